#include "field.h"

#include <algorithm>
#include <cmath>

#include "osteo/core/base/parallel.h"

namespace osteo::inline imaging::segment {

std::array<int, 3> Field::nearest(Vec3 world_mm) const {
  std::array<int, 3> p{};
  for (std::size_t a = 0; a < 3; ++a) {
    p[a] = std::clamp(static_cast<int>(std::lround((world_mm[a] - origin_mm[a]) / h_mm)), 0, n[a] - 1);
  }
  return p;
}

double Field::sample(Vec3 world_mm) const {
  std::array<int, 3> lo{}, hi{};
  std::array<double, 3> t{};
  for (std::size_t a = 0; a < 3; ++a) {
    const double x = std::clamp((world_mm[a] - origin_mm[a]) / h_mm, 0.0, n[a] - 1.0);
    lo[a] = std::min(static_cast<int>(x), n[a] - 1);
    hi[a] = std::min(lo[a] + 1, n[a] - 1);
    t[a] = x - lo[a];
  }
  const auto row = [&](int j, int k) {
    const double a = static_cast<double>(v[at(lo[0], j, k)]), b = static_cast<double>(v[at(hi[0], j, k)]);
    return a + (b - a) * t[0];
  };
  const double a = row(lo[1], lo[2]), b = row(hi[1], lo[2]), c = row(lo[1], hi[2]), d = row(hi[1], hi[2]);
  const double e = a + (b - a) * t[1], f = c + (d - c) * t[1];
  return e + (f - e) * t[2];
}

void bounds_of(const Frame& frame, Vec3& lo_mm, Vec3& hi_mm) {
  lo_mm = {1e30, 1e30, 1e30};
  hi_mm = {-1e30, -1e30, -1e30};
  for (int c = 0; c < 8; ++c) {
    const Vec3 p =
        frame.world_from_index({(c & 1) != 0 ? frame.dims[0] - 1.0 : 0.0, (c & 2) != 0 ? frame.dims[1] - 1.0 : 0.0,
                                (c & 4) != 0 ? frame.dims[2] - 1.0 : 0.0});
    for (std::size_t a = 0; a < 3; ++a) {
      lo_mm[a] = std::min(lo_mm[a], p[a]);
      hi_mm[a] = std::max(hi_mm[a], p[a]);
    }
  }
}

Sampler::Sampler(const Image& ct) : ct_(&ct), to_index_(inverse(ct.frame.direction)) {
  for (Vec3& c : to_index_.column) {
    c = {c.x / ct.frame.spacing_mm.x, c.y / ct.frame.spacing_mm.y, c.z / ct.frame.spacing_mm.z};
  }
}

double noise_of(const Image& ct) {
  // Where the scanner cut values off or a program padded, neighbours are equal: those say nothing.
  std::vector<std::uint64_t> count(256);
  std::uint64_t all = 0;
  const auto nx = static_cast<std::size_t>(ct.frame.dims[0]);
  const std::size_t n = ct.frame.voxel_count(), stride = n > 4'000'000 ? 5 : 1;
  for (std::size_t i = 1; i < n; i += stride) {
    if (i % nx == 0 || ct.voxels[i] <= -1020) continue;
    const int d = std::abs(ct.voxels[i] - ct.voxels[i - 1]);
    ++count[static_cast<std::size_t>(std::min(d, 255))];
    ++all;
  }
  std::uint64_t sum = 0;
  std::size_t d = 0;
  while (d < 255 && 5 * (sum + count[d]) < all) sum += count[d++];
  // Within the bin that the fifth falls into; its values are rounded.
  const double inside =
      count[d] > 0 ? (0.2 * static_cast<double>(all) - static_cast<double>(sum)) / static_cast<double>(count[d]) : 0;
  const double fifth = d == 0 ? 0.5 * inside : static_cast<double>(d) - 0.5 + inside;
  return fifth / 0.2533 / std::sqrt(2.0);
}

Field make_field(const Image& ct, Vec3 lo_mm, Vec3 hi_mm, double h_mm, int threads) {
  Vec3 lo, hi;
  bounds_of(ct.frame, lo, hi);
  Field f;
  f.h_mm = h_mm;
  // Steps from the CT's corner, so that voxels fall on voxels where they can.
  for (std::size_t a = 0; a < 3; ++a) {
    const double steps = std::ceil(std::max(0.0, lo_mm[a] - lo[a]) / h_mm - 1e-6);
    f.origin_mm[a] = lo[a] + steps * h_mm;
    f.n[a] = static_cast<int>(std::floor((std::min(hi[a], hi_mm[a]) - f.origin_mm[a]) / h_mm + 1e-6)) + 1;
    f.n[a] = std::max(f.n[a], 0);
  }
  f.v.resize(f.size());
  const Sampler sample(ct);
  const auto rows = static_cast<std::size_t>(f.n[1]) * static_cast<std::size_t>(f.n[2]);
  parallel_for(rows, 64, threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t r = begin; r < end; ++r) {
      const int j = static_cast<int>(r % static_cast<std::size_t>(f.n[1])),
                k = static_cast<int>(r / static_cast<std::size_t>(f.n[1]));
      for (int i = 0; i < f.n[0]; ++i) f.v[f.at(i, j, k)] = static_cast<float>(sample(f.world(i, j, k)));
    }
  });
  return f;
}

std::vector<float> smoothed(const std::vector<float>& v, std::array<int, 3> n, double sigma, int threads) {
  const int reach = std::max(1, static_cast<int>(std::ceil(3.5 * sigma)));
  std::vector<float> w(static_cast<std::size_t>(2 * reach + 1));
  double sum = 0;
  for (int i = -reach; i <= reach; ++i) sum += std::exp(-0.5 * i * i / (sigma * sigma));
  for (int i = -reach; i <= reach; ++i)
    w[static_cast<std::size_t>(i + reach)] = static_cast<float>(std::exp(-0.5 * i * i / (sigma * sigma)) / sum);
  const auto nx = static_cast<std::size_t>(n[0]), ny = static_cast<std::size_t>(n[1]),
             nz = static_cast<std::size_t>(n[2]);
  std::vector<float> a(v.size()), b(v.size());
  // Along x a row at a time; along y and z whole rows are added up, so that memory is read in order.
  parallel_for(ny * nz, 64, threads, [&](std::size_t begin, std::size_t end) {
    std::vector<float> line(nx + 2 * static_cast<std::size_t>(reach));
    for (std::size_t r = begin; r < end; ++r) {
      const float* const from = v.data() + r * nx;
      for (std::size_t i = 0; i < line.size(); ++i) {
        line[i] = from[static_cast<std::size_t>(std::clamp(static_cast<int>(i) - reach, 0, n[0] - 1))];
      }
      float* const to = a.data() + r * nx;
      for (std::size_t i = 0; i < nx; ++i) {
        float s = 0;
        for (std::size_t q = 0; q < w.size(); ++q) s += w[q] * line[i + q];
        to[i] = s;
      }
    }
  });
  const auto along = [&](const std::vector<float>& from, std::vector<float>& to, std::size_t axis) {
    parallel_for(ny * nz, 32, threads, [&](std::size_t begin, std::size_t end) {
      for (std::size_t r = begin; r < end; ++r) {
        const int j = static_cast<int>(r % ny), k = static_cast<int>(r / ny);
        float* const out = to.data() + r * nx;
        std::fill(out, out + nx, 0.0F);
        for (int q = -reach; q <= reach; ++q) {
          const int jj = axis == 1 ? std::clamp(j + q, 0, n[1] - 1) : j,
                    kk = axis == 2 ? std::clamp(k + q, 0, n[2] - 1) : k;
          const float* const in = from.data() + (static_cast<std::size_t>(kk) * ny + static_cast<std::size_t>(jj)) * nx;
          const float f = w[static_cast<std::size_t>(q + reach)];
          for (std::size_t i = 0; i < nx; ++i) out[i] += f * in[i];
        }
      }
    });
  };
  along(a, b, 1);
  along(b, a, 2);
  return a;
}

}  // namespace osteo::inline imaging::segment
