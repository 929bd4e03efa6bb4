#include "image.h"

#include <cmath>

#include "osteo/core/base/error.h"

namespace osteo::inline app {

StageInfo CropStage::info() {
  return {.name = "crop",
          .version = 1,
          .synopsis = "a region cut out: a box in mm, a temporal bone, the jaw",
          .description =
              "Cuts whole voxels; nothing is resampled, everything stays where it was in the patient. The temporal "
              "bones and the jaw are "
              "found from the skull; the box that was cut is reported, so that it can be moved with --centre-mm.",
          .inputs = {{"image", {DataKind::image}, "CT in HU"},
                     {"labels", {DataKind::labels}, "label map to cut alike", true}},
          .outputs = {{"image", {DataKind::image}, "the region"},
                      {"labels", {DataKind::labels}, "label map of the region", true}},
          .references = {},
          .example = "osteo crop ct.nrrd ear.nrrd --region left_temporal"};
}

std::vector<Data> CropStage::run(const Params& params, std::span<const Data> inputs, const Context& context) {
  const auto& ct = std::get<Image>(inputs[0]);
  const auto* const labels = std::get_if<Labels>(&inputs[1]);
  if (params.region == Region::whole) {
    if (params.size_mm != std::array<double, 3>{})
      throw Error(ExitCode::usage, "--size-mm needs a region: --region box");
    return {ct, labels != nullptr ? Data(*labels) : Data(std::monostate{})};
  }
  const Box box = find_region(ct, params);
  const Vec3 centre = (box.lo_mm + box.hi_mm) * 0.5, size = box.hi_mm - box.lo_mm;
  const auto text = [](Vec3 v) {
    const auto r = [](double x) { return format_number(std::round(x * 10) / 10); };
    return r(v.x) + "," + r(v.y) + "," + r(v.z);
  };
  context.report("centre_mm", text(centre));
  context.report("size_mm", text(size));
  if (const std::string beyond = bone_beyond_scan(ct, box); params.region != Region::box && !beyond.empty())
    context.warn("the scan ends within the region, where there is bone: " + beyond);
  Data cut_labels;
  if (labels != nullptr) cut_labels = crop(*labels, box);
  return {crop(ct, box), cut_labels};
}

StageInfo ThresholdStage::info() {
  return {
      .name = "threshold",
      .version = 3,
      .synopsis = "bone mask from a CT by Hounsfield units",
      .description =
          "Marks the voxels between two HU values, then cleans the mask: table and head holder, streaks near metal, "
          "hysteresis, closing, "
          "filling of cavities, and removal of small components. Small components go (--min-volume-mm3 0 keeps them), "
          "and "
          "table and holder where "
          "that is "
          "certain (--keep-table leaves them on; what is left though it may be table is listed); the rest is off "
          "unless "
          "asked for. With "
          "--preset the lower value "
          "is found from the scan: cortical for thick bone, cellular for the mastoid's walls, thin for the orbit's.",
      .inputs = {{"image", {DataKind::image}, "CT in HU"}},
      .outputs = {{"mask", {DataKind::labels}, "1 in bone, 0 elsewhere"}},
      .references = {"D. Morris, Haptics and Physical Simulation for Virtual Bone Surgery, 2006, section 3.2.1",
                     "S. Prevrhal et al., Accuracy limits for the determination of cortical width and density, Phys. "
                     "Med. Biol. 1999"},
      .example = "osteo threshold ct.nrrd bone.nrrd --lower 250 --core 500"};
}

std::vector<Data> ThresholdStage::run(const Params& params, std::span<const Data> inputs, const Context& context) {
  return {threshold(std::get<Image>(inputs[0]), params, context)};
}

StageInfo StructuresStage::info() {
  return {.name = "structures",
          .version = 2,
          .synopsis = "a label map of another program as named structures of a case",
          .description =
              "Takes NRRD (with the names of 3D Slicer), NIfTI, MetaImage, VTI or DICOM SEG, names and colours each "
              "value, and checks that "
              "it lies "
              "where the CT lies.",
          .inputs = {{"labels", {DataKind::labels}, "label map: nerves, vessels, ossicles"},
                     {"image", {DataKind::image}, "CT that it belongs to, for a check", true}},
          .outputs = {{"structures", {DataKind::labels}, "label map with names and colours"}},
          .references = {},
          .example = "osteo structures segmentation.dcm structures.seg.nrrd --image ct.nrrd --names '1=facial nerve'"};
}

std::vector<Data> StructuresStage::run(const Params& params, std::span<const Data> inputs, const Context& context) {
  const auto* const ct = std::get_if<Image>(&inputs[1]);
  return {name_structures(std::get<Labels>(inputs[0]), params, ct, context)};
}

StageInfo PhantomStage::info() {
  return {
      .name = "phantom",
      .version = 2,
      .synopsis = "a synthetic CT of a head, or of a fibula, whose every boundary is known",
      .description =
          "Skull, jaw with teeth, and temporal bones with air cells, ear canal, ossicles, labyrinth, facial nerve, "
          "sigmoid sinus and "
          "tegmen in sizes of published anatomy, and a bead on the left side only. A fibula is a "
          "shaft with a canal of marrow. Voxels hold the mean over their "
          "volume, spread as by "
          "a scanner, plus noise (--seed). Give a folder as output for a DICOM series.",
      .inputs = {},
      .outputs =
          {{"image", {DataKind::image}, "CT in HU"},
           {"labels",
            {DataKind::labels},
            "exact tissue at each voxel centre: 0 air, 1 soft tissue, 2 cortical bone, 3 walls of air cells, 4 "
            "mandible, 5 ossicles, "
            "6 facial nerve, 7 sigmoid sinus, 8 left marker, 9 diploe, 10 marrow of the jaw, 11 teeth, 12 labyrinth, "
            "13 chorda "
            "tympani, 14 alveolar nerve, 15 carotid artery, 16 dura, 17 air cells, 18 ear canal, 19 tympanic cavity",
            true}},
      .references = {},
      .example = "osteo phantom ct.nrrd --labels-out labels.nrrd --region temporal --spacing-mm 0.5"};
}

std::vector<Data> PhantomStage::run(const Params& params, std::span<const Data>, const Context& context) {
  Phantom phantom = make_phantom(params, context);
  return {phantom.ct, phantom.labels};
}

}  // namespace osteo::inline app
