// The table of all codes of a verdict: how grave, whether it rejects the scan, from which size on it is told, and what
// is done. docs/formats/verdict.md holds the same table, and a test holds the two together.
#pragma once
#include <span>
#include <string>
#include <string_view>

namespace osteo::inline imaging {

/// Sizes from which on something is told; each stands here only.
inline constexpr double kTiltDeg = 0.05;   ///< slices that lean by less are straight: 0.2 mm over a head
inline constexpr double kShiftMm = 0.05;   ///< of a slice, sideways against the others
inline constexpr double kMaxBoneCm2 = 80;  ///< of bone in each slice on average: a skull has up to 45, a pelvis 60
inline constexpr double kShiftedHu = 200;  ///< values shifted by as much are rejected
inline constexpr double kSliceBlankEndMm2PerMm =
    1700;  ///< a body that ends between two slices: three times what a head's vault does
inline constexpr double kSlicePartShare = 0.15;     ///< of the body in a slice that is of one value
inline constexpr double kSliceStepHu = 30;          ///< of air or soft tissue from a slice to the next
inline constexpr double kSliceMirrorRatio = 1.25;   ///< how much better a slice fits the next when turned over
inline constexpr double kSliceForeignRatio = 1.25;  ///< how much better the slices beside a foreign one fit each other
inline constexpr double kSliceOrderRatio = 1.2;     ///< how much better two slices fit in each other's place
/// Smaller in voxels below the second, or longer than the third, no scan of a patient is: fields of cone-beam scanners
/// begin at 40 mm, their voxels at 0.075 mm, and tables of CT scanners end at 2 m.
inline constexpr double kSpecimenMm = 40, kSpecimenVoxelMm = 0.074, kLongestMm = 2500;

enum class Refuses {
  no,
  yes,
  unless_any_modality,  ///< --any-modality takes the scan all the same
  beyond_tolerance,
  when_nothing_is_left,  ///< the file is left out; the scan is rejected when none can be used
};

struct VerdictCode {
  std::string_view code;
  std::string_view severity;  ///< "info", "warning", "error", or which when
  Refuses refuses = Refuses::no;
  double tolerance = 0;   ///< 0: there is none
  std::string_view unit;  ///< of the tolerance
  std::string_view what, then;
};

/// All of them, in the order of the page.
[[nodiscard]] std::span<const VerdictCode> verdict_codes();

/// Null for a code that is not in the table.
[[nodiscard]] const VerdictCode* find_verdict_code(std::string_view code);

/// The row of the page: "| `TILTED` | info | no | 0.05 degrees | ... | ... |".
[[nodiscard]] std::string table_row(const VerdictCode& code);

}  // namespace osteo::inline imaging
