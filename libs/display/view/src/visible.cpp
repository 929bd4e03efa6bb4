#include "osteo/display/view/detail/visible.h"

#include <algorithm>
#include <cmath>

namespace osteo::inline display {
namespace {

struct Point {
  float x, y, z;  // pixels; depth, near is small
  bool in_front;
};

std::vector<Point> projected(const VisibleMesh& m, int width, int height) {
  std::vector<Point> points(m.points_mm.size() / 3);
  const auto& c = m.clip_from_mesh;
  for (std::size_t p = 0; p < points.size(); ++p) {
    const auto x = static_cast<double>(m.points_mm[3 * p]), y = static_cast<double>(m.points_mm[3 * p + 1]),
               z = static_cast<double>(m.points_mm[3 * p + 2]);
    const double w = c[12] * x + c[13] * y + c[14] * z + c[15];
    const double safe = std::max(w, 1e-6);
    points[p] = {static_cast<float>(((c[0] * x + c[1] * y + c[2] * z + c[3]) / safe * 0.5 + 0.5) * width),
                 static_cast<float>(((c[4] * x + c[5] * y + c[6] * z + c[7]) / safe * 0.5 + 0.5) * height),
                 static_cast<float>((c[8] * x + c[9] * y + c[10] * z + c[11]) / safe), w > 1e-6};
  }
  return points;
}

// Calls f(pixel, depth) for the pixels whose middle a triangle covers. False when it is turned away or outside.
template <class F>
bool cover(const Point& a, const Point& b, const Point& c, int width, int height, F&& f) {
  if (!a.in_front || !b.in_front || !c.in_front) return true;  // through the eye's plane: never left out
  const float area = (b.x - a.x) * (c.y - a.y) - (c.x - a.x) * (b.y - a.y);
  if (!(area > 0)) return false;
  const int x0 = std::max(0, static_cast<int>(std::ceil(std::min({a.x, b.x, c.x}) - 0.5F))),
            x1 = std::min(width - 1, static_cast<int>(std::floor(std::max({a.x, b.x, c.x}) - 0.5F))),
            y0 = std::max(0, static_cast<int>(std::ceil(std::min({a.y, b.y, c.y}) - 0.5F))),
            y1 = std::min(height - 1, static_cast<int>(std::floor(std::max({a.y, b.y, c.y}) - 0.5F)));
  for (int y = y0; y <= y1; ++y) {
    for (int x = x0; x <= x1; ++x) {
      const float px = static_cast<float>(x) + 0.5F, py = static_cast<float>(y) + 0.5F;
      const float u = ((b.x - px) * (c.y - py) - (c.x - px) * (b.y - py)) / area;
      const float v = ((c.x - px) * (a.y - py) - (a.x - px) * (c.y - py)) / area;
      const float w = 1 - u - v;
      if (u < 0 || v < 0 || w < 0) continue;
      f(static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x),
        u * a.z + v * b.z + w * c.z);
    }
  }
  return true;
}

}  // namespace

std::vector<std::vector<std::uint32_t>> visible_triangles(std::span<const VisibleMesh> meshes, int width, int height) {
  std::vector<float> nearest(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), 2);
  std::vector<std::vector<Point>> points;
  for (const VisibleMesh& m : meshes) {
    points.push_back(projected(m, width, height));
    const auto& p = points.back();
    for (std::size_t t = 0; t + 2 < m.triangles.size(); t += 3) {
      cover(p[static_cast<std::size_t>(m.triangles[t])], p[static_cast<std::size_t>(m.triangles[t + 1])],
            p[static_cast<std::size_t>(m.triangles[t + 2])], width, height,
            [&](std::size_t pixel, float depth) { nearest[pixel] = std::min(nearest[pixel], depth); });
    }
  }
  // The farthest of a pixel's neighbours counts: rounding must not cost a triangle at an edge.
  std::vector<float> limit(nearest.size());
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      float most = -2;
      for (int j = std::max(0, y - 1); j <= std::min(height - 1, y + 1); ++j)
        for (int i = std::max(0, x - 1); i <= std::min(width - 1, x + 1); ++i)
          most = std::max(
              most,
              nearest[static_cast<std::size_t>(j) * static_cast<std::size_t>(width) + static_cast<std::size_t>(i)]);
      limit[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)] = most + 1e-5F;
    }
  }
  std::vector<std::vector<std::uint32_t>> seen(meshes.size());
  for (std::size_t n = 0; n < meshes.size(); ++n) {
    const VisibleMesh& m = meshes[n];
    const auto& p = points[n];
    for (std::size_t t = 0; t + 2 < m.triangles.size(); t += 3) {
      const Point corner[3] = {p[static_cast<std::size_t>(m.triangles[t])],
                               p[static_cast<std::size_t>(m.triangles[t + 1])],
                               p[static_cast<std::size_t>(m.triangles[t + 2])]};
      bool wins = false;
      const bool may = cover(corner[0], corner[1], corner[2], width, height,
                             [&](std::size_t pixel, float depth) { wins = wins || depth <= limit[pixel]; });
      // Small ones may cover no pixel's middle: their corners are asked.
      for (int c = 0; c < 3 && may && !wins; ++c) {
        const int x = static_cast<int>(corner[c].x), y = static_cast<int>(corner[c].y);
        if (!corner[c].in_front) wins = true;
        if (corner[c].x < 0 || corner[c].y < 0 || x >= width || y >= height) continue;
        wins = wins ||
               corner[c].z <=
                   limit[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)];
      }
      if (wins) seen[n].push_back(static_cast<std::uint32_t>(t / 3));
    }
  }
  return seen;
}

}  // namespace osteo::inline display
