#include "osteo/session/planning/detail/plan.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "osteo/core/base/error.h"
#include "osteo/core/base/json.h"
#include "osteo/core/base/json_document.h"
#include "osteo/core/base/param.h"
#include "osteo/core/data/json_vec.h"

namespace osteo::inline session {
namespace {

constexpr double kUnitTolerance = 1e-9, kMaxMm = 10000, kMaxKerfMm = 10;
const std::vector<std::string> kRootKeys{"osteotome_surgical_plan", "unit", "planes", "fragments", "screws"};
const std::vector<std::string> kPlaneKeys{"name", "bone", "at_mm", "normal", "kerf_mm", "waste_ahead"};
const std::vector<std::string> kFragmentKeys{"name", "bone", "planes", "rotation_rows", "shift_mm"};
const std::vector<std::string> kScrewKeys{"name", "fragment", "entry_mm", "tip_mm", "diameter_mm", "empty"};
constexpr double kShortestScrewMm = 1, kLongestScrewMm = 200, kThinnestScrewMm = 0.3, kThickestScrewMm = 12;

class PlanReader {
 public:
  PlanReader(std::string_view text, const std::string& name) : file_(text, name) {}

  SurgicalPlan read() const {
    const JsonValue& root = file_.root();
    file_.allow(root, "", kRootKeys);
    file_.require_format("osteotome_surgical_plan");
    const JsonValue& unit = file_.need(root, "", "unit");
    if (file_.text(unit, "\"unit\"") != "mm") throw file_.wrong(unit, "\"unit\" is not \"mm\"", "plans are in mm");
    SurgicalPlan plan;
    for (const JsonValue& v : file_.list(file_.need(root, "", "planes"), "\"planes\"")) {
      const std::string where = "plane " + std::to_string(plan.planes.size() + 1);
      file_.allow(v, where, kPlaneKeys);
      CutPlane p;
      p.name = name_of(v, where, "name");
      require_new(v, where, p.name, plan.planes);
      p.bone = name_of(v, where, "bone");
      p.at_mm = triple(file_.need(v, where, "at_mm"), where + " \"at_mm\"", kMaxMm);
      const JsonValue& normal = file_.need(v, where, "normal");
      p.normal = triple(normal, where + " \"normal\"", 2);
      if (std::abs(length(p.normal) - 1) > kUnitTolerance)
        throw file_.wrong(normal, where + ": \"normal\" is not of length 1", "divide it by its length");
      p.kerf_mm = file_.number(file_.need(v, where, "kerf_mm"), where + " \"kerf_mm\"", 0, kMaxKerfMm);
      const JsonValue& ahead = file_.need(v, where, "waste_ahead");
      if (ahead.kind != JsonValue::Kind::flag)
        throw file_.wrong(ahead, where + ": \"waste_ahead\" is neither true nor false");
      p.waste_ahead = ahead.flag;
      plan.planes.push_back(std::move(p));
    }
    for (const JsonValue& v : file_.list(file_.need(root, "", "fragments"), "\"fragments\""))
      plan.fragments.push_back(fragment(v, plan));
    if (const JsonValue* screws = root.find("screws"))
      for (const JsonValue& v : file_.list(*screws, "\"screws\"")) plan.screws.push_back(screw(v, plan));
    return plan;
  }

 private:
  PlannedFragment fragment(const JsonValue& v, const SurgicalPlan& plan) const {
    const std::string where = "fragment " + std::to_string(plan.fragments.size() + 1);
    file_.allow(v, where, kFragmentKeys);
    PlannedFragment f;
    f.name = name_of(v, where, "name");
    require_new(v, where, f.name, plan.fragments);
    f.bone = name_of(v, where, "bone");
    for (const JsonValue& n : file_.list(file_.need(v, where, "planes"), where + " \"planes\"")) {
      const std::string& wanted = file_.text(n, where + " \"planes\"");
      const auto p =
          std::find_if(plan.planes.begin(), plan.planes.end(), [&](const auto& q) { return q.name == wanted; });
      if (p == plan.planes.end()) throw file_.wrong(n, where + ": no plane is called \"" + wanted + "\"");
      if (p->bone != f.bone)
        throw file_.wrong(n, where + ": plane \"" + wanted + "\" cuts the " + p->bone + ", not the " + f.bone);
      f.planes.push_back(wanted);
    }
    const JsonValue& rows_at = file_.need(v, where, "rotation_rows");
    const auto& rows = file_.list(rows_at, where + " \"rotation_rows\"", 3);
    Mat3 columns;
    for (std::size_t r = 0; r < 3; ++r) columns.column[r] = triple(rows[r], where + " \"rotation_rows\"", 2);
    f.planned_from_ct.rotation = transposed(columns);
    for (std::size_t a = 0; a < 3; ++a) {
      for (std::size_t b = 0; b <= a; ++b) {
        if (std::abs(dot(columns.column[a], columns.column[b]) - (a == b ? 1 : 0)) > kUnitTolerance)
          throw file_.wrong(rows_at, where + ": \"rotation_rows\" is not a rotation");
      }
    }
    if (determinant(columns) < 0)
      throw file_.wrong(rows_at, where + ": \"rotation_rows\" mirrors", "a fragment can be turned, not mirrored");
    f.planned_from_ct.shift_mm = triple(file_.need(v, where, "shift_mm"), where + " \"shift_mm\"", kMaxMm);
    return f;
  }

  PlannedScrew screw(const JsonValue& v, const SurgicalPlan& plan) const {
    const std::string where = "screw " + std::to_string(plan.screws.size() + 1);
    file_.allow(v, where, kScrewKeys);
    PlannedScrew s;
    s.name = name_of(v, where, "name");
    require_new(v, where, s.name, plan.screws);
    s.fragment = name_of(v, where, "fragment");
    if (std::none_of(plan.fragments.begin(), plan.fragments.end(), [&](const auto& f) { return f.name == s.fragment; }))
      throw file_.wrong(v, where + ": no fragment is called \"" + s.fragment + "\"");
    s.entry_mm = triple(file_.need(v, where, "entry_mm"), where + " \"entry_mm\"", kMaxMm);
    const JsonValue& tip = file_.need(v, where, "tip_mm");
    s.tip_mm = triple(tip, where + " \"tip_mm\"", kMaxMm);
    const double mm = length(s.tip_mm - s.entry_mm);
    if (!(mm >= kShortestScrewMm && mm <= kLongestScrewMm))
      throw file_.wrong(tip, where + ": from \"entry_mm\" to \"tip_mm\" must be 1 to 200 mm");
    s.diameter_mm = file_.number(file_.need(v, where, "diameter_mm"), where + " \"diameter_mm\"", kThinnestScrewMm,
                                 kThickestScrewMm);
    const JsonValue& empty = file_.need(v, where, "empty");
    if (empty.kind != JsonValue::Kind::flag) throw file_.wrong(empty, where + ": \"empty\" is neither true nor false");
    s.empty = empty.flag;
    return s;
  }

  std::string name_of(const JsonValue& object, const std::string& where, std::string_view key) const {
    const JsonValue& v = file_.need(object, where, key);
    const std::string called = where + " \"" + std::string(key) + "\"";
    if (file_.text(v, called).empty()) throw file_.wrong(v, called + " is empty");
    return v.text;
  }
  template <class T>
  void require_new(const JsonValue& v, const std::string& where, const std::string& name,
                   const std::vector<T>& s) const {
    if (std::any_of(s.begin(), s.end(), [&](const T& t) { return t.name == name; }))
      throw file_.wrong(v, where + ": there is another \"" + name + "\" above", "give each a name of its own");
  }
  Vec3 triple(const JsonValue& v, const std::string& called, double limit) const {
    const auto& items = file_.list(v, called, 3);
    Vec3 out;
    for (std::size_t a = 0; a < 3; ++a) out[a] = file_.number(items[a], called, -limit, limit);
    return out;
  }

  JsonFile file_;
};

}  // namespace

namespace planning {
std::string rounded(double value, int decimals) {
  double scale = 1;
  for (int n = 0; n < decimals; ++n) scale *= 10;
  return format_number(std::round(scale * value) / scale);
}
}  // namespace planning

const CutPlane& SurgicalPlan::plane(std::string_view name) const {
  std::string names;
  for (const CutPlane& p : planes) {
    if (p.name == name) return p;
    names += (names.empty() ? "" : ", ") + p.name;
  }
  throw Error(ExitCode::usage, "no plane of the plan is called '" + std::string(name) + "'",
              names.empty() ? "it has no planes" : "there are: " + names);
}

SurgicalPlan plan_of(std::string_view text, const std::string& name) {
  return PlanReader(text, name).read();
}

std::string plan_json(const SurgicalPlan& plan) {
  Json j{{"osteotome_surgical_plan", 1}, {"unit", "mm"}};
  j["planes"] = Json::list();
  for (const CutPlane& p : plan.planes)
    j["planes"].push_back({{"name", p.name},
                           {"bone", p.bone},
                           {"at_mm", json_of(p.at_mm)},
                           {"normal", json_of(p.normal)},
                           {"kerf_mm", p.kerf_mm},
                           {"waste_ahead", p.waste_ahead}});
  j["fragments"] = Json::list();
  for (const PlannedFragment& f : plan.fragments) {
    Json rows = Json::list();
    const Mat3 t = transposed(f.planned_from_ct.rotation);
    for (const Vec3& row : t.column) rows.push_back(json_of(row));
    Json& out = j["fragments"];
    out.push_back({{"name", f.name}, {"bone", f.bone}});
    out.back()["planes"] = Json(f.planes);
    out.back()["rotation_rows"] = std::move(rows);
    out.back()["shift_mm"] = json_of(f.planned_from_ct.shift_mm);
  }
  if (!plan.screws.empty()) j["screws"] = Json::list();
  for (const PlannedScrew& s : plan.screws)
    j["screws"].push_back({{"name", s.name},
                           {"fragment", s.fragment},
                           {"entry_mm", json_of(s.entry_mm)},
                           {"tip_mm", json_of(s.tip_mm)},
                           {"diameter_mm", s.diameter_mm},
                           {"empty", s.empty}});
  std::string text = j.dump(1) + "\n";
  static_cast<void>(plan_of(text, "the plan"));
  return text;
}

}  // namespace osteo::inline session
