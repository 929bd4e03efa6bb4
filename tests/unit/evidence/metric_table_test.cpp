// Each metric of the table on a session of which its value is known by hand, with one hand and with two. A metric
// without a row here fails.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include "metric_session.h"
#include "osteo/assessment/evidence/score.h"
#include "osteo/assessment/evidence/timeline.h"
#include "osteo/assessment/scoring/hint_reader.h"
#include "scratch.h"

namespace osteo {
namespace {

using test::MetricSession;
using test::Second;

// With the rules that each metric needs. The nerve was reached: the first item fails, the second passes.
const Procedure& procedure() {
  static const Procedure p = parse_procedure(
      R"({"osteotome_procedure": 1, "name": "t", "structures": [{"name": "nerve", "role": "keep"}],
 "force_limits": [{"structure": "nerve", "within_mm": 2, "most_n": 1}],
 "instruments": [{"structure": "nerve", "within_mm": 8, "diamond_only": true}],
 "regions": [{"name": "near", "kind": "target", "structure": "nerve", "within_mm": 4},
             {"name": "next", "kind": "forbidden", "structure": "nerve", "within_mm": 2}],
 "items": [{"name": "whole", "kind": "not_violated", "structure": "nerve"},
           {"name": "one", "kind": "pieces", "threshold": 1, "most": 1}],
 "steps": [{"name": "all", "items": ["whole", "one"]}]})",
      "t.json");
  return p;
}

// An expert who pressed with 0.75 N at 5 mm/s everywhere and took one voxel of this session and one that it left; a
// novice took another.
Reference reference() {
  const World bone = test::metric_bone();
  const VoxelKey here = test::metric_voxel(bone, {3.25, 0.25, 0.25}),
                 left = test::metric_voxel(bone, {0.25, 0.25, 0.25}),
                 other = test::metric_voxel(bone, {0.25, 0.25, 1.25});
  Reference r;
  r.sessions.push_back({"E", ReferenceGroup::expert, {std::min(here, left), std::max(here, left)}, {}});
  r.sessions.back().near[1].assign(200, {0, {}, 0, 0.75F, 5});
  r.sessions.push_back({"N", ReferenceGroup::novice, {other}, {}});
  return r;
}

struct Row {
  const char* name;
  double one, two;  // the second hand drills as well
  double off = 1e-6;
};
const double kMoreThan5MmS = 1 / std::sqrt(3.0);  // of a minimum-jerk reach of 6 mm in a second
constexpr double kFrame = 0.1;                    // volumes are known to it
// A hole of one voxel is too narrow for the ball of 0.5 mm that makes a cavity; of the pit the floor's edges are left.
constexpr double kPit = 18, kSawn = 256, kVoxel = 0.125;

const Row kRows[] = {
    {"duration_s", 19.7, 19.7},
    {"lost_s", 0.3, 0.3},
    {"drilling_s", 8, 10},
    {"idle_s", 3.2, 3.2, 0.064},  // 2 %
    {"removed_mm3", 20, 25, 1e-4},
    {"sawn_mm3", kSawn, kSawn, 1e-3},
    {"rate_mm3_per_s", 2.5, 2.5, 1e-5},
    {"path_mm", 89.65, 89.65, 0.9},
    {"work_mj", 3, 3, 0.02},
    {"instrument_s[cutting 2 mm]", 16, 16},
    {"instrument_s[diamond 2 mm]", 2, 2},
    {"instrument_s[probe 1 mm]", 1.7, 1.7},
    {"instrument_mm3[cutting 2 mm]", 15, 15, 1e-4},
    {"instrument_mm3[diamond 2 mm]", 5, 5, 1e-4},
    {"instrument_mm3[cutting 4 mm]", NAN, 5, 1e-4},
    {"camera_moves", 2, 2},
    {"camera_s", 0.3, 0.3},
    {"force_median_n", 0.5, 0.5},
    {"force_p95_n", 1, 1},
    {"force_peak_n", 3, 3},
    {"suction_share", 4.0 / 8, 4.0 / 10},
    {"irrigation_share", 2.0 / 8, 2.0 / 10},
    {"burr_side_share", 4.0 / 8, 4.0 / 10},
    {"strokes", 8, 8},
    {"strokes_per_s", 8.0 / 8, 8.0 / 10},
    {"stroke_mm", 6, 6, 0.1},
    {"stroke_s", 1, 1, 0.03},
    {"stroke_variance", (0.2 + 0.4 + 0.4 + 0.2) / 4, (0.2 + 0.4 + 0.4 + 0.2) / 4, 0.01},
    {"stroke_sparc", -1.4058, -1.4058, 0.03},  // Balasubramanian's, of a minimum-jerk reach
    {"stroke_ldlj", -5.224, -5.224, 0.3},
    // Fifths of 20 mm3 are 1.6 s of drilling, of 25 mm3 2 s.
    {"phase_s[fifth 1]", 4.6, 5, kFrame + 1e-6},
    {"phase_s[fifth 2]", 2.6, 3, kFrame + 1e-6},
    {"phase_s[fifth 3]", 2.6, 3, kFrame + 1e-6},
    {"phase_s[fifth 4]", 2.6, 3, kFrame + 1e-6},
    {"phase_s[fifth 5]", 1.6, 4, kFrame + 1e-6},
    {"step_s[all]", 11, 11},
    {"seen_share", kPit / (kPit + 6 * kVoxel), kPit / (kPit + 6 * kVoxel)},
    {"hidden_mm3", 6 * kVoxel, 6 * kVoxel},
    {"sight_unknown_mm3", 2 * kVoxel, 2 * kVoxel},
    {"hidden_near_mm3[nerve]", 2 * kVoxel, 2 * kVoxel},
    {"clearance_mm[nerve]", -0.5, -0.5, 0.1},
    {"touches[nerve]", 3, 3},
    {"touched_s[nerve]", 0.28 + 0.28 + 0.18, 0.28 + 0.28 + 0.18, 0.05},
    {"injured_s[nerve]", 0.18, 0.18, 0.02},
    // Balls of 1 and 2 mm whose centres are 2.5 mm apart have pi / 4 * 18.25 / 30 of a mm3 in common.
    {"cut_mm3[nerve]", std::numbers::pi / 4 * 18.25 / 30, std::numbers::pi / 4 * 18.25 / 30, 0.05},
    // 5 mm away is too far to be told here: Sessions.ASawThroughAStructureIsTold has its value by hand.
    {"saw_clearance_mm[nerve]", NAN, NAN},
    {"near_05_s[nerve]", 2, 2},
    {"near_1_s[nerve]", 4, 4},
    {"near_s[nerve]", 6, 6},
    {"near_4_s[nerve]", 8, 8},
    {"near_05_mm3[nerve]", 5, 5, 1e-4},
    {"near_1_mm3[nerve]", 10, 10, 1e-4},
    {"near_mm3[nerve]", 15, 15, 1e-4},
    {"near_4_mm3[nerve]", 20, 20, 1e-4},
    {"excess_force_ns[nerve]", 0.080 * (3 - 1), 0.080 * (3 - 1)},
    {"burr_choice_share", 2.0 / 8, 2.0 / 8},
    {"target_share[near]", 2 * kVoxel / (4.0 / 3 * std::numbers::pi * 216),
     2 * kVoxel / (4.0 / 3 * std::numbers::pi * 216), 2e-5},
    {"forbidden_mm3[next]", 2 * kVoxel, 2 * kVoxel},
    {"outside_target_mm3", kSawn + kPit + 6 * kVoxel, kSawn + kPit + 6 * kVoxel, 1e-3},
    {"cavity_mm3", kSawn + kPit, kSawn + kPit, 4},
    {"items_passed", 1, 1},
    {"heat_bone_c", 37, 37},
    {"heat_peak_c[nerve]", 37, 37},
    {"heat_cem43_min[nerve]", 0, 0},
    // Of cases with planned cuts: PlannedSawing.* have their values by hand.
    {"plan_off_mm[cut]", NAN, NAN},
    {"plan_angle_deg[cut]", NAN, NAN},
    {"plan_voxels[cut]", NAN, NAN},
    {"force_above_band_share[nerve]", (200.0 + 8) / 800, (200.0 + 8) / 800},
    {"speed_above_band_share[nerve]", kMoreThan5MmS, kMoreThan5MmS, 0.02},
    {"region_log_ratio", std::log(2), std::log(2)},
    {"region_per_voxel", std::log(2) / 3, std::log(2) / 3},
    {"region_voxels", 3, 3},
    {"region_thesis", std::log(2), std::log(2)},
};

struct Result {
  Score score;
  Timeline timeline;
};
// With the heat of burrs that turn and press on nothing.
Result result_of(Second second) {
  const test::ScratchFolder scratch;
  MetricSession::write(scratch / "s.oss", second);
  const SessionReader session(scratch / "s.oss");
  const Reference experts = reference();
  TimelineKeeper keeper({MetricSession::kHz, test::metric_nerve().get(), nullptr});
  ScoreDetail detail;
  detail.frame = [&](const EvidenceFrame& f) { keeper.frame(f); };
  Result r{
      score_session(session, test::metric_bone(), test::metric_nerve().get(), &procedure(), &experts, {}, {}, &detail),
      keeper.timeline({})};
  HeatReader heat(test::metric_bone(), test::metric_nerve().get(), MetricSession::kHz);
  for (TickRecord t; t.tick < 500; ++t.tick) {
    t.speed_rpm = 20'000;
    t.device.position_mm = {0, 0, 9};
    for (t.hand = 0; t.hand < (second == Second::none ? 1U : 2U); ++t.hand) heat.tick(t, {});
  }
  for (Measured& m : heat_values(heat, test::metric_nerve().get())) r.score.values.push_back(std::move(m));
  return r;
}
const Result& result(Second second) {
  static std::map<Second, Result> all;
  const auto at = all.find(second);
  return at != all.end() ? at->second : all.emplace(second, result_of(second)).first->second;
}

std::string without_of(const std::string& name) {
  return name.substr(0, name.find('['));
}
void expect_rows(const Score& score, double Row::*wanted) {
  std::map<std::string, const Measured*> by_name;
  for (const Measured& m : score.values)
    EXPECT_TRUE(by_name.emplace(m.name(), &m).second) << m.name() << " is there twice";
  std::set<std::string> expected;
  for (const Row& row : kRows) {
    if (std::isnan(row.*wanted)) continue;
    expected.insert(row.name);
    const auto m = by_name.find(row.name);
    if (m == by_name.end() || !m->second->value) {
      ADD_FAILURE() << row.name << " has no value" << (m == by_name.end() ? "" : ": " + m->second->word);
    } else {
      EXPECT_NEAR(*m->second->value, row.*wanted, row.off) << row.name;
    }
  }
  for (const auto& [name, m] : by_name) EXPECT_TRUE(expected.contains(name)) << name << " has no row in this test";
}

TEST(MetricTable, EachMetricHasItsRowHere) {
  std::set<std::string> here, declared;
  for (const Row& row : kRows) here.insert(without_of(row.name));
  for (const MetricRow& row : metric_table()) {
    EXPECT_TRUE(declared.insert(std::string(row.name)).second) << row.name << " is declared twice";
    EXPECT_TRUE(here.contains(std::string(row.name))) << row.name << " has no value by hand in this test";
    EXPECT_FALSE(row.help.empty()) << row.name;
    EXPECT_FALSE(row.source.empty()) << row.name;
  }
  EXPECT_EQ(here, declared);
}

TEST(MetricTable, OneHand) {
  expect_rows(result(Second::none).score, &Row::one);
}

TEST(MetricTable, ASecondBurrFarAwayAddsItsOwnWorkAndNothingElse) {
  expect_rows(result(Second::cutting).score, &Row::two);
}

// A hand that does nothing changes nothing: values to the bit, moments and events.
TEST(MetricTable, ASecondBurrThatRestsChangesNoMetricNoMomentAndNoEvent) {
  const Result &one = result(Second::none), &two = result(Second::resting);
  ASSERT_EQ(one.score.values.size(), two.score.values.size());
  for (std::size_t n = 0; n < one.score.values.size(); ++n) {
    EXPECT_EQ(one.score.values[n].name(), two.score.values[n].name());
    EXPECT_EQ(one.score.values[n].value, two.score.values[n].value) << one.score.values[n].name();
  }
  const auto reported = [](const Score& s) {
    std::vector<std::string> all;
    for (const Moment& m : s.moments) all.push_back(std::to_string(m.t_s) + " " + m.what);
    return all;
  };
  EXPECT_EQ(reported(one.score), reported(two.score));
  EXPECT_EQ(timeline_json(one.timeline).dump(), timeline_json(two.timeline).dump());
}

TEST(MetricTable, AnInjuryIsOneMomentAndContactsASecondApartAreEvents) {
  for (const Second second : {Second::none, Second::resting, Second::cutting}) {
    const Result& r = result(second);
    const auto moments = [&](const std::string& what) {
      return std::count_if(r.score.moments.begin(), r.score.moments.end(),
                           [&](const Moment& m) { return m.what == what; });
    };
    EXPECT_EQ(moments("reached by a rotating burr"), 1);
    EXPECT_EQ(moments("pressed too hard near it"), 1);
    std::vector<double> touches_s, injuries_s;
    for (const TimelineEvent& e : r.timeline.events) {
      if (e.kind == EventKind::touch) touches_s.push_back(e.t_s);
      if (e.kind == EventKind::injury) injuries_s.push_back(e.t_s);
    }
    ASSERT_EQ(touches_s.size(), 2U);
    EXPECT_NEAR(touches_s[0], 14.66, 0.02);
    EXPECT_NEAR(touches_s[1], 15.66, 0.02);
    ASSERT_EQ(injuries_s.size(), 1U);
    EXPECT_NEAR(injuries_s[0], 16.66, 0.02);
  }
}

const Measured* find(const Score& score, const std::string& name) {
  const auto at =
      std::find_if(score.values.begin(), score.values.end(), [&](const Measured& m) { return m.name() == name; });
  return at == score.values.end() ? nullptr : &*at;
}

// The first of three contacts is recorded but for 20 ms of it: what the hand did there is not known, so what follows is
// a contact of its own. The same 20 ms in the air change nothing.
TEST(MetricTable, AContactDoesNotGoOnThroughWhatIsNotRecorded) {
  for (const auto& [lost_from, touches] : {std::pair<std::uint64_t, double>{14'760, 4}, {15'250, 3}}) {
    const test::ScratchFolder scratch;
    MetricSession::write(scratch / "s.oss", Second::none, lost_from, lost_from + 20);
    const Score score = score_session(SessionReader(scratch / "s.oss"), test::metric_bone(), test::metric_nerve().get(),
                                      &procedure(), nullptr, {});
    ASSERT_NE(find(score, "touches[nerve]"), nullptr);
    EXPECT_EQ(find(score, "touches[nerve]")->value, touches) << lost_from;
    EXPECT_NEAR(find(score, "lost_s")->value.value_or(0), 0.02, 1e-9);
  }
}

// Bands of experts want a second of theirs: 100 samples, no fewer.
TEST(MetricTable, BandsWantASecondOfTheExperts) {
  const test::ScratchFolder scratch;
  MetricSession::write(scratch / "s.oss", Second::none);
  for (const std::size_t samples : {99U, 100U}) {
    Reference experts = reference();
    experts.sessions.front().near[1].resize(samples);
    const Score score = score_session(SessionReader(scratch / "s.oss"), test::metric_bone(), test::metric_nerve().get(),
                                      &procedure(), &experts, {});
    const Measured* const share = find(score, "force_above_band_share[nerve]");
    ASSERT_NE(share, nullptr);
    EXPECT_EQ(share->value.has_value(), samples == 100) << samples;
  }
}

// Experts press with 0.75 N. Harder next to the nerve, for 80 ms, is one moment; harder 3 mm from it is none.
TEST(MetricTable, HarderThanExpertsNextToAStructureIsAMoment) {
  const test::ScratchFolder scratch;
  MetricSession::write(scratch / "s.oss", Second::none);
  const Reference experts = reference();
  const Score score = score_session(SessionReader(scratch / "s.oss"), test::metric_bone(), test::metric_nerve().get(),
                                    &procedure(), &experts, {});
  std::vector<Moment> harder;
  for (const Moment& m : score.moments)
    if (m.what == "pressed harder than experts do there") harder.push_back(m);
  ASSERT_EQ(harder.size(), 1U);
  EXPECT_NEAR(harder[0].t_s, 10, 0.02);
  EXPECT_EQ(harder[0].structure, "nerve");
  EXPECT_NEAR(harder[0].value, 3, 1e-6);
  EXPECT_NEAR(harder[0].limit, 0.75, 1e-6);
}

// Where nothing is known of how fast experts went, nobody was faster; how hard they pressed is known all the same.
TEST(MetricTable, ABandOfSpeedsWantsSpeeds) {
  const test::ScratchFolder scratch;
  MetricSession::write(scratch / "s.oss", Second::none);
  Reference experts = reference();
  for (NearMetric::Sample& s : experts.sessions.front().near[1]) s.speed_mm_s = NAN;
  const Score score = score_session(SessionReader(scratch / "s.oss"), test::metric_bone(), test::metric_nerve().get(),
                                    &procedure(), &experts, {});
  ASSERT_NE(find(score, "force_above_band_share[nerve]"), nullptr);
  EXPECT_TRUE(find(score, "force_above_band_share[nerve]")->value);
  ASSERT_NE(find(score, "speed_above_band_share[nerve]"), nullptr);
  EXPECT_FALSE(find(score, "speed_above_band_share[nerve]")->value);
  EXPECT_EQ(find(score, "speed_above_band_share[nerve]")->word, "no drilling near it is long enough for a speed");
}

}  // namespace
}  // namespace osteo
