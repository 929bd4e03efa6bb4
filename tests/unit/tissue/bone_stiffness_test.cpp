// Stiffness by density against closed forms, and a graded bar against the integral of its compliance.
#include "osteo/simulation/tissue/bone_stiffness.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <set>

#include "block.h"
#include "calculix.h"
#include "osteo/core/base/error.h"
#include "osteo/imaging/io/inp_io.h"
#include "osteo/simulation/tissue/fem.h"
#include "osteo/simulation/tissue/problem.h"

namespace osteo {
namespace {

using test::Block;
using test::block;

// A CT whose HU are `of` the place, whole around 0 to `size` and a voxel beyond.
Image ct_of(Vec3 size, Vec3 spacing, const std::function<double(Vec3)>& of, Mat3 direction = {}) {
  Frame f;
  f.spacing_mm = spacing;
  f.direction = direction;
  for (std::size_t a = 0; a < 3; ++a) f.dims[a] = static_cast<int>(std::ceil(size[a] / spacing[a])) + 3;
  f.origin_mm = direction * (spacing * -1.0);
  const auto v = make_voxels<std::int16_t>(f.voxel_count());
  std::size_t n = 0;
  for (int k = 0; k < f.dims[2]; ++k)
    for (int j = 0; j < f.dims[1]; ++j)
      for (int i = 0; i < f.dims[0]; ++i, ++n)
        v[n] =
            static_cast<std::int16_t>(std::lround(of({(i - 1) * spacing.x, (j - 1) * spacing.y, (k - 1) * spacing.z})));
  return {f, v};
}

TetMesh mesh_of(const Block& b, Mat3 turn = {}) {
  TetMesh m;
  m.points_mm.resize(b.points.size());
  for (std::size_t p = 0; p < b.points.size(); ++p) m.points_mm[p] = to_floats(turn * b.points[p]);
  m.tets.resize(b.tets.size());
  std::copy(b.tets.begin(), b.tets.end(), m.tets.begin());
  return m;
}

// Volume of each tetrahedron.
std::vector<double> volumes(const Block& b) {
  std::vector<double> v;
  for (const auto& t : b.tets)
    v.push_back(
        dot(cross(b.points[t[1]] - b.points[t[0]], b.points[t[2]] - b.points[t[0]]), b.points[t[3]] - b.points[t[0]]) /
        6);
  return v;
}

double mean(const std::vector<double>& e, const std::vector<double>& volume) {
  double sum = 0, all = 0;
  for (std::size_t t = 0; t < e.size(); ++t) sum += e[t] * volume[t], all += volume[t];
  return sum / all;
}

TEST(BoneStiffness, LawsGiveTheirPublishedValues) {
  BoneDensity d;
  d.per_1000_hu = 1;
  d.ash_correction = false;                    // ash in g/cm3 is HU / 1000
  EXPECT_NEAR(young_mpa(598, d), 6850, 1e-9);  // apparent density 1
  EXPECT_NEAR(apparent_density(1196, d), 2, 1e-12);
  EXPECT_NEAR(young_mpa(1196, d), 6850 * std::pow(2, 1.49), 1e-8);
  d.law = StiffnessLaw::keller_1994;
  EXPECT_NEAR(young_mpa(1000, d), 10500, 1e-9);
  EXPECT_NEAR(young_mpa(500, d), 10500 * std::pow(0.5, 2.29), 1e-9);
  d.law = StiffnessLaw::carter_hayes_1977;
  EXPECT_NEAR(young_mpa(598, d), 2875, 1);  // as it is mostly quoted
  d.law = StiffnessLaw::keyak_1998;
  EXPECT_NEAR(young_mpa(1000, d), 10200, 1e-9);
  EXPECT_NEAR(young_mpa(400, d), 5307 * 0.4 + 469, 1e-9);
  EXPECT_NEAR(young_mpa(200, d), 33900 * std::pow(0.2, 2.2), 1e-9);
  // Its three parts meet to a few percent.
  EXPECT_NEAR(young_mpa(271, d) / young_mpa(270, d), 1, 0.04);
  EXPECT_NEAR(young_mpa(600, d) / young_mpa(599, d), 1, 0.04);
  // The correction: as 0.877 r + 0.079 it is mostly quoted.
  d.ash_correction = true;
  EXPECT_NEAR(ash_density(1000, d), 0.877 + 0.079, 1e-3);
  for (const StiffnessLaw law : {StiffnessLaw::morgan_2003, StiffnessLaw::keller_1994, StiffnessLaw::carter_hayes_1977,
                                 StiffnessLaw::keyak_1998}) {
    d.law = law;
    EXPECT_EQ(young_mpa(-1000, d), 0) << static_cast<int>(law);
  }
}

TEST(BoneStiffness, OfEvenBoneItIsTheLaw) {
  const Block b = block(4, 3, 5, 2.0);
  const TetMesh m = mesh_of(b);
  const Image ct = ct_of({8, 6, 10}, {0.7, 0.9, 1.3}, [](Vec3) { return 900; });
  const BoneDensity d;
  const BoneStiffness s = bone_stiffness(m, ct, d);
  EXPECT_EQ(s.materials, 1U);
  for (const double e : s.young_mpa) EXPECT_NEAR(e, young_mpa(900, d), 1e-9 * e);
  EXPECT_NEAR(s.volume_mm3, 480, 1e-9);
  EXPECT_NEAR(s.mass_g, 0.48 * apparent_density(900, d), 1e-9);
  EXPECT_EQ(s.share_below + s.share_above, 0);
}

TEST(BoneStiffness, IsTheMeanOfTheModulusAndNotOfTheHu) {
  // HU rise along x from 0 to 1600: the mean modulus over the body is an integral; that of the mean HU is a third less.
  const Block b = block(2, 2, 2, 8.0);
  const Image ct = ct_of({16, 16, 16}, {0.5, 0.5, 0.5}, [](Vec3 p) { return 100 * p.x; });
  BoneDensity d;
  d.law = StiffnessLaw::keller_1994;
  double exact = 0;
  constexpr int kSteps = 100'000;
  for (int i = 0; i < kSteps; ++i) exact += young_mpa(1600 * (i + 0.5) / kSteps, d) / kSteps;
  const BoneStiffness s = bone_stiffness(mesh_of(b), ct, d, 0);
  EXPECT_NEAR(mean(s.young_mpa, volumes(b)), exact, 2e-3 * exact);
  EXPECT_GT(exact, 1.2 * young_mpa(800, d));
  for (std::size_t t = 0; t < b.tets.size(); ++t) {
    double x = 0;
    for (const std::uint32_t c : b.tets[t]) x += b.points[c].x / 4;
    EXPECT_NEAR(s.hu[t], 100 * x, 0.01);  // the mean of what is linear is at the middle
  }
}

TEST(BoneStiffness, TurnsWithTheCt) {
  const Block b = block(3, 3, 3, 2.0);
  const auto of = [](Vec3 p) { return 300 + 90 * p.x + 40 * p.y - 20 * p.z; };
  const Vec3 spacing{0.6, 0.8, 1.1};
  const Vec3 x = normalized({0.9, 0.3, -0.1}), y = normalized(cross(Vec3{0, 0.2, 1}, x));
  const Mat3 turn{{x, y, cross(x, y)}};
  const BoneStiffness a = bone_stiffness(mesh_of(b), ct_of({6, 6, 6}, spacing, of), {}, 0);
  const BoneStiffness c = bone_stiffness(mesh_of(b, turn), ct_of({6, 6, 6}, spacing, of, turn), {}, 0);
  for (std::size_t t = 0; t < a.young_mpa.size(); ++t)
    EXPECT_NEAR(a.young_mpa[t], c.young_mpa[t], 1e-4 * a.young_mpa[t]);
}

TEST(BoneStiffness, MaterialsAreAsStiffTogetherAsBefore) {
  const Block b = block(8, 8, 8, 1.0);
  const Image ct = ct_of({8, 8, 8}, {0.5, 0.5, 0.5}, [](Vec3 p) { return 100 + 200 * p.x + 30 * std::sin(3 * p.y); });
  const BoneStiffness own = bone_stiffness(mesh_of(b), ct, {}, 0), few = bone_stiffness(mesh_of(b), ct, {}, 0.05);
  EXPECT_GT(own.materials, 4 * few.materials);
  EXPECT_EQ(few.materials, std::set<double>(few.young_mpa.begin(), few.young_mpa.end()).size());
  const double m = mean(own.young_mpa, volumes(b));
  EXPECT_NEAR(mean(few.young_mpa, volumes(b)), m, 1e-9 * m);
  for (std::size_t t = 0; t < own.young_mpa.size(); ++t) EXPECT_NEAR(few.young_mpa[t] / own.young_mpa[t], 1, 0.051);
  Context one, two;
  one.threads = 1;
  two.threads = 2;
  EXPECT_EQ(bone_stiffness(mesh_of(b), ct, {}, 0.02, one).young_mpa,
            bone_stiffness(mesh_of(b), ct, {}, 0.02, two).young_mpa);
}

TEST(BoneStiffness, AGradedBarStretchesByTheIntegralOfItsCompliance) {
  // Without contraction across, the bar is a row of springs: u = F/A times the integral of 1/E.
  const int n = 24;
  const Block b = block(3, 3, n, 1.0);
  const auto of = [](Vec3 p) { return 400 + 45 * p.z; };
  const Image ct = ct_of({3, 3, double(n)}, {0.5, 0.5, 0.5}, of);
  const BoneDensity d;
  double compliance = 0;
  for (int i = 0; i < 24'000; ++i) compliance += 0.001 / young_mpa(of({0, 0, (i + 0.5) / 1000}), d);
  for (const double step : {0.0, 0.02}) {
    const BoneStiffness s = bone_stiffness(mesh_of(b), ct, d, step);
    std::vector<Material> materials;
    for (const double e : s.young_mpa) materials.push_back({e, 0});
    const FemBody body(b.points, b.tets, materials, ElasticLaw::linear, TetOrder::t4);
    TissueLoad load;
    for (std::uint32_t p = 0; p < b.points.size(); ++p) {
      if (b.points[p].z < 1e-9) load.fixed.push_back(p);
      if (b.points[p].z > n - 1e-9) load.moved.push_back({p, 4, {0, 0, 0.01}});
    }
    const Statics r = statics(body, body.on_all_points(load));
    ASSERT_TRUE(r.converged) << r.why;
    // Half of force times way, in N mm.
    EXPECT_NEAR(2 * r.energy_mj / 0.01, 0.01 * 9 / compliance, 4e-3 * 0.01 * 9 / compliance) << step;
  }
}

TEST(BoneStiffness, WeighsByTheCt) {
  const Block b = block(3, 3, 12, 1.0);
  const auto of = [](Vec3 p) { return 200 + 100 * p.z; };
  const Image ct = ct_of({3, 3, 12}, {0.5, 0.5, 0.5}, of);
  BoneDensity d;
  for (const BoneWeight weight : {BoneWeight::apparent, BoneWeight::in_situ}) {
    d.weight = weight;
    // Both lines of density are straight here, so the mean is that of the middle.
    const double middle = weight == BoneWeight::apparent ? apparent_density(800, d) : 1.017 + 0.000592 * 800;
    for (const double step : {0.0, 0.02, 0.5}) {
      const BoneStiffness s = bone_stiffness(mesh_of(b), ct, d, step);
      EXPECT_NEAR(s.mass_g, middle * 0.108, 1e-6 * s.mass_g) << step;
      EXPECT_NEAR(mean(s.density_kg_m3, volumes(b)), 1000 * middle, 1e-3 * middle) << step;
      // One density a material, so a file has as many materials as moduli.
      std::set<std::pair<double, double>> both;
      for (std::size_t t = 0; t < s.young_mpa.size(); ++t) both.insert({s.young_mpa[t], s.density_kg_m3[t]});
      EXPECT_EQ(both.size(), s.materials);
    }
  }
  // With marrow: water at 0 HU, air at -1000, without a step at 100.
  EXPECT_DOUBLE_EQ(weighed_density(0, d), 1);
  EXPECT_DOUBLE_EQ(weighed_density(-1000, d), 0);
  EXPECT_DOUBLE_EQ(weighed_density(-3000, d), 0);
  EXPECT_NEAR(weighed_density(99.9999, d), weighed_density(100, d), 1e-6);
  EXPECT_NEAR(weighed_density(1524, d), 1.919, 1e-3);
}

// Hung up by its end a bar that is stiffer and heavier below stretches by the integral of what hangs below each place
// over EA.
TEST(BoneStiffness, AGradedBarHangsByItsOwnWeight) {
  const int n = 24;
  const Block b = block(3, 3, n, 1.0);
  const auto of = [](Vec3 p) { return 1500 - 45 * p.z; };
  const Image ct = ct_of({3, 3, double(n)}, {0.5, 0.5, 0.5}, of);
  BoneDensity d;
  d.weight = BoneWeight::in_situ;
  const double g = 9.81;
  double below_n = 0, tip = 0;  // from the free end at z = 0 up to where it is held
  for (int i = 0; i < 24'000; ++i) {
    const Vec3 at{0, 0, (i + 0.5) / 1000};
    const double weight = weighed_density(of(at), d) * 1e-6 * g * 9 * 0.001;
    tip += (below_n + weight / 2) / (9 * young_mpa(of(at), d)) * 0.001;
    below_n += weight;
  }
  const BoneStiffness s = bone_stiffness(mesh_of(b), ct, d, 0.02);
  std::vector<Material> materials;
  for (std::size_t t = 0; t < s.young_mpa.size(); ++t) materials.push_back({s.young_mpa[t], 0, s.density_kg_m3[t]});
  for (const TetOrder order : {TetOrder::t4, TetOrder::t10}) {
    const FemBody body(b.points, b.tets, materials, ElasticLaw::linear, order);
    TissueLoad load;
    load.gravity_m_s2 = {0, 0, -g};
    for (std::uint32_t p = 0; p < b.points.size(); ++p) {
      if (b.points[p].z > n - 1e-9) load.fixed.push_back(p);
    }
    const TissueLoad all = body.on_all_points(load);
    EXPECT_THROW(static_cast<void>(statics(body, all)), Error);  // its weight is not among the forces
    const std::string inp = inp_text(body, all);
    const InpFile file = parse_inp(inp, "bar");
    const TissueProblem read = parse_tissue_problem(inp, file.mesh);
    const Statics r = statics(body, body.on_all_points(read.loads.at(0)));
    ASSERT_TRUE(r.converged) << r.why;
    EXPECT_NEAR(r.reaction_n.z, below_n, 1e-3 * below_n);
    double sum = 0;
    int ends = 0;
    for (std::uint32_t p = 0; p < b.points.size(); ++p) {
      if (b.points[p].z < 1e-9) sum += r.points_mm[p].z, ++ends;
    }
    EXPECT_NEAR(-sum / ends, tip, 5e-3 * tip);
    std::printf("stretched by %.4f of what is in closed form\n", -sum / ends / tip);
    if (!test::calculix_is_here()) {
      std::printf("CalculiX (ccx) is not installed: agreement with it not tested\n");
      continue;
    }
    const auto u = test::by_calculix(inp, body.point_count());
    ASSERT_EQ(u.size(), body.point_count());
    for (std::size_t p = 0; p < u.size(); ++p)
      ASSERT_LT(length(u[p] - (r.points_mm[p] - body.rest()[p])), 1e-5 * tip) << p;
  }
  // No weight without density, and none among forces that was to be apart.
  const FemBody light(b.points, b.tets, {{100, 0.3}}, ElasticLaw::linear, TetOrder::t4);
  TissueLoad load;
  load.fixed = {0, 1, 2, 3};
  load.gravity_m_s2 = {0, 0, -g};
  EXPECT_THROW(static_cast<void>(inp_text(light, load)), Error);
}

TEST(BoneStiffness, SaysWhatItLimitsAndRefuses) {
  const Block b = block(4, 4, 4, 1.0);
  const Image ct = ct_of({4, 4, 4}, {0.5, 0.5, 0.5}, [](Vec3 p) {
    return p.x < 0.9 ? -1000 : p.x > 3.1 ? 20000 : 800;
  });
  const BoneDensity d;
  const BoneStiffness s = bone_stiffness(mesh_of(b), ct, d);
  EXPECT_GT(s.share_above, 0.1);
  EXPECT_LT(s.share_above, 0.5);
  EXPECT_NEAR(*std::max_element(s.young_mpa.begin(), s.young_mpa.end()), d.max_mpa, 1e-6);
  const Image air = ct_of({4, 4, 4}, {0.5, 0.5, 0.5}, [](Vec3) { return -1000; });
  const BoneStiffness soft = bone_stiffness(mesh_of(b), air, d);
  EXPECT_EQ(soft.share_below, 1);
  EXPECT_EQ(soft.materials, 1U);
  EXPECT_NEAR(soft.young_mpa.front(), d.min_mpa, 1e-12);

  const auto message = [&](const TetMesh& m, const BoneDensity& density, double step) {
    try {
      (void)bone_stiffness(m, ct, density, step);
    } catch (const Error& e) {
      return std::string(e.what());
    }
    return std::string("accepted");
  };
  TetMesh away = mesh_of(b);
  for (auto& p : away.points_mm) p[2] += 2;
  EXPECT_NE(message(away, d, 0).find("% of the mesh lies outside of the CT"), std::string::npos);
  TetMesh nowhere = mesh_of(b);
  nowhere.points_mm[0][1] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_NE(message(nowhere, d, 0).find("not finite"), std::string::npos);
  // A little outside, as where a CT was cropped through bone: with the values at the border, and told.
  TetMesh beside = mesh_of(b);
  for (auto& p : beside.points_mm) p[2] += 1.1F;
  const BoneStiffness out = bone_stiffness(beside, ct, d);
  EXPECT_NEAR(out.share_outside, 0.1 / 4, 0.02);  // a few samples a tetrahedron
  EXPECT_EQ(s.share_outside, 0);
  BoneDensity bad = d;
  bad.per_1000_hu = 0;
  EXPECT_NE(message(mesh_of(b), bad, 0), "accepted");
  bad = d;
  bad.max_mpa = 0.5;
  EXPECT_NE(message(mesh_of(b), bad, 0), "accepted");
  EXPECT_NE(message(mesh_of(b), d, -0.1), "accepted");
}

}  // namespace
}  // namespace osteo
