// Durations of ticks, counted in buckets a tenth of an octave wide: quantiles within 7 %, no allocation.
#pragma once
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace osteo {

class Histogram {
 public:
  void add(std::int64_t ns) noexcept {
    const std::uint64_t v = static_cast<std::uint64_t>(std::max<std::int64_t>(ns, 0));
    ++buckets_[bucket(v)];
    ++count_;
    max_ = std::max(max_, v);
  }
  [[nodiscard]] std::uint64_t count() const { return count_; }
  [[nodiscard]] double max_us() const { return static_cast<double>(max_) / 1000; }
  /// Upper bound of the bucket that holds the quantile, at most the maximum.
  [[nodiscard]] double quantile_us(double q) const {
    const auto wanted = static_cast<std::uint64_t>(std::ceil(q * static_cast<double>(count_)));
    std::uint64_t seen = 0;
    for (std::size_t b = 0; b < buckets_.size(); ++b) {
      seen += buckets_[b];
      if (seen >= wanted && seen > 0) return std::min(static_cast<double>(upper(b)), static_cast<double>(max_)) / 1000;
    }
    return max_us();
  }

 private:
  static constexpr std::size_t kSub = 8;  // buckets an octave
  static std::size_t bucket(std::uint64_t v) {
    if (v < kSub) return v;
    const auto octave = static_cast<std::size_t>(std::bit_width(v)) - 4;  // v >> octave is 8..15
    return std::min<std::size_t>((octave + 1) * kSub + (v >> octave) - kSub, kBuckets - 1);
  }
  static std::uint64_t upper(std::size_t b) {
    if (b < kSub) return b;
    const std::size_t octave = b / kSub - 1;
    return ((b % kSub + kSub + 1) << octave) - 1;
  }
  static constexpr std::size_t kBuckets = 48 * kSub;
  std::array<std::uint64_t, kBuckets> buckets_{};
  std::uint64_t count_ = 0, max_ = 0;
};

}  // namespace osteo
