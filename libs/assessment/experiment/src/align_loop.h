// The loop that is compiled once for each instruction set. Private to libs/assessment/experiment.
#pragma once
#include "align_kernel.h"

namespace osteo::inline assessment::experiment {
namespace {

// No array overlaps another, and each place depends on earlier anti-diagonals only.
template <bool weighted>
void run_diagonal(const Diagonal& d) {
  const double* __restrict f = d.f;
  const double* __restrict fs = d.fs;
  const double* __restrict fw = d.fw;
  const double* __restrict g = d.g;
  const double* __restrict gs = d.gs;
  const double* __restrict gw = d.gw;
  const double* __restrict before = d.before;
  const double* __restrict both = d.both;
  double* __restrict out = d.out;
  const long first = d.first, last = d.last;
  const double force = d.force, slope = d.slope, distortion = d.distortion;
  for (long i = first; i <= last; ++i) {
    const double late = (before[i - 1] < before[i] ? before[i - 1] : before[i]) + distortion, even = both[i - 1];
    double own = place_cost(f[i], fs[i], g[i], gs[i], force, slope);
    if constexpr (weighted) own *= fw[i] * gw[i];
    out[i] = own + (even < late ? even : late);
  }
}

void run_any(const Diagonal& d) {
  if (d.fw == nullptr) {
    run_diagonal<false>(d);
  } else {
    run_diagonal<true>(d);
  }
}

}  // namespace
}  // namespace osteo::inline assessment::experiment
