// Hints while a session runs: what is seen follows from the bone as it is then.
#include "osteo/assessment/scoring/hint_reader.h"

#include <gtest/gtest.h>

#include "evidence/scene.h"
#include "osteo/session/scene/rehearsal.h"

namespace osteo {
namespace {

// Drills from above into a slab below z = 4; the camera looks from `eye`.
std::vector<std::string> said_from(Vec3 eye) {
  Script s;
  s.axis = {0, 0, 1};
  s.waypoints = {{0, {0, 0, 7}, true}, {0.3, {0, 0, 5.5}, true}, {2.5, {0, 0, 1}, true}, {2.6, {0, 0, 7}, false}};
  HintRule unseen;
  unseen.id = unseen.words = "unseen";
  unseen.for_s = 0.4;
  RehearsalOptions o;
  o.haptics.device = SpringHand::traits();
  Rehearsal r(test::solid_world(
                  [](Vec3 p) {
                    return std::min({4 - p.z, p.z + 4, 11 - std::abs(p.x), 11 - std::abs(p.y)});
                  },
                  0.5, 24),
              std::make_unique<ScriptedDevice>(s, 1000), o, {});
  HintReader reader({unseen}, 1000, nullptr, false);
  reader.look_from(eye);
  r.add_reader(reader);
  (void)r.run_to_end({});
  r.remove_reader(reader);
  std::vector<std::string> said;
  while (const auto h = reader.take()) said.push_back(h->id);
  return said;
}

TEST(HintReader, SaysWhatCannotBeSeenFromTheCamera) {
  EXPECT_TRUE(said_from({0, 0, 200}).empty());
  EXPECT_EQ(said_from({0, 0, -200}), std::vector<std::string>{"unseen"});
}

}  // namespace
}  // namespace osteo
