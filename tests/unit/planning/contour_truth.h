// How far outlines and condyles truly are off, from where surgery put each fragment.
#pragma once
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "osteo/geometry/distance/triangle_tree.h"
#include "outcome_parts.h"
#include "outcome_world.h"

namespace osteo::testing_planning {

struct TrueFigures {
  double mean = 0, p95 = 0;
};

inline TrueFigures figures_of(std::vector<std::pair<double, double>> off_and_weight) {
  std::sort(off_and_weight.begin(), off_and_weight.end());
  double all = 0, below = 0;
  TrueFigures f;
  for (const auto& [off, weight] : off_and_weight) all += weight;
  for (const auto& [off, weight] : off_and_weight) {
    f.mean += off * weight / all;
    if (below < 0.95 * all - 1e-9) f.p95 = off;
    below += weight;
  }
  return f;
}

/// What a fragment is off by in the plan's axes, with the reference where it was.
inline RigidTransform off_by(const Outcome& o, const Truth& t, std::size_t n) {
  std::size_t reference = 0;
  while (!o.fragments[reference].reference) ++reference;
  return t.deviation[reference].inverse() * t.deviation[n];
}

inline TrueFigures true_against_plan(const Outcome& o, const Truth& t, const SurgicalPlan& plan) {
  std::vector<std::pair<double, double>> all;
  for (std::size_t n = 0; n < plan.fragments.size(); ++n) {
    const PlannedFragment& f = plan.fragments[n];
    if (f.planned_from_ct.shift_mm == Vec3{}) continue;
    const TriangleSoup& bone = f.bone == "mandible" ? world().phantom.jaw : world().phantom.donor;
    const TriangleTree tree(bone);
    std::vector<const CutPlane*> planes;
    for (const std::string& p : f.planes) planes.push_back(&plan.plane(p));
    const RigidTransform off = f.planned_from_ct.inverse() * off_by(o, t, n) * f.planned_from_ct;
    for (const auto& p : outcome::spread(bone, planes)) all.emplace_back(tree.closest(off(p.at)).distance_mm, p.mm2);
  }
  return figures_of(all);
}

/// Of the rebuilt jaw.
inline TrueFigures true_against_mirrored(const Outcome& o, const Truth& t, const SurgicalPlan& plan) {
  const std::vector<Vec3>& axis = world().axis_mm;
  std::vector<RigidTransform> off;
  for (std::size_t n = 0; n < plan.fragments.size(); ++n)
    if (plan.fragments[n].bone != "mandible") off.push_back(off_by(o, t, n));
  std::vector<std::pair<double, double>> all;
  for (const Vec3& q : world().contour_mm) {
    std::size_t at = 0;
    double nearest = 1e9;
    for (std::size_t k = 0; k + 1 < axis.size(); ++k) {
      const Vec3 d = axis[k + 1] - axis[k];
      const double mm = length(q - axis[k] - d * std::clamp(dot(q - axis[k], d) / dot(d, d), 0.0, 1.0));
      if (mm >= nearest) continue;
      nearest = mm;
      at = k;
    }
    const Vec3 a = off[at](axis[at]), d = normalized(off[at](axis[at + 1]) - a);
    all.emplace_back(length(cross(q - a, d)), 1);
  }
  return figures_of(all);
}

struct ContourErrors {
  std::vector<double> plan_mm, mirrored_mm, condyle_mm, condyle_deg;
  int held[6] = {}, asked[6] = {};  ///< plan: mean, 95 %; mirrored side: mean, 95 %; condyle: shift, turn
  double squares[6] = {};           ///< of errors over half-widths
  int unknown = 0;
  void ask(int which, const Interval95& m, double truth) {
    held[which] += m.holds(truth) ? 1 : 0;
    squares[which] += (m.value - truth) * (m.value - truth) / (m.half * m.half);
    ++asked[which];
  }
  [[nodiscard]] double over_half(int k) const { return std::sqrt(squares[k] / std::max(1, asked[k])); }
  void add(const Outcome& o, const Truth& t, const SurgicalPlan& plan) {
    for (const ContourOutcome& c : o.contours) {
      const bool own = c.against == "plan";
      if (!own && plan.planes.size() == 2) continue;  // nothing is rebuilt
      unknown += c.known ? 0 : 1;
      if (!c.known) continue;
      const TrueFigures f = own ? true_against_plan(o, t, plan) : true_against_mirrored(o, t, plan);
      ask(own ? 0 : 2, c.mean_mm, f.mean);
      ask(own ? 1 : 3, c.p95_mm, f.p95);
      (own ? plan_mm : mirrored_mm).push_back(std::abs(c.mean_mm.value - f.mean));
    }
    for (const CondyleOutcome& c : o.condyles) {
      if (c.pose.reference) continue;
      unknown += c.pose.known ? 0 : 1;
      if (!c.pose.known) continue;
      std::size_t n = 0;
      while (plan.fragments[n].name != c.pose.name) ++n;
      const RigidTransform d = off_by(o, t, n);
      const Vec3 shift = d(c.pose.middle_mm) - c.pose.middle_mm, turn = turn_of(d);
      Vec3 off, turned;
      for (std::size_t a = 0; a < 3; ++a) {
        off[a] = c.pose.shift_mm[a].value - shift[a];
        turned[a] = c.pose.turn_deg[a].value - turn[a];
        ask(4, c.pose.shift_mm[a], shift[a]);
        ask(5, c.pose.turn_deg[a], turn[a]);
      }
      condyle_mm.push_back(length(off));
      condyle_deg.push_back(length(turned));
    }
  }
};

}  // namespace osteo::testing_planning
