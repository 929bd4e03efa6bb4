#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>
#include <random>

#include "duck.h"
#include "osteo/simulation/haptics/fields.h"

namespace osteo {
namespace {

using test::duck_field, test::DuckError;

// The recording through the renderer: mean of |true - rendered| (equation 3 of the thesis, which calls it RMS).
template <class Field>
DuckError play(const Field& field, double friction, GodObjectParams p, double scale = 1, Vec3 offset = {}) {
  static const auto plain = test::duck_recording(0), rough = test::duck_recording(0.3);
  const auto& recording = friction > 0 ? rough : plain;
  GodObject proxy;
  p.friction = p.static_friction = friction;
  p.tolerance_mm *= scale;
  p.feature_mm *= scale;
  proxy.place(recording.front().surface_mm * scale + offset);
  DuckError e;
  std::vector<double> errors;
  for (const auto& tick : recording) {
    const auto a = proxy.update(field, tick.device_mm * scale + offset, p);
    const Vec3 force = (a.proxy_mm - (tick.device_mm * scale + offset)) * (test::kDuckStiffness / scale);
    const double off = length(force - tick.force_n);
    e.mean_n += off / static_cast<double>(recording.size());
    e.lost += a.contact ? 0 : 1;
    e.evaluations += static_cast<double>(a.evaluations) / static_cast<double>(recording.size());
    errors.push_back(off);
  }
  // The first tenth of a second is where the proxy finds its place.
  std::sort(errors.begin() + 100, errors.end());
  e.worst_n = errors.back();
  e.p95_n = errors[100 + (errors.size() - 100) * 95 / 100];
  return e;
}

TEST(GodObject, OnACubicFieldTheForceIsNearlyTrue) {
  for (const auto& [n, mean] : {std::pair{32, 0.002}, {64, 0.0005}, {128, 0.0002}}) {
    const auto e = play(duck_field(n), 0, {.feature_mm = 2, .tolerance_mm = 1e-5});
    EXPECT_LT(e.mean_n, mean) << n;
    EXPECT_LT(e.worst_n, 12 * mean) << n;
    EXPECT_EQ(e.lost, 0);
  }
}

TEST(GodObject, FrictionPullsAlongTheMotion) {
  for (const int n : {64, 128}) {
    const auto e = play(duck_field(n), 0.3, {.feature_mm = 2, .tolerance_mm = 1e-5});
    EXPECT_LT(e.mean_n, 0.002) << n;
    EXPECT_EQ(e.lost, 0);
  }
}

TEST(GodObject, OnTrianglesNeverLosesContactInAnyUnit) {
  for (const auto& [rings, sectors] : {std::pair{22, 22}, {54, 54}, {180, 180}}) {
    for (const double scale : {1e-3, 1.0, 1e3}) {
      const MeshField field(test::duck_mesh(rings, sectors, scale), true);
      for (const double friction : {0.0, 0.3}) {
        const auto e = play(field, friction, {.feature_mm = 2, .tolerance_mm = 1e-5}, scale);
        EXPECT_EQ(e.lost, 0) << rings << " " << scale;
        EXPECT_LT(e.worst_n, rings < 30 ? 1.2 : 0.5) << rings << " " << scale << " " << friction;
      }
    }
  }
}

TEST(GodObject, WorksFarFromTheOrigin) {
  const Vec3 far{1e4, -2e4, 3e4};
  const MeshField field(test::duck_mesh(54, 54, 1, far), true);
  const auto e = play(field, 0.3, {.feature_mm = 2, .tolerance_mm = 1e-5}, 1, far);
  EXPECT_EQ(e.lost, 0);
  EXPECT_LT(e.worst_n, 0.5);
}

// Values are met, polynomials of third degree inside the grid too, and slopes are the values' own.
TEST(CubicField, TheSplineGoesThroughItsValues) {
  Frame f;
  f.dims = {24, 26, 28};
  f.spacing_mm = {0.5, 0.5, 0.5};
  const auto height = [](Vec3 x) { return 0.02 * x.x * x.x * x.x - 0.3 * x.y * x.z + x.z - 2; };
  std::vector<float> v;
  for (int k = 0; k < 28; ++k)
    for (int j = 0; j < 26; ++j)
      for (int i = 0; i < 24; ++i)
        v.push_back(static_cast<float>(height(f.world_from_index({double(i), double(j), double(k)}))));
  const CubicField field(f, v, FieldCurve::spline);
  // Away from the rim, where the mirror is felt: 0.27 for each voxel.
  for (double x = 4; x < 8; x += 0.37)
    for (double y = 4; y < 8; y += 0.41) {
      const Vec3 at{x, y, 5.3};
      EXPECT_NEAR(field(at).value_mm, height(at), 2e-4);
      const Vec3 slope{0.06 * x * x, -0.3 * 5.3, -0.3 * y + 1};
      EXPECT_LT(length(field(at).gradient - slope), 2e-3);
    }
  for (const auto& [i, j, k] : {std::array{2, 3, 2}, {12, 13, 14}, {21, 22, 25}})
    EXPECT_NEAR(field(f.world_from_index({double(i), double(j), double(k)})).value_mm,
                static_cast<double>(v[(k * 26 + j) * 24 + i]), 1e-5);
}

// Fields with an answer in closed form.
struct Walls {                                  // intersection of half spaces: free where all are kept
  std::vector<std::pair<Vec3, double>> planes;  // normal, offset: free where dot(n, x) >= offset
  double radius = 0;
  Clearance operator()(Vec3 x) const {
    Clearance c{1e9, {}, {}};
    for (const auto& [n, o] : planes) {
      if (const double v = dot(n, x) - o - radius; v < c.value_mm) c = {v, n, n};
    }
    return c;
  }
};

TEST(GodObject, RestsInACornerOfThreeWalls) {
  // At right angles and at sharper ones.
  for (const double lean : {0.0, 0.4, 0.8}) {
    Walls w;
    for (int k = 0; k < 3; ++k) {
      const double a = 2 * std::numbers::pi * k / 3;
      w.planes.push_back({normalized({std::cos(a), std::sin(a), 0.7 - 0.6 * lean}), 0});
    }
    GodObject proxy;
    proxy.place({0, 0, 5});
    GodObject::Answer a;
    for (int i = 0; i < 400; ++i)
      a = proxy.update(w, {0.3, -0.2, 3 - std::min(i, 300) * 0.02}, {.feature_mm = 0.5, .tolerance_mm = 1e-6});
    EXPECT_TRUE(a.contact);
    EXPECT_LT(length(a.proxy_mm), 0.02) << lean;
    EXPECT_GT(w(a.proxy_mm).value_mm, -1e-4);
  }
}

struct Shell {  // solid between two radii, thin
  double inner, outer;
  Clearance operator()(Vec3 x) const {
    const double n = length(x), a = n - outer, b = inner - n;
    const Vec3 out = n > 0 ? x / n : Vec3{0, 0, 1};
    return a > b ? Clearance{a, out, out} : Clearance{b, -out, -out};
  }
};

TEST(GodObject, DoesNotPassAThinShellEitherWay) {
  const Shell shell{9.9, 10};
  for (const double from : {15.0, 0.0}) {
    GodObject proxy;
    proxy.place({0, 0.01, from});
    for (double z = from; from > 5 ? z > -3 : z<14; z += from> 5 ? -0.1 : 0.1) {
      const auto a = proxy.update(shell, {0, 0.01, z}, {.feature_mm = 0.5, .tolerance_mm = 1e-6});
      EXPECT_TRUE(from > 5 ? length(a.proxy_mm) >= 10 - 1e-4 : length(a.proxy_mm) <= 9.9 + 1e-4) << z;
    }
  }
  // A jump of 50 mm through everything: stopped by the near side.
  GodObject proxy;
  proxy.place({0, 0, 25});
  GodObject::Answer a;
  for (int i = 0; i < 20; ++i) a = proxy.update(shell, {0, 0, -25}, {.feature_mm = 0.5, .tolerance_mm = 1e-6});
  EXPECT_NEAR(length(a.proxy_mm), 10, 1e-3);
}

TEST(GodObject, StartedInsideItComesOut) {
  const auto field = duck_field(64);
  GodObject proxy;
  GodObject::Answer a;
  for (int i = 0; i < 50; ++i) a = proxy.update(field, {12, 3, 5}, {.feature_mm = 2, .tolerance_mm = 1e-5});
  EXPECT_TRUE(a.contact);
  EXPECT_NEAR(test::duck(a.proxy_mm), 0, 0.01);
}

TEST(GodObject, HoldsUntilTheConeThenSlips) {
  const Walls floor{{{Vec3{0, 0, 1}, 0}}, 0};
  GodObject proxy;
  const GodObjectParams p{.friction = 0.2, .static_friction = 0.5, .feature_mm = 1, .tolerance_mm = 1e-6};
  proxy.place({0, 0, 1});
  static_cast<void>(proxy.update(floor, {0, 0, -1}, p));
  bool slipped = false;
  double let_go = 0;
  for (double x = 0; x < 1; x += 0.001) {
    const auto a = proxy.update(floor, {x, 0, -1}, p);
    if (!slipped && a.slipping) {
      slipped = true;
      let_go = x;
    }
    EXPECT_NEAR(slipped ? x - a.proxy_mm.x : a.proxy_mm.x, slipped ? 0.2 : 0, 1e-3) << x;
  }
  EXPECT_NEAR(let_go, 0.5, 2e-3);
}

TEST(GodObject, SameBitsAgain) {
  const auto field = duck_field(32);
  std::vector<Vec3> first;
  for (int round = 0; round < 2; ++round) {
    GodObject proxy;
    std::size_t i = 0;
    for (const auto& tick : test::duck_recording(0.3, 2)) {
      const auto a = proxy.update(field, tick.device_mm, {.friction = 0.3, .feature_mm = 2, .tolerance_mm = 1e-5});
      if (round == 0) {
        first.push_back(a.proxy_mm);
      } else {
        ASSERT_EQ(first[i++], a.proxy_mm);
      }
    }
  }
}

TEST(GodObject, TheRadiusOfTheProbeIsKept) {
  auto field = duck_field(96);
  const MeshField mesh_plain(test::duck_mesh(180, 180), false);
  auto mesh = mesh_plain;
  field.set_radius_mm(1);
  mesh.set_radius_mm(1);
  GodObject a, b;
  for (double x = 45; x > 20; x -= 0.05) {
    const Vec3 device{x, 4, 3};
    const auto pa = a.update(field, device, {.feature_mm = 2, .tolerance_mm = 1e-5});
    const auto pb = b.update(mesh, device, {.feature_mm = 2, .tolerance_mm = 1e-5});
    EXPECT_GT(mesh_plain(pb.proxy_mm).value_mm, 1 - 1e-3);
    EXPECT_LT(length(pa.proxy_mm - pb.proxy_mm), 0.4);  // the sampled function is not exactly a distance
  }
}

}  // namespace
}  // namespace osteo
