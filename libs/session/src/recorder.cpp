#include "osteo/session/recorder.h"

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
    total += n;
    if (failure_) continue;  // keep draining, so that the servo's ring does not fill
    try {
      writer_.append({ticks_buffer_.data(), n}, {changes_buffer_.data(), got});
      ticks_ += n;  // told only once the file has them: these survive whatever happens to this process
    } catch (const Error& e) {
      failure_ = e;
    }
  }
}

void Recorder::stop() {
  stop_ = true;
  if (thread_.joinable()) thread_.join();
  drain();
}

}  // namespace osteo
