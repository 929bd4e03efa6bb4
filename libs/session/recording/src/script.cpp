#include "osteo/session/recording/script.h"

namespace osteo::inline session {

double Script::seconds() const {
  double last = actions.empty() ? 0 : actions.back().t_s;
  const auto add = [&](const Strokes& s) {
    if (!s.waypoints.empty()) last = std::max(last, s.waypoints.back().t_s);
  };
  add(*this);
  for (const Strokes& s : more_hands) add(s);
  return last;
}

std::vector<SceneAction> actions_of(const Script& script, double rate_hz) {
  std::vector<SceneAction> actions;
  for (const Script::TimedAction& a : script.actions) {
    actions.push_back(a.action);
    actions.back().tick = a.tick(rate_hz);
  }
  return actions;
}

std::vector<std::unique_ptr<Device>> devices_of(const Script& script, double rate_hz) {
  std::vector<std::unique_ptr<Device>> devices;
  devices.push_back(std::make_unique<ScriptedDevice>(
      script, rate_hz, script.actions.empty() ? 0 : script.actions.back().tick(rate_hz) + 1));
  for (const Strokes& s : script.more_hands) devices.push_back(std::make_unique<ScriptedDevice>(s, rate_hz));
  return devices;
}

}  // namespace osteo::inline session
