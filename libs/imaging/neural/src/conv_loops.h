// Compiled by conv_base.cpp, conv_avx2.cpp and conv_avx512.cpp: OSTEO_ISA is the name, OSTEO_LANES the floats of a
// vector, OSTEO_TILE the outputs held in registers, OSTEO_PAIR whether two blocks are computed at once. No library that
// inlines may be included here: the compiler's flags differ between those files.
#pragma once
#include "osteo/imaging/neural/detail/conv_kernel.h"

namespace osteo::inline imaging {
namespace OSTEO_ISA {

typedef float Vector __attribute__((vector_size(OSTEO_LANES * 4)));  // NOLINT
inline constexpr int kVectors = kChannels / OSTEO_LANES;

inline Vector load(const float* p) {
  Vector v;
  __builtin_memcpy(&v, p, sizeof v);
  return v;
}
inline void store(float* p, Vector v) {
  __builtin_memcpy(p, &v, sizeof v);
}

// `kStep`: from output to output, where it is known when this is compiled; 0: as the row says.
template <int kTile, int kBlocks, int kStep>
void tile(const ConvRow& r, int first) {
  constexpr int kParts = kBlocks * kVectors;
  const std::ptrdiff_t step = kStep != 0 ? kStep : r.in_step;
  Vector sum[kTile][kParts];
#pragma GCC unroll 16
  for (int b = 0; b < kBlocks; ++b) {
#pragma GCC unroll 16
    for (int t = 0; t < kTile; ++t) {
      const float* const from = r.start[b] != nullptr ? r.start[b] : r.out[b] + (first + t) * r.out_step;
      for (int v = 0; v < kVectors; ++v) sum[t][b * kVectors + v] = load(from + v * OSTEO_LANES);
    }
  }
  const float* weights[kBlocks];
  for (int b = 0; b < kBlocks; ++b) weights[b] = r.weights[b];
  const float* const origin = r.in + first * step;
  for (int z = 0; z < r.kernel[0]; ++z) {
    for (int y = 0; y < r.kernel[1]; ++y) {
      for (int x = 0; x < r.kernel[2]; ++x) {
        const float* in = origin + z * r.in_plane + y * r.in_row + x * r.in_pixel;
        for (int c = 0; c < r.channels; ++c, ++in) {
          Vector w[kParts];
#pragma GCC unroll 16
          for (int b = 0; b < kBlocks; ++b) {
#pragma GCC unroll 16
            for (int v = 0; v < kVectors; ++v) w[b * kVectors + v] = load(weights[b] + v * OSTEO_LANES);
            weights[b] += kChannels;
          }
#pragma GCC unroll 16
          for (int t = 0; t < kTile; ++t) {
            const Vector value = in[t * step] - Vector{};
#pragma GCC unroll 16
            for (int p = 0; p < kParts; ++p) sum[t][p] += w[p] * value;
          }
        }
      }
    }
  }
#pragma GCC unroll 16
  for (int b = 0; b < kBlocks; ++b) {
#pragma GCC unroll 16
    for (int t = 0; t < kTile; ++t) {
      for (int v = 0; v < kVectors; ++v)
        store(r.out[b] + (first + t) * r.out_step + v * OSTEO_LANES, sum[t][b * kVectors + v]);
    }
  }
}

using Tile = void (*)(const ConvRow&, int);
constexpr int at_most(int n) {
  return n < OSTEO_TILE ? n : OSTEO_TILE;
}

// In tiles of about one size.
template <int kBlocks, int kStep>
void row_of(const ConvRow& r) {
  static constexpr Tile kTiles[] = {
      &tile<at_most(1), kBlocks, kStep>,  &tile<at_most(2), kBlocks, kStep>,  &tile<at_most(3), kBlocks, kStep>,
      &tile<at_most(4), kBlocks, kStep>,  &tile<at_most(5), kBlocks, kStep>,  &tile<at_most(6), kBlocks, kStep>,
      &tile<at_most(7), kBlocks, kStep>,  &tile<at_most(8), kBlocks, kStep>,  &tile<at_most(9), kBlocks, kStep>,
      &tile<at_most(10), kBlocks, kStep>, &tile<at_most(11), kBlocks, kStep>, &tile<at_most(12), kBlocks, kStep>};
  static_assert(OSTEO_TILE <= 12);
  const int parts = (r.width + OSTEO_TILE - 1) / OSTEO_TILE;
  for (int n = 0, at = 0; n < parts; ++n) {
    const int next = r.width * (n + 1) / parts;
    kTiles[next - at - 1](r, at);
    at = next;
  }
}

template <int kBlocks>
void row_by_step(const ConvRow& r) {
  switch (r.in_step) {
    case kChannels:
      return row_of<kBlocks, kChannels>(r);
    case 2 * kChannels:
      return row_of<kBlocks, 2 * kChannels>(r);
    case 1:
      return row_of<kBlocks, 1>(r);
    default:
      return row_of<kBlocks, 0>(r);
  }
}

inline void row(const ConvRow& r) {
  if (r.weights[1] == nullptr) return row_by_step<1>(r);
#if OSTEO_PAIR
  row_by_step<2>(r);
#else
  ConvRow one = r;
  for (int b = 0; b < 2; ++b) {
    one.weights[0] = r.weights[b];
    one.out[0] = r.out[b];
    one.start[0] = r.start[b];
    row_by_step<1>(one);
  }
#endif
}

inline void sum(const float* values, int pixels, const float* mean, double* sums) {
  float total[kChannels] = {};
  if (mean == nullptr) {
    for (int i = 0; i < pixels; ++i) {
      for (int c = 0; c < kChannels; ++c) total[c] += values[i * kChannels + c];
    }
  } else {
    for (int i = 0; i < pixels; ++i) {
      for (int c = 0; c < kChannels; ++c) {
        const float d = values[i * kChannels + c] - mean[c];
        total[c] += d * d;
      }
    }
  }
  for (int c = 0; c < kChannels; ++c) sums[c] += static_cast<double>(total[c]);
}

inline void scale(float* values, int pixels, const float* by, const float* shift, const float* add, float slope) {
  for (int i = 0; i < pixels; ++i) {
    for (int c = 0; c < kChannels; ++c) {
      float v = values[i * kChannels + c] * by[c] + shift[c];
      if (add != nullptr) v += add[i * kChannels + c];
      values[i * kChannels + c] = v > 0 ? v : v * slope;
    }
  }
}

}  // namespace OSTEO_ISA
}  // namespace osteo::inline imaging
