#include "value_check.h"

#include <algorithm>
#include <cmath>

#include "osteo/core/base/param.h"
#include "osteo/imaging/dicom/detail/verdict_codes.h"

namespace osteo::inline imaging::dicom {
namespace {

struct Peak {
  double hu = 0, share = 0;
};

double centre_of(int bin) {
  return -1200 + 4 * bin + 1.5;
}
int bin_of(double hu) {
  return std::clamp(static_cast<int>((hu + 1200) / 4), 0, ValueCount::kBins - 1);
}

// Voxels by their value, and what stands out among them.
struct Histogram {
  const std::vector<std::uint32_t>& raw;
  std::vector<double> smooth;
  double total = 0;

  explicit Histogram(const std::vector<std::uint32_t>& counts) : raw(counts), smooth(counts.size()) {
    for (std::size_t i = 0; i < raw.size(); ++i) {
      total += raw[i];
      for (std::size_t j = i >= 2 ? i - 2 : 0; j < std::min(raw.size(), i + 3); ++j) smooth[i] += raw[j];
    }
  }
  // The highest place between two values, and the share of all voxels within 40 HU of it.
  [[nodiscard]] Peak peak(double lo, double hi) const {
    const int a = bin_of(lo), b = bin_of(hi);
    const auto it = std::max_element(smooth.begin() + a, smooth.begin() + b + 1);
    const int at = static_cast<int>(it - smooth.begin());
    double near = 0;
    for (int i = std::max(0, at - 10); i <= std::min(ValueCount::kBins - 1, at + 10); ++i)
      near += raw[static_cast<std::size_t>(i)];
    return {centre_of(at), total > 0 ? near / total : 0};
  }
  [[nodiscard]] double between(double lo, double hi) const {
    double n = 0;
    for (int i = bin_of(lo); i < bin_of(hi); ++i) n += raw[static_cast<std::size_t>(i)];
    return n;
  }
  // From a peak down to half of it.
  [[nodiscard]] double half_width(const Peak& of) const {
    const auto at = [&](int bin) { return smooth[static_cast<std::size_t>(bin)]; };
    int below = bin_of(of.hu);
    while (below > 0 && at(below) > 0.5 * at(bin_of(of.hu))) --below;
    return of.hu - centre_of(below);
  }
};

std::string whole(double v) {
  return format_number(std::round(v));
}

// More bone than kMaxBoneCm2 is soft tissue or air on a wrong scale, or a threshold that is not bone's.
constexpr double kBoneHu = 300;

void check_bone(Verdict& v, const std::vector<std::uint32_t>& histogram, double total, double voxel_mm3,
                double pixels) {
  double bone = 0;
  for (int i = bin_of(kBoneHu); i < ValueCount::kBins; ++i) bone += histogram[static_cast<std::size_t>(i)];
  const double bone_mm3 = bone / std::max(total, 1.0) * pixels * voxel_mm3;
  double height_mm = 0;
  for (std::size_t a = 0; a < 3; ++a)
    height_mm += std::abs(v.output.direction.column[a].z) * v.output.spacing_mm[a] * v.output.dims[a];
  if (height_mm <= 0 || bone_mm3 / height_mm <= kMaxBoneCm2 * 100) return;
  v.add(code::bone_implausible, Severity::warning,
        whole(bone_mm3 / 1000) + " cm3 are at " + whole(kBoneHu) + " HU or above, " +
            whole(bone_mm3 / height_mm / 100) + " cm2 of each slice on average: more than a body has bone",
        "see whether the values are Hounsfield units, and look at the mask ('osteo snapshot')");
}

// What was done to the pixels' bits.
void report_bits(Verdict& v, const ValueCount& count) {
  if (count.fractional) {
    v.add(code::values_rounded, Severity::info,
          "the HU scale is fractional; values are rounded to whole HU, at most 0.5 HU off");
  }
  if (count.sign_not_extended > 0) {
    v.add(code::sign_not_extended, Severity::info,
          "the sign of " + std::to_string(count.sign_not_extended) +
              " negative pixels is not extended above their stored bits; it is here");
  }
  if (count.bits_foreign > 0) {
    v.add(code::bits_foreign, Severity::info,
          std::to_string(count.bits_foreign) +
              " pixels have other bits above HighBit, such as an overlay; they are cleared");
  }
  if (count.bits_exceeded > 0) {
    v.add(code::bits_stored_wrong, Severity::warning,
          std::to_string(count.bits_exceeded) +
              " pixels need more bits than the file says it stores (BitsStored), and fit their neighbours only with "
              "these: whole words are "
              "taken",
          "compare with the scanner's own pictures, near metal above all");
  }
  if (count.high_bit_wrong > 0) {
    v.add(code::high_bit_wrong, Severity::warning,
          "the file says that the lowest bits belong to no pixel (HighBit), but they are in use: the lowest BitsStored "
          "bits are taken",
          "compare with the scanner's own pictures");
  }
}

void report_padding(Verdict& v, const ValueCount& count, double pixels) {
  ValueCheck& c = v.values;
  c.padding_share = static_cast<double>(count.by_tag + count.found + count.ring) / pixels;
  c.padding_hu = count.padding_hu;
  c.padding_source = count.by_tag > 0               ? (count.found + count.ring > 0 ? "tag and found" : "tag")
                     : count.found + count.ring > 0 ? "found"
                                                    : "none";
  const std::string share = format_number(std::round(c.padding_share * 1000) / 10) + " % of the pixels";
  if (count.by_tag > 0)
    v.add(code::padding_tag, Severity::info,
          "padding (" + whole(c.padding_hu) + " HU by its tag), " + share + ", is taken as air");
  if (count.found > 0) {
    v.add(code::padding_found, Severity::info,
          "values down to " + whole(c.padding_hu) + " HU" +
              (count.by_tag > 0 ? " besides those of the padding tag" : ", " + share + ", no tag names them") +
              ", are taken for padding and become air");
  }
  if (count.ring > 0) {
    v.add(code::padding_found, Severity::info,
          format_number(std::round(static_cast<double>(count.ring) / pixels * 1000) / 10) +
              " % of the pixels are connected with the pictures' corners and hold one value (" + whole(count.ring_hu) +
              " HU); they are taken for padding and become air");
  }
  if (static_cast<double>(count.declared_tissue) > 0.001 * pixels) {
    v.add(code::padding_tag_wrong, Severity::warning,
          "the padding tag names a value that tissue has; the tag is ignored");
  }
}

// What lies at the upper end, or above it.
void report_highest(Verdict& v, const ValueCount& count, double voxel_mm3, double pixels) {
  ValueCheck& c = v.values;
  if (count.out_of_range > 0) {
    const bool many = static_cast<double>(count.out_of_range) > 1e-4 * pixels;
    v.add(code::values_out_of_range, many ? Severity::error : Severity::warning,
          std::to_string(count.out_of_range) + " pixels are above 32767 HU (up to " + std::to_string(count.hu_max) +
              ")" + (many ? "" : "; they are cut there"),
          many ? "the file states the wrong sign or scale of its pixels; ask for the original export" : "");
  }
  c.saturated_mm3 = static_cast<double>(count.saturated) * voxel_mm3;
  c.metal_mm3 = static_cast<double>(count.metal) * voxel_mm3;
  if (c.saturated_mm3 > 1) {
    v.add(code::saturated, Severity::info,
          whole(c.saturated_mm3) + " mm3 are at the top of the stored range (" + std::to_string(count.hu_max) +
              " HU): denser matter is not distinguished",
          "an extended CT scale shows metal better");
  }
  if (c.metal_mm3 > 20) {
    v.add(code::metal, Severity::info,
          whole(c.metal_mm3) + " mm3 are at 3000 HU or above, as metal is; near it, streaks look like bone",
          "look at the mask near it; 'threshold --metal-mm' clears streaks");
  }
}

// How its values lie, as far as that tells whether they are Hounsfield units.
struct Scale {
  bool plausible = false;
  bool turned = false;  // the sign is the wrong one
  Peak plus_air;        // where air is if it is
};

Scale judge_scale(ValueCheck& c, const Histogram& h, const ValueCount& count, double pixels) {
  const Peak air = h.peak(-1100, -850), soft = h.peak(-250, 250);
  c.has_air = air.share > 0.005;
  // What else there is much of between air and bone's core: tissue on a wrong scale would lie there.
  const Peak above = h.peak(250, 1500), under = h.peak(-850, -250);
  c.has_soft_tissue = soft.share > 0.01 && soft.share > 0.15 * std::max(above.share, under.share);
  c.air_hu = air.hu;
  c.soft_tissue_hu = soft.hu;
  // Lungs, where the scan shows nothing outside the body. The airways in them are air, well apart from the peak, which
  // air on a smaller scale would not have.
  const double lung_share = 0.005 * h.between(-940, -600);
  const bool lungs =
      c.has_air && air.hu >= -940 && h.between(-1060, std::min(-940.0, air.hu - 2.5 * h.half_width(air))) > lung_share;
  // Much between air and tissue, and hardly a voxel of air: greys of another scale.
  const bool no_true_air = !c.has_air && under.share > 0.2 && h.between(-1100, -940) < lung_share;
  const bool air_right = c.has_air && ((air.hu > -1040 && air.hu < -940) || lungs);
  const bool soft_right = c.has_soft_tissue && soft.hu > -150 && soft.hu < 150;
  Scale s;
  s.plus_air = h.peak(850, 1100);
  s.turned = s.plus_air.share > 0.2 && std::abs(s.plus_air.hu - 1000) < 60 && s.plus_air.share > 2 * air.share;
  // No air at all but much "padding" far below it: air on a larger scale.
  const bool no_air_left = !c.has_air && static_cast<double>(count.found + count.below_air) > 0.2 * pixels;
  s.plausible =
      soft_right && !s.turned && !no_air_left && (air_right || (!c.has_air && !no_true_air && count.hu_min < -200));
  return s;
}

void report_below_air(Verdict& v, const ValueCount& count) {
  const ValueCheck& c = v.values;
  if (count.below_air > 0) {
    v.add(code::below_air, c.plausible ? Severity::info : Severity::warning,
          std::to_string(count.below_air) + " pixels lie below -1200 HU (down to " + std::to_string(count.hu_min) +
              ") and are no padding" +
              (c.plausible ? ": noise of air, or dark streaks beside metal; they are kept" : "; they are kept"),
          c.plausible ? "" : "see whether the values are Hounsfield units");
  }
}

// What the values could be instead, with a word on what would put them right.
void report_other_scale(Verdict& v, const Histogram& h, const ValueCount& count, const Scale& scale, bool any_values) {
  ValueCheck& c = v.values;
  const Severity grave = any_values ? Severity::warning : Severity::error;
  const std::string range = std::to_string(count.hu_min) + " to " + std::to_string(count.hu_max);
  const std::string advice =
      "check the bone threshold by eye ('osteo snapshot'), or ask for a series in Hounsfield units";
  if (scale.turned) {
    c.histogram = h.raw;
    v.add(code::hu_wrong_sign, grave,
          "the values (" + range + ") look like HU with the sign turned: air at " + whole(scale.plus_air.hu),
          "the file states the wrong scale; ask for the original export");
    return;
  }
  // The two highest peaks that stand apart, for a word on what could be wrong.
  const Peak first = h.peak(-1200, 3000);
  const Peak left = first.hu - 300 > -1200 ? h.peak(-1200, first.hu - 300) : Peak{};
  const Peak right = first.hu + 300 < 3000 ? h.peak(first.hu + 300, 3000) : Peak{};
  const Peak& second = left.share > right.share ? left : right;
  const double apart = std::abs(first.hu - second.hu), low = std::min(first.hu, second.hu);
  if (second.share > 0.02 && apart > 940 && apart < 1130) {
    // Unsigned pixels whose intercept was left out begin at 0, which is -1024 by custom.
    const double offset = count.hu_min == 0 && low < 80 ? -1024 : std::round(-1000 - low);
    const bool small = std::abs(offset) < kShiftedHu;
    c.histogram = h.raw;
    c.offset_hu = offset;
    v.add(code::hu_shifted, small ? Severity::warning : grave,
          "the values (" + range + ") look like HU shifted by " + whole(low + 1000) + ": air at " + whole(low) +
              ", tissue at " + whole(low + apart) + "; " + whole(offset) + " HU added to each would put them right",
          "--hu-offset " + whole(offset) + " adds it; 'osteo suggest-threshold SCAN --hu-offset " + whole(offset) +
              " --picture histogram.svg' shows the result first; or ask for the original export");
  } else if (second.share > 0.02 && apart > 400 && c.has_air) {
    v.add(code::hu_scaled, Severity::warning,
          "the values (" + range + ") look like HU on another scale: air at " + whole(low) + ", tissue at " +
              whole(low + apart),
          advice);
  } else {
    v.add(code::not_hu, Severity::warning,
          "the values (" + range + ") do not look like Hounsfield units; cone-beam scanners give greys like these",
          advice);
  }
}

}  // namespace

void check_values(Verdict& v, const ValueCount& count, double voxel_mm3, bool any_values) {
  ValueCheck& c = v.values;
  c.checked = true;
  c.hu_min = count.hu_min;
  c.hu_max = count.hu_max;
  c.rounding_error_hu = count.fractional ? 0.5 : 0;
  const double pixels = std::max<double>(1, static_cast<double>(count.pixels));
  report_bits(v, count);
  report_padding(v, count, pixels);
  report_highest(v, count, voxel_mm3, pixels);
  if (count.histogram.empty()) return;
  const Histogram h(count.histogram);
  const Scale scale = judge_scale(c, h, count, pixels);
  c.plausible = scale.plausible;
  check_bone(v, h.raw, h.total, voxel_mm3, pixels);
  report_below_air(v, count);
  if (!c.plausible) return report_other_scale(v, h, count, scale, any_values);
  // Outside the scan the scanner may have cut everything off at -1024.
  const bool cut_air = c.padding_share > 0.01 || count.hu_min <= kAirHu;
  if (!c.has_air && !cut_air)
    v.add(code::no_air, Severity::info, "there is no air in the pictures by which to check the HU scale");
}

}  // namespace osteo::inline imaging::dicom
