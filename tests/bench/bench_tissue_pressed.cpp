// Factorised steps under a tool: what an update costs, and how far a few iterations are from the converged step.
#include <time.h>

#include <algorithm>
#include <cstdio>
#include <memory>

#include "bench_tissue.h"
#include "osteo/simulation/tissue/dynamics.h"

namespace osteo::bench {
namespace {

constexpr double kUpdateS = 0.01;
constexpr int kUpdates = 50;

// A burr of 6 mm goes 1.2 radii deep into a pad and sideways, both within 0.4 s.
BallShape burr(const test::Block& b, int update) {
  Vec3 top{};
  for (const Vec3& p : b.points) top = {std::max(top.x, p.x), std::max(top.y, p.y), std::max(top.z, p.z)};
  const double t = std::min(1.0, update / 40.0);
  return {{top.x / 2 + 3 * (t - 0.5), top.y / 2, top.z + 3 - 3.6 * t}, 3};
}

// Of this thread: what an update costs a core, whatever else the machine does.
double processor_s() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

struct Course {
  std::vector<std::vector<Vec3>> places;  // every tenth update
  std::vector<double> force_n;
  double ms = 0, worst_ms = 0;  // median and worst of an update
};

template <class Real>
Course press(const test::Block& b, TissueDynamics<Real>& body, int steps) {
  Course c;
  std::vector<double> ms;
  for (int n = 0; n < kUpdates; ++n) {
    body.set_tool({std::make_shared<BallShape>(burr(b, n)), 0.1});
    const double begin = processor_s();
    c.force_n.push_back(length(body.step(steps)));
    ms.push_back(1e3 * (processor_s() - begin));
    if (n % 10 == 9) c.places.push_back(body.positions_mm());
  }
  std::sort(ms.begin(), ms.end());
  c.ms = ms[ms.size() / 2];
  c.worst_ms = ms.back();
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
      "### Pressed by a burr: factorised steps of 10 ms, one core, E 40 kPa, 3.6 mm deep in 0.4 s\n\n"
      "| tetrahedra | nu | way | update, ms of a core, worst | off the converged step mm (force) | factor s, MB "
      "|\n|---|---|---|---|---|---|\n");
  struct Size {
    int n, nz;
    double h, nu;
  };
  for (const Size s : {Size{8, 4, 3, 0.45}, Size{16, 8, 1.5, 0.45}, Size{16, 8, 1.5, 0.49}, Size{16, 8, 1.5, 0.499}}) {
    const test::Block b = test::block(s.n, s.n, s.nz, s.h);
    TissueModel model = TissueModel::of_voxels(b.points, b.tets, std::array{Material{0.04, s.nu}});
    model.scale({1, 1, 0, 1});
    std::vector<std::uint32_t> fixed;
    for (std::uint32_t p = 0; p < b.points.size(); ++p) {
      if (b.points[p].z < 0.1) fixed.push_back(p);
    }
    const auto with = [&](int iterations) {
      return TissueDynamics<float>(model, fixed,
                                   {.damping_per_s = 150, .factorised_step_s = kUpdateS, .iterations = iterations});
    };
    auto converged = with(40);
    const Course exact = press(b, converged, 1);
    for (const int iterations : {1, 2, 3, 5, 8}) {
      auto body = with(iterations);
      const double begin = processor_s();
      body.prepare();
      const double factor_s = processor_s() - begin;
      const double mb = static_cast<double>(body.factor_bytes()) / 1e6;
      const Course c = press(b, body, 1);
      std::printf("| %zu | %g | factorised, %d | %.2f, %.2f | %.3f (%.1f %%) | %.2f, %.1f |\n", b.tets.size(), s.nu,
                  iterations, c.ms, c.worst_ms, most_off(c, exact), 100 * force_off(c, exact), factor_s, mb);
    }
    TissueDynamics<float> stepped(model, fixed, {.damping_per_s = 150, .step_share = 0.75});
    const int steps = static_cast<int>(std::lround(kUpdateS / stepped.step_s()));
    const Course c = press(b, stepped, steps);
    std::printf("| %zu | %g | explicit, %d steps | %.2f, %.2f | %.3f (%.1f %%) | |\n", b.tets.size(), s.nu, steps, c.ms,
                c.worst_ms, most_off(c, exact), 100 * force_off(c, exact));
    std::fflush(stdout);
  }
  std::printf("\n");
}

}  // namespace osteo::bench
