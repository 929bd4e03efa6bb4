#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "osteo/core/base/param.h"
#include "place_parts.h"

namespace osteo::inline imaging::dicom {
namespace {

constexpr const char* kTranscode =
    "have the archive send it in another transfer syntax, such as Explicit VR Little Endian";
constexpr double kDegrees = 180 / 3.14159265358979323846;

// What tells two scans of one series apart. The last one takes all together.
using Key = std::string (*)(const DicomHeader&);
std::string acquisition_of(const DicomHeader& h) {
  const std::string n = std::to_string(h.acquisition);  // padded, so that texts sort as numbers
  return std::string(11 - std::min<std::size_t>(11, n.size()), ' ') + n;
}
std::string time_of(const DicomHeader& h) {
  return h.temporal;
}
std::string kind_of(const DicomHeader& h) {
  return h.image_type;
}
std::string kernel_of(const DicomHeader& h) {
  return h.kernel;
}
std::string thickness_of(const DicomHeader& h) {
  return std::to_string(std::lround(h.thickness_mm * 10));
}
std::string all_of(const DicomHeader& h) {
  return acquisition_of(h) + '\n' + time_of(h) + '\n' + kind_of(h) + '\n' + kernel_of(h) + '\n' + thickness_of(h);
}
constexpr std::array<Key, 6> kKeys{acquisition_of, time_of, kind_of, kernel_of, thickness_of, all_of};

// Of a stack, for who has to choose one.
std::string described(const DicomHeader& h) {
  std::string text = ", acquisition " + std::to_string(h.acquisition);
  if (!h.time_position.empty()) text += ", time " + h.time_position;
  if (!h.kvp.empty()) text += ", " + h.kvp + " kV";
  if (!h.kernel.empty()) text += ", kernel " + h.kernel;
  if (h.thickness_mm > 0) text += ", " + mm(h.thickness_mm) + " thick";
  return text;
}

class StackChooser {
 public:
  StackChooser(const Pictures& pictures, const PlaceOptions& options, const std::vector<FileSetAside>& excluded,
               const SamePixels& same_pixels, Verdict& verdict)
      : pictures_(pictures),
        headers_(pictures.headers),
        options_(options),
        excluded_(excluded),
        same_pixels_(same_pixels),
        verdict_(verdict) {}

  std::vector<Candidate> run() {
    std::vector<Candidate> all = usable_frames();
    if (!all.empty() && !options_.any_modality) require_ct(all);
    std::vector<std::vector<Candidate>> stacks;
    for (auto& cluster : clusters(all)) {
      for (auto& stack : without_conflicts(std::move(cluster))) stacks.push_back(std::move(stack));
    }
    std::vector<Candidate> chosen = choose(stacks);
    report_what_was_left_out();
    return chosen;
  }

 private:
  [[nodiscard]] const DicomFrame& frame_of(const Candidate& c) const { return pictures_.frame_of(c); }
  [[nodiscard]] std::string name_of(const Candidate& c) const { return pictures_.name_of(c); }
  [[nodiscard]] double corner_deviation(const Candidate& a, const Candidate& b) const {
    return pictures_.corner_deviation(a, b);
  }
  void set_aside(std::size_t header, std::string_view code, const std::string& why) {
    verdict_.set_aside.push_back({headers_[header].name, std::string(code), why});
  }

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
      const std::string why = verdict_.set_aside[index_of(files.front())].why;
      verdict_.add(code, Severity::warning,
                   (files.size() == 1
                        ? "'" + files.front() + "' is left out: "
                        : std::to_string(files.size()) + " files are left out, the first '" + files.front() + "': ") +
                       why,
                   code == code::unsupported_encoding ? kTranscode
                                                      : "copy the files again from their source, or ask for the "
                                                        "original export",
                   files);
    }
    if (all.empty()) {
      verdict_.add(verdict_.set_aside.empty() ? code::not_a_volume : verdict_.set_aside.front().code, Severity::error,
                   verdict_.set_aside.empty() ? "there is no slice"
                                              : "no file can be used; '" + verdict_.set_aside.front().file +
                                                    "': " + verdict_.set_aside.front().why,
                   !verdict_.set_aside.empty() && verdict_.set_aside.front().code == code::unsupported_encoding
                       ? kTranscode
                       : "choose another series");
    }
    return all;
  }

  [[nodiscard]] std::size_t index_of(const std::string& file) const {
    const auto& list = verdict_.set_aside;
    for (std::size_t i = 0; i < list.size(); ++i) {
      if (list[i].file == file) return i;
    }
    return 0;
  }

  void require_ct(const std::vector<Candidate>& all) {
    const std::string& modality = headers_[all.front().header].modality;
    if (modality == "CT") return;
    verdict_.add(code::not_ct, Severity::error,
                 "the series is not a CT but " + (modality.empty() ? "of no stated modality" : modality),
                 "Hounsfield units, and with them bone, are known in a CT only; --any-modality takes it all the same");
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

  /// How often each place is shown; 0 when not all are as often.
  static std::size_t times_at_each_place(const std::vector<Candidate>& sorted) {
    std::size_t times = 0;
    for (std::size_t begin = 0; begin < sorted.size();) {
      std::size_t end = begin + 1;
      while (end < sorted.size() && same_place(sorted[begin], sorted[end])) ++end;
      if (times != 0 && end - begin != times) return 0;
      times = end - begin;
      begin = end;
    }
    return times;
  }

  // Leaves out what is there twice, then parts what does not belong together: acquisitions, times, tube voltages,
  // kinds, kernels and thicknesses that share places or take turns. A stack that still has two different slices at one
  // place comes back as it is; choose() rejects it.
  std::vector<std::vector<Candidate>> without_conflicts(std::vector<Candidate> cluster) {
    sort_along(cluster);
    drop_duplicates(cluster);
    const bool conflict = has_conflict(cluster);
    for (const auto& key : kKeys) {
      std::map<std::string, std::vector<Candidate>> parts;
      for (const Candidate& c : cluster) parts[key(headers_[c.header])].push_back(c);
      if (parts.size() < 2 || parts.size() * 2 > cluster.size()) continue;
      const bool clean = std::none_of(parts.begin(), parts.end(), [](const auto& p) { return has_conflict(p.second); });
      if (conflict ? !clean : !take_turns(cluster, key)) continue;
      std::vector<std::vector<Candidate>> stacks;
      for (auto& [text, part] : parts) {
        for (auto& stack : without_conflicts(std::move(part))) stacks.push_back(std::move(stack));
      }
      return stacks;
    }
    if (std::vector<std::vector<Candidate>> sides = side_by_side(cluster); !sides.empty()) {
      std::vector<std::vector<Candidate>> stacks;
      for (auto& side : sides) {
        for (auto& stack : without_conflicts(std::move(side))) stacks.push_back(std::move(stack));
      }
      return stacks;
    }
    return {std::move(cluster)};
  }

  [[nodiscard]] Vec3 sideways(const Candidate& a, const Candidate& b) const {
    const DicomFrame& f = frame_of(a);
    const Vec3 d = frame_of(b).position_mm - f.position_mm, normal = cross(f.along_row, f.along_column);
    return d - normal * dot(d, normal);
  }

  // Two reconstructions beside each other, like both ears: two groups, if slices at one place, or slices in turn, lie
  // well apart sideways.
  [[nodiscard]] std::vector<std::vector<Candidate>> side_by_side(const std::vector<Candidate>& sorted) const {
    constexpr double kApartMm = 5;
    const bool conflict = has_conflict(sorted);
    const auto pair = std::adjacent_find(sorted.begin(), sorted.end(), [&](const Candidate& a, const Candidate& b) {
      return (!conflict || same_place(a, b)) && length(sideways(a, b)) > kApartMm;
    });
    if (pair == sorted.end()) return {};
    const Vec3 step = sideways(pair[0], pair[1]);
    std::vector<std::vector<Candidate>> sides(2);
    std::size_t changes = 0, before = 0;
    for (const Candidate& c : sorted) {
      const double t = dot(sideways(pair[0], c), step) / dot(step, step);
      const std::size_t side = t > 0.5 ? 1 : 0;
      if (std::abs(t - static_cast<double>(side)) > 0.25) return {};
      if (!sides[0].empty() || !sides[1].empty()) changes += side != before ? 1 : 0;
      before = side;
      sides[side].push_back(c);
    }
    if (sides[0].size() < 2 || sides[1].size() < 2) return {};
    if (conflict ? has_conflict(sides[0]) || has_conflict(sides[1]) : changes < 4 || changes * 4 < sorted.size())
      return {};
    return sides;
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

  // Two scans in one series whose slices interleave without meeting. One value a slice is a counter, and blocks one
  // after the other are one scan in parts.
  template <class Key>
  [[nodiscard]] bool take_turns(const std::vector<Candidate>& sorted, const Key& key) const {
    std::size_t changes = 0;
    std::map<std::string, int> count;
    std::string before;
    for (const Candidate& c : sorted) {
      const std::string now = key(headers_[c.header]);
      if (!count.empty() && now != before) ++changes;
      ++count[now];
      before = now;
    }
    return count.size() > 1 && count.size() * 3 <= sorted.size() && changes >= 2 * count.size();
  }

  [[nodiscard]] bool axial(const std::vector<Candidate>& stack) const {
    const DicomFrame& f = frame_of(stack.front());
    return std::abs(cross(f.along_row, f.along_column).z) > 0.7;
  }

  std::vector<Candidate> choose(std::vector<std::vector<Candidate>>& stacks) {
    if (stacks.empty()) return {};
    // Of as many slices the finer pixels.
    const auto fineness = [&](const std::vector<Candidate>& stack) {
      const DicomFrame& f = frame_of(stack.front());
      return -f.column_spacing_mm * f.row_spacing_mm;
    };
    std::stable_sort(stacks.begin(), stacks.end(), [&](const auto& a, const auto& b) {
      return std::tuple(a.size() > 1 && axial(a) && a.size() * 2 > b.size(), a.size(), fineness(a)) >
             std::tuple(b.size() > 1 && axial(b) && b.size() * 2 > a.size(), b.size(), fineness(b));
    });
    std::size_t volumes = 0;
    while (volumes < stacks.size() && stacks[volumes].size() > 1) ++volumes;
    verdict_.stacks = static_cast<int>(std::max<std::size_t>(volumes, 1));
    std::size_t take = 0;
    if (options_.stack > 0) {
      if (static_cast<std::size_t>(options_.stack) > std::max<std::size_t>(volumes, 1)) {
        verdict_.add(code::not_a_volume, Severity::error,
                     "there is no stack " + std::to_string(options_.stack) + "; the series holds " +
                         std::to_string(verdict_.stacks));
        return {};
      }
      take = static_cast<std::size_t>(options_.stack) - 1;
    }
    verdict_.stack = static_cast<int>(take) + 1;
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
                std::to_string(h.columns) + "x" + std::to_string(h.rows) +
                (axial(stacks[s]) ? ", axial" : ", not axial") + described(h) + place_of(stacks[s], stacks);
      }
      verdict_.add(code::several_stacks, Severity::warning,
                   "the series holds " + std::to_string(volumes) + " stacks (" + list + "); stack " +
                       std::to_string(take + 1) + " is taken",
                   "--stack takes another");
    }
    if (chosen.size() < 2) {
      verdict_.add(code::not_a_volume, Severity::error, "there is only one slice ('" + name_of(chosen.front()) + "')",
                   "choose another series");
      return {};
    }
    if (has_conflict(chosen)) {
      const auto at = std::adjacent_find(chosen.begin(), chosen.end(), same_place);
      const bool all = same_place(chosen.front(), chosen.back());
      if (const std::size_t times = all ? 0 : times_at_each_place(chosen); times > 1) {
        const std::size_t places = chosen.size() / times;
        verdict_.add(code::slices_at_one_place, Severity::error,
                     "each of " + std::to_string(places) + " places is shown " + std::to_string(times) +
                         " times with different pictures: a series over time, or of several phases",
                     "export one of its times as a series of its own", {name_of(at[0]), name_of(at[1])});
        return {};
      }
      verdict_.add(
          all ? code::not_a_volume : code::slices_at_one_place, Severity::error,
          all ? "all " + std::to_string(chosen.size()) + " slices lie at one place ('" + name_of(chosen.front()) +
                    "', ...)"
              : "'" + name_of(at[0]) + "' and '" + name_of(at[1]) + "' lie at one place but show different pictures",
          all ? "this is a series over time, not a volume; choose another series"
              : "the series mixes several scans and does not say which slice is of which; export one of them",
          {name_of(at[0]), name_of(at[1])});
      return {};
    }
    return chosen;
  }

  // Of the middle of a stack, where the stacks lie beside each other.
  [[nodiscard]] std::string place_of(const std::vector<Candidate>& stack,
                                     const std::vector<std::vector<Candidate>>& stacks) const {
    if (std::none_of(stacks.begin(), stacks.end(), [&](const auto& s) {
          return length(sideways(stack.front(), s.front())) > 5 && axial(s) == axial(stack);
        }))
      return {};
    const DicomFrame& f = frame_of(stack.front());
    const DicomHeader& h = headers_[stack.front().header];
    const Vec3 centre = f.position_mm + f.along_row * (f.column_spacing_mm * (h.columns - 1) / 2) +
                        f.along_column * (f.row_spacing_mm * (h.rows - 1) / 2);
    return ", its middle at " + mm(std::round(centre.x)) + " to the left";
  }

  void leave_out(const Candidate& c, const Candidate& chosen) {
    const DicomHeader &a = headers_[c.header], &b = headers_[chosen.header];
    if (c.frame > 0 && !verdict_.set_aside.empty() && verdict_.set_aside.back().file == a.name) return;
    const DicomFrame &f = frame_of(c), &g = frame_of(chosen);
    if (a.columns != b.columns || a.rows != b.rows) {
      const std::string why = "it has " + std::to_string(a.columns) + "x" + std::to_string(a.rows) +
                              " pixels, the others " + std::to_string(b.columns) + "x" + std::to_string(b.rows);
      set_aside(c.header, code::other_size, why);
    } else if (std::abs(f.column_spacing_mm - g.column_spacing_mm) * a.columns > kSamePlaceMm ||
               std::abs(f.row_spacing_mm - g.row_spacing_mm) * a.rows > kSamePlaceMm) {
      set_aside(c.header, code::other_spacing,
                "its pixels are " + mm(f.column_spacing_mm) + ", the others' " + mm(g.column_spacing_mm));
    } else if (corner_deviation(c, chosen) > kSamePlaceMm) {
      const Vec3 n = cross(f.along_row, f.along_column), m = cross(g.along_row, g.along_column);
      const double angle = std::acos(std::clamp(dot(n, m), -1.0, 1.0)) * kDegrees;
      set_aside(c.header, code::other_orientation,
                "it is turned against the others by " + format_number(std::round(angle * 100) / 100) + " degrees");
    } else {
      set_aside(c.header, code::other_acquisition,
                a.acquisition != b.acquisition ? "it is of another acquisition (" + std::to_string(a.acquisition) + ")"
                : time_of(a) != time_of(b)     ? "it is of another time or tube voltage"
                : kernel_of(a) != kernel_of(b) ? "it is of another reconstruction (kernel " + a.kernel + ")"
                : thickness_of(a) != thickness_of(b)
                    ? "its slice is " + mm(a.thickness_mm) + " thick, the others " + mm(b.thickness_mm)
                : length(sideways(chosen, c)) > 5 ? "it lies beside the others"
                                                  : "it is of another kind (ImageType)");
    }
  }

  // One finding a reason, for slices that could have been taken for part of the stack.
  void report_what_was_left_out() {
    static constexpr std::array kReported{code::other_size,        code::other_spacing,  code::other_orientation,
                                          code::other_acquisition, code::duplicate_file, code::duplicate_slice};
    for (const std::string_view kind : kReported) {
      std::vector<std::string> files;
      std::string why;
      for (const FileSetAside& f : verdict_.set_aside) {
        if (f.code != kind) continue;
        if (files.empty()) why = f.why;
        files.push_back(f.file);
      }
      if (files.empty()) continue;
      const bool harmless = kind == code::duplicate_file || kind == code::duplicate_slice || verdict_.stacks > 1;
      verdict_.add(kind, harmless ? Severity::info : Severity::warning,
                   (files.size() == 1
                        ? "'" + files.front() + "' is left out: "
                        : std::to_string(files.size()) + " files are left out, the first '" + files.front() + "': ") +
                       why,
                   harmless ? "" : "ask for the original export if these slices belong to the scan", files);
    }
  }
  const Pictures& pictures_;
  const std::vector<DicomHeader>& headers_;
  const PlaceOptions& options_;
  const std::vector<FileSetAside>& excluded_;
  const SamePixels& same_pixels_;
  Verdict& verdict_;
};

}  // namespace

std::vector<Candidate> choose_stack(const Pictures& pictures, const PlaceOptions& options,
                                    const std::vector<FileSetAside>& excluded, const SamePixels& same_pixels,
                                    Verdict& verdict) {
  return StackChooser(pictures, options, excluded, same_pixels, verdict).run();
}

}  // namespace osteo::inline imaging::dicom
