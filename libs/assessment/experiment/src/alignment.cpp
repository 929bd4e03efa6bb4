#include "osteo/assessment/experiment/alignment.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "align_kernel.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/simd.h"

namespace osteo::inline assessment::experiment {
namespace {

constexpr double kFar = std::numeric_limits<double>::infinity();

DiagonalFunction diagonal_function() {
  if (simd() == Simd::avx512) return &diagonal_avx512;
  if (simd() == Simd::avx2) return &diagonal_avx2;
  return &diagonal_base;
}

void need_curve(const Curve& c, const char* called) {
  const auto refuse = [&](const std::string& what) {
    throw Error(ExitCode::usage, "the " + std::string(called) + " curve " + what);
  };
  if (c.force_n.empty()) refuse("has no samples");
  if (c.slope_n_per_s.size() != c.force_n.size() || (!c.weight.empty() && c.weight.size() != c.force_n.size()))
    refuse("has not as many slopes or weights as forces");
  for (std::size_t i = 0; i < c.force_n.size(); ++i) {
    if (!std::isfinite(c.force_n[i]) || !std::isfinite(c.slope_n_per_s[i]))
      refuse("is not a number at sample " + std::to_string(i));
    if (!c.weight.empty() && !(c.weight[i] >= 0 && std::isfinite(c.weight[i])))
      refuse("has a weight below 0 at sample " + std::to_string(i));
  }
}

void need_costs(const AlignCosts& c) {
  for (const double v : {c.force, c.slope_s, c.distortion_n}) {
    if (!(v >= 0 && std::isfinite(v))) throw Error(ExitCode::usage, "costs of an alignment are 0 or more");
  }
}

void need_room(std::size_t n, std::size_t m) {
  if (n > (std::size_t{1} << 28) / m)
    throw Error(ExitCode::usage,
                "curves of " + std::to_string(n) + " and " + std::to_string(m) + " samples are too long to align",
                "resample them");
}

double gap(double value, double lo, double hi) {
  return value < lo ? lo - value : value > hi ? value - hi : 0;
}

}  // namespace

Aligner::Aligner(const AlignCosts& costs, double first_band) : costs_(costs), first_band_(first_band) {
  need_costs(costs);
  if (!(first_band > 0)) throw Error(ExitCode::usage, "the band of an alignment is wider than 0");
}

const Alignment& Aligner::align(const Curve& target, const Curve& applied) {
  need_curve(target, "target");
  need_curve(applied, "applied");
  need_room(target.force_n.size(), applied.force_n.size());
  n_ = static_cast<long>(target.force_n.size());
  m_ = static_cast<long>(applied.force_n.size());
  f_.assign(target.force_n.begin(), target.force_n.end());
  fs_.assign(target.slope_n_per_s.begin(), target.slope_n_per_s.end());
  g_.assign(applied.force_n.rbegin(), applied.force_n.rend());
  gs_.assign(applied.slope_n_per_s.rbegin(), applied.slope_n_per_s.rend());
  weighted_ = !target.weight.empty() || !applied.weight.empty();
  if (weighted_) {
    fw_.assign(target.weight.begin(), target.weight.end());
    gw_.assign(applied.weight.rbegin(), applied.weight.rend());
    fw_.resize(static_cast<std::size_t>(n_), 1);
    gw_.resize(static_cast<std::size_t>(m_), 1);
  }
  // Offsets applied - target that are looked at: some on either side of those that the lengths ask for.
  const long whole = std::max(n_, m_) - 1, least_low = std::min(0L, m_ - n_), least_high = std::max(0L, m_ - n_);
  const auto low = [&](long half) { return std::max(-(n_ - 1), least_low - half); };
  const auto high = [&](long half) { return std::min(m_ - 1, least_high + half); };
  long half = std::min(
      whole, std::max(2L, static_cast<long>(std::lround(std::min(1.0, first_band_) * static_cast<double>(whole)))));
  result_.places = 0;
  result_.cost_n = fill(low(half), high(half));
  if (half < whole) {
    // Who leaves a band of half width w stands still |difference of lengths| + 2 (w + 1) times. Sums in another order
    // differ in their last bits: the certificate does not live off those.
    const double spare =
        result_.cost_n * (1 + 1e-12) - least_cost() - static_cast<double>(std::abs(m_ - n_)) * costs_.distortion_n;
    const auto certain = [&](long w) { return spare < 2 * static_cast<double>(w + 1) * costs_.distortion_n; };
    if (!certain(half)) {
      const double wide = costs_.distortion_n > 0 ? std::floor(spare / (2 * costs_.distortion_n)) : kFar;
      half = wide < 0.7 * static_cast<double>(whole) ? static_cast<long>(wide) : whole;
      while (half < whole && !certain(half)) ++half;
      result_.cost_n = fill(low(half), high(half));
    }
  }
  result_.by = half < whole ? AlignBy::band : AlignBy::matrix;
  trace(low(half), high(half));
  return result_;
}

// What any way costs at least: each sample of the target has a partner somewhere.
double Aligner::least_cost() const {
  const auto [lo, hi] = std::minmax_element(g_.begin(), g_.end());
  const auto [slow, shigh] = std::minmax_element(gs_.begin(), gs_.end());
  const double weight = weighted_ ? *std::min_element(gw_.begin(), gw_.end()) : 1;
  double sum = 0;
  for (std::size_t i = 0; i < f_.size(); ++i)
    sum += (weighted_ ? fw_[i] * weight : 1) *
           (costs_.force * gap(f_[i], *lo, *hi) + costs_.slope_s * gap(fs_[i], *slow, *shigh));
  return sum * (1 - 1e-12);
}

double Aligner::fill(long lowest, long highest) {
  static const DiagonalFunction run = diagonal_function();
  const long diagonals = n_ + m_ - 1;
  const auto first_of = [&](long d) { return std::max({0L, d - (m_ - 1), (d - highest + 1) >> 1}); };
  const auto last_of = [&](long d) { return std::min({n_ - 1, d, (d - lowest) >> 1}); };
  row_.resize(static_cast<std::size_t>(diagonals) + 2);
  std::size_t size = 4;
  row_[0] = row_[1] = static_cast<std::size_t>(n_) + 1;
  for (long d = 0; d < diagonals; ++d) {
    const long first = first_of(d), count = last_of(d) - first + 1;
    row_[static_cast<std::size_t>(d) + 2] = size + 1 + static_cast<std::size_t>(n_ - first);
    size += static_cast<std::size_t>(count) + 2;
    result_.places += static_cast<std::size_t>(count);
  }
  if (cost_.size() < size) cost_.resize(size);
  std::fill_n(cost_.begin(), 4, kFar);
  const auto place = [&](long d) {
    return cost_.data() +
           (static_cast<std::ptrdiff_t>(row_[static_cast<std::size_t>(d + 2)]) - static_cast<std::ptrdiff_t>(n_));
  };
  Diagonal d{};
  d.force = costs_.force;
  d.slope = costs_.slope_s;
  d.distortion = costs_.distortion_n;
  d.f = f_.data();
  d.fs = fs_.data();
  d.fw = weighted_ ? fw_.data() : nullptr;
  for (long k = 0; k < diagonals; ++k) {
    d.first = first_of(k);
    d.last = last_of(k);
    const long shift = m_ - 1 - k;
    d.g = g_.data() + shift;
    d.gs = gs_.data() + shift;
    d.gw = weighted_ ? gw_.data() + shift : nullptr;
    d.out = place(k);
    d.before = place(k - 1);
    d.both = place(k - 2);
    d.out[d.first - 1] = d.out[d.last + 1] = kFar;
    if (k == 0) {
      const double own = place_cost(f_[0], fs_[0], d.g[0], d.gs[0], d.force, d.slope);
      d.out[0] = weighted_ ? own * (fw_[0] * d.gw[0]) : own;
    } else {
      run(d);
    }
  }
  return place(diagonals - 1)[n_ - 1];
}

void Aligner::trace(long lowest, long highest) {
  const auto value = [&](long i, long j) {
    if (i < 0 || j < 0 || j - i < lowest || j - i > highest) return kFar;
    return cost_[row_[static_cast<std::size_t>(i + j) + 2] - static_cast<std::size_t>(n_) +
                 static_cast<std::size_t>(i)];
  };
  result_.path.clear();
  result_.path.reserve(static_cast<std::size_t>(n_ + m_));
  long i = n_ - 1, j = m_ - 1;
  for (;;) {
    result_.path.push_back({static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(j)});
    if (i == 0 && j == 0) break;
    const double even = value(i - 1, j - 1), target = value(i - 1, j), applied = value(i, j - 1);
    if (even <= std::min(target, applied) + costs_.distortion_n) {
      --i;
      --j;
    } else if (target <= applied) {
      --i;
    } else {
      --j;
    }
  }
  std::reverse(result_.path.begin(), result_.path.end());
}

Alignment align_plainly(const Curve& target, const Curve& applied, const AlignCosts& costs) {
  need_curve(target, "target");
  need_curve(applied, "applied");
  need_costs(costs);
  need_room(target.force_n.size(), applied.force_n.size());
  const std::size_t n = target.force_n.size(), m = applied.force_n.size();
  const bool weighted = !target.weight.empty() || !applied.weight.empty();
  std::vector<double> cost(n * m);
  const auto value = [&](std::size_t i, std::size_t j) { return cost[i * m + j]; };
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < m; ++j) {
      double own = place_cost(target.force_n[i], target.slope_n_per_s[i], applied.force_n[j], applied.slope_n_per_s[j],
                              costs.force, costs.slope_s);
      if (weighted)
        own *= (target.weight.empty() ? 1 : target.weight[i]) * (applied.weight.empty() ? 1 : applied.weight[j]);
      double before = i + j == 0 ? 0 : kFar;
      if (i > 0) before = std::min(before, value(i - 1, j) + costs.distortion_n);
      if (j > 0) before = std::min(before, value(i, j - 1) + costs.distortion_n);
      if (i > 0 && j > 0) before = std::min(before, value(i - 1, j - 1));
      cost[i * m + j] = own + before;
    }
  }
  Alignment r;
  r.by = AlignBy::matrix;
  r.cost_n = cost.back();
  std::size_t i = n - 1, j = m - 1;
  for (;;) {
    r.path.push_back({static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(j)});
    if (i == 0 && j == 0) break;
    const double even = i > 0 && j > 0 ? value(i - 1, j - 1) : kFar, up = i > 0 ? value(i - 1, j) : kFar,
                 left = j > 0 ? value(i, j - 1) : kFar;
    if (even <= std::min(up, left) + costs.distortion_n) {
      --i;
      --j;
    } else if (up <= left) {
      --i;
    } else {
      --j;
    }
  }
  std::reverse(r.path.begin(), r.path.end());
  return r;
}

std::vector<double> slopes(std::span<const double> force_n, double rate_hz) {
  const std::size_t n = force_n.size();
  std::vector<double> s(n, 0);
  for (std::size_t i = 0; i < n && n > 1; ++i) {
    const std::size_t a = i > 0 ? i - 1 : 0, b = std::min(n - 1, i + 1);
    s[i] = (force_n[b] - force_n[a]) * rate_hz / static_cast<double>(b - a);
  }
  return s;
}

}  // namespace osteo::inline assessment::experiment
