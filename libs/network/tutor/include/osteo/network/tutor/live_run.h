// Live tutoring in real time: the threads and sockets around LiveHost and LiveGuest.
#pragma once
#include <atomic>
#include <functional>
#include <memory>
#include <string>
#include <thread>

#include "osteo/network/tutor/live.h"
#include "osteo/network/tutor/udp.h"
#include "osteo/session/recording/session_file.h"

namespace osteo::inline network {

/// What a copy needs to know of a session before its first tick, as bytes, and back: its settings, and past_bytes().
/// Error(corrupt).
[[nodiscard]] Bytes settings_bytes(const SessionHeader& header, const Bytes& past = {});
[[nodiscard]] SessionHeader settings_of(const Bytes& bytes);

/// A FarDevice that a session may own.
class FarHand final : public Device {
 public:
  explicit FarHand(std::shared_ptr<FarDevice> far) : far_(std::move(far)) {}
  DeviceSample read(std::uint64_t tick, double dt_s, Vec3 force_n) noexcept override {
    return far_->read(tick, dt_s, force_n);
  }
  [[nodiscard]] DeviceTraits traits() const override { return far_->traits(); }
  [[nodiscard]] bool active(std::uint64_t) const noexcept override { return false; }

 private:
  std::shared_ptr<FarDevice> far_;
};

/// Takes packets and sends them in a thread of its own, at most kMaxPackets between two looks at what is to be sent: a
/// flood costs this thread, and what the system's buffer does not hold, but no other. The same thread follows the
/// session's stream, beside its other readers, which may take longer.
class HostThread {
 public:
  static constexpr int kMaxPackets = 2000;
  /// Before `rehearsal` starts, and gone before it. Errors: of UdpSocket.
  HostThread(LiveHost& host, Rehearsal& rehearsal, const std::string& address, int port);
  ~HostThread();
  [[nodiscard]] int port() const { return port_; }
  /// The session had so many ticks: those who have joined are told, once all are in the log.
  void over(std::uint64_t ticks) { ticks_ = ticks; }

 private:
  void run();
  LiveHost& host_;
  Rehearsal& rehearsal_;
  StreamReader& stream_;
  std::unique_ptr<ReaderDispatcher> dispatcher_;
  UdpSocket socket_;
  const int port_;
  std::atomic<bool> stop_{false};
  std::atomic<std::uint64_t> ticks_{0};
  std::thread thread_;
};

/// Until everyone who may still be there has all of the session, at most so long.
void wait_for_all(const LiveHost& host, double most_s);

/// Microseconds since some beginning, steadily.
[[nodiscard]] std::int64_t steady_us() noexcept;

}  // namespace osteo::inline network
