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

// The lattice of corners between voxels: a bit for each that is in use, and what each row of points and voxels begins
// with.
class CornerLattice {
 public:
  CornerLattice(const VoxelBits& voxels, const Context& context)
      : voxels_(voxels),
        nx_(voxels.frame.dims[0]),
        ny_(voxels.frame.dims[1]),
        nz_(voxels.frame.dims[2]),
        words_((static_cast<std::size_t>(nx_) + 1 + 63) / 64),
        first_point_(corner_row(0, nz_ + 1) + 1, 0),
        first_voxel_(static_cast<std::size_t>(ny_) * static_cast<std::size_t>(nz_) + 1, 0) {
    used_.resize(corner_row(0, nz_ + 1) * words_);
    each_layer(context, [&](int k) {
      for (int j = 0; j <= ny_; ++j) first_point_[corner_row(j, k) + 1] = mark_corners(j, k);
      for (int j = 0; j < ny_ && k < nz_; ++j) {
        std::uint64_t count = 0;
        for (std::size_t w = 0; w < voxels_.words_per_row; ++w)
          count += static_cast<std::uint64_t>(std::popcount(voxels_.words[voxels_.row(j, k) + w]));
        first_voxel_[voxel_row(j, k) + 1] = count;
      }
    });
    for (std::size_t r = 1; r < first_point_.size(); ++r) first_point_[r] += first_point_[r - 1];
    for (std::size_t r = 1; r < first_voxel_.size(); ++r) first_voxel_[r] += first_voxel_[r - 1];
  }
  [[nodiscard]] std::uint64_t points() const { return first_point_.back(); }
  [[nodiscard]] std::uint64_t voxels() const { return first_voxel_.back(); }

  void fill(TetMesh& mesh, const Context& context) const {
    const bool right_handed = determinant(voxels_.frame.direction) > 0;
    const FiveTets patterns[2] = {oriented(kEven, right_handed), oriented(kOdd, right_handed)};
    each_layer(context, [&](int k) {
      for (int j = 0; j <= ny_; ++j) place_points(j, k, mesh);
      for (int j = 0; j < ny_ && k < nz_; ++j) fill_row(j, k, patterns, mesh);
    });
  }

 private:
  [[nodiscard]] std::size_t corner_row(int j, int k) const {
    return static_cast<std::size_t>(k) * static_cast<std::size_t>(ny_ + 1) + static_cast<std::size_t>(j);
  }
  [[nodiscard]] std::size_t voxel_row(int j, int k) const {
    return static_cast<std::size_t>(k) * static_cast<std::size_t>(ny_) + static_cast<std::size_t>(j);
  }
  // Of corners: one more than of voxels.
  template <typename Take>
  void each_layer(const Context& context, const Take& take) const {
    parallel_for(static_cast<std::size_t>(nz_) + 1, 4, context.threads, [&](std::size_t begin, std::size_t end) {
      for (int k = static_cast<int>(begin); k < static_cast<int>(end); ++k) take(k);
    });
  }

  // Those of a row that a voxel beside it has; returns how many.
  std::uint64_t mark_corners(int j, int k) {
    std::uint64_t* const row = &used_[corner_row(j, k) * words_];
    std::uint64_t points = 0, carry = 0;
    for (std::size_t w = 0; w < words_; ++w) {
      std::uint64_t v = 0;
      if (w < voxels_.words_per_row) {
        for (int dk = -1; dk <= 0; ++dk) {
          for (int dj = -1; dj <= 0; ++dj) {
            if (j + dj >= 0 && j + dj < ny_ && k + dk >= 0 && k + dk < nz_)
              v |= voxels_.words[voxels_.row(j + dj, k + dk) + w];
          }
        }
      }
      row[w] = v | v << 1 | carry;
      carry = v >> 63;
      points += static_cast<std::uint64_t>(std::popcount(row[w]));
    }
    return points;
  }

  void place_points(int j, int k, TetMesh& mesh) const {
    const Vec3 step = voxels_.frame.direction.column[0] * voxels_.frame.spacing_mm.x;
    const std::size_t r = corner_row(j, k);
    std::uint64_t at = first_point_[r];
    if (at == first_point_[r + 1]) return;
    const Vec3 start = voxels_.frame.world_from_index({-0.5, j - 0.5, k - 0.5});
    for (std::size_t w = 0; w < words_; ++w) {
      for (std::uint64_t rest = used_[r * words_ + w]; rest != 0; rest &= rest - 1) {
        const Vec3 p = start + step * static_cast<double>(w * 64 + static_cast<std::size_t>(std::countr_zero(rest)));
        mesh.points_mm[at++] = {static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)};
      }
    }
  }

  void fill_row(int j, int k, const FiveTets (&patterns)[2], TetMesh& mesh) const {
    std::array<std::uint32_t, 4>* out = mesh.tets.data() + 5 * first_voxel_[voxel_row(j, k)];
    const std::size_t rows[4] = {corner_row(j, k), corner_row(j + 1, k), corner_row(j, k + 1),
                                 corner_row(j + 1, k + 1)};
    std::uint32_t before[4];  // points of the row before this word
    for (int q = 0; q < 4; ++q) before[q] = static_cast<std::uint32_t>(first_point_[rows[q]]);
    for (std::size_t w = 0; w < voxels_.words_per_row; ++w) {
      std::uint64_t bits = voxels_.words[voxels_.row(j, k) + w];
      while (bits != 0) {
        const int start = std::countr_zero(bits), length = std::countr_one(bits >> start);
        bits = start + length == 64 ? 0 : bits & (~0ULL << (start + length));
        std::uint32_t corner_of[8];
        for (int q = 0; q < 4; ++q) {
          const std::uint64_t lower = used_[rows[q] * words_ + w] & ((1ULL << start) - 1);
          corner_of[2 * q] = before[q] + static_cast<std::uint32_t>(std::popcount(lower));
          corner_of[2 * q + 1] = corner_of[2 * q] + 1;
        }
        fill_run(corner_of, length, patterns, start + j + k, out);
        out += 5 * static_cast<std::ptrdiff_t>(length);
      }
      for (int q = 0; q < 4; ++q) before[q] += static_cast<std::uint32_t>(std::popcount(used_[rows[q] * words_ + w]));
    }
  }

  // A run of voxels: the corners along it are numbered one after the other, so each voxel has the tetrahedra of the one
  // before with 1 added, in the two patterns by turns.
  static void fill_run(const std::uint32_t (&corner_of)[8], int length, const FiveTets (&patterns)[2], int turn,
                       std::array<std::uint32_t, 4>* out) {
    std::uint32_t first[2][20];
    for (int n = 0; n < 2; ++n) {
      const FiveTets& five = patterns[(turn + n) & 1];
      for (std::size_t t = 0; t < 5; ++t) {
        for (std::size_t c = 0; c < 4; ++c) first[n][4 * t + c] = corner_of[five[t][c]] + static_cast<std::uint32_t>(n);
      }
    }
    auto* flat = out->data();
    for (int n = 0; n < length; ++n) {
      const std::uint32_t* const from = first[n & 1];
      const auto further = static_cast<std::uint32_t>(n & ~1);
      for (int c = 0; c < 20; ++c) flat[c] = from[c] + further;
      flat += 20;
    }
  }

  const VoxelBits& voxels_;
  int nx_, ny_, nz_;
  std::size_t words_;  // of a row of corners
  BigArray<std::uint64_t> used_;
  std::vector<std::uint64_t> first_point_, first_voxel_;  // by row
};

}  // namespace

TetMesh grid_tets(const VoxelBits& voxels, const Context& context) {
  const CornerLattice lattice(voxels, context);
  if (lattice.points() >= 0xffffffffULL)
    throw Error(ExitCode::resources, "the mesh would have more than 2^32 points", "choose larger voxels");
  context.check_cancelled();
  TetMesh mesh;
  mesh.points_mm.resize(lattice.points());
  mesh.tets.resize(lattice.voxels() * 5);
  lattice.fill(mesh, context);
  context.progress(1.0);
  return mesh;
}

}  // namespace osteo::inline geometry
