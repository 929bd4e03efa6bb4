#include "osteo/simulation/sound/detail/sound_model.h"

#include <algorithm>
#include <cmath>

#include "osteo/core/base/portable_math.h"

namespace osteo::inline simulation {
namespace {

constexpr double kSilent = -200, kHighestHz = 18000;

double bounded(double x, double lo, double hi) noexcept {
  return std::isfinite(x) ? std::clamp(x, lo, hi) : std::max(lo, 0.0);
}
double log10_of(double x) noexcept {
  return portable::log(x) / portable::log(10);
}

/// Linear between the points, and beyond them as between the last two.
template <std::size_t N>
double along(const std::array<std::array<double, 2>, N>& points, double x) noexcept {
  std::size_t i = 1;
  while (i + 1 < N && x > points[i][0]) ++i;
  const auto& a = points[i - 1];
  const auto& b = points[i];
  return a[1] + (b[1] - a[1]) * (x - a[0]) / (b[0] - a[0]);
}

double speed_db(double rpm, const SoundModel& m) noexcept {
  constexpr double kSlow = 20000, kFast = 80000;
  const double by_log =
      m.speed_db * portable::log(std::clamp(rpm, kSlow, kFast) / 60000) / portable::log(kFast / kSlow);
  return by_log + (rpm < kSlow ? 40 * log10_of(rpm / kSlow) : 0);
}

}  // namespace

double envelope_db(double hz) noexcept {
  if (!(hz > 0)) return kSilent;
  static const std::array<std::array<double, 2>, 7> points = [] {
    std::array<std::array<double, 2>, 7> p{
        {{100, -20}, {1000, -8}, {2000, 0}, {4000, 0}, {8000, -24}, {16000, -60}, {20000, -80}}};
    for (auto& at : p) at[0] = portable::log(at[0]);
    return p;
  }();
  return std::max(kSilent, along(points, portable::log(hz)));
}

BurrSpectrum burr_spectrum(const SoundVoice& voice, const SoundModel& m) noexcept {
  BurrSpectrum s;
  const double rpm = bounded(voice.speed_rpm, 0, 200000), press = bounded(voice.press_n, 0, 20);
  if (voice.kind != SoundKind::burr || rpm < 1) return s;
  const double edge_db = bounded(voice.edge_db, -60, 20), share = bounded(voice.teeth_share, 0, 1);
  s.softness = bounded(voice.softness, 0, 1);
  const double thickness = bounded(voice.thickness_mm, 0, 10);
  const double thin = press > 0 && thickness > 0 ? std::max(0.0, 1 - thickness / m.thin_mm) : 0;
  s.rotation_hz = rpm / 60 * (1 + m.thin_pitch * thin) * (1 + m.press_pitch_per_n * std::min(press, 5.0));

  const double speed = speed_db(rpm, m), size = along(m.size_db, bounded(voice.diameter_mm, 0.5, 10));
  const double contact = press < 0.001 ? kSilent
                                       : m.contact_db + size + edge_db + speed +
                                             m.press_db_per_decade * log10_of(std::clamp(press, 0.01, 5.0));
  const double free = m.free_db + speed;
  const auto part = [](double of) { return of >= 1 ? 0 : of > 0 ? 10 * log10_of(of) : kSilent; };
  const double teeth = contact + part(share), rest = contact + part(1 - share);
  const auto weight = [&](double hz) {
    return envelope_db(hz) +
           s.softness * m.soft_db * std::clamp(portable::log(std::max(hz, 1.0) / 2000) / portable::log(2), 0.0, 1.0);
  };
  const auto add = [&](std::size_t line, double multiple, double db) {
    const double hz = s.rotation_hz * multiple;
    s.lines[line] = {hz, hz > kHighestHz ? kSilent : std::max(kSilent, db)};
  };
  // Rotation: heard free and under load; half the load's part goes into it.
  for (std::size_t k = 1; k <= BurrSpectrum::kRotationLines; ++k) {
    const auto n = static_cast<double>(k);
    add(k - 1, n, std::max(free, contact - 12) - 6 * (n - 1));
  }
  for (std::size_t k = 1; k <= BurrSpectrum::kToothLines; ++k) {
    const double n = static_cast<double>(k), multiple = n * m.teeth;
    add(BurrSpectrum::kRotationLines + k - 1, multiple,
        share > 0 ? std::max(teeth, free - 12) - 6 * (n - 1) + weight(s.rotation_hz * multiple) : kSilent);
  }
  s.noise_db = std::max({rest - 3 * s.softness, free - 10, kSilent});
  return s;
}

double suction_db(const SoundVoice& voice, double water, const SoundModel& m) noexcept {
  const double draws = bounded(voice.draws, 0, 1);
  if (voice.kind != SoundKind::sucker || draws < 0.001) return kSilent;
  return m.suction_db + m.suction_db_per_mm * (bounded(voice.diameter_mm, 1, 5) - 8.0 / 3) +
         m.suction_wet_db * bounded(water, 0, 1) + 20 * log10_of(draws);
}

}  // namespace osteo::inline simulation
