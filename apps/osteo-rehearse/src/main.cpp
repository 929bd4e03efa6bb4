// The window of 'osteo rehearse', a program of its own.
#include <unistd.h>

#include <cstdlib>
#include <iostream>
#include <utility>

#include "osteo/base/error.h"
#include "osteo/base/files.h"
#include "osteo/bone/burr.h"
#include "osteo/bone/plates.h"
#include "osteo/cli/command.h"
#include "osteo/devices/devices.h"
#include "osteo/grid/grid_io.h"
#include "osteo/io/volume_io.h"
#include "osteo/marker/device.h"
#include "osteo/scene/approval.h"
#include "osteo/scene/free_ways.h"
#include "osteo/scene/session_folder.h"
#include "osteo/view/live_cut.h"
#include "osteo/window/rehearsal_window.h"
#include "window_flags.h"

namespace osteo {
namespace {

bool is_space_mouse(const HidInfo& info) {
  const DeviceModel m = model_of(info.vendor, info.product);
  return m == DeviceModel::space_mouse || m == DeviceModel::space_mouse_wireless;
}

// What moves the hands: as asked, or for the drill the best that is plugged in; with a pedal where there is one.
class Hands {
 public:
  explicit Hands(const WindowFlags& flags) : hand_(flags.device), dust_(flags.dust) {
    bool puck = false;
    for (const FoundDevice& f : find_devices()) {
      const bool mouse = f.model == DeviceModel::space_mouse || f.model == DeviceModel::space_mouse_wireless;
      puck = puck || (mouse && f.readable);
      if (hand_ == Hand::automatic && f.readable && (mouse || f.model == DeviceModel::woodenhaptics))
        found_ = std::max(found_, mouse ? 1 : 2);
      if (f.readable && (f.model == DeviceModel::pedal_infinity || f.model == DeviceModel::pedal_pcsensor))
        pedal_ = std::make_unique<FootPedal>(f.model,
                                             open_first([m = f.model](const HidInfo& i) { return model_of(i.vendor, i.product) == m; }));
    }
    if (hand_ == Hand::automatic) hand_ = found_ == 2 ? Hand::woodenhaptics : found_ == 1 ? Hand::spacemouse : Hand::mouse;
    second_ = flags.second_device == SecondHand::spacemouse      ? Hand::spacemouse
              : flags.second_device == SecondHand::woodenhaptics ? Hand::woodenhaptics
                                                                 : Hand::mouse;
    second_tool_ = static_cast<std::uint8_t>(instrument_index(flags.second_instrument));
    if (!flags.arm.empty()) geometry_ = load_woodenhaptics(flags.arm);
    if (hand_ == Hand::marker) look_for_pen(flags);
    // One that moves no hand moves the camera.
    if (puck && hand_ != Hand::spacemouse && second_ != Hand::spacemouse) puck_ = std::make_unique<CameraPuck>(open_first(is_space_mouse));
  }
  /// What there is for the camera. `first`: the drill's device, where one runs.
  [[nodiscard]] CameraDevices camera(Device* first, bool lend) const {
    CameraDevices devices;
    // The right switch, where it is no second hand's.
    devices.pedal = pedal_ && second_ == Hand::mouse && (pedal_->pressed() & pedal_bit(1)) != 0;
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
  /// `start`: where the drill's hand waits. `near_mm`: where an arm's tool is when it is first heard of; its reach is small. The second
  /// hand waits beside the first; moved by keys it is there for dust alone.
  [[nodiscard]] std::vector<std::unique_ptr<Device>> make(const HandGoal& start, Vec3 near_mm) const {
    std::vector<std::unique_ptr<Device>> all;
    all.push_back(make_one(hand_, 0, start, near_mm));
    if (second_ == Hand::mouse && !dust_) return all;
    HandGoal beside = start;
    const Vec3 off = any_perpendicular(from_floats(start.axis)) * 15;
    beside.position_mm += off;
    beside.tool = second_tool_;
    all.push_back(make_one(second_, 1, beside, near_mm + off));
    return all;
  }
  [[nodiscard]] std::string name() const {
    return std::string(EnumNames<Hand>::values[static_cast<std::size_t>(hand_)]) +
           (second_ != Hand::mouse ? ", " + std::string(EnumNames<Hand>::values[static_cast<std::size_t>(second_)]) : "") +
           (pedal_ && (hand_ != Hand::mouse || second_ != Hand::mouse) ? " and pedal" : "") + (puck_ ? "; camera: spacemouse" : "");
  }

  /// Keys and buttons of the window stand in for the pedal of a hand that has none of its own.
  void press(bool drill) const {
    if (const auto pen = pen_.lock()) pen->press(drill);
  }

 private:
  // One camera for all sessions: it takes a second to open. What is wrong with the files is an error now; a camera that is not there is
  // waited for, and the window says so.
  void look_for_pen(const WindowFlags& flags) {
    camera_ = load_camera(flags.camera);
    const Pen pen = flags.pen.empty() ? Pen{} : load_pen(flags.pen);
    camera_place_ = flags.camera_place;
    hand_scale_ = flags.hand_scale;
    link_ = std::make_shared<PenLink>([from = flags.video, c = camera_] { return open_pictures(from, c.width, c.height, c.fps); }, camera_,
                                      pen);
  }

  // Two devices of a kind: the first of them is the first hand's.
  [[nodiscard]] std::unique_ptr<Device> make_one(Hand kind, std::size_t number, const HandGoal& start, Vec3 near_mm) const {
    const int before = number > 0 && hand_ == kind ? 1 : 0;
    // The user looks at the patient's left side, as the window does: away from the user is to the right, right is to the back.
    if (kind == Hand::spacemouse) {
      return std::make_unique<SpaceMouseDevice>(open_first(is_space_mouse, before), start,
                                                Mat3{{Vec3{0, 1, 0}, Vec3{-1, 0, 0}, Vec3{0, 0, 1}}}, pedal_.get(), number);
    }
    if (kind == Hand::marker) {
      const Mat3 scene_from_desk{{Vec3{0, 1, 0}, Vec3{-1, 0, 0}, Vec3{0, 0, 1}}}, desk = desk_from_camera(camera_place_);
      const Mat3 scene_from_camera{{scene_from_desk * desk.column[0], scene_from_desk * desk.column[1], scene_from_desk * desk.column[2]}};
      auto device = std::make_unique<MarkerDevice>(link_, camera_, start, scene_from_camera, hand_scale_, pedal_.get(), number);
      pen_ = device->keys();
      return device;
    }
    if (kind == Hand::woodenhaptics) {
      const auto wanted = [](const HidInfo& i) { return model_of(i.vendor, i.product) == DeviceModel::woodenhaptics; };
      return std::make_unique<WoodenHapticsDevice>(open_first(wanted, before), geometry_,
                                                   WorkspaceMap(near_mm, Mat3{{Vec3{-1, 0, 0}, Vec3{0, -1, 0}, Vec3{0, 0, 1}}}, 1),
                                                   start.tool, pedal_.get(), number);
    }
    return std::make_unique<MouseDevice>(start);
  }

  Hand hand_, second_ = Hand::mouse;
  bool dust_;
  int found_ = 0;
  std::uint8_t second_tool_ = 0;
  WoodenHapticsGeometry geometry_;
  CameraModel camera_;
  CameraPlace camera_place_ = CameraPlace::facing;
  double hand_scale_ = 1;
  std::shared_ptr<PenLink> link_;
  mutable std::weak_ptr<HandKeys> pen_;
  std::unique_ptr<FootPedal> pedal_;
  std::unique_ptr<CameraPuck> puck_;
};

// In front of the bone on the patient's left, or where there is none, where a hand waits.
Vec3 near_the_bone(const World& world, const HandGoal& start) {
  try {
    return make_default_script(world, true, start.tool, 10).waypoints.front().at_mm;
  } catch (const Error&) {
    return start.position_mm;
  }
}

class Sitting;
// When the display goes away Xlib ends the program, by exit(): the session is closed first.
Sitting* g_sitting = nullptr;
void close_at_exit();

// One session after another on a case. Between them, and after whatever throws, none runs.
class Sitting {
 public:
  Sitting(const WindowFlags& flags, const Case& the_case, cli::Invocation& io)
      : case_(the_case),
        io_(io),
        hands_(flags),
        next_folder_(flags.out),
        last_(flags.resume),
        sound_(flags.sound, flags.volume, flags.alarms) {
    options_.rate_hz = flags.rate_hz;
    options_.follow = {true, true, flags.dust};
    options_.actions = first_actions(flags);
    options_.haptics.params.contact.method = flags.contact;
    apply_haptic_settings(case_.folder, flags.settings, options_.haptics);
  }

  HandGoal begin(bool from_case, const HandView& view) {
    sound_.follow(nullptr);
    rehearsal_.reset();
    if (!has_anatomy_) {  // the same for all sessions
      options_.anatomy = anatomy_of(case_, options_.haptics, io_.context);
      has_anatomy_ = true;
      if (!io_.common.quiet) io_.err << told_hardness(options_.anatomy) << std::endl;
    }
    SessionFolder session{next_folder_, case_.folder, from_case ? std::filesystem::path() : last_};
    World world = world_at_begin(session, case_, options_.anatomy, io_.context);
    const HandPose pose = FreeWays(world, skin_of_instrument(static_cast<std::size_t>(view.tool))).waiting(view.eye, view.axis);
    const HandGoal start{pose.at_mm, to_floats(pose.axis), 0, static_cast<std::uint8_t>(view.tool)};
    auto devices = hands_.make(start, near_the_bone(world, start));
    options_.haptics.device = devices.front()->traits();
    options_.haptics.more_devices.clear();
    for (std::size_t h = 1; h < devices.size(); ++h) options_.haptics.more_devices.push_back(devices[h]->traits());
    options_.soft = soft_body_of(case_.folder);
    // Last, so that what fails before leaves no folder.
    const SessionFolder before = session_;
    session_ = create_session_folder(next_folder_, session.case_folder, session.resumed_from);
    next_folder_.clear();
    options_.session_file = session_.stream();
    try {
      rehearsal_ = std::make_unique<Rehearsal>(std::move(world), std::move(devices), options_, io_.context);
      rehearsal_->start();
      sound_.follow(rehearsal_.get());
      if (sound_.on() && !sound_.failure().empty() && !io_.common.quiet && !told_silence_) {
        io_.err << sound_.failure() << "; --no-sound does not look for one" << std::endl;
        told_silence_ = true;
      }
      // Registered again: what the servo has made for itself by now must outlive it.
      static_cast<void>(plate_library());
      std::atexit(close_at_exit);
    } catch (...) {
      sound_.follow(nullptr);
      rehearsal_.reset();
      std::error_code ignored;  // nothing was recorded in it
      std::filesystem::remove_all(session_.folder, ignored);
      session_ = before;  // what is kept
      throw;
    }
    return start;
  }

  void save() {
    if (!rehearsal_) return;
    sound_.follow(nullptr);
    // Whatever comes of it, it is over; and what was recorded can be gone on from.
    const std::unique_ptr<Rehearsal> over = std::move(rehearsal_);
    last_ = session_.folder;
    const RehearsalSummary s = over->stop();
    write_summary(session_, s, options_.rate_hz, "window", options_.anatomy);
    for (const std::string& w : s.warnings) io_.context.warn(w);
    // Told even when quiet: the exit code is about it.
    if (!s.gaps.empty()) {
      lost_ticks_ = true;
      io_.err << "NOT RECORDED: " << s.ticks_not_recorded << " ticks in " << s.gaps.size()
              << " gaps, since the disk did not keep up; session: " << session_.folder.string() << std::endl;
    }
    if (!io_.common.quiet)
      io_.err << "session: " << session_.folder.string() << "  (" << s.ticks << " ticks, " << s.removed_mm3 << " mm3)" << std::endl;
  }

  [[nodiscard]] Rehearsal* rehearsal() const { return rehearsal_.get(); }
  [[nodiscard]] const std::filesystem::path& folder() const { return session_.folder; }
  [[nodiscard]] SoundOut& sound() { return sound_; }
  [[nodiscard]] std::string device() const { return hands_.name(); }
  [[nodiscard]] CameraDevices camera(bool lend) const { return hands_.camera(rehearsal_ ? &rehearsal_->device() : nullptr, lend); }
  void press(bool drill) const { hands_.press(drill); }
  /// Of any session so far, ticks were not recorded.
  [[nodiscard]] bool lost_ticks() const { return lost_ticks_; }

 private:
  const Case& case_;
  cli::Invocation& io_;
  const Hands hands_;
  std::filesystem::path next_folder_, last_;
  RehearsalOptions options_;
  SessionFolder session_;
  std::unique_ptr<Rehearsal> rehearsal_;
  SoundOut sound_;  // before the rehearsal it follows, it goes
  bool has_anatomy_ = false, lost_ticks_ = false, told_silence_ = false;
};

void close_at_exit() {
  if (g_sitting == nullptr) return;
  int code = static_cast<int>(ExitCode::cancelled);
  try {
    std::exchange(g_sitting, nullptr)->save();
    std::cerr << "osteo: the display is gone; the session is saved" << std::endl;
  } catch (const Error& e) {
    std::cerr << "osteo: the display is gone, and " << e.what() << std::endl;
    code = static_cast<int>(e.code());
  } catch (...) {
    code = static_cast<int>(ExitCode::unspecified);
  }
  ::_exit(code);
}

struct WindowCommand {
  using Params = WindowFlags;
  static void describe(Params& p, auto& visit) { WindowFlags::describe(p, visit); }
  static cli::CommandInfo info() {
    return {"rehearse",
            "drill the bone of a case in a window",
            "What 'osteo rehearse CASE' opens. Exit code 8 when ticks were not recorded, since the disk did not keep up.",
            {{"case", "a folder made by prepare"}},
            "osteo-rehearse CASE"};
  }

  static int run(const Params& p, cli::Invocation& io) {
    const Case the_case = load_case(io.arguments[0]);
    const ApprovalNow approval = approval_of(the_case.folder);
    if (p.require_approved) require_approval(approval, the_case.folder);
    if (!p.dust && (p.position != Posture::supine || p.head_turned_deg != 0))
      io.context.warn("how the patient lies moves dust and water alone, and there are none: add --dust");
    std::optional<SparseGrid> hu;
    if (const auto it = the_case.files.find("hu"); it != the_case.files.end()) hu = load_grid(it->second);
    WindowOptions window;
    if (!p.scan.empty()) {
      window.ct = load_image(p.scan, io.context);
      constexpr double kOwnHu = 60;
      if (!hu) {
        io.context.warn("this case keeps no CT values, so whether --scan is its scan could not be checked");
      } else if (!(difference_hu(*hu, *window.ct) < kOwnHu)) {
        throw Error(ExitCode::usage, "--scan is not the scan of this case, or does not lie where it lay",
                    "'osteo hand-over CASE FOLDER' writes the case's own as ct.nrrd");
      }
    }
    window.title = "Osteotome - " + the_case.folder.filename().string();
    window.tool = burr_index(p.burr, p.diameter_mm, p.shape);
    window.from_case = p.resume.empty();
    window.quality = p.quality;
    window.width = p.width;
    window.height = p.height;
    window.state_file = p.state_file;
    if (const auto it = the_case.files.find("region"); it != the_case.files.end()) window.bone.push_back(load_grid(it->second));
    window.bone.push_back(the_case.bone);
    window.stereo.mode = p.stereo;
    window.stereo.base_mm = p.stereo_base;
    if (!p.experiment.empty() && p.experiment != "camera")
      throw Error(ExitCode::usage, "--experiment: there is no '" + p.experiment + "'", "'camera' is the only one");
    window.camera_trial = p.experiment == "camera";
    window.approval = approval.words();
    window.approval_ended = approval.state == ApprovalState::outdated;
    if (const auto it = the_case.files.find("verdict"); it != the_case.files.end()) window.scan = read_verdict(read_text(it->second));
    Sitting sitting(p, the_case, io);
    window.device = sitting.device();
    io.end_progress();

    WindowActions actions;
    actions.begin = [&](bool from_case, const HandView& view) { return sitting.begin(from_case, view); };
    actions.save = [&] { sitting.save(); };
    actions.rehearsal = [&] { return sitting.rehearsal(); };
    actions.folder = [&] { return sitting.folder(); };
    actions.failure = [&] { return sitting.rehearsal()->recording().failure; };
    actions.camera = [&](bool lend) { return sitting.camera(lend); };
    actions.press = [&](bool drill) { sitting.press(drill); };
    actions.stop = [&] { return io.context.cancelled(); };
    g_sitting = &sitting;
    int gl_errors = 0;
    try {
      gl_errors = run_rehearsal_window(window, hu ? &*hu : nullptr, actions, sitting.sound());
    } catch (...) {
      g_sitting = nullptr;
      sitting.save();
      throw;
    }
    g_sitting = nullptr;
    sitting.save();
    if (io.context.cancelled()) throw Error(ExitCode::cancelled, "ended from outside; the session is saved");
    if (gl_errors > 0)
      throw Error(ExitCode::failed, std::to_string(gl_errors) + " OpenGL errors were seen; the session is saved",
                  "please report this with the name of the graphics card");
    return static_cast<int>(sitting.lost_ticks() ? ExitCode::partial : ExitCode::ok);
  }
};

}  // namespace
}  // namespace osteo

int main(int argc, char** argv) {
  osteo::cli::Program program;
  program.about = "osteo-rehearse: drill the bone of a case in a window";
  program.licence = "Osteotome's own sources: Apache-2.0. Not a medical device.";
  program.add<osteo::WindowCommand>();
  // The only command needs no name.
  std::vector<char*> args{argv[0]};
  static char name[] = "rehearse";
  const std::string_view first = argc > 1 ? argv[1] : "";
  if (first != "--version" && first != "help") args.push_back(name);
  args.insert(args.end(), argv + 1, argv + argc);
  return osteo::cli::run_program(program, static_cast<int>(args.size()), args.data(), std::cout, std::cerr);
}
