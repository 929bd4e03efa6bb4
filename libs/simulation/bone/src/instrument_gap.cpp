#include "osteo/simulation/bone/instrument.h"

#include <algorithm>
#include <cmath>

namespace osteo::inline simulation {
namespace {

struct Near {
  double gap_mm;
  Vec3 at_mm;
};

// A round cone somewhere: its lower ball's centre and its axis.
struct Placed {
  const RoundCone* shape;
  Vec3 from, axis;

  Placed(const RoundCone& s, const InstrumentPlace& p)
      : shape(&s), from(p.tip_mm + p.axis * s.start_mm), axis(p.axis) {}
  [[nodiscard]] Vec3 middle() const { return from + axis * (shape->length_mm / 2); }
  [[nodiscard]] double reach() const { return shape->length_mm / 2 + shape->largest_radius_mm(); }
  // The place on the axis whose ball is nearest to a point.
  [[nodiscard]] double foot(Vec3 p) const {
    const double axial = dot(p - from, axis);
    return shape->foot_mm(length(p - from - axis * axial), axial);
  }
  [[nodiscard]] double distance(Vec3 p) const {
    const double t = foot(p);
    return length(p - from - axis * t) - shape->radius_at_mm(t);
  }
};

Near near_between(const Placed& a, const Placed& b) {
  const auto gap = [&](double t) { return b.distance(a.from + a.axis * t) - a.shape->radius_at_mm(t); };
  double lo = 0, hi = a.shape->length_mm;
  constexpr double kGolden = 0.6180339887498949;
  double l = hi - kGolden * (hi - lo), r = lo + kGolden * (hi - lo), at_l = gap(l), at_r = gap(r);
  while (hi - lo > 1e-4) {
    if (at_l < at_r) {
      hi = r;
      r = l;
      at_r = at_l;
      l = hi - kGolden * (hi - lo);
      at_l = gap(l);
    } else {
      lo = l;
      l = r;
      at_l = at_r;
      r = lo + kGolden * (hi - lo);
      at_r = gap(r);
    }
  }
  const double t = 0.5 * (lo + hi), mm = gap(t);
  const Vec3 p = a.from + a.axis * t, q = b.from + b.axis * b.foot(p);
  const double apart = length(q - p);
  const Vec3 towards = apart > 1e-9 ? (q - p) / apart : a.axis;
  return {mm, p + towards * (a.shape->radius_at_mm(t) + mm / 2)};
}

}  // namespace

InstrumentGap gap_between(const InstrumentPlace& first, const InstrumentPlace& other) noexcept {
  constexpr double kFarMm = 20;
  InstrumentGap least{1e9, {}, true, true};
  for (const bool head : {true, false}) {
    const Placed a(head ? first.held->head : first.held->shaft, first);
    for (const bool its_head : {true, false}) {
      const Placed b(its_head ? other.held->head : other.held->shaft, other);
      const double at_least = length(a.middle() - b.middle()) - a.reach() - b.reach();
      if (at_least >= std::min(least.gap_mm, kFarMm)) {
        if (at_least < least.gap_mm) least = {at_least, (a.middle() + b.middle()) * 0.5, head, its_head};
        continue;
      }
      const Near n = near_between(a, b);
      if (n.gap_mm < least.gap_mm) least = {n.gap_mm, n.at_mm, head, its_head};
    }
  }
  return least;
}

}  // namespace osteo::inline simulation
