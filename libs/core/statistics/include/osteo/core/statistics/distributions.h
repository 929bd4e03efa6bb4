// Distributions of statistics, by Boost.Math (in one source file: its headers are slow to compile).
#pragma once

namespace osteo::statistics {

[[nodiscard]] double normal_cdf(double z);
[[nodiscard]] double normal_quantile(double share);
/// Two-sided.
[[nodiscard]] double student_p(double t, double df);
[[nodiscard]] double student_quantile(double share, double df);
[[nodiscard]] double chi_squared_quantile(double share, double df);
[[nodiscard]] double fisher_f_quantile(double share, double df1, double df2);
/// The upper tail.
[[nodiscard]] double fisher_f_p(double f, double df1, double df2);
/// The share of the non-central t distribution beyond `critical` on either side.
[[nodiscard]] double student_beyond(double critical, double df, double non_centrality);
/// The non-centrality for which `share` of the non-central t distribution lies below t. NaN where it cannot be found.
[[nodiscard]] double non_centrality(double t, double df, double share);
/// Gamma(df / 2) / (sqrt(df / 2) Gamma((df - 1) / 2)): Hedges' factor. df > 1.
[[nodiscard]] double hedges_factor(double df);

}  // namespace osteo::statistics
