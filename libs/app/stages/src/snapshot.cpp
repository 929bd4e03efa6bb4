#include "snapshot.h"

namespace osteo::inline app {

StageInfo SnapshotStage::info() {
  return {.name = "snapshot",
          .version = 3,
          .synopsis = "a picture (PNG) of a CT, mask, grid, surface or tetrahedra",
          .description =
              "Three cuts through the middle (axial seen from the feet: the patient's left is on the right) and a lit "
              "view in "
              "3D. Of tetrahedra the half that faces away, with its edges, coloured by the values at its points where "
              "it has some; of a "
              "distance grid lines of equal distance. Needs no display.",
          .inputs = {{"subject",
                      {DataKind::image, DataKind::labels, DataKind::grid, DataKind::surface, DataKind::tets},
                      "what to show"},
                     {"mask", {DataKind::labels, DataKind::grid}, "tinted over the cuts and shown in 3D", true},
                     {"surface", {DataKind::surface}, "shown in 3D", true}},
          .outputs = {{"picture", {DataKind::picture}, "the picture"}},
          .references = {},
          .example = "osteo snapshot ct.nrrd picture.png --mask bone.nrrd --view left"};
}

std::vector<Data> SnapshotStage::run(const Params& params, std::span<const Data> inputs, const Context& context) {
  return {snapshot({inputs[0], inputs[1], inputs[2]}, params, context)};
}

}  // namespace osteo::inline app
