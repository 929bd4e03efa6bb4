#include "osteo/geometry/distance/binary_distance.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "osteo/core/base/error.h"
#include "osteo/core/base/parallel.h"

namespace osteo::inline geometry {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

// Along a row the nearest voxel of the mask is the last one before or the first one after.
void transform_row(const std::uint8_t* mask, std::uint8_t value, float* d, int n, double h) {
  int last = -1;
  for (int i = 0; i < n; ++i) {
    if (mask[i] == value) last = i;
    d[i] = last < 0 ? kInfinity : static_cast<float>(i - last);
  }
  int next = -1;
  for (int i = n - 1; i >= 0; --i) {
    if (mask[i] == value) next = i;
    const float steps = next < 0 ? d[i] : std::min(d[i], static_cast<float>(next - i));
    d[i] = steps == kInfinity ? kInfinity
                              : static_cast<float>((static_cast<double>(steps) * h) * (static_cast<double>(steps) * h));
  }
}

struct Parabola {
  double value;  // f / h^2 + i^2
  double from;   // lowest from here on
  int site;
};

// Lower envelope of the parabolas f[i] + (h (x - i))^2; f is replaced by the envelope. `lower` has room for n.
void transform_line(float* f, int n, double h, Parabola* lower) {
  const double scale = 1 / (h * h);
  int count = 0;
  for (int i = 0; i < n; ++i) {
    if (f[i] == kInfinity) continue;
    const double v = static_cast<double>(f[i]) * scale + static_cast<double>(i) * i;
    double start = -std::numeric_limits<double>::infinity();
    while (count > 0) {
      const Parabola& p = lower[count - 1];
      start = (v - p.value) / (2.0 * (i - p.site));
      if (start > p.from) break;
      --count;
      start = -std::numeric_limits<double>::infinity();
    }
    lower[count++] = {v, start, i};
  }
  if (count == 0) return;
  for (int x = 0, k = 0; x < n; ++x) {
    while (k + 1 < count && lower[k + 1].from < x) ++k;
    const Parabola& p = lower[k];
    const double d = x - p.site;
    f[x] = static_cast<float>((p.value - static_cast<double>(p.site) * p.site + d * d) * h * h);
  }
}

// Lines along a strided axis, a handful at a time: rows of memory are read whole, and turned into lines in the cache.
constexpr std::size_t kTogether = 32;

void transform_lines(float* f, std::size_t stride, int n, double h, std::size_t lines, std::vector<float>& turned,
                     std::vector<Parabola>& lower) {
  const auto length = static_cast<std::size_t>(n);
  turned.resize(length * kTogether);
  lower.resize(length);
  bool any = false, settled = true;
  for (std::size_t i = 0; i < length; ++i) {
    const float* const row = f + i * stride;
    for (std::size_t l = 0; l < lines; ++l) {
      turned[l * length + i] = row[l];
      any |= row[l] != kInfinity;
      settled &= row[l] == 0;
    }
  }
  if (!any || settled) return;
  for (std::size_t l = 0; l < lines; ++l) transform_line(turned.data() + l * length, n, h, lower.data());
  for (std::size_t i = 0; i < length; ++i) {
    float* const row = f + i * stride;
    for (std::size_t l = 0; l < lines; ++l) row[l] = turned[l * length + i];
  }
}

}  // namespace

std::vector<float> squared_distance_mm2(std::span<const std::uint8_t> mask, const Frame& frame, std::uint8_t value,
                                        const Context& context) {
  std::vector<float> d(mask.size());
  const auto nx = static_cast<std::size_t>(frame.dims[0]);
  const auto ny = static_cast<std::size_t>(frame.dims[1]);
  const auto nz = static_cast<std::size_t>(frame.dims[2]);
  const std::size_t strips = (nx + kTogether - 1) / kTogether;
  // Rows and columns of one slice while it is in the cache.
  parallel_for(nz, 1, context.threads, [&](std::size_t begin, std::size_t end) {
    std::vector<float> turned;
    std::vector<Parabola> lower;
    for (std::size_t k = begin; k < end; ++k) {
      context.check_cancelled();
      float* const slice = d.data() + k * nx * ny;
      for (std::size_t j = 0; j < ny; ++j) {
        transform_row(mask.data() + k * nx * ny + j * nx, value, slice + j * nx, frame.dims[0], frame.spacing_mm.x);
      }
      for (std::size_t s = 0; s < strips; ++s) {
        transform_lines(slice + s * kTogether, nx, frame.dims[1], frame.spacing_mm.y,
                        std::min(kTogether, nx - s * kTogether), turned, lower);
      }
    }
  });
  parallel_for(ny, 1, context.threads, [&](std::size_t begin, std::size_t end) {
    std::vector<float> turned;
    std::vector<Parabola> lower;
    for (std::size_t j = begin; j < end; ++j) {
      context.check_cancelled();
      for (std::size_t s = 0; s < strips; ++s) {
        transform_lines(d.data() + j * nx + s * kTogether, nx * ny, frame.dims[2], frame.spacing_mm.z,
                        std::min(kTogether, nx - s * kTogether), turned, lower);
      }
    }
  });
  return d;
}

std::vector<float> squared_distance_within_mm2(std::span<const std::uint8_t> mask, const Frame& frame,
                                               std::uint8_t value, double within_mm, const Context& context) {
  if (!(within_mm > 0) || !std::isfinite(within_mm))
    throw Error(ExitCode::usage, "a distance to look within is positive and finite");
  std::vector<float> d(mask.size());
  const auto nx = static_cast<std::size_t>(frame.dims[0]);
  const auto ny = static_cast<std::size_t>(frame.dims[1]);
  const auto nz = static_cast<std::size_t>(frame.dims[2]);
  const double most = within_mm * within_mm * (1 + 1e-6);
  // Rows `stride` apart from f, each `width` wide, become the least of those beside them; in strips that stay in the
  // cache.
  const auto transform_rows = [&](float* f, std::size_t stride, std::size_t n, std::size_t width, double h,
                                  std::vector<float>& before) {
    const auto window = static_cast<std::size_t>(std::floor(std::sqrt(most) / h));
    if (window == 0) return;
    before.resize(n * width);
    std::vector<std::uint8_t> any(n);
    for (std::size_t i = 0; i < n; ++i) {
      std::copy_n(f + i * stride, width, before.data() + i * width);
      any[i] = std::any_of(f + i * stride, f + i * stride + width, [](float v) { return v != kInfinity; });
    }
    for (std::size_t i = 0; i < n; ++i) {
      float* const out = f + i * stride;
      for (std::size_t from = i - std::min(i, window); from < std::min(n, i + window + 1); ++from) {
        if (any[from] == 0 || from == i) continue;
        const double steps = (static_cast<double>(from) - static_cast<double>(i)) * h;
        const auto more = static_cast<float>(steps * steps);
        const float* const in = before.data() + from * width;
        for (std::size_t x = 0; x < width; ++x) out[x] = std::min(out[x], in[x] + more);
      }
    }
  };
  parallel_for(nz, 1, context.threads, [&](std::size_t begin, std::size_t end) {
    std::vector<float> before;
    for (std::size_t k = begin; k < end; ++k) {
      context.check_cancelled();
      float* const slice = d.data() + k * nx * ny;
      for (std::size_t j = 0; j < ny; ++j)
        transform_row(mask.data() + k * nx * ny + j * nx, value, slice + j * nx, frame.dims[0], frame.spacing_mm.x);
      for (std::size_t v = 0; v < nx * ny; ++v) slice[v] = slice[v] <= most ? slice[v] : kInfinity;
      transform_rows(slice, nx, ny, nx, frame.spacing_mm.y, before);
    }
  });
  parallel_for(ny, 1, context.threads, [&](std::size_t begin, std::size_t end) {
    std::vector<float> before;
    for (std::size_t j = begin; j < end; ++j) {
      context.check_cancelled();
      float* const rows = d.data() + j * nx;
      transform_rows(rows, nx * ny, nz, nx, frame.spacing_mm.z, before);
      for (std::size_t k = 0; k < nz; ++k) {
        float* const row = rows + k * nx * ny;
        for (std::size_t x = 0; x < nx; ++x) row[x] = row[x] <= most ? row[x] : kInfinity;
      }
    }
  });
  return d;
}

}  // namespace osteo::inline geometry
