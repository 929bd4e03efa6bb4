#include "osteo/session/scene/reader.h"

#include <algorithm>
#include <chrono>
#include <utility>

namespace osteo::inline session {

ReaderDispatcher::ReaderDispatcher(StreamReader& from, const World& world)
    : from_(from), world_(world), ticks_(1024), changes_(1 << 16) {}

void ReaderDispatcher::add(Reader& reader, bool resync) {
  readers_.push_back(&reader);
  if (!resync) return;
  reader.resync(world_);
  for (const auto& [kind, action] : standing_) reader.action(action);
  reader.update();
}

void ReaderDispatcher::remove(Reader& reader) {
  std::erase(readers_, &reader);
}

std::size_t ReaderDispatcher::take_actions() {
  for (SceneAction a; from_.actions.pop({&a, 1}) == 1;) actions_.push_back(a);
  return actions_.size();
}

void ReaderDispatcher::notify(const SceneAction& action) {
  if (row_of(action).moves_dust) standing_[action.kind] = action;
  for (Reader* const r : readers_) r->action(action);
}

std::size_t ReaderDispatcher::drain(std::optional<double> about_ms) {
  // So few that one of them may take its time.
  const std::size_t at_once = about_ms ? 16 * kMaxHands : ticks_.size();
  const auto begin = std::chrono::steady_clock::now();
  std::size_t total = 0;
  bool lost = false;
  std::size_t due = 0;  // actions whose earlier ticks are in the ring for certain
  for (;;) {
    due = take_actions();
    const std::size_t n = from_.ticks.pop(std::span(ticks_).first(at_once));
    if (n == 0) break;
    // Those of the ticks just taken were published before them.
    take_actions();
    std::size_t wanted = 0;
    for (std::size_t t = 0; t < n; ++t) wanted += ticks_[t].voxels_changed;
    if (wanted > changes_.size()) changes_.resize(wanted);
    const std::size_t got = from_.changes.pop({changes_.data(), wanted});
    std::size_t used = 0;
    for (std::size_t t = 0; t < n; ++t) {
      const TickRecord& record = ticks_[t];
      if (!next_tick_) next_tick_ = from_.first_tick.load(std::memory_order_relaxed);
      if (record.tick > *next_tick_) {
        ticks_lost_ += record.tick - *next_tick_;
        lost = true;
      }
      // All hands of a tick are there or none.
      next_tick_ = std::max(*next_tick_, record.tick + 1);
      latest_[record.hand] = record;
      for (; !actions_.empty() && actions_.front().tick <= record.tick; actions_.pop_front()) notify(actions_.front());
      const std::size_t changed = std::min<std::size_t>(record.voxels_changed, got - used);
      for (Reader* const r : readers_) r->tick(record, {changes_.data() + used, changed});
      used += changed;
    }
    total += n;
    if (about_ms &&
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count() > *about_ms) {
      due = 0;  // their ticks may be among those that are left
      break;
    }
  }
  due = std::min(due, actions_.size());
  for (std::size_t reported = 0; reported < due; ++reported, actions_.pop_front()) notify(actions_.front());
  const std::uint64_t dropped = from_.actions_dropped.load(std::memory_order_relaxed);
  lost = lost || dropped > std::exchange(actions_dropped_, dropped);
  if (lost || total > 0 || due > 0) resync_and_update(lost);
  return total;
}

void ReaderDispatcher::resync_and_update(bool lost) {
  for (Reader* const r : readers_) {
    if (lost) r->resync(world_);
    r->update();
  }
}

void ReaderDispatcher::scene_changed(const World::Effect& effect) {
  for (Reader* const r : readers_) r->scene_changed(world_, effect);
}

void ReaderDispatcher::begins(const SceneAction& action) {
  for (Reader* const r : readers_) r->begins(world_, action);
}

void ReaderDispatcher::end(std::uint64_t ticks) {
  take_actions();
  for (; !actions_.empty(); actions_.pop_front()) notify(actions_.front());
  const std::uint64_t first = from_.first_tick.load(std::memory_order_relaxed);
  const std::uint64_t next = next_tick_.value_or(first == StreamReader::kNone ? ticks : first);
  const bool lost = ticks > next;
  if (lost) ticks_lost_ += ticks - next;
  next_tick_ = ticks;
  resync_and_update(lost);
}

}  // namespace osteo::inline session
