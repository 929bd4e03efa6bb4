#include "osteo/network/tutor/live_run.h"

#include <chrono>
#include <utility>

#include "osteo/core/rt/loop.h"

namespace osteo::inline network {
std::int64_t steady_us() noexcept {
  return monotonic_ns() / 1000;
}

HostThread::HostThread(LiveHost& host, Rehearsal& rehearsal, const std::string& address, int port)
    : host_(host),
      rehearsal_(rehearsal),
      // Half a minute of two hands: what a busy machine may keep a thread waiting for.
      stream_(rehearsal.stream().add_reader(1 << 16)),
      socket_(address, port),
      port_(socket_.port()) {
  rehearsal.look(
      [&](const World& world, SceneReaders&) { dispatcher_ = std::make_unique<ReaderDispatcher>(stream_, world); });
  dispatcher_->add(host, false);
  thread_ = std::thread([this] { run(); });
}

void HostThread::run() {
  bool reported = false;
  while (!stop_) {
    socket_.wait_ms(1);
    UdpPeer from;
    for (int n = 0; n < kMaxPackets; ++n) {
      const auto packet = socket_.receive(from);
      if (!packet) break;
      host_.receive(from, *packet, steady_us());
    }
    const std::uint64_t ticks = ticks_;
    dispatcher_->drain();
    if (ticks > 0 && !std::exchange(reported, true)) {
      dispatcher_->end(ticks);
      host_.over(ticks);
    }
    for (const OutgoingPacket& o : host_.poll(steady_us())) socket_.send(o.to, o.bytes);
  }
}

HostThread::~HostThread() {
  stop_ = true;
  thread_.join();
  rehearsal_.stream().remove_reader(stream_);
}

void wait_for_all(const LiveHost& host, double most_s) {
  const std::int64_t begin = steady_us();
  while (host.waited_for(steady_us()) && steady_us() - begin < static_cast<std::int64_t>(most_s * 1e6))
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  // A few packets more, that say so: what was the last may get lost.
  std::this_thread::sleep_for(std::chrono::milliseconds(40));
}

}  // namespace osteo::inline network
