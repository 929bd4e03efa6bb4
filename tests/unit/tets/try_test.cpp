#include <gtest/gtest.h>
#include <cmath>
#include <cstdio>
#include <ctime>
#include "osteo/io/surface_io.h"
#include "osteo/tets/grid_tets.h"
#include "osteo/tets/quality.h"
#include "osteo/tets/stuffing.h"
using namespace osteo;
static double cpu() { timespec t; clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t); return t.tv_sec + 1e-9 * t.tv_nsec; }
static void show(const TetQuality& q) {
  std::printf("   points %lu tets %lu inverted %lu conforming %d (3+ %lu buried %lu) closed %d manifold %d vol %.4g dihedral %.2f..%.2f aspect %.3f/%.3f\n", q.points, q.tets, q.inverted, q.conforming(), q.faces_of_three_or_more, q.buried_triangles, q.boundary_closed, q.boundary_manifold, q.volume_mm3, q.min_dihedral_deg, q.max_dihedral_deg, q.min_aspect, q.mean_aspect);
}
TEST(Try, Tets) {
  for (auto* name : {"bunny_capped_69664_morris.obj", "gear_tetgen_542.obj", "happy_vrip_res4_15536.ply","dragon_vrip_res3_47794.ply", "dragon_100000_watertight_quartet.obj"}) {
    auto soup = soup_of(*load_surface(std::string(OSTEO_SHARED_DATA "/meshes/") + name));
    Context c; c.threads = 1;
    for (int n : {75, 165}) {
      Frame f = frame_around(soup, n, 2);
      double t0 = cpu();
      auto in = voxels_inside(soup, f, c); auto bits = in.dilated();
      double t1 = cpu();
      TetMesh m = grid_tets(bits, c);
      double t2 = cpu();
      std::printf("%s %d: inside %.4f grid %.4f tets %zu\n", name, n, t1 - t0, t2 - t1, m.tets.size());
      if (n == 75) show(tet_quality(m));
    }
    Frame f = frame_around(soup, 38, 0);
    for (double target : {0., 15., 20.}) {
      double t0 = cpu();
      TetMesh m = stuffed_tets(soup, {f.spacing_mm.x, target}, c);
      double t1 = cpu();
      std::printf("%s stuffed target %.0f: %.4f s\n", name, target, t1 - t0);
      show(tet_quality(m));
    }
  }
}
