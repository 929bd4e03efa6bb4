#include "osteo/geometry/tets/lattice_tets.h"

#include <bit>

#include "osteo/core/base/error.h"
#include "osteo/core/base/parallel.h"

namespace osteo::inline geometry {
namespace {

// Corner c of a cube is at (c & 1, c >> 1 & 1, c >> 2). Positive volumes in a right-handed frame.
using FiveTets = std::array<std::array<std::uint8_t, 4>, 5>;
constexpr FiveTets kEven{{{0, 3, 5, 6}, {1, 3, 5, 0}, {2, 0, 6, 3}, {4, 6, 0, 5}, {7, 5, 3, 6}}};
constexpr FiveTets kOdd{{{1, 2, 7, 4}, {0, 1, 2, 4}, {3, 2, 1, 7}, {5, 1, 4, 7}, {6, 4, 2, 7}}};

constexpr double corner(int c, int axis) {
  return c >> axis & 1;
}
constexpr FiveTets oriented(FiveTets tets, bool right_handed) {
  for (auto& t : tets) {
    double e[3][3] = {};
    for (int i = 0; i < 3; ++i) {
      for (int a = 0; a < 3; ++a) e[i][a] = corner(t[static_cast<std::size_t>(i) + 1], a) - corner(t[0], a);
    }
    const double volume = e[0][0] * (e[1][1] * e[2][2] - e[1][2] * e[2][1]) -
                          e[0][1] * (e[1][0] * e[2][2] - e[1][2] * e[2][0]) +
                          e[0][2] * (e[1][0] * e[2][1] - e[1][1] * e[2][0]);
    if ((volume > 0) != right_handed) std::swap(t[2], t[3]);
  }
  return tets;
}

}  // namespace

TetMesh grid_tets(const VoxelBits& voxels, const Context& context) {
  const int nx = voxels.frame.dims[0], ny = voxels.frame.dims[1], nz = voxels.frame.dims[2];
  // Which lattice corners are in use, a bit each.
  const std::size_t words = (static_cast<std::size_t>(nx) + 1 + 63) / 64;
  const auto corner_row = [&](int j, int k) {
    return static_cast<std::size_t>(k) * static_cast<std::size_t>(ny + 1) + static_cast<std::size_t>(j);
  };
  const std::size_t corner_rows = corner_row(0, nz + 1);
  BigArray<std::uint64_t> used;
  used.resize(corner_rows * words);
  std::vector<std::uint64_t> first_point(corner_rows + 1, 0),
      first_voxel(static_cast<std::size_t>(ny) * static_cast<std::size_t>(nz) + 1, 0);
  parallel_for(static_cast<std::size_t>(nz) + 1, 4, context.threads, [&](std::size_t begin, std::size_t end) {
    for (int k = static_cast<int>(begin); k < static_cast<int>(end); ++k) {
      for (int j = 0; j <= ny; ++j) {
        std::uint64_t* const row = &used[corner_row(j, k) * words];
        std::uint64_t points = 0, carry = 0;
        for (std::size_t w = 0; w < words; ++w) {
          std::uint64_t v = 0;
          if (w < voxels.words_per_row) {
            for (int dk = -1; dk <= 0; ++dk) {
              for (int dj = -1; dj <= 0; ++dj) {
                if (j + dj >= 0 && j + dj < ny && k + dk >= 0 && k + dk < nz)
                  v |= voxels.words[voxels.row(j + dj, k + dk) + w];
              }
            }
          }
          row[w] = v | v << 1 | carry;
          carry = v >> 63;
          points += static_cast<std::uint64_t>(std::popcount(row[w]));
        }
        first_point[corner_row(j, k) + 1] = points;
      }
      for (int j = 0; j < ny && k < nz; ++j) {
        std::uint64_t count = 0;
        for (std::size_t w = 0; w < voxels.words_per_row; ++w)
          count += static_cast<std::uint64_t>(std::popcount(voxels.words[voxels.row(j, k) + w]));
        first_voxel[static_cast<std::size_t>(k) * static_cast<std::size_t>(ny) + static_cast<std::size_t>(j) + 1] =
            count;
      }
    }
  });
  for (std::size_t r = 1; r < first_point.size(); ++r) first_point[r] += first_point[r - 1];
  for (std::size_t r = 1; r < first_voxel.size(); ++r) first_voxel[r] += first_voxel[r - 1];
  if (first_point.back() >= 0xffffffffULL)
    throw Error(ExitCode::resources, "the mesh would have more than 2^32 points", "choose larger voxels");
  context.check_cancelled();

  TetMesh mesh;
  mesh.points_mm.resize(first_point.back());
  mesh.tets.resize(first_voxel.back() * 5);
  const bool right_handed = determinant(voxels.frame.direction) > 0;
  const FiveTets patterns[2] = {oriented(kEven, right_handed), oriented(kOdd, right_handed)};
  const Vec3 step = voxels.frame.direction.column[0] * voxels.frame.spacing_mm.x;
  parallel_for(static_cast<std::size_t>(nz) + 1, 4, context.threads, [&](std::size_t begin, std::size_t end) {
    for (int k = static_cast<int>(begin); k < static_cast<int>(end); ++k) {
      for (int j = 0; j <= ny; ++j) {
        const std::size_t r = corner_row(j, k);
        std::uint64_t at = first_point[r];
        if (at == first_point[r + 1]) continue;
        const Vec3 start = voxels.frame.world_from_index({-0.5, j - 0.5, k - 0.5});
        for (std::size_t w = 0; w < words; ++w) {
          for (std::uint64_t rest = used[r * words + w]; rest != 0; rest &= rest - 1) {
            const Vec3 p =
                start + step * static_cast<double>(w * 64 + static_cast<std::size_t>(std::countr_zero(rest)));
            mesh.points_mm[at++] = {static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)};
          }
        }
      }
      for (int j = 0; j < ny && k < nz; ++j) {
        std::array<std::uint32_t, 4>* out =
            mesh.tets.data() +
            5 * first_voxel[static_cast<std::size_t>(k) * static_cast<std::size_t>(ny) + static_cast<std::size_t>(j)];
        const std::size_t rows[4] = {corner_row(j, k), corner_row(j + 1, k), corner_row(j, k + 1),
                                     corner_row(j + 1, k + 1)};
        std::uint32_t before[4];  // points of the row before this word
        for (int q = 0; q < 4; ++q) before[q] = static_cast<std::uint32_t>(first_point[rows[q]]);
        for (std::size_t w = 0; w < voxels.words_per_row; ++w) {
          std::uint64_t bits = voxels.words[voxels.row(j, k) + w];
          while (bits != 0) {
            // A run of voxels: the corners along it are numbered one after the other, so each voxel has the tetrahedra
            // of the one before with 1 added, in the two patterns by turns.
            const int start = std::countr_zero(bits), length = std::countr_one(bits >> start);
            bits = start + length == 64 ? 0 : bits & (~0ULL << (start + length));
            std::uint32_t corner_of[8];
            for (int q = 0; q < 4; ++q) {
              const std::uint64_t lower = used[rows[q] * words + w] & ((1ULL << start) - 1);
              corner_of[2 * q] = before[q] + static_cast<std::uint32_t>(std::popcount(lower));
              corner_of[2 * q + 1] = corner_of[2 * q] + 1;
            }
            std::uint32_t first[2][20];
            for (int n = 0; n < 2; ++n) {
              const FiveTets& five = patterns[(start + n + j + k) & 1];
              for (std::size_t t = 0; t < 5; ++t) {
                for (std::size_t c = 0; c < 4; ++c)
                  first[n][4 * t + c] = corner_of[five[t][c]] + static_cast<std::uint32_t>(n);
              }
            }
            auto* flat = out->data();
            for (int n = 0; n < length; ++n) {
              const std::uint32_t* const from = first[n & 1];
              const auto further = static_cast<std::uint32_t>(n & ~1);
              for (int c = 0; c < 20; ++c) flat[c] = from[c] + further;
              flat += 20;
            }
            out += 5 * static_cast<std::ptrdiff_t>(length);
          }
          for (int q = 0; q < 4; ++q) before[q] += static_cast<std::uint32_t>(std::popcount(used[rows[q] * words + w]));
        }
      }
    }
  });
  context.progress(1.0);
  return mesh;
}

}  // namespace osteo::inline geometry
