#include "osteo/assessment/experiment/recall.h"

#include <algorithm>
#include <cmath>

#include "osteo/core/base/error.h"

namespace osteo::inline assessment::experiment {
namespace {

// By straight lines, from the first to the last.
std::vector<double> resampled(std::span<const double> v, std::size_t samples) {
  std::vector<double> out(samples);
  for (std::size_t k = 0; k < samples; ++k) {
    const double at = static_cast<double>(k) * static_cast<double>(v.size() - 1) / static_cast<double>(samples - 1);
    const auto i = std::min(static_cast<std::size_t>(at), v.size() - 2);
    const double share = at - static_cast<double>(i);
    out[k] = v[i] * (1 - share) + v[i + 1] * share;
  }
  return out;
}

}  // namespace

std::vector<double> box_filtered(std::span<const double> values, std::size_t width) {
  const std::size_t n = values.size(), half = width / 2;
  std::vector<double> sums(n + 1, 0), out(n);
  for (std::size_t i = 0; i < n; ++i) sums[i + 1] = sums[i] + values[i];
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t from = i > half ? i - half : 0, to = std::min(n, i + half + 1);
    out[i] = (sums[to] - sums[from]) / static_cast<double>(to - from);
  }
  return out;
}

Recall score_recall(std::span<const double> target_n, std::span<const double> applied_n,
                    const std::vector<bool>& saturated, double rate_hz, const RecallSettings& s) {
  if (target_n.size() != applied_n.size() || target_n.size() < 2 || s.samples < 2)
    throw Error(ExitCode::usage, "a recall needs target and applied force of the same length, two samples at least");
  if (!saturated.empty() && saturated.size() != target_n.size())
    throw Error(ExitCode::usage, "saturation is given for another length");
  if (!(rate_hz > 0)) throw Error(ExitCode::usage, "a recall needs a rate above 0");
  for (std::size_t i = 0; i < target_n.size(); ++i) {
    if (!std::isfinite(target_n[i]) || !std::isfinite(applied_n[i]))
      throw Error(ExitCode::usage, "a force is not a number at sample " + std::to_string(i));
  }
  Recall r;
  r.seconds = static_cast<double>(target_n.size() - 1) / rate_hz;
  r.target_n = resampled(target_n, s.samples);
  r.applied_n = resampled(box_filtered(applied_n, static_cast<std::size_t>(std::lround(s.box_s * rate_hz))), s.samples);
  std::vector<double> weight;
  if (std::find(saturated.begin(), saturated.end(), true) != saturated.end()) {
    // A sample of the coarser time base is out where the one nearest to it is.
    for (std::size_t k = 0; k < s.samples; ++k) {
      const double at =
          static_cast<double>(k) * static_cast<double>(saturated.size() - 1) / static_cast<double>(s.samples - 1);
      weight.push_back(saturated[static_cast<std::size_t>(std::lround(at))] ? 0 : 1);
    }
    r.saturated =
        1 - static_cast<double>(std::count(weight.begin(), weight.end(), 1.0)) / static_cast<double>(s.samples);
  }
  const double rate = static_cast<double>(s.samples - 1) / r.seconds, step_s = 1 / rate;
  const std::vector<double> target_slope = slopes(r.target_n, rate), applied_slope = slopes(r.applied_n, rate);
  // What no force at all would cost: partners are those of the same time, since each step aside costs and none is
  // better there.
  double nothing = 0, rms = 0, counted = 0;
  for (std::size_t k = 0; k < s.samples; ++k) {
    const double w = weight.empty() ? 1 : weight[k];
    nothing += w * (s.costs.force * std::abs(r.target_n[k]) + s.costs.slope_s * std::abs(target_slope[k]));
    rms += w * (r.target_n[k] - r.applied_n[k]) * (r.target_n[k] - r.applied_n[k]);
    counted += w;
  }
  if (!(nothing > 0)) throw Error(ExitCode::usage, "the target holds no force that could be recalled");
  Aligner aligner(s.costs);
  // Left out by the target's time: were the applied curve's samples left out as well, a way through them would cost
  // nothing anywhere.
  const Alignment& a = aligner.align({r.target_n, target_slope, weight}, {r.applied_n, applied_slope, {}});
  r.score = a.cost_n / nothing;
  r.by = a.by;
  r.path = a.path;
  r.plain_rms_n = std::sqrt(rms / counted);
  double weights = 0;
  std::vector<double> sum(s.samples, 0);
  std::vector<int> many(s.samples, 0);
  for (const Pairing& p : a.path) {
    const double w = weight.empty() ? 1 : weight[p.target];
    const double apart = (static_cast<double>(p.applied) - static_cast<double>(p.target)) * step_s;
    r.phase_s += w * std::abs(apart);
    r.lag_s += w * apart;
    r.amplitude_n += w * std::abs(r.target_n[p.target] - r.applied_n[p.applied]);
    r.slope_n_per_s += w * std::abs(target_slope[p.target] - applied_slope[p.applied]);
    weights += w;
    sum[p.target] += r.applied_n[p.applied];
    ++many[p.target];
  }
  for (double* const part : {&r.phase_s, &r.lag_s, &r.amplitude_n, &r.slope_n_per_s})
    *part = weights > 0 ? *part / weights : 0;
  for (std::size_t k = 0; k < s.samples; ++k) r.warped_n.push_back(sum[k] / many[k]);
  const std::vector<double> warped_slope = slopes(r.warped_n, rate);
  double force2 = 0, slope2 = 0;
  for (std::size_t k = 0; k < s.samples; ++k) {
    const double w = weight.empty() ? 1 : weight[k];
    force2 += w * (r.target_n[k] - r.warped_n[k]) * (r.target_n[k] - r.warped_n[k]);
    slope2 += w * (target_slope[k] - warped_slope[k]) * (target_slope[k] - warped_slope[k]);
  }
  r.thesis_n = (s.alignment * a.cost_n / counted + s.after_force * std::sqrt(force2 / counted) +
                s.after_slope_s * std::sqrt(slope2 / counted)) /
               3;
  return r;
}

}  // namespace osteo::inline assessment::experiment
