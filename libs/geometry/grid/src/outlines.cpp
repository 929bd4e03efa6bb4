#include "outlines.h"

#include <algorithm>
#include <cmath>

#include "osteo/core/base/parallel.h"

namespace osteo::inline geometry::grid {
namespace {

// A slice of the field: pixels `su` and `sv` values apart, `hu` and `hv` mm apart.
struct Slice {
  float* field;
  int nu, nv;
  std::size_t su, sv;
  float hu, hv;
  [[nodiscard]] float at(int u, int v) const {
    return field[static_cast<std::size_t>(u) * su + static_cast<std::size_t>(v) * sv];
  }
};

// Farther than this no outline is looked for, however thick the slices: the cost grows with the square.
constexpr double kMaxPixels = 24;

struct Point {
  float u, v;  // in pixels
};

bool bone(float x) {
  return x > 0;
}

// Where between pixels 0 and 1 the cubic through four in a row (Catmull-Rom, as resampling has it) crosses 0.
float crossing(float a, float b, float c, float d) {
  const auto value = [&](float t) {
    const float p = t * (-0.5F + t * (1 - 0.5F * t)), q = 1 + t * t * (1.5F * t - 2.5F),
                r = t * (0.5F + t * (2 - 1.5F * t)), s = t * t * (0.5F * t - 0.5F);
    return a * p + b * q + c * r + d * s;
  };
  float lo = 0, hi = 1, t = b / (b - c);
  for (int n = 0; n < 12; ++n) {
    (bone(value(t)) == bone(b) ? lo : hi) = t;
    t = 0.5F * (lo + hi);
  }
  return t;
}

Point along_u(const Slice& s, int u, int v) {
  const auto x = [&](int i) { return s.at(std::clamp(i, 0, s.nu - 1), v); };
  return {static_cast<float>(u) + crossing(x(u - 1), x(u), x(u + 1), x(u + 2)), static_cast<float>(v)};
}
Point along_v(const Slice& s, int u, int v) {
  const auto x = [&](int j) { return s.at(u, std::clamp(j, 0, s.nv - 1)); };
  return {static_cast<float>(u), static_cast<float>(v) + crossing(x(v - 1), x(v), x(v + 1), x(v + 2))};
}

// Squared distances of the pixels around to a piece of outline.
void mark(const Slice& s, Point a, Point b, int reach_u, int reach_v, std::vector<float>& square) {
  const int u0 = std::max(0, static_cast<int>(std::min(a.u, b.u)) - reach_u),
            u1 = std::min(s.nu - 1, static_cast<int>(std::max(a.u, b.u)) + 1 + reach_u);
  const int v0 = std::max(0, static_cast<int>(std::min(a.v, b.v)) - reach_v),
            v1 = std::min(s.nv - 1, static_cast<int>(std::max(a.v, b.v)) + 1 + reach_v);
  const float du = (b.u - a.u) * s.hu, dv = (b.v - a.v) * s.hv, length2 = du * du + dv * dv,
              scale = length2 > 0 ? 1 / length2 : 0;
  for (int v = v0; v <= v1; ++v) {
    float* const row = square.data() + static_cast<std::size_t>(v) * static_cast<std::size_t>(s.nu);
    const float pv = (static_cast<float>(v) - a.v) * s.hv;
    for (int u = u0; u <= u1; ++u) {
      const float pu = (static_cast<float>(u) - a.u) * s.hu;
      const float t = std::min(1.0F, std::max(0.0F, (pu * du + pv * dv) * scale));
      const float x = pu - t * du, y = pv - t * dv;
      row[u] = std::min(row[u], x * x + y * y);
    }
  }
}

// Of each pixel the squared distance to the outline, up to the reach; below zero where there is no bone.
void measure(const Slice& s, float reach_mm, std::vector<float>& square) {
  square.assign(static_cast<std::size_t>(s.nu) * static_cast<std::size_t>(s.nv), reach_mm * reach_mm);
  const int reach_u = static_cast<int>(std::ceil(reach_mm / s.hu)),
            reach_v = static_cast<int>(std::ceil(reach_mm / s.hv));
  for (int v = 0; v + 1 < s.nv; ++v) {
    for (int u = 0; u + 1 < s.nu; ++u) {
      const float c[4] = {s.at(u, v), s.at(u + 1, v), s.at(u + 1, v + 1), s.at(u, v + 1)};
      const int kind = (bone(c[0]) ? 1 : 0) | (bone(c[1]) ? 2 : 0) | (bone(c[2]) ? 4 : 0) | (bone(c[3]) ? 8 : 0);
      if (kind == 0 || kind == 15) continue;
      // Where the outline crosses the cell's sides: below, right, above, left.
      Point p[4];
      const bool cut[4] = {bone(c[0]) != bone(c[1]), bone(c[1]) != bone(c[2]), bone(c[2]) != bone(c[3]),
                           bone(c[3]) != bone(c[0])};
      if (cut[0]) p[0] = along_u(s, u, v);
      if (cut[1]) p[1] = along_v(s, u + 1, v);
      if (cut[2]) p[2] = along_u(s, u, v + 1);
      if (cut[3]) p[3] = along_v(s, u, v);
      const auto piece = [&](int i, int j) { mark(s, p[i], p[j], reach_u, reach_v, square); };
      if (kind == 5 || kind == 10) {
        // A saddle: the middle tells whether the two corners of bone are connected.
        const bool joined = bone(c[0] + c[1] + c[2] + c[3]) == (kind == 5);
        piece(0, joined ? 1 : 3);
        piece(2, joined ? 3 : 1);
        continue;
      }
      int ends[2], n = 0;
      for (int i = 0; i < 4; ++i) {
        if (cut[i]) ends[n++] = i;
      }
      piece(ends[0], ends[1]);
    }
  }
  for (int v = 0; v < s.nv; ++v) {
    for (int u = 0; u < s.nu; ++u) {
      float& x = square[static_cast<std::size_t>(v) * static_cast<std::size_t>(s.nu) + static_cast<std::size_t>(u)];
      x = std::copysign(x, bone(s.at(u, v)) ? 1.0F : -1.0F);
    }
  }
}

// How much a voxel and the one above or below it are of one slope of the boundary: where their outlines lie apart by up
// to 3.5 slices, wholly; by 5 and more (a flat end, a body that begins) not at all, and the values alone decide, as
// partial volume has them.
float of_one_slope(float apart, float slice_mm, float reach_mm) {
  const float from = std::min(3.5F * slice_mm, 0.7F * reach_mm), to = std::min(5 * slice_mm, reach_mm);
  return std::clamp((to - apart) / (to - from), 0.0F, 1.0F);
}

}  // namespace

SliceAxis slice_axis(const Frame& f) {
  SliceAxis s;
  for (std::size_t a = 0; a < 3; ++a) {
    if (f.spacing_mm[a] > f.spacing_mm[s.axis]) s.axis = a;
  }
  s.ratio = f.spacing_mm[s.axis] / (0.5 * (f.spacing_mm[(s.axis + 1) % 3] + f.spacing_mm[(s.axis + 2) % 3]));
  return s;
}

void limit_by_outlines(std::vector<float>& field, const Frame& f, std::size_t axis, double per_mm,
                       const Context& context) {
  const std::array<std::size_t, 3> stride{1, static_cast<std::size_t>(f.dims[0]),
                                          static_cast<std::size_t>(f.dims[0]) * static_cast<std::size_t>(f.dims[1])};
  const std::size_t u = axis == 0 ? 1 : 0, v = axis == 2 ? 1 : 2;
  const auto nu = static_cast<std::size_t>(f.dims[u]), nv = static_cast<std::size_t>(f.dims[v]),
             nk = static_cast<std::size_t>(f.dims[axis]);
  const auto slice_mm = static_cast<float>(f.spacing_mm[axis]);
  const auto reach_mm =
      static_cast<float>(std::min(5 * f.spacing_mm[axis], kMaxPixels * std::max(f.spacing_mm[u], f.spacing_mm[v])));
  const auto slope = static_cast<float>(per_mm);
  // A batch of slices at a time, with the distances of one slice more at each end.
  constexpr std::size_t kBatch = 16;
  std::vector<std::vector<float>> square(kBatch + 2);
  std::size_t known = 0;  // slices up to here are measured
  const auto of = [&](std::size_t k) -> std::vector<float>& { return square[k % (kBatch + 2)]; };
  for (std::size_t first = 0; first < nk; first += kBatch) {
    const std::size_t last = std::min(nk, first + kBatch), upto = std::min(nk, last + 1);
    parallel_for(upto - known, 1, context.threads, [&](std::size_t begin, std::size_t end) {
      context.check_cancelled();
      for (std::size_t k = known + begin; k < known + end; ++k)
        measure({field.data() + k * stride[axis], f.dims[u], f.dims[v], stride[u], stride[v],
                 static_cast<float>(f.spacing_mm[u]), static_cast<float>(f.spacing_mm[v])},
                reach_mm, of(k));
    });
    known = upto;
    parallel_for(last - first, 1, context.threads, [&](std::size_t begin, std::size_t end) {
      for (std::size_t k = first + begin; k < first + end; ++k) {
        const std::vector<float>& own = of(k);
        for (std::size_t b = 0; b < nv; ++b) {
          for (std::size_t a = 0; a < nu; ++a) {
            float& x = field[k * stride[axis] + a * stride[u] + b * stride[v]];
            const std::size_t pixel = b * nu + a;
            const float distance = std::sqrt(std::abs(own[pixel])), most = slope * distance;
            if (std::abs(x) <= most) continue;
            float share = 1;
            for (const std::size_t other : {k - 1, k + 1}) {
              if (other >= nk) continue;  // k - 1 of the first slice wraps round
              const float there = of(other)[pixel];
              if (std::signbit(own[pixel]) == std::signbit(there)) continue;
              share = std::min(share, of_one_slope(distance + std::sqrt(std::abs(there)), slice_mm, reach_mm));
            }
            const float limited = std::clamp(x, -most, most);
            x = share * limited + (1 - share) * x;
          }
        }
      }
    });
  }
}

}  // namespace osteo::inline geometry::grid
