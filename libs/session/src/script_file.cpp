#include "osteo/session/script_file.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>

#include "osteo/base/error.h"
#include "osteo/base/files.h"
#include "osteo/base/portable_math.h"
#include "osteo/bone/burr.h"
#include "osteo/bone/plates.h"

namespace osteo {
namespace {

using nlohmann::ordered_json;

Vec3 point_of(const ordered_json& j) {
  return {j.at(0).get<double>(), j.at(1).get<double>(), j.at(2).get<double>()};
}

Vec3 vector_or(const ordered_json& j, const char* key, Vec3 otherwise) {
  return j.contains(key) ? point_of(j.at(key)) : otherwise;
}

// Circles that open and close between the middle and the rim of a bowl, a little deeper each time.
void cavity(double begin_s, const ordered_json& j, std::vector<Script::Waypoint>& out) {
  const Vec3 centre = point_of(j.at("centre_mm")), in = normalized(point_of(j.at("towards")));
  const double rim = j.at("radius_mm"), deep = j.at("depth_mm"), seconds = j.at("over_s"), turns = j.value("turns_per_s", 1.2);
  const Vec3 u = any_perpendicular(in), v = cross(in, u);
  constexpr double kStep = 0.05, kSwaysPerS = 0.25;
  for (double t = 0; t < seconds; t += kStep) {
    const double share = t / seconds, sway = std::abs(std::fmod(kSwaysPerS * t, 2.0) - 1);
    const double circle = rim * (1 - sway);
    const portable::SinCos turn = portable::sin_cos_turns(turns * t);
    // A bowl: less deep towards its rim.
    const double depth = deep * share * (1 - 0.4 * (circle / rim) * (circle / rim));
    if (out.empty() || begin_s + t > out.back().t_s)
      out.push_back({begin_s + t, centre + in * depth + u * (circle * turn.cos) + v * (circle * turn.sin), true});
  }
}

// A plate's frame from where its x and z axes point; z counts, x is taken at right angles to it.
Mat3 axes_of(const ordered_json& j) {
  const Vec3 z = normalized(vector_or(j, "z", {0, 0, 1}));
  Vec3 x = vector_or(j, "x", {1, 0, 0});
  x -= z * dot(x, z);
  x = length(x) > 1e-9 ? normalized(x) : any_perpendicular(z);
  return {{x, cross(z, x), z}};
}

// One entry of a script; what takes its time becomes many small steps.
class Deeds {
 public:
  explicit Deeds(std::vector<Script::Deed>& out) : out_(out) {}

  void read(const ordered_json& j) {
    const double t = j.at("t_s");
    const auto only = [&](const char* key) { return j.contains(key) ? &j.at(key) : nullptr; };
    if (const auto* const a = only("saw")) {
      SawCut cut;
      cut.at_mm = point_of(a->at("at_mm"));
      cut.normal = point_of(a->at("normal"));
      cut.along = vector_or(*a, "along", cut.along);
      cut.kerf_mm = a->value("kerf_mm", cut.kerf_mm);
      cut.length_mm = a->value("length_mm", 0.0);
      cut.depth_mm = a->value("depth_mm", 0.0);
      add(t, SceneAction::saw(cut, a->value("piece", SceneAction::kNobody)));
    } else if (const auto* const b = only("split")) {
      add(t, SceneAction::split(b->value("least_mm3", 50.0)));
    } else if (const auto* const m = only("move")) {
      move(t, *m);
    } else if (const auto* const g = only("grip")) {
      const std::string plate = g->value("plate", "");
      add(t, SceneAction::grip(plate.empty() ? SceneAction::kNobody : static_cast<std::uint32_t>(plate_index(plate)),
                               {axes_of(*g), vector_or(*g, "shift_mm", {})}));
    } else if (const auto* const f = only("attach")) {
      const auto& pieces = f->at("pieces");
      add(t, SceneAction::attach(static_cast<std::uint32_t>(plate_index(f->at("plate").get<std::string>())),
                                 {axes_of(*f), point_of(f->at("at_mm"))}, pieces.at(0).get<std::uint32_t>(),
                                 pieces.size() > 1 ? pieces.at(1).get<std::uint32_t>() : SceneAction::kNobody));
    } else if (const auto* const d = only("detach")) {
      add(t, SceneAction::detach(d->at("number")));
    } else if (const auto* const o = only("open")) {
      const std::uint32_t number = o->at("number");
      const double goal = o->at("opening_mm");
      double& now = opening_[number];
      steps(t, o->value("over_s", 0.0), [&](double share) { return SceneAction::open(number, now + (goal - now) * share); });
      now = goal;
    } else if (const auto* const s = only("suction")) {
      const double rate = s->value("mm3_per_s", 60.0);
      const Vec3 goal = rate > 0 ? point_of(s->at("at_mm")) : sucker_;
      if (!(sucking_ > 0)) sucker_ = goal;  // it comes from nowhere
      steps(t, s->value("over_s", 0.0),
            [&](double share) { return SceneAction::suction(sucker_ + (goal - sucker_) * share, s->value("radius_mm", 4.0), rate); });
      sucker_ = goal;
      sucking_ = rate;
    } else if (const auto* const w = only("irrigate")) {
      add(t, SceneAction::irrigate(vector_or(*w, "at_mm", {}), w->value("radius_mm", 6.0), w->value("share_per_s", 0.8)));
    } else if (only("undo") != nullptr) {
      add(t, SceneAction::plain(ActionKind::undo));
    } else {
      throw Error(ExitCode::usage, "it says nothing that can be done",
                  "one of saw, split, move, grip, attach, detach, open, suction, irrigate, undo");
    }
  }

 private:
  static constexpr double kStepsPerS = 50;
  struct Place {
    Vec3 shift;
    double turn_deg = 0;
  };
  void add(double t, const SceneAction& a) { out_.push_back({t, a}); }
  template <class F>
  void steps(double t, double seconds, F&& at) {
    const int n = std::max(1, static_cast<int>(std::lround(seconds * kStepsPerS)));
    for (int i = 1; i <= n; ++i) add(t + seconds * (i - 1) / n, at(static_cast<double>(i) / n));
  }
  // Where a piece is, from where it was in the case: first turned, then shifted.
  void move(double t, const ordered_json& j) {
    const std::uint32_t piece = j.at("piece");
    Place& now = places_[piece];
    const Place goal{vector_or(j, "shift_mm", now.shift), j.value("turn_deg", now.turn_deg)};
    const Vec3 axis = normalized(vector_or(j, "axis", {0, 0, 1})), about = vector_or(j, "about_mm", {});
    steps(t, j.value("over_s", 0.0), [&](double share) {
      const double turn = now.turn_deg + (goal.turn_deg - now.turn_deg) * share;
      return SceneAction::move(piece, RigidTransform{{}, now.shift + (goal.shift - now.shift) * share} *
                                          rotation_about(about, axis, turn * std::numbers::pi / 180));
    });
    now = goal;
  }

  std::vector<Script::Deed>& out_;
  std::map<std::uint32_t, Place> places_;
  std::map<std::uint32_t, double> opening_;
  Vec3 sucker_;
  double sucking_ = 0;
};

}  // namespace

std::vector<SceneAction> actions_of(const Script& script, double rate_hz) {
  std::vector<SceneAction> actions;
  for (const Script::Deed& d : script.deeds) {
    actions.push_back(d.action);
    actions.back().tick = static_cast<std::uint64_t>(std::llround(std::max(0.0, d.t_s) * rate_hz));
  }
  return actions;
}

Script load_script(const fs::path& path) {
  const std::string text = read_text(path), name = "'" + path.string() + "'";
  Script script;
  std::string where = "header";
  try {
    const auto j = ordered_json::parse(text, nullptr, true, true);
    if (j.at("osteotome_strokes") != 1) throw Error(ExitCode::usage, name + ": \"osteotome_strokes\" must be 1");
    where = "burr";
    BurrKind kind = BurrKind::cutting;
    detail::FieldCollector fields;
    fields({"burr.kind", "kind of burr"}, kind);
    fields.fields.front().from_text(j.at("burr").at("kind").get<std::string>());
    script.tool = burr_index(kind, j.at("burr").at("diameter_mm"));
    where = "axis";
    script.axis = normalized(point_of(j.at("axis")));
    if (length(script.axis) == 0) throw Error(ExitCode::usage, name + ": the axis has no length");
    for (const auto& w : j.at("waypoints")) {
      where = "waypoint " + std::to_string(script.waypoints.size() + 1);
      if (w.contains("cavity")) {
        cavity(w.at("t_s"), w.at("cavity"), script.waypoints);
        continue;
      }
      const Script::Waypoint point{w.at("t_s"), point_of(w.at("at_mm")), w.value("drill", true)};
      if (!script.waypoints.empty() && !(point.t_s > script.waypoints.back().t_s))
        throw Error(ExitCode::usage, name + ": " + where + ": times must rise");
      script.waypoints.push_back(point);
    }
    where = "camera";
    if (j.contains("camera")) {
      const auto& c = j.at("camera");
      script.camera = Script::Camera{point_of(c.at("centre_mm")), c.at("radius_mm"), normalized(point_of(c.at("eye")))};
    }
    Deeds deeds(script.deeds);
    int number = 0;
    for (const auto& a : j.value("actions", ordered_json::array())) {
      where = "action " + std::to_string(++number);
      const std::size_t before = script.deeds.size();
      try {
        deeds.read(a);
      } catch (const Error& e) {
        throw Error(ExitCode::usage, name + ": " + where + ": " + e.what(), e.advice());
      }
      if (before > 0 && before < script.deeds.size() && script.deeds[before].t_s < script.deeds[before - 1].t_s)
        throw Error(ExitCode::usage, name + ": " + where + ": it begins before the one above has ended");
    }
  } catch (const nlohmann::json::exception& e) {
    throw Error(ExitCode::usage, name + ": " + where + ": " + e.what(), "docs/session-format.md describes scripts of strokes");
  }
  if (script.waypoints.empty()) throw Error(ExitCode::usage, name + ": there are no waypoints");
  return script;
}

std::string script_json(const Script& script) {
  const Burr& burr = burr_library()[static_cast<std::size_t>(script.tool)];
  ordered_json j;
  j["osteotome_strokes"] = 1;
  j["burr"] = {{"kind", EnumNames<BurrKind>::values[static_cast<std::size_t>(burr.kind)]}, {"diameter_mm", burr.diameter_mm}};
  j["axis"] = {script.axis.x, script.axis.y, script.axis.z};
  j["waypoints"] = ordered_json::array();
  for (const auto& w : script.waypoints)
    j["waypoints"].push_back({{"t_s", w.t_s}, {"at_mm", {w.at_mm.x, w.at_mm.y, w.at_mm.z}}, {"drill", w.drill_on}});
  return j.dump(1) + "\n";
}

}  // namespace osteo
