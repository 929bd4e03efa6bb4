#include "osteo/app/stages/registry.h"

#include "bone.h"
#include "bone_stiffness.h"
#include "distance.h"
#include "edit.h"
#include "enhance.h"
#include "fit_damping.h"
#include "image.h"
#include "import.h"
#include "neural.h"
#include "osteo/app/stages/mesh.h"
#include "planning.h"
#include "register.h"
#include "segment.h"
#include "snapshot.h"
#include "tissue.h"
#include "virtual_fixture.h"

namespace osteo::inline app {

Registry osteo_stages() {
  Registry registry;
  registry.add<ImportStage>();
  registry.add<ImportBoneStage>();
  registry.add<CropStage>();
  registry.add<DenoiseStage>();
  registry.add<ReduceMetalStage>();
  registry.add<ThresholdStage>();
  registry.add<ApplyEditsStage>();
  registry.add<ResampleStage>();
  registry.add<SurfaceStage>();
  registry.add<MeshInfoStage>();
  registry.add<MeshRepairStage>();
  registry.add<CompareStage>();
  registry.add<DistanceStage>();
  registry.add<DistanceAtStage>();
  registry.add<VoxelizeStage>();
  registry.add<TetrahedralizeStage>();
  registry.add<EmbedSurfaceStage>();
  registry.add<BoneStiffnessStage>();
  registry.add<FemStage>();
  registry.add<CalibrateStage>();
  registry.add<SimulateStage>();
  registry.add<FitDampingStage>();
  registry.add<SawStage>();
  registry.add<SeparateFragmentsStage>();
  registry.add<VirtualFixtureStage>();
  registry.add<SnapshotStage>();
  registry.add<StructuresStage>();
  registry.add<TubeStage>();
  registry.add<FindStructuresStage>();
  registry.add<SegmentNetworkStage>();
  registry.add<RegisterStage>();
  registry.add<PlanReconstructionStage>();
  registry.add<CuttingGuideStage>();
  registry.add<OutcomeStage>();
  registry.add<PhantomStage>();
  return registry;
}

}  // namespace osteo::inline app
