// simulate-trainee: a session by a program whose skill is known.
#include <cmath>
#include <ostream>

#include "commands/simulate_trainee.h"
#include "osteo/assessment/evidence/procedure.h"
#include "osteo/assessment/trainee/simulate.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/session/scene/session_folder.h"

namespace osteo {

cli::CommandInfo SimulateTraineeCommand::info() {
  std::string skills;
  TraineeSkill usual;
  for (const FieldRef& f : fields_of<TraineeSkill>(usual))
    skills +=
        (skills.empty() ? "" : "; ") + std::string(f.doc.name) + " (" + f.to_text() + "): " + std::string(f.doc.help);
  return {"simulate-trainee",
          "a session by a simulated trainee, whose skill is known, to test scores with",
          "Opens a window through bone to what the procedure's target regions lie around: a hand that feels its force, "
          "sees which bone is "
          "left, and is as good as --skill says. The same seed gives the same session. It is labelled simulated "
          "wherever it is shown, and "
          "says nothing about people (docs/validation/trainee.md). Skills, with an expert's values: " +
              skills + ".",
          {{"case", "a folder made by prepare, with structures"}},
          "osteo simulate-trainee CASE --skill 'novice, undercut=0.8' --procedure "
          "mastoid-window -o SESSION"};
}

int SimulateTraineeCommand::run(const Params& p, cli::Invocation& io) {
  if (p.procedure.empty())
    throw Error(ExitCode::usage, "a trainee needs to know what is to be done", "--procedure mastoid-window");
  TraineeOptions options;
  options.skill = parse_skill(p.skill);
  options.seed = static_cast<std::uint64_t>(io.common.seed);
  options.most_s = p.minutes * 60;
  options.plan.radius_mm = p.window_mm;
  options.plan.goal = p.goal;
  if (p.goal && io.given.contains("window_mm"))
    throw Error(ExitCode::usage, "--window-mm has no effect with --goal", "give one of them");
  if (io.given.contains("approach")) {
    options.plan.toward = Vec3{p.approach[0], p.approach[1], p.approach[2]};
    if (length(*options.plan.toward) == 0)
      throw Error(ExitCode::usage, "--approach 0,0,0 is no direction", "like 1,-0.3,0");
  }
  Procedure procedure = load_procedure(p.procedure);
  if (p.mirror) procedure = mirrored(std::move(procedure));
  const TraineeScene scene = trainee_scene(io.arguments[0], std::move(procedure), io.context);
  const SessionFolder folder = create_session_folder(p.out, scene.the_case.folder, {});
  io.context.progress(0, "planning and drilling");
  const SimulatedSession s =
      simulate_trainee(scene, world_of(scene.the_case, scene.anatomy), options, folder, io.context);
  io.end_progress();
  if (s.summary.interrupted) io.context.check_cancelled();
  if (io.common.json) {
    io.out << Json{{"session", folder.folder.string()},
                   {"simulated", true},
                   {"seconds", s.seconds},
                   {"finished", s.finished},
                   {"removed_mm3", s.summary.removed_mm3}}
                  .dump(2)
           << '\n';
  }
  if (!io.common.quiet) {
    io.err << "simulated: " << format_number(std::round(s.seconds * 10) / 10) << " s, removed "
           << format_number(std::round(s.summary.removed_mm3 * 10) / 10) << " mm3"
           << (s.finished ? "" : "; its time was up before it had finished") << "\nsession: " << folder.folder.string()
           << "  (trainee.json: skill, and what it knows of what it left)\n";
  }
  return static_cast<int>(s.summary.gaps.empty() ? ExitCode::ok : ExitCode::partial);
}

}  // namespace osteo
