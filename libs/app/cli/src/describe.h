// Everything that is printed from declarations: help, reference pages, schema, completion, Slicer XML. Private to
// libs/app/cli.
#pragma once
#include <map>
#include <string>
#include <vector>

#include "osteo/app/cli/command.h"

namespace osteo::inline app::cli {

/// The first screen; `all`: every stage and command.
[[nodiscard]] std::string program_help(const Program& program, bool all = false);
[[nodiscard]] std::string stage_help(Stage& stage);
[[nodiscard]] std::string command_help(Command& command);
/// `group`: below "Osteotome" in Slicer's list of modules.
[[nodiscard]] std::string stage_xml(Stage& stage, const std::string& group);
/// The title of a name's group; empty where the program has no groups.
[[nodiscard]] std::string group_of(const Program& program, const std::string& name);
/// "fill-holes" -> "OsteoFillHoles": a file without a dot in its name, as Slicer wants it; and its content.
[[nodiscard]] std::string slicer_module_name(const std::string& stage);
[[nodiscard]] std::string slicer_module_script(const std::string& stage);
/// Arguments of a stage as Slicer writes points and boxes of its scene, as the stage takes them. Error(usage) for a box
/// that is not six numbers.
[[nodiscard]] std::vector<std::string> from_slicer(const std::string& stage, const std::vector<std::string>& args);
/// The declaration as JSON, for other programs.
[[nodiscard]] std::string stage_json(Stage& stage);
[[nodiscard]] std::string pipeline_schema(const Program& program);
[[nodiscard]] std::string bash_completion(const Program& program);
[[nodiscard]] std::string zsh_completion(const Program& program);
[[nodiscard]] std::string fish_completion(const Program& program);
/// Of the program (subject empty), a stage or a command, from its help.
[[nodiscard]] std::string man_page(const Program& program, const std::string& subject);
/// Flags that every stage and command has.
[[nodiscard]] std::vector<FieldRef> common_fields();
/// File name -> content of docs/reference.
[[nodiscard]] std::map<std::string, std::string> reference_pages(const Program& program);

/// "--half-width <mm>" or "--force"
[[nodiscard]] std::string flag_text(const FieldRef& field);
[[nodiscard]] std::string output_flag(const Port& port);

}  // namespace osteo::inline app::cli
