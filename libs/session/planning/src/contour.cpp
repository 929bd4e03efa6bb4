#include "contour.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "osteo/core/base/error.h"
#include "osteo/core/base/portable_math.h"

namespace osteo::inline session::planning {
namespace {

constexpr double kStepMm = 2;
constexpr int kMaxSteps = 150;
constexpr double kElongated = 1.3;  // from here on a section has a long axis of its own

Vec3 border_middle(const Sheet& sheet, const Loop& loop, Vec3 down, double thickness) {
  const Moments m = moments(loop);
  Point2 d{dot(down, sheet.axes.column[0]), dot(down, sheet.axes.column[1])};
  const double half = (m.xx - m.yy) / 2, root = std::sqrt(half * half + m.xy * m.xy), mean = (m.xx + m.yy) / 2;
  if (mean + root > kElongated * kElongated * (mean - root)) {
    const double angle = portable::atan2(m.xy, half) / 2;
    const auto [sin, cos] = portable::sin_cos(angle);
    const double sign = cos * d[0] + sin * d[1] < 0 ? -1 : 1;
    d = {sign * cos, sign * sin};
  }
  const double size = std::sqrt(d[0] * d[0] + d[1] * d[1]);
  if (size < 1e-6) return sheet.world(m.centroid);
  d = {d[0] / size, d[1] / size};
  double lowest = -std::numeric_limits<double>::max();
  for (const Point2& p : loop) lowest = std::max(lowest, p[0] * d[0] + p[1] * d[1]);
  return sheet.world(moments(clipped(loop, d, lowest - thickness)).centroid);
}

}  // namespace

std::vector<Vec3> contour_of(const TriangleSoup& target, const Plane& a, const Plane& b, Vec3 down, double thickness) {
  std::vector<Vec3> out;
  const auto outline = [&](const Sheet& sheet, Vec3 near) {
    auto loop = outline_near(target, sheet, near, kNearMm);
    if (!loop)
      throw Error(
          ExitCode::failed,
          "the target has no closed section " + std::to_string(out.size() * 2) + " mm from resection plane a",
          "the place of the plane must lie in the bone, in LPS mm, and the surface be closed ('osteo mesh-repair')");
    return *loop;
  };
  Sheet sheet(a.at, a.normal);
  Loop loop = outline(sheet, a.at);
  std::vector<Vec3> middles{sheet.world(moments(loop).centroid)};
  if (b.ahead(middles[0]) <= 0 || a.ahead(b.at) <= 0)
    throw Error(ExitCode::usage, "the resection planes do not face each other",
                "each normal points to the part that is removed, which lies between them");
  out.push_back(border_middle(sheet, loop, down, thickness));
  Vec3 heading = a.normal;
  for (int step = 0; step < kMaxSteps; ++step) {
    const Vec3 next = middles.back() + heading * kStepMm;
    if (b.ahead(next) <= 0) {
      sheet = Sheet(b.at, b.normal);
      loop = outline(sheet, middles.back());
      out.push_back(border_middle(sheet, loop, down, thickness));
      return out;
    }
    sheet = Sheet(next, heading);
    loop = outline(sheet, next);
    middles.push_back(sheet.world(moments(loop).centroid));
    // Sections that are not yet at right angles to the bone, near an oblique plane a, are not in step with the rest.
    const Vec3 middle = border_middle(sheet, loop, down, thickness);
    if (a.ahead(middle) > 0 && b.ahead(middle) > 0) out.push_back(middle);
    heading = normalized(middles.back() - middles[middles.size() - std::min<std::size_t>(middles.size(), 5)]);
  }
  throw Error(ExitCode::usage, "from resection plane a the bone does not lead to plane b within 300 mm",
              "each normal points to the part that is removed, which lies between them");
}

double to_segment(Vec3 p, Vec3 a, Vec3 b) {
  const Vec3 d = b - a;
  const double t = std::clamp(dot(p - a, d) / std::max(dot(d, d), 1e-12), 0.0, 1.0);
  return length(p - a - d * t);
}

}  // namespace osteo::inline session::planning
