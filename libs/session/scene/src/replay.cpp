#include <algorithm>
#include <chrono>
#include <deque>

#include "osteo/core/base/error.h"
#include "osteo/core/base/param.h"
#include "osteo/session/recording/session_reader.h"
#include "osteo/session/scene/rehearsal.h"

namespace osteo::inline session {

namespace {

// Gives the servo the sample of the tick that is repeated.
class RecordedHand final : public Device {
 public:
  DeviceSample read(std::uint64_t, double, Vec3) noexcept override { return sample; }
  DeviceSample sample;
};

void check_same_case(const SessionReader& session, const World& start, const Anatomy& anatomy) {
  const SessionHeader& header = session.header();
  if (const std::string& why = session.outline().not_replayable; !why.empty())
    throw Error(ExitCode::corrupt, "the session cannot be repeated by this version: " + why,
                "replay it with " + header.program_version +
                    "; 'osteo export', 'osteo export-result' and --resume use it all the same");
  if (start.hash() != header.bone_hash) {
    throw Error(ExitCode::corrupt, "the session was recorded on another bone than this case's",
                "give the case it was recorded on, unchanged");
  }
  if (header.haptics.hardness.value_or(false) != (anatomy.hardness != nullptr)) {
    throw Error(ExitCode::usage, "the session went by the hardness of the bone, which this case does not tell",
                "the case needs its hu.vdb");
  }
  if (header.haptics.structures != (anatomy.structures ? anatomy.structures->hash() : "")) {
    throw Error(ExitCode::corrupt, "the session watched other critical structures than this case has",
                "give the case it was recorded on, unchanged");
  }
  const std::vector<std::string>& opened = header.haptics.opened;
  for (std::size_t n = 0; anatomy.structures && n < anatomy.structures->values().size(); ++n) {
    const std::string name = anatomy.structures->name_of(anatomy.structures->values()[n]);
    if (anatomy.structures->opened(n) != (std::find(opened.begin(), opened.end(), name) != opened.end()))
      throw Error(ExitCode::usage, "'" + name + "' is opened by the operation that was recorded, or by this one alone",
                  "an anatomy is made from the session's own setup (anatomy_of)");
  }
}

// The servo once more, and the recorded changes beside it.
class Replaying {
 public:
  Replaying(const SessionReader& session, World start, const Anatomy& anatomy, const Context& context,
            std::span<Reader* const> readers)
      : session_(session),
        context_(context),
        known_until_(session.outline().bone_known_until()),
        from_changes_(start.copy()),
        from_checkpoints_(start.copy()),
        checkpoints_(session.checkpoints()),
        hands_(session.header().haptics.hands()),
        reader_(stream_.add_reader()),
        operation_(std::move(start), session.header().haptics, anatomy, devices(), stream_, session.header().rate_hz),
        dispatcher_(stream_.add_reader(), operation_.world()),
        // Dust follows from the stream, so it has to come out the same as well.
        readers_(operation_.world(), {.surface = false, .dust_by_action = true}, session.header().rate_hz, context) {
    dispatcher_.add(operation_.strokes(), false);
    readers_.add_to(dispatcher_);
    for (Reader* const r : readers) dispatcher_.add(*r);
  }

  void take(const SessionPart& part) {
    if (part.gap != nullptr) end_repeating(*part.gap);
    if (part.gap != nullptr && part.gap == known_until_) changes_apply_ = false;
    if (changes_apply_) apply_part(part, from_changes_);
    result_.actions += part.actions.size();
    if (repeating_) actions_.insert(actions_.end(), part.actions.begin(), part.actions.end());
    // A frame holds whole ticks.
    const std::span<const TickRecord> records(part.ticks);
    for (std::size_t first = 0; first + hands_.size() <= records.size(); first += hands_.size()) {
      const auto tick = records.subspan(first, hands_.size());
      if (repeating_) {
        repeat(tick);
      } else {
        for (const TickRecord& t : tick) result_.removed_mm3 += static_cast<double>(t.removed_mm3);
      }
      ++result_.ticks;
    }
    if (part.checkpoint && repeating_) compare_at(*part.checkpoint);
  }

  ReplayResult finish() {
    const SessionOutline& o = session_.outline();
    if (repeating_) do_all();
    if (repeating_) end_readers();
    if (repeating_ && from_changes_.hash() != operation_.world().hash()) differ_in_bone();
    result_.structures = operation_.renderer().structure_events();
    result_.losses = losses(o);
    const bool dust = o.end && !o.end->dust_hash.empty();
    if ((o.header.dust || dust) && o.header.dust_model != kDustModel)
      result_.losses.push_back("dust of model " + std::to_string(o.header.dust_model) + ", which this version (model " +
                               std::to_string(kDustModel) + ") does not have: where it lay at the end is not compared");
    result_.bone_hash = from_changes_.hash();
    result_.surface_hash = SurfaceReader(from_changes_, context_).hash();
    if (readers_.dust && repeating_) result_.dust_hash = readers_.dust->dust().hash();
    result_.complete = o.end.has_value();
    if (o.end && known_until_ == nullptr) {
      const auto compare = [&](const std::string& recorded, const std::string& now, const char* what) {
        if (!recorded.empty() && recorded != now) differ(std::string("the ") + what + " came out differently");
      };
      compare(o.end->bone_hash, result_.bone_hash, "bone");
      compare(o.end->surface_hash, result_.surface_hash, "surface");
      // Dust of another model lies elsewhere; nothing else depends on it.
      if (repeating_ && o.header.dust_model == kDustModel) compare(o.end->dust_hash, result_.dust_hash, "dust");
    }
    if (result_.difference_since_s)
      result_.difference += ", between the checkpoints at " + format_number(*result_.difference_since_s) + " s and " +
                            (failed_before_s_ ? format_number(*failed_before_s_) + " s" : "the end");
    result_.world = std::make_shared<const World>(std::move(from_changes_));
    result_.identical = result_.difference.empty();
    return std::move(result_);
  }

 private:
  void differ(const std::string& what) {
    if (!result_.difference.empty()) return;
    result_.difference = what;
    result_.difference_since_s = seconds(checkpoint_);
  }
  void differ_in_bone() { differ("the recorded voxel changes give another bone than the recorded poses"); }
  [[nodiscard]] double seconds(std::uint64_t tick) const {
    return static_cast<double>(tick) / session_.header().rate_hz;
  }

  std::vector<Device*> devices() {
    std::vector<Device*> all;
    for (RecordedHand& h : hands_) all.push_back(&h);
    return all;
  }

  // The next whose tick has come.
  void act() {
    const SceneAction action = actions_.front();
    actions_.pop_front();
    if (row_of(action).by_servo) {  // not done again: it has to come again
      if (own_.empty() || own_.front() != std::pair(action.kind, action.tick)) {
        differ("at tick " + std::to_string(action.tick) + " '" + std::string(name_of(action)) +
               "' came out differently");
      } else {
        own_.pop_front();
      }
      return;
    }
    dispatcher_.drain();
    const World::Effect effect = operation_.act(action, [&](const World::Effect& e) {
      if (row_of(action).begins_state) return dispatcher_.begins(action);
      dispatcher_.scene_changed(e);
    });
    if (!effect.done)
      differ("at tick " + std::to_string(action.tick) + " '" + std::string(name_of(action)) +
             "' could not be done: " + effect.message);
  }
  // Behind the last tick.
  void do_all() {
    for (; !actions_.empty(); operation_.finish()) act();
    if (!own_.empty())
      differ("a stroke ended at tick " + std::to_string(own_.front().second) + " that was not recorded");
  }
  void end_readers() {
    dispatcher_.drain();
    dispatcher_.end(result_.ticks_repeated);
  }

  // The records of all hands of a tick.
  void repeat(std::span<const TickRecord> recorded) {
    if (recorded.front().tick % 256 == 0) {
      const double ticks = static_cast<double>(session_.outline().tick_records) / static_cast<double>(hands_.size());
      context_.progress(0.9 * static_cast<double>(result_.ticks) / ticks, "replay");
      dispatcher_.drain();
    }
    // At most one a tick is done; the servo's own come with its step.
    if (!actions_.empty() && actions_.front().tick <= recorded.front().tick && !row_of(actions_.front()).by_servo)
      act();
    for (std::size_t h = 0; h < recorded.size(); ++h) hands_[h].sample = recorded[h].device;
    operation_.step(0);
    std::array<TickRecord, kMaxHands> now;
    reader_.ticks.pop({now.data(), recorded.size()});
    while (reader_.changes.pop(changes_) > 0) {
    }
    for (SceneAction done; reader_.actions.pop({&done, 1}) > 0;) {
      if (row_of(done).by_servo) own_.emplace_back(done.kind, done.tick);
    }
    while (!actions_.empty() && actions_.front().tick <= recorded.front().tick && row_of(actions_.front()).by_servo)
      act();
    for (std::size_t h = 0; h < recorded.size(); ++h) {
      if (const RecordField* const f = first_difference(session_.outline().tick_fields, &now[h], &recorded[h]))
        differ("tick " + std::to_string(recorded[h].tick) +
               (recorded.size() > 1 ? ", hand " + std::to_string(h) + "," : "") + " came out differently (" +
               std::string(f->name) + ")");
      result_.removed_mm3 += static_cast<double>(now[h].removed_mm3);
    }
    ++result_.ticks_repeated;
  }

  // Behind it only bone is known.
  void end_repeating(const Gap& gap) {
    if (!repeating_) return;
    do_all();
    end_readers();
    repeating_ = false;
    // Damage may have taken the changes of the ticks before it.
    if (gap.bytes == 0 && from_changes_.hash() != operation_.world().hash()) differ_in_bone();
  }

  void compare_at(std::uint64_t tick) {
    do_all();
    while (const SessionPart* const part = checkpoints_.next()) {
      if (part->checkpoint) break;
      apply_part(*part, from_checkpoints_);
    }
    const std::string repeated = operation_.world().hash();
    if (repeated != from_changes_.hash()) differ_in_bone();
    if (repeated != from_checkpoints_.hash())
      differ("the checkpoint at " + format_number(seconds(tick)) + " s holds another bone");
    if (result_.difference_since_s && !failed_before_s_) failed_before_s_ = seconds(tick);
    checkpoint_ = tick;
  }

  const SessionReader& session_;
  const Context& context_;
  const Gap* known_until_;
  World from_changes_, from_checkpoints_;  // the second way and the third
  SessionReader::Parts checkpoints_;
  std::vector<RecordedHand> hands_;
  Stream stream_;
  StreamReader& reader_;
  Operation operation_;
  ReaderDispatcher dispatcher_;
  SceneReaders readers_;
  std::deque<SceneAction> actions_;  // whose tick has not come
  std::deque<std::pair<std::uint32_t, std::uint64_t>>
      own_;  // kind and tick of what the servo told of itself, not compared yet
  std::vector<VoxelChange> changes_ = std::vector<VoxelChange>(1 << 16);
  bool repeating_ = true, changes_apply_ = true;
  std::uint64_t checkpoint_ = 0;
  std::optional<double> failed_before_s_;
  ReplayResult result_;
};

}  // namespace

void apply_recorded(const SessionReader& session, World& world) {
  auto parts = session.parts();
  while (const SessionPart* const part = parts.next()) apply_part(*part, world);
}

std::uint64_t apply_recorded_until(const SessionReader& session, World& world, std::uint64_t tick) {
  std::uint64_t reached = 0;
  auto parts = session.scene_at(tick, reached);
  while (const SessionPart* const part = parts.next()) apply_part(*part, world);
  return reached;
}

ReplayResult replay(const SessionReader& session, World start, const Anatomy& anatomy, const Context& context,
                    std::span<Reader* const> readers) {
  const auto begin = std::chrono::steady_clock::now();
  check_same_case(session, start, anatomy);
  start.simulate(Simulated::dust, session.header().dust);
  start.simulate(Simulated::heat, session.header().heat);
  Replaying again(session, std::move(start), anatomy, context, readers);
  auto parts = session.parts();
  while (const SessionPart* const part = parts.next()) again.take(*part);
  ReplayResult result = again.finish();
  result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return result;
}

}  // namespace osteo::inline session
