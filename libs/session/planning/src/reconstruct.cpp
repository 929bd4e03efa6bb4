#include "osteo/session/planning/detail/reconstruct.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include "contour.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/portable_math.h"
#include "section.h"
#include "solve.h"

namespace osteo::inline session {
namespace {

using planning::kNearMm;
using planning::Loop;
using planning::Moments;
using planning::Plane;
using planning::Point2;
using planning::Sheet;

constexpr double kStepMm = 2, kMaxEndShiftMm = 2.5, kEndStepMm = 0.5;
constexpr double kMaxMeanMm = 5;  // beyond that it is no reconstruction
constexpr int kRolls = 48;

Vec3 vec(const std::array<double, 3>& a) {
  return {a[0], a[1], a[2]};
}

Vec3 direction(const std::array<double, 3>& a, const char* name) {
  const Vec3 v = vec(a);
  if (!(length(v) > 1e-9)) throw Error(ExitCode::usage, std::string(name) + " has no length", "give a direction");
  return normalized(v);
}

Vec3 turned_from_to(Vec3 v, Vec3 from, Vec3 to) {
  const Vec3 axis = cross(from, to);
  const double sin = length(axis), cos = dot(from, to);
  if (sin < 1e-12) return v;
  return rotation_about({}, axis / sin, portable::atan2(sin, cos))(v);
}

double deg(double rad) {
  return rad * 180 / std::numbers::pi;
}

// --- the donor ---------------------------------------------------------------------------------------------------

class Donor {
 public:
  Donor(const TriangleSoup& bone, Vec3 down) : bone_(bone) {
    if (bone.points_mm.empty()) throw Error(ExitCode::failed, "the donor bone has no points", "give its surface");
    Vec3 middle;
    for (const Vec3& p : bone.points_mm) middle += p;
    middle = middle / static_cast<double>(bone.points_mm.size());
    std::array<std::array<double, 3>, 3> spread{};
    for (const Vec3& p : bone.points_mm) {
      for (std::size_t a = 0; a < 3; ++a) {
        for (std::size_t b = 0; b < 3; ++b) spread[a][b] += (p - middle)[a] * (p - middle)[b];
      }
    }
    const Mat3 axes = planning::principal_axes(spread);
    axis_ = dot(axes.column[0], down) < 0 ? -axes.column[0] : axes.column[0];
    side_ = axes.column[1];
    double lo = std::numeric_limits<double>::max(), hi = -lo;
    for (const Vec3& p : bone.points_mm) {
      lo = std::min(lo, dot(p - middle, axis_));
      hi = std::max(hi, dot(p - middle, axis_));
    }
    length_ = hi - lo;
    const Vec3 start = middle + axis_ * lo;
    Vec3 last = start + axis_ * (kStepMm / 2);
    for (double s = kStepMm / 2; s < length_; s += kStepMm) {
      const Sheet sheet(start + axis_ * s, axis_);
      const auto loop = planning::outline_near(bone, sheet, last + axis_ * kStepMm, 2 * kNearMm);
      if (!loop) continue;
      const Moments m = planning::moments(*loop);
      last = sheet.world(m.centroid);
      Station station{s, last, m.area, {}};
      for (const Point2& p : *loop) station.ring.push_back(sheet.world(p));
      stations_.push_back(std::move(station));
    }
    if (stations_.size() < 10)
      throw Error(ExitCode::failed, "the donor bone shows no shaft", "give the closed surface of a long bone, in mm");
  }

  [[nodiscard]] double length_mm() const { return length_; }
  [[nodiscard]] double thickness_mm() const {
    return 2 * std::sqrt(stations_[stations_.size() / 2].area / std::numbers::pi);
  }
  [[nodiscard]] Vec3 centre(double s) const {
    const auto n = upper(s);
    const Station &a = stations_[n - 1], &b = stations_[n];
    const double t = (s - a.s) / (b.s - a.s);
    return a.centre * (1 - t) + b.centre * t;
  }
  [[nodiscard]] const std::vector<Vec3>& ring(double s) const { return stations_[upper(s)].ring; }
  /// Where the axis is `away` from the centre at s, further down.
  [[nodiscard]] double further(double s, double away) const {
    double lo = s, hi = s + 1.5 * away;
    const Vec3 from = centre(s);
    for (int n = 0; n < 60; ++n) {
      const double middle = (lo + hi) / 2;
      (length(centre(middle) - from) < away ? lo : hi) = middle;
    }
    return hi;
  }
  [[nodiscard]] Vec3 side() const { return side_; }
  [[nodiscard]] const TriangleSoup& bone() const { return bone_; }

 private:
  struct Station {
    double s;
    Vec3 centre;
    double area;
    std::vector<Vec3> ring;
  };
  [[nodiscard]] std::size_t upper(double s) const {
    const auto it = std::upper_bound(stations_.begin(), stations_.end(), s,
                                     [](double v, const Station& station) { return v < station.s; });
    return std::clamp<std::size_t>(static_cast<std::size_t>(it - stations_.begin()), 1, stations_.size() - 1);
  }

  const TriangleSoup& bone_;
  Vec3 axis_, side_;
  double length_ = 0;
  std::vector<Station> stations_;
};

// --- a chain of straight axes ------------------------------------------------------------------------------------

double to_chain(Vec3 p, const std::vector<Vec3>& chain) {
  double best = std::numeric_limits<double>::max();
  for (std::size_t n = 0; n + 1 < chain.size(); ++n)
    best = std::min(best, planning::to_segment(p, chain[n], chain[n + 1]));
  return best;
}

double mean_square(const std::vector<Vec3>& contour, const std::vector<Vec3>& chain) {
  double sum = 0;
  for (const Vec3& p : contour) {
    const double d = to_chain(p, chain);
    sum += d * d;
  }
  return sum / static_cast<double>(contour.size());
}

// Corners move one direction at a time, ends within their planes or not at all.
void fit_chain(const std::vector<Vec3>& contour, std::vector<Vec3>& chain, const Plane& a, const Plane& b,
               bool ends_move, double min_length) {
  const auto cost = [&] {
    double c = mean_square(contour, chain);
    for (std::size_t n = 0; n + 1 < chain.size(); ++n) {
      const double lacks = std::max(0.0, min_length - length(chain[n + 1] - chain[n]));
      c += 10 * lacks * lacks;
    }
    return c;
  };
  const Sheet sheet_a(a.at, a.normal), sheet_b(b.at, b.normal);
  double best = cost();
  for (double step = 2; step > 0.004; step /= 2) {
    for (int round = 0; round < 200; ++round) {
      bool better = false;
      for (std::size_t n = 0; n < chain.size(); ++n) {
        const bool end = n == 0 || n + 1 == chain.size();
        if (end && !ends_move) continue;
        for (std::size_t axis = 0; axis < (end ? 2U : 3U); ++axis) {
          const Vec3 d = n == 0 ? sheet_a.axes.column[axis] : end ? sheet_b.axes.column[axis] : Mat3{}.column[axis];
          for (const double sign : {1.0, -1.0}) {
            const Vec3 was = chain[n];
            chain[n] += d * (sign * step);
            // However long segments must be, they end in the bone.
            const bool astray = end && length(chain[n] - (n == 0 ? contour.front() : contour.back())) > kMaxEndShiftMm;
            const double c = astray ? best : cost();
            if (c < best - 1e-12) {
              best = c;
              better = true;
            } else {
              chain[n] = was;
            }
          }
        }
      }
      if (!better) break;
    }
  }
}

std::vector<Vec3> even_chain(const std::vector<Vec3>& contour, int segments) {
  std::vector<double> until{0};
  for (std::size_t n = 1; n < contour.size(); ++n) until.push_back(until.back() + length(contour[n] - contour[n - 1]));
  std::vector<Vec3> chain;
  for (int k = 0; k <= segments; ++k) {
    const double s = until.back() * k / segments;
    const auto it = std::lower_bound(until.begin() + 1, until.end() - 1, s);
    const auto n = static_cast<std::size_t>(it - until.begin());
    const double t = std::clamp((s - until[n - 1]) / std::max(until[n] - until[n - 1], 1e-12), 0.0, 1.0);
    chain.push_back(contour[n - 1] * (1 - t) + contour[n] * t);
  }
  return chain;
}

// --- segments of the donor in the chain --------------------------------------------------------------------------

struct Placed {
  std::vector<RigidTransform> jaw_from_donor;
  std::vector<DonorSegment> segments;
  std::vector<double> contact;
  std::vector<Loop> end_faces;  // of the first and the last segment, in the sheets of the resection planes
  double used_to_mm = 0;
  double mean_contact = 0;
};

// Where a line along `axis` meets a plane.
double along(Vec3 p, Vec3 axis, const Plane& plane) {
  return -plane.ahead(p) / dot(axis, plane.normal);
}

Plane moved(const RigidTransform& t, const Plane& p) {
  return {t(p.at), t.rotation * p.normal};
}

class Placement {
 public:
  Placement(const TriangleSoup& jaw, const Donor& donor, const ReconstructionParams& params, const Plane& a,
            const Plane& b)
      : donor_(donor), params_(params), a_(a), b_(b), sheets_{Sheet(a.at, a.normal), Sheet(b.at, b.normal)} {
    for (std::size_t e = 0; e < 2; ++e) {
      auto face = planning::outline_near(jaw, sheets_[e], e == 0 ? a.at : b.at, kNearMm);
      if (!face)
        throw Error(ExitCode::failed, std::string("the jaw has no closed section in resection plane ") + "ab"[e],
                    "its place must lie in the bone, and the surface be closed");
      jaw_faces_[e] = *face;
    }
  }

  /// The planes between segments, from a to b, facing along the chain.
  [[nodiscard]] std::vector<Plane> joints(const std::vector<Vec3>& chain) const {
    std::vector<Plane> out{{chain.front(), a_.normal}};
    for (std::size_t n = 1; n + 1 < chain.size(); ++n)
      out.push_back({chain[n], normalized(normalized(chain[n] - chain[n - 1]) + normalized(chain[n + 1] - chain[n]))});
    out.push_back({chain.back(), -b_.normal});
    return out;
  }

  /// Nothing where the donor is too short or a face is not there.
  [[nodiscard]] std::optional<Placed> place(const std::vector<Vec3>& chain, double roll) const {
    const std::vector<Plane> joint = joints(chain);
    Placed out;
    double from = params_.reserve_mm;
    Vec3 side, last_heading;
    for (std::size_t n = 0; n + 1 < chain.size(); ++n) {
      const double size = length(chain[n + 1] - chain[n]);
      const Vec3 heading = (chain[n + 1] - chain[n]) / size;
      side = n == 0 ? rotation_about({}, heading, roll)(any_perpendicular(heading))
                    : turned_from_to(side, last_heading, heading);
      last_heading = heading;
      RigidTransform t;
      // The first face of this segment is one kerf beyond the last of the one before, where they come nearest. The
      // donor's bow turns the segment as it moves along, so that takes a few rounds.
      for (int round = 0; round < 8; ++round) {
        if (donor_.length_mm() - params_.reserve_mm < from + size) return std::nullopt;
        t = transform(from, size, chain[n], heading, side);
        if (n == 0) break;
        const Plane before = moved(out.jaw_from_donor.back().inverse(), joint[n]), here = moved(t.inverse(), joint[n]);
        const Vec3 axis = t.inverse().rotation * heading;
        const double slant = std::min(std::abs(dot(axis, before.normal)), std::abs(dot(axis, here.normal)));
        double gap = std::numeric_limits<double>::max();
        for (const Vec3& p : donor_.ring(from)) gap = std::min(gap, along(p, axis, here) - along(p, axis, before));
        const double lacks = params_.kerf_mm / slant - gap;
        if (std::abs(lacks) < 1e-6) break;
        from += lacks;
      }
      out.jaw_from_donor.push_back(t);
      const Plane start = moved(t.inverse(), joint[n]), end = moved(t.inverse(), joint[n + 1]);
      const Vec3 axis = t.inverse().rotation * heading;
      const double to = donor_.further(from, size);
      double shortest = std::numeric_limits<double>::max();
      for (const Vec3& p : donor_.ring((from + to) / 2))
        shortest = std::min(shortest, along(p, axis, end) - along(p, axis, start));
      out.segments.push_back({size, shortest, from});
      from = out.used_to_mm = to;
    }
    for (std::size_t j = 0; j < joint.size(); ++j) {
      const Sheet sheet(joint[j].at, joint[j].normal);
      std::vector<Loop> faces;
      if (j == 0 || j + 1 == joint.size()) {
        const std::size_t e = j == 0 ? 0 : 1;
        Loop face;
        for (const Point2& p : jaw_faces_[e]) face.push_back(sheet.local(sheets_[e].world(p)));
        faces.push_back(std::move(face));
      }
      for (const std::size_t n : {j, j + 1}) {  // segments j - 1 and j
        if (n == 0 || n > out.jaw_from_donor.size()) continue;
        const RigidTransform& t = out.jaw_from_donor[n - 1];
        const Plane own = moved(t.inverse(), joint[j]);
        const Sheet own_sheet(own.at, own.normal);
        const auto loop = planning::outline_near(donor_.bone(), own_sheet, own.at, kNearMm);
        if (!loop) return std::nullopt;
        Loop face;
        for (const Point2& p : *loop) face.push_back(sheet.local(t(own_sheet.world(p))));
        faces.push_back(std::move(face));
      }
      // By the same rows, so that equal faces touch wholly and not a little more.
      const double smaller =
          std::min(planning::common_area(faces[0], faces[0]), planning::common_area(faces[1], faces[1]));
      out.contact.push_back(smaller > 0 ? planning::common_area(faces[0], faces[1]) / smaller : 0);
      out.mean_contact += out.contact.back() / static_cast<double>(joint.size());
      if (j == 0 || j + 1 == joint.size()) out.end_faces.push_back(std::move(faces[1]));
    }
    return out;
  }

  [[nodiscard]] std::optional<Placed> best_roll(const std::vector<Vec3>& chain, const Context& context) const {
    std::optional<Placed> best;
    for (int r = 0; r < kRolls; ++r) {
      context.check_cancelled();
      auto placed = place(chain, 2 * std::numbers::pi * r / kRolls);
      if (placed && (!best || placed->mean_contact > best->mean_contact)) best = std::move(placed);
    }
    return best;
  }

  /// Ends moved within their planes to where the faces touch most; 3 % of the face for each millimetre is the price.
  void move_ends(std::vector<Vec3>& chain, const Placed& placed) const {
    const std::vector<Plane> joint = joints(chain);
    for (std::size_t e = 0; e < 2; ++e) {
      const Plane& plane = e == 0 ? joint.front() : joint.back();
      const Sheet sheet(plane.at, plane.normal);
      Loop face;
      for (const Point2& p : jaw_faces_[e]) face.push_back(sheet.local(sheets_[e].world(p)));
      const double smaller = std::min(planning::moments(face).area, planning::moments(placed.end_faces[e]).area);
      double best = -1;
      Point2 shift{};
      const int steps = static_cast<int>(kMaxEndShiftMm / kEndStepMm);
      for (int x = -steps; x <= steps; ++x) {
        for (int y = -steps; y <= steps; ++y) {
          const Point2 s{x * kEndStepMm, y * kEndStepMm};
          const double away = std::sqrt(s[0] * s[0] + s[1] * s[1]);
          if (away > kMaxEndShiftMm) continue;
          Loop there = placed.end_faces[e];
          for (Point2& p : there) p = {p[0] + s[0], p[1] + s[1]};
          const double value = planning::common_area(face, there) / smaller - 0.03 * away;
          if (value <= best) continue;
          best = value;
          shift = s;
        }
      }
      (e == 0 ? chain.front() : chain.back()) = sheet.world(shift);
    }
  }

 private:
  [[nodiscard]] RigidTransform transform(double from, double size, Vec3 corner, Vec3 heading, Vec3 side) const {
    const Vec3 start = donor_.centre(from);
    const Vec3 axis = normalized(donor_.centre(donor_.further(from, size)) - start);
    const Vec3 own_side = normalized(donor_.side() - axis * dot(donor_.side(), axis));
    const Mat3 own{{own_side, cross(axis, own_side), axis}};
    const Vec3 across = normalized(side - heading * dot(side, heading));
    const Mat3 wanted{{across, cross(heading, across), heading}};
    RigidTransform t;
    const Mat3 back = transposed(own);
    for (std::size_t c = 0; c < 3; ++c) t.rotation.column[c] = wanted * back.column[c];
    t.shift_mm = corner - t.rotation * start;
    return t;
  }

  const Donor& donor_;
  const ReconstructionParams& params_;
  Plane a_, b_;
  std::array<Sheet, 2> sheets_;
  std::array<Loop, 2> jaw_faces_;
};

SurgicalPlan plan_from(const Placed& placed, const std::vector<Plane>& joint, const Plane& a, const Plane& b,
                       double kerf) {
  SurgicalPlan plan;
  plan.planes = {{"resection a", "mandible", a.at, a.normal, kerf, true},
                 {"resection b", "mandible", b.at, b.normal, kerf, true}};
  plan.fragments = {{"mandible at a", "mandible", {"resection a"}, {}},
                    {"mandible at b", "mandible", {"resection b"}, {}}};
  for (std::size_t n = 0; n < placed.segments.size(); ++n) {
    const std::string name = "segment " + std::to_string(n + 1);
    const RigidTransform back = placed.jaw_from_donor[n].inverse();
    const Plane start = moved(back, joint[n]), end = moved(back, joint[n + 1]);
    plan.planes.push_back({name + " start", "fibula", start.at, normalized(-start.normal), kerf, true});
    plan.planes.push_back({name + " end", "fibula", end.at, normalized(end.normal), kerf, true});
    plan.fragments.push_back({name, "fibula", {name + " start", name + " end"}, placed.jaw_from_donor[n]});
  }
  return plan;
}

}  // namespace

double donor_thickness_mm(const TriangleSoup& donor) {
  require_sound(donor);
  return Donor(donor, {0, 0, -1}).thickness_mm();
}

Reconstruction reconstruct(const TriangleSoup& jaw, const TriangleSoup& donor_bone, const ReconstructionParams& params,
                           const Context& context) {
  require_sound(jaw);
  require_sound(donor_bone);
  planning::require_size_mm(bounds_of(jaw), "mandible", planning::kShortestBoneMm);
  planning::require_size_mm(bounds_of(donor_bone), "donor bone", planning::kShortestDonorMm);
  const Plane a{vec(params.a_mm), direction(params.a_normal, "--a-normal")};
  const Plane b{vec(params.b_mm), direction(params.b_normal, "--b-normal")};
  const Vec3 down = direction(params.down, "--down");
  const Donor donor(donor_bone, {0, 0, -1});
  Reconstruction out;
  out.donor_thickness_mm = donor.thickness_mm();
  TriangleSoup target = jaw;
  if (params.target == ReconstructionTarget::mirrored) {
    out.symmetry = find_symmetry_plane(jaw, context);
    target = mirrored(jaw, *out.symmetry);
  }
  context.progress(0.4, "contour");
  out.contour_mm = planning::contour_of(target, a, b, down, out.donor_thickness_mm);
  const Placement placement(jaw, donor, params, a, b);
  struct Candidate {
    std::vector<Vec3> chain;
    Placed placed;
    double mean = 0;
  };
  std::optional<Candidate> best;
  bool short_donor = false;
  double longest_short = 0;
  for (int segments = 1; segments <= params.max_segments; ++segments) {
    context.progress(0.4 + 0.6 * segments / (params.max_segments + 1), "segments");
    std::vector<Vec3> chain = even_chain(out.contour_mm, segments);
    // Where the contour's first and last place are in their planes, so are the ends.
    chain.front() = chain.front() - a.normal * a.ahead(chain.front());
    chain.back() = chain.back() - b.normal * b.ahead(chain.back());
    // The shortest line of a segment falls short of its axis by what slanted ends take, half on each side.
    double wanted = params.min_length_mm;
    std::optional<Placed> placed;
    for (int round = 0; round < 3; ++round) {
      fit_chain(out.contour_mm, chain, a, b, round == 0, wanted);
      placed = placement.best_roll(chain, context);
      if (!placed) break;
      if (round == 2) break;
      if (round == 0) placement.move_ends(chain, *placed);
      for (const DonorSegment& s : placed->segments)
        wanted = std::max(wanted, params.min_length_mm + (s.length_mm - s.shortest_mm));
    }
    if (!placed) {
      short_donor = true;
      continue;
    }
    double shortest = std::numeric_limits<double>::max();
    for (const DonorSegment& s : placed->segments) shortest = std::min(shortest, s.shortest_mm);
    if (shortest < params.min_length_mm) {
      longest_short = std::max(longest_short, shortest);
      continue;
    }
    double mean = 0;
    for (const Vec3& p : out.contour_mm) mean += to_chain(p, chain) / static_cast<double>(out.contour_mm.size());
    if (mean > kMaxMeanMm || (best && mean >= best->mean)) continue;
    best = Candidate{chain, std::move(*placed), mean};
    if (mean <= params.max_contour_mm) break;
  }
  if (!best) {
    if (short_donor && longest_short == 0)
      throw Error(ExitCode::failed,
                  "the donor bone of " + format_number(std::round(donor.length_mm())) +
                      " mm is too short for this gap with --reserve-mm at both ends",
                  "plan a shorter resection, or leave less of the donor where that is safe");
    throw Error(
        ExitCode::failed,
        "no number of segments keeps to --min-length-mm and within 5 mm of the contour; the longest of those too "
        "short has " +
            planning::rounded(longest_short, 1) + " mm",
        "a gap this short needs no segment of this length");
  }
  if (best->mean > params.max_contour_mm)
    context.warn("the contour is met to " + planning::rounded(best->mean, 2) +
                 " mm on average, not to --max-contour-mm: longer segments than the curve wants, or too few");
  out.axis_mm = best->chain;
  out.segments = best->placed.segments;
  out.contact = best->placed.contact;
  out.contour_mean_mm = best->mean;
  for (const Vec3& p : out.contour_mm) out.contour_max_mm = std::max(out.contour_max_mm, to_chain(p, best->chain));
  for (std::size_t n = 1; n + 1 < best->chain.size(); ++n) {
    const Vec3 u = normalized(best->chain[n] - best->chain[n - 1]), v = normalized(best->chain[n + 1] - best->chain[n]);
    out.wedge_deg.push_back(deg(portable::atan2(length(cross(u, v)), dot(u, v))));
  }
  out.donor_used_mm = best->placed.used_to_mm - params.reserve_mm;
  out.plan = plan_from(best->placed, placement.joints(best->chain), a, b, params.kerf_mm);
  return out;
}

}  // namespace osteo::inline session
