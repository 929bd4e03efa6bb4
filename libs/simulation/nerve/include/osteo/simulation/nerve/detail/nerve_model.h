// What nerves do: when they fire by themselves, what stimulus they answer, how much of them is left.
#pragma once
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "osteo/simulation/nerve/detail/monitor_setup.h"
#include "osteo/simulation/nerve/detail/nerve_course.h"

namespace osteo::inline simulation {

/// SplitMix64 (Steele, Lea and Flood 2014): the same numbers everywhere.
class NerveRandom {
 public:
  explicit NerveRandom(std::uint64_t seed) : state_(seed) {}
  std::uint64_t bits() noexcept {
    std::uint64_t z = (state_ += 0x9e3779b97f4a7c15ULL);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
    return z ^ (z >> 31);
  }
  /// [0, 1)
  double uniform() noexcept { return static_cast<double>(bits() >> 11) * 0x1p-53; }
  double between(double lo, double hi) noexcept { return lo + (hi - lo) * uniform(); }
  /// Mean 0, variance 1, within 3.5: a sum of four, which is near enough to a normal distribution for noise.
  double normal() noexcept {
    const std::uint64_t b = bits();
    const auto sum = static_cast<double>((b & 0xffff) + (b >> 16 & 0xffff) + (b >> 32 & 0xffff) + (b >> 48));
    return (sum - 2 * 65535.0) * (1 / 37837.2275);
  }

 private:
  std::uint64_t state_;
};

/// Why a nerve fires.
enum class NerveCause : std::uint8_t { none, mechanical, pressure, heat, injury };
[[nodiscard]] std::string_view name_of(NerveCause cause);

/// What one tool does to one nerve.
struct NerveStress {
  std::size_t nerve = 0;
  std::size_t point = 0;    ///< of its course, the nearest
  double clearance_mm = 0;  ///< from the tool's surface to the nerve's; negative: in it
  double bone_mm = 0;       ///< of bone between them
  double press_n = 0;       ///< of the tool on what it touches
  bool drills = false;      ///< a burr that turns and takes bone, or touches
  bool cuts = false;        ///< it turns: what it reaches of the nerve is gone
};

/// Current that reaches half of nothing: below it nothing answers. mA; through so much soft tissue and bone, by a pulse
/// so long. I(d) = [soft + soft_per_mm2 d2 - (soft - bare) exp(-d / contact)] + bone_per_mm2 b2, times (1 + c / w) / (1
/// + c / 0.1 ms).
[[nodiscard]] double stimulus_threshold_ma(const MonitorConstants& constants, double soft_mm, double bone_mm,
                                           double width_ms) noexcept;

/// The state of all nerves of a case, in steps. The same stresses and temperatures in the same order give the same, on
/// any machine.
class NerveModel {
 public:
  /// `setup` with the nerves of `courses`, one for each, in order.
  NerveModel(const MonitorConstants& constants, std::vector<NerveCourse> courses, std::uint64_t seed);

  /// Something that goes on: spikes of a burst, or the sine of a train.
  struct Discharge {
    std::uint64_t id = 0;
    NerveCause cause = NerveCause::none;
    bool train = false;
    std::size_t nerve = 0, point = 0;
    double hz = 0, uv = 0;  ///< at a channel whose share is 1
    double left_s = 0;
  };
  /// What became true in a step.
  struct Happening {
    NerveCause cause = NerveCause::none;  ///< of a discharge that begins; injury: fibres were lost
    std::size_t nerve = 0, point = 0;
    double integrity = 1;  ///< of the nerve there
  };

  /// One step of dt_s. `warm`: for each nerve, temperatures in C and doses (CEM43, minutes; infinite where coagulated)
  /// of its points; empty where nothing is warm.
  struct Warmth {
    std::vector<double> celsius, cem43_min;
  };
  void step(double dt_s, std::span<const NerveStress> stresses, std::span<const Warmth> warm);

  [[nodiscard]] std::span<const Discharge> discharges() const { return discharges_; }
  /// Of the last step.
  [[nodiscard]] std::span<const Happening> happenings() const { return happenings_; }
  [[nodiscard]] const std::vector<NerveCourse>& courses() const { return courses_; }
  /// 0: cut or cooked, 1: whole.
  [[nodiscard]] double integrity(std::size_t nerve, std::size_t point) const { return integrity_[nerve][point]; }
  /// What of an impulse at a point reaches the muscles: the least integrity from there on.
  [[nodiscard]] double conducts(std::size_t nerve, std::size_t point) const;
  /// Share of the nerve that answers a stimulus, with its spread trial by trial; 0: none.
  [[nodiscard]] double answer(std::size_t nerve, std::size_t point, double current_ma, double threshold_ma);

 private:
  void stress(const NerveStress& s, double dt_s);
  void lose(std::size_t nerve, std::size_t point, double to);
  void begin(NerveCause cause, bool train, std::size_t nerve, std::size_t point, double seconds, double hz, double uv);
  [[nodiscard]] bool goes_on(NerveCause cause, std::size_t nerve, double at_least_s);

  MonitorConstants c_;
  std::vector<NerveCourse> courses_;
  std::vector<std::vector<double>> integrity_;
  NerveRandom random_;
  std::vector<bool> touches_, touched_;  // of each nerve, in this step and in the last
  std::vector<Discharge> discharges_;
  std::vector<Happening> happenings_;
  std::uint64_t next_id_ = 1;
};

}  // namespace osteo::inline simulation
