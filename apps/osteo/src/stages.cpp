#include "stages.h"

#include "osteo/bone/stages.h"
#include "osteo/dicom/import.h"
#include "osteo/distance/compare.h"
#include "osteo/distance/stages.h"
#include "osteo/grid/import_bone.h"
#include "osteo/grid/resample.h"
#include "osteo/haptics/curve_stage.h"
#include "osteo/image/crop.h"
#include "osteo/image/phantom.h"
#include "osteo/image/structures.h"
#include "osteo/image/threshold.h"
#include "osteo/mesh/bone_surface.h"
#include "osteo/meshing/stages.h"
#include "osteo/tets/skin.h"
#include "osteo/tissue/calibrate.h"
#include "osteo/tissue/stages.h"
#include "osteo/view/snapshot.h"

namespace osteo {

Registry osteo_stages() {
  Registry registry;
  registry.add<ImportStage>();
  registry.add<ImportBoneStage>();
  registry.add<CropStage>();
  registry.add<ThresholdStage>();
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
  registry.add<FemStage>();
  registry.add<CalibrateStage>();
  registry.add<SimulateStage>();
  registry.add<SawStage>();
  registry.add<PiecesStage>();
  registry.add<CurveStage>();
  registry.add<SnapshotStage>();
  registry.add<StructuresStage>();
  registry.add<PhantomStage>();
  return registry;
}

}  // namespace osteo
