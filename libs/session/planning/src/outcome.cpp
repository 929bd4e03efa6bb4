#include "osteo/session/planning/detail/outcome.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "edge_fit.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/parallel.h"
#include "osteo/core/base/param.h"
#include "osteo/core/base/portable_math.h"
#include "outcome_parts.h"
#include "section.h"

namespace osteo::inline session {
namespace outcome {
namespace {

using planning::EdgeReader;
using planning::Equation;
using planning::Row;
using planning::Solved;

constexpr std::size_t kCoarsePlaces = 250;
constexpr double kPatchMm = 8, kFaceStepMm = 0.6, kFaceRimMm = 0.8;
// Off by less than this, an edge is never left out. With 0.25 mm those beside another face or other bone stayed in, and
// moved cuts by 0.02 mm and 0.15 degrees where noise did nothing.
constexpr double kAlwaysKeptMm = 0.1;
// How far errors go together is not known: noise over 1 to 2 mm, the phase of the grid and streaks over several. Of a
// face, patches are as large as leaves this many; Student's quantile pays for there being few.
constexpr std::size_t kFacePatches = 8;
constexpr double kSmallestFacePatchMm = 4;
constexpr double kFaceReachMm = 2.5, kFaceDropShare = 0.6, kRiseShare = 0.15, kMinFaceSeen = 0.12;
// A face's edge is read where the bone behind it is dense: 1.6 mm behind it, bone that gives way to marrow falls off
// about twice as fast as at the edge, so half of that slope is taken off. With all of it, and as near to marrow as a
// drop of 0.6 is, faces were tilted by 0.03 degrees (root mean square) without any noise, on voxels of each size; and
// the noise of the slopes was a sixth of that of tilts.
constexpr double kDenseShare = 0.9, kLeastDense = 0.5, kPulledShare = 0.5;
constexpr double kBrighterHu = 150, kMetalMm = 8;
// Where edges say nothing, a pose stays where it is wanted: a shaft slides in its own surface. Weights against those of
// 2000 edges: what these do say is moved by less than a thousandth.
constexpr Row<7> kHold{0.01, 0.01, 0.01, 0.5, 0.5, 0.5, 0};
constexpr int kRounds = 40, kSettleRounds = 4;

// How well edges are met: the mean drop across the surface.
double coarse_score(const EdgeReader& ct, const std::vector<SurfacePlace>& places, const RigidTransform& pose) {
  double sum = 0;
  for (std::size_t n = 0; n < places.size(); n += places.size() / kCoarsePlaces + 1) {
    const Vec3 p = pose(places[n].at), d = pose.rotation * places[n].normal;
    const auto in = ct.value(p - d * 1.2), out = ct.value(p + d * 1.2);
    if (in && out) sum += std::clamp(*in - *out, -1000.0, 1000.0);
  }
  return sum;
}

// Edges upon the surface by least squares over turn, shift and offset; the reach shrinks, and what is off by more than
// three times the usual is left out.
std::optional<Fit> refined(const EdgeReader& ct, const std::vector<SurfacePlace>& places, const RigidTransform& start,
                           const RigidTransform& wanted, double reach, const Context& context) {
  Fit fit;
  fit.pose = start;
  std::vector<std::optional<EdgeReader::Edge>> edges(places.size());
  for (int round = 0; round < kRounds; ++round) {
    context.check_cancelled();
    const double here = std::max(1.8, reach * std::pow(0.75, round));
    parallel_for(places.size(), 64, context.threads, [&](std::size_t begin, std::size_t end) {
      for (std::size_t n = begin; n < end; ++n) {
        const Vec3 at = fit.pose(places[n].at);
        edges[n].reset();
        if (ct.metal_mm(at) < kMetalMm) continue;
        edges[n] = ct.along(at, fit.pose.rotation * places[n].normal, here);
        if (edges[n] && edges[n]->rise_hu > kRiseShare * edges[n]->drop_hu) edges[n].reset();
      }
    });
    std::vector<double> at, drops, steps, beyond, off;
    for (const auto& e : edges) {
      if (!e) continue;
      at.push_back(e->at_mm);
      drops.push_back(e->drop_hu);
      steps.push_back(e->step_hu);
      beyond.push_back(e->beyond_hu);
    }
    const double common = median_of(at);
    for (const double v : at) off.push_back(std::abs(v - common));
    const double limit = std::max(kAlwaysKeptMm, 3 * 1.4826 * median_of(off));
    fit.drop = median_of(drops);
    fit.beyond = median_of(beyond);
    fit.blur = EdgeReader::blur_mm(median_of(steps), fit.drop);
    fit.middle = {};
    std::vector<std::size_t> kept;
    for (std::size_t n = 0; n < edges.size(); ++n) {
      if (!edges[n] || std::abs(edges[n]->at_mm - common) > limit) continue;
      kept.push_back(n);
      fit.middle += fit.pose(places[n].at);
    }
    fit.found = static_cast<double>(kept.size()) / static_cast<double>(places.size());
    if (kept.size() < 60) return std::nullopt;
    fit.middle = fit.middle / static_cast<double>(kept.size());
    std::vector<Equation<7>> all;
    for (const std::size_t n : kept) {
      const Vec3 d = fit.pose.rotation * places[n].normal, m = cross(fit.pose(places[n].at) - fit.middle, d);
      all.push_back({{d.x, d.y, d.z, m.x, m.y, m.z, 1}, edges[n]->at_mm, patch_of(places[n].at, kPatchMm)});
    }
    const RigidTransform back = wanted * fit.pose.inverse();
    const Vec3 b = back(fit.middle) - fit.middle, w = rotation_vector(back.rotation);
    const auto solved = planning::least_squares<7>(all, kHold, {b.x, b.y, b.z, w.x, w.y, w.z, 0});
    if (!solved) return std::nullopt;
    const auto& s = solved->step;
    double squares = 0;
    for (const auto& e : all) {
      double left = e.rest;
      for (std::size_t k = 0; k < 7; ++k) left -= e.slope[k] * s[k];
      squares += left * left;
    }
    fit.rms = std::sqrt(squares / static_cast<double>(all.size()));
    fit.covariance = solved->covariance;
    fit.quantile = solved->quantile;
    fit.offset = s[6];
    Vec3 turn{s[3], s[4], s[5]};
    if (length(turn) > 0.1) turn = normalized(turn) * 0.1;
    fit.pose = small_motion(fit.middle, {s[0], s[1], s[2]}, turn) * fit.pose;
    if (round > kSettleRounds && std::abs(s[0]) + std::abs(s[1]) + std::abs(s[2]) < 1e-4 && length(turn) < 1e-6) break;
  }
  return fit;
}

struct Search {
  double shift_mm = 0, step_mm = 1, turn_deg = 0;
  std::size_t keep = 4;
};

std::optional<Fit> located(const EdgeReader& ct, const std::vector<SurfacePlace>& places, const RigidTransform& guess,
                           const Search& search, const Context& context) {
  Vec3 middle;
  for (const auto& p : places) middle += guess(p.at) / static_cast<double>(places.size());
  std::vector<RigidTransform> starts;
  const int steps = static_cast<int>(search.shift_mm / search.step_mm);
  for (int turn = 0; turn < 7; ++turn) {
    Vec3 about;
    if (turn > 0) about[static_cast<std::size_t>(turn - 1) / 2] = (turn % 2 == 0 ? 1 : -1) * search.turn_deg * kDeg;
    for (int x = -steps; x <= steps; ++x)
      for (int y = -steps; y <= steps; ++y)
        for (int z = -steps; z <= steps; ++z)
          starts.push_back(small_motion(middle, Vec3(x, y, z) * search.step_mm, about) * guess);
  }
  std::vector<double> score(starts.size());
  parallel_for(starts.size(), 16, context.threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) score[n] = coarse_score(ct, places, starts[n]);
  });
  std::vector<std::size_t> order(starts.size());
  for (std::size_t n = 0; n < order.size(); ++n) order[n] = n;
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return score[a] > score[b]; });
  std::optional<Fit> best;
  for (std::size_t n = 0; n < std::min(search.keep, order.size()); ++n) {
    auto fit = refined(ct, places, starts[order[n]], guess, 1.5 * search.step_mm + 2, context);
    if (fit && (!best || fit->found > best->found + 0.02 || (fit->found > best->found - 0.02 && fit->rms < best->rms)))
      best = std::move(fit);
  }
  return best;
}

bool within(const std::vector<planning::Loop>& loops, const planning::Point2& p) {
  bool in = false;
  for (const auto& loop : loops) {
    for (std::size_t n = 0; n < loop.size(); ++n) {
      const auto &a = loop[n], &b = loop[(n + 1) % loop.size()];
      if ((a[1] > p[1]) != (b[1] > p[1]) && p[0] < a[0] + (b[0] - a[0]) * (p[1] - a[1]) / (b[1] - a[1])) in = !in;
    }
  }
  return in;
}

// Places of the planned face, away from its rim; of the outline that holds the plane's place or is nearest to it.
std::vector<planning::Point2> face_places(const TriangleSoup& bone, const planning::Sheet& sheet) {
  auto outline = planning::outline_near(bone, sheet, sheet.at_mm, 40);
  if (!outline) return {};
  std::vector<planning::Loop> loops = planning::section(bone, sheet);
  std::array<double, 4> box{1e9, 1e9, -1e9, -1e9};
  for (const auto& p : *outline)
    box = {std::min(box[0], p[0]), std::min(box[1], p[1]), std::max(box[2], p[0]), std::max(box[3], p[1])};
  std::vector<planning::Point2> out;
  const std::vector<planning::Loop> only{*outline};
  for (double y = box[1]; y <= box[3]; y += kFaceStepMm) {
    for (double x = box[0]; x <= box[2]; x += kFaceStepMm) {
      bool all = within(only, {x, y});
      for (int k = 0; all && k < 9; ++k) {
        const auto [sin, cos] = portable::sin_cos(k * 45 * kDeg);
        const double rim = k < 8 ? kFaceRimMm : 0;
        all = within(loops, {x + rim * cos, y + rim * sin});
      }
      if (all) out.push_back({x, y});
    }
  }
  return out;
}

CutOutcome cut_of(const CutPlane& plane, const std::string& fragment, const TriangleSoup& bone, const Fit& fit,
                  const EdgeReader& ct, const OutcomeParams& params) {
  CutOutcome out;
  out.plane = plane.name;
  out.fragment = fragment;
  const Vec3 e = plane.waste_ahead ? plane.normal : -plane.normal;
  const planning::Sheet sheet(plane.at_mm, e);
  out.axes = {sheet.axes.column[0], sheet.axes.column[1]};
  const auto places = face_places(bone, sheet);
  std::vector<std::pair<planning::Point2, double>> seen;
  std::vector<double> drops;
  for (const auto& p : places) {
    const Vec3 place = fit.pose(sheet.world(p));
    if (ct.metal_mm(place) < kMetalMm) continue;
    const auto edge = ct.along(place, fit.pose.rotation * e, kFaceReachMm);
    if (!edge || edge->drop_hu < kFaceDropShare * fit.drop || edge->rise_hu > kRiseShare * edge->drop_hu ||
        edge->beyond_hu > fit.beyond + kBrighterHu)
      continue;
    seen.push_back({p, edge->at_mm - kPulledShare * edge->pulled * fit.blur - fit.offset});
    drops.push_back(edge->drop_hu);
  }
  out.seen = places.empty() ? 0 : static_cast<double>(seen.size()) / static_cast<double>(places.size());
  if (places.size() < 30 || out.seen < kMinFaceSeen) {
    out.why = "the CT shows too little of an edge there: the face lies upon other bone, is healed or covered";
    return out;
  }
  const double dense = kDenseShare * quantile_of(drops, 0.9);
  std::vector<std::pair<planning::Point2, double>> best;
  for (std::size_t n = 0; n < seen.size(); ++n)
    if (drops[n] > dense) best.push_back(seen[n]);
  if (static_cast<double>(best.size()) > kLeastDense * static_cast<double>(seen.size())) seen = std::move(best);
  planning::Point2 middle{};
  for (const auto& p : places)
    for (std::size_t a = 0; a < 2; ++a) middle[a] += p[a] / static_cast<double>(places.size());
  out.middle = middle;
  Row<3> plane_fit{};
  std::optional<Solved<3>> solved;
  for (int round = 0; round < 6; ++round) {
    std::vector<double> off;
    const auto left = [&](const auto& s) {
      return s.second - plane_fit[0] - plane_fit[1] * (s.first[0] - middle[0]) -
             plane_fit[2] * (s.first[1] - middle[1]);
    };
    for (const auto& s : seen) off.push_back(std::abs(left(s)));
    const double limit = round == 0 ? 1e9 : std::max(kAlwaysKeptMm, 3 * 1.4826 * median_of(off));
    std::vector<Equation<3>> all;
    for (double patch = kPatchMm; patch >= kSmallestFacePatchMm; --patch) {
      all.clear();
      std::set<std::array<int, 3>> patches;
      for (const auto& s : seen) {
        if (std::abs(left(s)) > limit) continue;
        const double x = s.first[0] - middle[0], y = s.first[1] - middle[1];
        all.push_back({{1, x, y}, left(s), patch_of({x, y, 0}, patch)});
        patches.insert(all.back().patch);
      }
      if (patches.size() >= kFacePatches) break;
    }
    solved = planning::least_squares<3>(all);
    if (!solved) break;
    for (std::size_t k = 0; k < 3; ++k) plane_fit[k] += solved->step[k];
  }
  if (!solved) {
    out.why = "too little of the face is seen";
    return out;
  }
  // The pose's own error moves the planned face under the edges: along its normal, and by turning it.
  const Vec3 at = fit.pose(sheet.world(middle));
  Mat3 to = transposed(fit.pose.rotation);
  to = {{transposed(sheet.axes) * to.column[0], transposed(sheet.axes) * to.column[1],
         transposed(sheet.axes) * to.column[2]}};
  const auto moves = at_place(fit, at, to);
  std::array<Row<7>, 3> slope{};
  for (std::size_t k = 0; k < 7; ++k) slope[0][k] = -moves[2][k] - (k == 6 ? 1 : 0);
  for (std::size_t k = 0; k < 6; ++k) {
    slope[1][k] = moves[4][k];  // h rises along x by minus the turn about y
    slope[2][k] = -moves[3][k];
  }
  const auto pose = planning::carried<7, 3>(slope, fit.covariance);
  const double quantile = std::max(solved->quantile, fit.quantile);
  const auto half = [&](std::size_t k) { return quantile * std::sqrt(solved->covariance[k][k] + pose[k][k]); };
  out.off_mm = {plane_fit[0], half(0)};
  for (std::size_t k = 0; k < 2; ++k)
    out.tilt_deg[k] = {portable::atan2(plane_fit[k + 1], 1) / kDeg, half(k + 1) / kDeg};
  out.angle_deg = portable::atan2(portable::hypot(plane_fit[1], plane_fit[2]), 1) / kDeg;
  out.known = out.off_mm.half <= params.max_unsure_mm && out.tilt_deg[0].half <= params.max_unsure_deg &&
              out.tilt_deg[1].half <= params.max_unsure_deg;
  if (!out.known) out.why = "the interval is wider than what is accepted";
  return out;
}

}  // namespace
}  // namespace outcome

Outcome measure_outcome(const SurgicalPlan& plan, const std::vector<std::pair<std::string, TriangleSoup>>& bones,
                        const Image& postop, const OutcomeParams& params, const Context& context) {
  for (const auto& [name, bone] : bones) planning::require_size_mm(bounds_of(bone), name, planning::kShortestBoneMm);
  outcome::require_plates(plan);
  const Frame& f = postop.frame;
  planning::require_size_mm({{}, {f.dims[0] * f.spacing_mm.x, f.dims[1] * f.spacing_mm.y, f.dims[2] * f.spacing_mm.z}},
                            "CT after surgery", planning::kShortestBoneMm);
  const planning::EdgeReader ct(postop, params.min_drop_hu, params.metal_hu);
  const std::size_t count = plan.fragments.size();
  std::vector<std::vector<const CutPlane*>> planes(count);
  std::vector<std::vector<outcome::SurfacePlace>> places(count);
  Outcome out;
  std::size_t reference = count;
  double largest = 0;
  for (std::size_t n = 0; n < count; ++n) {
    const PlannedFragment& f = plan.fragments[n];
    const TriangleSoup& bone = outcome::bone_called(bones, f.bone);
    require_sound(bone);
    for (const std::string& p : f.planes) planes[n].push_back(&plan.plane(p));
    places[n] = outcome::spread(bone, planes[n]);
    FragmentOutcome& o = out.fragments.emplace_back();
    o.name = f.name;
    BoxMm box;
    for (const auto& p : places[n]) {
      box.include(p.at);
      o.middle_mm += f.planned_from_ct(p.at) / static_cast<double>(places[n].size());
    }
    const double size = places[n].empty() ? 0 : length(box.hi - box.lo);
    if (!outcome::stays(f) || size <= largest) continue;
    largest = size;
    reference = n;
  }
  if (reference == count)
    throw Error(ExitCode::usage, "the plan moves every fragment", "one must stay, for the others to be compared with");
  context.progress(0.05, "reference");
  std::vector<std::optional<outcome::Fit>> fits(count);
  fits[reference] = outcome::located(ct, places[reference], {}, {20, 4, 8, 6}, context);
  if (!fits[reference] || fits[reference]->found < outcome::kMinFound)
    throw Error(ExitCode::failed, "'" + plan.fragments[reference].name + "' is not found in the CT after surgery",
                "'osteo register' brings a CT that lies elsewhere onto the plan's; both must be of one patient");
  for (std::size_t n = 0; n < count; ++n) {
    context.progress(0.2 + 0.8 * static_cast<double>(n) / static_cast<double>(count), plan.fragments[n].name);
    FragmentOutcome& o = out.fragments[n];
    const PlannedFragment& f = plan.fragments[n];
    o.reference = n == reference;
    if (!o.reference)
      fits[n] = outcome::located(ct, places[n], fits[reference]->pose * f.planned_from_ct, {4, 2, 6, 4}, context);
    if (!fits[n] || fits[n]->found < outcome::kMinFound) {
      o.why = "the CT does not show enough of its surface where it should be";
      for (const std::string& p : f.planes) {
        CutOutcome& c = out.cuts.emplace_back();
        c.plane = p;
        c.fragment = f.name;
        c.why = "its fragment is not found";
      }
      continue;
    }
    o.edge_mm = fits[n]->rms;
    o.found = fits[n]->found;
    o.postop_from_ct = fits[n]->pose;
    if (!o.reference) outcome::deviation(o, f, *fits[n], *fits[reference], params);
    outcome::judge(o, params);
    for (const CutPlane* p : planes[n]) {
      out.cuts.push_back(outcome::cut_of(*p, f.name, outcome::bone_called(bones, f.bone), *fits[n], ct, params));
      CutOutcome& c = out.cuts.back();
      if (!c.known && c.off_mm.half > params.max_unsure_mm && !(o.slides_along == Vec3{}))
        c.why = "the fragment's surface does not show where along itself it lies, so not where it was cut";
    }
  }
  outcome::find_contours(out, plan, bones, fits, places, reference, params, context);
  outcome::find_screws(out, plan, fits, ct, postop, params, context);
  outcome::find_plates(out, plan, fits, places, ct, postop, params, context);
  return out;
}

}  // namespace osteo::inline session
