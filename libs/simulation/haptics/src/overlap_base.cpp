#include "overlap_loops.h"

void osteo::overlap::brick_base(const Shape& shape, const float* values, const float* first, VoxelKey key, Sums& sums,
                                HitList& list, PartialList& partial) {
  run_brick(shape, values, first, key, sums, list, partial);
}

const osteo::overlap::GrainFunctions osteo::overlap::kGrainsBase{&take_grains, &grains_beyond};
