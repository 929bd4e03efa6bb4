#include "osteo/imaging/dicom/detail/verdict_codes.h"

#include <algorithm>
#include <array>

#include "osteo/core/base/param.h"
#include "osteo/imaging/dicom/detail/place.h"
#include "osteo/imaging/dicom/verdict.h"

namespace osteo::inline imaging {
namespace {

constexpr auto kTable = std::to_array<VerdictCode>({
    {code::tilted, "info", Refuses::no, kTiltDeg, "degrees", "the slices lean (gantry tilt), by their positions",
     "resampled upright"},
    {code::gaps_uneven, "warning (info up to 0.1 mm: rounded positions)", Refuses::no, 2 * kSamePlaceMm, "mm",
     "the distances between slices differ", "interpolated between true places"},
    {code::slices_missing, "warning", Refuses::no, 1.5, "times the usual distance", "single slices are missing, named",
     "interpolated up to `--max-hole-mm` (3)"},
    {code::hole_too_wide, "error", Refuses::beyond_tolerance, 3, "mm", "a hole wider than that", "rejected"},
    {code::gap_too_wide, "error", Refuses::beyond_tolerance, 8, "mm", "usual distance above `--max-gap-mm` (8)",
     "rejected"},
    {code::shifted_sideways, "warning", Refuses::no, kShiftMm, "mm", "slices jump sideways",
     "each taken where it says it lies"},
    {code::slice_blank, "warning", Refuses::no, kSliceBlankEndMm2PerMm, "mm2 a mm, at an end",
     "a slice whose pixels are all of one value, between slices that show a body, or at an end where a "
     "body cannot end",
     "kept as it is; bone is missing"},
    {code::slice_part_missing, "warning", Refuses::no, kSlicePartShare, "of the body",
     "whole rows or columns, or a share of the body, of one value where the slices before and after show a "
     "body",
     "kept as it is; bone is missing"},
    {code::slice_values_step, "warning", Refuses::no, kSliceStepHu, "HU",
     "air or soft tissue is brighter or darker in a slice than in the one beside it: wrong slope or "
     "intercept",
     "kept as it is"},
    {code::slice_mirrored, "warning", Refuses::no, kSliceMirrorRatio, "times",
     "a slice fits the one beside it better when turned over", "kept as it is"},
    {code::slice_foreign, "warning", Refuses::no, kSliceForeignRatio, "times",
     "up to eight slices fit neither the slice before nor the one after, which fit each other better", "kept as it is"},
    {code::slice_repeated, "warning", Refuses::no, 0, "", "a slice shows the same picture as the one before",
     "kept as it is; what lies there is not in the scan"},
    {code::slice_order, "warning", Refuses::no, kSliceOrderRatio, "times",
     "two slices fit better in each other's place, or several in reverse order", "kept as it is"},
    {code::concatenation_incomplete, "warning", Refuses::no, 0, "",
     "parts of a multi-frame scan over several files (InConcatenationTotalNumber) are not there",
     "what is there is taken"},
    {code::several_stacks, "warning", Refuses::no, 0, "",
     "orientations, sizes, acquisitions, times, tube voltages, kernels or places beside each other in one "
     "series, named",
     "the best is taken; `--stack N`"},
    {code::several_scans, "warning", Refuses::no, 0, "",
     "slices of another patient, study or frame of reference under the same series UID", "left out, by name"},
    {code::frame_of_reference_wrong, "warning", Refuses::no, 0, "", "each slice names a frame of reference of its own",
     "taken as one scan"},
    {code::not_a_volume, "error", Refuses::yes, 0, "", "one slice, or all at one place", "rejected"},
    {code::slices_at_one_place, "error", Refuses::yes, 0, "",
     "two different pictures at one place, nothing distinguishes them", "rejected"},
    {code::slices_overlap, "info, warning from 4 times on", Refuses::no, 1.25, "times the distance",
     "slices thicker than they are apart", "taken; nothing finer than the thickness is seen"},
    {code::projection, "error", Refuses::unless_any_modality, 0, "",
     "maximum or minimum intensity of slabs, renderings", "rejected; `--any-modality`"},
    {code::rescale_type, "error (warning: HU_MOD)", Refuses::unless_any_modality, 0, "",
     "RescaleType says that the values are no HU: Z_EFF, ED, MGML, ...", "rejected; `--any-modality`"},
    {code::few_slices, "warning", Refuses::no, 10, "slices", "fewer than ten", ""},
    {code::not_ct, "error", Refuses::unless_any_modality, 0, "", "another modality", "rejected; `--any-modality`"},
    {code::tilt_tag_wrong, "info", Refuses::no, 0.5, "degrees", "a tag says otherwise than the positions",
     "the positions count"},
    {code::spacing_tag_wrong, "info (warning where the numbers of the slices skip as well)", Refuses::no, 1, "%",
     "a tag says otherwise than the positions", "the positions count"},
    {code::other_size, "warning", Refuses::no, 0, "", "single slices that do not fit the stack", "left out, by name"},
    {code::other_spacing, "warning", Refuses::no, kSamePlaceMm, "mm at a corner",
     "single slices that do not fit the stack", "left out, by name"},
    {code::other_orientation, "warning", Refuses::no, kSamePlaceMm, "mm at a corner",
     "single slices that do not fit the stack", "left out, by name"},
    {code::other_acquisition, "info", Refuses::no, 0, "",
     "slices of another acquisition, time, tube voltage, kernel or thickness at the same places or in "
     "turn, or beside the others",
     "left out"},
    {code::duplicate_file, "info", Refuses::no, 0, "", "the same picture twice (same UID, another UID)", "left out"},
    {code::duplicate_slice, "info", Refuses::no, kSamePlaceMm, "mm", "the same picture twice (same UID, another UID)",
     "left out"},
    {code::position_missing, "warning", Refuses::when_nothing_is_left, 0, "", "a file that says too little",
     "left out; the hole counts"},
    {code::orientation_missing, "warning", Refuses::when_nothing_is_left, 0, "", "a file that says too little",
     "left out; the hole counts"},
    {code::spacing_missing, "warning", Refuses::when_nothing_is_left, 0, "", "a file that says too little",
     "left out; the hole counts"},
    {code::slope_invalid, "warning", Refuses::when_nothing_is_left, 0, "", "a file that says too little",
     "left out; the hole counts"},
    {code::header_damaged, "warning", Refuses::when_nothing_is_left, 0, "", "a file that is cut, damaged, or not there",
     "left out; the hole counts"},
    {code::pixels_damaged, "warning", Refuses::when_nothing_is_left, 0, "", "a file that is cut, damaged, or not there",
     "left out; the hole counts"},
    {code::no_pixels, "warning", Refuses::when_nothing_is_left, 0, "", "a file that is cut, damaged, or not there",
     "left out; the hole counts"},
    {code::unsupported_encoding, "warning", Refuses::when_nothing_is_left, 0, "",
     "a transfer syntax that is not read, named, with what this build lacks for it", "left out; the hole counts"},
    {code::cannot_read, "warning", Refuses::when_nothing_is_left, 0, "", "a file that is cut, damaged, or not there",
     "left out; the hole counts"},
    {code::missing_file, "warning", Refuses::when_nothing_is_left, 0, "", "a file that is cut, damaged, or not there",
     "left out; the hole counts"},
    {code::localizer, "only under `set_aside`", Refuses::when_nothing_is_left, 0, "", "files that are no slices",
     "left out"},
    {code::colour, "only under `set_aside`", Refuses::when_nothing_is_left, 0, "", "files that are no slices",
     "left out"},
    {code::not_an_image, "only under `set_aside`", Refuses::when_nothing_is_left, 0, "", "files that are no slices",
     "left out"},
    {code::not_dicom, "only under `set_aside`", Refuses::when_nothing_is_left, 0, "", "files that are no slices",
     "left out"},
    {code::padding_tag, "info", Refuses::no, 0, "",
     "a value that marks \"not measured\", by tag, or by being shared by many pixels below -1200 HU and all "
     "others, or by filling the corners of a picture above 1500 HU",
     "air, before interpolation"},
    {code::padding_found, "info", Refuses::no, 0, "",
     "a value that marks \"not measured\", by tag, or by being shared by many pixels below -1200 HU and all "
     "others, or by filling the corners of a picture above 1500 HU",
     "air, before interpolation"},
    {code::below_air, "info, warning off the scale", Refuses::no, 0, "",
     "other values below -1200 HU: dark streaks beside metal, noise of sharp kernels", "kept"},
    {code::padding_tag_wrong, "warning", Refuses::no, 0, "", "the padding tag names a value of tissue",
     "the tag is ignored"},
    {code::sign_not_extended, "info", Refuses::no, 0, "",
     "signed pixels of fewer bits than their words, whose sign is not extended above them", "extended"},
    {code::bits_foreign, "info", Refuses::no, 0, "", "other bits above HighBit (an overlay, rubbish)", "cleared"},
    {code::bits_stored_wrong, "warning", Refuses::no, 0, "",
     "values that need more bits than BitsStored, and fit their neighbours only with these", "whole words are taken"},
    {code::high_bit_wrong, "warning", Refuses::no, 0, "", "HighBit leaves out low bits that are in use",
     "the lowest BitsStored bits are taken"},
    {code::saturated, "info", Refuses::no, 1, "mm3", "matter at the top of the stored range (12 bits: 3071 HU)", ""},
    {code::metal, "info", Refuses::no, 20, "mm3", "matter at 3000 HU or above", "streaks: `threshold --metal-mm`"},
    {code::hu_wrong_sign, "error", Refuses::unless_any_modality, 0, "", "air at +1000", "rejected"},
    {code::values_out_of_range, "error, or warning for a few", Refuses::beyond_tolerance, 0.01, "% of the pixels",
     "above 32767 HU: wrong sign or scale of the pixels", "rejected, or cut"},
    {code::hu_shifted, "error from 200 HU on, else warning", Refuses::unless_any_modality, kShiftedHu, "HU",
     "air and tissue as far apart as they should be, but not where HU puts them, as without rescale "
     "intercept",
     "rejected, with the offset that `--hu-offset` takes; `--any-modality`"},
    {code::axes_not_stated, "warning", Refuses::no, 0, "",
     "a volume file does not say which way left, back and head are", "LPS is taken; `--axes` states it"},
    {code::lengths_converted, "warning", Refuses::no, 0, "", "a volume file's lengths are not in mm", "converted"},
    {code::places_disagree, "warning", Refuses::no, 1, "voxel",
     "the two forms of a NIfTI file put its voxels at different places", "the sform is taken"},
    {code::size_implausible, "warning", Refuses::no, kSpecimenMm, "mm",
     "a volume file is smaller than a scan of a patient in voxels below 0.075 mm, or longer than 2.5 m: micro-CT, or "
     "lengths that are not in the unit that it states",
     "taken as stated"},
    {code::hu_offset, "warning", Refuses::no, 0, "", "an offset that was asked for", "added to all values"},
    {code::hu_scaled, "warning", Refuses::no, 0, "", "air and soft tissue are not where HU puts them (cone-beam greys)",
     "check the threshold by eye"},
    {code::not_hu, "warning", Refuses::no, 0, "", "air and soft tissue are not where HU puts them (cone-beam greys)",
     "check the threshold by eye"},
    {code::bone_implausible, "warning", Refuses::no, kMaxBoneCm2, "cm2",
     "more at 300 HU or above than a body has bone (80 cm2 of each slice on average)", "look at the mask"},
    {code::no_air, "info", Refuses::no, 0, "", "no air by which to check the scale", ""},
    {code::monochrome1, "info", Refuses::no, 0, "", "meant to be shown inverted", "values taken as stored"},
    {code::values_rounded, "info", Refuses::no, 0, "", "fractional HU scale", "whole HU, at most 0.5 off"},
    {code::lossy, "info", Refuses::no, 0, "", "compressed with loss", ""},
});

}  // namespace

std::span<const VerdictCode> verdict_codes() {
  return kTable;
}

const VerdictCode* find_verdict_code(std::string_view code) {
  const auto it = std::find_if(kTable.begin(), kTable.end(), [&](const VerdictCode& c) { return c.code == code; });
  return it == kTable.end() ? nullptr : &*it;
}

std::string table_row(const VerdictCode& c) {
  static constexpr std::array<std::string_view, 5> kRefuses{"no", "yes", "unless `--any-modality`",
                                                            "beyond the tolerance", "when no file is left"};
  std::string row = "| `" + std::string(c.code) + "` | " + std::string(c.severity) + " | " +
                    std::string(kRefuses[static_cast<std::size_t>(c.refuses)]) + " | ";
  if (c.tolerance != 0) row += format_number(c.tolerance) + " " + std::string(c.unit) + " ";
  row += "| " + std::string(c.what) + " |";
  if (!c.then.empty()) row += " " + std::string(c.then);
  return row + " |";
}

}  // namespace osteo::inline imaging
