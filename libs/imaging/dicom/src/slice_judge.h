// Whether the pixels of a stack's slices belong together: tags can be in order where pictures are not. Private to
// libs/imaging/dicom.
#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "osteo/imaging/dicom/verdict.h"

namespace osteo::inline imaging::dicom {

/// A slice in at most 64 x 64 blocks of at least 4 x 4 pixels, all that is needed to compare it with others: 32 kB.
class SliceFigure {
 public:
  static constexpr int kSide = 64;
  struct Block {
    float hu = -1024;       ///< mean of the pixels that are measured
    bool one_value = true;  ///< all pixels are the same, or padding
    bool measured = false;  ///< some pixel is no padding
  };
  SliceFigure() = default;
  /// `hu`: as read_frames_hu() gives them, kNoValue for padding. One pass over the pixels.
  SliceFigure(const std::int16_t* hu, int columns, int rows);

  [[nodiscard]] int columns() const { return columns_; }
  [[nodiscard]] int rows() const { return rows_; }
  [[nodiscard]] const Block& at(int i, int j) const { return blocks_[static_cast<std::size_t>(j * columns_ + i)]; }
  [[nodiscard]] const std::vector<Block>& blocks() const { return blocks_; }
  /// Every pixel has the same value.
  [[nodiscard]] bool blank() const { return blank_; }

 private:
  int columns_ = 0, rows_ = 0;
  std::vector<Block> blocks_;
  bool blank_ = true;
};

struct JudgedSlice {
  std::string name;
  double along_mm = 0;
};

/// Compares each slice with its neighbours and adds what does not fit to the verdict, by name: slices without a
/// picture, pictures of which a part is missing, steps in the values, slices in another order than their positions say,
/// slices that are mirrored, of another place, or there twice. Nothing for fewer than four slices or fewer than 48 pixels a side. Slices are in order
/// along the normal, all figures of one size; `picture_mm2` is the area of one. O(slices * blocks).
void judge_slices(Verdict& verdict, const std::vector<JudgedSlice>& slices, const std::vector<SliceFigure>& figures,
                  double picture_mm2);

}  // namespace osteo::inline imaging::dicom
