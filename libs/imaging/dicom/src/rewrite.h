// What vtk-dicom cannot read, DCMTK rewrites plainly. Private to libs/imaging/dicom.
#pragma once
#include <filesystem>
#include <string>

namespace osteo::inline imaging::dicom {

/// Deflated, or without preamble, meta header or transfer syntax: written to `to` as explicit little endian. Compressed
/// pixels stay as they are. Returns why it could not, or nothing.
[[nodiscard]] std::string rewrite_plainly(const std::filesystem::path& from, const std::filesystem::path& to);

}  // namespace osteo::inline imaging::dicom
