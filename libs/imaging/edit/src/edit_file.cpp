#include "osteo/imaging/edit/edit_file.h"

#include <algorithm>

#include "osteo/core/base/error.h"
#include "osteo/core/base/json.h"

namespace osteo::inline imaging {
namespace {

Json value_of(const FieldRef& field) {
  struct To {
    Json operator()(const bool* p) const { return *p; }
    Json operator()(const int* p) const { return *p; }
    Json operator()(const double* p) const { return *p; }
    Json operator()(const std::string* p) const { return *p; }
    Json operator()(const std::array<double, 3>* p) const { return *p; }
    Json operator()(const std::vector<int>* p) const { return *p; }
    Json operator()(const FieldRef::Choice& c) const { return c.names[static_cast<std::size_t>(*c.index)]; }
  };
  return std::visit(To{}, field.target);
}

// One of each kind, as it is when nothing is said.
const std::vector<EditOperation>& all_kinds() {
  static const std::vector<EditOperation> kinds{
      ThresholdEdit{},    IslandEdit{},          IslandSizeEdit{},     BoxEdit{},
      FillEdit{},         SmoothEdit{},          BrushEdit{},          VoxelsEdit{},
      AddStructureEdit{}, ChangeStructureEdit{}, DeleteStructureEdit{}};
  return kinds;
}

/// A field of what a program says of the structure it found: files that were written before have none.
bool said_by_program(const EditOperation& operation, std::string_view field) {
  return std::holds_alternative<AddStructureEdit>(operation) &&
         (field == "origin" || field == "within_mm" || field == "finding");
}

EditOperation read_operation(const JsonFile& file, const JsonValue& j, const std::string& where) {
  const JsonValue& does = file.need(j, where, "do");
  const std::string& name = file.text(does, where + ": \"do\"");
  const auto kind = std::find_if(all_kinds().begin(), all_kinds().end(),
                                 [&](const EditOperation& o) { return operation_name(o) == name; });
  if (kind == all_kinds().end()) {
    std::vector<std::string> known;
    for (const EditOperation& o : all_kinds()) known.emplace_back(operation_name(o));
    const std::string near = nearest_name(name, known);
    throw file.wrong(does, where + ": '" + name + "' is nothing that can be done",
                     near.empty() ? "" : "did you mean '" + near + "'?");
  }
  EditOperation operation = *kind;
  std::vector<FieldRef> fields = operation_fields(operation);
  // Nothing is filled in: what is done again is what was written.
  for (FieldRef& f : fields) f.doc.needed = !said_by_program(operation, f.doc.name);
  auto* const brush = std::get_if<BrushEdit>(&operation);
  std::vector<std::string> besides{"do"};
  if (brush != nullptr) besides.emplace_back("points_mm");
  file.read(j, where, fields, besides);
  if (brush != nullptr) {
    for (const JsonValue& p : file.list(file.need(j, where, "points_mm"), where + ": \"points_mm\"")) {
      const auto& xyz = file.list(p, where + ": a point", 3);
      Vec3 at;
      for (std::size_t a = 0; a < 3; ++a) at[a] = file.number(xyz[a], where + ": a point", -1e6, 1e6);
      brush->points_mm.push_back(at);
    }
  }
  try {
    require_valid(operation);
  } catch (const Error& e) {
    throw file.wrong(j, where + ": " + e.what(), e.advice());
  }
  return operation;
}

}  // namespace

EditRecipe recipe_of(const EditDocument& document) {
  EditRecipe r{document.ct_hash(), document.start_hash(), document.hash(), document.operations(), {}};
  for (const EditStructure& s : document.structures()) {
    if (!s.shown) r.hidden.push_back(s.is.value);
  }
  return r;
}

Json edits_json(const EditRecipe& recipe) {
  Json operations = Json::list();
  for (EditOperation o : recipe.operations) {
    Json j{{"do", operation_name(o)}};
    const auto* const add = std::get_if<AddStructureEdit>(&o);
    const bool says = add != nullptr && !(add->origin.empty() && add->doubt.empty() && add->within_mm == 0);
    for (const FieldRef& f : operation_fields(o))
      if (says || !said_by_program(o, f.doc.name)) j[f.doc.name] = value_of(f);
    if (const auto* const brush = std::get_if<BrushEdit>(&o)) {
      Json points = Json::list();
      for (const Vec3 p : brush->points_mm) points.push_back({p.x, p.y, p.z});
      j["points_mm"] = std::move(points);
    }
    operations.push_back(std::move(j));
  }
  return {{"osteotome_edits", 1},
          {"ct_hash", recipe.ct_hash},
          {"start_hash", recipe.start_hash},
          {"result_hash", recipe.result_hash},
          {"operations", std::move(operations)},
          {"hidden", recipe.hidden}};
}

std::string edits_text(const EditRecipe& recipe) {
  const Json all = edits_json(recipe);
  std::string text = "{\n";
  bool first = true;
  for (const Json::Member& m : all.members()) {
    text += (first ? "  \"" : ",\n  \"") + m.key + "\": ";
    first = false;
    if (m.key != "operations") {
      text += m.value.dump();
      continue;
    }
    text += "[";
    for (std::size_t i = 0; i < m.value.items().size(); ++i)
      text += (i > 0 ? ",\n    " : "\n    ") + m.value.items()[i].dump();
    text += m.value.items().empty() ? "]" : "\n  ]";
  }
  return text + "\n}\n";
}

EditRecipe parse_edits(std::string_view text, const std::string& name) {
  const JsonFile file(text, name);
  file.require_format("osteotome_edits");
  file.allow(
      file.root(), "",
      std::vector<std::string>{"osteotome_edits", "ct_hash", "start_hash", "result_hash", "operations", "hidden"});
  const auto hash = [&](const char* key) {
    return file.text(file.need(file.root(), "", key), std::string("\"") + key + "\"");
  };
  EditRecipe r{hash("ct_hash"), hash("start_hash"), hash("result_hash"), {}, {}};
  const auto& operations = file.list(file.need(file.root(), "", "operations"), "\"operations\"");
  for (std::size_t i = 0; i < operations.size(); ++i)
    r.operations.push_back(read_operation(file, operations[i], "operation " + std::to_string(i + 1)));
  for (const JsonValue& v : file.list(file.need(file.root(), "", "hidden"), "\"hidden\"")) {
    const double value = file.number(v, "\"hidden\"", 1, 255);
    r.hidden.push_back(static_cast<int>(value));
  }
  return r;
}

void apply_edits(EditDocument& document, const EditRecipe& recipe, const Context& context) {
  if (recipe.ct_hash != document.ct_hash()) {
    throw Error(ExitCode::usage, "the edits were made on another CT, or on another region of it, than this one",
                "take the scan, series, region and offset they were made with, or edit this one again");
  }
  const bool same_start = document.start_hash() == recipe.start_hash;
  std::size_t vain = 0;
  for (std::size_t i = 0; i < recipe.operations.size(); ++i) {
    const auto n = static_cast<double>(recipe.operations.size());
    context.progress(static_cast<double>(i) / n, "edits");
    try {
      const EditOutcome done =
          document.apply(recipe.operations[i], context.sub(static_cast<double>(i) / n, static_cast<double>(i + 1) / n));
      vain += done.changed ? 0 : 1;
    } catch (const Error& e) {
      throw e.in("operation " + std::to_string(i + 1));
    }
  }
  for (const int value : recipe.hidden) document.show(value, false);
  if (same_start) {
    if (document.hash() != recipe.result_hash)
      throw Error(ExitCode::corrupt, "the edits do not give what they gave when they were saved",
                  "the file was changed: edit the case again");
    return;
  }
  context.warn("the edits began from another mask or other structures, so their result is another one: look at it" +
               (vain > 0 ? "; " + std::to_string(vain) + " of " + std::to_string(recipe.operations.size()) +
                               " steps change nothing"
                         : std::string()));
}

std::optional<double> threshold_of(const EditRecipe& recipe) {
  for (auto o = recipe.operations.rbegin(); o != recipe.operations.rend(); ++o) {
    if (const auto* const t = std::get_if<ThresholdEdit>(&*o)) return t->lower_hu;
  }
  return std::nullopt;
}

}  // namespace osteo::inline imaging
