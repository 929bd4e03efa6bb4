#include "osteo/assessment/goal/goal.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "osteo/core/base/error.h"
#include "osteo/core/base/order.h"
#include "osteo/core/base/param.h"
#include "osteo/core/base/portable_math.h"

namespace osteo::inline assessment {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr double kCoarsePitchMm = 1.5;    // of the columns by which directions are compared
constexpr double kTiltsDeg[] = {12, 25};  // of directions around the named one, eight each
constexpr double kAroundMm = 8;           // of the targets, for the saucerised rim
constexpr double kMinPatchMm2 = 6;        // of columns that reach a target; less is a pit, not a part of a cavity
constexpr double kPi = 3.14159265358979323846;

// mm of target regions on the way of all columns.
double gain_of(const Columns& columns, double radius) {
  double sum = 0;
  for (double v = columns.flat().lo.y; v <= columns.flat().hi.y; v += kCoarsePitchMm)
    for (double u = columns.flat().lo.x; u <= columns.flat().hi.x; u += kCoarsePitchMm)
      sum += columns.column(u, v, radius, 0, false).in_target_mm;
  return sum;
}

Vec3 best_toward(const World& world, const StructureMap& structures, const Procedure& procedure, const GoalOptions& o,
                 const Context& context) {
  const Vec3 named = toward_of(procedure), a = any_perpendicular(named), b = cross(named, a);
  std::vector<Vec3> all{named};
  for (const double tilt : kTiltsDeg) {
    const auto t = portable::sin_cos(tilt * kPi / 180);
    for (int n = 0; n < 8; ++n) {
      const auto w = portable::sin_cos_turns(n / 8.0);
      all.push_back(normalized(named * t.cos + (a * w.cos + b * w.sin) * t.sin));
    }
  }
  Vec3 best = named;
  double most = -1;
  for (std::size_t n = 0; n < all.size(); ++n) {
    context.progress(0.6 * static_cast<double>(n) / static_cast<double>(all.size()), "directions");
    const double gain = gain_of(Columns(world, structures, procedure, all[n], o.most_depth_mm, true), o.burr_mm / 2);
    // The named one wins where another is hardly better.
    if (gain > most * (n == 0 ? 1 : 1.03)) {
      most = gain;
      best = all[n];
    }
  }
  return best;
}

// Columns that reach a target and touch each other by a side; patches below the smallest are dropped.
std::size_t drop_pits(GoalCavity& g) {
  std::vector<int> part(g.bottom.size(), -1);
  std::size_t dropped = 0;
  const double each = g.pitch_mm * g.pitch_mm;
  for (std::size_t s = 0; s < part.size(); ++s) {
    if (std::isnan(g.bottom[s]) || part[s] >= 0) continue;
    std::vector<std::size_t> open{s}, all{s};
    part[s] = 1;
    while (!open.empty()) {
      const std::size_t at = open.back();
      open.pop_back();
      const int i = static_cast<int>(at % static_cast<std::size_t>(g.nu)),
                j = static_cast<int>(at / static_cast<std::size_t>(g.nu));
      for (const auto& [di, dj] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}}) {
        if (i + di < 0 || i + di >= g.nu || j + dj < 0 || j + dj >= g.nv) continue;
        const std::size_t next = g.index(i + di, j + dj);
        if (std::isnan(g.bottom[next]) || part[next] >= 0) continue;
        part[next] = 1;
        open.push_back(next);
        all.push_back(next);
      }
    }
    if (static_cast<double>(all.size()) * each >= kMinPatchMm2) continue;
    for (const std::size_t c : all) g.bottom[c] = kNone;
    dropped += all.size();
  }
  return dropped;
}

// A cone above each column, down to what is safe: the opening is wider than the floor.
void saucerise(GoalCavity& g, double slope) {
  if (!(slope > 0)) return;
  const std::vector<double> from = g.bottom;
  double deepest = 0;
  for (std::size_t n = 0; n < from.size(); ++n)
    if (!std::isnan(from[n])) deepest = std::max(deepest, g.top[n] - from[n]);
  const int reach = static_cast<int>(std::ceil(deepest * slope / g.pitch_mm));
  for (int j = 0; j < g.nv; ++j)
    for (int i = 0; i < g.nu; ++i) {
      const std::size_t at = g.index(i, j);
      if (std::isnan(g.top[at])) continue;
      double lowest = std::numeric_limits<double>::infinity();
      for (int b = std::max(0, j - reach); b <= std::min(g.nv - 1, j + reach); ++b)
        for (int a = std::max(0, i - reach); a <= std::min(g.nu - 1, i + reach); ++a) {
          const double low = from[g.index(a, b)];
          if (!std::isnan(low)) lowest = std::min(lowest, low + portable::hypot(a - i, b - j) * g.pitch_mm / slope);
        }
      lowest = std::max(lowest, g.safe[at]);
      if (lowest < g.top[at] && (std::isnan(g.bottom[at]) || lowest < g.bottom[at])) g.bottom[at] = lowest;
    }
}

// Of all burrs around: a ball whose lowest point is at `bottom`.
void lay_floor(GoalCavity& g) {
  const double r = g.burr_mm / 2;
  const int reach = static_cast<int>(r / g.pitch_mm);
  g.floor.assign(g.bottom.size(), kNone);
  for (int j = 0; j < g.nv; ++j)
    for (int i = 0; i < g.nu; ++i) {
      double lowest = std::numeric_limits<double>::infinity();
      for (int b = std::max(0, j - reach); b <= std::min(g.nv - 1, j + reach); ++b)
        for (int a = std::max(0, i - reach); a <= std::min(g.nu - 1, i + reach); ++a) {
          const double low = g.bottom[g.index(a, b)], off = portable::hypot(a - i, b - j) * g.pitch_mm;
          if (!std::isnan(low) && off <= r) lowest = std::min(lowest, low + r - std::sqrt(r * r - off * off));
        }
      if (lowest < std::numeric_limits<double>::infinity()) g.floor[g.index(i, j)] = lowest;
    }
}

// Each burr's way is measured: the smallest of all is the goal's.
void measure_margins(GoalCavity& g, const StructureMap& structures, const Procedure& procedure, double above) {
  const double r = g.burr_mm / 2;
  std::vector<double> each(structures.values().size()), least(each.size(), structures.reach_mm());
  const RoundCone ball{0, 0, r, r};
  for (int j = 0; j < g.nv; ++j)
    for (int i = 0; i < g.nu; ++i) {
      const std::size_t at = g.index(i, j);
      if (std::isnan(g.bottom[at])) continue;
      for (double t = g.bottom[at]; t < std::max(g.top[at], g.bottom[at]) + above; t += g.pitch_mm) {
        structures.clearance(ball, g.place(g.u0 + i * g.pitch_mm, g.v0 + j * g.pitch_mm, t + r), g.toward, each);
        for (std::size_t n = 0; n < each.size(); ++n) least[n] = std::min(least[n], each[n]);
      }
    }
  for (std::size_t n = 0; n < each.size(); ++n) {
    const std::string name = structures.name_of(structures.values()[n]);
    const ProcedureStructure* const s = procedure.find(name);
    const ProcedureRole role = s != nullptr ? s->role : ProcedureRole::keep;
    if (role == ProcedureRole::enter) continue;
    g.margins.push_back({name, least[n], kept_mm(role)});
  }
}

}  // namespace

bool GoalCavity::has(Vec3 p) const {
  const double u = dot(p, across), v = dot(p, along);
  const int i = static_cast<int>(std::lround((u - u0) / pitch_mm)),
            j = static_cast<int>(std::lround((v - v0) / pitch_mm));
  if (i < 0 || i >= nu || j < 0 || j >= nv) return false;
  const double low = floor[index(i, j)];
  return !std::isnan(low) && dot(p, toward) >= low;
}

Labels GoalCavity::labels(const World& world) const {
  const BrickGrid& bone = world.bodies().front().body->bone;
  Labels out;
  out.frame = bone.frame();
  auto voxels = std::make_shared<std::uint8_t[]>(out.frame.voxel_count());
  std::size_t n = 0;
  for (int k = 0; k < out.frame.dims[2]; ++k)
    for (int j = 0; j < out.frame.dims[1]; ++j)
      for (int i = 0; i < out.frame.dims[0]; ++i, ++n) {
        const Vec3 p = out.frame.world_from_index({double(i), double(j), double(k)});
        const double t = dot(p, toward);
        if (!has(p)) continue;
        // Not the air above the surface.
        const int a = static_cast<int>(std::lround((dot(p, across) - u0) / pitch_mm)),
                  b = static_cast<int>(std::lround((dot(p, along) - v0) / pitch_mm));
        const double surface = top[index(a, b)];
        if (!std::isnan(surface) && t <= surface + pitch_mm) voxels[n] = 1;
      }
  out.voxels = voxels;
  out.structures = {{1, "goal cavity", {255, 200, 0}}};
  return out;
}

GoalCavity goal_cavity(const World& world, const StructureMap& structures, const Procedure& procedure,
                       const GoalOptions& o, const Context& context) {
  GoalCavity g;
  g.toward = o.toward ? normalized(*o.toward) : best_toward(world, structures, procedure, o, context);
  g.pitch_mm = o.pitch_mm;
  g.burr_mm = o.burr_mm;
  const Columns columns(world, structures, procedure, g.toward, o.most_depth_mm, true);
  g.across = columns.across();
  g.along = columns.along();
  const BoxMm& flat = columns.flat();
  g.u0 = flat.lo.x - kAroundMm;
  g.v0 = flat.lo.y - kAroundMm;
  g.nu = static_cast<int>((flat.hi.x - flat.lo.x + 2 * kAroundMm) / g.pitch_mm) + 1;
  g.nv = static_cast<int>((flat.hi.y - flat.lo.y + 2 * kAroundMm) / g.pitch_mm) + 1;
  const std::size_t all = static_cast<std::size_t>(g.nu) * static_cast<std::size_t>(g.nv);
  g.top.assign(all, kNone);
  g.bottom = g.safe = g.top;
  std::size_t through = 0;
  for (int j = 0; j < g.nv; ++j) {
    context.check_cancelled();
    context.progress(0.6 + 0.3 * j / g.nv, "columns");
    for (int i = 0; i < g.nu; ++i) {
      const Column c = columns.column(g.u0 + i * g.pitch_mm, g.v0 + j * g.pitch_mm, o.burr_mm / 2, 0, false);
      if (!c.bone) continue;
      const std::size_t at = g.index(i, j);
      g.top[at] = c.top;
      g.safe[at] = c.safe;
      if (!c.target || c.in_target_mm < g.pitch_mm) continue;
      g.bottom[at] = *c.target;
      ++through;
    }
  }
  const std::size_t pits = drop_pits(g);
  if (through == pits)
    throw Error(ExitCode::usage,
                "from this side no burr of " + format_number(o.burr_mm) +
                    " mm reaches the target regions without breaking a margin",
                "give another --approach, or a smaller --burr-mm");
  if (pits > 0)
    g.notes.push_back(format_number(std::round(static_cast<double>(pits) * g.pitch_mm * g.pitch_mm * 10) / 10) +
                      " mm2 of pits narrower than a cavity were left out");
  saucerise(g, o.slope);
  lay_floor(g);
  measure_margins(g, structures, procedure, 2);
  for (const GoalMargin& m : g.margins)
    if (m.margin_mm < m.asked_mm - 0.3)
      g.notes.push_back("the margin to the " + m.structure + " is " +
                        format_number(std::round(m.margin_mm * 100) / 100) + " mm: the opening lies beside it");
  const BrickGrid& bone = world.bodies().front().body->bone;
  const double each = bone.frame().voxel_volume_mm3();
  for (VoxelKey v = 0; v < bone.brick_count() * BrickGrid::kVoxels; ++v) {
    const auto d = static_cast<double>(bone.value(v));
    if (d <= 0) continue;
    const Ijk c = bone.coordinate(v);
    if (g.has(bone.frame().world_from_index({double(c.i), double(c.j), double(c.k)}))) g.bone_mm3 += d * each;
  }
  return g;
}

GoalScore score_against(const GoalCavity& goal, const BrickGrid& before, const BrickGrid& after) {
  GoalScore s;
  const double each = before.frame().voxel_volume_mm3();
  double in_goal = 0, removed = 0;
  std::vector<double> beyond;
  for (VoxelKey v = 0; v < before.brick_count() * BrickGrid::kVoxels; ++v) {
    const auto was = static_cast<double>(before.value(v));
    if (was <= 0) continue;
    const Ijk c = before.coordinate(v);
    const double gone = std::max(0.0, was - static_cast<double>(after.at(c.i, c.j, c.k)));
    const Vec3 p = before.frame().world_from_index({double(c.i), double(c.j), double(c.k)});
    const bool wanted = goal.has(p);
    removed += gone * each;
    if (wanted) {
      in_goal += was * each;
      s.done_mm3 += gone * each;
      s.left_mm3 += (was - gone) * each;
    } else if (gone > 0.5) {
      s.beyond_mm3 += gone * each;
      const int i = static_cast<int>(std::lround((dot(p, goal.across) - goal.u0) / goal.pitch_mm)),
                j = static_cast<int>(std::lround((dot(p, goal.along) - goal.v0) / goal.pitch_mm));
      if (i < 0 || i >= goal.nu || j < 0 || j >= goal.nv || std::isnan(goal.floor[goal.index(i, j)])) continue;
      beyond.push_back(goal.floor[goal.index(i, j)] - dot(p, goal.toward));
    } else {
      s.beyond_mm3 += gone * each;
    }
  }
  if (in_goal + removed > 0) s.dice = 2 * s.done_mm3 / (in_goal + removed);
  s.beyond_mm = value_at_share(std::move(beyond), 0.95);
  return s;
}

}  // namespace osteo::inline assessment
