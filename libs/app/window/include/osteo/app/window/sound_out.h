// What the rehearsal that runs sounds like, on the machine's sound card.
#pragma once
#include <memory>
#include <string>

#include "osteo/session/scene/monitor_sound.h"
#include "osteo/session/scene/rehearsal.h"

namespace osteo::inline app {

/// From one thread. Where there is no sound card it says why and stays silent: a rehearsal goes on without.
class SoundOut {
 public:
  /// `on`: opens the sound card at the first session; else when it is turned on.
  SoundOut(bool on, double volume, bool alarms);
  ~SoundOut();
  SoundOut(const SoundOut&) = delete;
  SoundOut& operator=(const SoundOut&) = delete;

  /// Leaves the rehearsal it followed; null: follows none. Called before a rehearsal ends.
  void follow(Rehearsal* rehearsal);
  /// Beside it, while sound is on, a nerve monitor; null: none. It must live until it is exchanged.
  void mix_in(MonitorSound* monitor);

  [[nodiscard]] bool on() const { return on_; }
  [[nodiscard]] double volume() const { return volume_; }
  [[nodiscard]] bool alarms() const { return alarms_; }
  void turn(bool on);
  void set_volume(double volume);
  void set_alarms(bool alarms);
  /// Why no card could be opened; empty: one was, or none was looked for.
  [[nodiscard]] const std::string& failure() const { return failure_; }
  /// For people: through what it plays, or why not.
  [[nodiscard]] std::string status() const;

 private:
  struct Playing;
  void play();
  bool on_;
  double volume_;
  bool alarms_;
  Rehearsal* rehearsal_ = nullptr;
  MonitorSound* monitor_ = nullptr;
  std::string failure_;
  std::unique_ptr<Playing> playing_;
};

}  // namespace osteo::inline app
