// Speed against error of the approximate methods, beside their peers in the same run. Prints Markdown for docs/accuracy.md.
// usage: osteo_bench [threads]
#include <openvdb/openvdb.h>
#include <openvdb/tools/Dense.h>
#include <openvdb/tools/VolumeToMesh.h>
#include <vtkFlyingEdges3D.h>
#include <vtkImageData.h>
#include <vtkImageReslice.h>
#include <vtkMarchingCubes.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <functional>
#include <random>

#include "ball.h"
#include "bench.h"
#include "osteo/bone/live_surface.h"
#include "osteo/grid/resample.h"
#include "osteo/image/phantom.h"
#include "osteo/image/threshold.h"
#include "osteo/io/vtk_data.h"

namespace osteo {
namespace {

double seconds(const std::function<void()>& f, int repeats = 3) {
  double best = 1e30;
  for (int r = 0; r < repeats; ++r) {
    const auto begin = std::chrono::steady_clock::now();
    f();
    best = std::min(best, std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
  }
  return best;
}

constexpr double kRadius = 20.3;

struct Off {
  double mean = 0, p99 = 0;
};
Off off_the_ball(const std::vector<Vec3>& points) {
  std::vector<double> d;
  for (const Vec3& p : points) d.push_back(std::abs(length(p) - kRadius));
  std::sort(d.begin(), d.end());
  Off o;
  for (const double x : d) o.mean += x / static_cast<double>(d.size());
  if (!d.empty()) o.p99 = d[d.size() * 99 / 100];
  return o;
}
std::vector<Vec3> points_of(const TriMesh& m) {
  std::vector<Vec3> p;
  for (const auto& x : m.points_mm) p.push_back({x[0], x[1], x[2]});
  return p;
}
std::vector<Vec3> points_of(vtkPolyData* m) {
  std::vector<Vec3> p;
  for (vtkIdType i = 0; i < m->GetNumberOfPoints(); ++i) {
    double x[3];
    m->GetPoint(i, x);
    p.push_back({x[0], x[1], x[2]});
  }
  return p;
}

void bench_resample(const Context& context) {
  std::printf(
      "## Resampling: a ball of radius 20.3 mm, threshold half-way\n\n| CT voxels mm | method | voxels mm | ms | volume error %% | "
      "boundary off, mean mm | p99 mm |\n|---|---|---|---|---|---|---|\n");
  const double exact = 4.0 / 3 * M_PI * std::pow(kRadius, 3);
  for (const double z : {1.0, 2.0}) {
    const Image ct = test::ball(z, kRadius);
    ThresholdParams t;
    t.lower = 500;
    const Labels mask = threshold(ct, t);
    for (const double h : {0.25, 0.5, 1.0}) {
      ResampleParams r;
      r.lower = 500;
      r.spacing_mm = h;
      ResampledBone bone;
      const double s = seconds([&] { bone = resample_bone(ct, mask, r, context); });
      const Off o = off_the_ball(points_of(surface_nets(to_bricks(bone.density), 0.5F, context).mesh));
      std::printf("| 1x1x%g | osteo resample | %g | %.1f | %+.3f | %.4f | %.4f |\n", z, h, 1000 * s,
                  100 * (bone.volume_after_mm3 / exact - 1), o.mean, o.p99);
      // Peer: what thresholding first and resampling the mask gives (VTK's cubic reslice of the mask).
      vtkSmartPointer<vtkPolyData> surface;
      double volume = 0;
      const double ps = seconds([&] {
        vtkNew<vtkImageReslice> reslice;
        reslice->SetInputData(to_vtk(mask));
        reslice->SetInterpolationModeToCubic();
        reslice->SetOutputScalarType(VTK_FLOAT);
        reslice->SetOutputSpacing(h, h, h);
        reslice->Update();
        auto* const p = static_cast<const float*>(reslice->GetOutput()->GetScalarPointer());
        volume = 0;
        for (vtkIdType i = 0; i < reslice->GetOutput()->GetNumberOfPoints(); ++i) volume += p[i] >= 0.5F ? h * h * h : 0;
        vtkNew<vtkFlyingEdges3D> edges;
        edges->SetInputData(reslice->GetOutput());
        edges->SetValue(0, 0.5);
        edges->Update();
        surface = edges->GetOutput();
      });
      const Off po = off_the_ball(points_of(surface));
      std::printf("| 1x1x%g | mask, VTK cubic reslice | %g | %.1f | %+.3f | %.4f | %.4f |\n", z, h, 1000 * ps, 100 * (volume / exact - 1),
                  po.mean, po.p99);
    }
  }
}

void bench_surface(const Context& context) {
  const Image ct = test::ball(1, kRadius);
  ThresholdParams t;
  t.lower = 500;
  ResampleParams r;
  r.lower = 500;
  const BrickGrid small = to_bricks(resample_bone(ct, threshold(ct, t), r, context).density);
  PhantomParams pp;
  const Phantom phantom = make_phantom(pp, context);
  const SparseGrid sparse = resample_bone(phantom.ct, threshold(phantom.ct, t), r, context).density;
  const BrickGrid head = to_bricks(sparse);

  const auto dense_of = [](const BrickGrid& g) {
    auto image = vtkSmartPointer<vtkImageData>::New();
    image->SetDimensions(g.frame().dims[0], g.frame().dims[1], g.frame().dims[2]);
    image->SetOrigin(g.frame().origin_mm.x, g.frame().origin_mm.y, g.frame().origin_mm.z);
    image->SetSpacing(g.frame().spacing_mm.x, g.frame().spacing_mm.x, g.frame().spacing_mm.x);
    image->AllocateScalars(VTK_FLOAT, 1);
    g.read_block({0, 0, 0}, g.frame().dims, static_cast<float*>(image->GetScalarPointer()));
    return image;
  };
  const auto vdb_of = [](const BrickGrid& g) {
    auto grid = openvdb::FloatGrid::create(0.0F);
    for (VoxelKey v = 0; v < g.brick_count() * BrickGrid::kVoxels; ++v) {
      if (g.value(v) <= 0) continue;
      const Ijk c = g.coordinate(v);
      grid->tree().setValueOn(openvdb::Coord(c.i, c.j, c.k), g.value(v));
    }
    return grid;
  };
  std::printf("\n## Surface: a head at 0.5 mm (%zu bricks) for speed, the ball at 0.5 mm for error\n\n", head.brick_count());
  std::printf("| method | head s | triangles M | head closed, manifold | ball off, mean mm | p99 mm |\n|---|---|---|---|---|---|\n");
  const auto row = [&](const char* name, double s, std::size_t triangles, const char* closed, Off o) {
    std::printf("| %s | %.2f | %.2f | %s | %.4f | %.4f |\n", name, s, static_cast<double>(triangles) / 1e6, closed, o.mean, o.p99);
    std::fflush(stdout);
  };
  const auto closed = [](const TriMesh& m) {
    const MeshCheck c = check(m);
    static std::string text;
    text = std::string(c.watertight() ? "yes" : "no") + ", " +
           (c.manifold() ? "yes" : "no (" + std::to_string(c.nonmanifold_edges) + " edges)");
    return text.c_str();
  };
  BoneSurface nets;
  Context one = context;
  one.threads = 1;
  double s = seconds([&] { nets = surface_nets(head, 0.5F, one); });
  row("surface nets, 1 thread", s, nets.mesh.triangles.size(), closed(nets.mesh), off_the_ball(points_of(surface_nets(small).mesh)));
  const double rebuild = s = seconds([&] { nets = surface_nets(head, 0.5F, context); });
  row("surface nets", s, nets.mesh.triangles.size(), closed(nets.mesh), off_the_ball(points_of(surface_nets(small).mesh)));
  BoneSurface voxels;
  s = seconds([&] { voxels = voxel_surface(head, 0.5F, context); });
  row("voxel triangulation (thesis)", s, voxels.mesh.triangles.size(), closed(voxels.mesh),
      off_the_ball(points_of(voxel_surface(small).mesh)));
  const auto dense_head = dense_of(head), dense_small = dense_of(small);
  const auto vtk_row = [&](const char* name, auto filter) {
    vtkSmartPointer<vtkPolyData> out;
    const double time = seconds([&] {
      filter->SetInputData(dense_head);
      filter->SetValue(0, 0.5);
      filter->ComputeNormalsOn();
      filter->Modified();
      filter->Update();
      out = vtkSmartPointer<vtkPolyData>::New();
      out->ShallowCopy(filter->GetOutput());
    });
    const TriMesh mesh = mesh_from_vtk(out);
    filter->SetInputData(dense_small);
    filter->Update();
    row(name, time, mesh.triangles.size(), closed(mesh), off_the_ball(points_of(filter->GetOutput())));
  };
  vtk_row("VTK flying edges, dense", vtkSmartPointer<vtkFlyingEdges3D>::New());
  vtk_row("VTK marching cubes, dense", vtkSmartPointer<vtkMarchingCubes>::New());
  {
    const auto vh = vdb_of(head), vs = vdb_of(small);
    std::vector<openvdb::Vec3s> points;
    std::vector<openvdb::Vec3I> tris;
    std::vector<openvdb::Vec4I> quads;
    const double time = seconds([&] { openvdb::tools::volumeToMesh(*vh, points, tris, quads, 0.5); });
    TriMesh mesh;
    for (const auto& p : points) mesh.points_mm.push_back({p.x(), p.y(), p.z()});
    for (const auto& q : quads) {
      mesh.triangles.push_back({q[0], q[1], q[2]});
      mesh.triangles.push_back({q[0], q[2], q[3]});
    }
    openvdb::tools::volumeToMesh(*vs, points, tris, quads, 0.5);
    std::vector<Vec3> world;
    for (const auto& p : points) world.push_back(small.frame().world_from_index({p.x(), p.y(), p.z()}));
    row("OpenVDB volumeToMesh", time, mesh.triangles.size(), closed(mesh), off_the_ball(world));
  }
  // Local: 300 voxels in a ball of 2 mm change, as a 4 mm burr does in a picture's time.
  BrickGrid edited = head;
  LiveSurface live(edited, context);
  std::mt19937 random(1);
  std::vector<double> times;
  std::uniform_int_distribution<std::size_t> pick(0, nets.voxels.size() - 1);
  for (int n = 0; n < 400; ++n) {
    const Ijk c = edited.coordinate(nets.voxels[pick(random)]);
    const auto begin = std::chrono::steady_clock::now();
    for (int k = -4; k <= 4; ++k)
      for (int j = -4; j <= 4; ++j)
        for (int i = -4; i <= 4; ++i) {
          if (i * i + j * j + k * k > 16) continue;
          const VoxelKey v = edited.find(c.i + i, c.j + j, c.k + k);
          if (v == BrickGrid::kNone) continue;
          edited.set(v, edited.value(v) * 0.7F);
          live.mark(v);
        }
    live.update();
    times.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
  }
  std::sort(times.begin(), times.end());
  std::printf(
      "\nA 4 mm burr's worth of changed voxels to new triangles, one thread: p50 %.2f ms, p99 %.2f ms (a rebuild of all: %.0f ms).\n",
      1000 * times[200], 1000 * times[395], 1000 * rebuild);
}

}  // namespace

void bench_bone(const Context& context) {
  openvdb::initialize();
  bench_resample(context);
  bench_surface(context);
}

}  // namespace osteo
