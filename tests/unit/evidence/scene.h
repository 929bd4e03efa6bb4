// A block of bone with structures in it, and sessions on it: what metrics are held against.
#pragma once
#include <functional>
#include <memory>

#include "osteo/bone/structure_map.h"
#include "osteo/bone/world.h"
#include "osteo/evidence/score.h"

namespace osteo::test {

// Bone where `inside` is positive (mm from the face, as a signed distance), voxels of h, in a cube of `size_mm` around the origin; `shift`
// moves the lattice, not the bone.
inline World solid_world(const std::function<double(Vec3)>& inside, double h, double size_mm, Vec3 shift = {}, double turn = 0) {
  Frame f;
  const int n = static_cast<int>(std::ceil(size_mm / h / 8)) * 8;
  f.dims = {n, n, n};
  f.spacing_mm = {h, h, h};
  f.direction = rotation_about({}, normalized({1, 2, 3}), turn).rotation;
  f.origin_mm = f.direction * (Vec3{1, 1, 1} * ((1 - n) * h / 2)) + shift;  // faces at multiples of h
  std::vector<Ijk> bricks;
  for (int k = 0; k < n / 8; ++k)
    for (int j = 0; j < n / 8; ++j)
      for (int i = 0; i < n / 8; ++i) bricks.push_back({i, j, k});
  BrickGrid g(f, bricks);
  for (int k = 0; k < n; ++k)
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i) {
        const double d = inside(f.world_from_index({double(i), double(j), double(k)}));
        g.set(g.find(i, j, k), static_cast<float>(std::clamp(d / h + 0.5, 0.0, 1.0)));
      }
  return World(std::move(g));
}

// `value_of` says which structure a point lies in.
inline StructureMap structure_map(const std::function<std::uint8_t(Vec3)>& value_of, std::vector<Structure> structures, double h,
                                  double size_mm) {
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

}  // namespace osteo::test
