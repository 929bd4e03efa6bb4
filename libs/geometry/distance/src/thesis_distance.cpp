#include "osteo/geometry/distance/distance_methods.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <numeric>

#include "kernel.h"
#include "tree_data.h"

namespace osteo::inline geometry {

struct ThesisDistance::Tree {
  struct Node {
    Vec3 lo, hi;
    std::int32_t parent = -1, left = -1, right = -1;
    std::uint32_t triangle = 0;
  };
  std::vector<Node> nodes;
  std::vector<distance::ExactTriangle> exact;

  // Halves at the middle of the longest axis; where that leaves a side empty, at the median.
  std::int32_t build(std::vector<std::uint32_t>& order, std::size_t begin, std::size_t end, std::int32_t parent) {
    const auto id = static_cast<std::int32_t>(nodes.size());
    Node node;
    node.parent = parent;
    node.lo = {1e300, 1e300, 1e300};
    node.hi = {-1e300, -1e300, -1e300};
    for (std::size_t i = begin; i < end; ++i) {
      const distance::ExactTriangle& t = exact[order[i]];
      for (std::size_t a = 0; a < 3; ++a) {
        node.lo[a] = std::min({node.lo[a], t.a[a], t.b[a], t.c[a]});
        node.hi[a] = std::max({node.hi[a], t.a[a], t.b[a], t.c[a]});
      }
    }
    node.triangle = order[begin];
    nodes.push_back(node);
    if (end - begin == 1) return id;
    const Vec3 extent = node.hi - node.lo;
    const std::size_t axis = extent.x >= extent.y && extent.x >= extent.z ? 0 : extent.y >= extent.z ? 1 : 2;
    const auto centre = [&](std::uint32_t t) { return exact[t].a[axis] + exact[t].b[axis] + exact[t].c[axis]; };
    const double middle = 1.5 * (node.lo[axis] + node.hi[axis]);
    const auto first = order.begin() + static_cast<std::ptrdiff_t>(begin),
               last = order.begin() + static_cast<std::ptrdiff_t>(end);
    auto split = std::stable_partition(first, last, [&](std::uint32_t t) { return centre(t) < middle; });
    if (split == first || split == last) {
      split = first + (last - first) / 2;
      std::nth_element(first, split, last, [&](std::uint32_t x, std::uint32_t y) {
        return std::make_pair(centre(x), x) < std::make_pair(centre(y), y);
      });
    }
    const auto at = static_cast<std::size_t>(split - order.begin());
    const std::int32_t left = build(order, begin, at, id);
    const std::int32_t right = build(order, at, end, id);
    nodes[static_cast<std::size_t>(id)].left = left;
    nodes[static_cast<std::size_t>(id)].right = right;
    return id;
  }
};

ThesisDistance::ThesisDistance(const TriangleSoup& soup) : tree_(std::make_unique<Tree>()) {
  require_sound(soup);
  for (const auto& t : soup.triangles) {
    tree_->exact.push_back(distance::make_exact(soup.points_mm[t[0]], soup.points_mm[t[1]], soup.points_mm[t[2]]));
  }
  if (tree_->exact.empty()) return;
  std::vector<std::uint32_t> order(soup.triangles.size());
  std::iota(order.begin(), order.end(), 0U);
  tree_->build(order, 0, order.size(), -1);
}

ThesisDistance::~ThesisDistance() = default;

std::vector<double> ThesisDistance::distances_mm(std::span<const Vec3> points, const ThesisDistanceOptions& options,
                                                 const Context& context) const {
  std::vector<double> result;
  result.reserve(points.size());
  if (tree_->nodes.empty()) {
    result.assign(points.size(), std::numeric_limits<double>::infinity());
    return result;
  }
  std::deque<std::int32_t> boxes_to_descend;
  std::int32_t closest_node = -1;
  for (const Vec3 v : points) {
    if ((result.size() & 4095U) == 0) context.check_cancelled();
    double lowest = std::numeric_limits<double>::infinity(), lowest_upper = lowest;
    if (options.tree_ascend_n >= 0 && closest_node >= 0) {
      std::int32_t seed = closest_node;
      for (int i = 0; i < options.tree_ascend_n && tree_->nodes[static_cast<std::size_t>(seed)].parent >= 0; ++i) {
        seed = tree_->nodes[static_cast<std::size_t>(seed)].parent;
      }
      boxes_to_descend.push_back(seed);
    }
    boxes_to_descend.push_back(0);
    while (!boxes_to_descend.empty()) {
      const std::int32_t id = boxes_to_descend.front();
      boxes_to_descend.pop_front();
      const Tree::Node& node = tree_->nodes[static_cast<std::size_t>(id)];
      if (node.left < 0) {
        const double p[3] = {0, 0, 0}, origin[3] = {v.x, v.y, v.z};
        const std::uint32_t voxel = 0;
        double d2 = 0;
        distance::kScalar.measure_voxels(tree_->exact.data(), &node.triangle, &voxel, 1, origin, p, &d2);
        if (d2 < lowest) {
          lowest = d2;
          closest_node = id;
          lowest_upper = std::min(lowest_upper, d2);
        }
        continue;
      }
      double best_sum = 0, worst_sum = 0, best_squares = 0, worst_squares = 0;
      for (std::size_t a = 0; a < 3; ++a) {
        const double best = std::max({node.lo[a] - v[a], v[a] - node.hi[a], 0.0});
        const double worst = std::max(std::abs(node.lo[a] - v[a]), std::abs(node.hi[a] - v[a]));
        best_sum += best, worst_sum += worst;
        best_squares += best * best, worst_squares += worst * worst;
      }
      const double lower = options.bound_as_printed ? best_sum * best_sum : best_squares;
      const double upper = options.bound_as_printed ? worst_sum * worst_sum : worst_squares;
      if (lower > lowest_upper) continue;
      lowest_upper = std::min(lowest_upper, upper);
      if (options.breadth_first) {
        boxes_to_descend.push_back(node.left);
        boxes_to_descend.push_back(node.right);
      } else {
        boxes_to_descend.push_front(node.left);
        boxes_to_descend.push_front(node.right);
      }
    }
    result.push_back(std::sqrt(lowest));
  }
  return result;
}

}  // namespace osteo::inline geometry
