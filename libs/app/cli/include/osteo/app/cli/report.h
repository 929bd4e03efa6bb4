// What was done, told to people on standard error or to programs as JSON on standard output.
#pragma once
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "osteo/app/cli/command.h"
#include "osteo/core/base/error.h"
#include "osteo/imaging/pipeline/pipeline.h"

namespace osteo::inline app::cli {

void print_results(const std::vector<NodeResult>& results, Invocation& invocation);
/// A failure as JSON, with the document that an ErrorWithDocument carries.
[[nodiscard]] std::string error_json(const Error& error);
/// "mask_volume_mm3", 511409.0 -> "mask volume", "511409 mm3": for people.
[[nodiscard]] std::pair<std::string, std::string> fact_text(const std::string& key, const ReportValue& value);
/// "412345", "0.031", "yes": short enough for a table.
[[nodiscard]] std::string short_text(const ReportValue& value);

/// The reference pages made from the declarations of `program`: file name -> content.
[[nodiscard]] std::map<std::string, std::string> reference_pages(const Program& program);

/// What an installation shares, made from the declarations: path below PREFIX/share -> content. Man pages, completion
/// of bash, zsh and fish, and the modules of 3D Slicer (scripts, which may be run, and .xml).
[[nodiscard]] std::map<std::string, std::string> shared_files(const Program& program);

}  // namespace osteo::inline app::cli
