#include "osteo/simulation/bone/saw.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

namespace osteo::inline simulation {
namespace {

// Share of a cube of edge 1 that lies below a plane: its centre `depth` below, `n` the plane's unit normal. The sum of
// three uniform spreads of widths |n| (R. Scardovelli, S. Zaleski, J. Comput. Phys. 164, 2000, in its plainest form).
double share_below(double depth, Vec3 n) {
  double m[3] = {std::abs(n.x), std::abs(n.y), std::abs(n.z)};
  std::sort(m, m + 3);
  const double total = m[0] + m[1] + m[2];
  double a = depth + 0.5 * total;
  if (a <= 0) return 0;
  if (a >= total) return 1;
  const auto cube = [](double v) { return v > 0 ? v * v * v : 0.0; };
  const auto square = [](double v) { return v > 0 ? v * v : 0.0; };
  if (m[0] < 1e-4) {
    if (m[1] < 1e-4) return std::min(1.0, a / m[2]);
    return (square(a) - square(a - m[1]) - square(a - m[2]) + square(a - m[1] - m[2])) / (2 * m[1] * m[2]);
  }
  double sum = cube(a);
  for (const double w : m) sum -= cube(a - w);
  sum += cube(a - m[0] - m[1]) + cube(a - m[0] - m[2]) + cube(a - m[1] - m[2]);
  return std::clamp(sum / (6 * m[0] * m[1] * m[2]), 0.0, 1.0);
}

// f(brick, voxel, its density, the share of it that the blade covers) for all with bone in them that it reaches.
template <class F>
void for_each_covered(const BrickGrid& bone, const SawCut& cut, F&& take) {
  const Frame& f = bone.frame();
  const double h = f.spacing_mm.x;
  const Vec3 normal = normalized(cut.normal);
  Vec3 along = cut.along - normal * dot(cut.along, normal);
  along = length(along) > 1e-9 ? normalized(along) : any_perpendicular(normal);
  const Vec3 across = cross(normal, along);
  // Everything in voxels, along the grid's axes.
  const Mat3 to_index = transposed(f.direction);
  const Vec3 centre = f.index_from_world(cut.at_mm);
  struct Side {
    Vec3 axis;
    double half;  // infinite: no faces there
  };
  const auto half_of = [&](double size_mm) { return size_mm > 0 ? size_mm / 2 / h : INFINITY; };
  const std::array<Side, 3> sides{Side{to_index * normal, cut.kerf_mm / 2 / h},
                                  {to_index * along, half_of(cut.length_mm)},
                                  {to_index * across, half_of(cut.depth_mm)}};
  constexpr double kCorner = 6.1 + 0.9;  // from a brick's middle to a voxel's far corner
  for (std::uint32_t b = 0; b < bone.brick_count(); ++b) {
    const Ijk o = bone.brick_coordinate(b);
    const Vec3 middle = Vec3{o.i * 8 + 3.5, o.j * 8 + 3.5, o.k * 8 + 3.5} - centre;
    if (std::any_of(sides.begin(), sides.end(),
                    [&](const Side& s) { return std::abs(dot(middle, s.axis)) > s.half + kCorner; }))
      continue;
    for (std::uint32_t v = 0; v < BrickGrid::kVoxels; ++v) {
      const VoxelKey key = b * BrickGrid::kVoxels + v;
      const float before = bone.value(key);
      if (before <= 0) continue;
      const Vec3 p =
          Vec3{double(o.i * 8 + int(v & 7)), double(o.j * 8 + int(v >> 3 & 7)), double(o.k * 8 + int(v >> 6))} - centre;
      double covered = 1;
      for (const Side& s : sides) {
        if (!std::isfinite(s.half)) continue;
        const double x = dot(p, s.axis);
        // Between two parallel planes: below the one less below the other.
        covered *= std::abs(x) > s.half + 0.9 ? 0 : share_below(s.half - x, s.axis) - share_below(-s.half - x, s.axis);
        if (covered <= 0) break;
      }
      if (covered > 0) take(b, key, before, covered);
    }
  }
}

float left_of(float before, double covered) {
  return std::max(0.0F, before * static_cast<float>(1 - covered));
}

}  // namespace

double apply_saw(BrickGrid& bone, const SawCut& cut, std::vector<VoxelKey>& changed) {
  double removed = 0;
  std::optional<std::uint32_t> own;  // the last brick that was made the grid's own
  for_each_covered(bone, cut, [&](std::uint32_t brick, VoxelKey key, float before, double covered) {
    const float after = left_of(before, covered);
    if (after == before) return;
    if (own != brick) bone.own_brick(brick);
    own = brick;
    bone.set(key, after);
    changed.push_back(key);
    removed += static_cast<double>(before - after);
  });
  return removed * bone.frame().voxel_volume_mm3();
}

std::vector<VoxelKey> voxels_sawn(const BrickGrid& bone, const SawCut& cut) {
  std::vector<VoxelKey> voxels;
  for_each_covered(bone, cut, [&](std::uint32_t /*brick*/, VoxelKey key, float before, double covered) {
    if (left_of(before, covered) != before) voxels.push_back(key);
  });
  return voxels;
}

}  // namespace osteo::inline simulation
