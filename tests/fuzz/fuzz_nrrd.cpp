// NRRD headers and voxels, read by our own parser.
#include "file_target.h"
#include "osteo/imaging/io/volume_io.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return fuzz_file(data, size, ".nrrd", [](const std::string& path) { static_cast<void>(osteo::load_image(path)); });
}
