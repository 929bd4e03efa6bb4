#include "osteo/simulation/bone/plates.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "osteo/geometry/grid/sampler.h"

namespace osteo::inline simulation {
namespace {

// From inside the plate's thickness outwards: the first place along `down` where bone begins.
double gap_to(const PlacedBody& placed, Vec3 at, Vec3 down, double above_mm, double reach_mm) {
  const BrickGrid& bone = placed.body->bone;
  const RigidTransform own = placed.world_from_body.inverse();
  const Frame& f = bone.frame();
  const double h = f.spacing_mm.x, step = 0.5 * h;
  const Vec3 start = f.index_from_world(own(at)), way = transposed(f.direction) * (own.rotation * down) / h;
  double before = static_cast<double>(linear_at(bone, start - way * above_mm));
  // A plate that lies in bone: to where that begins above it, were it all around no gap can be told.
  if (before >= 0.5) return -above_mm;
  for (double s = -above_mm + step; s <= reach_mm + step; s += step) {
    const double now = static_cast<double>(linear_at(bone, start + way * s));
    if (now >= 0.5) return s - step * (now - 0.5) / (now - before);
    before = now;
  }
  return reach_mm;
}

}  // namespace

std::vector<PlateGap> plate_gaps(const World& world, const PlateModel& plate, const RigidTransform& pose,
                                 double opening_mm, int count, double reach_mm) {
  std::vector<PlateGap> gaps;
  const double above = std::max(1.0, plate.thickness_mm);
  const Vec3 down = pose.rotation.column[2] * -1;
  for (const bool moving : {false, true}) {
    if (moving && plate.moving.triangles.empty()) continue;
    // The underside is a third of a plate's surface.
    for (const PlateSample& s : sample_plate(plate, 3 * count, 0, moving)) {
      if (s.outwards.z > -0.9 || s.at_mm.z > 0.5 * plate.thickness_mm) continue;
      PlateGap g{s.at_mm + Vec3{moving ? opening_mm : 0, 0, 0}, reach_mm, SceneAction::kNobody};
      for (const PlacedBody& b : world.bodies()) {
        const double gap = gap_to(b, pose(g.at_mm), down, above, reach_mm);
        if (gap >= g.gap_mm) continue;
        g.gap_mm = gap;
        g.body = b.body->id;
      }
      gaps.push_back(g);
    }
  }
  return gaps;
}

std::vector<std::uint32_t> bodies_under(const World& world, const PlateModel& plate, const RigidTransform& pose,
                                        double near_mm) {
  const bool two_feet = !plate.moving.triangles.empty();
  std::map<std::uint32_t, int> all, moving;
  for (const PlateGap& g : plate_gaps(world, plate, pose, 0, 200, near_mm)) {
    if (g.body == SceneAction::kNobody) continue;
    // A finer region is part of the first body.
    const std::uint32_t body = world.find(g.body)->of_region ? world.bodies().front().body->id : g.body;
    ++(two_feet && g.at_mm.x > 0 ? moving : all)[body];
  }
  const auto most = [](const std::map<std::uint32_t, int>& counts, std::uint32_t but) {
    std::uint32_t best = SceneAction::kNobody;
    int n = 0;
    for (const auto& [body, count] : counts) {
      if (body != but && count > n) {
        best = body;
        n = count;
      }
    }
    return best;
  };
  std::vector<std::uint32_t> found;
  const std::uint32_t first = most(all, SceneAction::kNobody);
  if (first == SceneAction::kNobody) return found;
  found.push_back(first);
  const std::uint32_t second = most(two_feet ? moving : all, first);
  if (second != SceneAction::kNobody) found.push_back(second);
  return found;
}

}  // namespace osteo::inline simulation
