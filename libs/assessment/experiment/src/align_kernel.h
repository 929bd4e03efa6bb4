// One anti-diagonal of the matrix, for each instruction set. Private to libs/assessment/experiment.
#pragma once

namespace osteo::inline assessment::experiment {

/// Places first to last of the target. `f`, `fs`, `fw` by target; `g`, `gs`, `gw` shifted so that the same index is the
/// partner's. `before`: costs of the anti-diagonal before, `both`: of the one before that, by target. Weights null:
/// all 1.
struct Diagonal {
  long first, last;
  const double *f, *fs, *fw, *g, *gs, *gw, *before, *both;
  double* out;
  double force, slope, distortion;
};

using DiagonalFunction = void (*)(const Diagonal&);
void diagonal_base(const Diagonal& d);
void diagonal_avx2(const Diagonal& d);
void diagonal_avx512(const Diagonal& d);

/// A cell's own cost; the plain recurrence writes the same.
inline double place_cost(double f, double fs, double g, double gs, double force, double slope) {
  const double df = f - g, ds = fs - gs;
  return force * (df < 0 ? -df : df) + slope * (ds < 0 ? -ds : ds);
}

}  // namespace osteo::inline assessment::experiment
