#include "program.h"

#include "batch_command.h"
#include "commands/approve.h"
#include "commands/bench.h"
#include "commands/calibrate_camera.h"
#include "commands/calibrate_pen.h"
#include "commands/console.h"
#include "commands/convert.h"
#include "commands/demo.h"
#include "commands/devices.h"
#include "commands/docs.h"
#include "commands/edit.h"
#include "commands/export.h"
#include "commands/guide.h"
#include "commands/hand_over.h"
#include "commands/heat.h"
#include "commands/info.h"
#include "commands/join.h"
#include "commands/list.h"
#include "commands/markers.h"
#include "commands/monitor.h"
#include "commands/plan.h"
#include "commands/playback.h"
#include "commands/prepare.h"
#include "commands/rehearse.h"
#include "commands/replay.h"
#include "commands/report.h"
#include "commands/review.h"
#include "commands/run.h"
#include "commands/scene.h"
#include "commands/score.h"
#include "commands/series.h"
#include "commands/sound.h"
#include "commands/stream.h"
#include "commands/study.h"
#include "commands/take_back.h"
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

cli::Program make_osteo_program() {
  cli::Program p;
  p.about = "osteo: from a patient's CT to a bone that can be drilled and felt";
#ifdef OSTEO_WITH_MOVIE
  p.licence = licence_of_all_stages(movie_encoder_licence());
#else
  p.licence = licence_of_all_stages();
#endif
  p.registry = osteo_stages();
  p.add<ListCommand>();
  p.add<InfoCommand>();
  p.add<SeriesCommand>();
  p.add<GuideCommand>();
  p.add<ConvertCommand>();
  p.add<RunCommand>();
  p.add<PrepareCommand>();
  p.add<BatchCommand>();
  p.add<ReportCommand>();
  p.add<ApproveCommand>();
  p.add<EditCommand>();
  p.add<HandOverCommand>();
  p.add<TakeBackCommand>();
  p.add<SceneCommand>();
  p.add<PlanCommand>();
  p.add<RehearseCommand>();
  p.add<ReplayCommand>();
  p.add<PlaybackCommand>();
  p.add<TutorCommand>();
  p.add<JoinCommand>();
  p.add<ScoreCommand>();
#ifdef OSTEO_WITH_MOVIE
  p.add<MovieCommand>();
#endif
  p.add<ReviewCommand>();
  p.add<ExportCommand>();
  p.add<SoundCommand>();
  p.add<HeatCommand>();
  p.add<MonitorCommand>();
  p.add<StreamCommand>();
  p.add<ConsoleCommand>();
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
  p.add<WatchCommand>();
  p.add<DoctorCommand>();
  p.add<DemoCommand>();
  p.add<BenchCommand>();
  p.add<DocsCommand>();
  return p;
}

}  // namespace osteo
