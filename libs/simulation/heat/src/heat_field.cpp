#include "osteo/simulation/heat/heat_field.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "osteo/core/base/error.h"

namespace osteo::inline simulation {
namespace {

constexpr double kMm3PerM3 = 1e9, kMmPerM = 1e3, kMm2PerM2 = 1e6;
// Lattices with a layer more on one side (links) and on both (what is looked at): x fastest, first cell at -1.
constexpr int kLink[3] = {1, 9, 81}, kWide[3] = {1, 10, 100};
constexpr int kWideCells = 1000;
constexpr int at_link(int x, int y, int z) {
  return x + 1 + 9 * (y + 1) + 81 * (z + 1);
}
constexpr int at_wide(int x, int y, int z) {
  return x + 1 + 10 * (y + 1) + 100 * (z + 1);
}
constexpr int kSelf = 13;
constexpr std::size_t kFaces[6] = {12, 14, 10, 16, 4, 22};  // -x +x -y +y -z +z of the 27 around

Ijk brick_of(Ijk c) {
  return {c.i >> 3, c.j >> 3, c.k >> 3};
}
int place_of(Ijk c) {
  return (c.i & 7) | (c.j & 7) << 3 | (c.k & 7) << 6;
}
Ijk beside(Ijk c, int direction) {
  const int by = direction % 2 == 0 ? -1 : 1;
  (direction < 2 ? c.i : direction < 4 ? c.j : c.k) += by;
  return c;
}
Ijk around(Ijk c, int n) {
  return {c.i + n % 3 - 1, c.j + n / 3 % 3 - 1, c.k + n / 9 - 1};
}

// A brick's values with one layer of those around it, 0 where none is made. value(brick) gives the 512 of a brick.
template <class T, class Brick, class Value>
void widen(const Brick& b, Value value, std::array<T, kWideCells>& out) {
  for (int n = 0; n < 27; ++n) {
    const Brick* const from = b.around[static_cast<std::size_t>(n)];
    int lo[3], hi[3], off[3];
    const int side[3] = {n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1};
    for (int a = 0; a < 3; ++a) {
      lo[a] = side[a] == 0 ? 0 : side[a] < 0 ? -1 : 8;
      hi[a] = side[a] == 0 ? 8 : lo[a] + 1;
      off[a] = -8 * side[a];
    }
    for (int z = lo[2]; z < hi[2]; ++z) {
      for (int y = lo[1]; y < hi[1]; ++y) {
        const int row = (y + off[1]) * 8 + (z + off[2]) * 64 + off[0];
        for (int x = lo[0]; x < hi[0]; ++x)
          out[static_cast<std::size_t>(at_wide(x, y, z))] =
              from == nullptr ? T{} : value(*from)[static_cast<std::size_t>(row + x)];
      }
    }
  }
}

}  // namespace

HeatField::HeatField(double cell_mm, const HeatMaterials& m, MatterAt matter)
    : cell_mm_(cell_mm), matter_(std::move(matter)) {
  const auto positive = [](double x) { return std::isfinite(x) && x > 0; };
  if (!positive(cell_mm) || !positive(m.bone_w_per_m_k) || !positive(m.bone_kg_per_m3) ||
      !positive(m.bone_j_per_kg_k) || !positive(m.tissue_w_per_m_k) || !positive(m.tissue_kg_per_m3) ||
      !positive(m.tissue_j_per_kg_k))
    throw Error(ExitCode::usage, "cells and materials of heat must be above zero", "");
  const double volume = cell_mm * cell_mm * cell_mm;
  bone_j_per_k_ = m.bone_kg_per_m3 * m.bone_j_per_kg_k / kMm3PerM3 * volume;
  tissue_j_per_k_ = m.tissue_kg_per_m3 * m.tissue_j_per_kg_k / kMm3PerM3 * volume;
  bone_w_per_k_ = m.bone_w_per_m_k / kMmPerM * cell_mm;
  tissue_w_per_k_ = m.tissue_w_per_m_k / kMmPerM * cell_mm;
}

HeatField::Key HeatField::key_of(Ijk b) {
  const auto part = [](int v) { return static_cast<Key>(static_cast<std::uint32_t>(v + (1 << 20))); };
  return part(b.k) << 42 | part(b.j) << 21 | part(b.i);
}

const HeatField::Brick* HeatField::find(Ijk brick) const {
  const auto it = bricks_.find(key_of(brick));
  return it == bricks_.end() ? nullptr : it->second.get();
}

void HeatField::fill(Brick& b, int cell, HeatMatter m) const {
  const auto c = static_cast<std::size_t>(cell);
  const double bone = std::clamp(static_cast<double>(m.bone), 0.0, 1.0),
               tissue = std::clamp(static_cast<double>(m.tissue), 0.0, 1.0 - bone);
  // A trace of matter would cost a cell and hold nothing.
  const bool any = bone + tissue >= 0.02;
  b.capacity[c] = any ? static_cast<float>(bone * bone_j_per_k_ + tissue * tissue_j_per_k_) : 0;
  b.conducts[c] = any ? static_cast<float>(bone * bone_w_per_k_ + tissue * tissue_w_per_k_) : 0;
  b.share[c] = any ? static_cast<float>(bone + tissue) : 0;
}

void HeatField::links_are_old_around(Brick& b) {
  for (Brick* const other : b.around) {
    if (other != nullptr) other->links_old = true;
  }
}

// Of a square of four full cells a sixth goes along each diagonal and a twelfth along each side, else a quarter along
// each side: both let the same heat through along either axis.
void HeatField::link(Brick& b) {
  std::array<float, kWideCells> k;
  widen(
      b, [](const Brick& from) -> const auto& { return from.conducts; }, k);
  for (std::size_t normal = 0; normal < 3; ++normal) {
    const int u = kWide[(normal + 1) % 3], v = kWide[(normal + 2) % 3];
    for (int z = -1; z < 8; ++z) {
      for (int y = -1; y < 8; ++y) {
        for (int x = -1; x < 8; ++x) {
          const float* const c = &k[static_cast<std::size_t>(at_wide(x, y, z))];
          b.diagonal[normal][static_cast<std::size_t>(at_link(x, y, z))] =
              std::min(std::min(c[0], c[u]), std::min(c[v], c[u + v])) / 6;
        }
      }
    }
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    // The four squares that have this edge: two about each of the other axes.
    const auto &p = b.diagonal[(axis + 1) % 3], &q = b.diagonal[(axis + 2) % 3];
    const int along_p = kLink[(axis + 2) % 3], along_q = kLink[(axis + 1) % 3];
    const int own[3] = {axis == 0 ? -1 : 0, axis == 1 ? -1 : 0, axis == 2 ? -1 : 0};
    for (int z = own[2]; z < 8; ++z) {
      for (int y = own[1]; y < 8; ++y) {
        for (int x = own[0]; x < 8; ++x) {
          const int c = at_link(x, y, z);
          const float* const two = &k[static_cast<std::size_t>(at_wide(x, y, z))];
          const auto of = [](const auto& all, int n) { return all[static_cast<std::size_t>(n)]; };
          b.face[axis][static_cast<std::size_t>(c)] =
              std::max(0.0F, std::min(two[0], two[kWide[axis]]) -
                                 ((of(p, c) + of(p, c - along_p)) + (of(q, c) + of(q, c - along_q))));
        }
      }
    }
  }
  b.links_old = false;
}

HeatField::Brick& HeatField::make(Ijk at) {
  auto& made = bricks_[key_of(at)];
  if (made) return *made;
  made = std::make_unique<Brick>();
  Brick& b = *made;
  b.at = at;
  for (int c = 0; c < kCells; ++c)
    fill(b, c, matter_({at.i * 8 + (c & 7), at.j * 8 + (c >> 3 & 7), at.k * 8 + (c >> 6)}));
  for (int n = 0; n < 27; ++n) {
    const auto it = bricks_.find(key_of(around(at, n)));
    if (it == bricks_.end() || !it->second) continue;
    b.around[static_cast<std::size_t>(n)] = it->second.get();
    it->second->around[static_cast<std::size_t>(26 - n)] = &b;
  }
  links_are_old_around(b);
  return b;
}

// f(brick, cell) of each cell with matter whose centre lies within the ball.
template <class F>
void HeatField::for_ball(const Ball& ball, bool make_bricks, F&& f) {
  if (!std::isfinite(ball.centre.x + ball.centre.y + ball.centre.z) || !(ball.radius >= 0)) return;
  const auto from = [&](double v) { return static_cast<int>(std::ceil(v - ball.radius)); };
  const auto to = [&](double v) { return static_cast<int>(std::floor(v + ball.radius)); };
  const auto visit = [&](Ijk c) {
    Brick* const b = make_bricks ? &make(brick_of(c)) : const_cast<Brick*>(find(brick_of(c)));
    if (b != nullptr && b->capacity[static_cast<std::size_t>(place_of(c))] > 0) f(*b, place_of(c), c);
  };
  for (int k = from(ball.centre.z); k <= to(ball.centre.z); ++k) {
    for (int j = from(ball.centre.y); j <= to(ball.centre.y); ++j) {
      for (int i = from(ball.centre.x); i <= to(ball.centre.x); ++i) {
        const Vec3 d = Vec3{static_cast<double>(i), static_cast<double>(j), static_cast<double>(k)} - ball.centre;
        if (dot(d, d) <= ball.radius * ball.radius) visit({i, j, k});
      }
    }
  }
}

double HeatField::add(const Ball& where, double joules, double when) {
  if (!std::isfinite(joules) || joules == 0 || !(when >= 0 && when <= 1)) return 0;
  const double capacity = holds(where);
  if (!(capacity > 0)) return 0;
  for_ball(where, true, [&](Brick& b, int c, Ijk) {
    const double share = joules * static_cast<double>(b.capacity[static_cast<std::size_t>(c)]) / capacity;
    b.source[static_cast<std::size_t>(c)] += share;
    b.late[static_cast<std::size_t>(c)] += share * when;
    b.heated = true;
  });
  ledger_.added_j += joules;
  return joules;
}

double HeatField::holds(const Ball& where) {
  double capacity = 0;
  for_ball(where, true,
           [&](Brick& b, int c, Ijk) { capacity += static_cast<double>(b.capacity[static_cast<std::size_t>(c)]); });
  return capacity;
}

void HeatField::cool(const Ball& where, double film_w_per_m2_k, double water_k) {
  if (!(film_w_per_m2_k > 0) || !std::isfinite(film_w_per_m2_k) || !std::isfinite(water_k)) return;
  const double film = film_w_per_m2_k / kMm2PerM2 * cell_mm_ * cell_mm_;
  const auto share_at = [&](Ijk c) {
    if (const Brick* const b = find(brick_of(c))) return b->share[static_cast<std::size_t>(place_of(c))];
    const HeatMatter m = matter_(c);
    return std::clamp(m.bone + m.tissue, 0.0F, 1.0F);
  };
  for_ball(where, std::abs(water_k) >= kMinK, [&](Brick& b, int cell, Ijk at) {
    const auto c = static_cast<std::size_t>(cell);
    double open = 0;
    for (int d = 0; d < 6; ++d) open += std::max(0.0, static_cast<double>(b.share[c] - share_at(beside(at, d))));
    if (open <= 0) return;
    // From the centre to the face through half a cell, then into the water.
    const double half_cell = 2 * static_cast<double>(b.conducts[c] / b.share[c]);
    b.film[c] = static_cast<float>(open / (1 / film + 1 / half_cell));
    b.water[c] = static_cast<float>(water_k);
    b.cooled = true;
  });
}

void HeatField::set_matter(Ijk cell, HeatMatter now) {
  const auto it = bricks_.find(key_of(brick_of(cell)));
  if (it == bricks_.end()) return;
  Brick& b = *it->second;
  const auto c = static_cast<std::size_t>(place_of(cell));
  const double before = static_cast<double>(b.capacity[c]), heat = before * b.kelvin[c];
  fill(b, static_cast<int>(c), now);
  b.film[c] = 0;
  const double after = static_cast<double>(b.capacity[c]);
  if (after < before) {
    ledger_.chips_j += (before - after) * b.kelvin[c];
    if (after <= 0) {
      ledger_.chips_j += std::exchange(b.source[c], 0);
      b.late[c] = 0;
      b.kelvin[c] = 0;
    }
  } else if (after > 0) {
    b.kelvin[c] = heat / after;
  }
  links_are_old_around(b);
}

double HeatField::longest_step_s() const {
  return std::min(bone_j_per_k_ / bone_w_per_k_, tissue_j_per_k_ / tissue_w_per_k_) / 6;
}

void HeatField::step(double seconds) {
  if (!(seconds > 0) || !std::isfinite(seconds)) return;
  // A whole number of steps stays one, whatever the last bit of a quotient says.
  const int steps = std::max(1, static_cast<int>(std::ceil(seconds / longest_step_s() * (1 - 1e-9))));
  for (int s = 0; s < steps; ++s) {
    // What comes in the middle of a step half before it and half behind, what comes sooner more before it: each spreads
    // for as long as it is there, on average, and that is of second order like the rest.
    const bool one = steps == 1;
    heat(one ? 1 : 0.5 / steps, one ? -1 : 0);
    wake_and_forget();
    conduct(seconds / steps);
    heat(one ? 0 : 0.5 / steps, one ? 1 : 0);
  }
  for (auto& [key, b] : bricks_) {
    if (b->heated) {
      b->source.fill(0);
      b->late.fill(0);
    }
    if (b->cooled) b->film.fill(0);
    b->heated = b->cooled = false;
  }
}

void HeatField::heat(double all, double late) {
  for (auto& [key, b] : bricks_) {
    if (!b->heated) continue;
    for (std::size_t c = 0; c < kCells; ++c) {
      if (b->source[c] != 0)
        b->kelvin[c] += (all * b->source[c] + late * b->late[c]) / static_cast<double>(b->capacity[c]);
    }
  }
}

void HeatField::conduct(double seconds) {
  // Each cell asks its neighbours: what two say of their common link differs in sign only. Loops over x are plain
  // vectors.
  std::array<double, kWideCells> wide;
  for (auto& [key, made] : bricks_) {
    Brick& b = *made;
    if (b.links_old) link(b);
    widen(
        b, [](const Brick& from) -> const auto& { return from.kelvin; }, wide);
    for (int z = 0; z < 8; ++z) {
      for (int y = 0; y < 8; ++y) {
        const double* const t = &wide[static_cast<std::size_t>(at_wide(0, y, z))];
        const int first = at_link(0, y, z);
        double* const q = &b.change[static_cast<std::size_t>(8 * y + 64 * z)];
        for (int x = 0; x < 8; ++x) q[x] = 0;
        for (std::size_t axis = 0; axis < 3; ++axis) {
          const float* const face = &b.face[axis][static_cast<std::size_t>(first)];
          const int by = kWide[axis], back = kLink[axis];
          for (int x = 0; x < 8; ++x)
            q[x] += static_cast<double>(face[x]) * (t[x + by] - t[x]) +
                    static_cast<double>(face[x - back]) * (t[x - by] - t[x]);
          const float* const d = &b.diagonal[axis][static_cast<std::size_t>(first)];
          const int u = kWide[(axis + 1) % 3], v = kWide[(axis + 2) % 3], lu = kLink[(axis + 1) % 3],
                    lv = kLink[(axis + 2) % 3];
          for (int x = 0; x < 8; ++x) {
            q[x] += (static_cast<double>(d[x]) * (t[x + u + v] - t[x]) +
                     static_cast<double>(d[x - lu - lv]) * (t[x - u - v] - t[x])) +
                    (static_cast<double>(d[x - lu]) * (t[x - u + v] - t[x]) +
                     static_cast<double>(d[x - lv]) * (t[x + u - v] - t[x]));
          }
        }
      }
    }
  }
  for (auto& [key, made] : bricks_) {
    Brick& b = *made;
    for (std::size_t c = 0; c < kCells; ++c) {
      const double holds = static_cast<double>(b.capacity[c]);
      // Water halfway between before and after: stable however strong the film, since an open face stands where a
      // neighbour would.
      const double film = b.cooled ? 0.5 * seconds * static_cast<double>(b.film[c]) : 0,
                   water = static_cast<double>(b.water[c]);
      if (!(holds > 0)) continue;
      const double before = b.kelvin[c];
      b.kelvin[c] = (before * (holds - film) + b.change[c] * seconds + 2 * film * water) / (holds + film);
      if (film > 0) ledger_.cooled_j += film * (before + b.kelvin[c] - 2 * water);
    }
  }
}

void HeatField::wake_and_forget() {
  std::vector<Ijk> wanted;
  std::vector<Key> done;
  const auto warm_side = [](const Brick& b, int d) {
    const int axis = d / 2, at = d % 2 == 0 ? 0 : 7;
    for (int n = 0; n < 64; ++n) {
      const int c = axis == 0 ? 8 * n + at : axis == 1 ? (n >> 3) * 64 + 8 * at + (n & 7) : 64 * at + n;
      if (std::abs(b.kelvin[static_cast<std::size_t>(c)]) >= kMinK && b.conducts[static_cast<std::size_t>(c)] > 0)
        return true;
    }
    return false;
  };
  for (const auto& [key, b] : bricks_) {
    bool fed = b->heated || b->cooled;
    for (int d = 0; d < 6; ++d) {
      const Brick* const other = b->around[kFaces[d]];
      if (other != nullptr) {
        fed = fed || warm_side(*other, d ^ 1);
      } else if (warm_side(*b, d)) {
        wanted.push_back(beside(b->at, d));
      }
    }
    if (fed) continue;
    const auto [low, high] = std::minmax_element(b->kelvin.begin(), b->kelvin.end());
    if (std::max(-*low, *high) < kMinK / 2) done.push_back(key);
  }
  for (const Key key : done) {
    const auto it = bricks_.find(key);
    Brick& b = *it->second;
    for (std::size_t c = 0; c < kCells; ++c) ledger_.forgotten_j += b.kelvin[c] * static_cast<double>(b.capacity[c]);
    links_are_old_around(b);
    for (int n = 0; n < 27; ++n) {
      if (Brick* const other = b.around[static_cast<std::size_t>(n)]; other != nullptr && n != kSelf)
        other->around[static_cast<std::size_t>(26 - n)] = nullptr;
    }
    bricks_.erase(it);
  }
  for (const Ijk at : wanted) make(at);
}

double HeatField::stored_j() const {
  double sum = 0;
  for (const auto& [key, b] : bricks_) {
    for (std::size_t c = 0; c < kCells; ++c) sum += b->kelvin[c] * static_cast<double>(b->capacity[c]) + b->source[c];
  }
  return sum;
}

double HeatField::hottest() const {
  double most = 0;
  for (const auto& [key, b] : bricks_) {
    for (std::size_t c = 0; c < kCells; ++c) {
      if (b->share[c] >= 0.5F) most = std::max(most, b->kelvin[c]);
    }
  }
  return most;
}

double HeatField::at(Ijk cell) const noexcept {
  const Brick* const b = find(brick_of(cell));
  return b == nullptr ? 0 : b->kelvin[static_cast<std::size_t>(place_of(cell))];
}

double HeatField::at(Vec3 where) const noexcept {
  const auto low = [](double v) { return static_cast<int>(std::floor(v)); };
  const Ijk o{low(where.x), low(where.y), low(where.z)};
  const double f[3] = {where.x - o.i, where.y - o.j, where.z - o.k};
  double sum = 0, weights = 0;
  for (int n = 0; n < 8; ++n) {
    const Ijk c{o.i + (n & 1), o.j + (n >> 1 & 1), o.k + (n >> 2)};
    const double w =
        ((n & 1) != 0 ? f[0] : 1 - f[0]) * ((n & 2) != 0 ? f[1] : 1 - f[1]) * ((n & 4) != 0 ? f[2] : 1 - f[2]);
    const Brick* const b = find(brick_of(c));
    if (b != nullptr && b->capacity[static_cast<std::size_t>(place_of(c))] <= 0) continue;
    sum += w * (b == nullptr ? 0 : b->kelvin[static_cast<std::size_t>(place_of(c))]);
    weights += w;
  }
  return weights > 0 ? sum / weights : 0;
}

std::vector<Ijk> HeatField::warm_bricks() const {
  std::vector<Ijk> all;
  for (const auto& [key, b] : bricks_) all.push_back(b->at);
  return all;
}

std::span<const double> HeatField::brick(Ijk at) const {
  const Brick* const b = find(at);
  return b == nullptr ? std::span<const double>() : std::span<const double>(b->kelvin);
}

}  // namespace osteo::inline simulation
