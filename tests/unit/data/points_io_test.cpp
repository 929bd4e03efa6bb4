#include "osteo/core/data/points_io.h"

#include <gtest/gtest.h>

#include <fstream>

#include "osteo/core/base/error.h"
#include "scratch.h"

namespace osteo {
namespace {

struct Points : testing::Test {
  test::ScratchFolder at;
  std::vector<Vec3> read(const std::string& name, const std::string& text) const {
    std::ofstream(at / name) << text;
    return load_points(at / name);
  }
};

TEST_F(Points, OfAnyTable) {
  const auto p = read("p.csv", "x,y,z\n1,2,-3,label\n# said\n\n4; 5e1\t6\r\n");
  ASSERT_EQ(p.size(), 2U);
  EXPECT_EQ(p[0], (Vec3{1, 2, -3}));
  EXPECT_EQ(p[1], (Vec3{4, 50, 6}));
}

// 3D Slicer's begin with an identifier, which newer versions make a plain number, and say where they point.
TEST_F(Points, OfSlicerInItsCoordinates) {
  const std::string rows = "# columns = id,x,y,z,ow\nvtkMRMLMarkupsFiducialNode_0,1,2,3,0\n2,4,5,6,0\n";
  for (const char* lps : {"LPS", "1", "LPS\r"}) {
    const auto p = read("p.fcsv", std::string("# CoordinateSystem = ") + lps + "\n" + rows);
    ASSERT_EQ(p.size(), 2U);
    EXPECT_EQ(p[0], (Vec3{1, 2, 3})) << lps;
    EXPECT_EQ(p[1], (Vec3{4, 5, 6})) << lps;
  }
  for (const char* ras : {"# CoordinateSystem = RAS\n", "# CoordinateSystem = 0\n", ""}) {
    const auto p = read("p.FCSV", ras + rows);
    ASSERT_EQ(p.size(), 2U);
    EXPECT_EQ(p[1], (Vec3{-4, -5, 6})) << ras;
  }
  EXPECT_THROW(static_cast<void>(read("p.fcsv", "# CoordinateSystem = IJK\n" + rows)), Error);
  EXPECT_THROW(static_cast<void>(read("p.fcsv", "# CoordinateSystem = LPS\nalone\n")), Error);
  EXPECT_THROW(static_cast<void>(read("p.fcsv", "# CoordinateSystem = LPS\n7,1,2\n")), Error);
}

}  // namespace
}  // namespace osteo
