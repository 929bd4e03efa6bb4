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

// As Slicer 5 saves points, a line or a curve.
TEST_F(Points, OfSlicerAsItSavesThemNow) {
  const auto list = [](const std::string& head, const std::string& points) {
    return "{\"@schema\": \"markups-schema-v1.0.3.json#\", \"markups\": [{\"type\": \"Curve\", " + head +
           "\"controlPoints\": [" + points + "]}]}";
  };
  const std::string two =
      "{\"id\": \"1\", \"label\": \"F, 1\", \"position\": [1, 2.5, -3e1], \"positionStatus\": \"defined\"},"
      "{\"id\": \"2\", \"position\": [0, 0, 0], \"positionStatus\": \"undefined\"},"
      "{\"id\": \"3\", \"position\": [4, 5, 6]}";
  for (const char* const lps : {"\"coordinateSystem\": \"LPS\", \"coordinateUnits\": \"mm\",", ""})
    EXPECT_EQ(read("F.mrk.json", list(lps, two)), (std::vector<Vec3>{{1, 2.5, -30}, {4, 5, 6}}));
  EXPECT_EQ(read("F.MRK.JSON", list("\"coordinateSystem\": \"RAS\",", two)),
            (std::vector<Vec3>{{-1, -2.5, -30}, {-4, -5, 6}}));
  const auto refused = [&](const std::string& text) {
    try {
      static_cast<void>(read("F.mrk.json", text));
    } catch (const Error& e) {
      return std::string(e.what());
    }
    return std::string("taken");
  };
  EXPECT_NE(refused(list("\"coordinateSystem\": \"IJK\",", two)).find("coordinates 'IJK'"), std::string::npos);
  EXPECT_NE(refused(list("\"coordinateUnits\": \"um\",", two)).find("in 'um', not in mm"), std::string::npos);
  EXPECT_NE(refused(list("", "{\"position\": [1, 2]}")).find("three finite numbers"), std::string::npos);
  EXPECT_NE(refused(list("", "{\"position\": [1, null, 2]}")).find("three finite numbers"), std::string::npos);
  EXPECT_NE(refused(list("", "")).find("holds no points"), std::string::npos);
  EXPECT_NE(refused("{\"markups\": [{}, {}]}").find("2 lists"), std::string::npos);
  for (const char* const other : {"{\"a\": 1}", "[1, 2, 3]", "1,2,3\n", "{\"markups\": []}"})
    EXPECT_NE(refused(other).find("no list of points"), std::string::npos) << other;
}

}  // namespace
}  // namespace osteo
