// Tetrahedra, curves and skins, and the order of all tables of 'osteo bench geometry'.
#include "bench_geometry.h"

#include <unistd.h>

#include <cmath>
#include <random>

#include "bench.h"
#include "bench_geometry_peers.h"
#include "osteo/geometry/cgal/mesh_cgal.h"
#include "osteo/geometry/distance/compare.h"
#include "osteo/geometry/tetgen/mesh_tetgen.h"
#include "osteo/geometry/tets/lattice_tets.h"
#include "osteo/geometry/tets/quality.h"
#include "osteo/geometry/tets/skin.h"

namespace osteo {
namespace bench {

void tet_tables(const Context& context) {
  Context one = context;
  one.threads = 1;
  const auto all = subjects();
  const std::map<std::string, std::array<double, 4>> published{{"bunny", {0.153, 1.98, 10.139, 18.287}},
                                                               {"gear", {0.101, 1.132, 5.789, 9.961}},
                                                               {"happy", {0.057, 0.562, 2.7, 4.74}},
                                                               {"dragon", {0.083, 0.772, 3.57, 6.042}}};
  // What memory allows: writing as many bytes, once.
  std::printf(
      "\n### Voxels to five tetrahedra each (the thesis' Table 2)\n\nSeconds on one thread, surface in to mesh out, "
      "conforming; writing "
      "the result's bytes once, for comparison.\n\n");
  std::printf(
      "| surface | resolution | tets | voxels | tets | together | 2 threads | fill of as many bytes | published 2006 | "
      "published / ours "
      "|\n|---|---|---|---|---|---|---|---|---|---|\n");
  for (const Subject& s : all) {
    for (std::size_t r = 0; r < 4; ++r) {
      const int resolution = std::array{30, 75, 135, 165}[r];
      const Frame f = frame_around(s.soup, resolution, 2);
      VoxelBits bits;
      TetMesh m;
      const double voxels = cpu([&] { bits = voxels_inside(s.soup, f, one).dilated(); }, 5);
      const double tets = cpu([&] { m = {}, m = grid_tets(bits, one); }, 7);
      Context two = context;
      two.threads = 2;
      const double both = wall([&] { m = {}, m = grid_tets(voxels_inside(s.soup, f, two).dilated(), two); }, 5);
      const std::size_t bytes = m.tets.size() * 16 + m.points_mm.size() * 12;
      const double fill = cpu(
          [&] {
            BigArray<std::uint64_t> a;
            a.resize(bytes / 8);
            std::fill(a.begin(), a.end(), 0x0102030405060708ULL);
            asm volatile("" : : "r"(a.data()) : "memory");
          },
          7);
      const auto known = published.find(s.name);
      std::printf(
          "| %s | %d | %zu | %.4f | %.4f | %.4f | %.4f | %.4f | %s | %s |\n", s.name.c_str(), resolution, m.tets.size(),
          voxels, tets, voxels + tets, both, fill,
          known == published.end() ? "" : format_number(known->second[r]).c_str(),
          known == published.end() ? "" : std::to_string(std::lround(known->second[r] / (voxels + tets))).c_str());
      std::fflush(stdout);
    }
  }
  std::printf(
      "\n### Tetrahedra of the four methods that follow the surface\n\nOne thread. Distances between boundary and "
      "surface in %% of the "
      "longest extent.\n\n");
  std::printf(
      "| surface | method | CPU s | tets | tets/s | dihedral min | max | aspect min | inverted | conforming | mean "
      "distance | max distance "
      "|\n|---|---|---|---|---|---|---|---|---|---|---|---|\n");
  for (const Subject& s : all) {
    const Frame f = frame_around(s.soup, 38, 0);
    const double h = f.spacing_mm.x;
    const auto row = [&](const char* name, const std::function<TetMesh()>& make) {
      TetMesh m;
      double seconds = 0;
      try {
        seconds = cpu([&] { m = make(); }, 3);
      } catch (const osteo::Error& e) {
        std::printf("| %s | %s | %s |||||||||| \n", s.name.c_str(), name, e.what());
        return;
      }
      const TetQuality q = tet_quality(m);
      const SurfaceComparison c = compare_surfaces(soup_of(boundary_of(m)), s.soup);
      const double extent = 38 * h;
      std::printf("| %s | %s | %.3f | %zu | %.3g | %.2f | %.2f | %.3f | %llu | %s | %.3f | %.3f |\n", s.name.c_str(),
                  name, seconds, m.tets.size(), static_cast<double>(m.tets.size()) / seconds, q.min_dihedral_deg,
                  q.max_dihedral_deg, q.min_aspect, static_cast<unsigned long long>(q.inverted),
                  q.conforming() ? "yes" : "no", 100 * std::max(c.a_to_b.mean_mm, c.b_to_a.mean_mm) / extent,
                  100 * c.hausdorff_mm() / extent);
      std::fflush(stdout);
    };
    row("grid-conforming, stencils only", [&] { return stuffed_tets(s.soup, {h, 0}, one); });
    row("grid-conforming, to 15 degrees", [&] { return stuffed_tets(s.soup, {h, 15}, one); });
    row("grid-conforming, to 20 degrees", [&] { return stuffed_tets(s.soup, {h, 20}, one); });
    row("graded", [&] { return graded_tets(s.soup, {h, 3}, one); });
    row("tetgen", [&] { return tets_by_tetgen(s.soup, {0, 1.414, 0}, one); });
    row("cgal, perturbed and exuded", [&] { return tets_by_cgal(s.soup, {1.5 * h, 0, 0, true}, one); });
  }
}

void curve_table() {
  std::printf(
      "\n### Nearest point of a curve\n\n20,000 positions along a curve that approaches itself, as a hand would move. "
      "Microseconds a "
      "question; build in seconds; off track: not on the stretch that the exact penalised minimum is on.\n\n");
  std::printf(
      "| points | ours mean | p99.9 | build | ours, penalty, mean | p99.9 | thesis on nanoflann (N = 100), penalty, "
      "mean | p99.9 | its off "
      "track | ratio of means |\n|---|---|---|---|---|---|---|---|---|---|\n");
  for (const int n : {2000, 20000, 200000, 2000000}) {
    std::vector<Vec3> points;
    for (int i = 0; i < n; ++i) {
      const double t = 40.0 * i / n;
      points.push_back(
          {20 * std::cos(t) * (1 + 0.02 * std::sin(9 * t)), 20 * std::sin(t) * (1 + 0.02 * std::sin(7 * t)), 0.1 * t});
    }
    std::mt19937 random(5);
    std::normal_distribution<double> noise(0, 1);
    std::vector<Vec3> path;
    Vec3 stray;
    for (int i = 0; i < 20000; ++i) {
      stray = stray * 0.995 + Vec3{noise(random), noise(random), noise(random)} * 0.04;
      path.push_back(points[static_cast<std::size_t>(static_cast<double>(i) / 20000 * n)] + stray);
    }
    const double build = cpu([&] { Curve c(points); }, 3);
    const Curve curve(points);
    const NearestNeighbours peer(points);
    const auto run = [&](auto&& ask) {
      std::vector<double> us;
      double sum = 0;
      for (const Vec3 p : path) {
        const auto begin = std::chrono::steady_clock::now();
        ask(p);
        us.push_back(std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - begin).count());
        sum += us.back();
      }
      std::sort(us.begin(), us.end());
      return std::pair{sum / static_cast<double>(us.size()), us[us.size() * 999 / 1000]};
    };
    std::uint32_t hint = 0;
    const auto plain = run([&](Vec3 p) { hint = curve.nearest(p, hint).segment; });
    double arc = 0;
    hint = 0;
    std::vector<double> arcs;
    const auto held = run([&](Vec3 p) {
      const CurvePoint c = curve.nearest_from(p, arc, 0.5, hint);
      arc = c.arc_mm, hint = c.segment;
      arcs.push_back(arc);
    });
    arc = 0;
    std::size_t at = 0;
    int off = 0;
    const auto theirs = run([&](Vec3 p) {
      const CurvePoint c = peer.find(p, arc, 0.5, 100);
      arc = c.arc_mm;
      if (std::abs(arc - arcs[at++]) > 30) ++off;
    });
    std::printf("| %d | %.2f | %.2f | %.4f | %.2f | %.2f | %.1f | %.1f | %d of 20000 | %.0f |\n", n, plain.first,
                plain.second, build, held.first, held.second, theirs.first, theirs.second, off,
                theirs.first / held.first);
    std::fflush(stdout);
  }
}

void skin_table(const Context& context) {
  const auto all = subjects();
  const Subject& s = all[0];
  std::printf(
      "\n### Skinning: %s (%zu points) on grid tetrahedra\n\nError of the moved points against the true map, in cubes; "
      "one thread.\n\n",
      s.name.c_str(), s.soup.points_mm.size());
  std::printf(
      "| resolution | tets | method | bind ms | move ms | stretch rms | max | shear rms | bend 60 degrees rms | max | "
      "rotation rms | max "
      "|\n|---|---|---|---|---|---|---|---|---|---|---|---|\n");
  const TriMesh surface = mesh_of(s.soup);
  Context one = context;
  one.threads = 1;
  for (const int resolution : {20, 30, 75}) {
    const Frame f = frame_around(s.soup, resolution, 2);
    const TetMesh rest = grid_tets(voxels_inside(s.soup, f).dilated());
    const double h = f.spacing_mm.x;
    const Vec3 centre = f.centre_mm();
    const double height = resolution * h;
    const auto stretch = [&](Vec3 p) { return Vec3{centre.x + 1.3 * (p.x - centre.x), p.y, p.z}; };
    const auto shear = [&](Vec3 p) { return Vec3{p.x + 0.3 * (p.y - centre.y), p.y, p.z}; };
    const auto rotate = [&](Vec3 p) {
      const double c = std::cos(0.6), n = std::sin(0.6);
      const Vec3 q = p - centre;
      return centre + Vec3{c * q.x - n * q.y, n * q.x + c * q.y, q.z};
    };
    const auto bend = [&](Vec3 p) {  // the height becomes an arc of 60 degrees
      const double angle = (p.y - centre.y) / height * std::numbers::pi / 3,
                   radius = height / (std::numbers::pi / 3) + (p.x - centre.x);
      return Vec3{centre.x + radius * std::cos(angle) - height / (std::numbers::pi / 3),
                  centre.y + radius * std::sin(angle), p.z};
    };
    for (const SkinMethod method : {SkinMethod::embedded, SkinMethod::frames}) {
      const double bind = cpu([&] { Skin skin(surface, rest, {method, 5}, one); }, 3);
      const Skin skin(surface, rest, {method, 5}, one);
      std::vector<std::array<float, 3>> moved(rest.points_mm.size()), out(skin.point_count());
      double move = 0;
      const auto errors = [&](auto&& map) {
        for (std::size_t i = 0; i < moved.size(); ++i) {
          const Vec3 q = map(Vec3{rest.points_mm[i][0], rest.points_mm[i][1], rest.points_mm[i][2]});
          moved[i] = {static_cast<float>(q.x), static_cast<float>(q.y), static_cast<float>(q.z)};
        }
        move = cpu([&] { skin.apply(moved, out); }, 9);
        double sum = 0, worst = 0;
        for (std::size_t i = 0; i < out.size(); ++i) {
          const auto& p = surface.points_mm[i];
          const double d = length(map(Vec3{p[0], p[1], p[2]}) - Vec3{out[i][0], out[i][1], out[i][2]}) / h;
          sum += d * d;
          worst = std::max(worst, d);
        }
        return std::pair{std::sqrt(sum / static_cast<double>(out.size())), worst};
      };
      const auto a = errors(stretch), b = errors(shear), c = errors(bend), r = errors(rotate);
      std::printf("| %d | %zu | %s | %.1f | %.3f | %.2g | %.2g | %.2g | %.2g | %.2g | %.2g | %.2g |\n", resolution,
                  rest.tets.size(), method == SkinMethod::embedded ? "embedded" : "frames (thesis)", bind * 1e3,
                  move * 1e3, a.first, a.second, b.first, c.first, c.second, r.first, r.second);
      std::fflush(stdout);
    }
  }
}

}  // namespace bench

void bench_geometry(const Context& context) {
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("osteo-bench-" + std::to_string(::getpid()));
  std::filesystem::create_directories(folder);
  std::printf("## Geometry\n\n");
  bench::curve_table();
  bench::live_table();
  bench::tet_tables(context);
  bench::skin_table(context);
  bench::mask_table(context, folder);
  std::printf("\n");
  bench::distance_tables(context, folder);
  std::filesystem::remove_all(folder);
}

}  // namespace osteo
