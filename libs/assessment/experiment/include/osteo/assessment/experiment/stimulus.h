// What is to be learned: a path in a plane and a force along it (D. Morris 2006, section 4.2.3).
#pragma once
#include <cstdint>
#include <string>
#include <vector>

namespace osteo::inline assessment::experiment {

/// The dissertation's constants. x: to the right, y: up, z: towards the person; the path lies in y = 0, the force is
/// pressed downwards.
struct StimulusParams {
  double length_mm = 100, width_mm = 60;  ///< of the path, in x and z
  double speed_mm_s = 16;                 ///< along the path
  int path_sinusoids = 20;
  double path_cycles_per_cm = 0.3;  ///< highest
  int force_sinusoids = 4;
  double force_hz = 0.2;  ///< highest
  double force_n = 10;    ///< of the sinusoids
  double bump_n = 12;     ///< up to which bumps reach
  int bumps = 3;          ///< parabolas; number and width are not printed
  double bump_s = 0.6;    ///< half width
  double ramp_s = 1;      ///< at both ends
  /// What the device can hold, in N. Forces are made smaller so that `bump_n` is just that; else what is above it is
  /// saturated.
  double device_n = 8;
  bool scale = true;
};

/// Sampled at `rate_hz` from 0 to its end.
struct Stimulus {
  std::uint64_t seed = 0;
  StimulusParams params;
  double rate_hz = 1000;
  double scale = 1;  ///< of the printed forces
  std::vector<double> x_mm, z_mm, vx_mm_s, vz_mm_s, force_n;
  std::vector<bool> saturated;  ///< above what the device can hold

  [[nodiscard]] double seconds() const { return static_cast<double>(force_n.size() - 1) / rate_hz; }
  [[nodiscard]] double most_n() const;
  /// In the path's middle, and by straight lines; beyond the ends the ends.
  [[nodiscard]] double force_at(double t_s) const;
  [[nodiscard]] std::size_t index_at(double t_s) const;
};

/// The same seed gives the same bits. Error(usage) for sizes that are not positive or ramps that meet.
[[nodiscard]] Stimulus make_stimulus(std::uint64_t seed, const StimulusParams& params = {}, double rate_hz = 1000);

/// time_s,x_mm,z_mm,force_n,saturated at `rate_hz`.
[[nodiscard]] std::string stimulus_csv(const Stimulus& stimulus, double rate_hz = 100);
/// The same with the constants that it was made by.
[[nodiscard]] std::string stimulus_json(const Stimulus& stimulus, double rate_hz = 100);

}  // namespace osteo::inline assessment::experiment
