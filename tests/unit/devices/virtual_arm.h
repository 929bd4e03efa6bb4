// A WoodenHaptics arm that exists as equations, at the other end of a socket: reports encoders, takes currents, has
// mass, damping, a hand on it and the firmware's watchdog.
#pragma once
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <mutex>
#include <stdexcept>
#include <thread>

#include "osteo/simulation/devices/devices.h"
#include "osteo/simulation/haptics/simulated_device.h"

namespace osteo::test {

class VirtualArm {
 public:
  explicit VirtualArm(const WoodenHapticsGeometry& geometry, Vec3 start_mm)
      : kinematics_(geometry), body_({.mass_kg = 0.2, .damping_n_s_per_m = 2, .hand_damping_n_s_per_m = 2}, start_mm) {}
  ~VirtualArm() { unplug(); }
  VirtualArm(const VirtualArm&) = delete;
  VirtualArm& operator=(const VirtualArm&) = delete;

  /// For HidLink: each call plugs the cable in again, while `plugged`.
  HidLink::Open opener() {
    return [this](std::string& why) -> std::unique_ptr<HidPort> {
      why = "unplugged";
      if (!plugged_) return nullptr;
      int ends[2];
      if (::socketpair(AF_UNIX, SOCK_SEQPACKET, 0, ends) != 0) return nullptr;
      stop();
      fd_ = ends[1];
      running_ = true;
      thread_ = std::thread([this] { run(); });
      return open_socket(ends[0]);
    };
  }
  void unplug() {
    plugged_ = false;
    stop();
  }
  void plug() { plugged_ = true; }
  void set_hand(Vec3 place_mm, double spring_n_per_mm) {
    const std::lock_guard lock(mutex_);
    body_.set_hand({}, place_mm, spring_n_per_mm);
  }
  Vec3 position_mm() {
    const std::lock_guard lock(mutex_);
    return body_.position_mm();
  }
  Vec3 force_n() {
    const std::lock_guard lock(mutex_);
    return force_n_;
  }
  /// Sends something else than it should: 1 short reports, 2 noise, 3 two reports at once.
  std::atomic<int> mischief{0};
  std::atomic<std::uint64_t> commands{0};

 private:
  void stop() {
    running_ = false;
    if (thread_.joinable()) thread_.join();
    if (fd_ >= 0) ::close(fd_);
    fd_ = -1;
  }
  void run() {
    using clock = std::chrono::steady_clock;
    auto due = clock::now(), heard = due - std::chrono::hours(1);
    std::uint64_t tick = 0;
    std::array<double, 3> current{};
    while (running_) {
      due += std::chrono::milliseconds(1);
      std::this_thread::sleep_until(due);
      std::array<std::byte, 65> command;
      for (ssize_t n; (n = ::recv(fd_, command.data(), command.size(), MSG_DONTWAIT)) > 0;) {
        WoodenHapticsCommand c;
        if (!decode_woodenhaptics_command({command.data(), static_cast<std::size_t>(n)}, current, c)) continue;
        heard = clock::now();
        ++commands;
      }
      if (clock::now() - heard > std::chrono::milliseconds(500)) {
        current = {};                 // the firmware's watchdog
        if (commands == 0) continue;  // silent until spoken to
      }
      const std::lock_guard lock(mutex_);
      const auto counts = kinematics_.encoders(body_.position_mm());
      if (!counts) continue;
      force_n_ = kinematics_.force_n(kinematics_.angles_rad(*counts), current);
      body_.read(tick++, 1e-3, force_n_);
      const auto report = encode_woodenhaptics_report(*counts, false);
      if (mischief == 1) {
        ::send(fd_, report.data(), 5, MSG_NOSIGNAL | MSG_DONTWAIT);
      } else if (mischief == 2) {
        std::array<std::byte, 9> noise;
        for (auto& b : noise) b = static_cast<std::byte>(tick * 37 + 11);
        ::send(fd_, noise.data(), noise.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
      } else if (mischief == 3) {
        std::array<std::byte, 28> both;
        std::copy(report.begin(), report.end(), both.begin());
        std::copy(report.begin(), report.end(), both.begin() + 14);
        ::send(fd_, both.data(), both.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
      } else {
        ::send(fd_, report.data(), report.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
      }
    }
  }

  WoodenHapticsKinematics kinematics_;
  std::mutex mutex_;
  SimulatedDevice body_;
  Vec3 force_n_;
  std::atomic<bool> plugged_{true}, running_{false};
  int fd_ = -1;
  std::thread thread_;
};

}  // namespace osteo::test
