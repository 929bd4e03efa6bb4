#include "osteo/scene/operation.h"

#include <chrono>
#include <future>
#include <thread>

namespace osteo {
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
  const ActionRow& row = row_of(action);
  // What the servo needs and what its followers need, side by side.
  const auto scene_of = [&] { return std::make_unique<HapticScene>(HapticScene::of(world_, renderer_.setup(), scene_.get())); };
  std::unique_ptr<HapticScene> scene;
  if (row.changes_touch) {
    auto beside = std::async(row.reads_bone && done ? std::launch::async : std::launch::deferred, scene_of);
    if (row.changes_world && done) done(effect);
    scene = beside.get();
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
  const bool hold = row_of(action).reads_bone;
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
