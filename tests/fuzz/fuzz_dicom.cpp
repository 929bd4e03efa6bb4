// DICOM headers and pixels: our check of lengths, our splitting of fragments, and what the libraries make of the rest.
#include "file_target.h"
#include "osteo/core/base/files.h"
#include "osteo/imaging/dicom/detail/header.h"
#include "pixels.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return fuzz_file(data, size, ".dcm", [](const std::string& path) {
    const osteo::TemporaryFolder scratch;
    const osteo::DicomHeader h = osteo::read_dicom_header(path, scratch.path());
    if (!h.usable() || h.pixels_per_frame() > (1U << 24)) return;
    std::vector<std::int16_t> pixels(h.pixels_per_frame());
    const osteo::dicom::FrameTarget target{0, pixels.data()};
    osteo::dicom::ValueCount count;
    try {
      osteo::dicom::read_frames_hu(h, {&target, 1}, count);
    } catch (const osteo::dicom::PixelError&) {
    }
  });
}
