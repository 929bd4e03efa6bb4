// The sigmoid sinus: without contrast medium nothing tells it from brain but the groove in which it lies.
//
// A point in the groove has bone around it: of directions in space, most meet a wall within 12 mm. That gives the way
// of the groove from the transverse sinus to the jugular foramen. Then circles are fitted to the walls across it; the
// vessel is taken to be round, so that the arc of wall in the bone gives its open side too. Where bone no longer holds
// half of the round, the sinus as labelled here ends.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <queue>

#include "ear_parts.h"
#include "line.h"
#include "osteo/core/base/order.h"
#include "osteo/core/base/parallel.h"

namespace osteo::inline imaging::segment {
namespace {

constexpr double kMinRadiusMm = 2.5, kMaxRadiusMm = 7.5;
constexpr double kRimMm = 2;
constexpr double kMarchStepMm = 0.5;
constexpr int kRays = 48;
constexpr double kHeld = 0.5;  // share of the round
constexpr double kBridged = 0.3, kBridgeMm = 6;

struct Round {
  Vec3 centre;
  double radius = 0, held = 0, rough = 0;
};

/// The circle across `along` that fits the walls around `at`, near `radius` (0: not known).
Round fit_round(const Field& f, const Levels& levels, Vec3 at, Vec3 along, double radius) {
  const Vec3 u = any_perpendicular(along), v = cross(along, u);
  struct Edge {
    double x, y, w;
  };
  std::vector<Edge> edges;
  for (int q = 0; q < kRays; ++q) {
    const double a = 2 * std::numbers::pi * q / kRays;
    const Vec3 d = u * std::cos(a) + v * std::sin(a);
    double before = f.sample(at);
    for (double l = 0.25; l < kMaxRadiusMm + 2.5; l += 0.25) {
      const double here = f.sample(at + d * l);
      const double level = here > levels.bone_above ? levels.bone_above : levels.air_below;
      if (here > levels.bone_above || here < levels.air_below) {
        const double t = here != before ? std::clamp((level - before) / (here - before), 0.0, 1.0) : 0.5;
        const double r = l - 0.25 + 0.25 * t;
        edges.push_back({r * std::cos(a), r * std::sin(a), 1});
        break;
      }
      before = here;
    }
  }
  Round out{at, radius, 0, 0};
  if (edges.size() < kRays / 4) return out;
  // Kasa's circle, again with far edges weighed down (Tukey), so that the rim of the groove does not pull.
  double mx = 0, my = 0, r = radius;
  if (r <= 0) {
    std::vector<double> away;
    for (const Edge& e : edges) away.push_back(std::hypot(e.x, e.y));
    r = upper_median(std::move(away));
  }
  double reach = 2.5;
  for (int round = 0; round < 8; ++round) {
    double s = 0, sx = 0, sy = 0, sxx = 0, sxy = 0, syy = 0, sz = 0, sxz = 0, syz = 0;
    for (Edge& e : edges) {
      const double off = (std::hypot(e.x - mx, e.y - my) - r) / reach;
      e.w = std::abs(off) < 1 ? (1 - off * off) * (1 - off * off) : 0;
      const double z = e.x * e.x + e.y * e.y;
      s += e.w, sx += e.w * e.x, sy += e.w * e.y, sxx += e.w * e.x * e.x, sxy += e.w * e.x * e.y,
          syy += e.w * e.y * e.y;
      sz += e.w * z, sxz += e.w * e.x * z, syz += e.w * e.y * z;
    }
    if (s < kRays / 5.0) return out;
    const double cxx = sxx - sx * sx / s, cyy = syy - sy * sy / s, cxy = sxy - sx * sy / s;
    const double bx = 0.5 * (sxz - sx * sz / s), by = 0.5 * (syz - sy * sz / s), det = cxx * cyy - cxy * cxy;
    if (det < 1e-3 * s * s) return out;
    mx = (bx * cyy - by * cxy) / det;
    my = (by * cxx - bx * cxy) / det;
    r = std::sqrt(std::max(0.0, (sz - 2 * mx * sx - 2 * my * sy) / s + mx * mx + my * my));
    // An arc that is too flat or too narrow says nothing of a vessel's size.
    const double kept = std::clamp(r, std::max(kMinRadiusMm, radius > 0 ? radius - 0.7 : 0),
                                   std::min(kMaxRadiusMm, radius > 0 ? radius + 0.7 : 10));
    if (kept != r) {
      // The middle moves along the normal of the arc's middle, so that the wall stays where it is.
      const double ax = sx / s - mx, ay = sy / s - my, l = std::hypot(ax, ay);
      if (l > 1e-6) mx += ax / l * (r - kept), my += ay / l * (r - kept);
      r = kept;
    }
    reach = std::max(0.8, reach * 0.75);
  }
  const double off = std::hypot(mx, my), most = 1.2;
  if (off > most) mx *= most / off, my *= most / off;
  out.centre = at + u * mx + v * my;
  out.radius = r;
  // What holds it: directions from the middle with a wall not more than 2 mm beyond the circle.
  int held = 0;
  double rough = 0;
  for (int q = 0; q < 64; ++q) {
    const double a = 2 * std::numbers::pi * q / 64;
    const Vec3 d = u * std::cos(a) + v * std::sin(a);
    for (double l = 0.5 * r; l < r + 2; l += 0.25) {
      const double here = f.sample(out.centre + d * l);
      if (here > levels.bone_above || here < levels.air_below) {
        ++held;
        rough += std::abs(l - 0.12 - r);
        break;
      }
    }
  }
  out.held = held / 64.0;
  out.rough = held > 0 ? rough / held : 0;
  return out;
}

/// A coarser grid in which the groove is looked for, and how enclosed each of its places is.
struct Groove {
  Field g;                  ///< values: share of directions in space that meet a wall, where a sinus' middle can be
  std::vector<float> wide;  ///< mm to the nearest wall
  std::vector<std::uint32_t> piece;
  std::size_t start = 0;  ///< its deepest place
  double lowest_mm = 0;   ///< below, the vein leaves the skull, and muscles between bones look like grooves too

  [[nodiscard]] double worth(std::size_t i) const {
    const auto w = static_cast<double>(wide[i]);
    return std::clamp((static_cast<double>(g.v[i]) - 0.4) / 0.3, 0.0, 1.0) * std::clamp((w - 2.2) / 1.8, 0.0, 1.0) *
           (w > 6.5 ? 0.3 : 1.0);
  }
  [[nodiscard]] Vec3 at(std::size_t i) const {
    const auto p = g.place(i);
    return g.world(p[0], p[1], p[2]);
  }
};

/// The coarse grid behind the ear canal; without places where the image ends before the sinus.
Field grid_behind(const Field& f, const Canal& canal) {
  Field g;
  const Vec3 lo = canal.drum_mm + Vec3{-30, -2, -26}, hi = canal.drum_mm + Vec3{26, 48, 24};
  g.h_mm = 1;
  for (std::size_t a = 0; a < 3; ++a) {
    const double from = std::max(lo[a], f.origin_mm[a]), to = std::min(hi[a], f.origin_mm[a] + (f.n[a] - 1) * f.h_mm);
    g.origin_mm[a] = from;
    g.n[a] = std::max(0, static_cast<int>(to - from) + 1);
  }
  if (std::min({g.n[0], g.n[1], g.n[2]}) < 12) g.n = {0, 0, 0};
  return g;
}

/// How enclosed each place is that is as far from walls as the middle of a sinus.
void enclose(Groove& groove, const Field& f, const Mask& wall, const Canal& canal, const Context& context) {
  // Skin over bone is no groove.
  const auto holds = [&](std::size_t i) { return wall[i] == 0 ? 0 : canal.exterior[i] != 0 ? -1 : 1; };
  const std::vector<float> to_wall = distance_mm(f, wall, context);
  Field& g = groove.g;
  g.v.assign(g.size(), 0.0F);
  groove.wide.resize(g.size());
  parallel_for(g.size(), 256, context.threads, [&](std::size_t begin, std::size_t end) {
    context.check_cancelled();
    for (std::size_t i = begin; i < end; ++i) {
      const Vec3 x = groove.at(i);
      const auto q = f.nearest(x);
      groove.wide[i] = to_wall[f.at(q[0], q[1], q[2])];
      const auto w = static_cast<double>(groove.wide[i]);
      if (w > 2.3 && w < 8) g.v[i] = static_cast<float>(enclosure(f, x, 12, holds));
    }
  });
}

/// The largest piece behind the canal with walls all around it, and its deepest place. False: there is none.
bool choose_groove(Groove& groove, const Canal& canal) {
  const Field& g = groove.g;
  Mask deep(g.size());
  for (std::size_t i = 0; i < g.size(); ++i) {
    const Vec3 x = groove.at(i) - canal.drum_mm;
    deep[i] = g.v[i] > 0.62F && static_cast<double>(groove.wide[i]) > kMinRadiusMm && x.y > 5 && x.z > -20 && x.z < 16
                  ? 1
                  : 0;
  }
  const Pieces pieces = pieces_of(g, deep, true);
  std::vector<double> most_z(pieces.size.size(), -1e9), least_z(pieces.size.size(), 1e9);
  for (std::size_t i = 0; i < g.size(); ++i) {
    const auto z = static_cast<double>(g.place(i)[2]);
    most_z[pieces.of[i]] = std::max(most_z[pieces.of[i]], z);
    least_z[pieces.of[i]] = std::min(least_z[pieces.of[i]], z);
  }
  std::size_t best = 0;
  for (std::size_t p = 1; p < pieces.size.size(); ++p) {
    if (most_z[p] - least_z[p] < 7) continue;
    if (best == 0 || pieces.size[p] > pieces.size[best]) best = p;
  }
  if (best == 0) return false;
  double start_value = -1;
  for (std::size_t i = 0; i < g.size(); ++i) {
    if (pieces.of[i] != best) continue;
    const double value = static_cast<double>(g.v[i]) + 0.05 * static_cast<double>(groove.wide[i]);
    if (value > start_value) start_value = value, groove.start = i;
  }
  groove.lowest_mm = g.origin_mm.z + least_z[best] * g.h_mm - 2;
  return true;
}

/// Cheapest ways from the deepest place, as far as walls are on more than half of all sides.
struct Ways {
  static constexpr float kFar = std::numeric_limits<float>::max();
  std::vector<float> reached, mm;
  std::vector<std::size_t> from;
};

Ways ways_along(const Groove& groove) {
  const Field& g = groove.g;
  Ways ways{std::vector<float>(g.size(), Ways::kFar), std::vector<float>(g.size(), 0.0F),
            std::vector<std::size_t>(g.size(), groove.start)};
  using Entry = std::pair<float, std::size_t>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
  ways.reached[groove.start] = 0;
  queue.emplace(0.0F, groove.start);
  while (!queue.empty()) {
    const auto [c, at] = queue.top();
    queue.pop();
    if (c > ways.reached[at]) continue;
    const auto p = g.place(at);
    for (int k = -1; k <= 1; ++k)
      for (int j = -1; j <= 1; ++j)
        for (int i = -1; i <= 1; ++i) {
          if ((i == 0 && j == 0 && k == 0) || !g.inside(p[0] + i, p[1] + j, p[2] + k)) continue;
          const std::size_t to = g.at(p[0] + i, p[1] + j, p[2] + k);
          if (g.v[to] < 0.52F || static_cast<double>(groove.wide[to]) < kMinRadiusMm ||
              g.world(0, 0, p[2] + k).z < groove.lowest_mm)
            continue;
          const double step = std::sqrt(static_cast<double>(i * i + j * j + k * k));
          const auto cost =
              static_cast<float>(static_cast<double>(c) + step / (0.03 + groove.worth(to) * groove.worth(to)));
          if (cost < ways.reached[to]) {
            ways.reached[to] = cost;
            ways.mm[to] = ways.mm[at] + static_cast<float>(step);
            ways.from[to] = at;
            queue.emplace(cost, to);
          }
        }
  }
  return ways;
}

/// From the far end above to the far end below, evenly.
std::vector<Vec3> line_of(const Groove& groove) {
  const Ways ways = ways_along(groove);
  const auto line_to = [&](std::size_t end) {
    std::vector<Vec3> line;
    for (std::size_t at = end;; at = ways.from[at]) {
      line.push_back(groove.at(at));
      if (at == groove.start) break;
    }
    std::reverse(line.begin(), line.end());
    return line;
  };
  const Vec3 middle = groove.at(groove.start);
  std::size_t up = groove.start, down = groove.start;
  for (std::size_t i = 0; i < groove.g.size(); ++i) {
    if (ways.reached[i] == Ways::kFar) continue;
    const Vec3 x = groove.at(i);
    if (x.z < groove.lowest_mm || groove.worth(i) < 0.35 || groove.g.v[i] < 0.58F) continue;
    // Upwards it goes backwards too; downwards inward and forward.
    if (x.z > middle.z + 2 && x.y > middle.y - 3 && ways.mm[i] > ways.mm[up]) up = i;
    if (x.z < middle.z + 4 && x.x < middle.x && x.y < middle.y + 4 && ways.mm[i] > ways.mm[down]) down = i;
  }
  std::vector<Vec3> line = line_to(up), lower = line_to(down);
  std::reverse(line.begin(), line.end());
  line.insert(line.end(), lower.begin() + 1, lower.end());
  return evenly(line, kMarchStepMm);
}

/// A round vessel fitted into the groove, station by station.
struct Vessel {
  std::vector<Vec3> line;
  std::vector<double> radius;
  std::vector<Round> rounds;
};

/// Sizes change slowly along a vessel: the median over 8 mm. Empty where no round is held.
std::vector<double> slow_sizes(const std::vector<Round>& rounds) {
  std::vector<double> sizes(rounds.size());
  for (std::size_t i = 0; i < rounds.size(); ++i) {
    std::vector<double> near;
    for (std::size_t q = i > 8 ? i - 8 : 0; q <= std::min(i + 8, rounds.size() - 1); ++q)
      if (rounds[q].held >= kHeld && rounds[q].radius > 0) near.push_back(rounds[q].radius);
    if (near.empty()) continue;
    sizes[i] = upper_median(std::move(near));
  }
  double last = 0;
  for (double& s : sizes) last = s = s > 0 ? s : last;
  for (std::size_t i = sizes.size(); i-- > 0;) last = sizes[i] = sizes[i] > 0 ? sizes[i] : last;
  if (last <= 0) sizes.clear();
  return sizes;
}

void fit_rounds(Vessel& vessel, const Field& f, const Levels& levels, const Context& context) {
  const std::vector<Vec3>& line = vessel.line;
  vessel.rounds.assign(line.size(), {});
  const bool sized = vessel.radius.size() == line.size() && vessel.radius[0] > 0;
  parallel_for(line.size(), 8, context.threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const std::size_t a = i > 3 ? i - 3 : 0, b = std::min(i + 3, line.size() - 1);
      vessel.rounds[i] = fit_round(f, levels, line[i], normalized(line[b] - line[a]), sized ? vessel.radius[i] : 0);
    }
  });
}

/// Rounds and line in turn, until both lie in the groove. Without rounds: no vessel fits.
Vessel fit_vessel(std::vector<Vec3> line, const Field& f, const Levels& levels, const Context& context) {
  Vessel v{std::move(line), {}, {}};
  v.radius.assign(v.line.size(), 0.0);
  for (int round = 0; round <= 4; ++round) {
    fit_rounds(v, f, levels, context);
    if (round == 4) break;
    const std::vector<double> sizes = slow_sizes(v.rounds);
    if (sizes.empty()) return {};
    std::vector<Vec3> moved(v.line.size());
    std::vector<double> weight(v.line.size());
    for (std::size_t i = 0; i < v.line.size(); ++i) {
      moved[i] = v.rounds[i].centre;
      weight[i] = v.rounds[i].held >= 0.4 ? v.rounds[i].held : 0.02;
    }
    const std::vector<Vec3> smooth = smoothed_line(moved, weight, kMarchStepMm, 1.5);
    const std::vector<Vec3> next = evenly(smooth, kMarchStepMm);
    // Sizes go along to where the stations are now.
    v.radius.assign(next.size(), 0.0);
    for (std::size_t i = 0; i < next.size(); ++i) {
      const double at = next.size() > 1 ? static_cast<double>(i) * static_cast<double>(v.line.size() - 1) /
                                              static_cast<double>(next.size() - 1)
                                        : 0;
      v.radius[i] = sizes[static_cast<std::size_t>(std::lround(at))];
    }
    v.line = next;
  }
  return v;
}

/// The part that is held, around the place nearest to `middle`, each round where the line is and as wide as smoothed.
std::vector<Round> held_part(const Vessel& v, Vec3 middle) {
  const std::vector<Vec3>& line = v.line;
  std::size_t centre = 0;
  for (std::size_t i = 0; i < line.size(); ++i)
    if (length(line[i] - middle) < length(line[centre] - middle)) centre = i;
  const auto held = [&](std::size_t i) {
    double sum = 0;
    int count = 0;
    for (std::size_t q = i > 2 ? i - 2 : 0; q <= std::min(i + 2, line.size() - 1); ++q)
      sum += v.rounds[q].held, ++count;
    return sum / count >= kHeld;
  };
  // Short stretches that less bone holds, as before the jugular bulb, do not end it.
  const auto end_of = [&](int step) {
    std::size_t end = centre;
    for (auto i = static_cast<std::ptrdiff_t>(centre); i >= 0 && i < static_cast<std::ptrdiff_t>(line.size());
         i += step) {
      const auto at = static_cast<std::size_t>(i);
      if (v.rounds[at].held < kBridged && !held(at)) break;
      if (held(at)) end = at;
      if (std::abs(static_cast<double>(i) - static_cast<double>(end)) * kMarchStepMm > kBridgeMm) break;
    }
    return end;
  };
  const std::size_t first = end_of(-1), last = end_of(1);
  std::vector<Round> tube(v.rounds.begin() + static_cast<std::ptrdiff_t>(first),
                          v.rounds.begin() + static_cast<std::ptrdiff_t>(last) + 1);
  for (std::size_t i = 0; i < tube.size(); ++i) tube[i].centre = line[first + i], tube[i].radius = v.radius[first + i];
  return tube;
}

/// What lies in the tube and is no wall.
Mask fill_tube(const std::vector<Round>& tube, const Field& f, const Mask& wall) {
  Mask mask(f.size(), 0);
  for (std::size_t i = 0; i + 1 < tube.size(); ++i) {
    const Vec3 a = tube[i].centre, ab = tube[i + 1].centre - a;
    const double l2 = std::max(dot(ab, ab), 1e-12), most = std::max(tube[i].radius, tube[i + 1].radius) + 0.6;
    const auto p0 = f.nearest(a - Vec3{most, most, most}), p1 = f.nearest(a + ab + Vec3{most, most, most});
    const auto q0 = f.nearest(a + ab - Vec3{most, most, most}), q1 = f.nearest(a + Vec3{most, most, most});
    for (int k = std::min(p0[2], q0[2]); k <= std::max(p1[2], q1[2]); ++k)
      for (int j = std::min(p0[1], q0[1]); j <= std::max(p1[1], q1[1]); ++j)
        for (int x = std::min(p0[0], q0[0]); x <= std::max(p1[0], q1[0]); ++x) {
          const std::size_t at = f.at(x, j, k);
          if (wall[at] != 0 || mask[at] != 0) continue;
          const Vec3 d = f.world(x, j, k) - a;
          const double t = dot(d, ab) / l2;
          // Flat ends: nothing beyond where it is held.
          if ((i == 0 && t < 0) || (i + 2 == tube.size() && t > 1)) continue;
          const double s = std::clamp(t, 0.0, 1.0);
          if (length(d - ab * s) <= tube[i].radius + (tube[i + 1].radius - tube[i].radius) * s + 0.1) mask[at] = 1;
        }
  }
  return mask;
}

Part not_found(std::string why) {
  Part part;
  part.why = std::move(why);
  return part;
}

}  // namespace

Part find_sinus(const Field& f, const Levels& levels, const Canal& canal, const Context& context) {
  Mask wall(f.size());
  for (std::size_t i = 0; i < wall.size(); ++i) {
    const auto v = static_cast<double>(f.v[i]);
    wall[i] = v > levels.bone_above || v < levels.air_below ? 1 : 0;
  }
  Groove groove;
  groove.g = grid_behind(f, canal);
  if (groove.g.size() == 0) return not_found("the image ends before the sinus");
  enclose(groove, f, wall, canal, context);
  if (!choose_groove(groove, canal)) return not_found("no groove of a sinus' width behind the ear canal");
  std::vector<Vec3> line = line_of(groove);
  if (line.size() < 16) return not_found("the groove behind the ear canal is too short for a sinus");
  line = evenly(smoothed_line(line, std::vector<double>(line.size(), 1.0), kMarchStepMm, 1.5), kMarchStepMm);
  const Vessel vessel = fit_vessel(std::move(line), f, levels, context);
  if (vessel.rounds.empty()) return not_found("no vessel fits into the groove behind the ear canal");
  const std::vector<Round> tube = held_part(vessel, groove.at(groove.start));
  double long_mm = 0, hold = 0, rough = 0;
  for (std::size_t i = 0; i < tube.size(); ++i) {
    if (i > 0) long_mm += length(tube[i].centre - tube[i - 1].centre);
    hold += tube[i].held / static_cast<double>(tube.size());
    rough += tube[i].rough / static_cast<double>(tube.size());
  }
  if (long_mm < 15)
    return not_found("the groove behind the ear canal holds a vessel for only " +
                     std::to_string(static_cast<int>(long_mm)) + " mm");
  Part part;
  part.mask = fill_tube(tube, f, wall);
  part.quality = std::clamp(hold * (1 - rough / 3), 0.0, 1.0);
  part.found = true;
  Vec3 lo, hi;
  bounds_of(f.frame(), lo, hi);
  for (const Round* end : {&tube.front(), &tube.back()}) {
    for (std::size_t a = 0; a < 3; ++a) {
      const double rim = std::min(end->centre[a] - lo[a], hi[a] - end->centre[a]);
      if (rim < end->radius + kRimMm) part.why = "only a part of it: the image ends where it goes on";
    }
  }
  return part;
}

}  // namespace osteo::inline imaging::segment
