#include "pixels.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <limits>
#include <type_traits>

#include "decode.h"
#include "osteo/core/base/parallel.h"

namespace osteo::inline imaging::dicom {
namespace {

// Scanners mark what they did not measure with one value that no tissue has, below the noise of air. Dark streaks
// beside metal come down here as well, but with many values.
constexpr double kPaddingBelowHu = -1200;
constexpr double kSamePaddingHu = 8;
// A padding tag that names a value above this names tissue.
constexpr double kTissueFromHu = -900;
constexpr std::int16_t kMetalHu = 3000;
constexpr double kRingAboveHu = 1500;  // no corner of a picture of a head is as bright

// The values of words: BitsStored bits up to HighBit, with their sign extended; what lies around them is no part of a
// pixel, and a file need not extend the sign (PS3.5 8.1.1, C.7.6.3.1.2). Two errors of files are told from that by the
// pixels themselves: a HighBit that leaves out bits which are in use, and a BitsStored that the values exceed.
template <class T>
void take_stored_bits(const DicomHeader& h, T* p, std::size_t n, ValueCount& count) {
  static_assert(std::is_unsigned_v<T>);
  constexpr int kBits = 8 * sizeof(T);
  const int stored = h.bits_stored;
  if (stored <= 0 || stored >= kBits || h.high_bit >= kBits || h.high_bit + 1 < stored) return;
  const T mask = static_cast<T>((T{1} << stored) - 1), sign = static_cast<T>(T{1} << (stored - 1));
  const auto extended = [&](T v) {
    return static_cast<T>(h.is_signed && (v & sign) != 0 ? v | static_cast<T>(~mask) : v & mask);
  };

  const int shift = h.high_bit + 1 - stored;
  if (shift > 0) {
    const T below = static_cast<T>((T{1} << shift) - 1);
    bool in_use = false;
    for (std::size_t i = 0; i < n && !h.overlay_in_pixels; ++i) in_use = in_use || (p[i] & below) != 0;
    if (!in_use) {
      for (std::size_t i = 0; i < n; ++i) p[i] = extended(static_cast<T>(p[i] >> shift));
      return;
    }
    ++count.high_bit_wrong;
  }
  // Nearly all files are in order, which is quickly seen: a sum moves what may lie above the stored bits to where it
  // shows.
  const T lowest = h.is_signed ? sign : T{0};
  bool odd = false;
  constexpr std::size_t kBlock = 4096;
  for (std::size_t begin = 0; begin < n && !odd; begin += kBlock) {
    T above = 0;
    for (std::size_t i = begin; i < std::min(n, begin + kBlock); ++i)
      above = static_cast<T>(above | (static_cast<T>(p[i] + lowest) & static_cast<T>(~mask)));
    odd = above != 0;
  }
  if (!odd) return;

  // Padding that its tag gives in more bits than are stored is no value either way.
  const auto is_padding = [&](T word) {
    if (!h.padding) return false;
    const auto v =
        static_cast<std::int64_t>(h.is_signed ? static_cast<std::int64_t>(static_cast<std::make_signed_t<T>>(word))
                                              : static_cast<std::int64_t>(word));
    const int end = h.padding_limit.value_or(*h.padding);
    return v >= std::min(*h.padding, end) && v <= std::max(*h.padding, end);
  };
  const auto number = [&](T word) {
    return h.is_signed ? static_cast<double>(static_cast<std::make_signed_t<T>>(word)) : static_cast<double>(word);
  };
  // Pictures change less from pixel to pixel than bits that do not belong to them do.
  double by_tags = 0, by_text = 0;
  const auto columns = static_cast<std::size_t>(h.columns);
  std::uint64_t changed = 0, unextended = 0, too_low = 0;
  const std::size_t most = h.overlay_in_pixels ? 0 : n;
  for (std::size_t i = 0; i < most; ++i) {
    const T w = p[i], v = extended(w);
    changed += w != v ? 1 : 0;
    unextended += w != v && static_cast<T>(w & static_cast<T>(~mask)) == 0 ? 1 : 0;
    too_low += w != v && h.is_signed && static_cast<T>(w | mask) == static_cast<T>(~T{0}) ? 1 : 0;
    if (i % columns == 0 || (w == v && p[i - 1] == extended(p[i - 1])) || is_padding(w) || is_padding(p[i - 1]))
      continue;
    by_tags += std::abs(number(v) - number(extended(p[i - 1])));
    by_text += std::abs(number(w) - number(p[i - 1]));
  }
  // Negative numbers whose sign is extended, but from further up.
  const bool all_too_low = too_low > 0 && too_low == changed;
  if (all_too_low || by_text < 0.5 * by_tags) {
    count.bits_exceeded += changed;
    return;
  }
  for (std::size_t i = 0; i < n; ++i) {
    if (!is_padding(p[i])) p[i] = extended(p[i]);
  }
  count.sign_not_extended += unextended;
  count.bits_foreign += changed - unextended;
}

class Converter {
 public:
  Converter(const DicomHeader& h, const DicomFrame& f, ValueCount& count) : h_(h), f_(f), count_(count) {
    count.fractional = count.fractional || f.slope != std::floor(f.slope) || f.intercept != std::floor(f.intercept);
    if (h.padding) {
      const int lo = h.padding_limit ? std::min(*h.padding, *h.padding_limit) : *h.padding;
      const int hi = h.padding_limit ? std::max(*h.padding, *h.padding_limit) : *h.padding;
      const bool is_tissue = hounsfield(hi, f) > kTissueFromHu;
      (is_tissue ? tissue_lo_ : pad_lo_) = lo;
      (is_tissue ? tissue_hi_ : pad_hi_) = hi;
    }
    const double top = h.bits_stored > 0 && h.bits_stored < 16
                           ? (h.is_signed ? (1 << (h.bits_stored - 1)) - 1 : (1 << h.bits_stored) - 1)
                           : 1e9;
    top_ = h.bits_stored > 8 ? static_cast<std::int64_t>(top) : std::int64_t{1} << 40;
  }

  // `in` and `out` may be the same memory when T has two bytes.
  template <class T>
  void run(const T* in, std::int16_t* out, std::size_t columns, std::size_t rows) {
    std::vector<std::pair<T, T>> ranges(columns > 0 ? rows : 0);
    T least{};
    for (std::size_t y = 0; y < ranges.size(); ++y) {
      ranges[y] = least_and_greatest(in + y * columns, columns);
      least = y == 0 ? ranges[y].first : std::min(least, ranges[y].first);
    }
    find_padding(in, columns * rows, least);
    find_ring(in, columns, rows);
    if (count_.histogram.empty()) count_.histogram.assign(ValueCount::kBins, 0);
    sampled_.fill({});
    for (std::size_t y = 0; y < ranges.size(); ++y) {
      ring_row_ = ring_.empty() ? nullptr : ring_.data() + y * columns;
      const auto [lo, hi] = ring_row_ != nullptr
                                ? range_beside_ring(in + y * columns, columns)
                                : std::pair<std::int64_t, std::int64_t>(ranges[y].first, ranges[y].second);
      row(in + y * columns, out + y * columns, columns, lo, hi, y % 4 == 0);
    }
    for (const auto& part : sampled_) {
      for (std::size_t bin = 0; bin < count_.histogram.size(); ++bin) count_.histogram[bin] += part[bin];
    }
    count_.pixels += columns * rows;
  }

 private:
  /// All bits or none: compilers compare many at once so, where a choice between values keeps them from it.
  template <class Int>
  [[nodiscard]] static Int mask(bool yes) {
    return static_cast<Int>(-static_cast<Int>(yes));
  }

  // Up to two values (the corners of a picture, and what lies outside the table) that many pixels share, below all
  // others.
  template <class T>
  void find_padding(const T* in, std::size_t n, T least) {
    if (hounsfield(static_cast<double>(least), f_) >= kPaddingBelowHu) return;
    const auto whole = [](double stored) { return static_cast<std::int64_t>(std::clamp(stored, -1e12, 1e12)); };
    if (h_.lossy) {
      // One value no longer: all that is as low.
      found_ = whole(std::ceil((kPaddingBelowHu - f_.intercept) / f_.slope)) - 1;
      return;
    }
    // No wider than the values need, and without branches, so that many are compared at once.
    using Wide = std::conditional_t<(sizeof(T) > 2), std::int64_t, std::int32_t>;
    using Limits = std::numeric_limits<Wide>;
    const auto wide = [](std::int64_t v) {
      return static_cast<Wide>(std::clamp<std::int64_t>(v, Limits::min(), Limits::max()));
    };
    for (int found = 0; found < 2; ++found) {
      const Wide above = wide(found_), pad_lo = wide(pad_lo_), pad_hi = wide(pad_hi_);
      Wide lowest = Limits::max();
      for (std::size_t i = 0; i < n; ++i) {
        const Wide v = in[i];
        const Wide counts = mask<Wide>(v > above) & (mask<Wide>(v < pad_lo) | mask<Wide>(v > pad_hi));
        lowest = std::min<Wide>(lowest, (v & counts) | (Limits::max() & ~counts));
      }
      if (lowest == Limits::max() || hounsfield(static_cast<double>(lowest), f_) >= kPaddingBelowHu) return;
      const auto top = static_cast<std::int64_t>(lowest) + whole(kSamePaddingHu / f_.slope);
      const Wide same_to = wide(top);
      std::uint32_t same = 0;  // a picture has fewer pixels
      for (std::size_t i = 0; i < n; ++i) {
        const Wide v = in[i];
        same -= static_cast<std::uint32_t>(mask<Wide>(v >= lowest) & mask<Wide>(v <= same_to));
      }
      if (same < 16 || static_cast<double>(same) < 2e-4 * static_cast<double>(n)) return;
      found_ = top;
    }
  }

  // Around the round picture of some scanners the corners hold one value brighter than bone, whether a tag names it or
  // not. What of it is connected with a corner is padding; a clip of metal of that value is not.
  template <class T>
  void find_ring(const T* in, std::size_t columns, std::size_t rows) {
    ring_.clear();
    if (columns < 2 || rows < 2) return;
    const std::size_t n = columns * rows;
    const std::array<std::size_t, 4> corners{0, columns - 1, n - columns, n - 1};
    const T value = in[0];
    if (hounsfield(static_cast<double>(value), f_) < kRingAboveHu) return;
    for (const std::size_t c : corners)
      if (in[c] != value) return;
    ring_.assign(n, 0);
    std::vector<std::size_t> open(corners.begin(), corners.end());
    for (const std::size_t c : corners) ring_[c] = 1;
    while (!open.empty()) {
      const std::size_t at = open.back();
      open.pop_back();
      const std::size_t x = at % columns, y = at / columns;
      const auto go = [&](bool there, std::size_t to) {
        if (!there || ring_[to] != 0 || in[to] != value) return;
        ring_[to] = 1;
        open.push_back(to);
      };
      go(x > 0, at - 1), go(x + 1 < columns, at + 1), go(y > 0, at - columns), go(y + 1 < rows, at + columns);
    }
  }

  /// Of a row of at least one. Compared as signed numbers, many at once: the least that all processors have compares
  /// words only so.
  template <class T>
  [[nodiscard]] static std::pair<T, T> least_and_greatest(const T* in, std::size_t n) {
    using Signed = std::make_signed_t<T>;
    constexpr T kTurn = std::is_unsigned_v<T> ? static_cast<T>(T{1} << (8 * sizeof(T) - 1)) : T{0};
    Signed lo = std::numeric_limits<Signed>::max(), hi = std::numeric_limits<Signed>::min();
    for (std::size_t i = 0; i < n; ++i) {
      const auto v = static_cast<Signed>(static_cast<T>(in[i] ^ kTurn));
      lo = std::min(lo, v);
      hi = std::max(hi, v);
    }
    return {static_cast<T>(static_cast<T>(lo) ^ kTurn), static_cast<T>(static_cast<T>(hi) ^ kTurn)};
  }

  template <class T>
  [[nodiscard]] std::pair<std::int64_t, std::int64_t> range_beside_ring(const T* in, std::size_t n) const {
    std::int64_t lo = 1 << 30, hi = -(1 << 30);
    for (std::size_t i = 0; i < n; ++i) {
      if (ring_row_[i] != 0) continue;
      lo = std::min<std::int64_t>(lo, in[i]);
      hi = std::max<std::int64_t>(hi, in[i]);
    }
    return {lo, hi};
  }

  /// How many are at least this much. In words as wide as the values, so that many are compared at once.
  [[nodiscard]] static std::uint64_t at_least(const std::int16_t* hu, std::size_t n, std::int16_t limit) {
    constexpr std::size_t kBlock = 1 << 15;
    std::uint64_t all = 0;
    for (std::size_t begin = 0; begin < n; begin += kBlock) {
      std::uint16_t count = 0;
      for (std::size_t i = begin; i < std::min(n, begin + kBlock); ++i)
        count = static_cast<std::uint16_t>(count + (hu[i] >= limit ? 1 : 0));
      all += count;
    }
    return all;
  }

  /// Stored values plus a whole number. The result fits, so that arithmetic modulo 65536 gives it.
  template <class T>
  static void shifted(const T* in, std::int16_t* out, std::size_t n, int shift) {
    const auto by = static_cast<std::uint16_t>(shift);
    // In place, a value is read before it is written, and no other one is looked at.
#pragma GCC ivdep
    for (std::size_t i = 0; i < n; ++i)
      out[i] = static_cast<std::int16_t>(static_cast<std::uint16_t>(static_cast<std::uint16_t>(in[i]) + by));
  }

  template <class T>
  void row(const T* in, std::int16_t* out, std::size_t n, std::int64_t lo, std::int64_t hi, bool sample) {
    const double low = hounsfield(static_cast<double>(lo), f_), high = hounsfield(static_cast<double>(hi), f_);
    const bool whole = f_.slope == 1 && f_.intercept == std::floor(f_.intercept);
    const bool padded = pad_lo_ <= pad_hi_ && lo <= pad_hi_ && hi >= pad_lo_;
    const bool tissue = tissue_lo_ <= tissue_hi_ && lo <= tissue_hi_ && hi >= tissue_lo_;
    if (ring_row_ != nullptr) {
      careful_row(in, out, n);
    } else if (whole && !padded && !tissue && lo > found_ && low >= kPaddingBelowHu && high <= 32767) {
      shifted(in, out, n, static_cast<int>(f_.intercept));
      count_.hu_min = std::min(count_.hu_min, static_cast<std::int64_t>(low));
    } else if (whole && !tissue && low > kNoValue && high <= 32767) {
      padded_row(in, out, n);
    } else {
      careful_row(in, out, n);
    }
    count_.hu_max = std::max(count_.hu_max, static_cast<std::int64_t>(std::floor(high + 0.5)));
    if (hi >= top_) {
      const auto top = static_cast<std::int64_t>(std::floor(hounsfield(static_cast<double>(top_), f_)));
      if (top <= 32767)
        count_.saturated += at_least(out, n, static_cast<std::int16_t>(std::max<std::int64_t>(top, -32768)));
    }
    if (high >= kMetalHu) count_.metal += at_least(out, n, kMetalHu);
    if (!sample) return;
    // Without a branch, which noise would mislead, and in turn to several counts, as neighbours are often alike. Air
    // that the scanner cut off at -1024 is no peak of its own: it goes where what lies outside goes.
    for (std::size_t i = 0; i < n; ++i) {
      const auto bin = static_cast<unsigned>((out[i] + 1200) >> 2);
      const bool counts = bin < static_cast<unsigned>(ValueCount::kBins) && out[i] != kAirHu;
      ++sampled_[i % sampled_.size()][counts ? bin : static_cast<unsigned>(ValueCount::kBins)];
    }
  }

  // careful_row() for whole numbers that fit, without a branch: rows of round pictures are half padding.
  template <class T>
  void padded_row(const T* in, std::int16_t* out, std::size_t n) {
    using Limits = std::numeric_limits<std::int32_t>;
    const auto word = [](std::int64_t v) {
      return static_cast<std::int32_t>(std::clamp<std::int64_t>(v, Limits::min(), Limits::max()));
    };
    const std::int32_t pad_lo = word(pad_lo_), pad_hi = word(pad_hi_), found = word(found_),
                       shift = word(static_cast<std::int64_t>(f_.intercept));
    const std::int32_t any_found = mask<std::int32_t>(found_ >= Limits::min());
    constexpr auto kAirLimit = static_cast<std::int32_t>(kPaddingBelowHu);
    std::int32_t by_tag = 0, by_value = 0, below = 0;  // a row is short
    std::int32_t lowest_pad = Limits::max(), lowest = Limits::max();
    // In place, as in shifted().
#pragma GCC ivdep
    for (std::size_t i = 0; i < n; ++i) {
      const auto v = static_cast<std::int32_t>(in[i]);
      const std::int32_t hu = v + shift;
      const std::int32_t tagged = mask<std::int32_t>(v >= pad_lo) & mask<std::int32_t>(v <= pad_hi),
                         low = any_found & mask<std::int32_t>(v <= found) & ~tagged, none = tagged | low;
      by_tag -= tagged;
      by_value -= low;
      below -= mask<std::int32_t>(hu < kAirLimit) & ~none;
      lowest_pad = std::min(lowest_pad, (hu & none) | (Limits::max() & ~none));
      lowest = std::min(lowest, (hu & ~none) | (Limits::max() & none));
      out[i] = static_cast<std::int16_t>((hu & ~none) | (kNoValue & none));
    }
    count_.by_tag += static_cast<std::uint64_t>(by_tag);
    count_.found += static_cast<std::uint64_t>(by_value);
    count_.below_air += static_cast<std::uint64_t>(below);
    if (by_tag + by_value > 0) count_.padding_hu = std::min(count_.padding_hu, static_cast<double>(lowest_pad));
    if (lowest != Limits::max()) count_.hu_min = std::min<std::int64_t>(count_.hu_min, lowest);
  }

  template <class T>
  void careful_row(const T* in, std::int16_t* out, std::size_t n) {
    for (std::size_t i = 0; i < n; ++i) {
      const std::int64_t stored = in[i];
      const double hu = hounsfield(static_cast<double>(stored), f_);
      if (ring_row_ != nullptr && ring_row_[i] != 0) {
        ++count_.ring;
        count_.ring_hu = hu;
        out[i] = kNoValue;
        continue;
      }
      if (stored >= pad_lo_ && stored <= pad_hi_) {
        ++count_.by_tag;
        count_.padding_hu = std::min(count_.padding_hu, hu);
        out[i] = kNoValue;
        continue;
      }
      if (stored >= tissue_lo_ && stored <= tissue_hi_) ++count_.declared_tissue;
      if (stored <= found_) {
        ++count_.found;
        count_.padding_hu = std::min(count_.padding_hu, hu);
        out[i] = kNoValue;
        continue;
      }
      if (hu > 32767) ++count_.out_of_range;
      if (hu < kPaddingBelowHu) ++count_.below_air;
      count_.hu_min = std::min(count_.hu_min, static_cast<std::int64_t>(std::floor(hu + 0.5)));
      out[i] = static_cast<std::int16_t>(std::clamp(std::floor(hu + 0.5), -32767.0, 32767.0));
    }
  }

  const DicomHeader& h_;
  const DicomFrame& f_;
  ValueCount& count_;
  std::vector<std::uint8_t> ring_;          // of the picture: 1 where find_ring() found padding; empty without
  const std::uint8_t* ring_row_ = nullptr;  // of the row that is converted
  // What is sampled of the picture; the last bin is of what lies outside the others.
  std::array<std::array<std::uint32_t, ValueCount::kBins + 1>, 4> sampled_;
  std::int64_t pad_lo_ = 1, pad_hi_ = 0, tissue_lo_ = 1, tissue_hi_ = 0, top_ = 0;
  std::int64_t found_ =
      std::numeric_limits<std::int64_t>::min();  // stored values up to this are padding that no tag names
};

}  // namespace

void read_bytes(const DicomHeader& h, std::uint64_t offset, void* out, std::size_t bytes) {
  const int fd = ::open(h.file.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) throw PixelError(std::string("it cannot be read: ") + std::strerror(errno));
  std::size_t got = 0;
  while (got < bytes) {
    const ssize_t n = ::pread(fd, static_cast<char*>(out) + got, bytes - got, static_cast<off_t>(offset + got));
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) break;
    got += static_cast<std::size_t>(n);
  }
  ::close(fd);
  if (got < bytes)
    throw PixelError("the file is cut short: " + std::to_string(got) + " of " + std::to_string(bytes) +
                     " bytes of pixels are there");
}

void ValueCount::add(const ValueCount& o) {
  hu_min = std::min(hu_min, o.hu_min);
  hu_max = std::max(hu_max, o.hu_max);
  pixels += o.pixels;
  by_tag += o.by_tag;
  found += o.found;
  ring += o.ring;
  ring_hu = std::max(ring_hu, o.ring_hu);
  declared_tissue += o.declared_tissue;
  out_of_range += o.out_of_range;
  saturated += o.saturated;
  metal += o.metal;
  below_air += o.below_air;
  high_bit_wrong += o.high_bit_wrong;
  sign_not_extended += o.sign_not_extended;
  bits_foreign += o.bits_foreign;
  bits_exceeded += o.bits_exceeded;
  padding_hu = std::min(padding_hu, o.padding_hu);
  fractional = fractional || o.fractional;
  if (histogram.empty()) histogram.assign(kBins, 0);
  for (std::size_t i = 0; i < o.histogram.size(); ++i) histogram[i] += o.histogram[i];
}

void read_frames_hu(const DicomHeader& h, std::span<const FrameTarget> targets, ValueCount& count, int threads) {
  const std::size_t n = h.pixels_per_frame(), columns = static_cast<std::size_t>(h.columns),
                    rows = static_cast<std::size_t>(h.rows);
  const auto convert = [&](const FrameTarget& t, const auto* stored, ValueCount& to) {
    Converter(h, h.frames[static_cast<std::size_t>(t.frame)], to).run(stored, t.out, columns, rows);
  };
  if (h.compressed) {
    const CompressedFrames frames(h);
    std::vector<ValueCount> counts(targets.size());
    parallel_for(targets.size(), 1, threads, [&](std::size_t i, std::size_t) {
      const FrameTarget& t = targets[i];
      std::vector<std::uint16_t> stored = frames.decode(t.frame);
      // What codecs leave above the sign bit says nothing of the file.
      ValueCount ignored;
      take_stored_bits(h, stored.data(), n, ignored);
      if (h.is_signed) {
        convert(t, reinterpret_cast<const std::int16_t*>(stored.data()), counts[i]);
      } else {
        convert(t, stored.data(), counts[i]);
      }
    });
    for (const ValueCount& c : counts) count.add(c);
    return;
  }
  for (const FrameTarget& t : targets) {
    const std::uint64_t offset = h.pixel_offset + static_cast<std::uint64_t>(t.frame) * h.bytes_per_frame();
    if (h.bits_allocated == 8) {
      std::vector<std::uint8_t> stored(n);
      read_bytes(h, offset, stored.data(), n);
      take_stored_bits(h, stored.data(), n, count);
      if (h.is_signed) {
        convert(t, reinterpret_cast<const std::int8_t*>(stored.data()), count);
      } else {
        convert(t, stored.data(), count);
      }
      continue;
    }
    if (h.bits_allocated == 32) {
      std::vector<std::uint32_t> stored(n);
      read_bytes(h, offset, stored.data(), n * 4);
      if (h.big_endian)
        std::transform(stored.begin(), stored.end(), stored.begin(),
                       [](std::uint32_t v) { return __builtin_bswap32(v); });
      take_stored_bits(h, stored.data(), n, count);
      if (h.is_signed) {
        convert(t, reinterpret_cast<const std::int32_t*>(stored.data()), count);
      } else {
        convert(t, stored.data(), count);
      }
      continue;
    }
    // Read into place and converted there.
    read_bytes(h, offset, t.out, n * 2);
    auto* const words = reinterpret_cast<std::uint16_t*>(t.out);
    if (h.big_endian) std::transform(words, words + n, words, [](std::uint16_t v) { return __builtin_bswap16(v); });
    take_stored_bits(h, words, n, count);
    if (h.is_signed) {
      convert(t, t.out, count);
    } else {
      convert(t, words, count);
    }
  }
}

void convert_values(const DicomHeader& h, const std::int16_t* stored, std::int16_t* out, ValueCount& count) {
  Converter(h, h.frames.front(), count)
      .run(stored, out, static_cast<std::size_t>(h.columns), static_cast<std::size_t>(h.rows));
}

bool same_stored_pixels(const DicomHeader& a, const DicomHeader& b) {
  if (a.columns != b.columns || a.rows != b.rows || a.frames.size() != 1 || b.frames.size() != 1) return false;
  if (a.is_signed != b.is_signed || a.bits_allocated != b.bits_allocated) return false;
  try {
    std::vector<std::int16_t> p(a.pixels_per_frame()), q(b.pixels_per_frame());
    ValueCount ignored;
    const FrameTarget to_p{0, p.data()}, to_q{0, q.data()};
    read_frames_hu(a, {&to_p, 1}, ignored);
    read_frames_hu(b, {&to_q, 1}, ignored);
    return p == q;
  } catch (const PixelError&) {
    return false;
  }
}

}  // namespace osteo::inline imaging::dicom
