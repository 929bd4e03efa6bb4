#include "cavity.h"

#include <algorithm>
#include <cmath>

#include "osteo/assessment/evidence/visibility.h"
#include "osteo/core/base/parallel.h"
#include "osteo/geometry/grid/sampler.h"

namespace osteo::inline assessment {
namespace {

// A bone and where its bricks lie, in its voxels: what is beyond by more than a voxel is 0.
struct Extent {
  const BrickGrid* bone;
  std::array<int, 3> lo, hi;
};
Extent extent_of(const BrickGrid& bone) {
  constexpr int kFar = 1 << 28;
  Extent e{&bone, {kFar, kFar, kFar}, {-kFar, -kFar, -kFar}};
  for (std::uint32_t b = 0; b < bone.brick_count(); ++b) {
    const Ijk o = bone.brick_coordinate(b);
    const std::array<int, 3> at{o.i * 8, o.j * 8, o.k * 8};
    for (std::size_t a = 0; a < 3; ++a) {
      e.lo[a] = std::min(e.lo[a], at[a]);
      e.hi[a] = std::max(e.hi[a], at[a] + 7);
    }
  }
  return e;
}

// Adds to a row of the lattice a bone's densities there: from `first` on by `step` a cell, in its voxels.
void add_row(const Extent& extent, Vec3 first, Vec3 step, std::span<float> row) {
  const BrickGrid& bone = *extent.bone;
  double from = 0, to = static_cast<double>(row.size() - 1);
  for (std::size_t a = 0; a < 3; ++a) {
    const double lo = extent.lo[a] - 1, hi = extent.hi[a] + 1;
    if (std::abs(step[a]) < 1e-12) {
      if (first[a] < lo || first[a] > hi) return;
      continue;
    }
    const double u = (lo - first[a]) / step[a], v = (hi - first[a]) / step[a];
    from = std::max(from, std::min(u, v));
    to = std::min(to, std::max(u, v));
  }
  if (from > to) return;
  const auto begin = static_cast<std::size_t>(std::floor(from)),
             end = std::min(row.size(), static_cast<std::size_t>(std::ceil(to)) + 1);
  // A lattice that is the bone's own reads its voxels, whatever rounding has done.
  const auto snap = [](double x) {
    const double near = std::round(x);
    return std::abs(x - near) < 1e-6 ? near : x;
  };
  const auto whole = [&](double x) { return snap(x) == std::round(x); };
  const Vec3 last = first + step * static_cast<double>(row.size() - 1);
  const bool own = whole(first.x) && whole(first.y) && whole(first.z) && std::abs(step.x - 1) < 1e-9 && whole(last.x) &&
                   std::abs(last.y - first.y) < 1e-7 && std::abs(last.z - first.z) < 1e-7;
  if (!own) {
    for (std::size_t i = begin; i < end; ++i) {
      const Vec3 at = first + step * static_cast<double>(i);
      row[i] += linear_at(bone, {snap(at.x), snap(at.y), snap(at.z)});
    }
    return;
  }
  const int x0 = static_cast<int>(std::round(first.x)), y = static_cast<int>(std::round(first.y)),
            z = static_cast<int>(std::round(first.z));
  for (int i = static_cast<int>(begin); i < static_cast<int>(end);) {
    const int x = x0 + i, stop = std::min(static_cast<int>(end), i + 8 - (x & 7));
    if (const std::uint32_t b = bone.find_brick(x >> 3, y >> 3, z >> 3); b != BrickGrid::kNone) {
      const float* const v = bone.values_of_brick(b) + BrickGrid::offset_in_brick(x, y, z);
      for (int j = i; j < stop; ++j) row[static_cast<std::size_t>(j)] += v[j - i];
    }
    i = stop;
  }
}

template <class F>
void each_word(BitMask& out, const BitMask& other, F&& f) {
  const std::span<std::uint64_t> o = out.words();
  const std::span<const std::uint64_t> w = other.words();
  for (std::size_t n = 0; n < o.size(); ++n) o[n] = f(o[n], w[n]);
}
void take_away(BitMask& from, const BitMask& what) {
  each_word(from, what, [](std::uint64_t a, std::uint64_t b) { return a & ~b; });
}

// Of each row what lies one cell further along x too, either way.
void widen_rows(BitMask& m, const Context& context) {
  const std::size_t words = m.words_per_row();
  const int nx = m.dims()[0];
  parallel_for(m.rows(), 1024, context.threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t r = begin; r < end; ++r) {
      const std::span<std::uint64_t> row = m.row(r);
      std::uint64_t before = 0;
      for (std::size_t w = 0; w < words; ++w) {
        const std::uint64_t here = row[w], next = w + 1 < words ? row[w + 1] : 0;
        row[w] = here | here << 1 | before >> 63 | here >> 1 | next << 63;
        before = here;
      }
      row[words - 1] &= bits_of_word(words - 1, 0, nx);
    }
  });
}

bool any_in(const BitMask& m, const Run& run) {
  const std::span<const std::uint64_t> row = m.row(run.row);
  for (std::size_t w = run.begin / 64; w * 64 < run.end; ++w) {
    if ((row[w] & bits_of_word(w, static_cast<int>(run.begin), static_cast<int>(run.end))) != 0) return true;
  }
  return false;
}

// The connected parts (by faces) of a mask that hold a seed.
BitMask reached(const BitMask& mask, const BitMask& seeds) {
  const Components parts = connected_components(mask.runs(true), mask.dims(), Connectivity::face);
  std::vector<bool> has(parts.voxels.size(), false);
  for (std::size_t r = 0; r < parts.runs.size(); ++r) {
    if (!has[parts.component[r]] && any_in(seeds, parts.runs[r])) has[parts.component[r]] = true;
  }
  BitMask out(mask.dims());
  for (std::size_t r = 0; r < parts.runs.size(); ++r) {
    const Run& run = parts.runs[r];
    if (has[parts.component[r]]) out.set(run.row, static_cast<int>(run.begin), static_cast<int>(run.end), true);
  }
  return out;
}

BitMask lattice_faces(const std::array<int, 3>& dims) {
  BitMask faces(dims);
  const int nx = dims[0], ny = dims[1], nz = dims[2];
  for (std::size_t r = 0; r < faces.rows(); ++r) {
    const int j = static_cast<int>(r) % ny, k = static_cast<int>(r) / ny;
    if (j == 0 || j == ny - 1 || k == 0 || k == nz - 1) {
      faces.set(r, 0, nx, true);
    } else {
      faces.set(r, 0, 1, true);
      faces.set(r, nx - 1, nx, true);
    }
  }
  return faces;
}

// The largest number of squares of a cell that is nearer than `limit_mm2`.
int squares_below(double limit_mm2, double cell_mm) {
  int n = 0;
  while ((n + 1) * cell_mm * cell_mm < limit_mm2) ++n;
  return n;
}

}  // namespace

namespace {

// Rows of the lattice that a density reaches which is not the same in both worlds; all where their bricks are not the
// same.
std::vector<std::uint8_t> changed_rows(const World& before, const World& after, const Frame& lattice) {
  const int ny = lattice.dims[1], nz = lattice.dims[2];
  std::vector<std::uint8_t> rows(static_cast<std::size_t>(ny) * static_cast<std::size_t>(nz), 0);
  const auto all = [&] { return std::vector<std::uint8_t>(rows.size(), 1); };
  if (before.bodies().size() != after.bodies().size()) return all();
  for (std::size_t n = 0; n < before.bodies().size(); ++n) {
    const BrickGrid &a = before.bodies()[n].body->bone, &b = after.bodies()[n].body->bone;
    if (!(a.frame() == b.frame()) || a.brick_count() != b.brick_count()) return all();
    for (std::uint32_t k = 0; k < a.brick_count(); ++k) {
      const Ijk o = a.brick_coordinate(k);
      if (!(o == b.brick_coordinate(k))) return all();
      if (std::equal(a.values_of_brick(k), a.values_of_brick(k) + BrickGrid::kVoxels, b.values_of_brick(k))) continue;
      // A voxel is felt as far as its neighbours.
      double lo[2] = {1e9, 1e9}, hi[2] = {-1e9, -1e9};
      for (int c = 0; c < 8; ++c) {
        const auto corner = [&](int at, int bit) { return at * 8 + (bit != 0 ? 8.0 : -1.0); };
        const Vec3 x = lattice.index_from_world(
            a.frame().world_from_index({corner(o.i, c & 1), corner(o.j, c >> 1 & 1), corner(o.k, c >> 2)}));
        lo[0] = std::min(lo[0], x.y);
        hi[0] = std::max(hi[0], x.y);
        lo[1] = std::min(lo[1], x.z);
        hi[1] = std::max(hi[1], x.z);
      }
      const auto first = [](double x, int last) {
        return static_cast<int>(std::clamp(std::floor(x) - 1, 0.0, double(last)));
      };
      const auto end = [](double x, int last) {
        return static_cast<int>(std::clamp(std::ceil(x) + 2, 0.0, double(last)));
      };
      for (int z = first(lo[1], nz); z < end(hi[1], nz); ++z)
        for (int y = first(lo[0], ny); y < end(hi[0], ny); ++y)
          rows[static_cast<std::size_t>(z) * static_cast<std::size_t>(ny) + static_cast<std::size_t>(y)] = 1;
    }
  }
  return rows;
}

// `wanted`: a flag for each row; empty for all.
void fill_rows(const World& world, const Frame& lattice, const std::vector<std::uint8_t>& wanted, BitMask& out,
               const Context& context) {
  const auto nx = static_cast<std::size_t>(lattice.dims[0]), ny = static_cast<std::size_t>(lattice.dims[1]);
  std::vector<Extent> bones;
  for (const PlacedBody& b : world.bodies()) {
    if (b.body->bone.brick_count() > 0) bones.push_back(extent_of(b.body->bone));
  }
  parallel_for(ny * static_cast<std::size_t>(lattice.dims[2]), 64, context.threads,
               [&](std::size_t begin, std::size_t end) {
                 std::vector<float> density(nx);
                 for (std::size_t row = begin; row < end; ++row) {
                   if (!wanted.empty() && wanted[row] == 0) continue;
                   std::fill(density.begin(), density.end(), 0.0F);
                   const double j = static_cast<double>(row % ny), k = static_cast<double>(row / ny);
                   const Vec3 at = lattice.world_from_index({0, j, k}), next = lattice.world_from_index({1, j, k});
                   for (const Extent& e : bones) {
                     const Frame& own = e.bone->frame();
                     const Vec3 first = own.index_from_world(at);
                     add_row(e, first, own.index_from_world(next) - first, density);
                   }
                   const std::span<std::uint64_t> words = out.row(row);
                   for (std::size_t w = 0; w < words.size(); ++w) {
                     std::uint64_t word = 0;
                     for (std::size_t i = w * 64; i < std::min(nx, w * 64 + 64); ++i)
                       word |= std::uint64_t{density[i] >= kSolid} << (i % 64);
                     words[w] = word;
                   }
                 }
               });
}

}  // namespace

BitMask solid_cells(const World& world, const Frame& lattice, const Context& context) {
  BitMask out(lattice.dims);
  fill_rows(world, lattice, {}, out, context);
  return out;
}

BitMask solid_cells(const World& world, const Frame& lattice, const World& before, BitMask cells,
                    const Context& context) {
  fill_rows(world, lattice, changed_rows(before, world, lattice), cells, context);
  return cells;
}

BitMask grown(const BitMask& mask, int most2, const Context& context) {
  BitMask out(mask.dims()), wide = mask;
  const int ny = mask.dims()[1], nz = mask.dims()[2];
  const int most = static_cast<int>(std::sqrt(static_cast<double>(most2) + 0.5));
  std::vector<std::uint8_t> any(mask.rows());
  for (std::size_t r = 0; r < mask.rows(); ++r) {
    const std::span<const std::uint64_t> row = mask.row(r);
    any[r] = std::any_of(row.begin(), row.end(), [](std::uint64_t w) { return w != 0; }) ? 1 : 0;
  }
  // Rows widened by 0, 1, 2, ... cells, each laid where the ball is so wide.
  for (int w = 0; w <= most; ++w) {
    if (w > 0) widen_rows(wide, context);
    std::vector<std::array<int, 2>> offsets;
    for (int k = -most; k <= most; ++k) {
      for (int j = -most; j <= most; ++j) {
        const int room = most2 - j * j - k * k;
        if (room >= w * w && room < (w + 1) * (w + 1)) offsets.push_back({j, k});
      }
    }
    if (offsets.empty()) continue;
    parallel_for(out.rows(), 256, context.threads, [&](std::size_t begin, std::size_t end) {
      for (std::size_t r = begin; r < end; ++r) {
        const int j = static_cast<int>(r) % ny, k = static_cast<int>(r) / ny;
        const std::span<std::uint64_t> to = out.row(r);
        for (const auto& [dj, dk] : offsets) {
          if (j + dj < 0 || j + dj >= ny || k + dk < 0 || k + dk >= nz) continue;
          const std::size_t beside =
              static_cast<std::size_t>(k + dk) * static_cast<std::size_t>(ny) + static_cast<std::size_t>(j + dj);
          if (any[beside] == 0) continue;
          const std::span<const std::uint64_t> from = wide.row(beside);
          for (std::size_t n = 0; n < to.size(); ++n) to[n] |= from[n];
        }
      }
    });
  }
  return out;
}

BitMask cavity_of(const BitMask& solid, const BitMask& gone, const BitMask& closed, double cell_mm, double ball_mm,
                  double opened_mm, const Context& context) {
  const BitMask none(solid.dims());
  const auto is_empty = [&](const BitMask& m) { return m == none; };
  if (is_empty(gone)) return none;
  // Distances are between centres: the solid begins half a cell nearer.
  const double room_mm2 = std::pow(ball_mm + cell_mm / 2, 2);
  BitMask fits(solid.dims());
  for (std::size_t r = 0; r < fits.rows(); ++r) fits.set(r, 0, fits.dims()[0], true);
  take_away(fits, grown(solid, squares_below(room_mm2 * (1 - 1e-6), cell_mm), context));
  const BitMask faces = lattice_faces(solid.dims());
  // Outside first: all that is reached without what is gone or was closed.
  BitMask open = fits;
  take_away(open, gone);
  take_away(open, closed);
  const BitMask outside = reached(open, faces);
  // From there into what is gone, and on wherever the ball fits.
  BitMask way = grown(gone, squares_below(opened_mm * opened_mm * (1 + 1e-6), cell_mm), context);
  each_word(way, fits, [](std::uint64_t a, std::uint64_t b) { return a & b; });
  take_away(way, outside);
  BitMask seeds = grown(outside, 1, context);
  each_word(seeds, faces, [](std::uint64_t a, std::uint64_t b) { return a | b; });
  each_word(seeds, gone, [](std::uint64_t a, std::uint64_t b) { return a & b; });
  const BitMask inside = reached(way, seeds);
  if (is_empty(inside)) return none;
  // The ball sweeps what lies within its radius (and half a cell: faces, not centres) of its centre's ways.
  const int sweeps = squares_below(room_mm2 * (1 + 1e-6), cell_mm);
  BitMask cavity = grown(inside, sweeps, context), was_outside = grown(outside, sweeps, context);
  take_away(was_outside, gone);
  take_away(was_outside, closed);
  take_away(cavity, solid);
  take_away(cavity, was_outside);
  return cavity;
}

}  // namespace osteo::inline assessment
