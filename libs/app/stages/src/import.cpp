#include "import.h"

#include "osteo/imaging/dicom/volume.h"

namespace osteo::inline app {

StageInfo ImportStage::info() {
  return {
      .name = "import",
      .version = 3,
      .synopsis = "a CT from DICOM, NRRD, NIfTI, MetaImage or VTI as one volume in HU",
      .description =
          "Takes a folder of DICOM files, a DICOMDIR, a zip, or one volume file, applies the HU scale and places each "
          "voxel in LPS mm, "
          "each slice where its own position says. Even, straight slices are taken voxel for voxel; a tilted gantry or "
          "uneven distances "
          "are resampled onto upright slices. What cannot be placed rightly is rejected. Beside the output a verdict "
          "(JSON) says what was "
          "found, which slice came from which file, and what a person should do. 'osteo import --list FOLDER' shows "
          "the series.",
      .inputs = {{"source",
                  {DataKind::source},
                  "DICOM folder, DICOMDIR, zip, or one slice of a series, or a volume file"}},
      .outputs = {{"image", {DataKind::image}, "CT in HU"},
                  {"verdict",
                   {DataKind::document},
                   "what was found, also when the series is rejected",
                   true,
                   ".verdict.json"}},
      .references = {"DICOM PS3.3 C.7.6.2, Image Plane Module", "DICOM PS3.3 C.7.6.16, Multi-frame Functional Groups"},
      .example = "osteo import DICOM_FOLDER ct.nrrd"};
}

std::vector<Data> ImportStage::run(const Params& params, std::span<const Data> inputs, const Context& context) {
  try {
    Imported imported = import_ct(std::get<Source>(inputs[0]).path, params, context);
    return {std::move(imported.image), Document{to_json(imported.verdict)}};
  } catch (const Refused& e) {
    throw ErrorWithDocument(e, "verdict", {to_json(e.verdict())}, picture_of(e.verdict()));
  }
}

StageInfo ImportBoneStage::info() {
  return {
      .name = "import-bone",
      .version = 2,
      .synopsis = "DICOM straight to sparse bone, without the volume in memory",
      .description =
          "Reads slices a few at a time, places each by its own position and samples isotropic voxels between them in "
          "one pass: a tilted "
          "or uneven series is interpolated once instead of twice, and a scan of any length needs little memory. "
          "Thresholds and drops "
          "small components on the way. 'import', 'threshold' and 'resample' do the same in steps with more choices.",
      .inputs = {{"source", {DataKind::source}, "DICOM folder, DICOMDIR, file or zip"}},
      .outputs = {{"bone", {DataKind::grid}, "bone density, 0 to 1"},
                  {"hu", {DataKind::grid}, "CT value in the voxels that hold bone", true},
                  {"valid", {DataKind::grid}, "where the scan measured at all", true},
                  {"verdict",
                   {DataKind::document},
                   "what was found, also when the series is rejected",
                   true,
                   ".verdict.json"}},
      .references = {"DICOM PS3.3 C.7.6.2, Image Plane Module",
                     "K. Museth, VDB: High-Resolution Sparse Volumes with Dynamic Topology, ACM TOG 2013"},
      .example = "osteo import-bone DICOM_FOLDER bone.vdb --lower 300 --spacing-mm 0.5"};
}

std::vector<Data> ImportBoneStage::run(const Params& params, std::span<const Data> inputs, const Context& context) {
  try {
    ImportedBone bone = import_bone(std::get<Source>(inputs[0]).path, params, context);
    return {bone.density, bone.hu, bone.valid, Document{to_json(bone.verdict)}};
  } catch (const Refused& e) {
    throw ErrorWithDocument(e, "verdict", {to_json(e.verdict())}, picture_of(e.verdict()));
  }
}

}  // namespace osteo::inline app
