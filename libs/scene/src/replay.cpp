#include <chrono>
#include <cstddef>
#include <cstring>

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
      b->body->bone.set(c.voxel - b->body->name_of(0), c.density);
    }
  };
  for (; done.actions < actions_end; ++done.actions) {
    apply_until(session.actions[done.actions].changes_before);
    world.act(session.actions[done.actions].action);
  }
  apply_until(changes_end);
}

}  // namespace

void apply_recorded(const Session& session, World& world, const Gap* until) {
  Applied done;
  apply(session, world, done, until ? until->changes_before : session.changes.size(),
        until ? until->actions_before : session.actions.size());
}

ReplayResult replay(const Session& session, World start, const Anatomy& anatomy, const Context& context) {
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
  const std::size_t hands = session.header.haptics.hands();
  std::vector<std::vector<DeviceSample>> samples(hands);
  for (const TickRecord& t : repeated) samples[t.hand].push_back(t.device);
  World from_changes = start.copy();  // the second way: apply the recorded changes
  std::vector<std::unique_ptr<ReplayDevice>> hand_devices;
  std::vector<Device*> devices;
  for (std::vector<DeviceSample>& of_hand : samples)
    devices.push_back(hand_devices.emplace_back(std::make_unique<ReplayDevice>(std::move(of_hand))).get());
  Stream stream;
  StreamReader& reader = stream.add_reader();
  // Dust follows from the stream, so it has to come out the same as well.
  StreamReader* const dust_reader = session.header.dust ? &stream.add_reader() : nullptr;
  Operation operation(std::move(start), session.header.haptics, anatomy, devices, stream, session.header.rate_hz);
  std::unique_ptr<Follower> dust;
  if (dust_reader != nullptr)
    dust = std::make_unique<Follower>(operation.world(), FollowerParts{false, false, true}, session.header.rate_hz, context);
  std::vector<VoxelChange> changes(1 << 16);
  SceneAction action;
  const auto differ = [&](const std::string& what) {
    if (result.difference.empty()) result.difference = what;
  };
  auto next = session.actions.begin();
  const auto act = [&] {
    if (dust) dust->drain(*dust_reader);
    const World::Effect effect = operation.act(next->action, [&](const World::Effect& e) {
      if (dust) dust->follow(operation.world(), e);
    });
    if (!effect.done)
      differ("at tick " + std::to_string(next->action.tick) + " '" + std::string(name_of(next->action)) +
             "' could not be done: " + effect.message);
    ++next;
  };
  for (const TickRecord& recorded : repeated) {
    if (recorded.hand == 0) {
      if (recorded.tick % 256 == 0) {
        context.progress(0.9 * static_cast<double>(recorded.tick * hands) / static_cast<double>(repeated.size()), "replay");
        if (dust) dust->drain(*dust_reader);
      }
      if (next != actions_end && next->action.tick == recorded.tick) act();
      operation.step(0);
    }
    TickRecord now;
    reader.ticks.pop({&now, 1});
    while (reader.changes.pop(changes) > 0) {
    }
    while (reader.actions.pop({&action, 1}) > 0) {
    }
    // Bytes, not numbers: the same bits or not.
    constexpr std::size_t kRepeated = offsetof(TickRecord, work_us);
    const bool same = std::memcmp(&now, &recorded, kRepeated) == 0;
    if (!same)
      differ("tick " + std::to_string(recorded.tick) + (hands > 1 ? ", hand " + std::to_string(recorded.hand) + "," : "") +
             " came out differently");
    result.removed_mm3 += static_cast<double>(now.removed_mm3);
  }
  for (; next != actions_end; operation.finish()) act();  // done in the last moment
  result.ticks = session.ticks.size() / hands;
  result.ticks_repeated = repeated.size() / hands;
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
  const Follower surfaces(from_changes, {true, false, false}, session.header.rate_hz, context);
  result.surface_hash = surfaces.surface_hash();
  if (dust && gap == nullptr) {
    dust->drain(*dust_reader);
    dust->end(*dust_reader, result.ticks_repeated);
    result.dust_hash = dust->dust()->hash();
  }
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
