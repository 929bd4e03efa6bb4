// osteo rehearse: drilling, with a window or by a script.
#include <unistd.h>

#include <cmath>
#include <cstring>
#include <ostream>
#include <thread>

#include "audit_case.h"
#include "commands/rehearse.h"
#include "osteo/app/cli/report.h"
#include "osteo/assessment/evidence/procedure.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/json_document.h"
#include "osteo/core/base/shell.h"
#include "osteo/core/data/json_vec.h"
#include "osteo/display/view/world_view.h"
#include "osteo/imaging/io/surface_io.h"
#include "osteo/network/wire/rehearsal_stream.h"
#include "osteo/network/wire/tracked_hand.h"
#include "osteo/session/recording/haptic_settings.h"
#include "osteo/session/recording/script.h"
#include "osteo/session/scene/approval.h"
#include "osteo/session/scene/case.h"
#include "osteo/session/scene/rehearsal.h"
#include "osteo/session/scene/session_folder.h"
#include "osteo/simulation/bone/world_mesh.h"
#include "window_program.h"

namespace osteo {
namespace {

// The window is a program of its own, so that servers need neither GLFW nor a display.
int open_window(const RehearseCommand::Params& p, const cli::Invocation& io) {
  std::vector<std::string> args{window_program("osteo-rehearse", "use --headless")};
  args.insert(args.end(), io.arguments.begin(), io.arguments.end());
  WindowFlags flags = p, defaults;
  const auto usual = fields_of<WindowFlags>(defaults), given = fields_of<WindowFlags>(flags);
  add_changed_flags(args, given, usual, io);
  become(std::move(args), io);
}

}  // namespace

cli::CommandInfo RehearseCommand::info() {
  std::vector<cli::FlagGroup> groups = window_flag_groups({"headless", "script"});
  groups.push_back({"Without a window", {"seconds", "side", "fast", "fragments"}});
  groups.push_back({"Settings", {"show_settings"}});
  return {"rehearse",
          "drill the bone of a case, in a window or by script",
          "Opens the window: the bone beside three cuts, a drill moved by the mouse. With --headless a scripted hand "
          "drives the same "
          "servo, and the session, "
          "pictures from before and after, and a summary are written. Exit code 8 when ticks were not recorded, since "
          "the disk did not "
          "keep up, "
          "or actions of the script were rejected: the summary lists them. Dense bone resists the burr more, by the HU "
          "that the case keeps "
          "(\"hardness\": false in --settings turns that off).",
          {{"case", "a folder made by prepare; without one the window opens with a page to choose on", true}},
          "osteo rehearse CASE --headless --seconds 20 -o SESSION",
          false,
          std::move(groups)};
}

namespace {

// What would have no say is rejected, not ignored.
void refuse_what_is_ignored(const RehearseCommand::Params& p, const cli::Invocation& io) {
  const auto refuse = [&](std::string_view name, const std::string& beside, const std::string& advice) {
    if (!io.given.contains(std::string(name))) return;
    FieldRef field{{name, ""}, static_cast<bool*>(nullptr)};
    throw Error(ExitCode::usage, field.flag() + " has no effect " + beside, advice);
  };
  if (!p.script.empty()) {
    for (const char* const name : {"burr", "diameter_mm", "shape"})
      refuse(name, "beside --script: a script names its own burr",
             "change \"burr\" in '" + p.script + "', or leave the flag out");
    for (const char* const name : {"side", "seconds"})
      refuse(name, "beside --script", "it belongs to the built-in strokes; leave it out");
  }
  if (!p.headless) {
    for (const char* const name : {"script", "side", "seconds", "fast"})
      refuse(name, "in the window", "add --headless, or leave it out");
  } else {
    const bool tracked = p.device == Hand::igtl;
    if (tracked && p.fast)
      throw Error(ExitCode::usage, "--fast has no effect with --device igtl: a hand has its own time", "leave it out");
    if (!p.stream.empty() && p.fast)
      throw Error(ExitCode::usage, "--stream has no effect with --fast",
                  "leave --fast out, or 'osteo stream' the session afterwards");
    for (const char* const name :
         {"playback", "playback_as", "review", "tutor", "listen", "port", "two_way", "join", "code", "role", "arm",
          "camera", "pen", "video", "camera_place", "hand_scale", "second_device", "second_instrument"})
      refuse(name, "with --headless", "a script's hand moves the burr; leave it out");
    if (!tracked) refuse("device", "with --headless", "a script's hand moves the burr, or igtl; leave it out");
    for (const char* const name :
         {"quality", "width", "height", "scale", "layout", "full_screen", "end_page", "state_file", "scan", "sound",
          "volume", "alarms", "monitor", "stereo", "stereo_base", "experiment"})
      refuse(name, "with --headless", "there is no window; leave it out");
    if (p.stream.empty()) refuse("monitor_setup", "with --headless and without --stream", "leave it out");
  }
  if (p.procedure.empty()) refuse("mirror", "without --procedure", "add it, or leave it out");
  if (p.device == Hand::igtl && p.tracker.empty())
    throw Error(ExitCode::usage, "--device igtl needs --tracker", "HOST:PORT or HOST:PORT/NAME");
  if (p.device != Hand::igtl) refuse("tracker", "without --device igtl", "add it, or leave it out");
}

// A session without a window: a scripted hand, or one that is tracked, from the case to its summary.
class HeadlessSession {
 public:
  HeadlessSession(const RehearseCommand::Params& p, cli::Invocation& io) : p_(p), io_(io) {}
  int run(int tool) {
    open_case();
    World world = first_world();
    read_script(world, tool);
    begin_folder();
    set_options();
    std::vector<std::unique_ptr<Device>> devices = open_devices();
    const std::vector<StreamTarget> targets = stream_targets(p_.stream);
    rehearsal_ = std::make_unique<Rehearsal>(std::move(world), std::move(devices), options_, io_.context);
    if (!targets.empty()) open_stream(targets);
    draw("before.png");
    note_camera();
    drill();
    const std::string summary = end_session();
    report_what_failed();
    if (s_.interrupted) {  // closed all the same; what takes time is left out
      if (!io_.common.quiet)
        io_.err << "stopped after " << s_.ticks << " ticks; session: " << session_.folder.string()
                << "  (summary.json)\n";
      io_.context.check_cancelled();
    }
    write_pictures();
    if (!io_.common.quiet) report_result();
    if (io_.common.json) io_.out << summary;
    return static_cast<int>(s_.refused() || !s_.gaps.empty() ? ExitCode::partial : ExitCode::ok);
  }

 private:
  [[nodiscard]] bool tracked() const { return p_.device == Hand::igtl; }
  [[nodiscard]] std::string seconds_text(std::uint64_t ticks) const {
    return format_number(static_cast<double>(ticks) / p_.rate_hz);
  }

  void open_case() {
    case_ = load_case(io_.arguments[0]);
    approval_ = approval_of(case_.folder);
    if (p_.require_approved) require_approval(approval_, case_.folder);
    io_.context.progress(0, "loading");
    options_.haptics.params.contact.method = p_.contact;
    options_.haptics.device = SpringHand::traits();
    apply_haptic_settings(case_.folder, p_.settings, options_.haptics);
    if (!p_.procedure.empty()) options_.haptics.opened = load_procedure(p_.procedure).opened();
    options_.anatomy = anatomy_of(case_, options_.haptics, io_.context);
  }

  [[nodiscard]] World first_world() const {
    return p_.resume.empty()
               ? world_of(case_, options_.anatomy)
               : world_at_end(open_session_folder(p_.resume, case_.folder), case_, options_.anatomy, io_.context);
  }

  void read_script(const World& world, int tool) {
    script_ = p_.script.empty() ? make_default_script(world, p_.side == Side::left, tool, p_.seconds)
                                : load_script(p_.script, planned_cuts_of(case_.folder));
    doubts_ = warnings_about(script_, world, p_.dust, p_.position != Posture::supine || p_.head_turned_deg != 0);
    for (const std::string& d : doubts_) io_.context.warn(d);
  }

  void begin_folder() {
    session_ = create_session_folder(p_.out, case_.folder, p_.resume);
    // Before and after are seen from where the drill came, around the middle of its strokes.
    Vec3 site{};
    for (const auto& w : script_.waypoints) site += w.at_mm / static_cast<double>(script_.waypoints.size());
    const Vec3 eye = normalized(script_.axis + Vec3{0, -0.2, 0.15});
    const Script::Camera camera = script_.camera.value_or(Script::Camera{site, 32, eye});
    view_ = {camera.centre_mm, camera.radius_mm, camera.eye, 900, 700};
    write_file(session_.folder / "strokes.json", p_.script.empty() ? script_json(script_) : read_text(p_.script));
  }

  void set_options() {
    options_.rate_hz = p_.rate_hz;
    options_.session_file = session_.stream();
    options_.follow = {true, p_.pieces, p_.dust, p_.heat};
    options_.actions = first_actions(p_);
    for (SceneAction& a : actions_of(script_, p_.rate_hz)) options_.actions.push_back(a);
    options_.soft = soft_tissue_of(case_.folder);
    options_.haptics.more_devices.assign(script_.more_hands.size(), SpringHand::traits());
    options_.heard = [this](const std::string& kind, const std::string& json) {
      if (feed_ != nullptr) feed_->note(kind, json);
    };
  }

  [[nodiscard]] std::vector<std::unique_ptr<Device>> open_devices() {
    std::vector<std::unique_ptr<Device>> devices = devices_of(script_, p_.rate_hz);
    if (tracked()) {
      tracker_ = std::make_shared<TrackedLink>(tracker_address(p_.tracker));
      const HandGoal start{script_.waypoints.front().at_mm, to_floats(script_.axis), 0,
                           static_cast<std::uint8_t>(script_.tool)};
      devices.front() = std::make_unique<TrackedHand>(tracker_, start, nullptr);
    }
    return devices;
  }

  void open_stream(const std::vector<StreamTarget>& targets) {
    stream_ = std::make_unique<RehearsalStream>(*rehearsal_, targets, nullptr, monitor_options_of(p_.monitor_setup));
    feed_ = &stream_->feed();
    if (!io_.common.quiet) {
      for (const std::string& line : stream_->feed().reported()) io_.err << line << std::endl;
    }
    if (!stream_->invitation().empty()) io_.err << stream_->invitation() << std::endl;
  }

  void draw(const char* name) {
    rehearsal_->look([&](const World& w, SceneReaders& f) {
      save_picture(draw_world(w, f, rehearsal_->structures(), view_, rehearsal_->soft()), session_.folder / name);
    });
  }

  // A script that says from where it is looked at tells the session, as the window does.
  void note_camera() {
    if (!script_.camera) return;
    const Vec3 eye_mm = view_.centre_mm + view_.eye * (view_.radius_mm / 0.24);
    rehearsal_->note(
        "camera",
        Json{{"eye_mm", json_of(eye_mm)}, {"target_mm", json_of(view_.centre_mm)}, {"view_angle_deg", 30}}.dump());
  }

  void drill() {
    if (p_.fast) {
      s_ = rehearsal_->run_to_end(io_.context);
      return;
    }
    rehearsal_->start();
    // A script whose strokes nobody records is worth nothing: a full disk ends it at once.
    bool reported_behind = false, reported_lost = false;
    while (rehearsal_->running() && !rehearsal_->recording().failure) {
      const double t = static_cast<double>(rehearsal_->latest().tick) / p_.rate_hz;
      if (tracked() && t >= p_.seconds) break;
      try {
        io_.context.progress(0.1 + 0.8 * std::min(1.0, t / script_.seconds()), "drilling");
      } catch (const Error&) {
        break;
      }
      const std::string trouble = rehearsal_->trouble();
      if (!trouble.empty() &&
          !std::exchange(rehearsal_->recording().ticks_lost > 0 ? reported_lost : reported_behind, true))
        io_.context.warn(trouble);
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
    const bool interrupted = rehearsal_->running() && io_.context.cancelled();
    s_ = rehearsal_->stop();
    if (stream_) {
      stream_->feed().end();
      if (!io_.common.quiet) {
        for (const std::string& line : stream_->feed().reported()) io_.err << line << '\n';
      }
    }
    if (tracker_ && !io_.common.quiet)
      io_.err << "tracker: " << tracker_->poses() << " poses, " << tracker_->refused() << " rejected\n";
    s_.interrupted = interrupted;
  }

  // Writes its summary, before what takes time and may be interrupted or find the disk full.
  std::string end_session() {
    for (const std::string& w : s_.warnings) io_.context.warn(w);
    s_.warnings.insert(s_.warnings.begin(), doubts_.begin(), doubts_.end());
    std::string summary = write_summary(
        session_, s_, p_.rate_hz, instrument_library()[static_cast<std::size_t>(script_.tool)].name, options_.anatomy);
    io_.end_progress();
    return summary;
  }

  // Reported even when quiet: the exit code is about them.
  void report_what_failed() const {
    for (const ActionNote& n : s_.notes) {
      if (n.done && io_.common.quiet) continue;
      io_.err << (n.done ? "done otherwise" : "NOT DONE") << " at " << seconds_text(n.tick) << " s: " << name_of(n.kind)
              << ": " << n.why << (n.times > 1 ? " (" + std::to_string(n.times) + " times)" : "") << '\n';
    }
    for (const StructureCutEvent& e : s_.structure_cuts) {
      if (options_.anatomy.structures)
        io_.err << (e.cut.mm3 > 0 ? "INJURED at " : "at ") << seconds_text(e.tick)
                << " s: " << reported_cut(*options_.anatomy.structures, e.by, std::span(&e.cut, 1)) << '\n';
    }
    if (s_.unusable_poses > 0)
      io_.err << "the pose could not be used for " << seconds_text(s_.unusable_poses)
              << " s: not finite, or beyond all reach\n";
    if (!s_.gaps.empty())
      io_.err << "NOT RECORDED: " << s_.ticks_not_recorded << " ticks in " << s_.gaps.size()
              << " gaps, since the disk did not keep up; what bone became is recorded, and a replay repeats what comes "
                 "before the first\n";
  }

  void write_pictures() {
    draw("after.png");
    TriMesh after;
    rehearsal_->look([&](const World& w, SceneReaders&) { after = surface_of(w, io_.context); });
    save_surface(after, session_.folder / "surface.ply");
    io_.end_progress();
  }

  void report_result() {
    io_.err << "case: " << approval_.words() << '\n' << reported_hardness(options_.anatomy) << '\n';
    io_.err << "drilled " << s_.ticks << " ticks; removed " << format_number(std::round(s_.removed_mm3 * 10) / 10)
            << " mm3\n";
    for (const SoftTissue::Facts& f : s_.tissue)
      io_.err << "soft tissue '" << f.name << "': " << format_number(std::round(f.cut_off_mm3 * 10) / 10)
              << " mm3 cut off\n";
    rehearsal_->look([&](const World&, SceneReaders& readers) {
      if (!readers.heat) return;
      for (const std::string& line : reported(*readers.heat, rehearsal_->structures())) io_.err << line << '\n';
    });
    if (s_.ticks_not_followed > 0)
      io_.err << "surface, fragments and dust missed " << s_.ticks_not_followed
              << " ticks, since the machine did not keep up; they caught up from the bone itself\n";
    if (s_.loop) report_loop(*s_.loop);
    io_.err << "session: " << session_.folder.string()
            << "  (before.png, after.png, surface.ply, summary.json)\n  again: osteo replay "
            << shell_path(session_.folder) << '\n';
  }

  void report_loop(const LoopStats& l) const {
    io_.err << "servo: work p50 " << std::lround(l.work.quantile_us(0.5)) << " us, p99.9 "
            << std::lround(l.work.quantile_us(0.999)) << " us; wake-up late p99 "
            << std::lround(l.lateness.quantile_us(0.99)) << " us; periods missed by our work " << l.missed_by_work
            << ", by the machine " << l.missed_by_machine << "; real-time priority "
            << (l.realtime_granted ? "granted" : "not granted (" + l.realtime_refusal + ")") << '\n';
  }

  const RehearseCommand::Params& p_;
  cli::Invocation& io_;
  Case case_;
  ApprovalNow approval_;
  RehearsalOptions options_;
  Script script_;
  std::vector<std::string> doubts_;
  SessionFolder session_;
  WorldPicture view_;
  std::shared_ptr<TrackedLink> tracker_;  // null: no hand is tracked
  StreamFeed* feed_ = nullptr;            // set before the first note comes
  std::unique_ptr<Rehearsal> rehearsal_;
  std::unique_ptr<RehearsalStream> stream_;  // null: to nobody
  RehearsalSummary s_;
};

}  // namespace

int RehearseCommand::run(const Params& p, cli::Invocation& io) {
  if (!p.show_settings) refuse_what_is_ignored(p, io);
  const int tool = burr_index(p.burr, p.diameter_mm, p.shape);
  if (io.arguments.empty() && (p.show_settings || p.headless || !p.resume.empty() || !p.out.empty()))
    throw Error(ExitCode::usage, "osteo rehearse takes <case>",
                "only the window can be opened without: one is chosen there");
  if (p.show_settings) {
    HapticSetup setup;
    setup.params.contact.method = p.contact;
    apply_haptic_settings(io.arguments[0], p.settings, setup);
    io.out << haptic_settings_json(setup);
    return 0;
  }
  // Before it begins: the window becomes this process.
  if (!io.arguments.empty()) audit_case(AuditTrail(), AuditEvent::Kind::open, io.arguments[0], io.context);
  if (!p.headless) return open_window(p, io);
  return HeadlessSession(p, io).run(tool);
}

}  // namespace osteo
