#include "osteo/simulation/devices/detail/hid_link.h"

#include <pthread.h>

#include <array>
#include <chrono>
#include <exception>

namespace osteo::inline simulation {

HidLink::HidLink(Open open, HidHandler& handler, int timeout_ms)
    : open_(std::move(open)), handler_(handler), timeout_ms_(timeout_ms) {
  thread_ = std::thread([this] { run(); });
}

HidLink::~HidLink() {
  stop_ = true;
  if (thread_.joinable()) thread_.join();
}

void HidLink::run() {
  ::pthread_setname_np(::pthread_self(), "osteo-hid");
  // Below the servo, above everything that may wait. Rejected without the right: then it runs as it can.
  sched_param priority{};
  priority.sched_priority = 70;
  ::pthread_setschedparam(::pthread_self(), SCHED_FIFO, &priority);
  const auto guarded = [this](auto&& f) {
    try {
      f();
    } catch (const std::exception& e) {
      const std::lock_guard lock(trouble_mutex_);
      trouble_ = e.what();
    } catch (...) {
      const std::lock_guard lock(trouble_mutex_);
      trouble_ = "unknown trouble with the device";
    }
  };
  while (!stop_) {
    guarded([&] { read_on(); });
    if (connected_.exchange(false)) guarded([&] { handler_.gone(); });
    if (!stop_) std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
}

std::string HidLink::trouble() const {
  const std::lock_guard lock(trouble_mutex_);
  return trouble_;
}

// Until it is gone, or was not there.
void HidLink::read_on() {
  std::array<std::byte, 512> buffer{}, newer{};
  std::string why;
  const auto port = open_(why);
  if (port == nullptr) return;
  connected_ = true;
  handler_.opened(*port);
  {
    const std::lock_guard lock(trouble_mutex_);
    trouble_.clear();  // it works again
  }
  while (!stop_) {
    int n = port->read(buffer, timeout_ms_);
    if (n < 0) return;
    if (n > 0 && handler_.newest_only()) {
      for (int m = port->read(newer, 0); m > 0; m = port->read(newer, 0)) {
        buffer = newer;
        n = m;
        ++reports_;
      }
    }
    if (n > 0) {
      ++reports_;
      handler_.report(*port, std::span(buffer.data(), static_cast<std::size_t>(n)));
    }
    handler_.idle(*port);
  }
}

HidLink::Open open_first(std::function<bool(const HidInfo&)> wanted, int before) {
  return [wanted = std::move(wanted), before](std::string& why) -> std::unique_ptr<HidPort> {
    why = "no such device";
    int passed = 0;
    for (const HidInfo& info : list_hid()) {
      if (!wanted(info) || passed++ < before) continue;
      if (auto port = open_hid(info, why)) return port;
    }
    return nullptr;
  };
}

}  // namespace osteo::inline simulation
