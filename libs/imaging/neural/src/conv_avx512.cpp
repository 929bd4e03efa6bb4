#define OSTEO_ISA conv_avx512
#define OSTEO_LANES 16
#define OSTEO_TILE 12
#define OSTEO_PAIR 1
#include "conv_loops.h"

namespace osteo::inline imaging {

const ConvKernel& conv_kernel_avx512() {
  static constexpr ConvKernel kKernel{&conv_avx512::row, &conv_avx512::sum, &conv_avx512::scale};
  return kKernel;
}

}  // namespace osteo::inline imaging
