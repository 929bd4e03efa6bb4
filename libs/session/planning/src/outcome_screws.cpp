// Screws and empty holes of a plan, in a CT after surgery: which is whose, and how far it is off.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "osteo/core/base/portable_math.h"
#include "outcome_parts.h"
#include "outcome_rod.h"

namespace osteo::inline session::outcome {
namespace rods {
namespace {

using planning::Row;

constexpr double kSameRod = 0.5;      // of a diameter between two axes: one screw was found twice
constexpr double kUndecidedMm = 0.5;  // which of two planned screws one is
constexpr double kDoubtMm = 1.5;      // from its place: nothing but that place says whose a screw is
// What the voxels' own scatter does not show of places. With 0.015 mm, intervals of entries held 87 %.
constexpr double kModelMm = 0.02, kModelEndMm = 0.03;
// Beside a plate, tips are off by a tenth more than that (seeds 311 to 320: held 114 of 120, root mean square of errors
// over half-widths 0.57 instead of 0.51).
constexpr double kEndBesidePlate = 1.3;
// A hole that ends in marrow or goes through shows no bottom; what there was taken for one was up to 1.6 mm off.
constexpr double kBottomDoubt = 2;
constexpr const char* kOneForTwo = "one lies where two are planned; which of them it is cannot be known";

// From the fit to the plan's axes, in the CT of the fragment's bone.
void compare(ScrewOutcome& out, const Wanted& w, const RodFit& rod, const Fit& fragment, const OutcomeParams& params) {
  const RigidTransform back = fragment.pose.inverse();
  const PlannedScrew& s = *w.screw;
  const Vec3 wanted = normalized(s.tip_mm - s.entry_mm);
  const Mat3 to_bone = {{back.rotation * rod.rod.axes.column[0], back.rotation * rod.rod.axes.column[1],
                         back.rotation * rod.rod.axes.column[2]}};
  const Vec3 axis = to_bone.column[2], through = back(rod.rod.at);
  const double along = dot(s.entry_mm - through, wanted) / dot(axis, wanted);
  const Vec3 entry = through + axis * along, tip = back(rod.rod.world({0, 0, rod.rod.tip}));
  out.axes = {back.rotation * w.planned.axes.column[0], back.rotation * w.planned.axes.column[1]};
  out.seen = rod.seen;
  if (rod.off > kDoubtMm)
    out.finding = "it lies " + planning::rounded(rod.off, 1) +
                  " mm from its place: one that nobody planned would be taken for it";
  const double quantile = std::max(rod.quantile, fragment.quantile);

  // The covariance of a place on the axis: the fit's, the pose's, the model's.
  using Three = std::array<std::array<double, 3>, 3>;
  const auto spread_at = [&](double s_mm, bool end) {
    std::array<Row<5>, 3> slope{};
    for (std::size_t k = 0; k < 3; ++k) {
      slope[k][0] = to_bone.column[0][k];
      slope[k][1] = to_bone.column[1][k];
      slope[k][2] = to_bone.column[0][k] * (s_mm - rod.middle);
      slope[k][3] = to_bone.column[1][k] * (s_mm - rod.middle);
      if (end) slope[k][4] = axis[k] * (s.empty ? kBottomDoubt : 1);
    }
    Three sum = planning::carried<5, 3>(slope, rod.covariance);
    const auto moves = at_place(fragment, rod.rod.world({0, 0, s_mm}), back.rotation);
    const Three pose = planning::carried<7, 3>({moves[0], moves[1], moves[2]}, fragment.covariance);
    const double more = end && rod.plated ? kEndBesidePlate : 1, model_mm = more * kModelMm;
    const double tilt = rod.model_tilt(s.empty) * (s_mm - rod.middle), end_mm = end ? more * kModelEndMm : 0;
    for (std::size_t r = 0; r < 3; ++r) {
      for (std::size_t c = 0; c < 3; ++c) sum[r][c] += pose[r][c] + (end_mm * end_mm - tilt * tilt) * axis[r] * axis[c];
      sum[r][r] += model_mm * model_mm + tilt * tilt;
    }
    return sum;
  };
  const Three at_entry = spread_at(along, false), at_tip = spread_at(rod.rod.tip, true);
  const auto moves = at_place(fragment, fragment.pose(s.entry_mm), back.rotation);
  out.slides_along = slide_of(planning::carried<7, 3>({moves[0], moves[1], moves[2]}, fragment.covariance), quantile,
                              params.max_unsure_mm);
  const auto fill = [&](std::array<Interval95, 3>& to, Vec3 off, const Three& covariance, bool across) {
    bool sure = true;
    // Across the screw, and what is left of the way along which nothing is known: at right angles, so that the order in
    // which both are taken off makes no difference.
    Vec3 unknown = out.slides_along;
    if (across) unknown -= wanted * dot(unknown, wanted);
    unknown = length(unknown) > 1e-6 ? normalized(unknown) : Vec3{};
    const auto left = [&](Vec3 v) {
      if (across) v -= wanted * dot(v, wanted);
      return v - unknown * dot(v, unknown);
    };
    off = left(off);
    for (std::size_t k = 0; k < 3; ++k) {
      Vec3 a;
      a[k] = 1;
      to[k] = {off[k], half_along(covariance, quantile, left(a))};
      sure = sure && to[k].half <= params.max_unsure_mm;
    }
    return sure;
  };
  out.known = fill(out.entry_mm, entry - s.entry_mm, at_entry, true);
  out.tip_known = fill(out.tip_mm, tip - s.tip_mm, at_tip, false) && rod.end_seen;
  // The tilt: the fit's, and the pose's turn.
  out.direction_known = true;
  Row<2> tangent{};
  for (std::size_t k = 0; k < 2; ++k) {
    tangent[k] = dot(axis, out.axes[k]) / dot(axis, wanted);
    Row<5> own{};
    own[2] = dot(to_bone.column[0], out.axes[k]);
    own[3] = dot(to_bone.column[1], out.axes[k]);
    const Vec3 about = cross(axis, out.axes[k]);
    const double model = rod.model_tilt(s.empty);
    Row<7> turn{};
    for (std::size_t n = 0; n < 7; ++n) turn[n] = moves[3][n] * about.x + moves[4][n] * about.y + moves[5][n] * about.z;
    const double variance = planning::carried<5, 1>({own}, rod.covariance)[0][0] +
                            planning::carried<7, 1>({turn}, fragment.covariance)[0][0] + model * model;
    out.tilt_deg[k] = {portable::atan2(tangent[k], 1) / kDeg, quantile * std::sqrt(variance) / kDeg};
    out.direction_known = out.direction_known && out.tilt_deg[k].half <= params.max_unsure_deg;
  }
  out.angle_deg = portable::atan2(portable::hypot(tangent[0], tangent[1]), 1) / kDeg;
  if (!out.known || !out.direction_known || !out.tip_known) out.why = "the interval is wider than what is accepted";
  if (s.empty && out.known && out.direction_known && !rod.end_seen) out.why = "the CT shows no bottom of the hole";
}

}  // namespace
}  // namespace rods

void find_screws(Outcome& out, const SurgicalPlan& plan, const std::vector<std::optional<Fit>>& fits,
                 const planning::EdgeReader& ct, const Image& postop, const OutcomeParams& params,
                 const Context& context) {
  using namespace rods;
  if (plan.screws.empty()) return;
  const RodFinder finder(ct, postop, params);
  const std::size_t count = plan.screws.size();
  std::vector<Wanted> wanted(count);
  std::vector<std::optional<RodFit>> rods(count);
  std::vector<std::size_t> of(count);
  for (std::size_t n = 0; n < count; ++n) {
    context.check_cancelled();
    const PlannedScrew& s = plan.screws[n];
    ScrewOutcome& o = out.screws.emplace_back();
    o.name = s.name;
    o.fragment = s.fragment;
    o.empty = s.empty;
    while (plan.fragments[of[n]].name != s.fragment) ++of[n];
    if (!fits[of[n]] || fits[of[n]]->found < kMinFound) {
      o.why = "its fragment is not found";
      continue;
    }
    const Fit& fragment = *fits[of[n]];
    Wanted& w = wanted[n];
    w.screw = &s;
    w.length = length(s.tip_mm - s.entry_mm);
    w.radius = s.diameter_mm / 2;
    const Vec3 along = normalized(s.tip_mm - s.entry_mm), x = any_perpendicular(along);
    w.planned.at = fragment.pose(s.entry_mm);
    w.planned.axes = {
        {fragment.pose.rotation * x, fragment.pose.rotation * cross(along, x), fragment.pose.rotation * along}};
    w.planned.blur = blur_of(fragment);
    rods[n] = finder.find(w, {}, 0, o.why, o.found);
  }
  // One screw that two are planned at is that of the nearer; the other may have one of its own.
  for (bool again = true; again;) {
    again = false;
    for (std::size_t a = 0; a < count && !again; ++a) {
      for (std::size_t b = 0; b < count && !again; ++b) {
        if (a == b || !rods[a] || !rods[b] || plan.screws[a].empty != plan.screws[b].empty) continue;
        if (rods[b]->off < rods[a]->off || (rods[b]->off == rods[a]->off && b < a)) continue;  // a is the nearer
        const Vec3 q = rods[a]->rod.local(rods[b]->rod.world({0, 0, rods[b]->middle}));
        if (portable::hypot(q.x, q.y) > kSameRod * 2 * std::min(wanted[a].radius, wanted[b].radius)) continue;
        if (q.z < -1 || q.z > rods[a]->rod.tip + 1) continue;
        const double nearer = rods[a]->off, farther = rods[b]->off;
        std::vector<Rod> taken;
        for (std::size_t n = 0; n < count; ++n)
          if (n != b && rods[n]) taken.push_back(rods[n]->rod);
        out.screws[b].why.clear();
        rods[b] = plan.screws[b].empty
                      ? std::nullopt
                      : finder.find(wanted[b], taken, wanted[a].radius, out.screws[b].why, out.screws[b].found);
        again = true;
        const bool same =
            rods[b] && std::any_of(taken.begin(), taken.end(), [&](const Rod& t) {
              const Vec3 p = t.local(rods[b]->rod.world({0, 0, rods[b]->middle}));
              return portable::hypot(p.x, p.y) < kSameRod * 2 * wanted[b].radius && p.z > -1 && p.z < t.tip + 1;
            });
        if (same) rods[b].reset();
        if (rods[b]) continue;
        if (plan.screws[b].empty) {  // it was not looked for again
          out.screws[b].found = true;
          out.screws[b].why = kOneForTwo;
        } else if (same || !out.screws[b].found) {
          out.screws[b].found = false;
          out.screws[b].why = "what is near the planned place is that of '" + plan.screws[a].name + "'";
        }
        if (farther - nearer >= kUndecidedMm) continue;
        for (const std::size_t n : {a, b}) {
          rods[n].reset();
          out.screws[n].found = true;
          out.screws[n].why = kOneForTwo;
        }
      }
    }
  }
  for (std::size_t n = 0; n < count; ++n)
    if (rods[n]) compare(out.screws[n], wanted[n], *rods[n], *fits[of[n]], params);
}

}  // namespace osteo::inline session::outcome
