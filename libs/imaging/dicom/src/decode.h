// Compressed pictures to stored values. Private to libs/imaging/dicom.
//
// The fragments are taken out of the file here, with every length checked against the file, and each codec is handed
// one picture whose stated size is that of the header: the codecs' own readers ask for memory by whatever a damaged
// file says, or abort.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "osteo/imaging/dicom/detail/header.h"

namespace osteo::inline imaging::dicom {

class CompressedFrames {
 public:
  /// Reads the compressed bytes of the file. Throws PixelError when they are cut or damaged.
  explicit CompressedFrames(const DicomHeader& header);
  /// Stored values of one frame; signed ones in two's complement of 16 bits.
  /// Throws PixelError when the codec fails or the encoding is not supported.
  [[nodiscard]] std::vector<std::uint16_t> decode(int frame) const;

 private:
  [[nodiscard]] std::span<const char> bytes_of(int frame, std::vector<char>& joined) const;

  const DicomHeader& header_;
  std::vector<char> bytes_;                                     // from the first item on
  std::vector<std::pair<std::uint64_t, std::uint64_t>> items_;  // offset and length of each fragment in bytes_
  std::vector<std::size_t> first_;                              // first fragment of each frame, and one past the last
};

}  // namespace osteo::inline imaging::dicom
