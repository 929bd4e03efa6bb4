// Structures as they are drawn, against bodies known in closed form.
#include "osteo/display/view/structures_view.h"

#include <gtest/gtest.h>
#include <vtkGenericOpenGLRenderWindow.h>
#include <vtkNew.h>
#include <vtkRenderer.h>

#include <cmath>
#include <cstdio>
#include <functional>
#include <numbers>

#include "osteo/display/view/actors.h"
#include "osteo/display/view/live_cut.h"
#include "osteo/display/view/offscreen.h"

namespace osteo {
namespace {

// A body cut into voxels whose centres decide, as a segmentation would.
Labels labelled(double half_mm, Vec3 h, const std::function<double(Vec3)>& signed_mm) {
  Labels l;
  for (std::size_t a = 0; a < 3; ++a) {
    l.frame.dims[a] = 2 * static_cast<int>(half_mm / h[a]);
    l.frame.spacing_mm[a] = h[a];
    l.frame.origin_mm[a] = -(l.frame.dims[a] - 1) * h[a] / 2 + 0.13 * h[a];
  }
  const auto v = make_voxels<std::uint8_t>(l.frame.voxel_count());
  std::size_t at = 0;
  for (int k = 0; k < l.frame.dims[2]; ++k)
    for (int j = 0; j < l.frame.dims[1]; ++j)
      for (int i = 0; i < l.frame.dims[0]; ++i)
        v[at++] = signed_mm(l.frame.world_from_index({double(i), double(j), double(k)})) < 0 ? 1 : 0;
  l.voxels = v;
  return l;
}

struct Errors {
  double mean_mm = 0, rms_mm = 0, normals_deg = 0, volume = 0;
};
// Of the points of a surface but where `counts` says no; against the distance's own gradient.
Errors errors_of(const TriMesh& mesh, const std::function<double(Vec3)>& signed_mm,
                 const std::function<bool(Vec3)>& counts) {
  Errors e;
  int n = 0;
  for (std::size_t p = 0; p < mesh.points_mm.size(); ++p) {
    const Vec3 x = from_floats(mesh.points_mm[p]);
    if (!counts(x)) continue;
    const double d = signed_mm(x), eps = 1e-4;
    const Vec3 g = normalized({signed_mm(x + Vec3{eps, 0, 0}) - signed_mm(x - Vec3{eps, 0, 0}),
                               signed_mm(x + Vec3{0, eps, 0}) - signed_mm(x - Vec3{0, eps, 0}),
                               signed_mm(x + Vec3{0, 0, eps}) - signed_mm(x - Vec3{0, 0, eps})});
    const double angle =
        std::acos(std::clamp(dot(g, from_floats(mesh.normals[p])), -1.0, 1.0)) * 180 / std::numbers::pi;
    e.mean_mm += d;
    e.rms_mm += d * d;
    e.normals_deg += angle * angle;
    ++n;
  }
  e.mean_mm /= n;
  e.rms_mm = std::sqrt(e.rms_mm / n);
  e.normals_deg = std::sqrt(e.normals_deg / n);
  e.volume = enclosed_volume_mm3(mesh);
  return e;
}

TEST(StructureSurfaces, AreSmoothAndWhereTheBodyIs) {
  const Vec3 tilt = normalized({0.3, -0.5, 0.81});
  const auto tube = [&](double r) { return [r, tilt](Vec3 p) { return length(cross(p, tilt)) - r; }; };
  const auto ball = [](double r) { return [r](Vec3 p) { return length(p) - r; }; };
  const auto everywhere = [](Vec3) { return true; };
  const auto not_at_ends = [](Vec3 p) { return std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}) < 4; };
  struct Body {
    const char* name;
    std::function<double(Vec3)> signed_mm;
    bool whole;
    Vec3 voxel;
    double rms_mm, normals_deg;  // allowed
  };
  const Body bodies[] = {
      {"ball of 5, 0.3", ball(5), true, {0.3, 0.3, 0.3}, 0.025, 3},
      {"ball of 5, 0.5", ball(5), true, {0.5, 0.5, 0.5}, 0.04, 3},
      {"ball of 5, 1", ball(5), true, {1, 1, 1}, 0.075, 4.2},
      {"ball of 5, 0.5 x 0.5 x 1", ball(5), true, {0.5, 0.5, 1}, 0.055, 4.2},
      {"ball of 2, 0.5", ball(2), true, {0.5, 0.5, 0.5}, 0.045, 5.5},
      {"sinus: tube of 4, 0.3", tube(4), false, {0.3, 0.3, 0.3}, 0.018, 2.2},
      {"sinus: tube of 4, 0.5", tube(4), false, {0.5, 0.5, 0.5}, 0.03, 2.4},
      {"sinus: tube of 4, 1", tube(4), false, {1, 1, 1}, 0.075, 4},
      {"nerve: tube of 1, 0.3", tube(1), false, {0.3, 0.3, 0.3}, 0.025, 4},
      {"nerve: tube of 1, 0.5", tube(1), false, {0.5, 0.5, 0.5}, 0.06, 8},
      {"nerve: tube of 1, 1", tube(1), false, {1, 1, 1}, 0.19, 21},
      {"chorda: tube of 0.5, 0.3", tube(0.5), false, {0.3, 0.3, 0.3}, 0.045, 10},
      {"chorda: tube of 0.5, 0.5", tube(0.5), false, {0.5, 0.5, 0.5}, 0.1, 19},
  };
  for (const Body& b : bodies) {
    const Labels labels = labelled(6.5, b.voxel, b.signed_mm);
    const StructureMap map(labels, 2);
    const TriMesh smooth = smooth_surface(map.face(0), map.label_spacing_mm()[1] / 2);
    const Errors was = errors_of(map.face(0), b.signed_mm, b.whole ? everywhere : not_at_ends);
    const Errors now = errors_of(smooth, b.signed_mm, b.whole ? everywhere : not_at_ends);
    std::printf(
        "%-26s face: %+.3f rms %.3f mm normals %4.1f   drawn: %+.3f rms %.3f mm normals %4.1f  volume %.3f of the "
        "face's\n",
        b.name, was.mean_mm, was.rms_mm, was.normals_deg, now.mean_mm, now.rms_mm, now.normals_deg,
        now.volume / was.volume);
    EXPECT_LT(now.rms_mm, b.rms_mm) << b.name;
    EXPECT_LT(now.normals_deg, b.normals_deg) << b.name;
    EXPECT_LT(now.rms_mm, 1.1 * was.rms_mm) << b.name;
    EXPECT_NEAR(now.volume, was.volume, 0.06 * was.volume) << b.name;
    if (b.whole) continue;
    // A tube is one all along: a loop around its middle in every cut across it.
    for (double along = -4; along <= 4; along += 0.25) {
      const auto lines = section_of(smooth, tilt * along, tilt);
      ASSERT_EQ(lines.size(), 1u) << b.name << ' ' << along;
      EXPECT_TRUE(lines[0].closed);
      Vec3 middle;
      for (const Vec3 p : lines[0].points_mm) middle += p / static_cast<double>(lines[0].points_mm.size());
      EXPECT_LT(length(middle - tilt * along), 0.6 * b.voxel.x) << b.name << ' ' << along;
    }
  }
}

TEST(StructureSurfaces, ACrumbStaysWhatItIs) {
  const Labels labels = labelled(6, {0.5, 0.5, 0.5}, [](Vec3 p) {
    return std::min(length(p) - 3, length(p - Vec3{5, 0, 0}) - 0.45);
  });
  const StructureMap map(labels, 2);
  const TriMesh smooth = smooth_surface(map.face(0), 0.25);
  int crumb = 0, moved = 0;
  for (std::size_t p = 0; p < smooth.points_mm.size(); ++p) {
    const bool same = smooth.points_mm[p] == map.face(0).points_mm[p];
    if (smooth.points_mm[p][0] > 4) {
      ++crumb;
      EXPECT_TRUE(same);
    } else {
      moved += same ? 0 : 1;
    }
  }
  EXPECT_GT(crumb, 5);
  EXPECT_GT(moved, 100);
}

// A map's structures from the front, from 8 mm to each side.
struct Seen {
  explicit Seen(const StructureMap& map) : view(made(), map) { look_at(renderer, {0, 0, 0}, 8, {0, -1, 0}); }
  OffscreenWindow window{200, 200};
  vtkNew<vtkRenderer> renderer;
  StructuresView view;

 private:
  vtkRenderer* made() {
    window.window()->AddRenderer(renderer);
    set_up_scene(renderer);
    return renderer;
  }
};

TEST(StructuresView, ClearLetsEveryOtherPixelThroughAndHiddenAll) {
  // A small ball behind a large one.
  Labels labels = labelled(8, {0.5, 0.5, 0.5}, [](Vec3 p) { return length(p - Vec3{0, -3, 0}) - 4; });
  const auto v = make_voxels<std::uint8_t>(labels.frame.voxel_count());
  for (int k = 0; k < labels.frame.dims[2]; ++k)
    for (int j = 0; j < labels.frame.dims[1]; ++j)
      for (int i = 0; i < labels.frame.dims[0]; ++i) {
        const std::size_t at = labels.offset(i, j, k);
        v[at] = length(labels.frame.world_from_index({double(i), double(j), double(k)}) - Vec3{0, 5, 0}) < 2
                    ? std::uint8_t{2}
                    : labels.voxels[at];
      }
  labels.voxels = v;
  labels.structures = {{1, "in front", {255, 0, 0}}, {2, "behind", {0, 255, 0}}};
  const StructureMap map(labels, 2);
  Seen seen(map);
  StructuresView& view = seen.view;
  const auto share_in_middle = [&](std::size_t channel) {
    const Picture p = seen.window.render();
    int counted = 0;
    for (int y = 94; y < 106; ++y) {
      for (int x = 94; x < 106; ++x) {
        const std::uint8_t* const c = p.rgb.data() + 3 * static_cast<std::size_t>(y * p.width + x);
        counted += c[channel] > 40 && c[1 - channel] < 40 ? 1 : 0;
      }
    }
    return counted / 144.0;
  };
  EXPECT_EQ(share_in_middle(0), 1);
  view.show(0, StructureLook::clear);
  EXPECT_NEAR(share_in_middle(0), 0.5, 0.02);
  EXPECT_NEAR(share_in_middle(1), 0.5, 0.02);
  view.show(0, StructureLook::hidden);
  EXPECT_EQ(share_in_middle(1), 1);
  view.show(1, StructureLook::hidden);
  EXPECT_EQ(share_in_middle(1), 0);
  view.show(0, StructureLook::solid);
  EXPECT_EQ(share_in_middle(0), 1);
  EXPECT_EQ(view.all()[0].value, 1);
}

// A tube along x that runs out of the bone's grid at both ends: it fades there, also where it is clear. One that ends
// before stays whole to its end, and so does one whose labels were cropped, or that is labelled beyond the bone.
TEST(StructuresView, WhatRunsOutOfTheBoneFadesTowardsItsBorder) {
  const auto drawn = [](const std::function<double(Vec3)>& body, StructureLook look, double bone_half_mm = 6) {
    Labels labels = labelled(6, {0.5, 0.5, 0.5}, body);
    labels.structures = {{1, "tube", {255, 0, 0}}};
    const StructureMap map(labels, 2);
    Seen seen(map);
    Frame bone;
    for (std::size_t a = 0; a < 3; ++a) {
      bone.spacing_mm[a] = 0.3;
      bone.dims[a] = static_cast<int>(2 * bone_half_mm / 0.3);
      bone.origin_mm[a] = labels.frame.origin_mm[a] + 5.75 - bone_half_mm + 0.15;
    }
    seen.view.fade_at_border(bone);
    if (look != StructureLook::solid) {
      seen.view.show(0, StructureLook::hidden);
      seen.view.show(0, look);
    }
    const Picture p = seen.window.render();
    // Share of the tube's middle rows that is its own, by millimetres from the picture's middle.
    std::vector<double> share;
    for (int mm = 0; mm < 6; ++mm) {
      int own = 0, all = 0;
      for (int y = 92; y < 108; ++y)
        for (int x = 0; x < 200; ++x) {
          if (static_cast<int>(std::abs(x - 99.5) * 16 / 200) != mm) continue;
          const std::uint8_t* const c = p.rgb.data() + 3 * static_cast<std::size_t>(y * p.width + x);
          own += c[0] > 40 && c[1] < 40 ? 1 : 0;
          ++all;
        }
      share.push_back(static_cast<double>(own) / all);
    }
    return share;
  };
  const auto tube = [](double half_mm) {
    return [half_mm](Vec3 p) { return std::max(std::hypot(p.y, p.z) - 2, std::abs(p.x) - half_mm); };
  };
  const std::vector<double> out = drawn(tube(100), StructureLook::solid),
                            clear = drawn(tube(100), StructureLook::clear),
                            whole = drawn(tube(4.4), StructureLook::solid),
                            cropped = drawn(tube(100), StructureLook::solid, 15),
                            beyond = drawn(tube(100), StructureLook::solid, 4);
  for (std::size_t mm = 0; mm < out.size(); ++mm)
    std::printf("%zu mm from the middle: %.2f drawn, clear %.2f; of one that ends before %.2f\n", mm, out[mm],
                clear[mm], whole[mm]);
  // A sixth of 12 mm.
  for (std::size_t mm = 0; mm < 3; ++mm) EXPECT_EQ(out[mm], 1) << mm;
  EXPECT_GT(out[3], 0.95);
  EXPECT_NEAR(out[4], 0.6, 0.15);
  EXPECT_LT(out[5], 0.25);
  for (std::size_t mm = 0; mm < 6; ++mm) EXPECT_NEAR(clear[mm], out[mm] / 2, 0.06) << mm;
  for (std::size_t mm = 0; mm < 4; ++mm) EXPECT_EQ(whole[mm], 1) << mm;
  for (std::size_t mm = 0; mm < 5; ++mm) {
    EXPECT_EQ(cropped[mm], 1) << mm;
    EXPECT_EQ(beyond[mm], 1) << mm;
  }
}

// The left half of a ball is uncertain: it has bars of a paler colour, the right half has none.
TEST(StructuresView, WhatIsUncertainIsHatched) {
  Labels labels = labelled(8, {0.4, 0.4, 0.4}, [](Vec3 p) { return length(p) - 6; });
  labels.structures = {{1, "ball", {200, 0, 0}, "segment-network, version 3", 0.6}};
  const StructureMap map(labels, 2);
  labels.structures[0].within_mm = 0;  // as after a correction
  const StructureMap corrected(labels, 2);
  Labels values = labels;
  const auto v = make_voxels<std::uint8_t>(labels.frame.voxel_count());
  for (int k = 0; k < labels.frame.dims[2]; ++k)
    for (int j = 0; j < labels.frame.dims[1]; ++j)
      for (int i = 0; i < labels.frame.dims[0]; ++i) {
        const bool left = labels.frame.world_from_index({double(i), double(j), double(k)}).x < -1;
        v[labels.offset(i, j, k)] = static_cast<std::uint8_t>(labels.at(i, j, k) == 0 ? 0 : left ? 4 : 3);
      }
  values.voxels = v;
  Seen seen(map);
  StructuresView& view = seen.view;
  const auto pale = [&](int x0, int x1) {
    const Picture p = seen.window.render();
    int counted = 0;
    for (int y = 90; y < 110; ++y)
      for (int x = x0; x < x1; ++x) counted += p.rgb[3 * static_cast<std::size_t>(y * p.width + x) + 1] > 85 ? 1 : 0;
    return counted / (20.0 * (x1 - x0));
  };
  EXPECT_EQ(pale(60, 90), 0);
  view.hatch(values, 5);
  EXPECT_EQ(pale(60, 90) + pale(110, 140), 0) << "nothing is in that class";
  view.hatch(values, 4);
  const double left = pale(60, 90), right = pale(110, 140);
  EXPECT_NEAR(std::max(left, right), 0.5, 0.2);
  EXPECT_EQ(std::min(left, right), 0);
  // What a hand has corrected is not.
  view.show(0, StructureLook::hidden);
  {
    StructuresView other(seen.renderer, corrected);
    other.hatch(values, 4);
    EXPECT_EQ(pale(60, 90) + pale(110, 140), 0);
  }
  view.show(0, StructureLook::solid);
  view.show(0, StructureLook::hidden);
  EXPECT_EQ(pale(60, 140), 0);
  view.show(0, StructureLook::solid);
  EXPECT_NEAR(std::max(pale(60, 90), pale(110, 140)), 0.5, 0.2);
}

}  // namespace
}  // namespace osteo
