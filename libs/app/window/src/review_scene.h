// A session that is over in the picture: the bone and the hands as of the time that is looked at, the places of a
// finding. Private to libs/app/window.
#pragma once
#include <array>
#include <memory>

#include <vtkSmartPointer.h>

#include "osteo/display/view/instrument_view.h"
#include "osteo/display/view/world_view.h"
#include "review_control.h"
#include "review_panel.h"
#include "scope_input.h"
#include "view_layout.h"
#include "window_state.h"

class vtkActor;
class vtkRenderer;

namespace osteo::inline app {

/// One turn of the window's loop: lay_out(), draw_findings() and key() in any order, then show().
class ReviewScene {
 public:
  ReviewScene();
  ~ReviewScene();
  void begin(const ReviewControl::Make& make) { control_.begin(make); }
  /// Another session begins, or the window closes: what was drawn of this one goes.
  void end();

  /// Takes the course's place from the lower edge of the picture, where it is shown.
  void lay_out(ViewLayout& layout, float em_pixels);
  /// Into the current window: the three that matter; all of them.
  void draw_findings();
  void draw_all_findings() { osteo::draw_all_findings(control_); }
  /// That the course is shown.
  void draw_switch();
  /// What was found would be done otherwise.
  [[nodiscard]] bool found_serious() const;
  /// A picture of a finding is due: the scene is drawn for it, and not shown. After it was drawn: taken from the middle
  /// of `area` of the frame buffer.
  [[nodiscard]] bool wants_picture() const { return due_.has_value(); }
  void take_picture(const PictureArea& area, int window_height);
  [[nodiscard]] bool key(const Keyboard::Press& press) { return control_.key(press); }
  /// `world` is replaced by a view of the session's own scene as soon as that is there.
  void show(vtkRenderer* renderer, std::unique_ptr<WorldView>& world,
            std::array<std::unique_ptr<InstrumentView>, kMaxHands>& hands, ScopeInput& scope, double seconds);
  void state(ViewState& state) const;

 private:
  void show_places(vtkRenderer* renderer, const std::vector<Vec3>& places_mm);
  void show_hands(std::array<std::unique_ptr<InstrumentView>, kMaxHands>& hands);

  void aim_at_next(ScopeInput& scope);

  ReviewControl control_;
  std::array<unsigned, kShownFindings> pictures_{};  // textures
  std::optional<std::size_t> due_;                   // which of them
  std::size_t taken_ = 0;                            // that were looked after
  std::optional<ScopeView> view_before_;
  ScreenBox course_;
  bool drawn_ = false;  // the world is the session's own
  double volume_mm3_ = 0;
  vtkRenderer* renderer_ = nullptr;
  vtkSmartPointer<vtkActor> places_;
};

}  // namespace osteo::inline app
