#define OSTEO_ISA conv_base
#define OSTEO_LANES 4
#define OSTEO_TILE 3
#define OSTEO_PAIR 0
#include "conv_loops.h"

namespace osteo::inline imaging {

const ConvKernel& conv_kernel_base() {
  static constexpr ConvKernel kKernel{&conv_base::row, &conv_base::sum, &conv_base::scale};
  return kKernel;
}

}  // namespace osteo::inline imaging
