// Kinds of burrs: all that differs between them, a row each.
#pragma once
#include <array>
#include <cstddef>
#include <string_view>

#include "osteo/core/base/param.h"

namespace osteo::inline simulation {

/// A row of kBurrKinds, by its place. Those that the program chooses by itself have a name here; a further kind needs
/// none.
enum class BurrKind : int { cutting, diamond };

/// What a kind of burr is. Whoever decides by kind asks here: nothing else may compare kinds with each other (the test
/// BurrKinds reads the sources for that). To add a kind: a row at the end of kBurrKinds.
/// kBurrLibraryVersion stays, unless what older kinds remove changes.
struct BurrKindRow {
  std::string_view
      name;      ///< "cutting": in names of burrs, flags, scripts, session files, buttons; ends with a zero character
  char key = 0;  ///< that takes it in the window, a capital letter

  /// Of a ball of 4 mm at its equator, at the nominal speed; and what of it is lost for each radian of latitude (struct
  /// Burr).
  double rate_mm3_per_s_per_n = 0, falloff_mm3_per_s_per_n_per_rad = 0;
  /// May work where a procedure or a hint wants no cutting burr: beside critical structures.
  bool near_structures = false;

  /// Vibration: the kind whose peaks it has where a file of vibrations (libs/simulation/haptics/vibration.json) names
  /// none for it; its own name: a file has to.
  std::string_view vibrates_as;
  /// Sound on bone, in dB against a cutting burr (sound_model.h), and the share of its power that is in the lines of
  /// its teeth, 0 to 1.
  double sound_db = 0, sound_teeth_share = 0;
  /// Heat in bone: how much of it goes by the burr's work (HeatOfCutting::cutting_share), how much by force alone
  /// (diamond_w_per_n).
  double heat_by_work = 0, heat_by_force = 0;

  /// Look: flutes of burrs below 3 mm, below 5 mm and of larger ones; 0: a coat of grit.
  std::array<int, 3> flutes{};
  /// Red, green, blue, 0 to 1: from afar; of edges or grains; of what lies between them.
  std::array<double, 3> colour{}, raised{}, sunk{};
};

/// The one declaration of each kind. Rates are guesses ordered as D. Morris 2006 says; sound: Kylen 1977 (diamonds 5 to
/// 11 dB less).
inline constexpr std::array kBurrKinds{
    BurrKindRow{.name = "cutting",
                .key = 'C',
                .rate_mm3_per_s_per_n = 6,
                .falloff_mm3_per_s_per_n_per_rad = 3,
                .near_structures = false,
                .vibrates_as = "cutting",
                .sound_db = 0,
                .sound_teeth_share = 0.5,
                .heat_by_work = 1,
                .heat_by_force = 0,
                .flutes = {6, 8, 10},
                .colour = {0.62, 0.63, 0.65},
                .raised = {0.86, 0.87, 0.88},
                .sunk = {0.30, 0.31, 0.34}},
    BurrKindRow{.name = "diamond",
                .key = 'D',
                .rate_mm3_per_s_per_n = 2,
                .falloff_mm3_per_s_per_n_per_rad = 0.3,
                .near_structures = true,
                .vibrates_as = "diamond",
                .sound_db = -8,
                .sound_teeth_share = 0,
                .heat_by_work = 0,
                .heat_by_force = 1,
                .flutes = {0, 0, 0},
                .colour = {0.68, 0.66, 0.59},
                .raised = {0.80, 0.78, 0.70},
                .sunk = {0.52, 0.50, 0.44}},
};
static_assert(kBurrKinds[static_cast<std::size_t>(BurrKind::cutting)].name == "cutting");
static_assert(kBurrKinds[static_cast<std::size_t>(BurrKind::diamond)].name == "diamond");

[[nodiscard]] constexpr const BurrKindRow& row_of(BurrKind kind) {
  return kBurrKinds[static_cast<std::size_t>(kind)];
}

// What another vibrates as is read before it.
static_assert([] {
  for (std::size_t n = 0; n < kBurrKinds.size(); ++n) {
    std::size_t like = 0;
    while (like < n && kBurrKinds[like].name != kBurrKinds[n].vibrates_as) ++like;
    if (kBurrKinds[like].name != kBurrKinds[n].vibrates_as) return false;
  }
  return true;
}());

[[nodiscard]] constexpr std::array<std::string_view, kBurrKinds.size()> enum_names(BurrKind) {
  std::array<std::string_view, kBurrKinds.size()> names;
  for (std::size_t n = 0; n < names.size(); ++n) names[n] = kBurrKinds[n].name;
  return names;
}

}  // namespace osteo::inline simulation
