#include "program.h"

#include "batch_command.h"
#include "commands/approve.h"
#include "commands/bench.h"
#include "commands/calibrate_camera.h"
#include "commands/calibrate_pen.h"
#include "commands/convert.h"
#include "commands/demo.h"
#include "commands/devices.h"
#include "commands/docs.h"
#include "commands/edit.h"
#include "commands/estimate_cost.h"
#include "commands/export.h"
#include "commands/export_result.h"
#include "commands/export_slicer.h"
#include "commands/goal_cavity.h"
#include "commands/heat.h"
#include "commands/import_slicer.h"
#include "commands/info.h"
#include "commands/join.h"
#include "commands/list.h"
#include "commands/list_series.h"
#include "commands/markers.h"
#include "commands/nerve_console.h"
#include "commands/nerve_monitor.h"
#include "commands/playback.h"
#include "commands/prepare.h"
#include "commands/rehearse.h"
#include "commands/replay.h"
#include "commands/report.h"
#include "commands/review.h"
#include "commands/run.h"
#include "commands/score.h"
#include "commands/sound.h"
#include "commands/stream.h"
#include "commands/study.h"
#include "commands/suggest_threshold.h"
#include "commands/track_pen.h"
#include "commands/tutor.h"
#include "licence.h"
#include "osteo/app/stages/registry.h"
#include "pacs_commands.h"
#ifdef OSTEO_WITH_RESEARCH
#include "commands/experiment.h"
#include "commands/ground_truth.h"
#include "commands/simulate_trainee.h"
#endif
#ifdef OSTEO_WITH_MOVIE
#include "commands/movie.h"
#include "osteo/assessment/movie/movie_file.h"
#endif

namespace osteo {
namespace {

// Who uses what. A name that stands in none of these is listed last; a test wants that list short.
std::vector<cli::Group> command_groups() {
  return {
      {"Prepare a case",
       {"prepare",
        "list-series",
        "info",
        "report",
        "edit",
        "approve",
        "import",
        "crop",
        "denoise",
        "suggest-threshold",
        "threshold",
        "reduce-metal",
        "resample",
        "surface",
        "import-bone",
        "structures",
        "tube",
        "find-structures",
        "segment-network",
        "register",
        "apply-edits",
        "export-slicer",
        "import-slicer",
        "snapshot",
        "convert",
        "run"}},
      {"Rehearse",
       {"rehearse", "estimate-cost", "export-result", "replay", "playback", "tutor", "join", "devices", "markers",
        "calibrate-camera", "calibrate-pen", "track-pen", "stream", "nerve-console"}},
      {"Review and teach",
       {"review", "score", "goal-cavity", "study", "movie", "export", "heat", "sound", "nerve-monitor"}},
      {"Server and PACS", {"batch", "receive", "watch-folder", "send", "fetch", "deidentify", "doctor"}},
      {"Geometry",
       {"mesh-info", "mesh-repair", "voxelize", "distance", "distance-at", "compare", "virtual-fixture", "saw",
        "separate-fragments", "tetrahedralize", "embed-surface"}},
      {"Tissue", {"simulate", "fem", "bone-stiffness", "calibrate", "fit-damping"}},
      {"Plan surgery", {"plan-reconstruction", "cutting-guide", "outcome"}},
      {"Research", {"experiment", "ground-truth", "simulate-trainee", "phantom", "bench"}},
      {"Osteotome itself", {"demo", "list", "docs"}},
  };
}

}  // namespace

cli::Program make_osteo_program() {
  cli::Program p;
  p.about = "osteo: from a patient's CT to a bone that can be drilled and felt";
#ifdef OSTEO_WITH_MOVIE
  p.licence = licence_of_all_stages(movie_encoder_licence());
#else
  p.licence = licence_of_all_stages();
#endif
  p.registry = osteo_stages();
  p.tasks = {{"Prepare a case from a CT", "osteo prepare DICOM_FOLDER -o CASE"},
             {"Correct and approve it", "osteo edit CASE    osteo approve CASE --by NAME"},
             {"Rehearse the operation", "osteo rehearse CASE"},
             {"Review a session, or score it", "osteo review SESSION    osteo score SESSION"},
             {"Prepare many scans on a server", "osteo batch TABLE.csv -o FOLDER"},
             {"Try it without a scan", "osteo demo"}};
  p.groups = command_groups();
  p.add<ListCommand>();
  p.add<InfoCommand>();
  p.add<ListSeriesCommand>();
  p.add<SuggestThresholdCommand>();
  p.add<ConvertCommand>();
  p.add<RunCommand>();
  p.add<PrepareCommand>();
  p.add<BatchCommand>();
  p.add<ReportCommand>();
  p.add<ApproveCommand>();
  p.add<EditCommand>();
  p.add<ExportSlicerCommand>();
  p.add<ImportSlicerCommand>();
  p.add<EstimateCostCommand>();
  p.add<ExportResultCommand>();
  p.add<RehearseCommand>();
  p.add<ReplayCommand>();
  p.add<PlaybackCommand>();
  p.add<TutorCommand>();
  p.add<JoinCommand>();
  p.add<ScoreCommand>();
#ifdef OSTEO_WITH_MOVIE
  p.add<MovieCommand>();
#endif
  p.add<GoalCavityCommand>();
  p.add<ReviewCommand>();
  p.add<ExportCommand>();
  p.add<SoundCommand>();
  p.add<HeatCommand>();
  p.add<NerveMonitorCommand>();
  p.add<StreamCommand>();
  p.add<NerveConsoleCommand>();
#ifdef OSTEO_WITH_RESEARCH
  p.add<ExperimentCommand>();
  p.add<GroundTruthCommand>();
#endif
  p.add<StudyCommand>();
#ifdef OSTEO_WITH_RESEARCH
  p.add<SimulateTraineeCommand>();
#endif
  p.add<DevicesCommand>();
  p.add<MarkersCommand>();
  p.add<CalibrateCameraCommand>();
  p.add<CalibratePenCommand>();
  p.add<TrackPenCommand>();
  p.add<DeidentifyCommand>();
  p.add<SendCommand>();
  p.add<FetchCommand>();
  p.add<ReceiveCommand>();
  p.add<WatchFolderCommand>();
  p.add<DoctorCommand>();
  p.add<DemoCommand>();
  p.add<BenchCommand>();
  p.add<DocsCommand>();
  return p;
}

}  // namespace osteo
