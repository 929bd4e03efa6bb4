// Contours and condyles of outcomes, against where surgery truly put each fragment.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "contour_truth.h"

namespace osteo {
namespace {

using namespace testing_planning;

Outcome measured(const SurgicalPlan& plan, const Truth& t, std::uint64_t seed, const PostopCt& how = {}) {
  return measure_outcome(plan, world().bones(), postop_ct(t.fragments, box_of(t, plan, world()), how, seed), {});
}

double most(const std::vector<double>& v) {
  return v.empty() ? 1e9 : *std::max_element(v.begin(), v.end());
}

TEST(OutcomeContour, IsThatOfTheTrueOutline) {
  ContourErrors errors;
  for (const std::uint64_t seed : {7, 8}) {
    const Truth t = surgery(world(), world().rebuilt, 0.7, 3, seed);
    errors.add(measured(world().rebuilt, t, seed), t, world().rebuilt);
  }
  const Truth t = surgery(world(), world().advanced, 1.5, 3, 9);
  errors.add(measured(world().advanced, t, 9), t, world().advanced);
  EXPECT_EQ(errors.unknown, 0);
  EXPECT_EQ(errors.plan_mm.size(), 3U);
  EXPECT_EQ(errors.mirrored_mm.size(), 2U);
  EXPECT_LT(most(errors.plan_mm), 0.06);
  EXPECT_LT(most(errors.mirrored_mm), 0.06);
  EXPECT_LT(most(errors.condyle_mm), 0.2);
  EXPECT_LT(most(errors.condyle_deg), 0.2);
  for (int k = 0; k < 6; ++k) {
    EXPECT_GT(errors.over_half(k), 0.02) << k << ": so wide that they say nothing";
    EXPECT_LT(errors.over_half(k), 1.2) << k;
  }
}

// Distances have no sign: of what lies as planned, errors of the poses are all that is measured, and 0 must be held.
TEST(OutcomeContour, OfWhatLiesAsPlannedIsNothing) {
  const Truth t = surgery(world(), world().rebuilt, 0, 0, 11);
  const Outcome o = measured(world().rebuilt, t, 11);
  ASSERT_EQ(o.contours.size(), 2U);
  EXPECT_EQ(o.contours[0].against, "plan");
  ASSERT_TRUE(o.contours[0].known) << o.contours[0].why;
  EXPECT_LT(o.contours[0].mean_mm.value, 0.04);
  EXPECT_TRUE(o.contours[0].mean_mm.holds(0)) << o.contours[0].mean_mm.value << ' ' << o.contours[0].mean_mm.half;
  EXPECT_EQ(o.contours[0].planned_mean_mm, 0);
  // Against the mirrored side the plan itself is off, and the outcome by as much.
  ASSERT_TRUE(o.contours[1].known) << o.contours[1].why;
  EXPECT_GT(o.contours[1].planned_mean_mm, 0.1);
  EXPECT_NEAR(o.contours[1].mean_mm.value, o.contours[1].planned_mean_mm, 0.05);
}

TEST(OutcomeContour, CondylesAreAtTheJawsEnds) {
  const Truth t = surgery(world(), world().advanced, 1.5, 3, 12);
  const Outcome o = measured(world().advanced, t, 12);
  ASSERT_EQ(o.condyles.size(), 2U);
  const auto& points = world().phantom.jaw.points_mm;  // the middles of its end faces are the last two
  int references = 0;
  for (const CondyleOutcome& c : o.condyles) {
    references += c.pose.reference ? 1 : 0;
    EXPECT_NE(c.pose.known, c.pose.reference);
    EXPECT_EQ(c.pose.why.find("part of the reference") != std::string::npos, c.pose.reference) << c.pose.why;
    const PlannedFragment& f = world().advanced.fragments[c.pose.name == "back" ? 0 : 1];
    const Vec3 middle = f.planned_from_ct.inverse()(c.pose.middle_mm);
    const Vec3 end = c.side == "left" ? points.back() : points[points.size() - 2];
    EXPECT_LT(length(middle - end), 8) << c.side;
  }
  EXPECT_EQ(references, 1);
  EXPECT_EQ(o.condyles[0].side, "left");
}

// With a skull that the plan leaves where it is, both condyles are told against it.
TEST(OutcomeContour, CondylesAreHeldAgainstTheSkull) {
  TriangleSoup skull;  // an egg above the jaw
  constexpr std::uint32_t kRings = 40, kAround = 60;
  const BoxMm jaw = bounds_of(world().phantom.jaw);
  const Vec3 middle{(jaw.lo.x + jaw.hi.x) / 2, (jaw.lo.y + jaw.hi.y) / 2, jaw.hi.z + 35};
  const auto place = [&](double u, double v) {
    return middle + Vec3{58 * std::sin(u) * std::cos(v), 70 * std::sin(u) * std::sin(v),
                         25 * std::cos(u) * (1 + 0.2 * std::sin(u) * std::sin(v))};
  };
  skull.points_mm = {place(0, 0), place(kDeg * 180, 0)};
  for (std::uint32_t k = 1; k < kRings; ++k)
    for (std::uint32_t n = 0; n < kAround; ++n)
      skull.points_mm.push_back(place(kDeg * 180 * k / kRings, kDeg * 360 * n / kAround));
  const auto at = [](std::uint32_t k, std::uint32_t n) { return 2 + (k - 1) * kAround + n % kAround; };
  for (std::uint32_t n = 0; n < kAround; ++n) {
    skull.triangles.push_back({0, at(1, n), at(1, n + 1)});
    skull.triangles.push_back({1, at(kRings - 1, n + 1), at(kRings - 1, n)});
    for (std::uint32_t k = 1; k + 1 < kRings; ++k) {
      skull.triangles.push_back({at(k, n), at(k + 1, n), at(k + 1, n + 1)});
      skull.triangles.push_back({at(k, n), at(k + 1, n + 1), at(k, n + 1)});
    }
  }
  const BoneField field(skull);
  SurgicalPlan plan = world().advanced;
  plan.fragments.push_back({"skull", "skull", {}, {}});
  Truth t = surgery(world(), world().advanced, 1.5, 3, 13);
  const RigidTransform patient = t.fragments[0].postop_from_ct;
  const RigidTransform off = motion(world().phantom.a_mm, {0.8, -0.6, 0.4}, {1, 0.5, -1});
  t.deviation[0] = off;
  t.deviation[1] = off * t.deviation[1];
  for (std::size_t n = 0; n < 2; ++n)
    t.fragments[n].postop_from_ct = patient * t.deviation[n] * plan.fragments[n].planned_from_ct;
  BoxMm box = box_of(t, world().advanced, world());
  t.deviation.push_back({});
  t.fragments.push_back({&field, patient, {}, {}, {}});
  for (const Vec3& p : skull.points_mm) box.include(patient(p));
  PostopCt how;
  how.spacing_mm = {0.8, 0.8, 0.9};
  auto bones = world().bones();
  bones.emplace_back("skull", skull);
  const Outcome o = measure_outcome(plan, bones, postop_ct(t.fragments, box, how, 13), {});
  EXPECT_TRUE(o.fragments[2].reference);
  ASSERT_EQ(o.condyles.size(), 2U);
  ContourErrors errors;
  errors.add(o, t, plan);
  EXPECT_EQ(errors.condyle_mm.size(), 2U) << o.condyles[0].pose.why << o.condyles[1].pose.why;
  EXPECT_LT(most(errors.condyle_mm), 0.25);
  EXPECT_LT(most(errors.condyle_deg), 0.25);
}

TEST(OutcomeContour, SaysWhatCannotBeKnown) {
  const SurgicalPlan& plan = world().advanced;
  Truth t = surgery(world(), plan, 0, 0, 3);
  const BoxMm box = box_of(t, plan, world());
  t.fragments.pop_back();
  const Outcome o = measure_outcome(plan, world().bones(), postop_ct(t.fragments, box, {}, 3), {});
  ASSERT_EQ(o.contours.size(), 2U);
  EXPECT_FALSE(o.contours[0].known);
  EXPECT_EQ(o.contours[0].why, "'front' is not found");
  EXPECT_FALSE(o.contours[1].known);
  EXPECT_NE(o.contours[1].why.find("does not rebuild"), std::string::npos) << o.contours[1].why;
  for (const CondyleOutcome& c : o.condyles) {
    EXPECT_FALSE(c.pose.known);
    EXPECT_EQ(c.pose.why.empty(), false);
  }
}

}  // namespace
}  // namespace osteo
