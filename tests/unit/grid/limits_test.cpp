// What a grid of bricks cannot hold is rejected, wherever it comes from.
#include <gtest/gtest.h>

#include <unistd.h>

#include <functional>

#include "folders.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/geometry/grid/brick_grid.h"
#include "osteo/geometry/grid/grid_io.h"
#include "osteo/geometry/grid/resample.h"
#include "osteo/geometry/grid/vdb.h"
#include "osteo/imaging/image/threshold.h"

namespace osteo {
namespace {

SparseGrid grid_of(const std::function<void(openvdb::FloatGrid&)>& fill) {
  grid::initialize_vdb();
  auto vdb = openvdb::FloatGrid::create(0.0F);
  fill(*vdb);
  const auto box = vdb->evalActiveVoxelBoundingBox();
  Frame f;
  for (int a = 0; a < 3; ++a) f.dims[static_cast<std::size_t>(a)] = box.max()[a] + 1;
  return grid::wrap(vdb, f, "density");
}

template <class F>
void expect_refused(ExitCode code, const std::string& word, F&& f) {
  try {
    f();
    ADD_FAILURE() << "taken, though: " << word;
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), code) << e.what();
    EXPECT_NE(std::string(e.what()).find(word), std::string::npos) << e.what();
    EXPECT_FALSE(e.advice().empty());
  }
}

static_assert(!too_many_bricks(BrickGrid::kMaxBricks) && too_many_bricks(BrickGrid::kMaxBricks + 1ULL));
// The last voxel of the last brick is not the name that stands for none.
static_assert((static_cast<std::uint64_t>(BrickGrid::kMaxBricks) - 1) * BrickGrid::kVoxels + BrickGrid::kVoxels - 1 <
              BrickGrid::kNone);
static_assert(!too_wide_for_bricks({512, 512, 512}) && too_wide_for_bricks({512, 512, 513}) &&
              too_wide_for_bricks({1ULL << 28, 1, 1}));
// Surfaces name a cell by 20 bits an axis.
static_assert(!too_wide_for_bricks({(1ULL << 17) - 1, 1, 1}) && too_wide_for_bricks({1, 1ULL << 17, 1}));
// Products that wrap around 64 bits.
static_assert(too_wide_for_bricks({1ULL << 22, 1ULL << 22, 1ULL << 22}) &&
              too_wide_for_bricks({1ULL << 32, 1ULL << 32, 1}));

TEST(VdbFile, VoxelsTooSmallForItAreRefusedInWords) {
  SparseGrid tiny = grid_of([](openvdb::FloatGrid& g) { g.tree().setValue({1, 1, 1}, 1.0F); });
  for (std::size_t a = 0; a < 3; ++a) tiny.frame.spacing_mm[a] = 1e-7;
  const auto path = fs::temp_directory_path() / ("osteo-tiny-" + std::to_string(::getpid()) + ".vdb");
  expect_refused(ExitCode::failed, "1e-07 mm", [&] { save_grid(tiny, path); });
  EXPECT_FALSE(fs::exists(path));
}

TEST(BrickLimits, BricksFarApartAreRefusedNotWrittenOutOfBounds) {
  for (const Ijk far : {Ijk{1 << 22, 1 << 22, 1 << 22}, Ijk{0, 1 << 27, 0}, Ijk{600, 600, 600}, Ijk{-1, 0, 0}})
    expect_refused(ExitCode::corrupt, far.i < 0 ? "negative" : "too far apart", [&] {
      BrickGrid({}, {{0, 0, 0}, far});
    });
  const BrickGrid far_but_thin({}, {{0, 0, 0}, {(1 << 17) - 2, 0, 0}});
  EXPECT_NE(far_but_thin.find((1 << 20) - 16 + 3, 1, 2), BrickGrid::kNone);
}

TEST(BrickLimits, AVoxelFarOutInAFile) {
  const auto at = [](int n) {
    return grid_of([n](openvdb::FloatGrid& g) {
      g.tree().setValueOn({1, 2, 3}, 1);
      g.tree().setValueOn({n, n, n}, 1);
    });
  };
  // As it lies in testdata, to the byte, for those who try the commands on it.
  const auto path = fs::temp_directory_path() / ("osteo-far-" + std::to_string(::getpid()) + ".vdb");
  save_grid(at(1 << 25), path);
  EXPECT_TRUE(read_text(path) == read_text(source_folder() / "testdata/far25.vdb"));
  expect_refused(ExitCode::corrupt, "more than can be counted", [&] { static_cast<void>(load_grid(path)); });
  fs::remove(path);
  expect_refused(ExitCode::corrupt, "too far apart", [&] { static_cast<void>(to_bricks(at(1 << 18))); });
  EXPECT_EQ(to_bricks(at(2000)).brick_count(), 2u);
}

// A few bytes in a file; as voxels 2 TB.
TEST(BrickLimits, ATileIsCountedBeforeItBecomesVoxels) {
  const auto solid = [](int edge) {
    return grid_of([edge](openvdb::FloatGrid& g) { g.sparseFill({{0, 0, 0}, {edge - 1, edge - 1, edge - 1}}, 1.0F); });
  };
  expect_refused(ExitCode::corrupt, "solid over 16777216 bricks", [&] { static_cast<void>(to_bricks(solid(2048))); });
  EXPECT_EQ(to_bricks(solid(128)).brick_count(), 4096u);
}

TEST(BrickLimits, ResampleSaysWhichVoxelsAreTooSmall) {
  Frame f;
  f.dims = {30, 30, 30};
  f.spacing_mm = {10, 10, 10};
  const auto v = make_voxels<std::int16_t>(f.voxel_count());
  std::fill_n(v.get(), f.voxel_count(), static_cast<std::int16_t>(1000));
  const Image ct{f, v};
  const Labels mask = threshold(ct, {});
  expect_refused(ExitCode::resources, "voxels of 0.1 mm make more than 8388607 bricks",
                 [&] { static_cast<void>(resample_bone(ct, mask, {.spacing_mm = 0.1, .lower = 300})); });
  expect_refused(ExitCode::resources, "voxels of 0.05 mm make a grid of more than",
                 [&] { static_cast<void>(resample_bone(ct, mask, {.spacing_mm = 0.05, .lower = 300})); });
}

}  // namespace
}  // namespace osteo
