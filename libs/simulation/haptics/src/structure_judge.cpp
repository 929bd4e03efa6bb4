#include "osteo/simulation/haptics/structure_judge.h"

#include <algorithm>
#include <cmath>

#include "osteo/core/base/translate.h"
#include "osteo/simulation/bone/instrument.h"
#include "osteo/simulation/bone/plates.h"
#include "osteo/simulation/haptics/saw_slot.h"

namespace osteo::inline simulation {
namespace {

constexpr double kAgainMm = 0.03;  // a tool that has moved by less takes nothing new to speak of
constexpr double kSlackMm = 0.4;   // by how much the map's distances may be off what they can change on a way
constexpr double kCell = StructureJudge::kCellMm;

double share_inside(double distance_mm) {
  return std::clamp(0.5 - distance_mm / kCell, 0.0, 1.0);
}
std::uint8_t of_255(double share) {
  return static_cast<std::uint8_t>(std::lround(share * 255));
}
// Of a cell that two faces pass through, by the shares inside each and the cosine between their normals: exact for
// planes that are parallel (cosine 1 or -1), on average for those at right angles.
double share_of_both(double first, double other, double cosine) {
  const double crossing = first * other;
  const double parallel = cosine > 0 ? std::min(first, other) : std::max(0.0, first + other - 1);
  return crossing + std::abs(cosine) * (parallel - crossing);
}
template <class Distance>
Vec3 normal_at(Vec3 p, Distance&& distance_mm) {
  constexpr double kStepMm = kCell / 2;
  const double here = distance_mm(p);
  return normalized({distance_mm(p + Vec3{kStepMm, 0, 0}) - here, distance_mm(p + Vec3{0, kStepMm, 0}) - here,
                     distance_mm(p + Vec3{0, 0, kStepMm}) - here});
}
double half_diagonal_mm(int cells) {
  return 0.5 * std::sqrt(3.0) * cells * kCell;
}
Vec3 middle_of(std::array<int, 3> from, int size) {
  return {(from[0] + 0.5 * size) * kCell, (from[1] + 0.5 * size) * kCell, (from[2] + 0.5 * size) * kCell};
}

}  // namespace

std::string_view name_of(CutBy by) {
  return enum_names(by)[static_cast<std::size_t>(by)];
}

std::string reported_cut(const StructureMap& map, CutBy by, std::span<const StructureCut> cuts) {
  const std::string tool = tr(std::string(name_of(by)));
  std::string reported;
  if (const std::string through = reported_structures_cut(map, cuts); !through.empty())
    reported = by == CutBy::saw ? filled(tr("the saw cut through {what}"), {{"what", through}})
                                : filled(tr("the {tool} went through {what}"), {{"tool", tool}, {"what", through}});
  std::string met;
  for (const StructureCut& c : cuts) {
    if (c.mm3 > 0 || c.distance_mm > 0) continue;
    met += (met.empty() ? "" : ", ") + filled(tr("the {structure}"), {{"structure", tr(map.name_of(c.structure))}});
  }
  if (met.empty()) return reported;
  return reported + (reported.empty() ? "" : "; ") +
         filled(tr("contact of the {tool} with {what}"), {{"tool", tool}, {"what", met}});
}

double StructureJudge::Shape::distance_mm(Vec3 p) const {
  const Vec3 from = p - at_mm;
  const double z = dot(from, axis);
  return cone->distance_mm({std::sqrt(std::max(0.0, dot(from, from) - z * z)), 0, z});
}

StructureJudge::StructureJudge(const StructureMap& map, double rate_hz)
    : map_(map),
      same_ticks_(static_cast<std::uint64_t>(kSameS * rate_hz)),
      parts_(map.values().size()),
      each_(map.values().size()) {
  for (std::size_t s = 0; s < parts_.size(); ++s) {
    for (const auto& p : map.face(s).points_mm) parts_[s].box.include(from_floats(p));
  }
}

void StructureJudge::tick(const TickRecord& record, const RigidTransform& own_from_world, const CuttingGuide& guide) {
  if ((record.flags & (kPlateInHand | kPoseInvalid)) != 0 || record.hand >= last_.size()) return;
  const Instrument& held = instrument_of(record.device.tool);
  const Vec3 at = own_from_world(from_floats(record.device.position_mm) + from_floats(record.shown_offset_mm));
  const Vec3 axis = own_from_world.rotation * tool_axis(record, guide);
  if (!std::isfinite(dot(at, at)) || !std::isfinite(dot(axis, axis))) return;
  const bool turning = held.cutter() != nullptr && static_cast<double>(record.speed_rpm) > kTurnsRpm;
  const Vec3 end = at + axis * (held.shaft.start_mm + held.shaft.length_mm);
  Last& last = last_[record.hand];
  if (turning == last.turning && record.device.tool == last.tool &&
      std::max(length(at - last.at_mm), length(end - last.end_mm)) < kAgainMm)
    return;
  last = {at, end, record.device.tool, turning};
  // The head first: what its shaft follows it into is gone.
  if (turning)
    meet(held.kind == InstrumentKind::saw ? CutBy::hand_saw : CutBy::burr, record.hand, record.tick,
         {&held.head, at, axis});
  meet(CutBy::shaft, record.hand, record.tick, {&held.shaft, at, axis});
}

bool StructureJudge::may_meet(const Part& part, const Shape& shape) const {
  const Vec3 a = shape.at_mm + shape.axis * shape.cone->start_mm, b = a + shape.axis * shape.cone->length_mm;
  const double r = shape.cone->largest_radius_mm();
  for (std::size_t k = 0; k < 3; ++k) {
    if (std::min(a[k], b[k]) - r > part.box.hi[k] || std::max(a[k], b[k]) + r < part.box.lo[k]) return false;
  }
  return true;
}

void StructureJudge::meet(CutBy by, std::uint32_t hand, std::uint64_t tick, const Shape& shape) {
  if (std::none_of(parts_.begin(), parts_.end(), [&](const Part& p) { return may_meet(p, shape); })) return;
  map_.clearance(*shape.cone, shape.at_mm, shape.axis, each_);
  for (std::size_t s = 0; s < parts_.size(); ++s) {
    if (each_[s] > 0 || map_.opened(s) || !may_meet(parts_[s], shape)) continue;
    const Vec3 a = shape.at_mm + shape.axis * shape.cone->start_mm, b = a + shape.axis * shape.cone->length_mm;
    const double r = shape.cone->largest_radius_mm() + kCell;
    std::array<int, 3> from{};
    int size = kEdge;
    const auto block_of = [](double mm) { return static_cast<int>(std::floor(mm / (kCell * kEdge))) * kEdge; };
    Vec3 nearest = (a + b) / 2;
    double least = 1e9;
    for (std::size_t k = 0; k < 3; ++k) {
      const double lo = std::max(std::min(a[k], b[k]) - r, parts_[s].box.lo[k] - kCell),
                   hi = std::min(std::max(a[k], b[k]) + r, parts_[s].box.hi[k] + kCell);
      from[k] = block_of(lo);
      while (from[k] + size < block_of(hi) + kEdge) size *= 2;
    }
    Taken taken;
    take(s, shape, from, size, taken);
    // Where it is, when nothing of it was new: the place of the axis that lies deepest.
    for (int n = 0; n <= 16; ++n) {
      const Vec3 p = a + (b - a) * (n / 16.0);
      const double d = map_.distance_mm(s, p);
      if (d < least) {
        least = d;
        nearest = p;
      }
    }
    keep(by, hand, tick, s, nearest, taken);
  }
}

// A cube of cells, halved where both faces may pass through it.
void StructureJudge::take(std::size_t part, const Shape& shape, std::array<int, 3> from, int size, Taken& taken) {
  const Vec3 middle = middle_of(from, size);
  const double reach = half_diagonal_mm(size) + kCell;
  if (shape.distance_mm(middle) > reach) return;
  const double d = map_.distance_mm(part, middle);
  // Beyond the map's reach it is only known to be farther than that.
  if (d > reach + kSlackMm || (d >= map_.reach_mm() && reach < map_.reach_mm())) return;
  if (size == kEdge) {
    take_block(part, block_at(part, from), shape, from, taken);
    return;
  }
  const int half = size / 2;
  for (int n = 0; n < 8; ++n)
    take(part, shape, {from[0] + (n & 1) * half, from[1] + (n >> 1 & 1) * half, from[2] + (n >> 2) * half}, half,
         taken);
}

StructureJudge::Block& StructureJudge::block_at(std::size_t part, std::array<int, 3> from) {
  std::uint64_t key = 0;
  for (const int f : from) key = key << 21 | static_cast<std::uint64_t>(f / kEdge + (1 << 20));
  const auto [at, is_new] = parts_[part].blocks.try_emplace(key);
  Block& block = at->second;
  if (!is_new) return block;
  block.taken.fill(0);
  std::size_t n = 0;
  for (int k = 0; k < kEdge; ++k) {
    for (int j = 0; j < kEdge; ++j) {
      for (int i = 0; i < kEdge; ++i, ++n) {
        const Vec3 cell = middle_of({from[0] + i, from[1] + j, from[2] + k}, 1);
        block.filled[n] = of_255(share_inside(map_.distance_mm(part, cell)));
        if (block.filled[n] > 0) ++block.open;
      }
    }
  }
  return block;
}

void StructureJudge::take_block(std::size_t part, Block& block, const Shape& shape, std::array<int, 3> from,
                                Taken& taken) {
  if (block.open == 0) return;
  const bool whole = shape.distance_mm(middle_of(from, kEdge)) < -half_diagonal_mm(kEdge) - kCell;
  std::size_t n = 0;
  for (int k = 0; k < kEdge; ++k) {
    for (int j = 0; j < kEdge; ++j) {
      for (int i = 0; i < kEdge; ++i, ++n) {
        if (block.filled[n] == 0 || block.taken[n] == 255) continue;
        const Vec3 cell = middle_of({from[0] + i, from[1] + j, from[2] + k}, 1);
        const double filled = block.filled[n] / 255.0;
        double share = whole ? 1 : share_inside(shape.distance_mm(cell));
        if (share > 0 && share < 1 && filled < 1) {
          const Vec3 tool = normal_at(cell, [&](Vec3 p) { return shape.distance_mm(p); });
          const Vec3 face = normal_at(cell, [&](Vec3 p) { return map_.distance_mm(part, p); });
          share = share_of_both(filled, share, dot(tool, face)) / filled;
        }
        const std::uint8_t now = of_255(share);
        if (now <= block.taken[n]) continue;
        const double mm3 = kCell * kCell * kCell * filled * ((now - block.taken[n]) / 255.0);
        taken.mm3 += mm3;
        taken.moment += cell * mm3;
        block.taken[n] = now;
        if (now == 255) --block.open;
      }
    }
  }
}

void StructureJudge::keep(CutBy by, std::uint32_t hand, std::uint64_t tick, std::size_t part, Vec3 at_mm,
                          const Taken& taken) {
  const Vec3 here = taken.mm3 > 0 ? taken.moment / taken.mm3 : at_mm;
  auto same = std::find_if(kept_.rbegin(), kept_.rend(), [&](const Kept& k) {
    return k.event.by == by && k.event.hand == hand && k.part == part && tick - k.last_tick <= same_ticks_ &&
           length(here - k.last_mm) <= kSameMm;
  });
  if (same == kept_.rend()) {
    // Again where all is taken: nothing happens to it there any more.
    if (taken.mm3 <= 0) return;
    kept_.push_back({{tick, {}, by, hand}, part, tick, here, {}});
    same = kept_.rbegin();
  }
  same->last_tick = tick;
  same->last_mm = here;
  same->taken.mm3 += taken.mm3;
  same->taken.moment += taken.moment;
}

StructureCut StructureJudge::cut_of(std::size_t part, const Taken& taken, Vec3 at_mm) const {
  StructureCut c;
  c.structure = map_.values()[part];
  c.mm3 = taken.mm3 >= StructureCut::kMinMm3 ? taken.mm3 : 0;
  c.at_mm = taken.mm3 > 0 ? taken.moment / taken.mm3 : at_mm;
  return c;
}

std::vector<StructureCut> StructureJudge::saw(std::uint64_t tick, const World& world, const SawCut& cut,
                                              std::span<const VoxelKey> voxels) {
  const std::optional<SawCut> blade = blade_at_work(world, cut, voxels);
  if (!blade) return {};
  std::vector<StructureCut> cuts = structures_cut(map_, *blade);
  for (const StructureCut& c : cuts) {
    if (c.distance_mm > 0) continue;
    const auto part = static_cast<std::size_t>(std::find(map_.values().begin(), map_.values().end(), c.structure) -
                                               map_.values().begin());
    kept_.push_back({{tick, {}, CutBy::saw, 0}, part, tick, c.at_mm, {c.mm3, c.at_mm * c.mm3}});
  }
  return cuts;
}

std::vector<StructureCut> StructureJudge::attach(std::uint64_t tick, const World& world, const SceneAction& action) {
  if (action.item >= plate_library().size()) return {};
  const PlateModel& plate = plate_library()[action.item];
  const RigidTransform own = world.bodies().front().world_from_body.inverse() * action.transform();
  const double radius = plate.screw_mm / 2;
  const RoundCone screw{radius, kScrewDiameters * plate.screw_mm - 2 * radius, radius, radius};
  // Of these screws alone: what they do is no part of what those of another plate did a moment before.
  std::vector<Kept> before;
  std::swap(before, kept_);
  for (const Vec3& hole : plate.holes_mm)
    meet(CutBy::plate_screws, 0, tick, {&screw, own(hole), -own.rotation.column[2]});
  std::swap(before, kept_);
  std::vector<StructureCut> cuts;
  for (std::size_t s = 0; s < parts_.size(); ++s) {
    Kept all;
    bool any = false;
    for (const Kept& k : before) {
      if (k.part != s) continue;
      if (!any) all = k;
      if (any) {
        all.taken.mm3 += k.taken.mm3;
        all.taken.moment += k.taken.moment;
      }
      any = true;
    }
    if (!any) continue;
    cuts.push_back(cut_of(s, all.taken, all.last_mm));
    kept_.push_back(all);
  }
  return cuts;
}

std::vector<StructureCutEvent> StructureJudge::events() const {
  std::vector<StructureCutEvent> all;
  for (const Kept& k : kept_) {
    all.push_back(k.event);
    all.back().cut = cut_of(k.part, k.taken, k.last_mm);
  }
  std::stable_sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.tick < b.tick; });
  return all;
}

}  // namespace osteo::inline simulation
