#include "osteo/simulation/bone/structure_map.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "osteo/core/base/error.h"
#include "osteo/core/base/param.h"
#include "osteo/core/base/portable_math.h"
#include "osteo/core/base/translate.h"

namespace osteo::inline simulation {
namespace {

constexpr double kCellMm = 0.15;
// By how much the map's distances may be off what a distance can change on the way (its lattice, linear between).
constexpr double kSlackMm = 0.4;

struct BladeFrame {
  Vec3 normal, along, across;
};
// As apply_saw() lays it.
BladeFrame frame_of(const SawCut& cut) {
  BladeFrame f;
  f.normal = normalized(cut.normal);
  f.along = cut.along - f.normal * dot(cut.along, f.normal);
  f.along = length(f.along) > 1e-9 ? normalized(f.along) : any_perpendicular(f.normal);
  f.across = cross(f.normal, f.along);
  return f;
}

SawCut moved(const SawCut& cut, const RigidTransform& by) {
  SawCut m = cut;
  m.at_mm = by(cut.at_mm);
  m.normal = by.rotation * cut.normal;
  m.along = by.rotation * cut.along;
  return m;
}

// One structure against a blade: the plane in rectangles, halved where the structure's face may pass through.
class Search {
 public:
  Search(const StructureMap& map, std::size_t number, const SawCut& blade, double within_mm)
      : map_(map),
        number_(number),
        blade_(blade),
        within_mm_(within_mm),
        frame_(frame_of(blade)),
        layers_(static_cast<int>(std::ceil(blade.kerf_mm / kCellMm))) {
    halve(-blade.length_mm / 2, blade.length_mm / 2, -blade.depth_mm / 2, blade.depth_mm / 2);
  }
  // Where it is farther than what is asked for: distance_mm is larger than that.
  [[nodiscard]] StructureCut result() const {
    StructureCut c;
    c.structure = map_.values()[number_];
    c.mm3 = least_mm_ <= 0 && mm3_ >= StructureCut::kMinMm3 ? mm3_ : 0;
    c.distance_mm = std::max(0.0, least_mm_);
    c.at_mm = c.mm3 > 0 ? moment_ / mm3_ : at_mm_;
    return c;
  }

 private:
  [[nodiscard]] Vec3 place(double u, double v, double w) const {
    return blade_.at_mm + frame_.along * u + frame_.across * v + frame_.normal * w;
  }
  void take(Vec3 p, double volume_mm3, double size_mm) {
    const double d = map_.distance_mm(number_, p);
    if (d < least_mm_) {
      least_mm_ = d;
      at_mm_ = p;
    }
    // What of a cell lies inside, by the distance of its middle.
    const double inside = std::clamp(0.5 - d / size_mm, 0.0, 1.0) * volume_mm3;
    mm3_ += inside;
    moment_ += p * inside;
  }
  void halve(double u0, double u1, double v0, double v1) {
    const double du = u1 - u0, dv = v1 - v0, u = (u0 + u1) / 2, v = (v0 + v1) / 2;
    const double reach = std::sqrt(du * du + dv * dv + blade_.kerf_mm * blade_.kerf_mm) / 2;
    const Vec3 middle = place(u, v, 0);
    const double d = map_.distance_mm(number_, middle);
    // No place of it is nearer than this; where the map knows no distance it tells its reach, and it is farther.
    const double at_least = d - reach - kSlackMm;
    if (at_least > 0 && at_least >= std::min(least_mm_, within_mm_)) return;
    if (d + reach < -kSlackMm) {
      const double volume = du * dv * blade_.kerf_mm;
      least_mm_ = std::min(least_mm_, d);
      mm3_ += volume;
      moment_ += middle * volume;
      return;
    }
    if (std::max(du, dv) <= kCellMm) {
      const double layer = blade_.kerf_mm / layers_, volume = du * dv * layer, size = portable::cbrt(volume);
      for (int n = 0; n < layers_; ++n) take(place(u, v, (n + 0.5) * layer - blade_.kerf_mm / 2), volume, size);
      return;
    }
    if (du >= dv) {
      halve(u0, u, v0, v1);
      halve(u, u1, v0, v1);
    } else {
      halve(u0, u1, v0, v);
      halve(u0, u1, v, v1);
    }
  }

  const StructureMap& map_;
  std::size_t number_;
  SawCut blade_;
  double within_mm_;
  BladeFrame frame_;
  int layers_;
  double least_mm_ = 1e9, mm3_ = 0;
  Vec3 at_mm_, moment_;
};

}  // namespace

std::optional<SawCut> blade_at_work(const SawCut& cut, std::span<const Vec3> bone_mm, double margin_mm) {
  if (bone_mm.empty()) return std::nullopt;
  const BladeFrame f = frame_of(cut);
  const std::array<Vec3, 2> axes{f.along, f.across};
  const std::array<double, 2> sizes{cut.length_mm, cut.depth_mm};
  std::array<double, 2> lo, hi;
  for (std::size_t a = 0; a < 2; ++a) {
    lo[a] = 1e300;
    hi[a] = -1e300;
    for (const Vec3 p : bone_mm) {
      const double x = dot(p - cut.at_mm, axes[a]);
      lo[a] = std::min(lo[a], x - margin_mm);
      hi[a] = std::max(hi[a], x + margin_mm);
    }
    if (sizes[a] <= 0) continue;
    lo[a] = std::clamp(lo[a], -sizes[a] / 2, sizes[a] / 2);
    hi[a] = std::clamp(hi[a], -sizes[a] / 2, sizes[a] / 2);
  }
  SawCut blade = cut;
  blade.normal = f.normal;
  blade.along = f.along;
  blade.at_mm = cut.at_mm + axes[0] * ((lo[0] + hi[0]) / 2) + axes[1] * ((lo[1] + hi[1]) / 2);
  blade.length_mm = hi[0] - lo[0];
  blade.depth_mm = hi[1] - lo[1];
  return blade;
}

std::optional<SawCut> blade_at_work(const World& world, const SawCut& cut, std::span<const VoxelKey> voxels) {
  const RigidTransform own = world.bodies().front().world_from_body.inverse();
  std::vector<Vec3> places;
  places.reserve(voxels.size());
  double margin_mm = 0;
  const PlacedBody* body = nullptr;
  for (const VoxelKey name : voxels) {
    // Those of a body come one after the other.
    if (body == nullptr || name < body->body->name_of(0) ||
        name - body->body->name_of(0) >= body->body->bone.brick_count() * BrickGrid::kVoxels)
      body = world.owner(name);
    if (body == nullptr) continue;
    const BrickGrid& bone = body->body->bone;
    const Ijk at = bone.coordinate(name - body->body->name_of(0));
    const Vec3 index{static_cast<double>(at.i), static_cast<double>(at.j), static_cast<double>(at.k)};
    places.push_back((own * body->world_from_body)(bone.frame().world_from_index(index)));
    margin_mm = std::max(margin_mm, bone.frame().spacing_mm.x / 2);
  }
  return blade_at_work(moved(cut, own), places, margin_mm);
}

std::vector<VoxelKey> voxels_sawn(const World& world, const SawCut& cut, std::uint32_t body) {
  std::vector<VoxelKey> names;
  for (const PlacedBody& placed : world.bodies()) {
    if (body != SceneAction::kNobody && body != placed.body->id) continue;
    for (const VoxelKey v : voxels_sawn(placed.body->bone, moved(cut, placed.world_from_body.inverse())))
      names.push_back(placed.body->name_of(v));
  }
  return names;
}

std::vector<StructureCut> structures_cut(const StructureMap& map, const SawCut& blade, double within_mm) {
  if (!(blade.length_mm > 0) || !(blade.depth_mm > 0) || !(blade.kerf_mm > 0))
    throw Error(ExitCode::usage, "only a blade with a length, a depth and a width can be held against structures");
  // Farther than this a rectangle of a few cells would have to be looked at to know that it is beyond the map's reach.
  const double within = std::min(within_mm, map.reach_mm() - StructureCut::kReachLessMm);
  std::vector<StructureCut> cuts;
  for (std::size_t n = 0; n < map.values().size(); ++n) {
    if (map.opened(n)) continue;
    const StructureCut c = Search(map, n, blade, within).result();
    if (c.mm3 > 0 || c.distance_mm < within) cuts.push_back(c);
  }
  return cuts;
}

std::string reported_structures_cut(const StructureMap& map, std::span<const StructureCut> cuts) {
  std::vector<std::string> parts;
  for (const StructureCut& c : cuts) {
    if (c.mm3 <= 0) continue;
    // To two places below 10 mm3, else to whole ones.
    const double step = c.mm3 < 10 ? 0.01 : 1;
    parts.push_back(filled(tr("the {structure} ({mm3} mm³)"),
                           {{"structure", tr(map.name_of(c.structure))},
                            {"mm3", shown_figures(format_number(std::max(step, std::round(c.mm3 / step) * step)))}}));
  }
  std::string all;
  for (std::size_t n = 0; n < parts.size(); ++n) {
    const bool last = n > 0 && n + 1 == parts.size();
    all = n == 0 ? parts[n]
          : last ? filled(tr("{one} and {other}"), {{"one", all}, {"other", parts[n]}})
                 : all + ", " + parts[n];
  }
  return all;
}

}  // namespace osteo::inline simulation
