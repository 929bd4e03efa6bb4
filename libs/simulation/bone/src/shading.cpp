#include "osteo/simulation/bone/detail/shading.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "osteo/core/base/parallel.h"
#include "osteo/core/base/portable_math.h"

namespace osteo::inline simulation {
namespace {

constexpr double kNarrowVoxels = 1;
// How much the share of bone below a face, and the height of its step, may differ from those of a flat one.
constexpr float kFlat = 0.05F, kNotFlat = 0.08F, kWholeStep = 0.85F;
// Below this height of the narrow kernel's step the triangles know better.
constexpr float kStepSeen = 0.25F, kStepSure = 0.5F;

float smooth_step(float from, float to, float x) {
  const float t = std::clamp((x - from) / (to - from), 0.0F, 1.0F);
  return t * t * (3 - 2 * t);
}

struct Sight {
  std::array<float, 3> gradient{};  // for a mm
  float value = 0;
};

std::array<float, 3> unit(const std::array<float, 3>& v, float length) {
  return {v[0] / length, v[1] / length, v[2] / length};
}
float length_of(const std::array<float, 3>& v) {
  return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

// Where a brick's wide view is made: nodes from -1 to `cells` of each axis, whose gradients are then interpolated; it
// takes cells from -1 - radius to cells + radius.
struct WideGrid {
  int cells, radius;  // along a brick's edge; of the kernel
  [[nodiscard]] int nodes() const { return cells + 2; }
  [[nodiscard]] int side() const { return nodes() + 2 * radius; }
};

// The cells that the brick at `at` takes, x fastest; `all` brick after brick.
void gather_cells(const BrickGrid& bone, const std::vector<float>& all, Ijk at, const WideGrid& grid,
                  std::vector<float>& block) {
  const int m = grid.cells, r = grid.radius, side = grid.side();
  block.assign(static_cast<std::size_t>(side * side * side), 0.0F);
  // Brick by brick, what of it lies in the block.
  const int lo = -1 - r, hi = m + r;
  const auto brick_of = [&](int cell) { return (cell + 64 * m) / m - 64; };
  for (int bk = brick_of(lo); bk <= brick_of(hi); ++bk) {
    for (int bj = brick_of(lo); bj <= brick_of(hi); ++bj) {
      for (int bi = brick_of(lo); bi <= brick_of(hi); ++bi) {
        const std::uint32_t other = bone.find_brick(at.i + bi, at.j + bj, at.k + bk);
        if (other == BrickGrid::kNone) continue;
        const float* const from = all.data() + static_cast<std::size_t>(other) * static_cast<std::size_t>(m * m * m);
        for (int k = std::max(lo, bk * m); k <= std::min(hi, bk * m + m - 1); ++k) {
          for (int j = std::max(lo, bj * m); j <= std::min(hi, bj * m + m - 1); ++j) {
            const int i0 = std::max(lo, bi * m), i1 = std::min(hi, bi * m + m - 1);
            const float* const row = from + ((k - bk * m) * m + j - bj * m) * m - bi * m;
            std::copy(row + i0, row + i1 + 1,
                      &block[static_cast<std::size_t>(((k - lo) * side + j - lo) * side + i0 - lo)]);
          }
        }
      }
    }
  }
}

// A kernel along one axis: `nodes` results from each of `outer` slabs, each a run of `inner` values.
struct Pass {
  int nodes, stride;               // from a value to the next along the axis
  int outer, outer_in, outer_out;  // slabs, and from one to the next
  int inner, out_stride;
  void operator()(const std::vector<float>& in, std::vector<float>& out, const std::vector<float>& taps) const {
    for (int o = 0; o < outer; ++o) {
      for (int n = 0; n < nodes; ++n) {
        float* const to = &out[static_cast<std::size_t>(o * outer_out + n * out_stride)];
        const float* const source = &in[static_cast<std::size_t>(o * outer_in + n * stride)];
        std::fill_n(to, inner, 0.0F);
        for (std::size_t t = 0; t < taps.size(); ++t) {
          const float w = taps[t];
          const float* const s = source + static_cast<int>(t) * stride;
          for (int x = 0; x < inner; ++x) to[x] += w * s[x];
        }
      }
    }
  }
};

// Value and gradient at each node. Separable: along z, then y, then x. Of the four that are wanted (value and three
// slopes) each pass makes what the next ones need.
void see_wide(const std::vector<float>& block, const std::vector<float>& value, const std::vector<float>& slope,
              const WideGrid& grid, std::vector<Sight>& sight) {
  const int nodes = grid.nodes(), side = grid.side(), plane = side * side, small = nodes * side;
  thread_local std::vector<float> zv, zs, yvv, ysv, yvs;
  zv.resize(static_cast<std::size_t>(nodes * plane));
  zs.resize(zv.size());
  const Pass along_z{nodes, plane, 1, 0, 0, plane, plane};
  along_z(block, zv, value);
  along_z(block, zs, slope);
  yvv.resize(static_cast<std::size_t>(nodes * small));
  ysv.resize(yvv.size());
  yvs.resize(yvv.size());
  const Pass along_y{nodes, side, nodes, plane, small, side, side};
  along_y(zv, yvv, value);
  along_y(zv, ysv, slope);
  along_y(zs, yvs, value);
  sight.assign(static_cast<std::size_t>(nodes * nodes * nodes), {});
  for (int row = 0; row < nodes * nodes; ++row) {
    const auto from = static_cast<std::size_t>(row * side);
    for (int n = 0; n < nodes; ++n) {
      Sight& s = sight[static_cast<std::size_t>(row * nodes + n)];
      for (std::size_t t = 0; t < value.size(); ++t) {
        const std::size_t x = from + static_cast<std::size_t>(n) + t;
        s.value += value[t] * yvv[x];
        s.gradient[0] += slope[t] * yvv[x];
        s.gradient[1] += value[t] * ysv[x];
        s.gradient[2] += value[t] * yvs[x];
      }
    }
  }
}

// Between the nodes; `place` in voxels from the brick's first, `cells_a_voxel` along an edge.
Sight between_nodes(const std::vector<Sight>& sight, int nodes, const std::array<float, 3>& place,
                    float cells_a_voxel) {
  std::array<int, 3> n{};
  std::array<float, 3> f{};
  for (std::size_t x = 0; x < 3; ++x) {
    const float u = std::clamp((place[x] + 0.5F) * cells_a_voxel + 0.5F, 0.0F, static_cast<float>(nodes) - 1.001F);
    n[x] = static_cast<int>(u);
    f[x] = u - static_cast<float>(n[x]);
  }
  Sight s;
  for (int corner = 0; corner < 8; ++corner) {
    const int di = corner & 1, dj = corner >> 1 & 1, dk = corner >> 2;
    const float w = (di != 0 ? f[0] : 1 - f[0]) * (dj != 0 ? f[1] : 1 - f[1]) * (dk != 0 ? f[2] : 1 - f[2]);
    const Sight& q = sight[static_cast<std::size_t>(((n[2] + dk) * nodes + n[1] + dj) * nodes + n[0] + di)];
    s.value += w * q.value;
    for (std::size_t x = 0; x < 3; ++x) s.gradient[x] += w * q.gradient[x];
  }
  return s;
}

// Voxels around a brick, read only when a vertex is not flat.
class NarrowView {
 public:
  // `memory` is its own while it lives.
  NarrowView(const BrickGrid& bone, const std::array<int, 3>& origin, int radius, double voxel_mm,
             std::vector<float>& memory)
      : bone_(bone),
        origin_(origin),
        radius_(radius),
        fine_(8 + 2 * (radius + 2)),
        voxel_mm_(voxel_mm),
        voxels_(memory) {}

  // Around the voxel that is nearest to the place, by kernels moved to it.
  std::array<float, 3> gradient_at(const std::array<float, 3>& place) {
    read();
    std::array<std::array<float, 16>, 3> value{}, slope{};
    std::array<int, 3> first{};
    const int taps = 2 * radius_ + 1;
    for (std::size_t x = 0; x < 3; ++x) first[x] = kernel_at(place[x], value[x], slope[x]);
    std::array<float, 3> g{};
    for (int k = 0; k < taps; ++k) {
      for (int j = 0; j < taps; ++j) {
        const float* const row =
            &voxels_[static_cast<std::size_t>(((first[2] + k) * fine_ + first[1] + j) * fine_ + first[0])];
        float along = 0, slopes = 0;
        for (int i = 0; i < taps; ++i) {
          along += value[0][static_cast<std::size_t>(i)] * row[i];
          slopes += slope[0][static_cast<std::size_t>(i)] * row[i];
        }
        const auto kk = static_cast<std::size_t>(k), jj = static_cast<std::size_t>(j);
        g[0] += value[2][kk] * value[1][jj] * slopes;
        g[1] += value[2][kk] * slope[1][jj] * along;
        g[2] += slope[2][kk] * value[1][jj] * along;
      }
    }
    return g;
  }

 private:
  void read() {
    if (have_) return;
    voxels_.resize(static_cast<std::size_t>(fine_ * fine_ * fine_));
    bone_.read_block({origin_[0] - radius_ - 2, origin_[1] - radius_ - 2, origin_[2] - radius_ - 2},
                     {fine_, fine_, fine_}, voxels_.data());
    have_ = true;
  }
  // Returns the first voxel that it takes.
  int kernel_at(float u, std::array<float, 16>& value, std::array<float, 16>& slope) const {
    const int taps = 2 * radius_ + 1;
    const int nearest = std::clamp(static_cast<int>(std::floor(u + 0.5F)), -2, 9);
    float sum = 0, moment = 0;
    for (int t = 0; t < taps; ++t) {
      const float d = static_cast<float>(nearest - radius_ + t) - u;
      const auto g =
          static_cast<float>(portable::exp(-0.5 * static_cast<double>(d * d) / (kNarrowVoxels * kNarrowVoxels)));
      value[static_cast<std::size_t>(t)] = g;
      slope[static_cast<std::size_t>(t)] = d * g;
      sum += g;
      moment += d * d * g;
    }
    for (int t = 0; t < taps; ++t) {
      value[static_cast<std::size_t>(t)] /= sum;
      slope[static_cast<std::size_t>(t)] /= moment * static_cast<float>(voxel_mm_);
    }
    return nearest + 2;
  }

  const BrickGrid& bone_;
  std::array<int, 3> origin_;
  int radius_, fine_;
  double voxel_mm_;
  bool have_ = false;
  std::vector<float>& voxels_;
};

}  // namespace

ShadingField::Kernel ShadingField::kernel_of(double sigma_mm, double cell_mm) {
  Kernel k;
  const double sigma = sigma_mm / cell_mm;
  k.radius = static_cast<int>(std::ceil(2.75 * sigma));
  double sum = 0, moment = 0;
  for (int i = -k.radius; i <= k.radius; ++i) {
    const double g = portable::exp(-0.5 * i * i / (sigma * sigma));
    k.value.push_back(static_cast<float>(g));
    k.slope.push_back(static_cast<float>(i * g));
    sum += g;
    moment += i * i * g;
  }
  // So that a constant has value 1 and a ramp its slope.
  for (float& v : k.value) v /= static_cast<float>(sum);
  for (float& v : k.slope) v /= static_cast<float>(moment * cell_mm);
  return k;
}

ShadingField::ShadingField(const BrickGrid& bone, int threads) : bone_(&bone) {
  const Vec3 s = bone.frame().spacing_mm;
  voxel_mm_ = portable::cbrt(s.x * s.y * s.z);
  edge_ = 1;
  while (edge_ < 8 && edge_ * voxel_mm_ * std::numbers::sqrt2 < kWideMm) edge_ *= 2;
  per_brick_ = 8 / edge_;
  wide_ = kernel_of(kWideMm, edge_ * voxel_mm_);
  narrow_ = kernel_of(kNarrowVoxels * voxel_mm_, voxel_mm_);
  const int reach = std::max((wide_.radius + 2) * edge_, narrow_.radius + 2);
  reach_bricks_ = (reach + 7) / 8;
  const auto n = static_cast<std::size_t>(per_brick_);
  cells_.resize(bone.brick_count() * n * n * n);
  parallel_for(bone.brick_count(), 256, threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t b = begin; b < end; ++b) sum_cells(static_cast<std::uint32_t>(b));
  });
}

void ShadingField::renew(std::uint32_t brick) {
  sum_cells(brick);
}

void ShadingField::sum_cells(std::uint32_t brick) {
  const auto n = static_cast<std::size_t>(per_brick_);
  float* const cells = cells_.data() + brick * n * n * n;
  std::fill_n(cells, n * n * n, 0.0F);
  const VoxelKey first = brick * static_cast<VoxelKey>(BrickGrid::kVoxels);
  const auto e = static_cast<std::uint32_t>(edge_);
  for (std::uint32_t v = 0; v < BrickGrid::kVoxels; ++v)
    cells[((v >> 6) / e * n + (v >> 3 & 7) / e) * n + (v & 7) / e] += bone_->value(first + v);
  const float share = 1 / static_cast<float>(edge_ * edge_ * edge_);
  for (std::size_t c = 0; c < n * n * n; ++c) cells[c] *= share;
}

void ShadingField::shade(std::uint32_t brick, SurfacePatch& patch) const {
  if (patch.vertices.empty()) return;
  const Ijk at = bone_->brick_coordinate(brick);
  const WideGrid grid{per_brick_, wide_.radius};
  thread_local std::vector<float> block;
  gather_cells(*bone_, cells_, at, grid, block);
  thread_local std::vector<Sight> sight;
  see_wide(block, wide_.value, wide_.slope, grid, sight);
  const float whole_wide = static_cast<float>(kWideMm * std::sqrt(2 * std::numbers::pi));
  const float whole_narrow = static_cast<float>(kNarrowVoxels * voxel_mm_ * std::sqrt(2 * std::numbers::pi));
  const float scale = 1 / static_cast<float>(edge_);
  const std::array<int, 3> origin{at.i * 8, at.j * 8, at.k * 8};
  thread_local std::vector<float> voxels;
  NarrowView narrow(*bone_, origin, narrow_.radius, voxel_mm_, voxels);
  for (SurfacePatch::Vertex& v : patch.vertices) {
    std::array<float, 3> place{};
    for (std::size_t x = 0; x < 3; ++x) place[x] = v.index[x] - static_cast<float>(origin[x]);
    const Sight s = between_nodes(sight, grid.nodes(), place, scale);
    const float height = length_of(s.gradient), step = height * whole_wide;
    const float bent = std::abs(s.value - 0.5F) + std::max(0.0F, kWholeStep - step);
    const float flat = height > 0 ? 1 - smooth_step(kFlat, kNotFlat, bent) : 0;
    std::array<float, 3> normal{};
    if (flat > 0) {
      const auto u = unit(s.gradient, -height);
      for (std::size_t x = 0; x < 3; ++x) normal[x] = flat * u[x];
    }
    if (flat < 1) {
      const std::array<float, 3> g = narrow.gradient_at(place);
      const float tall = length_of(g);
      const float seen = tall > 0 ? smooth_step(kStepSeen, kStepSure, tall * whole_narrow) : 0;
      for (std::size_t x = 0; x < 3; ++x)
        normal[x] += (1 - flat) * ((seen > 0 ? seen * -g[x] / tall : 0) + (1 - seen) * v.normal[x]);
    }
    const float size = length_of(normal);
    // Never against the triangles: a wall's other side.
    if (size > 0.1F && normal[0] * v.normal[0] + normal[1] * v.normal[1] + normal[2] * v.normal[2] > 0)
      v.normal = unit(normal, size);
  }
}

}  // namespace osteo::inline simulation
