#include <gtest/gtest.h>
#include <chrono>
#include <cmath>
#include <cstdio>
#include "osteo/distance/distance_map.h"
#include "osteo/io/surface_io.h"
using namespace osteo;
static double cpu() { timespec t; clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t); return t.tv_sec + 1e-9 * t.tv_nsec; }
TEST(Try, Speed) {
  for (auto* name : {"bunny_capped_69664_morris.obj", "gear_tetgen_542.obj", "happy_vrip_res4_15536.ply","dragon_vrip_res3_47794.ply"}) {
    auto mesh = load_surface(std::string(OSTEO_SHARED_DATA "/meshes/") + name);
    auto soup = soup_of(*mesh);
    for (int n : {30, 75, 135, 195}) {
      Frame f = frame_around(soup, n, 2);
      Context c; c.threads = 1;
      double t0 = cpu();
      TriangleTree tr(soup, f.direction, c);
      double ta = cpu();
      DistanceMapper m(soup, f, c);
      double t1 = cpu();
      VoxelBits w = m.inside().dilated();
      DistanceMap d = m.map(w, c);
      double t2 = cpu();
      double worst = 0; std::uint32_t hint = 0; std::size_t cnt = 0;
      for (std::size_t b = 0; b < d.bricks.size(); ++b) for (int v = 0; v < 512; v += 37) {
        if (!(d.stored[b * 8 + v / 64] >> (v % 64) & 1)) continue;
        Ijk o = d.bricks[b];
        Vec3 p = f.world_from_index({o.i * 8. + (v & 7), o.j * 8. + (v >> 3 & 7), o.k * 8. + (v >> 6)});
        auto cp = m.tree().closest(p, hint); hint = cp.triangle; ++cnt;
        worst = std::max(worst, std::abs(cp.distance_mm - std::abs(d.distance_mm[b * 512 + v])) / f.spacing_mm.x);
      }
      double t3 = cpu();
      std::printf("%s %d: tree %.3f prep %.3f map %.3f total(prep+map) %.3f  voxels %lu  worst %.2e  query %.2f us, closed %d by angle %lu\n", name, n, ta - t0, t1 - ta, t2 - t1, t2 - ta, d.count(), worst, (t3 - t2) / cnt * 1e6, m.inside_report().closed, m.inside_report().by_solid_angle);
    }
  }
}
