#include "osteo/simulation/bone/pieces.h"

#include <algorithm>

namespace osteo::inline simulation {
namespace {

constexpr std::uint32_t kCrumb = 0xfffffffeU, kNobody = 0xffffffffU, kSeveral = 0xfffffffdU;

std::uint32_t both(std::uint32_t a, std::uint32_t b) {
  return a == kNobody || a == b ? b : b == kNobody ? a : kSeveral;
}

// Of a voxel below a half: who most of its solid neighbours belong to, the first of equals; a crumb without any.
std::uint32_t nearest_owner(const BrickGrid& bone, const LiveComponents& components,
                            std::span<const std::uint32_t> piece_of, VoxelKey key) {
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
  std::uint32_t owner = kCrumb;
  std::size_t most = 0;
  for (std::size_t i = 0; i < n;) {
    std::size_t j = i;
    while (j < n && near[j] == near[i]) ++j;
    if (j - i > most) {
      most = j - i;
      owner = piece_of[near[i]];
    }
    i = j;
  }
  return owner;
}

bool holds_bone(const BrickGrid& bone, std::uint32_t brick) {
  const float* const v = bone.values_of_brick(brick);
  return std::any_of(v, v + BrickGrid::kVoxels, [](float density) { return density > 0; });
}

template <class F>
void for_neighbours(const BrickGrid& bone, std::uint32_t brick, F&& f) {
  const Ijk o = bone.brick_coordinate(brick);
  for (int d = 0; d < 27; ++d) {
    const std::uint32_t n = bone.find_brick(o.i + d % 3 - 1, o.j + d / 3 % 3 - 1, o.k + d / 9 - 1);
    if (n != BrickGrid::kNone) f(n);
  }
}

}  // namespace

Split split_bone(const BrickGrid& bone, double least_mm3, Connectivity connectivity) {
  return split_bone(bone, LiveComponents(bone, connectivity), least_mm3);
}

Split split_bone(const BrickGrid& bone, const LiveComponents& components, double least_mm3) {
  const auto found = components.components();
  const double voxel_mm3 = bone.frame().voxel_volume_mm3();
  Split split;
  // Component -> piece, largest first; equals by their first voxel.
  std::vector<std::uint32_t> order(found.size()), piece_of(found.size(), kCrumb);
  for (std::uint32_t c = 0; c < order.size(); ++c) order[c] = c;
  std::stable_sort(order.begin(), order.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return found[a].mass > found[b].mass; });
  std::vector<std::uint32_t> component_of_piece;
  for (const std::uint32_t c : order) {
    if (found[c].mass * voxel_mm3 < least_mm3) {
      ++split.crumbs;
    } else {
      piece_of[c] = static_cast<std::uint32_t>(component_of_piece.size());
      component_of_piece.push_back(c);
    }
  }
  const auto count = static_cast<std::uint32_t>(component_of_piece.size());
  if (count == 0) {
    for (VoxelKey v = 0; v < bone.brick_count() * BrickGrid::kVoxels; ++v) {
      if (bone.value(v) > 0) split.loose.emplace_back(v, bone.value(v));
    }
    split.crumbs_mm3 = bone.sum() * voxel_mm3;
    return split;
  }

  // Who owns the solid voxels of each brick; then of the bricks around it too: there alone parts can meet.
  std::vector<std::uint32_t> owner(bone.brick_count(), kNobody), around(bone.brick_count(), kNobody);
  for (std::uint32_t b = 0; b < owner.size(); ++b) {
    for (const std::uint32_t c : components.components_of_brick(b)) owner[b] = both(owner[b], piece_of[c]);
  }
  for (std::uint32_t b = 0; b < owner.size(); ++b) {
    for_neighbours(bone, b, [&](std::uint32_t n) { around[b] = both(around[b], owner[n]); });
    // What is near nothing solid stays with the largest.
    if (around[b] == kNobody) around[b] = 0;
  }
  split.pieces.resize(count);
  std::vector<std::vector<Ijk>> bricks(count);
  std::vector<std::uint32_t> in_brick;
  std::vector<std::pair<VoxelKey, std::uint32_t>> apart;  // voxels of bricks where parts meet, and whose they are
  const std::vector<std::uint32_t> near = around;
  for (std::uint32_t b = 0; b < bone.brick_count(); ++b) {
    if (near[b] == 0) continue;
    in_brick.clear();
    std::uint32_t whose = kNobody;
    // Most bricks are of one piece alone.
    if (near[b] != kSeveral && near[b] != kCrumb) {
      if (holds_bone(bone, b)) {
        whose = near[b];
        bricks[whose].push_back(bone.brick_coordinate(b));
        split.changed_bricks.push_back(b);
      }
      around[b] = whose;
      continue;
    }
    for (std::uint32_t v = 0; v < BrickGrid::kVoxels; ++v) {
      const VoxelKey key = b * BrickGrid::kVoxels + v;
      const float density = bone.value(key);
      if (density <= 0) continue;
      std::uint32_t piece = near[b];
      if (piece == kSeveral) {
        const std::uint32_t own = components.component_of(key);
        piece = own == LiveComponents::kNone ? nearest_owner(bone, components, piece_of, key) : piece_of[own];
        apart.emplace_back(key, piece);
      }
      whose = both(whose, piece);
      if (piece == kCrumb) {
        split.crumbs_mm3 += static_cast<double>(density) * voxel_mm3;
        split.loose.emplace_back(key, density);
      } else if (piece != 0 && std::find(in_brick.begin(), in_brick.end(), piece) == in_brick.end()) {
        in_brick.push_back(piece);
      }
    }
    for (const std::uint32_t p : in_brick) bricks[p].push_back(bone.brick_coordinate(b));
    // From now on: whose the brick is after all.
    around[b] = whose;
    if (whose != 0 && whose != kNobody) split.changed_bricks.push_back(b);
  }
  split.pieces[0].bone = bone.sharing();
  split.pieces[0].bone.empty_bricks(split.changed_bricks);
  for (std::uint32_t p = 1; p < count; ++p) {
    Piece& piece = split.pieces[p];
    piece.bone = BrickGrid(bone.frame(), std::move(bricks[p]));
    for (std::uint32_t b = 0; b < piece.bone.brick_count(); ++b) {
      const Ijk o = piece.bone.brick_coordinate(b);
      const std::uint32_t from = bone.find_brick(o.i, o.j, o.k);
      piece.origin.brick.push_back(from);
      bool unchanged = true;
      for_neighbours(bone, from, [&](std::uint32_t n) { unchanged = unchanged && both(around[n], p) == p; });
      piece.origin.unchanged.push_back(unchanged ? 1 : 0);
      if (around[from] == p) piece.bone.share_brick(b, bone, from);
    }
  }
  for (const auto& [key, p] : apart) {
    // A brick that is one piece's after all is shared with the bone, which others are reading: nothing is written
    // there, not even the same.
    if (p == kCrumb || around[key / BrickGrid::kVoxels] == p) continue;
    const Ijk c = bone.coordinate(key);
    BrickGrid& to = split.pieces[p].bone;
    to.set(p == 0 ? key : to.find(c.i, c.j, c.k), bone.value(key));
  }
  for (std::uint32_t p = 0; p < count; ++p) {
    split.pieces[p].solid = found[component_of_piece[p]];
  }
  return split;
}

}  // namespace osteo::inline simulation
