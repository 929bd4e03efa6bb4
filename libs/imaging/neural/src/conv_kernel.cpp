#include "osteo/imaging/neural/detail/conv_kernel.h"

#include "osteo/core/base/simd.h"

namespace osteo::inline imaging {

const ConvKernel& conv_kernel() {
#if defined(__x86_64__)
  if (simd() == Simd::avx512) return conv_kernel_avx512();
  if (simd() == Simd::avx2) return conv_kernel_avx2();
#endif
  return conv_kernel_base();
}

}  // namespace osteo::inline imaging
