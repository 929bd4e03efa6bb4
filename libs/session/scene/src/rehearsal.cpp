#include "osteo/session/scene/rehearsal.h"

#include <pthread.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <exception>

#include "osteo/core/base/error.h"
#include "osteo/imaging/pipeline/pipeline.h"
#include "structure_reader.h"

namespace osteo::inline session {

namespace {

std::vector<std::unique_ptr<Device>> one(std::unique_ptr<Device> device) {
  std::vector<std::unique_ptr<Device>> all;
  all.push_back(std::move(device));
  return all;
}
std::vector<Device*> pointers(const std::vector<std::unique_ptr<Device>>& devices) {
  std::vector<Device*> all;
  for (const auto& d : devices) all.push_back(d.get());
  return all;
}

// Dust and heat begin and end with actions; at first they are as asked.
World as_begun(World world, const ReaderList& follow) {
  world.simulate(Simulated::dust, follow.dust);
  world.simulate(Simulated::heat, follow.heat);
  return world;
}
ReaderList by_action(ReaderList follow) {
  follow.dust_by_action = follow.heat_by_action = true;
  return follow;
}

constexpr const char* kUndoLost =
    "undo history lost: the machine did not keep up, and what was done before that cannot be undone";

double bone_mm3_of(const World& world) {
  double mm3 = 0;
  for (const PlacedBody& b : world.bodies()) mm3 += b.body->bone.sum() * b.body->bone.frame().voxel_volume_mm3();
  return mm3;
}

}  // namespace

Rehearsal::Rehearsal(World world, std::unique_ptr<Device> device, const RehearsalOptions& options,
                     const Context& context)
    : Rehearsal(std::move(world), one(std::move(device)), options, context) {}

Rehearsal::Rehearsal(World world, std::vector<std::unique_ptr<Device>> devices, const RehearsalOptions& options,
                     const Context& context)
    : devices_(std::move(devices)),
      options_(options),
      voxel_mm3_(world.bodies().front().body->bone.frame().voxel_volume_mm3()),
      finest_voxel_mm_(world.finest_voxel_mm()),
      bone_mm3_(bone_mm3_of(world)),
      operation_(as_begun(std::move(world), options.follow), options.haptics, options.anatomy, pointers(devices_),
                 stream_, options.rate_hz),
      dispatcher_(stream_.add_reader(), operation_.world()),
      keeper_end_(stream_.add_reader(Recorder::kTickCapacity)),
      keeper_(keeper_end_, operation_.world()),
      timed_(options.actions.begin(), options.actions.end()) {
  if (!options_.session_file.empty()) {
    SessionHeader header;
    header.program_version = program_version();
    header.bone_hash = operation_.world().hash();
    header.rate_hz = options_.rate_hz;
    header.haptics = options_.haptics;
    header.dust = options_.follow.dust;
    header.heat = options_.follow.heat;
    recorder_ = std::make_unique<Recorder>(stream_.add_reader(Recorder::kTickCapacity), options_.session_file, header);
  }
  keeper_.add(operation_.strokes(), false);
  readers_ = std::make_unique<SceneReaders>(operation_.world(), by_action(options_.follow), options_.rate_hz, context,
                                            structures());
  readers_->add_to(dispatcher_, &keeper_);
  pieces_ = static_cast<int>(readers_->large_pieces().size());
  if (structures() != nullptr) {
    cuts_ = std::make_unique<StructureReader>(*structures(), operation_.world(), options_.rate_hz);
    keeper_.add(*cuts_, false);
  }
  if (options_.soft) {
    options_.soft->meet(&operation_.world());
    dispatcher_.add(*options_.soft, false);
  }
}

Rehearsal::~Rehearsal() {
  if (loop_) loop_->request_stop();
  if (loop_) loop_->join();
  stop_ = true;
  if (thread_.joinable()) thread_.join();
  if (keeper_thread_.joinable()) keeper_thread_.join();
  if (options_.soft) options_.soft->meet(nullptr);
}

bool Rehearsal::running() const {
  return (loop_ && loop_->running()) || elsewhere_;
}

TickRecord Rehearsal::latest(std::size_t hand) const {
  if (seat_now_ == nullptr) return latest_[hand].load();
  return hand == 0 ? seat_now_->load() : latest_[hand == seat_hand_ ? 0 : hand].load();
}

void Rehearsal::seat(Device* device, const Seqlock<TickRecord>* now, std::size_t hand) {
  seat_ = device;
  seat_now_ = now;
  seat_hand_ = hand;
}

// As a replay does: at most one action a tick, the servo's own come by themselves.
void Rehearsal::step_elsewhere(std::span<const SceneAction> actions) {
  elsewhere_ = true;
  for (const SceneAction& a : actions) {
    if (!row_of(a).by_servo) done_elsewhere_.push_back(a);
  }
  {
    // Until the servo has taken it up: who joins meanwhile finds nothing on its way.
    std::unique_lock lock(mutex_, std::defer_lock);
    if (!done_elsewhere_.empty()) {
      lock.lock();
      perform(done_elsewhere_.front(), false);
      done_elsewhere_.pop_front();
    }
    operation_.step(0);
  }
  if (operation_.ticks() % 16 == 0) catch_up();
}

void Rehearsal::end_elsewhere(std::span<const SceneAction> behind) {
  done_elsewhere_.insert(done_elsewhere_.end(), behind.begin(), behind.end());
  const std::lock_guard lock(queue_mutex_);
  for (const SceneAction& a : std::exchange(done_elsewhere_, {})) {
    if (!row_of(a).by_servo) queue_.push_back(a);
  }
}

void Rehearsal::catch_up() {
  if (recorder_) recorder_->drain();
  const std::lock_guard lock(mutex_);
  drain();
}

std::size_t Rehearsal::drain(std::optional<double> about_ms) {
  drain_keeper();
  operation_.take_strokes();
  const std::size_t total = dispatcher_.drain(about_ms);
  if (total == 0) return 0;
  for (std::size_t hand = 0; hand < devices_.size(); ++hand) latest_[hand].store(dispatcher_.latest(hand));
  if (options_.follow.pieces) pieces_ = static_cast<int>(readers_->large_pieces().size());
  return total;
}

void Rehearsal::drain_keeper() {
  const std::lock_guard lock(keeper_mutex_);
  keeper_.drain();
  // Not when the next tick shows the gap: undo may come before that.
  const std::uint64_t dropped =
      keeper_end_.dropped.load(std::memory_order_relaxed) + keeper_end_.actions_dropped.load(std::memory_order_relaxed);
  if (dropped == std::exchange(strokes_dropped_, dropped)) return;
  operation_.strokes().resync(operation_.world());
  strokes_lost_ = true;
}

bool Rehearsal::simulates(Simulated what) {
  const std::lock_guard lock(mutex_);
  return what == Simulated::dust ? readers_->dust != nullptr : readers_->heat != nullptr;
}

void Rehearsal::add_counter(Reader& reader) {
  const std::lock_guard lock(keeper_mutex_);
  keeper_.add(reader, false);
}

void Rehearsal::remove_counter(Reader& reader) {
  const std::lock_guard lock(keeper_mutex_);
  keeper_.remove(reader);
}

void Rehearsal::add_reader(Reader& reader) {
  const std::lock_guard lock(mutex_);
  // What was done to the scene last is told to the others first: whoever joins sees the scene behind it.
  while (!operation_.taken() && running()) std::this_thread::sleep_for(std::chrono::microseconds(100));
  drain();
  dispatcher_.add(reader);
}

void Rehearsal::remove_reader(Reader& reader) {
  const std::lock_guard lock(mutex_);
  dispatcher_.remove(reader);
}

// Under the lock unless live, which takes it. False: the servo had ended before.
bool Rehearsal::perform(const SceneAction& action, bool live) {
  const World::ComponentsOf components = [&](std::uint32_t body) {
    return readers_->pieces ? readers_->pieces->components(body) : nullptr;
  };
  const Operation::Done done = [&](const World::Effect& e) {
    if (row_of(action).begins_state) return dispatcher_.begins(action);
    dispatcher_.scene_changed(e);
    const std::lock_guard lock(keeper_mutex_);
    keeper_.scene_changed(e);
  };
  World::Effect effect;
  std::unique_lock scene(mutex_, std::defer_lock);
  if (live) {
    // Nobody looks at the scene while it changes; the wait for the servo is of a tick or two.
    scene.lock();
    auto live_effect = operation_.act_live(
        action, [&] { return running(); }, [&] { drain(); }, done, components);
    if (!live_effect) return false;
    effect = std::move(*live_effect);
  } else {
    drain();
    effect = operation_.act(action, done, components);
  }
  const bool other_bone = !effect.changed.empty() || !effect.made.empty() || !effect.gone.empty();
  if (options_.follow.pieces && other_bone) pieces_ = static_cast<int>(readers_->large_pieces().size());
  if (live) scene.unlock();
  if (effect.done && cuts_) look_at_cut(action, effect);
  if (!effect.message.empty() && !row_of(action).made_often) {
    const std::lock_guard lock(queue_mutex_);
    const auto kind = static_cast<ActionKind>(action.kind);
    if (!effect.done) refused_ = std::string(name_of(action)) + ": " + effect.message;
    if (!notes_.empty() && notes_.back().kind == kind && notes_.back().done == effect.done &&
        notes_.back().why == effect.message) {
      ++notes_.back().times;
    } else {
      notes_.push_back({operation_.ticks(), kind, effect.done, effect.message, 1});
    }
  }
  return true;
}

// What a saw by its plane or the screws of a plate took of structures: the servo, which looks after touches, knows
// nothing of it. In the thread that changes the scene, so that bodies stay where they are meanwhile.
void Rehearsal::look_at_cut(const SceneAction& action, const World::Effect& effect) {
  std::vector<StructureCut> cuts;
  const bool saw = action.is(ActionKind::saw);
  if (saw) {
    std::vector<VoxelKey> voxels;
    voxels.reserve(effect.dust.size());
    for (const auto& [name, density] : effect.dust) voxels.push_back(name);
    cuts = cuts_->saw(operation_.ticks(), operation_.world(), action.saw_cut(), voxels);
  } else if (action.is(ActionKind::attach)) {
    cuts = cuts_->attach(operation_.ticks(), operation_.world(), action);
  }
  const std::string reported = reported_cut(*structures(), saw ? CutBy::saw : CutBy::plate_screws, cuts);
  if (reported.empty()) return;
  const std::lock_guard lock(queue_mutex_);
  refused_ = reported;
}

// Soft tissue a hundredth of a second further, where the tools are now.
void Rehearsal::move_soft() {
  const std::uint64_t tick = operation_.ticks();
  if (!options_.soft || tick < soft_tick_ || tick == 0) return;
  soft_tick_ = tick + static_cast<std::uint64_t>(std::max(1.0, options_.rate_hz / SoftBody::kUpdatesPerS));
  std::vector<SoftTool> tools;
  for (std::size_t hand = 0; hand < devices_.size(); ++hand) {
    const TickRecord& now = dispatcher_.latest(hand);
    tools.push_back({from_floats(now.device.position_mm), normalized(from_floats(now.device.axis)), now.device.tool,
                     now.speed_rpm > 0});
  }
  for (const SceneAction& push : options_.soft->update(tools)) {
    // In its place: a hand whose turn has not come yet does not lose it.
    const auto before = std::find_if(soft_pushes_.begin(), soft_pushes_.end(),
                                     [&](const SceneAction& a) { return a.hand == push.hand; });
    if (before != soft_pushes_.end()) {
      *before = push;
    } else {
      soft_pushes_.push_back(push);
    }
  }
  tissue_mm3_ = options_.soft->cut_off_mm3();
}

void Rehearsal::act(const SceneAction& action) {
  const std::lock_guard lock(queue_mutex_);
  if (elsewhere_) {
    if (!row_of(action).made_often)
      refused_ = std::string(name_of(action)) + ": the session runs on another machine, and is changed there";
    return;
  }
  const auto same = [&](const SceneAction& before) {
    return before.kind == action.kind && before.body == action.body && before.other == action.other &&
           before.item == action.item && before.hand == action.hand;
  };
  const bool again = row_of(action).last_counts && !queue_.empty() && same(queue_.back());
  if (again) {
    queue_.back() = action;
  } else {
    queue_.push_back(action);
  }
}

void Rehearsal::note(const std::string& kind, const std::string& json) {
  if (recorder_) recorder_->note({operation_.ticks(), kind, json});
  if (options_.heard) options_.heard(kind, json);
}

std::string Rehearsal::take_refusal() {
  const std::lock_guard lock(queue_mutex_);
  return std::exchange(refused_, {});
}

std::string Rehearsal::trouble() const {
  const Recorder::Status s = recording();
  if (s.failure) return std::string("recording has ended: ") + s.failure->what();
  if (s.ticks_lost > 0) return "the disk does not keep up: " + std::to_string(s.ticks_lost) + " ticks are not recorded";
  if (strokes_lost_) return kUndoLost;
  if (s.notes_lost > 0)
    return std::to_string(s.notes_lost) + " notes (camera, marks) are not recorded: they came too fast";
  if (s.behind_s > 3)
    return "the disk is " + std::to_string(std::lround(s.behind_s)) + " s behind; nothing is lost yet";
  for (const auto& device : devices_) {
    if (std::string text = device->trouble(); !text.empty()) return text;
  }
  return {};
}

// What it throws is reported by stop(); a scene that nobody follows is no use to a hand, so the servo ends too.
void Rehearsal::follow() {
  ::pthread_setname_np(::pthread_self(), "osteo-follower");
  try {
    follow_on();
  } catch (...) {
    failure_ = std::current_exception();
    loop_->request_stop();
  }
}

// The lock of the scene may be held by a picture for longer than a ring lasts: what must not be lost needs none.
void Rehearsal::keep() {
  ::pthread_setname_np(::pthread_self(), "osteo-keeper");
  try {
    while (!stop_) {
      drain_keeper();
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
  } catch (...) {
    keeper_failure_ = std::current_exception();
    loop_->request_stop();
  }
}

void Rehearsal::follow_on() {
  while (!stop_) {
    std::optional<SceneAction> action;
    {
      // Where it cannot keep up, others get at the scene between two of these all the same.
      constexpr double kAtOnceMs = 20;
      const std::lock_guard lock(mutex_);
      drain(kAtOnceMs);
      if (running()) move_soft();
    }
    // Of each hand; what was asked for comes between two updates, however long they take.
    for (; !soft_pushes_.empty() && running(); soft_pushes_.pop_front()) perform(soft_pushes_.front(), true);
    // What is due stays where it is until the servo can take it up, or has ended: finish() does the rest.
    if (running()) {
      const std::lock_guard lock(queue_mutex_);
      if (!timed_.empty() && timed_.front().tick <= operation_.ticks()) {
        action = timed_.front();
        timed_.pop_front();
      } else if (!queue_.empty()) {
        action = queue_.front();
        queue_.pop_front();
      }
    }
    if (action) {
      if (perform(*action, true) || row_of(*action).made_often) continue;
      const std::lock_guard lock(queue_mutex_);
      timed_.push_front(*action);
    } else {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }
}

void Rehearsal::start() {
  loop_ = std::make_unique<FixedRateLoop>(options_.rate_hz,
                                          [this](std::int64_t lateness_ns) { return operation_.step(lateness_ns); });
  if (recorder_) recorder_->start();
  loop_->start();
  thread_ = std::thread([this] { follow(); });
  keeper_thread_ = std::thread([this] { keep(); });
}

RehearsalSummary Rehearsal::stop() {
  if (loop_) {
    loop_->request_stop();
    loop_->join();
  }
  stop_ = true;
  if (thread_.joinable()) thread_.join();
  if (keeper_thread_.joinable()) keeper_thread_.join();
  elsewhere_ = false;
  return finish();
}

RehearsalSummary Rehearsal::run_to_end(const Context& context) {
  bool interrupted = false;
  try {
    interrupted = !run_on(context);
  } catch (...) {
    failure_ = std::current_exception();
  }
  RehearsalSummary s = finish();
  s.interrupted = interrupted;
  return s;
}

// False: asked to stop.
bool Rehearsal::run_on(const Context& context) {
  for (;;) {
    std::unique_lock lock(mutex_, std::defer_lock);
    // Until the servo has taken it up: who joins meanwhile finds nothing on its way.
    if (!timed_.empty() && timed_.front().tick <= operation_.ticks() && operation_.active()) {
      lock.lock();
      perform(timed_.front(), false);
      timed_.pop_front();
    } else if (options_.soft && (operation_.ticks() >= soft_tick_ || !soft_pushes_.empty()) && operation_.active()) {
      // One action a tick: what was to be done comes first.
      lock.lock();
      drain();
      move_soft();
      if (!soft_pushes_.empty()) {
        perform(soft_pushes_.front(), false);
        soft_pushes_.pop_front();
      }
    }
    if (!operation_.step(0)) return true;
    if (operation_.ticks() % 64 != 0) continue;
    if (context.cancelled()) return false;
    if (recorder_) recorder_->drain();
    if (recording().failure) return true;
    if (!lock.owns_lock()) lock.lock();
    drain();
  }
}

// Closes the session whatever happened before.
RehearsalSummary Rehearsal::finish() {
  if (summary_) return *summary_;
  if (loop_ && loop_->failure() && !failure_) failure_ = loop_->failure();
  if (!failure_) failure_ = keeper_failure_;
  RehearsalSummary s;
  std::string dust_hash;
  operation_.finish();  // what was handed over belongs to the stream, whatever failed
  if (!failure_) {
    try {
      const std::lock_guard lock(mutex_);
      drain();
      // Due before the last tick or asked for, but the servo had ended first.
      const auto take_due = [&]() -> std::optional<SceneAction> {
        const std::lock_guard queue_lock(queue_mutex_);
        auto& from = !timed_.empty() && timed_.front().tick < operation_.ticks() ? timed_ : queue_;
        if (from.empty()) return std::nullopt;
        const SceneAction action = from.front();
        from.pop_front();
        return action;
      };
      while (const auto action = take_due()) {
        perform(*action, false);
        operation_.finish();
        drain();
      }
      dispatcher_.end(operation_.ticks());
      const std::lock_guard keeper_lock(keeper_mutex_);
      keeper_.end(operation_.ticks());
      s.surface_hash = readers_->surface_hash();
      s.pieces = readers_->large_pieces();
      if (readers_->dust) {
        const Dust& dust = readers_->dust->dust();
        s.dust = dust.totals();
        if (dispatcher_.ticks_lost() == 0)
          dust_hash = dust.hash();  // else the same dust, but later: a replay's lies elsewhere
      }
    } catch (...) {
      failure_ = std::current_exception();
    }
  }
  s.ticks = operation_.ticks();
  s.removed_mm3 = operation_.removed_mm3();
  s.sawn_mm3 = readers_->tools.sawn_mm3();
  s.crumbs_mm3 = readers_->tools.crumbs_mm3();
  s.tissue_mm3 = tissue_mm3_;
  s.tissue = tissue();
  // After a failure nobody knows whether all of it went into the stream.
  if (!failure_) {
    s.bone_hash = operation_.world().hash();
    // Bodies may be summed in another order than at the beginning.
    const double gone = bone_mm3_ - bone_mm3_of(operation_.world());
    s.gone_mm3 = gone > 1e-9 * bone_mm3_ ? gone : 0;
  }
  s.ticks_not_followed = dispatcher_.ticks_lost();
  if (strokes_lost_) s.warnings.emplace_back(kUndoLost);
  s.voxel_mm3 = voxel_mm3_;
  s.bodies = operation_.world().bodies().size();
  s.fixtures = operation_.world().fixtures();
  s.structures = operation_.renderer().structure_events();
  s.notes = notes_;
  if (cuts_) s.structure_cuts = cuts_->events();
  s.unusable_poses = readers_->tools.unusable_poses();
  if (loop_) s.loop = loop_->stats();
  for (const std::uint8_t tool : readers_->tools.burrs_used()) {
    const Burr* const edge = instrument_of(tool).cutter();
    if (edge == nullptr) continue;
    if (std::string text = too_small_for_voxels(*edge, finest_voxel_mm_); !text.empty())
      s.warnings.push_back(std::move(text));
  }
  if (const std::uint64_t n = readers_->tools.ticks_without_room(); n > 0)
    s.warnings.push_back("in " + std::to_string(n) +
                         " ticks bone was left at the burr's rim, since too much of the bone is drilled in part to "
                         "remember it all: larger "
                         "voxels, or a smaller region, need less");
  if (recorder_) {
    recorder_->finish({s.ticks, s.bone_hash, s.surface_hash, s.removed_mm3, dust_hash, 0, 0},
                      [&](std::vector<VoxelChange>& all) {
                        for (const PlacedBody& b : operation_.world().bodies()) {
                          const BrickGrid& bone = b.body->bone;
                          for (VoxelKey v = 0; v < bone.brick_count() * BrickGrid::kVoxels; ++v)
                            all.push_back({b.body->name_of(v), bone.value(v)});
                        }
                      });
    s.session_bytes = recorder_->bytes();
    s.gaps = recorder_->gaps();
    s.ticks_not_recorded = recorder_->status().ticks_lost;
    s.notes_not_recorded = recorder_->status().notes_lost;
    if (const auto failure = recorder_->status().failure; failure && !failure_)
      failure_ = std::make_exception_ptr(Error(*failure));
  }
  if (failure_) std::rethrow_exception(failure_);
  summary_ = s;
  return s;
}

HapticsParams Rehearsal::settings() const {
  const std::lock_guard lock(mutex_);
  return operation_.setup().params;
}

void Rehearsal::look(const std::function<void(const World&, SceneReaders&)>& f) {
  const std::lock_guard lock(mutex_);
  f(operation_.world(), *readers_);
}

}  // namespace osteo::inline session
