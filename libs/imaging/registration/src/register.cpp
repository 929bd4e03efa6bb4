#include "osteo/imaging/registration/register.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "edges.h"
#include "mutual.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/portable_math.h"
#include "surface.h"

namespace osteo::inline imaging {
namespace {

namespace reg = registration;

constexpr double kMinOverlap = 0.25, kMaxInverseMm = 1, kManyOff = 1.3, kLike = 0.8;
constexpr int kMinEdges = 300;
// Thin slices of one head meet to 0.03 to 0.05 mm at half of all edges; from here on a mirror is tried. What is better
// goes by the pair's own residual: thick slices leave 0.2 mm to a right pair and 0.25 to its mirror image. Of right
// pairs none fitted better in a mirror by both (docs/validation/registration.md); between, nobody can tell.
constexpr double kDoubtMm = 0.06, kMirrorBetter = 0.87, kMirrorBetterP90 = 0.96, kMirrorAlike = 1.15;
// Of one head a tenth of all edges lies more than 0.07 (1 mm voxels) to 0.34 (5 mm slices) of the coarser scan's
// spacing off; another head's do from here on.
constexpr double kManyOffOfSpacing = 0.45, kManyOffLeastMm = 0.4;

double extent_mm3(const Frame& f) {
  return f.voxel_volume_mm3() * static_cast<double>(f.voxel_count());
}

// Where the same place of the body comes out after there and back, at the corners of what both scans show.
double there_and_back(const RigidTransform& there, const RigidTransform& back, const Frame& first,
                      const Frame& second) {
  Vec3 lo{1e30, 1e30, 1e30}, hi{-1e30, -1e30, -1e30};
  for (int c = 0; c < 11 * 11 * 11; ++c) {
    const Vec3 x{(c % 11) / 10.0 * (first.dims[0] - 1), (c / 11 % 11) / 10.0 * (first.dims[1] - 1),
                 (c / 121) / 10.0 * (first.dims[2] - 1)};
    const Vec3 p = first.world_from_index(x), y = second.index_from_world(there(p));
    bool in = true;
    for (std::size_t a = 0; a < 3; ++a) in = in && y[a] >= -0.5 && y[a] <= second.dims[a] - 0.5;
    if (!in) continue;
    for (std::size_t a = 0; a < 3; ++a) {
      lo[a] = std::min(lo[a], p[a]);
      hi[a] = std::max(hi[a], p[a]);
    }
  }
  double most = 0;
  for (int c = 0; c < 8; ++c) {
    const Vec3 p{(c & 1) != 0 ? hi.x : lo.x, (c & 2) != 0 ? hi.y : lo.y, (c & 4) != 0 ? hi.z : lo.z};
    most = std::max(most, length(back(there(p)) - p));
  }
  return most;
}

// As if the file had left and right exchanged: along the axis of the voxels that points most to the side, so that a
// head stays upright.
Image in_a_mirror(const Image& image) {
  std::size_t axis = 0;
  for (std::size_t a = 1; a < 3; ++a)
    if (std::abs(image.frame.direction.column[a].x) > std::abs(image.frame.direction.column[axis].x)) axis = a;
  const auto& d = image.frame.dims;
  const auto v = make_voxels<std::int16_t>(image.frame.voxel_count());
  std::size_t at = 0;
  for (int k = 0; k < d[2]; ++k)
    for (int j = 0; j < d[1]; ++j)
      for (int i = 0; i < d[0]; ++i)
        v[at++] = image.at(axis == 0 ? d[0] - 1 - i : i, axis == 1 ? d[1] - 1 - j : j, axis == 2 ? d[2] - 1 - k : k);
  return {image.frame, v};
}

std::string mm(double v) {
  return format_number(std::round(v * 100) / 100) + " mm";
}

// What a tenth of all edges may be off without a word.
double many_off_mm(const RegisterParams& p, const Frame& first, const Frame& second) {
  const auto coarsest = [](const Frame& f) { return std::max({f.spacing_mm.x, f.spacing_mm.y, f.spacing_mm.z}); };
  const double own = kManyOffOfSpacing * std::max({coarsest(first), coarsest(second), p.finest_mm});
  return std::min(kManyOff * p.max_residual_mm, std::max(kManyOffLeastMm, own));
}

// Empty when the two belong together.
std::string doubt(const Registration& r, const RegisterParams& p) {
  if (r.overlap < kMinOverlap)
    return "only " + std::to_string(static_cast<int>(std::lround(100 * r.overlap))) +
           " % of the smaller scan lies inside the other";
  if (r.residual.points < kMinEdges)
    return "both scans show only " + std::to_string(r.residual.points) +
           " points of an edge in the same place: too little to go by";
  if (r.mirror_tried && r.mirror.points >= kMinEdges && r.mirror.median_mm < kMirrorBetter * r.residual.median_mm &&
      r.mirror.p90_mm < kMirrorBetterP90 * r.residual.p90_mm)
    return "the second scan fits better in a mirror, with left and right exchanged: half of all edges then meet to " +
           mm(r.mirror.median_mm) + " instead of " + mm(r.residual.median_mm) +
           "; one of the two files is mirrored, or shows the other side";
  if (r.residual.median_mm > p.max_residual_mm)
    return "at half of all edges the other scan's edge is " + mm(r.residual.median_mm) +
           " off or missing, allowed are " + mm(p.max_residual_mm) +
           ": another patient, the other side, or a body that has changed its shape";
  if (r.inverse_mm > kMaxInverseMm)
    return "registered back by itself, a corner of the region ends up " + mm(r.inverse_mm) +
           " from where it began: there is no one best place";
  return {};
}

}  // namespace

EdgeResidual edge_residual(const Image& first, const Image& second, const RigidTransform& second_from_first,
                           const Context& context) {
  const double h = reg::finest_of(first.frame, second.frame, 1);
  return reg::edge_residual(reg::make_levels(first, h, context), reg::make_levels(second, h, context),
                            second_from_first, context);
}

Registration register_scans(const Image& first, const Image& second, const RegisterParams& p, const Context& context) {
  const double h = reg::finest_of(first.frame, second.frame, p.finest_mm);
  const reg::Levels a = reg::make_levels(first, h, context), b = reg::make_levels(second, h, context);
  context.progress(0.1, "search");
  // Points of the smaller scan find all their partners in the larger.
  const bool swapped = extent_mm3(second.frame) < extent_mm3(first.frame);
  const reg::Levels &from = swapped ? b : a, &to = swapped ? a : b;
  const bool by_surface = p.method == RegisterMethod::surface;
  // Surfaces need a guess to a few mm.
  const std::size_t stop = by_surface ? std::min<std::size_t>(1, a.levels.size() - 1) : 0;
  const reg::Match match = reg::search(from, to, stop, context.sub(0.1, 0.6));
  Registration r;
  r.overlap = match.overlap;
  r.second_from_first = swapped ? match.to_from.inverse() : match.to_from;
  RigidTransform back;  // from the second to the first
  const bool seen = r.overlap >= kMinOverlap;
  if (by_surface && seen) {
    const reg::BoneOf bone = reg::bone_surface_of(first, p.bone_hu, "first", context),
                      other = reg::bone_surface_of(second, p.bone_hu, "second", context);
    const reg::SurfaceFit there = reg::fit_surfaces(bone, other, r.second_from_first, context);
    r.second_from_first = there.second_from_first;
    r.surface_mean_mm = there.mean_mm;
    r.surface_p95_mm = there.p95_mm;
    r.surface_shape_mm = there.shape_mean_mm;
    r.boundary_shift_mm = there.boundary_shift_mm;
    context.progress(0.75, "and back");
    back = reg::fit_surfaces(other, bone, r.second_from_first.inverse(), context).second_from_first;
  } else if (seen) {
    // Between scans of one kind mutual information is the more exact; a coil's shading pulls it.
    const bool unlike = reg::likeness(from, to, match.to_from, context) < kLike;
    if (unlike) r.second_from_first = reg::fit_edges(a, b, r.second_from_first, context);
    context.progress(0.75, "and back");
    // Two levels up, where there is more than one place to fall into.
    back = reg::refine(to, from, match.to_from.inverse(), 2, context).to_from;
    if (swapped) back = back.inverse();
    if (unlike) back = reg::fit_edges(b, a, back, context);
  }
  if (seen) r.inverse_mm = there_and_back(r.second_from_first, back, first.frame, second.frame);
  context.progress(0.9, "residual");
  r.residual = reg::edge_residual(a, b, r.second_from_first, context);
  if (seen && (r.residual.median_mm > kDoubtMm || r.residual.p90_mm > many_off_mm(p, first.frame, second.frame))) {
    context.progress(0.92, "in a mirror");
    const reg::Levels c = reg::make_levels(in_a_mirror(second), h, context);
    const reg::Match other =
        swapped ? reg::search(c, a, 0, context.sub(0.92, 0.99)) : reg::search(a, c, 0, context.sub(0.92, 0.99));
    r.mirror_tried = true;
    r.mirror = reg::edge_residual(a, c, swapped ? other.to_from.inverse() : other.to_from, context);
  }
  const Mat3& m = r.second_from_first.rotation;
  const double trace = m.column[0].x + m.column[1].y + m.column[2].z;
  r.rotation_deg = portable::acos(std::clamp((trace - 1) / 2, -1.0, 1.0)) * 180 / std::numbers::pi;
  r.shift_mm = length(r.second_from_first(first.frame.centre_mm()) - first.frame.centre_mm());

  context.report("finest_mm", h);
  context.report("overlap_percent", 100 * r.overlap);
  context.report("edge_points", static_cast<std::int64_t>(r.residual.points));
  context.report("edges_found_percent", 100 * r.residual.found);
  context.report("edge_residual_median_mm", r.residual.median_mm);
  context.report("edge_residual_p90_mm", r.residual.p90_mm);
  context.report("edge_shift_mm", r.residual.shift_mm);
  if (r.mirror_tried) context.report("mirror_residual_median_mm", r.mirror.median_mm);
  context.report("inverse_consistency_mm", r.inverse_mm);
  if (by_surface) {
    context.report("surface_mean_mm", r.surface_mean_mm);
    context.report("surface_p95_mm", r.surface_p95_mm);
    context.report("surface_shape_mean_mm", r.surface_shape_mm);
    context.report("boundary_shift_mm", r.boundary_shift_mm);
  }
  context.report("rotation_deg", r.rotation_deg);
  context.report("shift_at_centre_mm", r.shift_mm);
  if (r.residual.p90_mm > many_off_mm(p, first.frame, second.frame)) {
    context.warn("at a tenth of all edges the other scan's edge is " + mm(r.residual.p90_mm) +
                 " off or missing: drilled, swollen, a jaw or neck that moved, thick slices, or another patient; look "
                 "at --checkerboard-out");
  }
  const std::string why = doubt(r, p);
  if (why.empty() && r.mirror_tried && r.mirror.points >= kMinEdges &&
      r.mirror.median_mm < kMirrorAlike * r.residual.median_mm)
    context.warn("in a mirror, with left and right exchanged, the second scan fits as well (" + mm(r.mirror.median_mm) +
                 "): these scans do not show whether one of the files is mirrored");
  if (!why.empty()) {
    if (!p.accept_poor)
      throw Error(
          ExitCode::failed, "the scans cannot be registered: " + why,
          "look whether both are of the same patient and region; --accept-poor writes the transform all the same");
    context.warn("accepted as asked: " + why);
  }
  context.progress(1.0);
  return r;
}

}  // namespace osteo::inline imaging
