#include "osteo/scene/rehearsal.h"

#include <algorithm>
#include <chrono>

#include "osteo/base/error.h"
#include "osteo/pipeline/pipeline.h"

namespace osteo {

Rehearsal::Rehearsal(World world, std::unique_ptr<Device> device, const RehearsalOptions& options, const Context& context)
    : device_(std::move(device)),
      options_(options),
      voxel_mm3_(world.bodies().front().body->bone.frame().voxel_volume_mm3()),
      operation_(std::move(world), options.haptics, options.anatomy, *device_, stream_, options.rate_hz),
      timed_(options.actions.begin(), options.actions.end()) {
  if (!options_.session_file.empty()) {
    SessionHeader header;
    header.program_version = program_version();
    header.bone_hash = operation_.world().hash();
    header.rate_hz = options_.rate_hz;
    header.haptics = options_.haptics;
    header.dust = options_.follow.dust;
    recorder_ = std::make_unique<Recorder>(stream_.add_reader(), options_.session_file, header);
  }
  if (options_.follow.surface || options_.follow.pieces || options_.follow.dust || options_.soft) reader_ = &stream_.add_reader();
  follower_ = std::make_unique<Follower>(operation_.world(), options_.follow, options_.rate_hz, context);
  pieces_ = static_cast<int>(follower_->large_pieces().size());
  if (options_.soft) options_.soft->meet(&operation_.world());
}

Rehearsal::~Rehearsal() {
  if (loop_) loop_->request_stop();
  if (loop_) loop_->join();
  stop_ = true;
  if (thread_.joinable()) thread_.join();
  if (options_.soft) options_.soft->meet(nullptr);
}

bool Rehearsal::running() const {
  return loop_ && loop_->running();
}

std::size_t Rehearsal::drain() {
  if (reader_ == nullptr) return 0;
  const std::size_t total = follower_->drain(*reader_);
  if (total == 0) return 0;
  latest_.store(follower_->latest());
  removed_mm3_ = follower_->removed_mm3();
  if (options_.follow.pieces) pieces_ = static_cast<int>(follower_->large_pieces().size());
  return total;
}

void Rehearsal::perform(const SceneAction& action, bool live) {
  const World::ComponentsOf components = [&](std::uint32_t body) { return follower_->components(body); };
  const Operation::Done done = [&](const World::Effect& e) { follower_->follow(operation_.world(), e); };
  World::Effect effect;
  if (live) {
    // Nobody looks at the scene while it changes; the wait for the servo is of a tick or two.
    const std::lock_guard lock(mutex_);
    effect = operation_.act_live(
        action, [&] { return running(); }, [&] { drain(); }, done, components);
  } else {
    drain();
    effect = operation_.act(action, done, components);
  }
  const bool other_bone = !effect.changed.empty() || !effect.made.empty() || !effect.gone.empty();
  if (options_.follow.pieces && other_bone) pieces_ = static_cast<int>(follower_->large_pieces().size());
  // Soft tissue yields again with its next update.
  if (!effect.message.empty() && !action.is(ActionKind::yield)) {
    const std::lock_guard lock(queue_mutex_);
    const auto kind = static_cast<ActionKind>(action.kind);
    if (!effect.done) refused_ = std::string(name_of(kind)) + ": " + effect.message;
    if (!notes_.empty() && notes_.back().kind == kind && notes_.back().done == effect.done && notes_.back().why == effect.message) {
      ++notes_.back().times;
    } else {
      notes_.push_back({operation_.ticks(), kind, effect.done, effect.message, 1});
    }
  }
}

// Soft tissue a hundredth of a second further, where the tool is now.
std::optional<SceneAction> Rehearsal::move_soft() {
  const std::uint64_t tick = operation_.ticks();
  const TickRecord& now = follower_->latest();
  if (!options_.soft || tick < soft_tick_ || tick == 0 || now.device.tool >= burr_library().size()) return std::nullopt;
  soft_tick_ = tick + static_cast<std::uint64_t>(std::max(1.0, options_.rate_hz / SoftBody::kUpdatesPerS));
  const auto yield = options_.soft->update(
      {from_floats(now.device.position_mm), normalized(from_floats(now.device.axis)), now.device.tool, now.device.drill_on != 0});
  tissue_mm3_ = options_.soft->cut_off_mm3();
  return yield;
}

void Rehearsal::act(const SceneAction& action) {
  const std::lock_guard lock(queue_mutex_);
  // Of several moves of the same kind that nobody has seen yet the last is enough.
  const bool again = !queue_.empty() && queue_.back().kind == action.kind && queue_.back().body == action.body &&
                     queue_.back().item == action.item &&
                     (action.is(ActionKind::move) || action.is(ActionKind::grip) || action.is(ActionKind::open) ||
                      action.is(ActionKind::suction) || action.is(ActionKind::irrigate));
  if (again) {
    queue_.back() = action;
  } else {
    queue_.push_back(action);
  }
}

std::string Rehearsal::take_refusal() {
  const std::lock_guard lock(queue_mutex_);
  return std::exchange(refused_, {});
}

void Rehearsal::follow() {
  while (!stop_) {
    std::optional<SceneAction> action;
    {
      const std::lock_guard lock(mutex_);
      drain();
      if (running()) action = move_soft();
    }
    if (!action) {
      const std::lock_guard lock(queue_mutex_);
      if (!timed_.empty() && timed_.front().tick <= operation_.ticks()) {
        action = timed_.front();
        timed_.pop_front();
      } else if (!queue_.empty()) {
        action = queue_.front();
        queue_.pop_front();
      }
    }
    if (action && running()) {
      perform(*action, true);
    } else {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }
}

void Rehearsal::start() {
  loop_ = std::make_unique<FixedRateLoop>(options_.rate_hz, [this](std::int64_t lateness_ns) { return operation_.step(lateness_ns); });
  if (recorder_) recorder_->start();
  thread_ = std::thread([this] { follow(); });
  loop_->start();
}

RehearsalSummary Rehearsal::stop() {
  if (loop_) {
    loop_->request_stop();
    loop_->join();
  }
  stop_ = true;
  if (thread_.joinable()) thread_.join();
  return finish();
}

RehearsalSummary Rehearsal::run_to_end(const Context& context) {
  for (;;) {
    if (!timed_.empty() && timed_.front().tick <= operation_.ticks() && device_->active(operation_.ticks())) {
      perform(timed_.front(), false);
      timed_.pop_front();
    } else if (options_.soft && operation_.ticks() >= soft_tick_ && device_->active(operation_.ticks())) {
      // One action a tick: what was to be done comes first.
      drain();
      if (const auto yield = move_soft()) perform(*yield, false);
    }
    if (!operation_.step(0)) break;
    if (operation_.ticks() % 64 != 0) continue;
    context.check_cancelled();
    if (recorder_) recorder_->drain();
    drain();
  }
  return finish();
}

RehearsalSummary Rehearsal::finish() {
  operation_.finish();
  drain();
  if (recorder_) recorder_->stop();
  RehearsalSummary s;
  s.ticks = operation_.ticks();
  s.removed_mm3 = recorder_ ? recorder_->removed_mm3() : removed_mm3_.load();
  s.sawn_mm3 = follower_->sawn_mm3();
  s.tissue_mm3 = tissue_mm3_;
  s.bone_hash = operation_.world().hash();
  s.surface_hash = follower_->surface_hash();
  if (reader_ != nullptr) s.dropped = reader_->dropped;
  s.voxel_mm3 = voxel_mm3_;
  s.pieces = follower_->large_pieces();
  s.bodies = operation_.world().bodies().size();
  s.fixtures = operation_.world().fixtures();
  std::string dust_hash;
  if (const Dust* const dust = follower_->dust()) {
    s.dust = dust->totals();
    dust_hash = dust->hash();
  }
  if (recorder_) {
    if (recorder_->failure()) throw Error(*recorder_->failure());
    recorder_->finish({s.ticks, s.bone_hash, s.surface_hash, s.removed_mm3, dust_hash});
    s.session_bytes = recorder_->bytes();
  }
  s.structures = follower_->structure_events();
  s.notes = notes_;
  s.unusable_poses = follower_->unusable_poses();
  if (loop_) s.loop = loop_->stats();
  return s;
}

void Rehearsal::look(const std::function<void(const World&, Follower&)>& f) {
  const std::lock_guard lock(mutex_);
  f(operation_.world(), *follower_);
}

}  // namespace osteo
