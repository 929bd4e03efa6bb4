#include "osteo/assessment/trainee/truth.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace osteo::inline assessment {
namespace {

constexpr double kFarMm = 4;      // bone that is thicker counts as so thick
constexpr double kIntoMm = 0.1;   // less is rounding
constexpr double kBareMm = 0.25;  // as the item of holes has it on a lattice of 0.5 mm: half a cube

struct Place {
  Vec3 at_mm;
  double area_mm2 = 0, cover_mm = kFarMm;
  std::array<std::uint32_t, 3> points{};
};

// Of what lies barer than `bare_mm` the largest part that is connected: triangles that share a point.
double largest_bare_mm2(const std::vector<Place>& places, std::size_t points, double bare_mm) {
  std::vector<std::uint32_t> part(points);
  std::iota(part.begin(), part.end(), 0U);
  const auto root = [&](std::uint32_t p) {
    while (part[p] != p) p = part[p] = part[part[p]];
    return p;
  };
  for (const Place& p : places) {
    if (p.cover_mm > bare_mm) continue;
    part[root(p.points[1])] = root(p.points[0]);
    part[root(p.points[2])] = root(p.points[0]);
  }
  std::vector<double> area(points, 0.0);
  double most = 0;
  for (const Place& p : places)
    if (p.cover_mm <= bare_mm) most = std::max(most, area[root(p.points[0])] += p.area_mm2);
  return most;
}

std::vector<Place> places_of(const TriMesh& face, const Procedure& procedure, const ScaleItem& item, bool all_sides) {
  const FacePart part(procedure, item);
  std::vector<Place> places;
  for (const auto& t : face.triangles) {
    const Vec3 a = from_floats(face.points_mm[t[0]]), b = from_floats(face.points_mm[t[1]]),
               c = from_floats(face.points_mm[t[2]]);
    const Vec3 n = cross(b - a, c - a);
    const double area = length(n) / 2;
    if (area <= 0 || (!all_sides && !part.has((a + b + c) / 3, n))) continue;
    places.push_back({(a + b + c) / 3, area, kFarMm, {t[0], t[1], t[2]}});
  }
  return places;
}

}  // namespace

std::vector<OwnTruth> own_truth(const Procedure& procedure, const StructureMap& structures,
                                const std::vector<SweptBall>& swept) {
  std::vector<OwnTruth> truths;
  for (const ScaleItem& item : procedure.items) {
    const bool known = item.kind == ItemKind::exposed || item.kind == ItemKind::not_violated ||
                       item.kind == ItemKind::no_hole || item.kind == ItemKind::thinned;
    std::size_t number = 0;
    while (number < structures.values().size() && structures.name_of(structures.values()[number]) != item.structure)
      ++number;
    // What opens into a space that was there before is more than where the burr has been.
    if (procedure.enters(item.structure)) continue;
    if (!known || number == structures.values().size()) continue;
    const TriMesh& face = structures.face(number);
    std::vector<Place> places = places_of(face, procedure, item, item.kind == ItemKind::not_violated);
    if (places.empty()) continue;
    BoxMm box;
    for (const Place& p : places) box.include(p.at_mm);
    double least = kFarMm;
    for (const SweptBall& ball : swept) {
      const double reach = ball.radius_mm + kFarMm;
      bool near = true;
      for (std::size_t a = 0; a < 3; ++a)
        near = near && ball.centre_mm[a] > box.lo[a] - reach && ball.centre_mm[a] < box.hi[a] + reach;
      if (!near) continue;
      for (Place& p : places) {
        const Vec3 d = p.at_mm - ball.centre_mm;
        if (std::abs(d.x) > reach || std::abs(d.y) > reach || std::abs(d.z) > reach) continue;
        p.cover_mm = std::min(p.cover_mm, length(d) - ball.radius_mm);
      }
    }
    for (const Place& p : places) least = std::min(least, p.cover_mm);
    OwnTruth truth{&item, 0, false};
    double all = 0, part = 0;
    const auto area_below = [&](double cover) {
      all = part = 0;
      for (const Place& p : places) {
        all += p.area_mm2;
        if (p.cover_mm <= cover) part += p.area_mm2;
      }
    };
    switch (item.kind) {
      case ItemKind::exposed:
        area_below(item.cover_mm);
        truth.value = part / all;
        truth.pass = truth.value >= item.threshold;
        break;
      case ItemKind::no_hole:
        truth.value = largest_bare_mm2(places, face.points_mm.size(), kBareMm);
        truth.pass = truth.value < item.threshold;
        break;
      case ItemKind::thinned:
        // The median is below the threshold where more than half of the face is.
        area_below(item.threshold);
        truth.value = part / all;
        truth.pass = truth.value >= 0.5;
        area_below(item.most);
        truth.pass = truth.pass && part / all >= 0.9;
        break;
      default:
        truth.value = std::max(0.0, -least);
        truth.pass = least > -kIntoMm;
    }
    truths.push_back(truth);
  }
  return truths;
}

}  // namespace osteo::inline assessment
