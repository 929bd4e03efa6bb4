// Checkpoints of networks: a zip with a pickle.
#include <algorithm>

#include "osteo/core/base/error.h"
#include "osteo/imaging/neural/detail/checkpoint.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  osteo::ByteSource source;
  source.size = size;
  source.read = [&](std::uint64_t offset, std::span<std::byte> to) {
    if (offset > size || to.size() > size - offset) __builtin_trap();
    std::copy_n(reinterpret_cast<const std::byte*>(data) + offset, to.size(), to.begin());
  };
  try {
    static_cast<void>(osteo::read_checkpoint(source));
  } catch (const osteo::Error&) {
  }
  return 0;
}
