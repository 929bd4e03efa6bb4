#include "osteo/session/script_file.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>
#include <tuple>

#include "osteo/base/error.h"
#include "osteo/base/files.h"
#include "osteo/base/json.h"
#include "osteo/base/json_document.h"
#include "osteo/base/portable_math.h"
#include "osteo/bone/instrument.h"
#include "osteo/bone/plates.h"
#include "osteo/bone/posture.h"
#include "osteo/haptics/haptic_setup.h"

namespace osteo {
namespace {

using nlohmann::ordered_json;
using Triple = std::array<double, 3>;

// Of what a script may hold each part is declared once: name, help, unit, range. Reading and the schema both go by that.
constexpr double kFarMm = 10000, kLongestS = 21600, kMostPieces = 1e6;

Vec3 vec(const Triple& t) {
  return {t[0], t[1], t[2]};
}

struct Head {
  int version = 1;
  std::string schema, about, instrument;
  Triple axis{0, 0, 1};
  static void describe(Head& p, auto& visit) {
    visit({"osteotome_strokes", "version of the format", "", 1, 1, true}, p.version);
    visit({"$schema", "where its schema lies, for editors"}, p.schema);
    visit({"about", "what it shows"}, p.about);
    visit({"instrument", "by name, in place of a burr, as saw 25 mm"}, p.instrument);
    visit({"axis", "from the burr to the handle, LPS", "", -kFarMm, kFarMm, true}, p.axis);
  }
};

struct BurrPart {
  BurrKind kind = BurrKind::cutting;
  double diameter_mm = 4;
  BurrShape shape = BurrShape::ball;
  static void describe(BurrPart& p, auto& visit) {
    visit({"kind", "of its edges", "", 0, 0, true}, p.kind);
    visit({"diameter_mm", "1, 2, 3, 4, 5, 6 or 7", "mm", 1, 7, true}, p.diameter_mm);
    visit({"shape", "of its head"}, p.shape);
  }
};

struct CameraPart {
  Triple centre_mm{}, eye{};
  double radius_mm = 32;
  static void describe(CameraPart& p, auto& visit) {
    visit({"centre_mm", "middle of the pictures, LPS", "mm", -kFarMm, kFarMm, true}, p.centre_mm);
    visit({"radius_mm", "of what they show", "mm", 1, 1000, true}, p.radius_mm);
    visit({"eye", "from there towards who looks", "", -kFarMm, kFarMm, true}, p.eye);
  }
};

// When: of every waypoint and every action.
struct When {
  double t_s = 0;
  static void describe(When& p, auto& visit) { visit({"t_s", "when", "s", 0, kLongestS, true}, p.t_s); }
};

struct Point {
  double t_s = 0;
  Triple at_mm{};
  bool drill = true;
  double pedal = 1;
  static void describe(Point& p, auto& visit) {
    visit({"t_s", "when the hand is there", "s", 0, kLongestS, true}, p.t_s);
    visit({"at_mm", "where the hand wants the tip, LPS", "mm", -kFarMm, kFarMm, true}, p.at_mm);
    visit({"drill", "the pedal is down from here to the next waypoint: it drills, sucks or rinses"}, p.drill);
    visit({"pedal", "how far down", "", 0, 1}, p.pedal);
  }
};

struct HandPart {
  std::string instrument;
  Triple axis{0, 0, 1};
  static void describe(HandPart& p, auto& visit) {
    visit({"instrument", "by name, as sucker 8 Fr or cutting 4 mm", "", 0, 0, true}, p.instrument);
    visit({"axis", "from the tip to the handle, LPS", "", -kFarMm, kFarMm, true}, p.axis);
  }
};

struct Cavity {
  Triple centre_mm{}, towards{};
  double radius_mm = 5, depth_mm = 5, over_s = 10, turns_per_s = 1.2;
  static void describe(Cavity& p, auto& visit) {
    visit({"centre_mm", "middle of its rim, LPS", "mm", -kFarMm, kFarMm, true}, p.centre_mm);
    visit({"towards", "into the bone", "", -kFarMm, kFarMm, true}, p.towards);
    visit({"radius_mm", "of the burr's circles at the rim", "mm", 0.1, 100, true}, p.radius_mm);
    visit({"depth_mm", "in the middle, at the end", "mm", 0, 200, true}, p.depth_mm);
    visit({"over_s", "how long it takes", "s", 0.1, 3600, true}, p.over_s);
    visit({"turns_per_s", "circles a second", "1/s", 0.01, 20}, p.turns_per_s);
  }
};

struct Saw {
  static constexpr const char *kName = "saw", *kHelp = "take out a blade's width";
  Triple at_mm{}, normal{}, along{0, 0, 1};
  double kerf_mm = SawCut{}.kerf_mm, length_mm = 0, depth_mm = 0;
  int piece = -1;
  static void describe(Saw& p, auto& visit) {
    visit({"at_mm", "middle of the blade, LPS", "mm", -kFarMm, kFarMm, true}, p.at_mm);
    visit({"normal", "across the blade", "", -kFarMm, kFarMm, true}, p.normal);
    visit({"along", "where its length lies", "", -kFarMm, kFarMm}, p.along);
    visit({"kerf_mm", "thickness of what it takes", "mm", 0.05, 10}, p.kerf_mm);
    visit({"length_mm", "of the cut; 0: through", "mm", 0, 2000}, p.length_mm);
    visit({"depth_mm", "across normal and length; 0: through", "mm", 0, 2000}, p.depth_mm);
    visit({"piece", "only this one; -1: all", "", -1, kMostPieces}, p.piece);
  }
};

struct GuidePart {
  static constexpr const char *kName = "cutting_guide", *kHelp = "a slot that holds a hand's saw in a plane, until the next of these";
  Triple at_mm{}, normal{};
  double within_mm = 2;
  int hand = 0;
  static void describe(GuidePart& p, auto& visit) {
    visit({"at_mm", "a point of the plane, LPS", "mm", -kFarMm, kFarMm, true}, p.at_mm);
    visit({"normal", "across the plane", "", -kFarMm, kFarMm, true}, p.normal);
    visit({"within_mm", "a saw this near slips in; 0: the guide is taken away", "mm", 0, SceneAction::kMostSlotMm}, p.within_mm);
    visit({"hand", "whose saw", "", 0, kMostHands - 1}, p.hand);
  }
};

struct SplitPart {
  static constexpr const char *kName = "split", *kHelp = "take apart what does not hang together";
  double least_mm3 = 50;
  static void describe(SplitPart& p, auto& visit) { visit({"least_mm3", "what is smaller becomes dust", "mm3", 0, 1e6}, p.least_mm3); }
};

struct Move {
  static constexpr const char *kName = "move", *kHelp = "a piece, and all that is plated to it, from where it was in the case";
  int piece = 0;
  Triple shift_mm{}, axis{0, 0, 1}, about_mm{};
  double turn_deg = 0, over_s = 0;
  static void describe(Move& p, auto& visit) {
    visit({"piece", "which", "", 0, kMostPieces, true}, p.piece);
    visit({"shift_mm", "where to, after the turn; left out: as far as it was shifted before", "mm", -kFarMm, kFarMm}, p.shift_mm);
    visit({"turn_deg", "about axis through about_mm; left out: as far as it was turned before", "deg", -360, 360}, p.turn_deg);
    visit({"axis", "of the turn", "", -kFarMm, kFarMm}, p.axis);
    visit({"about_mm", "a point of that axis, LPS", "mm", -kFarMm, kFarMm}, p.about_mm);
    visit({"over_s", "how long it takes", "s", 0, 3600}, p.over_s);
  }
};

struct Grip {
  static constexpr const char *kName = "grip", *kHelp = "take a plate into the hand, or the drill again";
  std::string plate;
  Triple x{1, 0, 0}, z{0, 0, 1}, shift_mm{};
  static void describe(Grip& p, auto& visit) {
    visit({"plate", "which; left out: the drill again"}, p.plate);
    visit({"x", "along the plate, in the hand's frame", "", -kFarMm, kFarMm}, p.x);
    visit({"z", "away from the bone, in the hand's frame", "", -kFarMm, kFarMm}, p.z);
    visit({"shift_mm", "of its middle, in the hand's frame", "mm", -1000, 1000}, p.shift_mm);
  }
};

struct Attach {
  static constexpr const char *kName = "attach", *kHelp = "fix a plate to one piece or two";
  std::string plate;
  Triple at_mm{}, x{1, 0, 0}, z{0, 0, 1};
  std::vector<int> pieces;
  static void describe(Attach& p, auto& visit) {
    visit({"plate", "which", "", 0, 0, true}, p.plate);
    visit({"at_mm", "middle of its underside, LPS", "mm", -kFarMm, kFarMm, true}, p.at_mm);
    visit({"x", "along the plate", "", -kFarMm, kFarMm}, p.x);
    visit({"z", "away from the bone", "", -kFarMm, kFarMm}, p.z);
    visit({"pieces", "one or two; the plate stays with the first", "", 0, kMostPieces, true}, p.pieces);
  }
};

struct Detach {
  static constexpr const char *kName = "detach", *kHelp = "take a plate off";
  int number = 1;
  static void describe(Detach& p, auto& visit) {
    visit({"number", "of the plate, in the order of fixing, from 1", "", 1, kMostPieces, true}, p.number);
  }
};

struct Open {
  static constexpr const char *kName = "open", *kHelp = "turn the screw of a distractor";
  int number = 1;
  double opening_mm = 0, over_s = 0;
  static void describe(Open& p, auto& visit) {
    visit({"number", "of the plate, in the order of fixing, from 1", "", 1, kMostPieces, true}, p.number);
    visit({"opening_mm", "of the gap, at the end", "mm", 0, 100, true}, p.opening_mm);
    visit({"over_s", "how long it takes", "s", 0, 3600}, p.over_s);
  }
};

struct Suction {
  static constexpr const char *kName = "suction", *kHelp = "a sucker, until the next of these";
  Triple at_mm{};
  double radius_mm = 4, mm3_per_s = 60, over_s = 0;
  static void describe(Suction& p, auto& visit) {
    visit({"at_mm", "where it comes to, LPS", "mm", -kFarMm, kFarMm}, p.at_mm);
    visit({"radius_mm", "how far it reaches", "mm", 0.1, SceneAction::kMostReachMm}, p.radius_mm);
    visit({"mm3_per_s", "what it takes; 0: away", "mm3/s", 0, 1e5}, p.mm3_per_s);
    visit({"over_s", "how long it is on the way", "s", 0, 3600}, p.over_s);
  }
};

struct Irrigate {
  static constexpr const char *kName = "irrigate", *kHelp = "water, until the next of these";
  Triple at_mm{};
  double radius_mm = 15, mm3_per_s = 400;
  static void describe(Irrigate& p, auto& visit) {
    visit({"at_mm", "where, LPS", "mm", -kFarMm, kFarMm}, p.at_mm);
    visit({"radius_mm", "how far it falls at most before it spreads", "mm", 0.1, SceneAction::kMostReachMm}, p.radius_mm);
    visit({"mm3_per_s", "of water; 0: away", "mm3/s", 0, 1e5}, p.mm3_per_s);
  }
};

struct Patient {
  static constexpr const char *kName = "patient", *kHelp = "lies so from here on: where dust and water fall to";
  Posture position = Posture::supine;
  double head_turned_deg = 0;
  static void describe(Patient& p, auto& visit) {
    visit({"position", "of the patient"}, p.position);
    visit({"head_turned_deg", "positive: the face towards the left shoulder", "deg", -180, 180}, p.head_turned_deg);
  }
};

struct Undo {
  static constexpr const char *kName = "undo", *kHelp = "take back the last saw, split, move, attach, detach or open";
  static void describe(Undo&, auto&) {}
};

// Its keys are the names of the haptic settings, which are declared where they belong.
struct Set {
  static constexpr const char *kName = "set", *kHelp = "haptic settings that have other values from here on";
  HapticsParams params;
  static void describe(Set& p, auto& visit) { HapticsParams::describe(p.params, visit); }
};

using Forms = std::tuple<Saw, GuidePart, SplitPart, Move, Grip, Attach, Detach, Open, Suction, Irrigate, Patient, Undo, Set>;

template <class T>
std::vector<FieldRef> fields_in(T& part) {
  detail::FieldCollector collect;
  T::describe(part, collect);
  return std::move(collect.fields);
}

// A file being read: the declared parts, and what no range can say.
class ScriptReader {
 public:
  ScriptReader(const JsonFile& file, Script& script) : file_(file), script_(script) {}

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
      script_.camera = Script::Camera{vec(camera.centre_mm), camera.radius_mm, direction(*c, "camera", "eye", camera.eye)};
    }
    const JsonValue& waypoints = read_waypoints(root, "", script_);
    read_hands(root);
    int number = 0;
    const JsonValue* const actions = root.find("actions");
    if (actions != nullptr && actions->kind != JsonValue::Kind::list) throw file_.wrong(*actions, "\"actions\" must be a list");
    for (std::size_t a = 0; actions != nullptr && a < actions->items.size(); ++a) {
      const std::string where = "action " + std::to_string(++number);
      const std::size_t before = script_.actions.size();
      action(actions->items[a], where);
      if (before > 0 && script_.actions[before].t_s < script_.actions[before - 1].t_s)
        throw file_.wrong(actions->items[a], where + ": it begins before the one above has ended",
                          "actions stand in the order of their times");
    }
    if (!(script_.seconds() > 0)) throw file_.wrong(waypoints, "the script takes no time", "give a last waypoint with \"t_s\" above 0");
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
  int located(const JsonValue& at, const std::string& where, F&& f) {
    try {
      return f();
    } catch (const Error& e) {
      throw file_.wrong(at, where + ": " + e.what(), e.advice());
    }
  }
  Vec3 direction(const JsonValue& object, const std::string& where, const char* key, const Triple& t) {
    const Vec3 v = vec(t);
    const JsonValue* const at = object.find(key);
    if (!(length(v) > 1e-9))
      throw file_.wrong(at != nullptr ? *at : object,
                        (where.empty() ? "" : where + ": ") + "\"" + key + "\" is a direction and has no length");
    return normalized(v);
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
    const JsonValue& waypoints = needed(of, "waypoints", JsonValue::Kind::list, "[{\"t_s\": 0, \"at_mm\": [80, 24, -26]}, ...]");
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
    if (hands->items.size() >= kMostHands)
      throw file_.wrong(*hands, "there are " + std::to_string(hands->items.size()) + " hands besides the first",
                        "at most " + std::to_string(kMostHands - 1));
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
        throw file_.wrong(*w.find("pedal"), where + ": the pedal is down and \"drill\" is false", "leave out one of the two");
      hand.waypoints.push_back({p.t_s, vec(p.at_mm), p.drill, p.pedal});
    }
  }
  void must_rise(double t_s, const JsonValue& w, const std::string& where, const Strokes& hand) {
    if (!hand.waypoints.empty() && !(t_s > hand.waypoints.back().t_s))
      throw file_.wrong(w, where + ": times must rise, but the one above ends at " + format_number(hand.waypoints.back().t_s) + " s");
  }
  // Circles that open and close between the middle and the rim of a bowl, a little deeper each time.
  void add_cavity(double begin_s, const Cavity& c, Vec3 in, const JsonValue& w, const std::string& where, Strokes& hand) {
    must_rise(begin_s, w, where, hand);
    const Vec3 u = any_perpendicular(in), v = cross(in, u);
    constexpr double kStep = 0.05, kSwaysPerS = 0.25;
    for (double t = 0; t < c.over_s; t += kStep) {
      const double share = t / c.over_s, sway = std::abs(std::fmod(kSwaysPerS * t, 2.0) - 1);
      const double circle = c.radius_mm * (1 - sway);
      const portable::SinCos turn = portable::sin_cos_turns(c.turns_per_s * t);
      // A bowl: less deep towards its rim.
      const double depth = c.depth_mm * share * (1 - 0.4 * (circle / c.radius_mm) * (circle / c.radius_mm));
      hand.waypoints.push_back({begin_s + t, vec(c.centre_mm) + in * depth + u * (circle * turn.cos) + v * (circle * turn.sin), true});
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
      throw file_.wrong(entry, where + ": it says more than one thing to do", "give each an entry of its own, with its own \"t_s\"");
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

  void act(double t, const Saw& s, const JsonValue& j, const std::string& where) {
    SawCut cut{vec(s.at_mm), direction(j, where, "normal", s.normal), direction(j, where, "along", s.along), s.kerf_mm, s.length_mm,
               s.depth_mm};
    if (j.find("along") != nullptr && length(cross(cut.normal, cut.along)) < 1e-6)
      throw file_.wrong(j, where + ": \"along\" lies along \"normal\"", "the length of the blade lies across its normal");
    // As it is written: the cut takes any length.
    cut.normal = vec(s.normal);
    cut.along = vec(s.along);
    add(t, SceneAction::saw(cut, s.piece < 0 ? SceneAction::kNobody : static_cast<std::uint32_t>(s.piece)));
  }
  void act(double t, const GuidePart& g, const JsonValue& j, const std::string& where) {
    add(t, SceneAction::cutting_guide({vec(g.at_mm), direction(j, where, "normal", g.normal), g.within_mm},
                                      static_cast<std::uint32_t>(g.hand)));
  }
  void act(double t, const SplitPart& s, const JsonValue&, const std::string&) { add(t, SceneAction::split(s.least_mm3)); }
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
    const Vec3 axis = direction(j, where, "axis", m.axis), about = vec(m.about_mm), from = vec(now.shift), to = vec(m.shift_mm);
    steps(t, m.over_s, [&](double share) {
      const double turn = now.turn_deg + (m.turn_deg - now.turn_deg) * share;
      return SceneAction::move(piece,
                               RigidTransform{{}, from + (to - from) * share} * rotation_about(about, axis, turn * std::numbers::pi / 180));
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
      throw file_.wrong(*j.find("pieces"), where + ": \"pieces\" are one, or two that are not the same");
    add(t,
        SceneAction::attach(plate(j, where, a.plate), {axes_of(j, where, a.x, a.z), vec(a.at_mm)}, static_cast<std::uint32_t>(a.pieces[0]),
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
    steps(t, s.over_s, [&](double share) { return SceneAction::suction(sucker_ + (goal - sucker_) * share, s.radius_mm, s.mm3_per_s); });
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
  void act(double t, const Undo&, const JsonValue&, const std::string&) { add(t, SceneAction::plain(ActionKind::undo)); }

  // Each is an action of its own, in the order of the settings; as they are in the file, so that what is said of none is left alone.
  void act(double t, const Set& s, const JsonValue& j, const std::string& where) {
    if (j.members.empty()) throw file_.wrong(j, where + ": it names no setting");
    for (std::size_t n = 0; n < setting_names().size(); ++n) {
      if (j.find(setting_names()[n]) != nullptr)
        add(t, SceneAction::setting(static_cast<std::uint32_t>(n), setting_value(static_cast<int>(n), s.params)));
    }
  }

  const JsonFile& file_;
  Script& script_;
  std::map<std::uint32_t, Place> places_;
  std::map<std::uint32_t, double> opening_;
  Vec3 sucker_;
  double sucking_ = 0;
};

template <class T>
ordered_json object_schema() {
  T part;
  ordered_json s{
      {"type", "object"}, {"additionalProperties", false}, {"required", ordered_json::array()}, {"properties", ordered_json::object()}};
  for (const FieldRef& f : fields_in(part)) {
    s["properties"][std::string(f.doc.name)] = ordered_json::parse(field_schema(f).dump());
    if (f.doc.needed) s["required"].push_back(f.doc.name);
  }
  return s;
}

}  // namespace

Script load_script(const fs::path& path) {
  Script script;
  const JsonFile file(read_text(path), path.string());
  ScriptReader(file, script).read();
  return script;
}

std::string script_json(const Script& script) {
  const Instrument& held = instrument_of(static_cast<std::uint8_t>(script.tool));
  ordered_json j;
  j["osteotome_strokes"] = 1;
  if (const Burr* const burr = held.as_burr()) {
    j["burr"] = {{"kind", EnumNames<BurrKind>::values[static_cast<std::size_t>(burr->kind)]},
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
  ordered_json root{{"$schema", "https://json-schema.org/draft/2020-12/schema"}, {"title", "Script of strokes of Osteotome"}};
  s["properties"]["osteotome_strokes"] = {{"const", 1}};
  s["properties"]["burr"] = object_schema<BurrPart>();
  s["properties"]["camera"] = object_schema<CameraPart>();
  ordered_json cavity = object_schema<When>();
  cavity["properties"]["cavity"] = object_schema<Cavity>();
  cavity["required"].push_back("cavity");
  s["properties"]["waypoints"] = {{"type", "array"}, {"minItems", 1}, {"items", {{"oneOf", {object_schema<Point>(), cavity}}}}};
  ordered_json hand = object_schema<HandPart>();
  hand["properties"]["waypoints"] = s["properties"]["waypoints"];
  hand["required"].push_back("waypoints");
  s["properties"]["hands"] = {{"type", "array"}, {"maxItems", kMostHands - 1}, {"items", hand}};
  ordered_json any = ordered_json::array();
  const auto add = [&]<class F>(const F&) {
    ordered_json entry = object_schema<When>();
    ordered_json what = object_schema<F>();
    what["description"] = F::kHelp;
    if (what["properties"].contains("pieces")) {
      what["properties"]["pieces"]["minItems"] = 1;
      what["properties"]["pieces"]["maxItems"] = 2;
    }
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

}  // namespace osteo
