// Bodies too large for all their steps: how far fewer steps an update, as in a rehearsal, are from all of them.
#include <time.h>

#include <algorithm>
#include <cstdio>
#include <memory>

#include "bench_tissue.h"
#include "osteo/simulation/tissue/dynamics.h"

namespace osteo::bench {
namespace {

constexpr double kUpdateS = 0.01, kDampingPerS = 150;

// Of this thread: what an update costs a core, whatever else the machine does.
double processor_s() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

// A pad held at its underside; as a flap, half of it undercut.
struct Pad {
  test::Block block;
  TissueModel model;
  std::vector<std::uint32_t> fixed, cut;
  Vec3 top{};

  Pad(int n, int nz, double h, bool flap)
      : block(test::block(n, n, nz, h)),
        model(TissueModel::of_voxels(block.points, block.tets, std::array{Material{0.04, 0.45}})) {
    model.scale({1, 1, 0, 1});
    for (std::uint32_t p = 0; p < block.points.size(); ++p) {
      const Vec3& at = block.points[p];
      if (at.z < 0.1) fixed.push_back(p);
      top = {std::max(top.x, at.x), std::max(top.y, at.y), std::max(top.z, at.z)};
    }
    for (std::uint32_t t = 0; flap && t < block.tets.size(); ++t) {
      Vec3 middle{};
      for (const std::uint32_t p : block.tets[t]) middle += block.points[p] * 0.25;
      if (middle.x > 0.3 * top.x && middle.z > top.z - 3 * h && middle.z < top.z - 2 * h) cut.push_back(t);
    }
  }
};

struct Course {
  std::vector<std::vector<Vec3>> places;  // every fifth update
  std::vector<double> force_n;
  double ms = 0;  // median of an update
  int wanted = 0;
};

// A burr of 6 mm, pressed in at an even speed and then held; steps: 0: all.
Course press(const Pad& pad, double share, int steps, double mm_per_s, double deep_mm, int updates) {
  TissueDynamics<float> body(pad.model, pad.fixed, {.damping_per_s = kDampingPerS, .step_share = share});
  if (!pad.cut.empty()) body.cut_off(pad.cut);
  Course c;
  c.wanted = static_cast<int>(std::lround(kUpdateS / body.step_s()));
  const Vec3 at{(pad.cut.empty() ? 0.53 : 0.8) * pad.top.x, 0.47 * pad.top.y, pad.top.z + 3};
  std::vector<double> ms;
  for (int n = 0; n < updates; ++n) {
    const double deep = std::min(deep_mm, mm_per_s * kUpdateS * n);
    body.set_tool({std::make_shared<BallShape>(at - Vec3{0, 0, deep}, 3), 0.1});
    const double begin = processor_s();
    c.force_n.push_back(length(body.step(steps > 0 ? steps : c.wanted)));
    ms.push_back(1e3 * (processor_s() - begin));
    if (n % 5 == 4) c.places.push_back(body.positions_mm());
  }
  std::sort(ms.begin(), ms.end());
  c.ms = ms[ms.size() / 2];
  return c;
}

double most_off(const Course& a, const Course& b) {
  double most = 0;
  for (std::size_t n = 0; n < a.places.size(); ++n)
    for (std::size_t p = 0; p < a.places[n].size(); ++p) most = std::max(most, length(a.places[n][p] - b.places[n][p]));
  return most;
}
double force_off(const Course& a, const Course& b) {
  double most = 0, off = 0;
  for (std::size_t n = 0; n < a.force_n.size(); ++n) {
    most = std::max(most, b.force_n[n]);
    off = std::max(off, std::abs(a.force_n[n] - b.force_n[n]));
  }
  return off / most;
}

}  // namespace

void tissue_pressed() {
  std::printf(
      "### Pressed by a burr of 6 mm: fewer steps an update than real time, one core, E 40 kPa, nu 0.45\n\n"
      "| body | tetrahedra | mm/s | steps an update | ms of a core | force off at worst | held still | place off, mm "
      "|\n"
      "|---|---|---|---|---|---|---|---|\n");
  struct Row {
    const char* name;
    int n, nz;
    double h;
    bool flap;
    double mm_per_s, deep_mm;
    int updates;
    std::vector<int> steps;
  };
  for (const Row& r :
       {Row{"pad", 16, 8, 1.5, false, 9, 3.6, 60, {8, 16, 24, 48}},
        Row{"pad", 16, 8, 1.5, false, 40, 3.6, 30, {8, 16, 24, 48}},
        Row{"flap", 16, 8, 1.5, true, 9, 6, 90, {8, 16, 24, 48}}, Row{"pad", 24, 10, 1, false, 9, 3.6, 60, {8, 16}}}) {
    const Pad pad(r.n, r.nz, r.h, r.flap);
    const Course exact = press(pad, 0.3, 0, r.mm_per_s, r.deep_mm, r.updates);
    for (const int steps : r.steps) {
      const Course c = press(pad, 0.6, steps, r.mm_per_s, r.deep_mm, r.updates);
      std::printf("| %s | %zu | %g | %d of %d | %.1f | %.1f %% | %.1f %% | %.2f |\n", r.name, pad.block.tets.size(),
                  r.mm_per_s, steps, c.wanted, c.ms, 100 * force_off(c, exact),
                  100 * std::abs(c.force_n.back() / exact.force_n.back() - 1), most_off(c, exact));
      std::fflush(stdout);
    }
  }
  std::printf("\n");
}

}  // namespace osteo::bench
