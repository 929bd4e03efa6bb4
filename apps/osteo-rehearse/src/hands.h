// What moves the hands of a rehearsal in the window, and its camera.
#pragma once
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "osteo/app/window/rehearsal_window.h"
#include "osteo/network/wire/tracked_hand.h"
#include "osteo/simulation/devices/devices.h"
#include "osteo/simulation/marker/device.h"
#include "window_flags.h"

namespace osteo {

// What moves the hands: as asked, or for the drill the best that is plugged in; with a pedal where there is one.
class Hands {
 public:
  explicit Hands(const WindowFlags& flags);
  /// What there is for the camera. `first`: the drill's device, where one runs.
  [[nodiscard]] CameraDevices camera(Device* first, bool lend) const;
  /// `start`: where the drill's hand waits. `near_mm`: where an arm's tool is when it is first heard of; its reach is
  /// small. The second hand waits beside the first, so that suction and water can begin at any time.
  [[nodiscard]] std::vector<std::unique_ptr<Device>> make(const HandGoal& start, Vec3 near_mm) const;
  [[nodiscard]] std::string name() const;

  /// `first`: the drill's device, where one runs.
  static void tune(Device* first, const HandTuning& tuning);
  /// Of the foot pedal, where there is one; without that of a second hand that has a device.
  [[nodiscard]] std::optional<std::uint32_t> switches(bool attended) const;

 private:
  // One camera for all sessions: it takes a second to open. What is wrong with the files is an error now; a camera that
  // is not there is waited for, and the window says so.
  void look_for_pen(const WindowFlags& flags);

  // Two devices of a kind: the first of them is the first hand's.
  [[nodiscard]] std::unique_ptr<Device> make_one(Hand kind, std::size_t number, const HandGoal& start,
                                                 Vec3 near_mm) const;

  Hand hand_, second_ = Hand::mouse;
  int found_ = 0;
  std::uint8_t second_tool_ = 0;
  WoodenHapticsGeometry geometry_;
  CameraModel camera_;
  CameraPlace camera_place_ = CameraPlace::facing;
  double hand_scale_ = 1;
  std::shared_ptr<PenLink> link_;
  std::shared_ptr<TrackedLink> tracker_;
  std::unique_ptr<FootPedal> pedal_;
  std::unique_ptr<CameraPuck> puck_;
};

}  // namespace osteo
