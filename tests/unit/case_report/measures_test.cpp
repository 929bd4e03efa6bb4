// What is measured of structures and of thin bone, against shapes whose sizes are known.
#include "measures.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <functional>
#include <limits>
#include <numbers>
#include <regex>

#include "osteo/assessment/case_report/case_report.h"
#include "osteo/core/base/files.h"
#include "osteo/geometry/mesh/bone_surface.h"
#include "pictures.h"
#include "texts.h"

namespace osteo::case_report {
namespace {

Labels draw(std::array<int, 3> dims, double spacing, const std::function<int(Vec3)>& label) {
  Labels l;
  l.frame.dims = dims;
  l.frame.spacing_mm = {spacing, spacing, spacing};
  const auto voxels = make_voxels<std::uint8_t>(l.frame.voxel_count());
  std::size_t at = 0;
  for (int k = 0; k < dims[2]; ++k) {
    for (int j = 0; j < dims[1]; ++j) {
      for (int i = 0; i < dims[0]; ++i)
        voxels[at++] = static_cast<std::uint8_t>(label(l.frame.world_from_index({double(i), double(j), double(k)})));
    }
  }
  l.voxels = voxels;
  return l;
}

// What drew them says how far their boundaries may be off: distances carry it, and what is not to be trusted stands
// out.
TEST(Structures, CarryWhatIsKnownOfTheirBoundaries) {
  StructureMeasure nerve, canal, hand;
  nerve.structure = {1, "nervus", {}, "segment-network, version 3", 0.6};
  canal.structure = {2, "meatus", {}, "segment-network, version 3", 0.3};
  hand.structure = {3, "antrum", {}, "by hand"};
  nerve.gaps = {{2, 1.25}, {3, 2}};
  canal.gaps = {{1, 1.25}};
  const auto near = [](const StructureMeasure& a, const StructureMeasure& b, const StructureMeasure& c) {
    return structure_table({a, b, c}).rows[0][4].text;
  };
  const auto last = [](const StructureMeasure& m) { return structure_table({m}).rows[0].back(); };
  EXPECT_EQ(near(nerve, canal, hand), "meatus 1.3 ± 0.7 mm; antrum 2 mm");
  EXPECT_EQ(last(nerve).text, "boundary within 0.6 mm");
  EXPECT_EQ(last(hand).text, "");
  canal.structure.within_mm = std::numeric_limits<double>::infinity();
  EXPECT_EQ(near(nerve, canal, hand), "meatus 1.3 ± ? mm; antrum 2 mm");
  EXPECT_EQ(last(canal).text, "boundary uncertain");
  EXPECT_EQ(last(canal).tone, Tone::caution);
  canal.structure.doubt = "60 mm3, less than 83";
  EXPECT_EQ(last(canal).text, "not to be trusted: 60 mm3, less than 83");
  EXPECT_EQ(last(canal).tone, Tone::caution);
}

TEST(Structures, VolumePiecesAndGapsOfBalls) {
  Labels l = draw({100, 60, 60}, 0.5, [](Vec3 p) {
    if (length(p - Vec3{10, 15, 15}) < 5) return 1;
    if (length(p - Vec3{30, 15, 15}) < 5) return 2;
    if (length(p - Vec3{45, 15, 15}) < 2) return 2;
    return p == Vec3{2, 2, 2} ? 2 : 0;
  });
  l.structures = {{1, "one", {}}, {2, "two", {}}};
  const auto m = measure_structures(l, {});
  ASSERT_EQ(m.size(), 2U);
  EXPECT_NEAR(m[0].volume_mm3, 4.0 / 3 * std::numbers::pi * 125, 15);
  EXPECT_EQ(m[0].parts, 1);
  EXPECT_EQ(m[1].parts, 2);
  EXPECT_EQ(m[1].specks, 1);
  ASSERT_EQ(m[0].gaps.size(), 1U);
  EXPECT_EQ(m[0].gaps[0].other, 2);
  EXPECT_NEAR(m[0].gaps[0].mm, 10, 0.6);
  EXPECT_NEAR(length(m[0].middle_mm - Vec3{10, 15, 15}), 0, 0.5);
}

TEST(Structures, LengthAlongABentTube) {
  // Half a ring of radius 12 mm, 1.4 mm thick, with straight ends of 5 mm: 47.7 mm and its round ends.
  const auto tube = [](Vec3 p) {
    const Vec3 c{15, 10, 6};
    const double dx = p.x - c.x, dy = p.y - c.y, dz = p.z - c.z;
    const double ring = dy >= 0    ? std::hypot(std::hypot(dx, dy) - 12, dz)
                        : dy >= -5 ? std::hypot(std::abs(dx) - 12, dz)
                                   : 1e9;
    return ring < 0.7 ? 6 : 0;
  };
  Labels l = draw({120, 120, 50}, 0.25, tube);
  l.structures = {{6, "facial nerve", {}}};
  const auto m = measure_structures(l, {});
  ASSERT_EQ(m.size(), 1U);
  const double truth = 12 * std::numbers::pi + 10;
  EXPECT_GT(m[0].length_mm, 0.97 * truth);
  EXPECT_LT(m[0].length_mm, 1.08 * truth);
  const Plausibility p = plausibility_of(m[0]);
  EXPECT_TRUE(p.known && p.fits) << p.doubt;
  // The same in two pieces.
  Labels cut = draw({120, 120, 50}, 0.25, [&](Vec3 at) { return std::abs(at.x - 15) < 2 ? 0 : tube(at); });
  cut.structures = l.structures;
  const auto two = measure_structures(cut, {});
  const Plausibility doubt = plausibility_of(two[0]);
  EXPECT_FALSE(doubt.fits);
  EXPECT_NE(doubt.doubt.find("in 2 fragments"), std::string::npos);
}

TEST(Structures, OnlyKnownNamesAreJudged) {
  StructureMeasure m;
  m.structure.name = "tumour";
  m.volume_mm3 = 1e6;
  EXPECT_FALSE(plausibility_of(m).known);
  m.structure.name = "Sigmoid Sinus (left)";
  EXPECT_TRUE(plausibility_of(m).known);
  EXPECT_NE(plausibility_of(m).doubt.find("large"), std::string::npos);
  m.volume_mm3 = 1e4;
  m.parts = 2;
  EXPECT_FALSE(plausibility_of(m).fits);
  m.lo_mm = {-60, 0, 0};
  m.hi_mm = {60, 30, 30};
  EXPECT_TRUE(plausibility_of(m).fits);  // one each side
}

TEST(ThinBone, OfAShell) {
  // 3 mm between two spheres.
  Frame f;
  f.dims = {80, 80, 80};
  f.spacing_mm = {0.5, 0.5, 0.5};
  BrickGrid bone = BrickGrid::dense(f);
  for (VoxelKey key = 0; key < bone.brick_count() * BrickGrid::kVoxels; ++key) {
    const Ijk c = bone.coordinate(key);
    const double r = length(Vec3{c.i * 0.5, c.j * 0.5, c.k * 0.5} - Vec3{20, 20, 20});
    bone.set(key, static_cast<float>(std::clamp(0.5 + std::min(r - 12, 15 - r) / 0.5, 0.0, 1.0)));
  }
  TriMesh mesh = surface_nets(bone, 0.5F, {}).mesh;
  ASSERT_EQ(mesh.normals.size(), mesh.points_mm.size());
  const auto below = thickness_below(mesh, bone, 5, {});
  std::size_t far = 0;
  double mean = 0;
  for (const float t : below) {
    mean += static_cast<double>(t) / static_cast<double>(below.size());
    far += std::abs(static_cast<double>(t) - 3) > 0.35 ? 1 : 0;
  }
  EXPECT_NEAR(mean, 3, 0.1);
  EXPECT_LT(far, below.size() / 50);
  const auto [lo, hi] = bounds_of_bone(bone);
  EXPECT_NEAR(lo.x, 5, 0.5);
  EXPECT_NEAR(hi.z, 35, 0.5);
}

TEST(Words, DigitsThatMeanSomething) {
  EXPECT_EQ(volume_text(573217.8), "573 cm³");
  EXPECT_EQ(volume_text(12345), "12.3 cm³");
  EXPECT_EQ(volume_text(1234), "1.23 cm³");
  EXPECT_EQ(volume_text(412.7), "413 mm³");
  EXPECT_EQ(number_text(0.48828119999999997, 2), "0.49");
}

TEST(CaseCode, IsShortSpeakableAndOfTheScan) {
  const TemporaryFolder at;
  const auto code = [&](const std::string& source) {
    std::ofstream(at.path() / "manifest.json") << R"({"osteotome_case": 1, "recipe": {"source_hash": ")" + source +
                                                      R"("}, "files": {"bone": {"file": "b", "hash": "77"}}})";
    return case_code(at.path());
  };
  const std::string one = code("0123456789abcdef");
  EXPECT_TRUE(std::regex_match(
      one,
      std::regex("([bdfghjklmnprstvz][aiou]){2}[bdfghjklmnprstvz]-([bdfghjklmnprstvz][aiou]){2}[bdfghjklmnprstvz]")))
      << one;
  EXPECT_EQ(one, code("0123456789abcdef"));
  EXPECT_NE(one, code("0123456789abcdee"));
  std::ofstream(at.path() / "manifest.json")
      << R"({"osteotome_case": 1, "files": {"bone": {"file": "b", "hash": "77"}}})";
  EXPECT_FALSE(case_code(at.path()).empty());  // an old case: by its bone
}

TEST(Words, OfACaseThatSaysLittle) {
  const TemporaryFolder at;
  std::ofstream(at.path() / "manifest.json") << R"({"osteotome_case": 1})";
  const CaseFacts facts(at.path());
  EXPECT_EQ(verdict_band(facts).word, "Not known");
  EXPECT_TRUE(resolution_table(facts).rows.empty());
  EXPECT_FALSE(removed_rows(facts).empty());
  EXPECT_TRUE(verdict_notes(facts).empty());
}

// Green only where nothing is left to look at.
TEST(Words, TheBandIsGoodOnlyWhereNothingIsLeftToLookAt) {
  const TemporaryFolder at;
  const auto band = [&](const std::string& report, const std::string& verdict) {
    std::ofstream(at.path() / "manifest.json")
        << R"({"osteotome_case": 1, "steps": [{"stage": "threshold", "report": {)" + report + "}}]}";
    std::ofstream(at.path() / "import.json") << verdict;
    return verdict_band(CaseFacts(at.path())).word;
  };
  const std::string good = R"({"status": "good", "source": "DICOM", "findings": []})";
  EXPECT_EQ(band("", good), "Good");
  EXPECT_EQ(band(R"("outside_body_left_mm3": 0.0)", good), "Good");
  EXPECT_EQ(band(R"("outside_body_left_mm3": 400.0)", good), "Good");  // a nose, teeth
  EXPECT_EQ(band(R"("outside_body_left_mm3": 120000.0)", good), "Look");
  const std::string finding = R"({"code": "SLICE_BLANK", "severity": "warning", "message": "a slice shows nothing"})";
  EXPECT_EQ(
      band(
          "",
          R"({"status": "repaired", "source": "DICOM", "set_aside": [], "geometry": {"resampled": false}, "findings": [)" +
              finding + "]}"),
      "Look");
  EXPECT_EQ(
      band(
          "",
          R"({"status": "repaired", "source": "DICOM", "set_aside": [], "geometry": {"resampled": true}, "findings": [)" +
              finding + "]}"),
      "Repaired");
}

TEST(Words, ResolutionGoesByTheCoarsestEdge) {
  const TemporaryFolder at;
  std::ofstream(at.path() / "manifest.json") << R"({"osteotome_case": 1})";
  std::ofstream(at.path() / "import.json") << R"({"status": "good", "output": {"spacing_mm": [0.3, 0.3, 0.6]}})";
  const sheet::Table t = resolution_table(CaseFacts(at.path()));
  ASSERT_EQ(t.rows.size(), 4U);
  EXPECT_EQ(t.rows[1][0].text, "facial canal");  // 1.3 mm at 0.6 mm slices
  EXPECT_EQ(t.rows[1][2].text, "2.2 to 4.3");
  EXPECT_EQ(t.rows[1][3].tone, Tone::good);
  EXPECT_EQ(t.rows[2][3].tone, Tone::caution);
  EXPECT_EQ(t.rows[3][3].tone, Tone::bad);
}

TEST(Words, ResolutionIsThatOfTheSlicesNotOfTheVoxelsMadeOfThem) {
  const TemporaryFolder at;
  std::ofstream(at.path() / "manifest.json") << R"({"osteotome_case": 1})";
  std::ofstream(at.path() / "import.json")
      << R"({"status": "repaired", "source": "DICOM", "series": {"thickness_mm": 4},
    "geometry": {"gap_max_mm": 7, "resampled": true}, "output": {"spacing_mm": [0.5, 0.5, 0.5]}})";
  const CaseFacts facts(at.path());
  const sheet::Table t = resolution_table(facts);
  ASSERT_EQ(t.rows.size(), 4U);
  EXPECT_EQ(t.rows[1][2].text, "0.2 to 2.6");
  for (const auto& row : t.rows) EXPECT_EQ(row[3].tone, Tone::bad) << row[0].text;
}

}  // namespace
}  // namespace osteo::case_report
