// The figures of an outcome in a case's report.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "osteo/core/base/translate.h"
#include "texts.h"

namespace osteo::case_report {
namespace {

const char* const kOutcome = R"({"osteotome_outcome": 1,
 "fragments": [{"name": "back", "known": true, "reference": true},
  {"name": "front", "known": true, "reference": false,
   "shift_mm": [{"value": 1.254, "half_width_95": 0.04}, {"value": 0, "half_width_95": 0.05},
                {"value": -0.5, "half_width_95": 0.06}],
   "turn_deg": [{"value": 2, "half_width_95": 0.1}, {"value": 0, "half_width_95": 0.1},
                {"value": 0, "half_width_95": 0.1}]},
  {"name": "segment 1", "known": true, "reference": false, "slides_along": [0, 0, 1],
   "shift_mm": [{"value": 0, "half_width_95": 0.04}], "turn_deg": [{"value": 0, "half_width_95": 0.1}]}],
 "cuts": [{"plane": "stays", "fragment": "back", "known": false, "why": "the face lies upon other bone"}],
 "contours": [{"against": "plan", "known": true, "mean_mm": {"value": 0.7, "half_width_95": 0.02},
   "p95_mm": {"value": 1.5, "half_width_95": 0.05}}],
 "condyles": [{"side": "left", "fragment": "segment 1", "known": true, "slides_along": [0, 0, 1],
   "shift_mm": [{"value": 0, "half_width_95": 0.04}], "turn_deg": [{"value": 0, "half_width_95": 0.1}]},
  {"side": "right", "fragment": "back", "known": false, "why": "it is a part of the reference"}],
 "screws": [{"name": "1", "known": true, "finding": "it lies far off"}, {"name": "2", "known": false}],
 "plates": [{"name": "bar", "against": "front", "known": true, "slides_along": [0, 1, 0],
   "shift_mm": [{"value": 0.2, "half_width_95": 0.01}], "turn_deg": [{"value": 1, "half_width_95": 0.1}]},
  {"name": "bar", "against": "back", "known": false, "why": "that fragment is not found"}]})";

std::vector<std::vector<sheet::Cell>> rows_of(const SheetBlocks& blocks) {
  std::vector<std::vector<sheet::Cell>> rows;
  for (const SheetBlock& b : blocks)
    if (const auto* const t = std::get_if<sheet::Table>(&b.is)) rows.insert(rows.end(), t->rows.begin(), t->rows.end());
  return rows;
}

bool says(const SheetBlocks& blocks, const std::string& words) {
  bool found = false;
  for (const SheetBlock& b : blocks)
    if (const auto* const p = std::get_if<sheet::Paragraph>(&b.is))
      found = found || p->text.find(words) != std::string::npos;
  return found;
}

TEST(OutcomeTable, HasEachFigureOrWhyItIsNotKnown) {
  const SheetBlocks blocks = outcome_blocks(kOutcome);
  const auto rows = rows_of(blocks);
  ASSERT_EQ(rows.size(), 9U);
  EXPECT_EQ(rows[1][0].text, "front");
  EXPECT_EQ(rows[1][1].text, "1.25 ± 0.04; 0 ± 0.05; -0.5 ± 0.06");
  EXPECT_EQ(rows[2][0].text, "segment 1 (not known along itself)");
  EXPECT_EQ(rows[3][0].text, "left condyle (not known along its fragment)");
  EXPECT_EQ(rows[4][0].text, "right condyle");  // of the reference: said as of the reference itself
  EXPECT_EQ(rows[4][1].text, rows[0][1].text);
  EXPECT_EQ(rows[4][1].tone, Tone::quiet);
  EXPECT_EQ(rows[5][0].text, "stays (back)");
  EXPECT_EQ(rows[5][1].text, "not known: the face lies upon other bone");
  EXPECT_EQ(rows[5][1].tone, Tone::caution);
  EXPECT_EQ(rows[6][0].text, "against the plan");
  EXPECT_EQ(rows[6][2].text, "1.5 ± 0.05");
  EXPECT_EQ(rows[7][0].text, "bar against front (not known along itself)");
  EXPECT_EQ(rows[7][2].text, "1 ± 0.1");
  EXPECT_EQ(rows[8][1].text, "not known: that fragment is not found");
  EXPECT_TRUE(says(blocks, "Screws and holes: 1 of 2 are known."));
  EXPECT_TRUE(says(blocks, "others than the planned ones: 1 of 2."));
}

// The file is English; its reasons are not, where the report is not: neither fixed ones nor those with a name.
TEST(OutcomeTable, ReasonsAreInTheReportsLanguage) {
  const std::string text = R"({"osteotome_outcome": 1, "contours": [
    {"against": "plan", "known": false, "why": "'front {x}' is not found"},
    {"against": "mirrored side", "known": false, "why": "the interval is wider than what is accepted"},
    {"against": "bone's own outline", "known": false, "why": "a reason of a later version"}]})";
  const auto english = rows_of(outcome_blocks(text));
  const InLanguage german(Language::german);
  const auto rows = rows_of(outcome_blocks(text));
  ASSERT_EQ(rows.size(), 3U);
  EXPECT_EQ(english[0][1].text, "not known: 'front {x}' is not found");
  EXPECT_EQ(rows[0][1].text.find("is not found"), std::string::npos) << rows[0][1].text;
  EXPECT_NE(rows[0][1].text.find("front {x}"), std::string::npos) << rows[0][1].text;
  EXPECT_EQ(rows[1][1].text.find("the interval"), std::string::npos) << rows[1][1].text;
  EXPECT_NE(rows[2][1].text.find("a reason of a later version"), std::string::npos) << rows[2][1].text;
  EXPECT_EQ(english[2][0].text, "against the bone's own outline");
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
