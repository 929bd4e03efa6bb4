// How pixels may be encoded (transfer syntaxes of PS3.5), and which of it is read. Private to libs/imaging/dicom.
#pragma once
#include <span>
#include <string>
#include <string_view>

namespace osteo::inline imaging::dicom {

enum class Codec { none, rle, jpeg, jpeg_ls, jpeg_2000, htj2k, jpeg_xl, deflated_frames, unread };

struct Encoding {
  std::string_view uid, name;
  Codec codec = Codec::unread;
  bool always_lossy = false;
  std::string_view without;  ///< the library that this build lacks for it; empty when it is there or none would help
  [[nodiscard]] bool read() const { return codec != Codec::unread && without.empty(); }
};

/// Every transfer syntax of PS3.6 table A-1 that a CT may come in, those that are not read included.
[[nodiscard]] std::span<const Encoding> encodings();

/// Null for one that is not in the table, such as a maker's own.
[[nodiscard]] const Encoding* find_encoding(std::string_view uid);

/// Why pixels of this transfer syntax cannot be read, as a sentence goes on after "its pixels "; empty when they can.
[[nodiscard]] std::string why_unread(std::string_view uid);

}  // namespace osteo::inline imaging::dicom
