// A stage as a module of 3D Slicer: its description (Slicer Execution Model) and what starts it.
// What Slicer's own parser refuses is in docs/slicer.md; names of parameters and flags are letters, digits and
// underscores there.
#include <algorithm>
#include <cmath>
#include <sstream>

#include "describe.h"
#include "osteo/imaging/pipeline/formats.h"

namespace osteo::inline app::cli {
namespace {

std::string escape_xml(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (c == '&')
      out += "&amp;";
    else if (c == '<')
      out += "&lt;";
    else if (c == '>')
      out += "&gt;";
    else if (c == '"')
      out += "&quot;";
    else
      out += c;
  }
  return out;
}

std::string title_case(std::string name) {
  bool up = true;
  for (char& c : name) {
    if (up) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
    up = c == '-' || c == '_';
    if (up) c = ' ';
  }
  return name;
}

std::string underscored(std::string name) {
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
}

struct Tag {
  std::string name, attributes;
};

Tag tag_of(DataKind kind, bool output) {
  switch (kind) {
    case DataKind::image:
      return {"image", " type=\"scalar\" fileExtensions=\".nrrd\""};
    case DataKind::labels:
      return {"image", " type=\"label\" fileExtensions=\".nrrd\""};
    case DataKind::surface:
      return {"geometry", " type=\"model\" fileExtensions=\".vtp\""};
    case DataKind::source:
      if (!output) return {"directory", ""};
      [[fallthrough]];
    default: {
      // Its file names end as the first of the suffixes: ".vdb", ".png", ".json", ".vtu".
      std::istringstream suffixes(suffixes_of(kind));
      std::string first;
      suffixes >> first;
      return {"file", first.starts_with('.') ? " fileExtensions=\"" + first + "\"" : std::string()};
    }
  }
}

void element(std::ostream& out, int indent, const char* tag, std::string_view text) {
  out << std::string(static_cast<std::size_t>(indent), ' ') << '<' << tag << '>' << escape_xml(text) << "</" << tag
      << ">\n";
}

void field_xml(std::ostream& out, const FieldRef& f) {
  const std::string_view kind = f.kind();
  // Slicer names a flag only where it is wanted, so what is on by default is offered the other way round.
  const bool inverted = kind == "flag" && f.to_text() == "true";
  const char* const tag = kind == "flag"     ? "boolean"
                          : kind == "int"    ? "integer"
                          : kind == "number" ? "double"
                          : kind == "choice" ? "string-enumeration"
                          : kind == "triple" ? "double-vector"
                                             : "string";
  const std::string name = (inverted ? "no_" : "") + std::string(f.doc.name);
  std::string help(f.doc.help);
  if (inverted) help = "not: " + help;
  if (!f.doc.unit.empty()) help += " (" + std::string(f.doc.unit) + ")";
  out << "    <" << tag << ">\n";
  element(out, 6, "name", name);
  element(out, 6, "longflag", "--" + name);
  element(out, 6, "label", title_case(name));
  element(out, 6, "description", help);
  element(out, 6, "default", inverted ? "false" : f.to_text());
  if (const auto* c = std::get_if<FieldRef::Choice>(&f.target)) {
    for (const auto n : c->names) element(out, 6, "element", n);
  }
  if ((kind == "int" || kind == "number") && std::isfinite(f.doc.lo) && std::isfinite(f.doc.hi)) {
    const double range = f.doc.hi - f.doc.lo;
    const double step = kind == "int" || range > 50 ? 1 : range > 5 ? 0.1 : 0.01;
    out << "      <constraints>\n";
    element(out, 8, "minimum", format_number(f.doc.lo));
    element(out, 8, "maximum", format_number(f.doc.hi));
    element(out, 8, "step", format_number(step));
    out << "      </constraints>\n";
  }
  out << "    </" << tag << ">\n";
}

}  // namespace

std::string stage_xml(Stage& stage, const std::string& group) {
  const StageInfo& info = stage.info();
  std::ostringstream out;
  out << "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<executable>\n";
  element(out, 2, "category", group.empty() ? "Osteotome" : "Osteotome." + group);
  element(out, 2, "title", title_case(info.name));
  element(out, 2, "description", info.description);
  element(out, 2, "version", std::to_string(info.version));
  element(out, 2, "license", "Apache-2.0; not a medical device");
  out << "  <parameters>\n";
  element(out, 4, "label", "Input and output");
  element(out, 4, "description", "What is read and written");
  int index = 0;
  const auto port = [&](const Port& p, bool output) {
    const Tag tag = tag_of(p.kinds.front(), output);
    const std::string name = underscored(p.name) + (output ? "_out" : "");
    out << "    <" << tag.name << tag.attributes << ">\n";
    element(out, 6, "name", name);
    if (p.optional)
      element(out, 6, "longflag", "--" + name);
    else
      element(out, 6, "index", std::to_string(index++));
    element(out, 6, "label", title_case(p.name) + (p.optional ? " (optional)" : ""));
    element(out, 6, "description", p.help);
    element(out, 6, "channel", output ? "output" : "input");
    out << "    </" << tag.name << ">\n";
  };
  for (const Port& p : info.inputs) port(p, false);
  for (const Port& p : info.outputs) port(p, true);
  out << "  </parameters>\n";
  const auto fields = stage.fields();
  if (!fields.empty()) {
    out << "  <parameters>\n";
    element(out, 4, "label", "Parameters");
    element(out, 4, "description", "How it is done");
    for (const FieldRef& f : fields) field_xml(out, f);
    out << "  </parameters>\n";
  }
  // Slicer does not ask before it replaces its own temporary files.
  out << "  <parameters advanced=\"true\">\n";
  element(out, 4, "label", "Program");
  element(out, 4, "description", "How the program runs");
  for (const FieldRef& f : common_fields()) {
    if (f.doc.name == "threads" || f.doc.name == "seed") field_xml(out, f);
  }
  out << "  </parameters>\n</executable>\n";
  return out.str();
}

std::string slicer_module_name(const std::string& stage) {
  std::string name = title_case(stage);
  std::erase(name, ' ');
  return "Osteo" + name;
}

std::string slicer_module_script(const std::string& stage) {
  return "#!/bin/sh\n# A module of 3D Slicer. Its folder goes into Slicer's Application Settings, Modules, Additional "
         "module paths.\n"
         "exec \"$(dirname \"$(readlink -f \"$0\")\")/../../../bin/osteo\" " +
         stage + " --progress slicer --force \"$@\"\n";
}

}  // namespace osteo::inline app::cli
