// Time for each step, from distances made by hand: sums are known exactly.
#include "osteo/assessment/evidence/detail/step_clock.h"

#include <gtest/gtest.h>

#include "scene.h"

namespace osteo {
namespace {

constexpr double kHz = 100, kFar = 8;

// Three balls: a 1, b 2, c 3; d is named by the procedure and not there.
const StructureMap& balls() {
  static const StructureMap map = test::structure_map(
      [](Vec3 p) -> std::uint8_t {
        for (int n = 0; n < 3; ++n) {
          if (length(p - Vec3{6.0 * n - 6, 0, 0}) < 1) return static_cast<std::uint8_t>(n + 1);
        }
        return 0;
      },
      {{1, "a", {}}, {2, "b", {}}, {3, "c", {}}}, 0.5, 20);
  return map;
}
// b belongs to two steps, with one of another's between; a step about what the case lacks, and one about no structure
// at all.
const Procedure& procedure() {
  static const Procedure p = parse_procedure(
      R"({"osteotome_procedure": 1, "name": "t",
 "structures": [{"name": "a", "role": "keep"}, {"name": "b", "role": "keep"}, {"name": "c", "role": "keep"},
                {"name": "d", "role": "keep", "optional": true}],
 "items": [{"name": "d whole", "kind": "not_violated", "structure": "d"}, {"name": "b whole", "kind": "not_violated", "structure": "b"},
           {"name": "a whole", "kind": "not_violated", "structure": "a"}, {"name": "b holeless", "kind": "no_hole", "structure": "b"},
           {"name": "c whole", "kind": "not_violated", "structure": "c"}, {"name": "one", "kind": "pieces", "threshold": 1, "most": 1}],
 "steps": [{"name": "lacking", "items": ["d whole"]}, {"name": "b first", "items": ["b whole"]}, {"name": "a", "items": ["a whole"]},
           {"name": "b again", "items": ["b holeless"]}, {"name": "c", "items": ["c whole"]}, {"name": "apart", "items": ["one"]}]})",
      "t.json");
  return p;
}

struct Drilling {
  StepClock clock{balls(), procedure(), kHz};
  std::uint64_t now = 0;
  // For a time, nearest to one of them ("" : to none).
  void at(const std::string& what, double s) {
    std::vector<double> each(3, kFar);
    if (!what.empty()) each[static_cast<std::size_t>(what[0] - 'a')] = 1;
    for (int n = 0; n < static_cast<int>(s * kHz + 0.5); ++n) clock.drill(now++, each);
  }
  void rest(double s) { now += static_cast<std::uint64_t>(s * kHz + 0.5); }
  [[nodiscard]] std::map<std::string, Measured> times() const {
    std::vector<Measured> values;
    clock.finish(values);
    std::map<std::string, Measured> by_name;
    for (const Measured& m : values) by_name[m.of] = m;
    return by_name;
  }
  void expect(const std::map<std::string, double>& wanted) const {
    const auto times_s = times();
    for (const auto& [name, s] : wanted) {
      ASSERT_TRUE(times_s.at(name).value) << name;
      EXPECT_NEAR(*times_s.at(name).value, s, 1e-9) << name;
    }
  }
};

TEST(StepClock, StepsInTheirOrderWithPausesAndTheTimeBeforeAndBehind) {
  Drilling d;
  d.rest(30);  // nothing is drilled: of no step
  d.at("", 4);
  d.at("b", 5);
  d.rest(3);  // pauses belong to the step
  d.at("b", 1);
  d.at("a", 10);
  d.at("", 2);
  d.at("b", 6);
  d.at("c", 7);
  d.rest(20);
  // From the first drilling to the last: 38 s.
  d.expect({{"b first", 13}, {"a", 12}, {"b again", 6}, {"c", 7}});
  const auto times = d.times();
  EXPECT_FALSE(times.at("lacking").value);
  EXPECT_FALSE(times.at("apart").value);
  EXPECT_EQ(times.at("apart").word, "its items are about no structure of the case");
}

TEST(StepClock, AGlanceAsideIsNoStepAndOneMayBeginAgain) {
  Drilling d;
  d.at("b", 5);
  for (int n = 0; n < 10; ++n) {  // to and fro: never two seconds together
    d.at("a", 1.9);
    d.at("b", 0.1);
  }
  d.expect({{"b first", 25}, {"a", 0}});
  d.at("a", 1);
  d.rest(4);  // what counts is drilling, but the step's time is all of it
  d.at("", 1);
  d.at("a", 1);
  d.at("c", 1.99);  // of c too short
  d.at("a", 1);
  d.expect({{"b first", 25}, {"a", 9.99}, {"b again", 0}, {"c", 0}});
  d.at("c", 2);
  d.at("a", 3);  // no later step has it: the last before
  d.expect({{"b first", 25}, {"a", 12.99}, {"b again", 0}, {"c", 2}});
}

TEST(StepClock, NothingDrilledAndNoSteps) {
  const Drilling none;
  EXPECT_EQ(none.times().at("a").word, "no burr drilled");
  const Procedure bare = parse_procedure(R"({"osteotome_procedure": 1, "name": "t"})", "t.json");
  StepClock clock(balls(), bare, kHz);
  clock.drill(0, std::vector<double>{1, 2, 3});
  std::vector<Measured> values;
  clock.finish(values);
  EXPECT_TRUE(values.empty());
}

}  // namespace
}  // namespace osteo
