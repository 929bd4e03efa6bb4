// The water of Dust: how it runs, stands, takes dust along and dries.
#include <algorithm>
#include <cmath>

#include "dust_hood.h"
#include "osteo/simulation/bone/dust.h"

namespace osteo::inline simulation {
namespace {

// Of a liquid's solid share, what goes with a part of it.
std::uint32_t share_of(std::uint32_t solid, std::uint32_t part, std::uint32_t whole) {
  return part == whole ? solid : static_cast<std::uint32_t>(std::uint64_t{solid} * part / whole);
}

}  // namespace

// Onto the cells around the first bone in the jet's way; the water spreads from there by itself.
void Dust::irrigate(Vec3 nozzle_mm, Vec3 direction, double reach_mm, double mm3) {
  const Frame& frame = bone_.frame();
  if (!std::isfinite(dot(nozzle_mm, nozzle_mm)) || !(mm3 > 0) || !(reach_mm > 0)) return;
  const double units = mm3 / frame.voxel_volume_mm3() * kUnitsAVoxel + water_carry_;
  auto left = static_cast<std::uint32_t>(std::clamp(units, 0.0, 4e9));
  water_carry_ = units - left;
  if (left == 0) return;
  wet_ = true;
  ++version_;
  poured_ += left;
  const Vec3 along =
      std::isfinite(dot(direction, direction)) && length(direction) > 0 ? normalized(direction) : gravity_;
  const double h = frame.spacing_mm.x;
  const auto cell_at = [&](Vec3 p) {
    const Vec3 x = frame.index_from_world(p);
    return Ijk{static_cast<int>(std::floor(x.x + 0.5)), static_cast<int>(std::floor(x.y + 0.5)),
               static_cast<int>(std::floor(x.z + 0.5))};
  };
  Vec3 end = nozzle_mm;
  for (double t = 0; t <= std::min(reach_mm, 50.0); t += h / 2) {
    if (solid(cell_at(nozzle_mm + along * t))) break;
    end = nozzle_mm + along * t;
  }
  constexpr double kSplashMm = 1;
  const Ijk middle = cell_at(end);
  const int r = static_cast<int>(std::ceil(kSplashMm / h));
  std::vector<Ijk> free;
  for (int k = -r; k <= r; ++k)
    for (int j = -r; j <= r; ++j)
      for (int i = -r; i <= r; ++i) {
        const Ijk c{middle.i + i, middle.j + j, middle.k + k};
        if (i * i + j * j + k * k <= r * r && in_reach(c) && !solid(c)) free.push_back(c);
      }
  for (std::size_t n = 0; n < free.size(); ++n) {
    const auto part = static_cast<std::uint32_t>(left / (free.size() - n));
    Brick& b = *brick_at(free[n], true);
    if (!b.water) b.water = std::make_unique<Water>();
    // Where it is full already it stands higher than a cell, and spreads with the next steps.
    b.water->units[BrickGrid::offset_in_brick(free[n].i, free[n].j, free[n].k)] += part;
    left -= part;
    wake(free[n]);
  }
  run_off_ += left;  // a nozzle within bone, or out of reach
}

class Dust::Flow {
 public:
  using Place = Hood::Place;
  Flow(Dust& all, Brick& brick, Hood& hood, Ijk down)
      : d_(all),
        brick_(brick),
        hood_(hood),
        water_(*brick.water),
        down_(down),
        axis_(static_cast<std::size_t>(all.axis_)),
        side0_((axis_ + 1) % 3),
        side1_((axis_ + 2) % 3),
        half_(0.5 * (std::abs(all.pull_.x) + std::abs(all.pull_.y) + std::abs(all.pull_.z))),
        turn_(static_cast<std::size_t>(all.steps_ % 12)) {}
  void step() {
    for (int layer = 0; layer < 8; ++layer) {
      for (int n = 0; n < 64; ++n) {
        const int place = d_.steps_ % 2 == 0 ? n : 63 - n;
        Place c{};
        c[axis_] = d_.sign_ > 0 ? 7 - layer : layer;
        c[side0_] = place & 7;
        c[side1_] = place >> 3;
        if (!step_cell(c)) continue;
        brick_.stirred = true;
        hood_.wake_around(c);
        hood_.wake_around(Hood::moved(c, down_));
      }
    }
  }

 private:
  static constexpr std::uint32_t kSlack = 256;  // differences too small to run for: 0.4 % of a cell

  // Whether anything moved.
  bool step_cell(const Place& c) {
    const std::uint32_t at = Hood::offset(c);
    const std::uint32_t& l = water_.units[at];
    if (l == 0) return false;
    bool moved = take_dust(at);
    const std::uint32_t room = room_of(hood_.density(c)), held = film_at(c, room);
    moved = run(c, down_, room, held, l) || moved;
    const auto& lower = d_.lower_;
    for (std::size_t first = 0; first < lower.size() && l > held;) {
      std::size_t end = first + 1;
      while (end < lower.size() && lower[end].slope > lower[first].slope - 1e-9) ++end;
      const std::size_t of = end - first;
      for (std::size_t s = 0; s < of && l > held; ++s) {
        const auto most = static_cast<std::uint32_t>((l - held + of - s - 1) / (of - s));
        moved = run(c, lower[first + (s + turn_) % of].by, room, held, most) || moved;
      }
      first = end;
    }
    if (l > room) moved = overflow(c, room) || moved;
    return moved;
  }

  // Dust that it meets, until it is as thick as it pours.
  bool take_dust(std::uint32_t at) {
    std::uint32_t& lying = brick_.units[at];
    if (lying == 0) return false;
    static_assert(kMaxSolid == 0.3);
    std::uint32_t& l = water_.units[at];
    const std::int64_t takes = (3 * std::int64_t{l} - 10 * std::int64_t{water_.solid[at]}) / 7;
    const auto taken = static_cast<std::uint32_t>(std::clamp<std::int64_t>(takes, 0, lying));
    lying -= taken;
    l += taken;
    water_.solid[at] += taken;
    return taken > 0;
  }

  // Held by the bone that it wets.
  [[nodiscard]] std::uint32_t film_at(const Place& c, std::uint32_t room) const {
    if (room == 0) return 0;
    for (int f = 0; f < 6; ++f) {
      Place p = c;
      p[static_cast<std::size_t>(f / 2)] += f % 2 == 0 ? 1 : -1;
      if (hood_.is_solid(p)) return kFilmUnits;
    }
    return 0;
  }

  [[nodiscard]] std::uint32_t held_at(const Place& p) const {
    const Brick* const there = hood_.around[Hood::neighbour(p)].dust;
    return there == nullptr || !there->water ? 0U : there->water->units[Hood::offset(p)];
  }

  // To the cell `by` away, until both stand equally high.
  bool run(const Place& c, Ijk by, std::uint32_t room, std::uint32_t held, std::uint32_t most) {
    const std::uint32_t at = Hood::offset(c), l = water_.units[at];
    if (l <= held || most == 0) return false;
    const Place to = Hood::moved(c, by);
    const std::uint32_t there = room_of(hood_.density(to)), in_it = held_at(to);
    if (there <= in_it || !hood_.open(c, by)) return false;
    // Heights along gravity, in cells.
    const double drop = by.i * d_.pull_.x + by.j * d_.pull_.y + by.k * d_.pull_.z;
    const double mine = room > 0 ? static_cast<double>(l) / room : 1, its = static_cast<double>(in_it) / there;
    const double level = (drop / (2 * half_) + mine - its) / 2 * std::min(room > 0 ? room : kFull, there);
    if (level < kSlack) return false;
    pour(at, to, std::min({most, l - held, there - in_it, static_cast<std::uint32_t>(std::min(level, 4e9))}));
    return true;
  }

  // Bone came back, or more was poured than there is room for: aside and up, whatever the height.
  bool overflow(const Place& c, std::uint32_t room) {
    const std::uint32_t at = Hood::offset(c);
    const std::uint32_t& l = water_.units[at];
    bool moved = false;
    for (int s = 0; s < 5 && l > room; ++s) {
      Place p = c;
      if (s == 4) {
        p[axis_] -= d_.sign_;
      } else {
        const std::size_t t = (static_cast<std::size_t>(s) + turn_) % 4;
        p[t < 2 ? side0_ : side1_] += t % 2 == 0 ? 1 : -1;
      }
      const std::uint32_t there = room_of(hood_.density(p)), in_it = held_at(p);
      if (there == 0) continue;
      // Up without a limit, so that it ends above whatever is full.
      const std::uint32_t most = s == 4 ? l - room : std::min(l - room, there > in_it ? there - in_it : 0U);
      if (most == 0) continue;
      pour(at, p, most);
      moved = true;
    }
    return moved;
  }

  void pour(std::uint32_t from, const Place& to, std::uint32_t most) {
    Brick* const there = hood_.brick_of(to);
    std::uint32_t &l = water_.units[from], &s = water_.solid[from];
    const std::uint32_t with = share_of(s, most, l);
    if (there == nullptr) {
      d_.run_off_ += most - with;
      d_.fallen_ += with;
    } else {
      if (!there->water) there->water = std::make_unique<Water>();
      const std::uint32_t at = Hood::offset(to);
      there->water->units[at] += most;
      there->water->solid[at] += with;
    }
    l -= most;
    s -= with;
  }

  Dust& d_;
  Brick& brick_;
  Hood& hood_;
  Water& water_;
  Ijk down_;
  std::size_t axis_, side0_, side1_;
  double half_;  // of a cell, along gravity
  std::size_t turn_;
};

void Dust::step_water(Brick& brick, Hood& hood, Ijk down) {
  Flow(*this, brick, hood, down).step();
}

// On bone, or on water that fills what is below: it stands, it does not fall.
bool Dust::rests(Brick& brick, std::uint32_t at) const {
  for (std::size_t a = 0; a < 3; ++a) {
    if (std::abs(pull_[a]) <= 0.5) continue;
    const int shift = static_cast<int>(3 * a), x = static_cast<int>(at >> shift & 7), by = pull_[a] < 0 ? -1 : 1;
    const bool out = x + by < 0 || x + by > 7;
    Brick* const b = out ? brick.beside[2 * a + (by > 0 ? 1 : 0)] : &brick;
    const std::uint32_t there = (at & ~(7U << shift)) | static_cast<std::uint32_t>((x + by) & 7) << shift;
    if (b == nullptr) {
      Ijk c{brick.at.i * 8 + static_cast<int>(at & 7), brick.at.j * 8 + static_cast<int>(at >> 3 & 7),
            brick.at.k * 8 + static_cast<int>(at >> 6)};
      (a == 0 ? c.i : a == 1 ? c.j : c.k) += by;
      if (!solid(c)) return false;
      continue;
    }
    const float density = b->bone == BrickGrid::kNone ? 0.0F : bone_.value(b->bone * BrickGrid::kVoxels + there);
    const std::uint32_t room = room_of(density);
    if (room > 0 && (!b->water || b->water->units[there] < room / 10 * 9)) return false;
  }
  return true;
}

class Dust::Pools {
 public:
  explicit Pools(Dust& all)
      : d_(all), half_(0.5 * (std::abs(all.pull_.x) + std::abs(all.pull_.y) + std::abs(all.pull_.z))) {}
  void level() {
    for (Brick* const seed : take_stirred()) {
      for (std::uint32_t v = 0; v < 512; ++v) {
        find_pool(*seed, v);
        if (pool_.size() < 2) continue;
        const Amounts all = measure();
        if (all.volume >= all.rooms) continue;  // fuller than full: first it spreads
        const std::vector<std::uint32_t> units = units_of(all.volume);
        fill(units, solids_of(units, all));
      }
    }
    for (Brick* const b : touched_) b->marked = {};
  }

 private:
  struct Filled {
    Brick* brick;
    std::uint32_t at;
    bool rim = false;  // beside it, and there is room: its film is no part of it
    double height = 0;
    std::uint32_t room = 0;
  };
  struct Amounts {
    std::uint64_t volume = 0, solids = 0, rooms = 0;
  };
  static Ijk cell_of(const Brick& b, std::uint32_t at) {
    return Ijk{b.at.i * 8 + static_cast<int>(at & 7), b.at.j * 8 + static_cast<int>(at >> 3 & 7),
               b.at.k * 8 + static_cast<int>(at >> 6)};
  }
  [[nodiscard]] float density(const Brick& b, std::uint32_t at) const {
    return b.bone == BrickGrid::kNone ? 0.0F : d_.bone_.value(b.bone * BrickGrid::kVoxels + at);
  }

  // Bricks in which water moved since, in a fixed order.
  std::vector<Brick*> take_stirred() {
    std::vector<Brick*> seeds;
    for (const auto& b : d_.bricks_) {
      if (b->stirred) seeds.push_back(b.get());
      b->stirred = false;
    }
    std::sort(seeds.begin(), seeds.end(), [](const Brick* a, const Brick* b) {
      return key(a->at.i, a->at.j, a->at.k) < key(b->at.i, b->at.j, b->at.k);
    });
    return seeds;
  }

  void meet(Brick& b, std::uint32_t at, bool or_rim) {
    if ((b.marked[at >> 6] >> (at & 63) & 1) != 0) return;
    const bool stands = b.water && b.water->units[at] > 2 * kFilmUnits;
    if ((!stands && (!or_rim || room_of(density(b, at)) == 0)) || !d_.rests(b, at)) return;
    if (std::all_of(b.marked.begin(), b.marked.end(), [](std::uint64_t m) { return m == 0; })) touched_.push_back(&b);
    b.marked[at >> 6] |= std::uint64_t{1} << (at & 63);
    pool_.push_back({&b, at, !stands});
  }

  // What is connected with this cell; nothing where a pool has it already.
  void find_pool(Brick& seed, std::uint32_t v) {
    pool_.clear();
    meet(seed, v, false);
    for (std::size_t n = 0; n < pool_.size(); ++n) {
      if (pool_[n].rim) continue;
      Brick& b = *pool_[n].brick;
      const std::uint32_t at = pool_[n].at;
      for (std::uint32_t f = 0; f < 6; ++f) {
        const std::uint32_t shift = 3 * (f / 2), x = at >> shift & 7;
        const bool up = f % 2 == 1;
        Brick* other = &b;
        if (up ? x == 7 : x == 0) {
          other = b.beside[f];
          if (other == nullptr) {
            Ijk c = cell_of(b, at);
            (f < 2 ? c.i : f < 4 ? c.j : c.k) += up ? 1 : -1;
            if (d_.in_reach(c) && !d_.solid(c)) other = d_.brick_at(c, true);
          }
        }
        if (other != nullptr) meet(*other, (at & ~(7U << shift)) | ((up ? x + 1 : x + 7) & 7) << shift, true);
      }
    }
  }

  Amounts measure() {
    Amounts all;
    for (Filled& p : pool_) {
      const Ijk c = cell_of(*p.brick, p.at);
      p.height = -(d_.pull_.x * c.i + d_.pull_.y * c.j + d_.pull_.z * c.k);
      p.room = room_of(density(*p.brick, p.at));
      if (p.rim) {
        const std::uint32_t film = p.brick->water ? p.brick->water->units[p.at] : 0;
        p.room -= std::min(p.room, film);
      } else {
        all.volume += p.brick->water->units[p.at];
        all.solids += p.brick->water->solid[p.at];
      }
      all.rooms += p.room;
    }
    return all;
  }

  // Of a cell, below a level.
  [[nodiscard]] double share(const Filled& p, double level) const {
    return std::clamp((level - p.height + half_) / (2 * half_), 0.0, 1.0);
  }

  // Sorts the pool by height; the level up to which it holds no more than the volume.
  double find_level(std::uint64_t volume) {
    std::stable_sort(pool_.begin(), pool_.end(), [](const Filled& a, const Filled& b) { return a.height < b.height; });
    room_below_.assign(1, 0);
    for (const Filled& p : pool_) room_below_.push_back(room_below_.back() + p.room);
    double lo = pool_.front().height - half_, hi = pool_.back().height + half_;
    for (int step = 0; step < 50; ++step) {
      const double level = 0.5 * (lo + hi);
      const auto full =
          std::partition_point(pool_.begin(), pool_.end(), [&](const Filled& p) { return p.height + half_ <= level; });
      auto holds = static_cast<double>(room_below_[static_cast<std::size_t>(full - pool_.begin())]);
      for (auto p = full; p != pool_.end() && p->height - half_ < level; ++p) holds += p->room * share(*p, level);
      (holds < static_cast<double>(volume) ? lo : hi) = level;
    }
    return lo;
  }

  std::vector<std::uint32_t> units_of(std::uint64_t volume) {
    const double level = find_level(volume);
    std::vector<std::uint32_t> units(pool_.size());
    std::uint64_t left = volume;
    for (std::size_t n = 0; n < pool_.size(); ++n) {
      units[n] = static_cast<std::uint32_t>(
          std::min<std::uint64_t>(left, static_cast<std::uint64_t>(pool_[n].room * share(pool_[n], level))));
      left -= units[n];
    }
    while (left > 0) {  // what rounding kept: a unit each
      for (std::size_t n = 0; n < pool_.size() && left > 0; ++n) {
        if (units[n] == 0 || units[n] >= pool_[n].room) continue;
        ++units[n];
        --left;
      }
      const bool some = std::any_of(pool_.begin(), pool_.end(), [&](const Filled& p) {
        const std::uint32_t u = units[static_cast<std::size_t>(&p - pool_.data())];
        return u > 0 && u < p.room;
      });
      if (some || left == 0) continue;
      for (std::size_t n = 0; n < pool_.size() && left > 0; ++n) {
        const auto more = static_cast<std::uint32_t>(std::min<std::uint64_t>(left, pool_[n].room - units[n]));
        units[n] += more;
        left -= more;
      }
    }
    return units;
  }

  // What it carries, mixed.
  [[nodiscard]] static std::vector<std::uint32_t> solids_of(const std::vector<std::uint32_t>& units,
                                                            const Amounts& all) {
    std::uint64_t left = all.solids;
    std::vector<std::uint32_t> solid(units.size());
    for (std::size_t n = 0; n < units.size(); ++n) {
      solid[n] = static_cast<std::uint32_t>(all.solids * units[n] / all.volume);
      left -= solid[n];
    }
    for (std::size_t n = 0; n < units.size() && left > 0; ++n) {
      const auto more = static_cast<std::uint32_t>(std::min<std::uint64_t>(left, units[n] - solid[n]));
      solid[n] += more;
      left -= more;
    }
    return solid;
  }

  void fill(const std::vector<std::uint32_t>& units, const std::vector<std::uint32_t>& solid) {
    for (std::size_t n = 0; n < pool_.size(); ++n) {
      Brick& b = *pool_[n].brick;
      const std::uint32_t at = pool_[n].at;
      if (pool_[n].rim && units[n] == 0) continue;
      if (!b.water) b.water = std::make_unique<Water>();
      const std::uint32_t before = b.water->units[at];
      b.water->units[at] = units[n] + (pool_[n].rim ? before : 0);
      b.water->solid[at] = solid[n] + (pool_[n].rim ? b.water->solid[at] : 0);
      const std::uint32_t after = b.water->units[at];
      if (std::max(before, after) - std::min(before, after) <= 64) continue;
      b.stirred = true;
      d_.wake(cell_of(b, at));
    }
  }

  Dust& d_;
  double half_;  // of a cell, along gravity
  std::vector<Filled> pool_;
  std::vector<Brick*> touched_;  // that have marks
  std::vector<std::uint64_t> room_below_;
};

// What stands and is connected is filled again from below, to one height; what it carries is mixed.
void Dust::level_pools() {
  Pools(*this).level();
}

// Films: every half second of steps, a bit of each.
void Dust::dry() {
  constexpr auto kGone = static_cast<std::uint32_t>(kFilmUnits * 50 / (kDrySeconds * 100)) + 1;
  for (const auto& b : bricks_) {
    if (!b->water) continue;
    Water& w = *b->water;
    for (std::uint32_t v = 0; v < 512; ++v) {
      std::uint32_t& l = w.units[v];
      if (l == 0 || l > 2 * kFilmUnits) continue;
      ++version_;
      const std::uint32_t water = l - w.solid[v];
      if (water > kGone) {
        l -= kGone;
        dried_ += kGone;
        continue;
      }
      dried_ += water;
      if (w.solid[v] > 0) {
        b->units[v] += w.solid[v];
        wake({b->at.i * 8 + static_cast<int>(v & 7), b->at.j * 8 + static_cast<int>(v >> 3 & 7),
              b->at.k * 8 + static_cast<int>(v >> 6)});
      }
      l = w.solid[v] = 0;
    }
  }
}

void Dust::visit_liquid(const std::function<void(Ijk, double, double)>& f) const {
  if (!wet_) return;
  for (const Brick* b : in_order()) {
    for (std::uint32_t v = 0; b->water && v < 512; ++v) {
      const std::uint32_t l = b->water->units[v];
      if (l > 0)
        f({b->at.i * 8 + static_cast<int>(v & 7), b->at.j * 8 + static_cast<int>(v >> 3 & 7),
           b->at.k * 8 + static_cast<int>(v >> 6)},
          static_cast<double>(l) / kUnitsAVoxel, static_cast<double>(b->water->solid[v]) / l);
    }
  }
}

}  // namespace osteo::inline simulation
