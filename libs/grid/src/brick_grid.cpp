#include "osteo/grid/brick_grid.h"

#include <algorithm>
#include <cstring>
#include <tuple>

#include "osteo/base/error.h"
#include "osteo/base/files.h"
#include "osteo/base/parallel.h"

namespace osteo {

BrickGrid::BrickGrid(Frame frame, std::vector<Ijk> bricks) : frame_(frame), origins_(std::move(bricks)) {
  std::sort(origins_.begin(), origins_.end(), [](Ijk a, Ijk b) { return std::tie(a.k, a.j, a.i) < std::tie(b.k, b.j, b.i); });
  if (too_many_bricks(origins_.size()))
    throw Error(ExitCode::corrupt,
                "the sparse grid has " + std::to_string(origins_.size()) + " bricks of 8^3 voxels; " + std::to_string(kMostBricks) +
                    " can be numbered",
                "make it with larger voxels, or of a smaller region");
  for (const Ijk b : origins_) {
    if (b.i < 0 || b.j < 0 || b.k < 0)
      throw Error(ExitCode::corrupt, "the sparse grid has voxels at negative indices",
                  "bone begins at index 0; make it again with resample");
    extent_[0] = std::max(extent_[0], static_cast<std::uint32_t>(b.i + 1));
    extent_[1] = std::max(extent_[1], static_cast<std::uint32_t>(b.j + 1));
    extent_[2] = std::max(extent_[2], static_cast<std::uint32_t>(b.k + 1));
  }
  if (too_wide_for_bricks({extent_[0], extent_[1], extent_[2]}))
    throw Error(ExitCode::corrupt,
                "the sparse grid's voxels lie too far apart: within " + std::to_string(8ULL * extent_[0]) + " x " +
                    std::to_string(8ULL * extent_[1]) + " x " + std::to_string(8ULL * extent_[2]) + " voxels",
                "single voxels far from the rest are mostly a fault of the program that wrote it; make it again, or of a smaller region");
  table_.assign(static_cast<std::size_t>(extent_[0]) * extent_[1] * extent_[2], kNone);
  for (std::uint32_t n = 0; n < origins_.size(); ++n) {
    const Ijk b = origins_[n];
    table_[(static_cast<std::size_t>(b.k) * extent_[1] + static_cast<std::size_t>(b.j)) * extent_[0] + static_cast<std::size_t>(b.i)] = n;
  }
  values_ = std::make_unique<float[]>(origins_.size() * kVoxels);
}

BrickGrid::BrickGrid(const BrickGrid& other)
    : frame_(other.frame_),
      extent_(other.extent_),
      table_(other.table_),
      origins_(other.origins_),
      values_(std::make_unique_for_overwrite<float[]>(other.origins_.size() * kVoxels)) {
  parallel_for(origins_.size(), 2048, 0, [&](std::size_t begin, std::size_t end) {
    for (std::size_t v = begin * kVoxels; v < end * kVoxels; ++v) values_[v] = other.value(static_cast<VoxelKey>(v));
  });
}

void BrickGrid::read_block(Ijk lo, std::array<int, 3> n, float* out) const {
  for (int k = 0; k < n[2]; ++k) {
    for (int j = 0; j < n[1]; ++j) {
      float* const row = out + (static_cast<std::size_t>(k) * static_cast<std::size_t>(n[1]) + static_cast<std::size_t>(j)) *
                                   static_cast<std::size_t>(n[0]);
      for (int i = 0; i < n[0];) {
        // One table look-up for each brick that the row crosses.
        const int x = lo.i + i, y = lo.j + j, z = lo.k + k;
        const int run = std::min(n[0] - i, kEdge - (x & 7));
        const std::uint32_t b = find_brick(x >> 3, y >> 3, z >> 3);
        if (b == kNone) {
          std::fill_n(row + i, run, 0.0F);
        } else {
          const VoxelKey key = b * kVoxels + offset_in_brick(x, y, z);
          for (int r = 0; r < run; ++r) row[i + r] = value(key + static_cast<std::uint32_t>(r));
        }
        i += run;
      }
    }
  }
}

double BrickGrid::sum() const {
  double total = 0;
  for (std::size_t v = 0; v < origins_.size() * kVoxels; ++v) total += static_cast<double>(value(static_cast<VoxelKey>(v)));
  return total;
}

std::size_t BrickGrid::memory_bytes() const {
  return origins_.size() * (kVoxels * sizeof(float) + sizeof(Ijk)) + table_.size() * sizeof(std::uint32_t);
}

std::string BrickGrid::hash() const {
  Hasher h;
  h.add(&frame_.spacing_mm, sizeof frame_.spacing_mm);
  h.add(&frame_.origin_mm, sizeof frame_.origin_mm);
  h.add(&frame_.direction, sizeof frame_.direction);
  std::array<float, kVoxels> brick{};
  for (std::uint32_t b = 0; b < origins_.size(); ++b) {
    for (std::uint32_t v = 0; v < kVoxels; ++v) brick[v] = value(b * kVoxels + v);
    h.add(&origins_[b], sizeof(Ijk));
    h.add(brick.data(), sizeof brick);
  }
  return h.hex();
}

}  // namespace osteo
