// osteo-experiment: the window of force-skill training. 'osteo experiment force-skill' opens it.
#include <iostream>

#include "osteo/app/cli/command.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/param.h"
#include "osteo/core/rt/loop.h"
#include "osteo/simulation/devices/devices.h"
#include "run_screen.h"
#include "window_main.h"

namespace osteo {

enum class ExperimentDevice : int { mouse, keys, woodenhaptics, spacemouse };
[[nodiscard]] constexpr std::array<std::string_view, 4> enum_names(ExperimentDevice) {
  return {"mouse", "keys", "woodenhaptics", "spacemouse"};
}

namespace {

using namespace experiment;

// An arm without feeling: the path pulls it, mouse or keys say how hard it presses down.
class PressedArm final : public Device {
 public:
  explicit PressedArm(const PressedForce& pressed) : pressed_(pressed), arm_(params(), Vec3{}) {}
  DeviceSample read(std::uint64_t tick, double dt_s, Vec3 force_n) noexcept override {
    arm_.set_hand({0, -static_cast<double>(pressed_.n.load(std::memory_order_relaxed)), 0});
    return arm_.read(tick, dt_s, force_n);
  }
  [[nodiscard]] DeviceTraits traits() const override {
    DeviceTraits t = arm_.traits();
    t.damping_n_s_per_m += params().hand_damping_n_s_per_m;
    return t;
  }

 private:
  static SimulatedDeviceParams params() {
    SimulatedDeviceParams p;
    p.mass_kg = TaskGains{}.moving_mass_kg;
    p.damping_n_s_per_m = 2;
    p.hand_damping_n_s_per_m = 10;
    return p;
  }
  const PressedForce& pressed_;
  SimulatedDevice arm_;
};

bool is_space_mouse(const HidInfo& info) {
  const DeviceModel model = model_of(info.vendor, info.product);
  return model == DeviceModel::space_mouse || model == DeviceModel::space_mouse_wireless;
}

// x: to the right, y: up, z: towards the person.
std::unique_ptr<Device> open_device(ExperimentDevice kind, const PressedForce& pressed) {
  if (kind == ExperimentDevice::woodenhaptics) {
    const auto wanted = [](const HidInfo& i) { return model_of(i.vendor, i.product) == DeviceModel::woodenhaptics; };
    return std::make_unique<WoodenHapticsDevice>(
        open_first(wanted, 0), WoodenHapticsGeometry{},
        WorkspaceMap(Vec3{}, Mat3{{Vec3{0, 0, -1}, Vec3{-1, 0, 0}, Vec3{0, 1, 0}}}, 1), 0, nullptr);
  }
  if (kind == ExperimentDevice::spacemouse)
    return std::make_unique<SpaceMouseDevice>(open_first(is_space_mouse, 0), HandGoal{},
                                              Mat3{{Vec3{1, 0, 0}, Vec3{0, 0, -1}, Vec3{0, 1, 0}}}, nullptr);
  return std::make_unique<PressedArm>(pressed);
}

struct ExperimentWindowCommand {
  struct Params {
    std::string participant;
    ExperimentDevice device = ExperimentDevice::mouse;
    bool retention = false;
    int width = 1360, height = 860;
    std::string state_file;
  };
  static void describe(Params& p, auto& visit) {
    visit({"participant", "whose trials, by code"}, p.participant);
    visit(
        {"device", "what the hand holds; by mouse and keys the force is set on an axis, not felt, and the data say so"},
        p.device);
    visit({"retention", "retention test on another day: every stimulus once, without aid"}, p.retention);
    visit({"width", "width of the window", "px", 640, 7680}, p.width);
    visit({"height", "height of the window", "px", 480, 4320}, p.height);
    visit({"state_file", "writes here what it shows, for tests"}, p.state_file);
  }
  static cli::CommandInfo info() {
    return {"experiment",
            "force-skill training at the device",
            "What 'osteo experiment force-skill' opens. The space bar begins each run; Escape leaves, and the trial "
            "under way is done again "
            "the next time.",
            {{"folder", "of the experiment: with protocol.json"}},
            "osteo-experiment FOLDER --participant P01"};
  }

  static int run(const Params& p, cli::Invocation& io) {
    const std::filesystem::path folder = io.arguments[0];
    const Protocol protocol = read_protocol(folder);
    const std::size_t who = participant_number(protocol, p.participant);
    if (protocol.simulated)
      throw Error(ExitCode::usage, "this experiment's participants are programs", "give another folder for people");
    PressedForce pressed;
    const std::unique_ptr<Device> device = open_device(p.device, pressed);
    const bool by_hand = p.device == ExperimentDevice::mouse || p.device == ExperimentDevice::keys;
    const Mover mover = p.device == ExperimentDevice::mouse  ? Mover::mouse
                        : p.device == ExperimentDevice::keys ? Mover::keys
                                                             : Mover::device;
    ForceSkillController controller(
        folder, protocol, who, p.retention, mover,
        std::string(EnumNames<ExperimentDevice>::values[static_cast<std::size_t>(p.device)]), device->traits());
    Vec3 force;
    std::uint64_t tick = 0;
    const double dt = 1 / protocol.rate_hz;
    FixedRateLoop loop(protocol.rate_hz, [&](std::int64_t) {
      force = controller.step(device->read(tick++, dt, force));
      device->feel(force, {}, 0);
      return true;
    });
    loop.start();
    RunScreenOptions options;
    options.width = p.width;
    options.height = p.height;
    options.by_hand = by_hand;
    options.keys = p.device == ExperimentDevice::keys;
    options.state_file = p.state_file;
    int gl_errors = 0;
    try {
      gl_errors = run_experiment_window(controller, pressed, options, io.context);
    } catch (...) {
      loop.request_stop();
      loop.join();
      throw;
    }
    loop.request_stop();
    loop.join();
    if (const std::string trouble = device->trouble(); !trouble.empty() && !io.common.quiet) io.err << trouble << '\n';
    if (!io.common.quiet)
      io.err << p.participant << ": " << controller.done() << " of " << controller.trials() << " trials are done"
             << (controller.done() < controller.trials() ? "; the same command goes on there" : "") << '\n';
    require_no_gl_errors(gl_errors);
    return 0;
  }
};

}  // namespace
}  // namespace osteo

int main(int argc, char** argv) {
  return osteo::run_window_program<osteo::ExperimentWindowCommand>(
      argc, argv, "osteo-experiment: force-skill training at a haptic device",
      "Osteotome's own sources: Apache-2.0. This binary links what osteo-rehearse links, copyleft libraries too where "
      "that does: 'osteo --version' says which.\n"
      "Not a medical device: for rehearsal, teaching and research, not for treatment decisions.");
}
