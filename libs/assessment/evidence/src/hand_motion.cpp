#include "osteo/assessment/evidence/detail/hand_motion.h"

namespace osteo::inline assessment {

IdleClock::IdleClock(double rate_hz)
    : least_(static_cast<std::uint64_t>(std::llround(kIdleAfterS * rate_hz))),
      hands_(Hand{HandMotion(rate_hz, kWindowS), {}, {}, false}) {}

void IdleClock::add(const TickRecord& t) {
  Hand& hand = hands_[t.hand];
  hand.there = true;
  if (t.device.pedal == 0) hold(hand.up, t.tick);
  hand.motion.add(t.tick, from_floats(t.device.position_mm));
  const auto speed = hand.motion.speed_mm_s();
  if (!speed || *speed >= kStillMmPerS) return;
  // Slow at the middle of two windows. A hand that turns back is that for a moment, too: only a long row of such
  // moments is a rest, and then it reaches as far as the windows do.
  hold(hand.still, hand.motion.speed_tick());
}

void IdleClock::hold(Row& row, std::uint64_t tick) const {
  if (row.now.ticks() > 0 && tick == row.now.end) {
    ++row.now.end;
    return;
  }
  // What is too short even with what its windows reach beyond it is forgotten.
  if (row.now.ticks() >= least_ / 2) row.before.push_back(row.now);
  row.now = {tick, tick + 1};
}

std::vector<IdleClock::Span> IdleClock::long_ones(const Row& row) const {
  std::vector<Span> all = row.before;
  if (row.now.ticks() >= least_ / 2) all.push_back(row.now);
  return all;
}

std::vector<IdleClock::Span> IdleClock::common(const std::vector<Span>& a, const std::vector<Span>& b) const {
  std::vector<Span> both;
  for (std::size_t i = 0, j = 0; i < a.size() && j < b.size();) {
    const Span s{std::max(a[i].begin, b[j].begin), std::min(a[i].end, b[j].end)};
    if (s.ticks() > 0) both.push_back(s);
    ++(a[i].end < b[j].end ? i : j);
  }
  return both;
}

std::uint64_t IdleClock::idle_ticks() const {
  std::vector<Span> idle{{0, ~std::uint64_t{0}}};
  bool any = false;
  for (const Hand& hand : hands_) {
    if (!hand.there) continue;
    any = true;
    std::vector<Span> still;
    for (Span s : long_ones(hand.still)) {
      s.begin -= std::min(s.begin, hand.motion.window() - 1);
      s.end += hand.motion.window();
      if (!still.empty() && s.begin <= still.back().end) {
        still.back().end = s.end;
      } else {
        still.push_back(s);
      }
    }
    idle = common(common(idle, still), long_ones(hand.up));
  }
  std::uint64_t ticks = 0;
  for (const Span& s : idle) ticks += any && s.ticks() >= least_ ? s.ticks() : 0;
  return ticks;
}

}  // namespace osteo::inline assessment
