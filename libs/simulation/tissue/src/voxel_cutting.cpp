#include "osteo/simulation/tissue/voxel_cutting.h"

#include <algorithm>

namespace osteo::inline simulation {

double VoxelCutting::rate_mm3_per_s(double force_n, double bone_mm3_per_s_per_n) {
  return std::min(force_n * bone_mm3_per_s_per_n * kEasierThanBone, kMaxMm3PerS);
}

VoxelCutting::VoxelCutting(const TissueModel& model, double voxel_mm3)
    : model_(model), voxel_mm3_(voxel_mm3), gone_(model.tets().size()) {}

bool VoxelCutting::cut(TissueDynamics<float>& body, const RigidShape& tool, double mm3, std::size_t number) {
  if (number >= saved_mm3_.size()) saved_mm3_.resize(number + 1);
  double& saved_mm3 = saved_mm3_[number];
  saved_mm3 = std::min(saved_mm3 + mm3, kMaxSaved * voxel_mm3_);
  if (saved_mm3 < voxel_mm3_) return false;
  const auto x = body.positions_mm();
  const RigidShape::Ball near = tool.bounds();
  std::vector<std::pair<double, std::uint32_t>> met;  // depth, voxel
  for (std::uint32_t v = 0; v < gone_.size() / 5; ++v) {
    if (gone_[5 * v]) continue;
    double deepest = 0;
    for (std::uint32_t t = 5 * v; t < 5 * v + 5; ++t) {
      for (const std::uint32_t p : model_.tets()[t]) {
        const Vec3 off = x[p] - near.centre_mm;
        if (dot(off, off) > near.radius_mm * near.radius_mm) continue;
        Vec3 out;
        deepest = std::min(deepest, tool.distance_mm(x[p], out));
      }
    }
    if (deepest < 0) met.push_back({deepest, v});
  }
  std::sort(met.begin(), met.end());
  std::vector<std::uint32_t> tets;
  for (const auto& [depth, v] : met) {
    if (saved_mm3 < voxel_mm3_) break;
    saved_mm3 -= voxel_mm3_;
    for (std::uint32_t t = 5 * v; t < 5 * v + 5; ++t) tets.push_back(t);
  }
  if (tets.empty()) return false;
  take(body, tets);
  // What comes loose with it is taken to be sucked away.
  take(body, body.loose());
  return true;
}

void VoxelCutting::take(TissueDynamics<float>& body, std::span<const std::uint32_t> tets) {
  for (const std::uint32_t t : tets) gone_[t] = true;
  cut_mm3_ += voxel_mm3_ * static_cast<double>(tets.size()) / 5;
  body.cut_off(tets);
}

}  // namespace osteo::inline simulation
