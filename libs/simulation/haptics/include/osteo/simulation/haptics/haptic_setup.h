// Everything that decides what a rehearsal feels like.
#pragma once
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "osteo/simulation/bone/structure_map.h"
#include "osteo/simulation/haptics/contact.h"
#include "osteo/simulation/haptics/curve_constraint.h"
#include "osteo/simulation/haptics/guard.h"

namespace osteo::inline simulation {

struct EffectParams {
  bool shaft = true;
  /// Bone holds the shaft: it stops at a rim. Otherwise it presses there and a hand can push it through thin bone.
  /// Windows turn it on; a script, whose path nobody corrects, has it off unless its settings say so.
  bool held_shaft = false;
  bool fail_safe = true;
  double drag = 0.15;
  bool left_handed = false;
  double speed_rpm = Burr::kNominalRpm;
  double spin_up_s = 0.05;
  double spin_down_s = 0.05;
  bool vibration = true;

  static void describe(EffectParams& p, auto& visit) {
    visit({"shaft", "the shaft collides too"}, p.shaft);
    visit({"held_shaft", "bone holds the shaft at a rim, so that it cannot be pushed through; windows turn this on"},
          p.held_shaft);
    visit({"fail_safe", "deep in bone, where the burr has no direction of its own, push along a distance map"},
          p.fail_safe);
    visit({"drag", "pull of the teeth along the surface, for each newton pressed, at the equator (a guess)", "", 0, 2},
          p.drag);
    visit({"left_handed", "the burr rotates the other way"}, p.left_handed);
    visit({"speed_rpm", "speed of the burr with the pedal down; removal is in proportion", "rpm", 0, 200000},
          p.speed_rpm);
    visit({"spin_up_s", "time constant with which the burr's speed follows the pedal upwards (a guess)", "s", 0, 10},
          p.spin_up_s);
    visit({"spin_down_s", "and downwards (a guess)", "s", 0, 10}, p.spin_down_s);
    visit({"vibration", "the running drill shakes the hand"}, p.vibration);
  }
};

/// Everything that decides what a session feels like; written into its header.
struct HapticsParams {
  using Params = HapticsParams;
  ContactParams contact;
  EffectParams effects;
  GuardParams guard;

  static void describe(HapticsParams& p, auto& visit) {
    ContactParams::describe(p.contact, visit);
    EffectParams::describe(p.effects, visit);
    GuardParams::describe(p.guard, visit);
  }
};

/// Everything that decides what a rehearsal feels like; a session's header holds it. An empty part costs nothing.
struct HapticSetup {
  HapticsParams params;
  DeviceTraits device;  ///< of hand 0
  std::vector<DeviceTraits>
      more_devices;  ///< of hands 1, 2, ...: as many as there are hands besides, at most kMaxHands - 1
  std::map<int, ContactMethod>
      tool_methods;  ///< index in instrument_library() -> another method than params.contact.method for that tool
  std::optional<bool>
      hardness;  ///< removal goes by the HU of the case; empty: where it keeps them, which anatomy_of() settles
  std::string hardness_json;        ///< the law, as parse_hardness reads it; empty: the built-in one
  std::string structures;           ///< hash of the critical structures that are watched; empty: none
  std::vector<std::string> opened;  ///< names of structures that the operation enters: nobody is warned of them
  std::vector<Vec3> curve;          ///< points of a virtual fixture for hand 0, in mm; fewer than 2: none
  CurveConstraintParams curve_params;
  std::string
      texture_json;  ///< of what tools slide over, as parse_texture reads it; empty: none, and nothing is spent on it
  std::string vibration_json;  ///< a spectrum as parse_vibration reads it; empty: the built-in model

  [[nodiscard]] std::size_t hands() const { return 1 + more_devices.size(); }
  [[nodiscard]] const DeviceTraits& device_of(std::size_t hand) const {
    return hand == 0 ? device : more_devices[hand - 1];
  }
};

/// Settings by name: the fields of HapticsParams, in the order of their declaration. Their numbers (SceneAction::item
/// of a `setting`) are those of this build; a session's header lists names in order, so that a reader of another build
/// finds its own.
[[nodiscard]] const std::vector<std::string>& setting_names();
/// -1: there is none of that name.
[[nodiscard]] int setting_number(std::string_view name);
/// The value that an action carries: of a flag 0 or 1, of a choice its index. Error(usage), as FieldRef::from_text, for
/// text that is none.
[[nodiscard]] double setting_value(int number, std::string_view text);
/// Now. `number` is one of setting_names().
[[nodiscard]] double setting_value(int number, const HapticsParams& params);
/// Sets it. Error(usage) with name and range, when there is no such setting or value; then nothing is changed.
void change_setting(HapticsParams& params, std::uint32_t number, double value);

/// What is known of the patient besides bone; what is null costs nothing.
struct Anatomy {
  std::shared_ptr<const Hardness> hardness;         ///< of the case's bone, voxel by voxel
  std::shared_ptr<const Hardness> region_hardness;  ///< of its finer region
  std::shared_ptr<const StructureMap> structures;
};

}  // namespace osteo::inline simulation
