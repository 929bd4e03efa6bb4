#include "osteo/bone/pieces.h"

#include <algorithm>
#include <cmath>

namespace osteo {

RigidTransform rotation_about(Vec3 point, Vec3 axis, double angle) {
  const double c = std::cos(angle), s = std::sin(angle);
  RigidTransform r;
  const Vec3 unit[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  for (std::size_t k = 0; k < 3; ++k) r.rotation.column[k] = unit[k] * c + cross(axis, unit[k]) * s + axis * (dot(axis, unit[k]) * (1 - c));
  r.shift_mm = point - r.rotation * point;
  return r;
}

Split split_bone(const BrickGrid& bone, double least_mm3, Connectivity connectivity) {
  LiveComponents components(bone, connectivity);
  const auto found = components.update();
  const double voxel_mm3 = bone.frame().voxel_volume_mm3();
  Split split;
  // Component -> piece, largest first; equals by their first voxel.
  std::vector<std::uint32_t> order(found.size());
  for (std::uint32_t c = 0; c < order.size(); ++c) order[c] = c;
  std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) { return found[a].mass > found[b].mass; });
  std::vector<std::uint32_t> piece_of(found.size(), LiveComponents::kNone);
  std::uint32_t count = 0;
  for (const std::uint32_t c : order) {
    if (found[c].mass * voxel_mm3 < least_mm3) {
      ++split.crumbs;
    } else {
      piece_of[c] = count++;
    }
  }
  // Owner of every voxel with density; then each piece's bricks.
  constexpr std::uint32_t kDust = LiveComponents::kNone;
  std::vector<std::uint32_t> owner(bone.brick_count() * BrickGrid::kVoxels, kDust);
  std::vector<std::vector<Ijk>> bricks(count);
  std::vector<std::uint32_t> in_brick;
  for (std::uint32_t b = 0; b < bone.brick_count(); ++b) {
    in_brick.clear();
    for (std::uint32_t v = 0; v < BrickGrid::kVoxels; ++v) {
      const VoxelKey key = b * BrickGrid::kVoxels + v;
      const float density = bone.value(key);
      if (density <= 0) continue;
      const std::uint32_t own = components.component_of(key);
      std::uint32_t piece = own == LiveComponents::kNone ? kDust : piece_of[own];
      if (own == LiveComponents::kNone) {
        std::array<std::uint32_t, 26> near;
        std::size_t n = 0;
        const Ijk c = bone.coordinate(key);
        for (int d = 0; d < 27; ++d) {
          if (d == 13) continue;
          const VoxelKey other = bone.find(c.i + d % 3 - 1, c.j + d / 3 % 3 - 1, c.k + d / 9 - 1);
          if (other == BrickGrid::kNone) continue;
          if (const std::uint32_t o = components.component_of(other); o != LiveComponents::kNone) near[n++] = o;
        }
        std::sort(near.begin(), near.begin() + static_cast<std::ptrdiff_t>(n));
        std::size_t most = 0;
        for (std::size_t i = 0; i < n;) {
          std::size_t j = i;
          while (j < n && near[j] == near[i]) ++j;
          if (j - i > most) {
            most = j - i;
            piece = piece_of[near[i]];
          }
          i = j;
        }
      }
      if (piece == kDust) {
        split.crumbs_mm3 += static_cast<double>(density) * voxel_mm3;
        continue;
      }
      owner[key] = piece;
      if (std::find(in_brick.begin(), in_brick.end(), piece) == in_brick.end()) in_brick.push_back(piece);
    }
    for (const std::uint32_t p : in_brick) bricks[p].push_back(bone.brick_coordinate(b));
  }
  for (std::uint32_t p = 0; p < count; ++p) {
    Piece piece;
    piece.bone = BrickGrid(bone.frame(), std::move(bricks[p]));
    for (std::uint32_t b = 0; b < piece.bone.brick_count(); ++b) {
      const Ijk o = piece.bone.brick_coordinate(b);
      const std::uint32_t from = bone.find_brick(o.i, o.j, o.k);
      for (std::uint32_t v = 0; v < BrickGrid::kVoxels; ++v) {
        if (owner[from * BrickGrid::kVoxels + v] == p)
          piece.bone.set(b * BrickGrid::kVoxels + v, bone.value(from * BrickGrid::kVoxels + v));
      }
    }
    piece.volume_mm3 = piece.bone.sum() * voxel_mm3;
    piece.solid = found[static_cast<std::size_t>(std::find(piece_of.begin(), piece_of.end(), p) - piece_of.begin())];
    split.pieces.push_back(std::move(piece));
  }
  return split;
}

}  // namespace osteo
