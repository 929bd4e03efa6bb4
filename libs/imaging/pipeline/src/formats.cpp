#include "osteo/imaging/pipeline/formats.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/param.h"
#include "osteo/core/stage/stage.h"
#include "osteo/geometry/grid/grid_io.h"
#include "osteo/geometry/grid/sampler.h"
#include "osteo/imaging/dicom/objects.h"
#include "osteo/imaging/dicom/save_series.h"
#include "osteo/imaging/io/surface_io.h"
#include "osteo/imaging/io/tet_io.h"
#include "osteo/imaging/io/volume_io.h"

namespace osteo::inline imaging {
namespace {

struct Suffixes {
  DataKind kind;
  std::string_view writable;
};
constexpr std::array<Suffixes, 7> kSuffixes{{{DataKind::image, ".nrrd .nii .nii.gz .mha .vti"},
                                             {DataKind::labels, ".seg.nrrd .nrrd .nii .nii.gz .mha .vti .dcm"},
                                             {DataKind::grid, ".vdb .nrrd .vti"},
                                             {DataKind::surface, ".ply .stl .obj .glb .3mf .vtp .dcm"},
                                             {DataKind::picture, ".png"},
                                             {DataKind::document, ".json .inp .svg .csv .tfm .vtu .html"},
                                             {DataKind::tets, ".vtu .node .ele"}}};

bool accepts(std::span<const DataKind> kinds, DataKind kind) {
  return std::find(kinds.begin(), kinds.end(), kind) != kinds.end();
}

// All voxels of the box that holds the stored ones; the others have the background's value.
Volume<float> dense(const SparseGrid& grid, const Context& context) {
  constexpr double kMaxVoxels = 2e9;
  const auto& n = grid.frame.dims;
  if (1.0 * n[0] * n[1] * n[2] > kMaxVoxels)
    throw Error(ExitCode::resources, "the box around the grid has over 2e9 voxels",
                "write it as .vdb, which is sparse");
  Volume<float> all;
  all.frame = grid.frame;
  const auto values = make_voxels<float>(grid.frame.voxel_count());
  const GridSampler sampler(grid);
  std::size_t at = 0;
  for (int k = 0; k < n[2]; ++k) {
    context.check_cancelled();
    for (int j = 0; j < n[1]; ++j) {
      for (int i = 0; i < n[0]; ++i) values[at++] = sampler.linear_at({1.0 * i, 1.0 * j, 1.0 * k});
    }
  }
  all.voxels = values;
  return all;
}

// STL and its like have no unit. A stage cannot refuse a tooth or a whole body, but these are neither.
void warn_of_size(const TriMesh& surface, const fs::path& path, const Context& context) {
  constexpr float kShortestMm = 2, kLongestMm = 5000;
  if (surface.points_mm.empty()) return;
  auto lo = surface.points_mm.front(), hi = lo;
  for (const auto& p : surface.points_mm) {
    for (std::size_t a = 0; a < 3; ++a) {
      lo[a] = std::min(lo[a], p[a]);
      hi[a] = std::max(hi[a], p[a]);
    }
  }
  const float longest = std::max({hi[0] - lo[0], hi[1] - lo[1], hi[2] - lo[2]});
  if (longest > 0 && (longest < kShortestMm || longest > kLongestMm))
    context.warn(
        "'" + path.string() + "' is " + format_number(std::round(1e4 * static_cast<double>(longest)) / 1e4) +
        " mm large: " + (longest < kShortestMm ? "are its lengths in metres?" : "are its lengths in micrometres?") +
        " They are taken as millimetres");
}

}  // namespace

std::string suffixes_of(DataKind kind) {
  for (const auto& s : kSuffixes) {
    if (s.kind == kind)
      return std::string(s.writable) + (kind == DataKind::image ? ", or a folder name without suffix for DICOM" : "");
  }
  return {};
}

Data load_data(const fs::path& path, std::span<const DataKind> accepted, const Context& context) {
  if (accepts(accepted, DataKind::source)) {
    require_readable(path);
    return Source{path};
  }
  require_readable(path);
  const auto wrong = [&](DataKind found) {
    return Error(ExitCode::usage, "'" + path.string() + "' is a " + std::string(kind_name(found)) + " by its name; " +
                                      kinds_text(accepted) + " is wanted");
  };
  if (path.extension() == ".vdb") {
    if (!accepts(accepted, DataKind::grid)) throw wrong(DataKind::grid);
    return load_grid(path);
  }
  if (is_surface_file(path)) {
    if (!accepts(accepted, DataKind::surface)) throw wrong(DataKind::surface);
    Surface surface = load_surface(path);
    warn_of_size(*surface, path, context);
    return surface;
  }
  if (path.extension() == ".inp" && accepts(accepted, DataKind::document)) return Document{read_text(path)};
  if (is_tet_file(path)) {
    if (!accepts(accepted, DataKind::tets)) throw wrong(DataKind::tets);
    return load_tets(path);
  }
  if (path.extension() == ".png") {
    if (!accepts(accepted, DataKind::picture)) throw wrong(DataKind::picture);
    return load_picture(path);
  }
  if (path.extension() == ".json") {
    if (!accepts(accepted, DataKind::document)) throw wrong(DataKind::document);
    return Document{read_text(path)};
  }
  if (fs::is_directory(path)) {
    throw Error(ExitCode::usage, "'" + path.string() + "' is a folder; " + kinds_text(accepted) + " is wanted",
                "'osteo import FOLDER ct.nrrd' reads a folder of DICOM files");
  }
  const bool image = accepts(accepted, DataKind::image), labels = accepts(accepted, DataKind::labels);
  if (labels && !is_volume_file(path) && is_segmentation(path)) return load_segmentation(path, context);
  if (!image && !labels) {
    if (is_volume_file(path)) throw wrong(DataKind::image);
    throw Error(ExitCode::usage, "'" + path.string() + "' is no " + kinds_text(accepted) + " by its name");
  }
  if (image && labels) {
    return std::visit([](auto&& volume) -> Data { return volume; }, load_volume(path, context));
  }
  return labels ? Data(load_labels(path, context)) : Data(load_image(path, context));
}

bool becomes_folder(DataKind kind, const fs::path& path) {
  return kind == DataKind::image && !path.has_extension();
}

void require_savable(DataKind kind, const fs::path& path) {
  if (becomes_folder(kind, path)) return;
  const std::string name = path.filename().string();
  for (const auto& s : kSuffixes) {
    if (s.kind != kind) continue;
    std::string_view rest = s.writable;
    while (!rest.empty()) {
      const std::size_t space = rest.find(' ');
      const std::string_view suffix = rest.substr(0, space);
      if (name.size() > suffix.size() && name.ends_with(suffix)) return;
      rest = space == std::string_view::npos ? std::string_view() : rest.substr(space + 1);
    }
  }
  throw Error(ExitCode::usage, "cannot write a " + std::string(kind_name(kind)) + " as '" + name + "'",
              "name it " + suffixes_of(kind));
}

void save_data(const Data& data, const fs::path& path, const Context& context,
               const std::function<void(const fs::path&)>& may_replace) {
  require_savable(kind_of(data), path);
  switch (kind_of(data)) {
    case DataKind::image:
      if (becomes_folder(DataKind::image, path)) {
        save_dicom_series(std::get<Image>(data), path, context, may_replace);
      } else {
        save_image(std::get<Image>(data), path);
      }
      return;
    case DataKind::labels:
      if (path.extension() == ".dcm") {
        save_segmentation(std::get<Labels>(data), path);
      } else {
        save_labels(std::get<Labels>(data), path);
      }
      return;
    case DataKind::grid:
      if (path.extension() == ".vdb") {
        save_grid(std::get<SparseGrid>(data), path);
      } else {
        save_values(dense(std::get<SparseGrid>(data), context), path);
      }
      return;
    case DataKind::surface:
      if (path.extension() == ".dcm") {
        save_encapsulated_stl(*std::get<Surface>(data), path);
      } else {
        save_surface(*std::get<Surface>(data), path);
      }
      return;
    case DataKind::picture:
      save_picture(std::get<Picture>(data), path);
      return;
    case DataKind::document:
      write_file(path, std::get<Document>(data).json);
      return;
    case DataKind::tets:
      save_tets(*std::get<Tets>(data), path);
      return;
    case DataKind::none:
    case DataKind::source:
      break;
  }
  throw Error(ExitCode::unspecified, "a stage returned nothing for '" + path.string() + "'");
}

}  // namespace osteo::inline imaging
