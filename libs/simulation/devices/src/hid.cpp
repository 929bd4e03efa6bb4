#include "osteo/simulation/devices/detail/hid.h"

#include <hidapi/hidapi.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <mutex>
#include <sstream>

#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"

namespace osteo::inline simulation {
namespace {

std::string narrow(const wchar_t* text) {
  std::string s;
  for (; text != nullptr && *text != 0; ++text) s += *text < 128 ? static_cast<char>(*text) : '?';
  return s;
}

void start_hidapi() {
  static std::once_flag once;
  std::call_once(once, [] {
    hid_init();
    std::atexit([] { hid_exit(); });
  });
}

class KernelPort final : public HidPort {
 public:
  explicit KernelPort(hid_device* device) : device_(device) {}
  ~KernelPort() override { hid_close(device_); }
  KernelPort(const KernelPort&) = delete;
  KernelPort& operator=(const KernelPort&) = delete;
  int read(std::span<std::byte> report, int timeout_ms) override {
    return hid_read_timeout(device_, reinterpret_cast<unsigned char*>(report.data()), report.size(), timeout_ms);
  }
  bool write(std::span<const std::byte> report) override {
    return hid_write(device_, reinterpret_cast<const unsigned char*>(report.data()), report.size()) >= 0;
  }

 private:
  hid_device* device_;
};

class SocketPort final : public HidPort {
 public:
  explicit SocketPort(int fd) : fd_(fd) {}
  ~SocketPort() override { ::close(fd_); }
  SocketPort(const SocketPort&) = delete;
  SocketPort& operator=(const SocketPort&) = delete;
  int read(std::span<std::byte> report, int timeout_ms) override {
    pollfd p{fd_, POLLIN, 0};
    const int ready = ::poll(&p, 1, timeout_ms);
    if (ready <= 0) return ready < 0 && errno != EINTR ? -1 : 0;
    const ssize_t n = ::recv(fd_, report.data(), report.size(), 0);
    return n > 0 ? static_cast<int>(n) : -1;  // 0: the other end is closed
  }
  bool write(std::span<const std::byte> report) override {
    return ::send(fd_, report.data(), report.size(), MSG_NOSIGNAL | MSG_DONTWAIT) >= 0 || errno == EAGAIN;
  }

 private:
  int fd_;
};

}  // namespace

std::vector<HidInfo> list_hid() {
  start_hidapi();
  std::vector<HidInfo> all;
  hid_device_info* const first = hid_enumerate(0, 0);
  for (const hid_device_info* d = first; d != nullptr; d = d->next) {
    all.push_back({d->path != nullptr ? d->path : "", d->vendor_id, d->product_id, d->usage_page, d->usage,
                   d->interface_number, narrow(d->product_string), narrow(d->serial_number)});
  }
  hid_free_enumeration(first);
  std::sort(all.begin(), all.end(), [](const HidInfo& a, const HidInfo& b) { return a.path < b.path; });
  return all;
}

std::unique_ptr<HidPort> open_hid(const HidInfo& info, std::string& why) {
  start_hidapi();
  if (hid_device* const d = hid_open_path(info.path.c_str())) return std::make_unique<KernelPort>(d);
  why = "cannot open " + info.path +
        (::access(info.path.c_str(), R_OK | W_OK) != 0 && errno == EACCES ? ": no permission" : "");
  return nullptr;
}

std::unique_ptr<HidPort> open_socket(int fd) {
  return std::make_unique<SocketPort>(fd);
}

HidRecording load_hid_recording(const fs::path& path) {
  HidRecording r;
  std::istringstream in(read_text(path));
  std::string line;
  int number = 0;
  const auto refuse = [&](const std::string& what) {
    throw Error(ExitCode::corrupt, "'" + path.string() + "' line " + std::to_string(number) + ": " + what,
                "a recording is made with: hid-recorder > FILE");
  };
  while (std::getline(in, line)) {
    ++number;
    if (line.size() < 3 || line[1] != ':') continue;  // comments and what is not needed here
    std::istringstream words(line.substr(2));
    if (line[0] == 'N') {
      r.info.name =
          line.substr(line.find_first_not_of(' ', 2) == std::string::npos ? 2 : line.find_first_not_of(' ', 2));
    } else if (line[0] == 'I') {
      unsigned bus = 0, vendor = 0, product = 0;
      if (!(words >> std::hex >> bus >> vendor >> product) || vendor > 0xffff || product > 0xffff)
        refuse("no bus, vendor and product");
      r.info.vendor = static_cast<std::uint16_t>(vendor);
      r.info.product = static_cast<std::uint16_t>(product);
    } else if (line[0] == 'E') {
      HidRecording::Event e;
      std::size_t length = 0;
      if (!(words >> e.time_s >> length) || length > 4096) refuse("no time and length");
      words >> std::hex;
      for (std::size_t i = 0; i < length; ++i) {
        unsigned byte = 0;
        if (!(words >> byte) || byte > 0xff)
          refuse("byte " + std::to_string(i + 1) + " of " + std::to_string(length) + " is missing");
        e.report.push_back(static_cast<std::byte>(byte));
      }
      r.events.push_back(std::move(e));
    }
  }
  return r;
}

}  // namespace osteo::inline simulation
