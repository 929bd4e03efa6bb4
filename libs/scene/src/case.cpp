#include "osteo/scene/case.h"

#include <nlohmann/json.hpp>

#include "osteo/base/error.h"
#include "osteo/base/files.h"
#include "osteo/base/json.h"
#include "osteo/grid/grid_io.h"
#include "osteo/pipeline/report_json.h"

namespace osteo {
namespace {

using nlohmann::ordered_json;

ordered_json triple(Vec3 v) {
  return {v.x, v.y, v.z};
}

}  // namespace

void write_manifest(const fs::path& folder, const std::string& pipeline_name, const std::vector<NodeResult>& results) {
  ordered_json m;
  m["osteotome_case"] = 1;
  m["program"] = std::string(program_version());
  m["pipeline"] = pipeline_name;
  m["units"] = {{"length", "mm"}, {"world", "LPS"}, {"density", "share of the voxel filled with bone, 0 to 1"}, {"hu", "Hounsfield units"}};
  m["privacy"] = "No identity, no dates, no file names of the source. Only voxels that hold bone are stored: no skin, no face.";
  m["files"] = ordered_json::object();
  m["steps"] = ordered_json::array();
  for (const NodeResult& r : results) {
    m["steps"].push_back({{"id", r.id}, {"stage", r.stage}, {"params", r.params}, {"key", r.key}, {"report", report_to_json(r.report)}});
    for (const auto& [port, path] : r.outputs) {
      if (path.parent_path().lexically_normal() != folder.lexically_normal() && fs::absolute(path).parent_path() != fs::absolute(folder))
        continue;
      // A finer part of the bone is bone too: its stage's name tells them apart.
      const std::string role = r.id == "region" && port == "bone" ? "region" : port;
      m["files"][role] = {{"file", path.filename().string()}, {"hash", r.output_hashes.at(port)}};
    }
  }
  if (!m["files"].contains("bone")) {
    throw Error(ExitCode::usage, "the pipeline writes no \"bone\" into the case folder",
                "a case needs a stage with the output bone, as in pipelines/temporal-bone.json");
  }
  const SparseGrid bone = load_grid(folder / m["files"]["bone"]["file"].get<std::string>());
  m["frame"] = {{"dims", bone.frame.dims},
                {"spacing_mm", triple(bone.frame.spacing_mm)},
                {"origin_mm", triple(bone.frame.origin_mm)},
                {"direction",
                 {triple(bone.frame.direction.column[0]), triple(bone.frame.direction.column[1]), triple(bone.frame.direction.column[2])}},
                {"axes", orientation_code(bone.frame)}};
  m["bone_memory_mb"] = static_cast<double>(bone.memory_bytes) / 1e6;
  write_file(folder / "manifest.json", m.dump(2) + "\n");
}

std::map<std::string, ManifestFile> parse_manifest(std::string_view json) {
  std::map<std::string, ManifestFile> files;
  try {
    const ordered_json m = ordered_json::parse(json);
    if (m.at("osteotome_case") != 1) throw Error(ExitCode::corrupt, "it is of an unknown version");
    for (const auto& [role, f] : m.at("files").items()) {
      ManifestFile file{f.at("file").get<std::string>(), f.at("hash").get<std::string>()};
      if (file.name.empty() || file.name.find('/') != std::string::npos || file.name == "..") {
        throw Error(ExitCode::corrupt, "it names a file outside the case");
      }
      files[role] = std::move(file);
    }
  } catch (const nlohmann::json::exception& e) {
    throw Error(ExitCode::corrupt, std::string("it is damaged: ") + json_complaint(e), "run 'osteo prepare' again");
  }
  if (!files.contains("bone")) throw Error(ExitCode::corrupt, "it names no bone");
  return files;
}

Case load_case(const fs::path& folder) {
  require_readable(folder);
  const fs::path manifest = folder / "manifest.json";
  if (!fs::is_directory(folder) || !fs::exists(manifest)) {
    throw Error(ExitCode::no_input, "'" + folder.string() + "' is not a prepared case: it has no manifest.json",
                "make one with: osteo prepare CT -o " + folder.string());
  }
  Case result;
  result.folder = folder;
  std::map<std::string, ManifestFile> files;
  try {
    files = parse_manifest(read_text(manifest));
  } catch (const Error& e) {
    throw e.in("'" + manifest.string() + "'");
  }
  for (const auto& [role, f] : files) {
    const fs::path path = folder / f.name;
    require_readable(path);
    if (hash_path(path) != f.hash) {
      throw Error(ExitCode::corrupt, "'" + path.string() + "' is not the file that the manifest describes",
                  "it was changed or damaged: run 'osteo prepare' again");
    }
    result.files[role] = path;
  }
  result.bone = load_grid(result.files["bone"]);
  return result;
}

}  // namespace osteo
