#include "edges.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "gaps.h"
#include "osteo/core/base/parallel.h"

namespace osteo::inline imaging::registration {
namespace {

constexpr double kEdgeReachMm = 4, kStepMm = 0.25, kHalfMm = 4;
constexpr int kReach = static_cast<int>(kEdgeReachMm / kStepMm), kHalf = static_cast<int>(kHalfMm / kStepMm);
constexpr double kAlike = 0.6;  // correlation of two profiles of slopes that are of one edge
constexpr std::size_t kMaxEdgePoints = 6000;

struct Edge {
  Vec3 at_mm, normal;  // towards the brighter side
};

struct Gradient {
  Vec3 direction;  // world, unit
  float size = 0;
};

// Of values within the scan's usual range, so that a clip of metal does not hide all else.
Gradient gradient_at(const Levels& l, int i, int j, int k) {
  const Level& v = l.levels.front();
  const auto at = [&](int x, int y, int z) { return std::clamp(v.at(x, y, z), l.lo, l.hi); };
  const Vec3 g{static_cast<double>(at(i + 1, j, k) - at(i - 1, j, k)),
               static_cast<double>(at(i, j + 1, k) - at(i, j - 1, k)),
               static_cast<double>(at(i, j, k + 1) - at(i, j, k - 1))};
  const double n = length(g);
  return {n > 0 ? v.frame.direction * (g / n) : Vec3{}, static_cast<float>(n)};
}

// Voxels where the slope is steep and steepest along itself.
std::vector<Edge> edges_of(const Levels& l, const Context& context) {
  const Level& v = l.levels.front();
  const auto& d = v.frame.dims;
  std::vector<Edge> all;
  if (d[0] < 5 || d[1] < 5 || d[2] < 5) return all;
  const float steep = 0.12F * (l.hi - l.lo);
  std::vector<std::vector<Edge>> of_slice(static_cast<std::size_t>(d[2]));
  parallel_for(static_cast<std::size_t>(d[2] - 4), 1, context.threads, [&](std::size_t begin, std::size_t end) {
    context.check_cancelled();
    for (std::size_t s = begin; s < end; ++s) {
      const int k = static_cast<int>(s) + 2;
      for (int j = 2; j < d[1] - 2; ++j)
        for (int i = 2; i < d[0] - 2; ++i) {
          const Gradient g = gradient_at(l, i, j, k);
          if (g.size < steep) continue;
          const Vec3 step = transposed(v.frame.direction) * g.direction;
          const auto beside = [&](double t) {
            return gradient_at(l, i + static_cast<int>(std::lround(t * step.x)),
                               j + static_cast<int>(std::lround(t * step.y)),
                               k + static_cast<int>(std::lround(t * step.z)))
                .size;
          };
          if (g.size < beside(1) || g.size <= beside(-1)) continue;
          of_slice[s + 2].push_back(
              {v.frame.world_from_index({static_cast<double>(i), static_cast<double>(j), static_cast<double>(k)}),
               g.direction});
        }
    }
  });
  for (const auto& s : of_slice) all.insert(all.end(), s.begin(), s.end());
  return all;
}

// Sizes of the slope along a line, less their mean; nothing where a part of the line lies outside.
template <int kCount>
bool slopes_along(const Levels& l, const IndexMap& m, Vec3 at, Vec3 direction, std::array<float, kCount>& out) {
  constexpr int kSide = (kCount - 1) / 2;
  std::array<float, kCount + 4> values;
  for (int n = -kSide - 2; n <= kSide + 2; ++n) {
    const Vec3 p = at + direction * (n * kStepMm);
    const auto x = static_cast<float>(p.x), y = static_cast<float>(p.y), z = static_cast<float>(p.z);
    const auto along = [&](std::size_t r) { return m.row[r][0] * x + m.row[r][1] * y + m.row[r][2] * z + m.shift[r]; };
    float v = 0;
    if (!sample(l.levels.front(), along(0), along(1), along(2), v)) return false;
    values[static_cast<std::size_t>(n + kSide + 2)] = std::clamp(v, l.lo, l.hi);
  }
  for (std::size_t i = 0; i < kCount; ++i) out[i] = std::abs(values[i + 4] - values[i]);
  return true;
}

struct Offset {
  bool found = false;
  double mm = 0;
};

// Where along the line the second's slopes look most like the first's.
std::optional<Offset> offset_at(const Edge& e, const Levels& first, const IndexMap& own, const Levels& second,
                                const IndexMap& other, Vec3 centre) {
  std::array<float, 2 * kHalf + 1> a;
  std::array<float, 2 * (kHalf + kReach) + 1> b;
  if (!slopes_along<2 * kHalf + 1>(first, own, e.at_mm - centre, e.normal, a) ||
      !slopes_along<2 * (kHalf + kReach) + 1>(second, other, e.at_mm - centre, e.normal, b))
    return std::nullopt;
  constexpr auto n = static_cast<double>(2 * kHalf + 1);
  double ma = 0, va = 0;
  for (const float x : a) ma += static_cast<double>(x) / n;
  for (const float x : a) va += (static_cast<double>(x) - ma) * (static_cast<double>(x) - ma);
  std::array<double, 2 * kReach + 1> score{};
  for (std::size_t s = 0; s < score.size(); ++s) {
    double mb = 0, vb = 0, ab = 0;
    for (std::size_t i = 0; i < a.size(); ++i) mb += static_cast<double>(b[s + i]) / n;
    for (std::size_t i = 0; i < a.size(); ++i) {
      const double x = static_cast<double>(a[i]) - ma, y = static_cast<double>(b[s + i]) - mb;
      vb += y * y;
      ab += x * y;
    }
    // A flat stretch matches nothing.
    const double least = 1e-3 * static_cast<double>(second.hi - second.lo) * static_cast<double>(second.hi - second.lo);
    score[s] = va > 0 && vb > least ? ab / std::sqrt(va * vb) : 0;
  }
  const auto best = static_cast<std::size_t>(std::max_element(score.begin(), score.end()) - score.begin());
  if (score[best] < kAlike) return Offset{};
  double at = static_cast<double>(best) - kReach;
  if (best > 0 && best + 1 < score.size()) {
    const double bend = score[best - 1] - 2 * score[best] + score[best + 1];
    if (bend < 0) at += 0.5 * (score[best - 1] - score[best + 1]) / bend;
  }
  return Offset{true, at * kStepMm};
}

bool shows(const Levels& scan, Vec3 at_mm) {
  const Frame& f = scan.levels.front().frame;
  const Vec3 x = f.index_from_world(at_mm);
  bool in = true;
  for (std::size_t a = 0; a < 3; ++a) in = in && x[a] >= 2 && x[a] <= f.dims[a] - 3;
  return in;
}

// Evenly along the list.
std::vector<Edge> few_of(const std::vector<Edge>& all) {
  const std::size_t step = std::max<std::size_t>(1, all.size() / kMaxEdgePoints), n = all.size() / step;
  std::vector<Edge> few;
  for (std::size_t i = 0; i < n; ++i) few.push_back(all[i * step]);
  return few;
}

// Nothing where a part of the line lies outside.
std::vector<std::optional<Offset>> offsets_at(const std::vector<Edge>& edges, const Levels& first, const Levels& second,
                                              const RigidTransform& second_from_first, const Context& context) {
  const Vec3 centre = first.levels.front().frame.centre_mm();
  const IndexMap own = index_map(first.levels.front().frame, {}, centre),
                 other = index_map(second.levels.front().frame, second_from_first, centre);
  std::vector<std::optional<Offset>> offsets(edges.size());
  parallel_for(edges.size(), 128, context.threads, [&](std::size_t begin, std::size_t end) {
    context.check_cancelled();
    for (std::size_t i = begin; i < end; ++i) offsets[i] = offset_at(edges[i], first, own, second, other, centre);
  });
  return offsets;
}

// Edges that both scans show, and how far along its normal each lies off in the second.
struct Measured {
  Edge edge;
  Offset offset;
};
std::vector<Measured> measure(const std::vector<Edge>& all, const Levels& first, const Levels& second,
                              const RigidTransform& second_from_first, const Context& context) {
  std::vector<Edge> edges;
  for (const Edge& e : all)
    if (shows(second, second_from_first(e.at_mm))) edges.push_back(e);
  edges = few_of(edges);
  const auto offsets = offsets_at(edges, first, second, second_from_first, context);
  std::vector<Measured> measured;
  for (std::size_t i = 0; i < edges.size(); ++i) {
    if (offsets[i]) measured.push_back({edges[i], *offsets[i]});
  }
  return measured;
}

}  // namespace

RigidTransform fit_edges(const Levels& first, const Levels& second, const RigidTransform& guess,
                         const Context& context) {
  const std::vector<Edge> edges = edges_of(first, context);
  RigidTransform second_from_first = guess;
  for (int n = 0; n < 12; ++n) {
    const std::vector<Measured> measured = measure(edges, first, second, second_from_first, context);
    std::vector<double> size;
    for (const Measured& m : measured) {
      if (m.offset.found) size.push_back(std::abs(m.offset.mm));
    }
    if (size.size() < 300) return guess;
    std::sort(size.begin(), size.end());
    const double limit = std::max(3 * size[size.size() / 2], 0.3);
    // A place of the first must go along its normal by the offset to where the second has it.
    std::vector<Gap> gaps;
    for (const Measured& m : measured) {
      if (m.offset.found && std::abs(m.offset.mm) <= limit) gaps.push_back({m.edge.at_mm, m.edge.normal, -m.offset.mm});
    }
    const Closing c = close_gaps(gaps);
    second_from_first = second_from_first * c.motion;
    if (c.moved_mm < 2e-3) break;
  }
  return second_from_first;
}

EdgeResidual edge_residual(const Levels& first, const Levels& second, const RigidTransform& second_from_first,
                           const Context& context) {
  std::vector<double> size, signed_mm;
  EdgeResidual r;
  for (const Measured& m : measure(edges_of(first, context), first, second, second_from_first, context)) {
    size.push_back(m.offset.found ? std::abs(m.offset.mm) : kEdgeReachMm);
    if (m.offset.found) signed_mm.push_back(m.offset.mm);
  }
  r.points = static_cast<int>(size.size());
  if (size.empty()) return r;
  r.found = static_cast<double>(signed_mm.size()) / static_cast<double>(size.size());
  std::sort(size.begin(), size.end());
  std::sort(signed_mm.begin(), signed_mm.end());
  r.median_mm = size[size.size() / 2];
  r.p90_mm = size[size.size() * 9 / 10];
  // The normal points to the brighter side, inwards.
  if (!signed_mm.empty()) r.shift_mm = -signed_mm[signed_mm.size() / 2];
  return r;
}

std::vector<TwoOffsets> offsets_of_two(const Levels& first, const Levels& one, const RigidTransform& one_from_first,
                                       const Levels& other, const RigidTransform& other_from_first,
                                       const Context& context) {
  std::vector<Edge> edges;
  for (const Edge& e : edges_of(first, context))
    if (shows(one, one_from_first(e.at_mm)) && shows(other, other_from_first(e.at_mm))) edges.push_back(e);
  edges = few_of(edges);
  const auto a = offsets_at(edges, first, one, one_from_first, context),
             b = offsets_at(edges, first, other, other_from_first, context);
  const auto mm = [](const Offset& o) { return o.found ? std::optional(o.mm) : std::nullopt; };
  std::vector<TwoOffsets> both;
  for (std::size_t i = 0; i < edges.size(); ++i)
    if (a[i] && b[i]) both.push_back({edges[i].at_mm, edges[i].normal, mm(*a[i]), mm(*b[i])});
  return both;
}

}  // namespace osteo::inline imaging::registration
