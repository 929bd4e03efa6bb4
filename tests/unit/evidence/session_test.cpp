// Whole sessions: live and from the file the same bits, and the hard cases with a word each.
#include <gtest/gtest.h>

#include <filesystem>

#include "hole_script.h"
#include "osteo/assessment/evidence/findings.h"
#include "osteo/assessment/evidence/score.h"
#include "osteo/assessment/scoring/detail/score_reader.h"
#include "osteo/core/base/csv.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/session/recording/session_reader.h"
#include "osteo/session/scene/rehearsal.h"
#include "osteo/session/scene/session_folder.h"
#include "osteo/simulation/bone/instrument.h"
#include "scene.h"
#include "scratch.h"

namespace osteo {
namespace {

// A slab below z = 4, with a rod along y in it (1).
double slab(Vec3 p) {
  return std::min({4 - p.z, p.z + 6, 11 - std::abs(p.x), 11 - std::abs(p.y)});
}
const std::shared_ptr<const StructureMap>& rod() {
  static const auto map = std::make_shared<const StructureMap>(test::structure_map(
      [](Vec3 p) -> std::uint8_t { return std::hypot(p.x, p.z - 1) < 1 && std::abs(p.y) < 8 ? 1 : 0; },
      {{1, "rod", {}}}, 0.4, 24));
  return map;
}
World block() {
  return test::solid_world(slab, 0.5, 24);
}
SceneAction at(std::uint64_t tick, SceneAction a) {
  a.tick = tick;
  return a;
}
RehearsalOptions options(const std::filesystem::path& file) {
  RehearsalOptions o;
  o.session_file = file;
  o.haptics.device = SpringHand::traits();
  o.anatomy.structures = rod();
  o.haptics.structures = rod()->hash();
  return o;
}
const char* const kCamera =
    "{\"eye_mm\":[0,-20,200],\"target_mm\":[0,0,4],\"up\":[0,1,0],\"view_angle_deg\":30,\"pixels_per_mm\":10}";
const char* const kProcedure =
    "{ \"osteotome_procedure\": 1, \"name\": \"t\", \"structures\": [ {\"name\": \"rod\", \"role\": \"keep\"} ],"
    "\"force_limits\": [ {\"structure\": \"rod\", \"within_mm\": 8, \"most_n\": 0.01} ],"
    "\"instruments\": [ {\"structure\": \"rod\", \"within_mm\": 8, \"diamond_only\": true} ],"
    "\"regions\": [ {\"name\": \"r\", \"kind\": \"target\", \"structure\": \"rod\", \"within_mm\": 4} ],"
    "\"items\": [ {\"name\": \"whole\", \"kind\": \"not_violated\", \"structure\": \"rod\"}, {\"name\": \"one\", "
    "\"kind\": \"pieces\", "
    "\"threshold\": 1, \"most\": 1} ],"
    "\"steps\": [ {\"name\": \"all\", \"items\": [\"whole\", \"one\"]} ] }";

const Measured* find(const std::vector<Measured>& values, const std::string& name) {
  for (const Measured& m : values) {
    if (m.name() == name) return &m;
  }
  return nullptr;
}
double value(const std::vector<Measured>& values, const std::string& name) {
  const Measured* const m = find(values, name);
  EXPECT_NE(m, nullptr) << name;
  return m == nullptr || !m->value ? -1e9 : *m->value;
}
bool says(const Score& s, const std::string& what) {
  return std::any_of(s.words.begin(), s.words.end(),
                     [&](const std::string& w) { return w.find(what) != std::string::npos; });
}
Score score(const std::filesystem::path& file, const Procedure* procedure = nullptr,
            const Reference* reference = nullptr, const std::string& subject = {}) {
  return score_session(SessionReader(file, Damage::keep), block(), rod().get(), procedure, reference, subject);
}
RehearsalSummary record(const std::filesystem::path& file, int count, std::vector<SceneAction> actions = {},
                        bool camera = true, ScoreReader* live = nullptr) {
  RehearsalOptions o = options(file);
  o.actions = std::move(actions);
  Rehearsal r(block(), std::make_unique<ScriptedDevice>(test::holes(count, -6, 4.2), 1000), o, {});
  if (camera) r.note("camera", kCamera);
  if (live != nullptr) r.add_reader(*live);
  RehearsalSummary s = r.run_to_end({});
  if (live != nullptr) {
    live->end();
    r.remove_reader(*live);
  }
  return s;
}

TEST(Sessions, LiveAndFromTheFileAreTheSameBits) {
  const test::ScratchFolder scratch;
  const EvidenceScene scene{1000, rod().get(), nullptr};
  const World world = block();
  ScoreReader live(world, scene);
  live.camera({0, {0, -20, 200}, {0, 0, 4}});
  const RehearsalSummary s =
      record(scratch / "s.oss", 3,
             {at(1200, SceneAction::saw({{3, 0, 0}, {1, 0, 0}, {0, 0, 1}, 1})), at(1300, SceneAction::split(5)),
              at(1800, SceneAction::plain(ActionKind::undo)), at(1900, SceneAction::plain(ActionKind::undo))},
             true, &live);
  const Score file = score(scratch / "s.oss");
  EXPECT_EQ(live.resyncs(), 0U);
  ASSERT_GT(live.keeper().values().size(), 20U);
  for (std::size_t n = 0; n < live.keeper().values().size(); ++n) {
    const Measured &a = live.keeper().values()[n], &b = file.values[n];
    EXPECT_EQ(a.name(), b.name());
    EXPECT_EQ(a.value, b.value) << a.name();  // to the bit
    EXPECT_EQ(a.word, b.word);
  }
  // One stepping: the scene that frames leave is that of a replay of the file's changes.
  World applied = block();
  apply_recorded(SessionReader(scratch / "s.oss"), applied);
  EXPECT_EQ(report_frames(SessionReader(scratch / "s.oss"), block(), [](const EvidenceFrame&) {}).hash(),
            applied.hash());
  EXPECT_NEAR(value(file.values, "removed_mm3"), s.removed_mm3, 1e-3);
  EXPECT_NEAR(value(file.values, "sawn_mm3"), s.sawn_mm3, 1e-3);
  EXPECT_GT(value(file.values, "seen_share"), 0.5);
  EXPECT_NEAR(value(file.values, "clearance_mm[rod]"), s.structures.at(1).least_clearance_mm, 1e-5);
  EXPECT_EQ(value(file.values, "touched_s[rod]"), static_cast<double>(s.structures.at(1).ticks_touched) / 1000);
  EXPECT_EQ(value(file.values, "injured_s[rod]"), static_cast<double>(s.structures.at(1).ticks_injured) / 1000);
}

// The nerve cut through by a plane was told as "no structure was touched".
TEST(Sessions, ASawThroughAStructureIsTold) {
  const test::ScratchFolder scratch;
  const auto reported = [&](const std::string& name, const SawCut& cut, const SceneAction& then) {
    const std::vector<SceneAction> actions{at(100, SceneAction::saw(cut)), at(200, then)};
    const RehearsalSummary summary = record(scratch / name, 1, actions);
    return std::pair(summary, score(scratch / name));
  };
  const Procedure p = parse_procedure(kProcedure, "t.json");
  // Straight through the rod, at y 3; it was cut, though that is taken back.
  const auto [through, cut] =
      reported("through", {{0, 3, 0}, {0, 1, 0}, {1, 0, 0}, 0.8}, SceneAction::plain(ActionKind::undo));
  // As its labels of 0.4 mm have it: sixteen voxels across.
  EXPECT_NEAR(value(cut.values, "cut_mm3[rod]") / (16 * 0.4 * 0.4 * 0.8), 1, 0.15);
  const Findings serious = findings_of(cut, rod().get(), nullptr);
  ASSERT_NE(serious.find("cut-rod"), nullptr);
  EXPECT_EQ(serious.find("cut-rod")->severity, FindingSeverity::serious);
  EXPECT_EQ(serious.find("cut-rod")->text.find("The saw cut through the rod: 1."), 0U) << serious.find("cut-rod")->text;
  EXPECT_EQ(serious.find("cut-rod")->times_s, std::vector<double>{0.1});
  EXPECT_LT(length(*serious.find("cut-rod")->at_mm - Vec3{0, 3, 1}), 0.2);
  EXPECT_EQ(serious.find("untouched"), nullptr);
  ASSERT_EQ(through.structure_cuts.size(), 1U);
  EXPECT_EQ(through.structure_cuts[0].tick, 100U);
  EXPECT_NEAR(through.structure_cuts[0].cut.mm3, value(cut.values, "cut_mm3[rod]"), 1e-9) << "live as from the file";
  // An item that asks for it whole has failed, though no bone of it is gone.
  EXPECT_FALSE(score(scratch / "through", &p).items.at(0).pass);
  // Beside it: half a millimetre of the rod, 0.7 of its labels; and then one through the air, which is none.
  const auto [beside, missed] = reported("beside", {{1.9, 0, 0}, {1, 0, 0}, {0, 1, 0}, 0.8},
                                         SceneAction::saw({{0, 30, 0}, {0, 1, 0}, {1, 0, 0}, 0.8}));
  EXPECT_TRUE(beside.structure_cuts.empty());
  EXPECT_EQ(value(missed.values, "cut_mm3[rod]"), 0);
  EXPECT_NEAR(value(missed.values, "saw_clearance_mm[rod]"), 0.7, 0.15);
  const Findings good = findings_of(missed, rod().get(), nullptr);
  EXPECT_EQ(good.find("cut-rod"), nullptr);
  ASSERT_NE(good.find("untouched"), nullptr);
  EXPECT_NE(good.find("untouched")->text.find("The saw's cuts passed the rod at 0."), std::string::npos)
      << good.find("untouched")->text;
}

// A burr that drills into a structure: one volume, in the summary, in the score and in the words.
TEST(Sessions, WhatABurrTakesOfAStructureIsOneNumber) {
  const test::ScratchFolder scratch;
  Script down;
  down.tool = burr_index(BurrKind::cutting, 2);
  down.waypoints = {{0, {0, 0, 8}, true}, {0.2, {0, 0, 5}, true}, {3.5, {0, 0, 0.5}, true}, {3.7, {0, 0, 8}, false}};
  Rehearsal r(block(), std::make_unique<ScriptedDevice>(down, 1000), options(scratch / "s.oss"), {});
  const RehearsalSummary summary = r.run_to_end({});
  ASSERT_EQ(summary.structure_cuts.size(), 1U) << summary.structures.at(1).least_clearance_mm;
  const StructureCutEvent& e = summary.structure_cuts[0];
  EXPECT_EQ(e.by, CutBy::burr);
  EXPECT_GT(e.cut.mm3, 0.03);
  EXPECT_GT(summary.structures.at(1).ticks_injured, 0U);
  const Score s = score(scratch / "s.oss");
  EXPECT_NEAR(value(s.values, "cut_mm3[rod]"), e.cut.mm3, 1e-9);
  const Findings reported = findings_of(s, rod().get(), nullptr);
  ASSERT_NE(reported.find("injury-rod"), nullptr);
  EXPECT_NE(reported.find("injury-rod")->text.find(" in all, and took "), std::string::npos)
      << reported.find("injury-rod")->text;
  EXPECT_EQ(reported.find("cut-rod"), nullptr);
  SessionFolder folder;
  folder.folder = scratch.path();
  RehearsalOptions o = options({});
  EXPECT_NE(write_summary(folder, summary, 1000, "burr", o.anatomy).find("\"by\": \"burr\""), std::string::npos);
}

// The saw takes 220 mm3 and leaves a slice of 110 mm3 at the edge, which goes as a crumb: no saw took that.
TEST(Sessions, CrumbsAreNotSawnInTheSummaryNorInTheScore) {
  const test::ScratchFolder scratch;
  const RehearsalSummary s =
      record(scratch / "s.oss", 1,
             {at(200, SceneAction::saw({{10, 0, 0}, {1, 0, 0}, {0, 0, 1}, 1})), at(400, SceneAction::split(150)),
              at(500, SceneAction::saw({{-9, 0, 0}, {1, 0, 0}, {0, 0, 1}, 0.5}))});
  EXPECT_NEAR(s.sawn_mm3, 220 + 110, 3);
  EXPECT_NEAR(s.crumbs_mm3, 110, 3);
  EXPECT_NEAR(value(score(scratch / "s.oss").values, "sawn_mm3"), s.sawn_mm3, 1e-3);
}

TEST(Sessions, UndoTakesBackWhatWasRemoved) {
  const test::ScratchFolder scratch;
  record(scratch / "all.oss", 1);
  record(scratch / "back.oss", 1, {at(990, SceneAction::plain(ActionKind::undo))});
  const Procedure p = parse_procedure(kProcedure, "t.json");
  const Score all = score(scratch / "all.oss", &p), back = score(scratch / "back.oss", &p);
  EXPECT_FALSE(says(all, "nothing was removed"));
  EXPECT_EQ(value(back.values, "cavity_mm3"), 0);
  EXPECT_GT(value(back.values, "removed_mm3"), 0);  // work was done all the same
  EXPECT_TRUE(says(back, "all that was removed was taken back"));
  EXPECT_FALSE(says(back, "nothing was removed"));
  EXPECT_TRUE(says(back, "a step was taken back"));
  EXPECT_FALSE(says(all, "taken back"));
  EXPECT_EQ(find(back.values, "seen_share")->word, "no voxel lost half of its bone");
}

TEST(Sessions, ItemsRulesAndSteps) {
  const test::ScratchFolder scratch;
  record(scratch / "s.oss", 2);
  const Procedure p = parse_procedure(kProcedure, "t.json");
  const Score s = score(scratch / "s.oss", &p);
  ASSERT_EQ(s.items.size(), 2U);
  EXPECT_TRUE(s.items[0].measured);
  EXPECT_TRUE(s.items[1].pass);
  EXPECT_GT(value(s.values, "excess_force_ns[rod]"), 0);
  EXPECT_EQ(value(s.values, "burr_choice_share"), 0);  // a cutting burr where only diamond is allowed
  EXPECT_EQ(value(s.values, "items_passed"), static_cast<double>(s.passed()));
  EXPECT_EQ(s.steps.front().second, s.passed() == 2 ? "done" : "not done");
  EXPECT_NEAR(value(s.values, "rate_mm3_per_s") * value(s.values, "drilling_s"), value(s.values, "removed_mm3"), 1e-9);
  double phases = 0;
  for (int n = 1; n <= 5; ++n) phases += value(s.values, "phase_s[fifth " + std::to_string(n) + "]");
  EXPECT_LE(phases, value(s.values, "duration_s"));
  // One step, about the rod: from the first drilling to the last.
  EXPECT_GE(value(s.values, "step_s[all]"), value(s.values, "drilling_s"));
  EXPECT_LT(value(s.values, "step_s[all]"), value(s.values, "duration_s"));
  const auto json = Json::parse(score_json(s, true).dump());
  ASSERT_TRUE(json);
  EXPECT_EQ(*json->find("osteotome_score")->number(), 1);
  EXPECT_EQ(json->find("items")->items().size(), 2U);
  // A row of CSV has a field for each name, and begins with what it is of, as the JSON has it.
  const Csv csv = read_csv(score_csv(s, "s"), "row");
  ASSERT_EQ(csv.rows.size(), 1U);
  EXPECT_EQ(csv.rows[0].fields[0], "s");
  const Json& source = *json->find("source");
  for (std::size_t n = 1; n < 7; ++n)
    EXPECT_EQ(csv.rows[0].fields[n], *source.find(csv.columns[n])->text()) << csv.columns[n];
  EXPECT_EQ(s.source.bone.size(), 16U);
  EXPECT_EQ(s.source.procedure, p.hash);
  EXPECT_EQ(s.source.marks(), "");
  // A spreadsheet works nothing out.
  for (const char* const name : {"=1+1", "+1", "-1", "@a", "\t=1"})
    EXPECT_EQ(read_csv(score_csv(s, name), "row").rows[0].fields[0], "'" + std::string(name));
}

TEST(Sessions, HardCasesHaveAWordEach) {
  const test::ScratchFolder scratch;
  const auto whole = scratch / "whole.oss";
  record(whole, 2);
  // Cut short.
  const auto cut = scratch / "cut.oss";
  std::filesystem::copy_file(whole, cut);
  std::filesystem::resize_file(cut, std::filesystem::file_size(whole) * 2 / 3);
  EXPECT_TRUE(says(score(cut), "cut short"));
  EXPECT_EQ(score(cut).source.marks(), "cut-short");
  // A damaged frame in the middle.
  const auto hurt = scratch / "hurt.oss";
  std::string bytes = read_text(whole);
  bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 0x10);
  write_file(hurt, bytes);
  const Score damaged = score(hurt);
  EXPECT_TRUE(says(damaged, "behind the first gap"));
  EXPECT_LT(value(damaged.values, "duration_s"), value(score(whole).values, "duration_s"));
  // No camera notes.
  record(scratch / "blind.oss", 1, {}, false);
  EXPECT_EQ(find(score(scratch / "blind.oss").values, "seen_share")->word, "the session has no camera notes");
  // No structures.
  const Score bare = score_session(SessionReader(whole), block(), nullptr, nullptr, nullptr, {});
  EXPECT_TRUE(says(bare, "no structures"));
  EXPECT_EQ(find(bare.values, "touches")->word, "the case has no structures");
  const Procedure p = parse_procedure(kProcedure, "t.json");
  const Score half = score_session(SessionReader(whole), block(), nullptr, &p, nullptr, {});
  EXPECT_EQ(half.items[0].word, "the case has no structures");
  EXPECT_TRUE(half.items[1].measured);
  EXPECT_EQ(half.steps.front().second, "not judged");
  // A procedure for another case.
  const Procedure other = parse_procedure(
      "{ \"osteotome_procedure\": 1, \"name\": \"o\", \"structures\": [ {\"name\": \"jaw\", \"role\": \"keep\"} ] }",
      "o.json");
  try {
    static_cast<void>(score(whole, &other));
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::usage);
    EXPECT_NE(std::string(e.what()).find("'o.json' is a procedure for another case"), std::string::npos);
    EXPECT_NE(e.advice().find("'rod'"), std::string::npos);
  }
  // Another bone.
  EXPECT_THROW(static_cast<void>(score_session(SessionReader(whole), test::solid_world(slab, 0.6, 24), nullptr, nullptr,
                                               nullptr, {})),
               Error);
  // Nothing done at all.
  RehearsalOptions o = options(scratch / "idle.oss");
  Script still;
  still.waypoints = {{0, {0, 0, 12}, false}, {2, {0, 0, 12}, false}};
  Rehearsal(block(), std::make_unique<ScriptedDevice>(still, 1000), o, {}).run_to_end({});
  const Score idle = score(scratch / "idle.oss", &p);
  EXPECT_TRUE(says(idle, "nothing was removed"));
  EXPECT_EQ(find(idle.values, "strokes")->word, "no burr drilled");
  EXPECT_NEAR(value(idle.values, "idle_s"), 2, 0.11);
  // A burr that only grazes it: some bone is gone, but nowhere half a voxel.
  Script graze;
  graze.waypoints = {
      {0, {0, 0, 9}, true}, {0.3, {0, 0, 5.75}, true}, {0.32, {0, 0, 5.75}, true}, {0.4, {0, 0, 9}, false}};
  RehearsalOptions grazed = options(scratch / "graze.oss");
  Rehearsal(block(), std::make_unique<ScriptedDevice>(graze, 1000), grazed, {}).run_to_end({});
  const Score little = score(scratch / "graze.oss", &p);
  EXPECT_GT(value(little.values, "removed_mm3"), 0);
  EXPECT_EQ(value(little.values, "cavity_mm3"), 0);
  EXPECT_FALSE(says(little, "nothing was removed"));
  EXPECT_TRUE(says(little, "less was removed than half of any voxel"));
  // Inside a structure from the beginning.
  NearMetric near({1000, rod().get(), nullptr});
  TickRecord inside;
  inside.device.position_mm = {0, 0, 1};
  const World world = block();
  near.frame({1000, {}, {&inside, 1}, {}, {}, world, nullptr, 0});
  std::vector<Measured> values;
  std::vector<Moment> moments;
  near.finish(world, values, moments);
  ASSERT_FALSE(moments.empty());
  EXPECT_EQ(moments.front().what, "touched from the first tick on");
  EXPECT_EQ(value(values, "touches[rod]"), 1);
  EXPECT_EQ(value(values, "injured_s[rod]"), 0);  // it did not turn
}

TEST(Sessions, BonesInPiecesInRegionsAndGoneAltogether) {
  const test::ScratchFolder scratch;
  const Procedure p = parse_procedure(kProcedure, "t.json");
  // Sawn in two and taken apart.
  record(scratch / "two.oss", 2,
         {at(1200, SceneAction::saw({{3, 0, 0}, {1, 0, 0}, {0, 0, 1}, 1})), at(1300, SceneAction::split(5))});
  const Score two = score(scratch / "two.oss", &p);
  EXPECT_TRUE(says(two, "bone in fragments"));
  EXPECT_EQ(two.items[1].value, 2);
  EXPECT_FALSE(two.items[1].pass);  // one was asked for
  EXPECT_GT(value(two.values, "sawn_mm3"), 0);
  const auto other_bone = [&](const std::string& name, World world, const Script& script) {
    const World again = world.copy();
    Rehearsal r(std::move(world), std::make_unique<ScriptedDevice>(script, 1000), options(scratch / name), {});
    r.note("camera", kCamera);
    const RehearsalSummary s = r.run_to_end({});
    Score scored = score_session(SessionReader(scratch / name), again.copy(), rod().get(), &p, nullptr, {});
    EXPECT_NEAR(value(scored.values, "removed_mm3"), s.removed_mm3, 1e-3);
    return scored;
  };
  // A finer region under the first hole: by each voxel's own volume, what is gone is what was removed, but for voxels
  // that are half gone.
  Frame fine;
  fine.dims = {24, 24, 24};
  fine.spacing_mm = {0.25, 0.25, 0.25};
  fine.origin_mm = Vec3{-9, -3, -2} + Vec3{0.125, 0.125, 0.125};
  World with_region = block();
  with_region.add_region(test::soft_solid(fine, slab));
  const Score region = other_bone("region.oss", std::move(with_region), test::holes(1, -6, 4.2));
  EXPECT_TRUE(says(region, "a finer region"));
  EXPECT_FALSE(says(region, "bone in fragments"));
  EXPECT_EQ(region.items[1].value, 1);  // a region is no piece
  const double gone = value(region.values, "hidden_mm3") / (1 - value(region.values, "seen_share") + 1e-12);
  if (value(region.values, "hidden_mm3") > 0) {
    EXPECT_NEAR(gone, value(region.values, "removed_mm3"), 0.2 * gone);
  }
  // A crumb that is drilled away.
  Script down;
  down.waypoints = {{0, {-6, 0, 8}, true}, {0.2, {-6, 0, 6}, true}, {1.5, {-6, 0, 2}, true}, {1.7, {-6, 0, 8}, false}};
  const Score none = other_bone("crumb.oss",
                                test::solid_world(
                                    [](Vec3 q) {
                                      return 0.8 - length(q - Vec3{-6, 0, 3.5});
                                    },
                                    0.5, 24),
                                down);
  EXPECT_TRUE(says(none, "no bone is left"));
  EXPECT_FALSE(says(none, "nothing was removed"));
  EXPECT_TRUE(none.items[0].measured);
}

TEST(Sessions, AReferenceLeavesOutTheSamePerson) {
  const test::ScratchFolder scratch;
  for (int n = 1; n <= 3; ++n) record(scratch / ("s" + std::to_string(n) + ".oss"), n);
  Reference reference;
  for (int n = 1; n <= 3; ++n)
    reference.sessions.push_back(read_reference(
        SessionReader(scratch / ("s" + std::to_string(n) + ".oss")), block(), rod().get(),
        {"s" + std::to_string(n), "P" + std::to_string(n), n == 3 ? ReferenceGroup::novice : ReferenceGroup::expert}));
  const Score s = score(scratch / "s1.oss", nullptr, &reference);
  EXPECT_TRUE(says(s, "1 sessions of the reference are left out"));
  // What only the novice took was kept: better than what the novice left.
  EXPECT_GT(value(s.values, "region_log_ratio"), 0);
  // Experts who press harder than anybody, and such who do not press at all.
  for (const float newtons : {1000.0F, 0.0F}) {
    auto& theirs = reference.sessions[1].near[1];
    theirs.assign(200, {0, {}, 1, newtons, newtons});
    const Score banded = score(scratch / "s1.oss", nullptr, &reference);
    EXPECT_EQ(value(banded.values, "force_above_band_share[rod]"), newtons > 0 ? 0 : 1);
    theirs.resize(50);
    EXPECT_EQ(find(score(scratch / "s1.oss", nullptr, &reference).values, "force_above_band_share[rod]")->word,
              "experts drilled less than a second near it");
  }
  const Score novice = score(scratch / "s3.oss", nullptr, &reference, "P3");
  EXPECT_NE(find(novice.values, "region_log_ratio")->word.find("no sessions of novices"), std::string::npos);
}

TEST(Sessions, AReferenceIsReadStrictly) {
  const test::ScratchFolder scratch;
  std::filesystem::create_directories(scratch / "a");
  write_file(scratch / "a/stream.oss", "");
  const auto wrong = [&](const std::string& text) {
    write_file(scratch / "reference.json", text);
    try {
      static_cast<void>(load_reference(scratch / "."));
    } catch (const Error& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  const std::string a = "{\"session\": \"a\", \"subject\": \"P1\", \"group\": \"expert\"}";
  EXPECT_EQ(wrong("{\"osteotome_reference\": 1, \"sessions\": [" + a + "]}"), "");
  EXPECT_NE(wrong("{\"osteotome_reference\": 1, \"sessions\": [" + a + "," + a + "]}").find("there twice"),
            std::string::npos);
  EXPECT_NE(wrong("{\"osteotome_reference\": 1, \"sessions\": [\n{\"session\": \"b\", \"subject\": \"P1\", \"group\": "
                  "\"expert\"}]}")
                .find("line 2"),
            std::string::npos);
}

}  // namespace
}  // namespace osteo
