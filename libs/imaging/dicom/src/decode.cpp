#include "decode.h"

#include <gdcmFragment.h>
#include <gdcmJPEG2000Codec.h>
#include <gdcmJPEGCodec.h>
#include <gdcmJPEGLSCodec.h>
#include <gdcmSequenceOfFragments.h>
#include <gdcmTrace.h>
#include <vtkDICOMImageCodec.h>

#include <algorithm>
#include <cstring>

#include "codecs.h"
#include "encodings.h"
#include "pixels.h"

namespace osteo::inline imaging::dicom {
namespace {

unsigned u16(const char* p) {
  return static_cast<unsigned>(static_cast<unsigned char>(p[0])) << 8 | static_cast<unsigned char>(p[1]);
}
unsigned u32(const char* p) {
  return u16(p) << 16 | u16(p + 2);
}

struct Shape {
  unsigned width = 0, height = 0, components = 0, precision = 0;
};

// What the codestream itself says: SOF of JPEG and JPEG-LS (ISO 10918-1 B.2.2, 14495-1), SIZ of JPEG 2000 (15444-1
// A.5.1).
Shape shape_of(std::span<const char> bytes, bool jpeg2000) {
  const std::size_t n = bytes.size();
  const char* const p = bytes.data();
  if (jpeg2000) {
    // The codestream may lie in a JP2 file, in its box jp2c (I.4): what looks like one elsewhere is not what is
    // decoded.
    std::size_t at = 0;
    if (n >= 12 && std::memcmp(p, "\0\0\0\x0CjP  \r\n\x87\n", 12) == 0) {
      for (bool found = false; !found;) {
        if (at + 16 > n) return {};
        const bool wide = u32(p + at) == 1;  // a length of 64 bits follows
        const std::size_t head = wide ? 16 : 8, length = wide ? u32(p + at + 12) : u32(p + at);
        found = std::memcmp(p + at + 4, "jp2c", 4) == 0;
        if (!found && (length < head || (wide && u32(p + at + 8) != 0))) return {};
        at += found ? head : length;
      }
    }
    if (at + 43 > n || u32(p + at) != 0xFF4FFF51U) return {};
    const char* const siz = p + at + 8;  // after SOC, SIZ, length
    return {u32(siz) - u32(siz + 8), u32(siz + 4) - u32(siz + 12), u16(siz + 32),
            (static_cast<unsigned char>(siz[34]) & 127U) + 1};
  }
  // Markers up to the scan must follow each other without a gap: GDCM's decoders abort on some pictures that libjpeg
  // patches up.
  Shape shape;
  bool tables = false;
  std::size_t at = 2;
  while (at + 10 < n) {
    if (p[at] != static_cast<char>(0xFF)) return {};
    const unsigned marker = static_cast<unsigned char>(p[at + 1]);
    if (marker == 0xFF) {
      ++at;
      continue;
    }
    const bool jpeg_ls = marker == 0xF7;
    const bool frame =
        (marker >= 0xC0 && marker <= 0xCF && marker != 0xC4 && marker != 0xC8 && marker != 0xCC) || jpeg_ls;
    if (frame && shape.width > 0) return {};
    if (frame)
      shape = {u16(p + at + 7), u16(p + at + 5), static_cast<unsigned char>(p[at + 9]),
               static_cast<unsigned char>(p[at + 4])};
    tables = tables || jpeg_ls || marker == 0xC4;
    if (marker == 0xDA) return tables && p[at + 4] == 1 ? shape : Shape{};
    if (marker == 0xD9) return {};
    const unsigned length = u16(p + at + 2);
    if (length < 2) return {};
    at += 2 + length;
  }
  return {};
}

bool starts_picture(const char* p, std::uint64_t length) {
  return length > 3 &&
         (u16(p) == 0xFFD8 || u16(p) == 0xFF4F || u16(p) == 0xFF0A || std::memcmp(p, "\0\0\0\x0C", 4) == 0);
}

void check_size(const DicomHeader& h, const Shape& shape) {
  if (shape.width != static_cast<unsigned>(h.columns) || shape.height != static_cast<unsigned>(h.rows) ||
      shape.components != 1 || shape.precision < (h.bits_allocated == 1 ? 1U : 2U) || shape.precision > 16) {
    throw PixelError("its compressed pixels are damaged: they are no " + std::to_string(h.columns) + "x" +
                     std::to_string(h.rows) + " grey picture");
  }
}

// Hands the decoded bytes to take(pointer, count); false when the codec fails.
template <class F>
bool decode_with_gdcm(const DicomHeader& h, Codec codec_of, std::span<const char> in, F&& take) {
  static const bool quiet = [] {
    gdcm::Trace::WarningOff();
    gdcm::Trace::ErrorOff();
    gdcm::Trace::DebugOff();
    return true;
  }();
  static_cast<void>(quiet);
  const bool jpeg2000 = codec_of == Codec::jpeg_2000, jpeg_ls = codec_of == Codec::jpeg_ls;
  const Shape shape = shape_of(in, jpeg2000);
  check_size(h, shape);
  const unsigned short stored = static_cast<unsigned short>(shape.precision);
  // GDCM chooses its JPEG decoder (8, 12 or 16 bits) by this.
  const unsigned short allocated = static_cast<unsigned short>(jpeg2000 || jpeg_ls ? std::max(8, h.bits_allocated)
                                                               : stored <= 8       ? 8
                                                               : stored <= 12      ? 12
                                                                                   : 16);
  // It would write two bytes a pixel where there is room for one.
  if (stored > allocated)
    throw PixelError("its compressed pixels are damaged: they have " + std::to_string(stored) +
                     " bits, the header says " + std::to_string(h.bits_allocated));
  const gdcm::PixelFormat format(1, allocated, std::min(stored, allocated),
                                 static_cast<unsigned short>(std::min(stored, allocated) - 1), h.is_signed ? 1 : 0);
  const auto run = [&](auto& codec) {
    const unsigned dims[3] = {static_cast<unsigned>(h.columns), static_cast<unsigned>(h.rows), 1};
    codec.SetNumberOfDimensions(2);
    codec.SetDimensions(dims);
    codec.SetPlanarConfiguration(0);
    codec.SetPhotometricInterpretation(gdcm::PhotometricInterpretation::MONOCHROME2);
    codec.SetPixelFormat(format);
    codec.SetNeedByteSwap(false);
    codec.SetNeedOverlayCleanup(false);
    gdcm::SmartPointer<gdcm::SequenceOfFragments> fragments = new gdcm::SequenceOfFragments;
    gdcm::Fragment fragment;
    fragment.SetByteValue(in.data(), gdcm::VL(static_cast<std::uint32_t>(in.size())));
    fragments->AddFragment(fragment);
    gdcm::DataElement from(gdcm::Tag(0x7FE0, 0x0010)), to;
    from.SetValue(*fragments);
    if (!codec.Decode(from, to) || to.GetByteValue() == nullptr) return false;
    take(to.GetByteValue()->GetPointer(), static_cast<std::size_t>(to.GetByteValue()->GetLength()));
    return true;
  };
  try {
    if (jpeg2000) {
      // Left alone it gives one picture to all cores; here each core has a picture of its own.
      gdcm::JPEG2000Codec codec;
      codec.SetNumberOfThreadsForDecompression(1);
      return run(codec);
    }
    if (jpeg_ls) {
      gdcm::JPEGLSCodec codec;
      codec.SetBufferLength(static_cast<unsigned long>(h.pixels_per_frame() *
                                                       static_cast<std::size_t>(std::max(8, h.bits_allocated) / 8)));
      return run(codec);
    }
    gdcm::JPEGCodec codec;
    return run(codec);
  } catch (const PixelError&) {
    throw;
  } catch (const std::exception&) {
    return false;
  }
}

}  // namespace

// Items of a stated length, one after the other (PS3.5 A.4): a table of offsets, then the fragments.
CompressedFrames::CompressedFrames(const DicomHeader& h) : header_(h) {
  if (const std::string why = why_unread(h.transfer_syntax); !why.empty()) throw PixelError("its pixels " + why);
  if (h.bits_allocated > 16)
    throw PixelError("its compressed pixels have " + std::to_string(h.bits_allocated) + " bits, which is not read");
  if (h.pixel_offset >= h.file_bytes) throw PixelError("its compressed pixels are missing");
  bytes_.resize(static_cast<std::size_t>(h.file_bytes - h.pixel_offset));
  read_bytes(h, h.pixel_offset, bytes_.data(), bytes_.size());
  const auto little = [&](std::uint64_t at) {
    std::uint32_t v = 0;
    std::memcpy(&v, bytes_.data() + at, sizeof v);
    return v;
  };
  std::vector<std::uint64_t> table;
  std::vector<std::uint64_t> item_at;  // of each fragment, from the first fragment's item on
  std::uint64_t at = 0, base = 0;
  bool first = true;
  while (at + 8 <= bytes_.size() && little(at) == 0xE000FFFEU) {
    const std::uint64_t length = little(at + 4);
    if (at + 8 + length > bytes_.size()) throw PixelError("its compressed pixels are cut short");
    if (first) {
      for (std::uint64_t i = 0; i + 4 <= length; i += 4) table.push_back(little(at + 8 + i));
      base = at + 8 + length;
    } else {
      item_at.push_back(at - base);
      items_.emplace_back(at + 8, length);
    }
    first = false;
    at += 8 + length;
  }
  const std::size_t frames = h.frames.size();
  if (items_.empty()) throw PixelError("its compressed pixels are missing");
  if (frames == 1) {
    first_ = {0};
  } else if (table.size() == frames) {
    for (const std::uint64_t offset : table) {
      const auto it = std::find(item_at.begin(), item_at.end(), offset);
      if (it == item_at.end()) throw PixelError("its table of frames is damaged");
      first_.push_back(static_cast<std::size_t>(it - item_at.begin()));
    }
  } else if (items_.size() == frames) {
    for (std::size_t f = 0; f < frames; ++f) first_.push_back(f);
  } else {
    // Fragments without a table: a frame begins where a picture does.
    for (std::size_t i = 0; i < items_.size(); ++i) {
      if (starts_picture(bytes_.data() + items_[i].first, items_[i].second)) first_.push_back(i);
    }
  }
  if (first_.size() != frames) {
    throw PixelError("it should hold " + std::to_string(frames) + " pictures, but " + std::to_string(first_.size()) +
                     " were found");
  }
  first_.push_back(items_.size());
}

std::span<const char> CompressedFrames::bytes_of(int frame, std::vector<char>& joined) const {
  const auto f = static_cast<std::size_t>(frame);
  const auto piece = [&](std::size_t i) {
    return std::span(bytes_.data() + items_[i].first, static_cast<std::size_t>(items_[i].second));
  };
  std::span<const char> all = piece(first_[f]);
  if (first_[f + 1] > first_[f] + 1) {
    for (std::size_t i = first_[f]; i < first_[f + 1]; ++i)
      joined.insert(joined.end(), piece(i).begin(), piece(i).end());
    all = joined;
  }
  // Eight: what the other codecs look at. A black picture of bits deflates to less.
  const Encoding* const encoding = find_encoding(header_.transfer_syntax);
  if (all.size() < (encoding != nullptr && encoding->codec == Codec::deflated_frames ? 2U : 8U))
    throw PixelError("its compressed pixels are cut short");
  return all;
}

std::vector<std::uint16_t> CompressedFrames::decode(int frame) const {
  const DicomHeader& h = header_;
  std::vector<char> joined;
  const std::span<const char> in = bytes_of(frame, joined);
  const std::size_t n = h.pixels_per_frame();
  std::vector<std::uint16_t> values(n);
  const auto take = [&](const char* p, std::size_t count) {
    if (count >= 2 * n && h.bits_allocated > 8) {
      std::memcpy(values.data(), p, 2 * n);
    } else if (count >= n && count < 2 * n) {
      for (std::size_t i = 0; i < n; ++i) values[i] = static_cast<std::uint8_t>(p[i]);
    } else {
      throw PixelError("its compressed pixels are damaged");
    }
  };
  bool good = false;
  const Encoding* const encoding = find_encoding(h.transfer_syntax);
  const Codec codec_of = encoding == nullptr ? Codec::unread : encoding->codec;
  // Bytes as they lie in an uncompressed file of one frame: bits are packed.
  const auto take_bytes = [&](const std::vector<char>& bytes) {
    if (h.bits_allocated != 1) return take(bytes.data(), bytes.size());
    for (std::size_t i = 0; i < n; ++i) values[i] = static_cast<unsigned char>(bytes[i / 8]) >> (i % 8) & 1;
  };
  const std::size_t byte_count = h.bits_allocated == 1 ? (n + 7) / 8 : h.bytes_per_frame();
  if (codec_of == Codec::none) {
    good = in.size() == byte_count || in.size() == byte_count + byte_count % 2;
    if (good) take_bytes({in.begin(), in.begin() + static_cast<std::ptrdiff_t>(byte_count)});
  } else if (codec_of == Codec::deflated_frames) {
    std::vector<char> bytes(byte_count);
    good = inflate_frame(in, bytes);
    if (good) take_bytes(bytes);
  } else if (codec_of == Codec::htj2k) {
    check_size(h, shape_of(in, true));
    good = decode_htj2k(h, in, values);
  } else if (codec_of == Codec::jpeg_xl) {
    const std::vector<char> jpeg = encoding->always_lossy ? jpeg_inside(in) : std::vector<char>();
    good = jpeg.empty() ? decode_jpeg_xl(h, in, values) : decode_with_gdcm(h, Codec::jpeg, jpeg, take);
  } else if (codec_of == Codec::rle) {
    vtkDICOMImageCodec::ImageFormat format;
    format.Rows = static_cast<unsigned short>(h.rows);
    format.Columns = static_cast<unsigned short>(h.columns);
    format.BitsAllocated = static_cast<unsigned short>(h.bits_allocated);
    format.BitsStored = static_cast<unsigned short>(h.bits_stored);
    format.PixelRepresentation = h.is_signed ? 1 : 0;
    format.SamplesPerPixel = 1;
    const vtkDICOMImageCodec codec(vtkDICOMImageCodec::RLE);
    const auto* const from = reinterpret_cast<const unsigned char*>(in.data());
    if (h.bits_allocated == 16) {
      good = codec.Decode(format, from, in.size(), reinterpret_cast<unsigned char*>(values.data()), 2 * n) == 0;
    } else if (h.bits_allocated == 1) {
      // Bits are packed into bytes, and those are what is encoded.
      std::vector<unsigned char> packed((n + 7) / 8);
      format.Rows = 1;
      format.Columns = static_cast<unsigned short>(packed.size());
      format.BitsAllocated = format.BitsStored = 8;
      good = packed.size() <= 65535 && codec.Decode(format, from, in.size(), packed.data(), packed.size()) == 0;
      for (std::size_t i = 0; good && i < n; ++i) values[i] = packed[i / 8] >> (i % 8) & 1;
    } else {
      std::vector<char> out(h.bytes_per_frame());
      good = codec.Decode(format, from, in.size(), reinterpret_cast<unsigned char*>(out.data()), out.size()) == 0;
      if (good) take(out.data(), out.size());
    }
  } else {
    good = decode_with_gdcm(h, codec_of, in, take);
  }
  if (!good) throw PixelError("its compressed pixels are damaged");
  return values;
}

}  // namespace osteo::inline imaging::dicom
