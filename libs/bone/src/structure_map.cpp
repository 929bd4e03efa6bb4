#include "osteo/bone/structure_map.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "osteo/base/error.h"
#include "osteo/base/files.h"
#include "osteo/distance/mask_distance.h"
#include "osteo/mesh/bone_surface.h"

namespace osteo {

StructureMap::StructureMap(const Labels& labels, double reach_mm, const Context& context)
    : reach_mm_(reach_mm), structures_(labels.structures) {
  std::array<bool, 256> used{};
  for (std::size_t v = 0; v < labels.frame.voxel_count(); ++v) used[labels.voxels[v]] = true;
  std::vector<std::uint8_t> wanted;
  for (int v = 1; v < 256; ++v) {
    if (used[static_cast<std::size_t>(v)]) wanted.push_back(static_cast<std::uint8_t>(v));
  }
  DistanceMapOptions options;
  options.region = DistanceRegion::band;
  options.band_inside_mm = options.band_outside_mm = reach_mm;
  const MaskDistance map = mask_distance(labels, wanted, options, true, context);
  nearest_ = to_bricks(map.nearest, true);
  closeness_ = to_bricks(map.distance, true);
  for (std::uint32_t b = 0; b < closeness_.brick_count(); ++b) {
    const Ijk o = closeness_.brick_coordinate(b);
    const std::uint32_t n = nearest_.find_brick(o.i, o.j, o.k);
    for (std::uint32_t v = 0; v < BrickGrid::kVoxels; ++v) {
      const VoxelKey key = b * BrickGrid::kVoxels + v;
      const bool stored = n != BrickGrid::kNone && nearest_.value(n * BrickGrid::kVoxels + v) > 0;
      closeness_.set(key, stored ? static_cast<float>(std::max(0.0, reach_mm - static_cast<double>(closeness_.value(key)))) : 0.0F);
    }
  }
}

StructureMap::Answer StructureMap::at(Vec3 world_mm) const noexcept {
  const Vec3 x = closeness_.frame().index_from_world(world_mm);
  if (!(std::abs(x.x) < 1e6 && std::abs(x.y) < 1e6 && std::abs(x.z) < 1e6)) return {reach_mm_, 0};
  const int i = static_cast<int>(std::floor(x.x)), j = static_cast<int>(std::floor(x.y)), k = static_cast<int>(std::floor(x.z));
  const double u[3] = {x.x - i, x.y - j, x.z - k};
  double closeness = 0, heaviest = 0;
  std::uint8_t structure = 0;
  for (int c = 0; c < 8; ++c) {
    const int a = i + (c & 1), b = j + (c >> 1 & 1), d = k + (c >> 2);
    const double w = ((c & 1) != 0 ? u[0] : 1 - u[0]) * ((c & 2) != 0 ? u[1] : 1 - u[1]) * ((c & 4) != 0 ? u[2] : 1 - u[2]);
    closeness += w * static_cast<double>(closeness_.at(a, b, d));
    if (w > heaviest) {
      heaviest = w;
      structure = static_cast<std::uint8_t>(nearest_.at(a, b, d));
    }
  }
  return {reach_mm_ - closeness, structure};
}

std::pair<TriMesh, std::vector<std::uint8_t>> StructureMap::surface(const Context& context) const {
  TriMesh mesh = surface_nets(closeness_, static_cast<float>(reach_mm_), context).mesh;
  std::vector<std::uint8_t> whose;
  whose.reserve(mesh.points_mm.size());
  for (const auto& p : mesh.points_mm) whose.push_back(at(from_floats(p)).structure);
  return {std::move(mesh), std::move(whose)};
}

std::array<double, 3> StructureMap::colour_of(std::uint8_t structure) const {
  for (const Structure& s : structures_) {
    if (s.value == structure && s.rgb != std::array<std::uint8_t, 3>{}) return {s.rgb[0] / 255.0, s.rgb[1] / 255.0, s.rgb[2] / 255.0};
  }
  static constexpr std::array<std::array<double, 3>, 6> kRow{
      {{0.95, 0.85, 0.25}, {0.30, 0.45, 0.90}, {0.85, 0.25, 0.25}, {0.35, 0.75, 0.45}, {0.80, 0.45, 0.80}, {0.30, 0.75, 0.80}}};
  return kRow[(structure + 5U) % kRow.size()];
}

StructureMap::Answer StructureMap::clearance(const RoundCone& tool, Vec3 start_mm, Vec3 axis) const noexcept {
  const int steps = tool.length_mm > 0 ? static_cast<int>(std::ceil(tool.length_mm / (0.5 * tool.largest_radius_mm()))) : 0;
  Answer nearest{reach_mm_, 0};
  for (int s = 0; s <= steps; ++s) {
    const double t = steps > 0 ? tool.length_mm * s / steps : 0;
    Answer a = at(start_mm + axis * (tool.start_mm + t));
    a.distance_mm -= tool.radius_at_mm(t);
    if (a.structure != 0 && a.distance_mm < nearest.distance_mm) nearest = a;
  }
  return nearest;
}

std::string StructureMap::name_of(std::uint8_t structure) const {
  const auto s = std::find_if(structures_.begin(), structures_.end(), [&](const Structure& c) { return c.value == structure; });
  return s != structures_.end() ? s->name : "structure " + std::to_string(structure);
}

std::string StructureMap::hash() const {
  Hasher h;
  const std::string a = closeness_.hash(), b = nearest_.hash();
  h.add(a.data(), a.size());
  h.add(b.data(), b.size());
  return h.hex();
}

}  // namespace osteo
