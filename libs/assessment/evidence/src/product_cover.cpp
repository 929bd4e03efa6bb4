// Items that go by cover: what lies between a structure's face, a tube or a curve and the cavity.
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <queue>

#include "osteo/assessment/evidence/detail/product.h"
#include "product_lattice.h"

namespace osteo::inline assessment {

namespace {
// A share of a face says little where the face is far larger than what was to be done on it.
const char* const kWholeFace = "over all of its face: no patch, no direction";
}  // namespace

std::vector<Product::Patch> Product::patch_of(std::uint8_t value, const ScaleItem& item) const {
  const FacePart part(procedure_, item);
  std::vector<Patch> patch;
  const TriMesh& face = structures_.face(number_[value]);
  for (const auto& t : face.triangles) {
    const Vec3 a = from_floats(face.points_mm[t[0]]), b = from_floats(face.points_mm[t[1]]),
               c = from_floats(face.points_mm[t[2]]);
    const Vec3 n = cross(b - a, c - a);
    const double area = length(n) / 2;
    const Vec3 at = (a + b + c) / 3;
    if (area <= 0 || !part.has(at, n)) continue;
    // What lies outside the lattice is far from all that was done.
    patch.push_back({at, normalized(n), area, cell(at) == frame_.voxel_count() ? 1e9 : cavity_distance_mm(at)});
  }
  return patch;
}

void Product::exposed(const ScaleItem& item, std::uint8_t s, Result& r) const {
  const std::vector<Patch> patch = patch_of(s, item);
  double all = 0;
  for (const Patch& p : patch) {
    all += p.area_mm2;
    if (p.cover_mm <= item.cover_mm) keep(r, p.at_mm);
  }
  if (all <= 0) {
    r.word = FacePart(procedure_, item).nothing();
    return;
  }
  if (FacePart(procedure_, item).whole()) r.word = kWholeFace;
  const auto share = [&](double cover_mm) {
    double shown = 0;
    for (const Patch& p : patch) shown += p.cover_mm <= cover_mm ? p.area_mm2 : 0;
    return shown / all;
  };
  r.measured = true;
  r.value = share(item.cover_mm);
  r.pass = r.value >= item.threshold;
  r.margin = (r.value - item.threshold) / item.spread;
  settle(r, share(std::max(0.0, item.cover_mm - off_mm())) >= item.threshold,
         share(item.cover_mm + off_mm()) >= item.threshold);
}

// Triangles that share a point are connected.
void Product::hole(const ScaleItem& item, std::uint8_t s, Result& r) const {
  const FacePart looked_at(procedure_, item);
  const double bare_mm = frame_.spacing_mm.x / 2;
  bool any = false;
  struct Bare {
    std::array<std::uint32_t, 3> points;
    double cover_mm, mm2;
    Vec3 at_mm;
  };
  std::vector<Bare> bare;
  const TriMesh& face = structures_.face(number_[s]);
  for (const auto& t : face.triangles) {
    const Vec3 a = from_floats(face.points_mm[t[0]]), b = from_floats(face.points_mm[t[1]]),
               c = from_floats(face.points_mm[t[2]]);
    const Vec3 n = cross(b - a, c - a), at = (a + b + c) / 3;
    if (length(n) <= 0 || !looked_at.has(at, n)) continue;
    any = true;
    if (cell(at) == frame_.voxel_count()) continue;
    const double cover_mm = cavity_distance_mm(at);
    if (cover_mm <= 1.5 * bare_mm) bare.push_back({{t[0], t[1], t[2]}, cover_mm, length(n) / 2, at});
  }
  if (!any) {
    r.word = looked_at.nothing();
    return;
  }
  // The points of bare triangles alone, numbered again.
  std::vector<std::uint32_t> points;
  for (const Bare& b : bare) points.insert(points.end(), b.points.begin(), b.points.end());
  std::sort(points.begin(), points.end());
  points.erase(std::unique(points.begin(), points.end()), points.end());
  for (Bare& b : bare) {
    for (std::uint32_t& p : b.points)
      p = static_cast<std::uint32_t>(std::lower_bound(points.begin(), points.end(), p) - points.begin());
  }
  std::vector<std::uint32_t> part(points.size());
  std::vector<double> area(points.size());
  const auto largest = [&](double most_mm, Result* notify) {
    std::iota(part.begin(), part.end(), 0U);
    std::fill(area.begin(), area.end(), 0.0);
    const auto root = [&](std::uint32_t p) {
      while (part[p] != p) p = part[p] = part[part[p]];
      return p;
    };
    for (const Bare& b : bare) {
      if (b.cover_mm > most_mm) continue;
      part[root(b.points[1])] = root(b.points[0]);
      part[root(b.points[2])] = root(b.points[0]);
    }
    double most = 0;
    for (const Bare& b : bare) {
      if (b.cover_mm > most_mm) continue;
      double& mm2 = area[root(b.points[0])];
      mm2 += b.mm2;
      most = std::max(most, mm2);
    }
    if (notify != nullptr) {
      for (const Bare& b : bare) {
        if (b.cover_mm <= most_mm && area[root(b.points[0])] == most) keep(*notify, b.at_mm);
      }
    }
    return most;
  };
  r.value = largest(bare_mm, &r);
  r.measured = true;
  r.pass = r.value < item.threshold;
  r.margin = (item.threshold - r.value) / item.spread;
  settle(r, largest(1.5 * bare_mm, nullptr) < item.threshold, largest(0.5 * bare_mm, nullptr) < item.threshold);
}

void Product::thinned(const ScaleItem& item, std::uint8_t s, Result& r) const {
  std::vector<std::pair<double, double>> wall;
  double all = 0;
  for (const Patch& p : patch_of(s, item)) {
    wall.emplace_back(p.cover_mm, p.area_mm2);
    all += p.area_mm2;
    if (p.cover_mm > item.threshold) keep(r, p.at_mm);
  }
  if (all <= 0 || cells_->to_cavity.empty()) {
    r.word = all <= 0 ? FacePart(procedure_, item).nothing() : no_cavity();
    return;
  }
  if (FacePart(procedure_, item).whole()) r.word = kWholeFace;
  std::sort(wall.begin(), wall.end());
  const auto quantile = [&](double q) {
    double sum = 0;
    for (const auto& [mm, mm2] : wall) {
      sum += mm2;
      if (sum >= q * all) return mm;
    }
    return wall.back().first;
  };
  const double p90 = quantile(0.9);
  r.measured = true;
  r.value = quantile(0.5);
  r.pass = r.value <= item.threshold && p90 <= item.most;
  r.margin = std::min(item.threshold - r.value, item.most - p90) / item.spread;
  const auto passes = [&](double off_mm) { return r.value + off_mm <= item.threshold && p90 + off_mm <= item.most; };
  settle(r, passes(off_mm()), passes(-off_mm()));
  r.word = joined(r.word, "90 % of the wall is at most " + format_number(std::round(p90 * 100) / 100) + " mm");
}

// Along a tube: cells by their way from one of its ends, in steps of a millimetre.
void Product::followed(const ScaleItem& item, std::uint8_t s, Result& r) const {
  std::vector<std::size_t> inside;
  std::map<std::size_t, std::uint32_t> number;
  each_cell(cells_->near(s, 0), [&](int i, int j, int k) {
    const std::size_t c = offset(i, j, k);
    if (cells_->label[c] != s) return;
    number.emplace(c, static_cast<std::uint32_t>(inside.size()));
    inside.push_back(c);
  });
  if (inside.empty()) {
    r.word = "it is thinner than the lattice of " + format_number(frame_.spacing_mm.x) + " mm";
    return;
  }
  const auto nx = static_cast<std::ptrdiff_t>(frame_.dims[0]), nxy = nx * frame_.dims[1];
  const double h = frame_.spacing_mm.x;
  const auto ways_from = [&](std::uint32_t start) {
    std::vector<double> way(inside.size(), 1e9);
    using Entry = std::pair<double, std::uint32_t>;
    std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
    queue.emplace(way[start] = 0, start);
    while (!queue.empty()) {
      const auto [d, at] = queue.top();
      queue.pop();
      if (d > way[at]) continue;
      for (int k = -1; k <= 1; ++k)
        for (int j = -1; j <= 1; ++j)
          for (int i = -1; i <= 1; ++i) {
            const auto to =
                number.find(static_cast<std::size_t>(static_cast<std::ptrdiff_t>(inside[at]) + i + j * nx + k * nxy));
            if (to == number.end()) continue;
            const double next = d + h * std::sqrt(double(i * i + j * j + k * k));
            if (next < way[to->second] - 1e-9) queue.emplace(way[to->second] = next, to->second);
          }
    }
    return way;
  };
  const auto farthest = [](const std::vector<double>& way) {
    std::uint32_t best = 0;
    for (std::uint32_t n = 0; n < way.size(); ++n) {
      if (way[n] < 1e9 && (way[best] >= 1e9 || way[n] > way[best])) best = n;
    }
    return best;
  };
  const std::vector<double> way = ways_from(farthest(ways_from(0)));
  const auto bins = static_cast<std::size_t>(way[farthest(way)]) + 1;
  std::vector<double> cover(bins, 1e9);
  // Its face, not its middle, is what the cavity comes near to: each triangle counts where the cell just inside it
  // lies.
  for (const Patch& p : patch_of(s, item)) {
    for (double in = 0.5; in <= 2; in += 0.5) {
      const auto n = number.find(cell(p.at_mm - p.normal * (in * h)));
      if (n == number.end()) continue;
      if (way[n->second] < 1e9) {
        double& c = cover[std::min(bins - 1, static_cast<std::size_t>(way[n->second]))];
        c = std::min(c, p.cover_mm);
      }
      break;
    }
  }
  const auto share = [&](double cover_mm) {
    std::size_t shown = 0, all = 0;
    for (std::size_t n = 0; n < bins; ++n) {
      if (cover[n] >= 1e9 && !cells_->to_cavity.empty()) continue;
      ++all;
      if (cover[n] <= cover_mm) ++shown;
    }
    return all > 0 ? static_cast<double>(shown) / static_cast<double>(all) : -1;
  };
  const auto place_of = [&](std::size_t c) {
    const auto row = static_cast<std::size_t>(nx), slice = static_cast<std::size_t>(nxy);
    return place(static_cast<int>(c % row), static_cast<int>(c % slice / row), static_cast<int>(c / slice));
  };
  for (std::size_t n = 0; n < inside.size(); ++n) {
    if (way[n] < 1e9 && cover[std::min(bins - 1, static_cast<std::size_t>(way[n]))] <= item.cover_mm)
      keep(r, place_of(inside[n]));
  }
  r.measured = share(item.cover_mm) >= 0;
  r.value = std::max(0.0, share(item.cover_mm));
  r.pass = r.measured && r.value >= item.threshold;
  r.margin = (r.value - item.threshold) / item.spread;
  settle(r, share(std::max(0.0, item.cover_mm - off_mm())) >= item.threshold,
         share(item.cover_mm + off_mm()) >= item.threshold);
}

// The cavity reaches a landmark curve: everywhere near it, nowhere far beyond. Value: the farthest that the curve is
// from it.
void Product::margin(const ScaleItem& item, Vec3 approach, Result& r) const {
  if (cells_->to_cavity.empty()) {
    r.word = no_cavity();
    return;
  }
  Vec3 middle;
  for (const RemovedVoxel& v : removed_)
    middle += v.own_mm / static_cast<double>(std::max<std::size_t>(1, removed_.size()));
  double beyond = 0;
  std::vector<Vec3> samples;
  for (std::size_t n = 0; n + 1 < item.curve_mm.size(); ++n) {
    const Vec3 a = item.curve_mm[n], by = item.curve_mm[n + 1] - a;
    const int steps = std::max(1, static_cast<int>(std::ceil(length(by) / 0.25)));
    for (int t = 0; t < steps + (n + 2 == item.curve_mm.size() ? 1 : 0); ++t)
      samples.push_back(a + by * (double(t) / steps));
  }
  for (const Vec3 p : samples) {
    const double d = cell(p) == frame_.voxel_count() ? 1e9 : cavity_distance_mm(p);
    r.value = std::max(r.value, d);
    if (d > item.threshold) keep(r, p);
    // Beyond: on the way on from the cavity's middle across the curve, at right angles to the approach.
    const Vec3 out = normalized(p - middle - approach * dot(p - middle, approach));
    for (double t = 0; t <= 20; t += frame_.spacing_mm.x / 2) {
      std::array<int, 3> c{};
      if (!cell(p + out * t, c)) break;
      if (cells_->cavity.at(c[0], c[1], c[2])) beyond = std::max(beyond, t);
    }
  }
  r.measured = true;
  r.pass = r.value <= item.threshold && beyond <= item.most;
  r.margin = std::min(item.threshold - r.value, item.most - beyond) / item.spread;
  const auto passes = [&](double short_mm, double beyond_mm) {
    return short_mm <= item.threshold && beyond_mm <= item.most;
  };
  settle(r, passes(r.value + off_mm(), beyond) && passes(r.value, beyond + off_mm()),
         passes(r.value - off_mm(), beyond - off_mm()));
  r.word = joined(r.word, "beyond it by " + format_number(std::round(beyond * 10) / 10) + " mm");
}

}  // namespace osteo::inline assessment
