#include "kernel.h"

#if defined(__x86_64__)
#include <immintrin.h>

namespace osteo::inline geometry::distance {
namespace {

constexpr int kF = 8, kD = 4;

struct MaskF {
  __m256 m;
};
struct MaskD {
  __m256d m;
};
struct F {
  __m256 v;
  static F load(const float* p) { return {_mm256_loadu_ps(p)}; }
  static F all(float x) { return {_mm256_set1_ps(x)}; }
  void store(float* p) const { _mm256_storeu_ps(p, v); }
  friend F operator+(F a, F b) { return {_mm256_add_ps(a.v, b.v)}; }
  friend F operator-(F a, F b) { return {_mm256_sub_ps(a.v, b.v)}; }
  friend F operator*(F a, F b) { return {_mm256_mul_ps(a.v, b.v)}; }
  friend F fma(F a, F b, F c) { return {_mm256_fmadd_ps(a.v, b.v, c.v)}; }
  friend F fnma(F a, F b, F c) { return {_mm256_fnmadd_ps(a.v, b.v, c.v)}; }
  friend F min(F a, F b) { return {_mm256_min_ps(a.v, b.v)}; }
  friend F max(F a, F b) { return {_mm256_max_ps(a.v, b.v)}; }
  friend MaskF less(F a, F b) { return {_mm256_cmp_ps(a.v, b.v, _CMP_LT_OQ)}; }
  friend MaskF at_least(F a, F b) { return {_mm256_cmp_ps(a.v, b.v, _CMP_GE_OQ)}; }
  friend MaskF at_most(F a, F b) { return {_mm256_cmp_ps(a.v, b.v, _CMP_LE_OQ)}; }
  friend F select(MaskF m, F a, F b) { return {_mm256_blendv_ps(b.v, a.v, m.m)}; }
};
struct D {
  __m256d v;
  static D load(const double* p) { return {_mm256_loadu_pd(p)}; }
  static D all(double x) { return {_mm256_set1_pd(x)}; }
  void store(double* p) const { _mm256_storeu_pd(p, v); }
  friend D operator+(D a, D b) { return {_mm256_add_pd(a.v, b.v)}; }
  friend D operator-(D a, D b) { return {_mm256_sub_pd(a.v, b.v)}; }
  friend D operator*(D a, D b) { return {_mm256_mul_pd(a.v, b.v)}; }
  friend D min(D a, D b) { return {_mm256_min_pd(a.v, b.v)}; }
  friend D max(D a, D b) { return {_mm256_max_pd(a.v, b.v)}; }
  friend MaskD at_least(D a, D b) { return {_mm256_cmp_pd(a.v, b.v, _CMP_GE_OQ)}; }
  friend D select(MaskD m, D a, D b) { return {_mm256_blendv_pd(b.v, a.v, m.m)}; }
};

inline MaskF both(MaskF a, MaskF b) {
  return {_mm256_and_ps(a.m, b.m)};
}
inline MaskD both(MaskD a, MaskD b) {
  return {_mm256_and_pd(a.m, b.m)};
}
inline unsigned bits(MaskF m) {
  return static_cast<unsigned>(_mm256_movemask_ps(m.m));
}
inline F inverse_root(F a) {  // 12 bits and one step of Newton
  const F y{_mm256_rsqrt_ps(a.v)};
  const F half = F::all(0.5F) * a * y;
  return y * fnma(half, y, F::all(1.5F));
}
inline F root(F a) {
  return {_mm256_sqrt_ps(a.v)};
}
inline F absolute(F a) {
  return {_mm256_andnot_ps(_mm256_set1_ps(-0.0F), a.v)};
}
inline float smallest(F a) {
  float v[8];
  a.store(v);
  float s = v[0];
  for (int i = 1; i < 8; ++i) s = v[i] < s ? v[i] : s;
  return s;
}
inline unsigned tail(int left) {
  return left >= 8 ? 0xffU : (1U << left) - 1U;
}
inline int compress(std::uint32_t* out, const std::uint32_t* ids, unsigned mask) {
  int n = 0;
  for (; mask != 0; mask &= mask - 1) out[n++] = ids[__builtin_ctz(mask)];
  return n;
}

struct Lanes;
Lanes load_records(const TriangleRecord* records, const std::uint32_t* ids);
void load_exact(const ExactTriangle* exact, const std::uint32_t* ids, D* f);

}  // namespace

#include "kernel_loops.h"

namespace {

inline void turn8(const float* const* rows, F* out) {
  __m256 r[8], t[8];
  for (int i = 0; i < 8; ++i) r[i] = _mm256_load_ps(rows[i]);
  for (int i = 0; i < 8; i += 2) {
    t[i] = _mm256_unpacklo_ps(r[i], r[i + 1]);
    t[i + 1] = _mm256_unpackhi_ps(r[i], r[i + 1]);
  }
  for (int i = 0; i < 8; i += 4) {
    r[i] = _mm256_shuffle_ps(t[i], t[i + 2], 0x44);
    r[i + 1] = _mm256_shuffle_ps(t[i], t[i + 2], 0xee);
    r[i + 2] = _mm256_shuffle_ps(t[i + 1], t[i + 3], 0x44);
    r[i + 3] = _mm256_shuffle_ps(t[i + 1], t[i + 3], 0xee);
  }
  for (int c = 0; c < 4; ++c) {
    out[c].v = _mm256_permute2f128_ps(r[c], r[4 + c], 0x20);
    out[4 + c].v = _mm256_permute2f128_ps(r[c], r[4 + c], 0x31);
  }
}

inline Lanes load_records(const TriangleRecord* records, const std::uint32_t* ids) {
  Lanes l;
  for (int h = 0; h < 2; ++h) {
    const float* rows[8];
    for (int i = 0; i < 8; ++i) rows[i] = reinterpret_cast<const float*>(records + ids[i]) + 8 * h;
    turn8(rows, l.f + 8 * h);
  }
  return l;
}

inline void load_exact(const ExactTriangle* exact, const std::uint32_t* ids, D* f) {
  for (int h = 0; h < 4; ++h) {
    __m256d r[4];
    for (int i = 0; i < 4; ++i) r[i] = _mm256_load_pd(reinterpret_cast<const double*>(exact + ids[i]) + 4 * h);
    const __m256d a = _mm256_unpacklo_pd(r[0], r[1]), b = _mm256_unpackhi_pd(r[0], r[1]);
    const __m256d c = _mm256_unpacklo_pd(r[2], r[3]), d = _mm256_unpackhi_pd(r[2], r[3]);
    f[4 * h].v = _mm256_permute2f128_pd(a, c, 0x20);
    f[4 * h + 1].v = _mm256_permute2f128_pd(b, d, 0x20);
    f[4 * h + 2].v = _mm256_permute2f128_pd(a, c, 0x31);
    f[4 * h + 3].v = _mm256_permute2f128_pd(b, d, 0x31);
  }
}

}  // namespace

const Kernel kAvx2{filter, measure_voxels, measure_block, closest, collect};

}  // namespace osteo::inline geometry::distance
#endif
