// The inner loops of a network, compiled once for each width of vectors (conv_loops.h). Features lie in blocks of 16
// channels, the channel fastest. Each output is the sum of the same products in the same order, without contraction, so
// that all widths, tile sizes and numbers of threads give the same bits.
#pragma once
#include <cstddef>

namespace osteo::inline imaging {

inline constexpr int kChannels = 16;  ///< of a block

/// One row of outputs of one or two blocks, of what one block of inputs adds to it.
struct ConvRow {
  const float* in = nullptr;                                           ///< under the first tap of the first output
  std::ptrdiff_t in_step = 0, in_pixel = 0, in_row = 0, in_plane = 0;  ///< from output to output; from tap to tap
  int channels = 0;                                                    ///< of the input's block, 1 to 16
  int kernel[3] = {1, 1, 1};                                           ///< z, y, x
  const float* weights[2] = {nullptr,
                             nullptr};  ///< of each output block: z, y, x, channel, 16 outputs; [1] may be null
  float* out[2] = {nullptr, nullptr};
  std::ptrdiff_t out_step = 0;
  int width = 0;
  const float* start[2] = {nullptr, nullptr};  ///< 16 numbers that the sums begin with; null: with what stands there
};

struct ConvKernel {
  void (*row)(const ConvRow& row);
  /// Adds the sums of `pixels` pixels to 16 sums; with `mean`, of the squares of what is left beyond it.
  void (*sum)(const float* row, int pixels, const float* mean, double* sums);
  /// x * scale + shift, plus `add` where it is given, then negative ones times slope.
  void (*scale)(float* row, int pixels, const float* scale, const float* shift, const float* add, float slope);
};

[[nodiscard]] const ConvKernel& conv_kernel();
[[nodiscard]] const ConvKernel& conv_kernel_base();
[[nodiscard]] const ConvKernel& conv_kernel_avx2();
[[nodiscard]] const ConvKernel& conv_kernel_avx512();

}  // namespace osteo::inline imaging
