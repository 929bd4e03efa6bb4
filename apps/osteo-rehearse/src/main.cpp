// The window of 'osteo rehearse', a program of its own.
#include <iostream>

#include "osteo/app/cli/command.h"
#include "osteo/app/window/code_page.h"
#include "osteo/app/window/rehearsal_window.h"
#include "osteo/app/window/start_page.h"
#include "osteo/assessment/evidence/procedure.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/display/view/live_cut.h"
#include "osteo/geometry/grid/grid_io.h"
#include "osteo/imaging/io/volume_io.h"
#include "osteo/session/recording/session_reader.h"
#include "osteo/session/scene/approval.h"
#include "osteo/simulation/bone/burr.h"
#include "session_runner.h"
#include "window_flags.h"
#include "window_main.h"

namespace osteo {
namespace {

// A case with what the window shows of it. Read in a thread of its own.
struct OpenCase {
  Case files;
  std::optional<SparseGrid> hu;
  std::optional<Image> ct;  // the whole scan, where it was given
  std::optional<Labels> uncertainty;
  std::vector<SparseGrid> bone;  // density, the finest first
  ApprovalNow approval;
  VerdictSummary scan;
  std::string hash;
  std::vector<PlannedRegion> regions;  // of the procedure, where one was given
};
std::unique_ptr<OpenCase> open_case(const fs::path& folder, const WindowFlags& flags,
                                    const std::optional<Procedure>& procedure, const Context& context) {
  auto open = std::make_unique<OpenCase>();
  open->files = load_case(folder);
  open->approval = approval_of(open->files.folder);
  if (flags.require_approved) require_approval(open->approval, open->files.folder);
  if (const auto it = open->files.files.find("hu"); it != open->files.files.end()) open->hu = load_grid(it->second);
  if (const auto it = open->files.files.find("verdict"); it != open->files.files.end())
    open->scan = read_verdict(read_text(it->second));
  if (const auto it = open->files.files.find("uncertainty"); it != open->files.files.end())
    open->uncertainty = load_labels(it->second);
  open->hash = hash_path(open->files.folder / "manifest.json");
  if (const auto it = open->files.files.find("region"); it != open->files.files.end())
    open->bone.push_back(load_grid(it->second));
  open->bone.push_back(open->files.bone);
  if (procedure) {
    for (const ProcedureRegion& r : procedure->regions)
      open->regions.push_back({r.name, r.structure, r.kind == RegionKind::forbidden, r.within_mm});
  }
  if (!flags.scan.empty()) {
    open->ct = load_image(flags.scan, context);
    constexpr double kOwnHu = 60;
    if (!open->hu) {
      context.warn("this case keeps no CT values, so whether --scan is its scan could not be checked");
    } else if (!(difference_hu(*open->hu, *open->ct) < kOwnHu)) {
      throw Error(ExitCode::usage, "--scan is not the scan of this case, or does not lie where it lay",
                  "'osteo export-slicer CASE FOLDER' writes the case's own as ct.nrrd");
    }
  }
  return open;
}

// How things looked there.
std::vector<Note> looks_noted_in(const fs::path& session) {
  const SessionReader reader(SessionFolder{session, {}, {}}.stream());
  std::vector<Note> notes;
  auto parts = reader.parts();
  while (const SessionPart* const p = parts.next()) {
    for (const Note& n : p->notes) {
      if (n.kind == "structure" || n.kind == "cuts") notes.push_back(n);
    }
  }
  return notes;
}

struct WindowCommand {
  using Params = WindowFlags;
  static void describe(Params& p, auto& visit) { WindowFlags::describe(p, visit); }
  static cli::CommandInfo info() {
    return {"rehearse",
            "drill the bone of a case in a window",
            "What 'osteo rehearse CASE' opens; without a case, a page to choose one on. Exit code 8 when ticks were "
            "not recorded, since the "
            "disk did not keep up.",
            {{"case", "a folder made by prepare", true}},
            "osteo-rehearse CASE",
            false,
            window_flag_groups()};
  }

  // What was given beats what the person chose last; of a case that was given the flags alone say what it has.
  static PersonValues chosen(const Params& p, const cli::Invocation& io, PersonValues values) {
    const auto given = [&](const char* name) { return io.given.contains(name); };
    if (given("sound")) values.sound = p.sound;
    if (given("volume")) values.volume = p.volume;
    if (given("alarms")) values.alarms = p.alarms;
    if (given("full_screen")) values.full_screen = p.full_screen;
    const bool alone = !io.arguments.empty();
    if (alone || given("procedure")) values.procedure = p.procedure;
    if (alone || given("mirror")) values.mirror_procedure = p.mirror;
    if (alone || given("dust")) values.dust = p.dust;
    if (alone || given("heat")) values.heat = p.heat;
    if (alone || given("monitor")) values.monitor = p.monitor;
    if (alone || given("position")) values.position = EnumNames<Posture>::values[static_cast<std::size_t>(p.position)];
    if (p.layout != StartLayout::last)
      values.layout = EnumNames<StartLayout>::values[static_cast<std::size_t>(p.layout)];
    return values;
  }
  // What was changed in the window since `before` is the person's choice from now on.
  static void keep(const PersonValues& before, const PersonValues& now, PersonValues& kept) {
    const auto take = [&](auto PersonValues::*field) {
      if (before.*field != now.*field) kept.*field = now.*field;
    };
    take(&PersonValues::scale);
    take(&PersonValues::layout);
    take(&PersonValues::theme);
    take(&PersonValues::language);
    take(&PersonValues::full_screen);
    take(&PersonValues::sound);
    take(&PersonValues::volume);
    take(&PersonValues::alarms);
    take(&PersonValues::remember_cases);
    take(&PersonValues::first_steps);
    take(&PersonValues::motion_one_to);
    take(&PersonValues::wrist_rest);
    take(&PersonValues::burr_share);
    take(&PersonValues::left_handed);
    take(&PersonValues::mirror_mouse);
    take(&PersonValues::hints);
    take(&PersonValues::hints_off);
    take(&PersonValues::procedure);
    take(&PersonValues::mirror_procedure);
    take(&PersonValues::dust);
    take(&PersonValues::heat);
    take(&PersonValues::monitor);
    take(&PersonValues::position);
    take(&PersonValues::network);
    take(&PersonValues::lessons_at);
  }
  // As the start page has them.
  static void take_switches(const PersonValues& values, Params& flags) {
    flags.procedure = values.procedure;
    flags.mirror = values.mirror_procedure;
    flags.dust = values.dust;
    flags.heat = values.heat;
    flags.monitor = values.monitor;
    constexpr auto kPositions = enum_names(Posture{});
    const auto* const at = std::find(kPositions.begin(), kPositions.end(), values.position);
    if (at != kPositions.end()) flags.position = static_cast<Posture>(at - kPositions.begin());
  }
  static std::optional<Procedure> procedure_of(const Params& p) {
    if (p.procedure.empty()) return std::nullopt;
    Procedure procedure = load_procedure(p.procedure);
    return p.mirror ? mirrored(std::move(procedure)) : std::move(procedure);
  }

  // One case, from its first session to the last. `left`: how the person left it.
  static bool sit(const Params& p, const OpenCase& open, const Procedure* procedure, const StartOptions& start,
                  WindowShell& shell, PersonSettings& person, cli::Invocation& io, WindowEnd& left) {
    WindowOptions window;
    window.tool = burr_index(p.burr, p.diameter_mm, p.shape);
    window.from_case = p.resume.empty();
    window.state_file = p.state_file;
    window.end_page = p.end_page;
    window.review_only = !p.review.empty();
    window.case_hash = open.hash;
    window.approval = open.approval.words();
    window.approval_ended = open.approval.state == ApprovalState::outdated;
    window.scan = open.scan;
    window.quality = p.quality;
    window.ct = open.ct;
    window.bone = open.bone;
    window.regions = open.regions;
    if (procedure != nullptr) {
      for (const ProcedureStructure& s : procedure->structures)
        if (s.role == ProcedureRole::thin) window.thinned.push_back(s.name);
    }
    window.uncertainty = open.uncertainty;
    window.planned_cuts = planned_cuts_of(open.files.folder);
    window.planned_cuts_file = open.files.folder / kPlannedCutsFile;
    window.stereo.mode = p.stereo;
    window.stereo.base_mm = p.stereo_base;
    window.procedures = start.procedures;
    window.view = left.view;
    window.camera_trial = p.experiment == "camera";
    shell.set_title("Osteotome - " + open.files.folder.filename().string());
    SessionRunner session_runner(p, open.files, procedure, person.values, io);
    window.device = session_runner.device();
    window.way = session_runner.way();
    io.end_progress();

    WindowActions actions;
    actions.begin = [&](bool from_case, const HandView& view) { return session_runner.begin(from_case, view); };
    actions.save = [&] { session_runner.save(); };
    actions.rehearsal = [&] { return session_runner.rehearsal(); };
    if (!p.resume.empty()) actions.notes_before = [&] { return looks_noted_in(p.resume); };
    actions.folder = [&] { return session_runner.folder(); };
    actions.failure = [&] { return session_runner.rehearsal()->recording().failure; };
    actions.camera = [&](bool lend) { return session_runner.camera(lend); };
    actions.tune = [&](const HandTuning& tuning) { session_runner.tune(tuning); };
    actions.switches = [&](bool attended) { return session_runner.switches(attended); };
    actions.stop = [&] { return io.context.cancelled(); };
    actions.monitor = [&] { return session_runner.monitor(); };
    actions.turn_monitor = [&](bool on) { return session_runner.turn_monitor(on); };
    if (p.join.empty() && p.review.empty())
      actions.simulate = [&](Simulated what, bool on) { session_runner.simulate(what, on); };
    if (p.tutor || !p.join.empty() || !p.playback.empty()) {
      actions.tutor = [&] { return session_runner.tutor(); };
      actions.steps = [&](const std::vector<std::string>& injured) { return session_runner.steps(injured); };
      actions.lead = [&](bool on) { session_runner.lead(on); };
    }
    actions.facts = [&] { return session_runner.facts(); };
    actions.review = [&](const Context& context) { return session_runner.review(context); };
    actions.world_at_begin = [&](const Context& context) { return session_runner.at_begin(context); };
    session_runner.save_at_exit(true);
    try {
      left =
          run_rehearsal_window(shell, person, window, open.hu ? &*open.hu : nullptr, actions, session_runner.sound());
    } catch (...) {
      session_runner.save_at_exit(false);
      session_runner.save();
      throw;
    }
    session_runner.save_at_exit(false);
    person.values.sound = session_runner.sound().on();
    person.values.volume = session_runner.sound().volume();
    person.values.alarms = session_runner.sound().alarms();
    session_runner.save();
    return session_runner.lost_ticks();
  }

  static int run(const Params& p, cli::Invocation& io) {
    if (!p.monitor_setup.empty() && !p.monitor)
      throw Error(ExitCode::usage, "--monitor-setup has no effect without --monitor", "add --monitor, or leave it out");
    if (p.device == Hand::igtl && p.tracker.empty())
      throw Error(ExitCode::usage, "--device igtl needs --tracker", "HOST:PORT or HOST:PORT/NAME");
    const std::pair<const char*, bool> begins[] = {
        {"--resume", !p.resume.empty()}, {"--playback", !p.playback.empty()}, {"--tutor", p.tutor},
        {"--join", !p.join.empty()},     {"--out", !p.out.empty()},           {"--experiment", !p.experiment.empty()},
        {"--no-end-page", !p.end_page}};
    for (const auto& [flag, given] : begins) {
      if (given && !p.review.empty())
        throw Error(ExitCode::usage, std::string(flag) + " has no effect with --review",
                    "a session that is over is looked at; leave it out");
    }
    if (!p.review.empty() && io.arguments.empty())
      throw Error(ExitCode::usage, "--review takes the session's <case> too", "osteo rehearse CASE --review SESSION");
    if (!p.experiment.empty() && p.experiment != "camera")
      throw Error(ExitCode::usage, "--experiment: there is no '" + p.experiment + "'", "'camera' is the only one");
    if (p.mirror && p.procedure.empty())
      throw Error(ExitCode::usage, "--mirror has no effect without --procedure", "add it, or leave it out");
    std::optional<Procedure> procedure = procedure_of(p);  // what is wrong with it is said without a window
    PersonSettings person(PersonSettings::usual_file());
    for (const std::string& c : person.complaints()) io.context.warn(c);
    PersonValues kept = person.values;
    person.values = chosen(p, io, kept);
    const PersonValues before = person.values;
    const bool from_command_line = !io.arguments.empty();
    // What is no case at all is said without a window.
    if (from_command_line && !fs::exists(fs::path(io.arguments[0]) / "manifest.json"))
      static_cast<void>(load_case(io.arguments[0]));

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
    for (const std::string& name : built_in_procedures()) start.procedures.push_back({name, load_procedure(name).name});
    start.osteo = fs::read_symlink("/proc/self/exe").parent_path() / "osteo";
    std::optional<StartChoice> choice;
    if (!flags.join.empty() && flags.code.empty()) {
      const auto typed = ask_for_code(shell, flags.join, start.stop, p.state_file);
      if (!typed) return static_cast<int>(ExitCode::ok);
      flags.code = *typed;
    }
    if (from_command_line) choice = StartChoice{io.arguments[0], p.resume};
    bool chosen_in_window = !from_command_line;
    WindowEnd left;
    while (!closed && !io.context.cancelled()) {
      if (!choice) {
        choice = run_start_page(shell, person, start);
        if (!choice) break;
        take_switches(person.values, flags);
        flags.tutor = choice->teach;
        if (flags.tutor) flags.listen = person.values.lessons_at;
      }
      flags.resume = choice->resume;
      left = {false, {}, false, left.changed ? left.view : std::nullopt};
      try {
        std::unique_ptr<OpenCase> open;
        shell.while_working("the case is opened", io.context, [&](const Context& context) {
          procedure = procedure_of(flags);
          open = open_case(choice->case_folder, flags, procedure, context);
        });
        person.opened(open->files.folder);
        sat = true;
        lost_ticks = sit(flags, *open, procedure ? &*procedure : nullptr, start, shell, person, io, left) || lost_ticks;
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
      if (left.changed) {
        take_switches(person.values, flags);
        if (flags.join.empty() && flags.review.empty()) {  // it goes on as it was
          flags.dust = left.dust;
          flags.heat = left.heat;
        }
      }
      chosen_in_window = true;
      flags.out.clear();
      flags.review.clear();
    }
    person.values.scale = shell.by_hand();
    keep(before, person.values, kept);
    person.values = kept;
    if (const std::string not_kept = person.save(); !not_kept.empty()) io.context.warn(not_kept);
    if (io.context.cancelled())
      throw Error(ExitCode::cancelled, sat ? "ended from outside; the session is saved" : "ended from outside");
    require_no_gl_errors(shell.gl_errors(), "; the session is saved");
    return static_cast<int>(lost_ticks ? ExitCode::partial : ExitCode::ok);
  }
};

}  // namespace
}  // namespace osteo

int main(int argc, char** argv) {
  return osteo::run_window_program<osteo::WindowCommand>(
      argc, argv, "osteo-rehearse: drill the bone of a case in a window", std::string(osteo::kOwnLicence));
}
