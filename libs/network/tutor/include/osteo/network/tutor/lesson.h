// What is played back: the hands of a recorded session, and the way that the first of them took.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "osteo/session/recording/session_reader.h"
#include "osteo/simulation/haptics/haptic_setup.h"
#include "osteo/simulation/haptics/stream.h"

namespace osteo::inline network {

/// Part of a session, in memory: 28 bytes for each tick and hand, and 20 for each fifth of a millimetre of the way.
/// Never changed.
struct Lesson {
  static constexpr double kStepMm = 0.2;
  /// A place on the way of the first hand, kStepMm of way after the one before: jitter of a resting hand is no way.
  struct Point {
    std::array<float, 3> at_mm{};
    float arc_mm = 0;          ///< of way from the beginning
    std::uint32_t sample = 0;  ///< the first that is there
  };
  double rate_hz = 1000;
  std::uint64_t first_tick = 0;                  ///< of the session
  HapticSetup setup;                             ///< with the settings in force at first_tick
  std::vector<std::vector<DeviceSample>> hands;  ///< samples of each, all of one length, at least one
  std::vector<Point> way;                        ///< at least one
  std::vector<SceneAction> actions;              ///< settings and what moves dust, ticks from first_tick

  [[nodiscard]] std::size_t size() const { return hands.front().size(); }
  [[nodiscard]] double seconds() const { return static_cast<double>(size()) / rate_hz; }
};

/// From `from_s` to `to_s` (0: the end). Errors: corrupt, where this version cannot repeat the session, or ticks are
/// missing there; usage, where the part is empty, where something is done in it that other bone follows from than from
/// hands alone (saw, split, move, plates, undo, soft tissue, another guide), where a curve holds the first hand, or
/// where it has more than kMaxHands - 1 hands. Each says when.
[[nodiscard]] Lesson read_lesson(const SessionReader& session, double from_s, double to_s);

/// The way of samples: points, not of resting.
[[nodiscard]] std::vector<Lesson::Point> way_of(std::span<const DeviceSample> samples);

/// How far apart experts' ways are: of the distances from each point of `lesson`'s way to the nearest of each other,
/// the given share (0.75 is where a learner's error counts as one). 0 without others. Time: points of both, multiplied.
[[nodiscard]] double spread_mm(const Lesson& lesson, std::span<const Lesson> others, double share = 0.75);

}  // namespace osteo::inline network
