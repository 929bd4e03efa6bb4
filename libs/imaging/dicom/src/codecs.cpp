#include "codecs.h"

#include <zlib.h>

#include <algorithm>
#include <cstring>
#include <memory>
#ifdef OSTEO_OPENJPEG
#include <openjpeg.h>
#endif
#ifdef OSTEO_JXL
#include <jxl/decode.h>
#endif

namespace osteo::inline imaging::dicom {

#ifdef OSTEO_OPENJPEG
// OpenJPEG and not OpenJPH, which is faster: of 3000 damaged pictures OpenJPH 0.9 crashed or hung on 74.
bool decode_htj2k(const DicomHeader& h, std::span<const char> in, std::span<std::uint16_t> out) {
  struct Source {
    std::span<const char> bytes;
    std::size_t at = 0;
  } source{in};
  const std::unique_ptr<opj_stream_t, decltype(&opj_stream_destroy)> stream(opj_stream_create(1 << 16, OPJ_TRUE),
                                                                            &opj_stream_destroy);
  opj_stream_set_user_data(stream.get(), &source, nullptr);
  opj_stream_set_user_data_length(stream.get(), in.size());
  opj_stream_set_read_function(stream.get(), [](void* to, OPJ_SIZE_T count, void* user) {
    auto& s = *static_cast<Source*>(user);
    const std::size_t n = std::min<std::size_t>(count, s.bytes.size() - s.at);
    if (n == 0) return static_cast<OPJ_SIZE_T>(-1);
    std::memcpy(to, s.bytes.data() + s.at, n);
    s.at += n;
    return static_cast<OPJ_SIZE_T>(n);
  });
  opj_stream_set_skip_function(stream.get(), [](OPJ_OFF_T count, void* user) {
    auto& s = *static_cast<Source*>(user);
    if (count < 0) return static_cast<OPJ_OFF_T>(-1);
    const std::size_t n = std::min(static_cast<std::size_t>(count), s.bytes.size() - s.at);
    s.at += n;
    return n > 0 || count == 0 ? static_cast<OPJ_OFF_T>(n) : static_cast<OPJ_OFF_T>(-1);
  });
  opj_stream_set_seek_function(stream.get(), [](OPJ_OFF_T to, void* user) -> OPJ_BOOL {
    auto& s = *static_cast<Source*>(user);
    if (to < 0 || static_cast<std::size_t>(to) > s.bytes.size()) return OPJ_FALSE;
    s.at = static_cast<std::size_t>(to);
    return OPJ_TRUE;
  });
  const bool boxed = std::memcmp(in.data(), "\0\0\0\x0C", 4) == 0;
  const std::unique_ptr<opj_codec_t, decltype(&opj_destroy_codec)> codec(
      opj_create_decompress(boxed ? OPJ_CODEC_JP2 : OPJ_CODEC_J2K), &opj_destroy_codec);
  bool doubtful = false;
  const auto note = [](const char*, void* user) { *static_cast<bool*>(user) = true; };
  opj_set_warning_handler(codec.get(), note, &doubtful);
  opj_set_error_handler(codec.get(), note, &doubtful);
  opj_dparameters_t parameters;
  opj_set_default_decoder_parameters(&parameters);
  if (opj_setup_decoder(codec.get(), &parameters) == OPJ_FALSE) return false;
  opj_image_t* made = nullptr;
  const bool good = opj_read_header(stream.get(), codec.get(), &made) != OPJ_FALSE && made != nullptr &&
                    made->numcomps == 1 && made->x1 - made->x0 == static_cast<OPJ_UINT32>(h.columns) &&
                    made->y1 - made->y0 == static_cast<OPJ_UINT32>(h.rows) && made->comps[0].prec <= 16 &&
                    opj_decode(codec.get(), stream.get(), made) != OPJ_FALSE && !doubtful;
  const std::unique_ptr<opj_image_t, decltype(&opj_image_destroy)> image(made, &opj_image_destroy);
  if (!good || made->comps[0].data == nullptr ||
      static_cast<std::size_t>(made->comps[0].w) * made->comps[0].h != out.size())
    return false;
  std::transform(made->comps[0].data, made->comps[0].data + out.size(), out.begin(),
                 [](OPJ_INT32 v) { return static_cast<std::uint16_t>(v); });
  return true;
}
#else
bool decode_htj2k(const DicomHeader&, std::span<const char>, std::span<std::uint16_t>) {
  return false;
}
#endif

#ifdef OSTEO_JXL
namespace {
using JxlHandle = std::unique_ptr<JxlDecoder, decltype(&JxlDecoderDestroy)>;

JxlHandle jxl_decoder(std::span<const char> in, int events) {
  JxlHandle d(JxlDecoderCreate(nullptr), &JxlDecoderDestroy);
  if (d == nullptr || JxlDecoderSubscribeEvents(d.get(), events) != JXL_DEC_SUCCESS ||
      JxlDecoderSetInput(d.get(), reinterpret_cast<const std::uint8_t*>(in.data()), in.size()) != JXL_DEC_SUCCESS)
    return {nullptr, &JxlDecoderDestroy};
  JxlDecoderCloseInput(d.get());
  return d;
}
}  // namespace

bool decode_jpeg_xl(const DicomHeader& h, std::span<const char> in, std::span<std::uint16_t> out) {
  const JxlHandle d = jxl_decoder(in, JXL_DEC_BASIC_INFO | JXL_DEC_FULL_IMAGE);
  if (d == nullptr) return false;
  const JxlPixelFormat words{1, JXL_TYPE_UINT16, JXL_NATIVE_ENDIAN, 0};
  unsigned bits = 0;
  for (bool whole = false;;) {
    switch (JxlDecoderProcessInput(d.get())) {
      case JXL_DEC_BASIC_INFO: {
        JxlBasicInfo info;
        if (JxlDecoderGetBasicInfo(d.get(), &info) != JXL_DEC_SUCCESS || info.num_color_channels != 1 ||
            info.num_extra_channels != 0 || info.have_animation != JXL_FALSE || info.exponent_bits_per_sample != 0 ||
            info.xsize != static_cast<std::uint32_t>(h.columns) || info.ysize != static_cast<std::uint32_t>(h.rows) ||
            info.bits_per_sample < 1 || info.bits_per_sample > 16)
          return false;
        bits = info.bits_per_sample;
        break;
      }
      case JXL_DEC_NEED_IMAGE_OUT_BUFFER: {
        std::size_t bytes = 0;
        if (JxlDecoderImageOutBufferSize(d.get(), &words, &bytes) != JXL_DEC_SUCCESS || bytes != out.size_bytes() ||
            JxlDecoderSetImageOutBuffer(d.get(), &words, out.data(), bytes) != JXL_DEC_SUCCESS)
          return false;
        break;
      }
      case JXL_DEC_FULL_IMAGE:
        whole = true;
        break;
      case JXL_DEC_SUCCESS: {
        if (!whole) return false;
        // Values come spread over all 16 bits.
        const std::uint32_t full = (1U << bits) - 1;
        if (bits < 16) {
          for (std::uint16_t& v : out) v = static_cast<std::uint16_t>((v * full + 32767U) / 65535U);
        }
        return true;
      }
      default:
        return false;
    }
  }
}

std::vector<char> jpeg_inside(std::span<const char> in) {
  const JxlHandle d = jxl_decoder(in, JXL_DEC_JPEG_RECONSTRUCTION | JXL_DEC_FULL_IMAGE);
  if (d == nullptr) return {};
  std::vector<char> jpeg(in.size() * 2 + 1024);
  std::size_t left = jpeg.size();
  bool found = false;
  const auto hand = [&] {
    const std::size_t used = jpeg.size() - left;
    if (left == 0) jpeg.resize(jpeg.size() * 2);
    left = jpeg.size() - used;
    return JxlDecoderSetJPEGBuffer(d.get(), reinterpret_cast<std::uint8_t*>(jpeg.data() + used), left) ==
           JXL_DEC_SUCCESS;
  };
  for (;;) {
    switch (JxlDecoderProcessInput(d.get())) {
      case JXL_DEC_JPEG_RECONSTRUCTION:
        found = true;
        if (!hand()) return {};
        break;
      case JXL_DEC_JPEG_NEED_MORE_OUTPUT:
        left = JxlDecoderReleaseJPEGBuffer(d.get());
        if (jpeg.size() > (std::size_t{1} << 28)) return {};
        if (left > 0) {  // it wants more at once than is left
          const std::size_t used = jpeg.size() - left;
          jpeg.resize(jpeg.size() * 2);
          left = jpeg.size() - used;
        }
        if (!hand()) return {};
        break;
      case JXL_DEC_FULL_IMAGE:
        break;
      case JXL_DEC_SUCCESS:
        if (!found) return {};
        left = JxlDecoderReleaseJPEGBuffer(d.get());
        jpeg.resize(jpeg.size() - left);
        return jpeg;
      default:
        return {};
    }
  }
}
#else
bool decode_jpeg_xl(const DicomHeader&, std::span<const char>, std::span<std::uint16_t>) {
  return false;
}
std::vector<char> jpeg_inside(std::span<const char>) {
  return {};
}
#endif

bool inflate_frame(std::span<const char> in, std::span<char> out) {
  z_stream z{};
  if (inflateInit2(&z, -15) != Z_OK) return false;
  z.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(in.data()));
  z.avail_in = static_cast<uInt>(in.size());
  z.next_out = reinterpret_cast<Bytef*>(out.data());
  z.avail_out = static_cast<uInt>(out.size());
  const int end = inflate(&z, Z_FINISH);
  // One byte too many is what pads a picture of an odd number of bytes.
  char more = 0;
  bool whole = end == Z_STREAM_END;
  if (end == Z_BUF_ERROR && z.avail_out == 0) {
    z.next_out = reinterpret_cast<Bytef*>(&more);
    z.avail_out = 1;
    whole = inflate(&z, Z_FINISH) == Z_STREAM_END;
  }
  const bool good = whole && (z.avail_out == 0 || z.next_out == reinterpret_cast<Bytef*>(&more)) &&
                    z.total_out >= out.size() && z.avail_in < 2;
  inflateEnd(&z);
  return good;
}

}  // namespace osteo::inline imaging::dicom
