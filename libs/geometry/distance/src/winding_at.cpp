#include "winding_at.h"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "osteo/core/base/parallel.h"
#include "osteo/geometry/distance/triangle_tree.h"
#include "winding.h"

namespace osteo::inline geometry {
namespace {

struct Corners {
  Vec3 a, b, c;
};

Corners corners_of(const std::vector<Vec3>& points, const Layer& layer) {
  return {points[layer.corners[0]], points[layer.corners[1]], points[layer.corners[2]]};
}

// Turned, so that what was the axis is x.
Vec3 along(std::size_t axis, Vec3 p) {
  return {p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3]};
}

// Rays along one axis, in cells of the plane across it.
class Rays {
 public:
  void add(std::uint32_t number, Vec3 at) { rays_.push_back({number, at}); }

  void sort(std::size_t axis) {
    across_ = {(axis + 1) % 3, (axis + 2) % 3};
    for (const Ray& ray : rays_) box_.include(ray.at);
    cells_ = std::clamp(static_cast<int>(2 * std::sqrt(static_cast<double>(rays_.size()))), 1, 1024);
    const auto of = [&](const Ray& r) {
      return static_cast<std::size_t>(cell(1, r.at[across_[1]])) * static_cast<std::size_t>(cells_) +
             static_cast<std::size_t>(cell(0, r.at[across_[0]]));
    };
    first_.assign(static_cast<std::size_t>(cells_) * static_cast<std::size_t>(cells_) + 1, 0);
    for (const Ray& r : rays_) ++first_[of(r) + 1];
    for (std::size_t c = 1; c < first_.size(); ++c) first_[c] += first_[c - 1];
    std::vector<Ray> sorted(rays_.size());
    std::vector<std::uint32_t> fill(first_.begin(), first_.end() - 1);
    for (const Ray& r : rays_) sorted[fill[of(r)]++] = r;
    rays_ = std::move(sorted);
  }

  // Of each ray that meets the box: its number and its place.
  template <typename Visit>
  void that_meet(const BoxMm& box, const Visit& visit) const {
    if (rays_.empty()) return;
    int from[2], to[2];
    for (std::size_t k = 0; k < 2; ++k) {
      const std::size_t axis = across_[k];
      if (box.hi[axis] < box_.lo[axis] || box.lo[axis] > box_.hi[axis]) return;
      from[k] = cell(k, box.lo[axis]);
      to[k] = cell(k, box.hi[axis]);
    }
    for (int j = from[1]; j <= to[1]; ++j) {
      const std::size_t row = static_cast<std::size_t>(j) * static_cast<std::size_t>(cells_);
      const std::uint32_t begin = first_[row + static_cast<std::size_t>(from[0])],
                          end = first_[row + static_cast<std::size_t>(to[0]) + 1];
      for (std::uint32_t r = begin; r < end; ++r) {
        const Vec3 p = rays_[r].at;
        if (p[across_[0]] >= box.lo[across_[0]] && p[across_[0]] <= box.hi[across_[0]] &&
            p[across_[1]] >= box.lo[across_[1]] && p[across_[1]] <= box.hi[across_[1]])
          visit(rays_[r].number, p);
      }
    }
  }

 private:
  struct Ray {
    std::uint32_t number;
    Vec3 at;
  };
  // Never falls where x grows, so that nothing between two places is missed.
  [[nodiscard]] int cell(std::size_t k, double x) const {
    const double lo = box_.lo[across_[k]], size = box_.hi[across_[k]] - lo;
    if (!(size > 0)) return 0;
    return static_cast<int>(std::clamp((x - lo) / size * cells_, 0.0, cells_ - 1.0));
  }
  std::array<std::size_t, 2> across_{};
  std::vector<Ray> rays_;
  BoxMm box_;
  int cells_ = 1;
  std::vector<std::uint32_t> first_;
};

}  // namespace

std::vector<std::optional<int>> windings_behind(const std::vector<Vec3>& points, const std::vector<Layer>& closed,
                                                std::span<const PlaceOn> places, const Context& context) {
  BoxMm all;
  for (const Layer& layer : closed) {
    for (const auto v : layer.corners) all.include(points[v]);
  }
  double largest = 0;
  for (std::size_t axis = 0; axis < 3; ++axis)
    largest = std::max({largest, std::abs(all.lo[axis]), std::abs(all.hi[axis])});
  // A place where an edge is passed is off by a few units of the last place of a coordinate.
  const double near = 1e-12 * largest;

  struct Found {
    std::atomic<int> crossed{0};  // sums of whole numbers: the order of threads does not matter
    std::atomic<bool> doubtful{false};
  };
  std::vector<Found> found(places.size());
  std::array<Rays, 3> rays;
  for (std::uint32_t i = 0; i < places.size(); ++i) {
    const auto [a, b, c] = corners_of(points, closed[places[i].layer]);
    const Vec3 across = cross(b - a, c - a), p = places[i].at;
    std::size_t axis = 0;
    for (std::size_t other = 1; other < 3; ++other) {
      if (std::abs(across[other]) > std::abs(across[axis])) axis = other;
    }
    const LineCrossing own = crossing_of_line(along(axis, a), along(axis, b), along(axis, c), along(axis, p));
    const double to_edge =
        std::min({length(cross(b - a, p - a)) / length(b - a), length(cross(c - b, p - b)) / length(c - b),
                  length(cross(a - c, p - c)) / length(a - c)});
    if (own.turns == 0 || !(to_edge > 4 * near)) {
      found[i].doubtful = true;
      continue;
    }
    if (own.turns > 0) found[i].crossed = closed[places[i].layer].net;
    rays[axis].add(i, p);
  }
  for (std::size_t axis = 0; axis < 3; ++axis) rays[axis].sort(axis);

  const auto follow = [&](std::uint32_t t) {
    if (closed[t].net == 0) return;
    const auto [a, b, c] = corners_of(points, closed[t]);
    BoxMm box;
    for (const Vec3 p : {a, b, c}) box.include(p);
    for (std::size_t axis = 0; axis < 3; ++axis) box.lo[axis] -= near, box.hi[axis] += near;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      rays[axis].that_meet(box, [&](std::uint32_t i, Vec3 p) {
        if (places[i].layer == t) return;
        const LineCrossing x = crossing_of_line(along(axis, a), along(axis, b), along(axis, c), along(axis, p));
        if (x.turns != 0 && x.at <= p[axis])
          found[i].crossed.fetch_add(x.turns * closed[t].net, std::memory_order_relaxed);
        if (p[axis] >= box.lo[axis] && p[axis] <= box.hi[axis] && closest_on_triangle(p, a, b, c).distance_mm <= near)
          found[i].doubtful.store(true, std::memory_order_relaxed);
      });
    }
  };
  parallel_for(closed.size(), 16384, context.threads, [&](std::size_t begin, std::size_t end) {
    context.check_cancelled();
    for (std::size_t t = begin; t < end; ++t) follow(static_cast<std::uint32_t>(t));
  });
  std::vector<std::optional<int>> result(places.size());
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (!found[i].doubtful) result[i] = found[i].crossed.load();
  }
  return result;
}

}  // namespace osteo::inline geometry
