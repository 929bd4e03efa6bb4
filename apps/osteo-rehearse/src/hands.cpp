#include "hands.h"

#include <algorithm>

#include "osteo/simulation/bone/burr.h"

namespace osteo {
namespace {

bool is_space_mouse(const HidInfo& info) {
  const DeviceModel m = model_of(info.vendor, info.product);
  return m == DeviceModel::space_mouse || m == DeviceModel::space_mouse_wireless;
}

}  // namespace

Hands::Hands(const WindowFlags& flags) : hand_(flags.device) {
  bool puck = false;
  for (const FoundDevice& f : find_devices()) {
    const bool mouse = f.model == DeviceModel::space_mouse || f.model == DeviceModel::space_mouse_wireless;
    puck = puck || (mouse && f.readable);
    if (hand_ == Hand::automatic && f.readable && (mouse || f.model == DeviceModel::woodenhaptics))
      found_ = std::max(found_, mouse ? 1 : 2);
    if (f.readable && (f.model == DeviceModel::pedal_infinity || f.model == DeviceModel::pedal_pcsensor))
      pedal_ = std::make_unique<FootPedal>(
          f.model, open_first([m = f.model](const HidInfo& i) { return model_of(i.vendor, i.product) == m; }));
  }
  if (hand_ == Hand::automatic)
    hand_ = found_ == 2 ? Hand::woodenhaptics : found_ == 1 ? Hand::spacemouse : Hand::mouse;
  second_ = flags.second_device == SecondDevice::spacemouse      ? Hand::spacemouse
            : flags.second_device == SecondDevice::woodenhaptics ? Hand::woodenhaptics
                                                                 : Hand::mouse;
  second_tool_ = static_cast<std::uint8_t>(instrument_index(flags.second_instrument));
  if (!flags.arm.empty()) geometry_ = load_woodenhaptics(flags.arm);
  if (hand_ == Hand::marker) look_for_pen(flags);
  if (hand_ == Hand::igtl) tracker_ = std::make_shared<TrackedLink>(tracker_address(flags.tracker));
  // One that moves no hand moves the camera.
  if (puck && hand_ != Hand::spacemouse && second_ != Hand::spacemouse)
    puck_ = std::make_unique<CameraPuck>(open_first(is_space_mouse));
}

CameraDevices Hands::camera(Device* first, bool lend) const {
  CameraDevices devices;
  DeviceMotion motion = puck_ ? puck_->motion() : DeviceMotion{};
  if (auto* const hand = dynamic_cast<LendsHand*>(first)) {
    hand->lend(lend);
    if (lend && !puck_) motion = hand->motion();
    if (lend && puck_) {
      const DeviceMotion own = hand->motion();
      motion.hand_mm = own.hand_mm;
      motion.axis = own.axis;
    }
  }
  devices.hand_mm = motion.hand_mm;
  devices.hand_axis = motion.axis;
  devices.push = motion.push;
  devices.turn = motion.turn;
  return devices;
}

std::vector<std::unique_ptr<Device>> Hands::make(const HandGoal& start, Vec3 near_mm) const {
  std::vector<std::unique_ptr<Device>> all;
  all.push_back(make_one(hand_, 0, start, near_mm));
  HandGoal beside = start;
  const Vec3 off = any_perpendicular(from_floats(start.axis)) * 15;
  beside.position_mm += off;
  beside.tool = second_tool_;
  all.push_back(make_one(second_, 1, beside, near_mm + off));
  return all;
}

std::string Hands::name() const {
  return std::string(EnumNames<Hand>::values[static_cast<std::size_t>(hand_)]) +
         (second_ != Hand::mouse ? ", " + std::string(EnumNames<Hand>::values[static_cast<std::size_t>(second_)])
                                 : "") +
         (pedal_ ? " and pedal" : "") + (puck_ ? "; camera: spacemouse" : "");
}

void Hands::tune(Device* first, const HandTuning& tuning) {
  if (auto* const hand = dynamic_cast<TunedHand*>(first)) hand->tune(tuning);
}

std::optional<std::uint32_t> Hands::switches(bool attended) const {
  if (!pedal_) return std::nullopt;
  pedal_->hold_back(!attended);
  const std::uint32_t seconds = second_ == Hand::mouse ? 0 : pedal_bit(1);
  return pedal_->pressed_since() & ~seconds;
}

void Hands::look_for_pen(const WindowFlags& flags) {
  camera_ = load_camera(flags.camera);
  const Pen pen = flags.pen.empty() ? Pen{} : load_pen(flags.pen);
  camera_place_ = flags.camera_place;
  hand_scale_ = flags.hand_scale;
  link_ = std::make_shared<PenLink>(
      [from = flags.video, c = camera_] { return open_pictures(from, c.width, c.height, c.fps); }, camera_, pen);
}

std::unique_ptr<Device> Hands::make_one(Hand kind, std::size_t number, const HandGoal& start, Vec3 near_mm) const {
  const int before = number > 0 && hand_ == kind ? 1 : 0;
  // The user looks at the patient's left side, as the window does: away from the user is to the right, right is to the
  // back.
  if (kind == Hand::spacemouse) {
    return std::make_unique<SpaceMouseDevice>(open_first(is_space_mouse, before), start,
                                              Mat3{{Vec3{0, 1, 0}, Vec3{-1, 0, 0}, Vec3{0, 0, 1}}}, pedal_.get(),
                                              number);
  }
  if (kind == Hand::marker) {
    const Mat3 scene_from_controller{{Vec3{0, 1, 0}, Vec3{-1, 0, 0}, Vec3{0, 0, 1}}},
        controller = controller_from_camera(camera_place_);
    const Mat3 scene_from_camera{{scene_from_controller * controller.column[0],
                                  scene_from_controller * controller.column[1],
                                  scene_from_controller * controller.column[2]}};
    return std::make_unique<MarkerDevice>(link_, camera_, start, scene_from_camera, hand_scale_, pedal_.get(), number);
  }
  if (kind == Hand::igtl) return std::make_unique<TrackedHand>(tracker_, start, pedal_.get(), number);
  if (kind == Hand::woodenhaptics) {
    const auto wanted = [](const HidInfo& i) { return model_of(i.vendor, i.product) == DeviceModel::woodenhaptics; };
    return std::make_unique<WoodenHapticsDevice>(
        open_first(wanted, before), geometry_,
        WorkspaceMap(near_mm, Mat3{{Vec3{-1, 0, 0}, Vec3{0, -1, 0}, Vec3{0, 0, 1}}}, 1), start.tool, pedal_.get(),
        number);
  }
  return std::make_unique<MouseDevice>(start);
}

}  // namespace osteo
