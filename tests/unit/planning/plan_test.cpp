// The file of a plan: there and back to the last bit, and what it does not accept.
#include <gtest/gtest.h>

#include "osteo/core/base/error.h"
#include "osteo/session/planning/detail/plan.h"

namespace osteo {
namespace {

SurgicalPlan example() {
  SurgicalPlan plan;
  plan.planes = {{"a", "mandible", {1.0 / 3, -2, 1e-17}, normalized({1, 2, 3}), 0.7, true},
                 {"b", "fibula", {0.1, 0.2, 0.3}, normalized({-3, 0.1, 1}), 1, false}};
  plan.fragments = {{"chin", "mandible", {"a"}, {}},
                    {"segment 1", "fibula", {"b"}, rotation_about({5, 6, 7}, normalized({1, -1, 0.3}), 0.9)}};
  return plan;
}

std::string with(const std::string& what, const std::string& instead) {
  std::string text = plan_json(example());
  const auto at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return text.replace(at, what.size(), instead);
}

void expect_error(const std::string& text, const std::string& words) {
  try {
    static_cast<void>(plan_of(text, "p.json"));
    ADD_FAILURE() << "accepted: " << words;
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::usage);
    EXPECT_NE(std::string(e.what()).find(words), std::string::npos) << e.what();
    EXPECT_NE(std::string(e.what()).find("p.json"), std::string::npos) << e.what();
  }
}

TEST(Plan, ThereAndBackToTheBit) {
  const SurgicalPlan plan = example();
  const std::string text = plan_json(plan);
  const SurgicalPlan back = plan_of(text, "p.json");
  EXPECT_EQ(back.planes, plan.planes);
  ASSERT_EQ(back.fragments.size(), 2U);
  for (std::size_t n = 0; n < 2; ++n) {
    EXPECT_EQ(back.fragments[n].name, plan.fragments[n].name);
    EXPECT_EQ(back.fragments[n].planes, plan.fragments[n].planes);
    EXPECT_EQ(back.fragments[n].planned_from_ct.rotation, plan.fragments[n].planned_from_ct.rotation);
    EXPECT_EQ(back.fragments[n].planned_from_ct.shift_mm, plan.fragments[n].planned_from_ct.shift_mm);
  }
  EXPECT_EQ(plan_json(back), text);
  EXPECT_EQ(text.find("target"), std::string::npos);  // as files had it before there were others
  EXPECT_EQ(text.find("down"), std::string::npos);
  SurgicalPlan own = plan;
  own.target = ReconstructionTarget::own;
  own.down = normalized({0.1, -0.2, -1});
  const SurgicalPlan read = plan_of(plan_json(own), "p.json");
  EXPECT_EQ(read.target, own.target);
  EXPECT_EQ(read.down, own.down);
  EXPECT_EQ(back.plane("b").bone, "fibula");
  EXPECT_THROW(static_cast<void>(back.plane("c")), Error);
}

TEST(Plan, WhatIsWrongIsNamed) {
  expect_error(with("\"unit\"", "\"target\": \"other\", \"unit\""), "target");
  expect_error(with("\"unit\"", "\"down\": [0, 0, -2], \"unit\""), "down");
  expect_error(with("\"mm\"", "\"cm\""), "unit");
  expect_error(with("osteotome_surgical_plan\": 1", "osteotome_surgical_plan\": 2"), "osteotome_surgical_plan");
  expect_error(with("\"waste_ahead\": true", "\"waste_ahead\": 1"), "waste_ahead");
  expect_error(with("\"kerf_mm\": 0.7", "\"kerf_mm\": -0.7"), "kerf_mm");
  expect_error(with("\"kerf_mm\": 0.7", "\"kerf\": 0.7"), "kerf");
  expect_error(with("\"kerf_mm\": 0.7,", ""), "kerf_mm");
  expect_error(with("\"name\": \"b\"", "\"name\": \"a\""), "another \"a\"");
  expect_error(with("\"name\": \"a\"", "\"name\": \"z\""), "no plane is called \"a\"");
  expect_error(with("\"bone\": \"fibula\"", "\"bone\": \"ulna\""), "not the fibula");
}

TEST(Plan, HoldsScrewsWhereThereAreAny) {
  SurgicalPlan plan = example();
  EXPECT_EQ(plan_json(plan).find("screws"), std::string::npos) << "files without them stay as they were";
  plan.screws = {{"1", "chin", {1.0 / 3, 2, 3}, {1, 2, 11}, 2.4, false}, {"2", "segment 1", {}, {0, 6, 0}, 2, true}};
  const std::string text = plan_json(plan);
  EXPECT_EQ(plan_of(text, "p.json").screws, plan.screws);
  EXPECT_EQ(plan_json(plan_of(text, "p.json")), text);
  const auto changed = [&](const std::string& what, const std::string& instead) {
    std::string s = text;
    const auto at = s.find(what, s.find("\"screws\""));
    EXPECT_NE(at, std::string::npos) << what;
    return s.replace(at, what.size(), instead);
  };
  expect_error(changed("\"fragment\": \"chin\"", "\"fragment\": \"nose\""), "no fragment is called \"nose\"");
  expect_error(changed("\"name\": \"2\"", "\"name\": \"1\""), "another \"1\"");
  expect_error(changed("\"diameter_mm\": 2.4", "\"diameter_mm\": 24"), "diameter_mm");
  expect_error(changed("\"empty\": false", "\"empty\": 0"), "empty");
  expect_error(changed("\"empty\"", "\"hole\""), "hole");
  plan.screws[1].tip_mm = plan.screws[1].entry_mm;
  EXPECT_THROW(static_cast<void>(plan_json(plan)), Error) << "of no length";
}

TEST(Plan, IsNotWrittenWhereItCouldNotBeRead) {
  SurgicalPlan plan = example();
  plan.planes[0].normal = {1, 1, 0};
  EXPECT_THROW(static_cast<void>(plan_json(plan)), Error);
  plan = example();
  plan.fragments[1].planned_from_ct.rotation.column[0] = -plan.fragments[1].planned_from_ct.rotation.column[0];
  EXPECT_THROW(static_cast<void>(plan_json(plan)), Error) << "a mirror image";
  plan = example();
  plan.fragments[1].planned_from_ct.rotation.column[0] = {1, 0, 0};
  EXPECT_THROW(static_cast<void>(plan_json(plan)), Error) << "sheared";
}

}  // namespace
}  // namespace osteo
