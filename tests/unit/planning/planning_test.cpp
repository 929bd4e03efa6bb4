// Planes of symmetry and jaws rebuilt, on bones of which the truth is known.
#include <gtest/gtest.h>

#include <cstdlib>
#include <ctime>
#include <iostream>

#include "error_of.h"
#include "jaw_params.h"
#include "osteo/core/base/error.h"
#include "osteo/geometry/mesh/mesh_info.h"
#include "osteo/session/planning/detail/jaw_phantom.h"
#include "osteo/session/planning/detail/reconstruct.h"

namespace osteo {
namespace {

constexpr double kDeg = 3.14159265358979 / 180;

using test::params_for;

double to_axes(Vec3 c, const std::vector<Vec3>& axes) {
  double best = 1e9;
  for (std::size_t n = 0; n + 1 < axes.size(); ++n) {
    const Vec3 d = axes[n + 1] - axes[n];
    best = std::min(best, length(c - axes[n] - d * std::clamp(dot(c - axes[n], d) / dot(d, d), 0.0, 1.0)));
  }
  return best;
}

// The lower border before the tumour grew, which the planner has not seen.
double truth_mean(std::uint64_t seed, const Reconstruction& r) {
  double sum = 0;
  const auto truth = make_jaw_phantom(seed, r.donor_thickness_mm).contour_mm;
  for (const Vec3& c : truth) sum += to_axes(c, r.axis_mm);
  return sum / static_cast<double>(truth.size());
}

double angle_deg(const SymmetryPlane& s, const JawPhantom& p) {
  return std::acos(std::min(1.0, std::abs(dot(s.normal, p.symmetry_normal)))) / kDeg;
}

using test::error_of;

TEST(JawPhantom, IsClosedManifoldAndItsOwn) {
  const JawPhantom p = make_jaw_phantom(3, 12);
  for (const TriangleSoup* s : {&p.jaw, &p.donor}) {
    const MeshSummary m = summarize(mesh_of(*s));
    EXPECT_TRUE(m.watertight && m.manifold);
    EXPECT_GT(m.volume_mm3, 0) << "faces outward";
  }
  EXPECT_EQ(make_jaw_phantom(3, 12).jaw.points_mm, p.jaw.points_mm);
  EXPECT_NE(make_jaw_phantom(4, 12).jaw.points_mm, p.jaw.points_mm);
}

TEST(SymmetryPlane, IsFoundBesideATumour) {
  const JawPhantom even = make_jaw_phantom(2, 12, 0), uneven = make_jaw_phantom(2, 12, 0.4);
  const SymmetryPlane found = find_symmetry_plane(even.jaw);
  EXPECT_LT(angle_deg(found, even), 0.05);
  EXPECT_LT(std::abs(dot(found.at_mm - even.symmetry_at_mm, even.symmetry_normal)), 0.05);
  EXPECT_LT(found.within_1_mm, 1) << "the tumour has no mirror image";
  EXPECT_GT(found.normal.x, 0);
  EXPECT_LT(angle_deg(find_symmetry_plane(uneven.jaw), uneven), 0.5) << "as faces are";
}

TEST(SymmetryPlane, IsTheSameForAnyNumberOfThreads) {
  const TriangleSoup jaw = make_jaw_phantom(5, 12).jaw;
  Context one, three;
  one.threads = 1;
  three.threads = 3;
  const SymmetryPlane a = find_symmetry_plane(jaw, one), b = find_symmetry_plane(jaw, three);
  EXPECT_EQ(a.at_mm, b.at_mm);
  EXPECT_EQ(a.normal, b.normal);
}

TEST(SymmetryPlane, IsNotGuessed) {
  TriangleSoup ball;
  for (int k = 0; k <= 16; ++k) {
    for (int n = 0; n < 24; ++n) {
      const double lat = (k / 16.0 - 0.5) * 180 * kDeg, lon = 15 * n * kDeg;
      ball.points_mm.push_back(Vec3{std::cos(lat) * std::cos(lon), std::cos(lat) * std::sin(lon), std::sin(lat)} * 30);
    }
  }
  for (std::uint32_t k = 0; k < 16; ++k) {
    for (std::uint32_t n = 0; n < 24; ++n) {
      const std::uint32_t a = 24 * k + n, b = 24 * k + (n + 1) % 24;
      ball.triangles.push_back({a, b, b + 24});
      ball.triangles.push_back({a, b + 24, a + 24});
    }
  }
  EXPECT_NE(error_of([&] { static_cast<void>(find_symmetry_plane(ball)); }).find("another plane"), std::string::npos);
  TriangleSoup half = make_jaw_phantom(1, 12).jaw;
  const Vec3 n = make_jaw_phantom(1, 12).symmetry_normal;
  std::erase_if(half.triangles, [&](const auto& t) { return dot(half.points_mm[t[0]], n) > -8; });
  EXPECT_NE(error_of([&] { static_cast<void>(find_symmetry_plane(half)); }), "") << "one side alone";
}

TEST(SymmetryPlane, MirrorKeepsOutsideOut) {
  const TriangleSoup jaw = make_jaw_phantom(1, 12).jaw;
  const SymmetryPlane plane{{3, 0, 0}, {1, 0, 0}, 0, 1};
  EXPECT_NEAR(enclosed_volume_mm3(mesh_of(mirrored(jaw, plane))), enclosed_volume_mm3(mesh_of(jaw)), 1);
}

TEST(Reconstruct, MeetsTheJawBeforeTheTumour) {
  const JawPhantom p = make_jaw_phantom(1, 12);
  const Reconstruction r = reconstruct(p.jaw, p.donor, params_for(p));
  EXPECT_LT(r.contour_mean_mm, 1);
  EXPECT_LT(truth_mean(1, r), 1.2);
  ASSERT_EQ(r.contact.size(), r.segments.size() + 1);
  for (const double c : r.contact) {
    EXPECT_GT(c, 0.9);
    EXPECT_LE(c, 1);
  }
  for (const DonorSegment& s : r.segments) EXPECT_GE(s.shortest_mm, 15);
}

TEST(Reconstruct, PlanPutsEachCutWhereItBelongs) {
  const JawPhantom p = make_jaw_phantom(1, 12);
  ReconstructionParams params = params_for(p);
  params.max_contour_mm = 0.1;  // as many segments as fit
  params.min_length_mm = 8;
  params.kerf_mm = 1.2;
  const Reconstruction r = reconstruct(p.jaw, p.donor, params);
  const SurgicalPlan plan = plan_of(plan_json(r.plan), "plan");
  const std::size_t n = r.segments.size();
  ASSERT_GE(n, 2U);
  ASSERT_EQ(plan.fragments.size(), n + 2);
  for (std::size_t s = 0; s < n; ++s) {
    const PlannedFragment& f = plan.fragments[s + 2];
    const CutPlane &start = plan.plane(f.planes[0]), &end = plan.plane(f.planes[1]);
    const auto moved = [&](const CutPlane& c) { return f.planned_from_ct.rotation * c.normal; };
    EXPECT_LT(length(f.planned_from_ct(start.at_mm) - r.axis_mm[s]), 1e-9);
    EXPECT_LT(length(f.planned_from_ct(end.at_mm) - r.axis_mm[s + 1]), 1e-6);
    if (s == 0) {
      EXPECT_LT(length(moved(start) + p.a_normal), 1e-9) << "on the face that the saw leaves";
    }
    if (s + 1 == n) {
      EXPECT_LT(length(moved(end) + p.b_normal), 1e-9);
    } else {
      const PlannedFragment& g = plan.fragments[s + 3];
      const CutPlane& next = plan.plane(g.planes[0]);
      EXPECT_LT(length(moved(end) + g.planned_from_ct.rotation * next.normal), 1e-9) << "both faces in one plane";
      // Between the two faces in the donor the saw has room: no place of this segment's face is nearer the next
      // segment than a kerf.
      double least = 1e9;
      for (const Vec3& q : p.donor.points_mm) {
        if (length(q - end.at_mm) > 12) continue;
        const Vec3 axis = normalized(next.at_mm - start.at_mm);
        const double here = dot(end.at_mm - q, end.normal) / dot(axis, end.normal);
        const double there = dot(next.at_mm - q, next.normal) / dot(axis, next.normal);
        least = std::min(least,
                         (there - here) * std::min(std::abs(dot(axis, end.normal)), std::abs(dot(axis, next.normal))));
      }
      EXPECT_GT(least, 1.1);
      EXPECT_LT(least, 1.5) << "and no more donor is lost than needed";
    }
  }
  for (const double w : r.wedge_deg) EXPECT_GT(w, 1);
}

TEST(Reconstruct, MoreSegmentsComeNearer) {
  const JawPhantom p = make_jaw_phantom(1, 12);
  ReconstructionParams params = params_for(p);
  params.min_length_mm = 8;
  params.max_segments = 1;
  const double one = reconstruct(p.jaw, p.donor, params).contour_mean_mm;
  params.max_segments = 3;
  params.max_contour_mm = 0.1;
  EXPECT_LT(reconstruct(p.jaw, p.donor, params).contour_mean_mm, 0.7 * one);
}

TEST(Reconstruct, OwnTargetFollowsTheTumour) {
  const JawPhantom p = make_jaw_phantom(1, 12);
  ReconstructionParams params = params_for(p);
  params.target = ReconstructionTarget::own;
  const Reconstruction own = reconstruct(p.jaw, p.donor, params);
  EXPECT_FALSE(own.symmetry);
  EXPECT_GT(truth_mean(1, own), truth_mean(1, reconstruct(p.jaw, p.donor, params_for(p))));
}

TEST(Reconstruct, WhatCannotBePlannedIsSaid) {
  const JawPhantom p = make_jaw_phantom(1, 12);
  const auto complaint = [&](auto&& change) {
    ReconstructionParams params = params_for(p);
    params.target = ReconstructionTarget::own;
    change(params);
    return error_of([&] { static_cast<void>(reconstruct(p.jaw, p.donor, params)); });
  };
  EXPECT_NE(complaint([](auto& q) { q.a_normal = {}; }).find("--a-normal"), std::string::npos);
  EXPECT_NE(complaint([](auto& q) { std::swap(q.a_mm, q.b_mm); }).find("face each other"), std::string::npos);
  EXPECT_NE(complaint([](auto& q) { q.a_mm = {500, 0, 0}; }), "");
  EXPECT_NE(complaint([](auto& q) { q.min_length_mm = 90; }).find("--min-length-mm"), std::string::npos);
  EXPECT_NE(complaint([](auto& q) { q.reserve_mm = 190; }).find("too short"), std::string::npos);
}

// OSTEO_PLANNING_SEEDS=30 test_planning --gtest_filter=Reconstruct.Benchmark: the table of docs/guides/planning.md.
TEST(Reconstruct, Benchmark) {
  const char* seeds = std::getenv("OSTEO_PLANNING_SEEDS");
  if (seeds == nullptr) GTEST_SKIP() << "OSTEO_PLANNING_SEEDS is not set";
  for (int seed = 1; seed <= std::atoi(seeds); ++seed) {
    const auto start = std::clock();
    const JawPhantom p = make_jaw_phantom(static_cast<std::uint64_t>(seed), 12);
    std::cout << "seed " << seed;
    try {
      const Reconstruction r = reconstruct(p.jaw, p.donor, params_for(p));
      const double s = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
      std::cout << " segments " << r.segments.size() << " contour_mean_mm " << r.contour_mean_mm << " truth_mean_mm "
                << truth_mean(static_cast<std::uint64_t>(seed), r) << " least_contact "
                << *std::min_element(r.contact.begin(), r.contact.end()) << " symmetry_deg "
                << angle_deg(*r.symmetry, p) << " processor_s " << s << std::endl;
    } catch (const Error& e) {
      std::cout << " rejected: " << e.what() << std::endl;
    }
  }
}

}  // namespace
}  // namespace osteo
