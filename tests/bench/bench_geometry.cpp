// Distance maps, voxels, tetrahedra, curves, masks, skins: speed against error beside the peers in the same run.
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <random>
#include <sstream>

#include "bench.h"
#include "bench_geometry_peers.h"
#include "meshes.h"
#include "osteo/cgal/mesh_cgal.h"
#include "osteo/distance/compare.h"
#include "osteo/distance/live_distance.h"
#include "osteo/distance/stages.h"
#include "osteo/distance/swept_distance.h"
#include "osteo/distance/thesis_distance.h"
#include "osteo/image/distance.h"
#include "osteo/mesh/bone_surface.h"
#include "osteo/tetgen/mesh_tetgen.h"
#include "osteo/tets/graded_tets.h"
#include "osteo/tets/grid_tets.h"
#include "osteo/tets/quality.h"
#include "osteo/tets/skin.h"
#include "osteo/tets/stuffing.h"

namespace osteo {
namespace {

namespace fs = std::filesystem;

double cpu_seconds() {
  timespec t;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}
double wall_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

// The least of a few runs; long ones run once.
template <class F>
double cpu(F&& f, int repeats = 3) {
  double best = 1e30;
  for (int r = 0; r < repeats; ++r) {
    const double begin = cpu_seconds();
    f();
    best = std::min(best, cpu_seconds() - begin);
    if (best > 0.5) break;
  }
  return best;
}
template <class F>
double wall(F&& f, int repeats = 3) {
  double best = 1e30;
  for (int r = 0; r < repeats; ++r) {
    const double begin = wall_seconds();
    f();
    best = std::min(best, wall_seconds() - begin);
    if (best > 1) break;
  }
  return best;
}

struct Subject {
  std::string name;
  TriangleSoup soup;
};
std::vector<Subject> subjects() {
  std::vector<Subject> all;
  const fs::path folder = fs::path(OSTEO_SHARED_DATA) / "meshes";
  for (const auto& [name, file] : {std::pair{"bunny", "bunny_capped_69664_morris.obj"}, std::pair{"gear", "gear_tetgen_542.obj"},
                                   std::pair{"happy", "happy_vrip_res4_15536.ply"}, std::pair{"dragon", "dragon_vrip_res3_47794.ply"}}) {
    if (fs::exists(folder / file)) all.push_back({name, soup_of(*load_surface(folder / file))});
  }
  if (all.empty()) {
    std::printf("(The thesis' meshes are not at hand: a sphere and two boxes stand in.)\n\n");
    all.push_back({"sphere", test::sphere(10, 6)});
    all.push_back({"boxes", test::joined(test::box({0, 0, 0}, {5, 10, 10}), test::box({5, 5, 2}, {10, 12, 8}))});
  }
  return all;
}

std::vector<Vec3> points_of(const VoxelBits& bits) {
  std::vector<Vec3> points;
  const auto& n = bits.frame.dims;
  for (int k = 0; k < n[2]; ++k) {
    for (int j = 0; j < n[1]; ++j) {
      for (int i = 0; i < n[0]; ++i) {
        if (bits.at(i, j, k)) points.push_back(bits.frame.world_from_index({double(i), double(j), double(k)}));
      }
    }
  }
  return points;
}
// The map's distances in the same order.
std::vector<double> values_of(const DistanceMap& map, const VoxelBits& bits) {
  std::vector<double> values;
  const auto& n = bits.frame.dims;
  for (int k = 0; k < n[2]; ++k) {
    for (int j = 0; j < n[1]; ++j) {
      for (int i = 0; i < n[0]; ++i) {
        if (bits.at(i, j, k)) values.push_back(map.distance_mm[static_cast<std::size_t>(map.find(i, j, k))]);
      }
    }
  }
  return values;
}

struct Error {
  double max = 0, rms = 0, wrong = 0;  // voxels; share off by more than 1e-3 voxel
};
Error error_of(const std::vector<double>& d, const std::vector<double>& truth, double voxel) {
  Error e;
  std::size_t n = 0;
  for (std::size_t i = 0; i < d.size(); ++i) {
    if (std::isnan(d[i])) continue;
    const double off = std::abs(std::abs(d[i]) - truth[i]) / voxel;
    e.max = std::max(e.max, off);
    e.rms += off * off;
    e.wrong += off > 1e-3 ? 1 : 0;
    ++n;
  }
  if (n > 0) e.rms = std::sqrt(e.rms / static_cast<double>(n)), e.wrong /= static_cast<double>(n);
  return e;
}

template <class T>
void write_raw(const fs::path& path, const std::vector<T>& values) {
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(values.data()), static_cast<std::streamsize>(values.size() * sizeof(T)));
}

struct Line {
  std::string name;
  double seconds;
  std::string file;
};
// Peers from PyPI, where build/peers has them.
std::vector<Line> python_peers(const fs::path& folder, const char* what) {
  std::vector<Line> lines;
  std::error_code ec;
  const fs::path bin = fs::read_symlink("/proc/self/exe", ec).parent_path();
  const fs::path python = bin.parent_path().parent_path() / "peers" / "bin" / "python3";
  if (!fs::exists(python)) return lines;
  const std::string command = python.string() + " " OSTEO_BENCH_FOLDER "/peers.py " + folder.string() + " " + what + " 2>/dev/null";
  FILE* const pipe = ::popen(command.c_str(), "r");
  char buffer[1024];
  while (pipe != nullptr && std::fgets(buffer, sizeof buffer, pipe) != nullptr) {
    std::istringstream in(buffer);
    Line l;
    std::string seconds;
    if (std::getline(in, l.name, '|') && std::getline(in, seconds, '|') && std::getline(in, l.file)) {
      l.seconds = std::stod(seconds);
      lines.push_back(l);
    }
  }
  if (pipe != nullptr) ::pclose(pipe);
  return lines;
}

void distance_tables(const Context& context, const fs::path& folder) {
  Context one = context;
  one.threads = 1;
  std::printf(
      "### Distance maps of the inside\n\nVoxels inside and their six neighbours (the thesis' set, section 6.3.4), isotropic, the longest "
      "extent divided by "
      "the resolution. CPU seconds on one thread, surface in to map out; ours with tree, voxels and sign included, the peers' with the "
      "list of points given "
      "and, but for VTK's, without sign. Instruction set: %s.\n\n",
      std::string(simd_name()).c_str());
  std::printf(
      "| surface | resolution | voxels | ours | ours, 2 threads (wall) | thesis as printed | thesis corrected | breadth first | Embree + "
      "hint | CGAL AABB | thesis corrected / ours | Embree / ours | CGAL / ours | published 2006 |\n");
  std::printf("|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n");
  const std::map<std::string, std::array<double, 4>> published{{"bunny", {0.736, 6.107, 29.033, 82.341}},
                                                               {"gear", {0.144, 1.751, 9.228, 27.137}},
                                                               {"happy", {0.13495, 1.387, 6.132, 16.956}},
                                                               {"dragon", {0.494, 3.158, 11.839, 30.13}}};
  const auto all = subjects();
  for (const Subject& s : all) {
    for (std::size_t r = 0; r < 4; ++r) {
      const int resolution = std::array{30, 75, 135, 195}[r];
      const Frame f = frame_around(s.soup, resolution, 2);
      VoxelBits bits;
      const double ours = cpu(
          [&] {
            const DistanceMapper m(s.soup, f, one);
            bits = m.inside().dilated();
            (void)m.map_of(bits, std::numeric_limits<double>::infinity(), one);
          },
          5);
      Context two = context;
      two.threads = 2;
      const double ours2 = wall(
          [&] {
            const DistanceMapper m(s.soup, f, two);
            (void)m.map_of(m.inside().dilated(), std::numeric_limits<double>::infinity(), two);
          },
          5);
      const std::vector<Vec3> points = points_of(bits);
      const auto thesis = [&](bool breadth, bool printed) {
        return cpu([&] { (void)ThesisDistance(s.soup).distances_mm(points, {0, breadth, printed}); }, 1);
      };
      const double printed = thesis(false, true), corrected = thesis(false, false), breadth = thesis(true, false);
      const double embree = cpu([&] { (void)bench::by_embree(s.soup, points); }, 1);
      const double cgal = cpu([&] { (void)bench::by_cgal(s.soup, points); }, 1);
      const auto known = published.find(s.name);
      std::printf("| %s | %d | %zu | %.4f | %.4f | %.3f | %.3f | %.3f | %.3f | %.3f | %.0f | %.0f | %.0f | %s |\n", s.name.c_str(),
                  resolution, points.size(), ours, ours2, printed, corrected, breadth, embree, cgal, corrected / ours, embree / ours,
                  cgal / ours, known == published.end() ? "" : format_number(known->second[r]).c_str());
      std::fflush(stdout);
    }
  }
  // Errors and the slow peers, on the first surface.
  const Subject& s = all[0];
  const Frame f = frame_around(s.soup, 195, 2);
  const double h = f.spacing_mm.x;
  const DistanceMapper mapper(s.soup, f, one);
  const VoxelBits bits = mapper.inside().dilated();
  const std::vector<Vec3> points = points_of(bits);
  const TriangleTree tree(s.soup);
  std::vector<double> truth;
  // The tree's own answers, themselves held against brute force in the tests, and here on a sample.
  double reference_off = 0;
  for (std::size_t i = 0; i < points.size(); ++i)
    truth.push_back(tree.closest(points[i], i > 0 ? static_cast<std::uint32_t>(i % 7) : 0).distance_mm);
  for (std::size_t i = 0; i < points.size(); i += points.size() / 500) {
    double d = 1e300;
    for (const auto& t : s.soup.triangles) {
      d = std::min(d, closest_on_triangle(points[i], s.soup.points_mm[t[0]], s.soup.points_mm[t[1]], s.soup.points_mm[t[2]]).distance_mm);
    }
    reference_off = std::max(reference_off, std::abs(d - truth[i]) / h);
  }
  std::printf(
      "\n### Time against error: %s at 195\n\nError in voxels against the nearest of all triangles in double precision (brute force on 500 "
      "points differs from the reference by at most %.1e).\n\n",
      s.name.c_str(), reference_off);
  std::printf("| method | CPU s | of ours | error max | rms | off by > 0.001 voxel | sign |\n|---|---|---|---|---|---|---|\n");
  double ours_s = 0;
  const auto row = [&](const std::string& name, double seconds, const std::vector<double>& d, const char* sign) {
    const Error e = error_of(d, truth, h);
    std::printf("| %s | %.3f | %.2f | %.1e | %.1e | %.2g %% | %s |\n", name.c_str(), seconds, seconds / ours_s, e.max, e.rms, 100 * e.wrong,
                sign);
    std::fflush(stdout);
  };
  DistanceMap map;
  ours_s = cpu(
      [&] {
        const DistanceMapper m(s.soup, f, one);
        map = m.map_of(m.inside().dilated(), std::numeric_limits<double>::infinity(), one);
      },
      5);
  const std::vector<double> ours_values = values_of(map, bits);
  row("ours, exact", ours_s, ours_values, "winding number");
  std::vector<double> d;
  for (const auto& [name, o] : {std::pair{"thesis, as printed", ThesisDistanceOptions{0, false, true}},
                                std::pair{"thesis, corrected, depth first", ThesisDistanceOptions{0, false, false}},
                                std::pair{"thesis, corrected, breadth first", ThesisDistanceOptions{0, true, false}}}) {
    const double t = cpu([&] { d = ThesisDistance(s.soup).distances_mm(points, o); }, 1);
    row(name, t, d, "none");
  }
  double t = cpu([&] { d = bench::by_embree(s.soup, points); }, 1);
  row("Embree 3 + last triangle as bound", t, d, "none");
  t = cpu([&] { d = bench::by_cgal(s.soup, points); }, 1);
  row("CGAL AABB_tree + last point as hint", t, d, "none");
  const std::size_t step = std::max<std::size_t>(1, points.size() / 20000);
  std::vector<Vec3> sample;
  for (std::size_t i = 0; i < points.size(); i += step) sample.push_back(points[i]);
  const auto spread = [&](const std::vector<double>& v) {
    std::vector<double> whole(points.size(), std::numeric_limits<double>::quiet_NaN());
    for (std::size_t i = 0; i < v.size(); ++i) whole[i * step] = v[i];
    return whole;
  };
  t = cpu([&] { d = bench::by_vtk_locator(s.soup, sample); }, 1) * static_cast<double>(points.size()) / static_cast<double>(sample.size());
  row("vtkStaticCellLocator (from 20,000 points)", t, spread(d), "none");
  t = cpu([&] { d = bench::by_vtk_implicit(s.soup, sample); }, 1) * static_cast<double>(points.size()) / static_cast<double>(sample.size());
  row("vtkImplicitPolyDataDistance (from 20,000 points)", t, spread(d), "normals");
  std::vector<float> dense;
  const auto from_dense = [&] {
    std::vector<double> v;
    for (int k = 0; k < f.dims[2]; ++k) {
      for (int j = 0; j < f.dims[1]; ++j) {
        for (int i = 0; i < f.dims[0]; ++i) {
          if (bits.at(i, j, k)) v.push_back(static_cast<double>(dense[(static_cast<std::size_t>(k) * f.dims[1] + j) * f.dims[0] + i]) * h);
        }
      }
    }
    return v;
  };
  t = cpu([&] { dense = bench::by_openvdb(s.soup, f, -1, 3); }, 1);
  row("OpenVDB meshToVolume, inside unbounded", t, from_dense(), "flood");
  std::vector<double> swept;
  t = cpu([&] { swept = swept_distance_mm(s.soup, f); }, 1);
  dense.assign(swept.begin(), swept.end());
  for (auto& v : dense) v = static_cast<float>(v / h);
  row("ours, swept (whole box)", t, from_dense(), "winding number");
  std::vector<std::uint8_t> mask(f.voxel_count());
  for (int k = 0, at = 0; k < f.dims[2]; ++k) {
    for (int j = 0; j < f.dims[1]; ++j) {
      for (int i = 0; i < f.dims[0]; ++i, ++at) mask[at] = mapper.inside().at(i, j, k) ? 0 : 1;
    }
  }
  std::vector<float> d2;
  t = cpu([&] { d2 = squared_distance_mm2(mask, f, 1, one); });
  dense.resize(d2.size());
  for (std::size_t i = 0; i < d2.size(); ++i) dense[i] = static_cast<float>(std::max(0.0, std::sqrt(d2[i]) / h - 0.5));
  row("Euclidean transform of the mask, less half a voxel", t, from_dense(), "mask");
  std::vector<double> xyz;
  for (const Vec3 p : s.soup.points_mm) xyz.insert(xyz.end(), {p.x, p.y, p.z});
  write_raw(folder / "v.f64", xyz);
  std::vector<std::uint32_t> ids;
  for (const auto& tr : s.soup.triangles) ids.insert(ids.end(), tr.begin(), tr.end());
  write_raw(folder / "f.u32", ids);
  xyz.clear();
  for (const Vec3 p : points) xyz.insert(xyz.end(), {p.x, p.y, p.z});
  write_raw(folder / "p.f64", xyz);
  for (const Line& l : python_peers(folder, "points")) {
    std::vector<double> v(fs::file_size(l.file) / 8);
    std::ifstream(l.file, std::ios::binary).read(reinterpret_cast<char*>(v.data()), static_cast<std::streamsize>(v.size() * 8));
    const std::size_t every = (points.size() + v.size() - 1) / v.size();
    std::vector<double> all_values(points.size(), std::numeric_limits<double>::quiet_NaN());
    for (std::size_t i = 0; i < v.size() && i * every < all_values.size(); ++i) all_values[i * every] = v[i];
    row(l.name, l.seconds, all_values, l.name.find("libigl") == 0 ? "normals" : l.name.find("Open3D") == 0 ? "parity" : "none");
  }

  std::printf(
      "\n### Whole box and narrow band (3 voxels inside, 2 outside) at 195\n\nCPU seconds, one thread. Wrong signs: against the winding "
      "number, of voxels in the band.\n\n");
  std::printf(
      "| surface | ours, box | swept, box | swept / ours | ours, band | OpenVDB, band | OpenVDB / ours | OpenVDB max error (voxels) | "
      "OpenVDB wrong signs | ours wrong signs |\n|---|---|---|---|---|---|---|---|---|---|\n");
  for (const Subject& each : all) {
    const Frame g = frame_around(each.soup, 195, 2);
    const double box = cpu([&] { (void)DistanceMapper(each.soup, g, one).map({}, one); });
    const double sweep = cpu([&] { (void)swept_distance_mm(each.soup, g); }, 1);
    DistanceMap band;
    const double hh = g.spacing_mm.x;
    const double ours_band = cpu([&] { band = DistanceMapper(each.soup, g, one).map({DistanceRegion::band, 3 * hh, 2 * hh}, one); }, 5);
    const double vdb = cpu([&] { dense = bench::by_openvdb(each.soup, g, 3, 2); });
    double worst = 0;
    std::uint64_t wrong = 0, own_wrong = 0, n = 0;
    const Ordered o = ordered(each.soup);
    const TriangleSoup& reference = is_closed(each.soup) ? each.soup : o.soup;
    for (std::size_t b = 0; b < band.bricks.size(); ++b) {
      for (int v = 0; v < 512; ++v) {
        const double x = band.distance_mm[b * 512 + v];
        if (std::isnan(x)) continue;
        const Ijk oo = band.bricks[b];
        const int i = oo.i * 8 + (v & 7), j = oo.j * 8 + (v >> 3 & 7), k = oo.k * 8 + (v >> 6);
        const double y = static_cast<double>(dense[(static_cast<std::size_t>(k) * g.dims[1] + j) * g.dims[0] + i]) * hh;
        if (!std::isnan(y)) worst = std::max(worst, std::abs(std::abs(x) - std::abs(y)) / hh);
        if (!std::isnan(y) && std::abs(x) > 1e-6 * hh && (x < 0) != (y < 0)) ++wrong;
        if (n++ % 997 == 0 && std::abs(x) > 1e-6 * hh) {
          const double w = std::abs(winding_number(reference, g.world_from_index({double(i), double(j), double(k)})));
          if (std::abs(w - 0.5) > 1e-6 && (x < 0) != (w > 0.5)) ++own_wrong;
        }
      }
    }
    std::printf("| %s | %.3f | %.2f | %.0f | %.4f | %.3f | %.1f | %.2g | %llu | %llu of %llu tried |\n", each.name.c_str(), box, sweep,
                sweep / box, ours_band, vdb, vdb / ours_band, worst, static_cast<unsigned long long>(wrong),
                static_cast<unsigned long long>(own_wrong), static_cast<unsigned long long>(n / 997));
    std::fflush(stdout);
  }

  std::printf(
      "\n### The thesis' spatial coherence (Figures 54 to 56): %s at 135\n\nCPU seconds of the distances alone.\n\n| TREE_ASCEND_N | depth "
      "first, as printed | depth first, corrected | breadth first, as printed | breadth first, corrected |\n|---|---|---|---|---|\n",
      all.size() > 2 ? all[2].name.c_str() : all[0].name.c_str());
  const Subject& happy = all.size() > 2 ? all[2] : all[0];
  const Frame hf = frame_around(happy.soup, 135, 2);
  const std::vector<Vec3> hp = points_of(voxels_inside(happy.soup, hf).dilated());
  const ThesisDistance thesis(happy.soup);
  for (const int ascend : {-1, 0, 1, 2, 4, 8}) {
    std::printf("| %d |", ascend);
    for (const bool breadth : {false, true}) {
      for (const bool printed : {true, false})
        std::printf(" %.3f |", cpu([&] { (void)thesis.distances_mm(hp, {ascend, breadth, printed}); }, 1));
    }
    std::printf("\n");
  }
}

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
      "\n### Voxels to five tetrahedra each (the thesis' Table 2)\n\nSeconds on one thread, surface in to mesh out, conforming; writing "
      "the result's bytes once, for comparison.\n\n");
  std::printf(
      "| surface | resolution | tets | voxels | tets | together | 2 threads | fill of as many bytes | published 2006 | published / ours "
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
      std::printf("| %s | %d | %zu | %.4f | %.4f | %.4f | %.4f | %.4f | %s | %s |\n", s.name.c_str(), resolution, m.tets.size(), voxels,
                  tets, voxels + tets, both, fill, known == published.end() ? "" : format_number(known->second[r]).c_str(),
                  known == published.end() ? "" : std::to_string(std::lround(known->second[r] / (voxels + tets))).c_str());
      std::fflush(stdout);
    }
  }
  std::printf(
      "\n### Tetrahedra of the four methods that follow the surface\n\nOne thread. Distances between boundary and surface in %% of the "
      "longest extent.\n\n");
  std::printf(
      "| surface | method | CPU s | tets | tets/s | dihedral min | max | aspect min | inverted | conforming | mean distance | max distance "
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
      std::printf("| %s | %s | %.3f | %zu | %.3g | %.2f | %.2f | %.3f | %llu | %s | %.3f | %.3f |\n", s.name.c_str(), name, seconds,
                  m.tets.size(), static_cast<double>(m.tets.size()) / seconds, q.min_dihedral_deg, q.max_dihedral_deg, q.min_aspect,
                  static_cast<unsigned long long>(q.inverted), q.conforming() ? "yes" : "no",
                  100 * std::max(c.a_to_b.mean_mm, c.b_to_a.mean_mm) / extent, 100 * c.hausdorff_mm() / extent);
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
      "\n### Nearest point of a curve\n\n20,000 positions along a curve that approaches itself, as a hand would move. Microseconds a "
      "question; build in seconds; off track: not on the stretch that the exact penalised minimum is on.\n\n");
  std::printf(
      "| points | ours mean | p99.9 | build | ours, penalty, mean | p99.9 | thesis on nanoflann (N = 100), penalty, mean | p99.9 | its off "
      "track | ratio of means |\n|---|---|---|---|---|---|---|---|---|---|\n");
  for (const int n : {2000, 20000, 200000, 2000000}) {
    std::vector<Vec3> points;
    for (int i = 0; i < n; ++i) {
      const double t = 40.0 * i / n;
      points.push_back({20 * std::cos(t) * (1 + 0.02 * std::sin(9 * t)), 20 * std::sin(t) * (1 + 0.02 * std::sin(7 * t)), 0.1 * t});
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
    const bench::NearestNeighbours peer(points);
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
    std::printf("| %d | %.2f | %.2f | %.4f | %.2f | %.2f | %.1f | %.1f | %d of 20000 | %.0f |\n", n, plain.first, plain.second, build,
                held.first, held.second, theirs.first, theirs.second, off, theirs.first / held.first);
    std::fflush(stdout);
  }
}

void mask_table(const Context& context, const fs::path& folder) {
  Frame f;
  f.dims = {512, 512, 300};
  f.spacing_mm = {0.5, 0.5, 0.8};
  std::vector<std::uint8_t> mask(f.voxel_count(), 0);
  std::mt19937 random(1);
  for (int b = 0; b < 60; ++b) {  // sixty balls
    const int cx = static_cast<int>(random() % 512), cy = static_cast<int>(random() % 512), cz = static_cast<int>(random() % 300),
              r = 10 + static_cast<int>(random() % 40);
    for (int k = std::max(0, cz - r); k < std::min(300, cz + r); ++k) {
      for (int j = std::max(0, cy - r); j < std::min(512, cy + r); ++j) {
        for (int i = std::max(0, cx - r); i < std::min(512, cx + r); ++i) {
          if ((i - cx) * (i - cx) + (j - cy) * (j - cy) + (k - cz) * (k - cz) < r * r)
            mask[(static_cast<std::size_t>(k) * 512 + j) * 512 + i] = 1;
        }
      }
    }
  }
  std::printf(
      "\n### Euclidean distance of a mask, 512 x 512 x 300, anisotropic\n\nWall seconds. Ours gives squared distances to the mask; the "
      "stage's sparse map of a 3 mm band holds both sides.\n\n| method | s |\n|---|---|\n");
  std::vector<float> d2;
  for (const int threads : {1, 2}) {
    Context c = context;
    c.threads = threads;
    std::printf("| ours, %d thread(s) | %.2f |\n", threads, wall([&] { d2 = squared_distance_mm2(mask, f, 1, c); }));
  }
  Labels labels;
  labels.frame = f;
  const auto voxels = make_voxels<std::uint8_t>(mask.size());
  std::copy(mask.begin(), mask.end(), voxels.get());
  labels.voxels = voxels;
  SparseGrid sparse;
  const std::uint8_t value = 1;
  std::printf("| ours, both sides to a sparse band, %d threads | %.2f |\n", 2,
              wall(
                  [&] {
                    sparse = mask_distance(labels, {&value, 1}, {DistanceRegion::band, 3, 3}, context);
                  },
                  1));
  write_raw(folder / "mask.u8", mask);
  write_raw(folder / "shape.f64", std::vector<double>{512, 512, 300, 0.5, 0.5, 0.8});
  for (const Line& l : python_peers(folder, "mask")) std::printf("| %s | %.2f |\n", l.name.c_str(), l.seconds);
  if (fs::exists(folder / "edt.f32")) {
    std::vector<float> theirs(mask.size());
    std::ifstream(folder / "edt.f32", std::ios::binary)
        .read(reinterpret_cast<char*>(theirs.data()), static_cast<std::streamsize>(theirs.size() * 4));
    double worst = 0;
    for (std::size_t i = 0; i < theirs.size(); ++i)
      worst = std::max(worst, std::abs(std::sqrt(static_cast<double>(d2[i])) - static_cast<double>(theirs[i])));
    std::printf("\nOurs and edt differ by at most %.1e mm. The sparse band takes %.0f MB, a dense float volume %.0f MB.\n", worst,
                static_cast<double>(sparse.memory_bytes) / 1e6, static_cast<double>(mask.size()) * 4 / 1e6);
  }
}

void skin_table(const Context& context) {
  const auto all = subjects();
  const Subject& s = all[0];
  std::printf(
      "\n### Skinning: %s (%zu points) on grid tetrahedra\n\nError of the moved points against the true map, in cubes; one thread.\n\n",
      s.name.c_str(), s.soup.points_mm.size());
  std::printf(
      "| resolution | tets | method | bind ms | move ms | stretch rms | max | shear rms | bend 60 degrees rms | max | rotation rms | max "
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
      const double angle = (p.y - centre.y) / height * std::numbers::pi / 3, radius = height / (std::numbers::pi / 3) + (p.x - centre.x);
      return Vec3{centre.x + radius * std::cos(angle) - height / (std::numbers::pi / 3), centre.y + radius * std::sin(angle), p.z};
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
      std::printf("| %d | %zu | %s | %.1f | %.3f | %.2g | %.2g | %.2g | %.2g | %.2g | %.2g | %.2g |\n", resolution, rest.tets.size(),
                  method == SkinMethod::embedded ? "embedded" : "frames (thesis)", bind * 1e3, move * 1e3, a.first, a.second, b.first,
                  c.first, c.second, r.first, r.second);
      std::fflush(stdout);
    }
  }
}

// A 3 mm burr eats into a bone of 0.5 mm voxels; the band of distances to its surface follows.
void live_table() {
  Frame f;
  f.dims = {160, 160, 160};
  f.spacing_mm = {0.5, 0.5, 0.5};
  std::vector<Ijk> bricks;
  for (int k = 0; k < 20; ++k)
    for (int j = 0; j < 20; ++j)
      for (int i = 0; i < 20; ++i) bricks.push_back({i, j, k});
  BrickGrid bone(f, bricks);
  const auto at = [&](int i, int j, int k) { return f.world_from_index({double(i), double(j), double(k)}); };
  const Vec3 centre{40, 40, 40};
  for (int k = 0; k < 160; ++k)
    for (int j = 0; j < 160; ++j)
      for (int i = 0; i < 160; ++i)
        bone.set(bone.find(i, j, k), static_cast<float>(std::clamp(0.5 + (30 - length(at(i, j, k) - centre)) / 0.5, 0.0, 1.0)));
  std::vector<SurfacePatch> patches(bone.brick_count());
  const auto triangles_of = [&](std::uint32_t b) {
    std::vector<std::array<Vec3, 3>> list;
    for (const auto& t : patches[b].triangles) {
      std::array<Vec3, 3> c;
      for (std::size_t i = 0; i < 3; ++i) {
        const auto& x = patches[b].vertices[t[i]].index;
        c[i] = f.world_from_index({x[0], x[1], x[2]});
      }
      list.push_back(c);
    }
    return list;
  };
  TriangleSoup soup;
  std::vector<std::vector<std::uint32_t>> ids(bone.brick_count());
  for (std::uint32_t b = 0; b < bone.brick_count(); ++b) {
    patches[b] = extract_patch(bone, b);
    for (const auto& t : triangles_of(b)) {
      ids[b].push_back(static_cast<std::uint32_t>(soup.triangles.size()));
      const auto n = static_cast<std::uint32_t>(soup.points_mm.size());
      soup.points_mm.insert(soup.points_mm.end(), t.begin(), t.end());
      soup.triangles.push_back({n, n + 1, n + 2});
    }
  }
  const InsideAt inside = [&](int i, int j, int k) { return bone.at(i, j, k) >= 0.5F; };
  for (const double reach : {1.5, 3.0}) {
    BrickGrid drilled(bone);
    const InsideAt inside_now = [&](int i, int j, int k) { return drilled.at(i, j, k) >= 0.5F; };
    auto own_ids = ids;
    auto own_patches = patches;
    std::unique_ptr<LiveDistance> live;
    const double whole = cpu([&] { live = std::make_unique<LiveDistance>(soup, f, reach, inside); }, 1);
    std::vector<double> ms;
    std::uint64_t touched = 0, removed_count = 0, added_count = 0;
    for (int step = 0; step < 120; ++step) {
      // 0.1 mm a step, along the surface and slowly in.
      const Vec3 tip = centre + normalized(Vec3{std::cos(step * 0.0033), std::sin(step * 0.0033), 0.1}) * (31.2 - step * 0.01);
      const auto low = [&](double x) { return std::max(0, static_cast<int>((x - 2) / 0.5)); };
      std::vector<std::uint8_t> dirty(bone.brick_count(), 0);
      for (int k = low(tip.z); k < low(tip.z) + 9; ++k)
        for (int j = low(tip.y); j < low(tip.y) + 9; ++j)
          for (int i = low(tip.x); i < low(tip.x) + 9; ++i) {
            const VoxelKey key = drilled.find(i, j, k);
            if (key == BrickGrid::kNone) continue;
            const auto left = static_cast<float>(std::clamp(0.5 + (length(at(i, j, k) - tip) - 1.5) / 0.5, 0.0, 1.0));
            if (left >= drilled.value(key)) continue;
            drilled.set(key, left);
            for (int c = 0; c < 8; ++c) {
              const std::uint32_t b = drilled.find_brick((i + ((c & 1) != 0 ? 2 : -2)) >> 3, (j + ((c & 2) != 0 ? 2 : -2)) >> 3,
                                                         (k + ((c & 4) != 0 ? 2 : -2)) >> 3);
              if (b != BrickGrid::kNone) dirty[b] = 1;
            }
          }
      std::vector<std::uint32_t> removed;
      std::vector<std::array<Vec3, 3>> added;
      std::vector<std::pair<std::uint32_t, std::size_t>> place;  // brick and slot of each added one
      for (std::uint32_t b = 0; b < dirty.size(); ++b) {
        if (dirty[b] == 0) continue;
        // Only triangles that changed: the others keep their numbers.
        const auto before = triangles_of(b);
        const auto old_ids = own_ids[b];
        patches[b] = extract_patch(drilled, b);
        const auto after = triangles_of(b);
        own_ids[b].assign(after.size(), 0);
        std::map<std::array<double, 9>, std::uint32_t> known;
        const auto key = [](const std::array<Vec3, 3>& t) {
          return std::array<double, 9>{t[0].x, t[0].y, t[0].z, t[1].x, t[1].y, t[1].z, t[2].x, t[2].y, t[2].z};
        };
        for (std::size_t i = 0; i < before.size(); ++i) known[key(before[i])] = old_ids[i];
        for (std::size_t i = 0; i < after.size(); ++i) {
          const auto it = known.find(key(after[i]));
          if (it != known.end()) {
            own_ids[b][i] = it->second;
            known.erase(it);
          } else {
            added.push_back(after[i]);
            place.emplace_back(b, i);
          }
        }
        for (const auto& [k, id] : known) removed.push_back(id);
      }
      const auto begin = std::chrono::steady_clock::now();
      const std::uint32_t first = live->update(removed, added, inside_now);
      ms.push_back(std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count());
      for (std::size_t i = 0; i < place.size(); ++i) own_ids[place[i].first][place[i].second] = first + static_cast<std::uint32_t>(i);
      touched += live->touched();
      removed_count += removed.size();
      added_count += added.size();
    }
    patches = own_patches;
    std::sort(ms.begin(), ms.end());
    if (reach == 1.5) {
      std::printf(
          "\n### The map follows the drill\n\nA ball of bone, 160^3 voxels of 0.5 mm; a 3 mm burr moves 0.1 mm a step. One thread.\n\n| "
          "band | whole map s | update median ms | p95 ms | max ms | voxels measured a step | triangles taken / added a step "
          "|\n|---|---|---|---|---|---|---|\n");
    }
    std::printf("| %.1f mm | %.2f | %.3f | %.3f | %.3f | %llu | %llu / %llu |\n", reach, whole, ms[ms.size() / 2], ms[ms.size() * 95 / 100],
                ms.back(), static_cast<unsigned long long>(touched / ms.size()), static_cast<unsigned long long>(removed_count / ms.size()),
                static_cast<unsigned long long>(added_count / ms.size()));
  }
}

}  // namespace

void bench_geometry(const Context& context) {
  const fs::path folder = fs::temp_directory_path() / ("osteo-bench-" + std::to_string(::getpid()));
  fs::create_directories(folder);
  std::printf("## Geometry\n\n");
  curve_table();
  live_table();
  tet_tables(context);
  skin_table(context);
  mask_table(context, folder);
  std::printf("\n");
  distance_tables(context, folder);
  fs::remove_all(folder);
}

}  // namespace osteo
