// list, info, series: what there is.
#include <algorithm>
#include <cmath>
#include <map>
#include <ostream>

#include "case_pipeline.h"
#include "commands/info.h"
#include "commands/list.h"
#include "commands/list_series.h"
#include "osteo/assessment/case_report/case_report.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/json_document.h"
#include "osteo/geometry/grid/brick_grid.h"
#include "osteo/geometry/tets/quality.h"
#include "osteo/imaging/dicom/import.h"
#include "osteo/imaging/dicom/scan.h"
#include "osteo/imaging/image/planes.h"
#include "osteo/imaging/io/surface_io.h"
#include "osteo/imaging/pipeline/formats.h"
#include "osteo/session/scene/approval.h"

namespace osteo {
namespace {

Json triple(Vec3 v);

Json bounds(const auto& points_mm) {
  Vec3 lo{1e300, 1e300, 1e300}, hi = lo * -1;
  for (const auto& p : points_mm) {
    for (std::size_t a = 0; a < 3; ++a) {
      lo[a] = std::min(lo[a], static_cast<double>(p[a]));
      hi[a] = std::max(hi[a], static_cast<double>(p[a]));
    }
  }
  return {triple(lo), triple(hi)};
}

Json triple(Vec3 v) {
  return {v.x, v.y, v.z};
}

void add_frame(Json& j, const Frame& f) {
  j["dims"] = f.dims;
  j["spacing_mm"] = triple(f.spacing_mm);
  j["origin_mm"] = triple(f.origin_mm);
  j["axes"] = orientation_code(f);
  j["direction"] = {triple(f.direction.column[0]), triple(f.direction.column[1]), triple(f.direction.column[2])};
}

void describe_data(Json& j, const Data& data) {
  j["kind"] = kind_name(kind_of(data));
  if (const auto* image = std::get_if<Image>(&data)) {
    add_frame(j, image->frame);
    const auto [lo, hi] = std::minmax_element(image->span().begin(), image->span().end());
    j["hu_range"] = {*lo, *hi};
  } else if (const auto* labels = std::get_if<Labels>(&data)) {
    add_frame(j, labels->frame);
    std::array<std::uint64_t, 256> count{};
    for (const auto v : labels->span()) ++count[v];
    for (std::size_t v = 1; v < count.size(); ++v) {
      if (count[v] > 0)
        j["volume_mm3"][std::to_string(v)] = static_cast<double>(count[v]) * labels->frame.voxel_volume_mm3();
    }
  } else if (const auto* grid = std::get_if<SparseGrid>(&data)) {
    j["name"] = grid->name;
    add_frame(j, grid->frame);
    j["stored_voxels"] = grid->active_voxels;
    j["memory_mb"] = static_cast<double>(grid->memory_bytes) / 1e6;
    if (grid->name == "density") {
      const BrickGrid bricks = to_bricks(*grid);
      j["volume_mm3"] = bricks.sum() * grid->frame.voxel_volume_mm3();
    }
  } else if (const auto* surface = std::get_if<Surface>(&data)) {
    const TriMesh& mesh = **surface;
    j["points"] = mesh.points_mm.size();
    j["triangles"] = mesh.triangles.size();
    const MeshCheck c = check(mesh);
    j["watertight"] = c.watertight();
    j["manifold"] = c.manifold();
    j["area_mm2"] = area_mm2(mesh);
    if (c.watertight()) j["volume_mm3"] = enclosed_volume_mm3(mesh);
    j["bounds_mm"] = bounds(mesh.points_mm);
  } else if (const auto* tets = std::get_if<Tets>(&data)) {
    const TetQuality q = tet_quality(**tets);
    j["points"] = q.points;
    j["tets"] = q.tets;
    j["volume_mm3"] = q.volume_mm3;
    j["inverted"] = q.inverted;
    j["conforming"] = q.conforming();
    j["min_dihedral_deg"] = q.min_dihedral_deg;
    j["max_dihedral_deg"] = q.max_dihedral_deg;
    j["min_aspect"] = q.min_aspect;
    j["bounds_mm"] = bounds((*tets)->points_mm);
  } else if (const auto* picture = std::get_if<Picture>(&data)) {
    j["width"] = picture->width;
    j["height"] = picture->height;
  }
}

// A value with the digits that mean something; lists as "1, 2, 3".
std::string plain_text(const Json& value) {
  if (value.text() != nullptr) return *value.text();
  if (!value.items().empty()) {
    std::string all;
    for (const Json& v : value.items()) all += (all.empty() ? "" : v.items().empty() ? ", " : "; ") + plain_text(v);
    return all;
  }
  const auto number = value.number();
  if (!number || *number == 0 || *number == std::round(*number)) return value.dump();
  const double scale = std::pow(10, 5 - std::floor(std::log10(std::abs(*number))));
  return format_number(std::round(*number * scale) / scale);
}

// JSON as indented lines for people.
void print_plain(std::ostream& out, const Json& j, const std::string& indent = "") {
  for (const auto& [key, value] : j.members()) {
    if (!value.members().empty()) {
      out << indent << key << ":\n";
      print_plain(out, value, indent + "  ");
    } else {
      out << indent << key << ": " << plain_text(value) << '\n';
    }
  }
}

}  // namespace

cli::CommandInfo ListCommand::info() {
  return {"list",
          "the stages with their inputs and outputs",
          "One line a stage, or with --json their whole declarations.",
          {},
          "osteo list"};
}

int ListCommand::run(const Params&, cli::Invocation& io) {
  Json all = Json::list();
  for (const auto& name : io.registry.names()) {
    const auto stage = io.registry.make(name);
    std::string in, out;
    for (const Port& p : stage->info().inputs)
      in += (in.empty() ? "" : ", ") + std::string(p.optional ? "[" : "") + p.name + (p.optional ? "]" : "");
    for (const Port& p : stage->info().outputs)
      out += (out.empty() ? "" : ", ") + std::string(p.optional ? "[" : "") + p.name + (p.optional ? "]" : "");
    if (io.common.json) {
      all.push_back({{"name", name}, {"version", stage->info().version}, {"synopsis", stage->info().synopsis}});
    } else {
      io.out << name << std::string(12 - std::min<std::size_t>(11, name.size()), ' ') << (in.empty() ? "-" : in)
             << " -> " << out << "\n            " << stage->info().synopsis << '\n';
    }
  }
  if (io.common.json) io.out << all.dump(2) << '\n';
  return 0;
}

cli::CommandInfo InfoCommand::info() {
  return {"info",
          "facts on any file that can be read",
          "Kind, frame, range of values, volume, closedness: whatever applies. Of a case what a person wants to know, "
          "approval included; "
          "--json prints "
          "its manifest. Another folder is taken for DICOM.",
          {{"file", "volume, grid, surface, picture, or DICOM folder"}},
          "osteo info bone.vdb"};
}

int InfoCommand::run(const Params&, cli::Invocation& io) {
  const fs::path path = io.arguments[0];
  require_readable(path);
  if (fs::is_directory(path) && !fs::exists(path / "manifest.json")) return ListSeriesCommand::run({}, io);
  Json j;
  if (fs::is_directory(path)) {
    const auto manifest = Json::parse(read_text(path / "manifest.json"));
    if (!manifest)
      throw Error(ExitCode::corrupt, "'" + (path / "manifest.json").string() + "' is damaged",
                  "run 'osteo prepare' again");
    j = *manifest;
    j["code"] = case_code(path);
    j["approval"] = approval_json(approval_of(path));
    if (!io.common.json) {
      auto rows = case_facts(path);
      if (const auto recipe = read_recipe(path)) rows.emplace_back("Asked for", flags_of(*recipe).substr(1));
      for (const auto& [name, value] : rows)
        io.out << name << std::string(name.size() < 20 ? 20 - name.size() : 1, ' ') << value << '\n';
      return 0;
    }
  } else {
    static constexpr std::array kAny{DataKind::image,   DataKind::labels, DataKind::grid,
                                     DataKind::surface, DataKind::tets,   DataKind::picture};
    j["file"] = path.string();
    describe_data(j, load_data(path, kAny, io.context));
  }
  io.end_progress();
  if (io.common.json) {
    io.out << j.dump(2) << '\n';
  } else {
    print_plain(io.out, j);
  }
  return 0;
}

cli::CommandInfo ListSeriesCommand::info() {
  return {"list-series",
          "the DICOM series of a folder and what each is",
          "Also as 'osteo import --list'. The one marked * is taken when none is asked for. The scan says what belongs "
          "together: a letter "
          "for the patient, a number for the study, a letter for the frame of reference. Of several scans one must be "
          "asked for.",
          {{"folder", "folder with DICOM files at any depth"}},
          "osteo list-series DICOM_FOLDER"};
}

namespace {

// The middle slices of all series; of what is no volume there is none, and it says so.
void write_thumbnails(const DicomScan& scan, const fs::path& source, const fs::path& folder, cli::Invocation& io) {
  if (fs::exists(folder) && !fs::is_directory(folder))
    throw Error(ExitCode::cannot_write, "'" + folder.string() + "' is no folder");
  fs::create_directories(folder);
  std::map<std::string, int> times;
  for (const DicomSeries& s : scan.series) {
    std::string name = s.scan + "-" + std::to_string(s.number);
    // Two series may have one number.
    if (const int n = ++times[name]; n > 1) name += "-" + std::to_string(n);
    ImportParams p;
    p.series = s.uid;
    p.any_modality = true;
    try {
      Context quiet;
      quiet.threads = io.context.threads;
      const Image image = import_ct(source, p, quiet).image;
      // Soft tissue of a CT; of anything else all but its rarest values.
      std::vector<std::int16_t> some;
      for (std::size_t i = 0; i < image.frame.voxel_count();
           i += std::max<std::size_t>(1, image.frame.voxel_count() / 100000))
        some.push_back(image.voxels[i]);
      std::sort(some.begin(), some.end());
      const bool ct = s.modality == "CT";
      const double lo = ct ? -160 : some[some.size() / 50], hi = ct ? 240 : some[some.size() - 1 - some.size() / 100];
      const fs::path path = folder / (name + ".png");
      if (fs::exists(path) && !io.common.force)
        throw Error(ExitCode::cannot_write, "'" + path.string() + "' exists", "--force replaces it");
      save_picture(thumbnail(image, {2, image.frame.dims[2] / 2}, 256, lo, std::max(hi, lo + 1)), path);
    } catch (const Error& e) {
      if (e.code() == ExitCode::cannot_write) throw;
      io.context.info("no thumbnail of " + name + ": " + e.what());
    }
  }
}

}  // namespace

int ListSeriesCommand::run(const Params& p, cli::Invocation& io) {
  if (io.arguments.size() != 1) throw Error(ExitCode::usage, "which folder? osteo import --list FOLDER");
  const DicomScan scan = scan_dicom(io.arguments[0], {}, io.context);
  if (!p.thumbnails.empty()) write_thumbnails(scan, io.arguments[0], p.thumbnails, io);
  io.end_progress();
  if (io.common.json) {
    Json j;
    j["files"] = scan.files;
    j["series"] = Json::list();
    for (const DicomSeries& s : scan.series) {
      Json e{{"scan", s.scan},
             {"number", s.number},
             {"uid", s.uid},
             {"modality", s.modality},
             {"what", s.what},
             {"usable", s.usable},
             {"recommended", s.recommended},
             {"images", s.images},
             {"columns", s.columns},
             {"rows", s.rows},
             {"pixel_mm", s.pixel_mm},
             {"thickness_mm", s.thickness_mm},
             {"gap_mm", s.gap_mm},
             {"kernel", s.kernel},
             {"description", s.description}};
      if (p.studies) {
        e["study_date"] = s.study_date;
        e["study_description"] = s.study_description;
      }
      if (s.usable) e["why"] = s.why;
      if (!s.problem.empty()) e["problem"] = s.problem;
      j["series"].push_back(std::move(e));
    }
    j["set_aside"] = Json::list();
    for (const FileSetAside& f : scan.set_aside)
      j["set_aside"].push_back({{"file", f.file}, {"code", f.code}, {"why", f.why}});
    io.out << j.dump(2) << '\n';
    return 0;
  }
  io.out
      << "  scan  series  images  size       pixel mm  gap mm    what                          kernel    description\n";
  for (const DicomSeries& s : scan.series) {
    char line[320];
    const std::string size = std::to_string(s.columns) + "x" + std::to_string(s.rows);
    std::snprintf(line, sizeof line, "%c %-5s %-7d %-7d %-10s %-9.4g %-9.4g %-29s %-9s %s\n", s.recommended ? '*' : ' ',
                  s.scan.c_str(), s.number, s.images, size.c_str(), s.pixel_mm, s.gap_mm, s.what.c_str(),
                  s.kernel.c_str(), s.description.c_str());
    io.out << line;
  }
  for (const DicomSeries& s : scan.series) {
    if (s.recommended) io.out << "* " << s.scan << ':' << s.number << " recommended: " << s.why << '\n';
    if (!s.problem.empty()) io.out << "  " << s.scan << ':' << s.number << ": " << s.problem << '\n';
  }
  if (p.studies) {
    std::map<std::string, std::string> studies;
    for (const DicomSeries& s : scan.series)
      studies[s.scan.substr(0, s.scan.find_last_of("0123456789") + 1)] = s.study_date + "  " + s.study_description;
    for (const auto& [study, what] : studies) io.out << "study " << study << ": " << what << '\n';
  }
  if (!scan.set_aside.empty()) io.out << "set aside, " << scan.set_aside.size() << " of " << scan.files << " files:\n";
  constexpr std::size_t kShown = 10;
  for (std::size_t i = 0; i < std::min(kShown, scan.set_aside.size()); ++i) {
    io.out << "  " << scan.set_aside[i].file << ": " << scan.set_aside[i].why << '\n';
  }
  if (scan.set_aside.size() > kShown)
    io.out << "  and " << scan.set_aside.size() - kShown << " more (--json lists them all)\n";
  return 0;
}

}  // namespace osteo
