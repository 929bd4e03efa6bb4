#include "tool_touch.h"

#include <cmath>

#include "osteo/core/base/json_document.h"
#include "osteo/core/base/translate.h"

namespace osteo::inline app {
namespace {

std::string name_of(const Instrument& held, bool head) {
  switch (held.kind) {
    case InstrumentKind::burr:
      return head ? tr("the drill") : tr("the drill's shaft");
    case InstrumentKind::sucker:
      return tr("the suction tube");
    case InstrumentKind::irrigator:
      return tr("the irrigator");
    case InstrumentKind::probe:
      return tr("the probe");
    case InstrumentKind::saw:
      return tr("the saw");
  }
  return {};
}

InstrumentPlace place_of(const TickRecord& t) {
  return {&instrument_of(t.device.tool), from_floats(t.device.position_mm) + from_floats(t.shown_offset_mm),
          normalized(from_floats(t.device.axis))};
}

}  // namespace

std::optional<ToolTouch::Reported> ToolTouch::look(std::span<const TickRecord> hands) {
  double least = 1e9;
  std::optional<Reported> reported;
  at_mm_.reset();
  for (std::size_t a = 0; a < hands.size(); ++a) {
    for (std::size_t b = a + 1; b < hands.size(); ++b) {
      if (((hands[a].flags | hands[b].flags) & kPlateInHand) != 0) continue;
      const InstrumentPlace first = place_of(hands[a]), other = place_of(hands[b]);
      const InstrumentGap gap = gap_between(first, other);
      if (gap.gap_mm >= least) continue;
      least = gap.gap_mm;
      if (gap.gap_mm >= 0) continue;
      at_mm_ = gap.at_mm;
      const auto rounded = [](double x) { return std::round(x * 100) / 100; };
      reported =
          Reported{[&] {
                     return filled(tr("{one} touches {other}"), {{"one", name_of(*other.held, gap.other_head)},
                                                                 {"other", name_of(*first.held, gap.first_head)}});
                   },
                   Json{{"hands", Json{static_cast<int>(hands[a].hand), static_cast<int>(hands[b].hand)}},
                        {"tools", Json{first.held->name, other.held->name}},
                        {"at_mm", Json{rounded(gap.at_mm.x), rounded(gap.at_mm.y), rounded(gap.at_mm.z)}}}
                       .dump()};
    }
  }
  if (least > kApartMm) reported_ = false;
  if (!reported || reported_) return std::nullopt;
  reported_ = true;
  return reported;
}

}  // namespace osteo::inline app
