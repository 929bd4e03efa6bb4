// A part of the phantom's left ear: bone around the mastoid segment of the facial nerve, and the nerve as a structure.
#pragma once
#include <memory>
#include <vector>

#include "osteo/core/data/volume.h"
#include "osteo/geometry/grid/brick_grid.h"
#include "osteo/imaging/image/detail/head_anatomy.h"

namespace osteo::test {

struct Ear {
  BrickGrid bone;
  Labels labels;
};

// 20 x 16 x 16 mm in voxels of h: about 40,000 samples at 0.5 mm.
inline Ear ear(const HeadAnatomy& head, double h) {
  Frame f;
  const auto n = [h](double mm) { return static_cast<int>(mm / h / 8) * 8; };
  f.dims = {n(20), n(16), n(16)};
  f.spacing_mm = {h, h, h};
  f.origin_mm = {40, 2, -41};
  Ear e{BrickGrid::dense(f), {}};
  auto values = make_voxels<std::uint8_t>(f.voxel_count());
  std::size_t at = 0;
  for (int k = 0; k < f.dims[2]; ++k)
    for (int j = 0; j < f.dims[1]; ++j)
      for (int i = 0; i < f.dims[0]; ++i) {
        const Tissue t = head.tissue(f.world_from_index({double(i), double(j), double(k)}));
        values[at++] = t == Tissue::facial_nerve ? 6 : 0;
        e.bone.set(e.bone.find(i, j, k), is_bone(t) ? 1.0F : 0.0F);
      }
  e.labels.frame = f;
  e.labels.voxels = values;
  e.labels.structures = {{6, "Facial nerve", {240, 220, 60}}};
  return e;
}

}  // namespace osteo::test
