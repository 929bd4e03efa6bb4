#include "osteo/session/scene/session_player.h"

#include <algorithm>
#include <cmath>
#include <ranges>

#include "osteo/core/base/error.h"

namespace osteo::inline session {

SessionPlayer::SessionPlayer(const SessionReader& session, World begin, const Context& context)
    : begin_(std::move(begin)),
      scene_({true, false, false}, session.header().rate_hz, context),
      hands_(session.header().haptics.hands()),
      rate_hz_(session.header().rate_hz) {
  if (begin_.hash() != session.header().bone_hash)
    throw Error(ExitCode::corrupt, "the session was recorded on another bone than this case's",
                "give the case it was recorded on, unchanged");
  scene_.resync(begin_);
  const auto every = static_cast<std::uint64_t>(std::max(1.0, std::round(rate_hz_ / kHandRateHz)));
  const Gap* const known_until = session.outline().bone_known_until();
  const double all = static_cast<double>(std::max<std::uint64_t>(1, session.outline().tick_records));
  double reported = 0;
  TickRecord last;
  SessionScene use({false, false, false}, rate_hz_, context);  // of hands alone
  use.resync(begin_);
  auto parts = session.parts();
  while (const SessionPart* const p = parts.next()) {
    if (p->gap != nullptr && p->gap == known_until) break;
    for (const Note& n : p->notes) {
      if (n.kind == "camera") cameras_.emplace_back(static_cast<double>(n.tick) / rate_hz_, n.json);
    }
    for (const TickRecord& t : p->ticks) {
      end_s_ = std::max(end_s_, static_cast<double>(t.tick + 1) / rate_hz_);
      if (t.tick % every != 0 || t.hand >= hands_.size()) continue;
      use.tick(t, {});
      if (use.in_use(t.hand)) hands_[t.hand].push_back(t);
    }
    if (!p->ticks.empty()) last = p->ticks.back();
    reported += static_cast<double>(p->ticks.size());
    context.progress(std::min(1.0, reported / all), "reading the session");
    if (p->actions.empty() && p->changes.empty()) continue;
    Step step;
    step.actions.assign(p->actions.begin(), p->actions.end());
    step.remakes = std::ranges::any_of(
        step.actions, [](const SceneAction& a) { return row_of(a).changes_world && !row_of(a).by_servo; });
    step.changes.assign(p->changes.begin(), p->changes.end());
    step.last = last;
    step.end_s = end_s_;
    for (const SceneAction& a : step.actions) step.end_s = std::max(step.end_s, static_cast<double>(a.tick) / rate_hz_);
    for (const SceneAction& a : step.actions) scene_.action(a);
    for (VoxelChange& c : step.changes) {
      if (const PlacedBody* const b = scene_.world()->owner(c.voxel))
        c.before = b->body->bone.value(c.voxel - b->body->name_of(0));
    }
    scene_.tick(step.last, step.changes);
    steps_.push_back(std::move(step));
  }
  std::ranges::stable_sort(cameras_, {}, [](const auto& c) { return c.first; });
  scene_.refresh();
  done_ = steps_.size();
  now_s_ = end_s_;
}

void SessionPlayer::notify(const Step& step) {
  for (const SceneAction& a : step.actions) scene_.action(a);
  scene_.tick(step.last, step.changes);
}

void SessionPlayer::go_to_step(std::size_t steps) {
  const auto between =
      std::span(steps_).subspan(std::min(done_, steps), std::max(done_, steps) - std::min(done_, steps));
  if (std::ranges::any_of(between, &Step::remakes)) {
    // What it does follows from all that was told before it.
    scene_.resync(begin_);
    for (std::size_t n = 0; n < steps; ++n) notify(steps_[n]);
  } else if (steps > done_) {
    for (const Step& s : between) scene_.set(s.changes);
  } else {
    std::vector<VoxelChange> back;
    for (const Step& s : std::views::reverse(between)) {
      back.clear();
      for (const VoxelChange& c : s.changes) back.push_back({c.voxel, c.before, c.density});
      scene_.set(back);
    }
  }
  done_ = steps;
  scene_.refresh();
}

void SessionPlayer::go_to(double t_s) {
  now_s_ = std::clamp(t_s, 0.0, end_s_);
  // A step counts when all of it has happened; a thousandth of a tick for what rounding does.
  const double until = now_s_ + 1e-3 / rate_hz_;
  const auto behind = std::ranges::upper_bound(steps_, until, {}, &Step::end_s);
  const auto steps = static_cast<std::size_t>(behind - steps_.begin());
  if (steps != done_) go_to_step(steps);
}

const TickRecord* SessionPlayer::hand(std::size_t number) const {
  const std::vector<TickRecord>& all = hands_.at(number);
  const auto tick = static_cast<std::uint64_t>(now_s_ * rate_hz_ + 1e-3);
  const auto behind = std::ranges::upper_bound(all, tick, {}, &TickRecord::tick);
  return behind == all.begin() ? nullptr : &*(behind - 1);
}

const std::string* SessionPlayer::camera() const {
  const auto behind = std::ranges::upper_bound(cameras_, now_s_, {}, [](const auto& c) { return c.first; });
  return behind == cameras_.begin() ? nullptr : &(behind - 1)->second;
}

}  // namespace osteo::inline session
