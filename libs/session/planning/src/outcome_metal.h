// What finding screws and finding plates have in common.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "osteo/core/data/volume.h"

namespace osteo::inline session::outcome {

constexpr double kNearMetalMm = 4;     ///< of the planned place
constexpr double kUnitHu = 100;        ///< of equations
constexpr double kKeptHu = 150;        ///< off by less than this, a voxel is never left out
constexpr double kRingBlurs = 2.5;     ///< beyond a surface, the blur of metal has ended
constexpr double kRingMm = 0.3;        ///< and so much beyond that, what lies beside it is read
constexpr double kBrightShare = 0.8;   ///< of the HU of metal: what is brighter beside it is no bone
constexpr double kBlurDoubtMm = 0.05;  ///< how well the blur of bone's edges is that of metal's
constexpr int kMetalRounds = 25;

/// Each voxel of the box, along the voxels' axes, about the corners of another: its place, and its number.
/// `to_ct(corner)`: where a corner of the box from `lo` to `hi` lies in the CT.
template <class ToCt, class Visit>
void each_voxel_about(const Frame& f, Vec3 lo, Vec3 hi, const ToCt& to_ct, const Visit& visit) {
  std::array<int, 3> from{}, to{};
  for (std::size_t a = 0; a < 3; ++a) from[a] = f.dims[a] - 1;
  for (int c = 0; c < 8; ++c) {
    const Vec3 i = f.index_from_world(
        to_ct(Vec3{(c & 1) != 0 ? hi.x : lo.x, (c & 2) != 0 ? hi.y : lo.y, (c & 4) != 0 ? hi.z : lo.z}));
    for (std::size_t a = 0; a < 3; ++a) {
      from[a] = std::clamp(static_cast<int>(std::floor(i[a])), 0, from[a]);
      to[a] = std::clamp(static_cast<int>(std::ceil(i[a])), to[a], f.dims[a] - 1);
    }
  }
  const auto nx = static_cast<std::size_t>(f.dims[0]), ny = static_cast<std::size_t>(f.dims[1]);
  for (int k = from[2]; k <= to[2]; ++k)
    for (int j = from[1]; j <= to[1]; ++j)
      for (int i = from[0]; i <= to[0]; ++i)
        visit(f.world_from_index(Vec3(i, j, k)),
              (static_cast<std::size_t>(k) * ny + static_cast<std::size_t>(j)) * nx + static_cast<std::size_t>(i));
}

}  // namespace osteo::inline session::outcome
