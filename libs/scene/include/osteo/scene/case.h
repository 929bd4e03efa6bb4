// A prepared case: a folder that can be moved, with a manifest that says what is in it.
#pragma once
#include <filesystem>
#include <map>
#include <string>
#include <string_view>

#include "osteo/data/sparse_grid.h"
#include "osteo/pipeline/pipeline.h"

namespace osteo {

struct Case {
  std::filesystem::path folder;
  std::map<std::string, std::filesystem::path> files;  ///< role ("bone", "hu", "surface", "preview") -> file in the folder
  SparseGrid bone;
};

/// Writes manifest.json: units, frame, what made each file, hashes; nothing that identifies the patient.
void write_manifest(const std::filesystem::path& folder, const std::string& pipeline_name, const std::vector<NodeResult>& results);

struct ManifestFile {
  std::string name;  ///< in the case's folder
  std::string hash;
};
/// Role -> file. Error(corrupt) for what is no manifest, names no bone, or names a file outside the case.
[[nodiscard]] std::map<std::string, ManifestFile> parse_manifest(std::string_view json);

/// Reads the manifest, checks that the files are there and unchanged, loads the bone. Errors: no_input, corrupt.
[[nodiscard]] Case load_case(const std::filesystem::path& folder);

}  // namespace osteo
