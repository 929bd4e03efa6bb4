// Whether the lengths in a DICOM header make sense. Private to libs/imaging/dicom.
#pragma once
#include <filesystem>

namespace osteo::inline imaging::dicom {

/// Walks all elements up to the pixels: each must lie within the file, each sequence within its parent. vtk-dicom 0.8
/// asks for memory by whatever length it finds, and aborts on some; a header that is not sound goes to DCMTK, which
/// says what is wrong with it. O(elements); reads what a parser would read.
[[nodiscard]] bool header_is_sound(const std::filesystem::path& file);

}  // namespace osteo::inline imaging::dicom
