// OpenIGTLink as it comes over a connection, in pieces: whatever a tracker or a server says. The first byte tells how
// long the pieces are.
#include <algorithm>
#include <cstdint>
#include <span>

#include "osteo/network/wire/igtl.h"
#include "osteo/network/wire/stream_feed.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::size_t piece = 1 + data[0];
  osteo::IgtlParser parser(4096);
  for (std::size_t at = 1; at < size; at += piece) {
    const bool goes_on = parser.feed({data + at, std::min(piece, size - at)}, [](const osteo::IgtlMessage& m) {
      if (const auto pose = osteo::igtl_pose_in(m)) static_cast<void>(osteo::is_rigid(*pose));
      static_cast<void>(osteo::igtl_sensor_in(m));
      static_cast<void>(osteo::igtl_samples_in(m));
      if (const auto text = osteo::igtl_string_in(m)) {
        static_cast<void>(osteo::event_in(*text));
        static_cast<void>(osteo::monitor_in(*text));
        static_cast<void>(osteo::camera_in_note(*text));
      }
    });
    if (!goes_on) break;
  }
  // The same texts without a checksum to pass.
  const std::string text(reinterpret_cast<const char*>(data), size);
  static_cast<void>(osteo::event_in(text));
  static_cast<void>(osteo::monitor_in(text));
  return 0;
}
