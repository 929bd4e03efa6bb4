// What a nerve monitor is made of: constants and channels, from a file that says of each number where it comes from.
#pragma once
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "osteo/core/data/vec.h"

namespace osteo::inline simulation {

/// All illustrative; meaning, unit and source of each stand in monitor.json and docs/validation/monitor.md. None has a default
/// here.
struct MonitorConstants {
  using Params = MonitorConstants;
  // A stimulus and its response.
  double bare_ma = 0, soft_ma = 0, soft_ma_per_mm2 = 0, contact_mm = 0, bone_ma_per_mm2 = 0, chronaxie_ms = 0,
         recruit_ma = 0, trial_spread = 0, conduction_m_per_s = 0, evoked_ms = 0;
  // What a nerve does by itself.
  double burst_cover_mm = 0, bursts_per_s = 0, burst_least_s = 0, burst_most_s = 0, burst_least_hz = 0,
         burst_most_hz = 0, burst_least_uv = 0, burst_most_uv = 0;
  double sheath_mm = 0, sheath_n_per_mm = 0, train_n = 0, train_c = 0, trains_per_s = 0, train_least_s = 0,
         train_most_s = 0, train_least_hz = 0, train_most_hz = 0, train_least_uv = 0, train_most_uv = 0;
  double injury_s = 0, dose_from_min = 0, dose_to_min = 0;
  // What else is in the signal.
  double noise_uv = 0, noise_hz = 0, mains_hz = 0, mains_uv = 0, drill_uv = 0, drill_uv_per_n = 0, drill_most_uv = 0,
         artefact_uv = 0, artefact_ms = 0;
  // What counts as an event.
  double event_uv = 0, event_gap_ms = 0, train_from_s = 0, response_uv = 0, response_from_ms = 0, response_to_ms = 0;
  static void describe(Params& p, auto& visit) {
    const auto field = [&](std::string_view name, std::string_view unit, double lo, double hi, double& value) {
      visit({name, "", unit, lo, hi, true}, value);
    };
    field("bare_ma", "mA", 0.01, 10, p.bare_ma);
    field("soft_ma", "mA", 0.01, 10, p.soft_ma);
    field("soft_ma_per_mm2", "mA/mm2", 0, 10, p.soft_ma_per_mm2);
    field("contact_mm", "mm", 0.01, 5, p.contact_mm);
    field("bone_ma_per_mm2", "mA/mm2", 0, 100, p.bone_ma_per_mm2);
    field("chronaxie_ms", "ms", 0.01, 5, p.chronaxie_ms);
    field("recruit_ma", "mA", 0.01, 10, p.recruit_ma);
    field("trial_spread", "1", 0, 1, p.trial_spread);
    field("conduction_m_per_s", "m/s", 1, 150, p.conduction_m_per_s);
    field("evoked_ms", "ms", 1, 20, p.evoked_ms);
    field("burst_cover_mm", "mm", 0.01, 5, p.burst_cover_mm);
    field("bursts_per_s", "1/s", 0, 50, p.bursts_per_s);
    field("burst_least_s", "s", 0.01, 5, p.burst_least_s);
    field("burst_most_s", "s", 0.01, 5, p.burst_most_s);
    field("burst_least_hz", "Hz", 5, 500, p.burst_least_hz);
    field("burst_most_hz", "Hz", 5, 500, p.burst_most_hz);
    field("burst_least_uv", "uV", 1, 5000, p.burst_least_uv);
    field("burst_most_uv", "uV", 1, 5000, p.burst_most_uv);
    field("sheath_mm", "mm", 0.01, 1, p.sheath_mm);
    field("sheath_n_per_mm", "N/mm", 0, 100, p.sheath_n_per_mm);
    field("train_n", "N", 0.01, 20, p.train_n);
    field("train_c", "C", 37.5, 60, p.train_c);
    field("trains_per_s", "1/s", 0, 50, p.trains_per_s);
    field("train_least_s", "s", 0.1, 60, p.train_least_s);
    field("train_most_s", "s", 0.1, 60, p.train_most_s);
    field("train_least_hz", "Hz", 20, 1000, p.train_least_hz);
    field("train_most_hz", "Hz", 20, 1000, p.train_most_hz);
    field("train_least_uv", "uV", 1, 5000, p.train_least_uv);
    field("train_most_uv", "uV", 1, 5000, p.train_most_uv);
    field("injury_s", "s", 0, 10, p.injury_s);
    field("dose_from_min", "min", 0.1, 10000, p.dose_from_min);
    field("dose_to_min", "min", 0.1, 100000, p.dose_to_min);
    field("noise_uv", "uV", 0, 1000, p.noise_uv);
    field("noise_hz", "Hz", 100, 15000, p.noise_hz);
    field("mains_hz", "Hz", 40, 70, p.mains_hz);
    field("mains_uv", "uV", 0, 1000, p.mains_uv);
    field("drill_uv", "uV", 0, 1000, p.drill_uv);
    field("drill_uv_per_n", "uV/N", 0, 1000, p.drill_uv_per_n);
    field("drill_most_uv", "uV", 0, 1000, p.drill_most_uv);
    field("artefact_uv", "uV", 0, 100000, p.artefact_uv);
    field("artefact_ms", "ms", 0.01, 2, p.artefact_ms);
    field("event_uv", "uV", 1, 5000, p.event_uv);
    field("event_gap_ms", "ms", 5, 1000, p.event_gap_ms);
    field("train_from_s", "s", 0.1, 10, p.train_from_s);
    field("response_uv", "uV", 1, 5000, p.response_uv);
    field("response_from_ms", "ms", 1, 30, p.response_from_ms);
    field("response_to_ms", "ms", 2, 30, p.response_to_ms);
  }
};

/// An electrode pair that hears one nerve.
struct MonitorChannel {
  std::string name;
  double evoked_uv = 0;   ///< of a stimulus that recruits all of it
  double latency_ms = 0;  ///< from the nerve's distal end in the case to the beginning of the wave
  double share = 0;       ///< of what the nerve does by itself, 0 to 1
};

struct MonitoredNerve {
  std::vector<std::string> structures;  ///< names it goes by in label maps, in lower case
  Vec3 distal;                          ///< where its muscles lie, LPS: which of its ends is the far one
  std::vector<MonitorChannel> channels;
};

struct MonitorSetup {
  static constexpr int kRateHz = 30000;
  static constexpr std::size_t kMaxChannels = 16;  ///< over all nerves
  static constexpr double kMicrovoltsPerBit = 0.25;
  MonitorConstants constants;
  std::vector<MonitoredNerve> nerves;
  std::uint64_t seed = 1;
};

/// Strict: every constant once, each as { "value", "unit", "source" } with the unit that it has here; a source for each
/// nerve. `name` as errors call the file. Error(usage), with the line.
[[nodiscard]] MonitorSetup parse_monitor(std::string_view json, const std::string& name);
/// libs/simulation/nerve/monitor.json.
[[nodiscard]] std::string_view default_monitor_json();

}  // namespace osteo::inline simulation
