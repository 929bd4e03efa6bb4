// A volume by other means: slices read by DCMTK, interpolated one point at a time.
#pragma once
#include <cmath>
#include <random>

#include "edit.h"
#include "osteo/core/data/volume.h"

namespace osteo::test {

// Every slice read by DCMTK, for a reference that shares no code with the reader.
struct Reference {
  struct Slice {
    Vec3 position, u, v;
    double du, dv, slope = 1, intercept = 0;
    int columns, rows;
    std::vector<double> hu;
    double along;
  };
  std::vector<Slice> slices;
  Vec3 normal;

  explicit Reference(const fs::path& folder) {
    for (const auto& f : files_in(folder)) {
      DcmFileFormat file;
      if (file.loadFile(f.c_str()).bad()) continue;
      DcmDataset& d = *file.getDataset();
      Uint16 rows = 0, columns = 0, is_signed = 0;
      if (d.findAndGetUint16(DCM_Rows, rows).bad() || !d.tagExists(DCM_ImagePositionPatient)) continue;
      d.findAndGetUint16(DCM_Columns, columns);
      d.findAndGetUint16(DCM_PixelRepresentation, is_signed);
      Slice s;
      s.columns = columns;
      s.rows = rows;
      s.position = position_of(d);
      for (unsigned a = 0; a < 3; ++a) {
        d.findAndGetFloat64(DCM_ImageOrientationPatient, s.u[a], a);
        d.findAndGetFloat64(DCM_ImageOrientationPatient, s.v[a], a + 3);
      }
      d.findAndGetFloat64(DCM_PixelSpacing, s.dv, 0);
      d.findAndGetFloat64(DCM_PixelSpacing, s.du, 1);
      d.findAndGetFloat64(DCM_RescaleSlope, s.slope);
      d.findAndGetFloat64(DCM_RescaleIntercept, s.intercept);
      const Uint16* pixels = nullptr;
      if (d.findAndGetUint16Array(DCM_PixelData, pixels).bad()) continue;
      for (int i = 0; i < rows * columns; ++i) {
        s.hu.push_back(s.slope * (is_signed ? static_cast<std::int16_t>(pixels[i]) : static_cast<int>(pixels[i])) +
                       s.intercept);
      }
      slices.push_back(std::move(s));
    }
    normal = cross(slices.front().u, slices.front().v);
    for (Slice& s : slices) s.along = dot(s.position, normal);
    std::sort(slices.begin(), slices.end(), [](const Slice& a, const Slice& b) { return a.along < b.along; });
  }

  // HU at a point, linear in the slices and between them; NaN near padding or the border.
  [[nodiscard]] double at(Vec3 x) const {
    const double along = dot(x, normal);
    for (std::size_t k = 0; k + 1 < slices.size(); ++k) {
      if (along < slices[k].along || along > slices[k + 1].along) continue;
      const double t = (along - slices[k].along) / (slices[k + 1].along - slices[k].along);
      return (1 - t) * in_slice(slices[k], x) + t * in_slice(slices[k + 1], x);
    }
    return NAN;
  }

 private:
  static double in_slice(const Slice& s, Vec3 x) {
    const double i = dot(x - s.position, s.u) / s.du, j = dot(x - s.position, s.v) / s.dv;
    const int i0 = static_cast<int>(std::floor(i)), j0 = static_cast<int>(std::floor(j));
    if (i0 < 0 || j0 < 0 || i0 + 1 >= s.columns || j0 + 1 >= s.rows) return NAN;
    double sum = 0;
    for (int c = 0; c < 4; ++c) {
      const double hu = s.hu[static_cast<std::size_t>((j0 + (c >> 1)) * s.columns + i0 + (c & 1))];
      if (hu < -1024) return NAN;
      sum += hu * ((c & 1) != 0 ? i - i0 : 1 - (i - i0)) * ((c >> 1) != 0 ? j - j0 : 1 - (j - j0));
    }
    return sum;
  }
};

// The volume against the reference at random voxels. One HU is rounding; a place wrong by 0.01 mm shows at bone's
// edges.
inline void expect_every_slice_in_its_place(const Image& image, const fs::path& folder) {
  const Reference reference(folder);
  std::mt19937 random(7);
  int compared = 0, bone = 0;
  for (int n = 0; n < 60000; ++n) {
    const int i = static_cast<int>(random() % image.frame.dims[0]),
              j = static_cast<int>(random() % image.frame.dims[1]),
              k = static_cast<int>(random() % image.frame.dims[2]);
    const double wanted = reference.at(image.frame.world_from_index({double(i), double(j), double(k)}));
    if (std::isnan(wanted)) continue;
    ++compared;
    bone += wanted > 300;
    ASSERT_NEAR(image.at(i, j, k), wanted, 1.0) << i << ' ' << j << ' ' << k;
  }
  EXPECT_GT(compared, 5000);
  EXPECT_GT(bone, 100);
}

}  // namespace osteo::test
