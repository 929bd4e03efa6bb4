#include "osteo/assessment/evidence/procedure.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/json.h"
#include "procedures_json.h"

namespace osteo::inline assessment {
namespace {

using Keys = std::vector<std::string>;

// What an item of each kind goes by, besides name, kind, threshold and spread.
Keys keys_of(ItemKind kind) {
  switch (kind) {
    case ItemKind::exposed:
      return {"structure", "patch", "towards", "within_deg", "cover_mm"};
    case ItemKind::not_violated:
      return {"structure"};
    case ItemKind::no_hole:
      return {"structure", "patch", "towards", "within_deg"};
    case ItemKind::no_cells_left:
      return {"structure", "cells", "within_mm"};
    case ItemKind::no_overhang:
      return {"structure", "towards", "within_deg", "within_mm"};
    case ItemKind::thinned:
      return {"structure", "patch", "towards", "within_deg", "most"};
    case ItemKind::sharp_angle:
      return {"structure", "second", "within_mm"};
    case ItemKind::followed:
      return {"structure", "cover_mm"};
    case ItemKind::margin:
      return {"curve_mm", "most"};
    case ItemKind::pieces:
      return {"most"};
    case ItemKind::fixed:
      return {};
  }
  return {};
}

class Reading {
 public:
  Reading(std::string_view json, const std::string& name) : file_(json, name) { out_.file = name; }

  Procedure read() {
    const JsonValue& root = file_.root();
    file_.require_format("osteotome_procedure");
    const Keys known{"osteotome_procedure", "$schema",      "name",    "about", "usual_s", "structures", "regions",
                     "instruments",         "force_limits", "patches", "items", "steps"};
    file_.allow(root, "", known);
    out_.name = file_.text(file_.need(root, "", "name"), "name");
    if (const JsonValue* v = root.find("about")) out_.about = file_.text(*v, "about");
    if (const JsonValue* v = root.find("usual_s")) out_.usual_s = file_.number(*v, "usual_s", 1, 1e5);
    list(root, "structures", out_.structures, [&](auto& s, const std::string&, const JsonValue& v) {
      if (declared(s.name)) throw file_.wrong(v, "structure '" + s.name + "' is there twice");
    });
    const auto of_structure = [&](auto& r, const std::string& where, const JsonValue& v) {
      known_structure(r.structure, where, v);
    };
    list(root, "regions", out_.regions, of_structure);
    list(root, "instruments", out_.instruments, of_structure);
    list(root, "force_limits", out_.force_limits, of_structure);
    patches(root);
    items(root);
    steps(root);
    return std::move(out_);
  }

 private:
  bool declared(const std::string& name) const { return out_.find(name) != nullptr; }
  void known_structure(const std::string& name, const std::string& where, const JsonValue& at) const {
    if (declared(name)) return;
    Keys all;
    for (const auto& s : out_.structures) all.push_back(s.name);
    const std::string near = nearest_name(name, all);
    throw file_.wrong(at, where + ": '" + name + "' is not among the structures",
                      near.empty() ? "list it under \"structures\", with its role" : "did you mean '" + near + "'?");
  }
  // "item 3 ('sinus shown')": the name where there is one.
  static std::string called(const std::string& what, std::size_t n, const JsonValue& v) {
    std::string where = what + " " + std::to_string(n + 1);
    if (const JsonValue* const name = v.find("name"); name != nullptr && name->kind == JsonValue::Kind::text)
      where += " ('" + name->text + "')";
    return where;
  }
  template <class T>
  void list(const JsonValue& root, const std::string& key, std::vector<T>& into, const auto& check) {
    const JsonValue* const all = root.find(key);
    if (all == nullptr) return;
    const std::string what = key.substr(0, key.size() - 1);
    for (std::size_t n = 0; n < file_.list(*all, key).size(); ++n) {
      const JsonValue& v = all->items[n];
      const std::string where = called(what == "instrument" ? "instrument rule" : what, n, v);
      T t;
      file_.read(v, where, fields_of<T>(t));
      t.line = v.line;
      check(t, where, v);
      into.push_back(std::move(t));
    }
  }
  std::vector<Vec3> points(const JsonValue& list, const std::string& key) {
    std::vector<Vec3> all;
    for (const JsonValue& p : file_.list(list, key)) {
      Vec3 at;
      for (std::size_t a = 0; a < 3; ++a)
        at[a] = file_.number(file_.list(p, "a point of " + key, 3)[a], key, -1e4, 1e4);
      all.push_back(at);
    }
    return all;
  }
  void patches(const JsonValue& root) {
    const JsonValue* const all = root.find("patches");
    if (all == nullptr) return;
    for (std::size_t n = 0; n < file_.list(*all, "patches").size(); ++n) {
      const JsonValue& v = all->items[n];
      const std::string where = called("patch", n, v);
      FacePatch patch;
      const Keys extra{"points_mm"};
      file_.read(v, where, fields_of<FacePatch>(patch), extra);
      patch.line = v.line;
      known_structure(patch.structure, where, v);
      if (patch_of(patch.name) != nullptr) throw file_.wrong(v, where + ": there are two of this name");
      patch.points_mm = points(file_.need(v, where, "points_mm"), "points_mm");
      if (patch.points_mm.empty()) throw file_.wrong(v, where + ": 'points_mm' needs one point at least");
      out_.patches.push_back(std::move(patch));
    }
  }
  const FacePatch* patch_of(const std::string& name) const {
    for (const FacePatch& p : out_.patches)
      if (p.name == name) return &p;
    return nullptr;
  }
  void items(const JsonValue& root) {
    const JsonValue* const all = root.find("items");
    if (all == nullptr) return;
    std::set<std::string> names;
    for (std::size_t n = 0; n < file_.list(*all, "items").size(); ++n) {
      const JsonValue& v = all->items[n];
      const std::string where = called("item", n, v);
      ScaleItem item;
      const Keys curve{"curve_mm"};
      file_.read(v, where, fields_of<ScaleItem>(item), curve);
      item.line = v.line;
      if (!names.insert(item.name).second) throw file_.wrong(v, where + ": there are two of this name");
      const std::string kind(EnumNames<ItemKind>::values[static_cast<std::size_t>(item.kind)]);
      Keys allowed = keys_of(item.kind);
      for (const char* const k : {"name", "kind", "threshold", "spread"}) allowed.emplace_back(k);
      for (const JsonMember& m : v.members) {
        if (std::find(allowed.begin(), allowed.end(), m.key) == allowed.end())
          throw file_.wrong(m.value, where + ": '" + m.key + "' says nothing for an item of kind '" + kind + "'");
      }
      const auto needs = [&](const char* key) {
        if (std::find(allowed.begin(), allowed.end(), key) != allowed.end() && v.find(key) == nullptr)
          throw file_.wrong(v, where + ": '" + std::string(key) + "' is missing");
      };
      for (const char* const k : {"structure", "second", "cells", "curve_mm"}) needs(k);
      for (const std::string& s : {item.structure, item.second, item.cells}) {
        if (!s.empty()) known_structure(s, where, v);
      }
      if (const JsonValue* const named = v.find("patch")) {
        const FacePatch* const patch = patch_of(item.patch);
        if (patch == nullptr) {
          Keys known;
          for (const FacePatch& p : out_.patches) known.push_back(p.name);
          const std::string near = nearest_name(item.patch, known);
          throw file_.wrong(*named, where + ": '" + item.patch + "' is not among the patches",
                            near.empty() ? "list it under \"patches\"" : "did you mean '" + near + "'?");
        }
        if (patch->structure != item.structure)
          throw file_.wrong(*named, where + ": the patch '" + item.patch + "' is of '" + patch->structure + "'");
      }
      if (const JsonValue* const c = v.find("curve_mm")) {
        item.curve_mm = points(*c, "curve_mm");
        if (item.curve_mm.size() < 2) throw file_.wrong(*c, where + ": 'curve_mm' needs two points at least");
      }
      if (v.find("threshold") == nullptr) item.threshold = usual_threshold(item.kind);
      if (v.find("spread") == nullptr) item.spread = usual_spread(item.kind);
      if (v.find("most") == nullptr)
        item.most = item.kind == ItemKind::thinned ? 2.5 : item.kind == ItemKind::margin ? 3 : 1e6;
      out_.items.push_back(std::move(item));
    }
  }
  void steps(const JsonValue& root) {
    const JsonValue* const all = root.find("steps");
    if (all == nullptr) return;
    const Keys known{"name", "items"};
    for (std::size_t n = 0; n < file_.list(*all, "steps").size(); ++n) {
      const JsonValue& v = all->items[n];
      const std::string where = called("step", n, v);
      file_.allow(v, where, known);
      ProcedureStep step{file_.text(file_.need(v, where, "name"), "name"), {}};
      if (const JsonValue* const items = v.find("items")) {
        for (const JsonValue& i : file_.list(*items, "items")) {
          const std::string& item = file_.text(i, "items");
          if (std::none_of(out_.items.begin(), out_.items.end(), [&](const ScaleItem& s) { return s.name == item; }))
            throw file_.wrong(i, where + ": '" + item + "' is no item");
          step.items.push_back(item);
        }
      }
      out_.steps.push_back(std::move(step));
    }
  }

  JsonFile file_;
  Procedure out_;
};

}  // namespace

const ProcedureStructure* Procedure::find(std::string_view structure) const {
  const auto s = std::find_if(structures.begin(), structures.end(),
                              [&](const ProcedureStructure& p) { return p.name == structure; });
  return s == structures.end() ? nullptr : &*s;
}

bool Procedure::enters(std::string_view structure) const {
  const ProcedureStructure* const s = find(structure);
  return s != nullptr && s->role == ProcedureRole::enter;
}

std::vector<std::string> Procedure::opened() const {
  std::vector<std::string> names;
  for (const ProcedureStructure& s : structures)
    if (s.role == ProcedureRole::enter) names.push_back(s.name);
  return names;
}

FacePart::FacePart(const Procedure& procedure, const ScaleItem& item)
    : towards_(normalized({item.towards[0], item.towards[1], item.towards[2]})),
      all_sides_(length(towards_) == 0),
      least_(std::cos(item.within_deg * std::numbers::pi / 180)) {
  for (const FacePatch& p : procedure.patches)
    if (p.name == item.patch) patch_ = &p;
}

bool FacePart::has(Vec3 at_mm, Vec3 normal) const {
  if (!all_sides_ && dot(normalized(normal), towards_) < least_) return false;
  if (patch_ == nullptr) return true;
  const auto& line = patch_->points_mm;
  const double within = patch_->within_mm;
  for (std::size_t n = 0; n + 1 < std::max<std::size_t>(2, line.size()); ++n) {
    const Vec3 from = line[n], way = line[std::min(n + 1, line.size() - 1)] - from;
    const double all = dot(way, way), t = all > 0 ? std::clamp(dot(at_mm - from, way) / all, 0.0, 1.0) : 0;
    if (length(at_mm - from - way * t) <= within) return true;
  }
  return false;
}

std::string FacePart::nothing() const {
  return patch_ != nullptr ? "no part of the structure's face lies in the patch '" + patch_->name + "'" +
                                 (all_sides_ ? "" : " and looks that way")
                           : "no part of the structure's face looks that way";
}

Procedure parse_procedure(std::string_view json, const std::string& name) {
  Procedure p = Reading(json, name).read();
  p.hash = hash_text(json).substr(0, 16);
  return p;
}

std::vector<std::string> built_in_procedures() {
  std::vector<std::string> names;
  for (const auto& [file, text] : kProceduresJson) names.emplace_back(file.substr(0, file.rfind('.')));
  return names;
}

std::string procedure_text(const std::filesystem::path& file) {
  std::error_code unknown;
  if (std::filesystem::exists(file, unknown)) return read_text(file);
  std::string names;
  for (const auto& [name, text] : kProceduresJson) {
    const std::string known(name.substr(0, name.rfind('.')));
    if (file == known) return std::string(text);
    names += (names.empty() ? "" : ", ") + known;
  }
  throw Error(ExitCode::no_input, "there is no procedure '" + file.string() + "'", "a JSON file, or one of " + names);
}

Procedure load_procedure(const std::filesystem::path& file) {
  return parse_procedure(procedure_text(file), file.filename().string());
}

Procedure mirrored(Procedure p) {
  const std::size_t side = p.hash.find(' ');
  p.hash = side == std::string::npos ? p.hash + " mirrored" : p.hash.substr(0, side);
  for (ScaleItem& i : p.items) {
    i.towards[0] = -i.towards[0];
    for (Vec3& q : i.curve_mm) q.x = -q.x;
  }
  for (FacePatch& f : p.patches)
    for (Vec3& q : f.points_mm) q.x = -q.x;
  return p;
}

// Starting values, to be fitted on rated cases: docs/validation/evidence.md says where they are from.
double usual_threshold(ItemKind kind) {
  switch (kind) {
    case ItemKind::exposed:
      return 0.6;
    case ItemKind::no_hole:
      return 1;
    case ItemKind::no_cells_left:
      return 0.05;
    case ItemKind::no_overhang:
      return 0.95;
    case ItemKind::thinned:
      return 1.5;
    case ItemKind::sharp_angle:
      return 2;
    case ItemKind::followed:
      return 0.7;
    case ItemKind::margin:
      return 2;
    case ItemKind::pieces:
      return 2;
    case ItemKind::fixed:
      return 1;
    case ItemKind::not_violated:
      return 0;
  }
  return 0;
}

double usual_spread(ItemKind kind) {
  switch (kind) {
    case ItemKind::exposed:
    case ItemKind::followed:
      return 0.15;
    case ItemKind::no_hole:
      return 0.5;
    case ItemKind::no_cells_left:
    case ItemKind::no_overhang:
      return 0.05;
    case ItemKind::thinned:
    case ItemKind::sharp_angle:
    case ItemKind::margin:
      return 0.5;
    case ItemKind::pieces:
    case ItemKind::fixed:
      return 1;
    case ItemKind::not_violated:
      return 0.1;
  }
  return 1;
}

}  // namespace osteo::inline assessment
