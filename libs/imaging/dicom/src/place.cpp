#include "osteo/imaging/dicom/detail/place.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include "osteo/core/base/files.h"
#include "osteo/core/base/param.h"
#include "place_parts.h"

namespace osteo::inline imaging {
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

}  // namespace

namespace dicom {

std::string mm(double v) {
  return format_number(std::round(v * 1000) / 1000) + " mm";
}

std::string Pictures::name_of(std::size_t header, int frame) const {
  const DicomHeader& h = headers[header];
  return h.frames.size() > 1 ? h.name + " (picture " + std::to_string(frame + 1) + ")" : h.name;
}

double Pictures::corner_deviation(const Candidate& a, const Candidate& b) const {
  const DicomFrame &f = frame_of(a), &g = frame_of(b);
  const DicomHeader& h = headers[a.header];
  const Vec3 u = (f.along_row * f.column_spacing_mm - g.along_row * g.column_spacing_mm) * (h.columns - 1);
  const Vec3 v = (f.along_column * f.row_spacing_mm - g.along_column * g.row_spacing_mm) * (h.rows - 1);
  return std::max({length(u), length(v), length(u + v)});
}

}  // namespace dicom

Placement place_slices(const std::vector<DicomHeader>& headers, const PlaceOptions& options,
                       const std::vector<FileSetAside>& excluded,
                       const std::function<bool(std::size_t, std::size_t)>& same_pixels) {
  const dicom::Pictures pictures{headers};
  Placement p;
  Verdict& v = p.verdict;
  const std::vector<dicom::Candidate> stack = dicom::choose_stack(pictures, options, excluded, same_pixels, v);
  if (stack.empty()) return p;
  const DicomHeader& h = pictures.header_of(stack.front());
  const DicomFrame& f = pictures.frame_of(stack.front());
  p.origin_mm = f.position_mm;
  p.along_row = f.along_row;
  p.along_column = f.along_column;
  p.normal = cross(f.along_row, f.along_column);
  p.column_spacing_mm = f.column_spacing_mm;
  p.row_spacing_mm = f.row_spacing_mm;
  for (const dicom::Candidate& c : stack) {
    const Vec3 d = pictures.frame_of(c).position_mm - p.origin_mm;
    p.slices.push_back({c.header, c.frame, dot(d, p.normal), {dot(d, p.along_row), dot(d, p.along_column)}});
    v.slices.push_back(
        {headers[c.header].name, c.frame, pictures.frame_of(c).position_mm, c.along - stack.front().along, 0});
  }
  v.series = h.series_number;
  if (!h.study_uid.empty() && !h.frame_of_reference_uid.empty())
    v.scan_hash = hash_text(h.study_uid + '\n' + h.frame_of_reference_uid);
  v.modality = h.modality;
  v.kernel = h.kernel;
  v.scanner = known_maker(h.manufacturer);
  v.columns = h.columns;
  v.rows = h.rows;
  v.pixel_mm[0] = f.column_spacing_mm;
  v.pixel_mm[1] = f.row_spacing_mm;
  v.thickness_mm = h.thickness_mm;
  dicom::judge_stack(pictures, stack, options, p);
  return p;
}

}  // namespace osteo::inline imaging
