#include "osteo/assessment/evidence/detail/saw_cuts.h"

#include <algorithm>

namespace osteo::inline assessment {

std::string_view CutMetric::moment_of(CutBy by, bool contact) {
  switch (by) {
    case CutBy::saw:
      return contact ? "contact with the saw" : "cut through by the saw";
    case CutBy::burr:
      return contact ? "contact with the burr" : "taken by the burr";
    case CutBy::hand_saw:
      return contact ? "contact with the saw in the hand" : "taken by the saw in the hand";
    case CutBy::shaft:
      return contact ? "contact with the shaft" : "gone through by the shaft";
    case CutBy::plate_screws:
      return contact ? "contact with plate screws" : "gone through by plate screws";
  }
  return {};
}

CutMetric::CutMetric(const EvidenceScene& scene) : scene_(scene) {
  if (scene.structures != nullptr) judge_.emplace(*scene.structures, scene.rate_hz);
}

void CutMetric::frame(const EvidenceFrame& f) {
  if (!judge_) return;
  for (const SceneAction& a : f.actions) {
    if (a.is(ActionKind::attach)) judge_->attach(a.tick, f.world, a);
    // One that met no bone was not done; a frame begins with at most one that was (parts_changes).
    if (!a.is(ActionKind::saw) || f.sawn.empty()) continue;
    std::vector<VoxelKey> voxels;
    voxels.reserve(f.sawn.size());
    for (const VoxelChange& c : f.sawn) voxels.push_back(c.voxel);
    for (const StructureCut& c : judge_->saw(a.tick, f.world, a.saw_cut(), voxels)) {
      if (c.mm3 > 0) continue;
      const auto [at, is_new] = least_mm_.try_emplace(c.structure, c.distance_mm);
      at->second = std::min(at->second, c.distance_mm);
    }
  }
  const RigidTransform own = f.world.bodies().front().world_from_body.inverse();
  for (const TickRecord& t : f.ticks) {
    if (t.hand < kMaxHands) judge_->tick(t, own, f.world.cutting_guide(t.hand));
  }
}

void CutMetric::finish(const World& /*world*/, std::vector<Measured>& values, std::vector<Moment>& moments) {
  if (!judge_) {
    not_measured_all(values, MetricPlace::saw, {MetricWhen::structures}, "the case has no structures");
    return;
  }
  const std::vector<StructureCutEvent> events = judge_->events();
  for (std::size_t n = 0; n < scene_.structures->values().size(); ++n) {
    if (scene_.opens(n)) continue;
    const std::uint8_t s = scene_.structures->values()[n];
    const std::string name = scene_.structures->name_of(s);
    double mm3 = 0;
    bool sawn = false;
    for (const StructureCutEvent& e : events) {
      if (e.cut.structure != s) continue;
      mm3 += e.cut.mm3;
      sawn = sawn || (e.by == CutBy::saw && e.cut.mm3 > 0);
      moments.push_back({static_cast<double>(e.tick) / scene_.rate_hz, e.cut.at_mm,
                         std::string(moment_of(e.by, e.cut.mm3 <= 0)), name, e.cut.mm3, 0});
    }
    values.push_back(measured("cut_mm3", mm3, name));
    if (const auto near = least_mm_.find(s); !sawn && near != least_mm_.end())
      values.push_back(measured("saw_clearance_mm", near->second, name));
  }
}

}  // namespace osteo::inline assessment
