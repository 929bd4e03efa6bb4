// Expected Dice against numbers by hand, and what is said of structures that nobody should trust.
#include <gtest/gtest.h>

#include <cmath>

#include "folders.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/imaging/neural/detail/half.h"
#include "osteo/imaging/neural/detail/trust.h"

namespace osteo {
namespace {

NetworkModel two_structures() {
  NetworkModel model;
  model.values = {0, 1, 2};
  model.names = {{1, "facial nerve"}, {2, "ossicles"}};
  return model;
}

// 4 planes of 5 x 6 voxels of 2 mm3. The first plane is nerve by `nerve`, everything else background by ten.
NetworkLogits first_plane(double nerve) {
  NetworkLogits l;
  l.size = l.cropped = {4, 5, 6};
  l.grid_mm = {2, 1, 1};
  l.values.assign(std::size_t{3} * 120, half_from_double(-10));
  for (std::size_t v = 0; v < 120; ++v) l.values[v] = half_from_double(v < 30 ? 0 : 10);
  for (std::size_t v = 0; v < 30; ++v) l.values[120 + v] = half_from_double(nerve);
  return l;
}

NetworkCalibration plausible(double temperature) {
  NetworkCalibration c;
  c.temperature = temperature;
  c.structures = {{1, "facial nerve", 40, 80, 0.5}, {2, "ossicles", 10, 80, 0.5}};
  return c;
}

TEST(NetworkTrust, ExpectedDiceIsTheFormulas) {
  for (const double temperature : {1.0, 2.0, 4.0}) {
    const auto rows = trust_in(first_plane(1.5), two_structures(), plausible(temperature), {});
    const double p = std::exp(1.5 / temperature) / (std::exp(1.5 / temperature) + 1 + std::exp(-10 / temperature)),
                 rest = std::exp(-20 / temperature) / (1 + 2 * std::exp(-20 / temperature));
    ASSERT_EQ(rows.size(), 2U);
    EXPECT_EQ(rows[0].name, "facial nerve");
    EXPECT_DOUBLE_EQ(rows[0].volume_mm3, 60);
    EXPECT_NEAR(rows[0].expected_dice, 2 * 30 * p / (30 + 30 * p + 90 * rest), 1e-12) << temperature;
    EXPECT_EQ(rows[0].doubt, "") << temperature;
    EXPECT_EQ(rows[1].doubt, "not found");
    EXPECT_EQ(rows[1].expected_dice, 0);
  }
}

TEST(NetworkTrust, WhatIsImplausibleIsSaid) {
  NetworkCalibration c = plausible(1);
  c.structures[0].least_mm3 = 61;
  EXPECT_EQ(trust_in(first_plane(1.5), two_structures(), c, {})[0].doubt, "60 mm3, less than 61");
  c.structures[0] = {1, "facial nerve", 10, 59, 0.95};
  EXPECT_EQ(trust_in(first_plane(1.5), two_structures(), c, {})[0].doubt,
            "60 mm3, more than 59; expected Dice 0.9, below 0.95");
}

TEST(NetworkTrust, SameBitsForAnyNumberOfThreads) {
  NetworkLogits l = first_plane(0.3);
  for (std::size_t v = 0; v < l.values.size(); ++v)
    l.values[v] = half_from_double(std::sin(static_cast<double>(v * v)) * 3);
  std::vector<double> first;
  for (const int threads : {1, 2, 5}) {
    Context context;
    context.threads = threads;
    std::vector<double> got;
    for (const auto& row : trust_in(l, two_structures(), plausible(1.3), context)) got.push_back(row.expected_dice);
    if (first.empty()) first = got;
    EXPECT_EQ(got, first) << threads;
  }
}

TEST(NetworkTrust, TheShippedCalibrationIsOfTheShippedNetwork) {
  const fs::path folder = source_folder() / "testdata/neural/ear";
  const NetworkModel model =
      read_network_model(read_text(folder / "plans.json"), read_text(folder / "dataset.json"), "3d_fullres");
  const NetworkCalibration c = read_network_calibration(read_text(folder / "calibration.json"), model);
  ASSERT_EQ(c.structures.size(), 9U);
  for (const StructureCalibration& s : c.structures) EXPECT_GE(s.boundary_mm.size(), 2U) << s.name;
}

TEST(NetworkTrust, DamagedCalibrationsAreRefused) {
  const std::string good =
      R"({"osteotome_calibration": 1, "temperature": 1.5, "structures": [{"value": 2, "least_mm3": 3, "most_mm3": 9, "least_dice": 0.4}]})";
  const NetworkCalibration c = read_network_calibration(good, two_structures());
  EXPECT_EQ(c.temperature, 1.5);
  ASSERT_EQ(c.structures.size(), 1U);
  EXPECT_EQ(c.structures[0].name, "ossicles");
  EXPECT_EQ(c.structures[0].most_mm3, 9);
  for (const auto& [from, to] : {std::pair{"1.5", "0"},
                                 {"1.5", "\"1\""},
                                 {"\"value\": 2", "\"value\": 7"},
                                 {"\"most_mm3\": 9", "\"most_mm3\": 2"},
                                 {"0.4", "1.4"},
                                 {"structures", "others"},
                                 {"_calibration\": 1", "_calibration\": 2"},
                                 {"}]}", "}]"}}) {
    std::string text = good;
    text.replace(text.find(from), std::string(from).size(), to);
    EXPECT_THROW(static_cast<void>(read_network_calibration(text, two_structures())), Error) << text;
  }
  const auto with_table = [&](const std::string& table) {
    std::string text = good;
    return text.replace(text.find("}]}"), 1, ", \"boundary_mm\": " + table + "}");
  };
  const auto rows = read_network_calibration(with_table("[[0.6, 0.3], [2, 0.3], [6, 9]]"), two_structures());
  EXPECT_EQ(rows.structures[0].boundary_mm.size(), 3U);
  for (const char* const table : {"[]", "[[1]]", "[[1, 2], [1, 3]]", "[[2, 1], [1, 3]]", "[[1, 3], [2, 1]]",
                                  "[[-1, 3]]", "[[1, \"3\"]]", "[1, 3]"})
    EXPECT_THROW(static_cast<void>(read_network_calibration(with_table(table), two_structures())), Error) << table;
}

}  // namespace
}  // namespace osteo
