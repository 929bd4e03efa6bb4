#include "osteo/simulation/haptics/vibration.h"

#include <algorithm>
#include <cmath>

#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/json.h"
#include "osteo/core/base/portable_math.h"
#include "vibration_json.h"

namespace osteo::inline simulation {

VibrationSpectrum parse_vibration(std::string_view text, const std::string& name) {
  VibrationSpectrum s;
  const JsonFile file(text, name);
  const JsonValue& root = file.root();
  file.require_format("osteotome_vibration");
  std::vector<std::string> keys{"osteotome_vibration", "$schema", "about", "source", "band_hz"};
  for (const BurrKindRow& kind : kBurrKinds) keys.emplace_back(kind.name);
  file.allow(root, "", keys);
  const auto& band = file.list(file.need(root, "", "band_hz"), "\"band_hz\"", 2);
  const double lo = file.number(band[0], "\"band_hz\"", 0, 1000), hi = file.number(band[1], "\"band_hz\"", 0, 1000);
  if (hi <= lo) throw file.wrong(band[1], "\"band_hz\" must be two rising frequencies up to 1000");
  for (std::size_t index = 0; index < kBurrKinds.size(); ++index) {
    const BurrKindRow& kind = kBurrKinds[index];
    const std::string key(kind.name);
    if (kind.vibrates_as != kind.name && root.find(key) == nullptr) {
      // A kind of before it in the table.
      const auto like =
          std::find(EnumNames<BurrKind>::values.begin(), EnumNames<BurrKind>::values.end(), kind.vibrates_as);
      s.by_kind[index] = s.by_kind[static_cast<std::size_t>(like - EnumNames<BurrKind>::values.begin())];
      continue;
    }
    const JsonValue& peaks = file.need(root, "", key);
    int number = 0;
    for (const JsonValue& p : file.list(peaks, "\"" + key + "\"")) {
      const std::string where = key + " " + std::to_string(++number);
      file.allow(p, where, std::vector<std::string>{"frequency_hz", "idle_n", "per_n", "about"});
      const auto value = [&](const char* name_of, double least, double most) {
        return file.number(file.need(p, where, name_of), where + ": \"" + name_of + "\"", least, most);
      };
      const VibrationSpectrum::Peak peak{value("frequency_hz", 0.001, 1e6), value("idle_n", 0, 10),
                                         value("per_n", 0, 1)};
      if (peak.frequency_hz >= lo && peak.frequency_hz <= hi) s.by_kind[index].push_back(peak);
    }
    if (s.by_kind[index].size() > VibrationSpectrum::kMaxPeaks)
      throw file.wrong(peaks, key + " has more than 16 peaks in the band");
  }
  return s;
}

VibrationSpectrum load_vibration(const std::filesystem::path& path) {
  return parse_vibration(read_text(path), path.string());
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

}  // namespace osteo::inline simulation
