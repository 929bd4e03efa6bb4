#include "edges.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace osteo::inline simulation::marker {
namespace {

constexpr double kMinContrast = 14, kStepPx = 0.5;

double bilinear(const cv::Mat& g, double x, double y) {
  const int ix = static_cast<int>(std::floor(x)), iy = static_cast<int>(std::floor(y));
  if (ix < 0 || iy < 0 || ix + 1 >= g.cols || iy + 1 >= g.rows) return -1;
  const double fx = x - ix, fy = y - iy;
  const std::uint8_t* const a = g.ptr<std::uint8_t>(iy) + ix;
  const std::uint8_t* const b = g.ptr<std::uint8_t>(iy + 1) + ix;
  return (1 - fy) * ((1 - fx) * a[0] + fx * a[1]) + fy * ((1 - fx) * b[0] + fx * b[1]);
}

// A point in a line's own coordinates: along (0 to 1) and across (px, outwards).
struct EdgePoint {
  double along, across, weight;
};
struct Line {
  double at_begin = 0, at_end = 0;
};

bool fit_line(std::vector<EdgePoint>& points, Line& line) {
  for (int round = 0; round < 2; ++round) {
    double w = 0, s = 0, ss = 0, a = 0, sa = 0;
    for (const EdgePoint& p : points) {
      w += p.weight;
      s += p.weight * p.along;
      ss += p.weight * p.along * p.along;
      a += p.weight * p.across;
      sa += p.weight * p.along * p.across;
    }
    const double d = w * ss - s * s;
    if (!(d > 1e-9 * w * w)) return false;
    const double slope = (w * sa - s * a) / d, begin = (a - slope * s) / w;
    line = {begin, begin + slope};
    if (round > 0) break;
    double square = 0;
    for (const EdgePoint& p : points) square += p.weight * std::pow(p.across - begin - slope * p.along, 2);
    const double most = std::max(0.2, 2.5 * std::sqrt(square / w));
    const std::size_t before = points.size();
    std::erase_if(points, [&](const EdgePoint& p) { return std::abs(p.across - begin - slope * p.along) > most; });
    if (points.size() == before) break;
    if (points.size() < 4) return false;
  }
  return true;
}

}  // namespace

bool refine_corners(const cv::Mat& gray, Quad& quad, int cells) {
  Quad q = quad;
  double moved_most = 0;
  for (int round = 0; round < 8; ++round) {
    std::array<std::array<double, 4>, 4> lines;  // a point and a direction
    for (std::size_t e = 0; e < 4; ++e) {
      const auto &a = q[e], &b = q[(e + 1) % 4], &c = q[(e + 2) % 4], &d = q[(e + 3) % 4];
      const double dx = b[0] - a[0], dy = b[1] - a[1], long_px = std::hypot(dx, dy);
      if (!(long_px > 6)) return false;
      const double nx = dy / long_px, ny = -dx / long_px;
      const double far = -(((c[0] + d[0]) - (a[0] + b[0])) * nx + ((c[1] + d[1]) - (a[1] + b[1])) * ny) / 2;
      const double cell_px = far / cells;
      if (!(cell_px > 1.5)) return false;
      // Inside a cell of black, outside half a cell of white, less where the next face begins. First far enough to find
      // the edge; then a short reach, the same to both sides of where the line is by now, so that what is cut off of a
      // blurred edge is the same on both.
      const double reach = round == 0 ? std::clamp(0.4 * cell_px, 1.5, 5.0) : std::clamp(0.25 * cell_px, 1.0, 1.5);
      const int count = std::clamp(static_cast<int>(long_px), 8, 60);
      std::vector<EdgePoint> points;
      for (int i = 0; i < count; ++i) {
        const double t = 0.1 + 0.8 * (i + 0.5) / count;
        const double x = a[0] + t * dx, y = a[1] + t * dy;
        double before = -1, sum = 0, moment = 0;
        bool inside = true;
        for (double s = -reach - kStepPx / 2; s <= reach + kStepPx; s += kStepPx) {
          const double v = bilinear(gray, x + s * nx, y + s * ny);
          if (v < 0) {
            inside = false;
            break;
          }
          if (before >= 0 && v > before) {
            sum += v - before;
            moment += (v - before) * (s - kStepPx / 2);
          }
          before = v;
        }
        if (inside && sum > kMinContrast) points.push_back({t, moment / sum, sum});
      }
      if (points.size() < static_cast<std::size_t>(0.6 * count)) return false;
      Line line;
      if (!fit_line(points, line)) return false;
      const double bx = a[0] + nx * line.at_begin, by = a[1] + ny * line.at_begin;
      const double ex = b[0] + nx * line.at_end, ey = b[1] + ny * line.at_end;
      lines[e] = {bx, by, ex - bx, ey - by};
      moved_most = std::max({moved_most, std::abs(line.at_begin) / cell_px, std::abs(line.at_end) / cell_px});
    }
    for (std::size_t c = 0; c < 4; ++c) {
      const auto &l = lines[(c + 3) % 4], &m = lines[c];
      const double d = l[2] * m[3] - l[3] * m[2];
      if (std::abs(d) < 0.05 * std::hypot(l[2], l[3]) * std::hypot(m[2], m[3])) return false;
      const double t = ((m[0] - l[0]) * m[3] - (m[1] - l[1]) * m[2]) / d;
      q[c] = {l[0] + t * l[2], l[1] + t * l[3]};
    }
    if (moved_most > 0.8) return false;
    if (round > 0 && moved_most < 0.01) break;
    moved_most = 0;
  }
  quad = q;
  return true;
}

}  // namespace osteo::inline simulation::marker
