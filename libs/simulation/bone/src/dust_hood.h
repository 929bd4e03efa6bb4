// A brick of dust with its neighbours, while it is stepped. Private to libs/simulation/bone.
#pragma once
#include "osteo/simulation/bone/dust.h"

namespace osteo::inline simulation {

struct Dust::Hood {
  // Cells by their place from the brick's first, -1 to 8 along each axis.
  using Place = std::array<int, 3>;
  struct Neighbour {
    Brick* dust = nullptr;
    std::uint32_t bone = BrickGrid::kNone;
  };

  Hood(Dust& all, Brick& middle) : d(all), brick(middle) {
    for (int n = 0; n < 27; ++n) {
      const Ijk at{brick.at.i + n % 3 - 1, brick.at.j + n / 3 % 3 - 1, brick.at.k + n / 9 - 1};
      const auto found = d.index_.find(key(at.i, at.j, at.k));
      around[static_cast<std::size_t>(n)] = {found == d.index_.end() ? nullptr : d.bricks_[found->second].get(),
                                             d.bone_.find_brick(at.i, at.j, at.k)};
    }
  }
  [[nodiscard]] static std::size_t neighbour(const Place& p) {
    return static_cast<std::size_t>(((p[0] >> 3) + 1) + ((p[1] >> 3) + 1) * 3 + ((p[2] >> 3) + 1) * 9);
  }
  [[nodiscard]] static std::uint32_t offset(const Place& p) { return BrickGrid::offset_in_brick(p[0], p[1], p[2]); }
  [[nodiscard]] static Place moved(Place p, Ijk by) { return {p[0] + by.i, p[1] + by.j, p[2] + by.k}; }
  [[nodiscard]] float density(const Place& p) const {
    const std::uint32_t bone = around[neighbour(p)].bone;
    return bone == BrickGrid::kNone ? 0.0F : d.bone_.value(bone * BrickGrid::kVoxels + offset(p));
  }
  [[nodiscard]] bool is_solid(const Place& p) const { return density(p) >= 0.5F; }
  [[nodiscard]] Ijk cell_of(const Place& p) const {
    return {brick.at.i * 8 + p[0], brick.at.j * 8 + p[1], brick.at.k * 8 + p[2]};
  }
  // Null beyond what dust may reach.
  [[nodiscard]] Brick* brick_of(const Place& p) {
    Neighbour& n = around[neighbour(p)];
    if (n.dust == nullptr && d.in_reach(cell_of(p))) n.dust = d.brick_at(cell_of(p), true);
    return n.dust;
  }
  // Sideways and down at once, only where it is free beside; what has no way down, where one of both corners is.
  [[nodiscard]] bool open(const Place& c, Ijk by) const {
    const std::array<int, 3> b{by.i, by.j, by.k};
    const auto axis = static_cast<std::size_t>(d.axis_);
    int steps = 0;
    for (const int x : b) steps += x != 0 ? 1 : 0;
    if (steps < 2) return true;
    if (b[axis] != 0) {
      Place p = moved(c, by);
      p[axis] = c[axis];
      return !is_solid(p);
    }
    Place one = c, other = c;
    one[(axis + 1) % 3] += b[(axis + 1) % 3];
    other[(axis + 2) % 3] += b[(axis + 2) % 3];
    return !is_solid(one) || !is_solid(other);
  }
  void wake_around(const Place& p) {
    for (int k = (p[2] - 1) >> 3; k <= (p[2] + 1) >> 3; ++k)
      for (int j = (p[1] - 1) >> 3; j <= (p[1] + 1) >> 3; ++j)
        for (int i = (p[0] - 1) >> 3; i <= (p[0] + 1) >> 3; ++i) {
          const int x = i + 1, y = j + 1, z = k + 1;
          if (x >= 0 && x < 3 && y >= 0 && y < 3 && z >= 0 && z < 3) woken |= 1U << (x + 3 * y + 9 * z);
        }
  }

  Dust& d;
  Brick& brick;
  std::array<Neighbour, 27> around;
  std::uint32_t woken = 0;  // bits of the neighbourhood
};

}  // namespace osteo::inline simulation
