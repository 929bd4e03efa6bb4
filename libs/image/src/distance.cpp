#include "osteo/image/distance.h"

#include <cmath>
#include <limits>

#include "osteo/base/parallel.h"

namespace osteo {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

// Lower envelope of the parabolas f[i] + (h (x - i))^2 along one line; f is replaced by the envelope.
void transform_line(float* f, std::size_t stride, int n, double h, std::vector<double>& value, std::vector<int>& site,
                    std::vector<double>& from) {
  int count = 0;
  for (int i = 0; i < n; ++i) {
    const float fi = f[static_cast<std::size_t>(i) * stride];
    if (fi == kInfinity) continue;
    const double v = static_cast<double>(fi) / (h * h);
    double start = -std::numeric_limits<double>::infinity();
    while (count > 0) {
      const int j = site[static_cast<std::size_t>(count - 1)];
      const double vj = value[static_cast<std::size_t>(count - 1)];
      start = ((v + static_cast<double>(i) * i) - (vj + static_cast<double>(j) * j)) / (2.0 * (i - j));
      if (start > from[static_cast<std::size_t>(count - 1)]) break;
      --count;
      start = -std::numeric_limits<double>::infinity();
    }
    const auto c = static_cast<std::size_t>(count++);
    site[c] = i;
    value[c] = v;
    from[c] = start;
  }
  if (count == 0) return;
  for (int x = 0, k = 0; x < n; ++x) {
    while (k + 1 < count && from[static_cast<std::size_t>(k + 1)] < x) ++k;
    const double d = x - site[static_cast<std::size_t>(k)];
    f[static_cast<std::size_t>(x) * stride] = static_cast<float>((value[static_cast<std::size_t>(k)] + d * d) * h * h);
  }
}

}  // namespace

std::vector<float> squared_distance_mm2(std::span<const std::uint8_t> mask, const Frame& frame, std::uint8_t value,
                                        const Context& context) {
  std::vector<float> d(mask.size());
  for (std::size_t i = 0; i < d.size(); ++i) d[i] = mask[i] == value ? 0.0F : kInfinity;
  const auto nx = static_cast<std::size_t>(frame.dims[0]);
  const auto ny = static_cast<std::size_t>(frame.dims[1]);
  const auto nz = static_cast<std::size_t>(frame.dims[2]);
  const auto run_axis = [&](std::size_t axis, std::size_t lines, auto start_of_line, std::size_t stride) {
    context.check_cancelled();
    const int n = frame.dims[axis];
    parallel_for(lines, 256, context.threads, [&](std::size_t begin, std::size_t end) {
      std::vector<double> v(static_cast<std::size_t>(n)), from(static_cast<std::size_t>(n));
      std::vector<int> site(static_cast<std::size_t>(n));
      for (std::size_t l = begin; l < end; ++l) {
        transform_line(d.data() + start_of_line(l), stride, n, frame.spacing_mm[axis], v, site, from);
      }
    });
  };
  run_axis(
      0, ny * nz, [&](std::size_t l) { return l * nx; }, 1);
  run_axis(
      1, nx * nz, [&](std::size_t l) { return (l / nx) * nx * ny + l % nx; }, nx);
  run_axis(
      2, nx * ny, [&](std::size_t l) { return l; }, nx * ny);
  return d;
}

}  // namespace osteo
