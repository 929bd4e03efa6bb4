#include "osteo/assessment/trainee/work_plan.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "osteo/core/base/error.h"
#include "osteo/core/base/portable_math.h"
#include "osteo/core/statistics/basics.h"
#include "osteo/simulation/bone/instrument.h"

namespace osteo::inline assessment {

namespace {

constexpr double kPitch = 1;                         // mm, of columns
constexpr double kClosed = 0.7;                      // of the window's radius
constexpr double kPressMm = 1;                       // into the next layer
constexpr double kGridShiftMm = 7, kBeliefMm = 2.5;  // at no skill at all
constexpr double kStepMm = 0.3;                      // a floor's step that a stroke goes over, not through
constexpr double kLeanDeg = 40;                      // so that not the burr's slow pole does the work

// Leaning over the middle of the window, the more the farther from it, as far as the shaft finds room in the opening:
// `room` around its middle, `depth` above the burr.
Vec3 lean(const Columns& c, Vec3 toward, double u, double v, double radius, double room, double depth) {
  const double off = portable::hypot(u, v), share = std::min(1.0, off / std::max(0.1, radius));
  const auto usual = portable::sin_cos(kLeanDeg * 3.14159265358979323846 / 180);
  const double deep = std::max(1.0, depth);
  const double tangent =
      std::clamp(usual.sin / usual.cos, std::max(0.0, (off - room) / deep), std::min(2.0, (off + room) / deep));
  const Vec3 inwards = off > 1e-6 ? (c.across() * u + c.along() * v) * (-1 / off) : Vec3{};
  const Vec3 side = inwards * share + c.across() * (1 - share);
  return normalized(toward + side * tangent);
}

// Rows of a layer, to and fro. `low`: of a column the burr's lowest point in this layer, and as deep as it may be
// pressed; nothing where there is no work.
struct Low {
  double at, most;
};

WorkPlan plan_goal(const World& world, const StructureMap& structures, const Procedure& procedure,
                   const WorkPlanOptions& o) {
  GoalOptions options;
  options.burr_mm = o.fine_diameter_mm;
  options.toward = o.toward;
  const GoalCavity g = goal_cavity(world, structures, procedure, options);
  WorkPlan plan;
  plan.toward = g.toward;
  plan.coarse_tool = static_cast<std::uint8_t>(burr_index(BurrKind::cutting, o.coarse_diameter_mm));
  plan.fine_tool = static_cast<std::uint8_t>(burr_index(BurrKind::diamond, o.fine_diameter_mm));
  const double coarse = o.coarse_diameter_mm / 2, fine = o.fine_diameter_mm / 2;
  const Columns columns(world, structures, procedure, g.toward, options.most_depth_mm);
  // The middle and the width of the opening; the highest and the lowest place.
  double u0 = 0, v0 = 0, n = 0, highest = -1e300, lowest = 1e300;
  for (int j = 0; j < g.nv; ++j)
    for (int i = 0; i < g.nu; ++i) {
      const std::size_t at = g.index(i, j);
      if (std::isnan(g.bottom[at])) continue;
      u0 += g.u0 + i * g.pitch_mm;
      v0 += g.v0 + j * g.pitch_mm;
      highest = std::max(highest, g.top[at]);
      lowest = std::min(lowest, g.bottom[at]);
      ++n;
    }
  u0 /= n;
  v0 /= n;
  for (int j = 0; j < g.nv; ++j)
    for (int i = 0; i < g.nu; ++i)
      if (!std::isnan(g.bottom[g.index(i, j)]))
        plan.radius_mm =
            std::max(plan.radius_mm, portable::hypot(g.u0 + i * g.pitch_mm - u0, g.v0 + j * g.pitch_mm - v0));
  plan.open_mm = plan.radius_mm;
  plan.steep = true;
  plan.centre_mm = g.place(u0, v0, highest);
  // A coarse burr keeps within the floor, and out of where the procedure allows only other burrs.
  const auto floor_of = [&](int i, int j) {
    if (i < 0 || i >= g.nu || j < 0 || j >= g.nv) return highest;
    const std::size_t at = g.index(i, j);
    return !std::isnan(g.floor[at]) ? g.floor[at] : std::isnan(g.top[at]) ? -1e300 : g.top[at];
  };
  std::vector<double> coarse_low(g.bottom.size(), highest);
  const int reach = static_cast<int>(coarse / g.pitch_mm), step = std::max(1, static_cast<int>(kPitch / g.pitch_mm));
  for (int j = 0; j < g.nv; j += step)
    for (int i = 0; i < g.nu; i += step) {
      if (std::isnan(g.bottom[g.index(i, j)])) continue;
      double low = -1e300;
      for (int b = -reach; b <= reach; ++b)
        for (int a = -reach; a <= reach; ++a) {
          const double off = portable::hypot(a, b) * g.pitch_mm;
          if (off <= coarse)
            low = std::max(low, floor_of(i + a, j + b) - coarse + std::sqrt(coarse * coarse - off * off));
        }
      const Column c = columns.column(g.u0 + i * g.pitch_mm, g.v0 + j * g.pitch_mm, coarse, 0, true);
      coarse_low[g.index(i, j)] = c.bone ? std::max(low, c.safe) : low;
    }
  int layer = 0;
  const double room = plan.radius_mm + fine - 1.5;
  const auto rows = [&](std::uint8_t tool, double radius, int row_step, const auto& low_of) {
    const bool crosswise = layer % 2 == 1;
    bool back = false, any = false;
    for (int r = 0; r < (crosswise ? g.nu : g.nv); r += row_step) {
      TraineeStroke s;
      s.tool = tool;
      s.layer = layer;
      const int length_of = crosswise ? g.nv : g.nu, last = (length_of - 1) / step * step;
      for (int q = 0; q <= last; q += step) {
        const int at_q = back ? last - q : q, i = crosswise ? r : at_q, j = crosswise ? at_q : r;
        const std::size_t at = g.index(i, j);
        if (std::isnan(g.bottom[at])) continue;
        const std::optional<Low> low = low_of(at);
        const double u = g.u0 + i * g.pitch_mm, v = g.v0 + j * g.pitch_mm;
        // A row goes on over what is nothing's, but not over what stands between.
        if (!low) {
          if (!s.points.empty()) plan.strokes.push_back(std::exchange(s, {tool, true, layer, {}}));
          continue;
        }
        any = true;
        const TraineeStroke::Point here{
            g.place(u, v, low->at + radius),
            lean(columns, plan.toward, u - u0, v - v0, plan.radius_mm, room, highest - low->at),
            std::clamp(low->at - low->most, 0.0, kPressMm)};
        if (!s.points.empty()) {
          // Across at the level of the highest floor on the way, then down: a straight line would cut a step's edge.
          const TraineeStroke::Point before = s.points.back();
          double level = std::max(dot(before.at_mm, plan.toward), low->at + radius);
          for (int d = 1; d < step; ++d) {
            const int q_between = at_q + (back ? d : -d);
            const std::size_t between = crosswise ? g.index(r, q_between) : g.index(q_between, r);
            level = std::max(level, (std::isnan(g.bottom[between]) ? highest : g.bottom[between]) + radius);
          }
          const auto lifted = [&](TraineeStroke::Point x) {
            const double up = level - dot(x.at_mm, plan.toward);
            x.at_mm += plan.toward * up;
            x.press_mm = 0;
            if (up > kStepMm) s.points.push_back(x);
          };
          lifted(before);
          lifted(here);
        }
        s.points.push_back(here);
      }
      if (s.points.empty()) continue;
      back = !back;
      plan.strokes.push_back(std::move(s));
    }
    if (any) ++layer;
  };
  for (double t = highest - o.layer_mm; t > lowest - o.layer_mm; t -= o.layer_mm)
    rows(plan.coarse_tool, coarse, 2 * step, [&](std::size_t at) -> std::optional<Low> {
      const double low = std::max(t, coarse_low[at]);
      if (low > t + o.layer_mm || g.top[at] < low) return std::nullopt;
      return Low{low, coarse_low[at]};
    });
  for (double t = highest - o.fine_layer_mm; t > lowest - o.fine_layer_mm; t -= o.fine_layer_mm)
    rows(plan.fine_tool, fine, step, [&](std::size_t at) -> std::optional<Low> {
      const double low = std::max(t, g.bottom[at]);
      if (low > t + o.fine_layer_mm || low > coarse_low[at] + o.fine_layer_mm) return std::nullopt;
      return Low{low, g.bottom[at]};
    });
  return plan;
}

/// A place across the direction of approach.
struct Flat {
  double u = 0, v = 0;
};

int reach_of(const WorkPlanOptions& o) {
  return static_cast<int>(o.radius_mm / kPitch);
}

/// Where the window lies best, as one sees it who knows: the most of the targets below it. `fine`: the burr's radius.
Flat best_place(const Columns& columns, double fine, const WorkPlanOptions& o) {
  const int w = static_cast<int>((columns.flat().hi.x - columns.flat().lo.x) / kPitch) + 1;
  const int h = static_cast<int>((columns.flat().hi.y - columns.flat().lo.y) / kPitch) + 1;
  const auto u_of = [&](int i) { return columns.flat().lo.x + i * kPitch; };
  const auto v_of = [&](int j) { return columns.flat().lo.y + j * kPitch; };
  std::vector<double> gain(static_cast<std::size_t>(w) * static_cast<std::size_t>(h), 0.0);
  const auto at = [&](int i, int j) -> double& {
    return gain[static_cast<std::size_t>(j) * static_cast<std::size_t>(w) + static_cast<std::size_t>(i)];
  };
  bool any = false;
  for (int j = 0; j < h; ++j)
    for (int i = 0; i < w; ++i) {
      const Column c = columns.column(u_of(i), v_of(j), fine, 0, false);
      if (!c.target) continue;
      any = true;
      at(i, j) = c.in_target_mm;
    }
  if (!any)
    throw Error(ExitCode::usage,
                "from this side nothing of the target regions is within " + format_number(o.most_depth_mm) +
                    " mm of the bone's surface",
                "give another --approach");
  const int reach = reach_of(o);
  double best = -1e300;
  Flat place;
  for (int j = 0; j < h; ++j)
    for (int i = 0; i < w; ++i) {
      double sum = 0;
      for (int b = -reach; b <= reach; ++b)
        for (int a = -reach; a <= reach; ++a) {
          if ((a * a + b * b) * kPitch * kPitch > o.radius_mm * o.radius_mm) continue;
          sum += i + a < 0 || i + a >= w || j + b < 0 || j + b >= h ? 0.0 : at(i + a, j + b);
        }
      if (sum > best) {
        best = sum;
        place.u = u_of(i);
        place.v = v_of(j);
      }
    }
  return place;
}

struct Cell {
  double u, v;                               // from the window's middle
  double top, coarse, fine, fine_by_coarse;  // how deep the lowest point goes with which burr
};
using Cells = std::map<std::pair<int, int>, Cell>;

/// What is drilled, by its place in steps from the window's middle.
struct Work {
  Cells cells, opening;
};

/// `known`: the best place; `real`: where this one drills instead. `belief`: how much too deep it thinks it may.
/// `coarse`, `fine`: radii; `open`: of the opening; `roof`: how deep that goes.
Work work_of(const Columns& columns, Flat known, Flat real, double coarse, double fine, double belief, double open,
             double roof, const WorkPlanOptions& o) {
  Work work;
  const auto depth_of = [](const Column& c) { return c.target ? c.top - *c.target : 0.0; };
  const int reach = reach_of(o);
  for (int b = -reach; b <= reach; ++b)
    for (int a = -reach; a <= reach; ++a) {
      if ((a * a + b * b) * kPitch * kPitch > o.radius_mm * o.radius_mm) continue;
      const double u = a * kPitch, v = b * kPitch;
      const double depth_coarse = depth_of(columns.column(known.u + u, known.v + v, coarse, 0, true)),
                   depth_fine = depth_of(columns.column(known.u + u, known.v + v, fine, 0, false)),
                   depth_swap = depth_of(columns.column(known.u + u, known.v + v, coarse, 0, false));
      const Column real_coarse = columns.column(real.u + u, real.v + v, coarse, belief, true),
                   real_fine = columns.column(real.u + u, real.v + v, fine, belief, false),
                   real_swap = columns.column(real.u + u, real.v + v, coarse, belief, false);
      if (!real_fine.bone || depth_fine <= 0) continue;
      Cell c{u, v, real_fine.top, 0, 0, 0};
      c.fine = std::max(c.top - depth_fine - belief, real_fine.safe);
      c.fine_by_coarse = std::max(c.top - std::max(depth_swap, depth_coarse) - belief, real_swap.safe);
      // Where the coarse burr reaches no target region above what is ruled out, it goes as deep as it may on the way
      // there.
      const double wanted = depth_coarse > 0 ? depth_coarse : depth_fine;
      c.coarse = std::max({c.top - wanted - belief, real_coarse.safe, c.fine});
      work.cells[{a, b}] = c;
      // The opening is the window, drawn together towards its middle: a continuous matter, whatever the columns' pitch.
      const double narrow = open / o.radius_mm;
      const Column above =
          narrow < 1 ? columns.column(real.u + u * narrow, real.v + v * narrow, coarse, belief, true) : real_coarse;
      if (!above.bone) continue;
      Cell narrowed = c;
      narrowed.u *= narrow;
      narrowed.v *= narrow;
      narrowed.top = above.top;
      narrowed.coarse = narrow < 1 ? std::max({above.top - wanted - belief, above.safe, above.top - roof}) : c.coarse;
      work.opening[{a, b}] = narrowed;
    }
  if (work.cells.empty())
    throw Error(ExitCode::usage, "there is no bone where this trainee means to drill",
                "another --seed, or more of skill 'region'");
  return work;
}

}  // namespace

WorkPlan plan_work(const World& world, const StructureMap& structures, const Procedure& procedure,
                   const TraineeSkill& skill, std::uint64_t seed, const WorkPlanOptions& o) {
  if (o.goal) return plan_goal(world, structures, procedure, o);
  WorkPlan plan;
  plan.toward = o.toward ? normalized(*o.toward) : toward_of(procedure);
  plan.radius_mm = o.radius_mm;
  plan.coarse_tool = static_cast<std::uint8_t>(burr_index(BurrKind::cutting, o.coarse_diameter_mm));
  plan.fine_tool = static_cast<std::uint8_t>(burr_index(BurrKind::diamond, o.fine_diameter_mm));
  const double coarse = o.coarse_diameter_mm / 2, fine = o.fine_diameter_mm / 2;
  const Columns columns(world, structures, procedure, plan.toward, o.most_depth_mm);

  const Flat best = best_place(columns, fine, o);
  const double u0 = best.u, v0 = best.v;
  const int reach = reach_of(o);

  // Where this one drills instead, and how deep it thinks it may.
  statistics::Random random(seed ^ 0x706c616eULL);
  const auto way = portable::sin_cos_turns(random.uniform());
  const double shift = (1 - skill.region) * kGridShiftMm, du = shift * way.cos, dv = shift * way.sin;
  const double belief = (1 - skill.knowledge) * kBeliefMm;
  const double open = o.radius_mm * (1 - kClosed * skill.undercut), roof = 2 * coarse + 1;
  plan.open_mm = open;
  plan.shifted_mm = columns.across() * du + columns.along() * dv;

  const auto [cells, opening] = work_of(columns, best, {best.u + du, best.v + dv}, coarse, fine, belief, open, roof, o);
  double middle = 0, deepest = 0;
  for (const auto& [key, c] : cells) {
    middle += c.top / static_cast<double>(cells.size());
    deepest = std::max(deepest, c.top - c.coarse);
  }
  plan.centre_mm = columns.place(u0 + du, v0 + dv, middle);

  // Rows to and fro, the next layer's at right angles. `lowest`: where the lowest point goes and where it may at most,
  // nothing where the cell has no part.
  int layer = 0;
  const double room = open + fine - 1.5;
  const auto rows = [&](const std::map<std::pair<int, int>, Cell>& of, bool crosswise, std::uint8_t tool, double radius,
                        int row_step, const auto& lowest) {
    bool back = false;
    for (int r = -reach; r <= reach; r += row_step) {
      TraineeStroke s;
      s.tool = tool;
      s.layer = layer;
      for (int q = -reach; q <= reach; ++q) {
        const int at_q = back ? -q : q;
        const auto found = of.find(crosswise ? std::pair{r, at_q} : std::pair{at_q, r});
        if (found == of.end()) continue;
        const Cell& c = found->second;
        const std::optional<Low> low = lowest(c);
        if (!low) continue;
        s.points.push_back({columns.place(u0 + du + c.u, v0 + dv + c.v, low->at + radius),
                            lean(columns, plan.toward, c.u, c.v, o.radius_mm, room, c.top - low->at),
                            std::clamp(low->at - low->most, 0.0, kPressMm)});
      }
      if (s.points.empty()) continue;
      back = !back;
      plan.strokes.push_back(std::move(s));
    }
  };
  for (double d = o.layer_mm; d < deepest + o.layer_mm; d += o.layer_mm) {
    rows(d <= roof ? opening : cells, layer % 2 == 1, plan.coarse_tool, coarse, 2,
         [&](const Cell& c) -> std::optional<Low> {
           const double low = std::max(c.top - d, c.coarse);
           if (low > c.top - d + o.layer_mm) return std::nullopt;  // done in a layer before
           return Low{low, c.coarse};
         });
    ++layer;
  }
  // What is left for the fine burr; of its rows a share is done with the coarse one by those who choose badly.
  double most_fine = 0;
  for (const auto& [key, c] : cells) most_fine = std::max(most_fine, c.coarse - c.fine);
  double allowed = 0;
  for (double d = o.fine_layer_mm; d < most_fine + o.fine_layer_mm; d += o.fine_layer_mm) {
    const std::size_t before = plan.strokes.size();
    const auto low_of = [&](const Cell& c, double deepest_here) -> std::optional<Low> {
      if (c.coarse - d < c.fine - o.fine_layer_mm) return std::nullopt;
      return Low{std::max(c.coarse - d, deepest_here), deepest_here};
    };
    std::vector<TraineeStroke> good, bad;
    rows(cells, layer % 2 == 1, plan.fine_tool, fine, 1, [&](const Cell& c) { return low_of(c, c.fine); });
    good.assign(plan.strokes.begin() + static_cast<std::ptrdiff_t>(before), plan.strokes.end());
    plan.strokes.resize(before);
    rows(cells, layer % 2 == 1, plan.coarse_tool, coarse, 1,
         [&](const Cell& c) { return low_of(c, c.fine_by_coarse); });
    bad.assign(plan.strokes.begin() + static_cast<std::ptrdiff_t>(before), plan.strokes.end());
    plan.strokes.resize(before);
    // Rows with one burr come together: burrs are changed twice a layer at most.
    std::vector<TraineeStroke> late;
    for (std::size_t r = 0; r < good.size(); ++r) {
      allowed += skill.instruments;
      if (allowed >= 1 - 1e-9) {
        allowed -= 1;
        plan.strokes.push_back(good[r]);
      } else {
        late.push_back(bad[r]);
      }
    }
    plan.strokes.insert(plan.strokes.end(), late.begin(), late.end());
    ++layer;
  }
  return plan;
}

}  // namespace osteo::inline assessment
