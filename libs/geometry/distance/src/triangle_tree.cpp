#include "osteo/geometry/distance/triangle_tree.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "osteo/core/base/error.h"
#include "osteo/core/base/parallel.h"
#include "osteo/core/base/simd.h"
#include "tree_data.h"

namespace osteo::inline geometry {
namespace distance {

const Kernel& kernel() {
  static const Kernel* const chosen = [] {
#if defined(__x86_64__)
    if (simd() == Simd::avx512) return &kAvx512;
    if (simd() == Simd::avx2) return &kAvx2;
#endif
    return &kScalar;
  }();
  return *chosen;
}

ExactTriangle make_exact(Vec3 a, Vec3 b, Vec3 c) {
  // A lies opposite the longest edge: the two edges there are the short ones, which gives the best normal.
  const double ab2 = dot(b - a, b - a), bc2 = dot(c - b, c - b), ca2 = dot(a - c, a - c);
  double turned = 0;
  if (ab2 > bc2 && ab2 >= ca2) {
    const Vec3 t = c;
    c = b, b = a, a = t;
    turned = 2;
  } else if (ca2 > bc2) {
    const Vec3 t = a;
    a = b, b = c, c = t;
    turned = 1;
  }
  const Vec3 ab = b - a, ac = c - a, bc = c - b, n = cross(ab, ac);
  const double l_ab = dot(ab, ab), l_ac = dot(ac, ac), l_bc = dot(bc, bc), n2 = dot(n, n);
  // Thinner than this the rounding of the normal costs more than leaving the face out.
  const bool flat = !(n2 > 4e-22 * l_ab * l_ac);
  const double scale = flat ? std::numeric_limits<double>::quiet_NaN() : 1 / std::sqrt(n2);
  const auto inverse = [](double l2) { return l2 > 0 ? 1 / l2 : 0.0; };
  return {{a.x, a.y, a.z}, {b.x, b.y, b.z}, {c.x, c.y, c.z}, {n.x * scale, n.y * scale, n.z * scale},
          inverse(l_ab),   inverse(l_ac),   inverse(l_bc),   turned};
}

Place place_on(const ExactTriangle& t, Vec3 p) {
  const Vec3 a{t.a[0], t.a[1], t.a[2]}, b{t.b[0], t.b[1], t.b[2]}, c{t.c[0], t.c[1], t.c[2]}, n{t.n[0], t.n[1], t.n[2]};
  const auto along = [](Vec3 q, Vec3 e, double inverse) { return std::clamp(dot(q, e) * inverse, 0.0, 1.0); };
  Place best{};
  double best_d2 = std::numeric_limits<double>::infinity();
  const auto offer = [&](Vec3 from, Vec3 to, double s, Feature edge, Feature start, Feature end) {
    const Vec3 at = s == 1 ? to : from + (to - from) * s;
    const double d2 = dot(p - at, p - at);
    if (d2 < best_d2) {
      best_d2 = d2;
      best = {at, s == 0 ? start : s == 1 ? end : edge};
    }
  };
  offer(a, b, along(p - a, b - a, t.inverse_ab), Feature::edge_ab, Feature::corner_a, Feature::corner_b);
  offer(a, c, along(p - a, c - a, t.inverse_ac), Feature::edge_ca, Feature::corner_a, Feature::corner_c);
  offer(b, c, along(p - b, c - b, t.inverse_bc), Feature::edge_bc, Feature::corner_b, Feature::corner_c);
  // Back to the corners as they were given.
  if (const auto f = static_cast<int>(best.feature); f > 0) {
    const int kind = (f - 1) / 3, which = ((f - 1) % 3 + static_cast<int>(t.turned)) % 3;
    best.feature = static_cast<Feature>(1 + 3 * kind + which);
  }
  const auto left = [&](Vec3 e, Vec3 q) { return dot(cross(n, e), q); };
  if (left(b - a, p - a) >= 0 && left(c - b, p - b) >= 0 && left(a - c, p - c) >= 0) {
    const double s = dot(p - b, c - b) * t.inverse_bc;
    const double h = dot((p - b) - (c - b) * s, n);
    if (h * h < best_d2) best = {p - n * h, Feature::face};
  }
  return best;
}

namespace {

// Twice the bits of a Morton key apart: 21 bits an axis.
std::uint64_t spread(std::uint64_t x) {
  x &= 0x1fffff;
  x = (x | x << 32) & 0x1f00000000ffffULL;
  x = (x | x << 16) & 0x1f0000ff0000ffULL;
  x = (x | x << 8) & 0x100f00f00f00f00fULL;
  x = (x | x << 4) & 0x10c30c30c30c30c3ULL;
  return (x | x << 2) & 0x1249249249249249ULL;
}

}  // namespace

std::uint64_t curve_key(Vec3 at) {
  std::uint64_t key = 0;
  for (std::size_t a = 0; a < 3; ++a) {
    const double q = std::clamp((at[a] + 384) * (2097151.0 / 768), 0.0, 2097151.0);
    key |= spread(static_cast<std::uint64_t>(q)) << a;
  }
  return key;
}

// 11 bits a pass; passes over digits that are all equal are skipped.
void radix_sort(std::vector<Keyed>& items) {
  std::vector<Keyed> other(items.size());
  for (int shift = 0; shift < 63; shift += 11) {
    std::array<std::size_t, 2049> first{};
    for (const Keyed& k : items) ++first[(k.key >> shift & 2047) + 1];
    if (std::find(first.begin() + 1, first.end(), items.size()) != first.end()) continue;
    for (std::size_t d = 0; d < 2048; ++d) first[d + 1] += first[d];
    for (const Keyed& k : items) other[first[k.key >> shift & 2047]++] = k;
    items.swap(other);
  }
}

namespace {

TriangleRecord make_record(const ExactTriangle& t, float margin) {
  const Vec3 a{t.a[0], t.a[1], t.a[2]}, b{t.b[0], t.b[1], t.b[2]}, c{t.c[0], t.c[1], t.c[2]};
  const Vec3 ab = b - a, ac = c - a, bc = c - b;
  const double lu = length(ab), lv = length(ac), lw = length(bc);
  const double iu = lu * t.inverse_ab, iv = lv * t.inverse_ac, iw = lw * t.inverse_bc;  // 1/length, or 0
  const Vec3 u = ab * iu, v = ac * iv;
  const double cosine = dot(u, v);
  const Vec3 n = cross(u, v);
  const double sine2 = dot(n, n);
  // Which edge is nearest is decided from squares that rounding blurs by about eps * length^2.
  const double edges = 6e-4 * lw;
  // With the face: the foot of the perpendicular is off by 1/sine^2 times rounding. Without it: by the triangle's
  // height.
  const double inverse_sine2 = 1 / sine2, with_face = margin * inverse_sine2, height = lu * lv * std::sqrt(sine2) * iw;
  const bool face = sine2 > 1e-6 && with_face < height;
  const auto f = [](double x) { return static_cast<float>(x); };
  return {f(a.x),
          f(a.y),
          f(a.z),
          f(u.x),
          f(u.y),
          f(u.z),
          f(v.x),
          f(v.y),
          f(v.z),
          f(lu),
          f(lv),
          f(lw),
          f(iw),
          f(cosine),
          face ? f(inverse_sine2) : std::numeric_limits<float>::quiet_NaN(),
          f((face ? with_face : height) + edges) * 1.001F};
}

// Into the tree's order: boxes of packs, then boxes of groups, up to one group.
void build_boxes(TriangleTree::Data& d, const Context& context) {
  const std::uint32_t n = d.view.triangles;
  std::size_t items = (n + 15) / 16;
  const auto outward = [](double v, int direction) {
    const auto f = static_cast<float>(v);
    return std::nextafterf(
        f, direction < 0 ? -std::numeric_limits<float>::infinity() : std::numeric_limits<float>::infinity());
  };
  for (int level = 0;; ++level) {
    const std::size_t groups = (items + 15) / 16;
    std::vector<BoxGroup> boxes(groups);
    parallel_for(groups, 64, context.threads, [&](std::size_t begin, std::size_t end) {
      for (std::size_t g = begin; g < end; ++g) {
        for (std::size_t s = 0; s < 16; ++s) {
          const std::size_t item = g * 16 + s;
          std::array<float, 3> lo{1e18F, 1e18F, 1e18F}, hi{-1e18F, -1e18F, -1e18F};
          if (item >= items) {
            hi = lo;  // a box far away
          } else if (level == 0) {
            const std::size_t first = item * 16, last = std::min<std::size_t>(n, first + 16);
            for (std::size_t a = 0; a < 3; ++a) {
              double low = 1e18, high = -1e18;
              for (std::size_t t = first; t < last; ++t) {
                const ExactTriangle& e = d.exact[t];
                low = std::min(low, std::min(e.a[a], std::min(e.b[a], e.c[a])));
                high = std::max(high, std::max(e.a[a], std::max(e.b[a], e.c[a])));
              }
              lo[a] = outward(low, -1);
              hi[a] = outward(high, 1);
            }
          } else {
            const BoxGroup& below = d.boxes.back()[item];
            for (std::size_t a = 0; a < 3; ++a) {
              for (int i = 0; i < 16; ++i) {
                if (below.lo[a][i] == 1e18F) continue;
                lo[a] = std::min(lo[a], below.lo[a][i]);
                hi[a] = std::max(hi[a], below.hi[a][i]);
              }
            }
          }
          for (std::size_t a = 0; a < 3; ++a) {
            boxes[g].lo[a][s] = lo[a];
            boxes[g].hi[a][s] = hi[a];
          }
        }
      }
    });
    d.boxes.push_back(std::move(boxes));
    items = groups;
    if (groups == 1) break;
  }
  d.view.levels = static_cast<int>(d.boxes.size());
  for (std::size_t l = 0; l < d.boxes.size(); ++l) d.view.boxes[l] = d.boxes[l].data();
}

}  // namespace
}  // namespace distance

TriangleTree::TriangleTree(const TriangleSoup& soup, const Context& context) : TriangleTree(soup, Mat3{}, context) {}

TriangleTree::TriangleTree(const TriangleSoup& soup, const Mat3& axes, const Context& context) {
  require_sound(soup);
  const std::size_t n = soup.triangles.size();
  if (n == 0) throw Error(ExitCode::failed, "the surface has no triangles, so nothing has a distance to it");
  if (n > 0x7fffffffU) throw Error(ExitCode::resources, "a surface of more than 2^31 triangles is not supported");
  auto made = std::make_shared<Data>();
  Data& d = *made;
  d.axes = axes;
  // Only points in use count: a stray one far away must not cost precision.
  const auto [lo, hi] = bounds_of(soup);
  d.centre_mm = (lo + hi) * 0.5;
  const double extent = std::max({hi.x - lo.x, hi.y - lo.y, hi.z - lo.z});
  int exponent = 0;
  static_cast<void>(std::frexp(extent, &exponent));
  d.unit_mm = extent > 0 ? std::ldexp(1, exponent - 7) : 1.0;  // the extent becomes 64 to 128 units
  if (!(d.unit_mm > 0) || !std::isfinite(extent))
    throw Error(ExitCode::corrupt, "the surface's extent is not a number that can be worked with");
  std::vector<Vec3> points(soup.points_mm.size());
  parallel_for(points.size(), 8192, context.threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) points[i] = d.to_tree(soup.points_mm[i]);
  });
  context.check_cancelled();
  std::vector<distance::Keyed> keys(n);
  parallel_for(n, 8192, context.threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) {
      const auto& v = soup.triangles[t];
      // Coordinates lie within +-128 (a rotated box), their sums within 3 times that.
      keys[t] = {distance::curve_key(points[v[0]] + points[v[1]] + points[v[2]]), static_cast<std::uint32_t>(t)};
    }
  });
  distance::radix_sort(keys);
  context.check_cancelled();
  const std::size_t padded = (n + 15) / 16 * 16;
  d.view.triangles = static_cast<std::uint32_t>(n);
  // Rounding of coordinates up to 128 and of the sums made of them.
  d.view.margin = 128 * 12 * 6e-8F;
  d.exact.resize(padded);
  d.records.resize(padded);
  d.original.resize(n);
  d.rank.resize(n);
  parallel_for(n, 4096, context.threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const std::uint32_t t = keys[i].index;
      const auto& v = soup.triangles[t];
      d.original[i] = t;
      d.rank[t] = static_cast<std::uint32_t>(i);
      d.exact[i] = distance::make_exact(points[v[0]], points[v[1]], points[v[2]]);
      d.records[i] = distance::make_record(d.exact[i], d.view.margin);
    }
  });
  for (std::size_t i = n; i < padded; ++i) {
    d.exact[i] = d.exact[n - 1];
    d.records[i] = d.records[n - 1];
  }
  for (std::size_t i = 0; i < n; ++i) {
    const distance::TriangleRecord& r = d.records[i];
    if (r.face > 0)
      d.area += 0.5 * static_cast<double>(r.u_length * r.v_length) / std::sqrt(static_cast<double>(r.face));
  }
  distance::build_boxes(d, context);
  d.view.records = d.records.data();
  d.view.exact = d.exact.data();
  data_ = std::move(made);
}

std::size_t TriangleTree::triangle_count() const {
  return data_ == nullptr ? 0 : data_->view.triangles;
}

std::size_t TriangleTree::memory_bytes() const {
  std::size_t sum =
      (triangle_count() + 15) / 16 * 16 * (sizeof(distance::TriangleRecord) + sizeof(distance::ExactTriangle)) +
      (data_->original.size() + data_->rank.size()) * 4;
  for (const auto& b : data_->boxes) sum += b.size() * sizeof(distance::BoxGroup);
  return sum;
}

ClosestPoint TriangleTree::closest(Vec3 point_mm, std::uint32_t hint, double limit_mm) const {
  const Data& d = *data_;
  const Vec3 p = d.to_tree(point_mm);
  const double q[3] = {p.x, p.y, p.z};
  const double limit = limit_mm / d.unit_mm;
  const distance::Nearest n = distance::kernel().closest(d.view, q, hint < d.rank.size() ? d.rank[hint] : hint,
                                                         std::isfinite(limit) ? limit * limit : 1e300);
  ClosestPoint c;
  if (n.triangle == ClosestPoint::kNone) return c;
  const distance::Place place = distance::place_on(d.exact[n.triangle], p);
  c.distance_mm = std::sqrt(n.d2) * d.unit_mm;
  c.triangle = d.original[n.triangle];
  c.feature = place.feature;
  c.point_mm = d.to_world(place.point);
  return c;
}

ClosestPoint closest_on_triangle(Vec3 p, Vec3 a, Vec3 b, Vec3 c) {
  // About p, so that far-away coordinates lose nothing more.
  const distance::ExactTriangle t = distance::make_exact(a - p, b - p, c - p);
  const double zero[3] = {0, 0, 0};
  const std::uint32_t id = 0;
  double d2 = 0;
  distance::kScalar.measure_voxels(&t, &id, &id, 1, zero, zero, &d2);
  const distance::Place place = distance::place_on(t, Vec3{});
  return {std::sqrt(d2), 0, place.feature, place.point + p};
}

}  // namespace osteo::inline geometry
