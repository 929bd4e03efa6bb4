// A thread that keeps a HID device open, whatever happens to its cable.
#pragma once
#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "osteo/simulation/devices/detail/hid.h"

namespace osteo::inline simulation {

/// Called from the link's thread.
class HidHandler {
 public:
  virtual ~HidHandler() = default;
  virtual void opened(HidPort&) {}
  /// Every report, or with newest_only() the last of those that had piled up.
  virtual void report(HidPort& port, std::span<const std::byte> report) = 0;
  /// After each report and whenever none came within the time.
  virtual void idle(HidPort&) {}
  virtual void gone() {}
  [[nodiscard]] virtual bool newest_only() const { return false; }
};

/// Opens, reads, and after an unplug tries again every 50 ms. Reports pile up in the kernel when nobody reads: so one
/// thread does nothing else.
class HidLink {
 public:
  using Open = std::function<std::unique_ptr<HidPort>(std::string& why)>;
  /// `handler` must outlive the link.
  HidLink(Open open, HidHandler& handler, int timeout_ms);
  ~HidLink();
  HidLink(const HidLink&) = delete;
  HidLink& operator=(const HidLink&) = delete;
  [[nodiscard]] bool connected() const noexcept { return connected_; }
  [[nodiscard]] std::uint64_t reports() const noexcept { return reports_; }
  /// What its thread threw last, in words; empty: nothing. It then does as after an unplug.
  [[nodiscard]] std::string trouble() const;

 private:
  void run();
  void read_on();
  Open open_;
  HidHandler& handler_;
  int timeout_ms_;
  std::atomic<bool> stop_{false}, connected_{false};
  std::atomic<std::uint64_t> reports_{0};
  mutable std::mutex trouble_mutex_;
  std::string trouble_;
  std::thread thread_;
};

/// Opens the first device of the kernel for which `wanted` holds, or with `before` the first behind as many of those:
/// two alike are distinguished by the order of their paths.
[[nodiscard]] HidLink::Open open_first(std::function<bool(const HidInfo&)> wanted, int before = 0);

}  // namespace osteo::inline simulation
