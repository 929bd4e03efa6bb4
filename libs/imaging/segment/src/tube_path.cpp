#include "tube_path.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <queue>
#include <utility>

#include "osteo/core/base/parallel.h"

namespace osteo::inline imaging::segment {
namespace {

// A bone wall against soft tissue; a vessel against what is around it.
constexpr double kBoneContrastHu = 900, kVesselContrastHu = 250;
// Air and soft tissue: a line in bone below this is an air cell.
constexpr double kAirBelowHu = -450, kSoftAboveHu = -150;
constexpr double kFloor = 0.02;

// Eigenvalues of a symmetric matrix, ascending. O. K. Smith 1961.
std::array<double, 3> eigenvalues(double xx, double yy, double zz, double xy, double xz, double yz) {
  const double q = (xx + yy + zz) / 3, off = xy * xy + xz * xz + yz * yz;
  const double a = xx - q, b = yy - q, c = zz - q, p = std::sqrt((a * a + b * b + c * c + 2 * off) / 6);
  if (p < 1e-12) return {q, q, q};
  const double det = a * (b * c - yz * yz) - xy * (xy * c - yz * xz) + xz * (xy * yz - b * xz);
  const double phi = std::acos(std::clamp(det / (2 * p * p * p), -1.0, 1.0)) / 3;
  const double most = q + 2 * p * std::cos(phi), least = q + 2 * p * std::cos(phi + 2 * std::numbers::pi / 3);
  return {least, 3 * q - most - least, most};
}

}  // namespace

std::vector<float> tubeness(const Field& f, const TubeParams& params, const Context& context) {
  std::vector<float> best(f.size(), 0.0F);
  const double contrast = params.kind == TubeKind::nerve ? kBoneContrastHu : kVesselContrastHu;
  // A tube answers best to a Gaussian of its radius by the root of 2. Its peak is then the contrast by e.
  constexpr double kMin = 0.42;
  const double most = std::max(kMin, params.max_radius_mm / std::numbers::sqrt2);
  std::vector<double> sigmas;
  for (double s = kMin; s < most * 1.2; s *= 1.45) sigmas.push_back(s);
  const auto nx = static_cast<std::ptrdiff_t>(f.n[0]), nxy = nx * f.n[1];
  double done = 0;
  for (const double sigma : sigmas) {
    const std::vector<float> g = smoothed(f.v, f.n, sigma / f.h_mm, context.threads);
    const double scale = sigma * sigma / (f.h_mm * f.h_mm) * std::numbers::e / contrast * 2;
    parallel_for(static_cast<std::size_t>(f.n[2]), 1, context.threads, [&](std::size_t begin, std::size_t end) {
      context.check_cancelled();
      for (std::size_t kk = begin; kk < end; ++kk) {
        const int k = static_cast<int>(kk);
        if (k == 0 || k == f.n[2] - 1) continue;
        for (int j = 1; j + 1 < f.n[1]; ++j) {
          for (int i = 1; i + 1 < f.n[0]; ++i) {
            const std::size_t at = f.at(i, j, k);
            const float* const p = g.data() + at;
            const auto d = [&](std::ptrdiff_t o) { return static_cast<double>(p[o]); };
            const double c2 = 2 * d(0), xx = d(1) + d(-1) - c2, yy = d(nx) + d(-nx) - c2, zz = d(nxy) + d(-nxy) - c2;
            const double trace = std::abs(xx + yy + zz) * scale;
            if (trace < 0.05) continue;
            const double xy = 0.25 * (d(1 + nx) + d(-1 - nx) - d(1 - nx) - d(-1 + nx)),
                         xz = 0.25 * (d(1 + nxy) + d(-1 - nxy) - d(1 - nxy) - d(-1 + nxy)),
                         yz = 0.25 * (d(nx + nxy) + d(-nx - nxy) - d(nx - nxy) - d(-nx + nxy));
            const auto e = eigenvalues(xx, yy, zz, xy, xz, yz);
            const double dark = e[1], bright = -e[1], hu = d(0);
            double t = 0;
            if (params.kind == TubeKind::vessel) {
              t = bright;
            } else if (dark > 0) {
              t = dark * std::clamp((hu - kAirBelowHu) / (kSoftAboveHu - kAirBelowHu), 0.0, 1.0);
            } else if (hu < 0) {
              t = 0.4 * bright;  // a strand in air; walls between cells look like it too
            }
            best[at] = std::max(best[at], static_cast<float>(std::clamp(t * scale, 0.0, 1.0)));
          }
        }
      }
    });
    done += 1;
    context.progress(done / static_cast<double>(sigmas.size()), "lines");
  }
  return best;
}

std::vector<Vec3> cheapest_way(const Field& f, const std::vector<float>& tubeness, std::span<const Vec3> points_mm,
                               double snap_mm, const Context& context) {
  struct Step {
    int i, j, k;
    double length;
  };
  std::vector<Step> steps;
  for (int k = -1; k <= 1; ++k)
    for (int j = -1; j <= 1; ++j)
      for (int i = -1; i <= 1; ++i)
        if (i != 0 || j != 0 || k != 0)
          steps.push_back({i, j, k, std::sqrt(static_cast<double>(i * i + j * j + k * k))});
  // Squared: a long way in the tube must beat a short one through a foam of air cells, whose corners look like tubes in
  // part.
  const auto cost = [&](std::size_t at) {
    const auto t = static_cast<double>(tubeness[at]);
    return 1 / (kFloor + t * t);
  };
  const auto snapped = [&](Vec3 p) {
    const auto c = f.nearest(p);
    const int reach = static_cast<int>(snap_mm / f.h_mm);
    std::size_t best = f.at(c[0], c[1], c[2]);
    double value = -1;
    for (int k = c[2] - reach; k <= c[2] + reach; ++k)
      for (int j = c[1] - reach; j <= c[1] + reach; ++j)
        for (int i = c[0] - reach; i <= c[0] + reach; ++i) {
          if (!f.inside(i, j, k)) continue;
          const double away = length(f.world(i, j, k) - p);
          const double v = static_cast<double>(tubeness[f.at(i, j, k)]) - 0.1 * away;  // of equals the nearer
          if (away <= snap_mm && v > value) {
            value = v;
            best = f.at(i, j, k);
          }
        }
    return best;
  };
  std::vector<Vec3> way;
  constexpr float kFar = std::numeric_limits<float>::max();
  std::vector<float> reached(f.size());
  std::vector<std::int8_t> from(f.size());
  const double least = 1 / (kFloor + 1);
  std::size_t start = snapped(points_mm.front());
  for (std::size_t leg = 1; leg < points_mm.size(); ++leg) {
    context.check_cancelled();
    const std::size_t goal = snapped(points_mm[leg]);
    const auto g = f.place(goal);
    std::fill(reached.begin(), reached.end(), kFar);
    using Entry = std::pair<float, std::size_t>;  // estimate of the whole way, voxel; ties by the voxel's number
    std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
    std::vector<bool> closed(f.size());
    // Detours are for bends: beyond half a leg from the straight way everything is dear.
    const auto sp = f.place(start);
    const Vec3 leg_from = f.world(sp[0], sp[1], sp[2]), leg_along = f.world(g[0], g[1], g[2]) - leg_from;
    const double leg_mm = length(leg_along), wide = std::max(1.0, 0.5 * leg_mm);
    const auto detour = [&](int i, int j, int k) {
      const Vec3 d = f.world(i, j, k) - leg_from;
      const double t = leg_mm > 0 ? std::clamp(dot(d, leg_along) / (leg_mm * leg_mm), 0.0, 1.0) : 0;
      const double away = length(d - leg_along * t);
      return away > wide ? 1 + 2 * (away - wide) : 1.0;
    };
    const auto rest = [&](std::size_t at) {
      const auto p = f.place(at);
      const double x = p[0] - g[0], y = p[1] - g[1], z = p[2] - g[2];
      return least * std::sqrt(x * x + y * y + z * z);
    };
    reached[start] = 0;
    from[start] = -1;
    open.emplace(static_cast<float>(rest(start)), start);
    while (!open.empty()) {
      const std::size_t at = open.top().second;
      open.pop();
      if (closed[at]) continue;
      closed[at] = true;
      if (at == goal) break;
      const auto p = f.place(at);
      const double own = cost(at);
      for (std::size_t s = 0; s < steps.size(); ++s) {
        const Step& d = steps[s];
        if (!f.inside(p[0] + d.i, p[1] + d.j, p[2] + d.k)) continue;
        const std::size_t to = f.at(p[0] + d.i, p[1] + d.j, p[2] + d.k);
        if (closed[to]) continue;
        const auto c =
            static_cast<float>(static_cast<double>(reached[at]) +
                               0.5 * d.length * (own + cost(to)) * detour(p[0] + d.i, p[1] + d.j, p[2] + d.k));
        if (c < reached[to]) {
          reached[to] = c;
          from[to] = static_cast<std::int8_t>(s);
          open.emplace(c + static_cast<float>(rest(to)), to);
        }
      }
    }
    std::vector<Vec3> part;
    std::size_t at = goal;
    while (true) {
      const auto p = f.place(at);
      part.push_back(f.world(p[0], p[1], p[2]));
      if (from[at] < 0) break;
      const Step& d = steps[static_cast<std::size_t>(from[at])];
      at = f.at(p[0] - d.i, p[1] - d.j, p[2] - d.k);
    }
    std::reverse(part.begin(), part.end());
    way.insert(way.end(), part.begin() + (way.empty() ? 0 : 1), part.end());
    start = goal;
    context.progress(static_cast<double>(leg) / static_cast<double>(points_mm.size() - 1), "way");
  }
  return way;
}

}  // namespace osteo::inline imaging::segment
