// That two hands' instruments touch each other: told once when it begins, shown where, and kept as a note. No physics:
// they pass through. Private to libs/app/window.
#pragma once
#include <optional>
#include <span>
#include <string>

#include "local_text.h"
#include "osteo/simulation/bone/instrument.h"
#include "osteo/simulation/haptics/stream.h"

namespace osteo::inline app {

class ToolTouch {
 public:
  /// Their gap must have been so wide since the last touch before another is told: a hand trembles.
  static constexpr double kApartMm = 0.5;
  struct Reported {
    LocalText text;    ///< "the sucker touches the drill's shaft"
    std::string note;  ///< the value of a "touch" note
  };
  /// The hands as they are, empty ones left out. Something when a touch begins.
  std::optional<Reported> look(std::span<const TickRecord> hands);
  /// Where they touch now.
  [[nodiscard]] std::optional<Vec3> at_mm() const { return at_mm_; }

 private:
  std::optional<Vec3> at_mm_;
  bool reported_ = false;
};

}  // namespace osteo::inline app
