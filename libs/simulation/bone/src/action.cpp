#include "osteo/simulation/bone/action.h"

#include <algorithm>

namespace osteo::inline simulation {
namespace {

void put(std::array<double, 12>& values, std::size_t at, Vec3 v) {
  for (std::size_t a = 0; a < 3; ++a) values[at + a] = v[a];
}
Vec3 vector_at(const std::array<double, 12>& values, std::size_t at) {
  return {values[at], values[at + 1], values[at + 2]};
}
SceneAction with_transform(ActionKind kind, const RigidTransform& t) {
  SceneAction a = SceneAction::plain(kind);
  for (std::size_t c = 0; c < 3; ++c) put(a.values, 3 * c, t.rotation.column[c]);
  put(a.values, 9, t.shift_mm);
  return a;
}

constexpr ActionValue kSaw[] = {{"at_x", "mm"},    {"at_y", "mm"},    {"at_z", "mm"},   {"normal_x", "1"},
                                {"normal_y", "1"}, {"normal_z", "1"}, {"along_x", "1"}, {"along_y", "1"},
                                {"along_z", "1"},  {"kerf", "mm"},    {"length", "mm"}, {"depth", "mm"}};
// A rotation by its columns, then the shift.
constexpr ActionValue kPose[] = {{"x_x", "1"}, {"x_y", "1"},      {"x_z", "1"},      {"y_x", "1"},
                                 {"y_y", "1"}, {"y_z", "1"},      {"z_x", "1"},      {"z_y", "1"},
                                 {"z_z", "1"}, {"shift_x", "mm"}, {"shift_y", "mm"}, {"shift_z", "mm"}};
constexpr ActionValue kSplit[] = {{"least", "mm3"}};
constexpr ActionValue kOpen[] = {{"opening", "mm"}};
constexpr ActionValue kSuction[] = {
    {"at_x", "mm"}, {"at_y", "mm"}, {"at_z", "mm"}, {"radius", "mm"}, {"rate", "mm3/s"}};
constexpr ActionValue kIrrigate[] = {
    {"at_x", "mm"}, {"at_y", "mm"}, {"at_z", "mm"}, {"radius", "mm"}, {"rate", "mm3/s"}};
constexpr ActionValue kPosture[] = {{"down_x", "1"}, {"down_y", "1"}, {"down_z", "1"}};
constexpr ActionValue kSoftPush[] = {{"at_x", "mm"},    {"at_y", "mm"},    {"at_z", "mm"}, {"normal_x", "1"},
                                     {"normal_y", "1"}, {"normal_z", "1"}, {"force", "N"}, {"stiffness", "N/mm"}};
constexpr ActionValue kSetting[] = {{"value", "as the setting's"}};
constexpr ActionValue kSimulate[] = {{"on", "1"}};

constexpr ActionValue kGuide[] = {{"hand", "1"}, {"stiffness", "N/mm"}, {"damping", "N s/m"}, {"forward", "1"},
                                  {"most", "N"}, {"dead_zone", "mm"},   {"own_contact", "1"}, {"brake", "N s/m"}};

constexpr ActionValue kCuttingGuide[] = {{"at_x", "mm"},    {"at_y", "mm"},    {"at_z", "mm"},   {"normal_x", "1"},
                                         {"normal_y", "1"}, {"normal_z", "1"}, {"within", "mm"}, {"play", "mm"},
                                         {"up_x", "mm"},    {"up_y", "mm"},    {"up_z", "mm"},   {"length", "mm"}};

constexpr auto kLast = static_cast<std::size_t>(ActionKind::behind_last) - 1;
constexpr std::array<ActionRow, kLast> kTable{{
    {.kind = ActionKind::hold, .name = "hold", .help = "nothing is removed from here on"},
    {.kind = ActionKind::resume, .name = "resume", .help = "it may be again", .ends_hold = true},
    {.kind = ActionKind::saw,
     .name = "saw",
     .help = "take out a blade's width",
     .changes_world = true,
     .changes_touch = true,
     .reads_bone = true,
     .ends_hold = true,
     .body = "only this piece; none: all",
     .values = kSaw},
    {.kind = ActionKind::split,
     .name = "split",
     .help = "separate what is not connected; what is smaller than the least becomes dust",
     .changes_world = true,
     .changes_touch = true,
     .reads_bone = true,
     .ends_hold = true,
     .values = kSplit},
    {.kind = ActionKind::move,
     .name = "move",
     .help = "put a piece somewhere, and all that is plated to it",
     .changes_world = true,
     .changes_touch = true,
     .last_counts = true,
     .ends_hold = true,
     .body = "the piece",
     .values = kPose},
    {.kind = ActionKind::grip,
     .name = "grip",
     .help = "take a plate into the hand, turn it, or put it away",
     .changes_touch = true,
     .last_counts = true,
     .item = "plate, by its place in the library; none: the hand's instrument again",
     .hand = "which",
     .values = kPose},
    {.kind = ActionKind::attach,
     .name = "attach",
     .help = "fix a plate to one piece or two",
     .changes_world = true,
     .changes_touch = true,
     .reads_bone = true,
     .ends_hold = true,
     .body = "the piece that the plate stays with",
     .other = "the second piece, which a distractor moves; none: no second",
     .item = "plate, by its place in the library",
     .hand = "that is empty afterwards",
     .values = kPose},
    {.kind = ActionKind::detach,
     .name = "detach",
     .help = "take a plate off",
     .changes_world = true,
     .changes_touch = true,
     .ends_hold = true,
     .item = "number of the fixed plate"},
    {.kind = ActionKind::open,
     .name = "open",
     .help = "set the gap of a distractor",
     .changes_world = true,
     .changes_touch = true,
     .last_counts = true,
     .ends_hold = true,
     .item = "number of the fixed plate",
     .values = kOpen},
    {.kind = ActionKind::suction,
     .name = "suction",
     .help = "a suction tube at a place, until the next of these; rate 0: away",
     .last_counts = true,
     .moves_dust = true,
     .values = kSuction},
    {.kind = ActionKind::irrigate,
     .name = "irrigate",
     .help = "water at a place, which falls within the radius, until the next of these; rate 0: away",
     .last_counts = true,
     .moves_dust = true,
     .values = kIrrigate},
    {.kind = ActionKind::undo,
     .name = "undo",
     .help = "take back the last stroke of the burr, saw, split, move, attach, detach or open",
     .changes_world = true,
     .changes_touch = true,
     .reads_bone = true,
     .ends_hold = true},
    {.kind = ActionKind::soft_push,
     .name = "soft_push",
     .help = "a plane that soft tissue pushes with, harder where the tool is deeper, until the next of these",
     .made_often = true,
     .hand = "whose tool it pushes",
     .values = kSoftPush},
    {.kind = ActionKind::setting,
     .name = "setting",
     .help = "one of the haptic settings has another value from here on",
     .changes_touch = true,
     .last_counts = true,
     .ends_hold = true,
     .item = "number of the setting, as the session's header lists them",
     .values = kSetting},
    {.kind = ActionKind::stroke,
     .name = "stroke",
     .help = "the burr has taken no bone for 0.3 s: what it took since the last stroke or step is one step of undo",
     .reads_bone = true,
     .by_servo = true},
    {.kind = ActionKind::posture,
     .name = "patient_position",
     .help = "the patient's position changes: where dust and water fall to",
     .last_counts = true,
     .moves_dust = true,
     .values = kPosture},
    {.kind = ActionKind::guide,
     .name = "guide",
     .help = "one hand is led by another from here on: by a spring, a damper and the force that the other feels",
     .item = "which hand leads",
     .values = kGuide},
    {.kind = ActionKind::cutting_guide,
     .name = "cutting_guide",
     .help = "a slot that holds the hand's saw in a plane, until the next of these; within 0: none; with play the "
             "blade moves "
             "in it between faces that are as high as `up` and as long as `length`",
     .changes_touch = true,
     .last_counts = true,
     .hand = "whose saw",
     .values = kCuttingGuide},
    {.kind = ActionKind::simulate,
     .name = "simulate",
     .help = "dust and water, or heat, begin here with the bone as it is (1), or end and are gone (0)",
     .reads_bone = true,
     .ends_hold = true,
     .begins_state = true,
     .item = "what: 0 dust and water, 1 heat",
     .values = kSimulate},
}};

// A kind without its row, or out of order, does not compile.
constexpr bool in_order() {
  for (std::size_t i = 0; i < kTable.size(); ++i) {
    if (static_cast<std::size_t>(kTable[i].kind) != i + 1 || kTable[i].name.empty()) return false;
  }
  return true;
}
static_assert(in_order());

constexpr ActionRow kUnknown{.kind = ActionKind{}, .name = "?", .help = "unknown"};

}  // namespace

SceneAction SceneAction::plain(ActionKind kind) {
  SceneAction a;
  a.kind = static_cast<std::uint32_t>(kind);
  return a;
}

SceneAction SceneAction::saw(const SawCut& cut, std::uint32_t body) {
  SceneAction a = plain(ActionKind::saw);
  a.body = body;
  put(a.values, 0, cut.at_mm);
  put(a.values, 3, cut.normal);
  put(a.values, 6, cut.along);
  a.values[9] = cut.kerf_mm;
  a.values[10] = cut.length_mm;
  a.values[11] = cut.depth_mm;
  return a;
}

SawCut SceneAction::saw_cut() const {
  return {vector_at(values, 0), vector_at(values, 3), vector_at(values, 6), values[9], values[10], values[11]};
}

SceneAction SceneAction::split(double least_mm3) {
  SceneAction a = plain(ActionKind::split);
  a.values[0] = least_mm3;
  return a;
}

SceneAction SceneAction::move(std::uint32_t body, const RigidTransform& world_from_body) {
  SceneAction a = with_transform(ActionKind::move, world_from_body);
  a.body = body;
  return a;
}

SceneAction SceneAction::grip(std::uint32_t plate, const RigidTransform& hand_from_plate, std::uint32_t hand) {
  SceneAction a = with_transform(ActionKind::grip, hand_from_plate);
  a.item = plate;
  a.hand = hand;
  return a;
}

SceneAction SceneAction::attach(std::uint32_t plate, const RigidTransform& world_from_plate, std::uint32_t body,
                                std::uint32_t other) {
  SceneAction a = with_transform(ActionKind::attach, world_from_plate);
  a.item = plate;
  a.body = body;
  a.other = other;
  return a;
}

SceneAction SceneAction::detach(std::uint32_t fixture) {
  SceneAction a = plain(ActionKind::detach);
  a.item = fixture;
  return a;
}

SceneAction SceneAction::open(std::uint32_t fixture, double opening_mm) {
  SceneAction a = plain(ActionKind::open);
  a.item = fixture;
  a.values[0] = opening_mm;
  return a;
}

SceneAction SceneAction::suction(Vec3 nozzle_mm, double radius_mm, double mm3_per_s) {
  SceneAction a = plain(ActionKind::suction);
  put(a.values, 0, nozzle_mm);
  a.values[3] = radius_mm;
  a.values[4] = mm3_per_s;
  return a;
}

SceneAction SceneAction::irrigate(Vec3 at_mm, double radius_mm, double mm3_per_s) {
  SceneAction a = plain(ActionKind::irrigate);
  put(a.values, 0, at_mm);
  a.values[3] = radius_mm;
  a.values[4] = mm3_per_s;
  return a;
}

SceneAction SceneAction::posture(Vec3 down) {
  SceneAction a = plain(ActionKind::posture);
  put(a.values, 0, down);
  return a;
}

SceneAction SceneAction::soft_push(Vec3 at_mm, Vec3 normal, double force_n, double stiffness_n_per_mm) {
  SceneAction a = plain(ActionKind::soft_push);
  put(a.values, 0, at_mm);
  put(a.values, 3, normal);
  a.values[6] = force_n;
  a.values[7] = stiffness_n_per_mm;
  return a;
}

SceneAction SceneAction::setting(std::uint32_t number, double value) {
  SceneAction a = plain(ActionKind::setting);
  a.item = number;
  a.values[0] = value;
  return a;
}

SceneAction SceneAction::simulate(Simulated what, bool on) {
  SceneAction a = plain(ActionKind::simulate);
  a.item = static_cast<std::uint32_t>(what);
  a.values[0] = on ? 1 : 0;
  return a;
}

SceneAction SceneAction::cutting_guide(const CuttingGuide& guide, std::uint32_t hand) {
  SceneAction a = plain(ActionKind::cutting_guide);
  put(a.values, 0, guide.at_mm);
  put(a.values, 3, guide.normal);
  a.values[6] = guide.within_mm;
  a.values[7] = guide.play_mm;
  put(a.values, 8, guide.up_mm);
  a.values[11] = guide.length_mm;
  a.hand = hand;
  return a;
}

CuttingGuide SceneAction::guide() const {
  const Vec3 normal = vector_at(values, 3);
  if (!(length(normal) > 1e-9)) return {};
  CuttingGuide guide{vector_at(values, 0), normalized(normal), values[6]};
  if (values[7] > 0) {
    guide.play_mm = values[7];
    guide.up_mm = vector_at(values, 8);
    guide.up_mm -= guide.normal * dot(guide.up_mm, guide.normal);
    guide.length_mm = values[11];
  }
  return guide;
}

RigidTransform SceneAction::transform() const {
  RigidTransform t;
  for (std::size_t c = 0; c < 3; ++c) t.rotation.column[c] = vector_at(values, 3 * c);
  t.shift_mm = vector_at(values, 9);
  return t;
}

std::span<const ActionRow> action_table() {
  return kTable;
}

const ActionRow* find_row(std::uint32_t kind) {
  return kind >= 1 && kind <= kTable.size() ? &kTable[kind - 1] : nullptr;
}

const ActionRow& row_of(const SceneAction& action) {
  const ActionRow* const row = find_row(action.kind);
  return row != nullptr ? *row : kUnknown;
}

std::string_view name_of(ActionKind kind) {
  return row_of(SceneAction::plain(kind)).name;
}

}  // namespace osteo::inline simulation
