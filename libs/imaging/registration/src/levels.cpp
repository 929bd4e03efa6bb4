#include "levels.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "osteo/core/base/parallel.h"

namespace osteo::inline imaging::registration {
namespace {

constexpr double kCoarsestMm = 8;
constexpr double kMaxVoxels = 4e7;

// Of one output voxel along an axis: the input voxels it is the weighted mean of.
struct Taps {
  int first = 0;
  std::vector<float> weight;
};

std::vector<Taps> make_taps(int n, double spacing, int out_n, double h) {
  std::vector<Taps> taps;
  const int points = std::max(1, 2 * static_cast<int>(std::ceil(h / spacing - 1e-6)));
  for (int o = 0; o < out_n; ++o) {
    std::vector<double> w(static_cast<std::size_t>(n));
    int lo = n, hi = -1;
    for (int p = 0; p < points; ++p) {
      const double x = std::clamp((-0.5 * spacing + (o + (p + 0.5) / points) * h) / spacing, 0.0, n - 1.0);
      const int i = std::min(static_cast<int>(x), std::max(0, n - 2));
      const double t = x - i;
      w[static_cast<std::size_t>(i)] += (1 - t) / points;
      lo = std::min(lo, i);
      hi = std::max(hi, i);
      if (t > 0) {
        w[static_cast<std::size_t>(i) + 1] += t / points;
        hi = std::max(hi, i + 1);
      }
    }
    Taps t{lo, {}};
    for (int i = lo; i <= hi; ++i) t.weight.push_back(static_cast<float>(w[static_cast<std::size_t>(i)]));
    taps.push_back(std::move(t));
  }
  return taps;
}

Level finest(const Image& image, double h, const Context& context) {
  Level out;
  const Frame& f = image.frame;
  out.frame.direction = f.direction;
  out.frame.spacing_mm = {h, h, h};
  Vec3 first;
  std::array<std::vector<Taps>, 3> taps;
  for (std::size_t a = 0; a < 3; ++a) {
    const double spacing = f.spacing_mm[a];
    out.frame.dims[a] = std::max(1, static_cast<int>(std::floor(f.dims[a] * spacing / h + 1e-6)));
    taps[a] = make_taps(f.dims[a], spacing, out.frame.dims[a], h);
    first[a] = (-0.5 * spacing + 0.5 * h) / spacing;
  }
  out.frame.origin_mm = f.world_from_index(first);
  const auto nx = static_cast<std::size_t>(f.dims[0]), ny = static_cast<std::size_t>(f.dims[1]);
  const auto ox = static_cast<std::size_t>(out.frame.dims[0]), oy = static_cast<std::size_t>(out.frame.dims[1]),
             oz = static_cast<std::size_t>(out.frame.dims[2]);
  out.values.resize(ox * oy * oz);
  parallel_for(oz, 1, context.threads, [&](std::size_t begin, std::size_t end) {
    std::vector<float> plane(nx * ny), wide(ox * ny);
    for (std::size_t k = begin; k < end; ++k) {
      context.check_cancelled();
      std::fill(plane.begin(), plane.end(), 0.0F);
      const Taps& tz = taps[2][k];
      for (std::size_t t = 0; t < tz.weight.size(); ++t) {
        const std::int16_t* const p = image.voxels.get() + (static_cast<std::size_t>(tz.first) + t) * nx * ny;
        for (std::size_t i = 0; i < nx * ny; ++i) plane[i] += tz.weight[t] * static_cast<float>(p[i]);
      }
      for (std::size_t j = 0; j < ny; ++j) {
        for (std::size_t i = 0; i < ox; ++i) {
          const Taps& tx = taps[0][i];
          float sum = 0;
          for (std::size_t t = 0; t < tx.weight.size(); ++t)
            sum += tx.weight[t] * plane[j * nx + static_cast<std::size_t>(tx.first) + t];
          wide[j * ox + i] = sum;
        }
      }
      for (std::size_t j = 0; j < oy; ++j) {
        const Taps& ty = taps[1][j];
        float* const row = out.values.data() + (k * oy + j) * ox;
        std::fill_n(row, ox, 0.0F);
        for (std::size_t t = 0; t < ty.weight.size(); ++t) {
          const float* const p = wide.data() + (static_cast<std::size_t>(ty.first) + t) * ox;
          for (std::size_t i = 0; i < ox; ++i) row[i] += ty.weight[t] * p[i];
        }
      }
    }
  });
  return out;
}

Level halved(const Level& in) {
  Level out;
  out.frame = in.frame;
  for (std::size_t a = 0; a < 3; ++a) {
    out.frame.dims[a] = (in.frame.dims[a] + 1) / 2;
    out.frame.spacing_mm[a] *= 2;
  }
  out.frame.origin_mm = in.frame.world_from_index({0.5, 0.5, 0.5});
  out.values.resize(out.frame.voxel_count());
  std::size_t at = 0;
  for (int k = 0; k < out.frame.dims[2]; ++k)
    for (int j = 0; j < out.frame.dims[1]; ++j)
      for (int i = 0; i < out.frame.dims[0]; ++i, ++at) {
        float sum = 0;
        for (int c = 0; c < 8; ++c)
          sum += in.at(std::min(2 * i + (c & 1), in.frame.dims[0] - 1),
                       std::min(2 * j + (c >> 1 & 1), in.frame.dims[1] - 1),
                       std::min(2 * k + (c >> 2), in.frame.dims[2] - 1));
        out.values[at] = sum / 8;
      }
  return out;
}

}  // namespace

double finest_of(const Frame& a, const Frame& b, double wanted_mm) {
  for (const Frame* f : {&a, &b})
    wanted_mm = std::max({wanted_mm, std::min({f->spacing_mm.x, f->spacing_mm.y, f->spacing_mm.z}), wanted_mm,
                          std::cbrt(f->voxel_volume_mm3() * static_cast<double>(f->voxel_count()) / kMaxVoxels)});
  return wanted_mm;
}

Levels make_levels(const Image& image, double finest_mm, const Context& context) {
  Levels out;
  out.levels.push_back(finest(image, finest_mm, context));
  while (out.levels.back().frame.spacing_mm.x < kCoarsestMm) out.levels.push_back(halved(out.levels.back()));
  std::vector<float> some;
  const auto& v = out.levels.front().values;
  for (std::size_t i = 0; i < v.size(); i += std::max<std::size_t>(1, v.size() / 400000)) some.push_back(v[i]);
  std::sort(some.begin(), some.end());
  out.lo = some[some.size() / 200];
  out.hi = std::max(some[some.size() - 1 - some.size() / 500], out.lo + 1);
  return out;
}

IndexMap index_map(const Frame& to, const RigidTransform& to_from, Vec3 centre_mm) {
  IndexMap m;
  const Mat3 back = inverse(to.direction);
  const Vec3 shift = back * (to_from(centre_mm) - to.origin_mm);
  for (std::size_t c = 0; c < 3; ++c) {
    const Vec3 column = back * to_from.rotation.column[c];
    for (std::size_t r = 0; r < 3; ++r) m.row[r][c] = static_cast<float>(column[r] / to.spacing_mm[r]);
    m.shift[c] = static_cast<float>(shift[c] / to.spacing_mm[c]);
  }
  return m;
}

}  // namespace osteo::inline imaging::registration
