// A jaw and a fibula, two plans for them, and what surgery made of a plan.
#pragma once
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "jaw_params.h"
#include "osteo/session/planning/detail/jaw_phantom.h"
#include "osteo/session/planning/planning.h"
#include "postop.h"

namespace osteo::testing_planning {

inline constexpr double kDeg = 3.14159265358979323846 / 180;

struct World {
  JawPhantom phantom;
  BoneField jaw, donor;
  SurgicalPlan rebuilt;                   ///< from fibula segments, which lie upon each other
  std::vector<Vec3> contour_mm, axis_mm;  ///< of `rebuilt`: its target, and the corners of its axes
  SurgicalPlan advanced;                  ///< one cut, the front moved away: faces that a CT shows
  explicit World(std::uint64_t seed) : phantom(make_jaw_phantom(seed, 12)), jaw(phantom.jaw), donor(phantom.donor) {
    ReconstructionParams r = test::params_for(phantom);
    const Reconstruction all = reconstruct(phantom.jaw, phantom.donor, r);
    rebuilt = all.plan;
    contour_mm = all.contour_mm;
    axis_mm = all.axis_mm;
    const Vec3 e = phantom.a_normal;
    advanced.planes = {{"stays", "mandible", phantom.a_mm, e, 1, true},
                       {"moves", "mandible", phantom.a_mm + e * 1.0, e, 1, false}};
    RigidTransform away = motion(phantom.a_mm, e * 5, {2, -3, 1});
    advanced.fragments = {{"back", "mandible", {"stays"}, {}}, {"front", "mandible", {"moves"}, away}};
  }
  [[nodiscard]] std::vector<std::pair<std::string, TriangleSoup>> bones() const {
    return {{"mandible", phantom.jaw}, {"fibula", phantom.donor}};
  }
};

inline const World& world() {
  static const World w(1);
  return w;
}

struct Truth {
  std::vector<TrueFragment> fragments;
  std::vector<RigidTransform> deviation;  ///< of each fragment, in the plan's axes
  std::vector<Vec3> off_tilt;             ///< of each fragment's planes: mm, degrees about the sheet's axes
};

// Fragments off the plan by up to `most_mm` and `most_deg`, cuts too, the whole patient elsewhere.
inline Truth surgery(const World& w, const SurgicalPlan& plan, double most_mm, double most_deg, std::uint64_t seed) {
  statistics::Random random(seed);
  Truth out;
  const RigidTransform patient = motion({}, uniform_vector(random, 9), uniform_vector(random, 5));
  for (std::size_t n = 0; n < plan.fragments.size(); ++n) {
    const PlannedFragment& f = plan.fragments[n];
    const RigidTransform d = n == 0 ? RigidTransform{}
                                    : motion(f.planned_from_ct(plan.plane(f.planes[0]).at_mm),
                                             uniform_vector(random, most_mm), uniform_vector(random, most_deg));
    out.deviation.push_back(d);
    TrueFragment t{f.bone == "mandible" ? &w.jaw : &w.donor, patient * d * f.planned_from_ct, {}, {}, {}};
    for (const std::string& name : f.planes) {
      const CutPlane& p = plan.plane(name);
      const Vec3 e = p.waste_ahead ? p.normal : -p.normal;
      const double off = uniform(random, -1, 1), a = uniform(random, -2, 2), b = uniform(random, -2, 2);
      const Vec3 x = any_perpendicular(e), y = cross(e, x);
      // h rises by tan a along x and by tan b along y.
      t.faces.push_back({p.at_mm + e * off, normalized(e - x * std::tan(a * kDeg) - y * std::tan(b * kDeg))});
      out.off_tilt.push_back({off, a, b});
    }
    if (f.name == "mandible at b") {  // behind that plane also lies the other side's ramus
      t.guard_at = w.phantom.symmetry_at_mm;
      t.guard_normal = w.phantom.symmetry_normal;
      if (dot(w.phantom.b_mm - t.guard_at, t.guard_normal) < 0) t.guard_normal = -t.guard_normal;
    }
    out.fragments.push_back(std::move(t));
  }
  return out;
}

inline BoxMm box_of(const Truth& t, const SurgicalPlan& plan, const World& w) {
  BoxMm box;
  for (std::size_t n = 0; n < t.fragments.size(); ++n) {
    const TriangleSoup& bone = plan.fragments[n].bone == "mandible" ? w.phantom.jaw : w.phantom.donor;
    for (const Vec3& p : bone.points_mm) {
      bool in = dot(p - t.fragments[n].guard_at, t.fragments[n].guard_normal) >= 0;
      for (const auto& [at, e] : t.fragments[n].faces) in = in && dot(p - at, e) < 0;
      if (in) box.include(t.fragments[n].postop_from_ct(p));
    }
  }
  return box;
}

inline Vec3 turn_of(const RigidTransform& d) {
  const Mat3& m = d.rotation;
  const Vec3 twice{m.column[1].z - m.column[2].y, m.column[2].x - m.column[0].z, m.column[0].y - m.column[1].x};
  const double sin = length(twice) / 2;
  return sin < 1e-15 ? Vec3{} : twice * (std::asin(std::min(1.0, sin)) / (2 * sin) / kDeg);
}

}  // namespace osteo::testing_planning
