#include <vtkFloatArray.h>
#include <vtkImageData.h>
#include <vtkMarchingCubes.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkStaticCellLocator.h>

#include <algorithm>
#include <cmath>

#include "bone.h"
#include "osteo/core/base/error.h"
#include "osteo/geometry/mesh/bone_surface.h"

namespace osteo::inline app {
namespace {

struct Deviation {
  double mean = 0, max = 0;
  std::int64_t samples = 0;
};

// Distance, in voxels, of the surface's points to VTK's marching cubes of the same voxels, on up to 200 bricks spread
// evenly.
Deviation deviation_from_marching_cubes(const BrickGrid& bone, const BoneSurface& surface, double iso,
                                        const Context& context) {
  Deviation result;
  std::vector<std::uint32_t> bricks;  // those with surface, from the voxel list
  std::vector<std::size_t> first_voxel;
  for (std::size_t v = 0; v < surface.voxels.size(); ++v) {
    const std::uint32_t b = surface.voxels[v] / BrickGrid::kVoxels;
    if (bricks.empty() || bricks.back() != b) {
      bricks.push_back(b);
      first_voxel.push_back(v);
    }
  }
  first_voxel.push_back(surface.voxels.size());
  const std::size_t step = std::max<std::size_t>(1, bricks.size() / 200);
  constexpr int kPad = 4, kN = BrickGrid::kEdge + 2 * kPad;
  for (std::size_t n = 0; n < bricks.size(); n += step) {
    context.check_cancelled();
    const Ijk o = bone.brick_coordinate(bricks[n]);
    vtkNew<vtkImageData> block;
    block->SetDimensions(kN, kN, kN);
    block->SetOrigin(o.i * 8 - kPad, o.j * 8 - kPad, o.k * 8 - kPad);
    block->AllocateScalars(VTK_FLOAT, 1);
    bone.read_block({o.i * 8 - kPad, o.j * 8 - kPad, o.k * 8 - kPad}, {kN, kN, kN},
                    static_cast<float*>(block->GetScalarPointer()));
    vtkNew<vtkMarchingCubes> cubes;
    cubes->SetInputData(block);
    cubes->SetValue(0, iso);
    cubes->ComputeNormalsOff();
    cubes->ComputeScalarsOff();
    cubes->Update();
    if (cubes->GetOutput()->GetNumberOfCells() == 0) continue;
    vtkNew<vtkStaticCellLocator> locator;
    locator->SetDataSet(cubes->GetOutput());
    locator->BuildLocator();
    for (std::size_t v = first_voxel[n]; v < first_voxel[n + 1]; ++v) {
      for (const std::uint32_t vertex : surface.vertices_of_voxel.row(v)) {
        const auto& p = surface.mesh.points_mm[vertex];
        const Vec3 index = bone.frame().index_from_world({p[0], p[1], p[2]});
        const double x[3] = {index.x, index.y, index.z};
        double closest[3], distance2 = 0;
        vtkIdType cell = 0;
        int sub = 0;
        locator->FindClosestPoint(x, closest, cell, sub, distance2);
        result.mean += std::sqrt(distance2);
        result.max = std::max(result.max, std::sqrt(distance2));
        ++result.samples;
      }
    }
  }
  if (result.samples > 0) result.mean /= static_cast<double>(result.samples);
  return result;
}

}  // namespace

StageInfo SurfaceStage::info() {
  return {.name = "surface",
          .version = 2,
          .synopsis = "triangle surface of a bone density grid",
          .description =
              "nets: one vertex for each sheet of surface between eight voxels; closed, oriented and manifold for any "
              "bone. "
              "voxel: each vertex is a voxel on the surface, as in the thesis, without hidden triangles. "
              "Reports counts, closedness, enclosed volume, and the distance to marching cubes of the same voxels.",
          .inputs = {{"bone", {DataKind::grid}, "bone density, 0 to 1"}},
          .outputs = {{"surface", {DataKind::surface}, "triangles in LPS mm, facing out of the bone"}},
          .references = {"S. Gibson, Constrained Elastic Surface Nets, MERL 1998",
                         "G. Nielson, Dual Marching Cubes, IEEE Visualization 2004",
                         "R. Wenger, Isosurfaces: Geometry, Topology, and Algorithms, 2013",
                         "D. Morris, Haptics and Physical Simulation for Virtual Bone Surgery, 2006, section 3.2.2"},
          .example = "osteo surface bone.vdb bone.ply"};
}

std::vector<Data> SurfaceStage::run(const Params& p, std::span<const Data> inputs, const Context& context) {
  const BrickGrid bone = to_bricks(std::get<SparseGrid>(inputs[0]));
  const auto iso = static_cast<float>(p.iso);
  BoneSurface surface = p.method == SurfaceMethod::nets ? surface_nets(bone, iso, context.sub(0, 0.6))
                                                        : voxel_surface(bone, iso, context.sub(0, 0.6));
  if (surface.mesh.triangles.empty())
    throw Error(ExitCode::failed, "the grid has no surface at density " + format_number(p.iso));
  context.progress(0.6, "checking");
  const MeshCheck checked = check(surface.mesh);
  const Deviation d = deviation_from_marching_cubes(bone, surface, p.iso, context);
  context.report("points", static_cast<std::int64_t>(surface.mesh.points_mm.size()));
  context.report("triangles", static_cast<std::int64_t>(surface.mesh.triangles.size()));
  context.report("watertight", checked.watertight());
  context.report("manifold", checked.manifold());
  context.report("open_edges", static_cast<std::int64_t>(checked.open_edges));
  context.report("area_mm2", area_mm2(surface.mesh));
  if (checked.watertight()) context.report("enclosed_volume_mm3", enclosed_volume_mm3(surface.mesh));
  context.report("marching_cubes_distance_mean_voxels", d.mean);
  context.report("marching_cubes_distance_max_voxels", d.max);
  context.progress(1.0);
  return {std::make_shared<const TriMesh>(std::move(surface.mesh))};
}

}  // namespace osteo::inline app
