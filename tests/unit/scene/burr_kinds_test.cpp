// Kinds of burrs: one row says all that differs between them.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <regex>
#include <set>
#include <sstream>

#include "folders.h"
#include "osteo/simulation/bone/burr.h"
#include "osteo/simulation/bone/instrument.h"
#include "osteo/simulation/haptics/vibration.h"

namespace osteo {
namespace {

namespace fs = std::filesystem;

// A test of the kind anywhere else is what a further kind falls into unseen.
TEST(BurrKinds, AreNotComparedOutsideTheirTable) {
  const std::regex compared(
      R"([=!]=\s*BurrKind::|BurrKind::\w+\s*([=!]=|\?)|case\s+BurrKind::|using enum BurrKind|\{BurrKind::\w+,\s*BurrKind::)");
  int files = 0;
  for (const char* const top : {"libs", "apps"}) {
    for (const fs::directory_entry& e : fs::recursive_directory_iterator(source_folder() / top)) {
      if (e.path().extension() != ".h" && e.path().extension() != ".cpp") continue;
      if (e.path().filename() == "burr_kind.h") continue;
      std::ifstream file(e.path());
      std::string line;
      for (int n = 1; std::getline(file, line); ++n) {
        if (line.find("BurrKind") != line.npos) {
          EXPECT_FALSE(std::regex_search(line, compared)) << e.path() << ":" << n << ": " << line;
        }
      }
      ++files;
    }
  }
  EXPECT_GT(files, 500);
}

TEST(BurrKinds, EachRowIsWhole) {
  std::set<std::string_view> names;
  std::set<char> keys;
  for (std::size_t n = 0; n < kBurrKinds.size(); ++n) {
    const BurrKindRow& row = kBurrKinds[n];
    const auto kind = static_cast<BurrKind>(n);
    EXPECT_TRUE(names.insert(row.name).second) << row.name;
    EXPECT_EQ(row.name.data()[row.name.size()], '\0');
    EXPECT_TRUE(keys.insert(row.key).second && row.key >= 'A' && row.key <= 'Z') << row.name;
    EXPECT_EQ(&row_of(kind), &row);
    EXPECT_EQ(EnumNames<BurrKind>::values[n], row.name);
    EXPECT_GT(row.heat_by_work + row.heat_by_force, 0) << row.name << " heats nothing";
    EXPECT_TRUE(row.sound_teeth_share >= 0 && row.sound_teeth_share < 1) << row.name;
    EXPECT_FALSE(default_vibration().by_kind[n].empty()) << row.name;
    for (const BurrShape shape : {BurrShape::ball, BurrShape::cylinder, BurrShape::taper}) {
      for (int d = 1; d <= 7; ++d) {
        const Burr& burr = burr_library()[static_cast<std::size_t>(burr_index(kind, d, shape))];
        EXPECT_EQ(burr.rate_mm3_per_s_per_n, row.rate_mm3_per_s_per_n * d / 4);
        EXPECT_EQ(burr.falloff_mm3_per_s_per_n_per_rad, row.falloff_mm3_per_s_per_n_per_rad * d / 4);
        EXPECT_EQ(instrument_of(static_cast<std::uint8_t>(instrument_index(burr.name()))).as_burr()->kind, kind);
      }
    }
  }
}

// What sessions of before the table were recorded with.
TEST(BurrKinds, CuttingAndDiamondRemoveWhatTheyDid) {
  const Burr& cutting = burr_library()[static_cast<std::size_t>(burr_index(BurrKind::cutting, 3))];
  const Burr& diamond = burr_library()[static_cast<std::size_t>(burr_index(BurrKind::diamond, 3))];
  EXPECT_EQ(cutting.rate_mm3_per_s_per_n, 4.5);
  EXPECT_EQ(cutting.falloff_mm3_per_s_per_n_per_rad, 2.25);
  EXPECT_EQ(diamond.rate_mm3_per_s_per_n, 1.5);
  EXPECT_EQ(diamond.falloff_mm3_per_s_per_n_per_rad, 0.3 * 3 / 4);
  EXPECT_EQ(burr_index(BurrKind::diamond, 1), 7);
  EXPECT_EQ(burr_index(BurrKind::cutting, 1, BurrShape::taper), 28);
}

}  // namespace
}  // namespace osteo
