// The primitives of the final product against bodies whose answer is known.
#include "osteo/assessment/evidence/detail/product.h"
#include "osteo/assessment/evidence/detail/progress.h"

#include <gtest/gtest.h>

#include <numbers>

#include "scene.h"

namespace osteo {
namespace {

// Bone below z = 8; in it a ball of radius 3 around the origin (1), and a tube along y at x = -8 of radius 1.2 (2).
double block(Vec3 p) {
  return std::min({8 - p.z, 13 - std::abs(p.x), 13 - std::abs(p.y), p.z + 9});
}
std::uint8_t structure_at(Vec3 p) {
  if (length(p) < 3) return 1;
  return std::hypot(p.x + 8, p.z) < 1.2 && std::abs(p.y) < 8 ? 2 : 0;
}
const StructureMap& structures() {
  static const StructureMap map = test::structure_map(structure_at, {{1, "ball", {}}, {2, "tube", {}}}, 0.4, 30);
  return map;
}
Procedure procedure(const std::string& items) {
  return parse_procedure(
      "{ \"osteotome_procedure\": 1, \"name\": \"t\", \"structures\": [ {\"name\": \"ball\""
      ", \"role\": \"expose\"},"
      "{\"name\": \"tube\", \"role\": \"keep\"} ], \"regions\": [ {\"name\": \"shell\", \"kind\": \"target\", "
      "\"structure\": \"ball\", "
      "\"within_mm\": 2},"
      "{\"name\": \"about the tube\", \"kind\": \"forbidden\", \"structure\": \"tube\", \"within_mm\": 1} ], "
      "\"items\": [" +
          items + "] }",
      "t.json");
}

using test::shaft;
test::Drilled drilled(const std::function<double(Vec3)>& kept) {
  return test::drilled(block, kept, 0.5, 34);
}
Product::Result judge(const test::Drilled& c, const Procedure& p, Vec3 approach = {0, 0, 1},
                      const std::vector<std::string>& injured = {}) {
  const Product product(c.before, c.after, structures(), p, c.removed);
  return product.evaluate(p.items.front(), approach, injured);
}

// From a flat floor at height f the ball's face is within c where z >= f - c: a cap.
TEST(Product, ExposedIsTheCapThatTheFloorComesNearTo) {
  for (const double cover : {1.0, 1.5}) {
    const Procedure p = procedure(
        "{\"name\": \"shown\", \"kind\": \"exposed\", \"structure\": \"ball\", \"towards\": [0, 0, 1], \"within_deg\": "
        "90, \"cover_mm\": " +
        std::to_string(cover) + "}");
    const auto r = judge(drilled(shaft(3.5, 6)), p);
    ASSERT_TRUE(r.measured);
    // Of the upper half sphere the share by area is its height over the radius.
    EXPECT_NEAR(r.value, (3 - (3.5 - cover)) / 3, 0.07) << cover;
    EXPECT_GT(r.evidence_count, 0U);
    EXPECT_NEAR(r.margin, (r.value - 0.6) / 0.15, 1e-9);
    for (const Vec3 e : r.evidence_mm) EXPECT_GT(e.z, 3.5 - cover - 0.5);
  }
  const Procedure p = procedure("{\"name\": \"shown\", \"kind\": \"exposed\", \"structure\": \"ball\"}");
  EXPECT_DOUBLE_EQ(judge(drilled([](Vec3) { return 1e3; }), p).value, 0);
}

TEST(Product, NotViolatedCountsWhatIsGoneInside) {
  const Procedure p = procedure("{\"name\": \"whole\", \"kind\": \"not_violated\", \"structure\": \"ball\"}");
  EXPECT_TRUE(judge(drilled(shaft(3.5, 6)), p).pass);
  const auto cut = judge(drilled(shaft(2, 6)), p);
  // The cap of height 1.
  EXPECT_FALSE(cut.pass);
  const double cap = std::numbers::pi * 1 * 1 * (3 - 1.0 / 3);
  EXPECT_NEAR(cut.value, cap, 0.25 * cap);
  EXPECT_EQ(cut.evidence_count, cut.evidence_mm.size());
  for (const Vec3 e : cut.evidence_mm) EXPECT_LT(length(e), 3.4);
  const auto reached = judge(drilled(shaft(3.5, 6)), p, {0, 0, 1}, {"ball"});
  EXPECT_FALSE(reached.pass);
  EXPECT_EQ(reached.value, 0);
  EXPECT_LE(reached.margin, -1);
}

TEST(Product, AHoleIsAsLargeAsTheBareCap) {
  const Procedure p = procedure("{\"name\": \"no hole\", \"kind\": \"no_hole\", \"structure\": \"ball\"}");
  EXPECT_TRUE(judge(drilled(shaft(4.5, 6)), p).pass);
  const auto r = judge(drilled(shaft(1, 6)), p);
  EXPECT_FALSE(r.pass);
  // The cap above z = 1, give or take a cell.
  EXPECT_NEAR(r.value, 2 * std::numbers::pi * 3 * 2, 2 * std::numbers::pi * 3 * 0.6);
}

TEST(Product, AWallIsAsThickAsItIs) {
  const Procedure p = procedure(
      "{\"name\": \"thin\", \"kind\": \"thinned\", \"structure\": \"tube\", \"towards\": [1, 0, 0], \"within_deg\": "
      "20, \"threshold\": "
      "2.5, \"most\": 20}");
  // A trench beside the tube, its face at x = -5: 1.8 mm off.
  const auto r = judge(drilled([](Vec3 q) {
                         return std::max({-5 - q.x, q.x + 3.5, -2.5 - q.z, std::abs(q.y) - 9});
                       }),
                       p);
  ASSERT_TRUE(r.measured);
  EXPECT_NEAR(r.value, 1.85, 0.3);
  EXPECT_TRUE(r.pass);
  EXPECT_EQ(judge(drilled([](Vec3) { return 1e3; }), p).word, "nothing was removed: the bone is unchanged");
  // A groove that no ball of 0.5 mm enters opens nothing either, and that is another reason.
  const auto groove = judge(drilled([](Vec3 q) { return std::max(std::abs(q.x) - 0.3, 6 - q.z); }), p);
  EXPECT_FALSE(groove.measured);
  EXPECT_NE(groove.word.find("no ball of 0.5 mm comes in"), std::string::npos) << groove.word;
}

TEST(Product, APatchIsAPartOfAFaceByPlace) {
  const auto item = [&](const std::string& kind, const std::string& points, const std::string& more = "") {
    Procedure p = procedure("{\"name\": \"i\", \"kind\": \"" + kind + "\", \"structure\": \"ball\"" + more + "}");
    FacePatch patch{"window", "ball", {}, 2};
    const auto at = Json::parse(points);
    for (const Json& q : at->items())
      patch.points_mm.push_back({*q.items()[0].number(), *q.items()[1].number(), *q.items()[2].number()});
    p.patches.push_back(patch);
    p.items[0].patch = "window";
    return p;
  };
  // A shaft down to the ball's top: all of the patch there is shown, a tenth of the whole ball at most.
  const auto c = drilled(test::shaft(3.0, 3));
  const std::string top = "[[0, 0, 3]]", side = "[[0, 3, 0]]", seam = "[[0, 0, 3], [0, 3, 0]]", nowhere = "[[0, 0, 9]]";
  EXPECT_GT(judge(c, item("exposed", top)).value, 0.95);
  EXPECT_EQ(judge(c, item("exposed", side)).value, 0);
  const double whole = judge(c, procedure("{\"name\": \"i\", \"kind\": \"exposed\", \"structure\": \"ball\"}")).value;
  EXPECT_LT(whole, 0.4);
  // The line through both points holds what lies between them as well.
  const double both = judge(c, item("exposed", seam)).value;
  EXPECT_GT(both, 0.2);
  EXPECT_LT(both, 0.7);
  // A direction takes its part of the patch.
  EXPECT_GT(judge(c, item("exposed", seam, ", \"towards\": [0, 0, 1], \"within_deg\": 25")).value, 0.95);
  EXPECT_LT(judge(c, item("thinned", top)).value, 0.4);
  EXPECT_GT(judge(c, item("thinned", side)).value, 1);
  EXPECT_EQ(judge(drilled(test::shaft(2.0, 3)), item("no_hole", side)).value, 0);
  EXPECT_GT(judge(drilled(test::shaft(2.0, 3)), item("no_hole", top)).value, 3);
  for (const char* const kind : {"exposed", "thinned", "no_hole"}) {
    const auto r = judge(c, item(kind, nowhere));
    EXPECT_FALSE(r.measured);
    EXPECT_EQ(r.word, "no part of the structure's face lies in the patch 'window'");
  }
  EXPECT_FALSE(judge(c, procedure("{\"name\": \"i\", \"kind\": \"exposed\", \"structure\": \"ball\"}")).word.empty())
      << "that it is over all of the face is said";
}

TEST(Product, FollowedIsTheShareOfTheTubesLength) {
  const Procedure p =
      procedure("{\"name\": \"followed\", \"kind\": \"followed\", \"structure\": \"tube\", \"cover_mm\": 1.5}");
  // A trench above it for y < 0: half of its way.
  const auto r = judge(drilled([](Vec3 q) { return std::max({2 - q.z, std::abs(q.x + 8) - 2.5, q.y, -10 - q.y}); }), p);
  ASSERT_TRUE(r.measured);
  EXPECT_NEAR(r.value, 0.56, 0.08);  // and a millimetre on, which is still near
}

TEST(Product, UnderARoofNothingIsSeen) {
  const Procedure p =
      procedure("{\"name\": \"open\", \"kind\": \"no_overhang\", \"structure\": \"ball\", \"within_mm\": 3}");
  EXPECT_GT(judge(drilled(shaft(3.5, 6)), p).value, 0.95);
  // A shaft beside, and from it a chamber under the roof.
  const auto under = [](Vec3 q) {
    const double beside = std::max(3.5 - q.z, std::hypot(q.x - 7, q.y) - 2),
                 chamber = std::max({3.5 - q.z, q.z - 6, std::abs(q.y) - 3, std::abs(q.x - 3.5) - 4.5});
    return std::min(beside, chamber);
  };
  const auto r = judge(drilled(under), p);
  ASSERT_TRUE(r.measured);
  EXPECT_LT(r.value, 0.3);
  EXPECT_FALSE(r.pass);
}

TEST(Product, ASharpAngleLeavesNoRoomForABall) {
  const Procedure p = procedure(
      "{\"name\": \"sharp\", \"kind\": \"sharp_angle\", \"structure\": \"ball\", \"second\": \"tube\", \"within_mm\": "
      "5}");
  const auto full = judge(drilled([](Vec3) { return 1e3; }), p);
  const auto thin =
      judge(drilled([](Vec3 q) { return std::max(std::abs(q.z) > 6 ? 1.0 : -1.0, 1.5 - std::abs(q.y)); }), p);
  EXPECT_GT(full.value, 3);
  EXPECT_FALSE(full.pass);
  EXPECT_NEAR(thin.value, 1.5, 0.4);  // a wall of 3 mm
  EXPECT_TRUE(thin.pass);
}

TEST(Product, AMarginIsReachedAndNotPassed) {
  const auto with = [](double y) {
    return procedure("{\"name\": \"rim\", \"kind\": \"margin\", \"curve_mm\": [[-1, " + std::to_string(y) +
                     ", 7], [1, " + std::to_string(y) + ", 7]]}");
  };
  const test::Drilled c = drilled(shaft(3.5, 6));
  EXPECT_TRUE(judge(c, with(6.5)).pass);
  const auto short_of = judge(c, with(10));
  EXPECT_FALSE(short_of.pass);
  EXPECT_NEAR(short_of.value, 4, 0.5);
  const auto beyond = judge(c, with(1.5));
  EXPECT_FALSE(beyond.pass);
  EXPECT_LT(beyond.value, 0.5);
}

TEST(Product, RegionsAndTheCavityHaveTheirVolumes) {
  const Procedure p = procedure("");
  const test::Drilled c = drilled(shaft(3.5, 6));
  const Product product(c.before, c.after, structures(), p, c.removed);
  const auto regions = product.regions();
  ASSERT_EQ(regions.size(), 2U);
  // A ball of 5 mm, and of it the cap above 3.5.
  EXPECT_NEAR(regions[0].bone_mm3, 4.0 / 3 * std::numbers::pi * 125, 0.05 * 523);
  EXPECT_NEAR(regions[0].removed_mm3, std::numbers::pi * 1.5 * 1.5 * (5 - 0.5), 4);
  EXPECT_EQ(regions[1].removed_mm3, 0);
  EXPECT_NEAR(product.outside_targets_mm3(), std::numbers::pi * 36 * 4.5 - regions[0].removed_mm3, 20);
  EXPECT_NEAR(product.cavity_mm3(), std::numbers::pi * 36 * 4.5, 0.08 * std::numbers::pi * 36 * 4.5);
}

TEST(Product, ABubbleThatNobodyReachedIsNoCavity) {
  const Procedure p = procedure("");
  const test::Drilled c = drilled([](Vec3 q) { return length(q - Vec3{6, 6, 0}) - 2; });
  EXPECT_EQ(Product(c.before, c.after, structures(), p, c.removed).cavity_mm3(), 0);
}

// While it is drilled: each step's items as the score judges them at the end; before anything is gone, and after harm.
TEST(Product, StepsAreAsFarAsTheirItems) {
  const Procedure p =
      procedure(R"({"name": "shown", "kind": "exposed", "structure": "ball", "towards": [0, 0, 1], "within_deg": 90,)"
                R"( "cover_mm": 2.5}, {"name": "whole", "kind": "not_violated", "structure": "ball"},)"
                R"( {"name": "spared", "kind": "not_violated", "structure": "tube"} ], "steps": [)"
                R"( {"name": "find it", "items": ["shown"]}, {"name": "harm nothing", "items": ["whole", "spared"]})");
  const auto steps = [&](const test::Drilled& c, const std::vector<std::string>& injured = {}) {
    const auto all = step_progress(c.before, c.after, structures(), p, {0, 0, 1}, injured);
    EXPECT_EQ(all.size(), 2U);
    EXPECT_EQ(all[0].name, "find it");
    EXPECT_EQ(all[0].items, 1U);
    EXPECT_EQ(all[1].items, 2U);
    return std::pair{all[0].passed, all[1].passed};
  };
  using Passed = std::pair<std::size_t, std::size_t>;
  EXPECT_EQ(steps(drilled([](Vec3) { return 1e3; })), (Passed{0, 2})) << "nothing is gone yet";
  EXPECT_EQ(steps(drilled(shaft(3.2, 6))), (Passed{1, 2}));
  EXPECT_EQ(steps(drilled(shaft(2, 6))), (Passed{1, 1})) << "through the ball's cap";
  EXPECT_EQ(steps(drilled(shaft(3.2, 6)), {"tube"}), (Passed{1, 1})) << "a burr has reached the tube";
}

TEST(Product, WhatTheCaseLacksIsNotJudged) {
  const Procedure p = parse_procedure(
      "{ \"osteotome_procedure\": 1, \"name\": \"t\", \"structures\": [ {\"name\": \"ball\", \"role\": \"expose\"}, "
      "{\"name\": \"gone\", "
      "\"role\": \"keep\"} ],"
      "\"items\": [ {\"name\": \"a\", \"kind\": \"no_hole\", \"structure\": \"gone\"} ] }",
      "t.json");
  const auto r = judge(drilled(shaft(3.5, 6)), p);
  EXPECT_FALSE(r.measured);
  EXPECT_EQ(r.word, "the case has no 'gone'");
}

}  // namespace
}  // namespace osteo
