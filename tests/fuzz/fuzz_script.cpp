// Scripts of strokes.
#include "file_target.h"
#include "osteo/session/recording/script.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return fuzz_file(data, size, ".json", [](const std::string& path) { static_cast<void>(osteo::load_script(path)); });
}
