// What a hand can hold but plates: burrs, suckers, irrigators, probes, a saw. One library, one number each.
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "osteo/core/base/param.h"
#include "osteo/simulation/bone/burr.h"
#include "osteo/simulation/bone/round_cone.h"

namespace osteo::inline simulation {

enum class InstrumentKind : int { burr, sucker, irrigator, probe, saw };
[[nodiscard]] constexpr std::array<std::string_view, 5> enum_names(InstrumentKind) {
  return {"burr", "sucker", "irrigator", "probe", "saw"};
}

/// All of them are felt when they touch bone; what they do besides needs the pedal.
struct Instrument {
  InstrumentKind kind = InstrumentKind::burr;
  std::string name;  ///< "cutting 4 mm", "suction tube 8 Fr", "irrigator 2 mm", "probe 1 mm", "hook 2 mm", "saw 25 mm"
  RoundCone head;    ///< its tip's centre at the origin, handle along +z
  RoundCone shaft;   ///< behind it, in the same frame
  std::optional<Burr> edge;    ///< what removes bone with it: a burr, or the teeth of a saw; none: it removes nothing
  double rate = 0;             ///< sucker: mm3 of dry dust a second; irrigator: mm3 of water a second; pedal down
  double reach_mm = 0;         ///< sucker: around the tip's centre; irrigator: how far its jet goes on
  double falloff_per_rad = 0;  ///< with an edge: share of its efficiency lost for each radian of latitude
  double speed_share = 1;      ///< strokes of a saw for each turn of the motor

  /// What cuts, whatever drives it; null where nothing does.
  [[nodiscard]] const Burr* cutter() const { return edge ? &*edge : nullptr; }
  /// The same, of a burr alone.
  [[nodiscard]] const Burr* as_burr() const { return kind == InstrumentKind::burr ? cutter() : nullptr; }
};

/// Burrs first, under their numbers in burr_library(); then suckers of 5, 7, 8, 10 and 12 French, an irrigator, a blunt
/// probe, a hook. A tool is named by its index here; a session's file lists the names, and its reader gives the index
/// that they have in this build. Suckers: straight tubes as thick as the French scale says (a third of a millimetre
/// each; sizes as the Frazier pattern is sold in), closed at the tip by a dome. What they suck is a guess: 60 mm3/s
/// within 4 mm at 10 French, in proportion to the lumen's area and to its diameter. The irrigator's 24 ml a minute are
/// a guess too. The hook's bent tip is felt as a ball around it. The saw, last: a reciprocating blade 1 mm thick with
/// 25 mm of teeth, cut and felt as a rod of that thickness along the handle (its sides rub nowhere); 3 mm3/s/N is a
/// guess, of the order in which a mandible's body is cut through in half a minute. Its motor turns as a drill's; each
/// fourth turn is a stroke.
[[nodiscard]] const std::vector<Instrument>& instrument_library();
/// Error(usage), with all names, when there is none.
[[nodiscard]] int instrument_index(std::string_view name);
/// The instrument of a sample; the last where there is none under its number.
[[nodiscard]] const Instrument& instrument_of(std::uint8_t tool);

/// Depths of flat cuts of each instrument's head, and of its shaft; made once, at the first call.
[[nodiscard]] const CutDepth& head_cut_depth(std::size_t tool);
[[nodiscard]] const CutDepth& shaft_cut_depth(std::size_t tool);

// -- How near two instruments are to each other. They do not push each other: this is for telling and hearing that they
// touch.

/// Where an instrument is: its tip's centre, and the unit vector along its handle.
struct InstrumentPlace {
  const Instrument* held = nullptr;
  Vec3 tip_mm, axis;
};

struct InstrumentGap {
  double gap_mm = 0;  ///< between the surfaces of heads and shafts; negative: so deep in each other
  Vec3 at_mm;         ///< midway between the nearest places
  bool first_head = true, other_head = true;  ///< which parts of the first and the other are nearest; false: the shaft
};
/// To a micrometre: of two round cones the distance is convex along an axis, so the least is found by halving. The
/// handpiece behind a burr's shaft is not looked at. 2 us; where they are more than 20 mm apart it may be any larger
/// number, in 0.1 us.
[[nodiscard]] InstrumentGap gap_between(const InstrumentPlace& first, const InstrumentPlace& other) noexcept;

}  // namespace osteo::inline simulation
