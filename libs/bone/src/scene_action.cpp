#include <cmath>

#include "osteo/bone/world.h"

namespace osteo {
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

SceneAction SceneAction::grip(std::uint32_t plate, const RigidTransform& hand_from_plate) {
  SceneAction a = with_transform(ActionKind::grip, hand_from_plate);
  a.item = plate;
  return a;
}

SceneAction SceneAction::attach(std::uint32_t plate, const RigidTransform& world_from_plate, std::uint32_t body, std::uint32_t other) {
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

SceneAction SceneAction::irrigate(Vec3 at_mm, double radius_mm, double share_per_s) {
  SceneAction a = plain(ActionKind::irrigate);
  put(a.values, 0, at_mm);
  a.values[3] = radius_mm;
  a.values[4] = share_per_s;
  return a;
}

SceneAction SceneAction::yield(Vec3 at_mm, Vec3 normal, double force_n, double stiffness_n_per_mm) {
  SceneAction a = plain(ActionKind::yield);
  put(a.values, 0, at_mm);
  put(a.values, 3, normal);
  a.values[6] = force_n;
  a.values[7] = stiffness_n_per_mm;
  return a;
}

RigidTransform SceneAction::transform() const {
  RigidTransform t;
  for (std::size_t c = 0; c < 3; ++c) t.rotation.column[c] = vector_at(values, 3 * c);
  t.shift_mm = vector_at(values, 9);
  return t;
}

std::string_view name_of(ActionKind kind) {
  static constexpr std::array<std::string_view, 15> kNames{"?",      "hold", "resume",  "saw",      "split", "move",  "grip",  "attach",
                                                           "detach", "open", "suction", "irrigate", "undo",  "yield", "stroke"};
  const auto n = static_cast<std::size_t>(kind);
  return kNames[n < kNames.size() ? n : 0];
}

}  // namespace osteo
