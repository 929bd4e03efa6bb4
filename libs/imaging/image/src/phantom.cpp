#include "osteo/imaging/image/phantom.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numbers>

#include "fibula_anatomy.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/parallel.h"

namespace osteo::inline imaging {
namespace {

// Noise that depends only on seed and voxel: splitmix64 and Box-Muller.
double gaussian(std::uint64_t seed, std::uint64_t voxel) {
  const auto mix = [](std::uint64_t z) {
    z += 0x9e3779b97f4a7c15ULL;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
    return z ^ (z >> 31);
  };
  const std::uint64_t a = mix(seed * 0x632be59bd9b4e019ULL + voxel), b = mix(a);
  const double u = (static_cast<double>(a >> 11) + 0.5) * 0x1p-53, v = (static_cast<double>(b >> 11) + 0.5) * 0x1p-53;
  return std::sqrt(-2 * std::log(u)) * std::cos(2 * std::numbers::pi * v);
}

void spread(std::vector<float>& v, const Frame& frame, std::size_t axis, int threads) {
  const auto nx = static_cast<std::size_t>(frame.dims[0]), ny = static_cast<std::size_t>(frame.dims[1]);
  const std::size_t stride = axis == 0 ? 1 : axis == 1 ? nx : nx * ny;
  const auto n = static_cast<std::size_t>(frame.dims[axis]);
  const std::size_t lines = v.size() / n;
  parallel_for(lines, 256, threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t l = begin; l < end; ++l) {
      float* const p = v.data() + (axis == 0 ? l * nx : axis == 1 ? (l / nx) * nx * ny + l % nx : l);
      float before = p[0];
      for (std::size_t i = 0; i < n; ++i) {
        const float here = p[i * stride], after = p[std::min(i + 1, n - 1) * stride];
        p[i * stride] = (before + 4 * here + after) / 6;
        before = here;
      }
    }
  });
}

constexpr double kBeyondFibulaMm = 10;

Frame phantom_frame(const PhantomParams& p, const FibulaAnatomy& fibula) {
  const double slice = p.slice_mm > 0 ? p.slice_mm : p.spacing_mm;
  Vec3 lo{-92, -124, -122}, hi{92, 106, 108};
  if (p.region == PhantomRegion::temporal) lo = {14, -30, -62}, hi = {86, 58, 12};
  if (p.region == PhantomRegion::mandible) lo = {-68, -108, -118}, hi = {68, 4, -6};
  if (p.region == PhantomRegion::fibula) {
    const double top = FibulaAnatomy::kTopMm + kBeyondFibulaMm,
                 bottom = FibulaAnatomy::kTopMm - fibula.length_mm() - kBeyondFibulaMm, x = FibulaAnatomy::kMiddleX,
                 around = FibulaAnatomy::kAroundMm;
    lo = {x - around, -around, bottom}, hi = {x + around, around, top};
  }
  Frame f;
  f.spacing_mm = {p.spacing_mm, p.spacing_mm, slice};
  f.origin_mm = lo;
  for (std::size_t a = 0; a < 3; ++a) f.dims[a] = static_cast<int>(std::floor((hi[a] - lo[a]) / f.spacing_mm[a])) + 1;
  return f;
}

constexpr int kBlock = 8;

// One voxel: the tissue at its centre and the mean over 27 points, of which those within the centre's margin are known.
struct VoxelMean {
  Tissue tissue;
  double hu = 0, bone = 0;
};
template <class Anatomy>
VoxelMean voxel_mean(const Anatomy& head, Vec3 centre, Vec3 spacing) {
  const HeadAnatomy::Sample s = head.sample(centre);
  VoxelMean v{s.tissue, tissue_hu(s.tissue), is_bone(s.tissue) ? 1.0 : 0.0};
  if (s.margin_mm >= 0.5 * length(spacing)) return v;
  v.hu = v.bone = 0;
  // A lattice of rank 1 about the centre: 27 levels along every axis, where a cubic one has three and leaves terraces
  // on surfaces.
  for (int n = 0; n < 27; ++n) {
    const Vec3 offset{(n - 13) * spacing.x / 27, ((8 * n + 17) % 27 - 13) * spacing.y / 27,
                      ((10 * n + 18) % 27 - 13) * spacing.z / 27};
    const Tissue t = length(offset) < s.margin_mm ? s.tissue : head.tissue(centre + offset);
    v.hu += tissue_hu(t) / 27;
    v.bone += is_bone(t) ? 1.0 / 27 : 0;
  }
  return v;
}

template <class Anatomy>
Phantom phantom_of(const Anatomy& head, const Frame& frame, const PhantomParams& p, const Context& context) {
  if (static_cast<double>(frame.voxel_count()) > 1e9) {
    throw Error(ExitCode::resources, "a phantom of this size has more than 10^9 voxels",
                "use --region temporal or a larger --spacing-mm");
  }
  const auto hu = make_voxels<std::int16_t>(frame.voxel_count());
  const auto labels = make_voxels<std::uint8_t>(frame.voxel_count());
  std::vector<float> means(frame.voxel_count());
  std::array<std::size_t, 3> n{}, blocks{};
  for (std::size_t a = 0; a < 3; ++a) {
    n[a] = static_cast<std::size_t>(frame.dims[a]);
    blocks[a] = (n[a] + kBlock - 1) / kBlock;
  }
  const std::size_t rows = blocks[1] * blocks[2];  // of blocks along x
  std::vector<double> bone(rows);
  std::atomic<std::size_t> rows_done{0};
  parallel_for(rows, 1, context.threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t row = begin; row < end; ++row) {
      context.check_cancelled();
      for (std::size_t bi = 0; bi < blocks[0]; ++bi) {
        const std::array<std::size_t, 3> lo{bi * kBlock, row % blocks[1] * kBlock, row / blocks[1] * kBlock};
        std::array<std::size_t, 3> hi{};
        Vec3 middle, half;
        for (std::size_t a = 0; a < 3; ++a) {
          hi[a] = std::min(lo[a] + kBlock, n[a]);
          middle[a] = 0.5 * static_cast<double>(lo[a] + hi[a] - 1);
          half[a] = 0.5 * static_cast<double>(hi[a] - lo[a]) * frame.spacing_mm[a];
        }
        const HeadAnatomy::Sample whole = head.sample(frame.world_from_index(middle));
        const bool uniform = whole.margin_mm > length(half);
        VoxelMean v{whole.tissue, tissue_hu(whole.tissue), is_bone(whole.tissue) ? 1.0 : 0.0};
        for (std::size_t k = lo[2]; k < hi[2]; ++k) {
          for (std::size_t j = lo[1]; j < hi[1]; ++j) {
            for (std::size_t i = lo[0]; i < hi[0]; ++i) {
              if (!uniform) {
                const Vec3 index{static_cast<double>(i), static_cast<double>(j), static_cast<double>(k)};
                v = voxel_mean(head, frame.world_from_index(index), frame.spacing_mm);
              }
              const std::size_t at = (k * n[1] + j) * n[0] + i;
              labels[at] = static_cast<std::uint8_t>(v.tissue);
              means[at] = static_cast<float>(v.hu);
              bone[row] += v.bone;
            }
          }
        }
      }
      context.progress(0.9 * static_cast<double>(++rows_done) / static_cast<double>(rows), "phantom");
    }
  });
  // The scanner: its point spread (1 4 1)/6 along each axis, then noise.
  for (std::size_t axis = 0; axis < 3; ++axis) spread(means, frame, axis, context.threads);
  parallel_for(means.size(), 1 << 16, context.threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t at = begin; at < end; ++at) {
      const double noise = p.noise_hu > 0 ? p.noise_hu * gaussian(context.seed, at) : 0;
      hu[at] =
          static_cast<std::int16_t>(std::clamp(std::lround(static_cast<double>(means[at]) + noise), -1024L, 3071L));
    }
  });
  Phantom result{{frame, hu}, {frame, labels}, 0};
  for (const double b : bone) result.bone_mm3 += b * frame.voxel_volume_mm3();
  context.report("bone_volume_mm3", result.bone_mm3);
  return result;
}

}  // namespace

Phantom make_phantom(const PhantomParams& p, const Context& context) {
  const auto individual = static_cast<std::uint64_t>(p.individual);
  const FibulaAnatomy fibula(individual);
  const Frame frame = phantom_frame(p, fibula);
  return p.region == PhantomRegion::fibula ? phantom_of(fibula, frame, p, context)
                                           : phantom_of(HeadAnatomy(individual), frame, p, context);
}

}  // namespace osteo::inline imaging
