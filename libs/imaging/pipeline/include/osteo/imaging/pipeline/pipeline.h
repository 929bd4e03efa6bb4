// A graph of stages: from a file or from a command line, checked as a whole before anything is read, then run.
#pragma once
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "osteo/core/base/context.h"
#include "osteo/core/stage/stage.h"

namespace osteo::inline imaging {

struct PipelineNode {
  struct Input {
    std::string node, port;      ///< another node's output; port empty: its first
    std::filesystem::path file;  ///< or a file, when `node` is empty
  };
  std::string id;
  std::string stage;
  std::map<std::string, std::string> params;             ///< field name -> text
  std::map<std::string, Input> inputs;                   ///< port -> where from
  std::map<std::string, std::filesystem::path> outputs;  ///< port -> file to write
};

struct Pipeline {
  std::string name;
  std::string description;
  std::vector<PipelineNode> nodes;
};

struct PipelineVariable {
  std::string name, help;
  std::optional<std::string> fallback;
  bool in_file_name = false;  ///< part of the name of a file that is read: its value may name a patient
};

/// Reads a pipeline file:
///   { "osteotome": 1, "name": "...", "description": "...",
///     "variables": { "source": {"help": "..."}, "spacing_mm": {"help": "...", "default": 0.5} },
///     "stages": [ { "id": "bone", "stage": "threshold", "in": {"image": "ct"}, "params": {"lower": 300},
///                   "out": {"mask": "${case}/mask.nrrd"} } ] }
/// An input is the id of another stage ("ct", or "resample.hu" for a port besides the first), or {"file": "PATH"}.
/// `settings`: variable -> text, or "id.param" -> text. Errors: usage, with the place in the file.
[[nodiscard]] Pipeline parse_pipeline(std::string_view json, const std::map<std::string, std::string>& settings);
[[nodiscard]] std::vector<PipelineVariable> pipeline_variables(std::string_view json);

/// Checks stages, parameters, ports, kinds, names of outputs and cycles, without reading or writing any data file, and
/// brings the nodes into an order in which they can run. Errors: usage.
void validate(Pipeline& pipeline, const Registry& registry);

struct RunOptions {
  bool overwrite = false;  ///< replace outputs that exist
  bool reuse = false;      ///< keep outputs that exist and would come out the same; make the others again
  /// Where an output is written before the caller moves it to its place, once all are made. Empty: straight to its
  /// place.
  std::function<std::filesystem::path(const std::filesystem::path& output)> place = {};
  /// Ids of nodes that are run even if all their outputs are there, or they write none.
  std::set<std::string> always = {};
  /// Called with each output of each node that was run, as soon as it is made. Whoever keeps the value keeps its
  /// memory.
  std::function<void(const std::string& id, const std::string& port, const Data& value)> seen = {};
};

struct NodeResult {
  std::string id, stage, key;
  bool reused = false;  ///< nothing was done: the outputs were there, unchanged
  double seconds = 0;
  Report report{};
  std::map<std::string, std::string> params{};
  std::map<std::string, std::filesystem::path> outputs{};
  std::map<std::string, std::string> output_hashes{};
};

/// Validates and runs. Beside each output FILE it writes FILE.prov.json: program, stage, parameters, hashes of inputs
/// and output, report, duration, peak memory. No names of inputs, since names of files may name patients. An error
/// names the stage; outputs finished before stay. A folder is replaced only when require_replaceable lets it pass.
std::vector<NodeResult> run_pipeline(Pipeline pipeline, const Registry& registry, const RunOptions& options,
                                     const Context& context);

/// Throws Error(cannot_write), with names, unless every file in `folder` is as the record beside `output` says: what
/// the program has not made, or what was changed since, is never replaced. (`output` may be a link to the folder.)
void require_replaceable(const std::filesystem::path& folder, const std::filesystem::path& output);
/// The text, or "(UID)" for a DICOM UID, which names a scan of a patient and must not reach a record.
[[nodiscard]] std::string without_uid(const std::string& text);
/// "a, b, c, d, e and 12 more"
[[nodiscard]] std::string list_names(const std::vector<std::string>& names);

/// One text for all names of one file or folder: absolute, links followed. It need not exist.
[[nodiscard]] std::string true_place(const std::filesystem::path& path);
[[nodiscard]] std::filesystem::path provenance_path(const std::filesystem::path& output);
/// "0.1.0 (commit c8d6ef5d1b2a)", with ", changed" where the sources differed from it, or "(unknown commit)" without
/// git.
[[nodiscard]] std::string_view program_version();

}  // namespace osteo::inline imaging
