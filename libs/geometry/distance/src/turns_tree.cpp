#include "turns_tree.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "winding.h"

namespace osteo::inline geometry {
namespace {

constexpr std::uint32_t kLeaf = 4;
constexpr double kSphere = 4 * std::numbers::pi;

double turns_of(const Fan& f, Vec3 p) {
  return f.weight * solid_angle(f.a, f.b, f.c, p) / kSphere;
}

}  // namespace

struct TurnsTree::Open {
  Turns turns;
  std::uint32_t node;
  bool operator<(const Open& o) const { return turns.error < o.turns.error; }
};

TurnsTree::TurnsTree(std::vector<Fan> triangles) : triangles_(std::move(triangles)) {
  if (triangles_.empty()) return;
  order_.resize(triangles_.size());
  std::iota(order_.begin(), order_.end(), 0U);
  nodes_.reserve(triangles_.size());
  nodes_.push_back({});
  nodes_[0].end = static_cast<std::uint32_t>(triangles_.size());
  for (std::uint32_t n = 0; n < nodes_.size(); ++n) build(n);
  // An angle is off by some 1e-15; each addition by half a unit of the last place of a partial sum, which is at most
  // half the weights. Twice, for the sum in order and for ours, and ours takes terms away again.
  const auto n = static_cast<double>(triangles_.size());
  rounding_ = 1e-10 + n * (4e-15 + 4.5e-16 * nodes_[0].weight);
}

void TurnsTree::build(std::uint32_t index) {
  Node node = nodes_[index];
  const auto first = order_.begin() + node.begin, last = order_.begin() + node.end;
  node.lo = Vec3{1e300, 1e300, 1e300};
  node.hi = node.lo * -1.0;
  Vec3 mean;
  Vec3 lo = node.lo, hi = node.hi;  // of the centroids
  const auto middle = [&](std::uint32_t i) { return (triangles_[i].a + triangles_[i].b + triangles_[i].c) / 3; };
  for (auto at = first; at != last; ++at) {
    const Fan& f = triangles_[*at];
    const Vec3 m = middle(*at);
    const double area = std::abs(f.weight) * length(cross(f.b - f.a, f.c - f.a)) / 2;
    node.area += area;
    node.weight += std::abs(f.weight);
    mean += m * area;
    for (std::size_t a = 0; a < 3; ++a) {
      node.lo[a] = std::min({node.lo[a], f.a[a], f.b[a], f.c[a]});
      node.hi[a] = std::max({node.hi[a], f.a[a], f.b[a], f.c[a]});
      lo[a] = std::min(lo[a], m[a]);
      hi[a] = std::max(hi[a], m[a]);
    }
  }
  // Any centre will do for the bound: of mass, so that the first moments are small.
  node.centre = node.area > 0 ? mean / node.area : (node.lo + node.hi) / 2;
  double trace = 0;
  std::array<double, 6> first_order{};  // xx yy zz, and both of yz, zx, xy
  Vec3 n0, u;
  std::array<double, 10> t{};  // xxx yyy zzz xxy xxz yyx yyz zzx zzy xyz, all of a kind added up
  for (auto at = first; at != last; ++at) {
    const Fan& f = triangles_[*at];
    const Vec3 a = f.a - node.centre, b = f.b - node.centre, c = f.c - node.centre, m = (a + b + c) / 3;
    const Vec3 n = cross(f.b - f.a, f.c - f.a) * (0.5 * f.weight);
    const double most = std::max({length(a), length(b), length(c)});
    node.radius = std::max(node.radius, most);
    node.third += length(n) * most * most * most;
    n0 += n;
    trace += dot(n, m);
    const std::array<double, 6> nm{
        n.x * m.x, n.y * m.y, n.z * m.z, n.y * m.z + n.z * m.y, n.z * m.x + n.x * m.z, n.x * m.y + n.y * m.x};
    for (std::size_t k = 0; k < 6; ++k) first_order[k] += nm[k];
    // The mean of y y^T over a triangle.
    const auto q = [&](std::size_t i, std::size_t j) {
      return (a[i] * a[j] + b[i] * b[j] + c[i] * c[j] + 9 * m[i] * m[j]) / 12;
    };
    const double xx = q(0, 0), yy = q(1, 1), zz = q(2, 2), yz = q(1, 2), zx = q(2, 0), xy = q(0, 1);
    u += n * (xx + yy + zz) +
         Vec3{n.x * xx + n.y * xy + n.z * zx, n.x * xy + n.y * yy + n.z * yz, n.x * zx + n.y * yz + n.z * zz} * 2;
    const std::array<double, 10> own{n.x * xx,
                                     n.y * yy,
                                     n.z * zz,
                                     n.y * xx + 2 * n.x * xy,
                                     n.z * xx + 2 * n.x * zx,
                                     n.x * yy + 2 * n.y * xy,
                                     n.z * yy + 2 * n.y * yz,
                                     n.x * zz + 2 * n.z * zx,
                                     n.y * zz + 2 * n.z * yz,
                                     2 * (n.x * yz + n.y * zx + n.z * xy)};
    for (std::size_t k = 0; k < 10; ++k) t[k] += own[k];
  }
  node.moment = {n0.x, n0.y, n0.z, trace};
  std::copy(first_order.begin(), first_order.end(), node.moment.begin() + 4);
  for (std::size_t k = 0; k < 3; ++k) node.moment[10 + k] = u[k];
  std::copy(t.begin(), t.end(), node.moment.begin() + 13);
  // A ray's crossing is rounded: nothing that touches the box may be missed.
  for (std::size_t a = 0; a < 3; ++a) {
    const double margin = 1e-14 * (std::abs(node.lo[a]) + std::abs(node.hi[a]));
    node.lo[a] -= margin;
    node.hi[a] += margin;
  }
  node.radius *= 1 + 1e-14;
  const std::uint32_t count = node.end - node.begin;
  if (count > kLeaf) {
    const Vec3 size = hi - lo;
    const std::size_t axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    std::nth_element(first, first + count / 2, last, [&](std::uint32_t i, std::uint32_t j) {
      const double x = middle(i)[axis], y = middle(j)[axis];
      return x != y ? x < y : i < j;
    });
    node.left = static_cast<std::uint32_t>(nodes_.size());
    Node half;
    half.begin = node.begin;
    half.end = node.begin + count / 2;
    nodes_.push_back(half);
    half.begin = half.end;
    half.end = node.end;
    nodes_.push_back(half);
  }
  nodes_[index] = node;
}

TurnsTree::Turns TurnsTree::of(const Node& node, Vec3 p) const {
  const Turns unknown{0, node.weight / 2};  // a triangle makes half a turn at most
  const Vec3 r = node.centre - p;
  const double r2 = dot(r, r), inverse = 1 / std::sqrt(r2), rho = node.radius * inverse;
  if (!(rho < 0.95)) return unknown;
  const double i2 = inverse * inverse, i3 = i2 * inverse, i5 = i3 * i2, left = 1 / (1 - rho);
  const double error = node.third * i5 * left * (4 + rho * left) / kSphere;
  if (!(error < unknown.error)) return unknown;
  const auto& m = node.moment;
  const double x = r.x, y = r.y, z = r.z;
  const double zeroth = m[0] * x + m[1] * y + m[2] * z;
  const double first = m[4] * x * x + m[5] * y * y + m[6] * z * z + m[7] * y * z + m[8] * z * x + m[9] * x * y;
  const double trace = m[10] * x + m[11] * y + m[12] * z;
  const double cubic = x * (x * (m[13] * x + m[16] * y + m[17] * z) + y * (m[18] * y + m[22] * z)) +
                       y * (y * (m[14] * y + m[19] * z)) + z * (z * (m[15] * z + m[20] * x + m[21] * y));
  const double value = (zeroth + m[3]) * i3 + i5 * (-3 * first - 1.5 * trace + 7.5 * cubic * i2);
  // Rounding of the moments: a few units of the last place for each triangle, of sums that are below six times the
  // area's.
  const double rounding = (node.end - node.begin + 64.0) * 2e-15 * node.area * i2 / kSphere;
  return {value / kSphere, error + rounding};
}

// Splits the node with the largest bound until `done`.
template <typename Done>
TurnsTree::Turns TurnsTree::refine(Vec3 p, const Done& done) const {
  Turns total;
  std::vector<Open> heap;
  heap.reserve(64);
  const auto add = [&](std::uint32_t n) {
    const Turns t = of(nodes_[n], p);
    total.value += t.value;
    total.error += t.error;
    heap.push_back({t, n});
    std::push_heap(heap.begin(), heap.end());
  };
  if (!nodes_.empty()) add(0);
  while (!done(total) && !heap.empty()) {
    std::pop_heap(heap.begin(), heap.end());
    const Open o = heap.back();
    heap.pop_back();
    total.value -= o.turns.value;
    total.error = std::max(0.0, total.error - o.turns.error);
    const Node& node = nodes_[o.node];
    if (node.left != 0) {
      add(node.left);
      add(node.left + 1);
    } else {
      for (std::uint32_t i = node.begin; i < node.end; ++i) total.value += turns_of(triangles_[order_[i]], p);
    }
  }
  return total;
}

double TurnsTree::sum(Vec3 p) const {
  double turns = 0;
  for (const Fan& f : triangles_) turns += turns_of(f, p);
  return turns;
}

TurnsTree::Turns TurnsTree::turns(Vec3 p, double tolerance) const {
  Turns t = refine(p, [&](const Turns& now) { return now.error + rounding_ <= tolerance; });
  t.error += rounding_;
  return t;
}

bool TurnsTree::beyond_half(int winding, Vec3 p) const {
  const auto decided = [&](const Turns& t) {
    return std::abs(std::abs(winding - t.value) - 0.5) > t.error + rounding_;
  };
  const Turns t = refine(p, decided);
  return std::abs(winding - (decided(t) ? t.value : sum(p))) > 0.5;
}

int TurnsTree::crossings_before(Vec3 p) const {
  if (nodes_.empty()) return 0;
  int count = 0;
  std::array<std::uint32_t, 128> stack;  // halves: never deeper than 32
  std::size_t top = 0;
  stack[top++] = 0;
  while (top > 0) {
    const Node& node = nodes_[stack[--top]];
    if (node.lo.x > p.x || node.lo.y > p.y || node.hi.y < p.y || node.lo.z > p.z || node.hi.z < p.z) continue;
    if (node.left != 0) {
      stack[top++] = node.left;
      stack[top++] = node.left + 1;
      continue;
    }
    for (std::uint32_t i = node.begin; i < node.end; ++i) {
      const Fan& f = triangles_[order_[i]];
      count += f.weight * crossing_before(f.a, f.b, f.c, p);
    }
  }
  return count;
}

}  // namespace osteo::inline geometry
