// Measured motion: its table, and a single swing fitted to it.
#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "osteo/core/base/csv.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/param.h"
#include "osteo/simulation/tissue/damping.h"

namespace osteo::inline simulation {
namespace {

constexpr double kTurn = 2 * std::numbers::pi;
constexpr double kByChance = 20;  // how much better than no swing, by variances (F of 2 and many)

// What is left of channels after the best a, b, c, d for that decay and frequency (w = 0: one that only dies down,
// without b).
class SwingCost {
 public:
  explicit SwingCost(const MeasuredMotion& motion) : motion_(motion) {
    begin_ = 1e300;
    double end = -1e300;
    for (const auto& c : motion.channels) {
      values_ += c.time_s.size();
      if (c.time_s.empty()) continue;
      begin_ = std::min(begin_, c.time_s.front());
      end = std::max(end, c.time_s.back());
    }
    span_ = end - begin_;
  }
  [[nodiscard]] double span() const { return span_; }
  [[nodiscard]] std::size_t values() const { return values_; }
  [[nodiscard]] double operator()(double decay, double w) const {
    double left = 0;
    for (const auto& c : motion_.channels) left += of(c, decay, w, true);
    return left;
  }
  // Of mean and trend alone.
  [[nodiscard]] double trend() const {
    double left = 0;
    for (const auto& c : motion_.channels) left += of(c, 0, 0, false);
    return left;
  }

 private:
  [[nodiscard]] double of(const MeasuredMotion::Channel& c, double decay, double w, bool dies) const {
    Eigen::Matrix4d a = Eigen::Matrix4d::Zero();
    Eigen::Vector4d b = Eigen::Vector4d::Zero();
    for (int pass = 0; pass < 2; ++pass) {
      if (pass == 1) {  // b holds the answer from here on
        for (int i = 0; i < 4; ++i) a(i, i) = a(i, i) * (1 + 1e-12) + 1e-300;
        b = a.ldlt().solve(b).eval();
      }
      double left = 0;
      for (std::size_t i = 0; i < c.mm.size(); ++i) {
        const double t = c.time_s[i] - begin_, e = dies ? std::exp(-decay * t) : 0;
        const Eigen::Vector4d row(e * std::cos(w * t), w > 0 ? e * std::sin(w * t) : 0, 1,
                                  span_ > 0 ? t / span_ - 0.5 : 0);
        if (pass == 0) {
          a += row * row.transpose();
          b += row * c.mm[i];
        } else {
          const double off = c.mm[i] - row.dot(b);
          left += off * off;
        }
      }
      if (pass == 1) return left;
    }
    return 0;
  }

  const MeasuredMotion& motion_;
  double begin_ = 0, span_ = 0;
  std::size_t values_ = 0;
};

}  // namespace

MeasuredMotion read_motion(std::string_view text, const std::string& name, std::uint32_t points, std::uint32_t point,
                           Vec3 along) {
  const Csv csv = read_csv(text, name);
  const std::string columns = "the columns are time_s, point (may be left out), and ux_mm, uy_mm, uz_mm or u_mm";
  std::optional<std::size_t> time, of_point;
  struct Column {
    std::size_t at;
    Vec3 along;
  };
  std::vector<Column> values;
  for (std::size_t c = 0; c < csv.columns.size(); ++c) {
    const std::string& called = csv.columns[c];
    if (called == "time_s") {
      time = c;
    } else if (called == "point") {
      of_point = c;
    } else if (called == "u_mm") {
      if (!(length(along) > 0)) throw csv.wrong(1, "u_mm is along no direction", "say along which: --along 0,0,1");
      values.push_back({c, normalized(along)});
    } else if (called == "ux_mm" || called == "uy_mm" || called == "uz_mm") {
      Vec3 axis{};
      axis[static_cast<std::size_t>(called[1] - 'x')] = 1;
      values.push_back({c, axis});
    } else {
      throw csv.wrong(1, "there is a column '" + called + "'", columns);
    }
  }
  if (!time) throw csv.wrong(1, "there is no column time_s", columns);
  if (values.empty()) throw csv.wrong(1, "there is no displacement", columns);
  const auto number = [&](const CsvRow& row, std::size_t column) {
    try {
      return parse_number(row.fields[column], csv.columns[column]);
    } catch (const Error&) {
      throw csv.wrong(row.line, csv.columns[column] + " is '" + row.fields[column] + "', no finite number",
                      "leave out lines without a measurement");
    }
  };
  MeasuredMotion motion;
  std::vector<std::uint32_t> of_block;  // point of each block of `values.size()` channels
  for (const CsvRow& row : csv.rows) {
    std::uint32_t p = point;
    if (of_point) {
      const int given = csv.whole(row, *of_point);
      if (given < 0 || static_cast<std::uint32_t>(given) >= points)
        throw csv.wrong(row.line,
                        "point " + std::to_string(given) + " is not one of the mesh's " + std::to_string(points),
                        "points are numbered from 0");
      p = static_cast<std::uint32_t>(given);
    }
    std::size_t block = static_cast<std::size_t>(std::find(of_block.begin(), of_block.end(), p) - of_block.begin());
    if (block == of_block.size()) {
      of_block.push_back(p);
      for (const Column& v : values) {
        motion.channels.push_back({p, v.along, csv.columns[v.at], {}, {}});
        if (of_point) motion.channels.back().name += " of point " + std::to_string(p);
      }
    }
    const double t = number(row, *time);
    for (std::size_t v = 0; v < values.size(); ++v) {
      auto& channel = motion.channels[block * values.size() + v];
      if (!channel.time_s.empty() && !(t > channel.time_s.back()))
        throw csv.wrong(row.line,
                        "time_s is " + row.fields[*time] +
                            " and does not rise (before: " + format_number(channel.time_s.back()) + ")",
                        of_point ? "sort the lines of each point by time"
                                 : "sort the lines by time; of several points it needs a column point");
      channel.time_s.push_back(t);
      channel.mm.push_back(number(row, values[v].at));
    }
  }
  if (motion.channels.empty()) throw csv.wrong(1, "there is no line under the names");
  return motion;
}

Swing swing_of(const MeasuredMotion& motion, double least_hz, double most_hz) {
  const SwingCost cost(motion);
  const double span = cost.span(), trend = cost.trend();
  Swing s;
  if (!(span > 0) || !(trend > 0)) return s;
  double best = 1e300, decay = 0, w = 0;
  const double step_hz = std::max(0.25 / span, (most_hz - least_hz) / 4000);
  for (double hz = least_hz; hz <= most_hz; hz += step_hz) {
    const double w_now = kTurn * hz;
    for (const double d : {0.0, 1 / span, 4 / span, 0.03 * w_now, 0.1 * w_now, 0.3 * w_now, 0.8 * w_now}) {
      if (const double c = cost(d, w_now); c < best) {
        best = c;
        decay = d;
        w = w_now;
      }
    }
  }
  // Either by itself, in ever smaller steps: they hardly depend on each other.
  double by_w = kTurn * step_hz, by_decay = std::max(1 / span, 0.2 * decay);
  for (int n = 0; n < 400 && (by_w > 1e-9 * w || by_decay > 1e-9 * w); ++n) {
    bool better = false;
    for (const auto& [dd, dw] : {std::pair{by_decay, 0.0}, {-by_decay, 0.0}, {0.0, by_w}, {0.0, -by_w}}) {
      const double d_now = decay + dd, w_now = w + dw;
      if (w_now < kTurn * least_hz || w_now > kTurn * most_hz || d_now < -2 / span || d_now > 4 * w_now) continue;
      if (const double c = cost(d_now, w_now); c < best) {
        best = c;
        decay = d_now;
        w = w_now;
        better = true;
      }
    }
    if (!better) {
      by_w /= 2;
      by_decay /= 2;
    }
  }
  double still = trend;
  for (double d = 0.1 / span; d < 200 / span; d *= 1.5) still = std::min(still, cost(d, 0));
  const double freedom = static_cast<double>(cost.values()) - 2 - 4 * static_cast<double>(motion.channels.size());
  s.decay_per_s = decay;
  s.hz = w / kTurn;
  s.residual_share = std::sqrt(best / trend);
  s.swings = freedom > 0 && (still - best) * freedom > 2 * kByChance * best && decay < w;
  return s;
}

}  // namespace osteo::inline simulation
