#include "osteo/app/stages/mesh.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include <nlohmann/json.hpp>

#include "edit.h"
#include "meshes.h"
#include "osteo/core/base/error.h"
#include "osteo/core/data/tet_mesh.h"
#include "osteo/imaging/edit/edit_file.h"
#include "segment.h"

namespace osteo {
namespace {

Data surface(const TriangleSoup& s) {
  return std::make_shared<const TriMesh>(mesh_of(s));
}
Data surface(TriMesh m) {
  return std::make_shared<const TriMesh>(std::move(m));
}

template <class T>
T reported(const Report& report, const std::string& key) {
  for (const auto& [k, v] : report) {
    if (k == key) return std::get<T>(v);
  }
  ADD_FAILURE() << "nothing is reported as " << key;
  return {};
}

nlohmann::json info_of(const Data& d, MeshInfoParams p = {}) {
  return nlohmann::json::parse(std::get<Document>(MeshInfoStage::run(p, std::span(&d, 1), {})[0]).json);
}

// What a person drew or changed says so; what was left as it was found does not.
TEST(ApplyEdits, StructuresKnowTheHandsThatChangedThem) {
  Image ct;
  ct.frame.dims = {12, 12, 12};
  const auto hu = make_voxels<std::int16_t>(ct.frame.voxel_count());
  const auto mask = make_voxels<std::uint8_t>(ct.frame.voxel_count()),
             map = make_voxels<std::uint8_t>(ct.frame.voxel_count());
  for (std::size_t v = 0; v < ct.frame.voxel_count(); ++v) {
    hu[v] = 500;
    mask[v] = 1;
    map[v] = static_cast<std::uint8_t>(v < 144 ? 1 : v < 288 ? 2 : 0);
  }
  ct.voxels = hu;
  const Labels bone{{ct.frame, mask}, {}},
      structures{{ct.frame, map},
                 {{1, "left as found", {1, 1, 1}, "tube, version 2", 0.6, "short"},
                  {2, "changed", {2, 2, 2}, "find-structures, version 2", 0.6, "short"}}};
  EditDocument document(ct, bone, &structures);
  document.apply(BrushEdit{2, false, 1.5, {{5, 5, 6}}});
  document.apply(AddStructureEdit{3, "drawn", {250, 220, 40}, StructureRole::at_risk});
  document.apply(BrushEdit{3, false, 1.5, {{5, 5, 9}}});
  document.apply(AddStructureEdit{4, "by a tool", {250, 220, 40}, StructureRole::at_risk});
  document.apply(VoxelsEdit{4, "1400 5"});
  const std::vector<Data> inputs{ct, bone, Document{edits_text(recipe_of(document))}, structures};
  const auto made = std::get<Labels>(ApplyEditsStage::run({}, inputs, {})[1]);
  ASSERT_EQ(made.structures.size(), 4u);
  EXPECT_EQ(made.structures[0].origin, "tube, version 2");
  EXPECT_EQ(made.structures[1].origin, "find-structures, version 2, corrected by hand");
  EXPECT_EQ(made.structures[2].origin, "by hand");
  EXPECT_EQ(made.structures[3].origin, "");
  // What was said of a boundary was said of that boundary.
  EXPECT_EQ(made.structures[0].within_mm, 0.6);
  EXPECT_EQ(made.structures[0].doubt, "short");
  for (std::size_t n = 1; n < 4; ++n) {
    EXPECT_EQ(made.structures[n].within_mm, 0) << n;
    EXPECT_EQ(made.structures[n].doubt, "") << n;
  }
}

// A network's structure in the editor keeps what the network says of it, until a hand changes it.
TEST(ApplyEdits, WhatANetworkFoundInTheEditorKeepsItsDoubts) {
  Image ct;
  ct.frame.dims = {12, 12, 12};
  const std::size_t n = ct.frame.voxel_count();
  const auto hu = make_voxels<std::int16_t>(n);
  const auto mask = make_voxels<std::uint8_t>(n), map = make_voxels<std::uint8_t>(n),
             nets = make_voxels<std::uint8_t>(n);
  for (std::size_t v = 0; v < n; ++v) {
    hu[v] = 500;
    mask[v] = 1;
    map[v] = static_cast<std::uint8_t>(v < 144 ? 5 : 0);
    nets[v] = static_cast<std::uint8_t>(v < 100 ? 1 : v >= 600 && v < 660 ? 2 : v >= 1500 ? 3 : 0);
  }
  ct.voxels = hu;
  const std::string by = "segment-network, version 4";
  const double far = std::numeric_limits<double>::infinity();
  const Labels bone{{ct.frame, mask}, {}}, before{{ct.frame, map}, {{5, "sinus", {1, 1, 1}, "tube, version 2", 0.3}}},
      found{{ct.frame, nets},
            {{1, "sinus", {1, 1, 1}, by, 1.2, "differs from find-structures"},
             {2, "labyrinth", {2, 2, 2}, by, far, "too short"},
             {3, "ear canal", {3, 3, 3}, by, 0.6, "not that of a phantom"}}};
  EditDocument document(ct, bone, &before);
  document.apply_together(structures_of(found, document), "structures by a network");
  int canal = 0;
  for (const EditStructure& s : document.structures())
    if (s.is.name == "ear canal") canal = s.is.value;
  document.apply(BrushEdit{canal, false, 1.5, {{5, 5, 8}}});
  const std::vector<Data> inputs{ct, bone, Document{edits_text(recipe_of(document))}, before};
  const auto made = std::get<Labels>(ApplyEditsStage::run({}, inputs, {})[1]);
  ASSERT_EQ(made.structures.size(), 3u);
  for (const Structure& s : made.structures) {
    if (s.name == "sinus") {
      EXPECT_EQ(s.origin, by);
      EXPECT_EQ(s.within_mm, 1.2);
      EXPECT_EQ(s.doubt, "differs from find-structures");
    } else if (s.name == "labyrinth") {
      EXPECT_EQ(s.origin, by);
      EXPECT_EQ(s.within_mm, far);
      EXPECT_EQ(s.doubt, "too short");
    } else {
      EXPECT_EQ(s.origin, by + ", corrected by hand");
      EXPECT_EQ(s.within_mm, 0);
      EXPECT_EQ(s.doubt, "");
    }
  }
}

TEST(MeshInfo, TellsWhatASurfaceIsLike) {
  const auto box = info_of(surface(test::box({0, 0, 0}, {2, 3, 4})));
  EXPECT_EQ(box["points"], 8);
  EXPECT_EQ(box["triangles"], 12);
  EXPECT_EQ(box["watertight"], true);
  EXPECT_EQ(box["bodies"], 1);
  EXPECT_EQ(box["euler_characteristic"], 2);
  EXPECT_DOUBLE_EQ(box["volume_mm3"], 24);
  EXPECT_DOUBLE_EQ(box["area_mm2"], 52);
  EXPECT_EQ(box["bounds_mm"], nlohmann::json({{0, 0, 0}, {2, 3, 4}}));

  TriangleSoup bad = test::joined(test::box({0, 0, 0}, {2, 2, 2}), test::turned(test::box({5, 5, 5}, {6, 6, 6})));
  bad.triangles.pop_back();
  const auto worse = info_of(surface(bad));
  EXPECT_EQ(worse["watertight"], false);
  EXPECT_EQ(worse["holes"], 1);
  EXPECT_EQ(worse["open_edges"], 3);
  EXPECT_EQ(worse["bodies"], 2);
  EXPECT_FALSE(worse.contains("volume_mm3")) << "an open surface encloses nothing";
}

TEST(MeshInfo, NoSurfaceIsTooBad) {
  TriMesh m = mesh_of(test::box({0, 0, 0}, {1, 1, 1}));
  m.points_mm.push_back({std::nanf(""), 0, 0});
  m.triangles.push_back({0, 1, 8});
  m.triangles.push_back({0, 0, 1});
  const auto j = info_of(surface(m));
  EXPECT_EQ(j["non_finite_points"], 1);
  EXPECT_EQ(j["degenerate"], 1);
  EXPECT_FALSE(j.contains("self_intersections")) << "not to be counted among points that are nowhere";
}

TEST(MeshRepair, ReportsWhatItDid) {
  // Loose triangles of a box, one twice, one without area, one wrong way round.
  TriangleSoup s = test::unwelded(test::box({0, 0, 0}, {2, 2, 2}));
  std::swap(s.triangles[3][0], s.triangles[3][1]);
  s.triangles.push_back(s.triangles[5]);
  s.triangles.push_back({0, 0, 1});
  const Data in = surface(s);
  Context context;
  const auto out = MeshRepairStage::run({}, std::span(&in, 1), context);
  const Report r = context.take_report();
  EXPECT_EQ(reported<std::int64_t>(r, "points_welded"), 36 - 8);
  EXPECT_EQ(reported<std::int64_t>(r, "degenerate_dropped"), 1);
  EXPECT_EQ(reported<std::int64_t>(r, "duplicates_dropped"), 1);
  EXPECT_EQ(reported<std::int64_t>(r, "triangles_turned"), 1);
  EXPECT_TRUE(reported<bool>(r, "watertight"));
  EXPECT_NEAR(reported<double>(r, "volume_mm3"), 8, 1e-6);
  EXPECT_EQ(std::get<Surface>(out[0])->triangles.size(), 12u);
}

TEST(MeshRepair, KeepsTheLargestBodyWhenAsked) {
  const Data in = surface(test::joined(test::box({0, 0, 0}, {2, 2, 2}), test::box({5, 5, 5}, {6, 6, 6})));
  MeshRepairParams p;
  p.keep_largest = true;
  Context context;
  const auto out = MeshRepairStage::run(p, std::span(&in, 1), context);
  EXPECT_NEAR(enclosed_volume_mm3(*std::get<Surface>(out[0])), 8, 1e-6);
  EXPECT_EQ(reported<std::int64_t>(context.take_report(), "bodies_dropped"), 1);
}

TEST(Tetrahedralize, EveryMethodFillsTheBall) {
  const TriangleSoup ball = test::sphere(6, 3, {10, 0, -4});
  const double volume = enclosed_volume_mm3(mesh_of(ball));
  const Data in = surface(ball);
  for (const TetMethod method :
       {TetMethod::grid, TetMethod::grid_conforming, TetMethod::graded, TetMethod::tetgen, TetMethod::cgal}) {
    const std::string name(EnumNames<TetMethod>::values[static_cast<std::size_t>(method)]);
    if (method == TetMethod::cgal && copyleft_parts().find("CGAL") == std::string_view::npos) continue;
    if (method == TetMethod::tetgen && copyleft_parts().find("TetGen") == std::string_view::npos) continue;
    SCOPED_TRACE(name);
    TetrahedralizeParams p;
    p.method = method;
    p.spacing_mm = 1.2;
    p.margin = false;
    Context context;
    const auto out = TetrahedralizeStage::run(p, std::span(&in, 1), context);
    const TetMesh& m = *std::get<Tets>(out[0]);
    const Report r = context.take_report();
    const bool stairs = method == TetMethod::grid || method == TetMethod::graded;
    EXPECT_NEAR(volume_mm3(m), volume, (stairs ? 0.2 : 0.03) * volume);
    EXPECT_LT(reported<double>(r, "surface_to_boundary_max_mm"), stairs ? 2.1 : 0.4);
    EXPECT_TRUE(check(boundary_of(m)).watertight());
  }
}

TEST(Tetrahedralize, MissingMethodsAndThinSurfacesAreTold) {
  const Data in = surface(test::box({0, 0, 0}, {10, 10, 0.01}));
  TetrahedralizeParams p;
  p.method = TetMethod::grid;
  p.spacing_mm = 2;
  EXPECT_THROW(static_cast<void>(TetrahedralizeStage::run(p, std::span(&in, 1), {})), Error);
  const Data ball = surface(test::sphere(6, 2));
  for (const auto& [method, part] : {std::pair{TetMethod::tetgen, "TetGen"}, {TetMethod::cgal, "CGAL"}}) {
    if (copyleft_parts().find(part) != std::string_view::npos) continue;
    p.method = method;
    try {
      static_cast<void>(TetrahedralizeStage::run(p, std::span(&ball, 1), {}));
      ADD_FAILURE() << part << " is not there";
    } catch (const Error& e) {
      EXPECT_NE(std::string(e.what()).find("not in this build"), std::string::npos);
    }
  }
}

TEST(Tetrahedralize, CleanMendsFirst) {
  TriangleSoup s = test::unwelded(test::sphere(6, 2));
  std::swap(s.triangles[7][0], s.triangles[7][2]);
  const Data in = surface(s);
  TetrahedralizeParams p;
  p.spacing_mm = 1.5;
  p.clean = true;
  Context context;
  const auto out = TetrahedralizeStage::run(p, std::span(&in, 1), context);
  EXPECT_EQ(reported<std::int64_t>(context.take_report(), "triangles_turned"), 1);
  EXPECT_NEAR(volume_mm3(*std::get<Tets>(out[0])), enclosed_volume_mm3(mesh_of(test::sphere(6, 2))), 25);
}

// A canal of 2 mm from one place to another, 14 mm apart, in a half circle or straight, in 0.5 mm voxels of dense bone.
Image canal(bool bent) {
  Frame f;
  f.dims = {56, 40, 24};
  f.spacing_mm = {0.5, 0.5, 0.5};
  auto voxels = std::make_shared<std::int16_t[]>(f.voxel_count());
  std::size_t n = 0;
  for (int k = 0; k < f.dims[2]; ++k)
    for (int j = 0; j < f.dims[1]; ++j)
      for (int i = 0; i < f.dims[0]; ++i) {
        const Vec3 p = f.world_from_index({double(i), double(j), double(k)}), q = p - Vec3{13, 13, 6};
        const double ring =
            std::hypot(std::hypot(q.x, std::min(q.y, 0.0)) - 7, q.z) + (q.y > 0 ? std::max(0.0, q.y - 2) : 0);
        const double d = bent ? ring : std::hypot(q.y, q.z) + std::max(0.0, std::abs(q.x) - 7);
        voxels[n++] = static_cast<std::int16_t>(40 + 1460 * std::clamp((d - 1) / 0.5 + 0.5, 0.0, 1.0));
      }
  return {f, voxels};
}

TEST(Tube, AWayMuchLongerThanTheStraightLineIsTold) {
  for (const bool bent : {false, true}) {
    std::string said;
    Context context;
    context.on_log([&](LogLevel, std::string_view text) { said += text; });
    TubeStageParams p;
    p.points_mm = "6,13,6; 20,13,6";
    const Data inputs[] = {canal(bent), {}, {}};
    static_cast<void>(TubeStage::run(p, inputs, context));
    EXPECT_EQ(said.find("from point 1 to 2 the way is") != std::string::npos, bent) << said;
  }
}

}  // namespace
}  // namespace osteo
