// Rules of hints, and when they are said.
#include "osteo/assessment/evidence/hints.h"

#include <gtest/gtest.h>

#include <functional>

#include "osteo/core/base/error.h"
#include "osteo/simulation/bone/instrument.h"
#include "scene.h"

namespace osteo {
namespace {

std::string error_of(const std::string& hint) {
  try {
    (void)parse_hints("{ \"osteotome_hints\": 1, \"hints\": [\n" + hint + "\n] }", "h.json");
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::usage);
    return e.what();
  }
  return {};
}

TEST(Hints, FileIsReadStrictly) {
  EXPECT_GE(usual_hints().size(), 5U);
  EXPECT_EQ(error_of(R"({"id": "a", "kind": "dry", "words": "w", "for_s": 3})"), "");
  EXPECT_NE(error_of(R"({"id": "a", "kind": "dry", "words": "w", "within_mm": 3})").find("'h.json' line 2"),
            std::string::npos);
  EXPECT_NE(error_of(R"({"id": "a", "kind": "unseen", "words": "w", "limit": 3})").find("'limit' says nothing"),
            std::string::npos);
  EXPECT_NE(error_of(R"({"id": "a", "kind": "force", "words": "w"})").find("needs a 'limit'"), std::string::npos);
  EXPECT_NE(error_of(R"({"id": "a", "kind": "dry", "words": "near the {structure}"})").find("{structure}"),
            std::string::npos);
  EXPECT_NE(error_of(R"({"id": "a", "kind": "wet", "words": "w"})"), "");
  EXPECT_NE(error_of(R"({"id": "a", "kind": "dry", "words": "w", "colour": 1})"), "");
  EXPECT_NE(error_of(R"({"id": "a", "kind": "dry"})").find("words"), std::string::npos);
  EXPECT_NE(
      error_of(R"({"id": "a", "kind": "dry", "words": "w"}, {"id": "a", "kind": "dry", "words": "w"})").find("another"),
      std::string::npos);
  EXPECT_NE(error_of(R"({"id": "a", "kind": "dry", "words": "w", "quiet_s": 0})"), "");
}

const StructureMap& rod() {
  static const StructureMap map =
      test::structure_map([](Vec3 p) -> std::uint8_t { return std::hypot(p.x, p.z) < 1 && std::abs(p.y) < 8 ? 4 : 0; },
                          {{4, "rod", {}}}, 0.5, 20);
  return map;
}
HintRule rule(HintKind kind, double limit, double for_s, double quiet_s) {
  HintRule r;
  r.id = EnumNames<HintKind>::values[static_cast<std::size_t>(kind)];
  r.words = kind == HintKind::force ? "less at the {structure}" : r.id;
  r.kind = kind;
  r.limit = limit;
  r.for_s = for_s;
  r.quiet_s = quiet_s;
  return r;
}

// A thousand ticks a second from `from_s` on; what was said, by second.
struct Sequence {
  HintWatch watch;
  std::uint64_t tick = 0;
  std::vector<std::pair<double, std::string>> said = {};
  void go(double seconds, const TickRecord& as) {
    for (int n = 0; n < static_cast<int>(seconds * 1000); ++n) {
      TickRecord t = as;
      t.tick = tick++;
      watch.tick(t);
      if (const auto h = watch.take()) said.emplace_back(h->t_s, h->words);
    }
  }
};
TickRecord drilling(double force_n, double clearance_mm) {
  TickRecord t;
  t.device.tool = static_cast<std::uint8_t>(burr_index(BurrKind::cutting, 4));
  t.speed_rpm = 60000;
  t.normal_force_n = static_cast<float>(force_n);
  t.clearance_mm = static_cast<float>(clearance_mm);
  t.structure = 4;
  return t;
}

TEST(Hints, AreSaidWhenTheyHoldLongEnoughAndNotTooOften) {
  Sequence run{HintWatch({rule(HintKind::force, 1, 0.5, 10)}, 1000, &rod(), false)};
  run.go(2, drilling(0.9, 1));  // not hard enough
  run.go(2, drilling(2, 2.5));  // not near enough
  EXPECT_TRUE(run.said.empty());
  run.go(0.4, drilling(2, 1));
  run.go(0.2, drilling(0.5, 1));  // a pause of less than 0.3 s
  run.go(0.05, drilling(2, 1));
  EXPECT_TRUE(run.said.empty());
  run.go(1, drilling(2, 1));
  ASSERT_EQ(run.said.size(), 1U);
  EXPECT_NEAR(run.said[0].first, 4.7, 0.01);
  EXPECT_EQ(run.said[0].second, "less at the rod");
  run.go(20, drilling(2, 1));
  ASSERT_EQ(run.said.size(), 3U);  // every 10 s
  EXPECT_NEAR(run.said[1].first - run.said[0].first, 10, 0.01);
  TickRecord still = drilling(2, 1);
  still.speed_rpm = 0;
  run.go(20, still);
  EXPECT_EQ(run.said.size(), 3U);
}

TEST(Hints, OfSeveralThatHoldOneIsSaidAtATime) {
  HintRule other = rule(HintKind::large_burr, 3, 0.1, 60);
  HintRule elsewhere = rule(HintKind::cutting_burr, 0, 0.1, 60);
  elsewhere.structure = "no such structure";
  Sequence run{
      HintWatch({other, rule(HintKind::cutting_burr, 0, 0.1, 60), rule(HintKind::unseen, 0, 0.1, 60), elsewhere}, 1000,
                &rod(), false)};
  run.watch.seen(false);
  run.go(30, drilling(1, 0.5));
  ASSERT_EQ(run.said.size(), 3U);
  EXPECT_GE(run.said[1].first - run.said[0].first, HintWatch::kApartS);
  EXPECT_GE(run.said[2].first - run.said[1].first, HintWatch::kApartS);
  EXPECT_EQ(run.said[2].second, "unseen");
  Sequence good{HintWatch({rule(HintKind::unseen, 0, 0.1, 60), other}, 1000, &rod(), false)};
  TickRecord small = drilling(1, 0.5);
  small.device.tool = static_cast<std::uint8_t>(burr_index(BurrKind::diamond, 2));
  good.go(3, small);  // nothing is known of what is seen
  good.watch.seen(true);
  good.go(3, small);
  EXPECT_TRUE(good.said.empty());
}

TEST(Hints, WaterAtAnyTimeMakesItWetAgain) {
  Sequence run{HintWatch({rule(HintKind::dry, 0, 5, 60)}, 1000, nullptr, true)};
  run.go(4, drilling(1, 9));
  run.watch.action(SceneAction::irrigate({}, 3, 10));
  run.go(0.1, drilling(1, 9));
  run.watch.action(SceneAction::irrigate({}, 3, 0));
  run.go(4.9, drilling(1, 9));
  EXPECT_TRUE(run.said.empty());
  TickRecord pours;
  pours.hand = 1;
  pours.device.tool = static_cast<std::uint8_t>(instrument_index("irrigator 2 mm"));
  pours.device.pedal = 255;
  run.watch.tick(pours);
  run.go(4.9, drilling(1, 9));
  EXPECT_TRUE(run.said.empty());
  run.go(1, drilling(1, 9));
  EXPECT_EQ(run.said.size(), 1U);
  Sequence none{HintWatch({rule(HintKind::dry, 0, 5, 60)}, 1000, nullptr, false)};  // a scene without water
  none.go(20, drilling(1, 9));
  EXPECT_TRUE(none.said.empty());
}

}  // namespace
}  // namespace osteo
