// A stage as a module of 3D Slicer: its description (Slicer Execution Model) and what starts it.
// What Slicer's own parser rejects is in docs/how-to/slicer.md; names of parameters and flags are letters, digits and
// underscores there.
#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>

#include "describe.h"
#include "osteo/core/base/error.h"
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

// Where a port or field is more to Slicer than its kind says: what is chosen in the scene and not typed, or a text file
// of its own suffix. A point goes as "x,y,z", of several the flag is repeated (vtkSlicerCLIModuleLogic).
struct SlicerType {
  std::string_view stage, name, tag, attributes;
  std::string_view also = {};  // a flag that it implies, or none
};
constexpr std::string_view kPoints = " multiple=\"true\" coordinateSystem=\"lps\"";
constexpr std::string_view kPoint = " multiple=\"false\" coordinateSystem=\"lps\"";
constexpr std::string_view kPointFile = " fileExtensions=\".fcsv\" coordinateSystem=\"lps\"";
constexpr SlicerType kSlicerTypes[] = {
    {"register", "transform", "transform", " type=\"linear\" fileExtensions=\".tfm\""},
    {"tube", "points_mm", "point", kPoints},
    {"tube", "points", "pointfile", kPointFile},
    {"tube", "line", "file", " fileExtensions=\".csv\""},
    {"distance-at", "points", "pointfile", kPointFile},
    {"virtual-fixture", "curve", "pointfile", kPointFile},
    {"virtual-fixture", "path", "pointfile", kPointFile},
    {"find-structures", "labyrinth_mm", "point", kPoint},
    {"snapshot", "centre_mm", "point", kPoint},
    {"saw", "at_mm", "point", kPoint, "--no-from-centre"},  // it counts from where the scene does
    {"simulate", "tool_from_mm", "point", kPoint},
    {"simulate", "tool_to_mm", "point", kPoint},
    {"fit-damping", "at_mm", "point", kPoint},
    {"fit-damping", "motion", "file", " fileExtensions=\".csv\""},
    {"fit-damping", "fitted", "file", " fileExtensions=\".csv\""},
    {"calibrate", "course", "file", " fileExtensions=\".svg\""},
    {"fem", "inp", "file", " fileExtensions=\".inp\""},
    {"fem", "nodes", "file", " fileExtensions=\".vtu\""},
    {"bone-stiffness", "inp", "file", " fileExtensions=\".inp\""},
};
const SlicerType* slicer_type(std::string_view stage, std::string_view name) {
  const auto* const row = std::find_if(std::begin(kSlicerTypes), std::end(kSlicerTypes),
                                       [&](const SlicerType& t) { return t.stage == stage && t.name == name; });
  return row == std::end(kSlicerTypes) ? nullptr : row;
}

// A box is one thing in Slicer's scene and goes as centre and half edges, "x,y,z,a,b,c"; here it is two fields.
struct SlicerRegion {
  std::string_view stage, centre, size;
  std::string_view also, value;  // a flag that the box implies, or none
};
constexpr SlicerRegion kSlicerRegions[] = {
    {"crop", "centre_mm", "size_mm", "--region", "box"},
    {"resample", "centre_mm", "box_mm", "", ""},
};
const SlicerRegion* slicer_region(std::string_view stage) {
  const auto* const row = std::find_if(std::begin(kSlicerRegions), std::end(kSlicerRegions),
                                       [&](const SlicerRegion& r) { return r.stage == stage; });
  return row == std::end(kSlicerRegions) ? nullptr : row;
}

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

void field_xml(std::ostream& out, const FieldRef& f, const SlicerType* type = nullptr) {
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
  const std::string chosen(type != nullptr ? type->tag : tag);
  out << "    <" << chosen << (type != nullptr ? type->attributes : "") << ">\n";
  element(out, 6, "name", name);
  element(out, 6, "longflag", "--" + name);
  element(out, 6, "label", title_case(name));
  element(out, 6, "description", help);
  if (type != nullptr) {  // nothing is chosen until the user does
    out << "    </" << chosen << ">\n";
    return;
  }
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
    Tag tag = tag_of(p.kinds.front(), output);
    if (const SlicerType* const type = slicer_type(info.name, p.name);
        type != nullptr && (output || p.kinds.front() == DataKind::source))
      tag = {std::string(type->tag), std::string(type->attributes)};
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
    const SlicerRegion* const region = slicer_region(info.name);
    if (region != nullptr) {
      out << "    <region multiple=\"false\" coordinateSystem=\"lps\">\n";
      element(out, 6, "name", "box");
      element(out, 6, "longflag", "--box");
      element(out, 6, "label", "Box (optional)");
      element(out, 6, "description", "Only this box of the scan");
      out << "    </region>\n";
    }
    for (const FieldRef& f : fields) {
      if (region == nullptr || (f.doc.name != region->centre && f.doc.name != region->size))
        field_xml(out, f, slicer_type(info.name, f.doc.name));
    }
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

std::vector<std::string> from_slicer(const std::string& stage, const std::vector<std::string>& args) {
  std::vector<std::string> out;
  std::map<std::string, std::size_t> at;  // flag of points -> where its value stands in `out`
  for (std::size_t i = 0; i < args.size(); ++i) {
    const bool has_value = i + 1 < args.size();
    if (const SlicerRegion* const region = slicer_region(stage); region != nullptr && args[i] == "--box" && has_value) {
      std::array<double, 6> v{};
      std::stringstream words(args[++i]);
      std::string word;
      std::size_t n = 0;
      while (std::getline(words, word, ',')) {
        const double x = parse_number(word, "--box");
        if (n < 6) v[n] = x;
        ++n;
      }
      if (n != 6) throw Error(ExitCode::usage, "--box: '" + args[i] + "' is not x,y,z and three half edges");
      const auto triple = [](double x, double y, double z) {
        return format_number(x) + "," + format_number(y) + "," + format_number(z);
      };
      out.insert(out.end(), {"--" + std::string(region->centre), triple(v[0], v[1], v[2]),
                             "--" + std::string(region->size), triple(2 * v[3], 2 * v[4], 2 * v[5])});
      if (!region->also.empty()) out.insert(out.end(), {std::string(region->also), std::string(region->value)});
      continue;
    }
    const SlicerType* const type = args[i].starts_with("--") ? slicer_type(stage, args[i].substr(2)) : nullptr;
    if (type == nullptr || type->tag != "point" || !has_value) {
      out.push_back(args[i]);
      continue;
    }
    const auto [known, first] = at.emplace(args[i], out.size() + 1);
    if (!first && type->attributes == kPoints) {
      out[known->second] += "; " + args[++i];
      continue;
    }
    out.insert(out.end(), {args[i], args[i + 1]});
    ++i;
    if (!type->also.empty()) out.emplace_back(type->also);
  }
  return out;
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
