#include "second_hand.h"

#include <algorithm>

#include "osteo/core/base/translate.h"

namespace osteo::inline app {
namespace {

constexpr std::size_t kThings = 4;  // nothing is the first
constexpr const char* kNone = tr_later("there is no second hand in this session");

MouseDevice* moved_by_window(Rehearsal& rehearsal) {
  return rehearsal.hands() > 1 ? dynamic_cast<MouseDevice*>(&rehearsal.device(1)) : nullptr;
}

}  // namespace

std::string SecondHand::name_of(std::size_t what) const {
  return what == kSucker      ? "suction tube " + std::to_string(french_) + " Fr"
         : what == kIrrigator ? "irrigator 2 mm"
         : what == kProbe     ? "probe 1 mm"
                              : "";
}

LocalText SecondHand::take_next(Rehearsal& rehearsal) {
  return take(rehearsal, (holds_ + 1) % kThings);
}

LocalText SecondHand::take(Rehearsal& rehearsal, std::size_t what) {
  if (rehearsal.hands() < 2) return [] { return tr(kNone); };
  holds_ = what;
  if (moved_by_window(rehearsal) == nullptr) {
    holds_ = std::max<std::size_t>(holds_, 1);
    rehearsal.device(1).set_tool(static_cast<std::uint8_t>(instrument_index(name_of(holds_))));
  }
  if (holds_ == 0) follow();
  if (holds_ == 0) return [] { return tr("second hand: nothing"); };
  return [&] { return filled(tr("second hand: {tool}"), {{"tool", tr_sized(name_of(holds_))}}); };
}

bool SecondHand::move(Rehearsal& rehearsal, Vec3 by_mm, LocalText& said) {
  if (moved_by_window(rehearsal) == nullptr) {
    said = [&] { return rehearsal.hands() < 2 ? tr(kNone) : tr("the second hand has a device of its own"); };
    return false;
  }
  if (holds_ == 0) said = take_next(rehearsal);
  if (!placed_mm_) placed_mm_ = from_floats(rehearsal.latest(1).device.position_mm);
  *placed_mm_ += by_mm;
  return true;
}

void SecondHand::hold(Rehearsal& rehearsal, const ViewAxes& view, bool suck, bool wash, bool works, bool left_handed) {
  empty_ = false;
  MouseDevice* const hand = moved_by_window(rehearsal);
  if (hand == nullptr) return;
  sucking_ = suck || (works && !wash && holds_ == 1);
  washing_ = wash || (works && !suck && holds_ == 2);
  works = works || suck || wash;
  empty_ = !works && holds_ == 0;
  const TickRecord tick = rehearsal.latest();
  HandGoal goal;
  goal.tool = static_cast<std::uint8_t>(instrument_index(name_of(suck   ? kSucker
                                                                 : wash ? kIrrigator
                                                                        : std::max(holds_, kSucker))));
  goal.pedal = works ? 255 : 0;
  // From the side where the drill's handle is not.
  const Vec3 side = view.right * (left_handed ? 1.0 : -1.0);
  goal.axis = to_floats(normalized(side - view.forward));
  if (placed_mm_) {
    goal.position_mm = *placed_mm_;
  } else {
    const double gap =
        instrument_of(tick.device.tool).head.largest_radius_mm() + instrument_of(goal.tool).head.largest_radius_mm();
    goal.position_mm = from_floats(tick.device.position_mm) + from_floats(tick.shown_offset_mm) + side * gap;
    // Held ready beside it, or put away.
    if (!works) goal.position_mm += holds_ > 0 ? side * 8 - view.forward * 6 : side * 30 - view.forward * 40;
  }
  hand->set_goal(goal);
}

}  // namespace osteo::inline app
