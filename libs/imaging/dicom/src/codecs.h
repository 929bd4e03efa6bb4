// Codecs that GDCM has not: one picture each, into stored values. Private to libs/imaging/dicom.
//
// Nothing is taken from a picture that its codec only warns of: what a damaged one decodes to looks like a CT.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "osteo/imaging/dicom/detail/header.h"

namespace osteo::inline imaging::dicom {

/// Raw values of one picture, or false when the codec rejects it. `out` holds pixels_per_frame() values; signed ones in
/// two's complement of 16 bits. The size in the codestream must be the header's; all three check it before they take
/// memory for it. Any thread.
[[nodiscard]] bool decode_htj2k(const DicomHeader& header, std::span<const char> in, std::span<std::uint16_t> out);
[[nodiscard]] bool decode_jpeg_xl(const DicomHeader& header, std::span<const char> in, std::span<std::uint16_t> out);

/// The JPEG file that a JPEG XL picture was made of, to the byte; empty when it was not made of one.
[[nodiscard]] std::vector<char> jpeg_inside(std::span<const char> jpeg_xl);

/// Inflates (RFC 1951) to exactly out.size() bytes.
[[nodiscard]] bool inflate_frame(std::span<const char> in, std::span<char> out);

}  // namespace osteo::inline imaging::dicom
