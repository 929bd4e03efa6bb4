#include "osteo/imaging/dicom/scan.h"

#include <vtkDICOMItem.h>
#include <vtkDICOMMetaData.h>
#include <vtkDICOMParser.h>
#include <vtkDICOMSequence.h>
#include <vtkDICOMValue.h>
#include <vtkNew.h>

#include <algorithm>
#include <atomic>
#include <cctype>
#include <cmath>
#include <fstream>
#include <map>
#include <set>

#include "osteo/core/base/error.h"
#include "osteo/core/base/parallel.h"
#include "osteo/core/base/param.h"
#include "osteo/imaging/io/vtk_data.h"
#include "pixels.h"
#include "unpack.h"

namespace osteo::inline imaging {
namespace {

constexpr std::string_view kIndex = "1.2.840.10008.1.3.10";  // Media Storage Directory Storage: a DICOMDIR

struct Found {
  fs::path file;
  std::string name;
};

std::vector<Found> files_below(const fs::path& folder, std::vector<FileSetAside>& unreadable) {
  std::vector<Found> found;
  std::error_code ec;
  fs::recursive_directory_iterator it(folder, fs::directory_options::skip_permission_denied, ec), end;
  for (; !ec && it != end; it.increment(ec)) {
    std::error_code status;
    if (it->is_regular_file(status)) found.push_back({it->path(), it->path().lexically_relative(folder).string()});
    if (it->is_directory(status) && ::access(it->path().c_str(), R_OK | X_OK) != 0) {
      unreadable.push_back({it->path().lexically_relative(folder).string(), std::string(code::cannot_read),
                            "the folder may not be read"});
    }
  }
  std::sort(found.begin(), found.end(), [](const Found& a, const Found& b) { return a.name < b.name; });
  return found;
}

// The files that a DICOMDIR names; names on media are upper case, on disk not always.
std::vector<Found> files_of_index(const fs::path& index, std::vector<FileSetAside>& missing) {
  vtkNew<vtkDICOMParser> parser;
  vtkNew<vtkDICOMMetaData> meta;
  parser->SetMetaData(meta);
  parser->SetFileName(index.c_str());
  parser->Update();
  const vtkDICOMValue& records = meta->Get(DC::DirectoryRecordSequence);
  if (records.GetNumberOfValues() == 0) return {};
  const vtkDICOMItem* const items = records.GetSequenceData();
  std::vector<Found> found;
  std::map<fs::path, std::map<std::string, fs::path>> listing;  // folder -> lower-case name -> entry
  for (std::size_t i = 0; i < records.GetNumberOfValues(); ++i) {
    const vtkDICOMValue& id = items[i].Get(DC::ReferencedFileID);
    if (id.GetNumberOfValues() == 0) continue;
    fs::path at = index.parent_path().empty() ? fs::path(".") : index.parent_path();
    std::string name;
    bool there = true;
    for (std::size_t part = 0; part < id.GetNumberOfValues() && there; ++part) {
      std::string piece = id.GetString(part);
      while (!piece.empty() && piece.back() == ' ') piece.pop_back();
      if (piece == ".." || piece.find('/') != std::string::npos) there = false;
      name += (name.empty() ? "" : "/") + piece;
      auto& entries = listing[at];
      if (entries.empty()) {
        std::error_code ec;
        for (const auto& e : fs::directory_iterator(at, ec))
          entries[lower_case(e.path().filename().string())] = e.path();
      }
      const auto it = entries.find(lower_case(piece));
      there = there && it != entries.end();
      if (there) at = it->second;
    }
    if (there) {
      found.push_back({at, name});
    } else {
      missing.push_back({name, std::string(code::missing_file), "the DICOMDIR names it, but it is not there"});
    }
  }
  return found;
}

// A name, or free text, that holds a value which identifies the patient.
bool identifies(const std::string& text, const std::set<std::string>& values) {
  const std::string low = lower_case(text);
  return std::any_of(values.begin(), values.end(),
                     [&](const std::string& v) { return low.find(v) != std::string::npos; });
}

// Folders that identify become "*", the file itself its number in the order of names.
std::string without_identity(const std::string& name, const std::set<std::string>& values, const std::string& number) {
  std::string shown;
  std::size_t at = 0;
  while (at <= name.size()) {
    const std::size_t slash = std::min(name.find('/', at), name.size());
    const std::string part = name.substr(at, slash - at);
    const bool last = slash == name.size();
    shown += (identifies(part, values) ? (last ? number : "*") : part) + (last ? "" : "/");
    at = slash + 1;
  }
  return shown;
}

bool bone_kernel(const DicomSeries& s, const std::string& manufacturer) {
  const std::string kernel = lower_case(s.kernel), maker = lower_case(manufacturer), text = lower_case(s.description);
  for (const char* word : {"bone", "knochen", "osseux", "hueso", "osso", "petr", "temporal", "mastoid", "sharp"}) {
    if (text.find(word) != std::string::npos || kernel.find(word) != std::string::npos) return true;
  }
  // Words of their own: "IAC" is no "cardiac" or "iliac", "edge" no "wedge".
  for (const std::string& where : {text, kernel}) {
    std::string word;
    for (const char c : where + ' ') {
      if (std::isalpha(static_cast<unsigned char>(c)) != 0) {
        word += c;
        continue;
      }
      if (word == "iac" || word == "iacs" || word == "edge") return true;
      word.clear();
    }
  }
  const auto number = [&]() {
    const std::size_t at = kernel.find_first_of("0123456789");
    return at == std::string::npos ? 0 : std::atoi(kernel.c_str() + at);
  };
  if (maker.find("siemens") != std::string::npos) return number() >= 60;  // B60 to B80, H60, Hr64, U90: sharp
  if (maker.find("toshiba") != std::string::npos || maker.find("canon") != std::string::npos) {
    return (number() >= 30 && number() <= 39) || number() >= 80;  // FC30 to FC35, FC80: bone, high resolution
  }
  if (maker.find("philips") != std::string::npos)
    return kernel == "d" || kernel == "e" || kernel == "ya" || kernel == "yb" || kernel == "yc" || kernel == "yd";
  return false;
}

// Lower is better for drilling bone: thin, sharp, axial, whole.
double cost(const DicomSeries& s, const Placement& p, std::string& why) {
  const bool bone = bone_kernel(s, s.headers.front().manufacturer);
  const bool axial = std::abs(p.normal.z) > 0.7;
  const bool whole =
      !p.verdict.has(code::slices_missing) &&
      std::all_of(p.verdict.set_aside.begin(), p.verdict.set_aside.end(), [](const FileSetAside& f) {
        return f.code == code::duplicate_file || f.code == code::duplicate_slice || f.code == code::localizer;
      });
  const bool original = s.headers.front().image_type.starts_with("ORIGINAL") || s.headers.front().image_type.empty();
  const double extent = p.slices.back().along_mm;
  why = "slices " + format_number(std::round(p.verdict.gap_usual_mm * 100) / 100) + " mm apart";
  if (bone) why += ", bone kernel";
  why += axial ? ", axial" : ", not axial";
  why += whole ? ", complete" : ", incomplete";
  if (!original) why += ", derived pictures";
  const double thick = std::max({p.verdict.gap_usual_mm, s.thickness_mm * 0.7, 0.1});
  return thick * (bone ? 0.6 : 1) * (axial ? 1 : 2) * (whole ? 1 : 1.5) * (original ? 1 : 1.5) * (extent < 30 ? 4 : 1);
}

void judge(DicomSeries& s, const PlaceOptions& options, double& price) {
  const DicomHeader& first = s.headers.front();
  const bool all_localizers =
      std::all_of(s.headers.begin(), s.headers.end(), [](const auto& h) { return h.problem_code == code::localizer; });
  if (all_localizers) {
    s.what = "localizer";
    s.problem = "it is a localizer";
    return;
  }
  // A series over time has very many pictures at one place: there a look at some is enough for a list.
  int asked = 0;
  const Placement p = place_slices(s.headers, options, {}, [&](std::size_t a, std::size_t b) {
    if (++asked <= 40) return dicom::same_stored_pixels(s.headers[a], s.headers[b]);
    return !s.headers[a].sop_uid.empty() && s.headers[a].sop_uid == s.headers[b].sop_uid;
  });
  s.gap_mm = p.verdict.gap_usual_mm;
  for (const Finding& f : p.verdict.findings) {
    if (f.severity != Severity::error) continue;
    s.what = f.code == code::not_ct ? first.modality + ", not CT" : "rejected: " + f.code;
    s.problem = f.message;
    return;
  }
  s.usable = true;
  const Vec3 n = p.normal;
  s.what = std::string(std::abs(n.z) > 0.7   ? "axial"
                       : std::abs(n.y) > 0.7 ? "coronal"
                       : std::abs(n.x) > 0.7 ? "sagittal"
                                             : "oblique");
  if (p.verdict.has(code::tilted)) s.what += ", tilted";
  if (p.verdict.has(code::gaps_uneven)) s.what += ", uneven";
  if (p.verdict.has(code::slices_missing)) s.what += ", holes";
  if (p.verdict.has(code::slices_overlap)) s.what += ", overlapping";
  if (p.verdict.stacks > 1) s.what += ", " + std::to_string(p.verdict.stacks) + " stacks";
  price = cost(s, p, s.why);
}

// A, B, ..., Z, AA, ...
std::string letters(std::size_t n, char first) {
  std::string text;
  for (++n; n > 0; n = (n - 1) / 26) text.insert(text.begin(), static_cast<char>(first + (n - 1) % 26));
  return text;
}

// The number of a key in the order of first appearance.
class Numbering {
 public:
  std::size_t of(const std::string& key) { return numbers_.try_emplace(key, numbers_.size()).first->second; }

 private:
  std::map<std::string, std::size_t> numbers_;
};

// What a slice belongs to. Where each slice of a series has a frame of reference of its own, whoever wrote them meant
// nothing by it; a slice without one is of the only one there is.
std::vector<std::string> spaces_of(const std::vector<DicomHeader>& headers) {
  std::map<std::string, int> count;
  for (const DicomHeader& h : headers) {
    if (!h.frame_of_reference_uid.empty()) ++count[h.frame_of_reference_uid];
  }
  const bool meaningless = std::all_of(count.begin(), count.end(), [](const auto& c) { return c.second == 1; });
  std::vector<std::string> spaces;
  for (const DicomHeader& h : headers) {
    const std::string& uid = h.frame_of_reference_uid;
    spaces.push_back(count.empty()                                       ? ""
                     : meaningless || (uid.empty() && count.size() == 1) ? count.begin()->first
                                                                         : uid);
  }
  return spaces;
}

// Series as their UIDs have them, parted where they hold several scans, each with its scan's name.
std::vector<DicomSeries> part_by_scan(std::vector<DicomSeries> series) {
  std::vector<DicomSeries> parted;
  Numbering patients;
  std::map<std::string, Numbering> studies, frames;
  for (DicomSeries& s : series) {
    const auto spaces = spaces_of(s.headers);
    std::map<std::string, std::size_t> part_of;
    const std::size_t first = parted.size();
    for (std::size_t i = 0; i < s.headers.size(); ++i) {
      DicomHeader& h = s.headers[i];
      const std::string study = h.patient + '\n' + h.study_uid;
      const std::string scan = letters(patients.of(h.patient), 'A') + std::to_string(studies[h.patient].of(study) + 1) +
                               letters(frames[study].of(spaces[i]), 'a');
      const auto [it, is_new] = part_of.try_emplace(scan, parted.size());
      if (is_new) parted.emplace_back().scan = scan;
      parted[it->second].headers.push_back(std::move(h));
    }
    for (std::size_t p = first; p < parted.size(); ++p) {
      for (std::size_t q = first; q < parted.size(); ++q) {
        if (p == q) continue;
        for (const DicomHeader& h : parted[q].headers) {
          if (h.usable()) parted[p].foreign.push_back(h.name);
        }
      }
    }
  }
  return parted;
}

// The best usable series of each scan.
void recommend(std::vector<DicomSeries>& series, const std::vector<double>& price) {
  std::map<std::string, std::size_t> best;
  for (std::size_t i = 0; i < series.size(); ++i) {
    if (!series[i].usable) continue;
    const auto [it, is_new] = best.try_emplace(series[i].scan, i);
    if (!is_new && price[i] < price[it->second]) it->second = i;
  }
  for (const auto& [scan, i] : best) series[i].recommended = true;
}

std::string named(const DicomSeries& s) {
  return s.scan + ":" + std::to_string(s.number);
}

// "2 patients", "2 studies of one patient", ...: the most that sets the scans apart.
std::string what_differs(const std::vector<const DicomSeries*>& scans) {
  std::set<std::string> patients, studies;
  for (const DicomSeries* s : scans) {
    patients.insert(s->scan.substr(0, s->scan.find_first_of("0123456789")));
    studies.insert(s->scan.substr(0, s->scan.find_last_of("0123456789") + 1));
  }
  if (patients.size() > 1) return "of " + std::to_string(patients.size()) + " patients";
  if (studies.size() > 1) return "of " + std::to_string(studies.size()) + " studies of one patient";
  return "of one study, but in different frames of reference";
}

}  // namespace

bool is_archive(const fs::path& file) {
  const std::string name = lower_case(file.filename().string());
  for (const char* suffix : {".zip", ".tar", ".tgz", ".tar.gz", ".tar.xz", ".tar.bz2", ".7z"}) {
    if (name.ends_with(suffix)) return true;
  }
  char head[4] = {};
  std::ifstream(file, std::ios::binary).read(head, 4);
  return head[0] == 'P' && head[1] == 'K' && head[2] == 3 && head[3] == 4;
}

namespace {

bool by_name(const Found& a, const Found& b) {
  return a.name < b.name;
}

// What is to be read of a source, in the order of names.
struct ToRead {
  std::vector<Found> files;
  std::string only_series;  // empty: all of them
};

ToRead files_of(const fs::path& source, DicomScan& scan, const Context& context) {
  ToRead r;
  if (fs::is_directory(source)) {
    r.files = files_below(source, scan.set_aside);
  } else if (is_archive(source)) {
    for (auto& u : dicom::unpack(source, scan.scratch->path(), context.sub(0, 0.4)))
      r.files.push_back({u.file, u.name});
    std::sort(r.files.begin(), r.files.end(), by_name);
  } else {
    const DicomHeader one = read_dicom_header(source, scan.scratch->path());
    if (one.sop_class == kIndex) r.files = files_of_index(source, scan.set_aside);
    if (one.usable() && one.frames.size() == 1 && !one.series_uid.empty()) {
      // One slice stands for its series: the files beside it that belong to it.
      r.only_series = one.series_uid;
      const fs::path folder = source.has_parent_path() ? source.parent_path() : fs::path(".");
      std::error_code ec;
      for (const auto& e : fs::directory_iterator(folder, ec)) {
        if (e.is_regular_file(ec)) r.files.push_back({e.path(), e.path().filename().string()});
      }
      std::sort(r.files.begin(), r.files.end(), by_name);
    }
    if (r.files.empty()) r.files.push_back({source, source.filename().string()});
  }
  return r;
}

std::vector<DicomHeader> read_headers(const std::vector<Found>& files, const fs::path& scratch, double hu_offset,
                                      const Context& context) {
  std::vector<DicomHeader> headers(files.size());
  std::atomic<std::size_t> done{0};
  parallel_for(files.size(), 16, context.threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      headers[i] = read_dicom_header(files[i].file, scratch);
      headers[i].name = files[i].name;
      for (DicomFrame& f : headers[i].frames) f.intercept += hu_offset;
    }
    done += end - begin;
    context.progress(0.4 + 0.5 * static_cast<double>(done) / static_cast<double>(files.size()), "reading headers");
  });
  return headers;
}

// What identifies the patient, in any of them; they do not keep it.
std::set<std::string> take_identifying(std::vector<DicomHeader>& headers) {
  std::set<std::string> identifying;
  for (DicomHeader& h : headers) {
    identifying.insert(h.identifying.begin(), h.identifying.end());
    h.identifying.clear();
    h.identifying.shrink_to_fit();
  }
  return identifying;
}

// Into the scan's series, or aside; names that identify the patient become numbers.
void sort_headers(std::vector<DicomHeader> headers, const std::string& only_series,
                  const std::set<std::string>& identifying, DicomScan& scan) {
  const auto number_of = [](std::size_t i) {
    const std::string n = std::to_string(i + 1);
    return "file-" + std::string(n.size() < 6 ? 6 - n.size() : 0, '0') + n;
  };
  std::map<std::string, std::size_t> group;
  for (std::size_t i = 0; i < headers.size(); ++i) {
    DicomHeader& h = headers[i];
    if (!only_series.empty() && h.series_uid != only_series) continue;
    h.name = without_identity(h.name, identifying, number_of(i));
    const bool alone = h.frames.empty() && !h.usable() && h.problem_code != code::pixels_damaged;
    if (alone) {
      scan.set_aside.push_back({h.name, h.problem_code, h.problem});
      continue;
    }
    const std::string key =
        h.series_uid.empty() ? h.study_uid + "/" + std::to_string(h.series_number) + "/" + h.description : h.series_uid;
    const auto [it, is_new] = group.try_emplace(key, scan.series.size());
    if (is_new) scan.series.emplace_back();
    scan.series[it->second].headers.push_back(std::move(h));
  }
  for (FileSetAside& f : scan.set_aside) {
    f.file = without_identity(f.file, identifying, "(name removed)");
  }
}

// From the first of its headers that can be used.
void describe(DicomSeries& s, const std::set<std::string>& identifying) {
  const auto good = std::find_if(s.headers.begin(), s.headers.end(), [](const auto& h) { return h.usable(); });
  const DicomHeader& h = good == s.headers.end() ? s.headers.front() : *good;
  s.number = h.series_number;
  s.uid = h.series_uid;
  s.modality = h.modality;
  s.description = identifies(h.description, identifying) ? "(removed)" : h.description;
  s.study_date = h.study_date;
  s.study_description = identifies(h.study_description, identifying) ? "(removed)" : h.study_description;
  s.kernel = h.kernel;
  s.columns = h.columns;
  s.rows = h.rows;
  s.pixel_mm = h.frames.empty() ? 0 : h.frames.front().column_spacing_mm;
  s.thickness_mm = h.thickness_mm;
  for (const auto& each : s.headers) s.images += static_cast<int>(each.frames.size());
}

}  // namespace

DicomScan scan_dicom(const fs::path& source, const PlaceOptions& options, const Context& context) {
  require_readable(source);
  const QuietVtk quiet;
  DicomScan scan;
  scan.scratch = std::make_shared<TemporaryFolder>();
  const ToRead found = files_of(source, scan, context);
  scan.files = found.files.size();
  std::vector<DicomHeader> headers = read_headers(found.files, scan.scratch->path(), options.hu_offset, context);
  const std::set<std::string> identifying = take_identifying(headers);
  sort_headers(std::move(headers), found.only_series, identifying, scan);
  scan.series = part_by_scan(std::move(scan.series));
  const auto strays = std::make_shared<const std::vector<FileSetAside>>(scan.set_aside);
  // Pictures that could be of no volume go by name: a whole series of them is still worth a line.
  std::vector<double> price(scan.series.size(), 1e30);
  for (std::size_t i = 0; i < scan.series.size(); ++i) {
    DicomSeries& s = scan.series[i];
    describe(s, identifying);
    s.strays = strays;
    judge(s, options, price[i]);
    context.progress(0.9 + 0.1 * static_cast<double>(i + 1) / static_cast<double>(scan.series.size()), "sorting");
  }
  if (scan.series.empty()) {
    const std::string more =
        scan.set_aside.empty() ? "" : " ('" + scan.set_aside.front().file + "': " + scan.set_aside.front().why + ")";
    throw Error(ExitCode::no_input, "'" + source.string() + "' holds no DICOM image" + more,
                "give the folder with the CT's slices, or a .nrrd, .nii.gz, .mha or .vti file");
  }
  recommend(scan.series, price);
  std::stable_sort(scan.series.begin(), scan.series.end(), [](const auto& a, const auto& b) {
    return std::tie(a.scan, a.number) < std::tie(b.scan, b.number);
  });
  return scan;
}

const DicomSeries& choose_series(const DicomScan& scan, const std::string& wanted, const std::string& source_name) {
  std::vector<const DicomSeries*> found;
  for (const DicomSeries& s : scan.series) {
    const bool asked_for = std::to_string(s.number) == wanted || s.uid == wanted || named(s) == wanted;
    if (wanted.empty() || s.scan == wanted ? s.recommended : asked_for) found.push_back(&s);
  }
  if (found.size() == 1) return *found.front();
  if (found.size() > 1) {
    std::string list;
    for (const DicomSeries* s : found)
      list += (list.empty() ? "" : "; ") + named(*s) + ": " + std::to_string(s->images) + " pictures, " + s->what;
    if (!wanted.empty()) {
      const bool same_scan =
          std::any_of(found.begin() + 1, found.end(), [&](const auto* s) { return s->scan == found.front()->scan; });
      throw Error(ExitCode::usage, "there are several series " + wanted + " (" + list + ")",
                  same_scan ? "'osteo import --list --json FOLDER' shows their UIDs: give one of those"
                            : "give --series " + named(*found.front()) + " or another of these");
    }
    throw Error(
        ExitCode::corrupt,
        "'" + source_name + "' holds " + std::to_string(found.size()) + " scans that do not belong together, " +
            what_differs(found) + " (" + list + ")",
        "choose one, like --series " + found.front()->scan +
            "; 'osteo import --list FOLDER' shows all series, --studies the date and description of each study");
  }
  // When there is but one, its own verdict says more than a list.
  if (wanted.empty() && scan.series.size() == 1) return scan.series.front();
  std::string list;
  for (const DicomSeries& s : scan.series)
    list += (list.empty() ? "" : "; ") + std::to_string(s.number) + ": " + (s.problem.empty() ? s.what : s.problem);
  if (wanted.empty()) {
    throw Error(ExitCode::no_input, "'" + source_name + "' holds no CT series that makes a volume (" + list + ")",
                "'osteo import --list FOLDER' shows what each series is");
  }
  throw Error(ExitCode::usage, "there is no series '" + wanted + "' (" + list + ")",
              "'osteo import --list FOLDER' shows the series");
}

}  // namespace osteo::inline imaging
