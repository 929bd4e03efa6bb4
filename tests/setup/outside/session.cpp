// Component rehearsal: a scripted hand drills a block of bone; the session is recorded and read back.
#include <cstdio>
#include <filesystem>

#include "osteo/session/scene/rehearsal.h"

int main() {
  osteo::Frame frame{.dims = {40, 40, 40}, .spacing_mm = {0.5, 0.5, 0.5}};
  std::vector<osteo::Ijk> bricks;
  for (int n = 0; n < 125; ++n) bricks.push_back({n % 5, n / 5 % 5, n / 25});
  osteo::BrickGrid bone(frame, bricks);
  for (int n = 0; n < 40 * 40 * 20; ++n) bone.set(bone.find(n % 40, n / 40 % 40, n / 1600), 1);
  osteo::Script script;
  script.waypoints = {{0, {10, 10, 14}, true}, {1, {10, 10, 10}, true}};  // second, place in mm, drill on
  osteo::RehearsalOptions options;
  options.haptics.device = osteo::SpringHand::traits();
  options.session_file = "outside.oss";  // one that is there is never overwritten
  std::filesystem::remove(options.session_file);
  osteo::Rehearsal rehearsal(osteo::World(std::move(bone)),
                             std::make_unique<osteo::ScriptedDevice>(script, options.rate_hz), options, {});
  const osteo::RehearsalSummary done = rehearsal.run_to_end({});
  const osteo::Session session = osteo::read_session("outside.oss");
  const std::size_t ticks = session.tick_records;
  std::printf("%zu ticks, %.1f mm3 drilled, %s\n", ticks, done.removed_mm3, done.bone_hash.c_str());
  return ticks == done.ticks && done.removed_mm3 > 0.1 ? 0 : 1;
}
