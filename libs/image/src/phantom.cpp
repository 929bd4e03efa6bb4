#include "osteo/image/phantom.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "osteo/base/error.h"
#include "osteo/base/parallel.h"

namespace osteo {
namespace {

// Dimensions are round numbers near those of an adult head. All in mm, LPS, head centre at the origin.
// The HU of bone and of what lies around it put their mean near 500, so that one threshold finds unbiased boundaries.
constexpr std::array<double, kTissueCount> kHu{-1000, 40, 960, 960, 960, 1200, 60, 50, 2600};
constexpr std::array<std::string_view, kTissueCount> kNames{"air",     "soft tissue",  "cortical bone", "cellular bone", "mandible",
                                                            "ossicle", "facial nerve", "sigmoid sinus", "left marker"};

constexpr Vec3 kMastoid{57, 24, -26}, kMastoidRadii{15, 19, 24};
constexpr Vec3 kPetrous{34, 10, -20}, kPetrousRadii{27, 9, 10};
constexpr Vec3 kMiddleEar{42, 3, -19}, kMiddleEarRadii{4, 6, 7};
constexpr Vec3 kMarker{72, -8, 45};
constexpr double kCellPitch = 5.5, kCellRadius = 1.7;
constexpr double kMastoidCortex = 2.5;

// Left side; the right is its mirror image.
constexpr std::array<Vec3, 5> kNerve{Vec3{24, 4, -14}, {36, 2, -11}, {42, 12, -14}, {46, 17, -22}, {47, 16, -52}};
constexpr double kNerveRadius = 1.0, kNerveCanalWall = 1.0;
constexpr std::array<Vec3, 4> kSinus{Vec3{50, 52, -2}, {54, 40, -14}, {52, 36, -30}, {40, 30, -42}};
constexpr double kSinusRadius = 4.5, kSinusWall = 1.5;

double ellipsoid(Vec3 p, Vec3 c, Vec3 r) {  // < 1 inside
  const Vec3 d = p - c;
  return std::sqrt((d.x * d.x) / (r.x * r.x) + (d.y * d.y) / (r.y * r.y) + (d.z * d.z) / (r.z * r.z));
}

double segment_distance(Vec3 p, Vec3 a, Vec3 b) {
  const Vec3 ab = b - a;
  const double t = std::clamp(dot(p - a, ab) / dot(ab, ab), 0.0, 1.0);
  return length(p - (a + ab * t));
}

template <std::size_t N>
double polyline_distance(Vec3 p, const std::array<Vec3, N>& line) {
  double best = 1e30;
  for (std::size_t i = 0; i + 1 < N; ++i) best = std::min(best, segment_distance(p, line[i], line[i + 1]));
  return best;
}

bool in_ossicles(Vec3 p) {
  return segment_distance(p, {44, 2, -16}, {43, 2, -21}) < 0.9 ||  // malleus
         segment_distance(p, {44, 2, -16}, {42, 6, -16}) < 0.9 ||  // incus, body and short process
         segment_distance(p, {42, 6, -16}, {40, 4, -20}) < 0.8 ||  // long process to the stapes
         segment_distance(p, {40, 4, -20}, {38, 4, -20}) < 0.7;
}

bool in_air_cell(Vec3 p) {
  // Body-centred lattice of round cells: every wall has the same known thickness.
  for (int sub = 0; sub < 2; ++sub) {
    const double shift = sub == 0 ? 0.0 : kCellPitch / 2;
    Vec3 q;
    for (std::size_t a = 0; a < 3; ++a) {
      const double x = (p[a] - shift) / kCellPitch;
      q[a] = (x - std::round(x)) * kCellPitch;
    }
    if (length(q) < kCellRadius) return true;
  }
  return false;
}

// Temporal bone of one side, p mirrored to the left. Returns true when p belongs to it.
bool temporal_tissue(Vec3 p, Tissue& tissue) {
  if (p.x < 5 || p.y < -25 || p.y > 62 || p.z < -62 || p.z > 8) return false;
  const double mastoid = ellipsoid(p, kMastoid, kMastoidRadii);
  const double petrous = ellipsoid(p, kPetrous, kPetrousRadii);
  const double nerve = polyline_distance(p, kNerve), sinus = polyline_distance(p, kSinus);
  if (nerve < kNerveRadius) return tissue = Tissue::facial_nerve, true;
  if (sinus < kSinusRadius) return tissue = Tissue::sigmoid_sinus, true;
  if (in_ossicles(p)) return tissue = Tissue::ossicle, true;
  if (ellipsoid(p, kMiddleEar, kMiddleEarRadii) < 1) return tissue = Tissue::air, true;
  const bool ear_canal = p.x > 44 && std::hypot(p.y - 3, p.z + 19) < 3.5;
  if (ear_canal) return tissue = Tissue::air, true;
  const bool canal_wall = p.x > 44 && p.x < 66 && std::hypot(p.y - 3, p.z + 19) < 6;
  if (canal_wall || nerve < kNerveRadius + kNerveCanalWall) return tissue = Tissue::cortical, true;
  const bool sinus_wall = sinus < kSinusRadius + kSinusWall && (mastoid < 1.1 || petrous < 1.1);
  if (petrous < 1 || sinus_wall) return tissue = Tissue::cortical, true;
  if (mastoid < 1) {
    const double inner = ellipsoid(p, kMastoid, kMastoidRadii - Vec3{kMastoidCortex, kMastoidCortex, kMastoidCortex});
    if (inner >= 1) return tissue = Tissue::cortical, true;
    // A whole cell or none: cells that would break through the cortex are left solid.
    tissue = inner < 0.8 && in_air_cell(p) ? Tissue::air : Tissue::cellular;
    return true;
  }
  return false;
}

bool skull_tissue(Vec3 p, Tissue& tissue) {
  constexpr Vec3 centre{0, 5, 12}, outer{70, 88, 82};
  constexpr double thickness = 6.5;
  const double out = ellipsoid(p, centre, outer);
  if (out >= 1) return false;
  const double in = ellipsoid(p, centre, outer - Vec3{thickness, thickness, thickness});
  const bool orbit = length(p - Vec3{p.x > 0 ? 30.0 : -30.0, -80, 0}) < 20;
  const bool nose = std::abs(p.x) < 12 && p.y < -55 && p.z < -8 && p.z > -40;
  if (orbit || nose) return false;
  if (p.z > -34 && in >= 1) return tissue = Tissue::cortical, true;
  // Skull base with the foramen magnum.
  if (p.z > -40 && p.z <= -34 && std::hypot(p.x, p.y - 35) > 17) return tissue = Tissue::cortical, true;
  return false;
}

// Distance in the axial plane from an ellipse around (0, y0), to first order.
double arch_distance(Vec3 p, double rx, double y0, double ry) {
  const double u = p.x / rx, v = (p.y - y0) / ry, f = std::hypot(u, v);
  const double slope = std::hypot(u / rx, v / ry) / std::max(f, 1e-9);
  return std::abs(f - 1) / std::max(slope, 1e-9);
}

bool jaw_tissue(Vec3 p, Tissue& tissue) {
  // Body: a half ellipse open to the back; rami rise from its ends to below the skull base.
  if (p.y < 0 && p.z > -92 && p.z < -66 && arch_distance(p, 46, -5, 75) < 5.5) return tissue = Tissue::mandible, true;
  const double side = p.x > 0 ? 46 : -46;
  if (std::abs(p.x - side) < 4 && p.y > -12 && p.y < 12 && p.z > -92 && p.z < -48) return tissue = Tissue::mandible, true;
  // Upper jaw: a block of bone under the nose that carries the teeth.
  if (p.y < -25 && p.z > -62 && p.z < -38 && arch_distance(p, 34, -25, 52) < 7) return tissue = Tissue::cortical, true;
  return false;
}

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

Frame phantom_frame(const PhantomParams& p) {
  const double slice = p.slice_mm > 0 ? p.slice_mm : p.spacing_mm;
  const bool head = p.region == PhantomRegion::head;
  const Vec3 lo = head ? Vec3{-92, -108, -104} : Vec3{18, -14, -62};
  const Vec3 hi = head ? Vec3{92, 108, 108} : Vec3{90, 66, 12};
  Frame f;
  f.spacing_mm = {p.spacing_mm, p.spacing_mm, slice};
  f.origin_mm = lo;
  for (std::size_t a = 0; a < 3; ++a) f.dims[a] = static_cast<int>(std::floor((hi[a] - lo[a]) / f.spacing_mm[a])) + 1;
  return f;
}

}  // namespace

std::string_view tissue_name(Tissue tissue) {
  return kNames[static_cast<std::size_t>(tissue)];
}
double tissue_hu(Tissue tissue) {
  return kHu[static_cast<std::size_t>(tissue)];
}

Tissue phantom_tissue(Vec3 p) {
  Tissue tissue = Tissue::air;
  if (length(p - kMarker) < 5) return Tissue::left_marker;
  const bool face = p.z < -30 && std::hypot(p.x / 62, (p.y + 22) / 84) < 1;
  if (!face && ellipsoid(p, {0, 0, 5}, {84, 100, 98}) >= 1) return Tissue::air;
  if (temporal_tissue({std::abs(p.x), p.y, p.z}, tissue)) return tissue;
  if (skull_tissue(p, tissue)) return tissue;
  if (jaw_tissue(p, tissue)) return tissue;
  const bool airway = std::hypot(p.x / 8, (p.y + 30) / 10) < 1 && p.z < -42;
  return airway ? Tissue::air : Tissue::soft;
}

Phantom make_phantom(const PhantomParams& p, const Context& context) {
  const Frame frame = phantom_frame(p);
  if (static_cast<double>(frame.voxel_count()) > 1e9) {
    throw Error(ExitCode::resources, "a phantom of this size has more than 10^9 voxels", "use --region temporal or a larger --spacing-mm");
  }
  const int nx = frame.dims[0], ny = frame.dims[1], nz = frame.dims[2];
  const auto hu = make_voxels<std::int16_t>(frame.voxel_count());
  const auto labels = make_voxels<std::uint8_t>(frame.voxel_count());
  std::vector<float> means(frame.voxel_count());
  std::vector<double> bone_samples(static_cast<std::size_t>(nz));
  std::atomic<int> slices_done{0};
  parallel_for(static_cast<std::size_t>(nz), 1, context.threads, [&](std::size_t zb, std::size_t) {
    context.check_cancelled();
    const int k = static_cast<int>(zb);
    // Tissue at the corners of the voxels of this slice: a voxel whose corners and centre agree needs no more samples.
    std::vector<Tissue> corner(static_cast<std::size_t>(nx + 1) * static_cast<std::size_t>(ny + 1) * 2);
    const auto corner_at = [&](int i, int j, int s) -> Tissue& {
      return corner[(static_cast<std::size_t>(s) * static_cast<std::size_t>(ny + 1) + static_cast<std::size_t>(j)) *
                        static_cast<std::size_t>(nx + 1) +
                    static_cast<std::size_t>(i)];
    };
    for (int s = 0; s < 2; ++s) {
      for (int j = 0; j <= ny; ++j) {
        for (int i = 0; i <= nx; ++i) corner_at(i, j, s) = phantom_tissue(frame.world_from_index({i - 0.5, j - 0.5, k - 0.5 + s}));
      }
    }
    double bone = 0;
    for (int j = 0; j < ny; ++j) {
      for (int i = 0; i < nx; ++i) {
        const std::size_t at =
            (zb * static_cast<std::size_t>(ny) + static_cast<std::size_t>(j)) * static_cast<std::size_t>(nx) + static_cast<std::size_t>(i);
        const Vec3 centre = frame.world_from_index({double(i), double(j), double(k)});
        const Tissue t = phantom_tissue(centre);
        labels[at] = static_cast<std::uint8_t>(t);
        bool uniform = true;
        for (int c = 0; c < 8; ++c) uniform = uniform && corner_at(i + (c & 1), j + ((c >> 1) & 1), c >> 2) == t;
        // Fine structure may hide between the corners: always sample the temporal bones fully.
        const bool fine = std::abs(centre.x) > 18 && centre.z < 8 && centre.z > -62 && centre.y > -14 && centre.y < 62;
        double mean = tissue_hu(t), share = is_bone(t) ? 1 : 0;
        if (!uniform || fine) {
          mean = share = 0;
          for (int s = 0; s < 27; ++s) {
            const Tissue sample =
                phantom_tissue(frame.world_from_index({i + (s % 3 - 1) / 3.0, j + (s / 3 % 3 - 1) / 3.0, k + (s / 9 - 1) / 3.0}));
            mean += tissue_hu(sample) / 27;
            share += is_bone(sample) ? 1.0 / 27 : 0;
          }
        }
        bone += share;
        means[at] = static_cast<float>(mean);
      }
    }
    bone_samples[zb] = bone;
    context.progress(0.8 * ++slices_done / nz, "phantom");
  });
  // The scanner: its point spread (1 4 1)/6 along each axis, then noise.
  for (std::size_t axis = 0; axis < 3; ++axis) spread(means, frame, axis, context.threads);
  parallel_for(means.size(), 1 << 16, context.threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t at = begin; at < end; ++at) {
      const double noise = p.noise_hu > 0 ? p.noise_hu * gaussian(context.seed, at) : 0;
      hu[at] = static_cast<std::int16_t>(std::clamp(std::lround(static_cast<double>(means[at]) + noise), -1024L, 3071L));
    }
  });
  Phantom result{{frame, hu}, {frame, labels}, 0};
  for (const double b : bone_samples) result.bone_mm3 += b * frame.voxel_volume_mm3();
  context.report("bone_volume_mm3", result.bone_mm3);
  return result;
}

}  // namespace osteo
