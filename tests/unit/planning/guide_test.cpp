// Cutting guides: manifold, as far from the bone as wanted, slots where the plan has them, and they can be put on.
#include <gtest/gtest.h>

#include <cstdlib>
#include <cstring>
#include <ctime>
#include <fstream>
#include <iostream>
#include <random>

#include "error_of.h"
#include "guide_parts.h"
#include "jaw_params.h"
#include "osteo/core/base/error.h"
#include "osteo/geometry/distance/distance_map.h"
#include "osteo/geometry/mesh/mesh_info.h"
#include "osteo/session/planning/detail/jaw_phantom.h"
#include "osteo/session/planning/planning.h"

namespace osteo {
namespace {

constexpr double kDeg = 3.14159265358979 / 180;

// Along z, about the axis.
TriangleSoup tube(double radius, double length_mm, std::uint32_t around = 64) {
  TriangleSoup s;
  const std::uint32_t rings = 40;
  for (std::uint32_t k = 0; k <= rings; ++k) {
    for (std::uint32_t n = 0; n < around; ++n)
      s.points_mm.push_back({radius * std::cos(360.0 * n / around * kDeg), radius * std::sin(360.0 * n / around * kDeg),
                             length_mm * k / rings});
  }
  for (std::uint32_t k = 0; k < rings; ++k) {
    for (std::uint32_t n = 0; n < around; ++n) {
      const std::uint32_t a = around * k + n, b = around * k + (n + 1) % around;
      s.triangles.push_back({a, b, b + around});
      s.triangles.push_back({a, b + around, a + around});
    }
  }
  for (std::uint32_t n = 1; n + 1 < around; ++n) {
    s.triangles.push_back({0, n + 1, n});
    s.triangles.push_back({around * rings, around * rings + n, around * rings + n + 1});
  }
  return s;
}

SurgicalPlan one_plane(Vec3 at, Vec3 normal, double kerf = 1) {
  SurgicalPlan plan;
  plan.planes = {{"cut", "fibula", at, normalized(normal), kerf, true}};
  return plan;
}

TriangleSoup box(Vec3 lo, Vec3 hi) {
  TriangleSoup s;
  for (int n = 0; n < 8; ++n) s.points_mm.push_back({n & 1 ? hi.x : lo.x, n & 2 ? hi.y : lo.y, n & 4 ? hi.z : lo.z});
  s.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                 {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return s;
}

using test::error_of;

struct SlotFound {
  double off_mm = 0, off_deg = 0, width_mm = 0;
  int places = 0;
};

// Goes along the plane's normal from places in the kerf, above the bone and below the guide's top, to where the solid
// begins: the face that stays, and the other. Independent of how the guide was made. Beside the slot's edges the solid
// may begin at its top or underside: what is met there lies more than 30 degrees from the plane.
SlotFound measured_slot(const PrintedGuide& g, const SignedDistance& solid, const SignedDistance& bone,
                        const CutPlane& p, double play) {
  const Vec3 e = p.waste_ahead ? p.normal : -p.normal;
  const Vec3 across = normalized(cross(g.approach, e)), up = cross(e, across);
  std::vector<Vec3> found;
  SlotFound out;
  for (double u = -4; u <= 4; u += 2) {
    for (double h = 0; h < 20; h += 0.7) {
      const Vec3 middle = p.at_mm + across * u + up * h + e * (p.kerf_mm / 2);
      if (bone.at(middle).signed_mm < 0.3 || solid.inside(middle)) continue;
      const auto wall = [&](double sign) {
        double lo = 0, hi = 1.5;
        if (!solid.inside(middle + e * (sign * hi))) return -1.0;
        while (hi - lo > 1e-5) (solid.inside(middle + e * (sign * (lo + hi) / 2)) ? hi : lo) = (lo + hi) / 2;
        const auto& t = g.solid.triangles[solid.closest(middle + e * (sign * hi)).triangle];
        const Vec3 &a = g.solid.points_mm[t[0]], &b = g.solid.points_mm[t[1]], &c = g.solid.points_mm[t[2]];
        return std::abs(dot(normalized(cross(b - a, c - a)), e)) < std::cos(30 * kDeg) ? -1.0 : hi;
      };
      const double stays = wall(-1);
      if (stays < 0) continue;
      found.push_back(middle - e * stays);
      if (const double other = wall(1); other > 0) out.width_mm = std::max(out.width_mm, stays + other);
    }
  }
  out.places = static_cast<int>(found.size());
  if (found.size() < 6) return out;
  // Plane through the places by least squares over the two directions in the planned one.
  double suu = 0, suv = 0, svv = 0, su = 0, sv = 0, sh = 0, suh = 0, svh = 0;
  const double n = static_cast<double>(found.size());
  for (const Vec3& q : found) {
    const double u = dot(q - p.at_mm, across), v = dot(q - p.at_mm, up), h = dot(q - p.at_mm, e) + play / 2;
    su += u, sv += v, sh += h, suu += u * u, suv += u * v, svv += v * v, suh += u * h, svh += v * h;
    out.off_mm = std::max(out.off_mm, std::abs(h));
  }
  const double a = suu - su * su / n, b = suv - su * sv / n, d = svv - sv * sv / n;
  const double r = suh - su * sh / n, s = svh - sv * sh / n, det = a * d - b * b;
  out.off_deg = std::atan(std::hypot((r * d - s * b) / det, (a * s - b * r) / det)) / kDeg;
  return out;
}

void expect_printable(const PrintedGuide& g) {
  const MeshSummary m = summarize(mesh_of(g.solid));
  EXPECT_TRUE(m.watertight && m.manifold) << m.open_edges << ' ' << m.nonmanifold_edges << ' ' << m.nonmanifold_points;
  EXPECT_EQ(m.bodies, 1U);
  EXPECT_EQ(m.degenerate + m.duplicates, 0U);
  EXPECT_GT(m.volume_mm3, 0) << "faces outward";
}

TEST(CuttingGuide, FitsATube) {
  const TriangleSoup bone = tube(6, 100);
  const SurgicalPlan plan = one_plane({0, 0, 50}, {0.2, 0.3, 1}, 1.1);
  CuttingGuideParams params;
  params.code = "case-7";
  params.approach = {1, 0, 0};
  const PrintedGuide g = make_cutting_guide(bone, plan, params);
  expect_printable(g);
  EXPECT_TRUE(g.engraved);
  EXPECT_NEAR(g.min_gap_mm, 0.1, 0.02);
  EXPECT_LT(g.seat_off_mm, 0.02);
  EXPECT_GT(g.seat_mm2, 100);
  EXPECT_GE(g.insertion_mm, 0.08) << "above the bone, along the way, the gap is at least as high as it is wide";
  EXPECT_LT(std::abs(dot(g.approach, normalized({1, 0, 0})) - 1), 0.1);
  const SignedDistance solid(g.solid), tree(bone);
  // Each corner of the guide by exact distance, each corner of the bone to the guide.
  double least = 1e9;
  for (const Vec3& p : g.solid.points_mm) least = std::min(least, tree.at(p).signed_mm);
  for (const Vec3& p : bone.points_mm) least = std::min(least, solid.at(p).signed_mm);
  EXPECT_GT(least, 0.08);
  EXPECT_LT(least, 0.12);
  const SlotFound slot = measured_slot(g, solid, tree, plan.planes[0], params.play_mm);
  EXPECT_GT(slot.places, 20);
  EXPECT_LT(slot.off_mm, 0.001);
  EXPECT_LT(slot.off_deg, 0.01);
  EXPECT_NEAR(slot.width_mm, 1.2, 0.001);
  // A tube holds against turning across it, not along it.
  ASSERT_EQ(g.cuts.size(), 1U);
  EXPECT_GT(g.cuts[0].rock_mm, 4) << "it slides";
}

TEST(CuttingGuide, OpenSlotsReachTheSide) {
  CuttingGuideParams params;
  const PrintedGuide closed = make_cutting_guide(tube(6, 100), one_plane({0, 0, 50}, {0, 0, 1}), params);
  params.slot = GuideSlot::open;
  const PrintedGuide open = make_cutting_guide(tube(6, 100), one_plane({0, 0, 50}, {0, 0, 1}), params);
  expect_printable(open);
  EXPECT_EQ(summarize(mesh_of(closed.solid)).euler, 0) << "a body with one hole through it";
  EXPECT_EQ(summarize(mesh_of(open.solid)).euler, 2);
}

TEST(CuttingGuide, RocksAsFarAsItsGapLets) {
  // A bone of square section that is as long as the guide seats: the plane turns by what the gap gives at its ends.
  const TriangleSoup bone = box({-5, -5, 0}, {5, 5, 100});
  CuttingGuideParams params;
  params.approach = {1, 0, 0};
  params.margin_mm = 10;
  const PrintedGuide g = make_cutting_guide(bone, one_plane({0, 0, 50}, {0, 0, 1}), params);
  ASSERT_EQ(g.cuts.size(), 1U);
  // Held down at its middle, it tilts until one end meets the bone, 10.55 mm away.
  const double tilts = std::atan(0.1 / 10.55) / kDeg;
  EXPECT_GT(g.cuts[0].rock_deg, 0.9 * tilts);
  EXPECT_LT(g.cuts[0].rock_deg, 4 * tilts) << "with the turn that its sides let";
  params.margin_mm = 40;
  EXPECT_LT(make_cutting_guide(bone, one_plane({0, 0, 50}, {0, 0, 1}), params).cuts[0].rock_deg, g.cuts[0].rock_deg)
      << "a longer guide sits better";
  // The motion that says so: it turns the plane that far, and the guide then meets the bone and does not enter it.
  const GuideCut& c = g.cuts[0];
  const Vec3 turned = c.rocked.rotation * Vec3{0, 0, 1};
  const double deg = std::acos(std::min(1.0, turned.z)) / kDeg;
  EXPECT_LE(deg, c.rock_deg + 1e-9);
  EXPECT_GT(deg, 0.7 * c.rock_deg);
  TriangleSoup moved = g.solid;
  for (Vec3& p : moved.points_mm) p = c.rocked(p);
  const SignedDistance tree(bone), solid(moved);
  double least = 1e9;
  for (const Vec3& p : moved.points_mm) least = std::min(least, tree.at(p).signed_mm);
  for (const Vec3& p : bone.points_mm) least = std::min(least, solid.at(p).signed_mm);
  EXPECT_GT(least, -0.005);
  EXPECT_LT(least, 0.02);
}

// What a rehearsal's saw feels of the slot: its faces as the solid has them.
TEST(CuttingGuide, ItsSlotIsToldAsItIs) {
  const TriangleSoup bone = tube(6, 100);
  const SurgicalPlan plan = one_plane({0, 0, 50}, {0.2, 0.3, 1}, 1.1);
  CuttingGuideParams params;
  params.approach = {1, 0, 0};
  std::vector<std::string> said;
  Context context;
  context.on_log([&](LogLevel level, std::string_view text) {
    if (level == LogLevel::warning) said.emplace_back(text);
  });
  const PrintedGuide g = make_cutting_guide(bone, plan, params, context);
  EXPECT_TRUE(said.empty());
  const GuideCut& c = g.cuts[0];
  const CutPlane& p = plan.planes[0];
  const Vec3 e = p.waste_ahead ? p.normal : -p.normal, up = normalized(c.slot_up_mm), across = cross(e, up);
  EXPECT_NEAR(dot(c.slot_at_mm - p.at_mm, e), p.kerf_mm / 2, 1e-9);
  EXPECT_NEAR(dot(c.slot_up_mm, e), 0, 1e-9);
  EXPECT_GT(dot(up, g.approach), 0.9);
  EXPECT_GE(length(c.slot_up_mm), params.wall_mm) << "over the highest place of the bone";
  EXPECT_NEAR(std::tan(c.play_deg * kDeg), params.play_mm / length(c.slot_up_mm), 1e-9);
  EXPECT_LT(c.play_deg, 1);
  // Free in the middle, and solid just behind each face wherever it is said to be one.
  const SignedDistance solid(g.solid);
  for (const double v : {-0.45, 0.0, 0.45}) {
    for (const double u : {-0.45, 0.0, 0.45}) {
      const Vec3 at = c.slot_at_mm + c.slot_up_mm * v + across * (c.slot_length_mm * u);
      EXPECT_FALSE(solid.inside(at)) << u << ' ' << v;
      for (const double side : {-1.0, 1.0}) {
        EXPECT_FALSE(solid.inside(at + e * (side * (c.width_mm / 2 - 0.01)))) << u << ' ' << v << ' ' << side;
        EXPECT_TRUE(solid.inside(at + e * (side * (c.width_mm / 2 + 0.01)))) << u << ' ' << v << ' ' << side;
      }
    }
  }
  // A thin one is told of.
  params.wall_mm = 1.5;
  make_cutting_guide(bone, plan, params, context);
  ASSERT_EQ(said.size(), 1U);
  EXPECT_NE(said[0].find("the blade can tilt by 1."), std::string::npos) << said[0];
}

TEST(CuttingGuide, ServesAReconstruction) {
  const JawPhantom p = make_jaw_phantom(1, 12);
  ReconstructionParams r = test::params_for(p);
  r.max_contour_mm = 0.1;
  r.min_length_mm = 12;
  const SurgicalPlan plan = reconstruct(p.jaw, p.donor, r).plan;
  CuttingGuideParams params;
  params.bone = "fibula";
  const PrintedGuide g = make_cutting_guide(p.donor, plan, params);
  expect_printable(g);
  EXPECT_NEAR(g.min_gap_mm, 0.1, 0.02);
  EXPECT_LT(g.seat_off_mm, 0.02);
  EXPECT_GE(g.insertion_mm, 0);
  ASSERT_GE(g.cuts.size(), 4U);
  const SignedDistance solid(g.solid), bone(p.donor);
  for (const GuideCut& c : g.cuts) {
    const SlotFound slot = measured_slot(g, solid, bone, plan.plane(c.plane), c.two_sided ? params.play_mm : 0);
    EXPECT_GT(slot.places, 6) << c.plane;
    EXPECT_LT(slot.off_mm, 0.05) << c.plane;
    EXPECT_LT(slot.off_deg, 0.1) << c.plane;
  }
  params.bone = "mandible";
  params.planes = "resection a";
  const PrintedGuide jaw = make_cutting_guide(p.jaw, plan, params);
  expect_printable(jaw);
  EXPECT_LT(jaw.seat_off_mm, 0.02);
}

// Rows of turns are sixty times those of shifts; unscaled, this one's shift was lost in rounding and called not held.
TEST(CuttingGuide, RocksAsFarAsItsGapLetsOnALongShaft) {
  const JawPhantom p = make_jaw_phantom(60, 12);
  ReconstructionParams r = test::params_for(p);
  CuttingGuideParams params;
  params.bone = "fibula";
  for (const GuideCut& c : make_cutting_guide(p.donor, reconstruct(p.jaw, p.donor, r).plan, params).cuts)
    EXPECT_LT(c.rock_mm, 5) << c.plane;
}

void write_obj(const std::string& path, const TriangleSoup& s) {
  const TriMesh m = mesh_of(s);  // single precision, as files of guides are
  std::ofstream out(path);
  out.precision(9);
  for (const auto& p : m.points_mm) out << "v " << p[0] << ' ' << p[1] << ' ' << p[2] << '\n';
  for (const auto& t : m.triangles) out << "f " << t[0] + 1 << ' ' << t[1] + 1 << ' ' << t[2] + 1 << '\n';
}

// OSTEO_GUIDES_SEEDS=30 [OSTEO_GUIDES_OUT=FOLDER] test_planning --gtest_filter=CuttingGuide.Benchmark: the table of
// docs/validation/planning.md; tests/bench/guides_reference.py judges what is in FOLDER.
TEST(CuttingGuide, Benchmark) {
  const char* seeds = std::getenv("OSTEO_GUIDES_SEEDS");
  const char* folder = std::getenv("OSTEO_GUIDES_OUT");
  if (seeds == nullptr) GTEST_SKIP() << "OSTEO_GUIDES_SEEDS is not set";
  const char* const dash = std::strchr(seeds, '-');  // 30, or 31-60
  for (int seed = dash != nullptr ? std::atoi(seeds) : 1; seed <= std::atoi(dash != nullptr ? dash + 1 : seeds);
       ++seed) {
    const JawPhantom p = make_jaw_phantom(static_cast<std::uint64_t>(seed), 12);
    ReconstructionParams r = test::params_for(p);
    SurgicalPlan plan;
    try {
      plan = reconstruct(p.jaw, p.donor, r).plan;
    } catch (const Error& e) {
      std::cout << "seed " << seed << " no plan: " << e.what() << std::endl;
      continue;
    }
    for (const std::string which : {"fibula", "resection a", "resection b"}) {
      CuttingGuideParams params;
      const bool donor = which == "fibula";
      params.bone = donor ? "fibula" : "mandible";
      if (!donor) params.planes = which;
      params.code = "S" + std::to_string(seed);
      const TriangleSoup& bone = donor ? p.donor : p.jaw;
      const auto start = std::clock();
      std::cout << "seed " << seed << ' ' << which;
      try {
        const PrintedGuide g = make_cutting_guide(bone, plan, params);
        const double s = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
        const MeshSummary m = summarize(mesh_of(g.solid));
        const SignedDistance solid(g.solid), distance(bone);
        SlotFound worst;
        double rock = 0;
        for (const GuideCut& c : g.cuts) {
          const SlotFound f = measured_slot(g, solid, distance, plan.plane(c.plane), c.two_sided ? params.play_mm : 0);
          if (f.places < 6) std::cout << " slot not measured: " << c.plane;
          worst.off_mm = std::max(worst.off_mm, f.off_mm);
          worst.off_deg = std::max(worst.off_deg, f.off_deg);
          rock = std::max(rock, c.rock_deg);
        }
        std::cout << " manifold " << (m.watertight && m.manifold && m.bodies == 1) << " min_gap " << g.min_gap_mm
                  << " seat_off " << g.seat_off_mm << " seat_mm2 " << g.seat_mm2 << " insertion " << g.insertion_mm
                  << " slot_mm " << worst.off_mm << " slot_deg " << worst.off_deg << " rock_deg " << rock
                  << " engraved " << g.engraved << " triangles " << m.triangles << " s " << s << std::endl;
        if (folder == nullptr) continue;
        const std::string name = std::string(folder) + "/" + std::to_string(seed) + " " + which;
        write_obj(name + " guide.obj", g.solid);
        write_obj(name + " bone.obj", bone);
        std::ofstream(name + " approach.txt") << g.approach.x << ' ' << g.approach.y << ' ' << g.approach.z << '\n';
      } catch (const Error& e) {
        std::cout << " rejected: " << e.what() << std::endl;
      }
    }
  }
}

TEST(CuttingGuide, WhatCannotBeMadeIsSaid) {
  const TriangleSoup bone = tube(6, 100);
  const auto complaint = [&](const SurgicalPlan& plan, auto&& change) {
    CuttingGuideParams params;
    params.approach = {1, 0, 0};
    change(params);
    return error_of([&] { static_cast<void>(make_cutting_guide(bone, plan, params)); });
  };
  const SurgicalPlan one = one_plane({0, 0, 50}, {0, 0, 1});
  EXPECT_EQ(complaint(one, [](auto&) {}), "");
  EXPECT_NE(complaint(one, [](auto& q) { q.approach = {0, 0, 1}; }).find("--approach"), std::string::npos);
  EXPECT_NE(complaint(one, [](auto& q) { q.code = "a b"; }).find("--code"), std::string::npos);
  EXPECT_NE(complaint(one, [](auto& q) { q.bone = "ulna"; }).find("ulna"), std::string::npos);
  EXPECT_NE(complaint(one, [](auto& q) { q.planes = "cut, other"; }).find("other"), std::string::npos);
  EXPECT_NE(complaint(one_plane({0, 0, 300}, {0, 0, 1}), [](auto&) {}).find("does not cut"), std::string::npos);
  // A wedge that opens away from the guide.
  SurgicalPlan wedge = one_plane({0, 0, 50}, {-0.3, 0, 1});
  wedge.planes.push_back({"next", "fibula", {0, 0, 54}, normalized({-0.3, 0, -1}), 1, true});
  EXPECT_NE(complaint(wedge, [](auto&) {}).find("closes towards the guide"), std::string::npos);
  EXPECT_EQ(complaint(wedge, [](auto& q) { q.approach = {-1, 0, 0}; }), "") << "and from the other side it is open";
  EXPECT_EQ(complaint(wedge, [](auto& q) { q.approach = {}; }), "") << "which is found";
}

// A bar along z, sawn at z = 30 and 60 with what lies between removed; voxels of 1 mm whose places are plain.
TEST(PlannedHarm, WhatTheSawMeetsAndWhatIsRemoved) {
  const TriangleSoup bar = box({-5, -5, 0}, {5, 5, 100});
  SurgicalPlan plan;
  plan.planes.push_back({"lower", "bar", {0, 0, 30}, {0, 0, 1}, 1, true});
  plan.planes.push_back({"upper", "bar", {0, 0, 60}, {0, 0, 1}, 1, false});  // its kerf lies below it
  const Frame frame{{41, 41, 101}, {1, 1, 1}, {-20, -20, 0}};
  const auto voxels = make_voxels<std::uint8_t>(frame.voxel_count());
  std::fill_n(voxels.get(), frame.voxel_count(), std::uint8_t{0});
  Labels labels{{frame, voxels}, {{1, "nerve"}, {2, "tooth"}, {3, "far"}, {4, "beside"}, {5, "nowhere"}}};
  const auto put = [&](int x, int y, int z, std::uint8_t value) { voxels[labels.offset(x + 20, y + 20, z)] = value; };
  for (int z = 10; z <= 80; ++z) put(0, 0, z, 1);   // 71 mm3, right through
  for (int z = 34; z <= 40; ++z) put(2, 1, z, 2);   // 7 mm3, from 33.5 on: 2.5 above the lower kerf
  for (int z = 80; z <= 85; ++z) put(1, 1, z, 3);   // 19.5 above the upper plane
  for (int z = 28; z <= 32; ++z) put(15, 0, z, 4);  // at the lower plane, but beyond the section's circle
  const PlannedHarm harm = harm_of(plan, "bar", bar, labels);
  ASSERT_EQ(harm.at_cuts.size(), 3U);
  const auto at = [&](std::size_t n, const char* plane, const char* structure, double mm, double mm3) {
    SCOPED_TRACE(n);
    EXPECT_EQ(harm.at_cuts[n].plane, plane);
    EXPECT_EQ(harm.at_cuts[n].structure, structure);
    EXPECT_NEAR(harm.at_cuts[n].nearest_mm, mm, 1e-9);
    EXPECT_NEAR(harm.at_cuts[n].cut_mm3, mm3, 1e-9);
  };
  at(0, "lower", "nerve", 0, 1);  // halves of the voxels at 30 and 31
  at(1, "lower", "tooth", 2.5, 0);
  at(2, "upper", "nerve", 0, 1);
  // Ahead of both planes: the nerve from 31 to 59, all of the tooth; what is far from the bar is not removed with it.
  ASSERT_EQ(harm.removed.size(), 2U);
  EXPECT_EQ(harm.removed[0].structure, "tooth");
  EXPECT_EQ(harm.removed[0].share, 1);
  EXPECT_EQ(harm.removed[1].structure, "nerve");
  EXPECT_EQ(harm.removed[1].mm3, 29);
  EXPECT_NEAR(harm.removed[1].share, 29.0 / 71, 1e-12);
  // Nearer is asked for; one plane alone removes nothing that is known; nothing without names, or of another bone.
  EXPECT_EQ(harm_of(plan, "bar", bar, labels, 2).at_cuts.size(), 2U);
  plan.planes.pop_back();
  EXPECT_TRUE(harm_of(plan, "bar", bar, labels).removed.empty());
  const auto complaint = [&](const char* bone) {
    return error_of([&] { static_cast<void>(harm_of(plan, bone, bar, labels)); });
  };
  EXPECT_NE(complaint("rod").find("'rod'"), std::string::npos);
  labels.structures.clear();
  EXPECT_NE(complaint("bar").find("no names"), std::string::npos);
}

TEST(InsertionClearance, IsTheLeastHeightAbove) {
  EXPECT_NEAR(insertion_clearance_mm(box({0, 0, 5}, {4, 4, 9}), box({1, 1, 0}, {9, 9, 3}), {0, 0, 1}), 2, 1e-12);
  EXPECT_NEAR(insertion_clearance_mm(box({0, 0, 5}, {4, 4, 9}), box({1, 1, 0}, {9, 9, 3}), {0, 0, -1}), -9, 1e-12);
  EXPECT_TRUE(std::isinf(insertion_clearance_mm(box({0, 0, 5}, {1, 1, 9}), box({2, 2, 0}, {9, 9, 3}), {0, 0, 1})));
  // Two edges that cross, high above each other's corners.
  TriangleSoup a, b;
  a.points_mm = {{-1, 0, 1}, {1, 0, 1}, {0, 1, 9}};
  b.points_mm = {{0, -1, 0.75}, {0, 2, 0.75}, {2, 0, -9}};
  a.triangles = b.triangles = {{0, 1, 2}};
  EXPECT_NEAR(insertion_clearance_mm(a, b, {0, 0, 1}), 0.25, 1e-9);
}

TEST(GuideRock, LinearProgrammesAreSolved) {
  using Row = std::array<double, 6>;
  // max x + y, x + 2y <= 4, 3x + y <= 6, x >= -1: at (1.6, 1.2).
  const std::vector<Row> a{{1, 2, 0, 0, 0, 0}, {3, 1, 0, 0, 0, 0}, {-1, 0, 0, 0, 0, 0}};
  EXPECT_NEAR(guide::largest({1, 1, 0, 0, 0, 0}, a, {4, 6, 1}), 2.8, 1e-12);
  EXPECT_NEAR(guide::largest({-1, 0, 0, 0, 0, 0}, a, {4, 6, 1}), 1, 1e-12);
  EXPECT_TRUE(std::isinf(guide::largest({0, 0, 1, 0, 0, 0}, a, {4, 6, 1})));
  // |R x| <= 1 in each place, R the reflection I - J / 3, which is its own inverse: c . x = (R c) . (R x).
  const auto reflection = [](std::size_t row, std::size_t column) { return (row == column ? 1.0 : 0.0) - 1.0 / 3; };
  const Row c{1, -2, 0.5, 3, 0, 1};
  std::vector<Row> turned;
  std::vector<double> b;
  double expected = 0;
  for (std::size_t k = 0; k < 6; ++k) {
    double rc = 0;
    for (std::size_t n = 0; n < 6; ++n) rc += reflection(k, n) * c[n];
    expected += std::abs(rc);
    for (const double sign : {1.0, -1.0}) {
      Row r{};
      for (std::size_t n = 0; n < 6; ++n) r[n] = sign * reflection(k, n);
      turned.push_back(r);
      b.push_back(1);
    }
  }
  EXPECT_NEAR(guide::largest(c, turned, b), expected, 1e-9);
}

// As guides have them: unit normals with arms of centimetres, a thousand rows, many that meet in the optimum. It is
// known by how they are made: a cost that is a positive sum of rows which hold with equality at a place has its most
// there.
TEST(GuideRock, ThousandsOfContactsAreHeldBy) {
  using Row = std::array<double, 6>;
  std::mt19937_64 random(7);
  const auto between = [&](double lo, double hi) {
    return lo + (hi - lo) * static_cast<double>(random() >> 11U) * 0x1p-53;
  };
  const auto product = [](const Row& a, const Row& b) {
    double sum = 0;
    for (std::size_t k = 0; k < 6; ++k) sum += a[k] * b[k];
    return sum;
  };
  for (int n = 0; n < 60; ++n) {
    const double turn = n % 2 == 0 ? 0.002 : 0.08;
    Row x{};
    for (std::size_t k = 0; k < 6; ++k) x[k] = k < 3 ? between(-0.1, 0.1) : between(-turn, turn);
    std::vector<Row> a;
    std::vector<double> b;
    Row cost{};
    for (int m = 0; m < 1000; ++m) {
      // Nearly alike, as on a smooth shaft: normals within 0.2 of two directions.
      const Vec3 normal = normalized({between(-0.2, 0.2), m % 2 == 0 ? 1 : between(-1, 1), between(-0.2, 0.2)}),
                 at{between(-5, 5), between(-5, 5), between(-60, 60)}, arm = cross(at, normal);
      Row r{normal.x, normal.y, normal.z, arm.x, arm.y, arm.z};
      double there = product(r, x);
      if (there < 0) {
        for (double& v : r) v = -v;
        there = -there;
      }
      a.push_back(r);
      b.push_back(there + (m < 60 ? 0 : between(0, 0.1)));
      const double weight = m < 60 ? between(0.1, 1) : 0;
      for (std::size_t k = 0; k < 6; ++k) cost[k] += weight * r[k];
    }
    Row found{};
    const double most = guide::largest(cost, a, b, &found);
    EXPECT_NEAR(most, product(cost, x), 1e-7 * (1 + std::abs(most))) << n;
    EXPECT_NEAR(product(cost, found), most, 1e-7 * (1 + std::abs(most))) << n;
    for (std::size_t m = 0; m < a.size(); ++m) ASSERT_LE(product(a[m], found), b[m] + 1e-8) << n << ' ' << m;
  }
}

// On a smooth shaft next to no row differs from its neighbours, so that pivots are nearly nothing.
TEST(GuideRock, ASmoothShaftIsHeldBy) {
  using Row = std::array<double, 6>;
  std::mt19937_64 random(3);
  const auto between = [&](double lo, double hi) {
    return lo + (hi - lo) * static_cast<double>(random() >> 11U) * 0x1p-53;
  };
  for (int n = 0; n < 12; ++n) {
    std::vector<Row> a;
    std::vector<double> b;
    const double bow = n % 3 == 0 ? 0 : between(0, 2e-3), flat = n % 2 == 0 ? 0 : between(0, 0.1);
    for (double z = -15; z <= 15; z += 0.6) {
      for (double angle = -80; angle <= 80; angle += 5) {
        const double c = std::cos(angle * kDeg), s = std::sin(angle * kDeg);
        const Vec3 normal = normalized({c * (1 + flat), s, -2 * bow * z}),
                   at{6 * c + bow * z * z, 6 * s * (1 - flat), z}, arm = cross(at, normal);
        a.push_back({-normal.x, -normal.y, -normal.z, -arm.x, -arm.y, -arm.z});
        b.push_back(0.1 + between(-1e-3, 1e-3));
      }
    }
    a.push_back({1, 0, 0, 0, 0, 0});
    b.push_back(0);
    for (std::size_t k = 0; k < 6; ++k) {
      for (const double sign : {1.0, -1.0}) {
        a.emplace_back();
        a.back()[k] = sign;
        b.push_back(k < 3 ? 5 : 0.0873);
      }
    }
    for (const Row& cost :
         {Row{0, 0, 1, 3, -2, 0}, Row{0, 0, 0, 1, 0, 0}, Row{0, 0, 0, 0, 1, 0}, Row{0, 0, 0, 0.7, -0.7, 0}}) {
      Row x{};
      const double most = guide::largest(cost, a, b, &x);
      ASSERT_TRUE(std::isfinite(most)) << n;
      double reached = 0, worst = 0;
      for (std::size_t k = 0; k < 6; ++k) reached += cost[k] * x[k];
      for (std::size_t m = 0; m < a.size(); ++m) {
        double row = -b[m];
        for (std::size_t k = 0; k < 6; ++k) row += a[m][k] * x[k];
        worst = std::max(worst, row);
      }
      EXPECT_NEAR(reached, most, 1e-8) << n;
      EXPECT_LT(worst, 1e-8) << n;
    }
  }
}

}  // namespace
}  // namespace osteo
