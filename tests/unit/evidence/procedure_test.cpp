// Procedure files: read strictly, errors with file, item and line.
#include "osteo/assessment/evidence/procedure.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "osteo/assessment/evidence/score.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"

namespace osteo {
namespace {

std::string wrong(const std::string& json) {
  try {
    static_cast<void>(parse_procedure(json, "p.json"));
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::usage);
    return std::string(e.what()) + " | " + e.advice();
  }
  return "no error";
}

std::string with(const std::string& rest) {
  return "{ \"osteotome_procedure\": 1, \"name\": \"n\",\n\"structures\": [ {\"name\": \"nerve\", \"role\": "
         "\"never_touch\"} ],\n" +
         rest + " }";
}

TEST(Procedures, ThoseOfTheProjectAreRead) {
  for (const char* const name : {"mastoidectomy.json", "mandible-split.json"}) {
    const Procedure p = load_procedure(std::filesystem::path(OSTEO_SOURCE) / "pipelines/procedures" / name);
    EXPECT_FALSE(p.items.empty()) << name;
    EXPECT_FALSE(p.steps.empty()) << name;
    EXPECT_EQ(p.file, name);
  }
  const Procedure ear = load_procedure(std::filesystem::path(OSTEO_SOURCE) / "pipelines/procedures/mastoidectomy.json");
  EXPECT_EQ(ear.find("facial nerve")->role, ProcedureRole::never_touch);
  EXPECT_EQ(ear.items[1].threshold, 0.4);
  EXPECT_EQ(ear.items[2].threshold, usual_threshold(ItemKind::no_hole));
  EXPECT_EQ(mirrored(ear).items[1].towards[0], -ear.items[1].towards[0]);
  EXPECT_EQ(mirrored(ear).items[1].towards[1], ear.items[1].towards[1]);
}

TEST(Procedures, ErrorsNameFileItemAndLine) {
  const std::string unknown =
      wrong(with("\"items\": [\n{\"name\": \"a\", \"kind\": \"exposed\", \"structure\": \"nerv\"} ]"));
  EXPECT_NE(unknown.find("'p.json' line 4"), std::string::npos) << unknown;
  EXPECT_NE(unknown.find("item 1 ('a')"), std::string::npos) << unknown;
  EXPECT_NE(unknown.find("did you mean 'nerve'?"), std::string::npos) << unknown;
  const std::string idle = wrong(
      with("\"items\": [ {\"name\": \"a\", \"kind\": \"not_violated\", \"structure\": \"nerve\",\n\"cover_mm\": 1} ]"));
  EXPECT_NE(idle.find("line 4"), std::string::npos) << idle;
  EXPECT_NE(idle.find("'cover_mm' says nothing for an item of kind 'not_violated'"), std::string::npos) << idle;
  EXPECT_NE(wrong(with("\"items\": [ {\"name\": \"a\", \"kind\": \"exposed\"} ]")).find("'structure' is missing"),
            std::string::npos);
  EXPECT_NE(
      wrong(with("\"items\": [ {\"name\": \"a\", \"kind\": \"shown\", \"structure\": \"nerve\"} ]")).find("exposed"),
      std::string::npos);
  EXPECT_NE(
      wrong(with("\"items\": [ {\"name\": \"a\", \"kind\": \"pieces\"}, {\"name\": \"a\", \"kind\": \"fixed\"} ]"))
          .find("two of this name"),
      std::string::npos);
  EXPECT_NE(
      wrong(
          with("\"items\": [ {\"name\": \"a\", \"kind\": \"no_hole\", \"structure\": \"nerve\", \"threshold\": -1} ]"))
          .find("threshold"),
      std::string::npos);
  EXPECT_NE(wrong(with("\"steps\": [ {\"name\": \"s\", \"items\": [\"b\"]} ]")).find("'b' is no item"),
            std::string::npos);
  EXPECT_NE(wrong(with("\"force_limits\": [ {\"structure\": \"nerve\", \"within_mm\": 1} ]")).find("most_n"),
            std::string::npos);
  EXPECT_NE(wrong(with("\"regions\": [ {\"name\": \"r\", \"kind\": \"target\", \"structure\": \"bone\"} ]"))
                .find("'bone' is not among"),
            std::string::npos);
  EXPECT_NE(wrong("{ \"name\": \"n\" }").find("osteotome_procedure"), std::string::npos);
  EXPECT_NE(wrong(with("\"item\": []")).find("item"), std::string::npos);
  EXPECT_NE(
      wrong(with("\"items\": [ {\"name\": \"m\", \"kind\": \"margin\", \"curve_mm\": [[0,0,0]]} ]")).find("two points"),
      std::string::npos);
}

TEST(Metrics, TheTableInTheDocsIsTheirDeclaration) {
  const std::string docs = read_text(std::filesystem::path(OSTEO_SOURCE) / "docs/evidence.md");
  EXPECT_NE(docs.find(metric_table_markdown()), std::string::npos) << metric_table_markdown();
}

}  // namespace
}  // namespace osteo
