// The two sampling methods of the thesis.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "contact_models.h"

namespace osteo::inline simulation {
namespace {

// Less bone than this in the burr gives no contact: half a sample.
constexpr double kMinSamples = 0.5;

Mat3 world_from_tool(Vec3 axis) {
  const Vec3 u = any_perpendicular(axis);
  return {{u, cross(axis, u), axis}};
}

}  // namespace

void SampledHead::begin(const DeviceSample& pose) noexcept {
  pose_ = pose;
  measured_ = false;
}

double SampledHead::share(const BrickGrid& bone, const Grains* known) noexcept {
  if (known == nullptr || known->used() == 0) return 1;
  measured_ = true;
  const OverlapResult& o =
      overlap_.measure(bone, known, tool_of(pose_), position_of(pose_), axis_of(pose_), pose_.pedal != 0);
  return o.spread_mm3 > 0 ? std::min(1.0, o.bone_mm3 / o.spread_mm3) : 1;
}

Cut SampledHead::cut(const BrickGrid& bone, const Grains* known) noexcept {
  if (!measured_) overlap_.measure(bone, known, tool_of(pose_), position_of(pose_), axis_of(pose_), pose_.pedal != 0);
  return overlap_.cut();
}

VolumeSampling::VolumeSampling(const ContactParams& params, double spacing_mm)
    : ContactModel(params), head_(spacing_mm) {
  for (const Instrument& i : instrument_library()) {
    Tool tool{sample_head(i.head, i.falloff_per_rad), {}, {}, {}, false};
    tool.offset_index.resize(tool.samples.offset_mm.size());
    tool.inward_index.resize(tool.samples.offset_mm.size());
    tools_.push_back(std::move(tool));
  }
  static_cast<void>(head_cut_depth(0));  // not in the servo
}

void VolumeSampling::orient(Tool& tool, const BrickGrid& bone, const std::array<float, 3>& axis) noexcept {
  if (tool.oriented && tool.axis == axis) return;
  const Mat3 to_world = world_from_tool(normalized(from_floats(axis))), to_index = transposed(bone.frame().direction);
  const double h = bone.frame().spacing_mm.x;
  for (std::size_t s = 0; s < tool.offset_index.size(); ++s) {
    tool.offset_index[s] = to_floats(to_index * (to_world * from_floats(tool.samples.offset_mm[s])) / h);
    tool.inward_index[s] = to_floats(to_index * (to_world * from_floats(tool.samples.inward[s])));
  }
  tool.axis = axis;
  tool.oriented = true;
}

ContactResult VolumeSampling::contact(const BrickGrid& bone, const DeviceSample& pose) noexcept {
  ContactResult r;
  const std::size_t number = tool_of(pose);
  Tool& tool = tools_[number];
  head_.begin(pose);
  const Vec3 position = position_of(pose), axis = axis_of(pose);
  if (!finite(position)) return r;
  orient(tool, bone, to_floats(axis));

  const Vec3 centre = bone.frame().index_from_world(position);
  const RoundCone& head = instrument_library()[number].head;
  const double reach = (head.length_mm + head.largest_radius_mm()) / bone.frame().spacing_mm.x + 1;
  const auto& dims = bone.frame().dims;
  for (std::size_t a = 0; a < 3; ++a) {
    if (centre[a] < -reach || centre[a] > dims[a] + reach) return r;
  }
  // Rounding to the nearest voxel, from a base that keeps the numbers positive: truncation is then floor.
  constexpr int kBase = 512;
  const float cx = static_cast<float>(centre.x) + (kBase + 0.5F), cy = static_cast<float>(centre.y) + (kBase + 0.5F),
              cz = static_cast<float>(centre.z) + (kBase + 0.5F);
  float sx = 0, sy = 0, sz = 0;
  double density_sum = 0;
  const std::size_t n = tool.offset_index.size();
  for (std::size_t s = 0; s < n; ++s) {
    const auto& o = tool.offset_index[s];
    const VoxelKey voxel = bone.find(static_cast<int>(cx + o[0]) - kBase, static_cast<int>(cy + o[1]) - kBase,
                                     static_cast<int>(cz + o[2]) - kBase);
    if (voxel == BrickGrid::kNone) continue;
    const float density = bone.value(voxel);
    if (density <= 0) continue;
    const auto& push = tool.inward_index[s];
    sx += push[0] * density;
    sy += push[1] * density;
    sz += push[2] * density;
    density_sum += static_cast<double>(density);
    ++r.immersed;
  }
  if (density_sum < kMinSamples) return r;
  r.bone_mm3 = density_sum * tool.samples.sample_volume_mm3 * head_.share(bone, known_);
  if (!(r.bone_mm3 > 0)) return r;
  const Vec3 sum{static_cast<double>(sx), static_cast<double>(sy), static_cast<double>(sz)};
  const Vec3 direction = bone.frame().direction * normalized(sum);
  r.depth_mm = head_cut_depth(number)(r.bone_mm3, -dot(direction, axis));
  // Deep inside bone the pushes cancel and there is no direction: no force rather than a random one.
  if (length(sum) / density_sum < 1e-3) return r;
  r.normal = direction;
  r.normal_force_n = params_.force_n(r.depth_mm);
  r.force_n = r.normal * r.normal_force_n;
  r.shown_offset_mm = r.normal * r.depth_mm;
  return r;
}

Cut VolumeSampling::cut(const BrickGrid& bone) noexcept {
  return head_.cut(bone, known_);
}

RaySampling::RaySampling(const ContactParams& params, double spacing_mm) : ContactModel(params), head_(spacing_mm) {
  for (const Instrument& i : instrument_library())
    tools_.push_back(sample_head_surface(i.head, i.falloff_per_rad, kSamples));
  static_cast<void>(head_cut_depth(0));  // not in the servo
}

ContactResult RaySampling::contact(const BrickGrid& bone, const DeviceSample& pose) noexcept {
  ContactResult r;
  head_.begin(pose);
  const Vec3 position = position_of(pose), axis = axis_of(pose);
  if (!finite(position)) return r;
  const BurrSurface& tool = tools_[tool_of(pose)];
  const Mat3 to_index = transposed(bone.frame().direction), to_world = world_from_tool(axis);
  const double h = bone.frame().spacing_mm.x;
  const Vec3 centre = bone.frame().index_from_world(position);
  const auto density = [&](Vec3 x) {
    return bone.at(static_cast<int>(std::floor(x.x + 0.5)), static_cast<int>(std::floor(x.y + 0.5)),
                   static_cast<int>(std::floor(x.z + 0.5)));
  };
  Vec3 push;
  for (std::size_t s = 0; s < tool.offset_mm.size(); ++s) {
    const Vec3 start = centre + to_index * (to_world * from_floats(tool.offset_mm[s])) / h;
    if (density(start) < 0.5F) continue;
    ++r.immersed;
    // In half voxels towards the axis, as far as it goes in bone; the last step is cut where the density passes a half.
    const Vec3 inward = to_index * (to_world * from_floats(tool.inward[s]));
    const double reach = static_cast<double>(tool.reach_mm[s]) / h;
    double in = reach;
    float before = density(start);
    for (double t = 0; t < reach; t += 0.5) {
      const float d = density(start + inward * t);
      if (d < 0.5F) {
        in = std::max(0.0, t - 0.5 * static_cast<double>((0.5F - d) / std::max(before - d, 1e-6F)));
        break;
      }
      before = d;
    }
    push += (to_world * from_floats(tool.inward[s])) * (in * h);
  }
  double volume = length(push) * tool.sample_area_mm2;  // penetration times area
  if (!(volume > 0)) return r;
  volume *= head_.share(bone, known_);
  if (!(volume > 0)) return r;
  r.normal = normalized(push);
  r.bone_mm3 = volume;
  // On flat bone a ball's sum is pi r d^2, whatever the depth; for other shapes it is nearly the volume.
  const RoundCone& head = instrument_library()[tool_of(pose)].head;
  r.depth_mm = head.length_mm == 0 ? std::sqrt(volume / (std::numbers::pi * head.start_radius_mm))
                                   : head_cut_depth(tool_of(pose))(volume, -dot(r.normal, axis));
  r.normal_force_n = params_.force_n(r.depth_mm);
  r.force_n = r.normal * r.normal_force_n;
  r.shown_offset_mm = r.normal * r.depth_mm;
  return r;
}

Cut RaySampling::cut(const BrickGrid& bone) noexcept {
  return head_.cut(bone, known_);
}

}  // namespace osteo::inline simulation
