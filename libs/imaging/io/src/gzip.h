// gzip (RFC 1952) with a fast library and all cores. Private to libs/imaging/io.
#pragma once
#include <cstddef>
#include <span>
#include <string>
#include <string_view>

namespace osteo::inline imaging::io {

/// The bytes of `head` and of `body` after it as one member of gzip. Packed in pieces side by side, the same bytes
/// whatever the number of cores. What was packed is unpacked again and compared. Errors: failed when they differ.
[[nodiscard]] std::string gzip(std::string_view head, std::string_view body);

/// Unpacks one member of gzip whose content is exactly out.size() bytes. False where it is anything else (several
/// members, zlib's own wrapping, damage, another length); `out` is then undefined.
[[nodiscard]] bool gunzip_exactly(std::span<const std::byte> packed, std::span<std::byte> out);

}  // namespace osteo::inline imaging::io
