// What a nerve monitor writes down and what it sounds like.
#pragma once
#include <atomic>
#include <vector>

#include "osteo/core/rt/ring.h"
#include "osteo/session/scene/monitor_reader.h"
#include "osteo/session/scene/rehearsal.h"
#include "osteo/simulation/nerve/activity.h"

namespace osteo::inline session {

// -- What a nerve monitor would have written down, as notes of the session.

/// Settings of the stimulator as stimulator_notes() reads them; bursts, trains, answers, thresholds as notes "monitor".
/// In the thread that follows the stream, which may leave notes. `rehearsal` and `wiring` must outlive it.
class MonitorNotes final : public MonitorSink {
 public:
  MonitorNotes(Rehearsal& rehearsal, const MonitorWiring& wiring) : rehearsal_(rehearsal), wiring_(wiring) {}
  void event(const MonitorEvent& event) override;

 private:
  Rehearsal& rehearsal_;
  const MonitorWiring& wiring_;
};

// -- What a nerve monitor sounds like: the signal itself, and a tone where it crosses its threshold.

/// Between the thread that follows the stream and that of the sound card. Silent while a stimulus' artefact lasts, and
/// where it is muted. Latency, behind the block that a monitor tells: the tone begins with the next mix(), the signal
/// at most kMaxWaitingS later; what waits for longer is left out. Memory: fixed.
class MonitorSound final : public MonitorSink {
 public:
  static constexpr double kMaxWaitingS = 0.04, kToneS = 0.15, kBlankingS = 0.004;
  static constexpr float kToneHz = 1000, kFullScaleUv = 500;

  MonitorSound();
  void block(const MonitorBlock& block) override;
  void event(const MonitorEvent& event) override;

  /// Adds to what is there, 48 kHz, from one thread; neither allocates, locks nor throws. Sum within -1 to 1.
  void mix(std::span<float> out) noexcept;

  /// From any thread.
  void mute(bool on) { muted_ = on; }
  [[nodiscard]] bool muted() const { return muted_; }
  void set_volume(double volume) { volume_ = static_cast<float>(volume); }
  [[nodiscard]] double volume() const { return static_cast<double>(volume_.load()); }
  /// Of which channel the signal is heard; -1: of the largest, block by block.
  void set_channel(int channel) { channel_ = channel; }
  [[nodiscard]] int channel() const { return channel_; }

 private:
  Ring<float> waiting_;  // of the signal, 30 kHz
  std::vector<float> samples_;
  std::uint64_t blank_from_ = 0, blank_until_ = 0;
  std::atomic<std::uint32_t> tones_{0};  // asked for
  std::atomic<bool> muted_{false};
  std::atomic<float> volume_{0.7F};
  std::atomic<int> channel_{-1};
  // The card's thread.
  std::uint32_t tones_heard_ = 0;
  int tone_left_ = 0;
  float tone_phase_ = 0, at_ = 0, last_ = 0, next_ = 0;
  bool primed_ = false;
  std::array<float, 512> taken_{};
  std::size_t taken_at_ = 0, taken_size_ = 0;
};

}  // namespace osteo::inline session
