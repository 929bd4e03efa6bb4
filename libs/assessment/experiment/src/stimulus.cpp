#include "osteo/assessment/experiment/stimulus.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "osteo/core/base/error.h"
#include "osteo/core/base/json_document.h"
#include "osteo/core/base/portable_math.h"
#include "osteo/core/statistics/basics.h"

namespace osteo::inline assessment::experiment {
namespace {

constexpr double kFineMm = 0.02;  // steps in x along which the path is measured

struct Wave {
  double frequency, phase;
};
std::vector<Wave> waves(int count, double highest, statistics::Random& random) {
  std::vector<Wave> w;
  for (int i = 0; i < count; ++i) {
    const double frequency = highest * random.uniform(), phase = random.uniform();
    w.push_back({frequency, phase});
  }
  return w;
}
double sum_at(const std::vector<Wave>& waves, double at) {
  double s = 0;
  for (const Wave& w : waves) s += portable::sin_cos_turns(w.frequency * at + w.phase).sin;
  return s;
}
// To `lo` to `hi`; offsets of single waves would fall out here, so there are none.
void spread(std::vector<double>& v, double lo, double hi) {
  const auto [a, b] = std::minmax_element(v.begin(), v.end());
  const double from = *a, range = *b - *a;
  for (double& x : v) x = range > 0 ? lo + (hi - lo) * (x - from) / range : (lo + hi) / 2;
}

void check(const StimulusParams& p, double rate_hz) {
  const auto need = [](bool good, const char* what) {
    if (!good) throw Error(ExitCode::usage, std::string("a stimulus needs ") + what);
  };
  need(p.length_mm > 0 && p.width_mm > 0 && p.length_mm <= 1000 && p.width_mm <= 1000,
       "a length and a width from 0 to 1000 mm");
  need(p.speed_mm_s > 0 && p.path_sinusoids > 0 && p.force_sinusoids > 0, "a speed and sinusoids");
  need(p.path_cycles_per_cm > 0 && p.force_hz > 0, "frequencies above 0");
  need(p.force_n > 0 && p.bump_n >= p.force_n, "a force above 0 and bumps that reach at least as high");
  need(p.bumps >= 0 && p.bump_s > 0 && p.ramp_s >= 0, "bumps and ramps that are not negative");
  need(p.device_n > 0, "a device that can hold a force");
  need(rate_hz >= 10 && rate_hz <= 20000, "a rate from 10 to 20000 Hz");
}

}  // namespace

double Stimulus::most_n() const {
  return *std::max_element(force_n.begin(), force_n.end());
}

std::size_t Stimulus::index_at(double t_s) const {
  return static_cast<std::size_t>(std::lround(std::clamp(t_s * rate_hz, 0.0, static_cast<double>(force_n.size() - 1))));
}

double Stimulus::force_at(double t_s) const {
  const double at = std::clamp(t_s * rate_hz, 0.0, static_cast<double>(force_n.size() - 1));
  const auto i = std::min(static_cast<std::size_t>(at), force_n.size() - 2);
  const double share = at - static_cast<double>(i);
  return force_n[i] * (1 - share) + force_n[i + 1] * share;
}

Stimulus make_stimulus(std::uint64_t seed, const StimulusParams& p, double rate_hz) {
  check(p, rate_hz);
  statistics::Random random(seed);
  Stimulus s;
  s.seed = seed;
  s.params = p;
  s.rate_hz = rate_hz;
  s.scale = p.scale ? std::min(1.0, p.device_n / p.bump_n) : 1;

  // The path over x, then by its own length, so that the hand moves at one speed.
  const auto path = waves(p.path_sinusoids, p.path_cycles_per_cm, random);
  const auto fine = static_cast<std::size_t>(std::lround(p.length_mm / kFineMm)) + 1;
  std::vector<double> x(fine), z(fine), along(fine, 0);
  for (std::size_t i = 0; i < fine; ++i) {
    x[i] = p.length_mm * static_cast<double>(i) / static_cast<double>(fine - 1);
    z[i] = sum_at(path, x[i] / 10);
  }
  spread(z, -p.width_mm / 2, p.width_mm / 2);
  for (std::size_t i = 1; i < fine; ++i) along[i] = along[i - 1] + portable::hypot(x[i] - x[i - 1], z[i] - z[i - 1]);
  const double seconds = along.back() / p.speed_mm_s;
  if (!(seconds > 2 * p.ramp_s))
    throw Error(ExitCode::usage, "the ramps of a stimulus of " + std::to_string(seconds) + " s meet");
  const auto samples = static_cast<std::size_t>(std::floor(seconds * rate_hz)) + 1;
  std::size_t leg = 0;
  for (std::size_t i = 0; i < samples; ++i) {
    const double at = static_cast<double>(i) / rate_hz * p.speed_mm_s;
    while (leg + 2 < fine && along[leg + 1] < at) ++leg;
    const double step = along[leg + 1] - along[leg],
                 share = step > 0 ? std::clamp((at - along[leg]) / step, 0.0, 1.0) : 0;
    s.x_mm.push_back(x[leg] + share * (x[leg + 1] - x[leg]) - p.length_mm / 2);
    s.z_mm.push_back(z[leg] + share * (z[leg + 1] - z[leg]));
    s.vx_mm_s.push_back(step > 0 ? p.speed_mm_s * (x[leg + 1] - x[leg]) / step : 0);
    s.vz_mm_s.push_back(step > 0 ? p.speed_mm_s * (z[leg + 1] - z[leg]) / step : 0);
  }

  const auto force = waves(p.force_sinusoids, p.force_hz, random);
  for (std::size_t i = 0; i < samples; ++i) s.force_n.push_back(sum_at(force, static_cast<double>(i) / rate_hz));
  spread(s.force_n, 0, p.force_n);
  for (int b = 0; b < p.bumps; ++b) {
    const double middle = p.ramp_s + p.bump_s + random.uniform() * std::max(0.0, seconds - 2 * (p.ramp_s + p.bump_s));
    const double height = 0.5 + 0.5 * random.uniform();
    const auto bump = [&](std::size_t i) {
      const double off = (static_cast<double>(i) / rate_hz - middle) / p.bump_s;
      return std::max(0.0, 1 - off * off);
    };
    // As high as leaves the sum at `bump_n` at most, or a share of that.
    double room = p.bump_n;
    for (std::size_t i = 0; i < samples; ++i) {
      if (bump(i) > 0) room = std::min(room, (p.bump_n - s.force_n[i]) / bump(i));
    }
    for (std::size_t i = 0; i < samples; ++i) s.force_n[i] += height * std::max(0.0, room) * bump(i);
  }
  for (std::size_t i = 0; i < samples; ++i) {
    const double t = static_cast<double>(i) / rate_hz, end = static_cast<double>(samples - 1) / rate_hz - t;
    const double ramp = p.ramp_s > 0 ? std::min({1.0, t / p.ramp_s, end / p.ramp_s}) : 1;
    s.force_n[i] *= ramp * s.scale;
    s.saturated.push_back(s.force_n[i] > p.device_n + 1e-9);
  }
  return s;
}

namespace {
template <class F>
void each_sample(const Stimulus& s, double rate_hz, F&& f) {
  const auto count = static_cast<std::size_t>(std::floor(s.seconds() * rate_hz + 1e-9)) + 1;
  for (std::size_t k = 0; k < count; ++k) {
    const double t = static_cast<double>(k) / rate_hz;
    f(t, s.index_at(t));
  }
}
double rounded(double v) {
  return std::round(v * 1e4) / 1e4;
}
}  // namespace

std::string stimulus_csv(const Stimulus& s, double rate_hz) {
  std::string out = "time_s,x_mm,z_mm,force_n,saturated\n";
  each_sample(s, rate_hz, [&](double t, std::size_t i) {
    char line[120];
    std::snprintf(line, sizeof line, "%.4f,%.4f,%.4f,%.4f,%d\n", t, s.x_mm[i], s.z_mm[i], s.force_n[i],
                  s.saturated[i] ? 1 : 0);
    out += line;
  });
  return out;
}

std::string stimulus_json(const Stimulus& s, double rate_hz) {
  const StimulusParams& p = s.params;
  Json j{{"osteotome_stimulus", 1},
         {"seed", s.seed},
         {"rate_hz", rate_hz},
         {"seconds", s.seconds()},
         {"length_mm", p.length_mm},
         {"width_mm", p.width_mm},
         {"speed_mm_s", p.speed_mm_s},
         {"path_sinusoids", p.path_sinusoids},
         {"path_cycles_per_cm", p.path_cycles_per_cm},
         {"force_sinusoids", p.force_sinusoids},
         {"force_hz", p.force_hz},
         {"force_n", p.force_n},
         {"bump_n", p.bump_n},
         {"bumps", p.bumps},
         {"bump_s", p.bump_s},
         {"ramp_s", p.ramp_s},
         {"device_n", p.device_n},
         {"scale", s.scale}};
  Json x = Json::list(), z = Json::list(), f = Json::list(), cut = Json::list();
  each_sample(s, rate_hz, [&](double, std::size_t i) {
    x.push_back(rounded(s.x_mm[i]));
    z.push_back(rounded(s.z_mm[i]));
    f.push_back(rounded(s.force_n[i]));
    cut.push_back(s.saturated[i] ? 1 : 0);
  });
  j["samples"] = Json{{"x_mm", x}, {"z_mm", z}, {"force_n", f}, {"saturated", cut}};
  return j.dump() + "\n";
}

}  // namespace osteo::inline assessment::experiment
