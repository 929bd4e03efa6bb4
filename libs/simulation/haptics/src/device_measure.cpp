#include "osteo/simulation/haptics/device_measure.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <vector>

#include "osteo/core/base/param.h"
#include "osteo/core/base/portable_math.h"

namespace osteo::inline simulation {
namespace {

constexpr double kStillS = 0.03, kSeenS = 0.02, kLatestS = 0.012,
                 kFirstWordS = 0.3;  // before a pulse; fitted after it; and when it begins
constexpr double kMinN = 0.5, kMaxN = 4, kAgreeS = 1.5e-4;
constexpr int kPulses = 12, kTries = 16;

/// Free motion of a mass with damping, before and after a pulse at t0: c + m e^(-t / tau) + p (1 - e^(-(t - t0) / tau))
/// behind t0. All in ticks; t counts from the beginning of the samples.
struct Motion {
  double t0 = 0, tau = 0, way = 0;  // way: p
  double off = 1e300;               // sum of the squares beside it
};

// c, m and p are linear: by the normal equations of three unknowns.
Motion motion(std::span<const double> y, double t0, double tau) {
  double n[3][3] = {}, r[3] = {}, yy = 0;
  for (std::size_t i = 0; i < y.size(); ++i) {
    const double t = static_cast<double>(i);
    const double f[3] = {1, portable::exp(-t / tau), t > t0 ? 1 - portable::exp((t0 - t) / tau) : 0};
    for (std::size_t a = 0; a < 3; ++a) {
      for (std::size_t b = 0; b < 3; ++b) n[a][b] += f[a] * f[b];
      r[a] += f[a] * y[i];
    }
    yy += y[i] * y[i];
  }
  const auto det = [](const double(&m)[3][3]) {
    return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
           m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
  };
  const double all = det(n);
  Motion found{t0, tau, 0, 1e300};
  if (!(std::abs(all) > 1e-12)) return found;
  double x[3];
  for (std::size_t k = 0; k < 3; ++k) {
    double with[3][3];
    for (std::size_t a = 0; a < 3; ++a)
      for (std::size_t b = 0; b < 3; ++b) with[a][b] = b == k ? r[a] : n[a][b];
    x[k] = det(with) / all;
  }
  found.way = x[2];
  found.off = std::max(0.0, yy - x[0] * r[0] - x[1] * r[1] - x[2] * r[2]);
  return found;
}

/// The best of them with t0 from `from` to `to`.
Motion best_motion(std::span<const double> y, double from, double to) {
  Motion best;
  for (double tau = 6; tau < 1200; tau *= 1.6) {
    for (double t0 = from; t0 <= to; t0 += 0.5) {
      if (const Motion m = motion(y, t0, tau); m.off < best.off) best = m;
    }
  }
  for (double step = 0.25, factor = 1.27; step > 0.01; step /= 2, factor = std::sqrt(factor)) {
    const Motion around = best;
    for (const double t0 : {around.t0 - step, around.t0, around.t0 + step}) {
      for (const double tau : {around.tau / factor, around.tau, around.tau * factor}) {
        if (const Motion m = motion(y, t0, tau); m.off < best.off) best = m;
      }
    }
  }
  return best;
}

/// The smallest step of positions that are all multiples of one; 0: they are not.
double step_of(const std::vector<double>& mm) {
  double least = 1e9;
  for (std::size_t i = 1; i < mm.size(); ++i) {
    if (const double d = std::abs(mm[i] - mm[i - 1]); d > 2e-5) least = std::min(least, d);  // floats: 4e-6 at 60 mm
  }
  if (!(least < 1)) return 0;
  std::size_t off = 0, moved = 0;
  for (std::size_t i = 1; i < mm.size(); ++i) {
    const double steps = std::abs(mm[i] - mm[i - 1]) / least;
    if (!(steps > 0.5)) continue;
    ++moved;
    off += std::abs(steps - std::round(steps)) > 0.1 ? 1 : 0;
  }
  return moved >= 8 && off == 0 ? least : 0;
}

struct Pulse {
  bool seen = false;
  double delay_s = 0, damping_n_s_per_m = 0;
};

class Measurement {
 public:
  Measurement(Device& device, double dt_s, const std::function<void()>& tick)
      : device_(device), dt_s_(dt_s), wait_(tick) {}

  // Rest, a pulse along the axis, and what comes of it.
  Pulse pulse(std::size_t axis, double force_n) {
    const auto still = static_cast<std::size_t>(std::ceil(kStillS / dt_s_)),
               latest = static_cast<std::size_t>(std::ceil(kLatestS / dt_s_)),
               seen = static_cast<std::size_t>(std::ceil(kSeenS / dt_s_));
    std::vector<double> mm;
    Vec3 push;
    for (std::size_t i = 0; i < still; ++i) mm.push_back(step({}, axis));
    push[axis] = force_n;
    mm.push_back(step(push, axis));  // acts from here to the next
    while (mm.size() < still + latest + seen) mm.push_back(step({}, axis));
    for (std::size_t i = mm.size(); i-- > 0;) mm[i] -= mm[0];  // sums of squares of small numbers
    const double sent = static_cast<double>(still) + 0.5;      // as one in the middle of its tick
    const Motion m = best_motion(mm, sent - 0.5, sent + static_cast<double>(latest));
    const double quantum = std::max(device_.traits().encoder_mm, step_mm()),
                 beside = std::sqrt(m.off / static_cast<double>(mm.size())),
                 moved = m.way * (1 - portable::exp(-static_cast<double>(seen) / m.tau));
    Pulse p;
    p.delay_s = (m.t0 - sent) * dt_s_;
    // mm for N s is m / (N s / m) * 1000.
    p.damping_n_s_per_m = 1000 * force_n * dt_s_ / m.way;
    p.seen = (force_n < 0 ? -moved : moved) > std::max({10 * beside, 12 * quantum, 0.005}) &&
             m.t0 < sent + static_cast<double>(latest) - 0.5 && std::isfinite(p.damping_n_s_per_m);
    return p;
  }

  // A link that was just opened takes a while.
  void meet() {
    for (int i = 0; i < static_cast<int>(kFirstWordS / dt_s_) && (i == 0 || silent_); ++i) {
      silent_ = false;
      static_cast<void>(step({}, 0));
    }
    for (auto& axis : seen_mm_) axis.clear();
  }
  [[nodiscard]] bool silent() const { return silent_; }
  [[nodiscard]] double step_mm() const {
    double step = 0;
    for (const auto& axis : seen_mm_) {
      const double one = step_of(axis);
      if (one > 0) step = step > 0 ? std::min(step, one) : one;
    }
    return step;
  }

 private:
  double step(Vec3 force, std::size_t axis) {
    wait_();
    const DeviceSample s = device_.read(tick_++, dt_s_, last_);
    silent_ = silent_ || s.age_ms > 20;
    device_.feel(force, {}, 0);
    last_ = force;
    const Vec3 at = from_floats(s.position_mm);
    for (std::size_t a = 0; a < 3; ++a) seen_mm_[a].push_back(at[a]);
    return at[axis];
  }

  Device& device_;
  const double dt_s_;
  const std::function<void()>& wait_;
  std::uint64_t tick_ = 0;
  Vec3 last_;
  bool silent_ = false;
  std::array<std::vector<double>, 3> seen_mm_;
};

std::string ms(double s) {
  return format_number(std::round(s * 1e5) / 100) + " ms";
}

}  // namespace

MeasuredDevice measure_device(Device& device, double dt_s, const std::function<void()>& tick) {
  MeasuredDevice m;
  const DeviceTraits by_driver = m.traits = device.traits();
  Measurement loop(device, dt_s, tick);
  const double most_n = std::min(kMaxN, 0.5 * by_driver.max_force_n);
  double force_n = std::min(kMinN, most_n);
  std::vector<Pulse> seen;
  loop.meet();
  for (int i = 0; i < kTries && seen.size() < kPulses && !loop.silent(); ++i) {
    // In turns, so that what a pulse left of motion has gone by the next along its axis.
    const Pulse p = loop.pulse(static_cast<std::size_t>(i % 3), i / 3 % 2 == 0 ? force_n : -force_n);
    if (p.seen) {
      seen.push_back(p);
    } else if (force_n < most_n) {
      force_n = std::min(2 * force_n, most_n);
      seen.clear();  // the weaker ones tell less
    }
  }
  const auto n = static_cast<double>(seen.size());
  double delay_s = 0, damping = 0, spread = 0, damping_spread = 0;
  for (const Pulse& p : seen) {
    delay_s += p.delay_s / n;
    damping += p.damping_n_s_per_m / n;
  }
  for (const Pulse& p : seen) {
    const double by = p.delay_s - delay_s, damping_by = p.damping_n_s_per_m - damping;
    spread += by * by / std::max(1.0, n - 1);
    damping_spread += damping_by * damping_by / std::max(1.0, n - 1);
  }
  m.delay_error_s = n > 0 ? std::sqrt(spread / n) : 0;
  m.delay_measured = seen.size() >= kPulses / 2 && m.delay_error_s <= kAgreeS;
  if (m.delay_measured) {
    m.traits.delay_s = std::max(0.0, delay_s);
    // Believed as told where the pulses do not surely contradict: a hand on the device damps too.
    const double surely = std::max(0.0, damping) + 2 * std::sqrt(damping_spread / n);
    m.traits.damping_n_s_per_m = std::min(by_driver.damping_n_s_per_m, surely);
    m.traits.encoder_mm = std::max(by_driver.encoder_mm, loop.step_mm());
    m.reported = "the device answers after " + ms(m.traits.delay_s) + " (its driver says " + ms(by_driver.delay_s) +
                 "), damps by " + format_number(std::round(100 * m.traits.damping_n_s_per_m) / 100) +
                 " N s/m at least and reports steps of " + format_number(std::round(1e4 * m.traits.encoder_mm) / 10) +
                 " um";
  } else {
    m.traits.delay_s += kUnmeasuredDelayS;
    const char* const why = loop.silent()               ? "it is silent"
                            : seen.empty()              ? "pulses do not move it, or it is held or trembles"
                            : seen.size() < kPulses / 2 ? "most pulses do not show"
                                                        : "pulses do not agree";
    m.reported = std::string("the device's delay was not measured (") + why + "): taken as " + ms(m.traits.delay_s) +
                 ", " + ms(kUnmeasuredDelayS) + " more than its driver says";
  }
  return m;
}

}  // namespace osteo::inline simulation
