#include "outcome_parts.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <utility>

#include "osteo/core/base/error.h"
#include "osteo/core/base/portable_math.h"
#include "solve.h"

namespace osteo::inline session::outcome {
namespace {

constexpr std::size_t kPlaces = 2000;
constexpr double kFromCutsMm = 2;

double area_of(const TriangleSoup& s, const std::array<std::uint32_t, 3>& t) {
  const Vec3 a = s.points_mm[t[0]];
  return length(cross(s.points_mm[t[1]] - a, s.points_mm[t[2]] - a)) / 2;
}

bool behind(const std::vector<const CutPlane*>& planes, Vec3 p, double by) {
  return std::all_of(planes.begin(), planes.end(), [&](const CutPlane* c) {
    return dot(p - c->at_mm, c->normal) * (c->waste_ahead ? 1 : -1) <= -by;
  });
}

// Triangles of what stays: behind the planes, and in one piece with what is nearest to the first one's place. Planes go
// on beyond the bone's section: behind one across the left of a jaw also lies the right ramus, which is another's.
// Without planes, of all pieces that of most area.
std::vector<bool> part(const TriangleSoup& bone, const std::vector<const CutPlane*>& planes) {
  std::vector<bool> in(bone.triangles.size());
  std::vector<double> nearness(bone.triangles.size());
  for (std::size_t n = 0; n < in.size(); ++n) {
    const auto& t = bone.triangles[n];
    const Vec3 middle = (bone.points_mm[t[0]] + bone.points_mm[t[1]] + bone.points_mm[t[2]]) / 3;
    in[n] = behind(planes, middle, kFromCutsMm);
    if (!planes.empty()) nearness[n] = -length(middle - planes[0]->at_mm);
  }
  const std::vector<std::uint32_t> piece = pieces_of(bone, in);
  if (planes.empty()) {
    std::vector<double> area(bone.triangles.size());
    for (std::size_t n = 0; n < in.size(); ++n) area[piece[n]] += area_of(bone, bone.triangles[n]);
    for (std::size_t n = 0; n < in.size(); ++n) nearness[n] = area[piece[n]];
  }
  std::size_t wanted = in.size();
  for (std::size_t n = 0; n < in.size(); ++n)
    if (in[n] && (wanted == in.size() || nearness[n] > nearness[wanted])) wanted = n;
  for (std::size_t n = 0; n < in.size(); ++n) in[n] = in[n] && piece[n] == piece[wanted];
  return in;
}

}  // namespace

const TriangleSoup& bone_called(const std::vector<std::pair<std::string, TriangleSoup>>& bones,
                                const std::string& name) {
  for (const auto& [called, bone] : bones)
    if (called == name) return bone;
  throw Error(ExitCode::usage, "the plan has fragments of the '" + name + "', whose surface is not given",
              "give the surface of each bone that the plan cuts");
}

std::vector<std::uint32_t> pieces_of(const TriangleSoup& s, const std::vector<bool>& in) {
  std::vector<std::uint32_t> piece(s.points_mm.size());
  for (std::size_t n = 0; n < piece.size(); ++n) piece[n] = static_cast<std::uint32_t>(n);
  const auto root = [&](std::uint32_t n) {
    while (piece[n] != n) n = piece[n] = piece[piece[n]];
    return n;
  };
  for (std::size_t n = 0; n < in.size(); ++n) {
    if (!in[n]) continue;
    const auto& t = s.triangles[n];
    piece[root(t[1])] = root(t[0]);
    piece[root(t[2])] = root(t[0]);
  }
  std::vector<std::uint32_t> number(s.points_mm.size(), std::numeric_limits<std::uint32_t>::max()), out(in.size());
  std::uint32_t count = 0;
  for (std::size_t n = 0; n < in.size(); ++n) {
    if (!in[n]) continue;
    std::uint32_t& of = number[root(s.triangles[n][0])];
    if (of == std::numeric_limits<std::uint32_t>::max()) of = count++;
    out[n] = of;
  }
  return out;
}

bool stays(const PlannedFragment& f) {
  return f.planned_from_ct.rotation == Mat3{} && f.planned_from_ct.shift_mm == Vec3{};
}

// Spread over the area of what stays, by the golden ratio; the same every time.
std::vector<SurfacePlace> spread(const TriangleSoup& bone, const std::vector<const CutPlane*>& planes) {
  std::vector<double> until;
  std::vector<std::size_t> of;
  double sum = 0;
  const std::vector<bool> in = part(bone, planes);
  for (std::size_t n = 0; n < bone.triangles.size(); ++n) {
    if (!in[n]) continue;
    until.push_back(sum += area_of(bone, bone.triangles[n]));
    of.push_back(n);
  }
  std::vector<SurfacePlace> out;
  for (std::size_t n = 0; n < kPlaces && sum > 0; ++n) {
    const double at = sum * (static_cast<double>(n) + 0.5) / static_cast<double>(kPlaces);
    const auto& t = bone.triangles[of[static_cast<std::size_t>(
        std::min(std::lower_bound(until.begin(), until.end(), at) - until.begin(),
                 static_cast<std::ptrdiff_t>(of.size()) - 1))]];
    double u = std::fmod(static_cast<double>(n) * 0.7548776662466927, 1.0);
    double v = std::fmod(static_cast<double>(n) * 0.5698402909980532, 1.0);
    if (u + v > 1) {
      u = 1 - u;
      v = 1 - v;
    }
    const Vec3 a = bone.points_mm[t[0]], b = bone.points_mm[t[1]], c = bone.points_mm[t[2]];
    out.push_back({a + (b - a) * u + (c - a) * v, normalized(cross(b - a, c - a)), sum / static_cast<double>(kPlaces)});
  }
  return out;
}

RigidTransform small_motion(Vec3 about, Vec3 shift, Vec3 turn) {
  RigidTransform r = length(turn) > 0 ? rotation_about(about, normalized(turn), length(turn)) : RigidTransform{};
  r.shift_mm += shift;
  return r;
}

Vec3 rotation_vector(const Mat3& m) {
  const Vec3 twice{m.column[1].z - m.column[2].y, m.column[2].x - m.column[0].z, m.column[0].y - m.column[1].x};
  const double sin = length(twice) / 2, cos = (m.column[0].x + m.column[1].y + m.column[2].z - 1) / 2;
  return sin < 1e-15 ? Vec3{} : twice * (portable::atan2(sin, cos) / (2 * sin));
}

double quantile_of(std::vector<double> v, double share) {
  if (v.empty()) return 0;
  const auto at = v.begin() + static_cast<std::ptrdiff_t>(static_cast<double>(v.size()) * share);
  std::nth_element(v.begin(), at, v.end());
  return *at;
}

double median_of(std::vector<double> v) {
  return quantile_of(std::move(v), 0.5);
}

std::array<int, 3> patch_of(Vec3 p, double size) {
  const auto whole = [&](double v) { return static_cast<int>(std::floor(v / size)); };
  return {whole(p.x), whole(p.y), whole(p.z)};
}

std::array<planning::Row<7>, 6> at_place(const Fit& fit, Vec3 place, const Mat3& axes) {
  std::array<planning::Row<7>, 6> out{};
  for (std::size_t k = 0; k < 6; ++k) {
    Vec3 shift, turn;
    (k < 3 ? shift : turn)[k % 3] = 1;
    const Vec3 moved = axes * (shift + cross(turn, place - fit.middle)), turned = axes * turn;
    for (std::size_t r = 0; r < 3; ++r) {
      out[r][k] = moved[r];
      out[r + 3][k] = turned[r];
    }
  }
  return out;
}

double half_along(const std::array<std::array<double, 3>, 3>& covariance, double quantile, Vec3 a) {
  double sum = 0;
  for (std::size_t r = 0; r < 3; ++r)
    for (std::size_t c = 0; c < 3; ++c) sum += a[r] * covariance[r][c] * a[c];
  return quantile * std::sqrt(std::max(0.0, sum));
}

Vec3 slide_of(const std::array<std::array<double, 3>, 3>& covariance, double quantile, double limit) {
  const Mat3 axes = planning::principal_axes(covariance);
  if (half_along(covariance, quantile, axes.column[0]) > limit &&
      half_along(covariance, quantile, axes.column[1]) <= limit)
    return axes.column[0];
  return {};
}

// Abramowitz and Stegun 7.1.26: to 1.5e-7.
double share_below(double x) {
  const double z = std::abs(x) / std::numbers::sqrt2, t = 1 / (1 + 0.3275911 * z);
  const double tail = 0.5 * t *
                      (0.254829592 + t * (-0.284496736 + t * (1.421413741 + t * (-1.453152027 + t * 1.061405429)))) *
                      portable::exp(-z * z);
  return x > 0 ? 1 - tail : tail;
}

double blur_of(const Fit& fit) {
  constexpr double kFilterMm = 0.5, kSharpest = 0.25, kWidest = 1.2;
  return std::clamp(std::sqrt(std::max(0.0, fit.blur * fit.blur - kFilterMm * kFilterMm)), kSharpest, kWidest);
}

double clip_of(const Image& ct) {
  double most = -std::numeric_limits<double>::infinity();
  std::size_t count = 0;
  for (std::size_t n = 0; n < ct.frame.voxel_count(); ++n) {
    const double v = static_cast<double>(ct.voxels[n]);
    if (v < most) continue;
    count = v > most ? 1 : count + 1;
    most = v;
  }
  return count >= 5 ? most : std::numeric_limits<double>::infinity();
}

void deviation(FragmentOutcome& out, const PlannedFragment& planned, const Fit& fit, const Fit& reference,
               const OutcomeParams& params) {
  const RigidTransform back = reference.pose.inverse();
  const RigidTransform d = back * fit.pose * planned.planned_from_ct.inverse();
  const Vec3 place = fit.pose(planned.planned_from_ct.inverse()(out.middle_mm));
  Vec3 shift = d(out.middle_mm) - out.middle_mm;
  const Vec3 turn = rotation_vector(d.rotation);
  const auto own = planning::carried<7, 6>(at_place(fit, place, back.rotation), fit.covariance);
  const auto other = planning::carried<7, 6>(at_place(reference, place, back.rotation), reference.covariance);
  const double quantile = std::max(fit.quantile, reference.quantile);
  std::array<std::array<double, 3>, 3> shifts{};
  for (std::size_t r = 0; r < 3; ++r)
    for (std::size_t c = 0; c < 3; ++c) shifts[r][c] = own[r][c] + other[r][c];
  out.slides_along = slide_of(shifts, quantile, params.max_unsure_mm);
  shift = shift - out.slides_along * dot(shift, out.slides_along);
  for (std::size_t k = 0; k < 3; ++k) {
    Vec3 axis;
    axis[k] = 1;
    out.shift_mm[k] = {shift[k], half_along(shifts, quantile, axis - out.slides_along * out.slides_along[k])};
    out.turn_deg[k] = {turn[k] / kDeg, quantile * std::sqrt(own[k + 3][k + 3] + other[k + 3][k + 3]) / kDeg};
  }
}

void judge(FragmentOutcome& out, const OutcomeParams& params) {
  out.known = true;
  for (std::size_t k = 0; k < 3; ++k)
    out.known =
        out.known && out.shift_mm[k].half <= params.max_unsure_mm && out.turn_deg[k].half <= params.max_unsure_deg;
  if (!out.known) out.why = "the interval is wider than what is accepted";
}

}  // namespace osteo::inline session::outcome
