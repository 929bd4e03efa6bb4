// Outlines and condyles of an outcome.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "contour.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/parallel.h"
#include "osteo/geometry/distance/triangle_tree.h"
#include "osteo/session/planning/detail/reconstruct.h"
#include "osteo/session/planning/detail/symmetry.h"
#include "outcome_parts.h"
#include "section.h"

namespace osteo::inline session::outcome {
namespace outlines {
namespace {

using planning::Plane;
using planning::Row;
using planning::Sheet;

using Bones = std::vector<std::pair<std::string, TriangleSoup>>;
using Fits = std::vector<std::optional<Fit>>;

constexpr std::size_t kOutlinePlaces = 2000, kDraws = 1000;
constexpr double kNormal975 = 1.959964;
constexpr double kCondyleMm = 8, kFromMiddleMm = 25, kAboveLowestMm = 25, kLargestJawMm = 220, kOnFragmentMm = 6;

bool found(const std::optional<Fit>& fit) {
  return fit && fit->found >= kMinFound;
}

// What a surface does not show is no failure of the whole.
std::string why_of(const Error& e) {
  if (e.code() == ExitCode::cancelled) throw e;
  return e.what();
}

// Errors of poses as their covariances have them, always the same ones; half-widths of so few patches are Student's.
class Draws {
 public:
  explicit Draws(const Fits& fits) : errors_(kDraws, std::vector<Row<7>>(fits.size())) {
    std::mt19937_64 engine(1);
    std::vector<planning::Square<7>> roots;
    for (const auto& fit : fits) roots.push_back(fit ? root_of(fit->covariance) : planning::Square<7>{});
    for (auto& of : errors_) {
      for (std::size_t f = 0; f < fits.size(); ++f) {
        Row<7> normal{};
        for (double& v : normal) {  // twelve uniform ones: variance 1
          v = -6;
          for (int n = 0; n < 12; ++n) v += static_cast<double>(engine() >> 11U) * 0x1p-53;
        }
        if (!fits[f]) continue;
        for (std::size_t r = 0; r < 7; ++r)
          for (std::size_t c = 0; c <= r; ++c) of[f][r] += fits[f]->quantile / kNormal975 * roots[f][r][c] * normal[c];
      }
    }
  }
  [[nodiscard]] const std::vector<Row<7>>& of(std::size_t draw) const { return errors_[draw]; }

 private:
  // Cholesky; a direction of no variance stays without any.
  static planning::Square<7> root_of(const planning::Square<7>& m) {
    planning::Square<7> l{};
    for (std::size_t c = 0; c < 7; ++c) {
      double rest = m[c][c];
      for (std::size_t k = 0; k < c; ++k) rest -= l[c][k] * l[c][k];
      if (!(rest > 1e-12 * m[c][c])) continue;
      l[c][c] = std::sqrt(rest);
      for (std::size_t r = c + 1; r < 7; ++r) {
        double sum = m[r][c];
        for (std::size_t k = 0; k < c; ++k) sum -= l[r][k] * l[c][k];
        l[r][c] = sum / l[c][c];
      }
    }
    return l;
  }
  std::vector<std::vector<Row<7>>> errors_;
};

// How far one place is off, and how that changes with the errors of its fragment's pose and of the reference's.
struct Place {
  double mm = 0;
  std::size_t fragment = 0;
  Row<7> own{}, other{};
};

// `along`: unit, in the CT after surgery; `at`: the place there.
Place place_of(double mm, std::size_t fragment, Vec3 along, Vec3 at, const Fit& own, const Fit& reference) {
  const auto slope = [&](const Fit& fit) {
    const Vec3 m = cross(at - fit.middle, along);
    return Row<7>{along.x, along.y, along.z, m.x, m.y, m.z, 0};
  };
  Place p{mm, fragment, slope(own), slope(reference)};
  for (double& v : p.other) v = -v;
  return p;
}

struct Figures {
  double mean = 0, p95 = 0;
};
// Destroys the order.
Figures figures_of(std::vector<double>& off) {
  Figures f;
  for (double& v : off) {
    v = std::abs(v);
    f.mean += v / static_cast<double>(off.size());
  }
  const auto at = off.begin() + static_cast<std::ptrdiff_t>((off.size() * 95 + 99) / 100 - 1);
  std::nth_element(off.begin(), at, off.end());
  f.p95 = *at;
  return f;
}

// Distances have no sign, so errors of a pose make them larger on average: where all lies as planned, that is all that
// there is. What such errors add once more to what was found is taken off it.
void fill(ContourOutcome& out, const std::vector<Place>& places, std::size_t reference, const Draws& draws,
          const OutcomeParams& params, const Context& context) {
  std::vector<double> off;
  for (const Place& p : places) off.push_back(p.mm);
  const Figures measured = figures_of(off);
  std::vector<double> mean(kDraws), p95(kDraws);
  parallel_for(kDraws, 16, context.threads, [&](std::size_t begin, std::size_t end) {
    std::vector<double> drawn(places.size());
    for (std::size_t n = begin; n < end; ++n) {
      const auto& errors = draws.of(n);
      for (std::size_t k = 0; k < places.size(); ++k) {
        const Place& p = places[k];
        drawn[k] = p.mm;
        for (std::size_t u = 0; u < 7; ++u)
          drawn[k] += p.own[u] * errors[p.fragment][u] + p.other[u] * errors[reference][u];
      }
      const Figures f = figures_of(drawn);
      mean[n] = f.mean;
      p95[n] = f.p95;
    }
  });
  const auto interval = [](double value, std::vector<double>& drawn) {
    double more = 0;
    for (const double v : drawn) more += (v - value) / static_cast<double>(drawn.size());
    for (double& v : drawn) v = std::abs(v - value - more);
    const auto at = drawn.begin() + static_cast<std::ptrdiff_t>(drawn.size() * 95 / 100);
    std::nth_element(drawn.begin(), at, drawn.end());
    return Interval95{std::max(0.0, value - more), *at};
  };
  out.mean_mm = interval(measured.mean, mean);
  out.p95_mm = interval(measured.p95, p95);
  out.known = out.mean_mm.half <= params.max_unsure_mm && out.p95_mm.half <= params.max_unsure_mm;
  if (!out.known) out.why = "the interval is wider than what is accepted";
}

// Of the surface of each fragment that the plan moves, to the surface of its bone where the plan has it: all of the
// bone, so that where it was cut, and where a shaft lies along itself, makes no difference.
ContourOutcome against_plan(const SurgicalPlan& plan, const Bones& bones, const Fits& fits,
                            const std::vector<std::vector<SurfacePlace>>& places, std::size_t reference,
                            const Draws& draws, const OutcomeParams& params, const Context& context) {
  ContourOutcome out;
  out.against = "plan";
  double area = 0;
  std::vector<std::size_t> moved;
  for (std::size_t n = 0; n < fits.size(); ++n) {
    if (stays(plan.fragments[n]) || places[n].empty()) continue;
    moved.push_back(n);
    area += places[n].front().mm2 * static_cast<double>(places[n].size());
    if (!found(fits[n]) && out.why.empty()) out.why = "'" + plan.fragments[n].name + "' is not found";
  }
  if (moved.empty()) out.why = "the plan moves no fragment";
  if (!out.why.empty()) return out;
  std::vector<Place> all;
  for (const std::size_t n : moved) {
    const TriangleSoup& bone = bone_called(bones, plan.fragments[n].bone);
    const TriangleTree tree(bone, context);
    const RigidTransform to_bone =
        plan.fragments[n].planned_from_ct.inverse() * fits[reference]->pose.inverse();  // from the CT after surgery
    const double share = places[n].front().mm2 * static_cast<double>(places[n].size()) / area;
    const auto count = std::max<std::size_t>(1, static_cast<std::size_t>(share * kOutlinePlaces));
    for (std::size_t k = 0; k < count; ++k) {
      const std::size_t of = (2 * k + 1) * places[n].size() / (2 * count);
      const Vec3 at = fits[n]->pose(places[n][of].at), p = to_bone(at);
      const ClosestPoint c = tree.closest(p);
      const auto& t = bone.triangles[c.triangle];
      const Vec3 a = bone.points_mm[t[0]];
      const Vec3 facing = normalized(cross(bone.points_mm[t[1]] - a, bone.points_mm[t[2]] - a));
      const double sign = dot(p - c.point_mm, facing) < 0 ? -1 : 1;
      // At an edge the way to the nearest point is what counts; upon the surface there is none but its normal.
      const Vec3 along = c.distance_mm > 1e-3 ? (p - c.point_mm) * (sign / c.distance_mm) : facing;
      all.push_back(
          place_of(sign * c.distance_mm, n, transposed(to_bone.rotation) * along, at, *fits[n], *fits[reference]));
    }
  }
  fill(out, all, reference, draws, params, context);
  return out;
}

struct Axis {
  Vec3 from, to;
  [[nodiscard]] Axis moved(const RigidTransform& by) const { return {by(from), by(to)}; }
  [[nodiscard]] Vec3 nearest(Vec3 p) const {  // of the whole line
    const Vec3 d = normalized(to - from);
    return from + d * dot(p - from, d);
  }
};

// From places on the mirrored side's lower border to the axes of the segments, as the plan's own contour error; to the
// line of the segment that is planned there, so that where a shaft lies along itself makes no difference.
ContourOutcome against_mirrored(const SurgicalPlan& plan, const Bones& bones, const Fits& fits, std::size_t reference,
                                const std::optional<SymmetryPlane>& symmetry, const std::string& why_not,
                                const Draws& draws, const OutcomeParams& params, const Context& context) {
  ContourOutcome out;
  out.against = "mirrored side";
  const std::string& jaw = plan.planes.front().bone;
  std::vector<Plane> resection;
  for (const CutPlane& p : plan.planes)
    if (p.bone == jaw) resection.push_back({p.at_mm, p.waste_ahead ? p.normal : -p.normal});
  std::vector<std::size_t> segments;
  for (std::size_t n = 0; n < fits.size(); ++n)
    if (plan.fragments[n].bone != jaw && plan.fragments[n].planes.size() == 2) segments.push_back(n);
  if (resection.size() != 2 || segments.empty()) {
    out.why = "the plan does not rebuild what lies between two planes from segments of another bone";
    return out;
  }
  if (!symmetry) {
    out.why = why_not;
    return out;
  }
  std::vector<Axis> planned, lies;
  std::vector<Vec3> contour;
  const RigidTransform back = fits[reference]->pose.inverse();
  try {
    const TriangleSoup& donor = bone_called(bones, plan.fragments[segments.front()].bone);
    contour = planning::contour_of(mirrored(bone_called(bones, jaw), *symmetry), resection[0], resection[1],
                                   Vec3{0, 0, -1}, donor_thickness_mm(donor));
    for (const std::size_t n : segments) {
      const PlannedFragment& f = plan.fragments[n];
      if (!found(fits[n])) {
        out.why = "'" + f.name + "' is not found";
        return out;
      }
      std::array<Vec3, 2> ends;
      for (std::size_t e = 0; e < 2; ++e) {
        const CutPlane& p = plan.plane(f.planes[e]);
        const Sheet sheet(p.at_mm, p.normal);
        const auto outline = planning::outline_near(bone_called(bones, f.bone), sheet, p.at_mm, planning::kNearMm);
        if (!outline) {
          out.why = "'" + f.name + "' has no closed section in its planes";
          return out;
        }
        ends[e] = sheet.world(planning::moments(*outline).centroid);
      }
      const Axis axis{ends[0], ends[1]};
      planned.push_back(axis.moved(f.planned_from_ct));
      lies.push_back(axis.moved(back * fits[n]->pose));
    }
  } catch (const Error& e) {
    out.why = why_of(e);
    return out;
  }
  std::vector<Place> all;
  std::vector<double> as_planned;
  for (const Vec3& q : contour) {
    std::size_t at = 0;
    for (std::size_t k = 1; k < planned.size(); ++k)
      if (planning::to_segment(q, planned[k].from, planned[k].to) <
          planning::to_segment(q, planned[at].from, planned[at].to))
        at = k;
    as_planned.push_back(length(q - planned[at].nearest(q)));
    const Vec3 x = lies[at].nearest(q), off = x - q;
    const double mm = length(off);
    const Vec3 along = mm > 1e-9 ? off / mm : any_perpendicular(normalized(lies[at].to - lies[at].from));
    const Fit& own = *fits[segments[at]];
    all.push_back(place_of(mm, segments[at], fits[reference]->pose.rotation * along, fits[reference]->pose(x), own,
                           *fits[reference]));
  }
  const Figures as = figures_of(as_planned);
  out.planned_mean_mm = as.mean;
  out.planned_p95_mm = as.p95;
  fill(out, all, reference, draws, params, context);
  return out;
}

// The hindmost and highest place of one side, far enough from the middle and above the lowest, and the middle of the
// surface about it. `side`: 1 is the patient's left.
std::optional<Vec3> condyle(const TriangleSoup& jaw, const SymmetryPlane& middle, double side) {
  const Vec3 towards = normalized(Vec3{0, 1, 1});
  double lowest = std::numeric_limits<double>::infinity();
  std::optional<Vec3> hindmost;
  for (const auto& t : jaw.triangles) {
    for (const std::uint32_t n : t) {
      const Vec3 p = jaw.points_mm[n];
      const double beside = side * dot(p - middle.at_mm, middle.normal);
      if (beside < 0) continue;
      lowest = std::min(lowest, p.z);
      if (beside >= kFromMiddleMm && (!hindmost || dot(p - *hindmost, towards) > 0)) hindmost = p;
    }
  }
  const BoxMm box = bounds_of(jaw);
  if (!hindmost || hindmost->z < lowest + kAboveLowestMm || length(box.hi - box.lo) > kLargestJawMm)
    return std::nullopt;
  const Vec3 pole = *hindmost;
  Vec3 sum;
  double area = 0;
  for (const auto& t : jaw.triangles) {
    const Vec3 a = jaw.points_mm[t[0]], b = jaw.points_mm[t[1]], c = jaw.points_mm[t[2]], at = (a + b + c) / 3;
    if (length(at - pole) > kCondyleMm) continue;
    const double mm2 = length(cross(b - a, c - a)) / 2;
    sum += at * mm2;
    area += mm2;
  }
  return area > 0 ? sum / area : pole;
}

}  // namespace
}  // namespace outlines

void find_contours(Outcome& out, const SurgicalPlan& plan,
                   const std::vector<std::pair<std::string, TriangleSoup>>& bones,
                   const std::vector<std::optional<Fit>>& fits, const std::vector<std::vector<SurfacePlace>>& places,
                   std::size_t reference, const OutcomeParams& params, const Context& context) {
  using namespace outlines;
  if (plan.planes.empty()) return;
  const std::string& jaw_name = plan.planes.front().bone;
  const TriangleSoup& jaw = bone_called(bones, jaw_name);
  std::optional<SymmetryPlane> symmetry;
  std::string why_not;
  try {
    symmetry = find_symmetry_plane(jaw, context);
  } catch (const Error& e) {
    why_not = why_of(e);
  }
  const Draws draws(fits);
  out.contours.push_back(against_plan(plan, bones, fits, places, reference, draws, params, context));
  out.contours.push_back(against_mirrored(plan, bones, fits, reference, symmetry, why_not, draws, params, context));

  const BoxMm box = bounds_of(jaw);
  const SymmetryPlane middle = symmetry.value_or(SymmetryPlane{(box.lo + box.hi) / 2, {1, 0, 0}, 0, 0});
  for (const double side : {1.0, -1.0}) {
    CondyleOutcome& c = out.condyles.emplace_back();
    c.side = side > 0 ? "left" : "right";
    const auto at = condyle(jaw, middle, side);
    if (!at) {
      c.pose.why = "the surface of the '" + jaw_name + "' shows no condyle on this side";
      continue;
    }
    std::size_t of = fits.size();
    double nearest = kOnFragmentMm;
    for (std::size_t n = 0; n < fits.size(); ++n) {
      if (plan.fragments[n].bone != jaw_name) continue;
      for (const SurfacePlace& p : places[n]) {
        if (length(p.at - *at) >= nearest) continue;
        nearest = length(p.at - *at);
        of = n;
      }
    }
    if (of == fits.size()) {
      c.pose.why = "no fragment of the plan holds it";
      continue;
    }
    const PlannedFragment& f = plan.fragments[of];
    c.pose.name = f.name;
    c.pose.middle_mm = f.planned_from_ct(*at);
    if (of == reference) {
      c.pose.reference = true;
      c.pose.why = "it is a part of the reference, which the others are held against";
      continue;
    }
    if (!found(fits[of])) {
      c.pose.why = "its fragment is not found";
      continue;
    }
    c.pose.found = fits[of]->found;
    c.pose.postop_from_ct = fits[of]->pose;
    deviation(c.pose, f, *fits[of], *fits[reference], params);
    judge(c.pose, params);
  }
}

}  // namespace osteo::inline session::outcome
