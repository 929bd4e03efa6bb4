// A simulated hand: strokes with a force that it feels and corrects, a tremor, and a speed of its own.
#pragma once
#include <array>
#include <vector>

#include "osteo/assessment/trainee/skill.h"
#include "osteo/assessment/trainee/work_plan.h"
#include "osteo/simulation/bone/structure_map.h"
#include "osteo/simulation/haptics/device.h"

namespace osteo::inline assessment {

/// Slow or quick wavering of root mean square 1: three sines whose frequencies and phases follow from the seed.
class Wavering {
 public:
  Wavering(std::uint64_t seed, double least_hz, double most_hz);
  [[nodiscard]] double at(double t_s) const noexcept;

 private:
  std::array<double, 3> hz_{}, turns_{};
};

/// The device of a simulated trainee. It holds the drill on the spring of SpringHand and sets that spring's goal: along
/// the stroke it goes on at its speed, pulling sideways by no more than 0.8 of what it presses; towards the bone it
/// pulls as hard as it means to press, eases off within kEaseMm above the wanted depth, and takes back what it feels is
/// too much. Without control of its force it presses twice as hard as it means to, wavers by nearly as much as it
/// means, corrects nothing and does not ease off near structures. Servo's thread alone (or the one that steps it); no
/// allocation in read().
class TraineeHand final : public Device {
 public:
  static constexpr double kEaseMm = 0.1, kNearMm = 1.5, kSpringNPerMm = 0.8, kDampingNsPerMm = 0.0219;
  static constexpr double kTravelMmS = 100;  ///< moving freely

  /// `structures` may be null; else it must outlive this, and `guarded` says of each of its values() whether the hand
  /// is careful near it. It rests at `start_mm` until it gets a stroke. `toward`: unit, out of the bone.
  TraineeHand(const TraineeSkill& skill, std::uint64_t seed, const StructureMap* structures, std::vector<bool> guarded,
              Vec3 start_mm, Vec3 toward, Vec3 axis);

  DeviceSample read(std::uint64_t tick, double dt_s, Vec3 force_n) noexcept override;
  [[nodiscard]] DeviceTraits traits() const override { return SpringHand::traits(); }
  [[nodiscard]] bool active(std::uint64_t) const noexcept override { return !ended_; }

  /// The next stroke; in the same thread as read(), between ticks. The one before is dropped.
  void begin(TraineeStroke stroke);
  /// The stroke is done.
  [[nodiscard]] bool done() const { return next_ >= stroke_.points.size(); }
  /// By how much the hand goes on below the burr that is shown at the bone's surface, for each newton: depth is judged
  /// by what is seen.
  void sees(double mm_per_n) { yields_mm_per_n_ = mm_per_n; }
  /// Nothing more: the rehearsal ends with the next tick.
  void end() { ended_ = true; }
  [[nodiscard]] Vec3 position_mm() const { return at_mm_; }
  [[nodiscard]] std::uint8_t tool() const { return stroke_.tool; }

 private:
  void go_on(double dt_s, double most_sideways_mm) noexcept;
  [[nodiscard]] double wanted_height_mm() const noexcept;
  [[nodiscard]] double wanted_n(double t_s, double dt_s) noexcept;

  TraineeSkill skill_;
  const StructureMap* structures_;
  std::vector<bool> guarded_;
  std::vector<double> near_mm_;
  Vec3 toward_;
  Wavering force_wave_;
  std::array<Wavering, 3> tremor_;
  SpringHand hand_;
  TraineeStroke stroke_;
  std::size_t next_ = 0;
  Vec3 at_mm_, carrot_mm_, carrot_speed_mm_s_, axis_;
  double felt_n_ = 0, ramp_n_ = 0, bias_n_ = 0, stalled_s_ = 0, coming_s_ = 0, yields_mm_per_n_ = 0;
  bool ended_ = false;
};

}  // namespace osteo::inline assessment
