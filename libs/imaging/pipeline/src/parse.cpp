#include <algorithm>

#include "osteo/core/base/error.h"
#include "osteo/core/base/json.h"
#include "osteo/imaging/pipeline/engine.h"
#include "osteo/imaging/pipeline/pipeline.h"

namespace osteo::inline imaging {
namespace {

using Names = std::vector<std::string>;
using Variables = std::map<std::string, std::string>;

// A pipeline file, part by part; whatever is wrong is reported with its line.
class PipelineReader {
 public:
  explicit PipelineReader(std::string_view text) : file_(text, "pipeline") {
    file_.allow(root(), "", Names{"osteotome", "$schema", "name", "description", "variables", "stages"});
    file_.require_format("osteotome");
  }

  /// By name.
  [[nodiscard]] std::vector<PipelineVariable> variables() const {
    std::vector<PipelineVariable> result;
    for (const JsonMember& m : members(root(), "variables", "")) {
      const std::string where = "variable '" + m.key + "'";
      file_.allow(m.value, where, Names{"help", "default"});
      PipelineVariable variable{m.key, text_of(m.value, "help", where), std::nullopt};
      for (const JsonValue& s : stages()) {
        if (s.kind != JsonValue::Kind::object) continue;  // told when the stages are read
        const JsonValue* const in = s.find("in");
        for (const JsonMember& input : in != nullptr ? in->members : std::vector<JsonMember>{}) {
          const JsonValue* const file = input.value.find("file");
          variable.in_file_name |=
              file != nullptr &&
              scalar(*file, "input '" + input.key + "'").find("${" + m.key + "}") != std::string::npos;
        }
      }
      if (const JsonValue* const fallback = m.value.find("default"); fallback != nullptr)
        variable.fallback = scalar(*fallback, where);
      result.push_back(std::move(variable));
    }
    std::sort(result.begin(), result.end(), [](const auto& a, const auto& b) { return a.name < b.name; });
    return result;
  }

  [[nodiscard]] Pipeline pipeline(const Variables& values) const {
    Pipeline result;
    result.name = text_of(root(), "name", "");
    result.description = text_of(root(), "description", "");
    for (const JsonValue& s : stages()) {
      const PipelineNode node = read_node(s, "stage " + std::to_string(result.nodes.size() + 1), values);
      for (const PipelineNode& other : result.nodes) {
        if (other.id == node.id) throw file_.wrong(s, "stage '" + node.id + "': two stages have this id");
      }
      result.nodes.push_back(node);
    }
    return result;
  }

  /// By id.
  [[nodiscard]] std::map<std::string, std::size_t> lines() const {
    std::map<std::string, std::size_t> result;
    for (const JsonValue& s : stages()) {
      const std::string number = "stage " + std::to_string(result.size() + 1);
      const bool has_id = s.kind == JsonValue::Kind::object && s.find("id") != nullptr;
      result[has_id ? text_of(s, "id", number) : file_.text(file_.need(s, number, "stage"), number + ": \"stage\"")] =
          s.line;
    }
    return result;
  }

 private:
  [[nodiscard]] const JsonValue& root() const { return file_.root(); }
  [[nodiscard]] const std::vector<JsonValue>& stages() const {
    return file_.list(file_.need(root(), "", "stages"), "\"stages\"");
  }

  // Of an object that may be left out.
  [[nodiscard]] const std::vector<JsonMember>& members(const JsonValue& object, const std::string& key,
                                                       const std::string& where) const {
    static const std::vector<JsonMember> none;
    const JsonValue* const found = object.find(key);
    if (found == nullptr) return none;
    if (found->kind != JsonValue::Kind::object)
      throw file_.wrong(*found, (where.empty() ? "" : where + ": ") + "\"" + key + "\" must be an object in braces");
    return found->members;
  }
  [[nodiscard]] std::string text_of(const JsonValue& object, const std::string& key, const std::string& where) const {
    const JsonValue* const found = object.find(key);
    return found == nullptr ? std::string()
                            : file_.text(*found, (where.empty() ? "" : where + ": ") + "\"" + key + "\"");
  }

  // A parameter as a flag would have it.
  [[nodiscard]] std::string scalar(const JsonValue& value, const std::string& where) const {
    using Kind = JsonValue::Kind;
    if (value.kind == Kind::text) return value.text;
    if (value.kind == Kind::flag) return value.flag ? "true" : "false";
    if (value.kind == Kind::number) return format_number(value.number);
    if (value.kind == Kind::list && value.items.size() == 3)
      return scalar(value.items[0], where) + "," + scalar(value.items[1], where) + "," + scalar(value.items[2], where);
    throw file_.wrong(value, where + ": must be a text, a number, true, false, or three numbers");
  }

  // The same, with what "${NAME}" stands for.
  [[nodiscard]] std::string substituted(const JsonValue& value, const Variables& values,
                                        const std::string& where) const {
    std::string text = scalar(value, where);
    for (std::size_t at = text.find("${"); at != std::string::npos; at = text.find("${", at)) {
      const std::size_t end = text.find('}', at);
      if (end == std::string::npos) throw file_.wrong(value, where + ": '${' without '}'");
      const std::string name = text.substr(at + 2, end - at - 2);
      const auto it = values.find(name);
      if (it == values.end())
        throw file_.wrong(value, where + ": the variable '" + name + "' has no value",
                          "give it with --set " + name + "=VALUE");
      text.replace(at, end - at + 1, it->second);
      at += it->second.size();
    }
    return text;
  }

  [[nodiscard]] PipelineNode read_node(const JsonValue& s, const std::string& number, const Variables& values) const {
    PipelineNode node;
    file_.allow(s, number, Names{"id", "stage", "in", "params", "out"});
    node.stage = file_.text(file_.need(s, number, "stage"), number + ": \"stage\"");
    node.id = s.find("id") != nullptr ? text_of(s, "id", number) : node.stage;
    const std::string where = "stage '" + node.id + "'";
    if (node.id.find('.') != std::string::npos) throw file_.wrong(s, where + ": an id has no dots");
    for (const auto& [port, value] : members(s, "in", where))
      node.inputs[port] = read_input(value, where + " input '" + port + "'", values);
    for (const auto& [name, value] : members(s, "params", where))
      node.params[name] = substituted(value, values, where + " parameter '" + name + "'");
    for (const auto& [port, value] : members(s, "out", where))
      node.outputs[port] = substituted(value, values, where + " output '" + port + "'");
    return node;
  }

  [[nodiscard]] PipelineNode::Input read_input(const JsonValue& value, const std::string& where,
                                               const Variables& values) const {
    PipelineNode::Input input;
    if (value.kind == JsonValue::Kind::object) {
      file_.allow(value, where, Names{"file"});
      input.file = substituted(file_.need(value, where, "file"), values, where);
    } else if (value.kind == JsonValue::Kind::text) {
      const std::size_t dot = value.text.find('.');
      input.node = value.text.substr(0, dot);
      if (dot != std::string::npos) input.port = value.text.substr(dot + 1);
    } else {
      throw file_.wrong(value, where + ": must be the id of a stage, or {\"file\": \"PATH\"}");
    }
    return input;
  }

  const JsonFile file_;
};

}  // namespace

std::vector<PipelineVariable> pipeline_variables(std::string_view text) {
  return PipelineReader(text).variables();
}

Pipeline parse_pipeline(std::string_view text, const std::map<std::string, std::string>& settings) {
  const PipelineReader reader(text);
  Variables values;
  Names known;
  for (const PipelineVariable& v : reader.variables()) {
    known.push_back(v.name);
    if (v.fallback) values[v.name] = *v.fallback;
  }
  std::map<std::string, std::map<std::string, std::string>> overrides;  // id -> parameter -> text
  for (const auto& [key, value] : settings) {
    if (const std::size_t dot = key.find('.'); dot != std::string::npos) {
      overrides[key.substr(0, dot)][key.substr(dot + 1)] = value;
      continue;
    }
    if (std::find(known.begin(), known.end(), key) == known.end()) {
      const std::string near = nearest_name(key, known);
      throw Error(ExitCode::usage, "--set " + key + ": the pipeline has no variable '" + key + "'",
                  near.empty() ? "a parameter of one stage is set as --set ID.PARAMETER=VALUE"
                               : "did you mean '" + near + "'?");
    }
    values[key] = value;
  }
  Pipeline pipeline = reader.pipeline(values);
  Names ids;
  for (PipelineNode& node : pipeline.nodes) {
    ids.push_back(node.id);
    const auto it = overrides.find(node.id);
    if (it == overrides.end()) continue;
    for (const auto& [name, value] : it->second) node.params[name] = value;
    overrides.erase(it);
  }
  if (!overrides.empty()) {
    const std::string& id = overrides.begin()->first;
    const std::string near = nearest_name(id, ids);
    throw Error(ExitCode::usage, "--set " + id + ".…: the pipeline has no stage '" + id + "'",
                near.empty() ? "" : "did you mean '" + near + "'?");
  }
  return pipeline;
}

std::map<std::string, std::size_t> step_lines(std::string_view json) {
  return PipelineReader(json).lines();
}

}  // namespace osteo::inline imaging
