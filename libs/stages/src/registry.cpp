#include "osteo/stages/registry.h"

#include "osteo/stages/bone.h"
#include "osteo/stages/bone_stiffness.h"
#include "osteo/stages/curve.h"
#include "osteo/stages/distance.h"
#include "osteo/stages/edit.h"
#include "osteo/stages/enhance.h"
#include "osteo/stages/fit_damping.h"
#include "osteo/stages/image.h"
#include "osteo/stages/import.h"
#include "osteo/stages/mesh.h"
#include "osteo/stages/register.h"
#include "osteo/stages/segment.h"
#include "osteo/stages/snapshot.h"
#include "osteo/stages/tissue.h"

namespace osteo {

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

}  // namespace osteo
