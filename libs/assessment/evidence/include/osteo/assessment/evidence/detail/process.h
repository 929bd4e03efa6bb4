// How it was done: time, path, strokes, forces, instruments; and what was near.
#pragma once
#include <array>

#include "osteo/assessment/evidence/detail/hand_motion.h"
#include "osteo/assessment/evidence/detail/step_clock.h"
#include "osteo/assessment/evidence/detail/strokes.h"
#include "osteo/assessment/evidence/metric.h"

namespace osteo::inline assessment {

/// A burr drills when it turns faster than this and presses on bone.
inline constexpr double kTurnsRpm = 1000;

/// Time, path, strokes, force, work, instruments, suction and water, camera. Of the hands that hold a burr each counts;
/// path and strokes are those of the first.
class ProcessMetric final : public Metric {
 public:
  explicit ProcessMetric(const EvidenceScene& scene) : scene_(scene), idle_(scene.rate_hz), path_(scene.rate_hz) {}
  void frame(const EvidenceFrame& frame) override;
  void finish(const World& world, std::vector<Measured>& values, std::vector<Moment>& moments) override;

 private:
  EvidenceScene scene_;
  std::uint64_t ticks_ = 0, lost_ = 0, drilling_ = 0, sucking_ = 0, rinsing_ = 0, upright_ = 0;
  double removed_mm3_ = 0, sawn_mm3_ = 0, path_mm_ = 0, work_mj_ = 0;
  std::map<std::uint8_t, std::uint64_t> by_tool_;
  std::map<std::uint8_t, double> removed_by_tool_;
  std::vector<float> forces_n_;
  std::vector<std::pair<double, double>> volume_at_;  // time, removed so far: a point a frame
  struct Last {
    bool known = false;
    Vec3 at_mm, force_n;
  };
  PerHand<Last> last_;
  IdleClock idle_;
  HandMotion path_;              // of the first hand
  std::optional<Vec3> path_at_;  // to where path_mm_ goes
  bool sucker_ = false, water_ = false, any_camera_ = false;
  std::uint64_t camera_moves_ = 0, camera_ticks_ = 0;
  bool camera_moving_ = false;
  std::optional<CameraPose> camera_;
  StrokeFinder strokes_;
  double peak_n_ = 0;
  Moment peak_;
};

/// What the burr did near each structure: distance, touch, injury, time and volume near it, rules of the procedure.
/// Structures go with the first body. Distances are those of the burr's surface where it is shown.
class NearMetric final : public Metric {
 public:
  explicit NearMetric(const EvidenceScene& scene);
  void frame(const EvidenceFrame& frame) override;
  void finish(const World& world, std::vector<Measured>& values, std::vector<Moment>& moments) override;

  /// What "near" is, from near to far; each holds those before it.
  static constexpr std::array<double, 4> kBandsMm{0.5, 1, 2, 4};

  /// A burr at work within reach of a structure, at most 100 a second.
  struct Sample {
    double t_s = 0;
    Vec3 at_mm;
    float distance_mm = 0, force_n = 0;
    float speed_mm_s = 0;  ///< HandMotion's; not a number within kWindowS of where the hand's path is not known
  };
  /// By the structure's value.
  [[nodiscard]] const std::map<std::uint8_t, std::vector<Sample>>& samples() const { return samples_; }

 private:
  // What a hand does at a structure, and all hands together.
  struct Contact {
    Recurrence touch, injury;
  };
  struct Of {
    double least_mm = 1e9, excess_ns = 0;
    std::uint64_t touches = 0;
    std::uint64_t touched = 0, injured = 0;              // ticks in which any hand does
    std::uint64_t touched_until = 0, injured_until = 0;  // behind the last of them
    std::array<std::uint64_t, kBandsMm.size()> near{};   // ticks of drilling within each band
    std::array<double, kBandsMm.size()> near_mm3{};
    bool touched_first = false;
  };
  // A sample whose speed is known a window later.
  struct Waiting {
    std::uint64_t tick = 0;
    std::uint8_t structure = 0;
    std::size_t number = 0;
  };
  struct Hand {
    explicit Hand(double rate_hz = 1000) : motion(rate_hz) {}
    bool begun = false;
    HandMotion motion;
    std::vector<Contact> at;         // by number of the structure
    std::vector<Recurrence> excess;  // by force limit
    std::vector<Waiting> waiting;
  };
  void move(Hand& hand, const TickRecord& tick);
  void forget();
  EvidenceScene scene_;
  std::map<std::uint8_t, std::vector<Sample>> samples_;
  std::vector<Of> of_;
  std::vector<double> each_;
  std::vector<Moment> moments_;
  std::uint64_t ruled_ = 0, allowed_ = 0;
  PerHand<Hand> hands_;
  std::uint64_t known_ = 0;  // ticks of the first hand
  std::optional<StepClock> steps_;
};

}  // namespace osteo::inline assessment
