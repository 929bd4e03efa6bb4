// What of a stream is heard.
#pragma once
#include <atomic>
#include <cstdint>
#include <filesystem>
#include <set>
#include <span>
#include <vector>

#include "osteo/core/data/volume.h"
#include "osteo/session/scene/rehearsal.h"
#include "osteo/simulation/haptics/stream.h"
#include "osteo/simulation/sound/synthesizer.h"

namespace osteo::inline session {

/// Which structures are soft under the drill, so that bone over them sounds duller: values of those whose names speak
/// of a sinus, dura, vein, artery or bulb.
[[nodiscard]] std::set<std::uint32_t> soft_structures(std::span<const Structure> structures);

/// Goes along with ticks and actions; neither allocates, locks nor throws in take().
class SoundTracker {
 public:
  SoundTracker(std::set<std::uint32_t> soft, double rate_hz, bool alarms);
  void set_alarms(bool alarms) noexcept { alarms_ = alarms; }

  void take(const SceneAction& action) noexcept;
  /// Ticks in order, of each tick the hands in theirs.
  void take(const TickRecord& record) noexcept;
  [[nodiscard]] const SoundState& state() const { return state_; }

 private:
  [[nodiscard]] bool instruments_touch(std::uint64_t tick) noexcept;
  std::set<std::uint32_t> soft_;
  double rate_hz_;
  bool alarms_;
  SoundState state_;
  bool standing_suction_ = false, standing_water_ = false;  // by action, beside the burr
  std::uint64_t injured_until_ = 0, touched_until_ = 0;
  double thickness_mm_[kMaxHands] = {};
  TickRecord last_[kMaxHands];  // of each hand that holds an instrument
  bool has_[kMaxHands] = {};
  bool touching_ = false;
};

/// The sound of a rehearsal while it runs: an end of its stream for itself, drained by whoever asks for samples, such
/// as the thread of a sound card. Latency: what happened before the call is in its samples.
class LiveSound {
 public:
  /// The rehearsal must outlive it.
  LiveSound(Rehearsal& rehearsal, bool alarms, double volume);
  ~LiveSound();
  LiveSound(const LiveSound&) = delete;
  LiveSound& operator=(const LiveSound&) = delete;

  /// The next samples at Synthesizer::kRateHz, from one thread at a time: neither allocates, locks nor throws. Where no
  /// ticks come any more it fades to silence.
  void fill(std::span<float> out) noexcept;
  /// 0 to 1, from any thread; each as it was until the next fill().
  void set_volume(double volume) { volume_ = volume; }
  void set_alarms(bool alarms) { alarms_ = alarms; }

 private:
  Stream& stream_;
  StreamReader& from_;
  SoundTracker tracker_;
  Synthesizer synthesizer_;
  std::vector<TickRecord> ticks_;
  std::vector<VoxelChange> changes_;
  std::vector<SceneAction> actions_;
  std::atomic<double> volume_;
  std::atomic<bool> alarms_;
  double without_ticks_s_ = 0;
};

struct SoundFileFacts {
  double seconds = 0;
  double loudest_db = -200;      ///< of full scale: the largest sample
  double most_held_down_db = 0;  ///< by SafeLevel
  std::uint64_t gaps = 0;        ///< of the session: silent
};
/// The sound of a recorded session as a WAV file (48 kHz, 16 bits, one channel): a function of its records alone. O(its
/// length); memory of a frame. Errors: those of SessionReader and of write_atomically.
SoundFileFacts write_session_sound(const SessionReader& session, const std::set<std::uint32_t>& soft, double volume,
                                   bool alarms, const std::filesystem::path& out, const Context& context);

}  // namespace osteo::inline session
