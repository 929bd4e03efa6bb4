#define OSTEO_ISA conv_avx2
#define OSTEO_LANES 8
#define OSTEO_TILE 6
#define OSTEO_PAIR 0
#include "conv_loops.h"

namespace osteo::inline imaging {

const ConvKernel& conv_kernel_avx2() {
  static constexpr ConvKernel kKernel{&conv_avx2::row, &conv_avx2::sum, &conv_avx2::scale};
  return kKernel;
}

}  // namespace osteo::inline imaging
