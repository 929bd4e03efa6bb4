#include "charts.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "osteo/core/base/translate.h"
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

ReviewTexts texts_of(const Review& r) {
  const ReviewTexts& t = r.shown;
  const bool none = t.labels.empty() && t.left_out.empty() && t.findings.list.empty() && t.findings.summary.empty();
  return none ? ReviewTexts{r.labels, r.left_out, r.findings} : t;
}

const std::string& shown_caption(const ReviewPicture& p) {
  return p.shown.empty() ? p.caption : p.shown;
}

std::string clock(double s) {
  const auto whole = static_cast<long>(s + 1e-6);
  const long h = whole / 3600, min = whole / 60 % 60, sec = whole % 60;
  const std::string two = (sec < 10 ? ":0" : ":") + std::to_string(sec);
  if (h > 0) return std::to_string(h) + (min < 10 ? ":0" : ":") + std::to_string(min) + two;
  return std::to_string(min) + two;
}

namespace {

// Lanes below each other over one axis of time.
class TimelineChart {
 public:
  explicit TimelineChart(const Timeline& line) : line_(line) {
    d_.id = "timeline-still";
    d_.alt = filled(tr("Force, distance to the nearest structure, bone removed and speed over {time}"),
                    {{"time", reported_seconds(line.duration_s())}});
    d_.width = 720;
    w_ = d_.width - kLeft - kRight;
    duration_ = std::max(1.0, line.duration_s());
    columns_ = std::max<std::size_t>(1, std::min<std::size_t>(line.size(), 648));
    column_ = w_ / static_cast<double>(columns_);
  }
  sheet::Drawing draw() {
    mark_events();
    draw_force();
    y_ += kLane + kGap;
    draw_distance();
    y_ += kLane + kGap;
    draw_bone();
    y_ += kLane + kGap;
    draw_speed();
    y_ += kLane + 8;
    draw_instruments();
    y_ += 12;
    draw_clock();
    d_.height = y_ + 20;
    return std::move(d_);
  }

 private:
  static constexpr double kLeft = 100, kRight = 12, kLane = 44, kGap = 15;

  [[nodiscard]] double px(double s) const { return kLeft + w_ * std::clamp(s / duration_, 0.0, 1.0); }
  // take(x, from, to) for each column of the picture with the steps of time in it.
  template <typename Take>
  void each(const Take& take) const {
    for (std::size_t c = 0; c < columns_; ++c) {
      const std::size_t from = c * line_.size() / columns_, to = std::max(from + 1, (c + 1) * line_.size() / columns_);
      if (from < line_.size())
        take(kLeft + w_ * static_cast<double>(c) / static_cast<double>(columns_), from, std::min(to, line_.size()));
    }
  }
  // `most` of a lane and the step of its lines, both round.
  struct Scale {
    double most, step;
  };
  static Scale scale_of(double most) {
    const double step = nice_step(most, 2);
    return {std::ceil(most / step) * step, step};
  }
  void lane(const std::string& name, const std::string& unit, const Scale& scale) {
    d_.text(0, y_ + 10, name, 9.5, kInk, -1, true);
    d_.text(0, y_ + 21, unit, 8.5, kQuiet);
    for (double v = 0; v <= scale.most * 1.0001; v += scale.step) {
      const double at = height_of(v / scale.most);
      d_.line({{kLeft, at}, {kLeft + w_, at}}, kRule, 0.6);
      d_.text(kLeft - 4, at + 3, shown_figures(format_number(std::round(v * 100) / 100)), 8, kQuiet, 1);
    }
  }
  // Of a share of the lane's most.
  [[nodiscard]] double height_of(double share) const { return y_ + kLane * (1 - share); }

  // An area on the lane's floor, a step for each column.
  using Steps = std::vector<std::array<double, 2>>;
  [[nodiscard]] Steps begin_area() const { return {{kLeft, y_ + kLane}}; }
  void add_step(Steps& area, double x, double at) const {
    area.push_back({x, at});
    area.push_back({x + column_, at});
  }
  void end_area(Steps& area, Colour colour, double opacity) {
    area.push_back({kLeft + w_, y_ + kLane});
    d_.area(area, colour, opacity);
  }

  // Above all lanes; gaps of the recording behind them.
  void mark_events() {
    for (const TimelineEvent& e : line_.events) {
      if (e.kind == EventKind::gap)
        d_.box(px(e.t_s), y_, std::max(0.8, px(e.end_s) - px(e.t_s)), 4 * (kLane + kGap), kRule, 0.8);
    }
    for (const TimelineEvent& e : line_.events) {
      const bool bad = e.kind == EventKind::injury;
      if (e.kind == EventKind::instrument || e.kind == EventKind::gap) continue;
      d_.line({{px(e.t_s), 2}, {px(e.t_s), 10}}, bad ? kAccent : kQuiet, bad ? 1.6 : 0.8);
    }
  }

  void draw_force() {
    const auto& force = line_.force_n;
    const double peak = force.empty() ? 0.0 : static_cast<double>(*std::max_element(force.begin(), force.end()));
    const Scale scale = scale_of(std::max(0.5, peak));
    lane(tr("Force"), tr("N, of the burr"), scale);
    Steps shape = begin_area();
    each([&](double x, std::size_t from, std::size_t to) {
      const double v = static_cast<double>(*std::max_element(force.begin() + static_cast<std::ptrdiff_t>(from),
                                                             force.begin() + static_cast<std::ptrdiff_t>(to)));
      add_step(shape, x, height_of(v / scale.most));
    });
    end_area(shape, kForce, 0.75);
  }

  // The least of each column; where none is known the line ends.
  void draw_distance() {
    lane(tr("Clearance"), tr("mm, nearest structure"), {8, 4});
    d_.box(kLeft, y_ + kLane * 0.75, w_, kLane * 0.25, kAccent, 0.10);
    Steps run;
    const auto end_run = [&] {
      if (run.size() > 1) d_.line(run, kInk, 1);
      run.clear();
    };
    each([&](double x, std::size_t from, std::size_t to) {
      float least = std::numeric_limits<float>::quiet_NaN();
      for (std::size_t n = from; n < to; ++n) {
        if (!(least <= line_.distance_mm[n])) least = line_.distance_mm[n];
      }
      if (!std::isfinite(least)) return end_run();
      add_step(run, x, height_of(std::clamp(static_cast<double>(least), -0.5, 8.0) / 8));
    });
    end_run();
  }

  void draw_bone() {
    std::vector<std::array<double, 3>> bars;  // x, seen (and unknown), hidden: mm3 a second
    double most_mm3 = 0.1;
    each([&](double x, std::size_t from, std::size_t to) {
      double seen = 0, hidden = 0;
      for (std::size_t n = from; n < to; ++n) {
        seen += static_cast<double>(line_.seen_mm3[n] + line_.unknown_mm3[n]);
        hidden += static_cast<double>(line_.hidden_mm3[n]);
      }
      const double per_s = Timeline::kRateHz / static_cast<double>(to - from);
      bars.push_back({x, seen * per_s, hidden * per_s});
      most_mm3 = std::max(most_mm3, (seen + hidden) * per_s);
    });
    const Scale scale = scale_of(most_mm3);
    lane(tr("Bone"), tr("mm³/s; orange unseen"), scale);
    for (const bool all : {true, false}) {
      Steps shape = begin_area();
      for (const auto& [x, seen, hidden] : bars)
        add_step(shape, x, height_of((hidden + (all ? seen : 0)) / scale.most));
      end_area(shape, all ? kSeen : kAccent, 1);
    }
  }

  void draw_speed() {
    // A few jumps must not flatten all the rest.
    std::vector<float> sorted = line_.speed_mm_s;
    std::sort(sorted.begin(), sorted.end());
    const Scale scale =
        scale_of(sorted.empty() ? 1 : std::max(1.0, 1.2 * static_cast<double>(sorted[(sorted.size() - 1) * 98 / 100])));
    lane(tr("Tip speed"), tr("mm/s"), scale);
    Steps shape = begin_area();
    each([&](double x, std::size_t from, std::size_t to) {
      double v = 0;
      for (std::size_t n = from; n < to; ++n)
        v += static_cast<double>(line_.speed_mm_s[n]) / static_cast<double>(to - from);
      add_step(shape, x, height_of(std::min(1.0, v / scale.most)));
    });
    end_area(shape, kForce, 0.4);
  }

  void draw_instruments() {
    d_.text(0, y_ + 9, tr("In hand"), 9.5, kInk, -1, true);
    std::size_t from = 0;
    int shade = 0;
    for (std::size_t n = 1; n <= line_.size(); ++n) {
      if (n < line_.size() && line_.tool[n] == line_.tool[from]) continue;
      const double x = px(static_cast<double>(from) / Timeline::kRateHz),
                   x1 = px(static_cast<double>(n) / Timeline::kRateHz);
      d_.box(x, y_, std::max(0.5, x1 - x), 12, shade++ % 2 == 0 ? kBand : kRule);
      const std::string name =
          line_.tool[from] == Timeline::kPlate ? tr("a plate") : tr_sized(instrument_of(line_.tool[from]).name);
      if (x1 - x > 4.6 * static_cast<double>(name.size()) + 4) d_.text(x + 3, y_ + 9, name, 8.5, kInk);
      from = n;
    }
  }

  void draw_clock() {
    const double tick = clock_step(duration_, 10);
    for (double s = 0; s <= duration_ * 1.0001; s += tick) {
      d_.line({{px(s), y_ + 2}, {px(s), y_ + 5}}, kQuiet, 0.8);
      d_.text(px(s), y_ + 15, clock(s), 8.5, kQuiet, 0);
    }
  }

  const Timeline& line_;
  sheet::Drawing d_;
  double w_, duration_, column_;
  std::size_t columns_;
  double y_ = 14;  // the top of the lane that is drawn
};

}  // namespace

sheet::Drawing timeline_chart(const Review& r) {
  return TimelineChart(r.timeline).draw();
}

sheet::Drawing profile_chart(const ForceProfile& p, bool reference) {
  sheet::Drawing d;
  d.id = "profile";
  d.alt = filled(tr("Force by distance to the {structure}"), {{"structure", tr(p.structure)}});
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
  d.text(0, 12, tr(p.structure), 11, kInk, -1, true);
  d.text(kLeft + kW, 12, filled(tr("{time} of drilling near it"), {{"time", reported_seconds(p.drilled_s)}}), 9, kQuiet,
         1);
  for (double v = 0; v <= most * 1.0001; v += step) {
    d.line({at(0, v), at(kFar, v)}, kRule, 0.6);
    d.text(kLeft - 5, at(0, v)[1] + 3, shown_figures(format_number(std::round(v * 1000) / 1000)), 8.5, kQuiet, 1);
  }
  for (int mm = 0; mm <= 8; mm += 2) d.text(at(mm, 0)[0], kTop + kH + 13, std::to_string(mm), 8.5, kQuiet, 0);
  d.text(kLeft + kW / 2, kTop + kH + 26, tr("mm from its surface"), 8.5, kQuiet, 0);
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
         reference ? (p.experts_most.empty() ? tr("experts drilled less than a second here")
                                             : tr("grey: nine in ten of the experts' moments"))
                   : tr("no reference: no band of experts"),
         8, kQuiet, 1);
  d.text(0, d.height - 2, tr("orange: nine in ten of yours; dashed: half"), 8, kQuiet);
  return d;
}

std::string_view plain_name(std::string_view metric) {
  struct Row {
    MetricName metric;
    std::string_view plain;
  };
  static constexpr Row kRows[] = {{"items_passed", tr_later("items passed")},
                                  {"seen_share", tr_later("bone seen as it went")},
                                  {"hidden_mm3", tr_later("removed unseen")},
                                  {"hidden_near_mm3", tr_later("unseen, near structures")},
                                  {"touches", tr_later("touches of structures")},
                                  {"injured_s", tr_later("rotating burr in structures")},
                                  {"clearance_mm", tr_later("nearest to any structure")},
                                  {"force_p95_n", tr_later("force, 95 % are below")},
                                  {"force_peak_n", tr_later("hardest press")},
                                  {"duration_s", tr_later("time")},
                                  {"drilling_s", tr_later("time drilling")},
                                  {"removed_mm3", tr_later("bone removed")},
                                  {"rate_mm3_per_s", tr_later("bone for each second")},
                                  {"path_mm", tr_later("way of the tip")}};
  for (const Row& r : kRows) {
    if (r.metric.row().name == metric) return r.plain;
  }
  return metric;
}

std::string reported_value(const MetricRow& row, double v) {
  if (row.unit == "s") return reported_seconds(v);
  if (row.name.ends_with("_share")) return shown_figures(format_number(std::round(1000 * v) / 10)) + " %";
  const std::string unit = unit_text(row.unit);
  return reported_number(v) + (unit.empty() ? "" : " " + unit);
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
  d.text(0, kMid + 3.5, tr(std::string(plain_name(c.row->name))), 11, kInk);
  d.line({{kFrom - 6, kMid}, {kTo + 6, kMid}}, kRule, 1);
  const std::string better = c.row->better == Better::higher  ? tr("more is better")
                             : c.row->better == Better::lower ? tr("less is better")
                                                              : "";
  std::string alt = tr(std::string(plain_name(c.row->name))) + ": ";
  if (!c.experts.empty()) {
    const auto [a, b] = std::minmax_element(c.experts.begin(), c.experts.end());
    d.box(std::min(px(*a), px(*b)) - 4, kMid - 7, std::abs(px(*b) - px(*a)) + 8, 14, kBand);
    alt += filled(tr("experts {from} to {to}"),
                  {{"from", reported_value(*c.row, *a)}, {"to", reported_value(*c.row, *b)}}) +
           "; ";
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
    alt += filled(tr("this session {value}"), {{"value", reported_value(*c.row, *c.value)}});
  } else {
    alt += tr("not measured in this session");
  }
  d.text(kTo + 18, kMid + 3.5, c.value ? reported_value(*c.row, *c.value) : tr("not measured"), 11,
         c.value ? kInk : kQuiet, -1, c.value.has_value());
  d.text(720, kMid + 3, better, 8.5, kQuiet, 1);
  d.alt = alt;
  return d;
}

}  // namespace osteo::inline assessment::review
