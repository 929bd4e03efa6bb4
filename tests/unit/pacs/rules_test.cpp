// Which rule a series gets, and what of rules is rejected.
#include "osteo/hospital/pacs/rules.h"

#include <gtest/gtest.h>

#include "osteo/core/base/error.h"

namespace osteo {
namespace {

SeriesFacts head() {
  return {"CT", "Petrous bone 0.6 H70", 0.6, 120, true, false};
}

const char* const kRules = R"({
  "osteotome_rules": 1,
  "rules": [
    { "name": "overviews", "any_of": ["Topogram"], "ignore": true },
    { "name": "ear", "modality": "CT", "any_of": ["petrous", "temporal"], "none_of": ["after"], "slice_mm": [0.1, 1], "least_objects": 20,
      "pipeline": "sub/ear.json", "set": { "lower": "400" } },
    { "name": "any head", "modality": "CT" }
  ]
})";

TEST(Rules, FirstThatMatchesDecides) {
  const auto rules = read_series_rules(kRules, "/etc/osteo/rules.json");
  ASSERT_EQ(rules.size(), 3U);
  EXPECT_EQ(rules[1].pipeline, "/etc/osteo/sub/ear.json");
  EXPECT_EQ(rules[1].set.at("lower"), "400");
  const auto name = [&](SeriesFacts f) {
    const RuleChoice c = choose_rule(rules, f);
    return c.rule != nullptr ? c.rule->name : "none: " + c.why;
  };
  EXPECT_EQ(name(head()), "ear");
  SeriesFacts f = head();
  f.description = "TOPOGRAM petrous";
  EXPECT_EQ(name(f), "overviews");
  f.description = "petrous after contrast";
  EXPECT_EQ(name(f), "any head");
  for (const double mm : {0.1, 1.0}) {
    f = head();
    f.slice_mm = mm;
    EXPECT_EQ(name(f), "ear") << mm;
  }
  for (const double mm : {0.0, 0.09, 1.01}) {  // 0: not said, which meets no bound
    f = head();
    f.slice_mm = mm;
    EXPECT_EQ(name(f), "any head") << mm;
  }
  f = head();
  f.objects = 19;
  EXPECT_EQ(name(f), "any head");
}

TEST(Rules, SayWhyNoneMatches) {
  const auto rules = read_series_rules(kRules, "rules.json");
  SeriesFacts f = head();
  f.modality = "MR";
  f.description = "Name of a person";
  const RuleChoice c = choose_rule(rules, f);
  EXPECT_EQ(c.rule, nullptr);
  EXPECT_EQ(c.why,
            "'overviews': its description has none of the words; 'ear': another modality than CT; 'any head': another "
            "modality than CT");
  f = head();
  f.own = true;
  EXPECT_EQ(choose_rule(rules, f).rule, nullptr) << "what we made never runs";
  f = head();
  f.scan = false;
  EXPECT_EQ(choose_rule(rules, f).rule, nullptr);
}

TEST(Rules, WhatIsWrongIsToldWithItsLine) {
  const auto refused = [](const std::string& rules, const std::string& part) {
    try {
      static_cast<void>(read_series_rules("{ \"osteotome_rules\": 1,\n\"rules\": [\n" + rules + " ] }", "r.json"));
      ADD_FAILURE() << rules;
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ExitCode::usage);
      const std::string what = e.what();
      EXPECT_NE(what.find("line"), std::string::npos) << what;
      EXPECT_NE(what.find(part), std::string::npos) << what;
    }
  };
  refused("", "no rule");
  refused(R"({ "name": "a", "modalty": "CT" })", "modalty");
  refused(R"({ "modality": "CT" })", "name");
  refused(R"({ "name": "" })", "name");
  refused(R"({ "name": "a", "slice_mm": [2, 1] })", "above");
  refused(R"({ "name": "a", "slice_mm": [1] })", "slice_mm");
  refused(R"({ "name": "a", "least_objects": 1.5 })", "whole");
  refused(R"({ "name": "a", "any_of": [""] })", "empty word");
  refused(R"({ "name": "a", "ignore": false })", "only true");
  refused(R"({ "name": "a", "ignore": true, "pipeline": "p.json" })", "no pipeline");
  refused(R"({ "name": "a", "ignore": true, "set": {} })", "sets nothing");
  refused(R"({ "name": "a", "set": { "lower": 4 } })", "lower");
  refused("{ \"name\": \"a\" },\n{ \"name\": \"a\" }", "line 4");
  EXPECT_THROW(static_cast<void>(read_series_rules("{}", "r.json")), Error);
  EXPECT_THROW(static_cast<void>(read_series_rules("{ \"osteotome_rules\": 2, \"rules\": [] }", "r.json")), Error);
}

}  // namespace
}  // namespace osteo
