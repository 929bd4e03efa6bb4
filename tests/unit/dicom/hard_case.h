// What the tests of the hard list share: the straight series in parts, imports that are rejected.
#pragma once
#include <gtest/gtest.h>

#include <string>
#include <string_view>
#include <vector>

#include "edit.h"
#include "osteo/imaging/dicom/import.h"
#include "osteo/imaging/dicom/volume.h"
#include "reference.h"

namespace osteo::test {

inline std::vector<fs::path> slices(int begin, int end) {
  const auto& all = straight_series();
  return {all.begin() + begin, all.begin() + end};
}

inline Imported load(const fs::path& folder, ImportParams params = {}) {
  return import_ct(folder, params);
}

// Rejected with this code; what() names the file or says why.
inline Verdict refusal(const fs::path& folder, std::string_view code, const std::string& said = {},
                       ImportParams params = {}) {
  try {
    static_cast<void>(import_ct(folder, params));
  } catch (const Refused& e) {
    EXPECT_TRUE(e.verdict().refused());
    EXPECT_TRUE(e.verdict().has(code)) << e.what();
    EXPECT_NE(std::string(e.what()).find(said), std::string::npos) << e.what();
    return e.verdict();
  } catch (const Error& e) {
    ADD_FAILURE() << "another error: " << e.what();
    return {};
  }
  ADD_FAILURE() << "not refused";
  return {};
}

inline const SliceGap& only_gap(const Verdict& v) {
  static const SliceGap none;
  EXPECT_EQ(v.gaps.size(), 1u);
  return v.gaps.empty() ? none : v.gaps.front();
}

#define NEEDS(folder) \
  if (!fs::exists(folder)) GTEST_SKIP() << "no " << (folder)

}  // namespace osteo::test
