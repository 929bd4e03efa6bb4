#include "osteo/core/base/simd.h"

#include <gtest/gtest.h>

#include "osteo/core/base/error.h"

namespace osteo {
namespace {

TEST(Simd, AWishIsNeverExceededAndAnUnknownOneIsTold) {
  EXPECT_EQ(simd_for(nullptr), widest_simd());
  EXPECT_EQ(simd_for("scalar"), Simd::scalar);
  EXPECT_LE(simd_for("avx2"), Simd::avx2);
  EXPECT_EQ(simd_for("avx512"), widest_simd());
  EXPECT_EQ(simd_name(simd_for("scalar")), "scalar");
  for (const char* wish : {"", "base", "AVX2", "avx", "avx512f", "none"}) {
    try {
      static_cast<void>(simd_for(wish));
      FAIL() << "'" << wish << "' was taken";
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ExitCode::usage);
      EXPECT_NE(std::string(e.what()).find("OSTEO_SIMD"), std::string::npos);
      EXPECT_NE(e.advice().find("scalar, avx2, avx512"), std::string::npos);
    }
  }
}

}  // namespace
}  // namespace osteo
