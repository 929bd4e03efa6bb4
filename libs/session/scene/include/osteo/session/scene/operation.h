// A scene that is operated on: its world, what the servo touches of it, and how one changes while the other runs.
#pragma once
#include <functional>
#include <memory>
#include <optional>

#include "osteo/session/scene/detail/stroke_reader.h"
#include "osteo/simulation/haptics/servo.h"

namespace osteo::inline session {

/// Between a world, which is changed step by step, and a servo, which must never wait. An action makes the next world,
/// then what the servo keeps of the bodies that are new, and hands that over; it happens at the beginning of the next
/// tick. While that is prepared in real time, nothing is removed (an action of its own in the stream,
/// ActionKind::hold), so the outcome follows from the stream alone.
class Operation {
 public:
  /// What is given by reference must outlive this. As many devices as the setup has hands.
  Operation(World world, const HapticSetup& setup, const Anatomy& anatomy, std::span<Device* const> devices,
            Stream& stream, double rate_hz);
  /// Of one hand.
  Operation(World world, const HapticSetup& setup, const Anatomy& anatomy, Device& device, Stream& stream,
            double rate_hz);

  bool step(std::int64_t lateness_ns) noexcept { return servo_.step(lateness_ns); }
  /// After the last step: the stream tells of what was done and not yet taken up.
  void finish() noexcept { servo_.finish(); }
  [[nodiscard]] std::uint64_t ticks() const { return servo_.ticks(); }
  [[nodiscard]] double removed_mm3() const { return servo_.removed_mm3(); }
  [[nodiscard]] bool active() const noexcept { return servo_.active(); }
  [[nodiscard]] const World& world() const { return world_; }
  /// With the settings as the last action has left them; in the thread that acts.
  [[nodiscard]] const HapticSetup& setup() const { return setup_; }
  [[nodiscard]] const HapticRenderer& renderer() const { return renderer_; }
  /// To be told of the stream, in any one thread; without it undo knows nothing of the burr's strokes.
  [[nodiscard]] Reader& strokes() { return strokes_; }
  /// In the thread that acts: the world knows of the strokes that strokes() was told of; before each action by itself.
  void take_strokes() { strokes_.report_to(world_); }
  /// The servo has taken up all that was done.
  [[nodiscard]] bool taken() const noexcept { return servo_.taken(); }

  /// Called when the world was changed (ActionRow::changes_world), or a state begins (ActionRow::begins_state), and the
  /// servo does not know it yet: bodies that are new are still as they were made.
  using Done = std::function<void(const World::Effect&)>;
  /// In the thread that also steps; at most one action a tick. Who drains strokes() does so before.
  World::Effect act(const SceneAction& action, const Done& done = {}, const World::ComponentsOf& components = {});
  /// In one other thread, while the servo runs in real time. `running` false: the servo has ended, and nothing is
  /// waited for; none when it did before the action was tried. `held`: called while nothing is removed and before
  /// anything changes, for those that have to be up to date.
  std::optional<World::Effect> act_live(const SceneAction& action, const std::function<bool()>& running,
                                        const std::function<void()>& held, const Done& done = {},
                                        const World::ComponentsOf& components = {});

 private:
  void hand_over(const SceneAction& action, std::unique_ptr<HapticScene> scene);
  World::Effect apply(const SceneAction& action, const World::ComponentsOf& components);
  [[nodiscard]] bool needs_hold(const SceneAction& action) const;

  World world_;
  StrokeReader strokes_;
  HapticSetup setup_;
  HapticsParams given_;  // to the servo, until it has taken them
  HapticRenderer renderer_;
  Servo servo_;
  std::unique_ptr<HapticScene> scene_, old_scene_;
  Handover handover_;
};

}  // namespace osteo::inline session
