// Draws the cuts beside the window, in a thread, and only when what they show has changed. Private to libs/app/window;
// no OpenGL, no ImGui.
#pragma once
#include <array>
#include <chrono>
#include <future>
#include <memory>
#include <optional>
#include <vector>

#include "osteo/display/view/live_cut.h"

namespace osteo::inline app {

/// A structure's surface and the value it goes by; of planned regions kRegion and their number.
struct CutStructure {
  static constexpr int kRegion = 256;
  int value = 0;
  std::shared_ptr<const TriMesh> surface;
};

/// What the cuts show, but where they lie.
struct CutsScene {
  std::vector<LiveCut::Part> parts;
  double removed_mm3 = 0;  ///< tells that densities have changed
  HuWindow hu;
  bool tint_removed = true;
  friend bool operator==(const CutsScene&, const CutsScene&) = default;
};

/// One cut as it was drawn.
struct DrawnCut {
  int cut = 0;
  SliceView view;  ///< of the pixels: no finer than the voxels need, and at least as large as was asked for
  std::vector<std::uint32_t> rgba;
  struct Outline {
    int value = 0;
    std::vector<CutLine> lines;
  };
  std::vector<Outline> outlines;
};

class CutsDrawer {
 public:
  ~CutsDrawer();
  /// What never changes in a session. `ct` and `before` as LiveCut has them; owned. `least_mm_per_pixel`: pixels are no
  /// finer.
  void show(std::shared_ptr<const CtValues> ct, std::vector<std::shared_ptr<const GridSampler>> before,
            std::vector<CutStructure> structures, double least_mm_per_pixel);

  /// Takes what has been drawn since the last call, and begins to draw what `views` (none: not seen) and `scene` ask
  /// for, where that is something else, nothing is being drawn, and drawing has not just taken more than a third of a
  /// processor.
  [[nodiscard]] std::vector<DrawnCut> next(const std::array<std::optional<SliceView>, 3>& views,
                                           const CutsScene& scene);
  [[nodiscard]] bool busy() const { return drawing_.valid(); }
  /// Of a processor, for all cuts of the drawing that ended last; 0: none yet.
  [[nodiscard]] double last_ms() const { return last_ms_; }

 private:
  struct Done {
    std::vector<DrawnCut> cuts;
    double ms = 0;
  };
  [[nodiscard]] SliceView picture_of(const SliceView& view) const;

  std::shared_ptr<const CtValues> ct_;
  std::vector<std::shared_ptr<const GridSampler>> before_;
  std::vector<CutStructure> structures_;
  double least_mm_ = 0.1;
  std::array<std::optional<SliceView>, 3> asked_;
  CutsScene asked_scene_;
  std::future<Done> drawing_;
  std::chrono::steady_clock::time_point not_before_{};
  double last_ms_ = 0;
};

}  // namespace osteo::inline app
