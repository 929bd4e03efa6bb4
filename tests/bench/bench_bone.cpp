// Speed against error of the approximate methods, beside their peers in the same run. Prints Markdown for
// docs/validation/accuracy.md. usage: osteo_bench [threads]
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
#include "osteo/geometry/grid/resample.h"
#include "osteo/imaging/image/phantom.h"
#include "osteo/imaging/image/threshold.h"
#include "osteo/imaging/io/vtk_data.h"
#include "osteo/simulation/bone/depth_map.h"
#include "osteo/simulation/bone/dust.h"
#include "osteo/simulation/bone/live_surface.h"
#include "osteo/simulation/bone/pieces.h"
#include "osteo/simulation/bone/saw.h"

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
      "## Resampling: a ball of radius 20.3 mm, threshold half-way\n\n| CT voxels mm | method | voxels mm | ms | "
      "volume error %% | "
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
        for (vtkIdType i = 0; i < reslice->GetOutput()->GetNumberOfPoints(); ++i)
          volume += p[i] >= 0.5F ? h * h * h : 0;
        vtkNew<vtkFlyingEdges3D> edges;
        edges->SetInputData(reslice->GetOutput());
        edges->SetValue(0, 0.5);
        edges->Update();
        surface = edges->GetOutput();
      });
      const Off po = off_the_ball(points_of(surface));
      std::printf("| 1x1x%g | mask, VTK cubic reslice | %g | %.1f | %+.3f | %.4f | %.4f |\n", z, h, 1000 * ps,
                  100 * (volume / exact - 1), po.mean, po.p99);
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
  std::printf("\n## Surface: a head at 0.5 mm (%zu bricks) for speed, the ball at 0.5 mm for error\n\n",
              head.brick_count());
  std::printf(
      "| method | head s | triangles M | head closed, manifold | ball off, mean mm | p99 mm "
      "|\n|---|---|---|---|---|---|\n");
  const auto row = [&](const char* name, double s, std::size_t triangles, const char* closed, Off o) {
    std::printf("| %s | %.2f | %.2f | %s | %.4f | %.4f |\n", name, s, static_cast<double>(triangles) / 1e6, closed,
                o.mean, o.p99);
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
  row("surface nets, 1 thread", s, nets.mesh.triangles.size(), closed(nets.mesh),
      off_the_ball(points_of(surface_nets(small).mesh)));
  const double rebuild = s = seconds([&] { nets = surface_nets(head, 0.5F, context); });
  row("surface nets", s, nets.mesh.triangles.size(), closed(nets.mesh),
      off_the_ball(points_of(surface_nets(small).mesh)));
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
  for (const bool shaded : {false, true}) {
    BrickGrid edited = head;
    LiveSurface live(edited, context);
    if (shaded) live.shade(context);
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
        "\nA 4 mm burr's worth of changed voxels to new triangles, one thread%s: p50 %.2f ms, p99 %.2f ms (a rebuild "
        "of all: %.0f ms).\n",
        shaded ? ", with normals to light by" : "", 1000 * times[200], 1000 * times[395], 1000 * rebuild);
  }
}

// Pieces: from the last connecting voxel's removal to the answer, beside a flood fill of everything.
void bench_pieces(const Context& context) {
  const Phantom phantom = make_phantom(PhantomParams{}, context);
  ThresholdParams t;
  t.lower = 500;
  ResampleParams r;
  r.spacing_mm = 0.5;
  const BrickGrid whole = to_bricks(resample_bone(phantom.ct, threshold(phantom.ct, t), r, context).density);
  const auto& n = whole.frame().dims;
  std::printf("## Pieces: phantom head at 0.5 mm, %zu bricks\n\n| what | ms | result |\n|---|---|---|\n",
              whole.brick_count());
  std::unique_ptr<LiveComponents> live;
  BrickGrid bone = whole;
  const double all = seconds([&] { live = std::make_unique<LiveComponents>(bone); }, 1);
  std::printf("| label everything | %.1f | %zu parts, %.1f MB |\n", 1000 * all, live->update().size(),
              static_cast<double>(live->memory_bytes()) / 1e6);
  // A burr of 6 mm nibbles along the bone: 27 bricks at most change.
  std::mt19937 random(4);
  std::vector<double> updates;
  for (int e = 0; e < 300; ++e) {
    VoxelKey centre = 0;
    do centre = static_cast<VoxelKey>(random() % (bone.brick_count() * BrickGrid::kVoxels));
    while (bone.value(centre) < 0.5F);
    const Ijk c = bone.coordinate(centre);
    for (int k = -6; k <= 6; ++k)
      for (int j = -6; j <= 6; ++j)
        for (int i = -6; i <= 6; ++i) {
          const VoxelKey v = bone.find(c.i + i, c.j + j, c.k + k);
          if (v == BrickGrid::kNone || i * i + j * j + k * k > 36) continue;
          bone.set(v, 0);
          live->mark(v);
        }
    updates.push_back(seconds([&] { static_cast<void>(live->update()); }, 1));
  }
  std::sort(updates.begin(), updates.end());
  std::printf("| after a bite of a 6 mm burr | %.2f (p50), %.2f (p99) | %zu parts |\n", 1000 * updates[150],
              1000 * updates[297], live->update().size());
  bone = BrickGrid(whole);
  std::vector<VoxelKey> changed;
  double removed = 0;
  const double saw = seconds(
      [&] {
        removed = apply_saw(bone, {whole.frame().centre_mm(), {0, 0.3, 1}, {1, 0, 0}, 1}, changed);
      },
      1);
  std::printf("| saw through the whole head | %.1f | %zu voxels, %.0f mm3 |\n", 1000 * saw, changed.size(), removed);
  live = std::make_unique<LiveComponents>(whole);
  LiveComponents cut(bone);
  for (const VoxelKey v : changed) cut.mark(v);
  const double relabel = seconds([&] { static_cast<void>(cut.update()); }, 1);
  std::printf("| the parts after it, from its voxels alone | %.1f | %zu parts |\n", 1000 * relabel,
              cut.update().size());
  Split split;
  const double apart = seconds([&] { split = split_bone(bone, 50); }, 1);
  std::printf("| pieces with bone of their own, from nothing | %.1f | %zu pieces, %llu crumbs |\n", 1000 * apart,
              split.pieces.size(), static_cast<unsigned long long>(split.crumbs));
  std::vector<std::uint8_t> mask(whole.frame().voxel_count());
  std::size_t at = 0;
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i) mask[at++] = bone.at(i, j, k) >= 0.5F ? 1 : 0;
  std::size_t parts = 0;
  const double flood = seconds([&] { parts = connected_components(mask, n, 1, Connectivity::face).voxels.size(); }, 1);
  std::printf("| flood fill of the dense volume (the thesis' way, by runs) | %.1f | %zu parts |\n", 1000 * flood,
              parts);

  std::printf(
      "\n## Thickness: spherical shells, radius 8 mm, voxels 0.4 mm\n\n| shell mm | mean error mm | worst mm | us "
      "|\n|---|---|---|---|\n");
  for (const double thick : {0.8, 1.5, 4.0}) {
    Frame f;
    f.dims = {72, 72, 72};
    f.spacing_mm = {0.4, 0.4, 0.4};
    f.origin_mm = {-14.2, -14.2, -14.2};
    BrickGrid g = BrickGrid::dense(f);
    for (VoxelKey v = 0; v < g.brick_count() * BrickGrid::kVoxels; ++v) {
      const Ijk c = g.coordinate(v);
      int in = 0;
      for (int s = 0; s < 64; ++s) {
        const double d = length(f.world_from_index(
            {c.i + ((s & 3) - 1.5) / 4, c.j + ((s >> 2 & 3) - 1.5) / 4, c.k + ((s >> 4) - 1.5) / 4}));
        in += d > 8 && d < 8 + thick ? 1 : 0;
      }
      g.set(v, static_cast<float>(in) / 64);
    }
    std::normal_distribution<double> u;
    double mean = 0, worst = 0, time = 0;
    for (int k = 0; k < 2000; ++k) {
      const Vec3 out = normalized({u(random), u(random), u(random)});
      double found = 0;
      time += seconds([&] { found = thickness_mm(g, out * (8.4 + thick), -out); }, 1);
      mean += std::abs(found - thick) / 2000;
      worst = std::max(worst, std::abs(found - thick));
    }
    std::printf("| %g | %.3f | %.3f | %.2f |\n", thick, mean, worst, time / 2000 * 1e6);
  }
  std::printf("\n");
}

// Dust falling into a bowl of 80 mm: what a cell that may move costs.
void bench_dust() {
  Frame f;
  f.dims = {192, 192, 192};
  f.spacing_mm = {0.5, 0.5, 0.5};
  BrickGrid bone = BrickGrid::dense(f);
  for (VoxelKey v = 0; v < bone.brick_count() * BrickGrid::kVoxels; ++v) {
    const Ijk c = bone.coordinate(v);
    bone.set(v, length(Vec3{c.i - 96.0, c.j - 80.0, c.k - 96.0}) > 84 ? 1.0F : 0.0F);
  }
  Dust dust(bone);
  std::mt19937 random(6);
  std::printf(
      "## Dust: cells of 0.5 mm in a bowl\n\n| cells that hold dust | awake cells (of awake bricks) | ms a step | ns "
      "an awake cell | made "
      "less all there is, mm3 "
      "|\n|---|---|---|---|---|\n");
  for (const int wanted : {20000, 100000, 400000, 1000000}) {
    std::size_t holding = 0;
    while (true) {
      for (int n = 0; n < wanted / 8; ++n)
        dust.add(bone.find(60 + static_cast<int>(random() % 72), 20 + static_cast<int>(random() % 60),
                           60 + static_cast<int>(random() % 72)),
                 0.02);
      for (int s = 0; s < 5; ++s) dust.step();
      holding = 0;
      dust.visit([&](Vec3, double) { ++holding; });
      if (holding >= static_cast<std::size_t>(wanted) || dust.totals().present_mm3 > 60000) break;
    }
    const std::size_t awake = dust.awake_bricks() * 512;
    const double s = seconds([&] { dust.step(); }, 3);
    const auto t = dust.totals();
    std::printf("| %zu | %zu | %.2f | %.1f | %.2g |\n", holding, awake, 1000 * s,
                1e9 * s / static_cast<double>(std::max<std::size_t>(awake, 1)),
                t.added_mm3 - (t.present_mm3 + t.slurry_mm3 + t.sucked_mm3 + t.fallen_mm3));
  }
  std::printf("\n");
}

}  // namespace

void bench_bone(const Context& context) {
  openvdb::initialize();
  bench_resample(context);
  bench_surface(context);
  bench_pieces(context);
  bench_dust();
}

}  // namespace osteo
