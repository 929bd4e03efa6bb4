#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numbers>
#include <random>

#include "osteo/core/base/error.h"
#include "osteo/core/base/simd.h"
#include "osteo/simulation/bone/depth_map.h"
#include "osteo/simulation/bone/live_surface.h"
#include "osteo/simulation/haptics/servo.h"
#include "overlap_kernel.h"
#include "slab.h"
#include "solid.h"

namespace osteo {
namespace {

using test::slab;

DeviceSample at(double x, double y, double z, int tool = 3) {
  DeviceSample s;
  s.position_mm = {static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)};
  s.axis = {0.6F, 0, 0.8F};
  s.pedal = 255;
  s.tool = static_cast<std::uint8_t>(tool);
  return s;
}

// Voxels filled by 8^3 samples each.
template <class Inside>
BrickGrid body(double h, double half_mm, Inside inside) {
  return test::solid(h, half_mm, inside, {}, 8);
}

const ContactMethod kMethods[] = {ContactMethod::rays, ContactMethod::volume, ContactMethod::overlap,
                                  ContactMethod::proxy};

std::unique_ptr<ContactModel> model_of(ContactMethod method, double h, ContactParams params = {}) {
  params.method = method;
  return make_contact_model(params, h);
}

TEST(CutDepth, InvertsTheVolumeOfACap) {
  for (double r = 0.5; r < 4; r += 0.7) {
    const CutDepth cut(RoundCone{0, 0, r, r});
    for (double d = 0; d <= 2 * r; d += r / 17) {
      EXPECT_NEAR(cap_depth_mm(std::numbers::pi * d * d * (r - d / 3), r), d, 1e-6 * r);
      EXPECT_NEAR(cut(std::numbers::pi * d * d * (r - d / 3), 0.3), d, 1e-6 * r);
    }
  }
  EXPECT_EQ(cap_depth_mm(-1, 2), 0);
  EXPECT_NEAR(cap_depth_mm(1e9, 2), 4, 1e-6);
}

// Against random points in the shape.
TEST(CutDepth, TableOfATaperAgreesWithCounting) {
  const RoundCone taper{0, 8, 1, 2};
  std::mt19937 random(5);
  std::uniform_real_distribution<double> xy(-2, 2), z(-1, 10);
  std::vector<Vec3> inside;
  int tried = 0;
  while (inside.size() < 200000) {
    const Vec3 p{xy(random), xy(random), z(random)};
    ++tried;
    if (taper.distance_mm(p) < 0) inside.push_back(p);
  }
  const double volume = 4.0 * 4 * 11 * static_cast<double>(inside.size()) / tried;
  EXPECT_NEAR(taper.volume_mm3(), volume, 0.01 * volume);
  const CutDepth cut(taper);
  for (const double cosine : {-1.0, -0.6, 0.0, 0.05, 0.5, 0.9, 1.0}) {
    const Vec3 u{std::sqrt(1 - cosine * cosine), 0, cosine};
    const double top = std::max(1.0, 8 * cosine + 2);
    for (const double depth : {0.3, 0.7, 1.5}) {
      std::size_t n = 0;
      for (const Vec3& p : inside) n += dot(p, u) > top - depth ? 1 : 0;
      const double v = taper.volume_mm3() * static_cast<double>(n) / static_cast<double>(inside.size());
      EXPECT_NEAR(cut(v, cosine), depth, 0.02 + 0.02 * depth) << cosine;
    }
  }
}

TEST(RoundCone, DistanceIsThatOfTheHullOfItsBalls) {
  const RoundCone cone{1, 5, 2, 0.7};
  for (double x = -4; x < 4; x += 0.37) {
    for (double z = -4; z < 9; z += 0.41) {
      double best = 1e9;
      for (int i = 0; i <= 20000; ++i) {
        const double t = 5 * i / 20000.0;
        best = std::min(best, std::hypot(x, z - 1 - t) - (2 - 1.3 * t / 5));
      }
      EXPECT_NEAR(cone.distance_mm({x, 0, z}), best, 1e-4);
    }
  }
}

TEST(BurrSurface, SamplesLieOnItEvenly) {
  for (const BurrShape shape : {BurrShape::ball, BurrShape::cylinder, BurrShape::taper}) {
    const Burr& burr = burr_library()[static_cast<std::size_t>(burr_index(BurrKind::cutting, 4, shape))];
    const auto s =
        sample_head_surface(burr.head(), burr.falloff_mm3_per_s_per_n_per_rad / burr.rate_mm3_per_s_per_n, 2000);
    Vec3 sum{};
    for (std::size_t i = 0; i < s.offset_mm.size(); ++i) {
      const auto& o = s.offset_mm[i];
      EXPECT_NEAR(burr.head().distance_mm({o[0], o[1], o[2]}), 0, 1e-5);
      sum += Vec3{s.inward[i][0], s.inward[i][1], s.inward[i][2]} * s.sample_area_mm2;
    }
    // Normals of a closed surface cancel.
    EXPECT_LT(length(sum), 0.01 * s.sample_area_mm2 * 2000) << static_cast<int>(shape);
  }
}

// The overlap with solid bone is the volume of the shape, wherever it lies: coverage is exact, not sampled.
TEST(Overlap, OfSolidBoneIsTheShapesVolume) {
  const auto solid = body(0.5, 12, [](Vec3) { return true; });
  Overlap overlap(0);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> u(-1, 1);
  for (const auto& [shape, tolerance] : {std::pair{RoundCone{0, 0, 0.5, 0.5}, 0.06},
                                         {RoundCone{0, 0, 1, 1}, 6e-3},
                                         {RoundCone{0, 0, 3, 3}, 2e-4},
                                         {RoundCone{0, 6, 2, 2}, 5e-4},
                                         {RoundCone{0, 6, 1, 2}, 2e-3},
                                         {RoundCone{-4, 8, 1.2, 1.2}, 2e-3}}) {
    for (int n = 0; n < 20; ++n) {
      const Vec3 axis = normalized({u(random), u(random), u(random)});
      const auto o =
          overlap.measure(solid, shape, Vec3{u(random), u(random), u(random)} - axis * (shape.length_mm / 2), axis);
      EXPECT_NEAR(o.bone_mm3 / shape.volume_mm3(), 1, tolerance) << shape.start_radius_mm << " " << shape.length_mm;
      // Pressed from all sides alike.
      EXPECT_LT(length(o.area_mm2), 0.5 * std::pow(shape.volume_mm3(), 2.0 / 3) * 0.5 / shape.start_radius_mm);
    }
  }
}

TEST(Overlap, AreaIsTheGradientOfTheVolume) {
  const auto bone = slab(0.5);
  Overlap overlap(0);
  std::mt19937 random(2);
  std::uniform_real_distribution<double> u(-1, 1);
  for (int n = 0; n < 50; ++n) {
    const RoundCone shape = n % 2 == 0 ? RoundCone{0, 0, 2, 2} : RoundCone{0, 6, 1, 2};
    const Vec3 axis = normalized({u(random), u(random), 0.3 + std::abs(u(random))}),
               x{u(random), u(random), 0.8 + 0.5 * u(random)};
    const auto o = overlap.measure(bone, shape, x, axis);
    const double e = 0.1;
    Vec3 slope;
    for (std::size_t a = 0; a < 3; ++a) {
      Vec3 up = x, down = x;
      up[a] += e;
      down[a] -= e;
      slope[a] = (overlap.measure(bone, shape, up, axis).bone_mm3 - overlap.measure(bone, shape, down, axis).bone_mm3) /
                 (2 * e);
    }
    EXPECT_LT(length(slope - o.area_mm2), 0.03 * length(o.area_mm2) + (n % 2 == 0 ? 0.03 : 0.15)) << n;
  }
}

TEST(Overlap, SameBitsForEveryInstructionSet) {
  const auto bone = slab(0.5);
  std::mt19937 random(3);
  std::uniform_real_distribution<float> u(-12, 4);
  std::vector<Hit> hits(3 * 2048);
  std::vector<overlap::Partial> partials(3 * 512);
  const overlap::BrickFunction functions[] = {&overlap::brick_base, &overlap::brick_avx2, &overlap::brick_avx512};
  for (int n = 0; n < 2000; ++n) {
    overlap::Shape s{
        {0.6F, 0, 0.8F}, n % 2 == 0 ? 0.0F : 7.0F, 4.3F, n % 4 == 1 ? 0.2F : 0.0F, n % 4 == 1 ? 0.204F : 0.0F, 0.3F,
        n % 2 == 0};
    const float first[3] = {u(random), u(random), u(random)};
    const std::uint32_t brick = static_cast<std::uint32_t>(random()) % static_cast<std::uint32_t>(bone.brick_count());
    overlap::Sums sums[3];
    std::size_t counts[3];
    for (int f = 0; f < 3; ++f) {
      if (widest_simd() == Simd::scalar) GTEST_SKIP() << "this machine has nothing wider";
      if (f > static_cast<int>(widest_simd())) continue;
      overlap::HitList list{hits.data() + f * 2048, 0, 1536, 1, 0};
      overlap::PartialList partial{partials.data() + f * 512, 0, 512};
      functions[f](s, bone.values_of_brick(brick), first, brick * BrickGrid::kVoxels, sums[f], list, partial);
      counts[f] = list.count;
      ASSERT_EQ(std::memcmp(&sums[0], &sums[f], sizeof sums[0]), 0) << n << " " << f;
      ASSERT_EQ(counts[0], counts[f]);
      ASSERT_EQ(std::memcmp(hits.data(), hits.data() + f * 2048, counts[0] * sizeof(Hit)), 0);
      ASSERT_EQ(std::memcmp(partials.data(), partials.data() + f * 512, partial.count * sizeof(overlap::Partial)), 0);
    }
  }
}

TEST(Contact, FlatBoneGivesDepthAndDirectionByEveryMethod) {
  const auto bone = slab(0.5);
  for (const ContactMethod method : kMethods) {
    SCOPED_TRACE(EnumNames<ContactMethod>::values[static_cast<std::size_t>(method)]);
    for (const double depth : {0.2, 0.5, 1.0, 1.8}) {
      const auto model = model_of(method, 0.5);
      static_cast<void>(model->contact(bone, at(0.13, -0.21, 4)));  // the proxy comes from outside
      const auto r = model->contact(bone, at(0.13, -0.21, 2 - depth));
      EXPECT_NEAR(r.depth_mm, depth, method == ContactMethod::rays ? 0.15 : 0.06) << depth;
      EXPECT_GT(r.force_n.z / length(r.force_n), 0.995);
      EXPECT_NEAR(r.force_n.z, ContactParams{}.force_n(depth), method == ContactMethod::rays ? 0.6 : 0.25) << depth;
      EXPECT_NEAR(r.shown_offset_mm.z, depth, 0.15);
    }
    const auto model = model_of(method, 0.5);
    EXPECT_EQ(length(model->contact(bone, at(0, 0, 2.5)).force_n), 0);
    EXPECT_EQ(length(model->contact(bone, at(500, 0, 0)).force_n), 0);
  }
}

// All burrs, lying at any angle, feel flat bone with the same stiffness.
TEST(Contact, EveryBurrMeetsTheSameStiffness) {
  const auto bone = slab(0.5);
  const auto model = model_of(ContactMethod::overlap, 0.5);
  const auto& all = burr_library();
  for (std::size_t tool = 0; tool < all.size(); ++tool) {
    for (const double z : {0.0, 0.3, 0.7, 1.0}) {
      auto pose = at(0.1, 0.2, 0, static_cast<int>(tool));
      pose.axis = {static_cast<float>(std::sqrt(1 - z * z)), 0, static_cast<float>(z)};
      const RoundCone head = all[tool].head();
      const double lowest = std::max(head.start_radius_mm, head.end_radius_mm - head.length_mm * z);
      const double depth = std::min(0.6, 0.4 * all[tool].diameter_mm);
      pose.position_mm[2] = static_cast<float>(lowest - depth);
      const auto r = model->contact(bone, pose);
      EXPECT_NEAR(r.depth_mm, depth, 0.1) << all[tool].name() << " " << z;
      EXPECT_NEAR(r.force_n.z, ContactParams{}.force_n(depth), 0.4) << all[tool].name() << " " << z;
    }
  }
}

TEST(Contact, ForceIsContinuousAndCapped) {
  const auto bone = slab(0.5);
  for (const ContactMethod method : kMethods) {
    SCOPED_TRACE(EnumNames<ContactMethod>::values[static_cast<std::size_t>(method)]);
    const ContactParams params;
    const auto model = model_of(method, 0.5);
    double before = 0;
    for (double z = 2.5; z > -1; z -= 0.01) {
      const double f = length(model->contact(bone, at(0.1, 0.2, z)).force_n);
      EXPECT_LE(f, params.max_force_n + 1e-9);
      // 0.01 mm may change the force by its stiffness times that, and sampling adds its own grain.
      const double grain = method == ContactMethod::overlap  ? 0.03
                           : method == ContactMethod::proxy  ? 0.06
                           : method == ContactMethod::volume ? 0.26
                                                             : 0.8;
      EXPECT_LT(std::abs(f - before), params.stiffness_n_per_mm * 0.01 + grain) << z;
      before = f;
    }
  }
}

// Along the surface of a ball a fiftieth of a voxel changes the force by less than 1 %, 1.5 % where it is less than a
// third of a voxel deep.
TEST(Contact, ExactOverlapHasNoSteps) {
  const auto ball = body(0.5, 8, [](Vec3 p) { return length(p) < 6.3; });
  const auto model = model_of(ContactMethod::overlap, 0.5);
  for (const double depth : {0.15, 0.4, 1.0}) {
    double worst = 0;
    Vec3 before{};
    for (int s = 0; s < 2000; ++s) {
      const double a = 0.3 + s * (0.01 / 8);  // steps of 0.01 mm: a fiftieth of a voxel
      const double reach = 6.3 + 2 - depth;
      const auto f =
          model->contact(ball, at(reach * std::cos(a), reach * std::sin(a) * 0.8, reach * std::sin(a) * 0.6)).force_n;
      if (s > 0) worst = std::max(worst, length(f - before) / length(f));
      before = f;
    }
    EXPECT_LT(worst, depth < 0.17 ? 0.015 : 0.01) << depth;
  }
}

// A closed path through static bone gains nothing: the force is the slope of an energy.
TEST(Contact, ExactOverlapGivesNoEnergyOnAClosedPath) {
  const auto ball =
      body(0.5, 8, [](Vec3 p) { return length(p) < 5.7 || (p.x > 2 && std::abs(p.y) < 3 && std::abs(p.z) < 3); });
  const auto model = model_of(ContactMethod::overlap, 0.5);
  double work = 0, turned_over = 0;
  const int n = 4000;
  Vec3 last{}, force{};
  for (int s = 0; s <= n; ++s) {
    const double t = 2 * std::numbers::pi * s / n;
    const Vec3 x{6.8 + 0.7 * std::cos(t), 1.5 * std::sin(t), 0.8 * std::sin(2 * t)};
    const Vec3 f = model->contact(ball, at(x.x, x.y, x.z)).force_n;
    if (s > 0) {
      const double w = dot((f + force) * 0.5, x - last);
      work += w;
      turned_over += std::abs(w);
    }
    last = x;
    force = f;
  }
  EXPECT_GT(turned_over, 1);
  EXPECT_LT(std::abs(work), 0.05 * turned_over);
}

TEST(Contact, NotANumberGivesNoForce) {
  const auto bone = slab(1);
  for (const ContactMethod method : kMethods) {
    const auto model = model_of(method, 1);
    auto pose = at(0, 0, 0);
    pose.position_mm[1] = std::numeric_limits<float>::quiet_NaN();
    const auto r = model->contact(bone, pose);
    EXPECT_EQ(length(r.force_n), 0);
    EXPECT_EQ(r.immersed, 0u);
    EXPECT_TRUE(model->cut(bone).hits.empty());
  }
}

TEST(Contact, ProxyDoesNotPassAThinShell) {
  // A plate of two voxels: the burr's whole radius deeper, and still in front of it.
  for (const double sign : {1.0, -1.0}) {
    const auto plate = body(0.5, 12, [](Vec3 p) { return std::abs(p.z) < 0.5; });
    const auto model = model_of(ContactMethod::proxy, 0.5);
    for (double z = 4; z > -6; z -= 0.05) {
      auto pose = at(0.2, 0.1, sign * z);
      pose.pedal = 0;
      const auto r = model->contact(plate, pose);
      const double shown = z + sign * r.shown_offset_mm.z;
      EXPECT_GT(shown, 2.2) << z;
      EXPECT_NEAR(shown, std::max(z, 2.5), 0.1) << z;
    }
    auto pose = at(0.2, 0.1, sign * 4);
    EXPECT_EQ(length(model->contact(plate, pose).force_n), 0);
  }
}

TEST(Contact, ProxySticksAndSlips) {
  const auto bone = slab(0.5);
  ContactParams params;
  params.friction = 0.3;
  params.static_friction = 0.3;
  const auto model = model_of(ContactMethod::proxy, 0.5, params);
  auto pose = at(0, 0, 3);
  pose.pedal = 0;
  static_cast<void>(model->contact(bone, pose));
  for (int i = 0; i <= 100; ++i) {
    pose.position_mm = {0, 0, static_cast<float>(3 - 2 * i / 100.0)};  // 1 mm deep
    static_cast<void>(model->contact(bone, pose));
  }
  ContactResult r;
  for (int i = 0; i <= 300; ++i) {
    pose.position_mm[0] = static_cast<float>(i / 100.0);
    r = model->contact(bone, pose);
    const double ratio = -r.force_n.x / r.force_n.z;
    EXPECT_LT(ratio, 0.33);
    if (i < 20) {
      EXPECT_NEAR(r.shown_offset_mm.x, -i / 100.0, 0.03);  // held
    }
  }
  EXPECT_NEAR(-r.force_n.x / r.force_n.z, 0.3, 0.03);
  EXPECT_NEAR(r.shown_offset_mm.x, -0.3, 0.05);  // drawn along behind
}

TEST(Removal, WhatIsTakenIsWhatIsMissing) {
  for (const ContactMethod method : kMethods) {
    SCOPED_TRACE(EnumNames<ContactMethod>::values[static_cast<std::size_t>(method)]);
    auto bone = slab(0.5);
    const double before = bone.sum();
    const auto model = model_of(method, 0.5);
    Removal removal(bone);
    double total = 0;
    for (int t = 0; t < 3000; ++t) {
      const auto r = model->contact(bone, at(2 * std::sin(t / 300.0), 2 * std::cos(t / 300.0), 2.5 - t / 1500.0));
      double removed = 0;
      removal.remove(bone, model->cut(bone), burr_library()[3], r.normal_force_n, Burr::kNominalRpm, 1e-3, nullptr,
                     removed);
      total += removed;
    }
    EXPECT_GT(total, 5);
    EXPECT_NEAR((before - bone.sum()) * 0.125, total, 1e-3 * total);
  }
}

// The rate is a property of the burr, not of voxels or ticks: a hand of constant force drills the same volume.
TEST(Removal, SameVolumeForAnyVoxelAndTick) {
  for (const ContactMethod method : {ContactMethod::volume, ContactMethod::overlap, ContactMethod::proxy}) {
    SCOPED_TRACE(EnumNames<ContactMethod>::values[static_cast<std::size_t>(method)]);
    const double reference = test::drilled_mm3(method, 0.5, 1000);
    EXPECT_GT(reference, 4);
    for (const auto& [h, hz] : {std::pair{0.25, 1000.0}, {1.0, 1000.0}, {0.5, 500.0}, {0.5, 5000.0}, {0.35, 2000.0}}) {
      EXPECT_NEAR(test::drilled_mm3(method, h, hz) / reference, 1, 0.05) << h << " mm, " << hz << " Hz";
    }
  }
}

TEST(Removal, PoleRemovesLessThanEquator) {
  for (const ContactMethod method : {ContactMethod::rays, ContactMethod::volume, ContactMethod::overlap}) {
    const auto rate = [&](std::array<float, 3> axis) {
      auto bone = slab(0.5);
      const auto model = model_of(method, 0.5);
      Removal removal(bone);
      auto pose = at(0, 0, 1.6);
      pose.axis = axis;
      const auto r = model->contact(bone, pose);
      double removed = 0;
      removal.remove(bone, model->cut(bone), burr_library()[3], r.normal_force_n, Burr::kNominalRpm, 1e-3, nullptr,
                     removed);
      return removed;
    };
    EXPECT_LT(rate({0, 0, 1}), 0.6 * rate({1, 0, 0}));
  }
}

TEST(Removal, TurnsFasterAndSofterBoneGivesMore) {
  auto bone = slab(0.5);
  const auto model = model_of(ContactMethod::overlap, 0.5);
  const auto r = model->contact(bone, at(0, 0, 1.6));
  double slow = 0, fast = 0;
  auto copy = bone;
  Removal(bone).remove(bone, model->cut(bone), burr_library()[3], r.normal_force_n, 30000, 1e-3, nullptr, slow);
  Removal(copy).remove(copy, model->cut(copy), burr_library()[3], r.normal_force_n, 60000, 1e-3, nullptr, fast);
  EXPECT_NEAR(fast / slow, 2, 1e-3);
}

// HU by depth; where it is not said otherwise, cortex of 1500 HU down to 5 mm, below it cancellous bone of 500 HU.
std::shared_ptr<const Hardness> layered(
    const BrickGrid& bone, const HardnessLaw& law = {},
    double (*hu_at)(double z) = [](double z) { return z > -5 ? 1500.0 : 500.0; }) {
  BrickGrid hu(bone);
  for (VoxelKey v = 0; v < hu.brick_count() * BrickGrid::kVoxels; ++v) {
    const Ijk c = hu.coordinate(v);
    hu.set(v, static_cast<float>(hu_at(hu.frame().world_from_index({0, 0, double(c.k)}).z)));
  }
  return std::make_shared<const Hardness>(bone, to_sparse(hu, "hu"), law);
}

TEST(Hardness, FollowsItsLaw) {
  const HardnessLaw law = parse_hardness(default_hardness_json(), "built in");
  for (const double hu : {-500.0, 100.0, 400.0, 500.0, 1500.0, 2000.0, 9000.0}) {
    EXPECT_NEAR(law.at(hu), std::clamp(hu / 1500, 0.125, 3.0), 1e-12);
    EXPECT_EQ(law.at(hu), HardnessLaw{}.at(hu));
  }
  const HardnessLaw other = parse_hardness(
      R"({"osteotome_hardness": 1, "cortical_hu": 1000, "zero_hu": -100, "exponent": 2, "least": 0.05})", "x");
  EXPECT_NEAR(other.at(450), 0.25, 1e-12);
  EXPECT_EQ(other.at(-100), 0.05);
  auto bone = slab(0.5);
  const auto h = layered(bone, other);
  const auto at_z = [&](int k) { return static_cast<double>(h->at(bone.find(10, 10, k))); };
  EXPECT_NEAR(at_z(31), std::pow(1600.0 / 1100, 2), 1 / 100.0);
  EXPECT_NEAR(at_z(10), std::pow(600.0 / 1100, 2), 1 / 100.0);
}

TEST(Hardness, TheFileIsCheckedWithKeyAndLine) {
  const auto refused = [](const std::string& text, const std::string& part) {
    try {
      static_cast<void>(parse_hardness(text, "h.json"));
      ADD_FAILURE() << "taken: " << text;
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ExitCode::usage);
      EXPECT_NE(std::string(e.what()).find(part), std::string::npos) << e.what();
      EXPECT_NE(std::string(e.what()).find("'h.json'"), std::string::npos) << e.what();
    }
  };
  refused("{", "line 1");
  refused("[]", "object");
  refused(R"({"osteotome_hardness": 2})", "osteotome_hardness");
  refused("{\"osteotome_hardness\": 1,\n \"exponnet\": 1}", "line 2");
  refused("{\"osteotome_hardness\": 1,\n \"exponnet\": 1}", "did you mean \"exponent\"");
  refused("{\"osteotome_hardness\": 1,\n\n \"exponent\": 9}", "line 3");
  refused(R"({"osteotome_hardness": 1, "exponent": "1"})", "must be a number");
  refused(R"({"osteotome_hardness": 1, "most": 5})", "most");
  refused(R"({"osteotome_hardness": 1, "cortical_hu": 100, "zero_hu": 200})", "below");
}

// The burr fed down through cortex into cancellous bone, at a given speed and by a hand on a spring: what presses on it
// in either.
struct Layers {
  double cortex_n = 0, cancellous_n = 0;
  [[nodiscard]] double step() const { return (cortex_n - cancellous_n) / cortex_n; }
};
Layers fed(bool hard, double h, double hz, double mm_s = 1) {
  auto bone = slab(h);
  HapticSetup setup;
  setup.params.effects.vibration = setup.params.effects.shaft = false;
  setup.device = SpringHand::traits();
  HapticRenderer renderer(setup, bone, {hard ? layered(bone) : nullptr, nullptr, nullptr}, 1 / hz);
  Layers sum;
  int in_cortex = 0, in_cancellous = 0;
  for (int t = 0; t < static_cast<int>(9 / mm_s * hz); ++t) {
    const double deep = mm_s * t / hz;  // of the burr's lowest point
    auto pose = at(0, 0, 2 - deep);
    pose.axis = {1, 0, 0};
    pose.pedal = 255;
    const double n = static_cast<double>(renderer.step(pose).record.normal_force_n);
    // The head all in the one or the other; walls beside it alike.
    if (deep > 4 && deep < 4.9) {
      sum.cortex_n += n;
      ++in_cortex;
    }
    if (deep > 8 && deep < 8.9) {
      sum.cancellous_n += n;
      ++in_cancellous;
    }
  }
  return {sum.cortex_n / in_cortex, sum.cancellous_n / in_cancellous};
}

// What a hand can distinguish: 7 % (X. Pang, H. Tan, N. Durlach, Percept Psychophys 49(6), 1991, from 2.5 to 10 N); 10
// % to be careful.
TEST(Hardness, TheStepFromCortexToCancellousBoneIsFelt) {
  constexpr double kNoticed = 0.10;
  const Layers alike = fed(false, 0.5, 1000), hard = fed(true, 0.5, 1000);
  std::printf("fed 1 mm/s: alike %.2f N then %.2f N (step %.0f %%); by HU %.2f N then %.2f N (step %.0f %%)\n",
              alike.cortex_n, alike.cancellous_n, 100 * alike.step(), hard.cortex_n, hard.cancellous_n,
              100 * hard.step());
  EXPECT_LT(std::abs(alike.step()), kNoticed / 2);
  EXPECT_GT(hard.step(), 2 * kNoticed);
  EXPECT_GT(hard.step(), 0.4);  // 500 HU against 1500: two thirds, less what the hole is wider in soft bone
  for (const auto& [h, hz] : {std::pair{0.35, 500.0}, {0.7, 1000.0}, {0.5, 2000.0}}) {
    EXPECT_NEAR(fed(true, h, hz).step(), hard.step(), 0.12) << h << " mm, " << hz << " Hz";
  }
}

// What a hand of constant force takes out in a time goes by the bone alone, also where hard and soft lie under the burr
// at once.
TEST(Hardness, RemovalIsTheSameForAnyVoxelAndTick) {
  const auto drilled = [](double h, double hz) {
    auto bone = slab(h);
    HapticSetup setup;
    setup.params.effects.vibration = false;
    setup.device = SpringHand::traits();
    const auto softer_below = layered(bone, {}, [](double z) { return std::clamp(1500 + 700 * z, 300.0, 1800.0); });
    HapticRenderer renderer(setup, bone, {softer_below, nullptr, nullptr}, 1 / hz);
    SpringHand hand;
    double removed = 0;
    Vec3 force{};
    for (int t = 0; t < static_cast<int>(2 * hz); ++t) {
      const double s = t / hz;
      HandGoal goal;
      goal.position_mm = {4 * std::sin(6 * s), 4 * std::cos(6 * s), 0.4 - 1.0 * s};
      goal.axis = {0.6F, 0, 0.8F};
      goal.pedal = 255;
      goal.tool = 3;
      const auto record = renderer.step(hand.step(goal, 1 / hz, force)).record;
      force = from_floats(record.force_n);
      removed += static_cast<double>(record.removed_mm3);
    }
    return removed;
  };
  const double reference = drilled(0.5, 1000);
  EXPECT_GT(reference, 4);
  for (const auto& [h, hz] : {std::pair{0.35, 1000.0}, {0.75, 1000.0}, {0.5, 500.0}, {0.5, 3000.0}})
    EXPECT_NEAR(drilled(h, hz) / reference, 1, 0.05) << h << " mm, " << hz << " Hz";
}

TEST(DepthMap, EqualsOneMadeAnewAfterDrilling) {
  auto bone = body(0.5, 10, [](Vec3 p) { return length(p) < 9; });
  DepthMap live(bone);
  EXPECT_NEAR(live.at({0, 0, 0}).depth_mm, 9, 1.5);
  EXPECT_GT(dot(live.at({0, 5, 0}).outwards, Vec3{0, 1, 0}), 0.8);
  EXPECT_EQ(live.at({0, 9.9, 0}).depth_mm, 0);
  std::mt19937 random(4);
  for (int step = 0; step < 60; ++step) {
    std::vector<VoxelKey> changed;
    const Vec3 c{9 - step * 0.15, 1, 0.5};
    for (std::uint32_t v = 0; v < bone.brick_count() * BrickGrid::kVoxels; ++v) {
      const Ijk i = bone.coordinate(v);
      if (length(bone.frame().world_from_index({double(i.i), double(i.j), double(i.k)}) - c) < 2 && bone.value(v) > 0) {
        bone.set(v, 0);
        changed.push_back(v);
      }
    }
    live.update(bone, changed, 40);
  }
  while (!live.settled()) live.update(bone, {}, 1000);
  const DepthMap anew(bone);
  for (double x = -8; x < 8; x += 0.7)
    for (double y = -8; y < 8; y += 0.9)
      for (double z = -8; z < 8; z += 0.8) {
        EXPECT_NEAR(live.at({x, y, z}).depth_mm, anew.at({x, y, z}).depth_mm, 2.01) << x << " " << y << " " << z;
      }
}

TEST(LiveSurface, FollowsTheDrillToTheBit) {
  auto bone = slab(0.5);
  LiveSurface live(bone, {});
  HapticRenderer renderer({}, bone, {}, 1e-3);
  Stream stream;
  StreamReader& reader = stream.add_reader();
  Strokes script;
  script.axis = {0.6, 0, 0.8};
  script.waypoints = {{0, {-5, 0, 4}, true}, {0.3, {-5, 0, 0}, true}, {1.0, {5, 3, -2}, true}};
  ScriptedDevice device(script, 1000);
  Servo servo(renderer, device, stream, 1000);
  std::vector<VoxelChange> changes(4096);
  while (servo.step(0)) {
    TickRecord tick;
    ASSERT_EQ(reader.ticks.pop({&tick, 1}), 1u);
    const std::size_t n = reader.changes.pop(changes);
    ASSERT_EQ(n, tick.voxels_changed);
    for (std::size_t c = 0; c < n; ++c) live.mark(changes[c].voxel);
    if (tick.tick % 37 == 0) live.update();
  }
  live.update();
  EXPECT_EQ(servo.ticks(), 1000u);
  EXPECT_EQ(surface_hash(live.joined().mesh), surface_hash(surface_nets(bone).mesh));
}

TEST(SpringHand, RestsOnBoneInsteadOfPassingThrough) {
  const auto bone = slab(0.5);
  for (const ContactMethod method : kMethods) {
    SCOPED_TRACE(EnumNames<ContactMethod>::values[static_cast<std::size_t>(method)]);
    const auto model = model_of(method, 0.5);
    SpringHand hand;
    HandGoal goal;
    goal.tool = 3;
    Vec3 force{};
    DeviceSample pose;
    double mean_force = 0, mean_z = 0;
    float lowest = 100, highest = -100;
    for (int t = 0; t < 4000; ++t) {
      goal.position_mm = {0, 0, t < 500 ? 5.0 : 0.0};  // 2 mm below contact
      pose = hand.step(goal, 1e-3, force);
      force = model->contact(bone, pose).force_n;
      if (t < 3000) continue;
      mean_force += force.z / 1000;
      mean_z += static_cast<double>(pose.position_mm[2]) / 1000;
      lowest = std::min(lowest, pose.position_mm[2]);
      highest = std::max(highest, pose.position_mm[2]);
    }
    EXPECT_GT(lowest, 1.3F);
    EXPECT_LT(highest - lowest, 0.05F);           // at rest, but for the grain of the samples
    EXPECT_NEAR(mean_force, 0.8 * mean_z, 0.02);  // in balance with the spring
  }
}

}  // namespace
}  // namespace osteo
