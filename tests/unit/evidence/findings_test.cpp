// Findings of scores made by hand: which sentences come, with which figures, in which order.
#include <gtest/gtest.h>

#include "osteo/assessment/evidence/findings.h"
#include "scene.h"

namespace osteo {
namespace {

const StructureMap& sinus() {
  static const StructureMap map = test::structure_map([](Vec3 p) -> std::uint8_t { return length(p) < 2 ? 1 : 0; },
                                                      {{1, "sigmoid sinus", {}}}, 0.5, 24);
  return map;
}
Score plain() {
  Score s;
  s.values = {measured("duration_s", 723), measured("drilling_s", 401.2), measured("removed_mm3", 812.4)};
  return s;
}
Procedure procedure(const std::string& rest) {
  return parse_procedure(
      "{ \"osteotome_procedure\": 1, \"name\": \"t\", \"structures\": [ {\"name\": \"sigmoid sinus\", \"role\": "
      "\"never_touch\"}, {\"name\": \"antrum\", \"role\": \"enter\"} ]" +
          rest + "}",
      "t.json");
}

TEST(Findings, UnseenBoneIsToldWithWhatItLayNear) {
  Score s = plain();
  s.values.insert(s.values.end(),
                  {measured("seen_share", 0.9), measured("hidden_mm3", 31.2),
                   measured("hidden_near_mm3", 9.1, "sigmoid sinus"), measured("hidden_near_mm3", 20, "antrum")});
  // Three voxels far off, two near the sinus.
  VoxelKey n = 0;
  for (const Vec3 p : {Vec3{9, 9, 9}, Vec3{9, 9, 8}, Vec3{9, 8, 9}, Vec3{3, 0, 0}, Vec3{3, 0.5, 0}})
    s.hidden.push_back({n++, {VisibilityMetric::Seen::hidden, 100, p, 6.24F}});
  s.moments.push_back({12.5, {3, 0, 0}, "removed unseen", "sigmoid sinus", 1, 2});
  const Procedure p = procedure("");
  const Findings f = findings_of(s, &sinus(), &p);
  const ScoreFinding* const hidden = f.find("hidden");
  ASSERT_NE(hidden, nullptr);
  EXPECT_EQ(hidden->text, "31 mm³ of bone (10 %) was removed unseen, 9.1 mm³ of it within 2 mm of the sigmoid sinus.");
  EXPECT_EQ(hidden->severity, FindingSeverity::caution);
  EXPECT_EQ(hidden->times_s, std::vector<double>{12.5});
  EXPECT_EQ(hidden->places_count, 5U);
  EXPECT_NEAR(hidden->places_each, 6.24, 1e-6);
  ASSERT_TRUE(hidden->at_mm);
  EXPECT_LT(length(*hidden->at_mm - Vec3{3, 0, 0}), 0.6);  // near the sinus, not in the middle of all
}

TEST(Findings, SeenWellIsGood) {
  Score s = plain();
  s.values.insert(s.values.end(), {measured("seen_share", 0.999), measured("hidden_mm3", 0.8),
                                   measured("hidden_near_mm3", 0.0, "sigmoid sinus")});
  EXPECT_EQ(findings_of(s, nullptr, nullptr).find("hidden")->text,
            "0.8 mm³ of bone (less than 1 %) was removed unseen.");
  EXPECT_EQ(findings_of(s, nullptr, nullptr).find("hidden")->severity, FindingSeverity::good);
  s.values[3] = measured("seen_share", 1);
  s.values[4] = measured("hidden_mm3", 0);
  EXPECT_EQ(findings_of(s, nullptr, nullptr).find("hidden")->text, "All bone that was removed was seen as it went.");
}

TEST(Findings, InjuriesComeFirstAndTouchesAreNoInjuries) {
  Score s = plain();
  s.values.insert(s.values.end(),
                  {measured("seen_share", 0.5), measured("hidden_mm3", 400), measured("touches", 3, "sigmoid sinus"),
                   measured("touched_s", 0.62, "sigmoid sinus"), measured("injured_s", 0.41, "sigmoid sinus"),
                   measured("clearance_mm", -0.3, "sigmoid sinus"), measured("touches", 2, "dura"),
                   measured("touched_s", 0.1, "dura"), measured("injured_s", 0, "dura"),
                   measured("touches", 0, "labyrinth"), measured("touched_s", 0, "labyrinth"),
                   measured("injured_s", 0, "labyrinth"), measured("clearance_mm", 0.34, "labyrinth")});
  for (const double t : {8.0, 20.0})
    s.moments.push_back({t, {t, 0, 0}, "reached by a rotating burr", "sigmoid sinus", -0.1, 0});
  const Findings f = findings_of(s, nullptr, nullptr);
  EXPECT_EQ(f.list.front().id, "injury-sigmoid-sinus");
  EXPECT_EQ(f.list.front().text, "A rotating burr reached the sigmoid sinus twice, for 0.41 s in all.");
  EXPECT_EQ(f.list.front().severity, FindingSeverity::serious);
  EXPECT_EQ(f.list.front().times_s, (std::vector<double>{8, 20}));
  EXPECT_EQ(*f.list.front().at_mm, (Vec3{8, 0, 0}));
  EXPECT_EQ(f.find("touch-sigmoid-sinus"), nullptr);
  EXPECT_EQ(f.find("touch-dura")->text, "The burr touched the dura twice, for 0.1 s, without turning.");
  EXPECT_EQ(f.find("clearance-labyrinth")->text, "The burr came within 0.34 mm of the labyrinth.");
  EXPECT_EQ(f.find("untouched"), nullptr);
  // A saw is called a saw.
  s.moments.push_back({12, {}, "reached by the running saw", "sigmoid sinus", -0.1, 0});
  const ScoreFinding both = findings_of(s, nullptr, nullptr).list.front();
  EXPECT_EQ(both.text, "A rotating burr reached the sigmoid sinus twice and the running saw once, for 0.41 s in all.");
  EXPECT_EQ(both.times_s, (std::vector<double>{8, 12, 20}));
  s.moments.erase(s.moments.begin(), s.moments.end() - 1);
  EXPECT_EQ(findings_of(s, nullptr, nullptr).list.front().text,
            "The running saw reached the sigmoid sinus once, for 0.41 s in all.");
  for (std::size_t n = 1; n < f.list.size(); ++n) EXPECT_GE(f.list[n - 1].severity, f.list[n].severity);
}

TEST(Findings, ASawIsCalledASaw) {
  Score s = plain();
  s.values.insert(s.values.end(), {measured("touches", 1, "dura"), measured("touched_s", 0.2, "dura"),
                                   measured("injured_s", 0.2, "dura"), measured("clearance_mm", -0.3, "dura")});
  s.moments.push_back({8, {}, "reached by the running saw", "dura", -0.1, 0});
  EXPECT_EQ(findings_of(s, nullptr, nullptr).find("injury-dura")->text,
            "The running saw reached the dura once, for 0.2 s in all.");
  EXPECT_EQ(findings_of(s, nullptr, nullptr).find("injury-dura")->times_s, std::vector<double>{8});
  s.moments.push_back({9, {}, "reached by a rotating burr", "dura", -0.1, 0});
  EXPECT_EQ(findings_of(s, nullptr, nullptr).find("injury-dura")->text,
            "A rotating burr reached the dura once and the running saw once, for 0.2 s in all.");
}

TEST(Findings, ItemsSayWhatWasAsked) {
  const Procedure p = procedure(
      ", \"items\": [ {\"name\": \"sinus intact\", \"kind\": \"not_violated\", \"structure\": \"sigmoid sinus\"}, "
      "{\"name\": \"sinus "
      "shown\", "
      "\"kind\": \"exposed\", \"structure\": \"sigmoid sinus\", \"threshold\": 0.4}, {\"name\": \"two pieces\", "
      "\"kind\": \"pieces\"} ]");
  Score s = plain();
  s.procedure = p.name;
  Product::Result violated, shown, pieces;
  violated.item = &p.items[0];
  violated.measured = true;
  violated.value = 0.5;
  violated.unit = "mm3";
  violated.evidence_mm = {{0, 0, 0}, {0, 0, 1}, {0, 0, 2}};
  violated.evidence_count = 3;
  violated.evidence_each = 0.125;
  shown.item = &p.items[1];
  shown.measured = shown.pass = true;
  shown.value = 0.62;
  shown.threshold = 0.4;
  shown.unit = "1";
  pieces.item = &p.items[2];
  pieces.word = "the bone is gone";
  s.items = {violated, shown, pieces};
  const Findings f = findings_of(s, nullptr, &p);
  EXPECT_EQ(f.find("item-sinus-intact")->text, "Sinus intact: not passed, 0.5 mm³ of bone within it is gone.");
  EXPECT_EQ(f.find("item-sinus-intact")->severity, FindingSeverity::serious);  // it was never to be touched
  EXPECT_EQ(*f.find("item-sinus-intact")->at_mm, (Vec3{0, 0, 1}));
  EXPECT_EQ(f.find("item-sinus-shown")->text, "Sinus shown: passed, 62 % of it is laid open, at least 40 % is asked.");
  EXPECT_EQ(f.find("item-two-pieces"), nullptr);
  ASSERT_EQ(f.not_measured.size(), 1U);
  EXPECT_EQ(f.not_measured[0].first, "the bone is gone");
  EXPECT_EQ(f.not_measured[0].second, std::vector<std::string>{"item 'two pieces'"});
  EXPECT_EQ(f.summary.back(), "1 of 2 items of the scale passed; 1 could not be judged.");
  // Not passed though nothing of it is gone: the burr was in it.
  s.items[0].value = 0;
  EXPECT_EQ(findings_of(s, nullptr, &p).find("item-sinus-intact")->text,
            "Sinus intact: not passed, no bone within it is gone, but a running burr or saw reached into it.");
  s.items[0].pass = true;
  EXPECT_EQ(findings_of(s, nullptr, &p).find("item-sinus-intact")->text,
            "Sinus intact: passed, no bone within it is gone.");
}

TEST(Findings, ForceWaterAndTime) {
  Score s = plain();
  s.values.insert(
      s.values.end(),
      {measured("excess_force_ns", 1.25, "sigmoid sinus"), measured("force_above_band_share", 0.31, "sigmoid sinus"),
       measured("speed_above_band_share", 0.12, "sigmoid sinus"), measured("irrigation_share", 0),
       measured("idle_s", 300), measured("lost_s", 2.5), measured("force_peak_n", 3.21)});
  s.moments.push_back({4, {1, 1, 1}, "pressed too hard near it", "sigmoid sinus", 1.7, 1});
  const Findings f = findings_of(s, nullptr, nullptr);
  EXPECT_EQ(
      f.find("force-sigmoid-sinus")->text,
      "Near the sigmoid sinus the burr pressed harder than the 1 N that the procedure allows there: 1.7 N was seen.");
  EXPECT_EQ(f.find("force-band-sigmoid-sinus")->text,
            "31 % of the drilling near the sigmoid sinus was pressed harder than nine in ten moments of the "
            "reference's experts.");
  EXPECT_EQ(f.find("speed-band-sigmoid-sinus"), nullptr);  // 12 % is about what chance gives
  EXPECT_EQ(f.find("water")->text, "No water was used while drilling.");
  EXPECT_EQ(f.find("idle")->text, "For 5 min (41 %) neither hand moved.");
  EXPECT_EQ(f.find("lost")->severity, FindingSeverity::caution);
  EXPECT_EQ(f.summary.front(), "The session lasted 12 min 3 s; for 6 min 41 s of it a burr was drilling.");
}

TEST(Findings, NothingRemovedIsSaid) {
  Score s;
  s.values = {measured("duration_s", 12),
              measured("drilling_s", 0),
              measured("removed_mm3", 0),
              not_measured("seen_share", "nothing was removed"),
              not_measured("hidden_mm3", "nothing was removed"),
              not_measured("touches", "the case has no structures")};
  s.words = {"nothing was removed"};
  const Findings f = findings_of(s, nullptr, nullptr);
  EXPECT_EQ(f.summary, (std::vector<std::string>{"The session lasted 12 s; no burr drilled.", "No bone was removed."}));
  EXPECT_TRUE(f.list.empty());
  ASSERT_EQ(f.not_measured.size(), 2U);
  EXPECT_EQ(f.not_measured[0].second, (std::vector<std::string>{"seen_share", "hidden_mm3"}));
  EXPECT_EQ(f.words, s.words);
  const auto json = Json::parse(findings_json(f, true).dump());
  ASSERT_TRUE(json);
  EXPECT_EQ(json->find("not_measured")->items().size(), 2U);
}

TEST(Findings, NumbersAsPeopleSayThem) {
  EXPECT_EQ(reported_number(31.4), "31");
  EXPECT_EQ(reported_number(1234.4), "1234");
  EXPECT_EQ(reported_number(4.249), "4.2");
  EXPECT_EQ(reported_number(0.3456), "0.35");
  EXPECT_EQ(reported_number(0.012345), "0.012");
  EXPECT_EQ(reported_number(0), "0");
  EXPECT_EQ(reported_number(-2.96), "-3");
  EXPECT_EQ(reported_seconds(3723), "1 h 2 min");
  EXPECT_EQ(reported_seconds(60), "1 min");
  EXPECT_EQ(reported_seconds(59.6), "1 min");
  EXPECT_EQ(reported_seconds(0.41), "0.41 s");
}

TEST(Findings, AUnitIsWrittenOneWayForPeople) {
  EXPECT_EQ(unit_text("mm3"), "mm³");
  EXPECT_EQ(unit_text("mm2"), "mm²");
  EXPECT_EQ(unit_text("mm3/s"), "mm³/s");
  EXPECT_EQ(unit_text("N s"), "N s");
  EXPECT_EQ(unit_text("1"), "");
}

}  // namespace
}  // namespace osteo
