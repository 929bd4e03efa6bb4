#include "state_facts.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "osteo/core/base/translate.h"
#include "osteo/session/scene/heat_reader.h"

namespace osteo::inline app {
namespace {

template <class... A>
std::string text_of(const char* format, A... a) {
  char out[96];
  std::snprintf(out, sizeof out, format, a...);
  return shown_figures(out);
}

}  // namespace

std::string clock_text(double seconds) {
  const auto whole = static_cast<long>(std::max(0.0, seconds));
  if (whole >= 3600) return text_of("%ld:%02ld:%02ld", whole / 3600, whole / 60 % 60, whole % 60);
  return text_of("%ld:%02ld", whole / 60, whole % 60);
}

namespace {

// " ± 0.6" where the one who drew the structure says so.
std::string uncertainty_of(const StructureMap& structures, std::uint32_t value) {
  for (const Structure& s : structures.structures()) {
    if (s.value != value || s.within_mm <= 0) continue;
    return std::isfinite(s.within_mm) ? " ± " + shown_number(s.within_mm, 1) : " ± ?";
  }
  return {};
}

}  // namespace

StateFacts state_of_tick(const TickRecord& tick, const StructureMap* structures, double rate_hz) {
  StateFacts f;
  const Instrument& held = instrument_of(tick.device.tool);
  f.tool = (tick.flags & kPlateInHand) != 0 ? tr("plate in the hand") : tr_sized(held.name);
  f.turning = tick.speed_rpm > 0;
  // The last digits of a speed that follows a pedal would only flicker.
  f.speed = f.turning ? text_of("%.0f rpm", 500 * std::round(static_cast<double>(tick.speed_rpm) / 500)) : tr("still");
  f.force_n = length(from_floats(tick.force_n));
  f.force = text_of("%.2f N", f.force_n);
  f.force_share = std::min(1.0, f.force_n / StateFacts::kFullForceN);
  f.depth = text_of("%.2f mm", static_cast<double>(tick.depth_mm));
  f.under = tick.thickness_mm <= 0    ? std::string("-")
            : tick.thickness_mm >= 10 ? std::string(tr("over 10 mm"))
                                      : text_of("%.1f mm", static_cast<double>(tick.thickness_mm));
  if (structures == nullptr) {
    f.structure = tr("none in this case");
  } else if (tick.structure == 0) {
    f.nearness = Nearness::far;
    f.structure = filled(tr("none within {mm} mm"), {{"mm", shown_number(structures->reach_mm(), 0)}});
  } else {
    const auto mm = static_cast<double>(tick.clearance_mm);
    f.structure = tr(structures->name_of(static_cast<std::uint8_t>(tick.structure)));
    f.nearness = mm <= 0                     ? Nearness::touched
                 : mm < StateFacts::kCloseMm ? Nearness::close
                 : mm < StateFacts::kNearMm  ? Nearness::near
                                             : Nearness::far;
    f.distance = text_of("%.1f", std::max(0.0, mm)) + uncertainty_of(*structures, tick.structure) + " mm";
    f.near_share = std::clamp(1 - mm / StateFacts::kClearMm, 0.0, 1.0);
  }
  f.time = clock_text(static_cast<double>(tick.tick) / rate_hz);
  if ((tick.flags & kStructureInjured) != 0) {
    f.warning = filled(tr("the rotating burr touches {structure}"), {{"structure", f.structure}});
    f.alarm = true;
  } else if ((tick.flags & kEscape) != 0) {
    f.warning = tr("the burr is buried in bone");
    f.alarm = true;
  } else if ((tick.flags & kShaftContact) != 0) {
    f.warning = tr("the shaft touches bone");
  } else if ((tick.flags & kNoRoom) != 0) {
    f.warning = tr("no room: bone is left at the burr's rim");
  }
  return f;
}

std::vector<Message> causes_of(const StateFacts& facts) {
  if (facts.warning.empty()) return {};
  return {{facts.alarm   ? Message::Rank::harm
           : facts.lasts ? Message::Rank::information
                         : Message::Rank::hindrance,
           facts.warning}};
}

void report_warmth(StateFacts& f, const WarmthNow& warmth, const TickRecord& tick, const StructureMap* structures) {
  const auto of = warmth.structures_c.find(static_cast<std::uint8_t>(tick.structure));
  if (tick.structure == 0 || structures == nullptr) {
    f.warmth = filled(tr("bone up to {t} C"), {{"t", shown_number(warmth.bone_c, 0)}});
  } else {
    f.warmth = text_of("%.1f C", of == warmth.structures_c.end() ? 37.0 : of->second);
  }
  if (structures == nullptr || f.alarm) return;
  const auto worst = std::max_element(warmth.structures_c.begin(), warmth.structures_c.end(),
                                      [](const auto& a, const auto& b) { return a.second < b.second; });
  if (worst == warmth.structures_c.end() || worst->second < 47) return;
  f.warning = filled(tr("{structure} is at {t} C: stop, and rinse"),
                     {{"structure", tr(structures->name_of(worst->first))}, {"t", shown_number(worst->second, 0)}});
  f.alarm = worst->second >= kCoagulatedC;
}

StateFacts state_facts(const Rehearsal& rehearsal, const TickRecord& tick, const WarmthNow* warmth) {
  StateFacts f = state_of_tick(tick, rehearsal.structures(), rehearsal.rate_hz());
  if (warmth != nullptr) report_warmth(f, *warmth, tick, rehearsal.structures());
  f.removed = text_of("%.1f mm³", rehearsal.removed_mm3() + rehearsal.sawn_mm3());
  if (rehearsal.soft() != nullptr)
    f.tissue = filled(tr("tissue {mm3}"), {{"mm3", shown_number(rehearsal.tissue_mm3(), 1)}});
  // A recording in trouble comes before everything: nothing of what follows would be kept.
  if (const std::string trouble = rehearsal.trouble(); !trouble.empty()) {
    f.warning = trouble;
    f.alarm = rehearsal.recording().failure.has_value();
    return f;
  }
  if (!f.warning.empty()) return f;
  const Burr* const edge = instrument_of(tick.device.tool).cutter();
  f.lasts = true;
  // Before the first tick nobody holds the burr that a record begins with.
  if (edge != nullptr && tick.tick > 0 && !too_small_for_voxels(*edge, rehearsal.finest_voxel_mm()).empty())
    f.warning = filled(tr("the instrument is small for voxels of {mm} mm: its force is coarse"),
                       {{"mm", shown_number(rehearsal.finest_voxel_mm(), 2)}});
  return f;
}

}  // namespace osteo::inline app
