#include "commands.h"
#include "licence.h"
#include "osteo/stages/registry.h"

namespace osteo {

cli::Program make_osteo_program() {
  cli::Program p;
  p.about = "osteo: from a patient's CT to a bone that can be drilled and felt";
  p.licence = licence_of_all_stages();
  p.registry = osteo_stages();
  p.add<ListCommand>();
  p.add<InfoCommand>();
  p.add<SeriesCommand>();
  p.add<GuideCommand>();
  p.add<ConvertCommand>();
  p.add<RunCommand>();
  p.add<PrepareCommand>();
  p.add<ReportCommand>();
  p.add<ApproveCommand>();
  p.add<EditCommand>();
  p.add<HandOverCommand>();
  p.add<TakeBackCommand>();
  p.add<SceneCommand>();
  p.add<PlanCommand>();
  p.add<RehearseCommand>();
  p.add<ReplayCommand>();
  p.add<ScoreCommand>();
  p.add<ExportCommand>();
  p.add<SoundCommand>();
  p.add<HeatCommand>();
  p.add<ExperimentCommand>();
  p.add<StudyCommand>();
  p.add<DevicesCommand>();
  p.add<MarkersCommand>();
  p.add<CalibrateCameraCommand>();
  p.add<CalibratePenCommand>();
  p.add<TrackPenCommand>();
  p.add<DoctorCommand>();
  p.add<DemoCommand>();
  p.add<BenchCommand>();
  p.add<DocsCommand>();
  return p;
}

}  // namespace osteo
