#include "batch_command.h"
#include "commands.h"
#include "licence.h"
#include "osteo/app/stages/registry.h"
#include "pacs_commands.h"
#ifdef OSTEO_WITH_MOVIE
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
  p.add<ExperimentCommand>();
  p.add<GroundTruthCommand>();
  p.add<StudyCommand>();
  p.add<SimulateTraineeCommand>();
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
