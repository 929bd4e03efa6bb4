// What an import found, in words and stable codes. As JSON it is written beside every import (docs/formats/verdict.md,
// verdict.schema.json).
#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "osteo/core/data/frame.h"

namespace osteo::inline imaging {

/// Codes never change their meaning; new ones may come. verdict_codes.h says of each how grave it is and whether it
/// rejects.
namespace code {
// Files that are not slices of a scan.
inline constexpr std::string_view not_dicom = "NOT_DICOM", not_an_image = "NOT_AN_IMAGE", no_pixels = "NO_PIXELS",
                                  colour = "COLOUR", localizer = "LOCALIZER", cannot_read = "CANNOT_READ",
                                  missing_file = "MISSING_FILE", unsupported_encoding = "UNSUPPORTED_ENCODING";
// Files that are damaged or say too little.
inline constexpr std::string_view header_damaged = "HEADER_DAMAGED", pixels_damaged = "PIXELS_DAMAGED",
                                  position_missing = "POSITION_MISSING", orientation_missing = "ORIENTATION_MISSING",
                                  spacing_missing = "SPACING_MISSING", slope_invalid = "SLOPE_INVALID";
// Slices that do not belong to the stack.
inline constexpr std::string_view other_size = "OTHER_SIZE", other_spacing = "OTHER_SPACING",
                                  other_orientation = "OTHER_ORIENTATION", other_acquisition = "OTHER_ACQUISITION",
                                  duplicate_file = "DUPLICATE_FILE", duplicate_slice = "DUPLICATE_SLICE";
// The stack as a whole.
inline constexpr std::string_view not_ct = "NOT_CT", not_a_volume = "NOT_A_VOLUME",
                                  slices_at_one_place = "SLICES_AT_ONE_PLACE", gap_too_wide = "GAP_TOO_WIDE",
                                  slices_missing = "SLICES_MISSING", hole_too_wide = "HOLE_TOO_WIDE",
                                  gaps_uneven = "GAPS_UNEVEN", tilted = "TILTED", shifted_sideways = "SHIFTED_SIDEWAYS",
                                  several_stacks = "SEVERAL_STACKS", few_slices = "FEW_SLICES",
                                  tilt_tag_wrong = "TILT_TAG_WRONG", spacing_tag_wrong = "SPACING_TAG_WRONG",
                                  several_scans = "SEVERAL_SCANS",
                                  frame_of_reference_wrong = "FRAME_OF_REFERENCE_WRONG", projection = "PROJECTION",
                                  slices_overlap = "SLICES_OVERLAP",
                                  concatenation_incomplete = "CONCATENATION_INCOMPLETE";
// Pixels of slices that do not fit those beside them.
inline constexpr std::string_view slice_blank = "SLICE_BLANK", slice_part_missing = "SLICE_PART_MISSING",
                                  slice_values_step = "SLICE_VALUES_STEP", slice_mirrored = "SLICE_MIRRORED",
                                  slice_foreign = "SLICE_FOREIGN", slice_repeated = "SLICE_REPEATED",
                                  slice_order = "SLICE_ORDER";
// What a volume file leaves open.
inline constexpr std::string_view axes_not_stated = "AXES_NOT_STATED", lengths_converted = "LENGTHS_CONVERTED",
                                  places_disagree = "PLACES_DISAGREE", size_implausible = "SIZE_IMPLAUSIBLE";
// The values.
inline constexpr std::string_view padding_tag = "PADDING_TAG", padding_found = "PADDING_FOUND",
                                  padding_tag_wrong = "PADDING_TAG_WRONG", monochrome1 = "MONOCHROME1",
                                  saturated = "SATURATED", metal = "METAL", values_rounded = "VALUES_ROUNDED",
                                  values_out_of_range = "VALUES_OUT_OF_RANGE", hu_wrong_sign = "HU_WRONG_SIGN",
                                  hu_shifted = "HU_SHIFTED", hu_scaled = "HU_SCALED", not_hu = "NOT_HU",
                                  no_air = "NO_AIR", lossy = "LOSSY", sign_not_extended = "SIGN_NOT_EXTENDED",
                                  bits_foreign = "BITS_FOREIGN", bits_stored_wrong = "BITS_STORED_WRONG",
                                  high_bit_wrong = "HIGH_BIT_WRONG", rescale_type = "RESCALE_TYPE",
                                  hu_offset = "HU_OFFSET", below_air = "BELOW_AIR",
                                  bone_implausible = "BONE_IMPLAUSIBLE";
}  // namespace code

enum class Severity { info, warning, error };

struct Finding {
  std::string code;
  Severity severity = Severity::info;
  std::string message;             ///< a sentence for people: what, where, how much
  std::string advice;              ///< what a person should do; may be empty
  std::vector<std::string> files;  ///< shown names, where files matter
};

struct FileSetAside {
  std::string file, code, why;
};

/// Where a slice of the input went.
struct SliceRecord {
  std::string file;
  int frame = 0;
  Vec3 position_mm;         ///< as the file states it
  double along_mm = 0;      ///< distance from the first slice along the common normal
  double output_index = 0;  ///< in slices of the output; whole numbers when nothing was resampled
};

struct SliceGap {
  std::string after, before;  ///< files
  double gap_mm = 0, usual_mm = 0;
  int missing = 0;  ///< slices that seem to be missing in it
  bool filled = false;
};

/// What the values say. Peaks are of the histogram of all voxels that are not padding.
struct ValueCheck {
  std::int64_t hu_min = 0, hu_max = 0;
  bool checked = false, plausible = false;
  double air_hu = 0, soft_tissue_hu = 0;  ///< peaks; only meaningful with has_air, has_soft_tissue
  bool has_air = false, has_soft_tissue = false;
  std::string padding_source = "none";  ///< "none", "tag", "found", "tag and found"
  double padding_hu = 0, padding_share = 0;
  double saturated_mm3 = 0, metal_mm3 = 0;
  double rounding_error_hu = 0;  ///< of whole HU: 0 when slope and intercept are whole numbers
  // What a picture of a refusal shows; kept only where one helps.
  std::vector<std::uint32_t> histogram;  ///< 4 HU a bin, from -1200
  double offset_hu = 0;                  ///< that would put the values right
};

struct Verdict {
  std::string source = "DICOM";
  int series = 0, stack = 1, stacks = 1;
  std::string modality, kernel, why_chosen;
  std::string scanner;    ///< who made it, as one of a fixed list of makers; empty where it is none of them: no other
                          ///< text of the file
  std::string scan_hash;  ///< of its study and frame of reference: the same for all series of one scan; empty where
                          ///< they are not known
  int columns = 0, rows = 0;
  double pixel_mm[2] = {0, 0};
  double thickness_mm = 0;
  bool resampled = false;
  double gap_min_mm = 0, gap_max_mm = 0, gap_usual_mm = 0, tilt_deg = 0;
  double shear_mm_per_mm[2] = {0, 0};  ///< drift along rows and columns per mm along the normal
  double position_error_mm = 0;        ///< worst distance between where a pixel is and where the file says it is
  Frame output;
  ValueCheck values;
  std::vector<SliceRecord> slices;
  std::vector<SliceGap> gaps;  ///< where slices seem to be missing, or the distance is too wide
  std::vector<FileSetAside> set_aside;
  std::vector<Finding> findings;

  void add(std::string_view code, Severity severity, std::string message, std::string advice = {},
           std::vector<std::string> files = {});
  [[nodiscard]] bool has(std::string_view code) const;
  [[nodiscard]] bool refused() const;
  /// "good": taken as it is; "repaired": resampled or with something set aside; "rejected".
  [[nodiscard]] std::string status() const;
};

/// Pretty-printed, keys in a fixed order. Says nothing that identifies the patient.
[[nodiscard]] std::string to_json(const Verdict& verdict);

/// The histogram of values that were rejected for their scale, where air and tissue should be, and the values with the
/// offset that is proposed, as SVG. Empty for a verdict without such a finding.
[[nodiscard]] std::string picture_of(const Verdict& verdict);

/// What a person wants to know of a verdict that was written before.
struct VerdictSummary {
  std::string status;     ///< "good", "repaired", "rejected"
  std::string scan_hash;  ///< as in Verdict
  std::vector<Finding> findings;
};
/// Error(corrupt) when the text is no verdict.
[[nodiscard]] VerdictSummary read_verdict(std::string_view json);

}  // namespace osteo::inline imaging
