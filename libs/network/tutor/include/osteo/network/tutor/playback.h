// Haptic playback: a recorded hand leads the hand of who learns (D. Morris 2006, section 3.4.1).
#pragma once
#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <vector>

#include "osteo/network/tutor/lesson.h"
#include "osteo/network/tutor/playback_params.h"
#include "osteo/simulation/haptics/device.h"
#include "osteo/simulation/haptics/guide.h"
#include "osteo/simulation/haptics/simulated_device.h"

namespace osteo::inline network {

/// What the session begins with: hand 0 led by hand 1, in feel and graphics without a pull.
[[nodiscard]] HandGuide guide_of(const PlaybackParams& p);

/// Help as needed: after each trial K = forget K + gain w(error), between 0 and 1, with w = 0 in the dead zone. It
/// forgets faster than one learns when forget is below what errors fall by from trial to trial; without the dead zone
/// it would never come to 0 (J. Emken, D. Reinkensmeyer 2007). The gain is such that an error of kWorstMm asks for all
/// of it. An error is the 90th percentile of a trial.
class FadingGuide {
 public:
  static constexpr double kWorstMm = 5;
  FadingGuide(double forget, double dead_zone_mm) : forget_(forget), dead_mm_(dead_zone_mm) {}
  void add(double error_mm) noexcept;
  /// Nothing added: as before.
  void end_trial() noexcept;
  [[nodiscard]] double strength() const { return strength_; }
  [[nodiscard]] double last_error_mm() const { return error_mm_; }  ///< of the last trial
  [[nodiscard]] int trials() const { return trials_; }

 private:
  static constexpr double kBinMm = 0.05;
  double forget_, dead_mm_, strength_ = 1, error_mm_ = 0;
  int trials_ = 0;
  std::uint32_t count_ = 0;
  std::array<std::uint32_t, 512> bins_{};  // the last holds all that is farther
};

/// Which sample of the lesson is now. Pure: follows from where the hand is, tick by tick. First the target goes from
/// the hand to the lesson's beginning, at kApproachMmPerS, and waits for the hand; where nothing leads it is there at
/// once and time begins.
class LessonClock {
 public:
  static constexpr double kApproachMmPerS = 30, kStartMm = 1;
  LessonClock(const Lesson& lesson, const PlaybackParams& params);
  /// A tick on.
  void step(Vec3 hand_mm, double dt_s) noexcept;

  [[nodiscard]] bool started() const { return started_; }
  [[nodiscard]] bool ended() const { return ended_; }
  [[nodiscard]] std::size_t sample() const { return sample_; }
  /// The first time that it is this sample.
  [[nodiscard]] bool goes_on() const { return goes_on_; }
  [[nodiscard]] Vec3 target_mm() const { return target_; }

 private:
  [[nodiscard]] double behind_mm(Vec3 hand_mm) noexcept;
  const Lesson& lesson_;
  const bool waits_, by_clock_;
  const double tolerance_mm_;
  bool begun_ = false, started_ = false, ended_ = false, goes_on_ = false;
  std::size_t sample_ = 0, furthest_ = 0, point_ = 0;
  Vec3 target_;
};

/// What runs beside the hands of a playback; the servo's, but for what says so.
struct Playback {
  static constexpr double kLetGoS = 0.05;  ///< so soon nothing pulls when `on` is taken back
  Playback(std::shared_ptr<const Lesson> lesson, const PlaybackParams& params);
  std::shared_ptr<const Lesson> lesson;
  const PlaybackParams params;
  LessonClock clock;
  FadingGuide fading;
  Vec3 hand_mm;             ///< of who learns
  double strength = 0;      ///< of the pull, with ramps
  double trial_s = 0;       ///< since the last
  std::uint64_t begun = 0;  ///< tick at which the lesson's time began

  double patience_s = 0;  ///< the lesson ends when its time has not gone on for so long; 0: it waits for ever
  double waited_s = 0;
  bool given_up = false;  ///< it ended so

  std::atomic<bool> on{true};      ///< from any thread: the pull may be let go and taken up again
  std::atomic<double> seconds{0};  ///< for any thread: of the lesson, now
  std::atomic<double> pulled{0};   ///< for any thread: strength, 0 to 1
  std::atomic<bool> over{false};   ///< for any thread: the lesson has ended
};

/// Stands before the device of who learns: where the hand is, is told to the lesson; its pedal is up where the expert's
/// burr drills, and its instrument the expert's then.
class LedDevice final : public Device {
 public:
  LedDevice(std::unique_ptr<Device> held, std::shared_ptr<Playback> playback)
      : held_(std::move(held)), playback_(std::move(playback)) {}
  DeviceSample read(std::uint64_t tick, double dt_s, Vec3 force_n) noexcept override;
  void set_tool(std::uint8_t tool) noexcept override { held_->set_tool(tool); }
  bool lead(const HandWay& way) noexcept override { return held_->lead(way); }
  Led led() noexcept override { return held_->led(); }
  void feel(Vec3 force_n, Vec3 normal, double stiffness) noexcept override { held_->feel(force_n, normal, stiffness); }
  [[nodiscard]] Device& held() noexcept override { return held_->held(); }
  [[nodiscard]] DeviceTraits traits() const override { return held_->traits(); }
  [[nodiscard]] std::string trouble() const override { return held_->trouble(); }
  [[nodiscard]] bool active(std::uint64_t tick) const noexcept override { return held_->active(tick); }

 private:
  std::unique_ptr<Device> held_;
  std::shared_ptr<Playback> playback_;
};

/// A recorded hand as one of the session's own; the first of them leads.
class RecordedDevice final : public Device {
 public:
  RecordedDevice(std::shared_ptr<Playback> playback, std::size_t hand) : playback_(std::move(playback)), hand_(hand) {}
  DeviceSample read(std::uint64_t tick, double dt_s, Vec3 force_n) noexcept override;
  [[nodiscard]] DeviceTraits traits() const override { return playback_->lesson->setup.device_of(hand_); }
  [[nodiscard]] bool active(std::uint64_t) const noexcept override {
    return !playback_->over.load(std::memory_order_relaxed);
  }

 private:
  std::shared_ptr<Playback> playback_;
  std::size_t hand_;
};

/// The devices of a playback: who learns, then the lesson's hands; and the setup that goes with them (their traits).
[[nodiscard]] std::vector<std::unique_ptr<Device>> playback_devices(std::unique_ptr<Device> learner,
                                                                    const std::shared_ptr<Playback>& playback,
                                                                    HapticSetup& setup);
/// The lesson's actions with the guide before them, for RehearsalOptions::actions. Where time may wait, settings within
/// the lesson are an Error(usage), and what moves dust is left out.
[[nodiscard]] std::vector<SceneAction> playback_actions(const Playback& playback);

/// A hand without a will that holds a simulated device (`arm`; of 0.1 kg unless told): a spring (N/m) to a place that
/// gives way with kYieldS. 100 to 500 N/m are a grip's. Its damping at slow motion is stiffness x kYieldS. Its pedal
/// and instrument are the recorded ones of `playback`.
class FollowingHand final : public Device {
 public:
  static constexpr double kYieldS = 0.1;
  FollowingHand(double stiffness_n_per_m, Vec3 start_mm, std::shared_ptr<const Playback> playback,
                const SimulatedDeviceParams& arm = {});
  DeviceSample read(std::uint64_t tick, double dt_s, Vec3 force_n) noexcept override;
  [[nodiscard]] DeviceTraits traits() const override { return device_.traits(); }
  [[nodiscard]] bool active(std::uint64_t) const noexcept override { return stays; }
  [[nodiscard]] Vec3 velocity_mm_s() const { return device_.velocity_mm_s(); }

  bool stays = false;  ///< the session goes on when the lesson has ended
  Vec3 push_n;         ///< of somebody else, besides

 private:
  SimulatedDevice device_;
  double stiffness_n_per_mm_;
  Vec3 place_;
  std::shared_ptr<const Playback> playback_;
};

/// What a guided session came to, from its records alone: the same numbers whenever it is read.
struct GuidedFacts {
  std::uint64_t ticks = 0;                     ///< in which the lesson's time went, or the hand was led
  double rms_mm = 0, p95_mm = 0, most_mm = 0;  ///< between the hand and who leads
  double most_pull_n = 0, work_mj = 0;         ///< of the guide alone; work done on the hand
  double most_work_mj = 0;                     ///< the largest that it came to
  double guided_s = 0, capped_s = 0;           ///< the guard's force limit was reached in so much of it
};
/// From `begin_tick` on, hand 0 and hand 1. Error(corrupt).
[[nodiscard]] GuidedFacts measure_guided(const SessionReader& session, std::uint64_t begin_tick);

}  // namespace osteo::inline network
