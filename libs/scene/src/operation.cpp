#include "osteo/scene/operation.h"

#include <chrono>
#include <future>
#include <thread>

namespace osteo {
namespace {

// Or looks at densities (where a plate lies), which must be those that a replay finds.
bool takes_time(const SceneAction& a) {
  return a.is(ActionKind::saw) || a.is(ActionKind::split) || a.is(ActionKind::undo) || a.is(ActionKind::attach);
}
bool changes_what_is_touched(const SceneAction& a) {
  return !(a.is(ActionKind::hold) || a.is(ActionKind::resume) || a.is(ActionKind::suction) || a.is(ActionKind::irrigate) ||
           a.is(ActionKind::yield));
}

}  // namespace

Operation::Operation(World world, const HapticSetup& setup, const Anatomy& anatomy, Device& device, Stream& stream, double rate_hz)
    : world_(std::move(world)), renderer_(setup, anatomy, 1 / rate_hz), servo_(renderer_, device, stream, rate_hz) {
  scene_ = std::make_unique<HapticScene>(HapticScene::of(world_, renderer_.setup()));
  renderer_.show(scene_.get());
}

// Only when nothing posted before waits: the scene before the last is then nobody's any more.
void Operation::hand_over(const SceneAction& action, std::unique_ptr<HapticScene> scene) {
  handover_ = {action, nullptr, world_.held()};
  if (scene) {
    old_scene_ = std::exchange(scene_, std::move(scene));
    handover_.scene = scene_.get();
  }
  servo_.post(&handover_);
}

World::Effect Operation::act(const SceneAction& action, const Done& done, const World::ComponentsOf& components) {
  World::Effect effect = world_.act(action, components);
  if (!effect.done) return effect;
  // What the servo needs and what its followers need, side by side.
  const auto scene_of = [&] { return std::make_unique<HapticScene>(HapticScene::of(world_, renderer_.setup(), scene_.get())); };
  std::unique_ptr<HapticScene> scene;
  if (changes_what_is_touched(action)) {
    auto beside = std::async(takes_time(action) && done ? std::launch::async : std::launch::deferred, scene_of);
    if (done) done(effect);
    scene = beside.get();
  } else if (done) {
    done(effect);
  }
  hand_over(action, std::move(scene));
  return effect;
}

std::optional<World::Effect> Operation::act_live(const SceneAction& action, const std::function<bool()>& running,
                                                 const std::function<void()>& held, const Done& done,
                                                 const World::ComponentsOf& components) {
  const auto wait = [&] {
    while (!servo_.taken() && running()) std::this_thread::sleep_for(std::chrono::microseconds(100));
  };
  wait();
  if (!servo_.taken()) return std::nullopt;
  const bool hold = takes_time(action);
  if (hold) {
    act(SceneAction::plain(ActionKind::hold));
    wait();
    if (!servo_.taken()) return std::nullopt;
    held();
  }
  World::Effect effect = act(action, done, components);
  if (!effect.done && hold) act(SceneAction::plain(ActionKind::resume));
  return effect;
}

}  // namespace osteo
