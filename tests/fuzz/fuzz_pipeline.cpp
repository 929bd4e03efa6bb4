// Pipeline files: any text is read or rejected with an Error.
#include <cstdint>
#include <string_view>

#include "osteo/core/base/error.h"
#include "osteo/imaging/pipeline/pipeline.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    static_cast<void>(
        osteo::parse_pipeline({reinterpret_cast<const char*>(data), size}, {{"source", "x"}, {"case", "y"}}));
  } catch (const osteo::Error&) {
  }
  return 0;
}
