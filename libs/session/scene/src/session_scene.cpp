#include "osteo/session/scene/session_scene.h"

#include <algorithm>
#include <vector>

#include "osteo/core/base/error.h"
#include "osteo/session/recording/session_reader.h"

namespace osteo::inline session {

void SessionScene::resync(const World& world) {
  const bool again = world_.has_value();
  world_.emplace(world.copy());
  removed_mm3_ = 0;
  in_use_ = {};
  if (!again) world_->simulate(Simulated::dust, world_->simulates(Simulated::dust) || follow_.dust);
  if (!again || follow_.dust || follow_.dust_by_action) {  // dust begins again
    readers_ = std::make_unique<SceneReaders>(*world_, follow_, rate_hz_, context_);
    return;
  }
  // So that whoever draws the surfaces hears of all that is another now.
  if (readers_->surface) readers_->surface->resync(*world_);
  if (readers_->pieces) readers_->pieces->resync(*world_);
}

void SessionScene::action(const SceneAction& action) {
  if (!row_of(action).by_servo) refresh();  // pieces begin with the surface of what they are taken from
  const World::Effect effect = apply_action(action, *world_);
  if (!row_of(action).by_servo && effect.done && row_of(action).changes_world) {
    if (readers_->surface) readers_->surface->scene_changed(*world_, effect);
    if (readers_->pieces) readers_->pieces->scene_changed(*world_, effect);
    readers_->simulation().scene_changed(*world_, effect);
  }
  if (row_of(action).begins_state && effect.done) readers_->simulation().begins(*world_, action);
  if (readers_->pieces) readers_->pieces->action(action);
  readers_->simulation().action(action);
}

void SessionScene::set(std::span<const VoxelChange> changes) {
  for (const VoxelChange& c : changes) {
    const PlacedBody* const b = world_->owner(c.voxel);
    if (b == nullptr) throw Error(ExitCode::corrupt, "the session changes a voxel that the bone does not have");
    b->body->bone.set(c.voxel - b->body->name_of(0), c.density);
  }
  if (readers_->surface) readers_->surface->tick({}, changes);
}

void SessionScene::tick(const TickRecord& record, std::span<const VoxelChange> changes) {
  std::vector<VoxelChange>& reported = reported_changes_;
  reported.clear();
  for (const VoxelChange& c : changes) {
    const auto applied = apply_change(c, *world_);  // with the density before: files do not keep it
    if (!applied) throw Error(ExitCode::corrupt, "the session changes a voxel that the bone does not have");
    reported.push_back(*applied);
  }
  if (readers_->surface) readers_->surface->tick({}, reported);
  if (readers_->pieces) readers_->pieces->tick(record, reported);
  readers_->simulation().tick(record, reported);
  readers_->tools.tick(record, reported);
  if (record.hand < latest_.size()) {
    latest_[record.hand] = record;
    in_use_[record.hand] = in_use_[record.hand] || record.hand == 0 || record.device.pedal > 0 || record.immersed > 0;
  }
  removed_mm3_ += static_cast<double>(record.removed_mm3);
}

void SessionScene::refresh() {
  if (readers_->surface) readers_->surface->update();
  if (readers_->pieces) readers_->pieces->update();
}

void report_recorded(const SessionReader& session, const World& begin, Reader& reader, const Context& context) {
  if (begin.hash() != session.header().bone_hash)
    throw Error(ExitCode::corrupt, "the session was recorded on another bone than this case's",
                "give the case it was recorded on, unchanged");
  reader.resync(begin);
  const Gap* const known_until = session.outline().bone_known_until();
  const double all = static_cast<double>(std::max<std::uint64_t>(1, session.outline().tick_records));
  double reported = 0;
  TickRecord last;
  auto parts = session.parts();
  while (const SessionPart* const p = parts.next()) {
    if (p->gap != nullptr && p->gap == known_until) break;
    for (const SceneAction& a : p->actions) reader.action(a);
    for (std::size_t t = 0; t < p->ticks.size(); ++t)
      reader.tick(p->ticks[t], t + 1 == p->ticks.size() ? p->changes : std::span<const VoxelChange>());
    if (!p->ticks.empty()) {
      last = p->ticks.back();
      last.removed_mm3 = 0;
    } else if (!p->changes.empty()) {
      reader.tick(last, p->changes);  // of ticks that are not there: with the last that is
    }
    reported += static_cast<double>(p->ticks.size());
    context.progress(std::min(1.0, reported / all), "reading the session");
  }
  reader.update();
}

}  // namespace osteo::inline session
