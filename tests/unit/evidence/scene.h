// A block of bone with structures in it, and sessions on it: what metrics are held against.
#pragma once
#include <functional>
#include <memory>

#include "osteo/assessment/evidence/score.h"
#include "osteo/assessment/evidence/visibility.h"
#include "osteo/geometry/grid/brick_places.h"
#include "osteo/simulation/bone/structure_map.h"
#include "osteo/simulation/bone/world.h"
#include "soft_solid.h"

namespace osteo::test {

// Bone where `inside` is positive (mm from the face, as a signed distance), voxels of h, in a cube of `size_mm` around
// the origin; `shift` moves the lattice, not the bone.
inline World solid_world(const std::function<double(Vec3)>& inside, double h, double size_mm, Vec3 shift = {},
                         double turn = 0) {
  Frame f;
  const int n = static_cast<int>(std::ceil(size_mm / h / 8)) * 8;
  f.dims = {n, n, n};
  f.spacing_mm = {h, h, h};
  f.direction = rotation_about({}, normalized({1, 2, 3}), turn).rotation;
  f.origin_mm = f.direction * (Vec3{1, 1, 1} * ((1 - n) * h / 2)) + shift;  // faces at multiples of h
  return World(soft_solid(f, inside));
}

// `value_of` says which structure a point lies in.
inline StructureMap structure_map(const std::function<std::uint8_t(Vec3)>& value_of, std::vector<Structure> structures,
                                  double h, double size_mm) {
  Labels l;
  const int n = static_cast<int>(std::ceil(size_mm / h));
  l.frame.dims = {n, n, n};
  l.frame.spacing_mm = {h, h, h};
  l.frame.origin_mm = Vec3{1, 1, 1} * (-(n - 1) * h / 2);
  const auto v = make_voxels<std::uint8_t>(l.frame.voxel_count());
  std::size_t at = 0;
  for (int k = 0; k < n; ++k)
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i) v[at++] = value_of(l.frame.world_from_index({double(i), double(j), double(k)}));
  l.voxels = v;
  l.structures = std::move(structures);
  return StructureMap(l);
}

// Bone before and after; what is gone.
struct Drilled {
  World before, after;
  std::vector<RemovedVoxel> removed;
};
// `bone`, `kept`: as depths in mm; what is left is bone that is kept. Lattice as in solid_world().
inline Drilled drilled(const std::function<double(Vec3)>& bone, const std::function<double(Vec3)>& kept, double h,
                       double size_mm, Vec3 shift = {}, double turn = 0) {
  Drilled c{solid_world(bone, h, size_mm, shift, turn),
            solid_world([&](Vec3 p) { return std::min(bone(p), kept(p)); }, h, size_mm, shift, turn),
            {}};
  const BrickGrid &a = c.before.bodies().front().body->bone, &b = c.after.bodies().front().body->bone;
  for (VoxelKey v = 0; v < a.brick_count() * BrickGrid::kVoxels; ++v) {
    if (a.value(v) >= kSolid && b.value(v) < kSolid)
      c.removed.push_back({place_of_voxel_mm(a, v), static_cast<float>(h * h * h)});
  }
  return c;
}
// A shaft from above, its floor at `floor` and its radius `r` around (x, 0).
inline std::function<double(Vec3)> shaft(double floor, double r, double x = 0) {
  return [=](Vec3 p) { return std::max(floor - p.z, std::hypot(p.x - x, p.y) - r); };
}

}  // namespace osteo::test
