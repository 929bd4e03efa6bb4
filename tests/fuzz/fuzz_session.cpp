// Session streams: whatever a crash or a bad disk leaves.
#include "file_target.h"
#include "osteo/session/recording/session_reader.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return fuzz_file(data, size, ".oss", [](const std::string& path) { static_cast<void>(osteo::read_session(path)); });
}
