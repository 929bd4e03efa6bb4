#include "osteo/haptics/contact.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace osteo {
namespace {

constexpr std::uint32_t kTableSize = 1 << 13;  // more than twice the samples of a burr
constexpr std::uint32_t kEmpty = BrickGrid::kNone;
// Less bone than this in the burr gives no contact: half a sample.
constexpr double kLeastSamples = 0.5;

}  // namespace

double cap_depth_mm(double volume_mm3, double radius_mm) noexcept {
  // With x = d / r: x^2 (3 - x) = 3 v / (pi r^3). Newton from the shallow-cap estimate; the function rises on [0, 2].
  const double c = std::clamp(3 * volume_mm3 / (std::numbers::pi * radius_mm * radius_mm * radius_mm), 0.0, 4.0);
  if (c <= 0) return 0;
  double lo = 0, hi = 2, x = std::min(std::sqrt(c / 3), 1.9);
  for (int i = 0; i < 40; ++i) {
    const double f = x * x * (3 - x) - c;
    (f > 0 ? hi : lo) = x;
    const double slope = 3 * x * (2 - x);
    double next = slope > 1e-12 ? x - f / slope : 0.5 * (lo + hi);
    if (!(next > lo && next < hi)) next = 0.5 * (lo + hi);
    if (std::abs(next - x) < 1e-12) break;
    x = next;
  }
  return x * radius_mm;
}

VolumeSampling::VolumeSampling(const ContactParams& params) : params_(params) {
  std::size_t most = 0;
  for (const Burr& burr : burr_library()) {
    Tool tool{burr, sample_burr(burr), {}, {}, false};
    tool.offset_index.resize(tool.samples.offset_mm.size());
    most = std::max(most, tool.offset_index.size());
    tools_.push_back(std::move(tool));
  }
  hits_.resize(most);
  table_key_.assign(kTableSize, kEmpty);
  table_share_.assign(kTableSize, 0.0F);
  used_slots_.resize(most);
  changes_.resize(most);
}

void VolumeSampling::orient(Tool& tool, const BrickGrid& bone, const std::array<float, 3>& axis) noexcept {
  if (tool.oriented && tool.axis == axis) return;
  const Vec3 w = normalized({axis[0], axis[1], axis[2]});
  const Vec3 u = any_perpendicular(w), v = cross(w, u);
  const Mat3 to_index = transposed(bone.frame().direction);
  const double h = bone.frame().spacing_mm.x;
  for (std::size_t s = 0; s < tool.offset_index.size(); ++s) {
    const auto& o = tool.samples.offset_mm[s];
    const Vec3 world = u * static_cast<double>(o[0]) + v * static_cast<double>(o[1]) + w * static_cast<double>(o[2]);
    const Vec3 index = (to_index * world) / h;
    tool.offset_index[s] = {static_cast<float>(index.x), static_cast<float>(index.y), static_cast<float>(index.z)};
  }
  tool.axis = axis;
  tool.oriented = true;
}

ContactResult VolumeSampling::contact(const BrickGrid& bone, const DeviceSample& pose) noexcept {
  ContactResult result;
  tool_ = &tools_[std::min<std::size_t>(pose.tool, tools_.size() - 1)];
  hit_count_ = 0;
  force_magnitude_n_ = weight_sum_ = density_sum_ = 0;
  const Vec3 position{pose.position_mm[0], pose.position_mm[1], pose.position_mm[2]};
  if (!std::isfinite(position.x) || !std::isfinite(position.y) || !std::isfinite(position.z)) return result;
  orient(*tool_, bone, pose.axis);

  const Vec3 centre = bone.frame().index_from_world(position);
  const double reach = tool_->burr.diameter_mm / 2 / bone.frame().spacing_mm.x + 1;
  const auto& dims = bone.frame().dims;
  for (std::size_t a = 0; a < 3; ++a) {
    if (centre[a] < -reach || centre[a] > dims[a] + reach) return result;
  }
  // Rounding to the nearest voxel, from a base that keeps the numbers positive: truncation is then floor.
  const float cx = static_cast<float>(centre.x) + 64.5F, cy = static_cast<float>(centre.y) + 64.5F,
              cz = static_cast<float>(centre.z) + 64.5F;
  float sx = 0, sy = 0, sz = 0;
  double density_sum = 0, weight_sum = 0;
  const std::size_t n = tool_->offset_index.size();
  for (std::size_t s = 0; s < n; ++s) {
    const auto& o = tool_->offset_index[s];
    const VoxelKey voxel = bone.find(static_cast<int>(cx + o[0]) - 64, static_cast<int>(cy + o[1]) - 64, static_cast<int>(cz + o[2]) - 64);
    if (voxel == BrickGrid::kNone) continue;
    const float density = bone.value(voxel);
    if (density <= 0) continue;
    const float inverse = density / std::sqrt(o[0] * o[0] + o[1] * o[1] + o[2] * o[2]);
    sx -= o[0] * inverse;
    sy -= o[1] * inverse;
    sz -= o[2] * inverse;
    const float weight = density * tool_->samples.efficiency[s];
    hits_[hit_count_++] = {voxel, weight};
    density_sum += static_cast<double>(density);
    weight_sum += static_cast<double>(weight);
  }
  result.immersed = static_cast<std::uint32_t>(hit_count_);
  if (density_sum < kLeastSamples) return result;
  result.bone_mm3 = density_sum * tool_->samples.sample_volume_mm3;
  result.depth_mm = cap_depth_mm(result.bone_mm3, tool_->burr.diameter_mm / 2);
  const double soft = std::min(result.depth_mm, params_.soft_depth_mm);
  force_magnitude_n_ =
      std::min(params_.max_force_n, params_.soft_stiffness_n_per_mm * soft + params_.stiffness_n_per_mm * (result.depth_mm - soft));
  const Vec3 sum{static_cast<double>(sx), static_cast<double>(sy), static_cast<double>(sz)};
  // Deep inside bone the pushes cancel and there is no direction: no force rather than a random one.
  const double strength = length(sum) / density_sum;
  const Vec3 direction = bone.frame().direction * normalized(sum);
  result.force_n = strength > 1e-3 ? direction * force_magnitude_n_ : Vec3{};
  density_sum_ = density_sum;
  weight_sum_ = weight_sum;
  return result;
}

std::span<const VoxelChange> VolumeSampling::remove(BrickGrid& bone, double dt_s, double& removed_mm3) noexcept {
  if (hit_count_ == 0 || weight_sum_ <= 0 || force_magnitude_n_ <= 0) return {};
  const double efficiency = weight_sum_ / density_sum_;
  const double wanted = tool_->burr.rate_mm3_per_s_per_n * efficiency * force_magnitude_n_ * dt_s + carry_mm3_;
  const double voxel_mm3 = bone.frame().voxel_volume_mm3();
  // Shares by voxel: several samples lie in one voxel.
  used_count_ = 0;
  for (std::size_t h = 0; h < hit_count_; ++h) {
    if (hits_[h].weight <= 0) continue;
    std::uint32_t slot = (hits_[h].voxel * 2654435761U) >> 19;
    while (table_key_[slot] != kEmpty && table_key_[slot] != hits_[h].voxel) slot = (slot + 1) & (kTableSize - 1);
    if (table_key_[slot] == kEmpty) {
      table_key_[slot] = hits_[h].voxel;
      table_share_[slot] = 0;
      used_slots_[used_count_++] = slot;
    }
    table_share_[slot] += hits_[h].weight;
  }
  double taken = 0;
  std::size_t changed = 0;
  for (std::size_t u = 0; u < used_count_; ++u) {
    const std::uint32_t slot = used_slots_[u];
    const VoxelKey voxel = table_key_[slot];
    const double share = wanted * static_cast<double>(table_share_[slot]) / weight_sum_ / voxel_mm3;
    const float before = bone.value(voxel);
    const float after = std::max(0.0F, before - static_cast<float>(share));
    table_key_[slot] = kEmpty;
    if (after == before) continue;
    bone.set(voxel, after);
    changes_[changed++] = {voxel, after};
    taken += static_cast<double>(before - after) * voxel_mm3;
  }
  // What emptied voxels could not give, or rounding kept back, waits; but no more than a tick's worth at 10 N.
  carry_mm3_ = std::clamp(wanted - taken, 0.0, tool_->burr.rate_mm3_per_s_per_n * 10 * dt_s);
  removed_mm3 += taken;
  return {changes_.data(), changed};
}

}  // namespace osteo
