#include "figures.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "osteo/assessment/experiment/analysis.h"
#include "osteo/core/base/portable_math.h"
#include "osteo/core/statistics/curves.h"

namespace osteo::inline assessment::experiment {
namespace {

using At = sheet::Plot::At;

sheet::Plot over_time(const std::string& id, const std::string& title, double seconds, double most_n) {
  sheet::Plot p;
  p.id = id;
  p.title = title;
  p.x = {0, seconds, seconds > 12 ? 5.0 : 2.0, "s", {}};
  p.y = {0, std::ceil(most_n + 0.5), most_n > 6 ? 4.0 : 2.0, "N", {}};
  return p;
}
sheet::Plot::Line curve(const std::vector<double>& values, double seconds, Tone tone, bool dashed = false) {
  sheet::Plot::Line line{{}, tone, dashed};
  const std::size_t step = std::max<std::size_t>(1, values.size() / 300);
  for (std::size_t i = 0; i < values.size(); i += step)
    line.at.push_back({seconds * static_cast<double>(i) / static_cast<double>(values.size() - 1), values[i]});
  return line;
}
double highest(const Recall& r) {
  return std::max(*std::max_element(r.target_n.begin(), r.target_n.end()),
                  *std::max_element(r.applied_n.begin(), r.applied_n.end()));
}

struct Synthetic {
  std::vector<double> target, recalled, nothing;
  Recall red, green;
};
// Three peaks, recalled too late, too early and too late again.
const Synthetic& synthetic() {
  static const Synthetic s = [] {
    Synthetic made;
    for (int i = 0; i <= 1500; ++i) {
      const double t = i / 100.0;
      const auto peak = [&](double at) { return 6 * portable::exp(-((t - at) / 0.35) * ((t - at) / 0.35)); };
      made.target.push_back(peak(3) + peak(7.5) + peak(12));
      made.recalled.push_back(peak(3.7) + peak(6.8) + peak(12.7));
      made.nothing.push_back(0);
    }
    made.red = score_recall(made.target, made.recalled, {}, 100);
    made.green = score_recall(made.target, made.nothing, {}, 100);
    return made;
  }();
  return s;
}

}  // namespace

sheet::Plot path_plot(const Stimulus& s) {
  sheet::Plot p;
  p.id = "figure-22";
  p.title = "Figure 22: a path";
  p.x = {-55, 55, 25, "x, mm", {}};
  p.y = {-35, 35, 15, "-z, mm (away from the person)", {}};
  sheet::Plot::Line line;
  for (std::size_t i = 0; i < s.x_mm.size(); i += std::max<std::size_t>(1, s.x_mm.size() / 400))
    line.at.push_back({s.x_mm[i], -s.z_mm[i]});
  p.lines = {line};
  return p;
}

sheet::Plot force_plot(const Stimulus& s) {
  sheet::Plot p = over_time("figure-23", "Figure 23: a force along it", s.seconds(), s.most_n());
  p.lines = {curve(s.force_n, s.seconds(), Tone::plain)};
  return p;
}

sheet::Drawing display_of(const Stimulus& s, Training training, RunKind kind, const Protocol& protocol) {
  DisplayState state;
  state.training = training;
  state.kind = kind;
  state.most_n = protocol.device_n;
  const std::size_t i = s.force_n.size() / 2;
  state.view.t_s = static_cast<double>(i) / s.rate_hz;
  state.view.hand_mm = {s.x_mm[i], 0, s.z_mm[i]};
  state.view.path_x_mm = s.x_mm[i];
  state.view.path_z_mm = s.z_mm[i];
  state.view.target_n = s.force_n[i];
  state.view.applied_n = 0.8 * s.force_n[i];
  sheet::Drawing d = run_drawing(s, state, 520, 400);
  const bool test = kind == RunKind::test;
  d.id = test                           ? "figure-24-t"
         : training == Training::haptic ? "figure-24-a"
         : training == Training::visual ? "figure-24-b"
                                        : "figure-24-c";
  d.caption = test                           ? "T"
              : training == Training::haptic ? "Figure 24a: H"
              : training == Training::visual ? "24b: V"
                                             : "24c: V+H";
  return d;
}

sheet::Plot synthetic_plot() {
  sheet::Plot p = over_time("figure-25", "Figure 25: why curves are aligned", 15, 6);
  p.lines = {curve(synthetic().target, 15, Tone::plain), curve(synthetic().recalled, 15, Tone::bad),
             curve(synthetic().nothing, 15, Tone::good)};
  return p;
}

std::string synthetic_text() {
  char out[300];
  const Synthetic& s = synthetic();
  std::snprintf(out, sizeof out,
                "Figure 25: three peaks (dark), recalled at wrong times (red), and no force (green). RMS without "
                "alignment: red %.2f N, green "
                "%.2f N; score: red %.2f, green %.2f.",
                s.red.plain_rms_n, s.green.plain_rms_n, s.red.score, s.green.score);
  return out;
}

sheet::Plot alignment_plot(const Recall& r) {
  sheet::Plot p = over_time("figure-26", "Figure 26: partners of a trial", r.seconds, highest(r));
  const double step = r.seconds / static_cast<double>(r.target_n.size() - 1);
  for (std::size_t k = 0; k < r.path.size(); k += 20) {
    const auto [t, a] = r.path[k];
    p.lines.push_back({{{step * t, r.target_n[t]}, {step * a, r.applied_n[a]}}, Tone::quiet, false});
  }
  p.lines.push_back(curve(r.target_n, r.seconds, Tone::bad));
  p.lines.push_back(curve(r.applied_n, r.seconds, Tone::good));
  return p;
}

sheet::Plot warped_plot(const Recall& r) {
  sheet::Plot p = over_time("figure-27", "Figure 27: after warping", r.seconds, highest(r));
  p.lines = {curve(r.target_n, r.seconds, Tone::bad), curve(r.warped_n, r.seconds, Tone::plain)};
  return p;
}

sheet::Plot means_plot(const std::array<std::vector<double>, kTrainings>& means, double level) {
  sheet::Plot p;
  p.id = "figure-28";
  p.title = "Figure 28: mean error of recall";
  double most = 0.1;
  for (std::size_t t = 0; t < kTrainings; ++t) {
    const double x = static_cast<double>(t) + 1;
    p.x.named.emplace_back(x, short_name(static_cast<Training>(t)));
    const statistics::Interval i = statistics::mean_interval(means[t], level);
    const double m = statistics::mean(means[t]);
    p.areas.push_back({{{x - 0.3, 0}, {x + 0.3, 0}, {x + 0.3, m}, {x - 0.3, m}}, Tone::quiet});
    if (std::isfinite(i.lo)) {
      p.lines.push_back({{{x, i.lo}, {x, i.hi}}, Tone::bad, false});
      for (const double end : {i.lo, i.hi}) p.lines.push_back({{{x - 0.08, end}, {x + 0.08, end}}, Tone::bad, false});
    }
    p.points.push_back({{{x, m}}, Tone::bad, false});
    sheet::Plot::Points dots{{}, Tone::plain, true};
    for (std::size_t k = 0; k < means[t].size(); ++k) {
      dots.at.push_back({x + 0.16 + 0.02 * static_cast<double>(k % 6), means[t][k]});
      most = std::max(most, means[t][k]);
    }
    p.points.push_back(dots);
    most = std::max({most, m, std::isfinite(i.hi) ? i.hi : 0});
  }
  p.x.from = 0.4;
  p.x.to = 3.6;
  p.y = {0, 1.1 * most, most > 0.8 ? 0.25 : 0.1, "score (0 perfect)", {}};
  return p;
}

}  // namespace osteo::inline assessment::experiment
