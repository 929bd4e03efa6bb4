// A session that is over in the picture: the bone and the hands as of the time that is looked at, the places of a
// finding. Private to libs/app/window.
#pragma once
#include <array>
#include <memory>

#include <vtkSmartPointer.h>

#include "osteo/display/view/instrument_view.h"
#include "osteo/display/view/world_view.h"
#include "review_control.h"
#include "room_layout.h"
#include "scope_input.h"
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
  void lay_out(RoomLayout& room, float em_pixels);
  /// Into the current window.
  void draw_findings();
  [[nodiscard]] bool key(const Keyboard::Press& press) { return control_.key(press); }
  /// `world` is replaced by a view of the session's own scene as soon as that is there.
  void show(vtkRenderer* renderer, std::unique_ptr<WorldView>& world,
            std::array<std::unique_ptr<InstrumentView>, kMaxHands>& hands, ScopeInput& scope, double seconds);
  void state(RoomState& state) const;

 private:
  void show_places(vtkRenderer* renderer, const std::vector<Vec3>& places_mm);
  void show_hands(std::array<std::unique_ptr<InstrumentView>, kMaxHands>& hands);

  ReviewControl control_;
  ScreenBox course_;
  bool drawn_ = false;  // the world is the session's own
  double volume_mm3_ = 0;
  vtkRenderer* renderer_ = nullptr;
  vtkSmartPointer<vtkActor> places_;
};

}  // namespace osteo::inline app
