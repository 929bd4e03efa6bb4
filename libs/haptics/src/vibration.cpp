#include "osteo/haptics/vibration.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "osteo/base/error.h"
#include "osteo/base/files.h"
#include "osteo/base/json.h"
#include "osteo/base/portable_math.h"
#include "vibration_json.h"

namespace osteo {

VibrationSpectrum parse_vibration(std::string_view text, const std::string& name) {
  VibrationSpectrum s;
  std::string where = "header";
  const auto refuse = [&](const std::string& what) { throw Error(ExitCode::usage, name + ": " + where + ": " + what); };
  try {
    const auto j = nlohmann::json::parse(text);
    if (j.at("osteotome_vibration") != 1) refuse("\"osteotome_vibration\" must be 1");
    where = "band_hz";
    const double lo = j.at("band_hz").at(0), hi = j.at("band_hz").at(1);
    if (!(lo >= 0 && hi > lo && hi <= 1000)) refuse("must be two rising frequencies up to 1000");
    for (const BurrKind kind : {BurrKind::cutting, BurrKind::diamond}) {
      const auto index = static_cast<std::size_t>(kind);
      const std::string key(EnumNames<BurrKind>::values[index]);
      int number = 0;
      for (const auto& p : j.at(key)) {
        where = key + " " + std::to_string(++number);
        const VibrationSpectrum::Peak peak{p.at("frequency_hz"), p.at("idle_n"), p.at("per_n")};
        if (!(peak.frequency_hz > 0) || !(peak.idle_n >= 0) || !(peak.per_n >= 0) || peak.idle_n > 10 || peak.per_n > 1)
          refuse("needs a frequency above 0, idle_n from 0 to 10 and per_n from 0 to 1");
        if (peak.frequency_hz >= lo && peak.frequency_hz <= hi) s.by_kind[index].push_back(peak);
      }
      if (s.by_kind[index].size() > VibrationSpectrum::kMostPeaks) refuse("has more than 16 peaks in the band");
    }
  } catch (const nlohmann::json::exception& e) {
    refuse(json_complaint(e));
  }
  return s;
}

VibrationSpectrum load_vibration(const std::filesystem::path& path) {
  return parse_vibration(read_text(path), "'" + path.string() + "'");
}

std::string_view default_vibration_json() {
  return kVibrationJson;
}

const VibrationSpectrum& default_vibration() {
  static const VibrationSpectrum spectrum = parse_vibration(kVibrationJson, "the built-in vibration model");
  return spectrum;
}

std::array<double, 2> Vibration::step(BurrKind kind, double pressed_n, double dt_s, double speed) noexcept {
  const auto index = static_cast<std::size_t>(kind);
  std::array<double, 2> force{};
  for (std::size_t i = 0; i < spectrum_.by_kind[index].size(); ++i) {
    const auto& peak = spectrum_.by_kind[index][i];
    double& phase = phase_[index][i];
    const double frequency_hz = speed * peak.frequency_hz;
    phase += frequency_hz * dt_s;
    phase -= std::floor(phase);
    // Above what the loop can play without aliasing.
    if (frequency_hz * dt_s > 0.45) continue;
    const double amplitude = speed * (peak.idle_n + peak.per_n * pressed_n);
    const portable::SinCos turn = portable::sin_cos_turns(phase);
    force[0] += amplitude * turn.cos;
    force[1] += amplitude * turn.sin;
  }
  return force;
}

}  // namespace osteo
