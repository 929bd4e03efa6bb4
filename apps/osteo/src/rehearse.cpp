// rehearse and replay: drilling without a window, and doing it again.
#include <unistd.h>

#include <cmath>
#include <cstring>
#include <ostream>
#include <set>
#include <thread>

#include "commands.h"
#include "osteo/base/error.h"
#include "osteo/base/files.h"
#include "osteo/base/json_document.h"
#include "osteo/bone/live_components.h"
#include "osteo/bone/world_mesh.h"
#include "osteo/cli/report.h"
#include "osteo/grid/grid_io.h"
#include "osteo/io/surface_io.h"
#include "osteo/scene/approval.h"
#include "osteo/scene/case.h"
#include "osteo/scene/plan.h"
#include "osteo/scene/rehearsal.h"
#include "osteo/scene/session_folder.h"
#include "osteo/scene/sound.h"
#include "osteo/session/export.h"
#include "osteo/session/haptic_settings.h"
#include "osteo/session/script_file.h"
#include "osteo/session/session_reader.h"
#include "osteo/view/world_view.h"

namespace osteo {
namespace {

// The window is a program of its own, so that servers need neither GLFW nor a display.
int open_window(const RehearseCommand::Params& p, const cli::Invocation& io) {
  const fs::path program = fs::read_symlink("/proc/self/exe").parent_path() / "osteo-rehearse";
  if (!fs::exists(program))
    throw Error(ExitCode::failed, "this build has no window (osteo-rehearse is missing)",
                "build with -DOSTEO_WINDOW=ON, or use --headless");
  std::vector<std::string> args{program.string()};
  args.insert(args.end(), io.arguments.begin(), io.arguments.end());
  WindowFlags flags = p, defaults;
  const auto usual = fields_of<WindowFlags>(defaults), given = fields_of<WindowFlags>(flags);
  for (std::size_t i = 0; i < given.size(); ++i) {
    if (given[i].to_text() != usual[i].to_text() || io.given.contains(std::string(given[i].doc.name)))
      args.push_back(given[i].flag() + "=" + given[i].to_text());
  }
  if (io.common.quiet) args.emplace_back("--quiet");
  std::vector<char*> argv;
  for (auto& a : args) argv.push_back(a.data());
  argv.push_back(nullptr);
  ::execv(program.c_str(), argv.data());
  throw Error(ExitCode::failed, "cannot start '" + program.string() + "': " + std::strerror(errno));
}

}  // namespace

cli::CommandInfo RehearseCommand::info() {
  return {"rehearse",
          "drill the bone of a case, in a window or by script",
          "Opens the window: the bone beside three cuts, a drill moved by the mouse. With --headless a scripted hand drives the same "
          "servo, and the session, "
          "pictures from before and after, and a summary are written. Exit code 8 when ticks were not recorded, since the disk did not "
          "keep up, "
          "or actions of the script were refused: the summary lists them. Dense bone resists the burr more, by the HU that the case keeps "
          "(\"hardness\": false in --settings turns that off).",
          {{"case", "a folder made by prepare; without one the window opens with a page to choose on", true}},
          "osteo rehearse CASE --headless --seconds 20 -o SESSION"};
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
      refuse(name, "beside --script: a script names its own burr", "change \"burr\" in '" + p.script + "', or leave the flag out");
    for (const char* const name : {"side", "seconds"}) refuse(name, "beside --script", "it belongs to the built-in strokes; leave it out");
  }
  if (!p.headless) {
    for (const char* const name : {"script", "side", "seconds", "fast"}) refuse(name, "in the window", "add --headless, or leave it out");
  } else {
    for (const char* const name :
         {"device", "arm", "camera", "pen", "video", "camera_place", "hand_scale", "second_device", "second_instrument"})
      refuse(name, "with --headless", "a script's hand moves the burr; leave it out");
    for (const char* const name : {"quality", "width", "height", "scale", "layout", "full_screen", "end_page", "state_file", "scan",
                                   "sound", "volume", "alarms", "stereo", "stereo_base", "experiment"})
      refuse(name, "with --headless", "there is no window; leave it out");
  }
}

}  // namespace

int RehearseCommand::run(const Params& p, cli::Invocation& io) {
  if (!p.show_settings) refuse_what_is_ignored(p, io);
  const int tool = burr_index(p.burr, p.diameter_mm, p.shape);
  if (io.arguments.empty() && (p.show_settings || p.headless || !p.resume.empty() || !p.out.empty()))
    throw Error(ExitCode::usage, "osteo rehearse takes <case>", "only the window can be opened without: one is chosen there");
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
                                 : world_at_end(open_session_folder(p.resume, the_case.folder), the_case, options.anatomy, io.context);
  const Script script = p.script.empty() ? make_default_script(world, p.side == Side::left, tool, p.seconds) : load_script(p.script);
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
  options.follow = {true, p.pieces, p.dust};
  options.actions = first_actions(p);
  for (SceneAction& a : actions_of(script, p.rate_hz)) options.actions.push_back(a);
  options.soft = soft_body_of(the_case.folder);
  options.haptics.more_devices.assign(script.more_hands.size(), SpringHand::traits());
  Rehearsal rehearsal(std::move(world), devices_of(script, p.rate_hz), options, io.context);
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
    rehearsal.note("camera", Json{{"eye_mm", triple(eye_mm)}, {"target_mm", triple(view.centre_mm)}, {"view_angle_deg", 30}}.dump());
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
    s.interrupted = interrupted;
  }
  for (const std::string& w : s.warnings) io.context.warn(w);
  s.warnings.insert(s.warnings.begin(), doubts.begin(), doubts.end());
  // Before what takes time and may be interrupted or find the disk full.
  const std::string summary =
      write_summary(session, s, p.rate_hz, instrument_library()[static_cast<std::size_t>(script.tool)].name, options.anatomy);
  io.end_progress();
  // Told even when quiet: the exit code is about them.
  for (const ActionNote& n : s.notes) {
    if (n.done && io.common.quiet) continue;
    io.err << (n.done ? "done otherwise" : "NOT DONE") << " at " << format_number(static_cast<double>(n.tick) / p.rate_hz)
           << " s: " << name_of(n.kind) << ": " << n.why << (n.times > 1 ? " (" + std::to_string(n.times) + " times)" : "") << '\n';
  }
  if (s.unusable_poses > 0)
    io.err << "the pose could not be used for " << format_number(static_cast<double>(s.unusable_poses) / p.rate_hz)
           << " s: not finite, or beyond all reach\n";
  if (!s.gaps.empty())
    io.err << "NOT RECORDED: " << s.ticks_not_recorded << " ticks in " << s.gaps.size()
           << " gaps, since the disk did not keep up; what bone became is recorded, and a replay repeats what comes before the first\n";
  if (s.interrupted) {  // closed all the same; what takes time is left out
    if (!io.common.quiet) io.err << "stopped after " << s.ticks << " ticks; session: " << folder.string() << "  (summary.json)\n";
    io.context.check_cancelled();
  }
  TriMesh after;
  draw("after.png");
  rehearsal.look([&](const World& w, SceneReaders&) { after = surface_of(w, io.context); });
  save_surface(after, folder / "surface.ply");
  io.end_progress();
  if (!io.common.quiet) {
    io.err << "case: " << approval.words() << '\n' << told_hardness(options.anatomy) << '\n';
    io.err << "drilled " << s.ticks << " ticks; removed " << format_number(std::round(s.removed_mm3 * 10) / 10) << " mm3\n";
    if (s.ticks_not_followed > 0)
      io.err << "surface, pieces and dust missed " << s.ticks_not_followed
             << " ticks, since the machine did not keep up; they caught up from the bone itself\n";
    if (s.loop) {
      const LoopStats& l = *s.loop;
      io.err << "servo: work p50 " << std::lround(l.work.quantile_us(0.5)) << " us, p99.9 " << std::lround(l.work.quantile_us(0.999))
             << " us; wake-up late p99 " << std::lround(l.lateness.quantile_us(0.99)) << " us; periods missed by our work "
             << l.missed_by_work << ", by the machine " << l.missed_by_machine << "; real-time priority "
             << (l.realtime_granted ? "granted" : "refused (" + l.realtime_refusal + ")") << '\n';
    }
    io.err << "session: " << folder.string() << "  (before.png, after.png, surface.ply, summary.json)\n  again: osteo replay "
           << folder.string() << '\n';
  }
  if (io.common.json) io.out << summary;
  return static_cast<int>(s.refused() || !s.gaps.empty() ? ExitCode::partial : ExitCode::ok);
}

cli::CommandInfo ReplayCommand::info() {
  return {
      "replay",
      "run a session again and prove that it comes out the same",
      "Feeds the recorded poses to the same servo on the case's bone and compares every tick, the bone and the surface bit for bit; "
      "also applies the recorded "
      "voxel changes and compares that. Exit code 7 when anything differs, 8 when ticks were not recorded (what comes before is repeated, "
      "the rest taken from the recorded changes), 4 when the file is damaged.",
      {{"session", "a session folder"}},
      "osteo replay SESSION"};
}

int ReplayCommand::run(const Params& p, cli::Invocation& io) {
  const SessionFolder folder = open_session_folder(io.arguments[0], p.case_folder);
  const SessionReader session(folder.stream(), Damage::keep);
  const SessionOutline& outline = session.outline();
  const Case the_case = load_case(folder.case_folder);
  HapticSetup setup = outline.header.haptics;
  const Anatomy anatomy = anatomy_of(the_case, setup, io.context);
  const ReplayResult r = replay(session, world_at_begin(folder, the_case, anatomy, io.context), anatomy, io.context);
  if (!p.surface_out.empty()) {
    if (fs::exists(p.surface_out) && !io.common.force)
      throw Error(ExitCode::cannot_write, "'" + p.surface_out + "' exists already", "--force replaces it");
    save_surface(surface_of(*r.world, io.context), p.surface_out);
  }
  if (!p.bone_out.empty()) {
    if (fs::exists(p.bone_out) && !io.common.force)
      throw Error(ExitCode::cannot_write, "'" + p.bone_out + "' exists already", "--force replaces it");
    save_grid(to_sparse(r.world->bodies().front().body->bone, "density"), p.bone_out);
  }
  io.end_progress();
  Json j{{"ticks", r.ticks},         {"ticks_repeated", r.ticks_repeated},
         {"actions", r.actions},     {"identical", r.identical},
         {"complete", r.complete},   {"losses", r.losses},
         {"bone_hash", r.bone_hash}, {"surface_hash", r.surface_hash},
         {"dust_hash", r.dust_hash}, {"removed_mm3", r.removed_mm3},
         {"seconds", r.seconds}};
  if (anatomy.structures) j["structures"] = Json::parse(structures_json(r.structures, *anatomy.structures, outline.header.rate_hz)).value();
  if (!folder.approval.empty()) j["approval"] = folder.approval;
  if (!r.difference.empty()) j["difference"] = r.difference;
  if (r.difference_since_s) j["same_until_s"] = *r.difference_since_s;
  if (io.common.json) io.out << j.dump(2) << '\n';
  // Losses are told even when quiet: they are no talk.
  for (const std::string& line : r.losses) io.err << "session: " << line << '\n';
  for (const std::string& line : outline.newer) io.err << "session: of a later version, left out: " << line << '\n';
  if (!folder.approval.empty() && !io.common.quiet) io.err << "case, when it was recorded: " << folder.approval << '\n';
  const bool whole = outline.gaps.empty();
  if (!whole) {
    io.err << "only the first " << r.ticks_repeated << " of " << r.ticks << " ticks could be run again; "
           << (outline.bone_known_until() ? "bone behind the first loss is not known" : "behind them the recorded changes give the bone")
           << '\n';
  }
  if (!io.common.quiet) {
    io.err << "replayed " << r.ticks_repeated << " ticks and " << r.actions << " actions in "
           << format_number(std::round(r.seconds * 100) / 100)
           << " s: " << (r.identical ? "bit for bit the same" : "DIFFERENT, " + r.difference)
           << (r.complete ? "" : " (the session was cut short: its end is not recorded)") << '\n'
           << "bone " << r.bone_hash << "  surface " << r.surface_hash << '\n';
  }
  if (outline.damaged()) return static_cast<int>(ExitCode::corrupt);
  if (!r.identical) return static_cast<int>(ExitCode::failed);
  return whole ? 0 : static_cast<int>(ExitCode::partial);
}

cli::CommandInfo ExportCommand::info() {
  return {
      "export",
      "a session for other programs: CSV, HDF5 or MCAP",
      "By the ending: .csv for spreadsheets (actions and notes in files of their own, out-actions.csv and out-notes.csv), .h5 for MATLAB, "
      "Python and R (columns under /ticks, /actions, /gaps, /notes), .mcap for Foxglove and ROS tools. One row a tick: pose, force, "
      "torque, removal, flags, how late the machine was; notes are where the camera was, marks, choices. Of a damaged session all that is "
      "whole is written, and the exit code is 4.",
      {{"session", "a session folder"}, {"output", "file that ends in .csv, .h5 or .mcap"}},
      "osteo export SESSION ticks.csv"};
}

int ExportCommand::run(const Params&, cli::Invocation& io) {
  const SessionFolder folder = open_session_folder(io.arguments[0]);
  const SessionReader session(folder.stream(), Damage::keep);
  const SessionOutline& outline = session.outline();
  const fs::path out = io.arguments[1];
  for (const fs::path& file : export_files(out)) {
    if (fs::exists(file) && !io.common.force)
      throw Error(ExitCode::cannot_write, "'" + file.string() + "' exists already", "--force replaces it");
  }
  export_session(session, out, io.context);
  io.end_progress();
  for (const std::string& line : losses(outline)) io.err << "session: " << line << '\n';
  for (const std::string& line : outline.newer) io.err << "session: of a later version, left out: " << line << '\n';
  if (!io.common.quiet) {
    io.err << outline.tick_records << " ticks written to";
    for (const fs::path& file : export_files(out)) io.err << ' ' << file.string();
    io.err << (outline.end ? "" : " (the session was cut short)") << '\n';
  }
  return outline.damaged() ? static_cast<int>(ExitCode::corrupt) : 0;
}

cli::CommandInfo SoundCommand::info() {
  return {
      "sound",
      "what a session sounded like, as a WAV file",
      "Burrs by their rotation, teeth, size, force and the bone under them; suckers, water, plates on bone. A model by published levels "
      "and "
      "spectra, designed by ear where there are none (docs/sound.md), not a recording. 48 kHz, 16 bits, one channel. The bone over sinus, "
      "dura and vessels sounds duller where the case names its structures. Of a damaged session what is missing is silent, and the exit "
      "code is 4.",
      {{"session", "a session folder"}, {"output", "file that ends in .wav"}},
      "osteo sound SESSION out.wav"};
}

int SoundCommand::run(const Params& p, cli::Invocation& io) {
  const fs::path out = io.arguments[1];
  if (out.extension() != ".wav") throw Error(ExitCode::usage, "'" + out.string() + "' does not end in .wav", "name the output NAME.wav");
  if (fs::exists(out) && !io.common.force)
    throw Error(ExitCode::cannot_write, "'" + out.string() + "' exists already", "--force replaces it");
  const SessionFolder folder = open_session_folder(io.arguments[0], p.case_folder);
  const SessionReader session(folder.stream(), Damage::keep);
  std::set<std::uint32_t> soft;
  if (!session.header().haptics.structures.empty()) {
    HapticSetup setup;
    setup.hardness = false;
    const Anatomy anatomy = anatomy_of(load_case(folder.case_folder), setup, io.context);
    if (setup.structures == session.header().haptics.structures) {
      soft = soft_structures(anatomy.structures->structures());
    } else {
      io.context.warn("the case's structures are not those that the session watched: bone over them does not sound duller");
    }
  }
  const SoundFileFacts facts = write_session_sound(session, soft, p.volume, p.alarms, out, io.context);
  io.end_progress();
  const auto rounded = [](double x) { return format_number(std::round(x * 10) / 10); };
  if (io.common.json) {
    Json j{
        {"seconds", facts.seconds}, {"loudest_db", facts.loudest_db}, {"most_held_down_db", facts.most_held_down_db}, {"gaps", facts.gaps}};
    io.out << j.dump(2) << '\n';
  }
  for (const std::string& line : losses(session.outline())) io.err << "session: " << line << '\n';
  if (!io.common.quiet) {
    io.err << rounded(facts.seconds) << " s of sound: " << out.string() << ", loudest sample " << rounded(facts.loudest_db)
           << " dB of full scale";
    if (facts.most_held_down_db < -0.05)
      io.err << ", held down by up to " << rounded(-facts.most_held_down_db) << " dB where it was loud for long";
    io.err << '\n';
  }
  return session.outline().damaged() ? static_cast<int>(ExitCode::corrupt) : 0;
}

cli::CommandInfo PlanCommand::info() {
  return {
      "plan",
      "where a session left pieces and plates: transforms, STL, gaps between plate and bone",
      "Writes plan.json, an STL of each piece and plate where it is, and for each plate how far bone lies below its underside; a picture "
      "too. With --at-s as it was at that time.",
      {{"session", "a session folder"}},
      "osteo plan SESSION -o plan"};
}

int PlanCommand::run(const Params& p, cli::Invocation& io) {
  const SessionFolder session = open_session_folder(io.arguments[0], p.case_folder);
  const Case the_case = load_case(session.case_folder);
  const World world = p.at_s < 0 ? world_at_end(session, the_case, {}, io.context) : world_at(session, p.at_s, the_case, {}, io.context);
  const fs::path folder = p.out.empty() ? session.folder / "plan" : fs::path(p.out);
  SceneReaders readers(world, {}, 1000, io.context);
  Vec3 lo{1e9, 1e9, 1e9}, hi = lo * -1;
  for (const auto& q : surface_of(world, io.context).points_mm) {
    for (std::size_t a = 0; a < 3; ++a) {
      lo[a] = std::min(lo[a], static_cast<double>(q[a]));
      hi[a] = std::max(hi[a], static_cast<double>(q[a]));
    }
  }
  const WorldPicture view{(lo + hi) * 0.5, 0.36 * length(hi - lo), normalized({0.8, -0.6, 0.2}), 1100, 850};
  const auto picture = draw_world(world, readers, nullptr, view);
  std::string text;
  write_folder_atomically(folder, {}, [&](const fs::path& whole) {
    text = write_plan(world, whole, io.context);
    save_picture(picture, whole / "plan.png");
  });
  io.end_progress();
  if (io.common.json) io.out << text;
  if (!io.common.quiet)
    io.err << world.bodies().size() << (world.bodies().size() == 1 ? " piece and " : " pieces and ") << world.fixtures().size()
           << (world.fixtures().size() == 1 ? " plate: " : " plates: ") << folder.string() << '\n';
  return 0;
}

cli::CommandInfo SceneCommand::info() {
  return {"scene",
          "what a rehearsal of a case will build, and what each part costs",
          "Memory and time to make of every part that the case and the settings list, and the time of a tick while drilling. What is not "
          "listed is not "
          "built and costs nothing.",
          {{"case", "a folder made by prepare"}},
          "osteo scene CASE"};
}

namespace {

double rounded(double value, double steps_per_unit) {
  return std::round(value * steps_per_unit) / steps_per_unit;
}

// Builds the parts of a scene one after the other, and notes what each costs.
class SceneCosts {
 public:
  SceneCosts(const Case& the_case, const SceneCommand::Params& params, const Context& context)
      : case_(the_case), params_(params), context_(context) {
    j_["parts"] = Json::list();
  }

  void build() {
    build_bone();
    setup_.device = SpringHand::traits();
    setup_.params.contact.method = params_.contact;
    apply_haptic_settings(case_.folder, params_.settings, setup_);
    build_anatomy();
    build_what_follows();
    build_tissue();
    build_renderer();
    find_burrs_too_small();
    drill();
    j_["threads"] = {"servo (real time)", "recorder", "follower (surface, pieces)", "window"};
    j_["memory_mb"] = rounded(megabytes_, 10);
  }

  [[nodiscard]] const Json& json() const { return j_; }

  void print(std::ostream& out) const {
    for (const Part& part : parts_) {
      char line[160];
      std::snprintf(line, sizeof line, "%-50s %8.2f MB  made in %5.2f s  %s\n", part.name.c_str(), part.memory_mb, part.made_in_s,
                    part.thread.c_str());
      out << line;
    }
    out << "together " << format_number(rounded(megabytes_, 10)) << " MB; a tick while drilling takes "
        << format_number(ticks_.quantile_us(0.5)) << " us, p99 " << format_number(ticks_.quantile_us(0.99)) << " us, p99.9 "
        << format_number(ticks_.quantile_us(0.999)) << " us\n"
        << told_hardness(anatomy_) << '\n'
        << "threads: servo (real time), recorder, follower (surface, pieces), window\n";
  }

 private:
  struct Part {
    std::string name, thread;
    double memory_mb = 0, made_in_s = 0;
  };

  // `make` returns bytes.
  void timed(const std::string& name, const std::string& thread, const auto& make) {
    const std::int64_t begin = monotonic_ns();
    const std::size_t bytes = make();
    parts_.push_back(
        {name, thread, rounded(static_cast<double>(bytes) / 1e6, 100), rounded(static_cast<double>(monotonic_ns() - begin) / 1e9, 100)});
    const Part& p = parts_.back();
    megabytes_ += p.memory_mb;
    j_["parts"].push_back({{"part", p.name}, {"memory_mb", p.memory_mb}, {"made_in_s", p.made_in_s}, {"kept_up_to_date_by", p.thread}});
  }
  // Of all bodies together: a case with a finer region has two.
  [[nodiscard]] std::size_t over_bodies(const auto& bytes) const {
    std::size_t sum = 0;
    for (const PlacedBody& b : world_->bodies()) sum += bytes(b.body->bone);
    return sum;
  }

  void build_bone() {
    timed(case_.files.contains("region") ? "bone, with its finer region" : "bone", "servo", [&] {
      world_ = world_of(case_, {});
      return over_bodies([](const BrickGrid& b) { return b.memory_bytes(); });
    });
  }

  void build_anatomy() {
    timed("hardness and structures at risk", "nobody: they do not change", [&] {
      anatomy_ = anatomy_of(case_, setup_, context_);
      return (anatomy_.hardness ? anatomy_.hardness->memory_bytes() : 0) + (anatomy_.structures ? anatomy_.structures->memory_bytes() : 0);
    });
    j_["hardness"] = Json::parse(hardness_json(anatomy_)).value();
  }

  // What is kept true to the bone while it is drilled.
  void build_what_follows() {
    if (setup_.params.effects.fail_safe)
      timed("distance map", "servo", [&] { return over_bodies([](const BrickGrid& b) { return DepthMap(b).memory_bytes(); }); });
    timed("surface", "follower", [&] {
      return over_bodies([&](const BrickGrid& bone) {
        const LiveSurface surface(bone, context_);
        std::size_t bytes = 0;
        for (std::uint32_t b = 0; b < bone.brick_count(); ++b) bytes += sizeof(SurfacePatch) + surface.patch(b).memory_bytes();
        return bytes;
      });
    });
    timed("pieces (window, or --pieces)", "follower",
          [&] { return over_bodies([](const BrickGrid& b) { return LiveComponents(b).memory_bytes(); }); });
    if (params_.dust) {
      timed("bone dust (a copy of the bone; more where it lies)", "follower",
            [&] { return over_bodies([](const BrickGrid& b) { return BrickGrid(b).memory_bytes(); }); });
    }
  }

  void build_tissue() {
    if (!fs::exists(case_.folder / "tissue.vtu")) return;
    std::shared_ptr<SoftBody> soft;
    timed("soft tissue", "follower", [&] {
      soft = soft_body_of(case_.folder);
      return soft->memory_bytes();
    });
    if (soft->slow_motion() < 0.99)
      context_.warn("soft tissue runs at " + format_number(std::round(100 * soft->slow_motion())) +
                    " % of real time: it will feel sluggish; larger voxels make it quicker");
    soft->meet(&*world_);
    const SoftTool tool{soft->points_mm().front(), {0, 0, 1}, 0, false};
    constexpr int kUpdates = 20;
    const std::int64_t begin = monotonic_ns();
    for (int n = 0; n < kUpdates; ++n) static_cast<void>(soft->update(tool));
    const double ms = static_cast<double>(monotonic_ns() - begin) / 1e6 / kUpdates;
    soft->meet(nullptr);
    j_["soft_tissue"] = {{"update_ms", ms}, {"updates_per_s", SoftBody::kUpdatesPerS}, {"of_real_time", soft->slow_motion()}};
    if (ms > 1000 / SoftBody::kUpdatesPerS)
      context_.warn("an update of soft tissue takes " + format_number(rounded(ms, 10)) + " ms of the " +
                    format_number(1000 / SoftBody::kUpdatesPerS) + " it has");
  }

  void build_renderer() {
    const std::string_view method = EnumNames<ContactMethod>::values[static_cast<std::size_t>(setup_.params.contact.method)];
    timed("haptic renderer: " + std::string(method), "servo", [&] {
      renderer_ = std::make_unique<HapticRenderer>(setup_, anatomy_, 1e-3);
      touched_ = HapticScene::of(*world_, renderer_->setup());
      renderer_->show(&touched_);
      std::size_t bytes = touched_.changes.size() * sizeof(VoxelChange);
      for (const HapticScene::Item& i : touched_.items) bytes += i.bone->grains().memory_bytes();
      return bytes;
    });
  }

  // Those of the library that these voxels do not bear, and what is to be said of them.
  void find_burrs_too_small() {
    const double voxel_mm = world_->finest_voxel_mm();
    Json small = Json::list();
    for (const Burr& burr : burr_library()) {
      if (!too_small_for_voxels(burr, voxel_mm).empty()) small.push_back(burr.name());
    }
    if (small.empty()) return;
    j_["burrs_too_small"] = small;
    const double least_mm = 2 * kLeastRadiusVoxels * voxel_mm;
    context_.warn("balls and cylinders of less than " + format_number(std::ceil(least_mm * 10 - 1e-6) / 10) + " mm, tapers of less than " +
                  format_number(std::ceil(2 * least_mm * 10 - 1e-6) / 10) + " mm, are small for voxels of " +
                  format_number(rounded(voxel_mm, 1000)) +
                  " mm: force and its direction are coarse; prepare with a smaller --spacing, or a finer region of interest");
  }

  // A few seconds of drilling, without a clock.
  void drill() {
    ScriptedDevice device(make_default_script(*world_, true, burr_index(BurrKind::cutting, 4), 5), 1000);
    Vec3 force{};
    for (std::uint64_t t = 0; device.active(t); ++t) {
      const DeviceSample sample = device.read(t, 1e-3, force);
      const std::int64_t begin = monotonic_ns();
      const auto [record, changes] = renderer_->step(sample);
      ticks_.add(monotonic_ns() - begin);
      force = from_floats(record.force_n);
    }
    j_["tick_us"] = {{"p50_us", ticks_.quantile_us(0.5)}, {"p99_us", ticks_.quantile_us(0.99)}, {"p99_9_us", ticks_.quantile_us(0.999)}};
  }

  const Case& case_;
  const SceneCommand::Params& params_;
  const Context& context_;
  Json j_;
  std::vector<Part> parts_;
  double megabytes_ = 0;
  std::optional<World> world_;
  HapticSetup setup_;
  Anatomy anatomy_;
  std::unique_ptr<HapticRenderer> renderer_;
  HapticScene touched_;
  Histogram ticks_;
};

}  // namespace

int SceneCommand::run(const Params& p, cli::Invocation& io) {
  const Case the_case = load_case(io.arguments[0]);
  SceneCosts costs(the_case, p, io.context);
  costs.build();
  io.end_progress();
  if (io.common.json) {
    io.out << costs.json().dump(2) << '\n';
  } else {
    costs.print(io.out);
  }
  return 0;
}

}  // namespace osteo
