#include "osteo/assessment/ground_truth/measure.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>

#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/portable_math.h"

namespace osteo::inline assessment::truth {
namespace {

constexpr double kFelt = 0.05;  // N: what is less is no contact worth missing

double at_share(std::vector<double>& v, double share) {
  if (v.empty()) return 0;
  const auto i = std::min(v.size() - 1, static_cast<std::size_t>(share * static_cast<double>(v.size())));
  std::nth_element(v.begin(), v.begin() + static_cast<std::ptrdiff_t>(i), v.end());
  return v[i];
}

}  // namespace

Played play(const Trajectory& t, PointRenderer& renderer, const RenderSettings& settings, bool keep,
            const Context& context) {
  Played out;
  Accuracy& a = out.accuracy;
  out.cost.setup_s = renderer.setup_s();
  out.cost.memory_mb = static_cast<double>(renderer.memory_bytes()) / 1e6;
  if (t.moments.empty()) return out;
  const double tick_ms = 1000 / t.rate_hz, unit = settings.unit;
  const auto skipped = static_cast<std::size_t>(0.1 * t.rate_hz);
  std::vector<double> errors, ns;
  errors.reserve(t.moments.size());
  ns.reserve(t.moments.size());
  Hasher hash;
  std::size_t both = 0, placed = 0, stuck = 0;
  double stuck_most = 0;
  const Moment& begin = t.moments.front();
  renderer.place((begin.surface_mm + begin.normal * (t.probe_radius_mm + 0.01)) * unit);
  for (std::size_t i = 0; i < t.moments.size(); ++i) {
    if (i % 1024 == 0) context.check_cancelled();
    const Moment& m = t.moments[i];
    const auto from = std::chrono::steady_clock::now();
    Rendered r = renderer.render(m.device_mm * unit);
    const double took = std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now() - from).count();
    ns.push_back(renderer.own_ns() >= 0 ? renderer.own_ns() : took);
    r.contact_mm = r.contact_mm / unit;
    hash.add(&r.force_n, sizeof r.force_n);
    a.operations += r.operations;
    if (keep) out.rendered.push_back(r);
    if (i < skipped) continue;
    const double off = length(r.force_n - m.force_n), due = length(m.force_n), felt = length(r.force_n);
    errors.push_back(off);
    a.mean_n += off;
    a.rms_n += off * off;
    if (due > kFelt && felt > kFelt) {
      const double cosine = std::clamp(dot(r.force_n, m.force_n) / (due * felt), -1.0, 1.0);
      a.direction_deg += portable::acos(cosine) * 180 / std::numbers::pi;
      ++both;
    }
    if (due > kFelt && felt == 0) a.missed_ms += tick_ms;
    // In the air, farther from the surface than its noise: the device, not the out-trajectory, says so.
    if (!m.contact && felt > kFelt) a.false_ms += tick_ms;
    if (due > 2 * kFelt && dot(r.force_n, m.force_n) < 0) ++a.popped;
    if (m.contact && r.contact) {
      const double behind = length(r.contact_mm - m.surface_mm);
      a.position_mean_mm += behind;
      a.position_max_mm = std::max(a.position_max_mm, behind);
      ++placed;
      stuck = behind > kPositionLimitMm ? stuck + 1 : 0;
      a.position_over += behind > kPositionLimitMm ? 1 : 0;
      stuck_most = std::max(stuck_most, static_cast<double>(stuck) * tick_ms);
    }
  }
  a.moments = errors.size();
  const double n = std::max<double>(1, static_cast<double>(errors.size()));
  a.mean_n /= n;
  a.rms_n = std::sqrt(a.rms_n / n);
  a.max_n = errors.empty() ? 0 : *std::max_element(errors.begin(), errors.end());
  a.p95_n = at_share(errors, 0.95);
  a.direction_deg /= std::max<double>(1, static_cast<double>(both));
  a.position_mean_mm /= std::max<double>(1, static_cast<double>(placed));
  a.longest_stuck_ms = stuck_most;
  a.operations /= static_cast<double>(t.moments.size());
  a.bits = hash.hex();
  out.cost.ns_max = *std::max_element(ns.begin(), ns.end());
  out.cost.ns_p99 = at_share(ns, 0.99);
  out.cost.ns_p50 = at_share(ns, 0.5);
  return out;
}

double energy_per_cycle_mj(const Solid& solid, const std::string& what, double rate_hz, double* kept,
                           const Context& context) {
  TruthParams p;
  p.path.closed = true;
  p.seconds = 2 * kCycleS;
  p.rate_hz = rate_hz;
  // The push must come back too: 3 swings a cycle.
  Trajectory t = true_trajectory(solid, p);
  const double w = 3 * 2 * std::numbers::pi / kCycleS;
  for (Moment& m : t.moments) {
    m.force_n = m.normal * (p.push_n + p.swing_n * portable::sin_cos(w * m.time_s).sin);
    m.device_mm = m.surface_mm - m.force_n / t.stiffness_n_per_mm;
  }
  const RenderSettings s{.stiffness_n_per_mm = t.stiffness_n_per_mm, .rate_hz = rate_hz};
  const auto renderer = make_point_renderer(what, solid, s, context);
  const Played played = play(t, *renderer, s, true, context);
  const std::size_t half = t.moments.size() / 2;
  double work = 0, turned = 0;
  for (std::size_t i = half; i < t.moments.size(); ++i) {
    // Of the hand from the moment before to this one, against the mean of the forces: the trapezoid's error is of
    // second order.
    const Vec3 way = t.moments[i].device_mm - t.moments[i - 1].device_mm;
    const double w_i = dot((played.rendered[i].force_n + played.rendered[i - 1].force_n) * 0.5, way);
    work += w_i;
    turned += std::abs(w_i);
  }
  if (kept != nullptr) *kept = turned;
  return work;
}

double step_n(const Solid& solid, PointRenderer& renderer, double k) {
  const double h = renderer.grain_mm(), step = h / 50;
  const PathParams path;
  const Vec3 start = solid.place(1, path);
  const Vec3 heading = normalized(solid.place(1.001, path) - start);
  Vec3 at = start, last_rendered{}, last_true{};
  double most = 0;
  renderer.place(start + solid.normal(start) * 0.01);
  for (int i = 0; i < 500; ++i) {
    const Vec3 n = solid.normal(at), due = n * 1.0;
    const Rendered r = renderer.render(at - due / k);
    // The first steps are the renderer's way to its place.
    if (i > 25) most = std::max(most, length((r.force_n - last_rendered) - (due - last_true)));
    last_rendered = r.force_n;
    last_true = due;
    const Vec3 ahead = normalized(heading - n * dot(heading, n));
    at = solid.foot(at + ahead * step);
  }
  return most;
}

Identified identify_friction(const Trajectory& t, const Solid& solid, const std::string& what, double lo, double hi,
                             const Context& context) {
  Identified out;
  const auto error_at = [&](double friction) {
    const RenderSettings s{.stiffness_n_per_mm = t.stiffness_n_per_mm, .friction = friction, .rate_hz = t.rate_hz};
    ++out.runs;
    return play(t, *make_point_renderer(what, solid, s, context), s, false, context).accuracy.mean_n;
  };
  constexpr double kGolden = 0.6180339887498949;
  double a = hi - kGolden * (hi - lo), b = lo + kGolden * (hi - lo), at_a = error_at(a), at_b = error_at(b);
  while (hi - lo > 1e-4) {
    if (at_a <= at_b) {
      hi = b;
      b = a;
      at_b = at_a;
      a = hi - kGolden * (hi - lo);
      at_a = error_at(a);
    } else {
      lo = a;
      a = b;
      at_a = at_b;
      b = lo + kGolden * (hi - lo);
      at_b = error_at(b);
    }
  }
  out.friction = at_a <= at_b ? a : b;
  out.mean_n = std::min(at_a, at_b);
  return out;
}

}  // namespace osteo::inline assessment::truth
