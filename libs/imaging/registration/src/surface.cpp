#include "surface.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "gaps.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/order.h"
#include "osteo/core/base/parallel.h"
#include "osteo/geometry/distance/triangle_tree.h"
#include "osteo/geometry/grid/brick_grid.h"
#include "osteo/geometry/grid/resample.h"
#include "osteo/geometry/mesh/bone_surface.h"
#include "osteo/imaging/image/threshold.h"

namespace osteo::inline imaging::registration {
namespace {

constexpr double kVoxelMm = 0.75, kBorderMm = 4, kReachMm = 8, kMinBoneMm3 = 2000;
constexpr std::size_t kMaxPoints = 12000;

// Cut faces at a scan's border are no bone's surface.
bool well_inside(const Frame& f, Vec3 p) {
  const Vec3 x = f.index_from_world(p);
  for (std::size_t a = 0; a < 3; ++a) {
    const double margin = kBorderMm / f.spacing_mm[a];
    if (x[a] < margin - 0.5 || x[a] > f.dims[a] - 0.5 - margin) return false;
  }
  return true;
}

struct Pair {
  Vec3 from, normal;
  double gap = 0;  // along the normal
  double apart = 0;
};

}  // namespace

BoneOf bone_surface_of(const Image& ct, double bone_hu, const char* which, const Context& context) {
  ThresholdParams t;
  t.lower = bone_hu;
  Context quiet;
  quiet.threads = context.threads;
  const auto too_little = [&](double mm3) {
    return Error(ExitCode::failed,
                 std::string("the ") + which + " scan holds " + format_number(std::round(mm3 / 100) / 10) +
                     " cm3 of bone at or above " + format_number(bone_hu) + " HU: too little to go by",
                 "--bone-hu sets the threshold; --method mutual needs no bone");
  };
  std::optional<Labels> mask;
  try {
    mask = threshold(ct, t, quiet);
  } catch (const Error&) {
    throw too_little(0);
  }
  const ResampledBone bone = resample_bone(ct, *mask, {.spacing_mm = kVoxelMm, .lower = bone_hu}, quiet);
  if (bone.volume_after_mm3 < kMinBoneMm3) throw too_little(bone.volume_after_mm3);
  return {surface_nets(to_bricks(bone.density), 0.5F, quiet).mesh, ct.frame};
}

SurfaceFit fit_surfaces(const BoneOf& first, const BoneOf& second, const RigidTransform& guess,
                        const Context& context) {
  const TriangleSoup soup = soup_of(first.mesh);
  const TriMesh& b = second.mesh;
  const TriangleTree tree(soup, context);
  RigidTransform first_from_second = guess.inverse();
  const auto pairs_of = [&](std::size_t step, std::vector<std::uint32_t>& hints) {
    const std::size_t n = b.points_mm.size() / step;
    std::vector<std::optional<Pair>> found(n);
    hints.resize(n, ClosestPoint::kNone);
    parallel_for(n, 256, context.threads, [&](std::size_t begin, std::size_t end) {
      context.check_cancelled();
      for (std::size_t i = begin; i < end; ++i) {
        const Vec3 own = from_floats(b.points_mm[i * step]);
        const Vec3 p = first_from_second(own);
        if (!well_inside(first.scan, p) || !well_inside(second.scan, own)) continue;
        const ClosestPoint c = tree.closest(p, hints[i], kReachMm);
        hints[i] = c.triangle;
        if (c.triangle == ClosestPoint::kNone || !well_inside(first.scan, c.point_mm)) continue;
        const auto& t = soup.triangles[c.triangle];
        const Vec3 normal =
            normalized(cross(soup.points_mm[t[1]] - soup.points_mm[t[0]], soup.points_mm[t[2]] - soup.points_mm[t[0]]));
        // The other table of the skull is no partner.
        const Vec3 facing = first_from_second.rotation * from_floats(b.normals[i * step]);
        if (dot(normal, facing) < 0.5) continue;
        found[i] = Pair{p, normal, dot(normal, p - c.point_mm), c.distance_mm};
      }
    });
    std::vector<Pair> pairs;
    for (const auto& f : found) {
      if (f) pairs.push_back(*f);
    }
    return pairs;
  };
  const auto apart_at = [](const std::vector<Pair>& pairs, double share) {
    std::vector<double> d;
    for (const Pair& p : pairs) d.push_back(p.apart);
    return value_at_share(std::move(d), share);
  };
  SurfaceFit fit;
  const std::size_t step = std::max<std::size_t>(1, b.points_mm.size() / kMaxPoints);
  std::vector<std::uint32_t> hints;
  for (int n = 0; n < 60; ++n) {
    const std::vector<Pair> pairs = pairs_of(step, hints);
    if (pairs.size() < 500)
      throw Error(ExitCode::failed,
                  "too little bone is seen by both scans: " + std::to_string(pairs.size()) + " points of the surface",
                  "--method mutual goes by all tissue");
    // Of what is left after a drilled cavity and what only one shows, thrice the median is generous.
    const double limit = std::max(3 * apart_at(pairs, 0.5), 0.3);
    std::vector<Gap> gaps;
    for (const Pair& p : pairs) {
      if (p.apart <= limit) gaps.push_back({p.from, p.normal, p.gap});
    }
    const Closing c = close_gaps(gaps);
    first_from_second = c.motion * first_from_second;
    fit.boundary_shift_mm = c.offset_mm;
    if (c.moved_mm < 1e-3) break;
  }
  hints.clear();
  const std::vector<Pair> pairs = pairs_of(std::max<std::size_t>(1, step / 4), hints);
  for (const Pair& p : pairs) {
    fit.mean_mm += p.apart / static_cast<double>(pairs.size());
    fit.shape_mean_mm += std::abs(p.gap - fit.boundary_shift_mm) / static_cast<double>(pairs.size());
  }
  fit.p95_mm = apart_at(pairs, 0.95);
  fit.second_from_first = first_from_second.inverse();
  return fit;
}

}  // namespace osteo::inline imaging::registration
