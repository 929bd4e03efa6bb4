#include "osteo/session/recorder.h"

#include <algorithm>
#include <chrono>

namespace osteo {

Recorder::Recorder(StreamReader& reader, const std::filesystem::path& path, const SessionHeader& header)
    : reader_(reader), writer_(path, header), ticks_buffer_(256), changes_buffer_(1 << 20) {}

Recorder::~Recorder() {
  stop();
}

void Recorder::start() {
  thread_ = std::thread([this] {
    auto synced = std::chrono::steady_clock::now();
    while (!stop_) {
      drain();
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
      if (const auto now = std::chrono::steady_clock::now(); now - synced > std::chrono::seconds(1)) {
        writer_.sync();
        synced = now;
      }
    }
  });
}

std::size_t Recorder::drain() {
  std::size_t total = 0;
  for (;;) {
    // Ticks first: the changes of a tick are in the ring before its record.
    const std::size_t n = reader_.ticks.pop(ticks_buffer_);
    if (n == 0) return total;
    std::size_t wanted = 0;
    for (std::size_t t = 0; t < n; ++t) {
      wanted += ticks_buffer_[t].voxels_changed;
      removed_mm3_ += static_cast<double>(ticks_buffer_[t].removed_mm3);
    }
    if (wanted > changes_buffer_.size()) changes_buffer_.resize(wanted);
    const std::size_t got = reader_.changes.pop({changes_buffer_.data(), wanted});
    for (SceneAction a; reader_.actions.pop({&a, 1}) == 1;) actions_.push_back(a);
    total += n;
    try {
      std::size_t begin = 0, changes_begin = 0;
      const auto write_up_to = [&](std::size_t end) {
        std::size_t changes_end = changes_begin;
        for (std::size_t t = begin; t < end; ++t) changes_end += ticks_buffer_[t].voxels_changed;
        changes_end = std::min(changes_end, got);
        if (!failure_ && end > begin)
          writer_.append({ticks_buffer_.data() + begin, end - begin},
                         {changes_buffer_.data() + changes_begin, changes_end - changes_begin});
        begin = end;
        changes_begin = changes_end;
      };
      // An action stands before its tick, whose record may not be here yet.
      while (!actions_.empty() && actions_.front().tick <= ticks_buffer_[n - 1].tick) {
        std::size_t at = begin;
        while (ticks_buffer_[at].tick < actions_.front().tick) ++at;
        write_up_to(at);
        if (!failure_) writer_.append(actions_.front());
        actions_.pop_front();
      }
      write_up_to(n);
      if (failure_) continue;  // keep draining, so that the servo's ring does not fill
      ticks_ += n;             // told only once the file has them: these survive whatever happens to this process
    } catch (const Error& e) {
      failure_ = e;
    }
  }
}

void Recorder::stop() {
  stop_ = true;
  if (thread_.joinable()) thread_.join();
  drain();
  // What was done after the last tick.
  for (SceneAction a; reader_.actions.pop({&a, 1}) == 1;) actions_.push_back(a);
  for (; !actions_.empty() && !failure_; actions_.pop_front()) writer_.append(actions_.front());
}

}  // namespace osteo
