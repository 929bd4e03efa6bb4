#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <map>
#include <set>

#include "osteo/core/base/order.h"
#include "osteo/core/base/param.h"
#include "osteo/imaging/dicom/detail/verdict_codes.h"
#include "place_parts.h"

namespace osteo::inline imaging::dicom {
namespace {

constexpr double kDegrees = 180 / 3.14159265358979323846;

class StackJudge {
 public:
  StackJudge(const Pictures& pictures, const std::vector<Candidate>& stack, const PlaceOptions& options, Placement& p)
      : pictures_(pictures), headers_(pictures.headers), stack_(stack), options_(options), result_(p) {}

  void run() {
    judge_gaps();
    judge_lean();
    judge_pictures();
    compare_tags();
    judge_rest();
  }

 private:
  [[nodiscard]] std::string name_of(std::size_t header, int frame) const { return pictures_.name_of(header, frame); }

  void judge_gaps() {
    const auto& s = result_.slices;
    Verdict& v = result_.verdict;
    std::vector<double> gaps;
    for (std::size_t i = 1; i < s.size(); ++i) gaps.push_back(s[i].along_mm - s[i - 1].along_mm);
    auto sorted = gaps;
    std::sort(sorted.begin(), sorted.end());
    v.gap_min_mm = sorted.front();
    v.gap_max_mm = sorted.back();
    v.gap_usual_mm = sorted[sorted.size() / 2];

    const auto step = [&](std::size_t i) {
      return std::abs(headers_[s[i + 1].header].instance - headers_[s[i].header].instance);
    };
    std::size_t ones = 0;
    for (std::size_t i = 0; i < gaps.size(); ++i) ones += step(i) == 1 ? 1 : 0;
    const bool numbered = ones * 2 > gaps.size();

    // Positions written to tenths of a millimetre make distances of even slices wander by as much.
    const auto equal =
        std::count_if(gaps.begin(), gaps.end(), [&](double g) { return std::abs(g - v.gap_usual_mm) <= kSamePlaceMm; });
    tenths_ = equal * 5 < static_cast<std::ptrdiff_t>(gaps.size()) * 4 &&
              std::all_of(s.begin(), s.end(), [](const PlacedSlice& p) {
                return std::abs(p.along_mm * 10 - std::round(p.along_mm * 10)) < 1e-4;
              });
    const double slack = tenths_ ? 0.101 : 0;

    std::vector<std::string> files;
    std::string first_message;
    double widest = 0;
    int missing = 0;
    for (std::size_t i = 0; i < gaps.size(); ++i) {
      // What is usual near here: several distances in a row are a plan of the scan, one alone is a hole.
      std::vector<double> near;
      for (std::size_t j = i >= 5 ? i - 5 : 0; j < std::min(gaps.size(), i + 6); ++j) {
        if (j != i) near.push_back(gaps[j]);
      }
      if (near.empty()) near.push_back(gaps[i]);
      std::sort(near.begin(), near.end());
      double usual = near[near.size() / 2];
      bool hole = gaps[i] > 1.5 * usual + slack;
      if (!hole && numbered && step(i) > 1 && gaps[i] > 1.5 * near.front() + slack) {
        hole = true;
        usual = near.front();
      }
      const std::string a = name_of(s[i].header, s[i].frame), b = name_of(s[i + 1].header, s[i + 1].frame);
      if (!hole) {
        if (gaps[i] <= options_.max_gap_mm) continue;
        v.gaps.push_back({a, b, gaps[i], usual, 0, false});
        if (!v.has(code::gap_too_wide)) {
          v.add(code::gap_too_wide, Severity::error,
                "the slices are " + mm(gaps[i]) + " apart (between '" + a + "' and '" + b + "'); up to " +
                    mm(options_.max_gap_mm) + " is interpolated",
                "ask for a thinner reconstruction; --max-gap-mm accepts wider distances", {a, b});
        }
        continue;
      }
      const int count = std::max(1, static_cast<int>(std::lround(gaps[i] / usual)) - 1);
      v.gaps.push_back({a, b, gaps[i], usual, count, gaps[i] <= options_.max_hole_mm});
      missing += count;
      files.push_back(a);
      files.push_back(b);
      if (gaps[i] > widest) {
        widest = gaps[i];
        first_message = std::to_string(count) + (count == 1 ? " slice is" : " slices are") + " missing between '" + a +
                        "' and '" + b + "' (" + mm(gaps[i]) + " apart instead of " + mm(usual) + ")";
      }
    }
    if (missing == 0) return;
    const bool refuse = widest > options_.max_hole_mm;
    v.add(refuse ? code::hole_too_wide : code::slices_missing, refuse ? Severity::error : Severity::warning,
          (v.gaps.size() > 1 ? std::to_string(missing) + " slices are missing; at the widest place " : std::string()) +
              first_message +
              (refuse ? "; up to " + mm(options_.max_hole_mm) + " is interpolated" : "; the hole is interpolated"),
          "copy the missing files from their source" + std::string(refuse ? "; --max-hole-mm accepts wider holes" : ""),
          files);
  }

  // Whether the pictures are slices of Hounsfield units at all, and how sharp they are along the normal.
  void judge_pictures() {
    Verdict& v = result_.verdict;
    const Severity grave = options_.any_modality ? Severity::warning : Severity::error;
    const double thickness = v.thickness_mm, gap = v.gap_usual_mm;
    if (std::any_of(stack_.begin(), stack_.end(), [&](const Candidate& c) { return headers_[c.header].projection; })) {
      v.add(code::projection, grave,
            "the pictures are projections (MIP): each shows the brightest or darkest of a slab" +
                (thickness > 0 ? " of " + mm(thickness) : std::string()) + ", which makes bone too thick",
            "choose the series of thin slices that they were made from");
    } else if (thickness > 1.25 * gap && thickness > 0.5) {
      const bool by_far = thickness >= 4 * gap && thickness >= 3;
      v.add(
          code::slices_overlap, by_far ? Severity::warning : Severity::info,
          "slices of " + mm(thickness) + " lie " + mm(gap) +
              " apart and overlap: along their normal nothing finer than " + mm(thickness) + " is seen" +
              (by_far ? "; slabs like these may also be maximum-intensity projections, which make bone too thick" : ""),
          by_far ? "choose a series whose slices are as thick as they are apart" : "");
    }
    const auto other = std::find_if(stack_.begin(), stack_.end(), [&](const Candidate& c) {
      const std::string type = upper_case(pictures_.frame_of(c).rescale_type);
      return !type.empty() && type != "HU" && type != "US";
    });
    if (other == stack_.end()) return;
    const std::string& type = pictures_.frame_of(*other).rescale_type;
    const bool modified = upper_case(type) == "HU_MOD";
    v.add(code::rescale_type, modified ? Severity::warning : grave,
          modified
              ? "the values are modified Hounsfield units (HU_MOD), as spectral scanners write them"
              : "the values are no Hounsfield units but '" + type + "' (RescaleType), as of a spectral or material map",
          modified ? "look at the mask before you rely on a threshold" : "choose a series in Hounsfield units");
  }

  static std::string upper_case(std::string text) {
    std::transform(text.begin(), text.end(), text.begin(),
                   [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
    return text;
  }

  static double median(std::vector<double> values) {
    std::erase_if(values, [](double v) { return !std::isfinite(v); });
    return upper_median(std::move(values));
  }

  // Drift in mm per mm along the normal, and where it is at the first slice: a line through most slices, which single
  // slices that are shifted do not turn (a line by least squares would call one shifted slice a tilt).
  [[nodiscard]] std::pair<double, double> drift(std::size_t a) const {
    const auto& s = result_.slices;
    std::vector<double> slopes, rest;
    for (std::size_t i = 1; i < s.size(); ++i)
      slopes.push_back((s[i].sideways_mm[a] - s[i - 1].sideways_mm[a]) / (s[i].along_mm - s[i - 1].along_mm));
    double slope = median(slopes);
    const auto residuals = [&](double by) {
      std::vector<double> r;
      for (const PlacedSlice& slice : s) r.push_back(slice.sideways_mm[a] - by * slice.along_mm);
      return r;
    };
    rest = residuals(slope);
    double level = median(rest);
    std::vector<double> off;
    for (const double r : rest) off.push_back(std::abs(r - level));
    // Positions rounded to tenths wander by as much; what is further off does not take part.
    const double near = 0.06 + 3 * median(off);
    double n = 0, mean = 0, mean_side = 0, zz = 0, zs = 0;
    for (std::size_t i = 0; i < s.size(); ++i) {
      if (off[i] > near) continue;
      n += 1;
      mean += s[i].along_mm;
      mean_side += s[i].sideways_mm[a];
    }
    if (n == 0) return {0, level};
    mean /= n;
    mean_side /= n;
    for (std::size_t i = 0; i < s.size(); ++i) {
      if (off[i] > near) continue;
      zz += (s[i].along_mm - mean) * (s[i].along_mm - mean);
      zs += (s[i].along_mm - mean) * (s[i].sideways_mm[a] - mean_side);
    }
    // The least squares of these, where the steps from slice to slice agree with it as well: a step in the middle is no
    // drift.
    const double fitted = zz > 0 ? zs / zz : slope;
    const auto agreeing = [&](double by) {
      int count = 0;
      for (std::size_t i = 1; i < s.size(); ++i) {
        const double step = s[i].sideways_mm[a] - s[i - 1].sideways_mm[a] - by * (s[i].along_mm - s[i - 1].along_mm);
        count += std::abs(step) <= 0.06 ? 1 : 0;
      }
      return count;
    };
    if (agreeing(fitted) * 10 >= agreeing(slope) * 9) slope = fitted;
    return {slope, median(residuals(slope))};
  }

  void judge_lean() {
    Placement& p = result_;
    Verdict& v = result_.verdict;
    const auto& s = p.slices;
    const auto n = static_cast<double>(s.size());
    double shear[2] = {0, 0}, level[2] = {0, 0};
    for (std::size_t a = 0; a < 2; ++a) std::tie(shear[a], level[a]) = drift(a);
    double jitter = 0, off = 0;
    std::vector<std::string> shifted;
    const double pitch = s.back().along_mm / (n - 1);
    for (std::size_t i = 0; i < s.size(); ++i) {
      double j2 = 0, side2 = 0;
      for (int a = 0; a < 2; ++a) {
        const double r = s[i].sideways_mm[a] - level[a] - shear[a] * s[i].along_mm;
        j2 += r * r;
        side2 += s[i].sideways_mm[a] * s[i].sideways_mm[a];
      }
      const double along = s[i].along_mm - pitch * static_cast<double>(i);
      jitter = std::max(jitter, std::sqrt(j2));
      if (j2 > kShiftMm * kShiftMm) shifted.push_back(pictures_.name_of(stack_[i]));
      off = std::max(off, std::sqrt(along * along + side2));
    }
    p.even = off <= kSamePlaceMm;
    for (int a = 0; a < 2; ++a) v.shear_mm_per_mm[a] = shear[a];
    v.tilt_deg = std::atan(std::hypot(shear[0], shear[1])) * kDegrees;
    if (v.tilt_deg < 0.005) v.tilt_deg = 0;
    v.resampled = !p.even;
    v.position_error_mm = p.even ? off : 0;
    double corners = 0;
    for (const Candidate& c : stack_) corners = std::max(corners, pictures_.corner_deviation(c, stack_.front()));
    v.position_error_mm += corners;

    if (v.tilt_deg > kTiltDeg) {
      v.add(code::tilted, Severity::info,
            "the slices lean by " + format_number(std::round(v.tilt_deg * 100) / 100) +
                " degrees (gantry tilt); they are resampled upright");
    }
    if (jitter > kShiftMm) {
      v.add(code::shifted_sideways, Severity::warning,
            (shifted.size() == 1
                 ? "one slice ('" + shifted.front() + "') is shifted sideways by "
                 : std::to_string(shifted.size()) + " slices are shifted sideways against the others by up to ") +
                mm(jitter) + "; each is taken where it says it lies",
            "compare with the scanner's own pictures: a moved table is in the positions, a moved patient is not",
            shifted);
    }
    const bool uneven = v.gap_max_mm - v.gap_min_mm > 2 * kSamePlaceMm && !p.even;
    if (uneven && !v.has(code::slices_missing) && !v.has(code::hole_too_wide)) {
      // Positions rounded to a tenth of a millimetre are common, and no reason to worry anybody.
      const bool rounding = v.gap_max_mm - v.gap_min_mm < (tenths_ ? 0.11 : std::min(0.11, 0.2 * v.gap_usual_mm));
      v.add(code::gaps_uneven, rounding ? Severity::info : Severity::warning,
            "the slices are " + std::string(rounding ? "slightly " : "") + "unevenly spaced (" + mm(v.gap_min_mm) +
                " to " + mm(v.gap_max_mm) + "); they are interpolated between their true places",
            rounding ? "" : "fine structures between slices " + mm(v.gap_max_mm) + " apart are not in the scan");
    }
  }

  void compare_tags() {
    const DicomHeader& h = pictures_.header_of(stack_.front());
    Verdict& v = result_.verdict;
    if (h.has_tilt_tag && std::abs(std::abs(h.tilt_tag_deg) - v.tilt_deg) > 0.5) {
      v.add(code::tilt_tag_wrong, Severity::info,
            "the tilt tag says " + format_number(h.tilt_tag_deg) + " degrees, the positions " +
                format_number(std::round(v.tilt_deg * 100) / 100) + "; the positions count");
    }
    if (h.spacing_tag_mm != 0 && std::abs(std::abs(h.spacing_tag_mm) - v.gap_usual_mm) > 0.01 * v.gap_usual_mm) {
      // Both the tag and the numbers of the slices say that there is a slice between each two.
      const double parts = v.gap_usual_mm / std::abs(h.spacing_tag_mm);
      const long skip = std::lround(parts);
      const bool left_out = skip > 1 && std::abs(parts - static_cast<double>(skip)) < 0.01 * parts && every_nth(skip);
      v.add(code::spacing_tag_wrong, left_out ? Severity::warning : Severity::info,
            "the tag SpacingBetweenSlices says " + mm(h.spacing_tag_mm) + ", the positions " + mm(v.gap_usual_mm) +
                (left_out ? ", and the slices' numbers go up by " + std::to_string(skip) +
                                ": slices between those that are here seem not to have been sent"
                          : "; the positions count"),
            left_out ? "ask for the whole series: fine structures between slices are not in the scan" : "");
    }
  }

  // Whether the numbers of nearly all slices go up, or down, by n.
  [[nodiscard]] bool every_nth(long n) const {
    const auto& s = result_.slices;
    std::size_t steps = 0;
    for (std::size_t i = 1; i < s.size(); ++i)
      steps +=
          std::abs(static_cast<long>(headers_[s[i].header].instance) - headers_[s[i - 1].header].instance) == n ? 1 : 0;
    return steps * 10 >= (s.size() - 1) * 9;
  }

  // A scan over several multi-frame files: each says which part it is, and how many there are.
  void judge_concatenation() {
    std::map<std::string, std::pair<int, std::set<int>>> scans;
    for (const Candidate& c : stack_) {
      const DicomHeader& h = headers_[c.header];
      if (h.concatenation_uid.empty() || h.concatenation_parts <= 0) continue;
      auto& [parts, there] = scans[h.concatenation_uid];
      parts = std::max(parts, h.concatenation_parts);
      there.insert(h.concatenation_part);
    }
    for (const auto& [uid, scan] : scans) {
      const auto& [parts, there] = scan;
      const int missing = parts - static_cast<int>(there.size());
      if (missing <= 0) continue;
      result_.verdict.add(code::concatenation_incomplete, Severity::warning,
                          "the scan is spread over " + std::to_string(parts) + " files, of which " +
                              std::to_string(missing) + (missing == 1 ? " is" : " are") +
                              " not here: a part of the body is missing",
                          "copy the missing files from their source");
      return;
    }
  }

  void judge_rest() {
    Verdict& v = result_.verdict;
    judge_concatenation();
    if (stack_.size() < 10) {
      v.add(code::few_slices, Severity::warning, "there are only " + std::to_string(stack_.size()) + " slices");
    }
    std::set<std::string> spaces;
    for (const Candidate& c : stack_) spaces.insert(headers_[c.header].frame_of_reference_uid);
    spaces.erase("");
    if (spaces.size() > 1) {
      v.add(code::frame_of_reference_wrong, Severity::warning,
            "each of the slices names a frame of reference of its own, as careless anonymisation leaves them; they are "
            "taken as one scan",
            "see that all slices are of one patient and one scan");
    }
    if (pictures_.header_of(stack_.front()).inverted) {
      v.add(code::monochrome1, Severity::info,
            "the pictures are meant to be shown inverted (MONOCHROME1); the stored values are taken as they are");
    }
    if (std::any_of(stack_.begin(), stack_.end(), [&](const Candidate& c) { return headers_[c.header].lossy; })) {
      v.add(code::lossy, Severity::info, "the pictures were compressed with loss");
    }
  }

  const Pictures& pictures_;
  const std::vector<DicomHeader>& headers_;
  const std::vector<Candidate>& stack_;
  const PlaceOptions& options_;
  Placement& result_;
  bool tenths_ = false;  ///< positions are rounded to tenths of a millimetre, and the distance of slices is no whole
                         ///< number of these
};

}  // namespace

void judge_stack(const Pictures& pictures, const std::vector<Candidate>& stack, const PlaceOptions& options,
                 Placement& p) {
  StackJudge(pictures, stack, options, p).run();
}

}  // namespace osteo::inline imaging::dicom
