// Reports of HID devices, wherever they come from: the kernel (hidapi), a socket (a simulated device), a recording.
#pragma once
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace osteo::inline simulation {

struct HidInfo {
  std::string path;  ///< "/dev/hidraw0"
  std::uint16_t vendor = 0, product = 0;
  std::uint16_t usage_page = 0, usage = 0;
  int interface = -1;
  std::string name, serial;
};

/// One open device. Used by one thread.
class HidPort {
 public:
  virtual ~HidPort() = default;
  /// A report (with its id where the device numbers them), 0 when none came within the time, -1 when the device is
  /// gone.
  virtual int read(std::span<std::byte> report, int timeout_ms) = 0;
  /// The first byte is the report's id, 0 where they are not numbered. False when the device is gone.
  virtual bool write(std::span<const std::byte> report) = 0;
};

/// Devices that this process may see, in the order of their paths.
[[nodiscard]] std::vector<HidInfo> list_hid();
/// Null when it cannot be opened; `why` says so (usually: no permission, see the guide's udev rule).
[[nodiscard]] std::unique_ptr<HidPort> open_hid(const HidInfo& info, std::string& why);
/// One end of a connected AF_UNIX SOCK_SEQPACKET pair; takes it over.
[[nodiscard]] std::unique_ptr<HidPort> open_socket(int fd);

/// A recording in the text format of hid-recorder: lines "N: name", "I: bus vendor product", "E: seconds.microseconds
/// length bytes".
struct HidRecording {
  struct Event {
    double time_s = 0;
    std::vector<std::byte> report;
  };
  HidInfo info;
  std::vector<Event> events;
};
/// Errors: corrupt, with the line; no_input.
[[nodiscard]] HidRecording load_hid_recording(const std::filesystem::path& path);

}  // namespace osteo::inline simulation
