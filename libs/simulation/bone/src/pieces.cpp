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
  const auto within = [](int x) { return ((x & 7) - 1U) < 6U; };
  const bool inner = within(c.i) && within(c.j) && within(c.k);  // its neighbours are in the same brick
  for (int d = 0; d < 27; ++d) {
    if (d == 13) continue;
    const int i = d % 3 - 1, j = d / 3 % 3 - 1, k = d / 9 - 1;
    const VoxelKey other =
        inner ? key + static_cast<VoxelKey>(i + 8 * j + 64 * k) : bone.find(c.i + i, c.j + j, c.k + k);
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

// Which component is which piece.
struct Pieces {
  std::vector<std::uint32_t> of_component;  // kCrumb: none, it is too small
  std::vector<std::uint32_t> component;     // of each piece
  std::uint64_t crumbs = 0;
};

// Largest first; equals by their first voxel.
Pieces pieces_of(std::span<const LiveComponents::Component> found, double voxel_mm3, double least_mm3) {
  Pieces p;
  p.of_component.assign(found.size(), kCrumb);
  std::vector<std::uint32_t> order(found.size());
  for (std::uint32_t c = 0; c < order.size(); ++c) order[c] = c;
  std::stable_sort(order.begin(), order.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return found[a].mass > found[b].mass; });
  for (const std::uint32_t c : order) {
    if (found[c].mass * voxel_mm3 < least_mm3) {
      ++p.crumbs;
    } else {
      p.of_component[c] = static_cast<std::uint32_t>(p.component.size());
      p.component.push_back(c);
    }
  }
  return p;
}

// Takes bone apart: whose each brick is, then whose each voxel is where parts meet.
class Splitting {
 public:
  Splitting(const BrickGrid& bone, const LiveComponents& components, const Pieces& pieces)
      : bone_(bone), components_(components), of_component_(pieces.of_component), bricks_(pieces.component.size()) {
    split_.pieces.resize(pieces.component.size());
    split_.crumbs = pieces.crumbs;
  }
  Split split() {
    find_near();
    whose_ = near_;
    for (std::uint32_t b = 0; b < bone_.brick_count(); ++b) {
      if (near_[b] != 0) assign_brick(b);
    }
    split_.pieces[0].bone = bone_.sharing();
    split_.pieces[0].bone.empty_bricks(split_.changed_bricks);
    for (std::uint32_t p = 1; p < split_.pieces.size(); ++p) make_piece(p);
    write_apart();
    return std::move(split_);
  }

 private:
  // Who owns the solid voxels of each brick; then of the bricks around it too: there alone parts can meet.
  void find_near() {
    std::vector<std::uint32_t> owner(bone_.brick_count(), kNobody);
    near_.assign(bone_.brick_count(), kNobody);
    for (std::uint32_t b = 0; b < owner.size(); ++b) {
      for (const std::uint32_t c : components_.components_of_brick(b)) owner[b] = both(owner[b], of_component_[c]);
    }
    for (std::uint32_t b = 0; b < owner.size(); ++b) {
      for_neighbours(bone_, b, [&](std::uint32_t n) { near_[b] = both(near_[b], owner[n]); });
      // What is near nothing solid stays with the largest.
      if (near_[b] == kNobody) near_[b] = 0;
    }
  }

  // One that is not near the first piece alone.
  void assign_brick(std::uint32_t b) {
    // Most bricks are of one piece alone.
    if (near_[b] != kSeveral && near_[b] != kCrumb) {
      whose_[b] = kNobody;
      if (!holds_bone(bone_, b)) return;
      whose_[b] = near_[b];
      bricks_[near_[b]].push_back(bone_.brick_coordinate(b));
      split_.changed_bricks.push_back(b);
      return;
    }
    const double voxel_mm3 = bone_.frame().voxel_volume_mm3();
    std::vector<std::uint32_t> in_brick;
    std::uint32_t whose = kNobody;
    for (std::uint32_t v = 0; v < BrickGrid::kVoxels; ++v) {
      const VoxelKey key = b * BrickGrid::kVoxels + v;
      const float density = bone_.value(key);
      if (density <= 0) continue;
      std::uint32_t piece = near_[b];
      if (piece == kSeveral) {
        const std::uint32_t own = components_.component_of(key);
        piece =
            own == LiveComponents::kNone ? nearest_owner(bone_, components_, of_component_, key) : of_component_[own];
        apart_.emplace_back(key, piece);
      }
      whose = both(whose, piece);
      if (piece == kCrumb) {
        split_.crumbs_mm3 += static_cast<double>(density) * voxel_mm3;
        split_.loose.emplace_back(key, density);
      } else if (piece != 0 && std::find(in_brick.begin(), in_brick.end(), piece) == in_brick.end()) {
        in_brick.push_back(piece);
      }
    }
    for (const std::uint32_t p : in_brick) bricks_[p].push_back(bone_.brick_coordinate(b));
    whose_[b] = whose;
    if (whose != 0 && whose != kNobody) split_.changed_bricks.push_back(b);
  }

  void make_piece(std::uint32_t p) {
    Piece& piece = split_.pieces[p];
    piece.bone = BrickGrid(bone_.frame(), std::move(bricks_[p]));
    for (std::uint32_t b = 0; b < piece.bone.brick_count(); ++b) {
      const Ijk o = piece.bone.brick_coordinate(b);
      const std::uint32_t from = bone_.find_brick(o.i, o.j, o.k);
      piece.origin.brick.push_back(from);
      bool unchanged = true;
      for_neighbours(bone_, from, [&](std::uint32_t n) { unchanged = unchanged && both(whose_[n], p) == p; });
      piece.origin.unchanged.push_back(unchanged ? 1 : 0);
      if (whose_[from] == p) piece.bone.share_brick(b, bone_, from);
    }
  }

  void write_apart() {
    for (const auto& [key, p] : apart_) {
      // A brick that is one piece's after all is shared with the bone, which others are reading: nothing is written
      // there, not even the same.
      if (p == kCrumb || whose_[key / BrickGrid::kVoxels] == p) continue;
      const Ijk c = bone_.coordinate(key);
      BrickGrid& to = split_.pieces[p].bone;
      to.set(p == 0 ? key : to.find(c.i, c.j, c.k), bone_.value(key));
    }
  }

  const BrickGrid& bone_;
  const LiveComponents& components_;
  const std::vector<std::uint32_t>& of_component_;
  std::vector<std::uint32_t> near_;                        // of each brick: whose solid voxels are in it and around it
  std::vector<std::uint32_t> whose_;                       // it is after all
  std::vector<std::vector<Ijk>> bricks_;                   // of each piece
  std::vector<std::pair<VoxelKey, std::uint32_t>> apart_;  // voxels of bricks where parts meet, and whose they are
  Split split_;
};

}  // namespace

Split split_bone(const BrickGrid& bone, double least_mm3, Connectivity connectivity) {
  return split_bone(bone, LiveComponents(bone, connectivity), least_mm3);
}

Split split_bone(const BrickGrid& bone, const LiveComponents& components, double least_mm3) {
  const auto found = components.components();
  const double voxel_mm3 = bone.frame().voxel_volume_mm3();
  const Pieces pieces = pieces_of(found, voxel_mm3, least_mm3);
  if (pieces.component.empty()) {
    Split split;
    split.crumbs = pieces.crumbs;
    for (VoxelKey v = 0; v < bone.brick_count() * BrickGrid::kVoxels; ++v) {
      if (bone.value(v) > 0) split.loose.emplace_back(v, bone.value(v));
    }
    split.crumbs_mm3 = bone.sum() * voxel_mm3;
    return split;
  }
  Split split = Splitting(bone, components, pieces).split();
  for (std::size_t p = 0; p < split.pieces.size(); ++p) split.pieces[p].solid = found[pieces.component[p]];
  return split;
}

}  // namespace osteo::inline simulation
