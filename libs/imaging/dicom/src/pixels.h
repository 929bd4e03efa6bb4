// Pixels of one file as HU. Private to libs/imaging/dicom.
#pragma once
#include <cstdint>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "osteo/imaging/dicom/detail/header.h"

namespace osteo::inline imaging::dicom {

/// Marks a pixel that is no measurement: padding outside the scan.
inline constexpr std::int16_t kNoValue = -32768;
inline constexpr std::int16_t kAirHu = -1024;

/// What the values of some slices were like; summed over slices.
struct ValueCount {
  static constexpr int kBins = 1100;  // 4 HU each, from -1200
  std::int64_t hu_min = 1 << 30, hu_max = -(1 << 30);
  std::uint64_t pixels = 0, by_tag = 0, found = 0, declared_tissue = 0, out_of_range = 0, saturated = 0, metal = 0,
                below_air = 0;
  std::uint64_t ring = 0;  // pixels of one bright value that are connected with the picture's corners: padding
  double ring_hu = 0;
  // Words whose bits are not as the header says; frames for high_bit_wrong.
  std::uint64_t high_bit_wrong = 0, sign_not_extended = 0, bits_foreign = 0, bits_exceeded = 0;
  double padding_hu = 0;    // as declared, or the lowest that was found
  bool fractional = false;  // slope or intercept are no whole numbers
  std::vector<std::uint32_t> histogram;
  void add(const ValueCount& other);
};

/// Why the pixels of a file cannot be had.
struct PixelError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Throws PixelError when the file ends early.
void read_bytes(const DicomHeader& header, std::uint64_t offset, void* out, std::size_t bytes);

struct FrameTarget {
  int frame = 0;
  std::int16_t* out = nullptr;
};

/// Each target gets pixels_per_frame() values: HU rounded to whole numbers; kNoValue for padding. A compressed file is
/// read once for all targets, and its frames decoded in parallel (`threads` as of parallel_for). Any thread. Throws
/// PixelError.
void read_frames_hu(const DicomHeader& header, std::span<const FrameTarget> targets, ValueCount& count,
                    int threads = 1);

/// The same for values that are at hand: those of the header's only frame.
void convert_values(const DicomHeader& header, const std::int16_t* stored, std::int16_t* out, ValueCount& count);

/// True when the stored pixels of two single-frame files are the same.
[[nodiscard]] bool same_stored_pixels(const DicomHeader& a, const DicomHeader& b);

}  // namespace osteo::inline imaging::dicom
