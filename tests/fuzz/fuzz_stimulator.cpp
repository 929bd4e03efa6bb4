// The stimulator's endpoint, and the console's end of it: bodies of messages, the first byte of each says whose and how
// long.
#include <algorithm>
#include <cstdint>
#include <memory>
#include <span>

#include "osteo/network/wire/stimulator_link.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace osteo;
  StimulatorEndpoint endpoint(
      "K7MX2QPA", [](const StimulatorSetting&) { __builtin_trap(); },  // nobody here has paired
      [] { return std::pair(StimulatorSetting{}, std::uint32_t{1}); });
  StimulatorLink link("AAAAAAAA");
  static_cast<void>(link.begin());
  double now_s = 0;
  IgtlMessage m;
  m.type = kStimulatorType;
  for (std::size_t at = 0; at + 1 < size;) {
    const std::size_t length = std::min<std::size_t>(data[at], size - at - 1);
    m.content = {data + at + 1, length};
    static_cast<void>(endpoint.hear(data[at] % 8, m, now_s += 0.05));
    static_cast<void>(link.hear(m));
    at += 1 + length;
  }
  return 0;
}
