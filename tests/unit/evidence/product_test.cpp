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
  EXPECT_EQ(judge(drilled([](Vec3) { return 1e3; }), p).word, "no voxel lost half of its bone: there is no cavity");
  // A groove that no ball of 0.5 mm enters opens nothing either, and that is another reason.
  const auto groove = judge(drilled([](Vec3 q) { return std::max(std::abs(q.x) - 0.3, 6 - q.z); }), p);
  EXPECT_FALSE(groove.measured);
  EXPECT_NE(groove.word.find("no ball of 0.5 mm comes in"), std::string::npos) << groove.word;
}

TEST(Product, AWallFarFromTheCavityIsToldAsWell) {
  const Procedure p =
      procedure(R"({"name": "i", "kind": "thinned", "structure": "tube", "towards": [1, 0, 0], "within_deg": 20})");
  // From the tube's side at x = -6.8 to a shaft's floor at x = 3, z = 3.5; at the tube's ends 8 mm aside.
  const auto r = judge(drilled(shaft(3.5, 2, 5)), p);
  ASSERT_TRUE(r.measured) << r.word;
  EXPECT_GT(r.value, std::hypot(9.8, 3.5) - 0.4);
  EXPECT_LT(r.value, std::hypot(9.8, 3.5, 8) + 0.4);
  EXPECT_FALSE(r.pass);
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
  EXPECT_EQ(product.word(), "") << "on the bone's own cubes";
  EXPECT_EQ(product.spacing_mm(), 0.5);
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

constexpr double kOff = 0.7 * 0.5;  // what a place may be off by on this lattice
bool draw(const Product::Result& r) {
  return r.word.find("a draw: within what cubes of 0.5 mm can tell") != std::string::npos;
}
// `change` of an item's threshold (or what else it goes by): passes, and whether that is a draw.
void expect_verdict(const test::Drilled& c, Procedure p, const std::function<void(ScaleItem&)>& change, bool pass,
                    bool is_draw, const std::string& what) {
  change(p.items[0]);
  const Product::Result r = judge(c, p);
  ASSERT_TRUE(r.measured) << what;
  EXPECT_EQ(r.pass, pass) << what;
  EXPECT_EQ(draw(r), is_draw) << what << ": " << r.word;
  if (is_draw) {
    EXPECT_LE(std::abs(r.margin), Product::kDraw / 2) << what;
  }
  EXPECT_TRUE(pass ? r.margin >= 0 : r.margin <= 0) << what << ' ' << r.margin;
}

// A length passes at its threshold, and is a draw where 0.7 of a cube (0.35 mm) would have it the other way.
TEST(Product, ALengthIsADrawWithinWhatTheLatticeCanTell) {
  const auto trench = drilled([](Vec3 q) { return std::max({-5 - q.x, q.x + 3.5, -2.5 - q.z, std::abs(q.y) - 9}); });
  const auto wall = drilled([](Vec3 q) { return std::max(std::abs(q.z) > 6 ? 1.0 : -1.0, 1.5 - std::abs(q.y)); });
  const auto pit = drilled(shaft(3.5, 6));
  struct Case {
    std::string name;
    const test::Drilled& drilled;
    std::string item;
  };
  for (const Case& c :
       {Case{"thinned", trench,
             R"({"name": "i", "kind": "thinned", "structure": "tube", "towards": [1, 0, 0], "within_deg": 20,
               "most": 20})"},
        Case{"sharp_angle", wall,
             R"({"name": "i", "kind": "sharp_angle", "structure": "ball", "second": "tube", "within_mm": 5})"},
        Case{"margin", pit, R"({"name": "i", "kind": "margin", "curve_mm": [[-1, 8, 7], [1, 8, 7]], "most": 20})"}}) {
    const Procedure p = procedure(c.item);
    const double value = judge(c.drilled, p).value;
    ASSERT_GT(value, 1) << c.name;
    for (const auto& [more, pass, is_draw] : {std::tuple(0.36, true, false),
                                              {kOff, true, false},
                                              {0.34, true, true},
                                              {0.0, true, true},
                                              {-0.001, false, true},
                                              {-0.34, false, true},
                                              {-kOff, false, true},
                                              {-0.36, false, false}})
      expect_verdict(
          c.drilled, p, [&, by = more](ScaleItem& i) { i.threshold = value + by; }, pass, is_draw,
          c.name + " " + std::to_string(more));
    Procedure far = p;
    far.items[0].threshold = value + 1;
    EXPECT_NEAR(judge(c.drilled, far).margin, 1 / 0.5, 1e-9) << c.name;
    far.items[0].threshold = value - 1;
    EXPECT_NEAR(judge(c.drilled, far).margin, -1 / 0.5, 1e-9) << c.name;
  }
  // Nine tenths of a wall have a bound of their own, which is told to a hundredth.
  Procedure thin = procedure(
      R"({"name": "i", "kind": "thinned", "structure": "tube", "towards": [1, 0, 0], "within_deg": 20,
          "threshold": 8, "most": 20})");
  const std::string told = judge(trench, thin).word;
  ASSERT_EQ(told.find("90 % of the wall is at most "), 0U) << told;
  const double p90 = std::stod(told.substr(28));
  for (const auto& [more, pass, is_draw] :
       {std::tuple(0.36, true, false), {0.33, true, true}, {-0.33, false, true}, {-0.36, false, false}})
    expect_verdict(
        trench, thin, [&, by = more](ScaleItem& i) { i.most = p90 + by; }, pass, is_draw,
        "nine tenths " + std::to_string(more));
  // Beyond a landmark, 4.5 mm here, in steps of half a cube.
  const Procedure rim = procedure(
      R"({"name": "i", "kind": "margin", "curve_mm": [[-0.5, 1.5, 7], [0.5, 1.5, 7]], "threshold": 8, "most": 20})");
  const auto passes = [&](double most) {
    Procedure with = rim;
    with.items[0].most = most;
    return judge(pit, with).pass;
  };
  double beyond = 3;
  while (!passes(beyond) && beyond < 6) beyond += 0.25;
  EXPECT_NEAR(beyond, 4.5, 0.5);
  for (const auto& [more, pass, is_draw] : {std::tuple(0.36, true, false),
                                            {kOff, true, false},
                                            {0.34, true, true},
                                            {0.0, true, true},
                                            {-0.01, false, true},
                                            {-0.34, false, true},
                                            {-kOff, false, true},
                                            {-0.36, false, false}})
    expect_verdict(
        pit, rim, [&, by = more](ScaleItem& i) { i.most = beyond + by; }, pass, is_draw,
        "beyond " + std::to_string(more));
}

// A share passes at its threshold, and is a draw where another cover by 0.35 mm would have it the other way.
TEST(Product, AShareIsADrawWithinWhatTheLatticeCanTell) {
  const auto over_tube = drilled([](Vec3 q) { return std::max({2 - q.z, std::abs(q.x + 8) - 2.5, q.y, -10 - q.y}); });
  const auto over_ball = drilled(shaft(3.5, 6));
  for (const bool tube : {false, true}) {
    const test::Drilled& c = tube ? over_tube : over_ball;
    for (const double cover : {1.5, 0.2}) {
      const Procedure p = procedure(tube ? R"({"name": "i", "kind": "followed", "structure": "tube"})"
                                         : R"({"name": "i", "kind": "exposed", "structure": "ball"})");
      const auto share = [&](double mm) {
        Procedure with = p;
        with.items[0].cover_mm = std::max(0.0, mm);
        return judge(c, with).value;
      };
      const double value = share(cover), less = share(cover - 0.35), more = share(cover + 0.35);
      for (const double at : {less, value, more, less + 1e-6, value + 1e-6, more + 1e-6})
        expect_verdict(
            c, p,
            [&](ScaleItem& i) {
              i.threshold = at;
              i.cover_mm = cover;
            },
            value >= at, (less >= at) != (more >= at), std::to_string(tube) + " " + std::to_string(cover));
      if (cover < 1) continue;
      EXPECT_LT(less, value);
      EXPECT_LE(value, more);
    }
  }
}

// Of a ball of 3 mm the caps that are deeper than 0.35 mm within its face, within it, and as far beyond as labels of
// 0.4 mm may be off as well.
TEST(Product, AnAreaOrAVolumeIsADrawWithinWhatTheLatticeCanTell) {
  const auto cap = [](double r, double floor) {
    return std::numbers::pi * (r - floor) * (r - floor) * (r - (r - floor) / 3);
  };
  const Procedure whole = procedure(R"({"name": "i", "kind": "not_violated", "structure": "ball"})");
  const auto cut = drilled(shaft(2, 6));
  const double value = judge(cut, whole).value;
  const double surely = cap(3 - 0.35, 2), perhaps = cap(3 + 0.35 + 0.36 * 0.4, 2);
  ASSERT_GT(value, surely + 2);
  ASSERT_LT(value, perhaps - 4);
  for (const auto& [at, pass, is_draw] : {std::tuple(surely - 1.2, false, false),
                                          {surely + 1.2, false, true},
                                          {value - 0.01, false, true},
                                          {value, true, true},
                                          {perhaps - 2, true, true},
                                          {perhaps + 2, true, false}})
    expect_verdict(
        cut, whole, [&, to = at](ScaleItem& i) { i.threshold = to; }, pass, is_draw, "volume " + std::to_string(at));
  // Nothing gone is as good as it gets, and what is near is told all the same.
  const Product::Result kept = judge(drilled(shaft(4, 6)), whole);
  EXPECT_TRUE(kept.pass);
  EXPECT_DOUBLE_EQ(kept.margin, 1);
  EXPECT_FALSE(draw(kept));
  EXPECT_EQ(kept.evidence_count, 0U);
  EXPECT_TRUE(draw(judge(drilled(shaft(3, 6)), whole))) << "at its very face";
  // A burr that reached it is one, however much is allowed.
  Procedure allowed = whole;
  allowed.items[0].threshold = 100;
  allowed.items[0].spread = 200;
  EXPECT_NEAR(judge(cut, allowed).margin, (100 - value) / 200, 1e-6);
  const Product::Result reached = judge(cut, allowed, {0, 0, 1}, {"tube", "ball"});
  EXPECT_FALSE(reached.pass);
  EXPECT_EQ(reached.margin, -1);
  EXPECT_EQ(reached.word, "a running burr or saw reached into it");
  EXPECT_TRUE(judge(cut, allowed, {0, 0, 1}, {"tube"}).pass);

  // An area: of a quarter of a cube more or less of cover, 2.4 mm2 of the ball's face each.
  const Procedure closed = procedure(R"({"name": "i", "kind": "no_hole", "structure": "ball"})");
  const auto open = drilled(shaft(1, 6));
  const double area = judge(open, closed).value;
  for (const auto& [at, pass, is_draw] : {std::tuple(area - 9, false, false),
                                          {area - 0.2, false, true},
                                          {area, false, true},
                                          {area + 0.2, true, true},
                                          {area + 9, true, false}})
    expect_verdict(
        open, closed, [&, to = at](ScaleItem& i) { i.threshold = to; }, pass, is_draw, "area " + std::to_string(at));
  // Two holes are as large as the larger one, and it alone is shown.
  const auto two = drilled([](Vec3 q) {
    const double beside = std::hypot(q.x, q.y) - 6;
    return std::min(std::max(beside, 2 - q.z), std::max(beside, q.z + 2.6));
  });
  const Product::Result larger = judge(two, closed);
  EXPECT_NEAR(larger.value, 2 * std::numbers::pi * 3 * 1.1, 5) << "and with the other one it would be 8 more";
  for (const Vec3 e : larger.evidence_mm) EXPECT_GT(e.z, 1);
}

// Cells in a step: bone is gone above a low floor on one side and a high one on the other. All of it is cavity, so what
// is left is known to the cell, and a draw by those that have a face at it.
TEST(Product, CellsLeftAreADrawByThoseBesideTheCavity) {
  const auto in_cells = [](Vec3 p) { return std::max({std::abs(p.x) - 4, std::abs(p.y) - 3, std::abs(p.z) - 4}) < 0; };
  const StructureMap map =
      test::structure_map([&](Vec3 p) -> std::uint8_t { return in_cells(p) ? 1 : 0; }, {{1, "cells", {}}}, 0.5, 30);
  const Procedure p = parse_procedure(
      R"({"osteotome_procedure": 1, "name": "t", "structures": [{"name": "cells", "role": "enter"}],
          "items": [{"name": "i", "kind": "no_cells_left", "structure": "cells", "cells": "cells"}]})",
      "t.json");
  const test::Drilled c = test::drilled(
      block, [](Vec3 q) { return std::max((q.x < 0 ? 1.0 : -2.0) - q.z, std::abs(q.y) - 20); }, 0.5, 34);
  const Product product(c.before, c.after, map, p, c.removed);
  const auto at = [&](double threshold) {
    ScaleItem item = p.items[0];
    item.threshold = threshold;
    return product.evaluate(item, {0, 0, 1}, {});
  };
  // 16 x 12 x 16 cells; left are 10 layers of half of them and 4 of the other half.
  constexpr int kAll = 16 * 12 * 16, kLeft = 8 * 12 * (10 + 4);
  // Two floors and the step between them, whose upper edge is of both.
  constexpr int kBeside = 8 * 12 + 8 * 12 + 6 * 12 - 12;
  const Product::Result r = at(0.5);
  ASSERT_TRUE(r.measured) << r.word;
  EXPECT_EQ(r.evidence_count, static_cast<std::size_t>(kLeft));
  EXPECT_DOUBLE_EQ(r.value, static_cast<double>(kLeft) / kAll);
  for (const auto& [cells, pass, is_draw] : {std::tuple(kLeft + kBeside, true, false),
                                             {kLeft + kBeside - 1, true, true},
                                             {kLeft, true, true},
                                             {kLeft - 1, false, true},
                                             {kLeft - kBeside, false, true},
                                             {kLeft - kBeside - 1, false, false}}) {
    const Product::Result other = at(static_cast<double>(cells) / kAll);
    EXPECT_EQ(other.pass, pass) << cells - kLeft;
    EXPECT_EQ(draw(other), is_draw) << cells - kLeft;
    if (!is_draw) {
      EXPECT_NEAR(other.margin, (cells - kLeft) / (0.05 * kAll), 1e-9);
    }
  }
}

// The tube of 16 mm in steps of a millimetre along its way: each that comes near counts, to the last.
TEST(Product, FollowedCountsEachMillimetreToTheEnds) {
  // 2 x 2 cells thick: the way from end to end is 31 steps, one of them across.
  const StructureMap map = test::structure_map(
      [](Vec3 p) -> std::uint8_t { return std::abs(p.x) < 0.5 && std::abs(p.z) < 0.5 && std::abs(p.y) < 8 ? 1 : 0; },
      {{1, "tube", {}}}, 0.5, 30);
  const Procedure p = parse_procedure(
      R"({"osteotome_procedure": 1, "name": "t", "structures": [{"name": "tube", "role": "keep"}],
          "items": [{"name": "i", "kind": "followed", "structure": "tube", "cover_mm": 2}]})",
      "t.json");
  for (const auto& [from, to, least, most] :
       {std::tuple(-20.0, 20.0, 16, 16), {6.0, 20.0, 3, 4}, {-20.0, -6.0, 3, 4}, {-2.0, 2.0, 7, 8}}) {
    const test::Drilled c = test::drilled(
        block,
        [from = from, to = to](Vec3 q) {
          return std::max({1.5 - q.z, std::abs(q.x) - 3, from - q.y, q.y - to});
        },
        0.5, 34);
    const Product::Result r = Product(c.before, c.after, map, p, c.removed).evaluate(p.items[0], {0, 0, 1}, {});
    ASSERT_TRUE(r.measured) << r.word;
    const double steps = r.value * 16;
    EXPECT_NEAR(steps, std::round(steps), 1e-9) << from;
    EXPECT_GE(steps, least) << from;
    EXPECT_LE(steps, most) << from;
    for (const Vec3 e : r.evidence_mm) {
      EXPECT_GT(e.y, from - 3);
      EXPECT_LT(e.y, to + 3);
    }
  }
  // A tube that no cell's middle lies in is too thin for it.
  const StructureMap thin = test::structure_map(
      [](Vec3 q) -> std::uint8_t { return std::abs(q.x) < 0.05 && std::abs(q.z) < 0.05 && std::abs(q.y) < 3 ? 1 : 0; },
      {{1, "tube", {}}}, 0.08, 8);
  const test::Drilled c = drilled(shaft(1.5, 3));
  const Product::Result r = Product(c.before, c.after, thin, p, c.removed).evaluate(p.items[0], {0, 0, 1}, {});
  EXPECT_FALSE(r.measured);
  EXPECT_EQ(r.word, "it is thinner than the lattice of 0.5 mm");
}

// What is looked at from is what the item says, else from where it was drilled; a pit is open to above and not to
// aside.
TEST(Product, AnOverhangIsOneFromWhereItIsLookedAt) {
  const auto item = [](const std::string& more) {
    return procedure(R"({"name": "i", "kind": "no_overhang", "structure": "ball", "within_mm": 2)" + more + "}");
  };
  const test::Drilled c = drilled(shaft(3.5, 6));
  const std::string above = R"(, "towards": [0, 0, 5])", aside = R"(, "towards": [1, 0, 0])";
  const auto open = judge(c, item(above), {});
  ASSERT_TRUE(open.measured);
  EXPECT_DOUBLE_EQ(open.value, 1);
  EXPECT_TRUE(open.pass);
  EXPECT_EQ(open.evidence_count, 0U);
  EXPECT_NEAR(open.margin, (1 - 0.95) / 0.05, 1e-9);
  EXPECT_DOUBLE_EQ(judge(c, item(""), {0, 0, 1}).value, 1);
  const auto closed = judge(c, item(aside), {0, 0, 1});
  EXPECT_LT(closed.value, 0.2);
  EXPECT_FALSE(closed.pass);
  EXPECT_GT(closed.evidence_count, 50U);
  // 15 degrees aside is still within the cone.
  EXPECT_DOUBLE_EQ(judge(c, item(R"(, "towards": [0.25, 0, 1])"), {}).value, 1);
  const auto unknown = judge(c, item(""), {});
  EXPECT_FALSE(unknown.measured);
  EXPECT_EQ(unknown.word.find("it is not known from where it is looked at"), 0U);
  const auto far = judge(drilled(shaft(6, 3)), item(""), {0, 0, 1});
  EXPECT_FALSE(far.measured);
  EXPECT_EQ(far.word, "the cavity does not come within 2 mm of it");
}

// Pieces are at least so many and at most so many, plates at least: one more or less decides.
TEST(Product, PiecesAndPlatesAreCounted) {
  const World one = test::solid_world([](Vec3 p) { return 2 - length(p); }, 0.5, 8);
  struct Row {
    ItemKind kind;
    double threshold, most;
    bool pass;
    double margin;
  };
  for (const Row& row : {Row{ItemKind::pieces, 1, 1, true, 1}, Row{ItemKind::pieces, 1, 5, true, 1},
                         Row{ItemKind::pieces, 0, 1, true, 1}, Row{ItemKind::pieces, 0, 5, true, 2},
                         Row{ItemKind::pieces, 2, 5, false, -1}, Row{ItemKind::pieces, 3, 5, false, -2},
                         Row{ItemKind::pieces, 0, 0, false, -1}, Row{ItemKind::fixed, 0, 0, true, 1},
                         Row{ItemKind::fixed, 1, 5, false, -1}, Row{ItemKind::fixed, 2, 5, false, -2}}) {
    ScaleItem item;
    item.kind = row.kind;
    item.threshold = row.threshold;
    item.most = row.most;
    item.spread = 1;
    const Product::Result r = Product::count(item, one);
    EXPECT_TRUE(r.measured);
    EXPECT_EQ(r.value, row.kind == ItemKind::pieces ? 1 : 0);
    EXPECT_EQ(r.pass, row.pass) << row.threshold << ' ' << row.most;
    EXPECT_EQ(r.margin, row.margin) << row.threshold << ' ' << row.most;
    EXPECT_EQ(r.threshold, row.threshold);
    EXPECT_EQ(r.unit, "1");
  }
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
