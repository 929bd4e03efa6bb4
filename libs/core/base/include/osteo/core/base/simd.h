// Which instruction set loops that are compiled more than once run in. All give the same bits; only the speed differs.
#pragma once
#include <string_view>

namespace osteo {

enum class Simd : int { scalar, avx2, avx512 };

/// The widest that both the processor and the operating system have. A set counts only when every feature that its
/// files are compiled for is there: libs/CMakeLists.txt lists those once, for the compiler and for this.
[[nodiscard]] Simd widest_simd() noexcept;
/// The widest, or the narrower one that `wish` names (scalar, avx2, avx512; nullptr: none). A wider one than there is
/// gives the widest. Error(usage) for any other name.
[[nodiscard]] Simd simd_for(const char* wish);
/// What is used: simd_for(OSTEO_SIMD in the environment), decided once. Whoever holds such loops asks when it is made,
/// not in the servo.
[[nodiscard]] Simd simd();
[[nodiscard]] std::string_view simd_name(Simd simd) noexcept;

}  // namespace osteo
