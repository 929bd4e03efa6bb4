#include <nlohmann/json.hpp>

#include "osteo/base/error.h"
#include "osteo/pipeline/pipeline.h"

namespace osteo {
namespace {

using nlohmann::json;

[[noreturn]] void fail(const std::string& where, const std::string& what, const std::string& advice = {}) {
  throw Error(ExitCode::usage, "pipeline" + (where.empty() ? "" : " " + where) + ": " + what, advice);
}

json parse_json(std::string_view text) {
  try {
    return json::parse(text, nullptr, true, true);
  } catch (const json::parse_error& e) {
    std::size_t line = 1;
    for (std::size_t i = 0; i + 1 < e.byte && i < text.size(); ++i) line += text[i] == '\n' ? 1 : 0;
    fail("line " + std::to_string(line), "this is not valid JSON", e.what());
  }
}

void allow_keys(const json& object, const std::string& where, const std::vector<std::string>& known) {
  if (!object.is_object()) fail(where, "must be an object in braces");
  for (const auto& [key, value] : object.items()) {
    if (std::find(known.begin(), known.end(), key) != known.end()) continue;
    const std::string near = nearest_name(key, known);
    fail(where, "the key '" + key + "' is not known", near.empty() ? "" : "did you mean '" + near + "'?");
  }
}

std::string scalar_text(const json& value, const std::string& where) {
  if (value.is_string()) return value.get<std::string>();
  if (value.is_boolean()) return value.get<bool>() ? "true" : "false";
  if (value.is_number()) return format_number(value.get<double>());
  if (value.is_array() && value.size() == 3) {
    return scalar_text(value[0], where) + "," + scalar_text(value[1], where) + "," + scalar_text(value[2], where);
  }
  fail(where, "must be a text, a number, true, false, or three numbers");
}

std::string substitute(std::string text, const std::map<std::string, std::string>& variables, const std::string& where) {
  for (std::size_t at = text.find("${"); at != std::string::npos; at = text.find("${", at)) {
    const std::size_t end = text.find('}', at);
    if (end == std::string::npos) fail(where, "'${' without '}'");
    const std::string name = text.substr(at + 2, end - at - 2);
    const auto it = variables.find(name);
    if (it == variables.end()) fail(where, "the variable '" + name + "' has no value", "give it with --set " + name + "=VALUE");
    text.replace(at, end - at + 1, it->second);
    at += it->second.size();
  }
  return text;
}

// A value of the wrong JSON type somewhere deep becomes an Error like any other.
template <class F>
auto with_json_errors(F&& read) {
  try {
    return read();
  } catch (const json::exception& e) {
    fail("", "a value has the wrong type", e.what());
  }
}

std::vector<PipelineVariable> read_variables(std::string_view text) {
  std::vector<PipelineVariable> result;
  const json root = parse_json(text);
  if (!root.contains("variables")) return result;
  for (const auto& [name, v] : root["variables"].items()) {
    allow_keys(v, "variable '" + name + "'", {"help", "default"});
    PipelineVariable variable{name, v.value("help", ""), std::nullopt};
    for (const json& s : root.value("stages", json::array())) {
      const json inputs = s.is_object() ? s.value("in", json::object()) : json::object();
      for (const auto& [port, input] : inputs.items()) {
        variable.in_file_name |= input.is_object() && input.value("file", json()).dump().find("${" + name + "}") != std::string::npos;
      }
    }
    if (v.contains("default")) variable.fallback = scalar_text(v["default"], "variable '" + name + "'");
    result.push_back(std::move(variable));
  }
  return result;
}

Pipeline read_pipeline(std::string_view text, const std::map<std::string, std::string>& settings) {
  const json root = parse_json(text);
  allow_keys(root, "", {"osteotome", "name", "description", "variables", "stages"});
  if (!root.contains("osteotome") || root["osteotome"] != 1)
    fail("", "the key \"osteotome\": 1 is missing", "it says which format the file has");
  if (!root.contains("stages") || !root["stages"].is_array()) fail("", "the list \"stages\" is missing");

  std::map<std::string, std::string> variables;
  std::vector<std::string> known;
  for (const auto& v : read_variables(text)) {
    known.push_back(v.name);
    if (v.fallback) variables[v.name] = *v.fallback;
  }
  std::map<std::string, std::map<std::string, std::string>> overrides;
  for (const auto& [key, value] : settings) {
    if (const std::size_t dot = key.find('.'); dot != std::string::npos) {
      overrides[key.substr(0, dot)][key.substr(dot + 1)] = value;
      continue;
    }
    if (std::find(known.begin(), known.end(), key) == known.end()) {
      const std::string near = nearest_name(key, known);
      throw Error(ExitCode::usage, "--set " + key + ": the pipeline has no variable '" + key + "'",
                  near.empty() ? "a parameter of one stage is set as --set ID.PARAMETER=VALUE" : "did you mean '" + near + "'?");
    }
    variables[key] = value;
  }

  Pipeline pipeline;
  pipeline.name = root.value("name", "");
  pipeline.description = root.value("description", "");
  std::vector<std::string> ids;
  for (const json& s : root["stages"]) {
    PipelineNode node;
    const std::string number = "stage " + std::to_string(pipeline.nodes.size() + 1);
    allow_keys(s, number, {"id", "stage", "in", "params", "out"});
    if (!s.contains("stage") || !s["stage"].is_string()) fail(number, "the key \"stage\" is missing");
    node.stage = s["stage"];
    node.id = s.value("id", node.stage);
    const std::string where = "stage '" + node.id + "'";
    if (node.id.find('.') != std::string::npos) fail(where, "an id has no dots");
    if (std::find(ids.begin(), ids.end(), node.id) != ids.end()) fail(where, "two stages have this id");
    ids.push_back(node.id);
    // Named: the items of a temporary would outlive it.
    const json inputs = s.value("in", json::object()), params = s.value("params", json::object()), outputs = s.value("out", json::object());
    for (const auto& [port, value] : inputs.items()) {
      PipelineNode::Input input;
      if (value.is_object()) {
        allow_keys(value, where + " input '" + port + "'", {"file"});
        input.file = substitute(scalar_text(value.value("file", json()), where), variables, where);
      } else if (value.is_string()) {
        const std::string ref = value;
        const std::size_t dot = ref.find('.');
        input.node = ref.substr(0, dot);
        if (dot != std::string::npos) input.port = ref.substr(dot + 1);
      } else {
        fail(where + " input '" + port + "'", "must be the id of a stage, or {\"file\": \"PATH\"}");
      }
      node.inputs[port] = input;
    }
    for (const auto& [name, value] : params.items()) {
      node.params[name] = substitute(scalar_text(value, where + " parameter '" + name + "'"), variables, where);
    }
    for (const auto& [port, value] : outputs.items()) {
      node.outputs[port] = substitute(scalar_text(value, where + " output '" + port + "'"), variables, where);
    }
    if (const auto it = overrides.find(node.id); it != overrides.end()) {
      for (const auto& [name, value] : it->second) node.params[name] = value;
      overrides.erase(it);
    }
    pipeline.nodes.push_back(std::move(node));
  }
  if (!overrides.empty()) {
    const std::string near = nearest_name(overrides.begin()->first, ids);
    throw Error(ExitCode::usage, "--set " + overrides.begin()->first + ".…: the pipeline has no stage '" + overrides.begin()->first + "'",
                near.empty() ? "" : "did you mean '" + near + "'?");
  }
  return pipeline;
}

}  // namespace

std::vector<PipelineVariable> pipeline_variables(std::string_view text) {
  return with_json_errors([&] { return read_variables(text); });
}

Pipeline parse_pipeline(std::string_view text, const std::map<std::string, std::string>& settings) {
  return with_json_errors([&] { return read_pipeline(text, settings); });
}

}  // namespace osteo
