// demo: the main job from end to end.
#include <unistd.h>

#include <algorithm>
#include <ostream>

#include "commands/demo.h"
#include "commands/prepare.h"
#include "commands/rehearse.h"
#include "commands/replay.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/imaging/dicom/save_series.h"
#include "osteo/imaging/image/phantom.h"
#include "osteo/session/scene/case.h"

namespace osteo {

cli::CommandInfo DemoCommand::info() {
  return {"demo",
          "the whole way once: CT, case, drilled session, pictures",
          "With no CT given it makes one (a phantom head, as DICOM). Then prepare, a headless rehearsal in real time, "
          "and a replay that "
          "must come out the same.",
          {{"source", "DICOM folder or volume file", true}},
          "osteo demo"};
}

int DemoCommand::run(const Params& p, cli::Invocation& io) {
  const fs::path out = p.out;
  make_output_folder(out);
  const bool phantom = io.arguments.empty();
  fs::path source = phantom ? out / "phantom-dicom" : fs::path(io.arguments[0]);
  const auto say = [&](const std::string& text) {
    io.end_progress();
    if (!io.common.quiet) io.err << "\n== " << text << '\n';
  };
  // Without a terminal there is no bar: a line for each new activity and each 20 % says what is going on.
  if (::isatty(2) == 0 && !io.common.quiet && io.common.progress == cli::ProgressStyle::automatic) {
    io.context.on_progress(
        [&err = io.err, activity = std::string(), fifths = 0](double fraction, std::string_view what) mutable {
          const int now = static_cast<int>(fraction * 5);
          if (what.empty() || (what == activity && now <= fifths)) return;
          if (what != activity) fifths = 0;
          activity = what;
          fifths = std::max(fifths, now);
          err << "   " << static_cast<int>(fraction * 100) << " %  " << activity << std::endl;
        });
  }
  if (phantom && !fs::exists(source)) {
    say("making a CT of a phantom head: " + source.string());
    PhantomParams params;
    save_dicom_series(make_phantom(params, io.context).ct, source, io.context);
    io.end_progress();
  }
  say("preparing the case: " + (out / "case").string());
  PrepareCommand::Params prepare;
  prepare.out = (out / "case").string();
  prepare.axes = p.axes;
  if (phantom) prepare.lower = 500;  // half-way between the phantom's bone and tissue
  prepare.fresh = true;
  io.given = {"lower", "axes", "fresh"};
  if (!phantom) io.given.erase("lower");
  io.settings.clear();
  io.arguments = {source.string()};
  // Only what an earlier demo left on another scan is made anew.
  std::optional<Recipe> earlier;
  try {
    earlier = read_recipe(prepare.out);
  } catch (const Error&) {  // a damaged case is made anew, as --fresh says
  }
  const bool force = io.common.force;
  io.common.force = force || (earlier && earlier->source_hash != hash_path(source));
  PrepareCommand::run(prepare, io);
  io.common.force = force;

  say("drilling for " + format_number(p.seconds) + " s");
  // A session is never replaced, an earlier demo's neither.
  fs::path session = out / "session";
  for (int n = 2; fs::exists(session); ++n) session = out / ("session-" + std::to_string(n));
  RehearseCommand::Params rehearse;
  rehearse.headless = true;
  rehearse.out = session.string();
  rehearse.seconds = p.seconds;
  io.arguments = {prepare.out};
  RehearseCommand::run(rehearse, io);

  say("replaying the session");
  io.arguments = {session.string()};
  const int code = ReplayCommand::run({}, io);
  say("done; look at\n   " + (out / "case/preview.png").string() + "\n   " + (session / "before.png").string() +
      "\n   " + (session / "after.png").string() + "\nand drill yourself:  ./osteo rehearse " + prepare.out);
  return code;
}

}  // namespace osteo
