// The machine's sound card.
#pragma once
#include <functional>
#include <memory>
#include <span>
#include <string>

namespace osteo::inline app {

/// Plays one channel at 48 kHz on the system's default output (SDL 2: PipeWire, PulseAudio, ALSA; SDL_AUDIODRIVER
/// chooses another).
class AudioOut {
 public:
  static constexpr int kSamples = 256;  ///< asked for at a time: 5.3 ms; what the card keeps besides is the driver's

  /// Begins to play. `fill` is called in a thread of the driver, for as many samples as it asks; it must not wait.
  /// Error(failed) where there is no output, with the driver's reason.
  explicit AudioOut(std::function<void(std::span<float>)> fill);
  /// `fill` is not called any more when this returns.
  ~AudioOut();
  AudioOut(const AudioOut&) = delete;
  AudioOut& operator=(const AudioOut&) = delete;

  /// While one lives, `fill` is not called.
  class Pause {
   public:
    explicit Pause(AudioOut& out);
    ~Pause();
    Pause(const Pause&) = delete;
    Pause& operator=(const Pause&) = delete;

   private:
    AudioOut& out_;
  };
  [[nodiscard]] const std::string& driver() const { return driver_; }
  /// Between a call and what it filled being handed on: at least this.
  [[nodiscard]] double buffer_s() const { return buffer_s_; }

 private:
  std::function<void(std::span<float>)> fill_;
  std::string driver_;
  double buffer_s_ = 0;
  unsigned device_ = 0;
};

}  // namespace osteo::inline app
