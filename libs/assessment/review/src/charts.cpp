#include "charts.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "osteo/simulation/bone/instrument.h"
#include "pictures.h"

namespace osteo::inline assessment::review {
namespace {

using Colour = sheet::Drawing::Colour;
constexpr Colour kInk{38, 42, 48}, kQuiet{112, 118, 126}, kRule{222, 222, 216}, kForce{92, 108, 128},
    kBand{214, 222, 230}, kAccent = kHiddenRgb, kSeen = kSeenRgb;

// A step of 1, 2 or 5 times a power of ten, about `wanted` of which make up the range.
double nice_step(double range, int wanted) {
  if (!(range > 0)) return 1;
  const double raw = range / wanted, power = std::pow(10, std::floor(std::log10(raw)));
  for (const double m : {1.0, 2.0, 5.0}) {
    if (raw <= m * power * 1.0001) return m * power;
  }
  return 10 * power;
}

double clock_step(double duration_s, int wanted) {
  for (const double s : {1.0, 2.0, 5.0, 10.0, 15.0, 30.0, 60.0, 120.0, 300.0, 600.0, 1200.0, 1800.0}) {
    if (duration_s / s <= wanted) return s;
  }
  return 3600;
}

}  // namespace

std::string clock(double s) {
  const auto whole = static_cast<long>(s + 1e-6);
  const long h = whole / 3600, min = whole / 60 % 60, sec = whole % 60;
  const std::string two = (sec < 10 ? ":0" : ":") + std::to_string(sec);
  if (h > 0) return std::to_string(h) + (min < 10 ? ":0" : ":") + std::to_string(min) + two;
  return std::to_string(min) + two;
}

sheet::Drawing timeline_chart(const Review& r) {
  const Timeline& line = r.timeline;
  sheet::Drawing d;
  d.id = "timeline-still";
  d.alt = "Force, distance to the nearest structure, bone removed and speed over " + told_seconds(line.duration_s());
  d.width = 720;
  constexpr double kLeft = 100, kRight = 12, kLane = 44, kGap = 15;
  const double w = d.width - kLeft - kRight, duration = std::max(1.0, line.duration_s());
  const auto px = [&](double s) { return kLeft + w * std::clamp(s / duration, 0.0, 1.0); };
  const std::size_t columns = std::max<std::size_t>(1, std::min<std::size_t>(line.size(), 648));
  const auto each = [&](const auto& take) {
    for (std::size_t c = 0; c < columns; ++c) {
      const std::size_t from = c * line.size() / columns, to = std::max(from + 1, (c + 1) * line.size() / columns);
      if (from < line.size())
        take(kLeft + w * static_cast<double>(c) / static_cast<double>(columns), from, std::min(to, line.size()));
    }
  };
  const double column = w / static_cast<double>(columns);
  double y = 14;
  const auto lane = [&](const std::string& name, const std::string& unit, double most, double step) {
    d.text(0, y + 10, name, 9.5, kInk, -1, true);
    d.text(0, y + 21, unit, 8.5, kQuiet);
    for (double v = 0; v <= most * 1.0001; v += step) {
      const double at = y + kLane * (1 - v / most);
      d.line({{kLeft, at}, {kLeft + w, at}}, kRule, 0.6);
      d.text(kLeft - 4, at + 3, format_number(std::round(v * 100) / 100), 8, kQuiet, 1);
    }
  };
  const auto peak = [](const std::vector<float>& v) {
    return v.empty() ? 0.0 : static_cast<double>(*std::max_element(v.begin(), v.end()));
  };

  // Events: marks above all.
  for (const TimelineEvent& e : line.events) {
    if (e.kind == EventKind::gap)
      d.box(px(e.t_s), y, std::max(0.8, px(e.end_s) - px(e.t_s)), 4 * (kLane + kGap), kRule, 0.8);
  }
  for (const TimelineEvent& e : line.events) {
    const bool bad = e.kind == EventKind::injury;
    if (e.kind == EventKind::instrument || e.kind == EventKind::gap) continue;
    d.line({{px(e.t_s), 2}, {px(e.t_s), 10}}, bad ? kAccent : kQuiet, bad ? 1.6 : 0.8);
  }

  double most = std::max(0.5, peak(line.force_n));
  double step = nice_step(most, 2);
  most = std::ceil(most / step) * step;
  lane("Force", "N, of the burr", most, step);
  std::vector<std::array<double, 2>> shape{{kLeft, y + kLane}};
  each([&](double x, std::size_t from, std::size_t to) {
    const double v = static_cast<double>(*std::max_element(line.force_n.begin() + static_cast<std::ptrdiff_t>(from),
                                                           line.force_n.begin() + static_cast<std::ptrdiff_t>(to)));
    shape.push_back({x, y + kLane * (1 - v / most)});
    shape.push_back({x + column, y + kLane * (1 - v / most)});
  });
  shape.push_back({kLeft + w, y + kLane});
  d.area(shape, kForce, 0.75);

  y += kLane + kGap;
  lane("Distance", "mm, nearest structure", 8, 4);
  d.box(kLeft, y + kLane * 0.75, w, kLane * 0.25, kAccent, 0.10);
  std::vector<std::array<double, 2>> run;
  const auto end_run = [&] {
    if (run.size() > 1) d.line(run, kInk, 1);
    run.clear();
  };
  each([&](double x, std::size_t from, std::size_t to) {
    float least = std::numeric_limits<float>::quiet_NaN();
    for (std::size_t n = from; n < to; ++n) {
      if (!(least <= line.distance_mm[n])) least = line.distance_mm[n];
    }
    if (!std::isfinite(least)) return end_run();
    const double at = y + kLane * (1 - std::clamp(static_cast<double>(least), -0.5, 8.0) / 8);
    run.push_back({x, at});
    run.push_back({x + column, at});
  });
  end_run();

  y += kLane + kGap;
  std::vector<std::array<double, 3>> bars;  // x, seen (and unknown), hidden: mm3 a second
  double most_mm3 = 0.1;
  each([&](double x, std::size_t from, std::size_t to) {
    double seen = 0, hidden = 0;
    for (std::size_t n = from; n < to; ++n) {
      seen += static_cast<double>(line.seen_mm3[n] + line.unknown_mm3[n]);
      hidden += static_cast<double>(line.hidden_mm3[n]);
    }
    const double per_s = Timeline::kRateHz / static_cast<double>(to - from);
    bars.push_back({x, seen * per_s, hidden * per_s});
    most_mm3 = std::max(most_mm3, (seen + hidden) * per_s);
  });
  step = nice_step(most_mm3, 2);
  most_mm3 = std::ceil(most_mm3 / step) * step;
  lane("Bone", "mm³/s; orange unseen", most_mm3, step);
  for (const bool all : {true, false}) {
    shape.assign({{kLeft, y + kLane}});
    for (const auto& [x, seen, hidden] : bars) {
      const double at = y + kLane * (1 - (hidden + (all ? seen : 0)) / most_mm3);
      shape.push_back({x, at});
      shape.push_back({x + column, at});
    }
    shape.push_back({kLeft + w, y + kLane});
    d.area(shape, all ? kSeen : kAccent);
  }

  y += kLane + kGap;
  // A few jumps must not flatten all the rest.
  std::vector<float> sorted = line.speed_mm_s;
  std::sort(sorted.begin(), sorted.end());
  double fast = sorted.empty() ? 1 : std::max(1.0, 1.2 * static_cast<double>(sorted[(sorted.size() - 1) * 98 / 100]));
  step = nice_step(fast, 2);
  fast = std::ceil(fast / step) * step;
  lane("Speed", "mm/s, of the tip", fast, step);
  shape.assign({{kLeft, y + kLane}});
  each([&](double x, std::size_t from, std::size_t to) {
    double v = 0;
    for (std::size_t n = from; n < to; ++n)
      v += static_cast<double>(line.speed_mm_s[n]) / static_cast<double>(to - from);
    const double at = y + kLane * (1 - std::min(1.0, v / fast));
    shape.push_back({x, at});
    shape.push_back({x + column, at});
  });
  shape.push_back({kLeft + w, y + kLane});
  d.area(shape, kForce, 0.4);

  y += kLane + 8;
  d.text(0, y + 9, "In hand", 9.5, kInk, -1, true);
  std::size_t from = 0;
  int shade = 0;
  for (std::size_t n = 1; n <= line.size(); ++n) {
    if (n < line.size() && line.tool[n] == line.tool[from]) continue;
    const double x = px(static_cast<double>(from) / Timeline::kRateHz),
                 x1 = px(static_cast<double>(n) / Timeline::kRateHz);
    d.box(x, y, std::max(0.5, x1 - x), 12, shade++ % 2 == 0 ? kBand : kRule);
    const std::string name = line.tool[from] == Timeline::kPlate ? "a plate" : instrument_of(line.tool[from]).name;
    if (x1 - x > 4.6 * static_cast<double>(name.size()) + 4) d.text(x + 3, y + 9, name, 8.5, kInk);
    from = n;
  }
  y += 12;
  const double tick = clock_step(duration, 10);
  for (double s = 0; s <= duration * 1.0001; s += tick) {
    d.line({{px(s), y + 2}, {px(s), y + 5}}, kQuiet, 0.8);
    d.text(px(s), y + 15, clock(s), 8.5, kQuiet, 0);
  }
  d.height = y + 20;
  return d;
}

sheet::Drawing profile_chart(const ForceProfile& p, bool reference) {
  sheet::Drawing d;
  d.id = "profile";
  d.alt = "Force by distance to the " + p.structure;
  d.width = 340;
  d.height = 210;
  constexpr double kLeft = 34, kTop = 22, kW = 296, kH = 150, kFar = 8;
  double most = 0.4;
  for (const auto* const curve : {&p.most, &p.experts_most}) {
    for (const auto& s : *curve) most = std::max(most, s.value * 1.15);
  }
  const double step = nice_step(most, 4);
  most = std::ceil(most / step) * step;
  const auto at = [&](double mm, double n) {
    return std::array<double, 2>{kLeft + kW * std::clamp(mm, 0.0, kFar) / kFar,
                                 kTop + kH * (1 - std::clamp(n / most, 0.0, 1.0))};
  };
  d.text(0, 12, p.structure, 11, kInk, -1, true);
  d.text(kLeft + kW, 12, told_seconds(p.drilled_s) + " of drilling near it", 9, kQuiet, 1);
  for (double v = 0; v <= most * 1.0001; v += step) {
    d.line({at(0, v), at(kFar, v)}, kRule, 0.6);
    d.text(kLeft - 5, at(0, v)[1] + 3, format_number(std::round(v * 1000) / 1000), 8.5, kQuiet, 1);
  }
  for (int mm = 0; mm <= 8; mm += 2) d.text(at(mm, 0)[0], kTop + kH + 13, std::to_string(mm), 8.5, kQuiet, 0);
  d.text(kLeft + kW / 2, kTop + kH + 26, "mm from its surface", 8.5, kQuiet, 0);
  d.text(0, kTop + 4, "N", 8.5, kQuiet);
  // Steps as they are; a curve holds to the end.
  const auto steps = [&](const std::vector<IsotonicQuantile::Point>& curve) {
    std::vector<std::array<double, 2>> line;
    for (std::size_t n = 0; n < curve.size(); ++n) {
      line.push_back(at(std::max(0.0, curve[n].distance_mm), curve[n].value));
      line.push_back(at(n + 1 < curve.size() ? std::max(0.0, curve[n + 1].distance_mm) : kFar, curve[n].value));
    }
    return line;
  };
  if (!p.experts_most.empty()) {
    auto band = steps(p.experts_most);
    if (!band.empty()) {
      band.push_back({at(kFar, 0)});
      band.push_back({at(0, 0)[0] < band.front()[0] ? band.front()[0] : at(0, 0)[0], at(0, 0)[1]});
      d.area(band, kBand, 0.9);
    }
    d.line(steps(p.experts_middle), kSeen, 1.2, true);
  }
  for (const auto& s : p.samples) {
    const auto dot = at(static_cast<double>(s[0]), static_cast<double>(s[1]));
    d.box(dot[0] - 0.6, dot[1] - 0.6, 1.2, 1.2, kForce, 0.35);
  }
  d.line(steps(p.middle), kInk, 1.2, true);
  d.line(steps(p.most), kAccent, 1.8);
  d.text(kLeft + kW, d.height - 2,
         reference ? (p.experts_most.empty() ? "experts drilled less than a second here"
                                             : "grey: nine in ten of the experts' moments")
                   : "no reference: no band of experts",
         8, kQuiet, 1);
  d.text(0, d.height - 2, "orange: nine in ten of yours; dashed: half", 8, kQuiet);
  return d;
}

std::string_view plain_name(std::string_view metric) {
  struct Row {
    MetricName metric;
    std::string_view plain;
  };
  static constexpr Row kRows[] = {{"items_passed", "items passed"},
                                  {"seen_share", "bone seen as it went"},
                                  {"hidden_mm3", "removed unseen"},
                                  {"hidden_near_mm3", "unseen, near structures"},
                                  {"touches", "touches of structures"},
                                  {"injured_s", "turning burr in structures"},
                                  {"clearance_mm", "nearest to any structure"},
                                  {"force_p95_n", "force, 95 % are below"},
                                  {"force_peak_n", "hardest press"},
                                  {"duration_s", "time"},
                                  {"drilling_s", "time drilling"},
                                  {"removed_mm3", "bone removed"},
                                  {"rate_mm3_per_s", "bone for each second"},
                                  {"path_mm", "way of the tip"}};
  for (const Row& r : kRows) {
    if (r.metric.row().name == metric) return r.plain;
  }
  return metric;
}

std::string told_value(const MetricRow& row, double v) {
  if (row.unit == "s") return told_seconds(v);
  if (row.name.ends_with("_share")) return format_number(std::round(1000 * v) / 10) + " %";
  const std::string unit = unit_text(row.unit);
  return told_number(v) + (unit.empty() ? "" : " " + unit);
}

sheet::Drawing comparison_chart(const Comparison& c) {
  sheet::Drawing d;
  d.id = "compare-" + std::string(c.row->name);
  d.width = 720;
  d.height = 26;
  std::vector<double> all = c.experts;
  all.insert(all.end(), c.novices.begin(), c.novices.end());
  for (const auto& v : c.earlier) {
    if (v) all.push_back(*v);
  }
  if (c.value) all.push_back(*c.value);
  if (all.empty()) return d;
  double lo = *std::min_element(all.begin(), all.end()), hi = *std::max_element(all.begin(), all.end());
  if (hi - lo < 1e-9 * std::max(1.0, std::abs(hi))) {
    lo -= 0.5 * std::max(0.1, std::abs(lo));
    hi += 0.5 * std::max(0.1, std::abs(hi));
  }
  constexpr double kFrom = 190, kTo = 560, kMid = 13;
  const auto px = [&](double v) { return kFrom + (kTo - kFrom) * (v - lo) / (hi - lo); };
  d.text(0, kMid + 3.5, std::string(plain_name(c.row->name)), 11, kInk);
  d.line({{kFrom - 6, kMid}, {kTo + 6, kMid}}, kRule, 1);
  const std::string better = c.row->better == Better::higher  ? "more is better"
                             : c.row->better == Better::lower ? "less is better"
                                                              : "";
  std::string alt = std::string(plain_name(c.row->name)) + ": ";
  if (!c.experts.empty()) {
    const auto [a, b] = std::minmax_element(c.experts.begin(), c.experts.end());
    d.box(std::min(px(*a), px(*b)) - 4, kMid - 7, std::abs(px(*b) - px(*a)) + 8, 14, kBand);
    alt += "experts " + told_value(*c.row, *a) + " to " + told_value(*c.row, *b) + "; ";
  }
  for (const double v : c.novices) d.line({{px(v), kMid - 4}, {px(v), kMid + 4}}, kQuiet, 1);
  for (const double v : c.experts) d.line({{px(v), kMid - 6}, {px(v), kMid + 6}}, kSeen, 1.4);
  // The earlier the paler.
  for (std::size_t n = 0; n < c.earlier.size(); ++n) {
    if (!c.earlier[n]) continue;
    const double x = px(*c.earlier[n]),
                 share = 0.25 + 0.5 * static_cast<double>(n + 1) / static_cast<double>(c.earlier.size());
    d.area({{x, kMid - 4}, {x + 4, kMid}, {x, kMid + 4}, {x - 4, kMid}}, kInk, share);
  }
  if (c.value) {
    const double x = px(*c.value);
    d.area({{x, kMid - 7}, {x + 7, kMid}, {x, kMid + 7}, {x - 7, kMid}}, kAccent);
    alt += "this session " + told_value(*c.row, *c.value);
  } else {
    alt += "not measured in this session";
  }
  d.text(kTo + 18, kMid + 3.5, c.value ? told_value(*c.row, *c.value) : "not measured", 11, c.value ? kInk : kQuiet, -1,
         c.value.has_value());
  d.text(720, kMid + 3, better, 8.5, kQuiet, 1);
  d.alt = alt;
  return d;
}

}  // namespace osteo::inline assessment::review
