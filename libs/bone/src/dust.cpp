#include "osteo/bone/dust.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "osteo/base/files.h"
#include "osteo/base/portable_math.h"
#include "osteo/grid/brick_places.h"

namespace osteo {
namespace {

Ijk stepped(Ijk c, int axis, int by) {
  (axis == 0 ? c.i : axis == 1 ? c.j : c.k) += by;
  return c;
}

}  // namespace

Dust::Dust(const BrickGrid& bone, const DustParams& params)
    : bone_(bone), capacity_(static_cast<std::uint32_t>(std::clamp(params.packing, 0.01, 1.0) * kUnitsAVoxel)) {
  const Vec3 g = transposed(bone.frame().direction) * params.gravity;
  for (int a = 0; a < 3; ++a) {
    if (std::abs(g[static_cast<std::size_t>(a)]) > std::abs(g[static_cast<std::size_t>(axis_)])) axis_ = a;
  }
  sign_ = g[static_cast<std::size_t>(axis_)] < 0 ? -1 : 1;
}

bool Dust::in_reach(Ijk c) const {
  const auto& n = bone_.frame().dims;
  const int r = kReach * 8;
  return c.i >= -r && c.j >= -r && c.k >= -r && c.i < n[0] + r && c.j < n[1] + r && c.k < n[2] + r;
}

std::uint32_t* Dust::cell(Ijk c, bool make) {
  const std::uint64_t k = key(c.i >> 3, c.j >> 3, c.k >> 3);
  auto found = index_.find(k);
  if (found == index_.end()) {
    if (!make) return nullptr;
    found = index_.emplace(k, static_cast<std::uint32_t>(bricks_.size())).first;
    bricks_.push_back(std::make_unique<Brick>());
    bricks_.back()->at = {c.i >> 3, c.j >> 3, c.k >> 3};
  }
  return &bricks_[found->second]->units[BrickGrid::offset_in_brick(c.i, c.j, c.k)];
}

// The brick of a cell and those beside it, as far as the cell touches them: what happened here may set them moving.
void Dust::wake(Ijk c) {
  for (int k = (c.k - 1) >> 3; k <= (c.k + 1) >> 3; ++k)
    for (int j = (c.j - 1) >> 3; j <= (c.j + 1) >> 3; ++j)
      for (int i = (c.i - 1) >> 3; i <= (c.i + 1) >> 3; ++i) {
        const auto found = index_.find(key(i, j, k));
        if (found == index_.end() || bricks_[found->second]->awake) continue;
        bricks_[found->second]->awake = true;
        next_.push_back(found->second);
      }
}

void Dust::add_at(Vec3 world_mm, double mm3) {
  const Vec3 x = bone_.frame().index_from_world(world_mm);
  add(Ijk{static_cast<int>(std::lround(x.x)), static_cast<int>(std::lround(x.y)), static_cast<int>(std::lround(x.z))}, mm3);
}

void Dust::bone_changed(std::uint32_t brick) {
  const Ijk o = bone_.brick_coordinate(brick);
  for (int n = 0; n < 8; ++n) wake({o.i * 8 + (n & 1) * 7, o.j * 8 + (n >> 1 & 1) * 7, o.k * 8 + (n >> 2) * 7});
}

void Dust::add(Ijk c, double mm3) {
  const double units = mm3 / bone_.frame().voxel_volume_mm3() * kUnitsAVoxel + carry_;
  const auto whole = static_cast<std::uint32_t>(std::clamp(units, 0.0, 4e9));
  carry_ = units - whole;
  if (whole == 0) return;
  added_ += whole;
  if (!in_reach(c)) {
    fallen_ += whole;
    return;
  }
  *cell(c, true) += whole;
  wake(c);
}

// As much as fits, up to `most`. Returns what went.
std::uint32_t Dust::move(std::uint32_t& from, Ijk to, std::uint32_t most) {
  if (most == 0 || solid(to)) return 0;
  if (!in_reach(to)) {
    from -= most;
    fallen_ += most;
    return most;
  }
  const std::uint32_t* const there = cell(to, false);
  const std::uint32_t held = there != nullptr ? *there : 0;
  if (held >= capacity_) return 0;
  const std::uint32_t amount = std::min(most, capacity_ - held);
  *cell(to, true) += amount;  // may make a brick; `from` stays, since bricks do not move
  from -= amount;
  return amount;
}

void Dust::step() {
  // Lowest first, so that what falls does not fall on in the same step, and a column falls as one.
  awake_.swap(next_);
  next_.clear();
  const auto height = [&](const Brick& b) { return sign_ * (axis_ == 0 ? b.at.i : axis_ == 1 ? b.at.j : b.at.k); };
  std::sort(awake_.begin(), awake_.end(), [&](std::uint32_t a, std::uint32_t b) {
    const Brick &x = *bricks_[a], &y = *bricks_[b];
    if (height(x) != height(y)) return height(x) > height(y);
    return key(x.at.i, x.at.j, x.at.k) < key(y.at.i, y.at.j, y.at.k);
  });
  for (const std::uint32_t b : awake_) bricks_[b]->awake = false;
  ++steps_;
  for (const std::uint32_t b : awake_) step_brick(*bricks_[b]);
}

// One brick's cells. Its 26 neighbours are looked up once: nothing reaches farther in a step.
void Dust::step_brick(Brick& brick) {
  struct Neighbour {
    Brick* dust = nullptr;
    std::uint32_t bone = BrickGrid::kNone;
  };
  std::array<Neighbour, 27> hood;
  for (int n = 0; n < 27; ++n) {
    const Ijk at{brick.at.i + n % 3 - 1, brick.at.j + n / 3 % 3 - 1, brick.at.k + n / 9 - 1};
    const auto found = index_.find(key(at.i, at.j, at.k));
    hood[static_cast<std::size_t>(n)] = {found == index_.end() ? nullptr : bricks_[found->second].get(),
                                         bone_.find_brick(at.i, at.j, at.k)};
  }
  // Cells by their place from the brick's first, -1 to 8 along each axis.
  using Place = std::array<int, 3>;
  const auto neighbour = [](const Place& p) {
    return static_cast<std::size_t>(((p[0] >> 3) + 1) + ((p[1] >> 3) + 1) * 3 + ((p[2] >> 3) + 1) * 9);
  };
  const auto offset = [](const Place& p) { return BrickGrid::offset_in_brick(p[0], p[1], p[2]); };
  const auto is_solid = [&](const Place& p) {
    const std::uint32_t bone = hood[neighbour(p)].bone;
    return bone != BrickGrid::kNone && bone_.value(bone * BrickGrid::kVoxels + offset(p)) >= 0.5F;
  };
  const auto give = [&](std::uint32_t& from, const Place& to, std::uint32_t most) -> std::uint32_t {
    if (most == 0 || is_solid(to)) return 0;
    Neighbour& n = hood[neighbour(to)];
    std::uint32_t amount = std::min(most, capacity_);
    if (n.dust == nullptr) {
      const Ijk c{brick.at.i * 8 + to[0], brick.at.j * 8 + to[1], brick.at.k * 8 + to[2]};
      if (!in_reach(c)) {
        from -= most;
        fallen_ += most;
        return most;
      }
      static_cast<void>(cell(c, true));
      n.dust = bricks_.back().get();
    }
    std::uint32_t& there = n.dust->units[offset(to)];
    if (there >= capacity_) return 0;
    amount = std::min(most, capacity_ - there);
    there += amount;
    from -= amount;
    return amount;
  };
  std::uint32_t woken = 0;  // bits of the neighbourhood
  const auto wake_around = [&](const Place& p) {
    for (int k = (p[2] - 1) >> 3; k <= (p[2] + 1) >> 3; ++k)
      for (int j = (p[1] - 1) >> 3; j <= (p[1] + 1) >> 3; ++j)
        for (int i = (p[0] - 1) >> 3; i <= (p[0] + 1) >> 3; ++i) woken |= 1U << (i + 1 + (j + 1) * 3 + (k + 1) * 9);
  };
  const auto axis = static_cast<std::size_t>(axis_), side0 = (axis + 1) % 3, side1 = (axis + 2) % 3;
  const auto turn0 = static_cast<int>(steps_ % 4);
  for (int layer = 0; layer < 8; ++layer) {
    for (int n = 0; n < 64; ++n) {
      // The other way round every other step, so that piles do not lean.
      const int place = steps_ % 2 == 0 ? n : 63 - n;
      Place c{};
      c[axis] = sign_ > 0 ? 7 - layer : layer;
      c[side0] = place & 7;
      c[side1] = place >> 3;
      std::uint32_t& units = brick.units[offset(c)];
      if (units == 0) continue;
      const std::uint32_t before = units;
      Place below = c;
      below[axis] += sign_;
      give(units, below, units);
      const auto beside = [&](int s) {
        const int turn = (s + turn0) % 4;
        Place p = c;
        p[turn < 2 ? side0 : side1] += turn % 2 == 0 ? 1 : -1;
        return p;
      };
      const auto part_of = [](std::uint32_t amount, int s) {
        return (amount + 3 - static_cast<std::uint32_t>(s)) / (4 - static_cast<std::uint32_t>(s));
      };
      // Down a slope: sideways and down at once, where both are free.
      for (int s = 0; s < 4 && units > 0; ++s) {
        Place p = beside(s);
        if (is_solid(p)) continue;
        p[axis] += sign_;
        give(units, p, part_of(units, s));
      }
      if (units > 0) {
        // Too full, or bone stands here (it was cut into by less than half): to the sides, then up.
        std::uint32_t excess = is_solid(c) ? units : units - std::min(units, capacity_);
        for (int s = 0; s < 4 && excess > 0; ++s) excess -= give(units, beside(s), part_of(excess, s));
        if (excess > 0) {
          Place above = c;
          above[axis] -= sign_;
          give(units, above, excess);
        }
      }
      if (units == before) continue;
      wake_around(c);
      Place two = below;
      two[axis] += sign_;
      wake_around(two);
    }
  }
  for (int n = 0; n < 27; ++n) {
    if ((woken >> n & 1) == 0) continue;
    const auto found = index_.find(key(brick.at.i + n % 3 - 1, brick.at.j + n / 3 % 3 - 1, brick.at.k + n / 9 - 1));
    if (found == index_.end() || bricks_[found->second]->awake) continue;
    bricks_[found->second]->awake = true;
    next_.push_back(found->second);
  }
}

// Row by row, as if all cells of the ball were walked; but dust lies in bricks alone, so that no radius costs more than they do.
template <class F>
void Dust::in_ball(Vec3 centre_mm, double radius_mm, F&& f) {
  const Frame& frame = bone_.frame();
  const Vec3 x = frame.index_from_world(centre_mm);
  const double r = radius_mm / frame.spacing_mm.x;
  if (!std::isfinite(dot(x, x)) || !(r > 0)) return;
  std::vector<Brick*> met;
  for (const auto& b : bricks_) {
    const Ijk o{b->at.i * 8, b->at.j * 8, b->at.k * 8};
    if (o.i <= x.x + r && o.i + 7 >= x.x - r && o.j <= x.y + r && o.j + 7 >= x.y - r && o.k <= x.z + r && o.k + 7 >= x.z - r)
      met.push_back(b.get());
  }
  const auto place = [](const Brick* b) { return std::tuple(b->at.k, b->at.j, b->at.i); };
  std::sort(met.begin(), met.end(), [&](const Brick* a, const Brick* b) { return place(a) < place(b); });
  for (auto layer = met.begin(); layer != met.end();) {
    const auto layer_end = std::find_if(layer, met.end(), [&](const Brick* b) { return b->at.k != (*layer)->at.k; });
    for (int k = 0; k < 8; ++k) {
      for (auto row = layer; row != layer_end;) {
        const auto row_end = std::find_if(row, layer_end, [&](const Brick* b) { return b->at.j != (*row)->at.j; });
        for (int j = 0; j < 8; ++j) {
          for (auto b = row; b != row_end; ++b) {
            for (int i = 0; i < 8; ++i) {
              std::uint32_t& units = (*b)->units[BrickGrid::offset_in_brick(i, j, k)];
              if (units == 0) continue;
              const Ijk c{(*b)->at.i * 8 + i, (*b)->at.j * 8 + j, (*b)->at.k * 8 + k};
              const Vec3 d = Vec3{double(c.i), double(c.j), double(c.k)} - x;
              if (dot(d, d) <= r * r) f(c, units, d);
            }
          }
        }
        row = row_end;
      }
    }
    layer = layer_end;
  }
}

void Dust::push(const RoundCone& tool, Vec3 start_mm, Vec3 axis) {
  const Frame& frame = bone_.frame();
  const Vec3 middle = start_mm + axis * (tool.start_mm + tool.length_mm / 2);
  const double reach = tool.length_mm / 2 + tool.largest_radius_mm();
  in_ball(middle, reach, [&](Ijk c, std::uint32_t& units, Vec3) {
    const Vec3 p = place_of_voxel_mm(frame, c) - start_mm - axis * tool.start_mm;
    const double t = dot(p, axis), foot = tool.foot_mm(length(p - axis * t), t);
    const Vec3 out = p - axis * foot;
    const double inside = tool.radius_at_mm(foot) - length(out);
    if (inside <= 0) return;
    // To the first cell beyond the surface along the normal, and on until there is room.
    const Vec3 n = transposed(frame.direction) * (length(out) > 1e-6 ? normalized(out) : any_perpendicular(axis));
    const double far = inside / frame.spacing_mm.x;
    for (int s = 1; s <= 4 && units > 0; ++s) {
      const Ijk to{static_cast<int>(std::lround(c.i + n.x * (far + s))), static_cast<int>(std::lround(c.j + n.y * (far + s))),
                   static_cast<int>(std::lround(c.k + n.z * (far + s)))};
      if (to == c) continue;
      if (move(units, to, units) > 0) wake(to);
    }
    // No room: heaped up beyond what a cell holds, outside the tool along the normal, or where bone is there upwards out of it; it spreads
    // with the next steps.
    for (int s = 1; s <= 64 && units > 0; ++s) {
      const Ijk aside{static_cast<int>(std::lround(c.i + n.x * (far + s))), static_cast<int>(std::lround(c.j + n.y * (far + s))),
                      static_cast<int>(std::lround(c.k + n.z * (far + s)))};
      const Ijk to = s == 1 ? aside : stepped(c, axis_, -sign_ * s);
      if (to == c || solid(to) || !in_reach(to)) continue;
      const Vec3 q = place_of_voxel_mm(frame, to) - start_mm - axis * tool.start_mm;
      const double along = dot(q, axis), off = length(q - axis * along), its_foot = tool.foot_mm(off, along);
      if (portable::hypot(off, along - its_foot) < tool.radius_at_mm(its_foot)) continue;
      *cell(to, true) += units;
      units = 0;
      wake(to);
    }
    wake(c);
  });
}

double Dust::suck(Vec3 nozzle_mm, double radius_mm, double mm3) {
  const double voxel = bone_.frame().voxel_volume_mm3();
  auto wanted = static_cast<std::uint64_t>(std::max(0.0, mm3 / voxel * kUnitsAVoxel));
  struct Near {
    double distance2;
    Ijk at;
    std::uint32_t* units;
  };
  std::vector<Near> near;
  in_ball(nozzle_mm, radius_mm, [&](Ijk c, std::uint32_t& units, Vec3 d) { near.push_back({dot(d, d), c, &units}); });
  std::stable_sort(near.begin(), near.end(), [](const Near& a, const Near& b) { return a.distance2 < b.distance2; });
  std::uint64_t taken = 0;
  for (const Near& n : near) {
    if (wanted == 0) break;
    const auto amount = static_cast<std::uint32_t>(std::min<std::uint64_t>(*n.units, wanted));
    *n.units -= amount;
    wanted -= amount;
    taken += amount;
    wake(n.at);
  }
  sucked_ += taken;
  return static_cast<double>(taken) / kUnitsAVoxel * voxel;
}

double Dust::irrigate(Vec3 at_mm, double radius_mm, double share) {
  std::uint64_t taken = 0;
  in_ball(at_mm, radius_mm, [&](Ijk c, std::uint32_t& units, Vec3) {
    const auto amount = static_cast<std::uint32_t>(static_cast<double>(units) * std::clamp(share, 0.0, 1.0) + 0.5);
    units -= amount;
    taken += amount;
    wake(c);
  });
  washed_ += taken;
  return static_cast<double>(taken) / kUnitsAVoxel * bone_.frame().voxel_volume_mm3();
}

Dust::Totals Dust::totals() const {
  const double unit = bone_.frame().voxel_volume_mm3() / kUnitsAVoxel;
  std::uint64_t present = 0;
  for (const auto& b : bricks_)
    for (const std::uint32_t u : b->units) present += u;
  return {static_cast<double>(added_) * unit, static_cast<double>(present) * unit, static_cast<double>(sucked_) * unit,
          static_cast<double>(washed_) * unit, static_cast<double>(fallen_) * unit};
}

std::string Dust::hash() const {
  Hasher h;
  visit([&](Vec3 at, double full) {
    h.add(&at, sizeof at);
    h.add(&full, sizeof full);
  });
  return h.hex();
}

void Dust::visit(const std::function<void(Vec3, double)>& f) const {
  std::vector<const Brick*> order;
  for (const auto& b : bricks_) order.push_back(b.get());
  std::sort(order.begin(), order.end(),
            [](const Brick* a, const Brick* b) { return key(a->at.i, a->at.j, a->at.k) < key(b->at.i, b->at.j, b->at.k); });
  for (const Brick* b : order) {
    for (int v = 0; v < 512; ++v) {
      const std::uint32_t u = b->units[static_cast<std::size_t>(v)];
      if (u == 0) continue;
      f(bone_.frame().world_from_index({double(b->at.i * 8 + (v & 7)), double(b->at.j * 8 + (v >> 3 & 7)), double(b->at.k * 8 + (v >> 6))}),
        static_cast<double>(u) / capacity_);
    }
  }
}

}  // namespace osteo
