// What a surface shakes the hand with that slides over it: recorded spectra, played by force and speed.
#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "osteo/core/data/vec.h"

namespace osteo::inline simulation {

/// Spectra of one surface at a grid of forces and speeds, each as an autoregressive model of the recorded vibration (J.
/// Romano, K. Kuchenbecker, IEEE Trans Haptics 5(2), 2012): x(i) = -a1 x(i-1) - ... - aN x(i-N) + noise. Kept as
/// reflection coefficients, which can be interpolated without becoming unstable.
struct TextureModel {
  static constexpr std::size_t kMaxOrder = 64;
  struct Node {
    std::vector<double> reflection;  ///< each in (-1, 1)
    double noise_n2 = 0;             ///< variance of the noise, N^2
  };
  double rate_hz = 1000;                      ///< of the recording; it is played at this rate
  std::vector<double> forces_n, speeds_mm_s;  ///< rising, at least one each
  std::vector<Node> nodes;                    ///< force by force, in each speed by speed; all of one order
  [[nodiscard]] std::size_t order() const { return nodes.empty() ? 0 : nodes.front().reflection.size(); }
};

/// What a recorded acceleration is taken for a force with: hand and stylus near the tip (a guess).
inline constexpr double kTextureMassKg = 0.05;

/// { "osteotome_texture": 1, "source": "...", "rate_hz": 1000, "force_n": [...], "speed_mm_s": [...],
///   "models": [ { "force_n", "speed_mm_s", "ar": [a1, ...], "noise_n2" } ] }: one model for each pair, in any order.
/// Error(usage) with the line: pairs missing or twice, orders that differ, models that are not stable.
[[nodiscard]] TextureModel parse_texture(std::string_view json, const std::string& name);
/// The same as text, read back to the last digits that JSON keeps.
[[nodiscard]] std::string texture_json(const TextureModel& model, const std::string& source);
/// Of either layout: JSON as above, or XML of the Penn toolkit, told by its first character.
[[nodiscard]] TextureModel load_texture(const std::filesystem::path& path, double mass_kg = kTextureMassKg);

/// The model of a recording, by Burg's method: `order` coefficients, 1 to kMaxOrder, of samples at an even rate, N
/// (more than 4 order of them). Error(usage) otherwise.
[[nodiscard]] TextureModel::Node texture_node(const std::vector<double>& samples_n, std::size_t order);
/// The model of a spectrum: `power_n2_per_hz` one-sided, at even steps from 0 Hz to half the rate, both ends (17 at
/// least); by its autocorrelation and Levinson's recursion, so it is stable whatever the spectrum. Error(usage) as
/// texture_node.
[[nodiscard]] TextureModel::Node node_of_spectrum(const std::vector<double>& power_n2_per_hz, double rate_hz,
                                                  std::size_t order);
/// For a loop of another rate: its spectrum up to half the lower rate; above that nothing.
[[nodiscard]] TextureModel at_rate(const TextureModel& model, double rate_hz);
/// A texture of the Penn Haptic Texture Toolkit's layout (H. Culbertson, J. Lopez Delgado, K. Kuchenbecker, Haptics
/// Symposium 2014): <modelSet> with SampleRate, SpeedUnits mm/s, ForceUnits N, AccelUnits m/s^2, triangles of models
/// (<tri>, counted from 1) and for each <model> ARcoeff (a leading 1), MAcoeff, var, gain, speedMod, forceMod. `var` is
/// taken for the variance of the noise and `gain` for a factor behind the moving average: the layout's files do not
/// say. Amplitudes of spectra are interpolated in the triangles onto an even grid of forces and speeds, as a model
/// without moving average each; times `mass_kg` they are forces. Its recordings may not be shipped. Error(usage): other
/// units, counts that do not agree, models without number.
[[nodiscard]] TextureModel parse_hatt(std::string_view xml, const std::string& name, double mass_kg = kTextureMassKg);

/// What a node's spectrum is at a frequency, N^2/Hz, one-sided.
[[nodiscard]] double spectrum_n2_per_hz(const TextureModel::Node& node, double frequency_hz, double rate_hz);

/// The vibration itself, a sample a tick of the model's own rate: noise from a seed through a lattice whose
/// coefficients follow force and speed (bilinear between the nodes, its ends beyond them; below the lowest speed the
/// amplitude falls in proportion, so that what rests is still). No allocation; same seed, same bits.
class Texture {
 public:
  Texture(TextureModel model, std::uint64_t seed);
  /// N; `force_n` pressed, `speed_mm_s` along the surface. Without contact: 0, and what rang dies.
  double step(double force_n, double speed_mm_s) noexcept;
  [[nodiscard]] const TextureModel& model() const { return model_; }

 private:
  double noise() noexcept;
  TextureModel model_;
  std::uint64_t state_;
  bool spare_ = false;
  double spare_value_ = 0;
  std::array<double, TextureModel::kMaxOrder + 1> back_{};
};

/// A texture under what slides: a force along the surface and across the motion, so that on average it neither drives
/// nor brakes. The velocity is smoothed over kSmoothS. No allocation; same places, same bits.
class SlidingTexture {
 public:
  static constexpr double kSmoothS = 0.01;
  /// Played at the loop's own rate, whatever it was recorded at.
  SlidingTexture(const TextureModel& model, std::uint64_t seed, double dt_s);
  /// N. `normal` unit; pressed_n 0: no contact.
  [[nodiscard]] Vec3 step(Vec3 at_mm, Vec3 normal, double pressed_n) noexcept;

 private:
  Texture texture_;
  double dt_s_, share_;
  bool placed_ = false;
  Vec3 last_mm_, velocity_mm_s_;
};

}  // namespace osteo::inline simulation
