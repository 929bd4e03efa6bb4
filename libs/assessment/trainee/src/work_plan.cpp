#include "osteo/assessment/trainee/work_plan.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "osteo/core/base/error.h"
#include "osteo/core/base/portable_math.h"
#include "osteo/core/statistics/basics.h"
#include "osteo/simulation/bone/instrument.h"

namespace osteo::inline assessment {

double kept_mm(ProcedureRole role) {
  switch (role) {
    case ProcedureRole::expose:
      return 0.4;
    case ProcedureRole::thin:
      return 1.2;
    case ProcedureRole::enter:
      return -1e9;
    case ProcedureRole::keep:
    case ProcedureRole::never_touch:
      break;
  }
  return 1;
}

namespace {

constexpr double kPitch = 1, kStep = 0.25;           // mm: of columns, and along them
constexpr double kClosed = 0.7;                      // of the window's radius
constexpr double kPressMm = 1;                       // into the next layer
constexpr double kGridShiftMm = 7, kBeliefMm = 2.5;  // at no skill at all
constexpr double kLeanDeg = 40;                      // so that not the burr's slow pole does the work

// A burr that goes straight down: by the depth of its lowest point along the way from the surgeon.
struct Column {
  double top = 0;  ///< the bone's surface, mm along `toward`
  bool bone = false;
  double safe = 0;               ///< as deep as it may
  std::optional<double> target;  ///< as deep as a target region goes, above what is not safe
  double in_target_mm = 0;       ///< of the way, with the burr in a target region
};

class Columns {
 public:
  Columns(const World& world, const StructureMap& structures, const Procedure& procedure, Vec3 toward,
          double most_depth)
      : bone_(world.bodies().front().body->bone),
        structures_(structures),
        toward_(toward),
        across_(any_perpendicular(toward)),
        along_(cross(toward, across_)),
        most_depth_(most_depth),
        each_(structures.values().size()) {
    for (const std::uint8_t value : structures.values()) {
      const ProcedureStructure* const s = procedure.find(structures.name_of(value));
      role_.push_back(s != nullptr ? s->role : ProcedureRole::keep);
      double within = -1;
      for (const ProcedureRegion& r : procedure.regions)
        if (r.kind == RegionKind::target && r.structure == structures.name_of(value))
          within = std::max(within, r.within_mm);
      within_.push_back(within);
      double ruled = 0;
      for (const InstrumentRule& r : procedure.instruments)
        if (r.structure == structures.name_of(value)) ruled = std::max(ruled, r.within_mm);
      ruled_.push_back(ruled);
    }
    // Above all bone near the targets.
    BoxMm box;
    for (std::size_t n = 0; n < within_.size(); ++n) {
      if (within_[n] < 0) continue;
      for (const auto& p : structures.face(n).points_mm) box.include(from_floats(p));
    }
    if (box.lo.x > box.hi.x) {
      std::string names;
      for (const ProcedureRegion& r : procedure.regions)
        if (r.kind == RegionKind::target) names += (names.empty() ? "'" : ", '") + r.structure + "'";
      throw Error(ExitCode::usage,
                  names.empty() ? "the procedure has no target region, so there is nothing to drill towards"
                                : "the case has none of the structures that the target regions lie around: " + names,
                  names.empty() ? "add one of kind \"target\" to its \"regions\""
                                : "prepare the case with --structures and --names");
    }
    for (int c = 0; c < 8; ++c) {
      const Vec3 p{(c & 1) != 0 ? box.hi.x : box.lo.x, (c & 2) != 0 ? box.hi.y : box.lo.y,
                   (c & 4) != 0 ? box.hi.z : box.lo.z};
      flat_.include({dot(p, across_), dot(p, along_), dot(p, toward_)});
    }
    above_ = flat_.hi.z + 25;
  }

  [[nodiscard]] Vec3 place(double u, double v, double t) const { return across_ * u + along_ * v + toward_ * t; }
  [[nodiscard]] const BoxMm& flat() const { return flat_; }
  [[nodiscard]] Vec3 across() const { return across_; }
  [[nodiscard]] Vec3 along() const { return along_; }

  /// `belief`: by how much it thinks structures deeper. `ruled`: it keeps out of where only other instruments are
  /// allowed.
  [[nodiscard]] Column column(double u, double v, double radius, double belief, bool ruled) const {
    Column c;
    const RoundCone ball{0, 0, radius, radius};
    double t = above_;
    for (; t > flat_.lo.z && bone_.nearest(place(u, v, t)) < 0.5F; t -= kStep) {
      // A hollow that is deeper than the burr is no surface to begin at.
      if (t < flat_.hi.z - 30) return c;
    }
    if (t <= flat_.lo.z) return c;
    c.top = t;
    c.bone = true;
    c.safe = t;
    for (; t > c.top - most_depth_ - belief; t -= kStep) {
      structures_.clearance(ball, place(u, v, t + radius), toward_, each_);
      bool reaches = false;
      for (std::size_t n = 0; n < each_.size(); ++n) {
        const double kept =
            std::max(kept_mm(role_[n]), ruled && role_[n] != ProcedureRole::enter ? ruled_[n] : -1e9) - belief;
        if (each_[n] < kept) return c;
        reaches = reaches || (within_[n] >= 0 && each_[n] <= within_[n]);
      }
      c.safe = t;
      if (!reaches) continue;
      c.target = t;
      c.in_target_mm += kStep;
    }
    return c;
  }

 private:
  const BrickGrid& bone_;
  const StructureMap& structures_;
  Vec3 toward_, across_, along_;
  double most_depth_, above_ = 0;
  std::vector<ProcedureRole> role_;
  std::vector<double> within_, ruled_;  // by number of structure
  mutable std::vector<double> each_;
  BoxMm flat_;
};

Vec3 toward_of(const Procedure& procedure) {
  Vec3 view, shown;
  for (const ScaleItem& i : procedure.items) {
    const Vec3 towards = normalized({i.towards[0], i.towards[1], i.towards[2]});
    if (i.kind == ItemKind::no_overhang) view += towards;
    if (i.kind == ItemKind::exposed) shown += towards;
  }
  const Vec3 toward = normalized(length(view) > 0 ? view : shown);
  if (length(toward) == 0)
    throw Error(ExitCode::usage, "no item of the procedure says from where its structures are come to",
                "give --approach, or \"towards\" of an item of kind no_overhang or exposed");
  return toward;
}

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

}  // namespace

WorkPlan plan_work(const World& world, const StructureMap& structures, const Procedure& procedure,
                   const TraineeSkill& skill, std::uint64_t seed, const WorkPlanOptions& o) {
  WorkPlan plan;
  plan.toward = o.toward ? normalized(*o.toward) : toward_of(procedure);
  plan.radius_mm = o.radius_mm;
  plan.coarse_tool = static_cast<std::uint8_t>(burr_index(BurrKind::cutting, o.coarse_diameter_mm));
  plan.fine_tool = static_cast<std::uint8_t>(burr_index(BurrKind::diamond, o.fine_diameter_mm));
  const double coarse = o.coarse_diameter_mm / 2, fine = o.fine_diameter_mm / 2;
  const Columns columns(world, structures, procedure, plan.toward, o.most_depth_mm);

  // The best place, as one sees it who knows.
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
  const int reach = static_cast<int>(o.radius_mm / kPitch);
  double best = -1e300, u0 = 0, v0 = 0;
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
        u0 = u_of(i);
        v0 = v_of(j);
      }
    }

  // Where this one drills instead, and how deep it thinks it may.
  statistics::Random random(seed ^ 0x706c616eULL);
  const auto way = portable::sin_cos_turns(random.uniform());
  const double shift = (1 - skill.region) * kGridShiftMm, du = shift * way.cos, dv = shift * way.sin;
  const double belief = (1 - skill.knowledge) * kBeliefMm;
  const double open = o.radius_mm * (1 - kClosed * skill.undercut), roof = 2 * coarse + 1;
  plan.open_mm = open;
  plan.shifted_mm = columns.across() * du + columns.along() * dv;

  struct Cell {
    double u, v;                               // from the window's middle
    double top, coarse, fine, fine_by_coarse;  // how deep the lowest point goes with which burr
  };
  std::map<std::pair<int, int>, Cell> cells, opening;
  const auto depth_of = [](const Column& c) { return c.target ? c.top - *c.target : 0.0; };
  for (int b = -reach; b <= reach; ++b)
    for (int a = -reach; a <= reach; ++a) {
      if ((a * a + b * b) * kPitch * kPitch > o.radius_mm * o.radius_mm) continue;
      const double u = a * kPitch, v = b * kPitch;
      const double depth_coarse = depth_of(columns.column(u0 + u, v0 + v, coarse, 0, true)),
                   depth_fine = depth_of(columns.column(u0 + u, v0 + v, fine, 0, false)),
                   depth_swap = depth_of(columns.column(u0 + u, v0 + v, coarse, 0, false));
      const Column real_coarse = columns.column(u0 + du + u, v0 + dv + v, coarse, belief, true),
                   real_fine = columns.column(u0 + du + u, v0 + dv + v, fine, belief, false),
                   real_swap = columns.column(u0 + du + u, v0 + dv + v, coarse, belief, false);
      if (!real_fine.bone || depth_fine <= 0) continue;
      Cell c{u, v, real_fine.top, 0, 0, 0};
      c.fine = std::max(c.top - depth_fine - belief, real_fine.safe);
      c.fine_by_coarse = std::max(c.top - std::max(depth_swap, depth_coarse) - belief, real_swap.safe);
      // Where the coarse burr reaches no target region above what is ruled out, it goes as deep as it may on the way
      // there.
      const double wanted = depth_coarse > 0 ? depth_coarse : depth_fine;
      c.coarse = std::max({c.top - wanted - belief, real_coarse.safe, c.fine});
      cells[{a, b}] = c;
      // The opening is the window, drawn together towards its middle: a continuous matter, whatever the columns' pitch.
      const double narrow = open / o.radius_mm;
      const Column above =
          narrow < 1 ? columns.column(u0 + du + u * narrow, v0 + dv + v * narrow, coarse, belief, true) : real_coarse;
      if (!above.bone) continue;
      Cell narrowed = c;
      narrowed.u *= narrow;
      narrowed.v *= narrow;
      narrowed.top = above.top;
      narrowed.coarse = narrow < 1 ? std::max({above.top - wanted - belief, above.safe, above.top - roof}) : c.coarse;
      opening[{a, b}] = narrowed;
    }
  if (cells.empty())
    throw Error(ExitCode::usage, "there is no bone where this trainee means to drill",
                "another --seed, or more of skill 'region'");
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
  struct Low {
    double at, most;
  };
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
