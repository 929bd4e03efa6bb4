#include "osteo/simulation/bone/live_components.h"

#include <algorithm>
#include <utility>

#include "osteo/core/base/union_find.h"

namespace osteo::inline simulation {
namespace {

constexpr float kSolid = 0.5F;

}  // namespace

LiveComponents::LiveComponents(const BrickGrid& bone, Connectivity connectivity)
    : bone_(&bone), bricks_(bone.brick_count()), is_dirty_(bone.brick_count(), 1), relink_(bone.brick_count(), 0) {
  for (int k = 0; k <= 1; ++k)
    for (int j = -1; j <= 1; ++j)
      for (int i = -1; i <= 1; ++i) {
        const bool further = k > 0 || (k == 0 && (j > 0 || (j == 0 && i > 0)));
        const bool face = std::abs(i) + std::abs(j) + std::abs(k) == 1;
        if (further && (face || connectivity == Connectivity::full)) steps_.push_back({i, j, k});
      }
  for (std::uint32_t b = 0; b < bricks_.size(); ++b) dirty_.push_back(b);
  update();
}

LiveComponents::LiveComponents(const BrickGrid& piece, LiveComponents& whole, const PieceOrigin& origin)
    : bone_(&piece),
      steps_(whole.steps_),
      bricks_(piece.brick_count()),
      is_dirty_(piece.brick_count(), 0),
      relink_(piece.brick_count(), 0) {
  std::vector<std::uint32_t> here(whole.bricks_.size(), kNone);
  for (std::uint32_t b = 0; b < bricks_.size(); ++b) here[origin.brick[b]] = b;
  for (std::uint32_t b = 0; b < bricks_.size(); ++b) {
    if (origin.unchanged[b] == 0) {
      mark_brick(b);
      continue;
    }
    bricks_[b] = std::exchange(whole.bricks_[origin.brick[b]], {});
    for (Link& l : bricks_[b].links) l.brick = here[l.brick];
  }
  if (dirty_.empty()) join_parts();
  update();
}

void LiveComponents::take_back(LiveComponents& piece, const PieceOrigin& origin) {
  for (std::uint32_t b = 0; b < piece.bricks_.size(); ++b) {
    if (origin.unchanged[b] == 0) continue;
    Brick& brick = bricks_[origin.brick[b]] = std::exchange(piece.bricks_[b], {});
    for (Link& l : brick.links) l.brick = origin.brick[l.brick];
  }
}

void LiveComponents::mark_brick(std::uint32_t b) {
  if (is_dirty_[b] != 0) return;
  is_dirty_[b] = 1;
  dirty_.push_back(b);
}

void LiveComponents::label(std::uint32_t number) {
  Brick& brick = bricks_[number];
  brick.solid = {};
  brick.parts.clear();
  std::array<float, 512> density;
  for (std::uint32_t v = 0; v < 512; ++v) {
    density[v] = bone_->value(number * BrickGrid::kVoxels + v);
    if (density[v] >= kSolid) brick.solid[v >> 6] |= 1ULL << (v & 63);
  }
  std::array<std::uint16_t, 512> parent;
  const auto solid = [&](int i, int j, int k) {
    return (brick.solid[static_cast<std::size_t>(k)] >> (j * 8 + i) & 1) != 0;
  };
  for (std::uint16_t v = 0; v < 512; ++v) parent[v] = v;
  for (int k = 0; k < 8; ++k) {
    if (brick.solid[static_cast<std::size_t>(k)] == 0) continue;
    for (int j = 0; j < 8; ++j) {
      for (int i = 0; i < 8; ++i) {
        if (!solid(i, j, k)) continue;
        for (const Ijk s : steps_) {
          const int x = i + s.i, y = j + s.j, z = k + s.k;
          if (((x | y | z) & ~7) != 0 || !solid(x, y, z)) continue;
          join_sets(parent, static_cast<std::uint16_t>(k * 64 + j * 8 + i),
                    static_cast<std::uint16_t>(z * 64 + y * 8 + x));
        }
      }
    }
  }
  const Ijk o = bone_->brick_coordinate(number);
  std::array<std::uint8_t, 512> name{};
  for (std::uint16_t v = 0; v < 512; ++v) {
    if ((brick.solid[v >> 6] >> (v & 63) & 1) == 0) continue;
    const std::uint16_t r = root_of(parent, v);
    if (r == v) {
      // At most 256 parts: no two of them touch.
      name[v] = static_cast<std::uint8_t>(brick.parts.size());
      brick.parts.push_back({});
      brick.parts.back().first = v;
    }
    brick.label[v] = name[r];
    Part& p = brick.parts[name[r]];
    const double m = static_cast<double>(density[v]);
    const double x[3] = {static_cast<double>(o.i * 8 + (v & 7)), static_cast<double>(o.j * 8 + (v >> 3 & 7)),
                         static_cast<double>(o.k * 8 + (v >> 6))};
    ++p.voxels;
    p.mass += m;
    for (std::size_t a = 0; a < 3; ++a) {
      p.moment[a] += m * x[a];
      p.second[a] += m * x[a] * x[a];
    }
    p.second[3] += m * x[0] * x[1];
    p.second[4] += m * x[0] * x[2];
    p.second[5] += m * x[1] * x[2];
  }
}

void LiveComponents::link(std::uint32_t number) {
  Brick& brick = bricks_[number];
  brick.links.clear();
  const Ijk o = bone_->brick_coordinate(number);
  for (const Ijk s : steps_) {
    for (int k = 0; k < 8; ++k) {
      for (int j = 0; j < 8; ++j) {
        // Within the brick along y and z, only the end of the row leads out of it.
        const bool inside = (((j + s.j) | (k + s.k)) & ~7) == 0;
        if (inside && s.i == 0) continue;
        const int begin = inside && s.i > 0 ? 7 : 0, end = inside && s.i < 0 ? 1 : 8;
        for (int i = begin; i < end; ++i) {
          const int x = i + s.i, y = j + s.j, z = k + s.k;
          const std::uint32_t v = static_cast<std::uint32_t>(k * 64 + j * 8 + i);
          if ((brick.solid[v >> 6] >> (v & 63) & 1) == 0) continue;
          const std::uint32_t other = bone_->find_brick(o.i + (x >> 3), o.j + (y >> 3), o.k + (z >> 3));
          if (other == BrickGrid::kNone) continue;
          const std::uint32_t w = BrickGrid::offset_in_brick(x, y, z);
          const Brick& there = bricks_[other];
          if ((there.solid[w >> 6] >> (w & 63) & 1) == 0) continue;
          const Link l{brick.label[v], there.label[w], other};
          const auto same = [&](const Link& k2) { return k2.from == l.from && k2.to == l.to && k2.brick == l.brick; };
          if (brick.links.empty() ||
              !(same(brick.links.back()) || std::any_of(brick.links.begin(), brick.links.end(), same)))
            brick.links.push_back(l);
        }
      }
    }
  }
}

std::span<const LiveComponents::Component> LiveComponents::update() {
  if (dirty_.empty()) return components_;
  std::vector<std::uint32_t> again;
  const auto relink = [&](std::uint32_t b) {
    if (relink_[b] == 0) again.push_back(b);
    relink_[b] = 1;
  };
  for (const std::uint32_t b : dirty_) {
    is_dirty_[b] = 0;
    label(b);
  }
  // Who links to a brick: those that have it further on. By faces these are three, by edges and corners all around.
  std::vector<Ijk> back;
  for (const Ijk s : steps_) {
    for (int axes = 1; axes < 8; ++axes) {
      const Ijk d{(axes & 1) != 0 ? -s.i : 0, (axes & 2) != 0 ? -s.j : 0, (axes & 4) != 0 ? -s.k : 0};
      if (d != Ijk{} && std::find(back.begin(), back.end(), d) == back.end()) back.push_back(d);
    }
  }
  for (const std::uint32_t b : dirty_) {
    relink(b);
    const Ijk o = bone_->brick_coordinate(b);
    for (const Ijk d : back) {
      const std::uint32_t n = bone_->find_brick(o.i + d.i, o.j + d.j, o.k + d.k);
      if (n != BrickGrid::kNone) relink(n);
    }
  }
  for (const std::uint32_t b : again) {
    relink_[b] = 0;
    link(b);
  }
  dirty_.clear();
  join_parts();
  return components_;
}

void LiveComponents::join_parts() {
  std::uint32_t parts = 0;
  for (Brick& b : bricks_) {
    b.first_part = parts;
    parts += static_cast<std::uint32_t>(b.parts.size());
  }
  parent_.resize(parts);
  for (std::uint32_t p = 0; p < parts; ++p) parent_[p] = p;
  for (const Brick& b : bricks_) {
    for (const Link& l : b.links) join_sets(parent_, b.first_part + l.from, bricks_[l.brick].first_part + l.to);
  }
  component_of_part_.assign(parts, kNone);
  components_.clear();
  struct Sums {
    std::array<double, 3> moment{};
    std::array<double, 6> second{};
  };
  std::vector<Sums> sums;
  for (std::uint32_t number = 0; number < bricks_.size(); ++number) {
    const Brick& b = bricks_[number];
    for (std::uint32_t p = 0; p < b.parts.size(); ++p) {
      const std::uint32_t r = root_of(parent_, b.first_part + p);
      if (component_of_part_[r] == kNone) {
        component_of_part_[r] = static_cast<std::uint32_t>(components_.size());
        components_.push_back({});
        components_.back().first = number * BrickGrid::kVoxels + b.parts[p].first;
        sums.push_back({});
      }
      const std::uint32_t c = component_of_part_[b.first_part + p] = component_of_part_[r];
      components_[c].voxels += b.parts[p].voxels;
      components_[c].mass += b.parts[p].mass;
      for (std::size_t a = 0; a < 3; ++a) sums[c].moment[a] += b.parts[p].moment[a];
      for (std::size_t a = 0; a < 6; ++a) sums[c].second[a] += b.parts[p].second[a];
    }
  }
  const Frame& f = bone_->frame();
  for (std::size_t c = 0; c < components_.size(); ++c) {
    Component& part = components_[c];
    const double m = part.mass, h = f.spacing_mm.x;
    const auto& s = sums[c];
    const Vec3 centre{s.moment[0] / m, s.moment[1] / m, s.moment[2] / m};
    part.centre_mm = f.world_from_index(centre);
    // Covariance along the grid's axes, each voxel a cube; turned into the world; inertia is its trace less itself.
    double cov[3][3];
    for (int a = 0; a < 3; ++a)
      cov[a][a] = s.second[static_cast<std::size_t>(a)] -
                  m * centre[static_cast<std::size_t>(a)] * centre[static_cast<std::size_t>(a)] + m / 12;
    cov[0][1] = cov[1][0] = s.second[3] - m * centre.x * centre.y;
    cov[0][2] = cov[2][0] = s.second[4] - m * centre.x * centre.z;
    cov[1][2] = cov[2][1] = s.second[5] - m * centre.y * centre.z;
    double world[3][3] = {};
    for (std::size_t a = 0; a < 3; ++a)
      for (std::size_t b = 0; b < 3; ++b)
        for (std::size_t i = 0; i < 3; ++i)
          for (std::size_t j = 0; j < 3; ++j)
            world[a][b] += f.direction.column[i][a] * cov[i][j] * f.direction.column[j][b] * h * h;
    const double trace = world[0][0] + world[1][1] + world[2][2];
    part.inertia_mm2 = {trace - world[0][0], trace - world[1][1], trace - world[2][2],
                        -world[0][1],        -world[0][2],        -world[1][2]};
  }
}

std::uint32_t LiveComponents::component_of(VoxelKey voxel) const {
  const Brick& b = bricks_[voxel / BrickGrid::kVoxels];
  const std::uint32_t v = voxel % BrickGrid::kVoxels;
  if ((b.solid[v >> 6] >> (v & 63) & 1) == 0) return kNone;
  return component_of_part_[b.first_part + b.label[v]];
}

std::size_t LiveComponents::memory_bytes() const {
  std::size_t n = bricks_.size() * sizeof(Brick) + (parent_.size() + component_of_part_.size()) * 4;
  for (const Brick& b : bricks_) n += b.parts.capacity() * sizeof(Part) + b.links.capacity() * sizeof(Link);
  return n;
}

}  // namespace osteo::inline simulation
