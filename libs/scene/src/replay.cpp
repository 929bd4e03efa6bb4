#include <chrono>
#include <cstddef>
#include <cstring>
#include <deque>

#include "osteo/base/error.h"
#include "osteo/scene/rehearsal.h"

namespace osteo {

namespace {

// From where an earlier call ended.
struct Applied {
  std::size_t changes = 0, actions = 0;
};

void apply(const Session& session, World& world, Applied& done, std::size_t changes_end, std::size_t actions_end) {
  const auto apply_until = [&](std::size_t end) {
    for (; done.changes < end; ++done.changes) {
      const VoxelChange& c = session.changes[done.changes];
      const PlacedBody* const b = world.owner(c.voxel);
      if (b == nullptr) throw Error(ExitCode::corrupt, "the session changes a voxel that the bone does not have");
      BrickGrid& bone = b->body->bone;
      const VoxelKey own = c.voxel - b->body->name_of(0);
      // The last density of a voxel before each action is enough: strokes end at actions, and what was before them is in the bone.
      const VoxelChange change{c.voxel, c.density, bone.value(own)};
      bone.set(own, c.density);
      world.tell({&change, 1});
    }
  };
  for (; done.actions < actions_end; ++done.actions) {
    apply_until(session.actions[done.actions].changes_before);
    const SceneAction& action = session.actions[done.actions].action;
    if (!row_of(action).by_servo) world.act(action);
    world.tell(action);
  }
  apply_until(changes_end);
}

}  // namespace

void apply_recorded(const Session& session, World& world, const Gap* until) {
  Applied done;
  apply(session, world, done, until ? until->changes_before : session.changes.size(),
        until ? until->actions_before : session.actions.size());
}

ReplayResult replay(const Session& session, World start, const Anatomy& anatomy, const Context& context, std::span<Reader* const> readers) {
  const auto begin = std::chrono::steady_clock::now();
  ReplayResult result;
  if (start.hash() != session.header.bone_hash) {
    throw Error(ExitCode::corrupt, "the session was recorded on another bone than this case's",
                "give the case it was recorded on, unchanged");
  }
  if (session.header.haptics.hardness.value_or(false) != (anatomy.hardness != nullptr)) {
    throw Error(ExitCode::usage, "the session went by the hardness of the bone, which this case does not tell",
                "the case needs its hu.vdb");
  }
  if (session.header.haptics.structures != (anatomy.structures ? anatomy.structures->hash() : "")) {
    throw Error(ExitCode::corrupt, "the session watched other structures at risk than this case has",
                "give the case it was recorded on, unchanged");
  }
  // Up to the first gap; behind it only bone is known.
  const Gap* const gap = session.gaps.empty() ? nullptr : &session.gaps.front();
  const std::span repeated(session.ticks.data(), gap ? gap->ticks_before : session.ticks.size());
  const auto actions_end = session.actions.begin() + static_cast<std::ptrdiff_t>(gap ? gap->actions_before : session.actions.size());
  result.losses = losses(session);
  std::vector<DeviceSample> samples;
  samples.reserve(repeated.size());
  for (const TickRecord& t : repeated) samples.push_back(t.device);
  World from_changes = start.copy();  // the second way: apply the recorded changes
  ReplayDevice device(std::move(samples));
  Stream stream;
  StreamReader& reader = stream.add_reader();
  Operation operation(std::move(start), session.header.haptics, anatomy, device, stream, session.header.rate_hz);
  // As live: undo knows the strokes, dust follows from the stream and has to come out the same as well.
  ReaderHub hub(stream.add_reader(), operation.world());
  hub.add(operation.strokes(), false);
  SceneReaders own(operation.world(), {false, false, session.header.dust}, session.header.rate_hz, context);
  own.add_to(hub);
  for (Reader* const r : readers) hub.add(*r);
  std::vector<VoxelChange> changes(1 << 16);
  SceneAction action;
  const auto differ = [&](const std::string& what) {
    if (result.difference.empty()) result.difference = what;
  };
  auto next = session.actions.begin();
  // What the servo tells of itself is not done again, but has to come again.
  std::deque<std::uint64_t> strokes;
  const auto told = [&] {
    while (reader.actions.pop({&action, 1}) > 0) {
      if (row_of(action).by_servo) strokes.push_back(action.tick);
    }
  };
  const auto act = [&] {
    hub.drain();
    const World::Effect effect = operation.act(next->action, [&](const World::Effect& e) { hub.scene_changed(e); });
    if (!effect.done)
      differ("at tick " + std::to_string(next->action.tick) + " '" + std::string(name_of(next->action)) +
             "' could not be done: " + effect.message);
    ++next;
  };
  const auto expect_strokes = [&](std::uint64_t tick) {
    for (; next != actions_end && row_of(next->action).by_servo && next->action.tick <= tick; ++next) {
      if (strokes.empty() || strokes.front() != next->action.tick) {
        differ("the stroke that ended at tick " + std::to_string(next->action.tick) + " came out differently");
      } else {
        strokes.pop_front();
      }
    }
  };
  for (const TickRecord& recorded : repeated) {
    if (recorded.tick % 256 == 0) {
      context.progress(0.9 * static_cast<double>(recorded.tick) / static_cast<double>(repeated.size()), "replay");
      hub.drain();
    }
    if (next != actions_end && next->action.tick == recorded.tick && !row_of(next->action).by_servo) act();
    operation.step(0);
    TickRecord now;
    reader.ticks.pop({&now, 1});
    while (reader.changes.pop(changes) > 0) {
    }
    told();
    expect_strokes(recorded.tick);
    // Bytes, not numbers: the same bits or not.
    constexpr std::size_t kRepeated = offsetof(TickRecord, work_us);
    const bool same = std::memcmp(&now, &recorded, kRepeated) == 0;
    if (!same) differ("tick " + std::to_string(recorded.tick) + " came out differently");
    result.removed_mm3 += static_cast<double>(now.removed_mm3);
  }
  for (; next != actions_end; operation.finish()) act();  // done in the last moment
  if (!strokes.empty()) differ("a stroke ended at tick " + std::to_string(strokes.front()) + " that was not recorded");
  hub.drain();
  hub.end(repeated.size());
  result.ticks = session.ticks.size();
  result.ticks_repeated = repeated.size();
  result.actions = session.actions.size();
  result.structures = operation.renderer().structure_events();
  Applied done;
  if (gap == nullptr || gap->bytes == 0) {  // damage may have taken the changes of the ticks before it
    apply(session, from_changes, done, gap ? gap->changes_before : session.changes.size(),
          gap ? gap->actions_before : session.actions.size());
    if (from_changes.hash() != operation.world().hash()) differ("the recorded voxel changes give another bone than the recorded poses");
  }
  const Gap* const known = session.bone_known_until();
  apply(session, from_changes, done, known ? known->changes_before : session.changes.size(),
        known ? known->actions_before : session.actions.size());
  for (std::size_t t = repeated.size(); t < session.ticks.size(); ++t)
    result.removed_mm3 += static_cast<double>(session.ticks[t].removed_mm3);
  result.bone_hash = from_changes.hash();
  result.surface_hash = SurfaceReader(from_changes, context).hash();
  if (own.dust && gap == nullptr) result.dust_hash = own.dust->dust().hash();
  result.complete = session.end.has_value();
  if (session.end && known == nullptr) {
    if (!session.end->bone_hash.empty() && session.end->bone_hash != result.bone_hash) differ("the bone came out differently");
    if (!session.end->surface_hash.empty() && session.end->surface_hash != result.surface_hash) differ("the surface came out differently");
    if (!session.end->dust_hash.empty() && gap == nullptr && session.end->dust_hash != result.dust_hash)
      differ("the dust came out differently");
  }
  result.world = std::make_shared<const World>(std::move(from_changes));
  result.identical = result.difference.empty();
  result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return result;
}

}  // namespace osteo
