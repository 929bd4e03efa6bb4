#include "osteo/imaging/image/threshold.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "osteo/core/base/error.h"
#include "osteo/core/base/parallel.h"

namespace osteo::inline imaging {
namespace {

constexpr int kLow = -1024, kHigh = 4096;
using Histogram = std::vector<std::uint64_t>;  // one bin a HU, from kLow

Histogram& add(Histogram& a, const Histogram& b) {
  for (std::size_t i = 0; i < a.size(); ++i) a[i] += b[i];
  return a;
}

// Over all voxels that satisfy `wanted(index, i, j, k)`, in slices.
template <class F>
Histogram histogram_of(const Image& ct, int threads, F&& wanted) {
  const int nx = ct.frame.dims[0], ny = ct.frame.dims[1], nz = ct.frame.dims[2];
  std::vector<Histogram> parts(static_cast<std::size_t>(nz));
  parallel_for(static_cast<std::size_t>(nz), 1, threads, [&](std::size_t k, std::size_t) {
    Histogram h(kHigh - kLow);
    std::size_t at = k * static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny);
    for (int j = 0; j < ny; ++j) {
      for (int i = 0; i < nx; ++i, ++at) {
        if (wanted(at, i, j, static_cast<int>(k)))
          ++h[static_cast<std::size_t>(std::clamp<int>(ct.voxels[at], kLow, kHigh - 1) - kLow)];
      }
    }
    parts[k] = std::move(h);
  });
  Histogram all(kHigh - kLow);
  for (const Histogram& h : parts) add(all, h);
  return all;
}

double at_or_above(const Histogram& h, double hu) {
  double n = 0;
  for (int v = std::clamp(static_cast<int>(std::ceil(hu)), kLow, kHigh); v < kHigh; ++v)
    n += static_cast<double>(h[static_cast<std::size_t>(v - kLow)]);
  return n;
}

// The value that a share of the voxels between two values lies below.
double quantile(const Histogram& h, int lo, int hi, double share) {
  double total = 0, sum = 0;
  for (int v = lo; v < hi; ++v) total += static_cast<double>(h[static_cast<std::size_t>(v - kLow)]);
  for (int v = lo; v < hi; ++v) {
    sum += static_cast<double>(h[static_cast<std::size_t>(v - kLow)]);
    if (sum >= share * total) return v;
  }
  return hi;
}

}  // namespace

BoneGuide guide_threshold(const Image& ct, int threads) {
  const Histogram all = histogram_of(ct, threads, [](std::size_t, int, int, int) { return true; });
  BoneGuide g;

  // Soft tissue: the highest place, smoothed over 21 HU, that fat and bone are not.
  double best = 0;
  for (int c = -150; c <= 250; ++c) {
    double sum = 0;
    for (int v = c - 10; v <= c + 10; ++v) sum += static_cast<double>(all[static_cast<std::size_t>(v - kLow)]);
    if (sum > best) best = sum, g.soft_tissue_hu = c;
  }
  const double voxels = static_cast<double>(ct.frame.voxel_count());
  if (best < 1e-3 * voxels)
    throw Error(ExitCode::failed, "there is no soft tissue to go by: the values are no CT of a body",
                "give --lower by eye");
  // Its spread, from where it has fallen to 0.6065 of the peak, on the side where no partial volume of bone lies.
  const auto smooth = [&](int c) {
    double sum = 0;
    for (int v = c - 3; v <= c + 3; ++v)
      sum += static_cast<double>(all[static_cast<std::size_t>(std::clamp(v, kLow, kHigh - 1) - kLow)]);
    return sum;
  };
  const int peak = static_cast<int>(g.soft_tissue_hu);
  int below = peak;
  while (below > peak - 200 && smooth(below) > 0.6065 * smooth(peak)) --below;
  g.noise_hu = std::max(5.0, static_cast<double>(peak - below));

  // Dense bone: voxels all of whose face neighbours are bone as well, so that no edge takes part.
  const double provisional = std::max(g.soft_tissue_hu + 150, g.soft_tissue_hu + 4 * g.noise_hu);
  const int nx = ct.frame.dims[0], ny = ct.frame.dims[1], nz = ct.frame.dims[2];
  const std::size_t sy = static_cast<std::size_t>(nx), sz = sy * static_cast<std::size_t>(ny);
  const Histogram inside = histogram_of(ct, threads, [&](std::size_t at, int i, int j, int k) {
    if (ct.voxels[at] < provisional || i == 0 || j == 0 || k == 0 || i == nx - 1 || j == ny - 1 || k == nz - 1)
      return false;
    const auto* const p = ct.voxels.get() + at;
    return p[-1] >= provisional && p[1] >= provisional && p[-static_cast<std::ptrdiff_t>(sy)] >= provisional &&
           p[sy] >= provisional && p[-static_cast<std::ptrdiff_t>(sz)] >= provisional && p[sz] >= provisional;
  });
  const double count = at_or_above(inside, provisional);
  if (count * ct.frame.voxel_volume_mm3() < 50) {
    throw Error(
        ExitCode::failed,
        "there is no bone to go by: hardly a voxel lies above " + format_number(std::round(provisional)) + " HU",
        "see that the series is the right one, or give --lower by eye");
  }
  // Metal is no bone.
  g.dense_bone_hu = quantile(inside, static_cast<int>(provisional), 3000, 0.75);

  const double distance = g.dense_bone_hu - g.soft_tissue_hu, floor = g.soft_tissue_hu + 3.5 * g.noise_hu;
  constexpr std::array<std::pair<BonePreset, double>, 3> kShare{
      {{BonePreset::cortical, 0.5}, {BonePreset::cellular, 0.3}, {BonePreset::thin, 0.2}}};
  for (std::size_t n = 0; n < kShare.size(); ++n) {
    PresetGuide& p = g.presets[n];
    p.preset = kShare[n].first;
    p.lower_hu = std::round(std::max(g.soft_tissue_hu + kShare[n].second * distance, floor));
    const double volume = at_or_above(all, p.lower_hu);
    p.volume_mm3 = volume * ct.frame.voxel_volume_mm3();
    p.change_percent =
        50 * (at_or_above(all, p.lower_hu - 50) - at_or_above(all, p.lower_hu + 50)) / std::max(volume, 1.0);
  }
  const double apart = std::clamp(distance / (10 * g.noise_hu), 0.0, 1.0);
  g.confidence = apart * std::clamp(1.2 - g.presets[0].change_percent / 25, 0.0, 1.0);

  // A skull fills up to 45 cm2 of each slice on average, a pelvis 60, and no part of a body is bone almost alone: else
  // tissue passes for bone and air for tissue, as where the values lack their offset.
  constexpr double kMaxCm2 = 80, kMaxShare = 0.85;
  double height_mm = 0;
  for (std::size_t a = 0; a < 3; ++a)
    height_mm += std::abs(ct.frame.direction.column[a].z) * ct.frame.spacing_mm[a] * ct.frame.dims[a];
  const double cm2 = g.presets[0].volume_mm3 / std::max(height_mm, 1e-6) / 100;
  const double share =
      at_or_above(all, g.presets[0].lower_hu) / std::max(1.0, at_or_above(all, g.soft_tissue_hu - 150));
  if (cm2 > kMaxCm2 || share > kMaxShare) {
    g.confidence = 0;
    g.doubt = format_number(std::round(g.presets[0].volume_mm3 / 1000)) + " cm3 would be bone, " +
              (cm2 > kMaxCm2 ? format_number(std::round(cm2)) + " cm2 of each slice on average"
                             : format_number(std::round(100 * share)) + " % of all that is no air") +
              ": more than a body has; see whether the values are Hounsfield units";
  }
  return g;
}

}  // namespace osteo::inline imaging
