#include "osteo/assessment/evidence/visibility.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "osteo/assessment/evidence/detail/hand_motion.h"
#include "osteo/geometry/grid/brick_places.h"
#include "osteo/simulation/bone/instrument.h"

namespace osteo::inline assessment {
namespace {

// Walks the cells of a lattice that a segment passes through, in index coordinates where cell n spans [n - 0.5, n +
// 0.5].
class Walk {
 public:
  Walk(Vec3 from, Vec3 to, double cell) {
    for (std::size_t a = 0; a < 3; ++a) {
      const double x = (from[a] + 0.5) / cell, d = (to[a] - from[a]) / cell;
      at_[a] = static_cast<int>(std::floor(x));
      step_[a] = d > 0 ? 1 : -1;
      const double wall = d > 0 ? at_[a] + 1 - x : x - at_[a];
      next_[a] = d != 0 ? wall / std::abs(d) : std::numeric_limits<double>::infinity();
      each_[a] = d != 0 ? 1 / std::abs(d) : std::numeric_limits<double>::infinity();
    }
  }
  [[nodiscard]] const std::array<int, 3>& cell() const { return at_; }
  /// Where along the segment (0 to 1) the cell is left; the walk ends at 1.
  [[nodiscard]] double leaves_at() const { return std::min({next_[0], next_[1], next_[2]}); }
  void step() {
    const std::size_t a = next_[0] <= next_[1] ? (next_[0] <= next_[2] ? 0 : 2) : (next_[1] <= next_[2] ? 1 : 2);
    at_[a] += step_[a];
    next_[a] += each_[a];
  }

 private:
  std::array<int, 3> at_{}, step_{};
  std::array<double, 3> next_{}, each_{};
};

// The part of a segment (0 to 1) within the box [lo, hi] of index coordinates; empty: first > second.
std::pair<double, double> within(Vec3 from, Vec3 to, Vec3 lo, Vec3 hi) {
  double t0 = 0, t1 = 1;
  for (std::size_t a = 0; a < 3; ++a) {
    const double d = to[a] - from[a];
    if (d == 0) {
      if (from[a] < lo[a] || from[a] > hi[a]) return {1, 0};
      continue;
    }
    const double u = (lo[a] - from[a]) / d, v = (hi[a] - from[a]) / d;
    t0 = std::max(t0, std::min(u, v));
    t1 = std::min(t1, std::max(u, v));
  }
  return {t0, t1};
}

bool hits(const PlacedBody& placed, Vec3 from_mm, Vec3 to_mm, const BoneSight::LeftOut& left_out, VoxelKey& hit) {
  const BrickGrid& bone = placed.body->bone;
  if (bone.brick_count() == 0) return false;
  const RigidTransform back = placed.world_from_body.inverse();
  const Vec3 whole_from = bone.frame().index_from_world(back(from_mm)),
             whole_to = bone.frame().index_from_world(back(to_mm));
  const auto& dims = bone.frame().dims;
  const auto up = [](int n) { return (n + 7) / 8 * 8 + 8 - 0.5; };
  const auto [t0, t1] = within(whole_from, whole_to, {-0.5, -0.5, -0.5}, {up(dims[0]), up(dims[1]), up(dims[2])});
  if (!(t0 < t1)) return false;
  const Vec3 by = whole_to - whole_from, from = whole_from + by * t0, to = whole_from + by * t1;
  // Bricks first; in those that are stored, voxels. A voxel's walk begins where the segment enters its brick.
  Walk bricks(from, to, BrickGrid::kEdge);
  double enters = 0;
  for (;;) {
    const auto b = bricks.cell();
    const double leaves = std::min(1.0, bricks.leaves_at());
    if (const std::uint32_t brick = bone.find_brick(b[0], b[1], b[2]); brick != BrickGrid::kNone) {
      const Vec3 along = to - from, in = from + along * enters, out = from + along * leaves;
      Walk voxels(in, out, 1);
      for (;;) {
        const auto& v = voxels.cell();
        // Rounding may begin or end a cell beside the brick: that belongs to the next, which is walked too.
        if (v[0] >> 3 == b[0] && v[1] >> 3 == b[1] && v[2] >> 3 == b[2]) {
          const VoxelKey own = brick * BrickGrid::kVoxels + BrickGrid::offset_in_brick(v[0], v[1], v[2]);
          if (bone.value(own) >= kSolid && !(left_out && left_out(placed, own))) {
            hit = own;
            return true;
          }
        }
        if (voxels.leaves_at() >= 1) break;
        voxels.step();
      }
    }
    if (leaves >= 1) return false;
    enters = leaves;
    bricks.step();
  }
}

// A burr's head where it removed bone.
struct Head {
  Vec3 at_mm, axis;
  RoundCone shape;
  std::uint8_t tool = 0;
};

double distance_mm(const Head& h, Vec3 p_mm) {
  const Vec3 d = p_mm - h.at_mm;
  const double axial = dot(d, h.axis);
  const double radial = length(d - h.axis * axial);
  return h.shape.distance_mm({radial, 0, axial});
}

}  // namespace

bool BoneSight::first_hit(Vec3 from_mm, Vec3 to_mm, const LeftOut& left_out, Hit& hit) const {
  for (const PlacedBody& b : world_.bodies()) {
    if (hits(b, from_mm, to_mm, left_out, hit.own)) {
      hit.body = &b;
      return true;
    }
  }
  return false;
}

bool BoneSight::blocked(Vec3 from_mm, Vec3 to_mm, const LeftOut& left_out) const {
  Hit hit;
  return first_hit(from_mm, to_mm, left_out, hit);
}

void VisibilityMetric::frame(const EvidenceFrame& f) {
  std::vector<VoxelKey> removed;
  for (const VoxelChange& c : f.changes) {
    if (c.before >= kSolid && c.density < kSolid) removed.push_back(c.voxel);
  }
  if (removed.empty()) return;
  std::vector<Head> heads;
  PerHand<std::optional<Head>> last;
  for (const TickRecord& t : f.ticks) {
    if (t.removed_mm3 <= 0) continue;
    const Instrument& tool = instrument_of(t.device.tool);
    const Head h{from_floats(t.device.position_mm), normalized(from_floats(t.device.axis)), tool.head, t.device.tool};
    // Heads nearly where the hand's one before was add nothing.
    std::optional<Head>& before = last[t.hand];
    if (before && before->tool == h.tool && length(before->at_mm - h.at_mm) < 0.02 &&
        dot(before->axis, h.axis) > 0.9999)
      continue;
    before = h;
    heads.push_back(h);
  }
  const BoneSight sight(f.world);
  // A voxel is asked for many times in a frame.
  std::unordered_map<VoxelKey, bool> known;
  const auto touched = [&](const PlacedBody& body, VoxelKey own) {
    const auto [at, is_new] = known.try_emplace(body.body->name_of(own), false);
    if (is_new) {
      const Frame& frame = body.body->bone.frame();
      const Vec3 p = body.world_from_body(place_of_voxel_mm(body.body->bone, own));
      const double diagonal = length(frame.spacing_mm);
      at->second =
          std::any_of(heads.begin(), heads.end(), [&](const Head& h) { return distance_mm(h, p) <= diagonal; });
    }
    return at->second;
  };
  for (const VoxelKey name : removed) {
    const PlacedBody* const b = f.world.owner(name);
    if (b == nullptr) continue;
    const VoxelKey own = name - b->body->name_of(0);
    const Vec3 own_mm = place_of_voxel_mm(b->body->bone, own);
    Voxel v{Seen::unknown, f.ticks.empty() ? 0 : f.ticks.back().tick, own_mm,
            static_cast<float>(b->body->bone.frame().voxel_volume_mm3())};
    if (f.camera != nullptr)
      v.seen = sight.blocked(b->world_from_body(own_mm), f.camera->eye_mm, touched) ? Seen::hidden : Seen::seen;
    voxels_[name] = v;
  }
}

void VisibilityMetric::finish(const World& world, std::vector<Measured>& values, std::vector<Moment>& moments) {
  // What undo has put back was not removed.
  std::erase_if(voxels_, [&](const auto& v) {
    const PlacedBody* const b = world.owner(v.first);
    return b != nullptr && b->body->bone.value(v.first - b->body->name_of(0)) >= kSolid;
  });
  double seen = 0, hidden = 0, unknown = 0;
  std::map<std::uint8_t, double> near;
  std::map<std::uint8_t, std::uint64_t> last_reported;
  for (const auto& [name, v] : voxels_) {
    (v.seen == Seen::seen ? seen : v.seen == Seen::hidden ? hidden : unknown) += static_cast<double>(v.mm3);
    if (v.seen != Seen::hidden || scene_.structures == nullptr) continue;
    const StructureMap::Answer a = scene_.structures->at_risk(v.own_mm);
    if (a.structure != 0 && a.distance_mm <= kNearMm) near[a.structure] += static_cast<double>(v.mm3);
  }
  const std::string why = voxels_.empty() ? "no voxel lost half of its bone" : "the session has no camera notes";
  if (seen + hidden == 0) {
    not_measured_all(values, MetricPlace::sight, {MetricWhen::camera, MetricWhen::structures}, why);
    return;
  }
  values.push_back(measured("seen_share", seen / (seen + hidden)));
  values.push_back(measured("hidden_mm3", hidden));
  if (unknown > 0) values.push_back(measured("sight_unknown_mm3", unknown));
  if (scene_.structures == nullptr) {
    not_measured_all(values, MetricPlace::sight, {MetricWhen::structures}, "the case has no structures");
    return;
  }
  for (const std::uint8_t s : scene_.structures->values())
    values.push_back(measured("hidden_near_mm3", near.contains(s) ? near[s] : 0, scene_.structures->name_of(s)));
  // One moment a second and structure is enough to go and look.
  std::vector<const std::pair<const VoxelKey, Voxel>*> in_time;
  for (const auto& v : voxels_) {
    if (v.second.seen == Seen::hidden) in_time.push_back(&v);
  }
  std::stable_sort(in_time.begin(), in_time.end(),
                   [](const auto* a, const auto* b) { return a->second.tick < b->second.tick; });
  for (const auto* const v : in_time) {
    const StructureMap::Answer a = scene_.structures->at_risk(v->second.own_mm);
    if (a.structure == 0 || a.distance_mm > kNearMm) continue;
    const auto reported = last_reported.find(a.structure);
    if (reported != last_reported.end() && static_cast<double>(v->second.tick - reported->second) < scene_.rate_hz)
      continue;
    last_reported[a.structure] = v->second.tick;
    moments.push_back({static_cast<double>(v->second.tick) / scene_.rate_hz, v->second.own_mm, "removed unseen",
                       scene_.structures->name_of(a.structure), a.distance_mm, kNearMm});
  }
}

}  // namespace osteo::inline assessment
