#include "osteo/geometry/grid/brick_grid.h"

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <new>
#include <tuple>

#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/parallel.h"

namespace osteo::inline geometry {
namespace {

// Large ones are the system's own zeros, which take no memory until they are written.
std::shared_ptr<float[]> zeros(std::size_t bricks) {
  const std::size_t n = std::max<std::size_t>(bricks, 1) * BrickGrid::kVoxels;
  auto* const values = static_cast<float*>(std::calloc(n, sizeof(float)));
  if (values == nullptr) throw std::bad_alloc();
  return {values, [](float* p) { std::free(p); }};
}

std::vector<std::shared_ptr<float>> in_a_block(const std::shared_ptr<float[]>& block, std::size_t count) {
  std::vector<std::shared_ptr<float>> bricks;
  bricks.reserve(count);
  for (std::size_t b = 0; b < count; ++b) bricks.emplace_back(block, block.get() + b * BrickGrid::kVoxels);
  return bricks;
}

// Of a brick that another thread may write.
void copy_brick(float* from, float* to) {
  for (int v = 0; v < BrickGrid::kVoxels; ++v) to[v] = std::atomic_ref<float>(from[v]).load(std::memory_order_relaxed);
}

}  // namespace

BrickGrid::BrickGrid(Frame frame, std::vector<Ijk> bricks) : frame_(frame), origins_(std::move(bricks)) {
  std::sort(origins_.begin(), origins_.end(),
            [](Ijk a, Ijk b) { return std::tie(a.k, a.j, a.i) < std::tie(b.k, b.j, b.i); });
  if (too_many_bricks(origins_.size()))
    throw Error(ExitCode::corrupt,
                "the sparse grid has " + std::to_string(origins_.size()) + " bricks of 8^3 voxels; " +
                    std::to_string(kMaxBricks) + " can be numbered",
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
                "single voxels far from the rest are mostly a fault of the program that wrote it; make it again, or of "
                "a smaller region");
  table_.assign(static_cast<std::size_t>(extent_[0]) * extent_[1] * extent_[2], kNone);
  for (std::uint32_t n = 0; n < origins_.size(); ++n) {
    const Ijk b = origins_[n];
    table_[(static_cast<std::size_t>(b.k) * extent_[1] + static_cast<std::size_t>(b.j)) * extent_[0] +
           static_cast<std::size_t>(b.i)] = n;
  }
  bricks_ = in_a_block(zeros(origins_.size()), origins_.size());
}

BrickGrid BrickGrid::dense(const Frame& frame) {
  std::vector<Ijk> bricks;
  for (int k = 0; k < frame.dims[2]; k += kEdge)
    for (int j = 0; j < frame.dims[1]; j += kEdge)
      for (int i = 0; i < frame.dims[0]; i += kEdge) bricks.push_back({i / kEdge, j / kEdge, k / kEdge});
  return {frame, std::move(bricks)};
}

BrickGrid::BrickGrid(const BrickGrid& other)
    : frame_(other.frame_),
      extent_(other.extent_),
      table_(other.table_),
      origins_(other.origins_),
      bricks_(
          in_a_block(std::make_shared_for_overwrite<float[]>(other.origins_.size() * kVoxels), other.origins_.size())) {
  parallel_for(origins_.size(), 2048, 0, [&](std::size_t begin, std::size_t end) {
    for (std::size_t b = begin; b < end; ++b) copy_brick(other.bricks_[b].get(), bricks_[b].get());
  });
}

BrickGrid BrickGrid::sharing() const {
  BrickGrid g;
  g.frame_ = frame_;
  g.extent_ = extent_;
  g.table_ = table_;
  g.origins_ = origins_;
  g.bricks_ = bricks_;
  return g;
}

void BrickGrid::own_brick(std::uint32_t brick) {
  const auto own = std::make_shared_for_overwrite<float[]>(kVoxels);
  copy_brick(bricks_[brick].get(), own.get());
  bricks_[brick] = std::shared_ptr<float>(own, own.get());
}

void BrickGrid::empty_bricks(std::span<const std::uint32_t> bricks) {
  const auto block = in_a_block(zeros(bricks.size()), bricks.size());
  for (std::size_t b = 0; b < bricks.size(); ++b) bricks_[bricks[b]] = block[b];
}

void BrickGrid::read_block(Ijk lo, std::array<int, 3> n, float* out) const {
  for (int k = 0; k < n[2]; ++k) {
    for (int j = 0; j < n[1]; ++j) {
      float* const row =
          out + (static_cast<std::size_t>(k) * static_cast<std::size_t>(n[1]) + static_cast<std::size_t>(j)) *
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
  for (std::size_t v = 0; v < origins_.size() * kVoxels; ++v)
    total += static_cast<double>(value(static_cast<VoxelKey>(v)));
  return total;
}

std::size_t BrickGrid::memory_bytes() const {
  return origins_.size() * (kVoxels * sizeof(float) + sizeof(Ijk) + sizeof(bricks_[0])) +
         table_.size() * sizeof(std::uint32_t);
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

}  // namespace osteo::inline geometry
