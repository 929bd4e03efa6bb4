// The verdict of an import, as JSON that anybody may have edited.
#include <cstdint>
#include <string_view>

#include "osteo/core/base/error.h"
#include "osteo/imaging/dicom/verdict.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    static_cast<void>(osteo::read_verdict({reinterpret_cast<const char*>(data), size}));
  } catch (const osteo::Error&) {
  }
  return 0;
}
