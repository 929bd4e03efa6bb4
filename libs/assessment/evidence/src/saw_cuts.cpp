#include "osteo/assessment/evidence/detail/saw_cuts.h"

#include <algorithm>

namespace osteo::inline assessment {

void SawCutMetric::frame(const EvidenceFrame& f) {
  // One that met no bone was not done; a frame begins with at most one that was (parts_changes).
  if (f.sawn.empty()) return;
  for (const SceneAction& a : f.actions) {
    if (!a.is(ActionKind::saw)) continue;
    any_ = true;
    if (scene_.structures == nullptr) return;
    std::vector<VoxelKey> voxels;
    voxels.reserve(f.sawn.size());
    for (const VoxelChange& c : f.sawn) voxels.push_back(c.voxel);
    const std::optional<SawCut> blade = blade_at_work(f.world, a.saw_cut(), voxels);
    if (!blade) continue;
    for (const StructureCut& c : structures_cut(*scene_.structures, *blade)) {
      if (c.mm3 <= 0) {
        const auto [at, is_new] = least_mm_.try_emplace(c.structure, c.distance_mm);
        at->second = std::min(at->second, c.distance_mm);
        continue;
      }
      mm3_[c.structure] += c.mm3;
      moments_.push_back({static_cast<double>(a.tick) / f.rate_hz, c.at_mm, std::string(kMoment),
                          scene_.structures->name_of(c.structure), c.mm3, 0});
    }
  }
}

void SawCutMetric::finish(const World& /*world*/, std::vector<Measured>& values, std::vector<Moment>& moments) {
  if (!any_) return;
  if (scene_.structures == nullptr) {
    not_measured_all(values, MetricPlace::saw, {MetricWhen::some}, "the case has no structures");
    return;
  }
  for (const std::uint8_t s : scene_.structures->values()) {
    const std::string name = scene_.structures->name_of(s);
    const ProcedureStructure* const p = scene_.procedure == nullptr ? nullptr : scene_.procedure->find(name);
    // What is to be opened is not injured by that.
    if (p != nullptr && p->role == ProcedureRole::enter) continue;
    const auto cut = mm3_.find(s);
    const auto near = least_mm_.find(s);
    values.push_back(measured("cut_mm3", cut == mm3_.end() ? 0 : cut->second, name));
    if (cut == mm3_.end() && near != least_mm_.end())
      values.push_back(measured("saw_clearance_mm", near->second, name));
    for (const Moment& m : moments_) {
      if (m.structure == name) moments.push_back(m);
    }
  }
}

}  // namespace osteo::inline assessment
