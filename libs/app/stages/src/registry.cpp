#include "osteo/app/stages/registry.h"

#include "osteo/app/stages/bone.h"
#include "osteo/app/stages/bone_stiffness.h"
#include "osteo/app/stages/curve.h"
#include "osteo/app/stages/distance.h"
#include "osteo/app/stages/edit.h"
#include "osteo/app/stages/enhance.h"
#include "osteo/app/stages/fit_damping.h"
#include "osteo/app/stages/image.h"
#include "osteo/app/stages/import.h"
#include "osteo/app/stages/mesh.h"
#include "osteo/app/stages/register.h"
#include "osteo/app/stages/segment.h"
#include "osteo/app/stages/snapshot.h"
#include "osteo/app/stages/tissue.h"

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
  registry.add<SkinStage>();
  registry.add<BoneStiffnessStage>();
  registry.add<FemStage>();
  registry.add<CalibrateStage>();
  registry.add<SimulateStage>();
  registry.add<FitDampingStage>();
  registry.add<SawStage>();
  registry.add<PiecesStage>();
  registry.add<CurveStage>();
  registry.add<SnapshotStage>();
  registry.add<StructuresStage>();
  registry.add<TubeStage>();
  registry.add<FindStructuresStage>();
  registry.add<RegisterStage>();
  registry.add<PhantomStage>();
  return registry;
}

}  // namespace osteo::inline app
