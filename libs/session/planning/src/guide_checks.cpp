// Can it be put on, and how far does it rock.
#include <algorithm>
#include <cmath>
#include <limits>

#include "guide_parts.h"

namespace osteo::inline session {
namespace guide {
namespace {

constexpr double kFinestCellMm = 0.5;
constexpr int kMaxPivots = 2000;
constexpr double kBelieved = 1e-6;  // mm; the gaps are known to less

using Corner2 = std::array<double, 2>;

// A triangle seen along z: where it lies, and its height as a linear function.
struct Shadow {
  std::array<Corner2, 3> at;  // counter-clockwise
  double gx = 0, gy = 0, g0 = 0;
  Corner2 lo, hi;
  [[nodiscard]] double z(const Corner2& p) const { return g0 + gx * p[0] + gy * p[1]; }
};

// Upright triangles have no area there; their edges belong to others as well.
std::vector<Shadow> shadows(const TriangleSoup& s, const Mat3& axes) {
  std::vector<Shadow> out;
  for (const auto& t : s.triangles) {
    std::array<Vec3, 3> p;
    for (std::size_t n = 0; n < 3; ++n) {
      const Vec3& w = s.points_mm[t[n]];
      p[n] = {dot(w, axes.column[0]), dot(w, axes.column[1]), dot(w, axes.column[2])};
    }
    double area = (p[1].x - p[0].x) * (p[2].y - p[0].y) - (p[1].y - p[0].y) * (p[2].x - p[0].x);
    if (std::abs(area) < 1e-9) continue;
    if (area < 0) {
      std::swap(p[1], p[2]);
      area = -area;
    }
    Shadow h;
    h.gx = ((p[1].z - p[0].z) * (p[2].y - p[0].y) - (p[2].z - p[0].z) * (p[1].y - p[0].y)) / area;
    h.gy = ((p[2].z - p[0].z) * (p[1].x - p[0].x) - (p[1].z - p[0].z) * (p[2].x - p[0].x)) / area;
    h.g0 = p[0].z - h.gx * p[0].x - h.gy * p[0].y;
    for (std::size_t n = 0; n < 3; ++n) h.at[n] = {p[n].x, p[n].y};
    for (std::size_t a = 0; a < 2; ++a) {
      h.lo[a] = std::min({h.at[0][a], h.at[1][a], h.at[2][a]});
      h.hi[a] = std::max({h.at[0][a], h.at[1][a], h.at[2][a]});
    }
    out.push_back(h);
  }
  return out;
}

// Least of guide minus bone over what both cover: it is linear there, so at a corner.
double least_above(const Shadow& guide, const Shadow& bone) {
  std::array<Corner2, 16> now{}, next{};
  std::size_t n = 3;
  std::copy(guide.at.begin(), guide.at.end(), now.begin());
  for (std::size_t e = 0; e < 3; ++e) {
    const Corner2 &a = bone.at[e], &b = bone.at[(e + 1) % 3];
    const auto inside = [&](const Corner2& p) { return (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]); };
    std::size_t m = 0;
    for (std::size_t k = 0; k < n; ++k) {
      const Corner2 &p = now[k], &q = now[(k + 1) % n];
      const double hp = inside(p), hq = inside(q);
      if (hp >= 0) next[m++] = p;
      if ((hp >= 0) != (hq >= 0)) {
        const double t = hp / (hp - hq);
        next[m++] = {p[0] + (q[0] - p[0]) * t, p[1] + (q[1] - p[1]) * t};
      }
    }
    now = next;
    n = m;
    if (n < 3) return std::numeric_limits<double>::infinity();
  }
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < n; ++k) least = std::min(least, guide.z(now[k]) - bone.z(now[k]));
  return least;
}

}  // namespace

double largest(const std::array<double, 6>& c, const std::vector<std::array<double, 6>>& a,
               const std::vector<double>& b, std::array<double, 6>* x) {
  // Each unknown is the difference of two that are not negative; slacks are the first basis.
  constexpr std::size_t kColumns = 12;
  constexpr double kLeastPivot = 1e-8;  // of rows that are of order 1: below it there is nothing but rounding
  const std::size_t rows = a.size();
  std::vector<std::array<double, kColumns + 1>> t(rows + 1);
  // Columns of one size: turns act by arms of centimetres.
  std::array<double, 6> size{};
  for (std::size_t k = 0; k < 6; ++k) {
    for (std::size_t r = 0; r < rows; ++r) size[k] = std::max(size[k], std::abs(a[r][k]));
    if (!(size[k] > 0)) size[k] = 1;
  }
  for (std::size_t r = 0; r <= rows; ++r) {
    for (std::size_t k = 0; k < 6; ++k) {
      t[r][k] = (r < rows ? a[r][k] : -c[k]) / size[k];
      t[r][k + 6] = -t[r][k];
    }
    t[r][kColumns] = r < rows ? b[r] : 0;
  }
  // Names of what is in the columns and rows, for Bland's rule.
  std::array<std::size_t, kColumns> outside{};
  for (std::size_t k = 0; k < kColumns; ++k) outside[k] = k;
  std::vector<std::size_t> basis(rows);
  for (std::size_t r = 0; r < rows; ++r) basis[r] = kColumns + r;
  for (int pivot = 0; pivot < kMaxPivots; ++pivot) {
    std::size_t in = kColumns;
    for (std::size_t k = 0; k < kColumns; ++k)
      if (t[rows][k] < -1e-10 && (in == kColumns || outside[k] < outside[in])) in = k;
    if (in == kColumns) {
      std::array<double, 6> at{};
      for (std::size_t r = 0; r < rows; ++r)
        if (basis[r] < kColumns) at[basis[r] % 6] += (basis[r] < 6 ? 1 : -1) * t[r][kColumns] / size[basis[r] % 6];
      for (std::size_t r = 0; r < rows; ++r) {
        double over = -b[r];
        for (std::size_t k = 0; k < 6; ++k) over += a[r][k] * at[k];
        if (over > kBelieved) return std::numeric_limits<double>::infinity();  // lost in rounding
      }
      if (x != nullptr) *x = at;
      return t[rows][kColumns];
    }
    std::size_t out = rows;
    double step = std::numeric_limits<double>::infinity();
    for (std::size_t r = 0; r < rows; ++r) {
      if (t[r][in] <= kLeastPivot) continue;
      const double s = t[r][kColumns] / t[r][in];
      if (s < step - 1e-13 || (s < step + 1e-13 && out < rows && basis[r] < basis[out])) {
        step = s;
        out = r;
      }
    }
    if (out == rows) return std::numeric_limits<double>::infinity();
    const double p = t[out][in];
    for (std::size_t k = 0; k <= kColumns; ++k) t[out][k] /= p;
    t[out][in] = 1 / p;
    for (std::size_t r = 0; r <= rows; ++r) {
      if (r == out || t[r][in] == 0) continue;
      const double f = t[r][in];
      for (std::size_t k = 0; k <= kColumns; ++k)
        if (k != in) t[r][k] -= f * t[out][k];
      t[r][in] = -f / p;
    }
    std::swap(outside[in], basis[out]);
  }
  return std::numeric_limits<double>::infinity();  // what was reached so far would claim too little
}

}  // namespace guide

double insertion_clearance_mm(const TriangleSoup& guide, const TriangleSoup& bone, Vec3 approach) {
  const Vec3 z = normalized(approach), x = any_perpendicular(z);
  const Mat3 axes{{x, cross(z, x), z}};
  const auto above = guide::shadows(guide, axes);
  double least = std::numeric_limits<double>::infinity();
  if (above.empty()) return least;
  // The guide's triangles by cells; each bone triangle asks the cells that it covers.
  std::array<double, 2> lo{1e300, 1e300}, hi{-1e300, -1e300};
  for (const auto& s : above) {
    for (std::size_t a = 0; a < 2; ++a) {
      lo[a] = std::min(lo[a], s.lo[a]);
      hi[a] = std::max(hi[a], s.hi[a]);
    }
  }
  const double cell = std::max(guide::kFinestCellMm, std::max(hi[0] - lo[0], hi[1] - lo[1]) / 1000);
  std::array<std::size_t, 2> cells{};
  for (std::size_t a = 0; a < 2; ++a) cells[a] = static_cast<std::size_t>((hi[a] - lo[a]) / cell) + 1;
  const auto range = [&](const guide::Shadow& s, std::size_t a) {
    const auto clamp = [&](double v) {
      return static_cast<std::size_t>(std::clamp((v - lo[a]) / cell, 0.0, static_cast<double>(cells[a] - 1)));
    };
    return std::pair{clamp(s.lo[a]), clamp(s.hi[a])};
  };
  std::vector<std::vector<std::uint32_t>> in(cells[0] * cells[1]);
  for (std::size_t n = 0; n < above.size(); ++n) {
    const auto [i0, i1] = range(above[n], 0);
    const auto [j0, j1] = range(above[n], 1);
    for (std::size_t j = j0; j <= j1; ++j)
      for (std::size_t i = i0; i <= i1; ++i) in[j * cells[0] + i].push_back(static_cast<std::uint32_t>(n));
  }
  for (const auto& b : guide::shadows(bone, axes)) {
    if (b.hi[0] < lo[0] || b.lo[0] > hi[0] || b.hi[1] < lo[1] || b.lo[1] > hi[1]) continue;
    const auto [i0, i1] = range(b, 0);
    const auto [j0, j1] = range(b, 1);
    for (std::size_t j = j0; j <= j1; ++j) {
      for (std::size_t i = i0; i <= i1; ++i) {
        for (const std::uint32_t n : in[j * cells[0] + i]) least = std::min(least, guide::least_above(above[n], b));
      }
    }
  }
  return least;
}

}  // namespace osteo::inline session
