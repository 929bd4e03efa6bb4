#include "osteo/core/stage/stage.h"

#include <gtest/gtest.h>

#include <cmath>

namespace osteo {
namespace {

// Sums the characters of a document and, when given, of a second one.
struct LengthStage {
  struct Params {
    int times = 1;
  };
  static void describe(Params& p, auto& visit) { visit({"times", "counted so often", "", 0, 5}, p.times); }
  static StageInfo info() {
    return {.name = "length",
            .synopsis = "how long",
            .description = {},
            .inputs = {{"text", {DataKind::document}, "one"},
                       {"more", {DataKind::document, DataKind::picture}, "another", true}},
            .outputs = {{"length", {DataKind::document}, "its length"}},
            .references = {},
            .example = {}};
  }
  static std::vector<Data> run(const Params& p, std::span<const Data> inputs, const Context& context) {
    std::size_t n = std::get<Document>(inputs[0]).json.size();
    if (const auto* d = std::get_if<Document>(&inputs[1])) n += d->json.size();
    context.report("length", static_cast<std::int64_t>(n));
    return {Document{std::to_string(n * static_cast<std::size_t>(p.times))}};
  }
};
struct OtherStage : LengthStage {
  static StageInfo info() {
    StageInfo i = LengthStage::info();
    i.name = "other";
    return i;
  }
};

const Registry& registry() {
  static const Registry value = [] {
    Registry r;
    r.add<LengthStage>();
    r.add<OtherStage>();
    return r;
  }();
  return value;
}

Error error_of(const std::function<void()>& f) {
  try {
    f();
  } catch (const Error& e) {
    return e;
  }
  return {ExitCode::ok, "nothing was refused"};
}

TEST(Stage, RunsWithItsParametersAndReports) {
  const auto stage = registry().make("length");
  stage->fields()[0].from_text("3");
  const Context context;
  const std::vector<Data> inputs{Document{"abcd"}, std::monostate{}};
  EXPECT_EQ(std::get<Document>(stage->run(inputs, context)[0]).json, "12");
  EXPECT_EQ(std::get<std::int64_t>(context.take_report().at(0).second), 4);
  EXPECT_EQ(std::get<Document>(stage->run(std::vector<Data>{Document{"abcd"}, Document{"ef"}}, context)[0]).json, "18");
  // Each made stage has parameters of its own.
  EXPECT_EQ(registry().make("length")->fields()[0].to_text(), "1");
}

TEST(Stage, WrongInputsAreNamed) {
  const auto stage = registry().make("length");
  const Context context;
  const auto run = [&](std::vector<Data> inputs) { return error_of([&] { (void)stage->run(inputs, context); }); };
  EXPECT_STREQ(run({Document{"a"}}).what(), "stage 'length' takes 2 inputs, not 1");
  EXPECT_STREQ(run({std::monostate{}, std::monostate{}}).what(), "stage 'length' needs its input 'text'");
  const Error wrong = run({Document{"a"}, Source{"x"}});
  EXPECT_STREQ(wrong.what(), "stage 'length' takes document or picture as 'more', not source");
  EXPECT_EQ(wrong.code(), ExitCode::usage);
}

TEST(Registry, NamesInOrderAndTheNearestForAWrongOne) {
  EXPECT_EQ(registry().names(), (std::vector<std::string>{"length", "other"}));
  EXPECT_TRUE(registry().has("other"));
  EXPECT_FALSE(registry().has("none"));
  const Error e = error_of([] { (void)registry().make("lenght"); });
  EXPECT_EQ(e.code(), ExitCode::usage);
  EXPECT_EQ(e.advice(), "did you mean 'length'?");
}

TEST(Stage, KindsAreToldToPeople) {
  const std::array kinds{DataKind::image, DataKind::labels, DataKind::grid};
  EXPECT_EQ(kinds_text(kinds), "image, labels or grid");
  EXPECT_EQ(kinds_text(std::span(kinds).first(1)), "image");
  EXPECT_EQ(kinds_text({}), "");
}

TEST(Stage, ErrorWithDocumentKeepsBoth) {
  const ErrorWithDocument e(Error(ExitCode::corrupt, "bad", "mend it").in("stage 'x'"), "verdict", {"{}"});
  EXPECT_STREQ(e.what(), "stage 'x': bad");
  EXPECT_EQ(e.code(), ExitCode::corrupt);
  EXPECT_EQ(e.port(), "verdict");
  EXPECT_EQ(e.document().json, "{}");
}

}  // namespace
}  // namespace osteo
