// Values that Python's libraries gave: testdata/statistics, made by tests/bench/statistics_reference.py.
#pragma once
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "folders.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/json_document.h"

namespace osteo::statistics {

inline Json reference(const std::string& name) {
  return Json::parse(read_text(source_folder().string() + "/testdata/statistics/" + name + ".json")).value();
}
inline double number(const Json& j) {
  return j.number().value_or(std::nan(""));
}
inline double number(const Json& j, std::string_view key) {
  return number(*j.find(key));
}
inline std::vector<double> numbers(const Json& j) {
  std::vector<double> v;
  for (const Json& item : j.items()) v.push_back(number(item));
  return v;
}
inline std::vector<double> numbers(const Json& j, std::string_view key) {
  return numbers(*j.find(key));
}
inline std::vector<int> wholes(const Json& j, std::string_view key) {
  std::vector<int> v;
  for (const double d : numbers(j, key)) v.push_back(static_cast<int>(d));
  return v;
}
/// To 1e-9 of itself, and of 1 where it is smaller.
inline void expect_same(double value, double expected, const char* what = "") {
  EXPECT_NEAR(value, expected, 1e-9 * std::max(1.0, std::abs(expected))) << what;
}
inline void expect_same(const std::vector<double>& value, const std::vector<double>& expected, const char* what = "") {
  ASSERT_EQ(value.size(), expected.size()) << what;
  for (std::size_t i = 0; i < value.size(); ++i) expect_same(value[i], expected[i], what);
}

}  // namespace osteo::statistics
