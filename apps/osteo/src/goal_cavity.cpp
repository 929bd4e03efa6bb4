// osteo goal-cavity: what is to be removed in this patient's bone, by a procedure's rules.
#include <cmath>

#include "commands/goal_cavity.h"
#include "osteo/assessment/goal/goal.h"
#include "osteo/core/base/json_document.h"
#include "osteo/imaging/pipeline/formats.h"
#include "osteo/session/scene/session_folder.h"
#include "osteo/simulation/haptics/device.h"

namespace osteo {

cli::CommandInfo GoalCavityCommand::info() {
  return {"goal-cavity",
          "the cavity that a procedure asks for in this bone, and a session against it",
          "Columns of burrs go down from the surface until the margin to a structure would be broken, and stay as far "
          "as they reach the procedure's target regions; above them the cavity is saucerised. It says the bone to "
          "remove, the margin to each structure, and what was left out. With --session also how much of it was done, "
          "left, and removed beyond it. A goal by rules is a proposal to look at, not a plan for a patient "
          "(docs/validation/goal.md).",
          {{"case", "a folder made by prepare, with structures"}},
          "osteo goal-cavity CASE --procedure mastoidectomy -o goal.seg.nrrd",
          false,
          {},
          {"out"},
          {"procedure"}};
}

int GoalCavityCommand::run(const Params& p, cli::Invocation& io) {
  if (p.procedure.empty())
    throw Error(ExitCode::usage, "a goal goes by a procedure's rules", "--procedure mastoidectomy");
  if (!p.out.empty()) {
    require_savable(DataKind::labels, p.out);
    if (!io.common.force && output_exists(p.out))
      throw Error(ExitCode::cannot_write, "'" + p.out + "' exists already",
                  "give another name, or --force to replace it");
  }
  Procedure procedure = load_procedure(p.procedure);
  if (p.mirror) procedure = mirrored(std::move(procedure));
  const Case the_case = load_case(io.arguments[0]);
  HapticSetup setup;
  apply_haptic_settings(the_case.folder, {}, setup);
  const Anatomy anatomy = anatomy_of(the_case, setup, io.context);
  if (!anatomy.structures)
    throw Error(ExitCode::usage, "the case has no structures, and the goal's margins begin with them",
                "prepare it with --structures and --names");
  const World world = world_of(the_case, anatomy);
  GoalOptions options;
  options.burr_mm = p.burr_mm;
  if (io.given.contains("approach")) {
    options.toward = Vec3{p.approach[0], p.approach[1], p.approach[2]};
    if (length(*options.toward) == 0) throw Error(ExitCode::usage, "--approach 0,0,0 is no direction", "like 1,-0.3,0");
  }
  const GoalCavity goal = goal_cavity(world, *anatomy.structures, procedure, options, io.context);
  const auto hundredths = [](double x) { return std::round(x * 100) / 100; };
  Json j{{"bone_mm3", hundredths(goal.bone_mm3)},
         {"toward", Json{hundredths(goal.toward.x), hundredths(goal.toward.y), hundredths(goal.toward.z)}}};
  j["margins"] = Json::list();
  for (const GoalMargin& m : goal.margins)
    j["margins"].push_back(
        {{"structure", m.structure}, {"margin_mm", hundredths(m.margin_mm)}, {"asked_mm", m.asked_mm}});
  j["notes"] = Json::list();
  for (const std::string& n : goal.notes) j["notes"].push_back(n);
  std::string against;
  if (!p.session.empty()) {
    const SessionFolder session = open_session_folder(p.session, io.arguments[0]);
    const World after = world_at_end(session, the_case, anatomy, io.context);
    const GoalScore s = score_against(goal, world.bodies().front().body->bone, after.bodies().front().body->bone);
    j["session"] = {{"dice", std::round(s.dice * 1000) / 1000},
                    {"done_mm3", hundredths(s.done_mm3)},
                    {"left_mm3", hundredths(s.left_mm3)},
                    {"beyond_mm3", hundredths(s.beyond_mm3)},
                    {"beyond_mm", hundredths(s.beyond_mm)}};
    against = "session: Dice " + format_number(std::round(s.dice * 1000) / 1000) + "; done " +
              format_number(std::round(s.done_mm3)) + " mm3, left " + format_number(std::round(s.left_mm3)) +
              " mm3, beyond " + format_number(std::round(s.beyond_mm3)) + " mm3 (95 % of it within " +
              format_number(hundredths(s.beyond_mm)) + " mm)\n";
  }
  if (!p.out.empty()) save_data(Data(goal.labels(world)), p.out);
  io.end_progress();
  if (io.common.json) io.out << j.dump(2) << '\n';
  if (!io.common.quiet) {
    io.err << "goal: " << format_number(std::round(goal.bone_mm3)) << " mm3 of bone\n";
    for (const GoalMargin& m : goal.margins)
      io.err << "  margin to " << m.structure << ": " << format_number(hundredths(m.margin_mm)) << " mm\n";
    for (const std::string& n : goal.notes) io.err << "  note: " << n << '\n';
    io.err << against;
  }
  return 0;
}

}  // namespace osteo
