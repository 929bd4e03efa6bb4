#include "encodings.h"

#include <algorithm>
#include <array>

namespace osteo::inline imaging::dicom {
namespace {

#ifdef OSTEO_OPENJPEG
constexpr std::string_view kNoOpenJpeg;
#else
constexpr std::string_view kNoOpenJpeg = "OpenJPEG 2.5";
#endif
#ifdef OSTEO_JXL
constexpr std::string_view kNoJxl;
#else
constexpr std::string_view kNoJxl = "libjxl";
#endif

constexpr std::array kEncodings{
    Encoding{"1.2.840.10008.1.2", "Implicit VR Little Endian", Codec::none, false, {}},
    Encoding{"1.2.840.10008.1.2.1", "Explicit VR Little Endian", Codec::none, false, {}},
    Encoding{"1.2.840.10008.1.2.1.98", "Encapsulated Uncompressed Explicit VR Little Endian", Codec::none, false, {}},
    Encoding{"1.2.840.10008.1.2.1.99", "Deflated Explicit VR Little Endian", Codec::none, false, {}},
    Encoding{"1.2.840.10008.1.2.2", "Explicit VR Big Endian", Codec::none, false, {}},
    Encoding{"1.2.840.10008.1.2.4.50", "JPEG Baseline", Codec::jpeg, true, {}},
    Encoding{"1.2.840.10008.1.2.4.51", "JPEG Extended", Codec::jpeg, true, {}},
    Encoding{"1.2.840.10008.1.2.4.53", "JPEG Spectral Selection", Codec::jpeg, true, {}},
    Encoding{"1.2.840.10008.1.2.4.55", "JPEG Full Progression", Codec::jpeg, true, {}},
    Encoding{"1.2.840.10008.1.2.4.57", "JPEG Lossless", Codec::jpeg, false, {}},
    Encoding{"1.2.840.10008.1.2.4.70", "JPEG Lossless, First-Order Prediction", Codec::jpeg, false, {}},
    Encoding{"1.2.840.10008.1.2.4.80", "JPEG-LS Lossless", Codec::jpeg_ls, false, {}},
    Encoding{"1.2.840.10008.1.2.4.81", "JPEG-LS Near-Lossless", Codec::jpeg_ls, true, {}},
    Encoding{"1.2.840.10008.1.2.4.90", "JPEG 2000 Lossless", Codec::jpeg_2000, false, {}},
    Encoding{"1.2.840.10008.1.2.4.91", "JPEG 2000", Codec::jpeg_2000, false, {}},
    Encoding{"1.2.840.10008.1.2.4.92", "JPEG 2000 Part 2 Multi-component Lossless", Codec::unread, false, {}},
    Encoding{"1.2.840.10008.1.2.4.93", "JPEG 2000 Part 2 Multi-component", Codec::unread, false, {}},
    Encoding{"1.2.840.10008.1.2.4.94", "JPIP Referenced (pixels on a server)", Codec::unread, false, {}},
    Encoding{"1.2.840.10008.1.2.4.95", "JPIP Referenced Deflate (pixels on a server)", Codec::unread, false, {}},
    Encoding{"1.2.840.10008.1.2.4.110", "JPEG XL Lossless", Codec::jpeg_xl, false, kNoJxl},
    Encoding{"1.2.840.10008.1.2.4.111", "JPEG XL JPEG Recompression", Codec::jpeg_xl, true, kNoJxl},
    Encoding{"1.2.840.10008.1.2.4.112", "JPEG XL", Codec::jpeg_xl, false, kNoJxl},
    Encoding{"1.2.840.10008.1.2.4.201", "HTJ2K (High-Throughput JPEG 2000) Lossless", Codec::htj2k, false, kNoOpenJpeg},
    Encoding{"1.2.840.10008.1.2.4.202", "HTJ2K (High-Throughput JPEG 2000) Lossless RPCL", Codec::htj2k, false,
             kNoOpenJpeg},
    Encoding{"1.2.840.10008.1.2.4.203", "HTJ2K (High-Throughput JPEG 2000)", Codec::htj2k, false, kNoOpenJpeg},
    Encoding{"1.2.840.10008.1.2.4.204", "JPIP HTJ2K Referenced (pixels on a server)", Codec::unread, false, {}},
    Encoding{"1.2.840.10008.1.2.4.205", "JPIP HTJ2K Referenced Deflate (pixels on a server)", Codec::unread, false, {}},
    Encoding{"1.2.840.10008.1.2.5", "RLE Lossless", Codec::rle, false, {}},
    Encoding{"1.2.840.10008.1.2.8.1", "Deflated Image Frame Compression", Codec::deflated_frames, false, {}},
};

}  // namespace

std::span<const Encoding> encodings() {
  return kEncodings;
}

const Encoding* find_encoding(std::string_view uid) {
  const auto* const it =
      std::find_if(kEncodings.begin(), kEncodings.end(), [&](const auto& e) { return e.uid == uid; });
  return it == kEncodings.end() ? nullptr : it;
}

std::string why_unread(std::string_view uid) {
  const Encoding* const e = find_encoding(uid);
  if (e == nullptr) {
    const bool video = uid.starts_with("1.2.840.10008.1.2.4.10") || uid.starts_with("1.2.840.10008.1.2.7.");
    return "are encoded as " +
           (video ? "a video (MPEG, H.264, H.265, SMPTE ST 2110)" : "transfer syntax " + std::string(uid)) +
           ", which is not read";
  }
  if (!e->without.empty())
    return "are encoded as " + std::string(e->name) + "; this build reads none, it was made without " +
           std::string(e->without);
  return e->codec == Codec::unread ? "are encoded as " + std::string(e->name) + ", which is not read" : std::string();
}

}  // namespace osteo::inline imaging::dicom
