#include "charts.h"

#include <algorithm>
#include <cmath>

#include "osteo/core/statistics/curves.h"

namespace osteo::inline assessment::study {
namespace {

using statistics::Summary;

// Dots of one group side by side where they would hide each other, in the order of values.
std::vector<sheet::Plot::At> beside(double x, std::span<const double> values, double apart) {
  std::vector<double> sorted(values.begin(), values.end());
  std::sort(sorted.begin(), sorted.end());
  std::vector<sheet::Plot::At> dots;
  int row = 0;
  for (std::size_t i = 0; i < sorted.size(); ++i) {
    row = i > 0 && sorted[i] - sorted[i - 1] < apart ? row + 1 : 0;
    dots.push_back({x - 0.05 * (row % 4), sorted[i]});
  }
  return dots;
}

}  // namespace

sheet::Plot::Axis axis_around(std::span<const double> values, const std::string& name) {
  double lo = 1e300, hi = -1e300;
  for (const double v : values) {
    if (!std::isfinite(v)) continue;
    lo = std::min(lo, v);
    hi = std::max(hi, v);
  }
  if (lo > hi) lo = 0, hi = 1;
  const double room = hi > lo ? 0.06 * (hi - lo) : std::max(1e-6, 0.1 * std::abs(lo));
  lo -= room;
  hi += room;
  const double raw = (hi - lo) / 4, magnitude = std::pow(10, std::floor(std::log10(raw)));
  double tick = magnitude;
  for (const double m : {1.0, 2.0, 5.0}) {
    if (m * magnitude <= raw) tick = m * magnitude;
  }
  return {lo, hi, tick, name, {}};
}

sheet::Plot groups_chart(const std::string& id, const std::string& outcome, const std::vector<std::string>& groups,
                         const std::vector<std::vector<double>>& people, double level) {
  sheet::Plot p;
  p.id = id;
  p.title = outcome;
  std::vector<double> all;
  for (const auto& g : people) all.insert(all.end(), g.begin(), g.end());
  std::vector<statistics::Interval> means(people.size());
  for (std::size_t g = 0; g < people.size(); ++g) {
    if (people[g].size() < 2) continue;
    means[g] = statistics::mean_interval(people[g], level);
    for (const double end : {means[g].lo, means[g].hi}) all.push_back(end);
  }
  p.y = axis_around(all, "");
  p.x = {0.4, static_cast<double>(groups.size()) + 0.6, 1, "", {}};
  const double apart = (p.y.to - p.y.from) / 60;
  for (std::size_t g = 0; g < groups.size(); ++g) {
    const double x = static_cast<double>(g) + 1;
    p.x.named.emplace_back(x, groups[g] + " (" + std::to_string(people[g].size()) + ")");
    if (people[g].empty()) continue;
    const Summary s = statistics::summarise(people[g]);
    p.boxes.push_back({x, 0.28, s.least, s.q1, s.median, s.q3, s.most});
    p.points.push_back({beside(x - 0.24, people[g], apart), Tone::quiet, true});
    if (!std::isfinite(means[g].lo)) continue;
    p.lines.push_back({{{x + 0.26, means[g].lo}, {x + 0.26, means[g].hi}}, Tone::bad, false});
    p.points.push_back({{{x + 0.26, s.mean}}, Tone::bad, false});
  }
  return p;
}

sheet::Plot scatter_chart(const std::string& id, const std::string& metric, const std::string& rating,
                          std::span<const double> x, std::span<const double> y, const std::vector<bool>& marked,
                          double level) {
  sheet::Plot p;
  p.id = id;
  p.title = metric;
  p.x = axis_around(x, metric);
  p.y = axis_around(y, rating);
  sheet::Plot::Points full, hollow;
  hollow.hollow = true;
  for (std::size_t i = 0; i < x.size(); ++i) (marked[i] ? full : hollow).at.push_back({x[i], y[i]});
  p.points = {full, hollow};
  const statistics::FittedLine line = statistics::fitted_line(x, y, level);
  if (x.size() < 5 || !std::isfinite(line.slope)) return p;
  const auto [lo, hi] = std::minmax_element(x.begin(), x.end());
  sheet::Plot::Area band;
  std::vector<sheet::Plot::At> upper;
  constexpr int kSteps = 24;
  for (int s = 0; s <= kSteps; ++s) {
    const double at = *lo + (*hi - *lo) * s / kSteps;
    const statistics::Estimate e = line.at(at);
    band.at.push_back({at, e.interval.lo});
    upper.push_back({at, e.interval.hi});
  }
  band.at.insert(band.at.end(), upper.rbegin(), upper.rend());
  p.areas.push_back(band);
  p.lines.push_back({{{*lo, line.at(*lo).value}, {*hi, line.at(*hi).value}}, Tone::bad, false});
  return p;
}

sheet::Plot roc_chart(const std::string& id, const std::string& outcome, const statistics::Roc& roc) {
  sheet::Plot p;
  p.id = id;
  p.title = outcome;
  p.x = {0, 1, 0.25, "false positive", {}};
  p.y = {0, 1, 0.25, "true positive", {}};
  p.lines.push_back({{{0, 0}, {1, 1}}, Tone::quiet, true});
  sheet::Plot::Line curve{{}, Tone::bad, false};
  for (const auto& c : roc.curve) curve.at.push_back({c.false_positive, c.true_positive});
  p.lines.push_back(curve);
  p.points.push_back({{{roc.best.false_positive, roc.best.true_positive}}, Tone::bad, false});
  return p;
}

sheet::Plot agreement_chart(const std::string& id, const std::string& title, std::span<const double> first,
                            std::span<const double> second) {
  sheet::Plot p;
  p.id = id;
  p.title = title;
  std::vector<double> means, differences;
  for (std::size_t i = 0; i < first.size(); ++i) {
    means.push_back((first[i] + second[i]) / 2);
    differences.push_back(first[i] - second[i]);
  }
  const double bias = statistics::mean(differences), sd = std::sqrt(statistics::variance(differences));
  std::vector<double> ends = differences;
  if (std::isfinite(sd)) {
    for (const double sign : {-1.96, 1.96}) ends.push_back(bias + sign * sd);
  }
  p.x = axis_around(means, "mean of both");
  p.y = axis_around(ends, "first less second");
  p.lines.push_back({{{p.x.from, bias}, {p.x.to, bias}}, Tone::bad, false});
  if (std::isfinite(sd)) {
    for (const double sign : {-1.96, 1.96})
      p.lines.push_back({{{p.x.from, bias + sign * sd}, {p.x.to, bias + sign * sd}}, Tone::bad, true});
  }
  sheet::Plot::Points dots;
  dots.hollow = true;
  std::vector<sheet::Plot::At> seen;
  for (std::size_t i = 0; i < means.size(); ++i) {
    const sheet::Plot::At at{means[i], differences[i]};
    const auto same = static_cast<double>(std::count(seen.begin(), seen.end(), at));
    seen.push_back(at);
    dots.at.push_back({at[0] + 0.012 * same * (p.x.to - p.x.from), at[1]});
  }
  p.points.push_back(dots);
  return p;
}

SheetBlocks in_rows(std::vector<sheet::Plot> plots) {
  SheetBlocks rows;
  for (std::size_t i = 0; i < plots.size(); i += 2) {
    sheet::Columns row;
    for (std::size_t c = i; c < i + 2; ++c) {
      SheetBlocks column;
      if (c < plots.size()) column.push_back({std::move(plots[c])});
      row.columns.push_back(std::move(column));
    }
    rows.push_back({std::move(row)});
  }
  return rows;
}

}  // namespace osteo::inline assessment::study
