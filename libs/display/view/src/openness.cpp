#include "osteo/display/view/detail/openness.h"

#include <algorithm>
#include <cmath>

#include "osteo/core/base/parallel.h"

namespace osteo::inline display {
namespace {

// Cones: one along the normal, four around it; what each weighs of the cosine-weighted sky.
constexpr double kTilt = 0.87, kMiddle = 0.32;  // radians
// Where a cone is looked at, in cells of each level: just clear of the flat face it stands on.
constexpr double kAhead = 1.5, kAside = 2.1;
// What lies between the places looked at blocks too: fitted to round holes of 3 to 8 mm.
constexpr double kBlocked = 2;
// Ripples that the slices leave on flat bone are no cavities.
constexpr double kSlack = 1.04;

}  // namespace

Openness::Openness(const BrickGrid& bone, int threads) : frame_(bone.frame()) {
  const Vec3 s = bone.frame().spacing_mm;
  const double voxel_mm = std::cbrt(s.x * s.y * s.z);
  edge_ = 1;
  while (edge_ < 8 && edge_ * voxel_mm * 1.42 < 1) edge_ *= 2;
  std::array<int, 3> most{}, least{bone.frame().dims};
  for (std::uint32_t b = 0; b < bone.brick_count(); ++b) {
    const Ijk o = bone.brick_coordinate(b);
    least = {std::min(least[0], o.i), std::min(least[1], o.j), std::min(least[2], o.k)};
    most = {std::max(most[0], o.i), std::max(most[1], o.j), std::max(most[2], o.k)};
  }
  for (std::size_t a = 0; a < 3; ++a) {
    box_[0][a] = 8 * least[a] - 0.5;
    box_[1][a] = 8 * most[a] + 7.5;
  }
  for (std::size_t l = 0; l < levels_.size(); ++l) {
    Level& level = levels_[l];
    level.edge_voxels = edge_ << l;
    for (std::size_t a = 0; a < 3; ++a) level.n[a] = static_cast<int>(std::ceil((most[a] + 1) * 8 / level.edge_voxels));
    level.cells.assign(static_cast<std::size_t>(level.n[0]) * static_cast<std::size_t>(level.n[1]) *
                           static_cast<std::size_t>(level.n[2]),
                       0);
  }
  parallel_for(bone.brick_count(), 256, threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t b = begin; b < end; ++b) sum_brick(bone, static_cast<std::uint32_t>(b));
  });
  for (std::size_t l = 1; l < levels_.size(); ++l) sum_above(l, {0, 0, 0}, levels_[l].n);
}

void Openness::sum_brick(const BrickGrid& bone, std::uint32_t brick) {
  const int m = 8 / edge_;
  std::array<float, 512> sums{};
  const VoxelKey first = brick * static_cast<VoxelKey>(BrickGrid::kVoxels);
  for (std::uint32_t v = 0; v < BrickGrid::kVoxels; ++v) {
    const int i = static_cast<int>(v & 7) / edge_, j = static_cast<int>(v >> 3 & 7) / edge_,
              k = static_cast<int>(v >> 6) / edge_;
    sums[static_cast<std::size_t>((k * m + j) * m + i)] += bone.value(first + v);
  }
  const float share = 255.0F / static_cast<float>(edge_ * edge_ * edge_);
  Level& level = levels_[0];
  const Ijk o = bone.brick_coordinate(brick);
  for (int k = 0; k < m; ++k)
    for (int j = 0; j < m; ++j)
      for (int i = 0; i < m; ++i)
        level.cells[(static_cast<std::size_t>(o.k * m + k) * static_cast<std::size_t>(level.n[1]) +
                     static_cast<std::size_t>(o.j * m + j)) *
                        static_cast<std::size_t>(level.n[0]) +
                    static_cast<std::size_t>(o.i * m + i)] =
            static_cast<std::uint8_t>(
                std::clamp(sums[static_cast<std::size_t>((k * m + j) * m + i)] * share + 0.5F, 0.0F, 255.0F));
}

// Cells [lo, hi) of a level from the eight below each.
void Openness::sum_above(std::size_t l, std::array<int, 3> lo, std::array<int, 3> hi) {
  const Level& below = levels_[l - 1];
  Level& level = levels_[l];
  const auto at = [](const Level& from, int i, int j, int k) -> std::size_t {
    return (static_cast<std::size_t>(k) * static_cast<std::size_t>(from.n[1]) + static_cast<std::size_t>(j)) *
               static_cast<std::size_t>(from.n[0]) +
           static_cast<std::size_t>(i);
  };
  for (int k = lo[2]; k < hi[2]; ++k)
    for (int j = lo[1]; j < hi[1]; ++j)
      for (int i = lo[0]; i < hi[0]; ++i) {
        int sum = 0;
        for (int c = 0; c < 8; ++c) {
          const int x = 2 * i + (c & 1), y = 2 * j + (c >> 1 & 1), z = 2 * k + (c >> 2);
          if (x < below.n[0] && y < below.n[1] && z < below.n[2]) sum += below.cells[at(below, x, y, z)];
        }
        level.cells[at(level, i, j, k)] = static_cast<std::uint8_t>((sum + 4) / 8);
      }
}

void Openness::renew(const BrickGrid& bone, std::span<const std::uint32_t> bricks) {
  for (const std::uint32_t b : bricks) {
    sum_brick(bone, b);
    const Ijk o = bone.brick_coordinate(b);
    for (std::size_t l = 1; l < levels_.size(); ++l) {
      std::array<int, 3> lo{}, hi{};
      const std::array<int, 3> first{o.i * 8, o.j * 8, o.k * 8};
      for (std::size_t a = 0; a < 3; ++a) {
        const int edge = static_cast<int>(levels_[l].edge_voxels);
        lo[a] = first[a] / edge;
        hi[a] = std::min(levels_[l].n[a], (first[a] + 7) / edge + 1);
      }
      sum_above(l, lo, hi);
    }
  }
}

// Linear between the middles of cells; nothing outside.
double Openness::sample(const Level& level, Vec3 index) {
  int n[3];
  double f[3];
  for (std::size_t a = 0; a < 3; ++a) {
    const double u = (index[a] + 0.5) / level.edge_voxels - 0.5, whole = std::floor(u);
    n[a] = static_cast<int>(whole);
    f[a] = u - whole;
  }
  double sum = 0;
  for (int c = 0; c < 8; ++c) {
    const int i = n[0] + (c & 1), j = n[1] + (c >> 1 & 1), k = n[2] + (c >> 2);
    if (i < 0 || j < 0 || k < 0 || i >= level.n[0] || j >= level.n[1] || k >= level.n[2]) continue;
    const double w =
        ((c & 1) != 0 ? f[0] : 1 - f[0]) * ((c >> 1 & 1) != 0 ? f[1] : 1 - f[1]) * ((c >> 2) != 0 ? f[2] : 1 - f[2]);
    sum +=
        w *
        level.cells[(static_cast<std::size_t>(k) * static_cast<std::size_t>(level.n[1]) + static_cast<std::size_t>(j)) *
                        static_cast<std::size_t>(level.n[0]) +
                    static_cast<std::size_t>(i)];
  }
  return sum / 255;
}

bool Openness::reaches(Vec3 world_mm) const {
  const Vec3 x = frame_.index_from_world(world_mm);
  for (std::size_t a = 0; a < 3; ++a) {
    const double reach = kReachMm / frame_.spacing_mm[a];
    if (x[a] < box_[0][a] - reach || x[a] > box_[1][a] + reach) return false;
  }
  return true;
}

double Openness::at(const std::array<float, 3>& index, const std::array<float, 3>& normal,
                    std::span<const std::shared_ptr<const Openness>> others) const {
  const Vec3 p = from_floats(index), n = from_floats(normal);
  const Vec3 u = any_perpendicular(n), v = cross(n, u);
  const double up = std::cos(kTilt), out = std::sin(kTilt);
  const Vec3 ways[5] = {n, n * up + u * out, n * up - u * out, n * up + v * out, n * up - v * out};
  const Openness* near[4] = {};
  std::size_t count = 0;
  for (const auto& other : others) {
    if (count < std::size(near) && other->reaches(frame_.world_from_index(p))) near[count++] = other.get();
  }
  double open = 0;
  for (std::size_t w = 0; w < 5; ++w) {
    // How far along: a cone as wide as its cells, started clear of the face it stands on.
    double free = 1;
    for (std::size_t l = 0; l < levels_.size(); ++l) {
      const Vec3 at = p + ways[w] * ((w == 0 ? kAhead : kAside) * levels_[l].edge_voxels);
      double there = sample(levels_[l], at);
      // No two bodies hold the same bone; cells on their border are filled by both.
      for (std::size_t o = 0; o < count; ++o)
        there += sample(near[o]->levels_[l], near[o]->frame_.index_from_world(frame_.world_from_index(at)));
      free *= 1 - std::min(1.0, there);
    }
    open += free * (w == 0 ? kMiddle : (1 - kMiddle) / 4);
  }
  return std::pow(std::min(1.0, kSlack * open), kBlocked);
}

}  // namespace osteo::inline display
