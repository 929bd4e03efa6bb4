// What the burr does now, in words of fixed places. Private to libs/app/window; no ImGui, no screen.
#pragma once
#include <cstdint>
#include <map>
#include <string>

#include "messages.h"
#include "osteo/session/scene/rehearsal.h"
#include "palette.h"

namespace osteo::inline app {

struct StateFacts {
  std::string tool;      ///< what is in the hand
  bool turning = false;  ///< the burr
  std::string speed;     ///< "41000 rpm"; "still"
  double force_n = 0;
  std::string force;       ///< "1.25 N"
  double force_share = 0;  ///< of kFullForceN, 0 to 1
  std::string depth;       ///< of the burr in bone
  std::string under;       ///< bone under the burr: "2.3 mm", "over 10 mm", "-" where it touches none
  Nearness nearness = Nearness::unknown;
  std::string structure;  ///< the nearest; "none within 10 mm"; "none in this case"
  std::string distance;   ///< "1.2 mm", "1.2 ± 0.6 mm" where its boundary is uncertain; empty where none is near
  double near_share = 0;  ///< how far the bar of nearness is full: 0 from kClearMm on, 1 on contact
  std::string warmth;     ///< of that structure, or of the warmest bone: "38.2 C"; empty where the scene has no heat
  std::string removed;    ///< by burrs and saws: "12.3 mm³"
  std::string tissue;     ///< of soft tissue: "tissue 4.5"; empty where the scene has none
  std::string time;       ///< "3:07"
  std::string warning;    ///< the most important that there is to say; empty: nothing
  bool alarm = false;     ///< and it is one to stop for
  bool lasts = false;     ///< and it stays so for long, as of a bone in pieces
  static constexpr double kFullForceN = 4, kClearMm = 8, kNearMm = 2, kCloseMm = 0.5;
};
/// How warm drilling has made things, Celsius, now.
struct WarmthNow {
  double bone_c = 37;                           ///< the warmest so far
  std::map<std::uint8_t, double> structures_c;  ///< those that are warm at all, by value
};
/// Of the nearest structure; warns from 47 C on for any of them, which bone bears for a minute. `structures` may be
/// null.
void report_warmth(StateFacts& facts, const WarmthNow& warmth, const TickRecord& tick, const StructureMap* structures);
/// `warmth`: null where the scene has no heat.
[[nodiscard]] StateFacts state_facts(const Rehearsal& rehearsal, const TickRecord& tick,
                                     const WarmthNow* warmth = nullptr);
/// The part of it that follows from a tick alone. `structures` may be null.
[[nodiscard]] StateFacts state_of_tick(const TickRecord& tick, const StructureMap* structures, double rate_hz);

/// Its warning by rank: harm, what stops the work, or, where it lasts, information.
[[nodiscard]] std::vector<Message> causes_of(const StateFacts& facts);

/// "3:07"; from an hour "1:03:07".
[[nodiscard]] std::string clock_text(double seconds);

}  // namespace osteo::inline app
