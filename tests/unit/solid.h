// Bone of any shape, for tests and benchmarks: what is inside decides, voxels at the surface by counting.
#pragma once
#include <cmath>
#include <vector>

#include "osteo/geometry/grid/brick_grid.h"
#include "osteo/simulation/haptics/device.h"
#include "osteo/simulation/haptics/renderer.h"
#include "slab.h"

namespace osteo::test {

/// A cube of voxels of edge `h` around `centre`, at least `half_mm` to each side; each voxel's density is the share of
/// `per_edge`^3 points in it for which inside(point - centre) holds.
template <class Inside>
BrickGrid solid(double h, double half_mm, Inside inside, Vec3 centre = {}, int per_edge = 4) {
  Frame f;
  const int n = static_cast<int>(std::ceil(2 * half_mm / h / 8)) * 8;
  f.dims = {n, n, n};
  f.spacing_mm = {h, h, h};
  const double lo = -n * h / 2 + h / 2;
  f.origin_mm = centre + Vec3{lo, lo, lo};
  BrickGrid g = BrickGrid::dense(f);
  const int points = per_edge * per_edge * per_edge;
  for (int k = 0; k < n; ++k)
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i) {
        int in = 0;
        for (int s = 0; s < points; ++s) {
          const auto at = [&](int voxel, int point) {
            return lo + (voxel + (point - 0.5 * (per_edge - 1)) / per_edge) * h;
          };
          in +=
              inside(Vec3{at(i, s % per_edge), at(j, s / per_edge % per_edge), at(k, s / per_edge / per_edge)}) ? 1 : 0;
        }
        g.set(g.find(i, j, k), static_cast<float>(in) / static_cast<float>(points));
      }
  return g;
}

/// What a spring hand that circles over flat bone and presses ever harder removes in 2 s, mm3.
inline double drilled_mm3(ContactMethod method, double h, double rate_hz, int tool = 3) {
  auto bone = slab(h);
  HapticSetup setup;
  setup.params.contact.method = method;
  setup.params.effects.vibration = false;
  setup.device = SpringHand::traits();
  HapticRenderer renderer(setup, bone, {}, 1 / rate_hz);
  SpringHand hand;
  double removed = 0;
  Vec3 force{};
  for (int t = 0; t < static_cast<int>(2 * rate_hz); ++t) {
    HandGoal goal;
    const double s = t / rate_hz;
    goal.position_mm = {4 * std::sin(6 * s), 4 * std::cos(6 * s), 0.4 - 1.0 * s};
    goal.axis = {0.6F, 0, 0.8F};
    goal.pedal = 255;
    goal.tool = static_cast<std::uint8_t>(tool);
    const auto [record, changes] = renderer.step(hand.step(goal, 1 / rate_hz, force));
    force = {record.force_n[0], record.force_n[1], record.force_n[2]};
    removed += static_cast<double>(record.removed_mm3);
  }
  return removed;
}

}  // namespace osteo::test
