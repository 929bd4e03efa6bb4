#include "osteo/imaging/edit/bit_mask.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <functional>

#include "osteo/core/base/parallel.h"

namespace osteo::inline imaging {
namespace {

constexpr std::size_t kRowGrain = 256;

// Eight bytes of 0 or 1 to eight bits.
std::uint64_t pack8(const std::uint8_t* flags) {
  std::uint64_t x = 0;
  std::memcpy(&x, flags, 8);
  return (x * 0x0102040810204080ULL) >> 56;
}

std::uint64_t pack64(const std::uint8_t* flags) {
  std::uint64_t w = 0;
  for (int b = 0; b < 8; ++b) w |= pack8(flags + 8 * b) << (8 * b);
  return w;
}

// Values are whole: a range of numbers is one of values, or none.
struct Range {
  int lo, hi;
};
Range whole_range(double lower_hu, double upper_hu) {
  return {static_cast<int>(std::ceil(std::clamp(lower_hu, -40000.0, 40000.0))),
          static_cast<int>(std::floor(std::clamp(upper_hu, -40000.0, 40000.0)))};
}

void mark_range(const std::int16_t* in, std::size_t n, Range range, std::uint8_t* flags) {
  if (range.lo > 32767 || range.hi < -32768 || range.lo > range.hi) {
    std::memset(flags, 0, n);
    return;
  }
  const auto lo = static_cast<std::int16_t>(std::max(range.lo, -32768)),
             hi = static_cast<std::int16_t>(std::min(range.hi, 32767));
  for (std::size_t i = 0; i < n; ++i) flags[i] = static_cast<std::uint8_t>((in[i] >= lo) & (in[i] <= hi));
}

}  // namespace

BitMask::BitMask(std::array<int, 3> dims)
    : dims_(dims), words_per_row_((static_cast<std::size_t>(dims[0]) + 63) / 64), words_(words_per_row_ * rows()) {}

BitMask::BitMask(std::array<int, 3> dims, std::span<const std::uint8_t> bytes, int threads) : BitMask(dims) {
  const auto nx = static_cast<std::size_t>(dims[0]);
  parallel_for(rows(), kRowGrain, threads, [&](std::size_t begin, std::size_t end) {
    std::uint8_t flags[64];
    for (std::size_t r = begin; r < end; ++r) {
      for (std::size_t w = 0; w < words_per_row_; ++w) {
        const std::size_t n = std::min<std::size_t>(64, nx - w * 64);
        std::memset(flags, 0, sizeof flags);
        const std::uint8_t* const in = bytes.data() + r * nx + w * 64;
        for (std::size_t i = 0; i < n; ++i) flags[i] = static_cast<std::uint8_t>(in[i] != 0);
        words_[r * words_per_row_ + w] = pack64(flags);
      }
    }
  });
}

BitMask::BitMask(const Image& ct, double lower_hu, double upper_hu, int threads) : BitMask(ct.frame.dims) {
  const auto nx = static_cast<std::size_t>(dims_[0]);
  const Range range = whole_range(lower_hu, upper_hu);
  parallel_for(rows(), kRowGrain, threads, [&](std::size_t begin, std::size_t end) {
    std::uint8_t flags[64];
    for (std::size_t r = begin; r < end; ++r) {
      for (std::size_t w = 0; w < words_per_row_; ++w) {
        const std::size_t n = std::min<std::size_t>(64, nx - w * 64);
        if (n < 64) std::memset(flags, 0, sizeof flags);
        mark_range(ct.voxels.get() + r * nx + w * 64, n, range, flags);
        words_[r * words_per_row_ + w] = pack64(flags);
      }
    }
  });
}

void BitMask::set(std::size_t row_number, int begin, int end, bool value) {
  const std::span<std::uint64_t> w = row(row_number);
  for (std::size_t n = static_cast<std::size_t>(begin) / 64; n < w.size() && static_cast<int>(n) * 64 < end; ++n) {
    const std::uint64_t bits = bits_of_word(n, begin, end);
    w[n] = value ? w[n] | bits : w[n] & ~bits;
  }
}

std::uint64_t BitMask::count(int threads) const {
  constexpr std::size_t grain = std::size_t{1} << 16;
  std::vector<std::uint64_t> sums((words_.size() + grain - 1) / grain);
  parallel_for(words_.size(), grain, threads, [&](std::size_t begin, std::size_t end) {
    std::uint64_t n = 0;
    for (std::size_t w = begin; w < end; ++w) n += static_cast<std::uint64_t>(std::popcount(words_[w]));
    sums[begin / grain] = n;
  });
  std::uint64_t all = 0;
  for (const std::uint64_t s : sums) all += s;
  return all;
}

std::vector<Run> BitMask::runs(bool value) const {
  std::vector<Run> runs;
  const auto nx = static_cast<std::uint32_t>(dims_[0]);
  const std::uint64_t flip = value ? 0 : ~std::uint64_t{0};
  for (std::size_t r = 0; r < rows(); ++r) {
    const std::uint64_t* const words = words_.data() + r * words_per_row_;
    // The next voxel from x on that is wanted (or not): nx when there is none.
    const auto next = [&](std::uint32_t x, std::uint64_t inverted) {
      while (x < nx) {
        const std::uint64_t rest = ((words[x / 64] ^ flip) ^ inverted) >> (x % 64);
        if (rest != 0) return std::min(nx, x + static_cast<std::uint32_t>(std::countr_zero(rest)));
        x = (x / 64 + 1) * 64;
      }
      return nx;
    };
    for (std::uint32_t x = next(0, 0); x < nx;) {
      const std::uint32_t end = next(x, ~std::uint64_t{0});
      runs.push_back({x, end, static_cast<std::uint32_t>(r)});
      x = next(end, 0);
    }
  }
  return runs;
}

void BitMask::to_bytes(std::uint8_t* out, int threads) const {
  const auto nx = static_cast<std::size_t>(dims_[0]);
  parallel_for(rows(), kRowGrain, threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t r = begin; r < end; ++r) {
      for (std::size_t i = 0; i < nx; ++i)
        out[r * nx + i] = static_cast<std::uint8_t>(words_[r * words_per_row_ + i / 64] >> (i % 64) & 1);
    }
  });
}

std::vector<std::uint8_t> BitMask::bytes(int threads) const {
  std::vector<std::uint8_t> out(rows() * static_cast<std::size_t>(dims_[0]));
  to_bytes(out.data(), threads);
  return out;
}

namespace {

// How many voxels go together along each axis.
std::array<int, 3> factors(const Frame& frame, std::size_t most) {
  double edge = std::max({frame.spacing_mm.x, frame.spacing_mm.y, frame.spacing_mm.z});
  for (;; edge *= 1.02) {
    std::array<int, 3> f{};
    std::size_t cells = 1;
    for (std::size_t a = 0; a < 3; ++a) {
      f[a] = std::max(1, static_cast<int>(std::lround(edge / frame.spacing_mm[a])));
      cells *= static_cast<std::size_t>((frame.dims[a] + f[a] - 1) / f[a]);
    }
    if (cells <= most) return f;
  }
}

// `count_row` adds to each coarse voxel of a row how many of a row of fine ones are set.
CoarseMask gather(const Frame& frame, std::size_t most, int threads,
                  const std::function<void(std::size_t row, int factor, std::vector<std::uint32_t>& sums)>& count_row) {
  const std::array<int, 3> f = factors(frame, std::max<std::size_t>(most, 1));
  CoarseMask c;
  c.frame = frame;
  for (std::size_t a = 0; a < 3; ++a) {
    c.frame.dims[a] = (frame.dims[a] + f[a] - 1) / f[a];
    c.frame.spacing_mm[a] = frame.spacing_mm[a] * f[a];
  }
  c.frame.origin_mm = frame.world_from_index({(f[0] - 1) / 2.0, (f[1] - 1) / 2.0, (f[2] - 1) / 2.0});
  c.filled.resize(c.frame.voxel_count());
  const auto nx = static_cast<std::size_t>(c.frame.dims[0]), ny = static_cast<std::size_t>(c.frame.dims[1]);
  const float scale = 1.0F / static_cast<float>(f[0] * f[1] * f[2]);
  parallel_for(static_cast<std::size_t>(c.frame.dims[2]), 1, threads, [&](std::size_t begin, std::size_t end) {
    std::vector<std::uint32_t> sums(nx);
    for (std::size_t z = begin; z < end; ++z) {
      for (std::size_t y = 0; y < ny; ++y) {
        std::fill(sums.begin(), sums.end(), 0U);
        for (int k = static_cast<int>(z) * f[2]; k < std::min(frame.dims[2], (static_cast<int>(z) + 1) * f[2]); ++k) {
          for (int j = static_cast<int>(y) * f[1]; j < std::min(frame.dims[1], (static_cast<int>(y) + 1) * f[1]); ++j)
            count_row(
                static_cast<std::size_t>(k) * static_cast<std::size_t>(frame.dims[1]) + static_cast<std::size_t>(j),
                f[0], sums);
        }
        for (std::size_t x = 0; x < nx; ++x) c.filled[(z * ny + y) * nx + x] = static_cast<float>(sums[x]) * scale;
      }
    }
  });
  return c;
}

}  // namespace

CoarseMask coarse(const BitMask& mask, const Frame& frame, std::size_t most, int threads) {
  return gather(frame, most, threads, [&](std::size_t r, int factor, std::vector<std::uint32_t>& sums) {
    const std::span<const std::uint64_t> words = mask.row(r);
    for (std::size_t w = 0; w < words.size(); ++w) {
      // Set bits come in runs: each is added to the cells that it reaches into.
      std::uint64_t rest = words[w];
      while (rest != 0) {
        const int from = std::countr_zero(rest), n = std::countr_one(rest >> from);
        for (int i = static_cast<int>(w) * 64 + from, end = i + n; i < end;) {
          const int cell = i / factor, stop = std::min(end, (cell + 1) * factor);
          sums[static_cast<std::size_t>(cell)] += static_cast<std::uint32_t>(stop - i);
          i = stop;
        }
        rest = from + n == 64 ? 0 : rest & ~((std::uint64_t{1} << (from + n)) - 1);
      }
    }
  });
}

CoarseMask coarse(const Image& ct, double lower_hu, double upper_hu, std::size_t most, int threads) {
  return coarse(BitMask(ct, lower_hu, upper_hu, threads), ct.frame, most, threads);
}

}  // namespace osteo::inline imaging
