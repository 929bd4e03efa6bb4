// A prepared case: a folder that can be moved, with a manifest that says what is in it.
#pragma once
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "osteo/core/data/sparse_grid.h"
#include "osteo/imaging/pipeline/pipeline.h"
#include "osteo/session/scene/recipe.h"

namespace osteo::inline session {

struct Case {
  std::filesystem::path folder;
  std::map<std::string, std::filesystem::path>
      files;  ///< role ("bone", "hu", "surface", "preview") -> file in the folder
  SparseGrid bone;
};

/// The next state of a case. Until commit() the case stays as it was, whatever happens; from then on it is the new one,
/// also when the program is stopped half-way: who opens the case next finishes what is left (renames).
class CaseUpdate {
 public:
  /// Makes the folder when it is missing, finishes an earlier commit, and keeps others from preparing into it.
  /// Error(cannot_write).
  explicit CaseUpdate(std::filesystem::path folder);
  /// Without commit: nothing is left, not even the folder when it was made for this.
  ~CaseUpdate();
  CaseUpdate(const CaseUpdate&) = delete;
  CaseUpdate& operator=(const CaseUpdate&) = delete;

  [[nodiscard]] const std::filesystem::path& folder() const { return folder_; }
  /// Where an output of the case is written before commit(). What does not lie in the case's folder itself is written
  /// where it belongs.
  [[nodiscard]] std::filesystem::path place(const std::filesystem::path& output) const;
  /// `manifest`: the text of manifest.json. Files that only the old manifest names go, unless they were changed since.
  /// A case that would come out the same is not touched.
  void commit(const std::string& manifest);

 private:
  void close() noexcept;

  std::filesystem::path folder_, staging_;
  bool is_new_;
  int lock_ = -1;
};

/// Names of what lies in the folder and is no part of a case; of a case, what `outputs` would replace without having
/// made it.
[[nodiscard]] std::vector<std::string> foreign_files(const std::filesystem::path& folder,
                                                     const std::vector<std::filesystem::path>& outputs);

/// The text of manifest.json: units, frame, what made each file, hashes, recipe; nothing that identifies the patient.
[[nodiscard]] std::string make_manifest(const CaseUpdate& update, const std::string& pipeline_name,
                                        const std::vector<NodeResult>& results, const Recipe& recipe);
/// Fills in the reports of steps that were not done again, from the manifest that is there, where their keys agree.
void recall_facts(const std::filesystem::path& folder, std::vector<NodeResult>& results);

/// In a case whose structures were corrected by hand: as they were given, from which the edits begin.
inline constexpr std::string_view kGivenStructures = "structures-given.seg.nrrd";

struct ManifestFile {
  std::string name;  ///< in the case's folder
  std::string hash;
};
/// Role -> file. Error(corrupt), with the line, for what is no manifest, has a key that is not known, names no bone, or
/// names a file outside the case. `name` as errors call it.
[[nodiscard]] std::map<std::string, ManifestFile> parse_manifest(std::string_view json,
                                                                 const std::string& name = "manifest.json");

/// Finishes an interrupted commit, reads the manifest, checks that the files are there and unchanged, loads the bone.
/// Errors: no_input, corrupt.
[[nodiscard]] Case load_case(const std::filesystem::path& folder);

}  // namespace osteo::inline session
