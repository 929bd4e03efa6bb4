#include "describe.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "osteo/core/base/error.h"
#include "osteo/core/base/json.h"
#include "osteo/core/base/json_document.h"
#include "osteo/imaging/pipeline/formats.h"

namespace osteo::inline app::cli {
namespace {

std::string range_text(const FieldRef& f) {
  const FieldDoc& d = f.doc;
  std::string unit = d.unit.empty() ? "" : " " + std::string(d.unit);
  if (std::isfinite(d.lo) && std::isfinite(d.hi)) return format_number(d.lo) + " to " + format_number(d.hi) + unit;
  if (std::isfinite(d.lo)) return "at least " + format_number(d.lo) + unit;
  if (std::isfinite(d.hi)) return "at most " + format_number(d.hi) + unit;
  return {};
}

std::string choices_text(const FieldRef& f) {
  std::string text;
  if (const auto* c = std::get_if<FieldRef::Choice>(&f.target)) {
    for (const auto name : c->names) text.append(text.empty() ? "" : ", ").append(name);
  }
  return text;
}

void wrap(std::ostream& out, const std::string& text, int indent, int width = 100) {
  std::istringstream words(text);
  std::string word;
  int column = indent;
  bool first = true;
  while (words >> word) {
    if (!first && column + 1 + static_cast<int>(word.size()) > width) {
      out << '\n' << std::string(static_cast<std::size_t>(indent), ' ');
      column = indent;
      first = true;
    }
    if (!first) {
      out << ' ';
      ++column;
    }
    out << word;
    column += static_cast<int>(word.size());
    first = false;
  }
  out << '\n';
}

void row(std::ostream& out, const std::string& left, const std::string& right) {
  constexpr int kColumn = 30;
  out << "  " << left;
  if (static_cast<int>(left.size()) + 2 >= kColumn - 1) {
    out << '\n' << std::string(kColumn, ' ');
  } else {
    out << std::string(static_cast<std::size_t>(kColumn - 2 - static_cast<int>(left.size())), ' ');
  }
  wrap(out, right, kColumn);
}

void field_rows(std::ostream& out, const std::vector<FieldRef>& fields) {
  for (const FieldRef& f : fields) {
    std::string text(f.doc.help);
    std::string facts;
    if (const std::string c = choices_text(f); !c.empty()) facts += c;
    if (const std::string r = range_text(f); !r.empty()) facts += r;
    const std::string value = f.to_text();
    if (f.kind() == "flag") {
      facts = value == "true" ? "default: on" : "default: off";
    } else if (!value.empty()) {
      facts += (facts.empty() ? "" : "; ") + std::string("default ") + value;
    }
    if (!facts.empty()) text += " [" + facts + "]";
    // What is on by itself can only be turned off.
    row(out, f.kind() == "flag" && value == "true" ? "--no-" + f.flag().substr(2) : flag_text(f), text);
  }
}

// A command's flags under their titles. Names of fields that it has not are an error of ours.
std::vector<std::pair<std::string, std::vector<FieldRef>>> flags_in_groups(Command& command) {
  std::vector<FieldRef> left = command.fields();
  std::vector<std::pair<std::string, std::vector<FieldRef>>> groups;
  for (const FlagGroup& g : command.info().flag_groups) {
    groups.emplace_back(g.title, std::vector<FieldRef>{});
    for (const std::string& name : g.fields) {
      const auto at = std::find_if(left.begin(), left.end(), [&](const FieldRef& f) { return f.doc.name == name; });
      if (at == left.end())
        throw Error(ExitCode::failed, command.info().name + " has no field '" + name + "' for '" + g.title + "'");
      groups.back().second.push_back(*at);
      left.erase(at);
    }
  }
  if (!left.empty()) groups.emplace_back(groups.empty() ? "Flags" : "Other flags", std::move(left));
  return groups;
}

std::string usage_line(const StageInfo& info) {
  std::string text = "osteo " + info.name;
  for (const Port& p : info.inputs) {
    if (!p.optional) text += " <" + p.name + ">";
  }
  for (const Port& p : info.outputs) {
    if (!p.optional) text += " <" + p.name + ".out>";
  }
  return text + " [flags]";
}

std::string usage_line(const CommandInfo& info) {
  std::string text = "osteo " + info.name;
  for (const auto& p : info.positionals) text += p.optional ? " [" + p.name + "]" : " <" + p.name + ">";
  return text + " [flags]";
}

std::string port_text(const Port& port, bool output) {
  std::string text = port.help + " (" + kinds_text(port.kinds);
  if (output) text += ": " + suffixes_of(port.kinds.front());
  if (!port.beside.empty()) text += "; left out, the first output's name with " + port.beside;
  return text + ")";
}

std::string markdown_fields(const std::vector<FieldRef>& fields) {
  if (fields.empty()) return "It has no parameters.\n";
  std::string text = "| flag | key | default | range or choices | meaning |\n|---|---|---|---|---|\n";
  for (const FieldRef& f : fields) {
    std::string range = choices_text(f);
    if (range.empty()) range = range_text(f);
    const std::string off = f.kind() == "flag" && f.to_text() == "true" ? " / `--no-" + f.flag().substr(2) + "`" : "";
    text += "| `" + f.flag() + "`" + off + " | `" + std::string(f.doc.name) + "` | " +
            (f.to_text().empty() ? "" : "`" + f.to_text() + "`") + " | " + range + " | " + std::string(f.doc.help) +
            " |\n";
  }
  return text;
}

Json schema_of(const FieldRef& f) {
  return field_schema(f);
}

// A parameter may also be a variable of the pipeline: "${spacing_mm}".
Json or_variable(const Json& schema) {
  return {{"anyOf", {schema, {{"type", "string"}, {"pattern", "\\$\\{[A-Za-z0-9_]+\\}"}}}}};
}

}  // namespace

std::vector<FieldRef> common_fields() {
  static Common::Params params;
  params = {};
  return fields_of<Common>(params);
}

std::string flag_text(const FieldRef& field) {
  const std::string_view kind = field.kind();
  if (kind == "flag") return field.flag();
  std::string what(field.doc.unit);
  if (what.empty()) what = kind == "choice" ? "choice" : kind == "text" ? "text" : kind == "triple" ? "x,y,z" : "n";
  return field.flag() + " <" + what + ">";
}

std::string output_flag(const Port& port) {
  return "--" + port.name + "-out";
}

std::string group_of(const Program& program, const std::string& name) {
  for (const Group& g : program.groups) {
    if (std::find(g.members.begin(), g.members.end(), name) != g.members.end()) return g.title;
  }
  return {};
}

std::string program_help(const Program& program, bool all) {
  std::ostringstream out;
  out << program.about << '\n';
  const std::vector<Group> groups = program.grouped();
  if (!all && !program.tasks.empty()) {
    for (const Task& task : program.tasks) out << '\n' << task.what << ":\n  " << task.command << '\n';
    out << "\nosteo help NAME   a command in full\nosteo help --all  all commands: ";
    std::string titles;
    for (const Group& g : groups) titles += (titles.empty() ? "" : ", ") + g.title;
    wrap(out, titles, 18);
    return out.str();
  }
  for (const Group& g : groups) {
    out << '\n' << g.title << ":\n";
    for (const std::string& name : g.members) row(out, name, program.synopsis_of(name));
  }
  row(out, "help", "this text, or the help of a command");
  out << "\n'osteo help NAME' shows a command in full.\n";
  return out.str();
}

std::string stage_help(Stage& stage) {
  const StageInfo& info = stage.info();
  std::ostringstream out;
  out << info.name << ": " << info.synopsis << "\n\nUsage: " << usage_line(info) << "\n\n";
  wrap(out, info.description, 0);
  if (!info.inputs.empty()) {
    out << "\nInputs:\n";
    for (const Port& p : info.inputs)
      row(out, p.optional ? "--" + p.name + " <file>" : "<" + p.name + ">", port_text(p, false));
  }
  out << "\nOutputs:\n";
  for (const Port& p : info.outputs)
    row(out, p.optional ? output_flag(p) + " <file>" : "<" + p.name + ".out>", port_text(p, true));
  const auto fields = stage.fields();
  if (!fields.empty()) {
    out << "\nParameters:\n";
    field_rows(out, fields);
  }
  out << "\nCommon flags:\n";
  field_rows(out, common_fields());
  row(out, "--xml", "the interface as a Slicer Execution Model description");
  row(out, "--describe", "the interface as JSON");
  if (!info.references.empty()) {
    out << "\nReferences:\n";
    for (const auto& r : info.references) {
      out << "  ";
      wrap(out, r, 4);
    }
  }
  out << "\nExample:\n  " << info.example << '\n';
  return out.str();
}

std::string command_help(Command& command) {
  const CommandInfo& info = command.info();
  std::ostringstream out;
  out << info.name << ": " << info.synopsis << "\n\nUsage: " << usage_line(info) << "\n\n";
  wrap(out, info.description, 0);
  if (!info.positionals.empty()) {
    out << "\nArguments:\n";
    for (const auto& p : info.positionals) row(out, p.optional ? "[" + p.name + "]" : "<" + p.name + ">", p.help);
  }
  for (const auto& [title, fields] : flags_in_groups(command)) {
    out << '\n' << title << ":\n";
    field_rows(out, fields);
  }
  out << "\nCommon flags:\n";
  field_rows(out, common_fields());
  if (!info.example.empty()) out << "\nExample:\n  " << info.example << '\n';
  return out.str();
}

std::string stage_json(Stage& stage) {
  const StageInfo& info = stage.info();
  Json j;
  j["name"] = info.name;
  j["version"] = info.version;
  j["synopsis"] = info.synopsis;
  const auto ports = [](const std::vector<Port>& list) {
    auto a = Json::list();
    for (const Port& p : list) {
      Json o{{"name", p.name}, {"optional", p.optional}, {"help", p.help}};
      for (const DataKind k : p.kinds) o["kinds"].push_back(kind_name(k));
      a.push_back(o);
    }
    return a;
  };
  j["inputs"] = ports(info.inputs);
  j["outputs"] = ports(info.outputs);
  j["params"] = Json::object();
  for (const FieldRef& f : stage.fields()) j["params"][std::string(f.doc.name)] = schema_of(f);
  return j.dump(2) + "\n";
}

std::string pipeline_schema(const Program& program) {
  Json root;
  root["$schema"] = "https://json-schema.org/draft/2020-12/schema";
  root["title"] = "Osteotome pipeline";
  root["type"] = "object";
  root["additionalProperties"] = false;
  root["required"] = {"osteotome", "stages"};
  auto& p = root["properties"];
  p["osteotome"] = {{"const", 1}, {"description", "version of this format"}};
  p["name"] = {{"type", "string"}};
  p["description"] = {{"type", "string"}};
  p["variables"] = {{"type", "object"},
                    {"additionalProperties",
                     {{"type", "object"},
                      {"additionalProperties", false},
                      {"properties", {{"help", {{"type", "string"}}}, {"default", Json::object()}}}}}};
  auto any = Json::list();
  for (const auto& name : program.registry.names()) {
    const auto stage = program.registry.make(name);
    Json s;
    s["type"] = "object";
    s["title"] = stage->info().synopsis;
    s["additionalProperties"] = false;
    s["required"] = {"stage"};
    auto& sp = s["properties"];
    sp["id"] = {{"type", "string"}, {"pattern", "^[^.]+$"}};
    sp["stage"] = {{"const", name}};
    Json in{{"type", "object"}, {"additionalProperties", false}, {"properties", Json::object()}};
    for (const Port& port : stage->info().inputs) {
      in["properties"][port.name] = {
          {"description", port.help + " (" + kinds_text(port.kinds) + ")"},
          {"anyOf",
           {{{"type", "string"}},
            {{"type", "object"}, {"required", {"file"}}, {"properties", {{"file", {{"type", "string"}}}}}}}}};
      if (!port.optional) in["required"].push_back(port.name);
    }
    sp["in"] = in;
    Json params{{"type", "object"}, {"additionalProperties", false}, {"properties", Json::object()}};
    for (const FieldRef& f : stage->fields()) params["properties"][std::string(f.doc.name)] = or_variable(schema_of(f));
    sp["params"] = params;
    Json outputs{{"type", "object"}, {"additionalProperties", false}, {"properties", Json::object()}};
    for (const Port& port : stage->info().outputs)
      outputs["properties"][port.name] = {{"type", "string"}, {"description", port.help}};
    sp["out"] = outputs;
    any.push_back(s);
  }
  p["stages"] = {{"type", "array"}, {"items", {{"oneOf", any}}}};
  return root.dump(2) + "\n";
}

std::map<std::string, std::string> reference_pages(const Program& program) {
  std::map<std::string, std::string> pages;
  const std::string note = "<!-- Made by `osteo docs`; a test fails when it is stale. -->\n\n";
  std::string index = note +
                      "# Reference\n\nCommands by who uses them. A command that is also a node of pipeline files "
                      "and a VTK filter is called a stage.\n";
  for (const Group& g : program.grouped()) {
    index += "\n## " + g.title + "\n\n| command | what it does |\n|---|---|\n";
    for (const std::string& name : g.members) {
      const bool stage = program.registry.has(name);
      index += "| [" + name + "](" + (stage ? "stage-" : "command-") + name + ".md)" + (stage ? ", stage" : "") +
               " | " + program.synopsis_of(name) + " |\n";
    }
  }
  for (const auto& name : program.registry.names()) {
    const auto stage = program.registry.make(name);
    const StageInfo& info = stage->info();
    std::string page = note + "# " + info.name + "\n\n" + info.synopsis + "\n\n```\n" + usage_line(info) + "\n```\n\n" +
                       info.description + "\n\n## Inputs\n\n";
    if (info.inputs.empty()) page += "None.\n";
    for (const Port& p : info.inputs)
      page += "- `" + p.name + "`: " + port_text(p, false) + (p.optional ? "; optional, `--" + p.name + " FILE`" : "") +
              "\n";
    page += "\n## Outputs\n\n";
    for (const Port& p : info.outputs)
      page += "- `" + p.name + "`: " + port_text(p, true) +
              (p.optional ? "; optional, `" + output_flag(p) + " FILE`" : "") + "\n";
    page += "\n## Parameters\n\n" + markdown_fields(stage->fields());
    if (!info.references.empty()) {
      page += "\n## References\n\n";
      for (const auto& r : info.references) page += "- " + r + "\n";
    }
    page += "\n## Example\n\n```\n" + info.example + "\n```\n\nStage version " + std::to_string(info.version) + ".\n";
    pages["stage-" + name + ".md"] = page;
  }
  for (const auto& c : program.commands) {
    const CommandInfo& info = c->info();
    std::string page = note + "# " + info.name + "\n\n" + info.synopsis + "\n\n```\n" + usage_line(info) + "\n```\n\n" +
                       info.description + "\n\n";
    if (!info.positionals.empty()) {
      page += "## Arguments\n\n";
      for (const auto& p : info.positionals)
        page += "- `" + p.name + "`: " + p.help + (p.optional ? " (optional)" : "") + "\n";
      page += "\n";
    }
    const auto flags = flags_in_groups(*c);
    if (flags.empty()) page += "## Flags\n\nIt has no flags of its own.\n";
    for (const auto& [title, fields] : flags)
      page += (title == flags.front().first ? "## " : "\n## ") + title + "\n\n" + markdown_fields(fields);
    if (!info.example.empty()) page += "\n## Example\n\n```\n" + info.example + "\n```\n";
    pages["command-" + info.name + ".md"] = page;
  }
  index += "\n## Flags of every stage and command\n\n" + markdown_fields(common_fields());
  index +=
      "\n[Exit codes](exit-codes.md), [schema of pipeline files](pipeline.schema.json), [of scripts of "
      "strokes](script.schema.json), "
      "[actions of sessions](actions.md), [DICOM conformance statement](conformance.md), [bash "
      "completion](osteo.bash).\n";
  pages["README.md"] = index;
  std::string codes = note + "# Exit codes\n\n| code | name | meaning |\n|---|---|---|\n";
  for (const auto& d : exit_code_table)
    codes += "| " + std::to_string(static_cast<int>(d.code)) + " | " + std::string(d.name) + " | " +
             std::string(d.meaning) + " |\n";
  pages["exit-codes.md"] = codes;
  pages["pipeline.schema.json"] = pipeline_schema(program);
  pages["osteo.bash"] = bash_completion(program);
  return pages;
}

}  // namespace osteo::inline app::cli
