// osteo rehearse: drilling, with a window or by a script.
#include <unistd.h>

#include <cmath>
#include <cstring>
#include <ostream>
#include <thread>

#include "commands/rehearse.h"
#include "osteo/app/cli/report.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/json_document.h"
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
  groups.push_back({"Without a window", {"seconds", "side", "fast", "pieces"}});
  groups.push_back({"Settings", {"show_settings"}});
  return {"rehearse",
          "drill the bone of a case, in a window or by script",
          "Opens the window: the bone beside three cuts, a drill moved by the mouse. With --headless a scripted hand "
          "drives the same "
          "servo, and the session, "
          "pictures from before and after, and a summary are written. Exit code 8 when ticks were not recorded, since "
          "the disk did not "
          "keep up, "
          "or actions of the script were refused: the summary lists them. Dense bone resists the burr more, by the HU "
          "that the case keeps "
          "(\"hardness\": false in --settings turns that off).",
          {{"case", "a folder made by prepare; without one the window opens with a page to choose on", true}},
          "osteo rehearse CASE --headless --seconds 20 -o SESSION",
          false,
          std::move(groups)};
}

namespace {

// What would have no say is refused, not ignored.
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
  if (p.device == Hand::igtl && p.tracker.empty())
    throw Error(ExitCode::usage, "--device igtl needs --tracker", "HOST:PORT or HOST:PORT/NAME");
  if (p.device != Hand::igtl) refuse("tracker", "without --device igtl", "add it, or leave it out");
}

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
  if (!p.headless) return open_window(p, io);
  const Case the_case = load_case(io.arguments[0]);
  const ApprovalNow approval = approval_of(the_case.folder);
  if (p.require_approved) require_approval(approval, the_case.folder);
  io.context.progress(0, "loading");
  RehearsalOptions options;
  options.haptics.params.contact.method = p.contact;
  options.haptics.device = SpringHand::traits();
  apply_haptic_settings(the_case.folder, p.settings, options.haptics);
  options.anatomy = anatomy_of(the_case, options.haptics, io.context);
  World world = p.resume.empty() ? world_of(the_case, options.anatomy)
                                 : world_at_end(open_session_folder(p.resume, the_case.folder), the_case,
                                                options.anatomy, io.context);
  const Script script = p.script.empty() ? make_default_script(world, p.side == Side::left, tool, p.seconds)
                                         : load_script(p.script, planned_cuts_of(the_case.folder));
  const std::vector<std::string> doubts = doubts_about(script, world, p.dust);
  for (const std::string& d : doubts) io.context.warn(d);
  if (!p.dust && (p.position != Posture::supine || p.head_turned_deg != 0))
    io.context.warn("how the patient lies moves dust and water alone, and there are none: add --dust");
  const SessionFolder session = create_session_folder(p.out, the_case.folder, p.resume);
  const fs::path& folder = session.folder;

  // Before and after are seen from where the drill came, around the middle of its strokes.
  Vec3 site{};
  for (const auto& w : script.waypoints) site += w.at_mm / static_cast<double>(script.waypoints.size());
  const Vec3 eye = normalized(script.axis + Vec3{0, -0.2, 0.15});
  const Script::Camera camera = script.camera.value_or(Script::Camera{site, 32, eye});
  const WorldPicture view{camera.centre_mm, camera.radius_mm, camera.eye, 900, 700};
  write_file(folder / "strokes.json", p.script.empty() ? script_json(script) : read_text(p.script));

  options.rate_hz = p.rate_hz;
  options.session_file = session.stream();
  options.follow = {true, p.pieces, p.dust, p.heat};
  options.actions = first_actions(p);
  for (SceneAction& a : actions_of(script, p.rate_hz)) options.actions.push_back(a);
  options.soft = soft_tissue_of(the_case.folder);
  options.haptics.more_devices.assign(script.more_hands.size(), SpringHand::traits());
  const bool tracked = p.device == Hand::igtl;
  std::vector<std::unique_ptr<Device>> devices = devices_of(script, p.rate_hz);
  std::shared_ptr<TrackedLink> tracker;
  if (tracked) {
    tracker = std::make_shared<TrackedLink>(tracker_address(p.tracker));
    const HandGoal start{script.waypoints.front().at_mm, to_floats(script.axis), 0,
                         static_cast<std::uint8_t>(script.tool)};
    devices.front() = std::make_unique<TrackedHand>(tracker, start, nullptr);
  }
  const std::vector<StreamTarget> targets = stream_targets(p.stream);
  StreamFeed* feed = nullptr;  // set before the first note comes
  options.heard = [&](const std::string& kind, const std::string& json) {
    if (feed != nullptr) feed->note(kind, json);
  };
  Rehearsal rehearsal(std::move(world), std::move(devices), options, io.context);
  std::unique_ptr<RehearsalStream> stream;
  if (!targets.empty()) {
    stream = std::make_unique<RehearsalStream>(rehearsal, targets, nullptr, monitor_options_of(p.monitor_setup));
    feed = &stream->feed();
    if (!io.common.quiet) {
      for (const std::string& line : stream->feed().told()) io.err << line << std::endl;
    }
    if (!stream->invitation().empty()) io.err << stream->invitation() << std::endl;
  }
  const auto draw = [&](const char* name) {
    rehearsal.look([&](const World& w, SceneReaders& f) {
      save_picture(draw_world(w, f, rehearsal.structures(), view, rehearsal.soft()), folder / name);
    });
  };
  draw("before.png");
  // A script that says from where it is looked at tells the session, as the window does.
  if (script.camera) {
    const Vec3 eye_mm = view.centre_mm + view.eye * (view.radius_mm / 0.24);
    const auto triple = [](Vec3 v) { return Json{v.x, v.y, v.z}; };
    rehearsal.note(
        "camera",
        Json{{"eye_mm", triple(eye_mm)}, {"target_mm", triple(view.centre_mm)}, {"view_angle_deg", 30}}.dump());
  }
  RehearsalSummary s;
  if (p.fast) {
    s = rehearsal.run_to_end(io.context);
  } else {
    rehearsal.start();
    // A script whose strokes nobody records is worth nothing: a full disk ends it at once.
    bool told_behind = false, told_lost = false;
    while (rehearsal.running() && !rehearsal.recording().failure) {
      const double t = static_cast<double>(rehearsal.latest().tick) / p.rate_hz;
      if (tracked && t >= p.seconds) break;
      try {
        io.context.progress(0.1 + 0.8 * std::min(1.0, t / script.seconds()), "drilling");
      } catch (const Error&) {
        break;
      }
      const std::string trouble = rehearsal.trouble();
      if (!trouble.empty() && !std::exchange(rehearsal.recording().ticks_lost > 0 ? told_lost : told_behind, true))
        io.context.warn(trouble);
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
    const bool interrupted = rehearsal.running() && io.context.cancelled();
    s = rehearsal.stop();
    if (stream) {
      stream->feed().end();
      if (!io.common.quiet) {
        for (const std::string& line : stream->feed().told()) io.err << line << '\n';
      }
    }
    if (tracker && !io.common.quiet)
      io.err << "tracker: " << tracker->poses() << " poses, " << tracker->refused() << " refused\n";
    s.interrupted = interrupted;
  }
  for (const std::string& w : s.warnings) io.context.warn(w);
  s.warnings.insert(s.warnings.begin(), doubts.begin(), doubts.end());
  // Before what takes time and may be interrupted or find the disk full.
  const std::string summary = write_summary(
      session, s, p.rate_hz, instrument_library()[static_cast<std::size_t>(script.tool)].name, options.anatomy);
  io.end_progress();
  // Told even when quiet: the exit code is about them.
  for (const ActionNote& n : s.notes) {
    if (n.done && io.common.quiet) continue;
    io.err << (n.done ? "done otherwise" : "NOT DONE") << " at "
           << format_number(static_cast<double>(n.tick) / p.rate_hz) << " s: " << name_of(n.kind) << ": " << n.why
           << (n.times > 1 ? " (" + std::to_string(n.times) + " times)" : "") << '\n';
  }
  for (const StructureCutEvent& e : s.structure_cuts) {
    if (options.anatomy.structures)
      io.err << "INJURED at " << format_number(static_cast<double>(e.tick) / p.rate_hz) << " s: the saw cut through "
             << told_structures_cut(*options.anatomy.structures, std::span(&e.cut, 1)) << '\n';
  }
  if (s.unusable_poses > 0)
    io.err << "the pose could not be used for " << format_number(static_cast<double>(s.unusable_poses) / p.rate_hz)
           << " s: not finite, or beyond all reach\n";
  if (!s.gaps.empty())
    io.err << "NOT RECORDED: " << s.ticks_not_recorded << " ticks in " << s.gaps.size()
           << " gaps, since the disk did not keep up; what bone became is recorded, and a replay repeats what comes "
              "before the first\n";
  if (s.interrupted) {  // closed all the same; what takes time is left out
    if (!io.common.quiet)
      io.err << "stopped after " << s.ticks << " ticks; session: " << folder.string() << "  (summary.json)\n";
    io.context.check_cancelled();
  }
  TriMesh after;
  draw("after.png");
  rehearsal.look([&](const World& w, SceneReaders&) { after = surface_of(w, io.context); });
  save_surface(after, folder / "surface.ply");
  io.end_progress();
  if (!io.common.quiet) {
    io.err << "case: " << approval.words() << '\n' << told_hardness(options.anatomy) << '\n';
    io.err << "drilled " << s.ticks << " ticks; removed " << format_number(std::round(s.removed_mm3 * 10) / 10)
           << " mm3\n";
    for (const SoftTissue::Facts& f : s.tissue)
      io.err << "soft tissue '" << f.name << "': " << format_number(std::round(f.cut_off_mm3 * 10) / 10)
             << " mm3 cut off\n";
    rehearsal.look([&](const World&, SceneReaders& readers) {
      if (!readers.heat) return;
      for (const std::string& line : told(*readers.heat, rehearsal.structures())) io.err << line << '\n';
    });
    if (s.ticks_not_followed > 0)
      io.err << "surface, pieces and dust missed " << s.ticks_not_followed
             << " ticks, since the machine did not keep up; they caught up from the bone itself\n";
    if (s.loop) {
      const LoopStats& l = *s.loop;
      io.err << "servo: work p50 " << std::lround(l.work.quantile_us(0.5)) << " us, p99.9 "
             << std::lround(l.work.quantile_us(0.999)) << " us; wake-up late p99 "
             << std::lround(l.lateness.quantile_us(0.99)) << " us; periods missed by our work " << l.missed_by_work
             << ", by the machine " << l.missed_by_machine << "; real-time priority "
             << (l.realtime_granted ? "granted" : "refused (" + l.realtime_refusal + ")") << '\n';
    }
    io.err << "session: " << folder.string()
           << "  (before.png, after.png, surface.ply, summary.json)\n  again: osteo replay " << folder.string() << '\n';
  }
  if (io.common.json) io.out << summary;
  return static_cast<int>(s.refused() || !s.gaps.empty() ? ExitCode::partial : ExitCode::ok);
}

}  // namespace osteo
