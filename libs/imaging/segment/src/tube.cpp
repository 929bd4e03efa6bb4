#include "osteo/imaging/segment/tube.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "field.h"
#include "line.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/order.h"
#include "osteo/core/base/parallel.h"
#include "tube_path.h"

namespace osteo::inline imaging {
namespace {

using segment::evenly;
using segment::Sampler;
using segment::smoothed_line;

constexpr double kStepMm = 0.25;  // between stations
constexpr int kRays = 24;         // across
constexpr double kRayStepMm = 0.1;
constexpr double kSmoothMm = 0.4;  // along, standard deviation
constexpr int kRounds = 5;
constexpr double kMinWallHu = 150;  // a wall stands out by this much, and by four times the noise

std::vector<std::size_t> nearest_stations(const std::vector<Vec3>& line, std::span<const Vec3> points) {
  // In order along the line: a line that comes near itself must not take a later point for an earlier one.
  std::vector<std::size_t> at;
  std::size_t from = 0;
  for (std::size_t q = 0; q < points.size(); ++q) {
    std::size_t best = from;
    for (std::size_t i = from; i < line.size(); ++i)
      if (length(line[i] - points[q]) < length(line[best] - points[q])) best = i;
    if (q == 0) best = 0;
    if (q + 1 == points.size()) best = line.size() - 1;
    at.push_back(best);
    from = best;
  }
  return at;
}

/// What one section shows.
struct Cross {
  Vec3 centre;
  double radius = 0;
  double walls = 0;   ///< share of the directions in which a wall is met
  double open = 1;    ///< the widest run of directions without one, as a share of the round
  double rough = 1;   ///< of the walls about their circle, as a share of its radius
  double filled = 0;  ///< how far the middle's value is from the content's to the wall's: 0 is content, below 0 air
  double thin = 1;    ///< share of the walls that are lower than 0.6 of the usual one
  double level = 0;   ///< of the wall above the content
};

/// What the CT shows across the line at a point.
/// What is met along each of the rays across a tube.
struct Rays {
  std::array<std::vector<double>, kRays> of;
  int steps = 0;
  double middle = 0;
  double sign = 1;  ///< which way the wall differs from the content
  bool air_cell = false;
};

Rays rays_across(const Sampler& hu, Vec3 at, Vec3 along, const TubeParams& params) {
  Rays rays;
  const Vec3 u = any_perpendicular(along), v = cross(along, u);
  const double reach = 1.5 * params.max_radius_mm + 0.8;
  const int n = rays.steps = static_cast<int>(reach / kRayStepMm) + 1;
  const auto value = [&](Vec3 p) { return (hu(p - along * 0.3) + 2 * hu(p) + hu(p + along * 0.3)) / 4; };
  double middle = value(at);
  for (int q = 0; q < 6; ++q) {
    const double a = q * std::numbers::pi / 3;
    middle += value(at + (u * std::cos(a) + v * std::sin(a)) * 0.15);
  }
  middle /= 7;
  rays.middle = middle;
  // Dark in bone or bright in air: what most of the surroundings are.
  std::vector<double> around;
  for (int q = 0; q < kRays; ++q) {
    const double a = 2 * std::numbers::pi * q / kRays;
    const Vec3 d = u * std::cos(a) + v * std::sin(a);
    auto& r = rays.of[static_cast<std::size_t>(q)];
    r.resize(static_cast<std::size_t>(n));
    for (int i = 0; i < n; ++i) r[static_cast<std::size_t>(i)] = i == 0 ? middle : value(at + d * (i * kRayStepMm));
    around.push_back(r[static_cast<std::size_t>(std::min(n - 1, static_cast<int>(std::lround(1.0 / kRayStepMm))))]);
  }
  std::nth_element(around.begin(), around.begin() + kRays / 2, around.end());
  const bool nerve = params.kind == TubeKind::nerve;
  const bool in_air = nerve && around[kRays / 2] < -500 && middle < 0;
  rays.sign = nerve && !in_air ? 1 : -1;
  rays.air_cell = nerve && !in_air && middle < -350;
  return rays;
}

struct Edge {
  double distance, wall, level;
  bool met;
};

/// The wall of a ray: where the value is farthest from the middle's before it comes back by half.
Edge wall_on(const std::vector<double>& r, double sign, double noise, const TubeParams& params) {
  const double least = std::max(kMinWallHu, 4 * noise);
  const int n = static_cast<int>(r.size());
  int top = 0, low = 0;  // the wall; where the content is purest before it
  for (int i = 1; i < n; ++i) {
    const double x = sign * r[static_cast<std::size_t>(i)];
    const double peak = sign * r[static_cast<std::size_t>(top)], base = sign * r[static_cast<std::size_t>(low)];
    if (x > peak) top = i;
    if (peak - base < least) {
      if (x < base) low = top = i;
      if (low * kRayStepMm > 0.6 * params.max_radius_mm + 0.3) break;  // it only gets purer: not here
    } else if (peak - x > std::max(2 * noise, 0.15 * (peak - base))) {
      break;
    }
  }
  const double base = sign * r[static_cast<std::size_t>(low)], peak = sign * r[static_cast<std::size_t>(top)];
  if (peak - base < least) return {};
  const double half = 0.5 * (base + peak);
  int i = low;
  while (i < top && sign * r[static_cast<std::size_t>(i + 1)] < half) ++i;
  const double a = sign * r[static_cast<std::size_t>(i)],
               b = sign * r[static_cast<std::size_t>(std::min(i + 1, n - 1))];
  const double at_mm = (i + (b > a ? std::clamp((half - a) / (b - a), 0.0, 1.0) : 0.5)) * kRayStepMm;
  if (at_mm > 1.2 * params.max_radius_mm) return {};
  return {at_mm, top * kRayStepMm, peak, true};
}

/// The middle of the circle through the edges by least squares, at most 0.35 mm from where it was looked for. Edges
/// that lie far out are taken out of `edges`. I. Kasa 1976.
std::array<double, 2> circle_through(std::array<Edge, kRays>& edges, double usual) {
  double sx = 0, sy = 0, sxx = 0, sxy = 0, syy = 0, sz = 0, sxz = 0, syz = 0, count = 0;
  for (std::size_t q = 0; q < kRays; ++q) {
    if (!edges[q].met || edges[q].distance > 1.8 * usual + 0.1) {
      edges[q].met = false;
      continue;
    }
    const double a = 2 * std::numbers::pi * static_cast<double>(q) / kRays;
    const double x = edges[q].distance * std::cos(a), y = edges[q].distance * std::sin(a), z = x * x + y * y;
    sx += x, sy += y, sxx += x * x, sxy += x * y, syy += y * y, sz += z, sxz += x * z, syz += y * z, count += 1;
  }
  const double cxx = sxx - sx * sx / count, cyy = syy - sy * sy / count, cxy = sxy - sx * sy / count;
  const double bx = 0.5 * (sxz - sx * sz / count), by = 0.5 * (syz - sy * sz / count), det = cxx * cyy - cxy * cxy;
  double mx = 0, my = 0;
  if (det > 1e-6 * count * count) {
    mx = (bx * cyy - by * cxy) / det;
    my = (by * cxx - bx * cxy) / det;
  }
  const double off = std::sqrt(mx * mx + my * my), most = 0.35;
  if (off > most) mx *= most / off, my *= most / off;
  return {mx, my};
}

/// How round, open and even the walls are. `usual`: their median distance; `wall`, `content`: median levels.
void judge_walls(Cross& c, const std::array<Edge, kRays>& edges, std::array<double, 2> middle, double usual,
                 double wall, double content) {
  double square = 0;
  int low = 0, run = 0, widest = 0, met = 0;
  for (std::size_t q = 0; q < 2 * kRays; ++q) {
    run = edges[q % kRays].met ? 0 : run + 1;
    widest = std::max(widest, run);
  }
  for (std::size_t q = 0; q < kRays; ++q) {
    if (!edges[q].met) continue;
    ++met;
    const double a = 2 * std::numbers::pi * static_cast<double>(q) / kRays;
    const double d =
        std::hypot(edges[q].distance * std::cos(a) - middle[0], edges[q].distance * std::sin(a) - middle[1]) - usual;
    square += d * d;
    low += edges[q].level - content < 0.6 * (wall - content) ? 1 : 0;
  }
  c.walls = static_cast<double>(met) / kRays;
  c.open = std::min(widest, kRays) / static_cast<double>(kRays);
  c.rough = std::sqrt(square / std::max(1, met)) / std::max(0.2, usual);
  c.thin = low / static_cast<double>(std::max(1, met));
  c.level = wall - content;
}

/// The radius from what is missing: the blur moves it about but takes nothing away. Only where the wall is whole.
double radius_by_area(const Rays& rays, const std::array<Edge, kRays>& edges, double usual, double wall,
                      double content) {
  // From the mean of the rays, whose noise is less: the highest of a noisy ray is above its wall.
  std::vector<double> mean(static_cast<std::size_t>(rays.steps));
  double used = 0;
  int reached = 0;
  for (std::size_t q = 0; q < kRays; ++q) {
    if (!edges[q].met || edges[q].level < wall - 0.25 * std::abs(wall - content)) continue;
    used += 1;
    reached += static_cast<int>(std::lround(edges[q].wall / kRayStepMm));
    for (std::size_t i = 0; i < mean.size(); ++i) mean[i] += rays.sign * rays.of[q][i];
  }
  if (used == 0) return usual;
  reached = static_cast<int>(reached / used) + 1;
  int top = 0;
  for (int i = 1; i <= std::min(reached, rays.steps - 1); ++i)
    if (mean[static_cast<std::size_t>(i)] > mean[static_cast<std::size_t>(top)]) top = i;
  const double level = mean[static_cast<std::size_t>(top)] / used;
  double area = 0;
  for (int i = 0; i < top; ++i) {
    const double missing = level - mean[static_cast<std::size_t>(i)] / used;
    const double r0 = std::max(0.0, (i - 0.5) * kRayStepMm), r1 = (i + 0.5) * kRayStepMm;
    area += missing / std::max(1.0, level - content) * (r1 * r1 - r0 * r0);
  }
  return std::sqrt(std::max(0.0, area));
}

Cross look_across(const Sampler& hu, Vec3 at, Vec3 along, double noise, const TubeParams& params) {
  const Rays rays = rays_across(hu, at, along, params);
  if (rays.air_cell) return {at, 0, 0};
  std::array<Edge, kRays> edges{};
  std::vector<double> walls, distances;
  for (std::size_t q = 0; q < kRays; ++q) {
    edges[q] = wall_on(rays.of[q], rays.sign, noise, params);
    if (!edges[q].met) continue;
    walls.push_back(edges[q].level);
    distances.push_back(edges[q].distance);
  }
  const std::size_t met = walls.size();
  if (met < kRays / 4) return {at, 0, static_cast<double>(met) / kRays};
  const double usual = upper_median(std::move(distances)), wall = upper_median(std::move(walls));
  const std::array<double, 2> middle = circle_through(edges, usual);
  const Vec3 u = any_perpendicular(along), v = cross(along, u);
  Cross c{at};
  c.centre = at + u * middle[0] + v * middle[1];
  // A vessel's content is what its middle shows, which is too little when it is thin.
  const double content = params.kind == TubeKind::nerve ? rays.sign * params.lumen_hu : rays.sign * rays.middle;
  judge_walls(c, edges, middle, usual, wall, content);
  c.filled = (rays.sign * rays.middle - content) / std::max(100.0, c.level);
  c.radius = radius_by_area(rays, edges, usual, wall, content);
  return c;
}

// What a section shows and where it lies, as numbers of about 0 to 1.
constexpr std::size_t kSigns = 16;
using Signs = std::array<double, kSigns>;

// How much each sign counts, by logistic regression: that a place lies in the nerve with its radius. Made on nerves by
// seed (osteo_bench_segment shapes), judged on others: docs/validation/structures.md has the curve.
constexpr Signs kWeights{1.30,  2.12,  0.48,  -1.74, 0.01,  -2.01, -0.66, -1.06,
                         -0.35, -4.87, -1.90, -1.04, -3.31, -1.69, -0.97, 2.16};

// What the regression says, and how often it was right on other nerves than it was made on (seeds 1001 to 1100 and 2001
// to 2100, 9,288 places): in its middle it says too much, above it too little. Linear between.
struct Calibrated {
  double said, right;
};
constexpr std::array<Calibrated, 9> kCalibrated{
    {{0, 0}, {0.25, 0.2}, {0.45, 0.35}, {0.6, 0.46}, {0.75, 0.66}, {0.8, 0.75}, {0.88, 0.95}, {0.95, 0.985}, {1, 1}}};
double calibrated(double said) {
  std::size_t k = 1;
  while (k + 1 < kCalibrated.size() && said > kCalibrated[k].said) ++k;
  const Calibrated &a = kCalibrated[k - 1], &b = kCalibrated[k];
  return a.right + (b.right - a.right) * (said - a.said) / (b.said - a.said);
}

/// Of each station the chance that it is right.
std::vector<double> trust_along(const std::vector<Cross>& crosses, const std::vector<Vec3>& line,
                                std::span<const Vec3> points, const std::vector<std::size_t>& given, double noise,
                                const TubeParams& params) {
  const std::size_t n = line.size();
  std::vector<double> radii, trust(n);
  double walls = 0;
  for (const Cross& c : crosses) {
    walls += c.walls / static_cast<double>(n);
    if (c.walls >= 0.5) radii.push_back(c.radius);
  }
  std::sort(radii.begin(), radii.end());
  const double usual = std::max(0.1, radii.empty() ? 0.5 * params.max_radius_mm : radii[radii.size() / 2]);
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t a = i > 2 ? i - 2 : 0, b = std::min(i + 2, n - 1);
    const auto mean = [&](const auto& of) {
      double sum = 0;
      for (std::size_t q = a; q <= b; ++q) sum += of(q);
      return sum / static_cast<double>(b - a + 1);
    };
    const double radius = mean([&](std::size_t q) { return crosses[q].radius; });
    const double spread = std::sqrt(mean([&](std::size_t q) {
      const double d = crosses[q].radius - radius;
      return d * d;
    }));
    const double met = mean([&](std::size_t q) { return crosses[q].walls; });
    const double filled = std::clamp(mean([&](std::size_t q) { return crosses[q].filled; }), -1.0, 1.0);
    double near = 1e9;  // along the line to a given point
    std::size_t leg = 1;
    for (std::size_t g = 0; g < given.size(); ++g) {
      near = std::min(near, kStepMm * std::abs(static_cast<double>(given[g]) - static_cast<double>(i)));
      if (g > 0 && i > given[g - 1]) leg = g;
    }
    const double way = kStepMm * static_cast<double>(given[leg] - given[leg - 1]);
    const double longer = way / std::max(0.5, length(points[leg] - points[leg - 1])) - 1;
    const std::size_t back = i > 4 ? i - 4 : 0, on = std::min(i + 4, n - 1);
    const double bent =
        1 - length(line[on] - line[back]) / (kStepMm * static_cast<double>(std::max<std::size_t>(1, on - back)));
    const Signs x{
        1,
        met,
        mean([&](std::size_t q) { return crosses[q].open; }),
        mean([&](std::size_t q) { return std::min(crosses[q].rough, 1.0); }),
        std::max(0.0, filled),
        std::max(0.0, -filled),
        mean([&](std::size_t q) { return crosses[q].thin; }),
        std::min(1.0, mean([&](std::size_t q) { return crosses[q].level; }) / std::max(noise, 10.0) / 40),
        std::min(1.0, mean([&](std::size_t q) { return length(crosses[q].centre - line[q]); }) / std::max(0.2, radius)),
        std::max(0.0, radius / params.max_radius_mm - 0.7),
        std::min(1.0, spread / std::max(0.2, radius)),
        std::min(1.0, std::abs(std::log(std::max(0.1, radius) / usual))),
        std::min(near, 8.0) / 8,
        std::clamp(longer, 0.0, 2.0),
        std::max(0.0, bent),
        walls};
    double sum = 0;
    for (std::size_t s = 0; s < kSigns; ++s) sum += kWeights[s] * x[s];
    trust[i] = calibrated(1 / (1 + std::exp(-sum)));
    // Where most of the round has no wall, the CT shows nothing to be sure by.
    if (crosses[i].walls < 0.5 || met < 0.5) trust[i] = std::min(trust[i], 0.49);
  }
  return trust;
}

/// The CT around the points. Errors: usage for fewer than two, for points outside or all the same.
segment::Field field_around(const Image& ct, std::span<const Vec3> points_mm, const Context& context) {
  if (points_mm.size() < 2)
    throw Error(ExitCode::usage, "a tube needs two points or more", "where it begins and where it ends");
  const Vec3 last{ct.frame.dims[0] - 0.5, ct.frame.dims[1] - 0.5, ct.frame.dims[2] - 0.5};
  Vec3 lo{1e30, 1e30, 1e30}, hi{-1e30, -1e30, -1e30};
  double longest = 0;
  for (std::size_t i = 0; i < points_mm.size(); ++i) {
    const Vec3 p = points_mm[i], x = ct.frame.index_from_world(p);
    for (std::size_t a = 0; a < 3; ++a) {
      if (!(x[a] >= -0.5 && x[a] <= last[a])) {
        throw Error(ExitCode::usage, "point " + std::to_string(i + 1) + " lies outside the CT",
                    "'osteo info' shows where the CT lies (LPS mm)");
      }
      lo[a] = std::min(lo[a], p[a]);
      hi[a] = std::max(hi[a], p[a]);
    }
    if (i > 0) longest = std::max(longest, length(p - points_mm[i - 1]));
  }
  if (length(hi - lo) < 0.5) throw Error(ExitCode::usage, "the points of the tube are all the same");
  const double margin = std::clamp(0.35 * longest, 5.0, 15.0);
  const Vec3 s = ct.frame.spacing_mm, rim{margin, margin, margin};
  const double h = std::clamp(0.8 * std::min({s.x, s.y, s.z}), 0.3, 0.6);
  return segment::make_field(ct, lo - rim, hi + rim, h, context.threads);
}

/// The line moved between the walls in turns, and what lies across it at the last.
std::vector<Cross> line_between_walls(std::vector<Vec3>& line, const Image& ct, double noise,
                                      std::span<const Vec3> points_mm, const TubeParams& params,
                                      const Context& context) {
  const Sampler hu(ct);
  std::vector<double> weight(line.size(), 1.0);
  line = evenly(smoothed_line(line, weight, kStepMm, kSmoothMm), kStepMm);
  std::vector<Cross> crosses;
  for (int round = 0; round <= kRounds; ++round) {
    context.progress(0.9 + 0.1 * round / (kRounds + 1), "walls");
    crosses.assign(line.size(), {});
    parallel_for(line.size(), 16, context.threads, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const std::size_t a = i > 2 ? i - 2 : 0, b = std::min(i + 2, line.size() - 1);
        crosses[i] = look_across(hu, line[i], normalized(line[b] - line[a]), noise, params);
      }
    });
    if (round == kRounds) break;
    std::vector<Vec3> moved(line);
    weight.assign(line.size(), 0.0);
    for (std::size_t i = 0; i < line.size(); ++i) {
      if (crosses[i].walls < 0.5) continue;
      moved[i] = crosses[i].centre;
      weight[i] = crosses[i].walls;
    }
    // Given points hold the line where the CT shows nothing; where it does, the CT is right.
    const auto given = nearest_stations(line, points_mm);
    for (std::size_t q = 0; q < given.size(); ++q) {
      if (weight[given[q]] > 0) continue;
      moved[given[q]] = points_mm[q];
      weight[given[q]] = 1;
    }
    line = evenly(smoothed_line(moved, weight, kStepMm, kSmoothMm), kStepMm);
  }
  return crosses;
}

/// Of radius and walls the median of five neighbours: single sections mislead.
std::vector<TubeStation> stations_of(const std::vector<Vec3>& line, const std::vector<Cross>& crosses,
                                     double max_radius_mm) {
  std::vector<TubeStation> stations;
  for (std::size_t i = 0; i < line.size(); ++i) {
    std::vector<double> r, c;
    for (std::size_t q = i > 2 ? i - 2 : 0; q <= std::min(i + 2, line.size() - 1); ++q) {
      if (crosses[q].radius > 0) r.push_back(std::min(crosses[q].radius, max_radius_mm));
      c.push_back(crosses[q].walls);
    }
    std::sort(r.begin(), r.end());
    std::sort(c.begin(), c.end());
    const double arc = i == 0 ? 0 : stations.back().arc_mm + length(line[i] - line[i - 1]);
    stations.push_back({line[i], arc, r.empty() ? 0 : r[r.size() / 2], 0, c[c.size() / 2]});
  }
  return stations;
}

/// Where it is not sure the radius is that of the nearest place that is, or that has walls.
void borrow_radii(std::vector<TubeStation>& stations) {
  const std::size_t n = stations.size();
  std::vector<std::size_t> good;
  for (std::size_t i = 0; i < n; ++i)
    if (stations[i].confidence >= 0.5 && stations[i].radius_mm > 0) good.push_back(i);
  for (std::size_t i = 0; i < n && good.empty(); ++i)
    if (stations[i].radius_mm > 0) good.push_back(i);
  const std::vector<TubeStation> own = stations;
  for (std::size_t i = 0; i < n && !good.empty(); ++i) {
    const auto after = std::lower_bound(good.begin(), good.end(), i);
    std::size_t from = after != good.end() ? *after : good.back();
    if (after != good.begin() && i - *(after - 1) <= (from > i ? from - i : i - from)) from = *(after - 1);
    if (after != good.end() && *after == i) from = i;
    stations[i].radius_mm = own[from].radius_mm;
  }
}

/// Radii, confidence, unsure stretches of the whole. Errors: failed where too long a stretch has no walls.
void summarise(Tube& tube, std::span<const Vec3> points_mm, const TubeParams& params) {
  const std::size_t n = tube.stations.size();
  tube.length_mm = tube.stations.back().arc_mm;
  std::vector<Vec3> line;
  for (const TubeStation& t : tube.stations) line.push_back(t.at_mm);
  std::vector<bool> given(n);
  for (const std::size_t i : nearest_stations(line, points_mm)) given[i] = true;
  double sure = 0;
  tube.radius_min_mm = 1e9;
  double worst = 0, since = 0;  // without walls and without a given point
  std::vector<std::array<double, 2>> open_mm;
  const auto extend = [](std::vector<std::array<double, 2>>& stretches, bool goes_on, double arc_mm) {
    if (!goes_on) stretches.push_back({arc_mm, arc_mm});
    stretches.back()[1] = arc_mm;
  };
  for (std::size_t i = 0; i < n; ++i) {
    const TubeStation& t = tube.stations[i];
    tube.confidence += t.confidence / static_cast<double>(n);
    if (t.confidence < 0.5) extend(tube.unsure_mm, i > 0 && tube.stations[i - 1].confidence < 0.5, t.arc_mm);
    if (t.walls >= 0.5) {
      sure += 1;
      tube.radius_mean_mm += t.radius_mm;
      tube.radius_min_mm = std::min(tube.radius_min_mm, t.radius_mm);
      tube.radius_max_mm = std::max(tube.radius_max_mm, t.radius_mm);
      continue;
    }
    const bool goes_on = i > 0 && tube.stations[i - 1].walls < 0.5;
    extend(open_mm, goes_on, t.arc_mm);
    if (!goes_on || given[i]) since = t.arc_mm;
    worst = std::max(worst, t.arc_mm - since);
  }
  if (worst > params.max_uncertain_mm || sure < 0.25 * static_cast<double>(n)) {
    const auto bad = std::max_element(open_mm.begin(), open_mm.end(),
                                      [](const auto& a, const auto& b) { return a[1] - a[0] < b[1] - b[0]; });
    const auto mm = [](double x) { return format_number(std::round(x * 10) / 10); };
    throw Error(ExitCode::failed,
                "the points are not joined by a tube: no walls from " + mm((*bad)[0]) + " to " + mm((*bad)[1]) +
                    " mm of " + mm(tube.length_mm) + " mm along the way",
                "give a point on it there, check --kind, or allow it with --max-uncertain-mm");
  }
  tube.radius_mean_mm /= sure;
}

}  // namespace

Tube trace_tube(const Image& ct, std::span<const Vec3> points_mm, const TubeParams& params, const Context& context) {
  const segment::Field field = field_around(ct, points_mm, context);
  const std::vector<float> like = segment::tubeness(field, params, context.sub(0, 0.5));
  const std::vector<Vec3> way = segment::cheapest_way(
      field, like, points_mm, std::min(params.snap_mm, params.max_radius_mm), context.sub(0.5, 0.9));
  const double noise = segment::noise_of(ct);
  std::vector<Vec3> line = evenly(way, kStepMm);
  const std::vector<Cross> crosses = line_between_walls(line, ct, noise, points_mm, params, context);
  Tube tube;
  tube.stations = stations_of(line, crosses, params.max_radius_mm);
  const std::vector<double> trust =
      trust_along(crosses, line, points_mm, nearest_stations(line, points_mm), noise, params);
  for (std::size_t i = 0; i < line.size(); ++i) tube.stations[i].confidence = trust[i];
  borrow_radii(tube.stations);
  summarise(tube, points_mm, params);
  context.progress(1.0);
  return tube;
}

Labels draw_tube(const Tube& tube, const Frame& frame, const std::string& name, const Labels* onto) {
  if (onto != nullptr && !(onto->frame.dims == frame.dims && same_place(onto->frame, frame))) {
    throw Error(ExitCode::usage, "the label map does not lie on the voxels of the CT", "make it from this CT");
  }
  Labels out;
  out.frame = frame;
  if (onto != nullptr) out.structures = onto->structures;
  const auto voxels = make_voxels<std::uint8_t>(frame.voxel_count());
  for (std::size_t i = 0; i < frame.voxel_count(); ++i) voxels[i] = onto != nullptr ? onto->voxels[i] : 0;
  std::uint8_t value = 0;
  for (const Structure& s : out.structures)
    if (s.name == name) value = s.value;
  if (value != 0) {
    for (std::size_t i = 0; i < frame.voxel_count(); ++i)
      if (voxels[i] == value) voxels[i] = 0;
  } else {
    std::array<bool, 256> taken{};
    for (std::size_t i = 0; i < frame.voxel_count(); ++i) taken[voxels[i]] = true;
    for (const Structure& s : out.structures) taken[s.value] = true;
    int free = 1;
    while (free < 256 && taken[static_cast<std::size_t>(free)]) ++free;
    if (free == 256) throw Error(ExitCode::usage, "the label map holds 255 structures already");
    value = static_cast<std::uint8_t>(free);
    out.structures.push_back({value, name, {}});
    std::sort(out.structures.begin(), out.structures.end(),
              [](const Structure& a, const Structure& b) { return a.value < b.value; });
  }
  const auto at = [&](int i, int j, int k) {
    return (static_cast<std::size_t>(k) * static_cast<std::size_t>(frame.dims[1]) + static_cast<std::size_t>(j)) *
               static_cast<std::size_t>(frame.dims[0]) +
           static_cast<std::size_t>(i);
  };
  for (std::size_t s = 0; s + 1 < tube.stations.size(); ++s) {
    const TubeStation &a = tube.stations[s], &b = tube.stations[s + 1];
    const Vec3 ab = b.at_mm - a.at_mm;
    const double l2 = std::max(dot(ab, ab), 1e-12), r = std::max(a.radius_mm, b.radius_mm);
    std::array<int, 3> lo{}, hi{};
    const Vec3 ia = frame.index_from_world(a.at_mm), ib = frame.index_from_world(b.at_mm);
    for (std::size_t x = 0; x < 3; ++x) {
      const double reach = r / frame.spacing_mm[x];
      lo[x] = std::max(0, static_cast<int>(std::floor(std::min(ia[x], ib[x]) - reach)));
      hi[x] = std::min(frame.dims[x] - 1, static_cast<int>(std::ceil(std::max(ia[x], ib[x]) + reach)));
    }
    for (int k = lo[2]; k <= hi[2]; ++k)
      for (int j = lo[1]; j <= hi[1]; ++j)
        for (int i = lo[0]; i <= hi[0]; ++i) {
          const Vec3 p =
              frame.world_from_index({static_cast<double>(i), static_cast<double>(j), static_cast<double>(k)});
          const double t = std::clamp(dot(p - a.at_mm, ab) / l2, 0.0, 1.0);
          if (length(p - (a.at_mm + ab * t)) <= a.radius_mm + (b.radius_mm - a.radius_mm) * t)
            voxels[at(i, j, k)] = value;
        }
    for (int q = 0; q <= 4; ++q) {
      const Vec3 x = ia + (ib - ia) * (q / 4.0);
      const int i = static_cast<int>(std::lround(x.x)), j = static_cast<int>(std::lround(x.y)),
                k = static_cast<int>(std::lround(x.z));
      if (i >= 0 && j >= 0 && k >= 0 && i < frame.dims[0] && j < frame.dims[1] && k < frame.dims[2])
        voxels[at(i, j, k)] = value;
    }
  }
  out.voxels = voxels;
  return out;
}

}  // namespace osteo::inline imaging
