#include "osteo/geometry/grid/resample.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include "osteo/core/base/error.h"
#include "osteo/core/base/parallel.h"
#include "osteo/geometry/grid/brick_grid.h"
#include "osteo/geometry/grid/vdb.h"
#include "outlines.h"

namespace osteo::inline geometry {
namespace {

constexpr int kEdge = BrickGrid::kEdge;
constexpr int kVoxels = BrickGrid::kVoxels;

// Just inside or outside, for voxels whose HU and mask disagree: half the contrast of a mid-grey voxel would move the
// boundary by much, one HU would put a fill's boundary on its voxel centres.
constexpr float kForcedHu = 100;

constexpr float kTrace = 1.0F / 256;
// Measured (docs/validation/accuracy.md): from here on outlines are the better in nearly every body, and of a real skull; in finer
// slices values are. And how much the field may grow over as far as slices lie apart: with less, ends of bodies suffer,
// with more, flat slopes.
constexpr double kThickSlices = 1.3, kThickMm = 1.5, kHuPerSlice = 200;
// A scan has voxels of every value between tissue and bone; a gap as wide as this is one of made, binned or two-level
// values.
constexpr int kOpenHu = 20;

// The thresholds that the mask looks most like: from the lowest to the highest at which the fewest voxels differ from
// it.
std::pair<int, int> lower_of_mask(const Image& ct, const Labels& mask) {
  constexpr int kLow = -32768, kCount = 65536;
  std::vector<std::int64_t> balance(kCount);  // of each value: voxels in the mask less voxels outside
  for (std::size_t i = 0; i < ct.frame.voxel_count(); ++i)
    balance[static_cast<std::size_t>(ct.voxels[i] - kLow)] += mask.voxels[i] != 0 ? 1 : -1;
  // Raising the threshold past a value loses its mask voxels and is rid of its others.
  std::int64_t wrong = 0, best = 0;
  int from = kLow, to = kLow;
  for (int v = 0; v + 1 < kCount; ++v) {
    wrong += balance[static_cast<std::size_t>(v)];
    if (wrong < best) {
      best = wrong;
      from = to = v + 1 + kLow;
    } else if (wrong == best && balance[static_cast<std::size_t>(v)] == 0 && to == v + kLow) {
      to = v + 1 + kLow;
    }
  }
  return {from, to};
}

// HU above the boundary, negative outside bone.
std::vector<float> signed_field(const Image& ct, const Labels& mask, double lower) {
  std::vector<float> field(ct.frame.voxel_count());
  for (std::size_t i = 0; i < field.size(); ++i) {
    const float d = static_cast<float>(ct.voxels[i]) - static_cast<float>(lower);
    field[i] = mask.voxels[i] != 0 ? (d >= 0 ? d : kForcedHu) : (d < 0 ? d : -kForcedHu);
  }
  return field;
}

// How the samples of the output lie between the samples of the CT along one axis: four taps of a cubic (Catmull-Rom)
// each. R. Keys, Cubic Convolution Interpolation for Digital Image Processing, IEEE TASSP 1981.
struct AxisMap {
  int sub = 1;                               // sub-voxels along an output voxel
  std::vector<int> first;                    // CT index of the first tap; may lie outside, where the border repeats
  std::vector<std::array<float, 4>> weight;  // of the value
  std::vector<std::array<float, 4>> slope;   // of the change across the sub-voxel
};

AxisMap make_axis(int ct_dim, double ct_spacing, int out_first, int out_dim, double out_spacing) {
  AxisMap m;
  m.sub = std::max(1, static_cast<int>(std::ceil(out_spacing / ct_spacing - 1e-6)));
  const double h = out_spacing / m.sub;
  for (int s = 0; s < out_dim * m.sub; ++s) {
    const double x =
        std::clamp((-0.5 * ct_spacing + (out_first * m.sub + s + 0.5) * h) / ct_spacing, -0.5, ct_dim - 0.5);
    const int i = static_cast<int>(std::floor(x));
    const double t = x - i, per_mm = h / ct_spacing;
    m.first.push_back(i - 1);
    m.weight.push_back(
        {static_cast<float>(t * (-0.5 + t * (1 - 0.5 * t))), static_cast<float>(1 + t * t * (1.5 * t - 2.5)),
         static_cast<float>(t * (0.5 + t * (2 - 1.5 * t))), static_cast<float>(t * t * (0.5 * t - 0.5))});
    m.slope.push_back(
        {static_cast<float>(per_mm * (-0.5 + t * (2 - 1.5 * t))), static_cast<float>(per_mm * t * (4.5 * t - 5)),
         static_cast<float>(per_mm * (0.5 + t * (4 - 4.5 * t))), static_cast<float>(per_mm * t * (1.5 * t - 1))});
  }
  return m;
}

// Memory for one brick's samples, kept between bricks.
struct Scratch {
  std::vector<float> ct, x, dx, y, dy, xy;
};

class Resampler {
 public:
  Resampler(const Image& ct, const std::vector<float>& field, const ResampleParams& p)
      : ct_(ct), field_(field), h_(p.spacing_mm) {
    frame_.direction = ct.frame.direction;
    frame_.spacing_mm = {h_, h_, h_};
    Vec3 first;
    for (std::size_t a = 0; a < 3; ++a) {
      const double extent = ct.frame.dims[a] * ct.frame.spacing_mm[a];
      frame_.dims[a] = std::max(1, static_cast<int>(std::ceil(extent / h_ - 1e-6)));
    }
    if (boxed(p)) take_box(p);
    for (std::size_t a = 0; a < 3; ++a) {
      axis_[a] = make_axis(ct.frame.dims[a], ct.frame.spacing_mm[a], first_[a], frame_.dims[a], h_);
      first[a] = -0.5 + (0.5 + first_[a]) * h_ / ct.frame.spacing_mm[a];
    }
    frame_.origin_mm = ct.frame.world_from_index(first);
    find_occupied_blocks();
    find_bricks();
  }

  [[nodiscard]] const Frame& frame() const { return frame_; }
  [[nodiscard]] const std::vector<Ijk>& bricks() const { return bricks_; }

  // Calls take(voxel in brick, signed HU, HU of a full ramp across the sub-voxel, weight) for each sub-voxel of a
  // brick. Separable: first along x for the CT rows that the brick needs, then along y, then along z.
  template <class F>
  void sample_brick(Ijk brick, Scratch& scratch, F&& take) const {
    const std::array<int, 3> b{brick.i, brick.j, brick.k};
    std::array<std::size_t, 3> begin{}, count{};  // samples of the brick along each axis
    std::array<int, 3> lo{}, n{};                 // CT voxels they need
    for (std::size_t a = 0; a < 3; ++a) {
      begin[a] = static_cast<std::size_t>(b[a] * kEdge * axis_[a].sub);
      count[a] = static_cast<std::size_t>(std::min(kEdge, frame_.dims[a] - b[a] * kEdge) * axis_[a].sub);
      lo[a] = axis_[a].first[begin[a]];
      n[a] = axis_[a].first[begin[a] + count[a] - 1] + 4 - lo[a];
    }
    const auto nx = static_cast<std::size_t>(n[0]), ny = static_cast<std::size_t>(n[1]),
               nz = static_cast<std::size_t>(n[2]);
    const auto inside = [&](std::size_t a, int i) {
      return static_cast<std::size_t>(std::clamp(i, 0, ct_.frame.dims[a] - 1));
    };
    scratch.ct.resize(nx * ny * nz);
    for (std::size_t k = 0; k < nz; ++k) {
      for (std::size_t j = 0; j < ny; ++j) {
        const float* const row =
            field_.data() + (inside(2, lo[2] + static_cast<int>(k)) * static_cast<std::size_t>(ct_.frame.dims[1]) +
                             inside(1, lo[1] + static_cast<int>(j))) *
                                static_cast<std::size_t>(ct_.frame.dims[0]);
        for (std::size_t i = 0; i < nx; ++i)
          scratch.ct[(k * ny + j) * nx + i] = row[inside(0, lo[0] + static_cast<int>(i))];
      }
    }
    scratch.x.resize(count[0] * ny * nz);
    scratch.dx.resize(scratch.x.size());
    for (std::size_t row = 0; row < ny * nz; ++row) {
      for (std::size_t i = 0; i < count[0]; ++i) {
        const float* const p =
            scratch.ct.data() + row * nx + static_cast<std::size_t>(axis_[0].first[begin[0] + i] - lo[0]);
        const auto &w = axis_[0].weight[begin[0] + i], &d = axis_[0].slope[begin[0] + i];
        scratch.x[row * count[0] + i] = p[0] * w[0] + p[1] * w[1] + p[2] * w[2] + p[3] * w[3];
        scratch.dx[row * count[0] + i] = p[0] * d[0] + p[1] * d[1] + p[2] * d[2] + p[3] * d[3];
      }
    }
    const std::size_t plane = count[0] * count[1];
    for (auto* v : {&scratch.y, &scratch.dy, &scratch.xy}) v->resize(plane * nz);
    for (std::size_t k = 0; k < nz; ++k) {
      for (std::size_t j = 0; j < count[1]; ++j) {
        const std::size_t from = (k * ny + static_cast<std::size_t>(axis_[1].first[begin[1] + j] - lo[1])) * count[0];
        const auto &w = axis_[1].weight[begin[1] + j], &d = axis_[1].slope[begin[1] + j];
        for (std::size_t i = 0; i < count[0]; ++i) {
          const float *const p = scratch.x.data() + from + i, *const q = scratch.dx.data() + from + i;
          const std::size_t at = k * plane + j * count[0] + i;
          const std::size_t s1 = count[0], s2 = 2 * s1, s3 = 3 * s1;
          scratch.y[at] = p[0] * w[0] + p[s1] * w[1] + p[s2] * w[2] + p[s3] * w[3];
          scratch.dy[at] = p[0] * d[0] + p[s1] * d[1] + p[s2] * d[2] + p[s3] * d[3];
          scratch.xy[at] = q[0] * w[0] + q[s1] * w[1] + q[s2] * w[2] + q[s3] * w[3];
        }
      }
    }
    const float share = 1.0F / static_cast<float>(axis_[0].sub * axis_[1].sub * axis_[2].sub);
    for (std::size_t k = 0; k < count[2]; ++k) {
      const std::size_t from = static_cast<std::size_t>(axis_[2].first[begin[2] + k] - lo[2]) * plane;
      const auto &w = axis_[2].weight[begin[2] + k], &d = axis_[2].slope[begin[2] + k];
      const auto along_z = [&](const std::vector<float>& v, std::size_t at, const std::array<float, 4>& c) {
        const float* const p = v.data() + from + at;
        return p[0] * c[0] + p[plane] * c[1] + p[2 * plane] * c[2] + p[3 * plane] * c[3];
      };
      for (std::size_t j = 0; j < count[1]; ++j) {
        for (std::size_t i = 0; i < count[0]; ++i) {
          const std::size_t at = j * count[0] + i;
          const float value = along_z(scratch.y, at, w);
          const float gx = along_z(scratch.xy, at, w), gy = along_z(scratch.dy, at, w), gz = along_z(scratch.y, at, d);
          // A plane cuts a cube over a width between the 2-norm and the 1-norm of this change.
          const float ramp =
              0.5F * (std::sqrt(gx * gx + gy * gy + gz * gz) + std::abs(gx) + std::abs(gy) + std::abs(gz));
          take(BrickGrid::offset_in_brick(static_cast<int>(i) / axis_[0].sub, static_cast<int>(j) / axis_[1].sub,
                                          static_cast<int>(k) / axis_[2].sub),
               value, std::max(ramp, 1e-3F), share);
        }
      }
    }
  }

  // HU at the centre of an output voxel.
  [[nodiscard]] float hu_at(Ijk brick, std::uint32_t voxel) const {
    const int v[3] = {brick.i * 8 + static_cast<int>(voxel & 7), brick.j * 8 + static_cast<int>(voxel >> 3 & 7),
                      brick.k * 8 + static_cast<int>(voxel >> 6)};
    Vec3 index;
    for (std::size_t a = 0; a < 3; ++a) {
      const double spacing = ct_.frame.spacing_mm[a];
      index[a] = (-0.5 * spacing + (first_[a] + v[a] + 0.5) * h_) / spacing;
    }
    return static_cast<float>(std::floor(sample_linear(ct_, index) + 0.5));
  }

  [[nodiscard]] static bool boxed(const ResampleParams& p) {
    return p.box_mm[0] > 0 && p.box_mm[1] > 0 && p.box_mm[2] > 0;
  }

 private:
  static constexpr int kBlock = 4;

  // The box in output voxels, between faces that both grids have.
  void take_box(const ResampleParams& p) {
    int step = 0;
    for (int n = 1; n <= 64 && step == 0; ++n) {
      const double fine = n * p.align_mm / h_;
      if (std::abs(fine - std::round(fine)) < 1e-6) step = static_cast<int>(std::lround(fine));
    }
    if (step == 0)
      throw Error(ExitCode::usage,
                  "no whole number of voxels of " + format_number(h_) + " mm fills voxels of " +
                      format_number(p.align_mm) + " mm",
                  "choose a --spacing-mm like 0.1, 0.125, 0.2 or 0.25");
    const Vec3 centre = ct_.frame.index_from_world({p.centre_mm[0], p.centre_mm[1], p.centre_mm[2]});
    for (std::size_t a = 0; a < 3; ++a) {
      const double middle = (centre[a] + 0.5) * ct_.frame.spacing_mm[a] / h_, half = p.box_mm[a] / h_ / 2;
      const int lo = static_cast<int>(std::floor((middle - half) / step + 1e-6)) * step,
                hi = static_cast<int>(std::ceil((middle + half) / step - 1e-6)) * step;
      first_[a] = std::max(lo, 0);
      const int end = std::min(hi, frame_.dims[a] / step * step);
      if (end <= first_[a])
        throw Error(ExitCode::usage, "the box does not lie in the image", "give --centre-mm in LPS mm, within the CT");
      frame_.dims[a] = end - first_[a];
    }
  }

  void find_occupied_blocks() {
    for (std::size_t a = 0; a < 3; ++a) blocks_[a] = (ct_.frame.dims[a] + kBlock - 1) / kBlock;
    occupied_.assign(static_cast<std::size_t>(blocks_[0]) * static_cast<std::size_t>(blocks_[1]) *
                         static_cast<std::size_t>(blocks_[2]),
                     0);
    std::size_t at = 0;
    for (int k = 0; k < ct_.frame.dims[2]; ++k) {
      for (int j = 0; j < ct_.frame.dims[1]; ++j) {
        std::uint8_t* const row =
            occupied_.data() + (static_cast<std::size_t>(k / kBlock) * static_cast<std::size_t>(blocks_[1]) +
                                static_cast<std::size_t>(j / kBlock)) *
                                   static_cast<std::size_t>(blocks_[0]);
        for (int i = 0; i < ct_.frame.dims[0]; ++i, ++at) {
          if (field_[at] > -kForcedHu) row[i / kBlock] = 1;
        }
      }
    }
  }

  void find_bricks() {
    std::array<int, 3> n{};
    for (std::size_t a = 0; a < 3; ++a) n[a] = (frame_.dims[a] + kEdge - 1) / kEdge;
    const auto range = [&](std::size_t a, int b) {
      const auto& m = axis_[a];
      const int last = std::min((b + 1) * kEdge, frame_.dims[a]) * m.sub - 1, top = ct_.frame.dims[a] - 1;
      return std::pair{std::clamp(m.first[static_cast<std::size_t>(b * kEdge * m.sub)], 0, top) / kBlock,
                       std::clamp(m.first[static_cast<std::size_t>(last)] + 3, 0, top) / kBlock};
    };
    for (int k = 0; k < n[2]; ++k) {
      for (int j = 0; j < n[1]; ++j) {
        for (int i = 0; i < n[0]; ++i) {
          const auto [x0, x1] = range(0, i);
          const auto [y0, y1] = range(1, j);
          const auto [z0, z1] = range(2, k);
          bool any = false;
          for (int z = z0; z <= z1 && !any; ++z) {
            for (int y = y0; y <= y1 && !any; ++y) {
              for (int x = x0; x <= x1 && !any; ++x) {
                any = occupied_[(static_cast<std::size_t>(z) * static_cast<std::size_t>(blocks_[1]) +
                                 static_cast<std::size_t>(y)) *
                                    static_cast<std::size_t>(blocks_[0]) +
                                static_cast<std::size_t>(x)] != 0;
              }
            }
          }
          if (any) bricks_.push_back({i, j, k});
          if (too_many_bricks(bricks_.size()))
            throw Error(ExitCode::resources,
                        "voxels of " + format_number(h_) + " mm make more than " +
                            std::to_string(BrickGrid::kMaxBricks) +
                            " bricks of 8^3 that may hold bone, which is all that can be numbered",
                        "choose a larger --spacing-mm, or a smaller region");
        }
      }
    }
  }

  const Image& ct_;
  const std::vector<float>& field_;
  double h_;
  Frame frame_;
  std::array<AxisMap, 3> axis_;
  std::array<int, 3> first_{};  // of the output grid, counted from where a grid of all begins
  std::array<int, 3> blocks_{};
  std::vector<std::uint8_t> occupied_;
  std::vector<Ijk> bricks_;
};

// Share of a sub-voxel inside, for a boundary that lies `offset` HU above the threshold.
float coverage(float value, float ramp, float offset) {
  return std::clamp(0.5F + (value - offset) / ramp, 0.0F, 1.0F);
}

// Volume for a row of offsets at once, summed in brick order.
constexpr std::array<float, 9> kOffsets{-100, -50, -25, -10, 0, 10, 25, 50, 100};

double find_offset(const Resampler& resampler, double wanted_mm3, const Context& context, double& at_zero_mm3) {
  const auto& bricks = resampler.bricks();
  std::vector<std::array<double, kOffsets.size()>> volumes(bricks.size());
  parallel_for(bricks.size(), 64, context.threads, [&](std::size_t begin, std::size_t end) {
    context.check_cancelled();
    Scratch scratch;
    for (std::size_t b = begin; b < end; ++b) {
      auto& v = volumes[b];
      v.fill(0);
      resampler.sample_brick(bricks[b], scratch, [&](std::uint32_t, float value, float ramp, float weight) {
        if (value - kOffsets.front() < -0.5F * ramp) return;
        if (value - kOffsets.back() > 0.5F * ramp) {  // deep within bone, as most of it
          for (double& sum : v) sum += static_cast<double>(weight);
          return;
        }
        for (std::size_t o = 0; o < kOffsets.size(); ++o)
          v[o] += static_cast<double>(weight * coverage(value, ramp, kOffsets[o]));
      });
    }
  });
  const double voxel = resampler.frame().voxel_volume_mm3();
  std::array<double, kOffsets.size()> total{};
  for (const auto& v : volumes) {
    for (std::size_t o = 0; o < total.size(); ++o) total[o] += v[o] * voxel;
  }
  at_zero_mm3 = total[4];
  for (std::size_t o = 0; o + 1 < total.size(); ++o) {
    if (wanted_mm3 <= total[o] && wanted_mm3 >= total[o + 1]) {
      const double t = (total[o] - wanted_mm3) / std::max(total[o] - total[o + 1], 1e-12);
      return static_cast<double>(kOffsets[o]) + t * static_cast<double>(kOffsets[o + 1] - kOffsets[o]);
    }
  }
  return wanted_mm3 > total[0] ? static_cast<double>(kOffsets.front()) : static_cast<double>(kOffsets.back());
}

// `lower` of the parameters, or what the mask says of it where they leave that open.
double lower_for(const Image& ct, const Labels& mask, double asked, const Context& context) {
  if (asked != 0) return asked;
  const auto [from, to] = lower_of_mask(ct, mask);
  // Where no value lies in between, half way is where blur would have put the boundary.
  const bool open = to - from > kOpenHu;
  const double lower = open ? (from + to) / 2 : to;
  if (open) {
    context.warn("every threshold from " + format_number(from) + " to " + format_number(to) +
                 " HU gives this mask: the boundary of bone is put half way, at " + format_number(lower) +
                 " HU; 'resample --lower' puts it elsewhere");
  }
  return lower;
}

void require_not_too_wide(const Frame& frame, double spacing_mm) {
  std::array<std::uint64_t, 3> cells{};
  for (std::size_t a = 0; a < 3; ++a)
    cells[a] =
        static_cast<std::uint64_t>(std::ceil(frame.dims[a] * frame.spacing_mm[a] / spacing_mm / BrickGrid::kEdge));
  if (too_wide_for_bricks(cells)) {
    throw Error(ExitCode::resources,
                "voxels of " + format_number(spacing_mm) + " mm make a grid of more than " +
                    std::to_string(BrickGrid::kMaxCells) + " bricks of 8^3",
                "choose a larger --spacing-mm, or a smaller region");
  }
}

// The field whose zero is the boundary of bone, between slices as asked.
std::vector<float> boundary_field(const Image& ct, const Labels& mask, const ResampleParams& p,
                                  const Context& context) {
  std::vector<float> field = signed_field(ct, mask, p.lower);
  const grid::SliceAxis slices = grid::slice_axis(ct.frame);
  const bool outlines =
      p.between == Between::outlines ||
      (p.between == Between::automatic && slices.ratio > kThickSlices && ct.frame.spacing_mm[slices.axis] >= kThickMm);
  if (outlines)
    grid::limit_by_outlines(field, ct.frame, slices.axis, kHuPerSlice / ct.frame.spacing_mm[slices.axis], context);
  context.report("between_slices", std::string(outlines ? "outlines" : "values"));
  return field;
}

// Of each brick; null where there is no bone.
struct Sampled {
  std::vector<std::unique_ptr<float[]>> densities, hu;
};

Sampled sample(const Resampler& resampler, float offset, const Context& context) {
  const auto& bricks = resampler.bricks();
  Sampled s;
  s.densities.resize(bricks.size());
  s.hu.resize(bricks.size());
  parallel_for(bricks.size(), 64, context.threads, [&](std::size_t begin, std::size_t end) {
    context.check_cancelled();
    Scratch scratch;
    for (std::size_t b = begin; b < end; ++b) {
      std::array<float, kVoxels> d{};
      resampler.sample_brick(bricks[b], scratch, [&](std::uint32_t v, float value, float ramp, float weight) {
        d[v] += weight * coverage(value, ramp, offset);
      });
      // Traces are not worth a brick, nor is what a trace lacks to solid bone.
      for (float& x : d) x = x < kTrace ? 0 : x > 1 - kTrace ? 1 : x;
      if (std::none_of(d.begin(), d.end(), [](float x) { return x > 0; })) continue;
      s.densities[b] = std::make_unique_for_overwrite<float[]>(kVoxels);
      s.hu[b] = std::make_unique<float[]>(kVoxels);
      for (std::uint32_t v = 0; v < kVoxels; ++v) {
        s.densities[b][v] = d[v];
        if (d[v] > 0) s.hu[b][v] = resampler.hu_at(bricks[b], v);
      }
    }
  });
  return s;
}

// Fills density, hu and the volume afterwards.
void write_grids(const Resampler& resampler, Sampled sampled, ResampledBone& result) {
  grid::initialize_vdb();
  auto density = openvdb::FloatGrid::create(0.0F);
  auto hu = openvdb::FloatGrid::create(-1024.0F);
  double total = 0;
  const auto& bricks = resampler.bricks();
  for (std::size_t b = 0; b < bricks.size(); ++b) {
    auto &densities = sampled.densities[b], &values = sampled.hu[b];
    if (!densities) continue;
    const openvdb::Coord origin(bricks[b].i * kEdge, bricks[b].j * kEdge, bricks[b].k * kEdge);
    auto* const density_leaf = density->tree().touchLeaf(origin);
    auto* const hu_leaf = hu->tree().touchLeaf(origin);
    for (std::uint32_t v = 0; v < kVoxels; ++v) {
      if (densities[v] <= 0) continue;
      const openvdb::Coord c =
          origin.offsetBy(static_cast<int>(v & 7), static_cast<int>(v >> 3 & 7), static_cast<int>(v >> 6));
      density_leaf->setValueOn(c, densities[v]);
      hu_leaf->setValueOn(c, values[v]);
      total += static_cast<double>(densities[v]);
    }
    densities.reset();
    values.reset();
  }
  hu->setSaveFloatAsHalf(true);
  result.volume_after_mm3 = total * resampler.frame().voxel_volume_mm3();
  result.density = grid::wrap(density, resampler.frame(), "density");
  result.hu = grid::wrap(hu, resampler.frame(), "hu");
}

void report_volume(const ResampledBone& result, const ResampleParams& p, double unshifted_mm3, float offset,
                   const Context& context) {
  const bool boxed = Resampler::boxed(p);
  const double change = boxed ? 0 : 100 * (result.volume_after_mm3 / result.volume_before_mm3 - 1);
  context.report("volume_before_mm3", result.volume_before_mm3);
  context.report("volume_after_mm3", result.volume_after_mm3);
  if (!boxed) context.report("volume_change_percent", change);
  context.report("volume_change_unshifted_percent", 100 * (unshifted_mm3 / result.volume_before_mm3 - 1));
  context.report("boundary_offset_hu", static_cast<double>(offset));
  context.report("bone_voxels", static_cast<std::int64_t>(result.density.active_voxels));
  context.report("grid_memory_mb", static_cast<double>(result.density.memory_bytes) / 1e6);
  if (std::abs(change) > 1) {
    const bool far = std::abs(offset) >= kOffsets.back();
    context.warn("the volume of bone changed by " + format_number(std::round(change * 100) / 100) + " %: " +
                 (far ? "a boundary at " + format_number(p.lower) + " HU is far from half way between tissue and bone"
                      : "the bone is thinner than the voxels of " + format_number(p.spacing_mm) + " mm can hold"));
  }
}

}  // namespace

ResampledBone resample_bone(const Image& ct, const Labels& mask, const ResampleParams& given, const Context& context) {
  if (!same_place(ct.frame, mask.frame)) {
    throw Error(ExitCode::usage, "the mask does not lie on the voxels of the CT",
                "make the mask from this CT with 'osteo threshold'");
  }
  ResampleParams p = given;
  p.lower = lower_for(ct, mask, given.lower, context);
  context.report("lower_hu", p.lower);
  require_not_too_wide(ct.frame, p.spacing_mm);
  ResampledBone result;
  result.volume_before_mm3 =
      static_cast<double>(std::count_if(mask.span().begin(), mask.span().end(), [](auto v) { return v != 0; })) *
      ct.frame.voxel_volume_mm3();
  const std::vector<float> field = boundary_field(ct, mask, p, context);
  const Resampler resampler(ct, field, p);
  context.progress(0.1, "boundary");
  // Of a box the boundary is shifted as of the whole.
  double unshifted = 0;
  ResampleParams whole = p;
  whole.spacing_mm = p.align_mm;
  whole.box_mm = {0, 0, 0};
  const auto all = Resampler::boxed(p) ? std::make_unique<const Resampler>(ct, field, whole) : nullptr;
  const auto offset =
      static_cast<float>(find_offset(all ? *all : resampler, result.volume_before_mm3, context, unshifted));
  context.progress(0.5, "voxels");
  Sampled sampled = sample(resampler, offset, context);
  context.progress(0.8, "sparse grid");
  write_grids(resampler, std::move(sampled), result);
  report_volume(result, p, unshifted, offset, context);
  context.progress(1.0);
  return result;
}

}  // namespace osteo::inline geometry
