// What the running drill shakes the hand with.
#pragma once
#include <array>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "osteo/simulation/bone/burr.h"

namespace osteo::inline simulation {

/// Peaks of a spectrum: amplitude = idle + per newton pressed on bone. Frequencies outside the haptic band are left
/// out.
struct VibrationSpectrum {
  struct Peak {
    double frequency_hz = 0, idle_n = 0, per_n = 0;
  };
  static constexpr std::size_t kMaxPeaks = 16;
  std::array<std::vector<Peak>, kBurrKinds.size()> by_kind;  ///< in the order of BurrKind
};

/// Reads { "osteotome_vibration": 1, "band_hz": [lo, hi], "cutting": [ {"frequency_hz", "idle_n", "per_n"} ],
/// "diamond": [...] }, a list for each kind of burr but those that may have another's (BurrKindRow::vibrates_as).
/// Error(usage) with the place in the text; `name` stands for the file in messages.
[[nodiscard]] VibrationSpectrum parse_vibration(std::string_view json, const std::string& name);
[[nodiscard]] VibrationSpectrum load_vibration(const std::filesystem::path& path);
/// The built-in model: libs/simulation/haptics/vibration.json, which says what it rests on.
[[nodiscard]] const VibrationSpectrum& default_vibration();
[[nodiscard]] std::string_view default_vibration_json();

/// A force that turns around the drill's axis, the sum of the peaks. Phases go on from tick to tick. No allocation.
class Vibration {
 public:
  explicit Vibration(VibrationSpectrum spectrum) : spectrum_(std::move(spectrum)) {}
  /// Components along two directions at right angles to the axis, N. `speed`: of the burr, as a share of the one that
  /// the spectrum was taken at: frequencies and amplitudes go with it (the amplitudes: a guess).
  std::array<double, 2> step(BurrKind kind, double pressed_n, double dt_s, double speed = 1) noexcept;

 private:
  VibrationSpectrum spectrum_;
  std::array<std::array<double, VibrationSpectrum::kMaxPeaks>, kBurrKinds.size()> phase_{};
};

}  // namespace osteo::inline simulation
