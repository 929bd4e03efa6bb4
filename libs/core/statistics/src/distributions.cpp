#include "osteo/core/statistics/basics.h"

#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/fisher_f.hpp>
#include <boost/math/distributions/non_central_t.hpp>
#include <boost/math/distributions/normal.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <boost/math/special_functions/gamma.hpp>
#include <boost/math/tools/toms748_solve.hpp>
#include <cmath>
#include <cstdint>
#include <limits>
#include <stdexcept>

namespace osteo::statistics {

namespace bm = boost::math;

double normal_cdf(double z) {
  return bm::cdf(bm::normal(), z);
}
double normal_quantile(double share) {
  return bm::quantile(bm::normal(), share);
}
double student_p(double t, double df) {
  return 2 * bm::cdf(bm::complement(bm::students_t(df), std::abs(t)));
}
double student_quantile(double share, double df) {
  return bm::quantile(bm::students_t(df), share);
}
double chi_squared_quantile(double share, double df) {
  return bm::quantile(bm::chi_squared(df), share);
}
double fisher_f_quantile(double share, double df1, double df2) {
  return bm::quantile(bm::fisher_f(df1, df2), share);
}

double fisher_f_p(double f, double df1, double df2) {
  return bm::cdf(bm::complement(bm::fisher_f(df1, df2), f));
}
double student_beyond(double critical, double df, double non_centrality) {
  // So far out Boost's series do not end, and nothing is left on this side.
  if (std::abs(non_centrality) > 37 + critical) return 1;
  const bm::non_central_t t(df, non_centrality);
  return bm::cdf(bm::complement(t, critical)) + bm::cdf(t, -critical);
}

double non_centrality(double t, double df, double share) try {
  // The share below t falls as the non-centrality rises; beyond some forty of them off there is nothing left of it.
  const auto off = [&](double d) { return bm::cdf(bm::non_central_t(df, d), t) - share; };
  double lo = t - 1, hi = t + 1;
  for (double step = 2; off(lo) < 0 && step < 1e4; step *= 2) lo -= step;
  for (double step = 2; off(hi) > 0 && step < 1e4; step *= 2) hi += step;
  std::uintmax_t rounds = 200;
  const auto [a, b] = bm::tools::toms748_solve(off, lo, hi, bm::tools::eps_tolerance<double>(50), rounds);
  return (a + b) / 2;
} catch (const std::exception&) {
  // Where Boost cannot sum the series: groups apart by very many times their spread.
  return std::numeric_limits<double>::quiet_NaN();
}

double hedges_factor(double df) {
  return 1 / (std::sqrt(df / 2) * bm::tgamma_delta_ratio((df - 1) / 2, 0.5));
}

}  // namespace osteo::statistics
