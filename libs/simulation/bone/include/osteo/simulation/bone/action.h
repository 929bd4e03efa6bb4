// What can be done to a scene besides drilling, and one table that says of each kind what it is.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <string_view>

#include "osteo/core/data/rigid_transform.h"
#include "osteo/simulation/bone/saw.h"

namespace osteo::inline simulation {

/// Hands in a scene, at most.
inline constexpr std::uint32_t kMaxHands = 4;

/// Numbers are those of session files: a new kind goes to the end, with its row in action_table().
enum class ActionKind : std::uint32_t {
  hold = 1,       ///< nothing may be removed until the next action that ends it: something is being prepared
  resume,         ///< it may again
  saw,            ///< take out a blade's width
  split,          ///< take apart what does not are connected
  move,           ///< put a piece somewhere, and all that is plated to it
  grip,           ///< take a plate into a hand, turn it, or put it away
  attach,         ///< fix a plate to one piece or two
  detach,         ///< take a plate off
  open,           ///< set the gap of a distractor
  suction,        ///< a sucker at a place; rate 0: away
  irrigate,       ///< water at a place; rate 0: away
  undo,           ///< take back the last stroke of the burr, saw, split, move, attach, detach or open
  soft_push,      ///< what soft tissue pushes with near the tool, until the next of these
  setting,        ///< one of the haptic settings has another value
  stroke,         ///< a stroke of the burr has ended: a step that undo can take back
  posture,        ///< the patient lies otherwise: what is down for dust and water
  guide,          ///< one hand is led by another from here on, or let go
  cutting_guide,  ///< a slot that holds a hand's saw in a plane, or none
  simulate,       ///< dust and water, or heat, begin with the bone as it is, or end
  behind_last
};

/// What is computed beside bone and force, and may begin or end at any tick. Numbers are those of session files.
enum class Simulated : std::uint32_t { dust, heat, behind_last };

/// One of them, at the beginning of a tick, as it is written to session files. What follows from it follows from it and
/// the scene alone.
struct SceneAction {
  static constexpr std::uint32_t kNobody = 0xffffffffU;
  static constexpr double kMaxReachMm = 50;                    ///< of a sucker and of water
  static constexpr double kMaxSlotMm = 10;                     ///< that a saw slips into a cutting guide from
  static constexpr double kMaxPlayMm = 3;                      ///< of a blade in a slot
  static constexpr double kLeastFaceMm = 1, kMaxFaceMm = 200;  ///< height and length of a slot's faces
  static constexpr double kPlateReachMm =
      5;  ///< attach: bone of each piece begins within this below the plate's underside

  std::uint64_t tick = 0;
  std::uint32_t kind = 0;         ///< ActionKind
  std::uint32_t body = kNobody;   ///< id of a piece; what for, and what the rest means: ActionRow
  std::uint32_t other = kNobody;  ///< id of a second piece
  std::uint32_t item = 0;         ///< index in plate_library(), id of a fixture, number of a setting, Simulated
  std::uint32_t hand = 0;         ///< whose tool or plate is meant
  std::uint32_t unused = 0;       ///< always 0
  std::array<double, 12> values{};

  [[nodiscard]] bool is(ActionKind k) const { return kind == static_cast<std::uint32_t>(k); }
  static SceneAction plain(ActionKind kind);                                ///< hold, resume, undo
  static SceneAction saw(const SawCut& cut, std::uint32_t body = kNobody);  ///< in the world
  static SceneAction split(double least_mm3);
  static SceneAction move(std::uint32_t body, const RigidTransform& world_from_body);
  static SceneAction grip(std::uint32_t plate, const RigidTransform& hand_from_plate = {}, std::uint32_t hand = 0);
  static SceneAction attach(std::uint32_t plate, const RigidTransform& world_from_plate, std::uint32_t body,
                            std::uint32_t other = kNobody);
  static SceneAction detach(std::uint32_t fixture);
  static SceneAction open(std::uint32_t fixture, double opening_mm);
  static SceneAction suction(Vec3 nozzle_mm, double radius_mm, double mm3_per_s);
  static SceneAction irrigate(Vec3 at_mm, double radius_mm, double mm3_per_s);
  static SceneAction posture(Vec3 down);  ///< unit, LPS of the case: down_of()
  /// A plane through `at`, pushing along `normal` (unit) with `force_n` there and more by `stiffness` for each mm
  /// deeper.
  static SceneAction soft_push(Vec3 at_mm, Vec3 normal, double force_n, double stiffness_n_per_mm);
  static SceneAction setting(std::uint32_t number, double value);
  static SceneAction simulate(Simulated what, bool on);
  /// Its normal need not be unit; of the slot's height only what lies in the plane counts.
  static SceneAction cutting_guide(const CuttingGuide& guide, std::uint32_t hand = 0);
  [[nodiscard]] SawCut saw_cut() const;
  [[nodiscard]] RigidTransform transform() const;
  [[nodiscard]] CuttingGuide guide() const;  ///< of a cutting_guide
};
static_assert(sizeof(SceneAction) == 128);

/// One of SceneAction::values: "at_x" in "mm"; the unit of a ratio or of a part of a direction is "1".
struct ActionValue {
  std::string_view name, unit;
};

/// All that others need to know of a kind of action. Whoever decides by kind asks here; only what an action does is
/// elsewhere (World::act, HapticRenderer::take, Dust).
struct ActionRow {
  ActionKind kind;
  std::string_view name;  ///< "saw": in session files, scripts and messages
  std::string_view help;
  bool changes_world = false;  ///< bodies, their poses, fixtures or densities may differ afterwards
  bool changes_touch = false;  ///< and what the servo touches: a new HapticScene goes with it
  bool reads_bone = false;     ///< what it does depends on densities, or it takes long: a hold comes before, so that a
                               ///< replay finds the same
  bool last_counts =
      false;  ///< of several in a row that wait, with the same body, other, item and hand, the last one is enough
  bool moves_dust = false;  ///< a state that dust and water obey until the next of its kind (position, suction), so
                            ///< readers that join later are told it again; not for what is done once
  bool ends_hold = false;   ///< after it, done or not, bone may be removed again
  bool by_servo =
      false;  ///< the servo tells of it by itself: nobody asks for it, and a replay does not do it but gets it again
  bool made_often = false;    ///< follows from what else is done, many times a second: not reported when it fails, and
                              ///< not kept for later
  bool begins_state = false;  ///< a state of its own begins with the scene as it is then, and follows from the stream
                              ///< from there on: readers are given that scene (Reader::begins)
  std::string_view body = {}, other = {}, item = {}, hand = {};  ///< what those name; empty: they mean nothing
  std::span<const ActionValue> values = {};                      ///< from the first on; the rest mean nothing
};

/// Changes of densities before it and after it have to be kept apart wherever only the last of each voxel is kept: it
/// depends on them, or it is a step of undo and so parts the burr's strokes.
[[nodiscard]] constexpr bool parts_changes(const ActionRow& row) {
  return row.reads_bone || row.changes_world;
}

/// One row for each kind, in their order.
[[nodiscard]] std::span<const ActionRow> action_table();
/// Null for what is no kind.
[[nodiscard]] const ActionRow* find_row(std::uint32_t kind);
/// Of an unknown kind: name "?", nothing else said.
[[nodiscard]] const ActionRow& row_of(const SceneAction& action);
[[nodiscard]] inline std::string_view name_of(const SceneAction& action) {
  return row_of(action).name;
}
[[nodiscard]] std::string_view name_of(ActionKind kind);

}  // namespace osteo::inline simulation
