// The hand by itself, the plan, what the trainee knows, and one short session from beginning to end.
#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <filesystem>

#include "../evidence/scene.h"
#include "osteo/assessment/trainee/group.h"
#include "osteo/assessment/trainee/simulate.h"
#include "osteo/assessment/trainee/trainee_hand.h"
#include "osteo/core/base/error.h"
#include "osteo/session/recording/session_reader.h"
#include "osteo/session/scene/rehearsal.h"
#include "scratch.h"

namespace osteo {
namespace {

constexpr double kDt = 0.001;

TEST(Skill, ReadsWhatIsNamedAndRefusesTheRest) {
  EXPECT_EQ(parse_skill("").undercut, 0);
  EXPECT_EQ(parse_skill("expert, undercut = 0.5").undercut, 0.5);
  EXPECT_LT(parse_skill("novice").region, 0.5);
  EXPECT_EQ(parse_skill("novice,region=1").region, 1);
  EXPECT_THROW((void)parse_skill("undercutting=1"), Error);
  EXPECT_THROW((void)parse_skill("undercut"), Error);
  EXPECT_THROW((void)parse_skill("undercut=2"), Error);
  EXPECT_THROW((void)parse_skill("undercut=1, novice"), Error);
}

TEST(Skill, LatinHypercubeUsesEachStepOnce) {
  const auto all = latin_hypercube(20, 3);
  std::vector<int> seen(20);
  for (const TraineeSkill& s : all) ++seen[static_cast<std::size_t>(s.undercut * 20)];
  for (const int n : seen) EXPECT_EQ(n, 1);
  EXPECT_EQ(all[0].force_n, all[19].force_n);
  EXPECT_GT(overall(person_skill(TraineeGroup::expert, 1)), overall(person_skill(TraineeGroup::novice, 1)));
}

TraineeStroke stroke(std::vector<Vec3> points, bool drilling) {
  TraineeStroke s;
  s.tool = static_cast<std::uint8_t>(burr_index(BurrKind::cutting, 4));
  s.drilling = drilling;
  for (const Vec3 p : points) s.points.push_back({p, {0, 0, 1}});
  return s;
}

// A wall below z = 0 of 4 N/mm that nothing is taken from.
Vec3 wall(Vec3 at) {
  return at.z < 0 ? Vec3{0, 0, -4 * at.z} : Vec3{};
}

TEST(Hand, ReachesItsPlacesAtItsSpeed) {
  TraineeSkill skill;
  skill.tremor_mm = 0;
  TraineeHand hand(skill, 1, nullptr, {}, {0, 0, 5}, {0, 0, 1}, {0, 0, 1});
  hand.begin(stroke({{30, 0, 5}, {30, 20, 8}}, false));
  std::uint64_t tick = 0;
  while (!hand.done() && tick < 3000) (void)hand.read(tick++, kDt, {});
  EXPECT_NEAR(static_cast<double>(tick) * kDt, (30 + std::hypot(20.0, 3.0)) / TraineeHand::kTravelMmS, 0.1);
  for (int n = 0; n < 300; ++n) (void)hand.read(tick++, kDt, {});
  EXPECT_LT(length(hand.position_mm() - Vec3{30, 20, 8}), 0.02);
}

// The force felt while it strokes along a wall, after it has come down.
std::vector<double> forces(double control, std::uint64_t seed) {
  TraineeSkill skill;
  skill.tremor_mm = 0;
  skill.force_n = 2;
  skill.force_control = control;
  TraineeHand hand(skill, seed, nullptr, {}, {0, 0, 1}, {0, 0, 1}, {0, 0, 1});
  std::vector<Vec3> points;
  for (int n = 0; n < 40; ++n) points.push_back({n % 2 == 0 ? 0.0 : 10.0, 0, -5});
  hand.begin(stroke(points, true));
  std::vector<double> all;
  Vec3 felt;
  for (std::uint64_t t = 0; t < 8000 && !hand.done(); ++t) {
    felt = wall(from_floats(hand.read(t, kDt, felt).position_mm));
    if (t > 1000) all.push_back(felt.z);
  }
  return all;
}
TEST(Hand, HoldsItsForce) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    for (const double f : forces(1, seed)) EXPECT_NEAR(f, 2, 0.2);
    double least = 9, most = 0, sum = 0, n = 0;
    for (const double f : forces(0, seed)) {
      least = std::min(least, f);
      most = std::max(most, f);
      sum += f;
      n += 1;
    }
    EXPECT_GT(most - least, 1.5);
    EXPECT_GT(sum / n, 3);
  }
}

// Depth is judged by the burr that is seen, which stays at the bone's surface: until that is deep enough the force is
// the wanted one.
TEST(Hand, PressesUntilTheBurrThatItSeesIsDeepEnough) {
  const auto force_at_end = [](double yields_mm_per_n) {
    TraineeSkill skill;
    skill.tremor_mm = 0;
    skill.force_n = 2;
    TraineeHand hand(skill, 1, nullptr, {}, {0, 0, 1}, {0, 0, 1}, {0, 0, 1});
    hand.sees(yields_mm_per_n);
    std::vector<Vec3> points;
    for (int n = 0; n < 20; ++n) points.push_back({n % 2 == 0 ? 0.0 : 10.0, 0, -0.2});
    hand.begin(stroke(points, true));
    Vec3 felt;
    for (std::uint64_t t = 0; t < 3000; ++t) felt = wall(from_floats(hand.read(t, kDt, felt).position_mm));
    return felt.z;
  };
  EXPECT_NEAR(force_at_end(0.25), 2, 0.1);  // of 4 N/mm: what is seen has not moved
  EXPECT_LT(force_at_end(0), 1);            // the hand itself is 0.2 mm below
}

// The hand's own force follows its control, whether or not the bone gives way now and then.
TEST(Hand, DoesNotPressAfterBoneThatGivesWay) {
  TraineeSkill skill;
  skill.tremor_mm = 0;
  skill.force_n = 2;
  TraineeHand hand(skill, 1, nullptr, {}, {0, 0, 1}, {0, 0, 1}, {0, 0, 1});
  std::vector<Vec3> points;
  for (int n = 0; n < 40; ++n) points.push_back({n % 2 == 0 ? 0.0 : 10.0, 0, -9});
  hand.begin(stroke(points, true));
  Vec3 felt;
  double most = 0, floor = 0;
  for (std::uint64_t t = 0; t < 6000 && !hand.done(); ++t) {
    if (t % 400 == 399) floor -= 0.3;  // a thin wall breaks
    const Vec3 at = from_floats(hand.read(t, kDt, felt).position_mm);
    felt = at.z < floor ? Vec3{0, 0, 4 * (floor - at.z)} : Vec3{};
    most = std::max(most, felt.z);
  }
  EXPECT_LT(most, 2.3);
  EXPECT_GT(most, 1.8);
}

TEST(Hand, TremblesBetweenEightAndTwelveHertz) {
  TraineeSkill skill;
  skill.tremor_mm = 0.3;
  TraineeHand hand(skill, 5, nullptr, {}, {0, 0, 5}, {0, 0, 1}, {0, 0, 1});
  std::vector<double> x;
  for (std::uint64_t t = 0; t < 9000; ++t) {
    const DeviceSample s = hand.read(t, kDt, {});
    if (t >= 1000) x.push_back(s.position_mm[0]);
  }
  double in_band = 0, all = 0, sum = 0;
  for (const double v : x) sum += v / static_cast<double>(x.size());
  for (double hz = 0.5; hz < 40; hz += 0.125) {
    std::complex<double> c;
    for (std::size_t i = 0; i < x.size(); ++i)
      c += (x[i] - sum) * std::polar(1.0, -2 * M_PI * hz * static_cast<double>(i) * kDt);
    all += std::norm(c);
    if (hz > 7.5 && hz < 12.5) in_band += std::norm(c);
  }
  EXPECT_GT(in_band / all, 0.95);
  double square = 0;
  for (const double v : x) square += (v - sum) * (v - sum) / static_cast<double>(x.size());
  EXPECT_NEAR(std::sqrt(square), 0.3, 0.06);
}

// A slab below z = 4.5 with a rod along y at z = 0 (1) and a space of cells beside it (2).
World slab() {
  return test::solid_world(
      [](Vec3 p) {
        return std::min({4.5 - p.z, p.z + 11, 11 - std::abs(p.x), 11 - std::abs(p.y)});
      },
      0.8, 24);
}
const std::shared_ptr<const StructureMap>& rod_and_cells() {
  static const auto map = std::make_shared<const StructureMap>(test::structure_map(
      [](Vec3 p) -> std::uint8_t {
        if (std::hypot(p.x, p.z) < 1.5 && std::abs(p.y) < 10) return 1;
        return length(p - Vec3{6, 0, 0}) < 1.2 ? 2 : 0;
      },
      {{1, "rod", {}}, {2, "cells", {}}}, 0.5, 26));
  return map;
}
const char* const kProcedure =
    "{ \"osteotome_procedure\": 1, \"name\": \"t\", \"structures\": [ {\"name\": \"rod\", \"role\": \"expose\"}, "
    "{\"name\": \"cells\", "
    "\"role\": \"enter\"} ], \"regions\": [ {\"name\": \"to the rod\", \"kind\": \"target\", \"structure\": \"rod\", "
    "\"within_mm\": 1} ],"
    "\"items\": [ {\"name\": \"shown\", \"kind\": \"exposed\", \"structure\": \"rod\", \"towards\": [0, 0, 1], "
    "\"within_deg\": 60,"
    " \"threshold\": 0.1}, {\"name\": \"intact\", \"kind\": \"not_violated\", \"structure\": \"rod\"} ] }";

TEST(Plan, GoesDownToTheStructureAndStopsBeforeIt) {
  const World world = slab();
  const Procedure procedure = parse_procedure(kProcedure, "t.json");
  const WorkPlan plan = plan_work(world, *rod_and_cells(), procedure, {}, 1);
  EXPECT_GT(dot(plan.toward, Vec3{0, 0, 1}), 0.99);
  EXPECT_NEAR(plan.centre_mm.z, 4.5, 0.6);
  EXPECT_LT(std::abs(plan.centre_mm.x), 3);  // above the rod
  double lowest = 99;
  for (const TraineeStroke& s : plan.strokes) {
    const double radius = instrument_library()[s.tool].head.largest_radius_mm();
    for (const auto& p : s.points) lowest = std::min(lowest, std::hypot(p.at_mm.x, p.at_mm.z) - 1.5 - radius);
  }
  EXPECT_NEAR(lowest, kept_mm(ProcedureRole::expose), 0.4);
  TraineeSkill lost;
  lost.region = 0;
  WorkPlanOptions narrow;
  narrow.radius_mm = 2;
  const WorkPlan beside = plan_work(world, *rod_and_cells(), procedure, lost, 1, narrow);
  EXPECT_NEAR(length(beside.shifted_mm), 7, 1e-9);
}

// How far from the middle, across, the burr goes: in the first layer, and farthest of all.
std::pair<double, double> widths(double undercut) {
  const World deep = test::solid_world(
      [](Vec3 p) {
        return std::min({12.0 - p.z, p.z + 11, 11 - std::abs(p.x), 11 - std::abs(p.y)});
      },
      0.8, 26);
  TraineeSkill skill;
  skill.undercut = undercut;
  const WorkPlan plan = plan_work(deep, *rod_and_cells(), parse_procedure(kProcedure, "t.json"), skill, 1);
  double first = 0, all = 0;
  for (const TraineeStroke& s : plan.strokes) {
    for (const auto& p : s.points) {
      const Vec3 off = p.at_mm - plan.centre_mm;
      const double across = length(off - plan.toward * dot(off, plan.toward));
      all = std::max(all, across);
      if (s.layer == 0) first = std::max(first, across);
    }
  }
  return {first, all};
}
TEST(Plan, UndercuttingDrawsTheOpeningTogetherAndLeavesTheWindowBelow) {
  const auto [none, none_all] = widths(0);
  double before = none;
  for (const double undercut : {0.25, 0.5, 0.75, 1.0}) {
    const auto [open, all] = widths(undercut);
    EXPECT_NEAR(open, none * (1 - 0.7 * undercut), 0.05);
    EXPECT_LT(open, before);
    EXPECT_NEAR(all, none_all, 1e-9);
    before = open;
  }
}

TEST(Plan, SaysWhatItLacks) {
  const World world = slab();
  const auto refused = [&](const char* from, const char* to) {
    std::string text = kProcedure;
    text.replace(text.find(from), std::string(from).size(), to);
    try {
      (void)plan_work(world, *rod_and_cells(), parse_procedure(text, "t.json"), {}, 1);
    } catch (const Error& e) {
      return std::string(e.what());
    }
    return std::string("nothing");
  };
  EXPECT_NE(refused("\"kind\": \"target\"", "\"kind\": \"forbidden\"").find("no target region"), std::string::npos);
  EXPECT_NE(refused("\"towards\": [0, 0, 1], ", "").find("from where"), std::string::npos);
  WorkPlanOptions shallow;
  shallow.most_depth_mm = 1;
  try {
    (void)plan_work(world, *rod_and_cells(), parse_procedure(kProcedure, "t.json"), {}, 1, shallow);
    FAIL();
  } catch (const Error& e) {
    EXPECT_NE(std::string(e.what()).find("within 1 mm"), std::string::npos) << e.what();
  }
}

TEST(Truth, BallsOnAPlainFace) {
  // Balls of 2 mm in a row above the rod: the nearest 0.5 mm off its face, or into it.
  const Procedure procedure = parse_procedure(kProcedure, "t.json");
  for (const double gap : {0.5, -0.5}) {
    std::vector<SweptBall> swept;
    for (double y = -9; y <= 9; y += 0.5) swept.push_back({{0, y, 1.5 + 2 + gap}, 2});
    const auto truth = own_truth(procedure, *rod_and_cells(), swept);
    ASSERT_EQ(truth.size(), 2U);
    EXPECT_TRUE(truth[0].pass) << truth[0].value;
    EXPECT_EQ(truth[1].pass, gap > 0) << truth[1].value;
  }
  EXPECT_FALSE(own_truth(procedure, *rod_and_cells(), {})[0].pass);
}

SimulatedSession session(const TraineeSkill& skill, std::uint64_t seed, const std::filesystem::path& folder,
                         double most_s = 12) {
  std::filesystem::create_directories(folder);
  TraineeScene scene;
  scene.procedure = parse_procedure(kProcedure, "t.json");
  scene.haptics.device = SpringHand::traits();
  scene.anatomy.structures = rod_and_cells();
  scene.haptics.structures = rod_and_cells()->hash();
  TraineeOptions o;
  o.skill = skill;
  o.seed = seed;
  o.most_s = most_s;
  o.plan.radius_mm = 2;
  return simulate_trainee(scene, slab(), o, {folder, {}, {}});
}

TEST(Session, IsTheSameForTheSameSeedAndSaysThatItIsSimulated) {
  const test::ScratchFolder scratch;
  TraineeSkill skill;
  skill.tremor_mm = 0.2;
  const SimulatedSession a = session(skill, 4, scratch / "a"), b = session(skill, 4, scratch / "b"),
                         c = session(skill, 5, scratch / "c");
  EXPECT_GT(a.summary.removed_mm3, 20);
  EXPECT_EQ(a.summary.bone_hash, b.summary.bone_hash);
  EXPECT_NE(a.summary.bone_hash, c.summary.bone_hash);
  const SessionReader reader(scratch / "a" / "stream.oss");
  EXPECT_NE(simulated_text(reader), "");
  const Session recorded = read_session(scratch / "a" / "stream.oss");
  EXPECT_EQ(recorded.notes.front().kind, kSimulatedNote);
  EXPECT_TRUE(
      std::any_of(recorded.notes.begin(), recorded.notes.end(), [](const Note& n) { return n.kind == "camera"; }));
  const ReplayResult again = replay(reader, slab(), {nullptr, nullptr, rod_and_cells()}, {});
  EXPECT_TRUE(again.identical) << again.difference;
}

// One skill at a time, the rest an expert's: what it acts on follows it.
TEST(Session, ForceFollowsItsControl) {
  const test::ScratchFolder scratch;
  double before = 1e9;
  for (const double control : {0.0, 0.5, 1.0}) {
    TraineeSkill skill;
    skill.force_control = control;
    const auto folder = scratch / ("c" + std::to_string(control));
    static_cast<void>(session(skill, 4, folder, 5));
    std::vector<double> force;
    for (const TickRecord& t : read_session(folder / "stream.oss").ticks)
      if (t.normal_force_n > 0 && t.speed_rpm > 1000) force.push_back(static_cast<double>(t.normal_force_n));
    ASSERT_GT(force.size(), 1000U);
    std::sort(force.begin(), force.end());
    const double p95 = force[force.size() * 95 / 100];
    EXPECT_LT(p95, 0.85 * before) << control;
    before = p95;
  }
}

TEST(Session, WhoDoesNotKnowTheStructureReachesIt) {
  const test::ScratchFolder scratch;
  for (const double knowledge : {0.0, 1.0}) {
    TraineeSkill skill;
    skill.knowledge = knowledge;
    skill.force_n = 3;
    const SimulatedSession done = session(skill, 4, scratch / ("k" + std::to_string(knowledge)), 40);
    ASSERT_EQ(done.truth.size(), 2U);
    EXPECT_EQ(done.truth[1].pass, knowledge > 0) << done.truth[1].value;
    EXPECT_TRUE(done.truth[0].pass || knowledge > 0) << done.truth[0].value;
  }
}

}  // namespace
}  // namespace osteo
