#include "osteo/heat/heat_field.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "osteo/base/error.h"

namespace osteo {
namespace {

constexpr double kMm3PerM3 = 1e9, kMmPerM = 1e3, kMm2PerM2 = 1e6;
constexpr int kStep[3] = {1, 8, 64};
// Of the longest stable step: errors of second order in space and time then cancel, averaged over all directions (alpha dt / h2 = 1/10).
constexpr double kOfLongest = 0.6;

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
float least(float a, float b) {
  return b < a ? b : a;
}

}  // namespace

HeatField::HeatField(double cell_mm, const HeatMaterials& m, MatterAt matter) : cell_mm_(cell_mm), matter_(std::move(matter)) {
  const auto positive = [](double x) { return std::isfinite(x) && x > 0; };
  if (!positive(cell_mm) || !positive(m.bone_w_per_m_k) || !positive(m.bone_kg_per_m3) || !positive(m.bone_j_per_kg_k) ||
      !positive(m.tissue_w_per_m_k) || !positive(m.tissue_kg_per_m3) || !positive(m.tissue_j_per_kg_k))
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

// Faces of a brick along an axis, the last of them to the brick beside.
void HeatField::join(Brick& b, int axis) {
  auto& face = b.face[static_cast<std::size_t>(axis)];
  const int by = kStep[axis];
  const Brick* const next = b.beside[static_cast<std::size_t>(2 * axis + 1)];
  for (int c = 0; c < kCells; ++c) {
    const bool last = (c / by & 7) == 7;
    const float other = !last ? b.conducts[static_cast<std::size_t>(c + by)]
                              : (next != nullptr ? next->conducts[static_cast<std::size_t>(c - 7 * by)] : 0.0F);
    face[static_cast<std::size_t>(c)] = least(b.conducts[static_cast<std::size_t>(c)], other);
  }
}

HeatField::Brick& HeatField::make(Ijk at) {
  auto& made = bricks_[key_of(at)];
  if (made) return *made;
  made = std::make_unique<Brick>();
  Brick& b = *made;
  b.at = at;
  for (int c = 0; c < kCells; ++c) fill(b, c, matter_({at.i * 8 + (c & 7), at.j * 8 + (c >> 3 & 7), at.k * 8 + (c >> 6)}));
  for (int d = 0; d < 6; ++d) {
    const auto it = bricks_.find(key_of(beside(at, d)));
    if (it == bricks_.end() || !it->second) continue;
    b.beside[static_cast<std::size_t>(d)] = it->second.get();
    it->second->beside[static_cast<std::size_t>(d ^ 1)] = &b;
    if (d % 2 == 0) join(*it->second, d / 2);
  }
  for (int axis = 0; axis < 3; ++axis) join(b, axis);
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

double HeatField::add(const Ball& where, double joules) {
  if (!std::isfinite(joules) || joules == 0) return 0;
  const double capacity = holds(where);
  if (!(capacity > 0)) return 0;
  for_ball(where, true, [&](Brick& b, int c, Ijk) {
    b.source[static_cast<std::size_t>(c)] += joules * static_cast<double>(b.capacity[static_cast<std::size_t>(c)]) / capacity;
    b.heated = true;
  });
  ledger_.added_j += joules;
  return joules;
}

double HeatField::holds(const Ball& where) {
  double capacity = 0;
  for_ball(where, true, [&](Brick& b, int c, Ijk) { capacity += static_cast<double>(b.capacity[static_cast<std::size_t>(c)]); });
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
  for_ball(where, std::abs(water_k) >= kLeastK, [&](Brick& b, int cell, Ijk at) {
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
  strongest_film_ = std::max(strongest_film_, film_w_per_m2_k);
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
      b.kelvin[c] = 0;
    }
  } else if (after > 0) {
    b.kelvin[c] = heat / after;
  }
  for (int axis = 0; axis < 3; ++axis) {
    const int by = kStep[axis], along = static_cast<int>(c) / by & 7;
    const auto a = static_cast<std::size_t>(axis);
    if (along < 7) {
      b.face[a][c] = least(b.conducts[c], b.conducts[c + static_cast<std::size_t>(by)]);
    } else if (const Brick* const next = b.beside[2 * a + 1]) {
      b.face[a][c] = least(b.conducts[c], next->conducts[c - static_cast<std::size_t>(7 * by)]);
    }
    if (along > 0) {
      b.face[a][c - static_cast<std::size_t>(by)] = least(b.conducts[c], b.conducts[c - static_cast<std::size_t>(by)]);
    } else if (Brick* const last = b.beside[2 * a]) {
      const std::size_t there = c + static_cast<std::size_t>(7 * by);
      last->face[a][there] = least(b.conducts[c], last->conducts[there]);
    }
  }
}

double HeatField::longest_step_s(double film_w_per_m2_k) const {
  const double film = film_w_per_m2_k / kMm2PerM2 * cell_mm_ * cell_mm_;
  const auto longest = [&](double holds, double conducts) {
    return holds / (6 * conducts + (film > 0 ? 6 / (1 / film + 1 / (2 * conducts)) : 0));
  };
  return std::min(longest(bone_j_per_k_, bone_w_per_k_), longest(tissue_j_per_k_, tissue_w_per_k_));
}

void HeatField::step(double seconds) {
  if (!(seconds > 0) || !std::isfinite(seconds)) return;
  const double most = kOfLongest * longest_step_s(strongest_film_);
  const int steps = std::max(1, static_cast<int>(std::ceil(seconds / most)));
  for (int s = 0; s < steps; ++s) {
    // Half of a step's heat before it, half behind: of second order like the rest.
    heat(0.5 / steps);
    wake_and_forget();
    conduct(seconds / steps);
    heat(0.5 / steps);
  }
  for (auto& [key, b] : bricks_) {
    if (b->heated) b->source.fill(0);
    if (b->cooled) b->film.fill(0);
    b->heated = b->cooled = false;
  }
  strongest_film_ = 0;
}

void HeatField::heat(double share) {
  for (auto& [key, b] : bricks_) {
    if (!b->heated) continue;
    for (std::size_t c = 0; c < kCells; ++c) {
      if (b->source[c] != 0) b->kelvin[c] += share * b->source[c] / static_cast<double>(b->capacity[c]);
    }
  }
}

void HeatField::conduct(double seconds) {
  // Along a row, a plane, a brick: the loops over x are plain vectors.
  for (auto& [key, made] : bricks_) {
    Brick& b = *made;
    const double* const t = b.kelvin.data();
    double* const q = b.change.data();
    for (int axis = 0; axis < 3; ++axis) {
      const int by = kStep[axis];
      const float* const face = b.face[static_cast<std::size_t>(axis)].data();
      const auto inside = [&](int c) {
        const double flow = static_cast<double>(face[c]) * (t[c + by] - t[c]);
        q[c] += flow;
        q[c + by] -= flow;
      };
      if (axis == 0) {
        for (int row = 0; row < kCells; row += 8) {
          for (int c = row; c < row + 7; ++c) inside(c);
        }
      } else if (axis == 1) {
        for (int plane = 0; plane < kCells; plane += 64) {
          for (int c = plane; c < plane + 56; ++c) inside(c);
        }
      } else {
        for (int c = 0; c < kCells - 64; ++c) inside(c);
      }
      Brick* const next = b.beside[static_cast<std::size_t>(2 * axis + 1)];
      if (next == nullptr) continue;
      for (int n = 0; n < 64; ++n) {
        const int c = axis == 0 ? 8 * n + 7 : axis == 1 ? (n >> 3) * 64 + 56 + (n & 7) : 448 + n;
        const double flow = static_cast<double>(face[c]) * (next->kelvin[static_cast<std::size_t>(c - 7 * by)] - t[c]);
        q[c] += flow;
        next->change[static_cast<std::size_t>(c - 7 * by)] -= flow;
      }
    }
  }
  for (auto& [key, made] : bricks_) {
    Brick& b = *made;
    if (b.cooled) {
      for (std::size_t c = 0; c < kCells; ++c) {
        const double flow = static_cast<double>(b.film[c]) * (b.kelvin[c] - static_cast<double>(b.water[c]));
        b.change[c] -= flow;
        ledger_.cooled_j += flow * seconds;
      }
    }
    for (std::size_t c = 0; c < kCells; ++c) {
      const double holds = static_cast<double>(b.capacity[c]);
      b.kelvin[c] += holds > 0 ? b.change[c] * seconds / holds : 0;
      b.change[c] = 0;
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
      if (std::abs(b.kelvin[static_cast<std::size_t>(c)]) >= kLeastK && b.conducts[static_cast<std::size_t>(c)] > 0) return true;
    }
    return false;
  };
  for (const auto& [key, b] : bricks_) {
    bool fed = b->heated || b->cooled;
    for (int d = 0; d < 6; ++d) {
      const Brick* const other = b->beside[static_cast<std::size_t>(d)];
      if (other != nullptr) {
        fed = fed || warm_side(*other, d ^ 1);
      } else if (warm_side(*b, d)) {
        wanted.push_back(beside(b->at, d));
      }
    }
    if (fed) continue;
    const auto [low, high] = std::minmax_element(b->kelvin.begin(), b->kelvin.end());
    if (std::max(-*low, *high) < kLeastK / 2) done.push_back(key);
  }
  for (const Key key : done) {
    const auto it = bricks_.find(key);
    Brick& b = *it->second;
    for (std::size_t c = 0; c < kCells; ++c) ledger_.forgotten_j += b.kelvin[c] * static_cast<double>(b.capacity[c]);
    for (int d = 0; d < 6; ++d) {
      Brick* const other = b.beside[static_cast<std::size_t>(d)];
      if (other == nullptr) continue;
      other->beside[static_cast<std::size_t>(d ^ 1)] = nullptr;
      if (d % 2 == 0) join(*other, d / 2);
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
    const double w = ((n & 1) != 0 ? f[0] : 1 - f[0]) * ((n & 2) != 0 ? f[1] : 1 - f[1]) * ((n & 4) != 0 ? f[2] : 1 - f[2]);
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

}  // namespace osteo
