#include "line.h"

namespace osteo::inline imaging::segment {

std::vector<Vec3> evenly(const std::vector<Vec3>& line, double step) {
  std::vector<Vec3> out{line.front()};
  double rest = step;
  for (std::size_t i = 1; i < line.size(); ++i) {
    Vec3 a = line[i - 1];
    double l = length(line[i] - a);
    while (l >= rest) {
      a = a + (line[i] - a) * (rest / l);
      l = length(line[i] - a);
      out.push_back(a);
      rest = step;
    }
    rest -= l;
  }
  if (out.size() < 2 || length(line.back() - out.back()) > 0.3 * step) out.push_back(line.back());
  return out;
}

std::vector<Vec3> smoothed_line(const std::vector<Vec3>& p, const std::vector<double>& weight, double step_mm,
                                double along_mm) {
  const std::size_t n = p.size();
  if (n < 4) return p;
  const double k = along_mm / step_mm, lambda = k * k * k * k;
  std::vector<double> d(n, 1e-6), e(n), f(n);  // the diagonal, and those one and two beside it
  std::vector<Vec3> r(n);
  for (std::size_t i = 0; i < n; ++i) {
    d[i] += weight[i];
    r[i] = p[i] * (weight[i] + 1e-6);
  }
  for (std::size_t i = 1; i + 1 < n; ++i) {  // second differences 1 -2 1
    d[i - 1] += lambda;
    d[i] += 4 * lambda;
    d[i + 1] += lambda;
    e[i - 1] -= 2 * lambda;
    e[i] -= 2 * lambda;
    f[i - 1] += lambda;
  }
  for (std::size_t i = 0; i < n; ++i) {
    const double a = e[i] / d[i], b = f[i] / d[i];
    if (i + 1 < n) {
      d[i + 1] -= a * e[i];
      e[i + 1] -= a * f[i];
      r[i + 1] = r[i + 1] - r[i] * a;
    }
    if (i + 2 < n) {
      d[i + 2] -= b * f[i];
      r[i + 2] = r[i + 2] - r[i] * b;
    }
    e[i] = a;
    f[i] = b;
  }
  std::vector<Vec3> out(n);
  for (std::size_t i = n; i-- > 0;) {
    out[i] = r[i] / d[i];
    if (i + 1 < n) out[i] = out[i] - out[i + 1] * e[i];
    if (i + 2 < n) out[i] = out[i] - out[i + 2] * f[i];
  }
  return out;
}

}  // namespace osteo::inline imaging::segment
