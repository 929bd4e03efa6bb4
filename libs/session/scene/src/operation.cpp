#include "osteo/session/scene/operation.h"

#include <chrono>
#include <future>
#include <thread>

#include "osteo/core/base/error.h"

namespace osteo::inline session {

Operation::Operation(World world, const HapticSetup& setup, const Anatomy& anatomy, std::span<Device* const> devices,
                     Stream& stream, double rate_hz)
    : world_(std::move(world)),
      setup_(setup),
      renderer_(setup, anatomy, 1 / rate_hz),
      servo_(renderer_, devices, stream, rate_hz) {
  scene_ = std::make_unique<HapticScene>(HapticScene::of(world_, setup_));
  renderer_.show(scene_.get());
}

Operation::Operation(World world, const HapticSetup& setup, const Anatomy& anatomy, Device& device, Stream& stream,
                     double rate_hz)
    : Operation(std::move(world), setup, anatomy, std::array<Device*, 1>{&device}, stream, rate_hz) {}

// Only when nothing posted before waits: the scene before the last is then nobody's any more.
void Operation::hand_over(const SceneAction& action, std::unique_ptr<HapticScene> scene) {
  handover_ = {action, nullptr, world_.held(), nullptr};
  if (scene) {
    old_scene_ = std::exchange(scene_, std::move(scene));
    handover_.scene = scene_.get();
  }
  if (action.is(ActionKind::setting)) {
    given_ = setup_.params;
    handover_.settings = &given_;
  }
  servo_.post(&handover_);
}

// The settings are the operation's own; all else is the world's.
World::Effect Operation::apply(const SceneAction& action, const World::ComponentsOf& components) {
  take_strokes();
  World::Effect effect = world_.act(action, components);
  if (!effect.done || !action.is(ActionKind::setting)) return effect;
  try {
    change_setting(setup_.params, action.item, action.values[0]);
  } catch (const Error& e) {
    effect.done = false;
    effect.message = e.what();
  }
  return effect;
}

World::Effect Operation::act(const SceneAction& action, const Done& done, const World::ComponentsOf& components) {
  World::Effect effect = apply(action, components);
  if (!effect.done) return effect;
  const ActionRow& row = row_of(action);
  // What the servo needs and what its followers need, side by side.
  const auto scene_of = [&] { return std::make_unique<HapticScene>(HapticScene::of(world_, setup_, scene_.get())); };
  std::unique_ptr<HapticScene> scene;
  if (row.changes_touch) {
    auto beside = std::async(row.reads_bone && done ? std::launch::async : std::launch::deferred, scene_of);
    if (row.changes_world && done) done(effect);
    scene = beside.get();
  } else if (row.begins_state && done) {
    done(effect);
  }
  hand_over(action, std::move(scene));
  return effect;
}

// A distance map that was not wanted before is made of the bone as it is.
bool Operation::needs_hold(const SceneAction& action) const {
  if (!action.is(ActionKind::setting)) return row_of(action).reads_bone;
  HapticSetup next = setup_;
  try {
    change_setting(next.params, action.item, action.values[0]);
  } catch (const Error&) {
    return false;  // apply() rejects it
  }
  return scene_->needs_bone_held(next);
}

std::optional<World::Effect> Operation::act_live(const SceneAction& action, const std::function<bool()>& running,
                                                 const std::function<void()>& held, const Done& done,
                                                 const World::ComponentsOf& components) {
  const auto wait = [&] {
    while (!servo_.taken() && running()) std::this_thread::sleep_for(std::chrono::microseconds(100));
  };
  wait();
  if (!servo_.taken()) return std::nullopt;
  const bool hold = needs_hold(action);
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

}  // namespace osteo::inline session
