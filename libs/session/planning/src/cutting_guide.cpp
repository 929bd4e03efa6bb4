#include "osteo/session/planning/detail/cutting_guide.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "glyphs.h"
#include "guide_parts.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/portable_math.h"
#include "section.h"

namespace osteo::inline session {
namespace guide {
namespace {

constexpr double kBetweenSlotsMm = 2.5, kBesideSectionMm = 1, kSectionNearMm = 40, kTiltLimit = 0.35;
constexpr double kMaxHeightMm = 40, kWedgeMm = 0.02, kLeastSeatMm2 = 20;
constexpr double kNotHeldMm = 5, kNotHeldDeg = 5, kMostPlayDeg = 1, kPressedMm = 1e-4;

struct Axes {
  Vec3 origin;
  Mat3 to;  // columns x, y, z in the CT
  [[nodiscard]] Vec3 local(Vec3 p) const { return turned(p - origin); }
  [[nodiscard]] Vec3 turned(Vec3 v) const { return {dot(v, to.column[0]), dot(v, to.column[1]), dot(v, to.column[2])}; }
  [[nodiscard]] Vec3 world(Vec3 p) const { return origin + to * p; }
};

std::string trimmed(const std::string& s) {
  const auto from = s.find_first_not_of(' '), to = s.find_last_not_of(' ');
  return from == std::string::npos ? "" : s.substr(from, to - from + 1);
}

std::vector<CutPlane> wanted_planes(const SurgicalPlan& plan, const CuttingGuideParams& params) {
  std::string bone = params.bone;
  for (const CutPlane& p : plan.planes) {
    if (!params.bone.empty()) break;
    if (!bone.empty() && bone != p.bone)
      throw Error(ExitCode::usage, "the plan cuts more than one bone: " + bone + ", " + p.bone, "name one by --bone");
    bone = p.bone;
  }
  std::vector<CutPlane> out;
  for (std::size_t from = 0; !params.planes.empty() && from <= params.planes.size();) {
    const std::size_t to = std::min(params.planes.find(',', from), params.planes.size());
    const CutPlane& p = plan.plane(trimmed(params.planes.substr(from, to - from)));
    if (p.bone != bone)
      throw Error(ExitCode::usage, "plane '" + p.name + "' cuts the " + p.bone + ", not the " + bone,
                  "one guide is for one bone");
    out.push_back(p);
    from = to + 1;
  }
  for (const CutPlane& p : plan.planes)
    if (params.planes.empty() && p.bone == bone) out.push_back(p);
  if (out.empty())
    throw Error(ExitCode::usage, "the plan has no plane that cuts '" + bone + "'", "--bone is a name in the plan");
  return out;
}

Vec3 towards_waste(const CutPlane& p) {
  return p.waste_ahead ? p.normal : -p.normal;
}

// Along the bone: from the first plane to the last, or along the only one's normal.
Vec3 along_of(const std::vector<CutPlane>& planes) {
  double farthest = 0;
  Vec3 along = towards_waste(planes[0]);
  for (const CutPlane& a : planes) {
    for (const CutPlane& b : planes) {
      const double mm = length(b.at_mm - a.at_mm);
      if (mm <= farthest) continue;
      farthest = mm;
      along = (b.at_mm - a.at_mm) / mm;
    }
  }
  return along;
}

// Where wedges of waste open; else away from the bone's middle, which for a jaw is its outer side.
Vec3 chosen_approach(const TriangleSoup& bone, const std::vector<CutPlane>& planes, Vec3 along, Vec3 origin) {
  Vec3 opens;
  for (std::size_t n = 0; n + 1 < planes.size(); ++n) {
    const Vec3 a = towards_waste(planes[n]), b = towards_waste(planes[n + 1]);
    if (dot(a, along) <= 0 || dot(b, along) >= 0) continue;
    const auto slope = [&](Vec3 e) { return (along * dot(e, along) - e) / dot(e, along); };
    opens += slope(b) - slope(a);
  }
  if (length(opens) > kWedgeMm) return normalized(opens);
  Vec3 middle;
  for (const Vec3& p : bone.points_mm) middle += p / static_cast<double>(bone.points_mm.size());
  Vec3 away = origin - middle;
  away = away - along * dot(away, along);
  return length(away) > 1 ? normalized(away) : any_perpendicular(along);
}

Axes axes_of(const TriangleSoup& bone, std::vector<CutPlane>& planes, const CuttingGuideParams& params) {
  Axes a;
  for (const CutPlane& p : planes) a.origin += p.at_mm / static_cast<double>(planes.size());
  const Vec3 along = along_of(planes);
  std::stable_sort(planes.begin(), planes.end(), [&](const CutPlane& p, const CutPlane& q) {
    return dot(p.at_mm - a.origin, along) < dot(q.at_mm - a.origin, along);
  });
  Vec3 z{params.approach[0], params.approach[1], params.approach[2]};
  if (z == Vec3{}) z = chosen_approach(bone, planes, along, a.origin);
  z = normalized(z);
  const Vec3 across = z - along * dot(z, along);
  if (length(across) < kTiltLimit)
    throw Error(ExitCode::usage, "--approach runs along the bone", "give a direction away from the bone's side");
  z = normalized(across);
  a.to = {{along, cross(z, along), z}};
  return a;
}

GuideFace face_of(const CutPlane& p, const Axes& axes, double towards_waste_mm) {
  GuideFace f;
  f.n = axes.turned(towards_waste(p));
  f.c = dot(axes.local(p.at_mm), f.n) + towards_waste_mm;
  if (std::abs(f.n.x) < kTiltLimit)
    throw Error(ExitCode::failed, "plane '" + p.name + "' runs along the guide",
                "make a guide of its own for it by --planes");
  return f;
}

GuideOpening slot_of(const CutPlane& p, std::size_t index, const Axes& axes, double play) {
  const GuideFace stays = face_of(p, axes, -play / 2), other = face_of(p, axes, p.kerf_mm + play / 2);
  return stays.n.x > 0 ? GuideOpening{stays, other, {index}} : GuideOpening{other, stays, {index}};
}

// The least distance along the bone over the corners of where a guide can be.
double least_between(const GuideFace& a, const GuideFace& b, const GuideLayout& l, double lowest) {
  double least = std::numeric_limits<double>::infinity();
  for (const double y : {l.cut0, l.cut1})
    for (const double z : {lowest, l.top}) least = std::min(least, b.x(y, z) - a.x(y, z));
  return least;
}

// Slots that would run into each other become one opening, where what lies between is discarded.
void merge_openings(GuideLayout& l, const std::vector<CutPlane>& planes, const Axes& axes, double lowest,
                    const Context& context) {
  std::vector<GuideOpening> out;
  for (const GuideOpening& o : l.openings) {
    if (out.empty() || least_between(out.back().upper, o.lower, l, lowest) >= kBetweenSlotsMm) {
      out.push_back(o);
      continue;
    }
    const CutPlane &p = planes[out.back().cuts.back()], &q = planes[o.cuts[0]];
    const std::string both = "'" + p.name + "' and '" + q.name + "'";
    if (out.back().cuts.size() > 1 || axes.turned(towards_waste(p)).x < 0 || axes.turned(towards_waste(q)).x > 0)
      throw Error(ExitCode::failed, "between the slots of " + both + " the guide would be too thin",
                  "a guide for each of them (--planes) has room");
    GuideOpening merged{face_of(p, axes, 0), face_of(q, axes, 0), {out.back().cuts[0], o.cuts[0]}};
    const double room = least_between(merged.lower, merged.upper, l, lowest), kerf = std::max(p.kerf_mm, q.kerf_mm);
    if (room < kerf / 2)
      throw Error(ExitCode::failed, "the wedge between " + both + " closes towards the guide",
                  "put the guide on from the other side (--approach), or make a guide for each (--planes)");
    if (room < kerf)
      context.warn("the opening between " + both + " is narrower than the blade in one corner: " +
                   planning::rounded(room, 2) + " mm; the saw enters from its wide side");
    out.back() = merged;
  }
  l.openings = std::move(out);
}

// Ends of slots across the bone: its section in each plane, and a little more.
void slot_ends(const TriangleSoup& local, const std::vector<CutPlane>& planes, const Axes& axes, GuideLayout& l) {
  l.cut0 = 1e300;
  l.cut1 = -1e300;
  for (const CutPlane& p : planes) {
    const planning::Sheet sheet(axes.local(p.at_mm), axes.turned(p.normal));
    const auto outline = planning::outline_near(local, sheet, sheet.at_mm, kSectionNearMm);
    if (!outline)
      throw Error(ExitCode::failed, "plane '" + p.name + "' does not cut the bone near its place",
                  "the surface must be the plan's " + p.bone + ", closed, in the same CT");
    for (const auto& q : *outline) {
      l.cut0 = std::min(l.cut0, sheet.world(q).y - kBesideSectionMm);
      l.cut1 = std::max(l.cut1, sheet.world(q).y + kBesideSectionMm);
    }
  }
}

std::string code_of(const CuttingGuideParams& params) {
  std::string text;
  for (const char c : params.code) {
    const char upper = c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
    if (kGlyphNames.substr(0, 37).find(upper) == std::string_view::npos)
      throw Error(ExitCode::usage, std::string("--code has the character '") + c + "'",
                  "letters A to Z, digits and '-' can be engraved");
    text += upper;
  }
  return text;
}

GuideLayout layout_of(const TriangleSoup& local, const std::vector<CutPlane>& planes, const Axes& axes,
                      const CuttingGuideParams& params, Underside& under, const Context& context) {
  GuideLayout l;
  l.gap = params.gap_mm;
  slot_ends(local, planes, axes, l);
  l.y0 = l.cut0 - params.wall_mm;
  l.y1 = l.cut1 + params.wall_mm;
  if (params.slot == GuideSlot::open) l.cut1 = l.y1;
  for (std::size_t n = 0; n < planes.size(); ++n) l.openings.push_back(slot_of(planes[n], n, axes, params.play_mm));
  const double first = axes.local(planes.front().at_mm).x, last = axes.local(planes.back().at_mm).x;
  const double reach = params.margin_mm + 20;
  under.measure_crest(first - reach, last + reach, l.y0, l.y1, params.depth_mm, context);
  const auto heights = [&](double from, double to) {
    double lo = 1e300, hi = -1e300;
    for (double x = from; x <= to; x += 1) {
      lo = std::min(lo, under.crest(x));
      hi = std::max(hi, under.crest(x));
    }
    return std::pair{lo, hi};
  };
  auto [lo, hi] = heights(first - params.margin_mm, last + params.margin_mm);
  for (int round = 0; round < 2; ++round) {  // how far slanted faces reach depends on the height, and that on them
    l.top = hi + params.wall_mm;
    l.x0 = first;
    l.x1 = last;
    for (const double y : {l.cut0, l.cut1}) {
      for (const double z : {lo - params.depth_mm, l.top}) {
        l.x0 = std::min(l.x0, l.openings.front().lower.x(y, z) - params.margin_mm);
        l.x1 = std::max(l.x1, l.openings.back().upper.x(y, z) + params.margin_mm);
      }
    }
    l.x0 = std::max(l.x0, first - reach);
    l.x1 = std::min(l.x1, last + reach);
    std::tie(lo, hi) = heights(l.x0, l.x1);
  }
  l.top = hi + params.wall_mm;
  if (l.top - (lo - params.depth_mm) > kMaxHeightMm)
    throw Error(ExitCode::failed,
                "the guide would be " + format_number(std::round(l.top - lo + params.depth_mm)) + " mm high",
                "bone is in the way, or far from straight: another --approach, or a guide for each plane (--planes)");
  // How far the block may reach has an end: a slanted face that leaves it there would fold it.
  const double rest = std::min(kBetweenSlotsMm, params.margin_mm / 2);
  for (const double y : {l.cut0, l.cut1})
    for (const double z : {lo - params.depth_mm, l.top})
      if (l.openings.front().lower.x(y, z) - l.x0 < rest || l.x1 - l.openings.back().upper.x(y, z) < rest)
        throw Error(ExitCode::failed, "the outermost cut is so slanted that it leaves the guide at its end",
                    "another --approach, a larger --margin-mm, or a guide for each plane (--planes)");
  merge_openings(l, planes, axes, lo - params.depth_mm, context);
  l.code = code_of(params);
  l.head = axes.turned({0, 0, 1});
  return l;
}

// What a plane's slot is without a neighbour, before the guide is seated.
GuideCut cut_of(const CutPlane& p, const GuideLayout& l, const Underside& under, const Axes& axes,
                const CuttingGuideParams& params) {
  GuideCut c;
  c.plane = p.name;
  c.width_mm = p.kerf_mm + params.play_mm;
  const GuideFace middle = face_of(p, axes, p.kerf_mm / 2);
  const double y = (l.cut0 + l.cut1) / 2;
  const double floor = under.crest(middle.x(y, l.top - params.wall_mm)) + l.gap, z = (floor + l.top) / 2;
  c.slot_at_mm = axes.world({middle.x(y, z), y, z});
  c.slot_up_mm = axes.to * Vec3{middle.x(y, l.top) - middle.x(y, floor), 0, l.top - floor};
  c.slot_length_mm = l.cut1 - l.cut0;
  c.play_deg = portable::atan2(params.play_mm, length(c.slot_up_mm)) * 180 / std::numbers::pi;
  return c;
}

// How far the play lets the guide move each plane while its middle is held down.
void rock(const GuideBlock& block, const std::vector<CutPlane>& planes, const Axes& axes, std::vector<GuideCut>& cuts) {
  Vec3 middle;
  for (const auto& c : block.contacts) middle += c.at / static_cast<double>(block.contacts.size());
  std::vector<std::array<double, 6>> rows;
  std::vector<double> room;
  const auto add = [&](const GuideBlock::Contact& c) {
    const Vec3 m = cross(c.at - middle, c.normal);
    rows.push_back({-c.normal.x, -c.normal.y, -c.normal.z, -m.x, -m.y, -m.z});
    room.push_back(c.gap);
  };
  for (const auto& c : block.contacts) add(c);
  rows.push_back({0, 0, 1, 0, 0, 0});
  room.push_back(0);
  // What nothing limits (along a smooth shaft) ends here.
  constexpr double kNotHeldRad = kNotHeldDeg * std::numbers::pi / 180;
  for (std::size_t k = 0; k < 6; ++k) {
    for (const double sign : {1.0, -1.0}) {
      rows.emplace_back();
      rows.back()[k] = sign;
      room.push_back(k < 3 ? kNotHeldMm : kNotHeldRad);
    }
  }
  using Motion = std::array<double, 6>;  // shift, turn about the middle
  Motion farthest;
  // With the contacts that hold it so far; where that motion would press another one into bone, with that one too. The
  // worst of them first, so that a few dozen of several thousand are enough.
  const auto hold = [&](const Motion& c, Motion& x) {
    for (const GuideBlock::Contact* added = nullptr;;) {
      const double reached = largest(c, rows, room, &x);
      if (!std::isfinite(reached)) return reached;
      const GuideBlock::Contact* worst = nullptr;
      double deepest = kPressedMm;
      for (const auto& o : block.others) {
        const Vec3 moved = Vec3{x[0], x[1], x[2]} + cross(Vec3{x[3], x[4], x[5]}, o.at - middle);
        const double pressed = -o.gap - dot(o.normal, moved);
        if (pressed <= deepest) continue;
        deepest = pressed;
        worst = &o;
      }
      if (worst == nullptr) return reached;
      if (worst == added) return std::numeric_limits<double>::infinity();  // not solved well enough to hold by it
      add(*worst);
      added = worst;
    }
  };
  const auto most = [&](Vec3 shift, Vec3 turn, double not_held) {
    double out = 0;
    for (const double sign : {1.0, -1.0}) {
      Motion x{};
      const double reached =
          hold({sign * shift.x, sign * shift.y, sign * shift.z, sign * turn.x, sign * turn.y, sign * turn.z}, x);
      if (reached > out) farthest = x;
      out = std::max(out, reached);
    }
    return std::isfinite(out) ? out : not_held;
  };
  for (std::size_t n = 0; n < planes.size(); ++n) {
    const Vec3 normal = axes.turned(planes[n].normal), at = axes.local(planes[n].at_mm);
    cuts[n].rock_mm = most(normal, cross(at - middle, normal), kNotHeldMm);
    const Vec3 u = any_perpendicular(normal), v = cross(normal, u);
    std::array<double, 4> turned{};
    double largest_turn = 0;
    for (std::size_t k = 0; k < turned.size(); ++k) {
      farthest = {};
      turned[k] = most({}, k < 2 ? (k == 0 ? u : v) : normalized(k == 2 ? u + v : u - v), kNotHeldRad);
      const Vec3 turn{farthest[3], farthest[4], farthest[5]}, tilt = turn - normal * dot(turn, normal);
      if (length(tilt) <= largest_turn) continue;
      largest_turn = length(tilt);
      // In the CT's axes, about the guide's middle.
      RigidTransform shift;
      shift.shift_mm = axes.to * Vec3{farthest[0], farthest[1], farthest[2]};
      cuts[n].rocked = shift * rotation_about(axes.world(middle), normalized(axes.to * turn), length(turn));
    }
    cuts[n].rock_deg = portable::hypot(turned[0], turned[1]) * 180 / std::numbers::pi;  // no turn of the plane is more
  }
}

}  // namespace
}  // namespace guide

PrintedGuide make_cutting_guide(const TriangleSoup& bone, const SurgicalPlan& plan, const CuttingGuideParams& params,
                                const Context& context) {
  require_sound(bone);
  std::vector<CutPlane> planes = guide::wanted_planes(plan, params);
  planning::require_size_mm(bounds_of(bone), planes.front().bone, planning::kShortestBoneMm);
  const guide::Axes axes = guide::axes_of(bone, planes, params);
  TriangleSoup local = bone;
  for (Vec3& p : local.points_mm) p = axes.local(p);
  guide::Underside under(local, params.gap_mm, context);
  const guide::GuideLayout layout = guide::layout_of(local, planes, axes, params, under, context);
  context.progress(0.2, "underside");
  guide::GuideBlock block = guide::build_block(layout, under, context);
  PrintedGuide out;
  out.approach = axes.to.column[2];
  out.along = axes.to.column[0];
  out.min_gap_mm = block.min_gap;
  out.seat_mm2 = block.seat_mm2;
  out.seat_off_mm = block.seat_off;
  out.engraved = block.engraved;
  if (!params.code.empty() && !out.engraved) context.warn("the code is not engraved: no part of the top has room");
  const BoxMm box = bounds_of(block.solid);
  out.length_mm = box.hi.x - box.lo.x;
  out.width_mm = box.hi.y - box.lo.y;
  out.height_mm = box.hi.z - box.lo.z;
  for (const CutPlane& p : planes) out.cuts.push_back(guide::cut_of(p, layout, under, axes, params));
  for (const guide::GuideOpening& o : layout.openings) {
    for (const std::size_t n : o.cuts) {
      if (o.cuts.size() < 2) continue;
      out.cuts[n].two_sided = false;
      out.cuts[n].play_deg = 0;
      out.cuts[n].width_mm = guide::least_between(o.lower, o.upper, layout, box.lo.z);
    }
  }
  if (block.seat_mm2 < guide::kLeastSeatMm2 || block.contacts.empty())
    throw Error(ExitCode::failed, "the guide would not seat: almost nothing of it follows the bone",
                "another --approach, a larger --depth-mm or --margin-mm");
  for (const GuideCut& c : out.cuts)
    if (c.play_deg > guide::kMostPlayDeg)
      context.warn("in the slot of '" + c.plane + "' the blade can tilt by " + planning::rounded(c.play_deg, 1) +
                   " degrees: its faces are " + planning::rounded(length(c.slot_up_mm), 1) +
                   " mm high; a larger --wall-mm or a smaller --play-mm keeps it straighter");
  context.progress(0.8, "seat");
  guide::rock(block, planes, axes, out.cuts);
  out.solid = std::move(block.solid);
  for (Vec3& p : out.solid.points_mm) p = axes.world(p);
  context.progress(0.9, "insertion");
  out.insertion_mm = insertion_clearance_mm(out.solid, bone, out.approach);
  if (out.insertion_mm < 0)
    throw Error(ExitCode::failed, "the guide cannot be put on: on its way it meets the bone",
                "another --approach, or a guide for each plane (--planes)");
  return out;
}

}  // namespace osteo::inline session
