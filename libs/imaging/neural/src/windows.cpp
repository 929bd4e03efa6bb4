#include "osteo/imaging/neural/detail/windows.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "osteo/core/base/parallel.h"
#include "osteo/imaging/neural/detail/half.h"

namespace osteo::inline imaging {
namespace {

constexpr double kAnisotropy = 3;
constexpr int kPad = 12;  // repeated edge values, as scipy.ndimage does before its filter

double centre_of(int n, int size, int to) {
  return static_cast<double>(size) / to * (n + 0.5) - 0.5;
}

// Coefficients of the cubic B-spline through the values, in place; mirrored at its ends.
// M. Unser, Splines: a perfect fit for signal and image processing, IEEE Signal Process. Mag. 1999.
void filter(std::vector<double>& c) {
  const double pole = std::sqrt(3.0) - 2;
  const std::size_t n = c.size();
  for (double& v : c) v *= 6;
  double sum = c[0], power = pole;
  for (std::size_t i = 1; i < n; ++i, power *= pole) sum += power * c[i];
  c[0] = sum;
  for (std::size_t i = 1; i < n; ++i) c[i] += pole * c[i - 1];
  c[n - 1] = pole / (pole * pole - 1) * (c[n - 1] + pole * c[n - 2]);
  for (std::size_t i = n - 1; i-- > 0;) c[i] = pole * (c[i + 1] - c[i]);
}

// Each line along `axis` becomes `to` long.
template <class Line>
std::vector<float> along(const std::vector<float>& values, Axes& size, std::size_t axis, int to, const Context& context,
                         const Line& line) {
  const int from = size[axis];
  const std::size_t inner = axis == 2   ? 1
                            : axis == 1 ? static_cast<std::size_t>(size[2])
                                        : static_cast<std::size_t>(size[1]) * static_cast<std::size_t>(size[2]);
  const std::size_t lines = voxels_of(size) / static_cast<std::size_t>(from);
  Axes after = size;
  after[axis] = to;
  std::vector<float> out(voxels_of(after));
  parallel_for(lines, 256, context.threads, [&](std::size_t begin, std::size_t end) {
    context.check_cancelled();
    std::vector<double> in(static_cast<std::size_t>(from)), result(static_cast<std::size_t>(to));
    for (std::size_t l = begin; l < end; ++l) {
      const std::size_t outer = l / inner, within = l % inner;
      for (std::size_t i = 0; i < in.size(); ++i)
        in[i] = static_cast<double>(values[(outer * in.size() + i) * inner + within]);
      line(in, result);
      for (std::size_t i = 0; i < result.size(); ++i)
        out[(outer * result.size() + i) * inner + within] = static_cast<float>(result[i]);
    }
  });
  size = after;
  return out;
}

void cubic_line(const std::vector<double>& in, std::vector<double>& out) {
  const int size = static_cast<int>(in.size()), to = static_cast<int>(out.size());
  std::vector<double> c(in.size() + 2 * kPad);
  for (std::size_t i = 0; i < c.size(); ++i)
    c[i] = in[static_cast<std::size_t>(std::clamp(static_cast<int>(i) - kPad, 0, size - 1))];
  filter(c);
  for (int n = 0; n < to; ++n) {
    const double at = centre_of(n, size, to) + kPad;
    const auto i = static_cast<std::size_t>(std::floor(at));
    const double t = at - std::floor(at), u = 1 - t;
    out[static_cast<std::size_t>(n)] = (u * u * u * c[i - 1] + (t * t * (3 * t - 6) + 4) * c[i] +
                                        (u * u * (3 * u - 6) + 4) * c[i + 1] + t * t * t * c[i + 2]) /
                                       6;
  }
}

void clamp_range(std::vector<float>& to, std::span<const float> range) {
  const auto [low, high] = std::minmax_element(range.begin(), range.end());
  for (float& v : to) v = std::clamp(v, *low, *high);
}

}  // namespace

int separate_axis(const std::array<double, 3>& from_mm, const std::array<double, 3>& to_mm) {
  for (const auto& mm : {from_mm, to_mm}) {
    const auto [low, high] = std::minmax_element(mm.begin(), mm.end());
    if (*high / *low <= kAnisotropy) continue;
    if (std::count_if(mm.begin(), mm.end(), [&](double v) { return *high / v == 1; }) != 1) return -1;
    return static_cast<int>(high - mm.begin());
  }
  return -1;
}

std::vector<float> resample_cubic(std::vector<float> values, const Axes& size, const Axes& to, int separate,
                                  const Context& context) {
  if (size == to) return values;
  Axes now = size;
  std::vector<float> out = values;
  for (std::size_t a = 0; a < 3; ++a) {
    if (static_cast<int>(a) != separate && now[a] != to[a])
      out = along(out, now, a, to[a], context, [](const auto& in, auto& line) { cubic_line(in, line); });
  }
  if (separate < 0) {
    clamp_range(out, values);
    return out;
  }
  // Each slice is held to its own range.
  const auto axis = static_cast<std::size_t>(separate);
  const auto each = [axis](std::vector<float>& v, const Axes& s, int at, const auto& visit) {
    Axes first{0, 0, 0}, end = s, n{};
    first[axis] = at;
    end[axis] = at + 1;
    for (n[0] = first[0]; n[0] < end[0]; ++n[0]) {
      for (n[1] = first[1]; n[1] < end[1]; ++n[1]) {
        for (n[2] = first[2]; n[2] < end[2]; ++n[2])
          visit(v[(static_cast<std::size_t>(n[0]) * static_cast<std::size_t>(s[1]) + static_cast<std::size_t>(n[1])) *
                      static_cast<std::size_t>(s[2]) +
                  static_cast<std::size_t>(n[2])]);
      }
    }
  };
  for (int slice = 0; slice < size[axis]; ++slice) {
    context.check_cancelled();
    float low = std::numeric_limits<float>::infinity(), high = -low;
    each(values, size, slice, [&](float v) { low = std::min(low, v), high = std::max(high, v); });
    each(out, now, slice, [&](float& v) { v = std::clamp(v, low, high); });
  }
  if (now[axis] == to[axis]) return out;
  const auto taps = linear_taps(now[axis], to[axis], true);
  return along(out, now, axis, to[axis], context, [&](const auto& in, auto& line) {
    for (std::size_t i = 0; i < line.size(); ++i) line[i] = in[static_cast<std::size_t>(taps[i].low)];
  });
}

std::vector<LinearTap> linear_taps(int size, int to, bool nearest) {
  std::vector<LinearTap> taps;
  for (int n = 0; n < to; ++n) {
    const double at = std::clamp(centre_of(n, size, to), 0.0, static_cast<double>(size - 1));
    const int low = static_cast<int>(std::floor(nearest ? at + 0.5 : at));
    taps.push_back({low, nearest ? low : std::min(low + 1, size - 1), nearest ? 0 : at - low});
  }
  return taps;
}

std::vector<std::int16_t> resample_labels(const std::vector<std::int16_t>& labels, const Axes& size, const Axes& to,
                                          int separate, const Context& context) {
  if (size == to) return labels;
  std::array<std::vector<LinearTap>, 3> taps, nearest;
  for (std::size_t a = 0; a < 3; ++a) {
    nearest[a] = linear_taps(size[a], to[a], true);
    taps[a] = static_cast<int>(a) == separate ? nearest[a] : linear_taps(size[a], to[a], false);
  }
  const auto at = [&](int z, int y, int x) {
    return labels[(static_cast<std::size_t>(z) * static_cast<std::size_t>(size[1]) + static_cast<std::size_t>(y)) *
                      static_cast<std::size_t>(size[2]) +
                  static_cast<std::size_t>(x)];
  };
  std::vector<std::int16_t> out(voxels_of(to));
  const auto plane = static_cast<std::size_t>(to[1]) * static_cast<std::size_t>(to[2]);
  parallel_for(static_cast<std::size_t>(to[0]), 1, context.threads, [&](std::size_t begin, std::size_t end) {
    context.check_cancelled();
    for (std::size_t n = begin * plane; n < end * plane; ++n) {
      const std::array<std::size_t, 3> v{n / plane,
                                         n / static_cast<std::size_t>(to[2]) % static_cast<std::size_t>(to[1]),
                                         n % static_cast<std::size_t>(to[2])};
      // Sums in the order in which scipy.ndimage takes them: ties are exact, and frequent.
      std::array<std::pair<std::int16_t, double>, 8> met;
      std::size_t count = 0;
      for (int corner = 0; corner < 8; ++corner) {
        std::array<int, 3> from{};
        double weight = 1;
        for (std::size_t a = 0; a < 3; ++a) {
          const LinearTap& t = taps[a][v[a]];
          const bool high = (corner >> (2 - a) & 1) != 0;
          from[a] = high ? t.high : t.low;
          weight *= high ? t.share : 1 - t.share;
        }
        const std::int16_t label = at(from[0], from[1], from[2]);
        std::size_t k = 0;
        while (k < count && met[k].first != label) ++k;
        if (k == count) met[count++] = {label, 0.0};
        met[k].second += weight;
      }
      double most = 0;
      for (std::size_t k = 0; k < count; ++k) most = std::max(most, met[k].second);
      const std::int16_t here = at(nearest[0][v[0]].low, nearest[1][v[1]].low, nearest[2][v[2]].low);
      std::int16_t lowest = std::numeric_limits<std::int16_t>::max();
      bool level = false;
      for (std::size_t k = 0; k < count; ++k) {
        if (met[k].second < most) continue;
        lowest = std::min(lowest, met[k].first);
        level = level || met[k].first == here;
      }
      out[n] = level ? here : lowest;
    }
  });
  return out;
}

std::vector<int> window_starts(int size, int window, double step) {
  const int count = static_cast<int>(std::ceil((size - window) / (window * step))) + 1;
  std::vector<int> starts;
  for (int n = 0; n < count; ++n)
    starts.push_back(
        count == 1 ? 0 : static_cast<int>(std::nearbyint(static_cast<double>(size - window) / (count - 1) * n)));
  return starts;
}

std::vector<std::uint16_t> window_weights(const Axes& window, bool flat) {
  std::array<std::vector<double>, 3> line;
  double most = 1;
  for (std::size_t a = 0; a < 3; ++a) {
    line[a].assign(static_cast<std::size_t>(window[a]), 1.0);
    if (flat && a == 0) continue;
    const double sigma = window[a] / 8.0;
    const int reach = static_cast<int>(4 * sigma + 0.5);
    double sum = 0;
    for (int i = -reach; i <= reach; ++i) sum += std::exp(-0.5 / (sigma * sigma) * i * i);
    for (int i = 0; i < window[a]; ++i) {
      const int from = i - window[a] / 2;
      line[a][static_cast<std::size_t>(i)] =
          std::abs(from) <= reach ? std::exp(-0.5 / (sigma * sigma) * from * from) / sum : 0;
    }
    most *= *std::max_element(line[a].begin(), line[a].end());
  }
  std::vector<std::uint16_t> weights;
  std::uint16_t least = 0xffff;
  for (const double z : line[0]) {
    for (const double y : line[1]) {
      for (const double x : line[2]) {
        const std::uint16_t h = half_from_float(static_cast<float>(z * y * x / (most / 10)));
        if (h != 0) least = std::min(least, h);
        weights.push_back(h);
      }
    }
  }
  for (std::uint16_t& h : weights) h = h == 0 ? least : h;
  return weights;
}

}  // namespace osteo::inline imaging
