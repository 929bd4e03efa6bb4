// Distance maps, masks and the live map: speed against error beside the peers in the same run.
#include <cmath>
#include <random>

#include "bench_geometry.h"
#include "bench_geometry_peers.h"
#include "osteo/core/base/simd.h"
#include "osteo/geometry/distance/binary_distance.h"
#include "osteo/geometry/distance/detail/live_distance.h"
#include "osteo/geometry/distance/distance_methods.h"
#include "osteo/geometry/mesh/bone_surface.h"

namespace osteo::bench {
namespace {

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

void write_for_peers(const fs::path& folder, const TriangleSoup& soup, const std::vector<Vec3>& points) {
  std::vector<double> xyz;
  for (const Vec3 p : soup.points_mm) xyz.insert(xyz.end(), {p.x, p.y, p.z});
  write_raw(folder / "v.f64", xyz);
  std::vector<std::uint32_t> ids;
  for (const auto& t : soup.triangles) ids.insert(ids.end(), t.begin(), t.end());
  write_raw(folder / "f.u32", ids);
  xyz.clear();
  for (const Vec3 p : points) xyz.insert(xyz.end(), {p.x, p.y, p.z});
  write_raw(folder / "p.f64", xyz);
}

std::vector<double> read_values(const fs::path& file) {
  std::vector<double> v(fs::file_size(file) / 8);
  std::ifstream(file, std::ios::binary)
      .read(reinterpret_cast<char*>(v.data()), static_cast<std::streamsize>(v.size() * 8));
  return v;
}

// 200,000 points in the box around each surface and 5 % more, signed, in the order of their making: nobody sorted them.
void scattered_table(const std::vector<Subject>& all, const fs::path& folder, const Context& one) {
  std::printf(
      "\n### Scattered points, signed\n\n200,000 random points in the box of each surface and 5 %% more; CPU seconds "
      "on "
      "one thread with tree and all. Errors against the same question asked alone, in extents; wrong signs.\n\n| "
      "surface "
      "| method | CPU s | of ours | error max | wrong signs |\n|---|---|---|---|---|---|\n");
  for (const Subject& s : all) {
    Vec3 lo = s.soup.points_mm.front(), hi = lo;
    for (const auto& t : s.soup.triangles) {
      for (const auto c : t) {
        for (std::size_t a = 0; a < 3; ++a) {
          lo[a] = std::min(lo[a], s.soup.points_mm[c][a]);
          hi[a] = std::max(hi[a], s.soup.points_mm[c][a]);
        }
      }
    }
    const Vec3 size = hi - lo;
    const double extent = std::max({size.x, size.y, size.z});
    std::mt19937_64 random(5);
    std::uniform_real_distribution<double> u(-0.05, 1.05);
    std::vector<Vec3> points(200000);
    for (Vec3& p : points) p = lo + Vec3{u(random) * size.x, u(random) * size.y, u(random) * size.z};
    std::vector<SignedDistance::Answer> alone(points.size()), together;
    const double alone_s = cpu([&] {
      const SignedDistance d(s.soup, one);
      for (std::size_t i = 0; i < points.size(); ++i) alone[i] = d.at(points[i]);
    });
    const double together_s = cpu([&] { together = SignedDistance(s.soup, one).at(points, one); });
    const auto row = [&](const std::string& name, double seconds, const std::vector<double>& d) {
      double worst = 0;
      std::uint64_t wrong = 0;
      for (std::size_t i = 0; i < d.size(); ++i) {
        worst = std::max(worst, std::abs(std::abs(d[i]) - alone[i].closest.distance_mm));
        wrong += (d[i] < 0) != (alone[i].signed_mm < 0) ? 1 : 0;
      }
      std::printf("| %s | %s | %.3f | %.2f | %.1e | %llu |\n", s.name.c_str(), name.c_str(), seconds,
                  seconds / together_s, worst / extent, static_cast<unsigned long long>(wrong));
      std::fflush(stdout);
    };
    const auto values = [](const std::vector<SignedDistance::Answer>& answers) {
      std::vector<double> v;
      for (const auto& a : answers) v.push_back(a.signed_mm);
      return v;
    };
    row("ours, together", together_s, values(together));
    row("ours, one by one", alone_s, values(alone));
    write_for_peers(folder, s.soup, points);
    for (const Line& l : python_peers(folder, "scattered")) row(l.name, l.seconds, read_values(l.file));
  }
}

}  // namespace

void distance_tables(const Context& context, const fs::path& folder) {
  Context one = context;
  one.threads = 1;
  std::printf(
      "### Distance maps of the inside\n\nVoxels inside and their six neighbours (the thesis' set, section 6.3.4), "
      "isotropic, the longest "
      "extent divided by "
      "the resolution. CPU seconds on one thread, surface in to map out; ours with tree, voxels and sign included, the "
      "peers' with the "
      "list of points given "
      "and, but for VTK's, without sign. Instruction set: %s.\n\n",
      simd_name(simd()).data());
  std::printf(
      "| surface | resolution | voxels | ours | ours, 2 threads (wall) | thesis as printed | thesis corrected | "
      "breadth first | Embree + "
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
      const double embree = cpu([&] { (void)by_embree(s.soup, points); }, 1);
      const double cgal = cpu([&] { (void)by_cgal(s.soup, points); }, 1);
      const auto known = published.find(s.name);
      std::printf("| %s | %d | %zu | %.4f | %.4f | %.3f | %.3f | %.3f | %.3f | %.3f | %.0f | %.0f | %.0f | %s |\n",
                  s.name.c_str(), resolution, points.size(), ours, ours2, printed, corrected, breadth, embree, cgal,
                  corrected / ours, embree / ours, cgal / ours,
                  known == published.end() ? "" : format_number(known->second[r]).c_str());
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
      d = std::min(
          d, closest_on_triangle(points[i], s.soup.points_mm[t[0]], s.soup.points_mm[t[1]], s.soup.points_mm[t[2]])
                 .distance_mm);
    }
    reference_off = std::max(reference_off, std::abs(d - truth[i]) / h);
  }
  std::printf(
      "\n### Time against error: %s at 195\n\nError in voxels against the nearest of all triangles in double precision "
      "(brute force on 500 "
      "points differs from the reference by at most %.1e).\n\n",
      s.name.c_str(), reference_off);
  std::printf(
      "| method | CPU s | of ours | error max | rms | off by > 0.001 voxel | sign |\n|---|---|---|---|---|---|---|\n");
  double ours_s = 0;
  const auto row = [&](const std::string& name, double seconds, const std::vector<double>& d, const char* sign) {
    const Error e = error_of(d, truth, h);
    std::printf("| %s | %.3f | %.2f | %.1e | %.1e | %.2g %% | %s |\n", name.c_str(), seconds, seconds / ours_s, e.max,
                e.rms, 100 * e.wrong, sign);
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
  double t = cpu([&] { d = by_embree(s.soup, points); }, 1);
  row("Embree 3 + last triangle as bound", t, d, "none");
  t = cpu([&] { d = by_cgal(s.soup, points); }, 1);
  row("CGAL AABB_tree + last point as hint", t, d, "none");
  const std::size_t step = std::max<std::size_t>(1, points.size() / 20000);
  std::vector<Vec3> sample;
  for (std::size_t i = 0; i < points.size(); i += step) sample.push_back(points[i]);
  const auto spread = [&](const std::vector<double>& v) {
    std::vector<double> whole(points.size(), std::numeric_limits<double>::quiet_NaN());
    for (std::size_t i = 0; i < v.size(); ++i) whole[i * step] = v[i];
    return whole;
  };
  t = cpu([&] { d = by_vtk_locator(s.soup, sample); }, 1) * static_cast<double>(points.size()) /
      static_cast<double>(sample.size());
  row("vtkStaticCellLocator (from 20,000 points)", t, spread(d), "none");
  t = cpu([&] { d = by_vtk_implicit(s.soup, sample); }, 1) * static_cast<double>(points.size()) /
      static_cast<double>(sample.size());
  row("vtkImplicitPolyDataDistance (from 20,000 points)", t, spread(d), "normals");
  std::vector<float> dense;
  const auto from_dense = [&] {
    std::vector<double> v;
    for (int k = 0; k < f.dims[2]; ++k) {
      for (int j = 0; j < f.dims[1]; ++j) {
        for (int i = 0; i < f.dims[0]; ++i) {
          if (bits.at(i, j, k))
            v.push_back(static_cast<double>(dense[(static_cast<std::size_t>(k) * f.dims[1] + j) * f.dims[0] + i]) * h);
        }
      }
    }
    return v;
  };
  t = cpu([&] { dense = by_openvdb(s.soup, f, -1, 3); }, 1);
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
  write_for_peers(folder, s.soup, points);
  for (const Line& l : python_peers(folder, "points")) {
    const std::vector<double> v = read_values(l.file);
    const std::size_t every = (points.size() + v.size() - 1) / v.size();
    std::vector<double> all_values(points.size(), std::numeric_limits<double>::quiet_NaN());
    for (std::size_t i = 0; i < v.size() && i * every < all_values.size(); ++i) all_values[i * every] = v[i];
    row(l.name, l.seconds, all_values,
        l.name.find("libigl") == 0   ? "normals"
        : l.name.find("Open3D") == 0 ? "parity"
                                     : "none");
  }

  scattered_table(all, folder, one);

  std::printf(
      "\n### Whole box and narrow band (3 voxels inside, 2 outside) at 195\n\nCPU seconds, one thread. Wrong signs: "
      "against the winding "
      "number, of voxels in the band.\n\n");
  std::printf(
      "| surface | ours, box | swept, box | swept / ours | ours, band | OpenVDB, band | OpenVDB / ours | OpenVDB max "
      "error (voxels) | "
      "OpenVDB wrong signs | ours wrong signs |\n|---|---|---|---|---|---|---|---|---|---|\n");
  for (const Subject& each : all) {
    const Frame g = frame_around(each.soup, 195, 2);
    const double box = cpu([&] { (void)DistanceMapper(each.soup, g, one).map({}, one); });
    const double sweep = cpu([&] { (void)swept_distance_mm(each.soup, g); }, 1);
    DistanceMap band;
    const double hh = g.spacing_mm.x;
    const double ours_band = cpu(
        [&] {
          band = DistanceMapper(each.soup, g, one).map({DistanceRegion::band, 3 * hh, 2 * hh}, one);
        },
        5);
    const double vdb = cpu([&] { dense = by_openvdb(each.soup, g, 3, 2); });
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
    std::printf("| %s | %.3f | %.2f | %.0f | %.4f | %.3f | %.1f | %.2g | %llu | %llu of %llu tried |\n",
                each.name.c_str(), box, sweep, sweep / box, ours_band, vdb, vdb / ours_band, worst,
                static_cast<unsigned long long>(wrong), static_cast<unsigned long long>(own_wrong),
                static_cast<unsigned long long>(n / 997));
    std::fflush(stdout);
  }

  std::printf(
      "\n### The thesis' spatial coherence (Figures 54 to 56): %s at 135\n\nCPU seconds of the distances alone.\n\n| "
      "TREE_ASCEND_N | depth "
      "first, as printed | depth first, corrected | breadth first, as printed | breadth first, corrected "
      "|\n|---|---|---|---|---|\n",
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

void mask_table(const Context& context, const fs::path& folder) {
  Frame f;
  f.dims = {512, 512, 300};
  f.spacing_mm = {0.5, 0.5, 0.8};
  std::vector<std::uint8_t> mask(f.voxel_count(), 0);
  std::mt19937 random(1);
  for (int b = 0; b < 60; ++b) {  // sixty balls
    const int cx = static_cast<int>(random() % 512), cy = static_cast<int>(random() % 512),
              cz = static_cast<int>(random() % 300), r = 10 + static_cast<int>(random() % 40);
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
      "\n### Euclidean distance of a mask, 512 x 512 x 300, anisotropic\n\nWall seconds. Ours gives squared distances "
      "to the mask; the "
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
                    sparse = mask_distance(labels, {&value, 1}, {DistanceRegion::band, 3, 3}, false, context).distance;
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
    std::printf(
        "\nOurs and edt differ by at most %.1e mm. The sparse band takes %.0f MB, a dense float volume %.0f MB.\n",
        worst, static_cast<double>(sparse.memory_bytes) / 1e6, static_cast<double>(mask.size()) * 4 / 1e6);
  }
}

// A 3 mm burr eats into a bone of 0.5 mm voxels; the band of distances to its surface follows.
void live_table() {
  Frame f;
  f.dims = {160, 160, 160};
  f.spacing_mm = {0.5, 0.5, 0.5};
  BrickGrid bone = BrickGrid::dense(f);
  const auto at = [&](int i, int j, int k) { return f.world_from_index({double(i), double(j), double(k)}); };
  const Vec3 centre{40, 40, 40};
  for (int k = 0; k < 160; ++k)
    for (int j = 0; j < 160; ++j)
      for (int i = 0; i < 160; ++i)
        bone.set(bone.find(i, j, k),
                 static_cast<float>(std::clamp(0.5 + (30 - length(at(i, j, k) - centre)) / 0.5, 0.0, 1.0)));
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
      const Vec3 tip =
          centre + normalized(Vec3{std::cos(step * 0.0033), std::sin(step * 0.0033), 0.1}) * (31.2 - step * 0.01);
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
              const std::uint32_t b =
                  drilled.find_brick((i + ((c & 1) != 0 ? 2 : -2)) >> 3, (j + ((c & 2) != 0 ? 2 : -2)) >> 3,
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
      for (std::size_t i = 0; i < place.size(); ++i)
        own_ids[place[i].first][place[i].second] = first + static_cast<std::uint32_t>(i);
      touched += live->touched();
      removed_count += removed.size();
      added_count += added.size();
    }
    patches = own_patches;
    std::sort(ms.begin(), ms.end());
    if (reach == 1.5) {
      std::printf(
          "\n### The map follows the drill\n\nA ball of bone, 160^3 voxels of 0.5 mm; a 3 mm burr moves 0.1 mm a step. "
          "One thread.\n\n| "
          "band | whole map s | update median ms | p95 ms | max ms | voxels measured a step | triangles taken / added "
          "a step "
          "|\n|---|---|---|---|---|---|---|\n");
    }
    std::printf("| %.1f mm | %.2f | %.3f | %.3f | %.3f | %llu | %llu / %llu |\n", reach, whole, ms[ms.size() / 2],
                ms[ms.size() * 95 / 100], ms.back(), static_cast<unsigned long long>(touched / ms.size()),
                static_cast<unsigned long long>(removed_count / ms.size()),
                static_cast<unsigned long long>(added_count / ms.size()));
  }
}

}  // namespace osteo::bench
