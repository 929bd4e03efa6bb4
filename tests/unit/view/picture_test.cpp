// What can be seen in pictures of bone: depth, light, colours.
#include <gtest/gtest.h>
#include <vtkCamera.h>
#include <vtkFloatArray.h>
#include <vtkGenericOpenGLRenderWindow.h>
#include <vtkNew.h>
#include <vtkPolyData.h>
#include <vtkRenderer.h>
#include <vtkTypeInt32Array.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <numbers>
#include <thread>

#include "osteo/display/view/actors.h"
#include "osteo/display/view/detail/bone_view.h"
#include "osteo/display/view/detail/wet_film.h"
#include "osteo/display/view/offscreen.h"
#include "osteo/display/view/pictures.h"
#include "osteo/display/view/world_view.h"
#include "osteo/imaging/io/surface_io.h"
#include "osteo/imaging/io/vtk_data.h"
#include "solid.h"

namespace osteo {
namespace {

// A block with a hole 8 mm deep and 6 wide, drilled towards the eye, a ridge of 90 degrees and one of 60.
BrickGrid block() {
  return test::solid(
      0.4, 15,
      [](Vec3 p) {
        const bool hole = p.y < 2 && std::hypot(p.x, p.z) < 3;
        const bool ridge = p.y > -6 - 3 && p.y <= -6 && std::abs(p.x - 9) < (p.y + 9);
        return (p.y > -6 && p.y < 9 && std::abs(p.x) < 13 && std::abs(p.z) < 11 && !hole) ||
               (ridge && std::abs(p.z) < 9);
      },
      {}, 2);
}

struct Scene {
  OffscreenWindow window{400, 400};
  vtkNew<vtkRenderer> renderer;
  Scene() {
    window.window()->AddRenderer(renderer);
    set_up_scene(renderer);
    look_at(renderer, {0, 0, 0}, 14, {0, -1, 0});
  }
  Picture draw(const PictureStyle& style) {
    set_depth(renderer, style);
    return window.render();
  }
};

// A large ball and beside it a wire 0.3 mm thick, as of a head holder: fewer triangles, on points of the mesh, none
// with its back outside; and the wire is still as wide and as long as it was.
TEST(PictureMesh, IsSmallAndLosesNoWire) {
  TriMesh whole;
  const auto add = [&](const TriMesh& part) {
    const auto first = static_cast<std::uint32_t>(whole.points_mm.size());
    whole.points_mm.insert(whole.points_mm.end(), part.points_mm.begin(), part.points_mm.end());
    whole.normals.insert(whole.normals.end(), part.normals.begin(), part.normals.end());
    for (const auto& t : part.triangles) whole.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  };
  // Rings of points around an axis, joined to the next ring.
  const auto tube = [](int rings, int around, const std::function<std::pair<Vec3, Vec3>(int, double)>& at) {
    TriMesh m;
    for (int r = 0; r < rings; ++r)
      for (int n = 0; n < around; ++n) {
        const auto [p, out] = at(r, 2 * std::numbers::pi * n / around);
        m.points_mm.push_back(to_floats(p));
        m.normals.push_back(to_floats(out));
      }
    for (int r = 0; r + 1 < rings; ++r)
      for (int n = 0; n < around; ++n) {
        const auto a = static_cast<std::uint32_t>(r * around + n),
                   b = static_cast<std::uint32_t>(r * around + (n + 1) % around),
                   up = static_cast<std::uint32_t>(around);
        m.triangles.push_back({a, b, a + up});
        m.triangles.push_back({b, b + up, a + up});
      }
    return m;
  };
  constexpr double kRadius = 90, kWire = 0.15;
  constexpr int kRings = 900;
  add(tube(kRings, 1800, [](int r, double turn) {
    const double down = std::numbers::pi * (r + 0.5) / kRings;
    const Vec3 out{std::sin(down) * std::cos(turn), std::sin(down) * std::sin(turn), -std::cos(down)};
    return std::pair{out * kRadius, out};
  }));
  const std::size_t ball = whole.triangles.size();
  add(tube(401, 8, [](int r, double turn) {
    const Vec3 out{std::cos(turn), std::sin(turn), 0};
    return std::pair{Vec3{120, 0, -50 + 0.25 * r} + out * kWire, out};
  }));
  ASSERT_GT(ball, 3'000'000U);
  const PictureMesh few = mesh_for_pictures(whole);
  std::printf("%zu of %zu triangles\n", few.mesh.triangles.size(), whole.triangles.size());
  EXPECT_LT(few.mesh.triangles.size(), 1'000'000U);
  EXPECT_GT(few.mesh.triangles.size(), 200'000U);
  ASSERT_EQ(few.point.size(), few.mesh.points_mm.size());
  ASSERT_EQ(few.mesh.normals.size(), few.mesh.points_mm.size());
  for (std::size_t p = 0; p < few.point.size(); ++p) {
    EXPECT_EQ(few.mesh.points_mm[p], whole.points_mm[few.point[p]]);
    EXPECT_EQ(few.mesh.normals[p], whole.normals[few.point[p]]);
  }
  double wire_mm2 = 0, lowest = 1e9, highest = -1e9, off = 0;
  std::size_t backs = 0;
  for (const auto& t : few.mesh.triangles) {
    const Vec3 a = from_floats(few.mesh.points_mm[t[0]]), b = from_floats(few.mesh.points_mm[t[1]]),
               c = from_floats(few.mesh.points_mm[t[2]]), n = cross(b - a, c - a);
    Vec3 out;
    for (const std::uint32_t p : t) out += from_floats(few.mesh.normals[p]);
    backs += dot(n, out) < 0 ? 1 : 0;
    if (a.x < 100) {
      off = std::max(off, kRadius - length((a + b + c) * (1.0 / 3)));
      continue;
    }
    wire_mm2 += length(n) / 2;
    for (const Vec3& p : {a, b, c}) {
      lowest = std::min(lowest, p.z);
      highest = std::max(highest, p.z);
    }
  }
  EXPECT_EQ(backs, 0U);
  EXPECT_LT(off, 0.05) << "of the ball";
  EXPECT_GT(wire_mm2, 0.5 * 100 * 2 * std::numbers::pi * kWire);
  EXPECT_LT(lowest, -49);
  EXPECT_GT(highest, 49);
  // What is small enough stays as it is.
  const TriMesh small = surface_nets(block()).mesh;
  const PictureMesh same = mesh_for_pictures(small);
  EXPECT_EQ(same.mesh.points_mm, small.points_mm);
  EXPECT_EQ(same.mesh.triangles, small.triangles);
  EXPECT_EQ(same.point.size(), small.points_mm.size());
  EXPECT_EQ(same.point.back(), small.points_mm.size() - 1);
}

double grey(const Picture& p, int x, int y) {
  const auto i = 3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(p.width) + static_cast<std::size_t>(x));
  return (p.rgb[i] + p.rgb[i + 1] + p.rgb[i + 2]) / 3.0;
}
double mean(const Picture& p, int cx, int cy, int half) {
  double sum = 0;
  for (int y = cy - half; y <= cy + half; ++y)
    for (int x = cx - half; x <= cx + half; ++x) sum += grey(p, x, y);
  return sum / ((2 * half + 1) * (2 * half + 1));
}
// Bone is redder than blue, the background the other way round.
bool is_bone(const Picture& p, std::size_t i) {
  return p.rgb[i] > p.rgb[i + 2] + 3;
}

TEST(Picture, ACavityLooksDeep) {
  const auto bone = block();
  LiveSurface surface(bone, {});
  surface.shade({});
  Scene scene;
  const auto actor = make_bone_actor(to_vtk(surface.joined().mesh));
  scene.renderer->AddActor(actor);
  const Picture none = scene.draw({false, 1});
  scene.renderer->RemoveActor(actor);
  BoneView view(scene.renderer);
  view.show(surface);
  const Picture plain = scene.draw({false, 1}), deep = scene.draw({true, 1});
  // The floor, and bone beside the hole. A pixel is 0.073 mm.
  const auto ratio = [](const Picture& p) { return mean(p, 200, 200, 8) / mean(p, 130, 200, 8); };
  std::printf("floor over rim: triangles alone %.2f, plain %.2f, deep %.2f\n", ratio(none), ratio(plain), ratio(deep));
  EXPECT_GT(ratio(none), 0.9);
  EXPECT_LT(ratio(plain), 0.6);
  EXPECT_LT(ratio(deep), 0.6);
  EXPECT_GT(mean(deep, 200, 200, 8), 35);
  // A picture at rest is the one in motion, but for creases.
  double off = 0;
  std::size_t n = 0;
  for (std::size_t i = 0; i < plain.rgb.size(); ++i) off += std::abs(plain.rgb[i] - deep.rgb[i]), ++n;
  std::printf("mean difference of rest and motion: %.1f of 255\n", off / static_cast<double>(n));
  EXPECT_LT(off / static_cast<double>(n), 6);
}

TEST(Picture, NothingBurnsOutAndNoShadowIsBlack) {
  const auto bone = test::solid(
      0.5, 14,
      [](Vec3 p) {
        return (length(p) < 11 && !(length(p - Vec3{0, -9, 0}) < 6)) || (length(p - Vec3{11, 0, 4}) < 3);
      },
      {}, 2);
  LiveSurface surface(bone, {});
  surface.shade({});
  Scene scene;
  BoneView view(scene.renderer);
  view.show(surface);
  Dust dust(bone);
  WetFilm film;
  view.set_film(&film);
  for (const bool wet : {false, true}) {
    // From all around, a film everywhere.
    for (int n = 0; wet && n < 3000; ++n) {
      const double z = (n % 60) / 30.0 - 1, a = n * 2.4, r = std::sqrt(1 - z * z);
      const Vec3 from = Vec3{r * std::cos(a), r * std::sin(a), z} * 14.0;
      dust.irrigate(from, normalized(from) * -1, 20, 0.05);
    }
    film.update(dust);
    view.wet(surface);
    for (const Vec3 eye : {Vec3{0, -1, 0}, {1, 0, 0}, {0.6, -0.7, 0.4}, {-0.5, 0.5, -0.7}}) {
      look_at(scene.renderer, {0, 0, 0}, 13, normalized(eye));
      for (const bool effects : {false, true}) {
        const Picture p = scene.draw({effects, 1});
        std::size_t white = 0, seen = 0;
        double darkest = 255, brightest = 0;
        for (std::size_t i = 0; i < p.rgb.size(); i += 3) {
          if (!is_bone(p, i)) continue;
          ++seen;
          white += std::max({p.rgb[i], p.rgb[i + 1], p.rgb[i + 2]}) >= 250 ? 1 : 0;
          darkest = std::min(darkest, static_cast<double>(p.rgb[i]));
          brightest = std::max(brightest, static_cast<double>(p.rgb[i]));
        }
        EXPECT_GT(seen, 30000U);
        EXPECT_LT(static_cast<double>(white), 0.005 * static_cast<double>(seen)) << wet << effects;
        EXPECT_GT(brightest, 200) << wet << effects;
        EXPECT_GT(darkest, 8) << wet << effects;
      }
    }
  }
}

// The occlusion's places are half floats: a quarter of a millimetre apart where a microscope looks from.
TEST(Picture, AMicroscopeSeesNoStripesOnFlatBone) {
  const auto bone = test::solid(
      0.4, 12, [](Vec3 p) { return p.y + 0.8 * p.x - 0.3 * p.z > 0 && length(p) < 11; }, {}, 2);
  LiveSurface surface(bone, {});
  surface.shade({});
  Scene scene;
  BoneView view(scene.renderer);
  view.show(surface);
  vtkCamera* const camera = scene.renderer->GetActiveCamera();
  for (const double field_mm : {8.0, 20.0}) {
    camera->SetFocalPoint(0, 0, 0);
    camera->SetPosition(0, -250, 0);
    camera->SetViewUp(0, 0, 1);
    camera->SetViewAngle(2 * std::atan(field_mm / 500) * 180 / std::numbers::pi);
    scene.renderer->ResetCameraClippingRange();
    const Picture plain = scene.draw({false, 1}), deep = scene.draw({true, 1});
    double least = 9, most = 0;
    const int half = static_cast<int>(std::min(150.0, 4 / field_mm * 400));  // within 4 mm of the middle
    for (int y = 200 - half; y <= 200 + half; ++y) {
      for (int x = 200 - half; x <= 200 + half; ++x) {
        const double ratio = mean(deep, x, y, 1) / mean(plain, x, y, 1);
        least = std::min(least, ratio);
        most = std::max(most, ratio);
      }
    }
    std::printf("field of %.0f mm: occlusion on a flat face leaves %.3f to %.3f of the light\n", field_mm, least, most);
    EXPECT_GT(least, 0.9);
    EXPECT_LT(most, 1.05);
  }
}

// Edges stay edges: within half a millimetre the light changes as much as it does in all.
TEST(Picture, EdgesOf90DegreesAreCrisp) {
  const auto bone = block();
  LiveSurface surface(bone, {});
  surface.shade({});
  Scene scene;
  look_at(scene.renderer, {9, -9, 0}, 5, {0, -1, 0});
  BoneView view(scene.renderer);
  view.show(surface);
  const Picture p = scene.draw({false, 1});
  // Across the ridge, 0.025 mm a pixel.
  double left = 0, right = 0;
  for (int d = 30; d < 50; ++d) {
    left += grey(p, 200 - d, 200) / 20;
    right += grey(p, 200 + d, 200) / 20;
  }
  ASSERT_GT(std::abs(left - right), 12);
  const double near = std::abs(mean(p, 184, 200, 3) - mean(p, 216, 200, 3));
  EXPECT_GT(near, 0.75 * std::abs(left - right));
}

TEST(Picture, FewerTrianglesInMotionLookTheSame) {
  const auto bone = block();
  LiveSurface surface(bone, {});
  surface.shade({});
  Scene scene;
  look_at(scene.renderer, {0, 0, 0}, 14, normalized({0.5, -0.8, 0.3}));
  BoneView view(scene.renderer);
  view.show(surface);
  const Picture whole = scene.draw({false, 1});
  for (std::size_t n = 0; n < view.chunks(); ++n) {
    const auto a = view.arrays(n);
    const std::size_t before = static_cast<std::size_t>(a.triangles->GetNumberOfValues());
    auto fewer =
        coarse_triangles({a.points_mm->GetPointer(0), static_cast<std::size_t>(a.points_mm->GetNumberOfValues())},
                         {a.triangles->GetPointer(0), before}, 0.35 * 0.4);
    EXPECT_LE(fewer.size(), before);
    view.keep_coarse(n, a.version, fewer);
    EXPECT_TRUE(view.has_coarse(n));
  }
  view.draw_all(true);
  EXPECT_LT(view.drawn_triangles(), 0.5 * static_cast<double>(view.triangles()));
  const Picture coarse = scene.draw({false, 1});
  double off = 0;
  std::size_t holes = 0;
  for (std::size_t i = 0; i < whole.rgb.size(); i += 3) {
    off += std::abs(whole.rgb[i] - coarse.rgb[i]);
    if (is_bone(whole, i) && !is_bone(coarse, i)) ++holes;
  }
  off /= static_cast<double>(whole.rgb.size() / 3);
  std::printf("%.0f %% of the triangles, mean difference %.2f of 255, %zu pixels lost\n",
              100.0 * static_cast<double>(view.drawn_triangles()) / static_cast<double>(view.triangles()), off, holes);
  EXPECT_LT(off, 3);
  EXPECT_LT(holes, 150U);
  view.draw_all(false);
  EXPECT_EQ(scene.draw({false, 1}).rgb, whole.rgb);
}

TEST(Picture, RefreshedIsAsShownAnew) {
  auto bone = block();
  LiveSurface surface(bone, {});
  surface.shade({});
  Scene scene;
  BoneView live(scene.renderer);
  live.show(surface);
  for (VoxelKey key = 0; key < bone.brick_count() * BrickGrid::kVoxels; ++key) {
    const Ijk c = bone.coordinate(key);
    if (length(bone.frame().world_from_index({1.0 * c.i, 1.0 * c.j, 1.0 * c.k}) - Vec3{-7, -4, 2}) > 4) continue;
    bone.set(key, 0);
    surface.mark(key);
  }
  live.update(surface, surface.update());
  live.update(surface, surface.settle());
  live.refresh(surface);
  const Picture followed = scene.draw({false, 1});
  live.show(surface);
  EXPECT_EQ(scene.draw({false, 1}).rgb, followed.rgb);
}

TEST(Picture, IsDrawnAgainOnlyWhenSomethingHasChanged) {
  const auto bone = test::solid(
      0.5, 8, [](Vec3 p) { return length(p) < 6; }, {}, 2);
  LiveSurface surface(bone, {});
  Scene scene;
  BoneView view(scene.renderer);
  view.show(surface);
  const auto stamp = [&] { return scene_stamp(scene.renderer); };
  static_cast<void>(scene.draw({false, 1}));
  std::uint64_t last = 0;
  for (const bool effects : {false, true, false}) {
    static_cast<void>(scene.draw({effects, 1}));
    last = stamp();
    scene.window.window()->Render();
    scene.renderer->ResetCameraClippingRange();
    view.place({});
    view.highlight(false);
    view.wet(surface);
    EXPECT_EQ(stamp(), last);
  }
  const auto changed = [&](const char* what) {
    EXPECT_NE(stamp(), last) << what;
    last = stamp();
  };
  scene.renderer->GetActiveCamera()->Azimuth(1);
  changed("camera");
  view.place({{}, {1, 0, 0}});
  changed("a body moved");
  view.place({{}, {1, 0, 0.5}});
  changed("and again");
  view.highlight(true);
  changed("highlight");
  Dust dust(bone);
  WetFilm film;
  view.set_film(&film);
  dust.irrigate({0, -14, 0}, {0, 1, 0}, 20, 2);
  ASSERT_TRUE(film.update(dust));
  view.wet(surface);
  changed("wetness");
  view.update(surface, std::vector<std::uint32_t>{surface.bone().find_brick(1, 1, 1)});
  changed("bone");
  const auto actor = make_bone_actor(to_vtk(surface.joined().mesh));
  scene.renderer->AddActor(actor);
  changed("something new");
  scene.renderer->RemoveActor(actor);
  changed("something gone");
}

// A cube of so many voxels about the origin; `value` of each by its index.
Labels cube_labels(int size, double spacing_mm, std::vector<Structure> structures,
                   const std::function<int(int i, int j, int k)>& value) {
  Labels labels;
  const double corner_mm = -0.5 * size * spacing_mm;
  labels.frame.dims = {size, size, size};
  labels.frame.spacing_mm = {spacing_mm, spacing_mm, spacing_mm};
  labels.frame.origin_mm = {corner_mm, corner_mm, corner_mm};
  const auto voxels = make_voxels<std::uint8_t>(labels.frame.voxel_count());
  for (int k = 0; k < size; ++k)
    for (int j = 0; j < size; ++j)
      for (int i = 0; i < size; ++i)
        voxels[static_cast<std::size_t>((k * size + j) * size + i)] = static_cast<std::uint8_t>(value(i, j, k));
  labels.voxels = voxels;
  labels.structures = std::move(structures);
  return labels;
}

// Bone that gets thinner over a nerve takes on its colour without steps.
TEST(Colours, ShineThroughThinBoneWithoutSteps) {
  const StructureMap map(cube_labels(40, 0.4, {{6, "facial nerve", {255, 255, 0}}},
                                     [](int, int j, int k) { return std::hypot(j - 20, k - 20) < 4 ? 6 : 0; }));
  double last = 2, widest = 0;
  for (double depth = 0.02; depth < 3; depth += 0.02) {
    const double share = shine_through(map, {0, 0, 1.6 + depth}, {0, 0, -1}).share;
    EXPECT_LE(share, last + 0.02) << depth;
    if (last <= 1) widest = std::max(widest, last - share);
    last = share;
  }
  EXPECT_EQ(last, 0);
  EXPECT_GT(shine_through(map, {0, 0, 1.8}, {0, 0, -1}).share, 0.5);
  EXPECT_LT(widest, 0.06);
}

// By what is remembered of each vertex colours are the same, and the remembered is not used where a vertex has moved.
TEST(Colours, RememberedShineIsTheSame) {
  auto bone = block();
  const StructureMap map(cube_labels(60, 0.5, {{6, "sigmoid sinus", {0, 0, 255}}}, [](int, int j, int k) {
    return j > 38 && j < 48 && std::abs(k - 30) < 8 ? 6 : 0;
  }));
  LiveSurface surface(bone, {});
  surface.shade({});
  BonePaint paint(bone, &map, nullptr);
  std::vector<ShineMemo> memos(bone.brick_count());
  std::vector<Rgb> whole, remembered;
  std::size_t blue = 0, held = 0;
  for (int stroke = 0; stroke < 4; ++stroke) {
    for (std::uint32_t b = 0; b < bone.brick_count(); ++b) {
      paint.paint(bone, surface.patch(b), whole);
      paint.paint(bone, surface.patch(b), remembered, &memos[b]);
      ASSERT_EQ(whole.size(), remembered.size());
      for (std::size_t n = 0; n < whole.size(); ++n) {
        for (std::size_t c = 0; c < 3; ++c) ASSERT_NEAR(whole[n][c], remembered[n][c], 4) << stroke;
        blue += whole[n][2] > whole[n][0] ? 1 : 0;
      }
      held += memos[b].of_key.size();
    }
    for (VoxelKey key = 0; key < bone.brick_count() * BrickGrid::kVoxels; ++key) {
      const Ijk c = bone.coordinate(key);
      if (length(bone.frame().world_from_index({1.0 * c.i, 1.0 * c.j, 1.0 * c.k}) - Vec3{0, 2.0 + stroke, 0}) > 3)
        continue;
      bone.set(key, 0);
      surface.mark(key);
    }
    const auto changed = surface.update();
    paint.renew(bone, changed);
    surface.settle();
  }
  EXPECT_GT(blue, 50U);
  EXPECT_GT(held, 0U);
}

// As by small steps all the way, from everywhere near two structures and in any direction.
TEST(Colours, ShineThroughAsByStepsAllTheWay) {
  const StructureMap map(cube_labels(
      40, 0.4, {{6, "facial nerve", {255, 255, 0}}, {7, "sigmoid sinus", {0, 0, 255}}}, [](int i, int j, int k) {
        return std::hypot(j - 20, k - 20) < 4 ? 6 : std::hypot(i - 8, j - 9, k - 31) < 5 ? 7 : 0;
      }));
  int shines = 0, other = 0;
  for (int n = 0; n < 20000; ++n) {
    // Evenly over the box and over directions, by irrational steps.
    const auto part = [&](double by) { return std::fmod(by * (n + 1), 1.0); };
    const Vec3 at{16 * part(0.7548776662) - 8, 16 * part(0.5698402909) - 8, 16 * part(0.4301597090) - 8};
    const double turn = 2 * std::numbers::pi * part(0.6180339887), up = 2 * part(0.4142135623) - 1;
    const Vec3 along{std::sqrt(1 - up * up) * std::cos(turn), std::sqrt(1 - up * up) * std::sin(turn), up};
    const Shine found = shine_through(map, at, along);
    // The depth at which the way first meets one, to a hundredth.
    double deep = 99;
    const auto first = map.at(at);
    if (first.structure != 0 && first.distance_mm < BonePaint::kShownThroughMm) {
      for (double t = 0; t <= BonePaint::kShownThroughMm && deep > 90; t += 0.01) {
        if (const auto there = map.at(at + along * t); there.structure != 0 && there.distance_mm <= 0) deep = t;
      }
    }
    const double none = std::exp(-BonePaint::kShownThroughMm / 0.8);
    const double expected = deep > 90 ? 0 : std::clamp((std::exp(-deep / 0.8) - none) / (1 - none), 0.0, 1.0);
    shines += expected > 0 ? 1 : 0;
    // A way that only grazes one may miss it between two steps.
    other += std::abs(found.share - expected) > 0.03 ? 1 : 0;
  }
  EXPECT_GT(shines, 1000);
  EXPECT_LT(other, shines / 50) << shines;
}

// The speckle of cut cancellous bone belongs to the place.
TEST(Colours, SpeckleStaysWhereItIs) {
  const auto bone = test::solid(
      0.4, 10, [](Vec3 p) { return p.z < 2; }, {}, 1);
  // 300 HU everywhere.
  SparseGrid hu = to_sparse(bone, "hu");
  BrickGrid values = to_bricks(hu, true);
  for (VoxelKey key = 0; key < values.brick_count() * BrickGrid::kVoxels; ++key) values.set(key, 300);
  const auto spongy = std::make_shared<const Hardness>(bone, to_sparse(values, "hu"));
  for (VoxelKey key = 0; key < values.brick_count() * BrickGrid::kVoxels; ++key) values.set(key, 1600);
  const auto dense = std::make_shared<const Hardness>(bone, to_sparse(values, "hu"));
  const LiveSurface surface(bone, {});
  const auto spread = [&](const std::shared_ptr<const Hardness>& h, double& red_over_blue) {
    const BonePaint paint(bone, nullptr, h);
    std::vector<Rgb> colours, again;
    double sum = 0, squares = 0, n = 0;
    red_over_blue = 0;
    for (std::uint32_t b = 0; b < bone.brick_count(); ++b) {
      const SurfacePatch& patch = surface.patch(b);
      paint.paint(bone, patch, colours);
      paint.paint(bone, patch, again);
      EXPECT_EQ(colours, again);
      for (std::size_t v = 0; v < colours.size(); ++v) {
        const Vec3 at = from_floats(patch.vertices[v].index);
        if (patch.vertices[v].normal[2] < 0.99F || at.x < 12 || at.y < 12 || at.x > 36 || at.y > 36) continue;
        sum += colours[v][0];
        squares += colours[v][0] * colours[v][0];
        red_over_blue += colours[v][0] / static_cast<double>(colours[v][2]);
        ++n;
      }
    }
    EXPECT_GT(n, 100);
    red_over_blue /= n;
    return std::sqrt(std::max(0.0, squares / n - sum / n * (sum / n)));
  };
  double red = 0, pale = 0;
  const double rough = spread(spongy, red), even = spread(dense, pale);
  EXPECT_GT(rough, 3);
  EXPECT_LT(even, 1);
  EXPECT_GT(red, 1.15 * pale);
}

}  // namespace
}  // namespace osteo
