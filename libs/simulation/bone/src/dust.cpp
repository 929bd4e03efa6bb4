#include "osteo/simulation/bone/dust.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "dust_hood.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/portable_math.h"
#include "osteo/geometry/grid/brick_places.h"

namespace osteo::inline simulation {
namespace {

Ijk stepped(Ijk c, int axis, int by) {
  (axis == 0 ? c.i : axis == 1 ? c.j : c.k) += by;
  return c;
}

}  // namespace

Dust::Dust(const BrickGrid& bone, const DustParams& params)
    : bone_(bone), capacity_(static_cast<std::uint32_t>(std::clamp(params.packing, 0.01, 1.0) * kUnitsAVoxel)) {
  set_gravity({0, 1, 0});
  set_gravity(params.gravity);
}

void Dust::set_gravity(Vec3 direction) {
  if (!std::isfinite(dot(direction, direction)) || !(length(direction) > 0)) return;
  direction = normalized(direction);
  if (direction == gravity_) return;
  gravity_ = direction;
  pull_ = transposed(bone_.frame().direction) * direction;
  axis_ = 0;
  for (int a = 1; a < 3; ++a) {
    if (std::abs(pull_[static_cast<std::size_t>(a)]) > std::abs(pull_[static_cast<std::size_t>(axis_)])) axis_ = a;
  }
  const auto axis = static_cast<std::size_t>(axis_);
  sign_ = pull_[axis] < 0 ? -1 : 1;
  // Off an axis by rounding alone is on it.
  for (std::size_t a = 0; a < 3; ++a) {
    if (a != axis && std::abs(pull_[a]) < 1e-9) pull_[a] = 0;
  }
  constexpr double kRepose = 0.84;  // tangent of 40 degrees
  slides_.clear();
  lower_.clear();
  // The axis of gravity's own neighbours first, in the order in which they take turns.
  for (int n = 0; n < 27; ++n) {
    std::array<int, 3> by{};
    static constexpr std::array<int, 3> kTurns{1, -1, 0};
    by[axis] = kTurns[static_cast<std::size_t>(n / 9)] * sign_;
    by[(axis + 1) % 3] = kTurns[static_cast<std::size_t>(n / 3 % 3)];
    by[(axis + 2) % 3] = kTurns[static_cast<std::size_t>(n % 3)];
    const Vec3 d{double(by[0]), double(by[1]), double(by[2])};
    const double drop = dot(d, pull_), aside = std::sqrt(std::max(0.0, dot(d, d) - drop * drop));
    const Offset offset{{by[0], by[1], by[2]}, aside < 1e-9 * std::abs(drop) ? 1e9 : drop / aside};
    if (n == 26 || dot(d, d) > 2.5) continue;
    if (offset.slope >= kRepose && aside > 1e-6) slides_.push_back(offset);
    if (drop > -1e-9) lower_.push_back(offset);
  }
  const auto steeper = [](const Offset& a, const Offset& b) { return a.slope > b.slope + 1e-9; };
  std::stable_sort(slides_.begin(), slides_.end(), steeper);
  std::stable_sort(lower_.begin(), lower_.end(), steeper);
  for (const auto& b : bricks_) wake({b->at.i * 8 + 4, b->at.j * 8 + 4, b->at.k * 8 + 4});
  ++version_;
}

bool Dust::in_reach(Ijk c) const {
  const auto& n = bone_.frame().dims;
  const int r = kReach * 8;
  return c.i >= -r && c.j >= -r && c.k >= -r && c.i < n[0] + r && c.j < n[1] + r && c.k < n[2] + r;
}

Dust::Brick* Dust::brick_at(Ijk c, bool make) {
  const Ijk at{c.i >> 3, c.j >> 3, c.k >> 3};
  auto found = index_.find(key(at.i, at.j, at.k));
  if (found != index_.end()) return bricks_[found->second].get();
  if (!make) return nullptr;
  index_.emplace(key(at.i, at.j, at.k), static_cast<std::uint32_t>(bricks_.size()));
  bricks_.push_back(std::make_unique<Brick>());
  Brick& made = *bricks_.back();
  made.at = at;
  made.bone = bone_.find_brick(at.i, at.j, at.k);
  for (int n = 0; n < 6; ++n) {
    found = index_.find(key(at.i + (n == 1) - (n == 0), at.j + (n == 3) - (n == 2), at.k + (n == 5) - (n == 4)));
    if (found == index_.end()) continue;
    Brick* const other = bricks_[found->second].get();
    made.beside[static_cast<std::size_t>(n)] = other;
    other->beside[static_cast<std::size_t>(n ^ 1)] = &made;
  }
  return &made;
}

std::uint32_t* Dust::cell(Ijk c, bool make) {
  Brick* const b = brick_at(c, make);
  return b == nullptr ? nullptr : &b->units[BrickGrid::offset_in_brick(c.i, c.j, c.k)];
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
  add(Ijk{static_cast<int>(std::lround(x.x)), static_cast<int>(std::lround(x.y)), static_cast<int>(std::lround(x.z))},
      mm3);
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
  ++version_;
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
  if (!awake_.empty()) ++version_;
  for (const std::uint32_t b : awake_) step_brick(*bricks_[b]);
  if (!wet_) return;
  constexpr std::uint64_t kLevelEvery = 10, kDryEvery = 50;
  if (steps_ % kLevelEvery == 0) level_pools();
  if (steps_ % kDryEvery == 0) dry();
}

void Dust::step_brick(Brick& brick) {
  using Place = Hood::Place;
  Hood hood(*this, brick);
  const auto give = [&](std::uint32_t& from, const Place& to, std::uint32_t most) -> std::uint32_t {
    if (most == 0 || hood.is_solid(to)) return 0;
    Brick* const there = hood.brick_of(to);
    if (there == nullptr) {
      from -= most;
      fallen_ += most;
      return most;
    }
    std::uint32_t& held = there->units[Hood::offset(to)];
    if (held >= capacity_) return 0;
    const std::uint32_t amount = std::min({most, capacity_, capacity_ - held});
    held += amount;
    from -= amount;
    return amount;
  };
  const auto axis = static_cast<std::size_t>(axis_), side0 = (axis + 1) % 3, side1 = (axis + 2) % 3;
  const auto turn0 = static_cast<int>(steps_ % 4);
  // A cell along the nearest axis each step, and along the others as often as the direction asks, so that the way is
  // straight on average.
  Ijk down{};
  for (std::size_t a = 0; a < 3; ++a) {
    const double rate = std::abs(pull_[a]) / std::abs(pull_[axis]),
                 before = static_cast<double>(steps_ % 1000000) * rate;
    const int by = a == axis ? 1 : static_cast<int>(std::floor(before + rate + 0.5) - std::floor(before + 0.5));
    (a == 0 ? down.i : a == 1 ? down.j : down.k) = pull_[a] < 0 ? -by : by;
  }
  for (int layer = 0; layer < 8; ++layer) {
    for (int n = 0; n < 64; ++n) {
      // The other way round every other step, so that piles do not lean.
      const int place = steps_ % 2 == 0 ? n : 63 - n;
      Place c{};
      c[axis] = sign_ > 0 ? 7 - layer : layer;
      c[side0] = place & 7;
      c[side1] = place >> 3;
      std::uint32_t& units = brick.units[Hood::offset(c)];
      if (units == 0) continue;
      const std::uint32_t before = units;
      const Place below = Hood::moved(c, down);
      if (hood.open(c, down)) give(units, below, units);
      const auto beside = [&](int s) {
        const int turn = (s + turn0) % 4;
        Place p = c;
        p[turn < 2 ? side0 : side1] += turn % 2 == 0 ? 1 : -1;
        return p;
      };
      const auto part_of = [](std::uint32_t amount, int s, int of) {
        const auto left = static_cast<std::uint32_t>(of - s);
        return (amount + left - 1) / left;
      };
      // Down a slope, in equal parts where several are as steep.
      for (std::size_t first = 0; first < slides_.size() && units > 0;) {
        std::size_t end = first + 1;
        while (end < slides_.size() && slides_[end].slope > slides_[first].slope - 1e-9) ++end;
        const int of = static_cast<int>(end - first);
        for (int s = 0; s < of && units > 0; ++s) {
          const Ijk by = slides_[first + static_cast<std::size_t>((s + turn0) % of)].by;
          if (hood.open(c, by)) give(units, Hood::moved(c, by), part_of(units, s, of));
        }
        first = end;
      }
      if (units > 0) {
        // Too full, or bone stands here (it was cut into by less than half): to the sides, then up.
        std::uint32_t excess = hood.is_solid(c) ? units : units - std::min(units, capacity_);
        for (int s = 0; s < 4 && excess > 0; ++s) excess -= give(units, beside(s), part_of(excess, s, 4));
        if (excess > 0) {
          Place above = c;
          above[axis] -= sign_;
          give(units, above, excess);
        }
      }
      if (units == before) continue;
      hood.wake_around(c);
      Place two = below;
      two[axis] += sign_;
      hood.wake_around(two);
    }
  }
  if (brick.water) step_water(brick, hood, down);
  for (int n = 0; n < 27; ++n) {
    if ((hood.woken >> n & 1) == 0) continue;
    const auto found = index_.find(key(brick.at.i + n % 3 - 1, brick.at.j + n / 3 % 3 - 1, brick.at.k + n / 9 - 1));
    if (found == index_.end() || bricks_[found->second]->awake) continue;
    bricks_[found->second]->awake = true;
    next_.push_back(found->second);
  }
}

// Row by row, as if all cells of the ball were walked; but dust lies in bricks alone, so that no radius costs more than
// they do.
template <class F>
void Dust::in_ball(Vec3 centre_mm, double radius_mm, F&& f) {
  const Frame& frame = bone_.frame();
  const Vec3 x = frame.index_from_world(centre_mm);
  const double r = radius_mm / frame.spacing_mm.x;
  if (!std::isfinite(dot(x, x)) || !(r > 0)) return;
  std::vector<Brick*> met;
  for (const auto& b : bricks_) {
    const Ijk o{b->at.i * 8, b->at.j * 8, b->at.k * 8};
    if (o.i <= x.x + r && o.i + 7 >= x.x - r && o.j <= x.y + r && o.j + 7 >= x.y - r && o.k <= x.z + r &&
        o.k + 7 >= x.z - r)
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
              const std::uint32_t at = BrickGrid::offset_in_brick(i, j, k);
              if ((*b)->units[at] == 0 && ((*b)->water == nullptr || (*b)->water->units[at] == 0)) continue;
              const Ijk c{(*b)->at.i * 8 + i, (*b)->at.j * 8 + j, (*b)->at.k * 8 + k};
              const Vec3 d = Vec3{double(c.i), double(c.j), double(c.k)} - x;
              if (dot(d, d) <= r * r) f(c, **b, at, d);
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
  in_ball(middle, reach, [&](Ijk c, Brick& brick, std::uint32_t at, Vec3) {
    std::uint32_t& units = brick.units[at];
    if (units == 0) return;
    const Vec3 p = place_of_voxel_mm(frame, c) - start_mm - axis * tool.start_mm;
    const double t = dot(p, axis), foot = tool.foot_mm(length(p - axis * t), t);
    const Vec3 out = p - axis * foot;
    const double inside = tool.radius_at_mm(foot) - length(out);
    if (inside <= 0) return;
    // To the first cell beyond the surface along the normal, and on until there is room.
    const Vec3 n = transposed(frame.direction) * (length(out) > 1e-6 ? normalized(out) : any_perpendicular(axis));
    const double far = inside / frame.spacing_mm.x;
    for (int s = 1; s <= 4 && units > 0; ++s) {
      const Ijk to{static_cast<int>(std::lround(c.i + n.x * (far + s))),
                   static_cast<int>(std::lround(c.j + n.y * (far + s))),
                   static_cast<int>(std::lround(c.k + n.z * (far + s)))};
      if (to == c) continue;
      if (move(units, to, units) > 0) wake(to);
    }
    // No room: heaped up beyond what a cell holds, outside the tool along the normal, or where bone is there upwards
    // out of it; it spreads with the next steps.
    for (int s = 1; s <= 64 && units > 0; ++s) {
      const Ijk aside{static_cast<int>(std::lround(c.i + n.x * (far + s))),
                      static_cast<int>(std::lround(c.j + n.y * (far + s))),
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
  const double units = std::clamp(mm3 / voxel * kUnitsAVoxel, 0.0, 1e15);
  auto dry = static_cast<std::uint64_t>(units), liquid = static_cast<std::uint64_t>(units * kLiquidForDust);
  struct Near {
    double distance2;
    Ijk at;
    Brick* brick;
    std::uint32_t place;
  };
  std::vector<Near> near;
  in_ball(nozzle_mm, radius_mm, [&](Ijk c, Brick& brick, std::uint32_t at, Vec3 d) {
    near.push_back({dot(d, d), c, &brick, at});
  });
  std::stable_sort(near.begin(), near.end(), [](const Near& a, const Near& b) { return a.distance2 < b.distance2; });
  std::uint64_t taken = 0;
  for (const Near& n : near) {
    if (dry == 0 && liquid == 0) break;
    std::uint32_t& lying = n.brick->units[n.place];
    const auto amount = static_cast<std::uint32_t>(std::min<std::uint64_t>(lying, dry));
    lying -= amount;
    dry -= amount;
    taken += amount;
    if (n.brick->water) {
      std::uint32_t &l = n.brick->water->units[n.place], &s = n.brick->water->solid[n.place];
      const auto drunk = static_cast<std::uint32_t>(std::min<std::uint64_t>(l, liquid));
      const std::uint32_t with =
          drunk == l ? s : static_cast<std::uint32_t>(std::uint64_t{s} * drunk / std::max(1U, l));
      l -= drunk;
      s -= with;
      liquid -= drunk;
      taken += with;
      water_sucked_ += drunk - with;
    }
    wake(n.at);
  }
  sucked_ += taken;
  ++version_;
  return static_cast<double>(taken) / kUnitsAVoxel * voxel;
}

Dust::Totals Dust::totals() const {
  const double unit = bone_.frame().voxel_volume_mm3() / kUnitsAVoxel;
  std::uint64_t present = 0, slurry = 0, water = 0;
  for (const auto& b : bricks_) {
    for (const std::uint32_t u : b->units) present += u;
    for (std::size_t v = 0; b->water && v < 512; ++v) {
      slurry += b->water->solid[v];
      water += b->water->units[v] - b->water->solid[v];
    }
  }
  const auto mm3 = [unit](std::uint64_t units) { return static_cast<double>(units) * unit; };
  return {mm3(added_),  mm3(present), mm3(slurry),        mm3(sucked_), mm3(fallen_),
          mm3(poured_), mm3(water),   mm3(water_sucked_), mm3(dried_),  mm3(run_off_)};
}

std::size_t Dust::memory_bytes() const {
  std::size_t bytes = bricks_.size() * sizeof(Brick);
  for (const auto& b : bricks_) bytes += b->water ? sizeof(Water) : 0;
  return bytes;
}

std::string Dust::hash() const {
  Hasher h;
  visit([&](Vec3 at, double full) {
    h.add(&at, sizeof at);
    h.add(&full, sizeof full);
  });
  visit_liquid([&](Ijk at, double full, double solid) {
    h.add(&at, sizeof at);
    h.add(&full, sizeof full);
    h.add(&solid, sizeof solid);
  });
  return h.hex();
}

bool Dust::falls(Ijk c, int cells) const {
  const auto brick_of = [&](Ijk at) -> const Brick* {
    const auto found = index_.find(key(at.i >> 3, at.j >> 3, at.k >> 3));
    return found == index_.end() ? nullptr : bricks_[found->second].get();
  };
  const Brick* brick = brick_of(c);
  if (brick == nullptr || !brick->awake) return false;
  // So many cells of packed dust over each other are a heap. A stream from the burr is seldom packed at all.
  constexpr int kHeap = 4;
  const Vec3 down = pull_ * (1 / std::abs(pull_[static_cast<std::size_t>(axis_)]));
  int packed = 0;
  for (int n = 1; n <= cells; ++n) {
    const Ijk at{static_cast<int>(std::lround(c.i + n * down.x)), static_cast<int>(std::lround(c.j + n * down.y)),
                 static_cast<int>(std::lround(c.k + n * down.z))};
    if (solid(at)) return false;
    if (brick == nullptr || brick->at.i != at.i >> 3 || brick->at.j != at.j >> 3 || brick->at.k != at.k >> 3)
      brick = brick_of(at);
    const std::uint32_t held = brick == nullptr ? 0 : brick->units[BrickGrid::offset_in_brick(at.i, at.j, at.k)];
    packed = held >= capacity_ / 10 * 9 ? packed + 1 : 0;
    if (packed == kHeap) return false;
  }
  return true;
}

std::vector<const Dust::Brick*> Dust::in_order() const {
  std::vector<const Brick*> order;
  for (const auto& b : bricks_) order.push_back(b.get());
  std::sort(order.begin(), order.end(), [](const Brick* a, const Brick* b) {
    return key(a->at.i, a->at.j, a->at.k) < key(b->at.i, b->at.j, b->at.k);
  });
  return order;
}

void Dust::visit(const std::function<void(Vec3, double)>& f) const {
  for (const Brick* b : in_order()) {
    for (int v = 0; v < 512; ++v) {
      const std::uint32_t u = b->units[static_cast<std::size_t>(v)];
      if (u == 0) continue;
      f(bone_.frame().world_from_index(
            {double(b->at.i * 8 + (v & 7)), double(b->at.j * 8 + (v >> 3 & 7)), double(b->at.k * 8 + (v >> 6))}),
        static_cast<double>(u) / capacity_);
    }
  }
}

}  // namespace osteo::inline simulation
