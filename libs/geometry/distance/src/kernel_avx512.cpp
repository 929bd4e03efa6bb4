#include "kernel.h"

#if defined(__x86_64__)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wuninitialized"  // g++ 12 about its own intrinsics
#include <immintrin.h>

namespace osteo::inline geometry::distance {
namespace {

constexpr int kF = 16, kD = 8;

struct F {
  __m512 v;
  static F load(const float* p) { return {_mm512_loadu_ps(p)}; }
  static F all(float x) { return {_mm512_set1_ps(x)}; }
  void store(float* p) const { _mm512_storeu_ps(p, v); }
  friend F operator+(F a, F b) { return {_mm512_add_ps(a.v, b.v)}; }
  friend F operator-(F a, F b) { return {_mm512_sub_ps(a.v, b.v)}; }
  friend F operator*(F a, F b) { return {_mm512_mul_ps(a.v, b.v)}; }
  friend F fma(F a, F b, F c) { return {_mm512_fmadd_ps(a.v, b.v, c.v)}; }
  friend F fnma(F a, F b, F c) { return {_mm512_fnmadd_ps(a.v, b.v, c.v)}; }
  friend F min(F a, F b) { return {_mm512_min_ps(a.v, b.v)}; }
  friend F max(F a, F b) { return {_mm512_max_ps(a.v, b.v)}; }
  friend __mmask16 less(F a, F b) { return _mm512_cmp_ps_mask(a.v, b.v, _CMP_LT_OQ); }
  friend __mmask16 at_least(F a, F b) { return _mm512_cmp_ps_mask(a.v, b.v, _CMP_GE_OQ); }
  friend __mmask16 at_most(F a, F b) { return _mm512_cmp_ps_mask(a.v, b.v, _CMP_LE_OQ); }
  friend F select(__mmask16 m, F a, F b) { return {_mm512_mask_blend_ps(m, b.v, a.v)}; }
};
struct D {
  __m512d v;
  static D load(const double* p) { return {_mm512_loadu_pd(p)}; }
  static D all(double x) { return {_mm512_set1_pd(x)}; }
  void store(double* p) const { _mm512_storeu_pd(p, v); }
  friend D operator+(D a, D b) { return {_mm512_add_pd(a.v, b.v)}; }
  friend D operator-(D a, D b) { return {_mm512_sub_pd(a.v, b.v)}; }
  friend D operator*(D a, D b) { return {_mm512_mul_pd(a.v, b.v)}; }
  friend D min(D a, D b) { return {_mm512_min_pd(a.v, b.v)}; }
  friend D max(D a, D b) { return {_mm512_max_pd(a.v, b.v)}; }
  friend __mmask8 at_least(D a, D b) { return _mm512_cmp_pd_mask(a.v, b.v, _CMP_GE_OQ); }
  friend D select(__mmask8 m, D a, D b) { return {_mm512_mask_blend_pd(m, b.v, a.v)}; }
};

inline __mmask16 both(__mmask16 a, __mmask16 b) {
  return static_cast<__mmask16>(a & b);
}
inline __mmask8 both(__mmask8 a, __mmask8 b) {
  return static_cast<__mmask8>(a & b);
}
inline unsigned bits(__mmask16 m) {
  return m;
}
inline F inverse_root(F a) {  // 14 bits and one step of Newton
  const F y{_mm512_rsqrt14_ps(a.v)};
  const F half = F::all(0.5F) * a * y;
  return y * fnma(half, y, F::all(1.5F));
}
inline F root(F a) {
  return {_mm512_sqrt_ps(a.v)};
}
inline F absolute(F a) {
  return {_mm512_abs_ps(a.v)};
}
inline float smallest(F a) {
  return _mm512_reduce_min_ps(a.v);
}
inline unsigned tail(int left) {
  return left >= 16 ? 0xffffU : (1U << left) - 1U;
}
inline int compress(std::uint32_t* out, const std::uint32_t* ids, unsigned mask) {
  const __m512i packed = _mm512_maskz_compress_epi32(static_cast<__mmask16>(mask), _mm512_loadu_si512(ids));
  _mm512_storeu_si512(out, packed);
  return __builtin_popcount(mask);
}

struct Lanes;
Lanes load_records(const TriangleRecord* records, const std::uint32_t* ids);
void load_exact(const ExactTriangle* exact, const std::uint32_t* ids, D* f);

}  // namespace

#include "kernel_loops.h"

namespace {

// 16 rows of 16 floats, turned.
inline Lanes load_records(const TriangleRecord* records, const std::uint32_t* ids) {
  __m512 r[16], t[16];
  for (int i = 0; i < 16; ++i) r[i] = _mm512_load_ps(records + ids[i]);
  for (int i = 0; i < 16; i += 2) {
    t[i] = _mm512_unpacklo_ps(r[i], r[i + 1]);
    t[i + 1] = _mm512_unpackhi_ps(r[i], r[i + 1]);
  }
  for (int i = 0; i < 16; i += 4) {
    const auto pd = [](__m512 x) { return _mm512_castps_pd(x); };
    const auto ps = [](__m512d x) { return _mm512_castpd_ps(x); };
    r[i] = ps(_mm512_unpacklo_pd(pd(t[i]), pd(t[i + 2])));
    r[i + 1] = ps(_mm512_unpackhi_pd(pd(t[i]), pd(t[i + 2])));
    r[i + 2] = ps(_mm512_unpacklo_pd(pd(t[i + 1]), pd(t[i + 3])));
    r[i + 3] = ps(_mm512_unpackhi_pd(pd(t[i + 1]), pd(t[i + 3])));
  }
  // r[4a + c], 128-bit part b: field 4b + c of rows 4a..4a+3.
  Lanes l;
  for (int c = 0; c < 4; ++c) {
    const __m512 p = _mm512_shuffle_f32x4(r[c], r[4 + c], 0x88), q = _mm512_shuffle_f32x4(r[c], r[4 + c], 0xdd);
    const __m512 s = _mm512_shuffle_f32x4(r[8 + c], r[12 + c], 0x88),
                 u = _mm512_shuffle_f32x4(r[8 + c], r[12 + c], 0xdd);
    l.f[c].v = _mm512_shuffle_f32x4(p, s, 0x88);
    l.f[8 + c].v = _mm512_shuffle_f32x4(p, s, 0xdd);
    l.f[4 + c].v = _mm512_shuffle_f32x4(q, u, 0x88);
    l.f[12 + c].v = _mm512_shuffle_f32x4(q, u, 0xdd);
  }
  return l;
}

// 8 rows of 16 doubles, turned.
inline void load_exact(const ExactTriangle* exact, const std::uint32_t* ids, D* f) {
  for (int h = 0; h < 2; ++h) {
    __m512d r[8], t[8];
    for (int i = 0; i < 8; ++i) r[i] = _mm512_load_pd(reinterpret_cast<const double*>(exact + ids[i]) + 8 * h);
    for (int i = 0; i < 8; i += 2) {
      t[i] = _mm512_unpacklo_pd(r[i], r[i + 1]);      // fields 0 2 4 6 of both rows
      t[i + 1] = _mm512_unpackhi_pd(r[i], r[i + 1]);  // fields 1 3 5 7
    }
    for (int o = 0; o < 2; ++o) {
      const __m512d p = _mm512_shuffle_f64x2(t[o], t[2 + o], 0x88), q = _mm512_shuffle_f64x2(t[o], t[2 + o], 0xdd);
      const __m512d s = _mm512_shuffle_f64x2(t[4 + o], t[6 + o], 0x88),
                    u = _mm512_shuffle_f64x2(t[4 + o], t[6 + o], 0xdd);
      f[8 * h + o].v = _mm512_shuffle_f64x2(p, s, 0x88);
      f[8 * h + 4 + o].v = _mm512_shuffle_f64x2(p, s, 0xdd);
      f[8 * h + 2 + o].v = _mm512_shuffle_f64x2(q, u, 0x88);
      f[8 * h + 6 + o].v = _mm512_shuffle_f64x2(q, u, 0xdd);
    }
  }
}

}  // namespace

const Kernel kAvx512{filter, measure_voxels, measure_block, closest, collect};

}  // namespace osteo::inline geometry::distance
#pragma GCC diagnostic pop
#endif
