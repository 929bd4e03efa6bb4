// The figures of an outcome in a case's report.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "texts.h"

namespace osteo::case_report {
namespace {

const char* const kOutcome = R"({"osteotome_outcome": 1,
 "fragments": [{"name": "back", "known": true, "reference": true},
  {"name": "front", "known": true, "reference": false,
   "shift_mm": [{"value": 1.254, "half_width_95": 0.04}, {"value": 0, "half_width_95": 0.05},
                {"value": -0.5, "half_width_95": 0.06}],
   "turn_deg": [{"value": 2, "half_width_95": 0.1}, {"value": 0, "half_width_95": 0.1},
                {"value": 0, "half_width_95": 0.1}]}],
 "cuts": [{"plane": "stays", "known": false, "why": "the face lies upon other bone"}],
 "contours": [{"against": "plan", "known": true, "mean_mm": {"value": 0.7, "half_width_95": 0.02},
   "p95_mm": {"value": 1.5, "half_width_95": 0.05}}],
 "condyles": [{"side": "right", "fragment": "back", "known": false, "why": "it is a part of the reference"}],
 "screws": [{"name": "1", "known": true}, {"name": "2", "known": false}]})";

std::vector<std::vector<sheet::Cell>> rows_of(const SheetBlocks& blocks) {
  std::vector<std::vector<sheet::Cell>> rows;
  for (const SheetBlock& b : blocks)
    if (const auto* const t = std::get_if<sheet::Table>(&b.is)) rows.insert(rows.end(), t->rows.begin(), t->rows.end());
  return rows;
}

TEST(OutcomeTable, HasEachFigureOrWhyItIsNotKnown) {
  const SheetBlocks blocks = outcome_blocks(kOutcome);
  const auto rows = rows_of(blocks);
  ASSERT_EQ(rows.size(), 5U);
  EXPECT_EQ(rows[1][0].text, "front");
  EXPECT_EQ(rows[1][1].text, "1.25 ± 0.04; 0 ± 0.05; -0.5 ± 0.06");
  EXPECT_EQ(rows[2][0].text, "right condyle");
  EXPECT_EQ(rows[2][1].text, "not known: it is a part of the reference");
  EXPECT_EQ(rows[2][1].tone, Tone::caution);
  EXPECT_EQ(rows[3][1].text, "not known: the face lies upon other bone");
  EXPECT_EQ(rows[4][0].text, "against the plan");
  EXPECT_EQ(rows[4][2].text, "1.5 ± 0.05");
  bool counted = false;
  for (const SheetBlock& b : blocks)
    if (const auto* const p = std::get_if<sheet::Paragraph>(&b.is))
      counted = counted || p->text == "Screws and holes: 1 of 2 are known.";
  EXPECT_TRUE(counted);
}

TEST(OutcomeTable, SaysThatAFileIsNoOutcome) {
  for (const char* const text : {"{\"osteotome_case\": 1}", "not JSON", "[]"}) {
    const SheetBlocks blocks = outcome_blocks(text);
    ASSERT_EQ(blocks.size(), 2U) << text;
    const auto* const p = std::get_if<sheet::Paragraph>(&blocks[1].is);
    ASSERT_TRUE(p);
    EXPECT_EQ(p->tone, Tone::caution);
  }
}

}  // namespace
}  // namespace osteo::case_report
