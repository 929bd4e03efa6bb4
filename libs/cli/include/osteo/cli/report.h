// What was done, told to people on standard error or to programs as JSON on standard output.
#pragma once
#include <filesystem>
#include <vector>

#include "osteo/cli/command.h"
#include "osteo/pipeline/pipeline.h"

namespace osteo::cli {

void print_results(const std::vector<NodeResult>& results, Invocation& invocation);
/// "412345", "0.031", "yes": short enough for a table.
[[nodiscard]] std::string short_text(const ReportValue& value);

/// The reference pages made from the declarations of `program`: file name -> content.
[[nodiscard]] std::map<std::string, std::string> reference_pages(const Program& program);

}  // namespace osteo::cli
