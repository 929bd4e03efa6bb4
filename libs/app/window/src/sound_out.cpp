#include "osteo/app/window/sound_out.h"

#include <algorithm>
#include <cmath>

#include "audio_out.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/translate.h"
#include "osteo/session/scene/sound.h"

namespace osteo::inline app {

struct SoundOut::Playing {
  // What the card's thread looks at; exchanged while it is kept out.
  std::unique_ptr<LiveSound> live;
  MonitorSound* monitor = nullptr;
  AudioOut card{[this](std::span<float> out) {
    if (live) {
      live->fill(out);
      if (monitor != nullptr) monitor->mix(out);
    } else {
      std::fill(out.begin(), out.end(), 0.0F);
    }
  }};
};

SoundOut::SoundOut(bool on, double volume, bool alarms) : on_(on), volume_(volume), alarms_(alarms) {}
SoundOut::~SoundOut() = default;

void SoundOut::follow(Rehearsal* rehearsal) {
  rehearsal_ = rehearsal;
  play();
}

// The end of the stream is there only while it is heard, so that silence costs nothing.
void SoundOut::play() {
  if (on_ && rehearsal_ != nullptr && !playing_ && failure_.empty()) {
    try {
      playing_ = std::make_unique<Playing>();
    } catch (const Error& e) {
      failure_ = e.what();
    }
  }
  if (!playing_) return;
  std::unique_ptr<LiveSound> next;
  if (on_ && rehearsal_ != nullptr) {
    next = std::make_unique<LiveSound>(*rehearsal_, alarms_, volume_);
  }
  const AudioOut::Pause pause(playing_->card);
  std::swap(playing_->live, next);
  playing_->monitor = monitor_;
}

void SoundOut::mix_in(MonitorSound* monitor) {
  monitor_ = monitor;
  play();
}

void SoundOut::turn(bool on) {
  if (on && !on_) failure_.clear();  // a card may have come
  on_ = on;
  play();
}

void SoundOut::set_volume(double volume) {
  volume_ = std::clamp(volume, 0.0, 1.0);
  if (playing_ && playing_->live) playing_->live->set_volume(volume_);
}

void SoundOut::set_alarms(bool alarms) {
  alarms_ = alarms;
  if (playing_ && playing_->live) playing_->live->set_alarms(alarms_);
}

std::string SoundOut::status() const {
  if (!failure_.empty()) return failure_;
  if (!playing_) return on_ ? "" : tr("off");
  return filled(
      on_ ? tr("through {driver}, {ms} ms at a time") : tr("off; {driver}, {ms} ms at a time"),
      {{"driver", playing_->card.driver()}, {"ms", std::to_string(std::lround(1000 * playing_->card.buffer_s()))}});
}

}  // namespace osteo::inline app
