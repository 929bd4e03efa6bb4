// The window of 'osteo rehearse', a program of its own.
#include <unistd.h>

#include <cstdlib>
#include <iostream>
#include <mutex>
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
#include "osteo/window/start_page.h"
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
  Sitting(const WindowFlags& flags, const Case& the_case, const PersonValues& person, cli::Invocation& io)
      : case_(the_case),
        io_(io),
        hands_(flags),
        next_folder_(flags.out),
        last_(flags.resume),
        sound_(person.sound, person.volume, person.alarms) {
    options_.rate_hz = flags.rate_hz;
    options_.follow = {true, true, flags.dust};
    options_.actions = first_actions(flags);
    options_.haptics.params.contact.method = flags.contact;
    apply_haptic_settings(case_.folder, flags.settings, options_.haptics);
  }

  // Begun and saved in threads of their own; whoever ends the program meanwhile waits.
  HandGoal begin(bool from_case, const HandView& view) {
    const std::lock_guard lock(mutex_);
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
    const std::lock_guard lock(mutex_);
    if (!rehearsal_) return;
    sound_.follow(nullptr);
    // Whatever comes of it, it is over; and what was recorded can be gone on from.
    const std::unique_ptr<Rehearsal> over = std::move(rehearsal_);
    last_ = session_.folder;
    const RehearsalSummary s = over->stop();
    write_summary(session_, s, options_.rate_hz, "window", options_.anatomy);
    facts_ = facts_of(s);
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
  /// Of the session that was saved last.
  [[nodiscard]] const SessionFacts& facts() const { return facts_; }
  /// As the session that runs, or ran last, began with it.
  [[nodiscard]] World at_begin(const Context& context) const { return world_at_begin(session_, case_, options_.anatomy, context); }
  [[nodiscard]] const std::filesystem::path& folder() const { return session_.folder; }
  [[nodiscard]] SoundOut& sound() { return sound_; }
  [[nodiscard]] std::string device() const { return hands_.name(); }
  [[nodiscard]] CameraDevices camera(bool lend) const { return hands_.camera(rehearsal_ ? &rehearsal_->device() : nullptr, lend); }
  void press(bool drill) const { hands_.press(drill); }
  /// Of any session so far, ticks were not recorded.
  [[nodiscard]] bool lost_ticks() const { return lost_ticks_; }

 private:
  [[nodiscard]] SessionFacts facts_of(const RehearsalSummary& s) const {
    SessionFacts f;
    f.folder = session_.folder;
    f.rate_hz = options_.rate_hz;
    f.seconds = static_cast<double>(s.ticks) / options_.rate_hz;
    f.removed_mm3 = s.removed_mm3;
    f.sawn_mm3 = s.sawn_mm3;
    f.tissue_mm3 = s.tissue_mm3;
    f.bodies = s.bodies;
    for (const Fixture& p : s.fixtures) f.plates.push_back(std::to_string(p.id) + ": " + plate_library()[p.plate].name);
    const StructureMap* const map = options_.anatomy.structures.get();
    f.has_structures = map != nullptr;
    for (const auto& [value, e] : s.structures) {
      if (map == nullptr) break;
      f.structures.push_back({map->name_of(static_cast<std::uint8_t>(value)), e.least_clearance_mm,
                              static_cast<double>(e.ticks_touched) / options_.rate_hz,
                              static_cast<double>(e.ticks_injured) / options_.rate_hz});
    }
    f.warnings = s.warnings;
    if (!s.gaps.empty()) f.warnings.push_back("NOT RECORDED: " + std::to_string(s.ticks_not_recorded) + " ticks: the disk did not keep up");
    return f;
  }

  const Case& case_;
  cli::Invocation& io_;
  const Hands hands_;
  std::filesystem::path next_folder_, last_;
  RehearsalOptions options_;
  SessionFolder session_;
  SessionFacts facts_;
  std::mutex mutex_;
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

// A case with what the window shows of it. Read in a thread of its own.
struct OpenCase {
  Case files;
  std::optional<SparseGrid> hu;
  std::optional<Image> ct;       // the whole scan, where it was given
  std::vector<SparseGrid> bone;  // density, the finest first
  ApprovalNow approval;
  VerdictSummary scan;
  std::string hash;
};
std::unique_ptr<OpenCase> open_case(const fs::path& folder, const WindowFlags& flags, const Context& context) {
  auto open = std::make_unique<OpenCase>();
  open->files = load_case(folder);
  open->approval = approval_of(open->files.folder);
  if (flags.require_approved) require_approval(open->approval, open->files.folder);
  if (const auto it = open->files.files.find("hu"); it != open->files.files.end()) open->hu = load_grid(it->second);
  if (const auto it = open->files.files.find("verdict"); it != open->files.files.end()) open->scan = read_verdict(read_text(it->second));
  open->hash = hash_path(open->files.folder / "manifest.json");
  if (const auto it = open->files.files.find("region"); it != open->files.files.end()) open->bone.push_back(load_grid(it->second));
  open->bone.push_back(open->files.bone);
  if (!flags.scan.empty()) {
    open->ct = load_image(flags.scan, context);
    constexpr double kOwnHu = 60;
    if (!open->hu) {
      context.warn("this case keeps no CT values, so whether --scan is its scan could not be checked");
    } else if (!(difference_hu(*open->hu, *open->ct) < kOwnHu)) {
      throw Error(ExitCode::usage, "--scan is not the scan of this case, or does not lie where it lay",
                  "'osteo hand-over CASE FOLDER' writes the case's own as ct.nrrd");
    }
  }
  return open;
}

struct WindowCommand {
  using Params = WindowFlags;
  static void describe(Params& p, auto& visit) { WindowFlags::describe(p, visit); }
  static cli::CommandInfo info() {
    return {
        "rehearse",
        "drill the bone of a case in a window",
        "What 'osteo rehearse CASE' opens; without a case, a page to choose one on. Exit code 8 when ticks were not recorded, since the "
        "disk did not keep up.",
        {{"case", "a folder made by prepare", true}},
        "osteo-rehearse CASE"};
  }

  // What was given beats what the person chose last.
  static PersonValues chosen(const Params& p, const cli::Invocation& io, PersonValues values) {
    const auto given = [&](const char* name) { return io.given.contains(name); };
    if (given("sound")) values.sound = p.sound;
    if (given("volume")) values.volume = p.volume;
    if (given("alarms")) values.alarms = p.alarms;
    if (given("full_screen")) values.full_screen = p.full_screen;
    if (p.layout != StartLayout::last) values.layout = EnumNames<StartLayout>::values[static_cast<std::size_t>(p.layout)];
    return values;
  }
  // What was changed in the window since `before` is the person's choice from now on.
  static void keep(const PersonValues& before, const PersonValues& now, PersonValues& kept) {
    const auto take = [&](auto PersonValues::*field) {
      if (before.*field != now.*field) kept.*field = now.*field;
    };
    take(&PersonValues::scale);
    take(&PersonValues::layout);
    take(&PersonValues::full_screen);
    take(&PersonValues::sound);
    take(&PersonValues::volume);
    take(&PersonValues::alarms);
    take(&PersonValues::remember_cases);
    take(&PersonValues::first_steps);
  }

  // One case, from its first session to the last. `left`: how the person left it.
  static bool sit(const Params& p, const OpenCase& open, WindowShell& shell, PersonSettings& person, cli::Invocation& io, WindowEnd& left) {
    WindowOptions window;
    window.tool = burr_index(p.burr, p.diameter_mm, p.shape);
    window.from_case = p.resume.empty();
    window.state_file = p.state_file;
    window.end_page = p.end_page;
    window.case_hash = open.hash;
    window.approval = open.approval.words();
    window.approval_ended = open.approval.state == ApprovalState::outdated;
    window.scan = open.scan;
    window.quality = p.quality;
    window.ct = open.ct;
    window.bone = open.bone;
    window.stereo.mode = p.stereo;
    window.stereo.base_mm = p.stereo_base;
    window.camera_trial = p.experiment == "camera";
    shell.set_title("Osteotome - " + open.files.folder.filename().string());
    Sitting sitting(p, open.files, person.values, io);
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
    actions.facts = [&] { return sitting.facts(); };
    actions.world_at_begin = [&](const Context& context) { return sitting.at_begin(context); };
    g_sitting = &sitting;
    try {
      left = run_rehearsal_window(shell, person, window, open.hu ? &*open.hu : nullptr, actions, sitting.sound());
    } catch (...) {
      g_sitting = nullptr;
      sitting.save();
      throw;
    }
    g_sitting = nullptr;
    person.values.sound = sitting.sound().on();
    person.values.volume = sitting.sound().volume();
    person.values.alarms = sitting.sound().alarms();
    sitting.save();
    return sitting.lost_ticks();
  }

  static int run(const Params& p, cli::Invocation& io) {
    if (!p.experiment.empty() && p.experiment != "camera")
      throw Error(ExitCode::usage, "--experiment: there is no '" + p.experiment + "'", "'camera' is the only one");
    if (!p.dust && (p.position != Posture::supine || p.head_turned_deg != 0))
      io.context.warn("how the patient lies moves dust and water alone, and there are none: add --dust");
    PersonSettings person(PersonSettings::usual_file());
    for (const std::string& c : person.complaints()) io.context.warn(c);
    PersonValues kept = person.values;
    person.values = chosen(p, io, kept);
    const PersonValues before = person.values;
    const bool from_command_line = !io.arguments.empty();
    // What is no case at all is said without a window.
    if (from_command_line && !fs::exists(fs::path(io.arguments[0]) / "manifest.json")) static_cast<void>(load_case(io.arguments[0]));

    ShellOptions shown;
    shown.width = p.width;
    shown.height = p.height;
    shown.scale = p.scale;
    shown.by_hand = person.values.scale;
    shown.full_screen = person.values.full_screen;
    shown.two_buffers = p.stereo == StereoMode::quad_buffer;
    WindowShell shell(shown);
    bool lost_ticks = false, closed = false, sat = false;
    Params flags = p;
    StartOptions start;
    start.state_file = p.state_file;
    start.stop = [&] { return io.context.cancelled(); };
    std::optional<StartChoice> choice;
    if (from_command_line) choice = StartChoice{io.arguments[0], p.resume};
    bool chosen_in_window = !from_command_line;
    while (!closed && !io.context.cancelled()) {
      if (!choice) {
        choice = run_start_page(shell, person, start);
        if (!choice) break;
      }
      flags.resume = choice->resume;
      WindowEnd left;
      try {
        std::unique_ptr<OpenCase> open;
        shell.while_working("the case is opened", io.context,
                            [&](const Context& context) { open = open_case(choice->case_folder, p, context); });
        person.opened(open->files.folder);
        sat = true;
        lost_ticks = sit(flags, *open, shell, person, io, left) || lost_ticks;
        closed = !left.another;
        start.message.clear();
      } catch (const Error& e) {
        // One who chose on the page chooses there again.
        if (!chosen_in_window || e.code() == ExitCode::cancelled) throw;
        start.message = e.what() + (e.advice().empty() ? std::string() : "; " + e.advice());
        io.err << start.message << std::endl;
      }
      start.folder = fs::absolute(choice->case_folder).parent_path();
      choice.reset();
      if (left.dropped) choice = choice_of(*left.dropped, start.message);
      chosen_in_window = true;
      flags.out.clear();
    }
    person.values.scale = shell.by_hand();
    keep(before, person.values, kept);
    person.values = kept;
    if (const std::string not_kept = person.save(); !not_kept.empty()) io.context.warn(not_kept);
    if (io.context.cancelled()) throw Error(ExitCode::cancelled, sat ? "ended from outside; the session is saved" : "ended from outside");
    if (shell.gl_errors() > 0)
      throw Error(ExitCode::failed, std::to_string(shell.gl_errors()) + " OpenGL errors were seen; the session is saved",
                  "please report this with the name of the graphics card");
    return static_cast<int>(lost_ticks ? ExitCode::partial : ExitCode::ok);
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
