// A point that follows the device but stays outside: rigid contact with friction, on any field that tells clearance and
// its gradient.
#pragma once
#include <algorithm>
#include <cmath>

#include "osteo/core/data/vec.h"

namespace osteo::inline simulation {

/// What a field says of a point.
struct Clearance {
  double value_mm =
      0;          ///< distance to what may not be entered, negative inside; may be an approximation with slope about 1
  Vec3 gradient;  ///< of the value; any length but 0
  Vec3 normal;    ///< unit; where forces act along: the gradient's direction, or a shaded one
};

struct GodObjectParams {
  double friction = 0;         ///< dynamic
  double static_friction = 0;  ///< until it slips; taken as `friction` when smaller
  double feature_mm =
      1;  ///< moves along the surface in steps no longer than this: the voxel, or the radius of what is felt
  double tolerance_mm =
      1e-6;  ///< contact and convergence; scale it with the object, so that metres and micrometres work alike
  int evaluations = 96;    ///< of the field in an update, at most (and a few more); what is left is done in the next
  double travel_mm = 1e9;  ///< it walks no farther in an update, but for corrections; what is left is done in the next
};

/// C. Zilles, J. Salisbury, IROS 1995, without triangles: the proxy minimises the distance to the device subject to
/// clearance >= 0. In free space it walks to the device no farther than the clearance allows, so it cannot pass a wall;
/// on the surface it projects the way to the device onto the tangent plane, moves, and corrects by Newton's method
/// along the gradient. Friction: the device's offset stays inside the cone; when it leaves, the proxy is drawn along
/// the surface until the offset lies on the dynamic cone, so that it slips in the direction of motion. No allocation.
/// Field: Clearance operator()(Vec3) const; about 4 evaluations an update in steady contact.
class GodObject {
 public:
  struct Answer {
    Vec3 proxy_mm;
    Vec3 normal;  ///< unit, out of the surface; zero without contact
    bool contact = false;
    bool slipping = false;
    int evaluations = 0;
  };

  [[nodiscard]] bool placed() const { return placed_; }
  [[nodiscard]] Vec3 position_mm() const { return x_; }
  /// Puts the proxy somewhere: the first time, after a gap, or when the scene jumps.
  void place(Vec3 at_mm) {
    x_ = at_mm;
    placed_ = true;
    slipping_ = false;
  }
  /// Along with what it stands on: neither a step nor a slip.
  void carry(Vec3 by_mm) {
    x_ += by_mm;
    last_ += by_mm;
  }
  void forget() { placed_ = false; }

  template <class Field>
  Answer update(const Field& field, Vec3 device_mm, const GodObjectParams& p) {
    Answer a;
    if (!placed_) place(device_mm);
    const double tolerance = p.tolerance_mm;
    Clearance c = field(x_);
    a.evaluations = 1;
    double left = p.travel_mm;
    // The surface may have moved over the proxy, or the proxy was put inside: out along the gradient.
    while (c.value_mm < -tolerance && a.evaluations < p.evaluations && left > 0) {
      const Vec3 before = x_;
      c = step_out(field, c, std::min(p.feature_mm, left), a);
      left -= length(x_ - before);
    }
    bool stopped_by_friction = false;
    while (a.evaluations < p.evaluations && left > 0) {
      const Vec3 way = device_mm - x_;
      const double distance = length(way);
      if (distance <= 1e-3 * tolerance) break;
      if (c.value_mm > tolerance || dot(way, c.normal) >= 0) {
        // Free, or leaving: straight to the device, but not beyond what is known to be free.
        const double step =
            std::min({distance, left, std::max(c.value_mm, 0.25 * p.feature_mm * (dot(way, c.normal) >= 0 ? 1 : 0))});
        x_ += way * (step / distance);
        left -= step;
        a.contact = false;
        slipping_ = false;
        c = field(x_);
        ++a.evaluations;
        if (c.value_mm < 0) c = settle(field, c, {}, p.feature_mm, tolerance, a);
        continue;
      }
      a.contact = true;
      const double depth = -dot(way, c.normal);
      const Vec3 tangent = way + c.normal * depth;
      const double off = length(tangent);
      const double hold = std::max(p.friction, p.static_friction) * depth, drag = p.friction * depth;
      if (off <= (slipping_ ? drag : hold) + tolerance) {
        stopped_by_friction = off > drag + tolerance || (hold > 0 && !slipping_);
        break;
      }
      slipping_ = true;
      const double move = std::min({off - drag, p.feature_mm, left});
      left -= move;
      const Vec3 before = x_, wall = c.normal;
      x_ += tangent * (move / off);
      c = field(x_);
      ++a.evaluations;
      c = settle(field, c, wall, p.feature_mm, tolerance, a);
      if (length(x_ - before) <= 0.1 * tolerance) break;
    }
    if (a.contact && c.value_mm > tolerance) a.contact = false;
    // Stuck again when it has come to rest within the cone.
    if (!a.contact || stopped_by_friction || length(x_ - last_) <= 0.1 * tolerance) slipping_ = false;
    a.slipping = slipping_;
    last_ = x_;
    a.proxy_mm = x_;
    if (a.contact) a.normal = c.normal;
    return a;
  }

 private:
  static constexpr int kSettles = 8;
  static constexpr double kSameWall = 0.95, kMinRise = 0.02;

  template <class Field>
  Clearance step_out(const Field& field, const Clearance& c, double longest, Answer& a) {
    const double slope = dot(c.gradient, c.gradient);
    Vec3 step = slope > 0 ? c.gradient * (-c.value_mm / slope) : Vec3{};
    if (const double n = length(step); n > longest) step = step * (longest / n);
    x_ += step;
    ++a.evaluations;
    return field(x_);
  }
  /// Back onto the surface from near it, from either side. `slid`: the normal of the wall it slid along. Where another
  /// wall is met, the way out of that one leads along the walls already kept, so that corners are reached in a few
  /// steps however sharp they are.
  template <class Field>
  Clearance settle(const Field& field, Clearance c, Vec3 slid, double longest, double tolerance, Answer& a) {
    Vec3 kept[3] = {slid};
    int count = slid == Vec3{} ? 0 : 1;
    for (int i = 0; i < kSettles && std::abs(c.value_mm) > 0.5 * tolerance; ++i) {
      if (c.value_mm > longest) break;  // over an edge: free
      const double slope = length(c.gradient);
      const Vec3 g = slope > 0 ? c.gradient / slope : Vec3{};
      Vec3 along = g, used{};
      bool known = false;
      for (int k = 0; k < count; ++k) {
        if (dot(kept[k], g) > kSameWall) {
          known = true;
          continue;
        }
        // Gram-Schmidt over at most two other walls.
        const Vec3 other = used == Vec3{} ? kept[k] : normalized(kept[k] - used * dot(kept[k], used));
        along -= other * dot(along, other);
        used = other;
      }
      const double rise = dot(along, g);
      if (c.value_mm < 0 && slope > 0 && rise > kMinRise && !(used == Vec3{})) {
        Vec3 step = along * (-c.value_mm / (slope * rise));
        if (const double n = length(step); n > longest) step = step * (longest / n);
        x_ += step;
        ++a.evaluations;
        c = field(x_);
      } else {
        c = step_out(field, c, longest, a);
      }
      if (!known && count < 3) kept[count++] = g;
    }
    return c;
  }

  Vec3 x_, last_;
  bool placed_ = false, slipping_ = false;
};

}  // namespace osteo::inline simulation
