// What a reader keeps of each hand from tick to tick: its own state, where it is and how fast, when it is at rest.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "osteo/core/data/vec.h"
#include "osteo/simulation/haptics/stream.h"

namespace osteo::inline assessment {

/// A T for each hand, by TickRecord::hand. Whatever is compared with "the tick before" is a hand's own: of another hand
/// it says nothing.
template <class T>
class PerHand {
 public:
  PerHand() : of_{} {}
  explicit PerHand(const T& each) : PerHand(each, std::make_index_sequence<kMaxHands>()) {}
  /// Hands from kMaxHands on share the last one: no session has them.
  [[nodiscard]] T& operator[](std::uint32_t hand) { return of_[std::min<std::size_t>(hand, of_.size() - 1)]; }
  [[nodiscard]] auto begin() { return of_.begin(); }
  [[nodiscard]] auto end() { return of_.end(); }
  [[nodiscard]] auto begin() const { return of_.begin(); }
  [[nodiscard]] auto end() const { return of_.end(); }

 private:
  template <std::size_t... n>
  PerHand(const T& each, std::index_sequence<n...>) : of_{(static_cast<void>(n), each)...} {}
  std::array<T, kMaxHands> of_;
};

/// Says when something begins that comes and goes: what comes again soon is the same.
class Recurrence {
 public:
  /// True where it begins: it was not there in the last `same_s`. In order of ticks.
  bool begins(std::uint64_t tick, double rate_hz, double same_s) {
    const bool is_new = !on_ || static_cast<double>(tick - last_) > same_s * rate_hz;
    on_ = true;
    last_ = tick;
    return is_new;
  }
  /// What comes next begins.
  void forget() { on_ = false; }

 private:
  bool on_ = false;
  std::uint64_t last_ = 0;
};
/// Contacts of a hand with a structure that are closer than this are one.
inline constexpr double kSameContactS = 0.1;

/// Place and speed of a hand from means over a window. Positions jitter by an encoder's steps and by trembling; the
/// difference of two neighbouring ticks is that jitter times the rate (a step of 0.04 mm at 1 kHz is 40 mm/s). Speed is
/// from the mean of the window before last to that of the last: a low-pass without delay, told a window later. Memory:
/// two windows of positions. O(1) a tick.
class HandMotion {
 public:
  /// Half of a speed's amplitude is left at 18 Hz: about as strokes are smoothed.
  static constexpr double kWindowS = 0.025;

  explicit HandMotion(double rate_hz, double window_s = kWindowS)
      : rate_hz_(rate_hz),
        window_(static_cast<std::uint64_t>(std::max(1LL, std::llround(window_s * rate_hz)))),
        at_mm_(2 * window_) {}

  /// Ticks in order; one that does not follow the last begins again.
  void add(std::uint64_t tick, Vec3 at_mm) {
    if (count_ > 0 && tick != tick_ + 1) forget();
    tick_ = tick;
    const Vec3 oldest = at_mm_[count_ % at_mm_.size()], middle = at_mm_[(count_ + window_) % at_mm_.size()];
    at_mm_[count_ % at_mm_.size()] = at_mm;
    last_sum_ += at_mm;
    if (count_ >= window_) {
      last_sum_ = last_sum_ - middle;
      before_sum_ += middle;
    }
    if (count_ >= 2 * window_) before_sum_ = before_sum_ - oldest;
    ++count_;
  }
  /// Nothing is known of the hand: what comes next begins again.
  void forget() {
    count_ = 0;
    last_sum_ = before_sum_ = {};
  }

  [[nodiscard]] std::uint64_t window() const { return window_; }  ///< ticks
  /// Mean of the last window, once there is one: the place half a window ago.
  [[nodiscard]] std::optional<Vec3> place_mm() const {
    if (count_ < window_) return std::nullopt;
    return last_sum_ / static_cast<double>(window_);
  }
  /// Once there are two windows: the speed a window ago, at tick `speed_tick()`.
  [[nodiscard]] std::optional<double> speed_mm_s() const {
    if (count_ < 2 * window_) return std::nullopt;
    const auto w = static_cast<double>(window_);
    return length(last_sum_ - before_sum_) / w / w * rate_hz_;
  }
  [[nodiscard]] std::uint64_t speed_tick() const { return tick_ - window_; }

 private:
  double rate_hz_;
  std::uint64_t window_;
  std::vector<Vec3> at_mm_;  // the last two windows, by count
  std::uint64_t count_ = 0, tick_ = 0;
  Vec3 last_sum_, before_sum_;  // of the last window and of the one before
};

/// Time in which nobody does anything: no pedal is down and no hand goes faster than kStillMmPerS, for kIdleAfterS or
/// longer. Speeds are those of means of a tenth of a second: an encoder's steps and a tremor of some 10 Hz move them
/// little. O(hands) a tick; memory grows with how often a hand comes to rest.
class IdleClock {
 public:
  static constexpr double kStillMmPerS = 2, kIdleAfterS = 1, kWindowS = 0.1;

  explicit IdleClock(double rate_hz);
  /// Of all hands, each hand's in order; where ticks are missing what is idle ends.
  void add(const TickRecord& record);
  /// Ticks idle up to now.
  [[nodiscard]] std::uint64_t idle_ticks() const;

 private:
  struct Span {
    std::uint64_t begin = 0, end = 0;
    [[nodiscard]] std::uint64_t ticks() const { return end > begin ? end - begin : 0; }
  };
  // Ticks in a row at which something holds.
  struct Row {
    std::vector<Span> before;
    Span now;
  };
  struct Hand {
    HandMotion motion;
    Row still, up;  // at rest; pedal up
    bool there = false;
  };
  // The row goes on, or another begins.
  void hold(Row& row, std::uint64_t tick) const;
  [[nodiscard]] std::vector<Span> long_ones(const Row& row) const;
  [[nodiscard]] std::vector<Span> common(const std::vector<Span>& a, const std::vector<Span>& b) const;
  std::uint64_t least_;  // ticks
  PerHand<Hand> hands_;
};

}  // namespace osteo::inline assessment
