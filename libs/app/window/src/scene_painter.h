// Draws the scene of a window when it has changed, as well as there is time for. Private to libs/app/window.
#pragma once
#include <chrono>
#include <cstdint>
#include <functional>
#include <string>
#include <utility>

#include <vtkSmartPointer.h>

#include "osteo/display/view/quality.h"

class vtkGenericOpenGLRenderWindow;
class vtkRenderer;
struct ImDrawData;

namespace osteo::inline app {

/// Where in the window, in pixels from its lower left corner, the scene is shown.
struct SceneBox {
  int left = 0, bottom = 0, width = 1, height = 1;
};

/// In each turn of a window's loop: begin(), where it says so show(), panels on top, the swap, then done(); else
/// wait(). What is drawn of the scene stays with VTK's window and is shown again while only panels change.
class ScenePainter {
 public:
  /// Both must outlive this. VTK's window draws into its own frame and shows nothing by itself. With a renderer of
  /// make_layered_renderer() what lies still is not drawn again while the camera rests.
  ScenePainter(vtkGenericOpenGLRenderWindow* window, vtkRenderer* renderer);

  [[nodiscard]] QualityChoice& quality() { return quality_; }
  [[nodiscard]] const QualityChoice& quality() const { return quality_; }
  /// Whether fewer triangles may stand for the bone while the camera moves.
  [[nodiscard]] bool coarse() const { return quality_.level() != Quality::deep; }

  struct Turn {
    SceneBox box;
    int width = 1, height = 1;  ///< of the window
    bool settled = true;        ///< the scene is as it will be until something changes
    bool input = false;         ///< mouse or keys did something
    bool still = false;         ///< for a still picture: as at rest, at any price
    bool uncovered = false;     ///< the system has lost what was shown
    bool calm = false;          ///< nothing but events and what wait() asks can change what is shown
    std::uint64_t images = 0;   ///< another number when an image in the panels has changed
  };
  /// True: this turn has a picture to show. `panels` as ImGui is about to draw them.
  [[nodiscard]] bool begin(const Turn& turn, const ImDrawData* panels);
  /// Into the frame buffer of the window, which must be cleared.
  void show();
  /// After the swap.
  void done();
  /// Until an event comes, `stirs` says that something moves, or it is time to look again.
  void wait(const std::function<bool()>& stirs);
  /// Of the time since the last turn, what went by while nothing happened at all: no key was held then.
  [[nodiscard]] double take_slept_s() { return std::exchange(slept_s_, 0.0); }

  [[nodiscard]] std::uint64_t drawn() const { return drawn_; }  ///< pictures of the scene
  [[nodiscard]] double scale() const { return style_.scale; }   ///< of the last one
  /// Of the last one: parts that were not drawn again, as they lay still.
  [[nodiscard]] std::size_t kept() const { return layer_.kept(); }
  [[nodiscard]] bool at_rest() const { return drawn_ > 0 && motion_ == Motion::none; }
  /// For the panel: "picture 21 ms, at rest 180 ms: calm".
  [[nodiscard]] std::string words() const;

 private:
  using Clock = std::chrono::steady_clock;
  vtkGenericOpenGLRenderWindow* window_;
  vtkRenderer* renderer_;
  QualityChoice quality_;
  Turn turn_;
  PictureStyle style_;
  StillLayer layer_;
  Motion motion_ = Motion::all;
  bool draws_ = false;
  std::uint64_t seen_ = 0, view_ = 0, stamp_ = 0, panels_ = 0, drawn_ = 0;
  double slept_s_ = 0;
  // When the scene changed last, when the camera did, when anybody did anything, when anything was shown anew.
  Clock::time_point changed_at_{}, turned_at_{}, stirred_at_{}, shown_at_{}, began_{};
};

/// Another number when panels would look different. Pictures in them do not count.
[[nodiscard]] std::uint64_t panels_stamp(const ImDrawData* panels);

}  // namespace osteo::inline app
