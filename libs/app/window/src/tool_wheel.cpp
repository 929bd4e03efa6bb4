#include "tool_wheel.h"

#include <cmath>
#include <numbers>
#include <vector>

#include "osteo/core/base/translate.h"
#include "osteo/simulation/bone/burr_kind.h"

namespace osteo::inline app {

std::span<const WheelItem> wheel_items() {
  static const std::vector<WheelItem> items = [] {
    std::vector<WheelItem> all;
    for (std::size_t n = 0; n < kBurrKinds.size(); ++n)
      all.push_back({kBurrKinds[n].name.data(), Command::burr_kind, static_cast<int>(n)});
    all.insert(all.end(), {{tr_later("ball"), Command::ball},
                           {tr_later("taper"), Command::taper},
                           {tr_later("cylinder"), Command::cylinder},
                           {tr_later("plate"), Command::plates},
                           {tr_later("Fragments"), Command::pieces},
                           {tr_later("saw"), Command::saw},
                           {tr_later("drill"), Command::put_away}});
    return all;
  }();
  return items;
}

void ToolWheel::show(float x, float y) {
  open_ = true;
  x_ = x;
  y_ = y;
  chosen_ = -1;
}

void ToolWheel::point(float right_em, float down_em) {
  if (std::hypot(right_em, down_em) < kInnerEm) return;
  const auto count = static_cast<float>(wheel_items().size());
  const float turns = std::atan2(right_em, -down_em) / (2 * std::numbers::pi_v<float>);
  const auto sector = static_cast<int>(std::lround(turns * count));
  chosen_ = (sector + static_cast<int>(count)) % static_cast<int>(count);
}

void ToolWheel::turn(int items) {
  const auto count = static_cast<int>(wheel_items().size());
  chosen_ = chosen_ < 0 ? (items > 0 ? 0 : count - 1) : (chosen_ + items % count + count) % count;
}

}  // namespace osteo::inline app
