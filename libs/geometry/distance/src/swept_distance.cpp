#include "osteo/geometry/distance/distance_methods.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "osteo/core/base/error.h"
#include "tree_data.h"

namespace osteo::inline geometry {

std::vector<double> swept_distance_mm(const TriangleSoup& soup, const Frame& frame, const Context& context) {
  require_sound(soup);
  require_valid(frame);
  if (soup.triangles.empty())
    throw Error(ExitCode::failed, "the surface has no triangles, so nothing has a distance to it");
  const Vec3 s = frame.spacing_mm;
  const Mat3 back = inverse(frame.direction);
  std::vector<Vec3> points;
  points.reserve(soup.points_mm.size());
  for (const Vec3 p : soup.points_mm) points.push_back(back * (p - frame.origin_mm));
  std::vector<distance::ExactTriangle> exact;
  exact.reserve(soup.triangles.size());
  for (const auto& t : soup.triangles) exact.push_back(distance::make_exact(points[t[0]], points[t[1]], points[t[2]]));
  constexpr std::uint32_t kNone = 0xffffffffU;
  std::vector<double> d2(frame.voxel_count(), std::numeric_limits<double>::infinity());
  std::vector<std::uint32_t> nearest(d2.size(), kNone);
  const auto& n = frame.dims;
  const auto offset = [&](int i, int j, int k) {
    return (static_cast<std::size_t>(k) * static_cast<std::size_t>(n[1]) + static_cast<std::size_t>(j)) *
               static_cast<std::size_t>(n[0]) +
           static_cast<std::size_t>(i);
  };
  const auto offer = [&](std::size_t at, int i, int j, int k, std::uint32_t t) {
    const double origin[3] = {i * s.x, j * s.y, k * s.z}, none[3] = {0, 0, 0};
    const std::uint32_t voxel = 0;
    double found = 0;
    distance::kScalar.measure_voxels(exact.data(), &t, &voxel, 1, origin, none, &found);
    if (found < d2[at]) {
      d2[at] = found;
      nearest[at] = t;
    }
  };
  for (std::uint32_t t = 0; t < exact.size(); ++t) {
    std::array<int, 3> lo{}, hi{};
    for (std::size_t a = 0; a < 3; ++a) {
      const double low = std::min({exact[t].a[a], exact[t].b[a], exact[t].c[a]}) / s[a],
                   high = std::max({exact[t].a[a], exact[t].b[a], exact[t].c[a]}) / s[a];
      lo[a] = static_cast<int>(std::clamp(std::floor(low) - 1, 0.0, n[a] - 1.0));
      hi[a] = static_cast<int>(std::clamp(std::ceil(high) + 1, 0.0, n[a] - 1.0));
    }
    for (int k = lo[2]; k <= hi[2]; ++k) {
      for (int j = lo[1]; j <= hi[1]; ++j) {
        for (int i = lo[0]; i <= hi[0]; ++i) offer(offset(i, j, k), i, j, k, t);
      }
    }
  }
  for (int sweep = 0; sweep < 16; ++sweep) {  // eight directions, twice
    context.progress(sweep / 16.0, "sweeping");
    const int di = (sweep & 1) != 0 ? 1 : -1, dj = (sweep & 2) != 0 ? 1 : -1, dk = (sweep & 4) != 0 ? 1 : -1;
    for (int kk = 0; kk < n[2]; ++kk) {
      const int k = dk > 0 ? n[2] - 1 - kk : kk;
      for (int jj = 0; jj < n[1]; ++jj) {
        const int j = dj > 0 ? n[1] - 1 - jj : jj;
        for (int ii = 0; ii < n[0]; ++ii) {
          const int i = di > 0 ? n[0] - 1 - ii : ii;
          const std::size_t at = offset(i, j, k);
          std::uint32_t tried = nearest[at];
          for (int m = 1; m < 8; ++m) {
            const int x = i + ((m & 1) != 0 ? di : 0), y = j + ((m & 2) != 0 ? dj : 0), z = k + ((m & 4) != 0 ? dk : 0);
            if (x < 0 || y < 0 || z < 0 || x >= n[0] || y >= n[1] || z >= n[2]) continue;
            const std::uint32_t t = nearest[offset(x, y, z)];
            if (t == kNone || t == tried) continue;
            tried = t;
            offer(at, i, j, k, t);
          }
        }
      }
    }
  }
  for (double& d : d2) d = std::sqrt(d);
  return d2;
}

}  // namespace osteo::inline geometry
