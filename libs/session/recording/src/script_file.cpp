#include "osteo/session/recording/script.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>
#include <tuple>

#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/json.h"
#include "osteo/core/base/json_document.h"
#include "osteo/core/base/portable_math.h"
#include "osteo/simulation/bone/instrument.h"
#include "osteo/simulation/bone/plates.h"
#include "osteo/simulation/bone/posture.h"
#include "script_parts.h"

namespace osteo::inline session {
namespace {

using nlohmann::ordered_json;
using namespace script;

// A file being read: the declared parts, and what no range can say.
class ScriptReader {
 public:
  ScriptReader(const JsonFile& file, std::span<const PlannedCut> planned, Script& script)
      : file_(file), planned_(planned), script_(script) {}

  void read() {
    const JsonValue& root = file_.root();
    Head head;
    const std::vector<std::string> besides{"burr", "camera", "waypoints", "actions", "hands"};
    file_.read(root, "", fields_in(head), besides);
    script_.axis = direction(root, "", "axis", head.axis);
    if (const JsonValue* const i = root.find("instrument")) {
      if (root.find("burr") != nullptr)
        throw file_.wrong(*i, "the hand holds a \"burr\" or another \"instrument\"", "leave out one of the two");
      script_.tool = located(*i, "instrument", [&] { return instrument_index(head.instrument); });
    } else {
      BurrPart burr;
      const JsonValue& b = needed(root, "burr", JsonValue::Kind::object, "{\"kind\": \"cutting\", \"diameter_mm\": 4}");
      file_.read(b, "burr", fields_in(burr));
      script_.tool = located(b, "burr", [&] { return burr_index(burr.kind, burr.diameter_mm, burr.shape); });
    }
    if (const JsonValue* const c = root.find("camera")) {
      CameraPart camera;
      file_.read(*c, "camera", fields_in(camera));
      script_.camera =
          Script::Camera{vec(camera.centre_mm), camera.radius_mm, direction(*c, "camera", "eye", camera.eye)};
    }
    const JsonValue& waypoints = read_waypoints(root, "", script_);
    read_hands(root);
    int number = 0;
    const JsonValue* const actions = root.find("actions");
    if (actions != nullptr && actions->kind != JsonValue::Kind::list)
      throw file_.wrong(*actions, "\"actions\" must be a list");
    for (std::size_t a = 0; actions != nullptr && a < actions->items.size(); ++a) {
      const std::string where = "action " + std::to_string(++number);
      const std::size_t before = script_.actions.size();
      action(actions->items[a], where);
      if (before > 0 && script_.actions[before].t_s < script_.actions[before - 1].t_s)
        throw file_.wrong(actions->items[a], where + ": it begins before the one above has ended",
                          "actions stand in the order of their times");
    }
    if (!(script_.seconds() > 0))
      throw file_.wrong(waypoints, "the script takes no time", "give a last waypoint with \"t_s\" above 0");
  }

 private:
  static constexpr double kStepsPerS = 50;
  struct Place {
    Triple shift{};
    double turn_deg = 0;
  };

  const JsonValue& needed(const JsonValue& object, const char* key, JsonValue::Kind kind, const std::string& like) {
    const JsonValue* const v = object.find(key);
    if (v == nullptr) throw file_.wrong(object, "\"" + std::string(key) + "\" is missing, as in " + like);
    if (v->kind != kind) throw file_.wrong(*v, "\"" + std::string(key) + "\" must be as in " + like);
    return *v;
  }
  template <class F>
  std::invoke_result_t<F> located(const JsonValue& at, const std::string& where, F&& f) {
    try {
      return f();
    } catch (const Error& e) {
      throw file_.wrong(at, where + ": " + e.what(), e.advice());
    }
  }
  Vec3 direction(const JsonValue& object, const std::string& where, const char* key, const Triple& t) {
    return direction_of(file_, object, where, key, t);
  }
  // A plate's frame from where its x and z axes point; z counts, x is taken at right angles to it.
  Mat3 axes_of(const JsonValue& object, const std::string& where, const Triple& x_of, const Triple& z_of) {
    const Vec3 z = direction(object, where, "z", z_of);
    Vec3 x = direction(object, where, "x", x_of);
    x -= z * dot(x, z);
    x = length(x) > 1e-9 ? normalized(x) : any_perpendicular(z);
    return {{x, cross(z, x), z}};
  }

  const JsonValue& read_waypoints(const JsonValue& of, const std::string& where, Strokes& hand) {
    const JsonValue& waypoints =
        needed(of, "waypoints", JsonValue::Kind::list, "[{\"t_s\": 0, \"at_mm\": [80, 24, -26]}, ...]");
    int number = 0;
    for (const JsonValue& w : waypoints.items) waypoint(w, where + "waypoint " + std::to_string(++number), hand);
    if (hand.waypoints.empty()) throw file_.wrong(waypoints, where + "there are no waypoints");
    return waypoints;
  }
  // Those besides the one with the burr.
  void read_hands(const JsonValue& root) {
    const JsonValue* const hands = root.find("hands");
    if (hands == nullptr) return;
    if (hands->kind != JsonValue::Kind::list) throw file_.wrong(*hands, "\"hands\" must be a list");
    if (hands->items.size() >= kMaxHands)
      throw file_.wrong(*hands, "there are " + std::to_string(hands->items.size()) + " hands besides the first",
                        "at most " + std::to_string(kMaxHands - 1));
    int number = 0;
    for (const JsonValue& h : hands->items) {
      const std::string where = "hand " + std::to_string(++number);
      HandPart part;
      const std::vector<std::string> besides{"waypoints"};
      file_.read(h, where, fields_in(part), besides);
      Strokes strokes;
      strokes.tool = located(*h.find("instrument"), where, [&] { return instrument_index(part.instrument); });
      strokes.axis = direction(h, where, "axis", part.axis);
      static_cast<void>(read_waypoints(h, where + ", ", strokes));
      script_.more_hands.push_back(std::move(strokes));
    }
  }

  void waypoint(const JsonValue& w, const std::string& where, Strokes& hand) {
    if (const JsonValue* const c = w.find("cavity")) {
      When when;
      const std::vector<std::string> besides{"cavity"};
      file_.read(w, where, fields_in(when), besides);
      Cavity cavity;
      file_.read(*c, where + ", cavity", fields_in(cavity));
      add_cavity(when.t_s, cavity, direction(*c, where + ", cavity", "towards", cavity.towards), w, where, hand);
    } else {
      Point p;
      file_.read(w, where, fields_in(p));
      must_rise(p.t_s, w, where, hand);
      if (!p.drill && w.find("pedal") != nullptr && p.pedal > 0)
        throw file_.wrong(*w.find("pedal"), where + ": the pedal is down and \"drill\" is false",
                          "leave out one of the two");
      hand.waypoints.push_back({p.t_s, vec(p.at_mm), p.drill, p.pedal});
    }
  }
  void must_rise(double t_s, const JsonValue& w, const std::string& where, const Strokes& hand) {
    if (!hand.waypoints.empty() && !(t_s > hand.waypoints.back().t_s))
      throw file_.wrong(
          w, where + ": times must rise, but the one above ends at " + format_number(hand.waypoints.back().t_s) + " s");
  }
  // Circles that open and close between the middle and the rim of a bowl, a little deeper each time.
  void add_cavity(double begin_s, const Cavity& c, Vec3 in, const JsonValue& w, const std::string& where,
                  Strokes& hand) {
    must_rise(begin_s, w, where, hand);
    const Vec3 u = any_perpendicular(in), v = cross(in, u);
    constexpr double kStep = 0.05, kSwaysPerS = 0.25;
    for (double t = 0; t < c.over_s; t += kStep) {
      const double share = t / c.over_s, sway = std::abs(std::fmod(kSwaysPerS * t, 2.0) - 1);
      const double circle = c.radius_mm * (1 - sway);
      const portable::SinCos turn = portable::sin_cos_turns(c.turns_per_s * t);
      // A bowl: less deep towards its rim.
      const double depth = c.depth_mm * share * (1 - 0.4 * (circle / c.radius_mm) * (circle / c.radius_mm));
      hand.waypoints.push_back(
          {begin_s + t, vec(c.centre_mm) + in * depth + u * (circle * turn.cos) + v * (circle * turn.sin), true});
    }
  }

  // One entry; what takes its time becomes many small steps.
  void action(const JsonValue& entry, const std::string& where) {
    std::vector<std::string> names;
    std::apply([&](auto... form) { (names.emplace_back(form.kName), ...); }, Forms());
    When when;
    file_.read(entry, where, fields_in(when), names);
    if (entry.members.size() == 1) {
      std::string list;
      for (const std::string& n : names) list += (list.empty() ? "" : ", ") + n;
      throw file_.wrong(entry, where + ": it says nothing that can be done", "one of " + list);
    }
    if (entry.members.size() > 2)
      throw file_.wrong(entry, where + ": it says more than one thing to do",
                        "give each an entry of its own, with its own \"t_s\"");
    const JsonMember& what = entry.members[entry.members[0].key == "t_s" ? 1 : 0];
    std::apply(
        [&](auto... form) {
          const auto take = [&](auto& f) {
            if (what.key != f.kName) return;
            const std::string at = where + ", " + f.kName;
            if constexpr (std::is_same_v<std::decay_t<decltype(f)>, Move>) now_at(what.value, at, f);
            file_.read(what.value, at, fields_in(f));
            act(when.t_s, f, what.value, at);
          };
          (take(form), ...);
        },
        Forms());
  }

  void add(double t, const SceneAction& a) { script_.actions.push_back({t, a}); }
  template <class F>
  void steps(double t, double seconds, F&& at) {
    const int n = std::max(1, static_cast<int>(std::lround(seconds * kStepsPerS)));
    for (int i = 1; i <= n; ++i) add(t + seconds * (i - 1) / n, at(static_cast<double>(i) / n));
  }

  // Named, or all that it is.
  const PlannedCut* planned(const JsonValue& j, const std::string& where, const std::string& name,
                            std::string_view beside) {
    if (name.empty()) {
      for (const char* const key : {"at_mm", "normal"}) {
        if (j.find(key) == nullptr)
          throw file_.wrong(j, where + ": \"" + key + "\" is missing",
                            "or name a planned cut of the case: {\"planned\": \"left body\"}");
      }
      return nullptr;
    }
    for (const JsonMember& m : j.members) {
      if (m.key != "planned" && m.key != beside)
        throw file_.wrong(m.value, where + ": \"" + m.key + "\" beside \"planned\": the planned cut says that",
                          "leave out one of the two");
    }
    return located(*j.find("planned"), where, [&] { return &planned_cut(planned_, name); });
  }
  void act(double t, const Saw& s, const JsonValue& j, const std::string& where) {
    const PlannedCut* const plan = planned(j, where, s.planned, "piece");
    add(t, SceneAction::saw(plan != nullptr ? plan->cut : s.blade.checked(file_, j, where),
                            s.piece < 0 ? SceneAction::kNobody : static_cast<std::uint32_t>(s.piece)));
  }
  void act(double t, const GuidePart& g, const JsonValue& j, const std::string& where) {
    const PlannedCut* const plan = planned(j, where, g.planned, "hand");
    const CuttingGuide guide = plan != nullptr
                                   ? plan->guide()
                                   : CuttingGuide{vec(g.at_mm), direction(j, where, "normal", g.normal), g.within_mm};
    add(t, SceneAction::cutting_guide(guide, static_cast<std::uint32_t>(g.hand)));
  }
  void act(double t, const SplitPart& s, const JsonValue&, const std::string&) {
    add(t, SceneAction::split(s.least_mm3));
  }
  // What a move leaves out stays as it was.
  void now_at(const JsonValue& j, const std::string& where, Move& m) {
    file_.read(j, where, fields_in(m));
    const Place& now = places_[static_cast<std::uint32_t>(m.piece)];
    m.shift_mm = now.shift;
    m.turn_deg = now.turn_deg;
  }
  // Where a piece is, from where it was in the case: first turned, then shifted.
  void act(double t, const Move& m, const JsonValue& j, const std::string& where) {
    const auto piece = static_cast<std::uint32_t>(m.piece);
    Place& now = places_[piece];
    const Vec3 axis = direction(j, where, "axis", m.axis), about = vec(m.about_mm), from = vec(now.shift),
               to = vec(m.shift_mm);
    steps(t, m.over_s, [&](double share) {
      const double turn = now.turn_deg + (m.turn_deg - now.turn_deg) * share;
      return SceneAction::move(piece, RigidTransform{{}, from + (to - from) * share} *
                                          rotation_about(about, axis, turn * std::numbers::pi / 180));
    });
    now = {m.shift_mm, m.turn_deg};
  }
  std::uint32_t plate(const JsonValue& j, const std::string& where, const std::string& name) {
    return static_cast<std::uint32_t>(located(*j.find("plate"), where, [&] { return plate_index(name); }));
  }
  void act(double t, const Grip& g, const JsonValue& j, const std::string& where) {
    add(t, SceneAction::grip(g.plate.empty() ? SceneAction::kNobody : plate(j, where, g.plate),
                             {axes_of(j, where, g.x, g.z), vec(g.shift_mm)}));
  }
  void act(double t, const Attach& a, const JsonValue& j, const std::string& where) {
    if (a.pieces.empty() || a.pieces.size() > 2 || (a.pieces.size() == 2 && a.pieces[0] == a.pieces[1]))
      throw file_.wrong(*(j.find("fragments") != nullptr ? j.find("fragments") : j.find("pieces")),
                        where + ": \"fragments\" are one, or two that are not the same");
    add(t, SceneAction::attach(plate(j, where, a.plate), {axes_of(j, where, a.x, a.z), vec(a.at_mm)},
                               static_cast<std::uint32_t>(a.pieces[0]),
                               a.pieces.size() > 1 ? static_cast<std::uint32_t>(a.pieces[1]) : SceneAction::kNobody));
  }
  void act(double t, const Detach& d, const JsonValue&, const std::string&) {
    add(t, SceneAction::detach(static_cast<std::uint32_t>(d.number)));
  }
  void act(double t, const Open& o, const JsonValue&, const std::string&) {
    const auto number = static_cast<std::uint32_t>(o.number);
    double& now = opening_[number];
    steps(t, o.over_s, [&](double share) { return SceneAction::open(number, now + (o.opening_mm - now) * share); });
    now = o.opening_mm;
  }
  void must_be_somewhere(const JsonValue& j, const std::string& where) {
    if (j.find("at_mm") == nullptr) throw file_.wrong(j, where + ": \"at_mm\" is missing: where, LPS mm");
  }
  void act(double t, const Suction& s, const JsonValue& j, const std::string& where) {
    if (s.mm3_per_s > 0) must_be_somewhere(j, where);
    const Vec3 goal = s.mm3_per_s > 0 ? vec(s.at_mm) : sucker_;
    if (!(sucking_ > 0)) sucker_ = goal;  // it comes from nowhere
    steps(t, s.over_s, [&](double share) {
      return SceneAction::suction(sucker_ + (goal - sucker_) * share, s.radius_mm, s.mm3_per_s);
    });
    sucker_ = goal;
    sucking_ = s.mm3_per_s;
  }
  void act(double t, const Irrigate& w, const JsonValue& j, const std::string& where) {
    if (w.mm3_per_s > 0) must_be_somewhere(j, where);
    add(t, SceneAction::irrigate(vec(w.at_mm), w.radius_mm, w.mm3_per_s));
  }
  void act(double t, const Patient& p, const JsonValue&, const std::string&) {
    add(t, SceneAction::posture(down_of(p.position, p.head_turned_deg)));
  }
  void act(double t, const Undo&, const JsonValue&, const std::string&) {
    add(t, SceneAction::plain(ActionKind::undo));
  }

  void act(double t, const Simulate& s, const JsonValue& j, const std::string& where) {
    if (j.members.empty()) throw file_.wrong(j, where + ": it names neither \"dust\" nor \"heat\"");
    if (j.find("dust") != nullptr) add(t, SceneAction::simulate(Simulated::dust, s.dust));
    if (j.find("heat") != nullptr) add(t, SceneAction::simulate(Simulated::heat, s.heat));
  }

  // Each is an action of its own, in the order of the settings; as they are in the file, so that what is said of none
  // is left alone.
  void act(double t, const Set& s, const JsonValue& j, const std::string& where) {
    if (j.members.empty()) throw file_.wrong(j, where + ": it names no setting");
    for (std::size_t n = 0; n < setting_names().size(); ++n) {
      if (j.find(setting_names()[n]) != nullptr)
        add(t, SceneAction::setting(static_cast<std::uint32_t>(n), setting_value(static_cast<int>(n), s.params)));
    }
  }

  const JsonFile& file_;
  const std::span<const PlannedCut> planned_;
  Script& script_;
  std::map<std::uint32_t, Place> places_;
  std::map<std::uint32_t, double> opening_;
  Vec3 sucker_;
  double sucking_ = 0;
};

template <class T>
ordered_json object_schema() {
  T part;
  ordered_json s{{"type", "object"},
                 {"additionalProperties", false},
                 {"required", ordered_json::array()},
                 {"properties", ordered_json::object()}};
  for (const FieldRef& f : fields_in(part)) {
    s["properties"][std::string(f.doc.name)] = ordered_json::parse(field_schema(f).dump());
    if (f.doc.needed) s["required"].push_back(f.doc.name);
  }
  return s;
}

}  // namespace

Script load_script(const fs::path& path, std::span<const PlannedCut> planned) {
  Script script;
  const JsonFile file(read_text(path), path.string());
  ScriptReader(file, planned, script).read();
  return script;
}

std::string script_json(const Script& script) {
  const Instrument& held = instrument_of(static_cast<std::uint8_t>(script.tool));
  ordered_json j;
  j["osteotome_strokes"] = 1;
  if (const Burr* const burr = held.as_burr()) {
    j["burr"] = {{"kind", row_of(burr->kind).name},
                 {"diameter_mm", burr->diameter_mm},
                 {"shape", EnumNames<BurrShape>::values[static_cast<std::size_t>(burr->shape)]}};
  } else {
    j["instrument"] = held.name;
  }
  j["axis"] = {script.axis.x, script.axis.y, script.axis.z};
  j["waypoints"] = ordered_json::array();
  for (const auto& w : script.waypoints) {
    j["waypoints"].push_back({{"t_s", w.t_s}, {"at_mm", {w.at_mm.x, w.at_mm.y, w.at_mm.z}}, {"drill", w.drill_on}});
    if (w.drill_on && w.pedal != 1) j["waypoints"].back()["pedal"] = w.pedal;
  }
  return j.dump(1) + "\n";
}

std::string script_schema() {
  ordered_json s = object_schema<Head>();
  ordered_json root{{"$schema", "https://json-schema.org/draft/2020-12/schema"},
                    {"title", "Script of strokes of Osteotome"}};
  s["properties"]["osteotome_strokes"] = {{"const", 1}};
  s["properties"]["burr"] = object_schema<BurrPart>();
  s["properties"]["camera"] = object_schema<CameraPart>();
  ordered_json cavity = object_schema<When>();
  cavity["properties"]["cavity"] = object_schema<Cavity>();
  cavity["required"].push_back("cavity");
  s["properties"]["waypoints"] = {
      {"type", "array"}, {"minItems", 1}, {"items", {{"oneOf", {object_schema<Point>(), cavity}}}}};
  ordered_json hand = object_schema<HandPart>();
  hand["properties"]["waypoints"] = s["properties"]["waypoints"];
  hand["required"].push_back("waypoints");
  s["properties"]["hands"] = {{"type", "array"}, {"maxItems", kMaxHands - 1}, {"items", hand}};
  ordered_json any = ordered_json::array();
  const auto add = [&]<class F>(const F&) {
    ordered_json entry = object_schema<When>();
    ordered_json what = object_schema<F>();
    what["description"] = F::kHelp;
    if (what["properties"].contains("fragments")) {
      what["properties"]["fragments"]["minItems"] = 1;
      what["properties"]["fragments"]["maxItems"] = 2;
    }
    if (what["properties"].contains("planned"))
      what["anyOf"] = {{{"required", {"planned"}}}, {{"required", {"at_mm", "normal"}}}};
    entry["properties"][F::kName] = what;
    entry["required"].push_back(F::kName);
    any.push_back(entry);
  };
  std::apply([&](auto... form) { (add(form), ...); }, Forms());
  s["properties"]["actions"] = {{"type", "array"}, {"items", {{"oneOf", any}}}};
  s["required"].push_back("waypoints");
  s["oneOf"] = {{{"required", {"burr"}}}, {{"required", {"instrument"}}}};
  root.update(s);
  return root.dump(2) + "\n";
}

}  // namespace osteo::inline session
