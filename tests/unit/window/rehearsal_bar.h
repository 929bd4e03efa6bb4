// Rehearsals of a bar of bone under the window's keys and mouse, without a window.
#pragma once
#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "bar.h"
#include "osteo/session/recording/session_file.h"
#include "rehearsal_control.h"
#include "scratch.h"

namespace osteo::test {

// Runs rehearsals of a bar of bone as the program does those of a case.
struct SessionRunner {
  ScratchFolder scratch;
  World first{bar(0.5, 0.2)}, last = first.copy();
  std::unique_ptr<Rehearsal> running;
  int begun = 0, shown = 0;
  std::optional<Error> fails_to_begin, fails_to_show, fails_to_save, failed;

  WindowActions actions() {
    WindowActions a;
    a.save = [this] {
      if (!running) return;
      const std::unique_ptr<Rehearsal> over = std::move(running);
      over->stop();
      over->look([&](const World& world, SceneReaders&) { last = world.copy(); });
      if (fails_to_save) throw Error(*std::exchange(fails_to_save, {}));
    };
    a.begin = [this](bool from_case, const HandView& view) {
      if (fails_to_begin) throw Error(*std::exchange(fails_to_begin, {}));
      World world = (from_case ? first : last).copy();
      const HandPose pose =
          PathPlanner(world, skin_of_instrument(static_cast<std::size_t>(view.tool))).waiting(view.eye, view.axis);
      const HandGoal start{pose.at_mm, to_floats(pose.axis), 0, static_cast<std::uint8_t>(view.tool)};
      RehearsalOptions options;
      options.follow = {true, true, true};
      options.haptics.device = SpringHand::traits();
      options.haptics.more_devices = {SpringHand::traits()};
      options.session_file = scratch / (std::to_string(++begun) + ".oss");
      std::vector<std::unique_ptr<Device>> hands;
      hands.push_back(std::make_unique<MouseDevice>(start));
      hands.push_back(std::make_unique<MouseDevice>(HandGoal{pose.at_mm + Vec3{0, 0, 50}}));
      running = std::make_unique<Rehearsal>(std::move(world), std::move(hands), options, Context{});
      running->start();
      return start;
    };
    a.rehearsal = [this] { return running.get(); };
    a.folder = [this] { return scratch / "none"; };
    a.failure = [this] { return failed; };
    a.stop = [] { return false; };
    return a;
  }
  RehearsalControl control() {
    return RehearsalControl(actions(), burr_index(BurrKind::cutting, 4, BurrShape::ball), [this](Rehearsal&) {
      ++shown;
      if (fails_to_show) throw Error(*std::exchange(fails_to_show, {}));
    });
  }
};

// From above, as the bar lies; x to the right.
inline const ViewAxes kFromAbove{{0, 0, 120}, {0, 0, -1}, {1, 0, 0}, {0, 1, 0}};

inline void press(RehearsalControl& control, Command command, int value = 0, const std::optional<Vec3>& direction = {}) {
  control.command({command, value}, direction);
}

// Frames at sixty a second until it is so; false after a while.
inline bool frames_until(RehearsalControl& control, const std::function<bool()>& so, HandInput input = {}) {
  input.seconds = 1 / 60.0;
  for (int n = 0; n < 4000; ++n) {
    control.watch();
    control.look_from(kFromAbove);
    control.hold(input);
    if (so()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return false;
}

template <class F>
auto of_world(RehearsalControl& control, F&& f) {
  decltype(f(std::declval<const World&>())) value{};
  control.rehearsal().look([&](const World& world, SceneReaders&) { value = f(world); });
  return value;
}
inline std::size_t steps(RehearsalControl& control) {
  return of_world(control, [](const World& w) { return w.undo_steps(); });
}

}  // namespace osteo::test
