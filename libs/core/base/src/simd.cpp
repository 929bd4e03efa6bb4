#include "osteo/core/base/simd.h"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <string>

#include "osteo/core/base/error.h"
#include "simd_features.h"

namespace osteo {
namespace {

constexpr std::array<std::string_view, 3> kNames{"scalar", "avx2", "avx512"};

}  // namespace

Simd widest_simd() noexcept {
#if defined(__x86_64__)
  if (OSTEO_CPU_HAS_AVX2 && OSTEO_CPU_HAS_AVX512) return Simd::avx512;
  if (OSTEO_CPU_HAS_AVX2) return Simd::avx2;
#endif
  return Simd::scalar;
}

Simd simd_for(const char* wish) {
  if (wish == nullptr) return widest_simd();
  const auto* const name = std::find(kNames.begin(), kNames.end(), wish);
  if (name == kNames.end())
    throw Error(ExitCode::usage,
                "OSTEO_SIMD is '" + std::string(wish) + "' in the environment, which names no instruction set",
                "one of scalar, avx2, avx512; or unset it");
  return std::min(static_cast<Simd>(name - kNames.begin()), widest_simd());
}

Simd simd() {
  static const Simd chosen = simd_for(std::getenv("OSTEO_SIMD"));
  return chosen;
}

std::string_view simd_name(Simd simd) noexcept {
  return kNames[static_cast<std::size_t>(simd)];
}

}  // namespace osteo
