#include "osteo/imaging/bone_import/import_bone.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "osteo/core/base/error.h"
#include "osteo/imaging/dicom/save_series.h"
#include "scratch.h"

namespace osteo {
namespace {

TEST(ImportBone, RefusesVoxelsTooSmallBeforeItTakesMemory) {
  const test::ScratchFolder folder;
  Frame f;
  f.dims = {16, 16, 10};
  f.spacing_mm = {50, 50, 5};
  const auto v = make_voxels<std::int16_t>(f.voxel_count());
  std::fill_n(v.get(), f.voxel_count(), static_cast<std::int16_t>(1000));
  save_dicom_series({f, v}, folder / "ct");
  try {
    static_cast<void>(import_bone(folder / "ct", {.source = {}, .lower = 300, .spacing_mm = 0.05}));
    ADD_FAILURE() << "taken";
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::resources) << e.what();
    EXPECT_NE(std::string(e.what()).find("voxels of 0.05 mm make a grid of more than"), std::string::npos) << e.what();
    EXPECT_FALSE(e.advice().empty());
  }
}

}  // namespace
}  // namespace osteo
