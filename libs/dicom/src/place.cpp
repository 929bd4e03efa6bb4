#include "osteo/dicom/place.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <map>
#include <set>

#include "osteo/base/files.h"
#include "osteo/base/param.h"

namespace osteo {
namespace {

// A text of the file might name a place or a person: only makers that are known are passed on, in our own spelling.
std::string known_maker(const std::string& manufacturer) {
  constexpr std::array<std::array<std::string_view, 2>, 14> kMakers{{{"siemens", "Siemens"},
                                                                     {"ge medical", "GE"},
                                                                     {"general electric", "GE"},
                                                                     {"philips", "Philips"},
                                                                     {"canon", "Canon"},
                                                                     {"toshiba", "Toshiba"},
                                                                     {"hitachi", "Hitachi"},
                                                                     {"fujifilm", "Fujifilm"},
                                                                     {"united imaging", "United Imaging"},
                                                                     {"planmeca", "Planmeca"},
                                                                     {"carestream", "Carestream"},
                                                                     {"sirona", "Sirona"},
                                                                     {"morita", "Morita"},
                                                                     {"marconi", "Marconi"}}};
  const std::string low = lower_case(manufacturer);
  for (const auto& [word, name] : kMakers) {
    if (low.find(word) != std::string::npos) return std::string(name);
  }
  return {};
}

constexpr double kDegrees = 180 / 3.14159265358979323846;

struct Candidate {
  std::size_t header = 0;
  int frame = 0;
  double along = 0;
};

std::string mm(double v) {
  return format_number(std::round(v * 1000) / 1000) + " mm";
}

class Placer {
 public:
  Placer(const std::vector<DicomHeader>& headers, const PlaceOptions& options, const std::vector<FileSetAside>& excluded,
         const std::function<bool(std::size_t, std::size_t)>& same_pixels)
      : headers_(headers), options_(options), excluded_(excluded), same_pixels_(same_pixels) {}

  Placement run() {
    std::vector<Candidate> all = usable_frames();
    if (!all.empty() && !options_.any_modality) require_ct(all);
    std::vector<std::vector<Candidate>> stacks;
    for (auto& cluster : clusters(all)) {
      for (auto& stack : without_conflicts(std::move(cluster))) stacks.push_back(std::move(stack));
    }
    const std::vector<Candidate> chosen = choose(stacks);
    tell_what_was_left_out();
    if (!chosen.empty()) describe(chosen);
    return std::move(result_);
  }

 private:
  [[nodiscard]] const DicomFrame& frame_of(const Candidate& c) const {
    return headers_[c.header].frames[static_cast<std::size_t>(c.frame)];
  }
  [[nodiscard]] std::string name_of(const Candidate& c) const { return name_of(c.header, c.frame); }
  [[nodiscard]] std::string name_of(std::size_t header, int frame) const {
    const DicomHeader& h = headers_[header];
    return h.frames.size() > 1 ? h.name + " (picture " + std::to_string(frame + 1) + ")" : h.name;
  }
  void set_aside(std::size_t header, std::string_view code, const std::string& why) {
    verdict().set_aside.push_back({headers_[header].name, std::string(code), why});
  }
  Verdict& verdict() { return result_.verdict; }

  std::vector<Candidate> usable_frames() {
    std::vector<Candidate> all;
    std::map<std::string, std::vector<std::string>> damaged;  // code -> files
    for (std::size_t h = 0; h < headers_.size(); ++h) {
      const DicomHeader& header = headers_[h];
      const bool out = h < excluded_.size() && !excluded_[h].code.empty();
      if (!out && header.usable()) {
        for (std::size_t f = 0; f < header.frames.size(); ++f) all.push_back({h, static_cast<int>(f), 0});
        continue;
      }
      const std::string code = out ? excluded_[h].code : header.problem_code;
      set_aside(h, code, out ? excluded_[h].why : header.problem);
      // What was a slice of the scan is worth a warning; what never was one is not.
      if (code != code::localizer && code != code::colour && code != code::not_an_image && code != code::not_dicom) {
        damaged[code].push_back(header.name);
      }
    }
    for (auto& [code, files] : damaged) {
      const std::string why = verdict().set_aside[index_of(files.front())].why;
      verdict().add(code, Severity::warning,
                    (files.size() == 1 ? "'" + files.front() + "' is left out: "
                                       : std::to_string(files.size()) + " files are left out, the first '" + files.front() + "': ") +
                        why,
                    "copy the files again from their source, or ask for the original export", files);
    }
    if (all.empty()) {
      verdict().add(verdict().set_aside.empty() ? code::not_a_volume : verdict().set_aside.front().code, Severity::error,
                    verdict().set_aside.empty()
                        ? "there is no slice"
                        : "no file can be used; '" + verdict().set_aside.front().file + "': " + verdict().set_aside.front().why,
                    "choose another series");
    }
    return all;
  }

  [[nodiscard]] std::size_t index_of(const std::string& file) const {
    const auto& list = result_.verdict.set_aside;
    for (std::size_t i = 0; i < list.size(); ++i) {
      if (list[i].file == file) return i;
    }
    return 0;
  }

  void require_ct(const std::vector<Candidate>& all) {
    const std::string& modality = headers_[all.front().header].modality;
    if (modality == "CT") return;
    verdict().add(code::not_ct, Severity::error, "the series is not a CT but " + (modality.empty() ? "of no stated modality" : modality),
                  "Hounsfield units, and with them bone, are known in a CT only; --any-modality takes it all the same");
  }

  // How far apart the corners of two slices come to lie by their axes and spacing alone.
  [[nodiscard]] double corner_deviation(const Candidate& a, const Candidate& b) const {
    const DicomFrame &f = frame_of(a), &g = frame_of(b);
    const DicomHeader& h = headers_[a.header];
    const Vec3 u = (f.along_row * f.column_spacing_mm - g.along_row * g.column_spacing_mm) * (h.columns - 1);
    const Vec3 v = (f.along_column * f.row_spacing_mm - g.along_column * g.row_spacing_mm) * (h.rows - 1);
    return std::max({length(u), length(v), length(u + v)});
  }

  std::vector<std::vector<Candidate>> clusters(const std::vector<Candidate>& all) {
    std::vector<std::vector<Candidate>> result;
    for (const Candidate& c : all) {
      std::vector<Candidate>* home = nullptr;
      for (auto& cluster : result) {
        const DicomHeader &a = headers_[cluster.front().header], &b = headers_[c.header];
        if (a.columns == b.columns && a.rows == b.rows && corner_deviation(cluster.front(), c) <= kSamePlaceMm) {
          home = &cluster;
          break;
        }
      }
      if (home == nullptr) home = &result.emplace_back();
      home->push_back(c);
    }
    return result;
  }

  void sort_along(std::vector<Candidate>& slices) const {
    const DicomFrame& first = frame_of(slices.front());
    const Vec3 normal = cross(first.along_row, first.along_column);
    for (Candidate& c : slices) c.along = dot(frame_of(c).position_mm, normal);
    std::sort(slices.begin(), slices.end(), [&](const Candidate& a, const Candidate& b) {
      return std::tie(a.along, headers_[a.header].instance, a.header, a.frame) <
             std::tie(b.along, headers_[b.header].instance, b.header, b.frame);
    });
  }

  static bool same_place(const Candidate& a, const Candidate& b) { return std::abs(a.along - b.along) < kSamePlaceMm; }
  static bool has_conflict(const std::vector<Candidate>& sorted) {
    return std::adjacent_find(sorted.begin(), sorted.end(), same_place) != sorted.end();
  }

  // Leaves out what is there twice, then parts acquisitions that share places. A stack that still has two different slices at
  // one place comes back as it is; choose() refuses it.
  std::vector<std::vector<Candidate>> without_conflicts(std::vector<Candidate> cluster) {
    sort_along(cluster);
    drop_duplicates(cluster);
    if (!has_conflict(cluster) && !overlapping_acquisitions(cluster)) return {std::move(cluster)};
    const auto by = [&](auto&& key) {
      std::map<std::string, std::vector<Candidate>> parts;
      for (const Candidate& c : cluster) parts[key(headers_[c.header])].push_back(c);
      return parts;
    };
    using Parts = std::map<std::string, std::vector<Candidate>>;
    const auto number = [](int n) { return std::string(10 - std::min<std::size_t>(9, std::to_string(n).size()), ' ') + std::to_string(n); };
    for (const Parts& parts :
         {by([&](const DicomHeader& h) { return number(h.acquisition); }), by([](const DicomHeader& h) { return h.temporal; }),
          by([](const DicomHeader& h) { return h.image_type; }), by([](const DicomHeader& h) { return h.kernel; })}) {
      if (parts.size() < 2) continue;
      const bool clean = std::none_of(parts.begin(), parts.end(), [](const auto& p) { return has_conflict(p.second); });
      if (!clean) continue;
      std::vector<std::vector<Candidate>> stacks;
      for (const auto& [key, part] : parts) stacks.push_back(part);
      return stacks;
    }
    return {std::move(cluster)};
  }

  void drop_duplicates(std::vector<Candidate>& sorted) {
    std::vector<Candidate> kept;
    for (const Candidate& c : sorted) {
      bool twice = false;
      for (auto it = kept.rbegin(); it != kept.rend() && same_place(*it, c) && !twice; ++it) {
        if (it->header == c.header) continue;
        const DicomHeader &a = headers_[it->header], &b = headers_[c.header];
        const bool same_uid = !a.sop_uid.empty() && a.sop_uid == b.sop_uid;
        if (frame_of(*it).slope != frame_of(c).slope || frame_of(*it).intercept != frame_of(c).intercept) continue;
        if (!(same_pixels_ ? same_pixels_(it->header, c.header) : same_uid)) continue;
        twice = true;
        set_aside(c.header, same_uid ? code::duplicate_file : code::duplicate_slice,
                  "the same picture at the same place as '" + a.name + "'");
      }
      if (!twice) kept.push_back(c);
    }
    sorted = std::move(kept);
  }

  // Two scans in one series whose slices interleave without meeting.
  [[nodiscard]] bool overlapping_acquisitions(const std::vector<Candidate>& sorted) const {
    int changes = 0;
    std::map<int, int> count;
    for (std::size_t i = 0; i < sorted.size(); ++i) {
      const int a = headers_[sorted[i].header].acquisition;
      ++count[a];
      if (i > 0 && a != headers_[sorted[i - 1].header].acquisition) ++changes;
    }
    // One number a slice is a counter, and blocks one after the other are one scan in parts.
    return count.size() > 1 && count.size() * 3 <= sorted.size() && changes >= 2 * static_cast<int>(count.size());
  }

  [[nodiscard]] bool axial(const std::vector<Candidate>& stack) const {
    const DicomFrame& f = frame_of(stack.front());
    return std::abs(cross(f.along_row, f.along_column).z) > 0.7;
  }

  std::vector<Candidate> choose(std::vector<std::vector<Candidate>>& stacks) {
    if (stacks.empty()) return {};
    std::stable_sort(stacks.begin(), stacks.end(), [&](const auto& a, const auto& b) {
      return std::tuple(a.size() > 1 && axial(a) && a.size() * 2 > b.size(), a.size()) >
             std::tuple(b.size() > 1 && axial(b) && b.size() * 2 > a.size(), b.size());
    });
    std::size_t volumes = 0;
    while (volumes < stacks.size() && stacks[volumes].size() > 1) ++volumes;
    verdict().stacks = static_cast<int>(std::max<std::size_t>(volumes, 1));
    std::size_t take = 0;
    if (options_.stack > 0) {
      if (static_cast<std::size_t>(options_.stack) > std::max<std::size_t>(volumes, 1)) {
        verdict().add(code::not_a_volume, Severity::error,
                      "there is no stack " + std::to_string(options_.stack) + "; the series holds " + std::to_string(verdict().stacks));
        return {};
      }
      take = static_cast<std::size_t>(options_.stack) - 1;
    }
    verdict().stack = static_cast<int>(take) + 1;
    const auto& chosen = stacks[take];
    for (std::size_t s = 0; s < stacks.size(); ++s) {
      if (s == take) continue;
      for (const Candidate& c : stacks[s]) leave_out(c, chosen.front());
    }
    if (volumes > 1) {
      std::string list;
      for (std::size_t s = 0; s < volumes; ++s) {
        const DicomHeader& h = headers_[stacks[s].front().header];
        list += (s == 0 ? "" : "; ") + std::to_string(s + 1) + ": " + std::to_string(stacks[s].size()) + " slices of " +
                std::to_string(h.columns) + "x" + std::to_string(h.rows) + (axial(stacks[s]) ? ", axial" : ", not axial") +
                ", acquisition " + std::to_string(h.acquisition);
      }
      verdict().add(
          code::several_stacks, Severity::warning,
          "the series holds " + std::to_string(volumes) + " stacks (" + list + "); stack " + std::to_string(take + 1) + " is taken",
          "--stack takes another");
    }
    if (chosen.size() < 2) {
      verdict().add(code::not_a_volume, Severity::error, "there is only one slice ('" + name_of(chosen.front()) + "')",
                    "choose another series");
      return {};
    }
    if (has_conflict(chosen)) {
      const auto at = std::adjacent_find(chosen.begin(), chosen.end(), same_place);
      const bool all = same_place(chosen.front(), chosen.back());
      verdict().add(all ? code::not_a_volume : code::slices_at_one_place, Severity::error,
                    all ? "all " + std::to_string(chosen.size()) + " slices lie at one place ('" + name_of(chosen.front()) + "', ...)"
                        : "'" + name_of(at[0]) + "' and '" + name_of(at[1]) + "' lie at one place but show different pictures",
                    all ? "this is a series over time, not a volume; choose another series"
                        : "the series mixes several scans and does not say which slice is of which; export one of them",
                    {name_of(at[0]), name_of(at[1])});
      return {};
    }
    return chosen;
  }

  void leave_out(const Candidate& c, const Candidate& chosen) {
    const DicomHeader &a = headers_[c.header], &b = headers_[chosen.header];
    if (c.frame > 0 && !verdict().set_aside.empty() && verdict().set_aside.back().file == a.name) return;
    const DicomFrame &f = frame_of(c), &g = frame_of(chosen);
    if (a.columns != b.columns || a.rows != b.rows) {
      const std::string why = "it has " + std::to_string(a.columns) + "x" + std::to_string(a.rows) + " pixels, the others " +
                              std::to_string(b.columns) + "x" + std::to_string(b.rows);
      set_aside(c.header, code::other_size, why);
    } else if (std::abs(f.column_spacing_mm - g.column_spacing_mm) * a.columns > kSamePlaceMm ||
               std::abs(f.row_spacing_mm - g.row_spacing_mm) * a.rows > kSamePlaceMm) {
      set_aside(c.header, code::other_spacing, "its pixels are " + mm(f.column_spacing_mm) + ", the others' " + mm(g.column_spacing_mm));
    } else if (corner_deviation(c, chosen) > kSamePlaceMm) {
      const Vec3 n = cross(f.along_row, f.along_column), m = cross(g.along_row, g.along_column);
      const double angle = std::acos(std::clamp(dot(n, m), -1.0, 1.0)) * kDegrees;
      set_aside(c.header, code::other_orientation,
                "it is turned against the others by " + format_number(std::round(angle * 100) / 100) + " degrees");
    } else {
      set_aside(c.header, code::other_acquisition, "it is of another acquisition (" + std::to_string(a.acquisition) + ")");
    }
  }

  // One finding a reason, for slices that could have been taken for part of the stack.
  void tell_what_was_left_out() {
    static constexpr std::array kTold{code::other_size,        code::other_spacing,  code::other_orientation,
                                      code::other_acquisition, code::duplicate_file, code::duplicate_slice};
    for (const std::string_view kind : kTold) {
      std::vector<std::string> files;
      std::string why;
      for (const FileSetAside& f : verdict().set_aside) {
        if (f.code != kind) continue;
        if (files.empty()) why = f.why;
        files.push_back(f.file);
      }
      if (files.empty()) continue;
      const bool harmless = kind == code::duplicate_file || kind == code::duplicate_slice || verdict().stacks > 1;
      verdict().add(kind, harmless ? Severity::info : Severity::warning,
                    (files.size() == 1 ? "'" + files.front() + "' is left out: "
                                       : std::to_string(files.size()) + " files are left out, the first '" + files.front() + "': ") +
                        why,
                    harmless ? "" : "ask for the original export if these slices belong to the scan", files);
    }
  }

  void describe(const std::vector<Candidate>& stack) {
    const Candidate& first = stack.front();
    const DicomFrame& f = frame_of(first);
    const DicomHeader& h = headers_[first.header];
    Placement& p = result_;
    p.origin_mm = f.position_mm;
    p.along_row = f.along_row;
    p.along_column = f.along_column;
    p.normal = cross(f.along_row, f.along_column);
    p.column_spacing_mm = f.column_spacing_mm;
    p.row_spacing_mm = f.row_spacing_mm;
    for (const Candidate& c : stack) {
      const Vec3 d = frame_of(c).position_mm - p.origin_mm;
      p.slices.push_back({c.header, c.frame, dot(d, p.normal), {dot(d, p.along_row), dot(d, p.along_column)}});
    }
    Verdict& v = verdict();
    v.series = h.series_number;
    if (!h.study_uid.empty() && !h.frame_of_reference_uid.empty()) v.scan_hash = hash_text(h.study_uid + '\n' + h.frame_of_reference_uid);
    v.modality = h.modality;
    v.kernel = h.kernel;
    v.scanner = known_maker(h.manufacturer);
    v.columns = h.columns;
    v.rows = h.rows;
    v.pixel_mm[0] = f.column_spacing_mm;
    v.pixel_mm[1] = f.row_spacing_mm;
    v.thickness_mm = h.thickness_mm;
    for (const Candidate& c : stack)
      v.slices.push_back({headers_[c.header].name, c.frame, frame_of(c).position_mm, c.along - first.along, 0});
    judge_gaps();
    judge_lean(stack);
    judge_pictures(stack);
    compare_tags(h);
    if (stack.size() < 10) {
      v.add(code::few_slices, Severity::warning, "there are only " + std::to_string(stack.size()) + " slices");
    }
    std::set<std::string> spaces;
    for (const Candidate& c : stack) spaces.insert(headers_[c.header].frame_of_reference_uid);
    spaces.erase("");
    if (spaces.size() > 1) {
      v.add(code::frame_of_reference_wrong, Severity::warning,
            "each of the slices names a frame of reference of its own, as careless anonymisation leaves them; they are taken as one scan",
            "see that all slices are of one patient and one scan");
    }
    if (h.inverted) {
      v.add(code::monochrome1, Severity::info,
            "the pictures are meant to be shown inverted (MONOCHROME1); the stored values are taken as they are");
    }
    if (std::any_of(stack.begin(), stack.end(), [&](const Candidate& c) { return headers_[c.header].lossy; })) {
      v.add(code::lossy, Severity::info, "the pictures were compressed with loss");
    }
  }

  void judge_gaps() {
    const auto& s = result_.slices;
    Verdict& v = verdict();
    std::vector<double> gaps;
    for (std::size_t i = 1; i < s.size(); ++i) gaps.push_back(s[i].along_mm - s[i - 1].along_mm);
    auto sorted = gaps;
    std::sort(sorted.begin(), sorted.end());
    v.gap_min_mm = sorted.front();
    v.gap_max_mm = sorted.back();
    v.gap_usual_mm = sorted[sorted.size() / 2];

    const auto step = [&](std::size_t i) { return std::abs(headers_[s[i + 1].header].instance - headers_[s[i].header].instance); };
    std::size_t ones = 0;
    for (std::size_t i = 0; i < gaps.size(); ++i) ones += step(i) == 1 ? 1 : 0;
    const bool numbered = ones * 2 > gaps.size();

    // Positions written to tenths of a millimetre make distances of even slices wander by as much.
    const auto equal = std::count_if(gaps.begin(), gaps.end(), [&](double g) { return std::abs(g - v.gap_usual_mm) <= kSamePlaceMm; });
    tenths_ = equal * 5 < static_cast<std::ptrdiff_t>(gaps.size()) * 4 && std::all_of(s.begin(), s.end(), [](const PlacedSlice& p) {
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
                "the slices are " + mm(gaps[i]) + " apart (between '" + a + "' and '" + b + "'); up to " + mm(options_.max_gap_mm) +
                    " is interpolated",
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
        first_message = std::to_string(count) + (count == 1 ? " slice is" : " slices are") + " missing between '" + a + "' and '" + b +
                        "' (" + mm(gaps[i]) + " apart instead of " + mm(usual) + ")";
      }
    }
    if (missing == 0) return;
    const bool refuse = widest > options_.max_hole_mm;
    v.add(refuse ? code::hole_too_wide : code::slices_missing, refuse ? Severity::error : Severity::warning,
          (v.gaps.size() > 1 ? std::to_string(missing) + " slices are missing; at the widest place " : std::string()) + first_message +
              (refuse ? "; up to " + mm(options_.max_hole_mm) + " is interpolated" : "; the hole is interpolated"),
          "copy the missing files from their source" + std::string(refuse ? "; --max-hole-mm accepts wider holes" : ""), files);
  }

  // Whether the pictures are slices of Hounsfield units at all, and how sharp they are along the normal.
  void judge_pictures(const std::vector<Candidate>& stack) {
    Verdict& v = verdict();
    const Severity grave = options_.any_modality ? Severity::warning : Severity::error;
    const double thickness = v.thickness_mm, gap = v.gap_usual_mm;
    if (std::any_of(stack.begin(), stack.end(), [&](const Candidate& c) { return headers_[c.header].projection; })) {
      v.add(code::projection, grave,
            "the pictures are projections (MIP): each shows the brightest or darkest of a slab" +
                (thickness > 0 ? " of " + mm(thickness) : std::string()) + ", which makes bone too thick",
            "choose the series of thin slices that they were made from");
    } else if (thickness > 1.25 * gap && thickness > 0.5) {
      const bool by_far = thickness >= 4 * gap && thickness >= 3;
      v.add(code::slices_overlap, by_far ? Severity::warning : Severity::info,
            "slices of " + mm(thickness) + " lie " + mm(gap) + " apart and overlap: along their normal nothing finer than " +
                mm(thickness) + " is seen" +
                (by_far ? "; slabs like these may also be maximum-intensity projections, which make bone too thick" : ""),
            by_far ? "choose a series whose slices are as thick as they are apart" : "");
    }
    const auto other = std::find_if(stack.begin(), stack.end(), [&](const Candidate& c) {
      const std::string type = upper_case(frame_of(c).rescale_type);
      return !type.empty() && type != "HU" && type != "US";
    });
    if (other == stack.end()) return;
    const std::string& type = frame_of(*other).rescale_type;
    const bool modified = upper_case(type) == "HU_MOD";
    v.add(code::rescale_type, modified ? Severity::warning : grave,
          modified ? "the values are modified Hounsfield units (HU_MOD), as spectral scanners write them"
                   : "the values are no Hounsfield units but '" + type + "' (RescaleType), as of a spectral or material map",
          modified ? "look at the mask before you rely on a threshold" : "choose a series in Hounsfield units");
  }

  static std::string upper_case(std::string text) {
    std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
    return text;
  }

  static double median(std::vector<double> values) {
    std::erase_if(values, [](double v) { return !std::isfinite(v); });
    if (values.empty()) return 0;
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
  }

  // Drift in mm per mm along the normal, and where it is at the first slice: a line through most slices, which single slices that are
  // shifted do not turn (a line by least squares would call one shifted slice a tilt).
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
    // The least squares of these, where the steps from slice to slice agree with it as well: a step in the middle is no drift.
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

  void judge_lean(const std::vector<Candidate>& stack) {
    Placement& p = result_;
    Verdict& v = verdict();
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
      if (j2 > 0.05 * 0.05) shifted.push_back(name_of(stack[i]));
      off = std::max(off, std::sqrt(along * along + side2));
    }
    p.even = off <= kSamePlaceMm;
    for (int a = 0; a < 2; ++a) v.shear_mm_per_mm[a] = shear[a];
    v.tilt_deg = std::atan(std::hypot(shear[0], shear[1])) * kDegrees;
    if (v.tilt_deg < 0.005) v.tilt_deg = 0;
    v.resampled = !p.even;
    v.position_error_mm = p.even ? off : 0;
    double corners = 0;
    for (const Candidate& c : stack) corners = std::max(corners, corner_deviation(c, stack.front()));
    v.position_error_mm += corners;

    if (v.tilt_deg > 0.05) {
      v.add(
          code::tilted, Severity::info,
          "the slices lean by " + format_number(std::round(v.tilt_deg * 100) / 100) + " degrees (gantry tilt); they are resampled upright");
    }
    if (jitter > 0.05) {
      v.add(code::shifted_sideways, Severity::warning,
            (shifted.size() == 1 ? "one slice ('" + shifted.front() + "') is shifted sideways by "
                                 : std::to_string(shifted.size()) + " slices are shifted sideways against the others by up to ") +
                mm(jitter) + "; each is taken where it says it lies",
            "compare with the scanner's own pictures: a moved table is in the positions, a moved patient is not", shifted);
    }
    const bool uneven = v.gap_max_mm - v.gap_min_mm > 2 * kSamePlaceMm && !p.even;
    if (uneven && !v.has(code::slices_missing) && !v.has(code::hole_too_wide)) {
      // Positions rounded to a tenth of a millimetre are common, and no reason to worry anybody.
      const bool rounding = v.gap_max_mm - v.gap_min_mm < (tenths_ ? 0.11 : std::min(0.11, 0.2 * v.gap_usual_mm));
      v.add(code::gaps_uneven, rounding ? Severity::info : Severity::warning,
            "the slices are " + std::string(rounding ? "slightly " : "") + "unevenly spaced (" + mm(v.gap_min_mm) + " to " +
                mm(v.gap_max_mm) + "); they are interpolated between their true places",
            rounding ? "" : "fine structures between slices " + mm(v.gap_max_mm) + " apart are not in the scan");
    }
  }

  void compare_tags(const DicomHeader& h) {
    Verdict& v = verdict();
    if (h.has_tilt_tag && std::abs(std::abs(h.tilt_tag_deg) - v.tilt_deg) > 0.5) {
      v.add(code::tilt_tag_wrong, Severity::info,
            "the tilt tag says " + format_number(h.tilt_tag_deg) + " degrees, the positions " +
                format_number(std::round(v.tilt_deg * 100) / 100) + "; the positions count");
    }
    if (h.spacing_tag_mm != 0 && std::abs(std::abs(h.spacing_tag_mm) - v.gap_usual_mm) > 0.01 * v.gap_usual_mm) {
      v.add(
          code::spacing_tag_wrong, Severity::info,
          "the tag SpacingBetweenSlices says " + mm(h.spacing_tag_mm) + ", the positions " + mm(v.gap_usual_mm) + "; the positions count");
    }
  }

  const std::vector<DicomHeader>& headers_;
  const PlaceOptions& options_;
  const std::vector<FileSetAside>& excluded_;
  const std::function<bool(std::size_t, std::size_t)>& same_pixels_;
  Placement result_;
  bool tenths_ = false;  ///< positions are rounded to tenths of a millimetre, and the distance of slices is no whole number of these
};

}  // namespace

Placement place_slices(const std::vector<DicomHeader>& headers, const PlaceOptions& options, const std::vector<FileSetAside>& excluded,
                       const std::function<bool(std::size_t, std::size_t)>& same_pixels) {
  return Placer(headers, options, excluded, same_pixels).run();
}

}  // namespace osteo
