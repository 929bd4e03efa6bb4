// The stimulator: when it gives a pulse, and how it looks for the threshold.
#pragma once
#include <cstdint>
#include <optional>

namespace osteo::inline simulation {

/// As the technician has set it. The tip of a hand's tool is its electrode, whatever that tool is: a probe, or an
/// insulated burr.
struct StimulatorSetting {
  std::uint32_t hand = 0;
  double current_ma = 0;    ///< 0: off; at most kMaxMa
  double pulses_per_s = 4;  ///< 1 to 30
  double width_ms = 0.1;    ///< 0.05 to 1
  bool search = false;      ///< it looks for the threshold by itself, from current_ma on
  static constexpr double kMinMa = 0.02, kMaxMa = 5;
  friend bool operator==(const StimulatorSetting&, const StimulatorSetting&) = default;
};
/// Each number as the nearest it may be.
[[nodiscard]] StimulatorSetting within_range(StimulatorSetting setting);

/// Twice the current until most of kTrials pulses answer, half of it until they do not, then the middle (geometric) of
/// what is between until the two are within a tenth.
class ThresholdSearch {
 public:
  static constexpr int kTrials = 3;
  explicit ThresholdSearch(double begin_ma);
  [[nodiscard]] double current_ma() const { return current_ma_; }
  /// What a pulse of current_ma() gave.
  void take(bool response);
  [[nodiscard]] bool done() const { return done_; }
  /// When done: least current that answered, no value: none did.
  [[nodiscard]] std::optional<double> threshold_ma() const { return answers_ma_; }

 private:
  double current_ma_;
  std::optional<double> silent_ma_, answers_ma_;
  int trials_ = 0, responses_ = 0;
  bool done_ = false;
};

/// Pulses while the tip touches something.
class Stimulator {
 public:
  void set(const StimulatorSetting& setting);
  [[nodiscard]] const StimulatorSetting& setting() const { return setting_; }
  /// Of the next pulse: as the search has it, where one goes on.
  [[nodiscard]] double current_ma() const;
  /// Whether a pulse comes within the next `samples`, which begin at sample `first`, and where; at most one in a call.
  [[nodiscard]] std::optional<std::uint64_t> pulse(std::uint64_t first, std::uint64_t samples, bool touches);
  /// What the last pulse gave. The threshold, when this ends the search; a search that ends turns the stimulator off.
  struct Found {
    std::optional<double> threshold_ma;
  };
  std::optional<Found> take(bool response);

 private:
  StimulatorSetting setting_;
  std::optional<ThresholdSearch> search_;
  std::uint64_t next_ = 0;
};

}  // namespace osteo::inline simulation
