#include "overlap_loops.h"

void osteo::overlap::brick_avx2(const Shape& shape, const float* values, const float* first, VoxelKey key, Sums& sums,
                                HitList& list, PartialList& partial) {
  run_brick(shape, values, first, key, sums, list, partial);
}

const osteo::overlap::GrainFunctions osteo::overlap::kGrainsAvx2{&take_grains, &grains_beyond};
