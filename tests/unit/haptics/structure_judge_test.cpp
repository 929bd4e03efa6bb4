// What hands, shafts, screws and planes take of critical structures, against volumes in closed form.
#include "osteo/simulation/haptics/structure_judge.h"
#include "osteo/core/base/translate.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "osteo/simulation/bone/instrument.h"
#include "osteo/simulation/bone/plates.h"
#include "soft_solid.h"

namespace osteo {
namespace {

constexpr double kPi = std::numbers::pi;

double volume_mm3(const TriMesh& face) {
  double six = 0;
  const auto at = [&](std::uint32_t n) { return from_floats(face.points_mm[n]); };
  for (const auto& t : face.triangles) six += dot(at(t[0]), cross(at(t[1]), at(t[2])));
  return std::abs(six) / 6;
}
StructureMap map_of(const std::function<std::uint8_t(Vec3)>& label) {
  Labels l;
  constexpr double h = 0.25;
  l.frame.dims = {80, 72, 80};
  l.frame.spacing_mm = {h, h, h};
  l.frame.origin_mm = {-8 + h / 2, -9 + h / 2, -10 + h / 2};
  const auto v = make_voxels<std::uint8_t>(l.frame.voxel_count());
  std::size_t at = 0;
  for (int k = 0; k < l.frame.dims[2]; ++k)
    for (int j = 0; j < l.frame.dims[1]; ++j)
      for (int i = 0; i < l.frame.dims[0]; ++i)
        v[at++] = label(l.frame.world_from_index({double(i), double(j), double(k)}));
  l.voxels = v;
  l.structures = {{2, "facial nerve", {}}, {7, "dura", {}}};
  return StructureMap(l);
}
// A nerve of 1 mm along z at x 0, from -9 to 9, and dura: all beyond x 8.
const StructureMap& nerve_and_dura() {
  static const StructureMap map = map_of([](Vec3 p) -> std::uint8_t {
    return std::hypot(p.x, p.y) < 0.5 && std::abs(p.z) < 9 ? 2 : p.x > 8 ? 7 : 0;
  });
  return map;
}
// Of the map's own face: what there is to be met.
double section_mm2() {
  static const double area = volume_mm3(nerve_and_dura().face(0)) / 18;
  return area;
}

World slab() {
  Frame f;
  f.dims = {80, 48, 80};
  f.spacing_mm = {0.5, 0.5, 0.5};
  f.origin_mm = {-19.75, -7.75, -19.75};
  return World(test::soft_solid(f, [](Vec3 p) { return 4 - std::abs(p.y); }));
}

struct Hand {
  StructureJudge& judge;
  int tool;
  Vec3 axis;
  std::uint64_t tick = 1000;
  double rpm = 20'000;
  std::uint32_t hand = 0;
  RigidTransform own{};

  void at(Vec3 p) {
    TickRecord t;
    t.tick = tick++;
    t.hand = hand;
    t.device.position_mm = to_floats(p);
    t.device.axis = to_floats(axis);
    t.device.tool = static_cast<std::uint8_t>(tool);
    t.speed_rpm = static_cast<float>(rpm);
    judge.tick(t, own, {});
  }
  void go(Vec3 from, Vec3 to, int ticks = 100) {
    for (int n = 0; n <= ticks; ++n) at(from + (to - from) * (static_cast<double>(n) / ticks));
  }
};
// What came to more than contact, and what happened in words.
std::string words_of(const std::vector<StructureCutEvent>& events) {
  std::string all;
  for (const StructureCutEvent& e : events)
    all += std::string(name_of(e.by)) + " at " + std::to_string(e.tick) + " " + std::to_string(e.cut.mm3) + "; ";
  return all;
}
const Instrument& burr4() {
  return instrument_library()[static_cast<std::size_t>(instrument_index("cutting 4 mm"))];
}

// Across the nerve along x: a length of it as long as the ball's chord there, whole.
TEST(StructureJudge, ABallAcrossANerveTakesItsChordOfIt) {
  for (const double off : {0.0, 0.7, 1.3}) {
    StructureJudge judge(nerve_and_dura(), 1000);
    // Held so that its shaft is behind the ball.
    Hand hand{judge, instrument_index("cutting 4 mm"), {0, 1, 0}};
    hand.go({-4, off, 1}, {4, off, 1});
    hand.go({4, off, 1}, {-4, off, 1});  // what lay in it once counts once
    const auto events = judge.events();
    ASSERT_EQ(events.size(), 1U) << words_of(events);
    EXPECT_EQ(events[0].by, CutBy::burr);
    EXPECT_EQ(events[0].cut.structure, 2);
    // The mean of the chord over the nerve's width: 4 mm less y2 / 2 of a quarter of its radius squared.
    const double chord = 2 * std::sqrt(4 - off * off - section_mm2() / kPi / 4);
    EXPECT_NEAR(events[0].cut.mm3 / (section_mm2() * chord), 1, 0.05) << off;
    EXPECT_LT(length(events[0].cut.at_mm - Vec3{0, 0, 1}), 0.1);
    EXPECT_NEAR(static_cast<double>(events[0].tick), 1000 + 50 - 2.5 / 0.08, 8);
  }
}

// Half a ball into a plane, and a cap: in closed form.
TEST(StructureJudge, ABallInAPlaneTakesItsCap) {
  for (const double depth : {0.5, 1.0, 2.0}) {
    StructureJudge judge(nerve_and_dura(), 1000);
    Hand hand{judge, instrument_index("cutting 4 mm"), {-0.6, -0.8, 0}};
    const double face = 7 + nerve_and_dura().distance_mm(1, {7, 0.33, 0.21});
    hand.go({5, 0.33, 0.21}, {face - 2 + depth, 0.33, 0.21});
    const auto events = judge.events();
    ASSERT_EQ(events.size(), 1U) << words_of(events);
    EXPECT_EQ(events[0].cut.structure, 7);
    const double cap = kPi * depth * depth * (2 - depth / 3);
    EXPECT_NEAR(events[0].cut.mm3 / cap, 1, 0.05) << depth;
  }
}

TEST(StructureJudge, WithTheDrillOffAHeadTakesNothingAndAShaftWhatItGoesThrough) {
  const double radius = burr4().shaft.start_radius_mm;
  for (const double rpm : {0.0, 20'000.0}) {
    StructureJudge judge(nerve_and_dura(), 1000);
    Hand hand{judge, instrument_index("cutting 4 mm"), {-1, 0, 0}};
    hand.rpm = rpm;
    // The head far beyond the nerve, the shaft sideways through it.
    hand.go({5.5, -3, 3}, {5.5, 3, 3});
    const auto events = judge.events();
    ASSERT_EQ(events.size(), 1U) << words_of(events);
    EXPECT_EQ(events[0].by, CutBy::shaft);
    EXPECT_NEAR(events[0].cut.mm3 / (section_mm2() * 2 * radius), 1, 0.05);
    EXPECT_LT(length(events[0].cut.at_mm - Vec3{0, 0, 3}), 0.1);
    const StructureCut cuts[] = {events[0].cut};
    EXPECT_EQ(reported_cut(nerve_and_dura(), events[0].by, cuts).find("the shaft went through the facial nerve ("), 0U);
  }
  StructureJudge judge(nerve_and_dura(), 1000);
  Hand off{judge, instrument_index("cutting 4 mm"), {0, 1, 0}};
  off.rpm = 0;
  off.go({-4, 0, -4}, {4, 0, -4});
  for (const StructureCutEvent& e : judge.events()) EXPECT_EQ(e.by, CutBy::shaft) << "a head at rest presses aside";
}

// A graze is contact, and beside it is nothing.
TEST(StructureJudge, AGrazeIsContactAndBesideIsNothing) {
  const double radius = std::sqrt(section_mm2() / kPi);
  for (const double gap : {-0.02, 0.1, 0.3}) {
    StructureJudge judge(nerve_and_dura(), 1000);
    Hand hand{judge, instrument_index("cutting 4 mm"), {0, 1, 0}};
    const double reach = 2 + radius + gap;
    hand.go({0, reach + 3, 0.05}, {0, reach, 0.05});
    const auto events = judge.events();
    ASSERT_EQ(events.size(), gap < 0 ? 1U : 0U) << gap;
    if (events.empty()) continue;
    EXPECT_EQ(events[0].cut.mm3, 0);
    const StructureCut cuts[] = {events[0].cut};
    EXPECT_EQ(reported_cut(nerve_and_dura(), events[0].by, cuts), "contact of the burr with the facial nerve");
  }
  // The same of a plane, and of one that cuts.
  StructureCut graze, cut;
  graze.structure = 2;
  cut.structure = 7;
  cut.mm3 = 31;
  const StructureCut both[] = {graze, cut};
  EXPECT_EQ(reported_cut(nerve_and_dura(), CutBy::saw, both),
            "the saw cut through the dura (31 mm³); contact of the saw with the facial nerve");
  EXPECT_EQ(reported_cut(nerve_and_dura(), CutBy::saw, {}), "");
  // The window's message of a harm, in the language of who reads it.
  const InLanguage theirs(Language::german);
  EXPECT_EQ(reported_cut(nerve_and_dura(), CutBy::saw, both),
            "die Säge hat durchtrennt: „Dura“ (31 mm³); Kontakt (Säge): „N. facialis“");
}

TEST(StructureJudge, EventsAreOfOneTimeAndPlace) {
  StructureJudge judge(nerve_and_dura(), 1000);
  Hand hand{judge, instrument_index("cutting 2 mm"), {0, 1, 0}};
  const auto dip = [&](double z, std::uint64_t at) {
    hand.tick = at;
    hand.go({0, 3, z}, {0, 0.7, z});
    hand.go({0, 0.7, z}, {0, 3, z});
  };
  dip(-6, 1000);
  dip(-5.4, 1500);  // within a second, beside it: the same
  dip(-2, 4000);    // later
  dip(4.5, 4400);   // at once, but elsewhere
  dip(4.5, 9000);   // again where all is gone: nothing happens to it
  const auto events = judge.events();
  ASSERT_EQ(events.size(), 3U);
  EXPECT_LT(events[0].tick, 1100U);
  EXPECT_NEAR(events[0].cut.at_mm.z, -5.7, 0.2);
  EXPECT_GT(events[1].tick, 4000U);
  EXPECT_NEAR(events[2].cut.at_mm.z, 4.5, 0.1);
  EXPECT_GT(events[0].cut.mm3, events[1].cut.mm3);
  EXPECT_NEAR(events[1].cut.mm3 / events[2].cut.mm3, 1, 0.05);
}

// Two hands at one place share what is there; each event says whose.
TEST(StructureJudge, TwoHandsDoNotTakeTheSameTwice) {
  StructureJudge judge(nerve_and_dura(), 1000);
  Hand first{judge, instrument_index("cutting 4 mm"), {0, -1, 0}}, second = first;
  second.hand = 1;
  first.go({-4, 0, 1}, {4, 0, 1});
  second.go({-4, 0, 2}, {4, 0, 2});
  const auto events = judge.events();
  ASSERT_EQ(events.size(), 2U);
  EXPECT_EQ(events[1].hand, 1U);
  const double chord = 2 * std::sqrt(4 - section_mm2() / kPi / 4);
  EXPECT_NEAR(events[0].cut.mm3 / (section_mm2() * chord), 1, 0.05);
  EXPECT_NEAR(events[1].cut.mm3 / section_mm2(), 1, 0.07) << "a millimetre more of its length";
}

TEST(StructureJudge, ASawInTheHandTakesItsThickness) {
  const int saw = instrument_index("saw 25 mm");
  const double thick = 2 * instrument_library()[static_cast<std::size_t>(saw)].head.start_radius_mm;
  StructureJudge judge(nerve_and_dura(), 1000);
  Hand hand{judge, saw, {-1, 0, 0}};
  hand.go({4, -3, -3}, {4, 3, -3});
  const auto events = judge.events();
  ASSERT_EQ(events.size(), 1U);
  EXPECT_EQ(events[0].by, CutBy::hand_saw);
  EXPECT_NEAR(events[0].cut.mm3 / (section_mm2() * thick), 1, 0.05);
}

// Where the first body was moved the structures are with it.
TEST(StructureJudge, StructuresGoWithTheFirstBody) {
  StructureJudge judge(nerve_and_dura(), 1000);
  Hand hand{judge, instrument_index("cutting 4 mm"), {0, -1, 0}};
  hand.own = {{}, {0, -20, 0}};
  hand.go({-4, 20, 1}, {4, 20, 1});
  ASSERT_EQ(judge.events().size(), 1U);
  EXPECT_LT(length(judge.events()[0].cut.at_mm - Vec3{0, 0, 1}), 0.1);
}

TEST(StructureJudge, ScrewsTakeWhatTheyGoThrough) {
  const World world = slab();
  StructureJudge judge(nerve_and_dura(), 1000);
  const PlateModel& plate = plate_library().front();
  // Plates have their screws along -z; turned so that these go along -y, one of them onto the nerve.
  const Mat3 turned{{Vec3{1, 0, 0}, Vec3{0, 0, -1}, Vec3{0, 1, 0}}};
  const auto fixed = [&](double x) {
    const Vec3 hole = turned * plate.holes_mm.front();
    return SceneAction::attach(0, {turned, Vec3{x, 2, 0} - hole}, world.bodies().front().body->id);
  };
  const auto cuts = judge.attach(500, world, fixed(0));
  ASSERT_GE(cuts.size(), 1U);
  EXPECT_EQ(cuts[0].structure, 2);
  EXPECT_NEAR(cuts[0].mm3 / (section_mm2() * plate.screw_mm), 1, 0.1) << "its chords are a little shorter";
  EXPECT_LT(length(cuts[0].at_mm), 0.1);
  ASSERT_EQ(judge.events().size(), cuts.size());
  EXPECT_EQ(judge.events()[0].by, CutBy::plate_screws);
  EXPECT_EQ(judge.events()[0].tick, 500U);
  StructureJudge beside(nerve_and_dura(), 1000);
  for (const StructureCut& c : beside.attach(500, world, fixed(-0.6 - plate.screw_mm / 2))) EXPECT_NE(c.structure, 2);
}

}  // namespace
}  // namespace osteo
