// demo: the main job from end to end.
#include <unistd.h>

#include <algorithm>
#include <ostream>

#include "built_in_pipelines.h"
#include "commands/demo.h"
#include "commands/prepare.h"
#include "commands/rehearse.h"
#include "commands/replay.h"
#include "commands/review.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/imaging/dicom/save_series.h"
#include "osteo/imaging/image/phantom.h"
#include "osteo/imaging/io/volume_io.h"
#include "osteo/session/scene/case.h"

namespace osteo {

cli::CommandInfo DemoCommand::info() {
  return {
      "demo",
      "the whole way once: CT, case, drilled session, replay, review",
      "Without a CT it makes one of a phantom's left ear, as DICOM with its structures, prepares the case, drills a "
      "cortical mastoidectomy by a script, replays it to the bit, and scores and reviews it. With a CT: case, some "
      "seconds of drilling in real time, replay. It opens nothing; the last lines say what to look at.",
      {{"source", "DICOM folder or volume file", true}},
      "osteo demo"};
}

namespace {

// Structures that are looked at from a cavity. Cells and canal are air in a cavity's wall: drawn they would fill it.
constexpr const char* kEarNames =
    "5=ossicles, 6=facial nerve, 7=sigmoid sinus, 12=labyrinth, 13=chorda tympani, 16=dura";

void write_if_new(const fs::path& path, const std::string& text) {
  if (!fs::exists(path)) write_file(path, text);
}

}  // namespace

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
  const fs::path labels = out / "labels.nrrd", script = out / "strokes.json", procedure = out / "mastoidectomy.json";
  if (phantom) {
    if (!fs::exists(source) || !fs::exists(labels)) {
      say("making a CT of a phantom's left ear: " + source.string());
      PhantomParams params;
      params.region = PhantomRegion::temporal;
      params.spacing_mm = 0.5;
      const Phantom made = make_phantom(params, io.context);
      if (!fs::exists(labels)) save_labels(made.labels, labels);
      if (!fs::exists(source)) save_dicom_series(made.ct, source, io.context);
      io.end_progress();
    }
    write_if_new(script, kMastoidectomyStrokes);
    write_if_new(procedure, kMastoidectomy);
  }
  say("preparing the case: " + (out / "case").string());
  PrepareCommand::Params prepare;
  prepare.out = (out / "case").string();
  prepare.axes = p.axes;
  prepare.fresh = true;
  io.given = {"axes", "fresh"};
  if (phantom) {
    prepare.lower = 500;  // half-way between the phantom's bone and tissue
    prepare.structures = labels.string();
    prepare.names = kEarNames;
    io.given.insert({"lower", "structures", "names"});
  }
  io.settings.clear();
  io.arguments = {source.string()};
  // Only what an earlier demo left on another scan is made again.
  std::optional<Recipe> earlier;
  try {
    earlier = read_recipe(prepare.out);
  } catch (const Error&) {  // a damaged case is made again, as --fresh says
  }
  const bool force = io.common.force;
  io.common.force = force || (earlier && earlier->source_hash != hash_path(source));
  PrepareCommand::run(prepare, io);
  io.common.force = force;

  say(phantom ? "drilling a cortical mastoidectomy, 96 s of surgery as fast as this machine can"
              : "drilling for " + format_number(p.seconds) + " s");
  // A session is never replaced, an earlier demo's neither.
  fs::path session = out / "session";
  for (int n = 2; fs::exists(session); ++n) session = out / ("session-" + std::to_string(n));
  RehearseCommand::Params rehearse;
  rehearse.headless = true;
  rehearse.out = session.string();
  rehearse.seconds = p.seconds;
  if (phantom) {
    rehearse.script = script.string();
    rehearse.fast = rehearse.dust = true;
  }
  io.arguments = {prepare.out};
  RehearseCommand::run(rehearse, io);

  say("replaying the session");
  io.arguments = {session.string()};
  const int code = ReplayCommand::run({}, io);
  std::string look = "\n   " + (out / "case/preview.png").string() + "\n   " + (session / "before.png").string() +
                     "\n   " + (session / "after.png").string();
  if (phantom) {
    say("scoring and reviewing the session");
    ReviewCommand::Params review;
    review.out = (session / "review").string();
    review.procedure = procedure.string();
    io.arguments = {session.string()};
    ReviewCommand::run(review, io);
    look += "\n   " + (session / "review/review.html").string();
  }
  say("done; look at" + look + "\nand drill yourself:  ./osteo rehearse " + prepare.out);
  return code;
}

}  // namespace osteo
