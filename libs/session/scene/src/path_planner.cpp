#include "osteo/session/scene/path_planner.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <queue>
#include <unordered_map>
#include <utility>

#include "osteo/core/base/portable_math.h"
#include "osteo/geometry/grid/brick_places.h"
#include "osteo/geometry/grid/sampler.h"
#include "osteo/simulation/bone/instrument.h"
#include "osteo/simulation/haptics/haptic_scene.h"

namespace osteo::inline session {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kClearMm = 0.4;     // on the way in or out of a cavity, where it has that much room
constexpr double kPressedMm = -0.3;  // a tool that was pressed into bone, and yields
constexpr double kFarMm = 4;         // from there on it may go quickly
constexpr double kOutsideMm = 8;     // beyond the ball around the bone
constexpr double kLookMm = 0.5;      // between two looks along a way

// Rings around a round cone, `spacing_mm` apart.
void add_skin(const RoundCone& c, double spacing_mm, ToolSkin& skin) {
  const double sine = c.slope(), cosine = std::sqrt(1 - sine * sine), tangent = portable::asin(sine);
  const auto ring = [&](double radius, double z, double out_radial, double out_z) {
    const int n = std::max(1, static_cast<int>(std::ceil(2 * kPi * radius / spacing_mm)));
    for (int i = 0; i < n; ++i) {
      const auto [y, x] = portable::sin_cos_turns(static_cast<double>(i) / n);
      skin.points.push_back({{radius * x, radius * y, z}, {out_radial * x, out_radial * y, out_z}});
      skin.reach_mm = std::max(skin.reach_mm, length(skin.points.back().at_mm));
    }
  };
  const auto cap = [&](double middle, double radius, double from, double to) {
    const int n = std::max(1, static_cast<int>(std::ceil(radius * (to - from) / spacing_mm)));
    for (int i = 0; i <= n; ++i) {
      const auto [w, u] = portable::sin_cos(from + (to - from) * i / n);
      ring(radius * u, middle + radius * w, u, w);
    }
  };
  cap(c.start_mm, c.start_radius_mm, -kPi / 2, tangent);
  const int sides = static_cast<int>(std::ceil(c.length_mm / spacing_mm));
  for (int i = 1; i < sides; ++i) {
    const double along = c.length_mm * i / sides, radius = c.radius_at_mm(along);
    ring(radius * cosine, c.start_mm + along + radius * sine, cosine, sine);
  }
  cap(c.start_mm + c.length_mm, c.end_radius_mm, tangent, kPi / 2);
}

double angle_between(Vec3 a, Vec3 b) {
  return portable::atan2(length(cross(a, b)), dot(a, b));
}

// On the great circle from a to b (units).
Vec3 between(Vec3 a, Vec3 b, double share) {
  const double angle = angle_between(a, b);
  if (angle < 1e-9) return a;
  Vec3 side = b - a * dot(a, b);
  side = length(side) < 1e-6 ? any_perpendicular(a) : normalized(side);
  const auto [sine, cosine] = portable::sin_cos(angle * share);
  return normalized(a * cosine + side * sine);
}

// As the hand turns on a leg (GuidedHand).
HandPose on_leg(const HandPose& a, const HandPose& b, double share) {
  return {a.at_mm + (b.at_mm - a.at_mm) * share, normalized(a.axis * (1 - share) + b.axis * share)};
}

// Directions all around, those that agree best with the two given ones first.
std::vector<Vec3> directions(Vec3 axis, Vec3 rather) {
  constexpr int kCount = 160;
  std::vector<Vec3> all;
  for (int i = 0; i < kCount; ++i) {
    const double z = 1 - (2 * i + 1.0) / kCount, r = std::sqrt(1 - z * z);
    const auto [sine, cosine] = portable::sin_cos(i * kPi * (3 - std::sqrt(5.0)));
    all.push_back({r * cosine, r * sine, z});
  }
  const Vec3 best = axis + rather;
  std::stable_sort(all.begin(), all.end(), [&](Vec3 a, Vec3 b) { return dot(a, best) > dot(b, best); });
  all.insert(all.begin(), {rather, axis});
  return all;
}

HandWay put_at(const HandPose& pose) {
  HandWay way;
  way.put = true;
  way.points[0] = {pose.at_mm, to_floats(pose.axis), false};
  way.count = 1;
  return way;
}

}  // namespace

ToolSkin skin_of_instrument(std::size_t tool, bool head) {
  ToolSkin skin;
  const Instrument& held = instrument_library()[tool];
  if (head) add_skin(held.head, 0.4, skin);
  add_skin(held.shaft, 0.7, skin);
  return skin;
}

ToolSkin skin_of_plate(std::size_t plate, const RigidTransform& grip) {
  ToolSkin skin;
  const PlateModel& model = plate_library()[plate];
  for (const bool moving : {false, true}) {
    if (moving && model.moving.triangles.empty()) continue;
    for (const PlateSample& s : sample_plate(model, 400, 0, moving)) {
      skin.points.push_back({grip(s.at_mm), grip.rotation * s.outwards});
      skin.reach_mm = std::max(skin.reach_mm, length(skin.points.back().at_mm));
    }
  }
  return skin;
}

PathPlanner::PathPlanner(const World& world, ToolSkin tool, const StructureMap* structures)
    : tool_(std::move(tool)), structures_(structures) {
  Vec3 lo{1e30, 1e30, 1e30}, hi{-1e30, -1e30, -1e30};
  for (const PlacedBody& placed : world.bodies()) {
    Bone b{placed.body, placed.world_from_body.inverse(), {}, 0};
    const BrickGrid& bone = placed.body->bone;
    Vec3 own_lo{1e30, 1e30, 1e30}, own_hi{-1e30, -1e30, -1e30};
    for (std::uint32_t brick = 0; brick < bone.brick_count(); ++brick) {
      const Vec3 p = middle_of_brick_mm(bone, brick);
      for (std::size_t a = 0; a < 3; ++a) {
        own_lo[a] = std::min(own_lo[a], p[a]);
        own_hi[a] = std::max(own_hi[a], p[a]);
      }
    }
    if (bone.brick_count() == 0) continue;
    b.centre_mm = (own_lo + own_hi) * 0.5;
    for (std::uint32_t brick = 0; brick < bone.brick_count(); ++brick)
      b.radius_mm = std::max(b.radius_mm, length(middle_of_brick_mm(bone, brick) - b.centre_mm));
    b.radius_mm += 4 * length(bone.frame().spacing_mm);
    const Vec3 at = placed.world_from_body(b.centre_mm);
    for (std::size_t a = 0; a < 3; ++a) {
      lo[a] = std::min(lo[a], at[a] - b.radius_mm);
      hi[a] = std::max(hi[a], at[a] + b.radius_mm);
    }
    bones_.push_back(std::move(b));
  }
  if (bones_.empty()) return;
  centre_mm_ = (lo + hi) * 0.5;
  for (const Bone& b : bones_)
    radius_mm_ = std::max(radius_mm_, length(b.body_from_world.inverse()(b.centre_mm) - centre_mm_) + b.radius_mm);
}

// Points of the skin that are in bone or too near to a structure, counted to one more than `most`.
std::size_t PathPlanner::touching(const HandPose& pose, double margin_mm, std::size_t most) const {
  const std::size_t bone = touching_bone(pose, margin_mm, most);
  if (bone > most || structures_ == nullptr) return bone;
  return bone + touching_structures(pose, std::max(kClearOfStructuresMm, margin_mm), most - bone);
}

// A point that is far from all structures speaks for those beside it: distance grows no faster than one goes.
std::size_t PathPlanner::touching_structures(const HandPose& pose, double clear_mm, std::size_t most) const {
  constexpr double kErrorMm = 0.2;  // of the map's distances
  const RigidTransform hand{frame_of_axis(pose.axis), pose.at_mm};
  std::size_t count = 0;
  for (std::size_t i = 0; i < tool_.points.size();) {
    const Vec3 here = tool_.points[i].at_mm;
    const double distance = structures_->at_risk(hand(here)).distance_mm;
    if (distance < clear_mm && ++count > most) return count;
    const double room = distance - clear_mm - kErrorMm;
    do {
      ++i;
    } while (i < tool_.points.size() && length(tool_.points[i].at_mm - here) < room);
  }
  return count;
}

std::size_t PathPlanner::touching_bone(const HandPose& pose, double margin_mm, std::size_t most) const {
  // With room to keep any bone counts; without it, what is more bone than not.
  const float least = margin_mm > 0 ? 0.05F : 0.5F;
  const RigidTransform hand{frame_of_axis(pose.axis), pose.at_mm};
  std::size_t count = 0;
  for (const Bone& b : bones_) {
    const RigidTransform own = b.body_from_world * hand;
    if (length(own.shift_mm - b.centre_mm) > b.radius_mm + tool_.reach_mm + margin_mm) continue;
    const BrickGrid& bone = b.body->bone;
    const Frame& f = bone.frame();
    const Mat3 back = inverse(f.direction);
    const Vec3 origin = f.index_from_world(own.shift_mm);
    Mat3 index_from_hand;
    for (std::size_t c = 0; c < 3; ++c) {
      const Vec3 v = back * own.rotation.column[c];
      index_from_hand.column[c] = {v.x / f.spacing_mm.x, v.y / f.spacing_mm.y, v.z / f.spacing_mm.z};
    }
    for (const ToolSkin::Point& p : tool_.points) {
      const Vec3 x = origin + index_from_hand * (p.at_mm + p.outwards * margin_mm);
      const auto round = [](double v) { return static_cast<int>(std::floor(v + 0.5)); };
      if (!(bone.at(round(x.x), round(x.y), round(x.z)) >= least)) continue;
      // Without room to keep it matters where in the voxel: a bore is as narrow as what drilled it.
      if (margin_mm > 0 || linear_at(bone, x) >= least) ++count;
      if (count > most) return count;
    }
  }
  return count;
}

bool PathPlanner::in_bone(Vec3 at_mm) const {
  return std::any_of(bones_.begin(), bones_.end(),
                     [&](const Bone& b) { return b.body->bone.nearest(b.body_from_world(at_mm)) >= 0.5F; });
}

bool PathPlanner::free(const HandPose& pose, double margin_mm) const {
  return touching(pose, margin_mm, 0) == 0;
}

bool PathPlanner::outside(Vec3 at_mm) const {
  return length(at_mm - centre_mm_) >= radius_mm_ + kOutsideMm;
}

bool PathPlanner::free_leg(const HandPose& a, const HandPose& b, double margin_mm) const {
  const double mm = std::max(length(b.at_mm - a.at_mm), tool_.reach_mm * angle_between(a.axis, b.axis));
  const int n = std::max(1, static_cast<int>(std::ceil(mm / (margin_mm > 1 ? 2 * kLookMm : kLookMm))));
  for (int i = 0; i <= n; ++i) {
    if (!free(on_leg(a, b, static_cast<double>(i) / n), margin_mm)) return false;
  }
  return true;
}

// The most room in bone, of those that ways are looked for with.
double PathPlanner::margin_at(const HandPose& pose) const {
  for (const double m : {kClearMm, 0.0}) {
    if (touching_bone(pose, m, 0) == 0) return m;
  }
  return kPressedMm;
}

HandPose PathPlanner::waiting(Vec3 eye, Vec3 axis) const {
  // Nobody has looked yet: there is no way that leads out of bone along no direction.
  if (!(length(eye) > 0.5)) eye = {0, 0, 1};
  HandPose pose{centre_mm_ + eye * (radius_mm_ + kOutsideMm), axis};
  while (!free(pose, kFarMm)) pose.at_mm += eye * kFarMm;
  return pose;
}

// Straight from a pose to the outside. At the beginning the tool may touch, but never more than it did.
bool PathPlanner::leaves(const HandPose& from, Vec3 direction, double near_margin, double margin, HandPose& end) const {
  constexpr double kBeginningMm = 4;
  // The middle of the tip alone tells most that do not.
  for (double s = kBeginningMm; !outside(from.at_mm + direction * s); s += kLookMm) {
    if (in_bone(from.at_mm + direction * s)) return false;
  }
  std::size_t touched = touching(from, near_margin, tool_.points.size());
  for (double s = kLookMm;; s += s > 12 ? 2 * kLookMm : kLookMm) {
    end = {from.at_mm + direction * s, from.axis};
    if (s <= kBeginningMm) {
      const std::size_t now = touching(end, near_margin, touched);
      if (now > touched) return false;
      touched = now;
    } else if (!free(end, margin)) {
      return false;
    }
    if (outside(end.at_mm) && free(end, margin)) return true;
  }
}

// Where no straight way leads out: on a lattice, places farther out first.
std::optional<PathPlanner::Poses> PathPlanner::search_out(const HandPose& from, double near_margin, double far_margin,
                                                          double step_mm) const {
  constexpr int kMaxLooks = 40000;
  constexpr double kBeginningMm = 3;
  // At the beginning the tool may touch, but never more than it does.
  const std::size_t touched = touching(from, near_margin, tool_.points.size());
  const auto beginning = [&](Vec3 at) { return length(at - from.at_mm) < kBeginningMm; };
  const auto fits = [&](const HandPose& p) {
    return beginning(p.at_mm) ? touching(p, near_margin, touched) <= touched : free(p, far_margin);
  };
  constexpr int kHalf = 1 << 19;
  const auto name = [](int i, int j, int k) {
    return (static_cast<std::int64_t>(i + kHalf) << 40) | (static_cast<std::int64_t>(j + kHalf) << 20) | (k + kHalf);
  };
  const auto place = [&](std::int64_t n) {
    return from.at_mm + step_mm * Vec3{static_cast<double>((n >> 40) - kHalf),
                                       static_cast<double>((n >> 20 & 0xfffff) - kHalf),
                                       static_cast<double>((n & 0xfffff) - kHalf)};
  };
  std::unordered_map<std::int64_t, std::int64_t> seen;  // place -> the one it was reached from
  std::priority_queue<std::pair<double, std::int64_t>> open;
  seen.emplace(name(0, 0, 0), -1);
  open.emplace(0, name(0, 0, 0));
  int looks = 0;
  while (!open.empty() && looks < kMaxLooks) {
    const std::int64_t here = open.top().second;
    open.pop();
    const Vec3 at = place(here);
    if (outside(at)) {
      Poses path;
      for (std::int64_t n = here; n != -1; n = seen.at(n)) path.insert(path.begin(), {place(n), from.axis});
      // Corners that can be left out.
      Poses straight;
      for (std::size_t i = 0; i + 1 < path.size();) {
        std::size_t next = path.size() - 1;
        while (next > i + 1 && !free_leg(path[i], path[next], beginning(path[i].at_mm) ? near_margin : far_margin))
          next = i + (next - i) / 2;
        straight.push_back(path[next]);
        i = next;
      }
      return straight;
    }
    for (int d = 0; d < 27; ++d) {
      const int i = static_cast<int>(here >> 40) - kHalf + d % 3 - 1,
                j = static_cast<int>(here >> 20 & 0xfffff) - kHalf + d / 3 % 3 - 1,
                k = static_cast<int>(here & 0xfffff) - kHalf + d / 9 - 1;
      const std::int64_t there = name(i, j, k);
      if (seen.contains(there) || in_bone(place(there))) continue;
      ++looks;
      if (!fits({place(there), from.axis})) continue;
      seen.emplace(there, here);
      open.emplace(length(place(there) - centre_mm_), there);
    }
  }
  return std::nullopt;
}

std::optional<PathPlanner::Poses> PathPlanner::straight_out(const HandPose& from, Vec3 rather,
                                                            double least_margin) const {
  if (outside(from.at_mm)) return Poses{};
  const double here = margin_at(from);
  const std::vector<Vec3> all = directions(from.axis, rather);
  HandPose end;
  for (const double margin : {kClearMm, 0.0, kPressedMm}) {
    if (margin < least_margin) break;
    for (const Vec3 d : all) {
      if (leaves(from, d, std::min(here, margin), margin, end)) return Poses{end};
    }
  }
  return std::nullopt;
}

std::optional<PathPlanner::Poses> PathPlanner::way_out(const HandPose& from, Vec3 rather) const {
  if (auto straight = straight_out(from, rather, kPressedMm)) return straight;
  const double here = std::min(0.0, margin_at(from));
  auto roomy = search_out(from, here, kClearMm, 1);
  if (!roomy) roomy = search_out(from, here, here, 1);
  // A channel that is little wider than the tool, and leads between the lattice's places.
  return roomy ? roomy : search_out(from, here, here, 0.5);
}

// Round the ball, from outside it to outside it, no farther off than needed.
std::optional<PathPlanner::Poses> PathPlanner::across(const HandPose& from, const HandPose& to) const {
  const Vec3 a = from.at_mm - centre_mm_, b = to.at_mm - centre_mm_, ua = normalized(a), ub = normalized(b);
  const double lowest = std::max({length(a), length(b), radius_mm_ + kOutsideMm});
  const double turn = angle_between(from.axis, to.axis), arc = angle_between(ua, ub);
  const int n = std::max(1, static_cast<int>(std::ceil(std::max(arc / (kPi / 18), turn / (kPi / 6)))));
  for (const double margin : {kFarMm, kClearMm}) {
    for (const double more : {0.0, 15.0, 40.0, 1 + tool_.reach_mm}) {
      Poses poses;
      for (int i = 0; i <= n; ++i) {
        const double share = static_cast<double>(i) / n;
        poses.push_back({centre_mm_ + between(ua, ub, share) * (lowest + more), between(from.axis, to.axis, share)});
      }
      poses.push_back(to);
      HandPose last = from;
      const bool all_free = std::all_of(poses.begin(), poses.end(),
                                        [&](const HandPose& p) { return free_leg(std::exchange(last, p), p, margin); });
      if (all_free) return poses;
    }
  }
  return std::nullopt;
}

// To a place near by: lifted a little, over, and down.
std::optional<PathPlanner::Poses> PathPlanner::over(const HandPose& from, const HandPose& to, Vec3 lift) const {
  constexpr double kNearByMm = 40;
  if (length(to.at_mm - from.at_mm) > kNearByMm || dot(from.axis, to.axis) < 0.5) return std::nullopt;
  const double here = margin_at(from);
  if (!free(from, here)) return std::nullopt;
  for (const double up : {0.0, 3.0, 8.0, 20.0, 40.0}) {
    const HandPose first{from.at_mm + lift * up, from.axis}, second{to.at_mm + lift * up, to.axis};
    if (free_leg(first, second, kClearMm) && free_leg(second, to, kClearMm) && free_leg(from, first, here))
      return Poses{first, second, to};
  }
  return std::nullopt;
}

// Slowly where bone is near, quickly elsewhere. Nothing where there are too many corners.
std::optional<HandWay> PathPlanner::finished(const HandPose& from, const Poses& poses) const {
  constexpr int kWorthMm = 6;  // a shorter stretch is not worth going quickly
  HandWay way;
  HandPose a = from;
  for (const HandPose& b : poses) {
    const int n = std::max(1, static_cast<int>(std::ceil(length(b.at_mm - a.at_mm))));
    std::vector<bool> far(static_cast<std::size_t>(n) + 1);
    for (int i = 0; i <= n; ++i)
      far[static_cast<std::size_t>(i)] = free(on_leg(a, b, static_cast<double>(i) / n), kFarMm);
    for (int i = 0, last_end = 0; i < n;) {
      // From i on to where it changes.
      const bool quick = far[static_cast<std::size_t>(i)];
      int end = i + 1;
      while (end < n && far[static_cast<std::size_t>(end)] == quick) ++end;
      if (quick && !far[static_cast<std::size_t>(end)]) --end;
      const bool whole = end == n && i == 0;
      const bool near_bone = !quick || (end - i < kWorthMm && !whole);
      end = std::max(end, i + 1);
      // Slow stretches side by side are one.
      if (near_bone && last_end > 0 && way.points[way.count - 1].near_bone) --way.count;
      if (way.count >= HandWay::kMax) return std::nullopt;
      const HandPose p = on_leg(a, b, static_cast<double>(end) / n);
      way.points[way.count++] = {p.at_mm, to_floats(p.axis), near_bone};
      last_end = i = end;
    }
    a = b;
  }
  return way;
}

// Clear of the structures, or where only they are in the way, past them.
PathPlanner::Found PathPlanner::clear_or_past_structures(const auto& find) const {
  const Found clear = find(*this);
  if (!clear.way.put || structures_ == nullptr) return clear;
  PathPlanner of_bone(*this);
  of_bone.structures_ = nullptr;
  Found past = find(of_bone);
  if (past.way.put) return clear;
  past.past_structures = true;
  return past;
}

PathPlanner::Found PathPlanner::way(const HandPose& from, const HandPose& to) const {
  return clear_or_past_structures([&](const PathPlanner& ways) { return ways.found_way(from, to); });
}

PathPlanner::Found PathPlanner::approach(const HandPose& from, Vec3 seen_mm, Vec3 forward, Vec3 axis) const {
  return clear_or_past_structures(
      [&](const PathPlanner& ways) { return ways.found_approach(from, seen_mm, forward, axis); });
}

PathPlanner::Found PathPlanner::found_way(const HandPose& from, const HandPose& to) const {
  if (auto poses = way_out(from, normalized(to.at_mm - centre_mm_))) {
    if (const auto rest = across(poses->empty() ? from : poses->back(), to)) {
      poses->insert(poses->end(), rest->begin(), rest->end());
      if (const auto way = finished(from, *poses)) return {*way, to};
    }
  }
  return {put_at(to), to};
}

PathPlanner::Found PathPlanner::found_approach(const HandPose& from, Vec3 seen_mm, Vec3 forward, Vec3 axis) const {
  constexpr double kGapMm = 0.5;
  const Vec3 back = forward * -1;
  // As asked; leaning as much to the other sides; towards who looks.
  std::vector<Vec3> axes{axis};
  const Vec3 lean = axis - back * dot(axis, back), up = cross(back, lean);
  for (const Vec3 v : {up, up * -1, lean * -1}) axes.push_back(normalized(back * dot(axis, back) + v));
  axes.push_back(normalized(back + lean * 0.3));
  axes.push_back(back);
  for (double s = kGapMm;; s += s < 10 ? kLookMm : s / 10) {
    const Vec3 at = seen_mm + back * s;
    for (const Vec3 a : axes) {
      const HandPose end{at, a};
      if (!free(end, kGapMm)) continue;
      // It got out of where it drilled itself in; into a gap without room bone would not let its shaft.
      const auto down = straight_out(end, back, kClearMm);
      if (!down) continue;
      if (const auto near = over(from, end, back)) {
        if (const auto way = finished(from, *near)) return {*way, end};
      }
      const HandPose top = down->empty() ? end : down->back();
      Poses rest(down->rbegin(), down->rend());
      if (!rest.empty()) {
        rest.erase(rest.begin());
        rest.push_back(end);
      }
      if (auto poses = way_out(from, back)) {
        if (const auto middle = across(poses->empty() ? from : poses->back(), top)) {
          poses->insert(poses->end(), middle->begin(), middle->end());
          poses->insert(poses->end(), rest.begin(), rest.end());
          if (const auto way = finished(from, *poses)) return {*way, end};
        }
      }
      // Shut in: put above the place, and down from there.
      HandWay way = put_at(top);
      if (const auto last = finished(top, rest); last && last->count < HandWay::kMax) {
        std::copy_n(last->points.begin(), last->count, way.points.begin() + 1);
        way.count += last->count;
        return {way, end};
      }
    }
  }
}

Vec3 PathPlanner::turned(const HandPose& pose, Vec3 wanted, double most_rad) const {
  const double angle = angle_between(pose.axis, wanted);
  if (angle < 1e-6) return wanted;
  const std::size_t now = touching(pose, 0, tool_.points.size());
  for (double share = std::min(1.0, most_rad / angle); share * angle > 0.005; share /= 2) {
    const Vec3 axis = between(pose.axis, wanted, share);
    if (touching({pose.at_mm, axis}, 0, now) <= now) return axis;
  }
  return pose.axis;
}

}  // namespace osteo::inline session
