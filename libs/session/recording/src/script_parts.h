// What a script of strokes may hold. Private to libs/session/recording.
#pragma once
#include <tuple>

#include "osteo/simulation/bone/burr.h"
#include "osteo/simulation/bone/plates.h"
#include "osteo/simulation/bone/posture.h"
#include "osteo/simulation/haptics/haptic_setup.h"
#include "saw_fields.h"

namespace osteo::inline session::script {

// Of what a script may hold each part is declared once: name, help, unit, range. Reading and the schema both go by
// that.
inline constexpr double kLongestS = 21600, kMaxPieces = 1e6;

struct Head {
  int version = 1;
  std::string schema, about, instrument;
  Triple axis{0, 0, 1};
  static void describe(Head& p, auto& visit) {
    visit({"osteotome_strokes", "version of the format", "", 1, 1, true}, p.version);
    visit({"$schema", "where its schema lies, for editors"}, p.schema);
    visit({"about", "what it shows"}, p.about);
    visit({"instrument", "name of the instrument in place of a burr, like saw 25 mm"}, p.instrument);
    visit({"axis", "direction from the burr to the handle, LPS", "", -kFarMm, kFarMm, true}, p.axis);
  }
};

struct BurrPart {
  BurrKind kind = BurrKind::cutting;
  double diameter_mm = 4;
  BurrShape shape = BurrShape::ball;
  static void describe(BurrPart& p, auto& visit) {
    visit({"kind", "kind of the burr's edges", "", 0, 0, true}, p.kind);
    visit({"diameter_mm", "1, 2, 3, 4, 5, 6 or 7", "mm", 1, 7, true}, p.diameter_mm);
    visit({"shape", "shape of the burr's head"}, p.shape);
  }
};

struct CameraPart {
  Triple centre_mm{}, eye{};
  double radius_mm = 32;
  static void describe(CameraPart& p, auto& visit) {
    visit({"centre_mm", "middle of the pictures, LPS", "mm", -kFarMm, kFarMm, true}, p.centre_mm);
    visit({"radius_mm", "radius of what is shown", "mm", 1, 1000, true}, p.radius_mm);
    visit({"eye", "direction from there towards the viewer", "", -kFarMm, kFarMm, true}, p.eye);
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
    visit({"instrument", "name of the instrument, like suction tube 8 Fr or cutting 4 mm", "", 0, 0, true},
          p.instrument);
    visit({"axis", "direction from the tip to the handle, LPS", "", -kFarMm, kFarMm, true}, p.axis);
  }
};

struct Cavity {
  Triple centre_mm{}, towards{};
  double radius_mm = 5, depth_mm = 5, over_s = 10, turns_per_s = 1.2;
  static void describe(Cavity& p, auto& visit) {
    visit({"centre_mm", "middle of its rim, LPS", "mm", -kFarMm, kFarMm, true}, p.centre_mm);
    visit({"towards", "into the bone", "", -kFarMm, kFarMm, true}, p.towards);
    visit({"radius_mm", "radius of the burr's circles at the rim", "mm", 0.1, 100, true}, p.radius_mm);
    visit({"depth_mm", "in the middle, at the end", "mm", 0, 200, true}, p.depth_mm);
    visit({"over_s", "how long it takes", "s", 0.1, 3600, true}, p.over_s);
    visit({"turns_per_s", "circles a second", "1/s", 0.01, 20}, p.turns_per_s);
  }
};

struct Saw {
  static constexpr const char *kName = "saw", *kHelp = "take out a blade's width";
  std::string planned;
  SawFields blade;
  int piece = -1;
  static void describe(Saw& p, auto& visit) {
    visit({"planned", "a planned cut of the case by its name, in place of what follows but the piece"}, p.planned);
    SawFields::describe(p.blade, visit, false);
    visit({"piece", "only this one; -1: all", "", -1, kMaxPieces}, p.piece);
  }
};

struct GuidePart {
  static constexpr const char *kName = "cutting_guide",
                              *kHelp = "a slot that holds a hand's saw in a plane, until the next of these";
  std::string planned;
  Triple at_mm{}, normal{};
  double within_mm = 2;
  int hand = 0;
  static void describe(GuidePart& p, auto& visit) {
    visit({"planned", "a planned cut of the case by its name, in place of what follows but the hand"}, p.planned);
    visit({"at_mm", "a point of the plane, LPS", "mm", -kFarMm, kFarMm}, p.at_mm);
    visit({"normal", "across the plane", "", -kFarMm, kFarMm}, p.normal);
    visit({"within_mm", "a saw this near slips in; 0: the guide is taken away", "mm", 0, SceneAction::kMaxSlotMm},
          p.within_mm);
    visit({"hand", "whose saw", "", 0, kMaxHands - 1}, p.hand);
  }
};

struct SplitPart {
  static constexpr const char *kName = "split", *kHelp = "separate what is not connected";
  double least_mm3 = 50;
  static void describe(SplitPart& p, auto& visit) {
    visit({"least_mm3", "what is smaller becomes dust", "mm3", 0, 1e6}, p.least_mm3);
  }
};

struct Move {
  static constexpr const char *kName = "move",
                              *kHelp = "a piece, and all that is plated to it, from where it was in the case";
  int piece = 0;
  Triple shift_mm{}, axis{0, 0, 1}, about_mm{};
  double turn_deg = 0, over_s = 0;
  static void describe(Move& p, auto& visit) {
    visit({"piece", "which", "", 0, kMaxPieces, true}, p.piece);
    visit({"shift_mm", "where to, after the turn; left out: as far as before", "mm", -kFarMm, kFarMm}, p.shift_mm);
    visit({"turn_deg", "about axis through about_mm; left out: as far as before", "deg", -360, 360}, p.turn_deg);
    visit({"axis", "axis of the rotation", "", -kFarMm, kFarMm}, p.axis);
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
    visit({"shift_mm", "shift of the middle, in the hand's frame", "mm", -1000, 1000}, p.shift_mm);
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
    visit({"fragments", "one or two; the plate stays with the first", "", 0, kMaxPieces, true}, p.pieces);
  }
};

struct Detach {
  static constexpr const char *kName = "detach", *kHelp = "take a plate off";
  int number = 1;
  static void describe(Detach& p, auto& visit) {
    visit({"number", "number of the plate in the order of fixing, from 1", "", 1, kMaxPieces, true}, p.number);
  }
};

struct Open {
  static constexpr const char *kName = "open", *kHelp = "turn the screw of a distractor";
  int number = 1;
  double opening_mm = 0, over_s = 0;
  static void describe(Open& p, auto& visit) {
    visit({"number", "number of the plate in the order of fixing, from 1", "", 1, kMaxPieces, true}, p.number);
    visit({"opening_mm", "opening of the gap at the end", "mm", 0, 100, true}, p.opening_mm);
    visit({"over_s", "how long it takes", "s", 0, 3600}, p.over_s);
  }
};

struct Suction {
  static constexpr const char *kName = "suction", *kHelp = "a suction tube, until the next of these";
  Triple at_mm{};
  double radius_mm = 4, mm3_per_s = 60, over_s = 0;
  static void describe(Suction& p, auto& visit) {
    visit({"at_mm", "where it comes to, LPS", "mm", -kFarMm, kFarMm}, p.at_mm);
    visit({"radius_mm", "how far it reaches", "mm", 0.1, SceneAction::kMaxReachMm}, p.radius_mm);
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
    visit({"radius_mm", "how far it falls at most before it spreads", "mm", 0.1, SceneAction::kMaxReachMm},
          p.radius_mm);
    visit({"mm3_per_s", "water per second (0: none)", "mm3/s", 0, 1e5}, p.mm3_per_s);
  }
};

struct Patient {
  static constexpr const char *kName = "patient", *kHelp = "lies so from here on: where dust and water fall to";
  Posture position = Posture::supine;
  double head_turned_deg = 0;
  static void describe(Patient& p, auto& visit) {
    visit({"position", "position of the patient"}, p.position);
    visit({"head_turned_deg", "positive: the face towards the left shoulder", "deg", -180, 180}, p.head_turned_deg);
  }
};

struct Undo {
  static constexpr const char *kName = "undo", *kHelp = "take back the last saw, split, move, attach, detach or open";
  static void describe(Undo&, auto&) {}
};

struct Simulate {
  static constexpr const char *kName = "simulate", *kHelp = "what begins here with the bone as it is, or ends";
  bool dust = false, heat = false;
  static void describe(Simulate& p, auto& visit) {
    visit({"dust", "bone dust and water"}, p.dust);
    visit({"heat", "how warm drilling makes bone"}, p.heat);
  }
};

// Its keys are the names of the haptic settings, which are declared where they belong.
struct Set {
  static constexpr const char *kName = "set", *kHelp = "haptic settings that have other values from here on";
  HapticsParams params;
  static void describe(Set& p, auto& visit) { HapticsParams::describe(p.params, visit); }
};

using Forms = std::tuple<Saw, GuidePart, SplitPart, Move, Grip, Attach, Detach, Open, Suction, Irrigate, Patient, Undo,
                         Simulate, Set>;

}  // namespace osteo::inline session::script
