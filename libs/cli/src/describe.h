// Everything that is printed from declarations: help, reference pages, schema, completion, Slicer XML. Private to libs/cli.
#pragma once
#include <map>
#include <string>

#include "osteo/cli/command.h"

namespace osteo::cli {

[[nodiscard]] std::string program_help(const Program& program);
[[nodiscard]] std::string stage_help(Stage& stage);
[[nodiscard]] std::string command_help(Command& command);
[[nodiscard]] std::string stage_xml(Stage& stage);
/// The declaration as JSON, for other programs.
[[nodiscard]] std::string stage_json(Stage& stage);
[[nodiscard]] std::string pipeline_schema(const Program& program);
[[nodiscard]] std::string bash_completion(const Program& program);
/// File name -> content of docs/reference.
[[nodiscard]] std::map<std::string, std::string> reference_pages(const Program& program);

/// "--half-width <mm>" or "--force"
[[nodiscard]] std::string flag_text(const FieldRef& field);
[[nodiscard]] std::string output_flag(const Port& port);

}  // namespace osteo::cli
