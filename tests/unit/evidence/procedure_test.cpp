// Procedure files: read strictly, errors with file, item and line.
#include "osteo/assessment/evidence/procedure.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "folders.h"
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
    const Procedure p = load_procedure(source_folder() / "pipelines/procedures" / name);
    EXPECT_FALSE(p.items.empty()) << name;
    EXPECT_FALSE(p.steps.empty()) << name;
    EXPECT_EQ(p.file, name);
  }
  const Procedure ear = load_procedure(source_folder() / "pipelines/procedures/mastoidectomy.json");
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

TEST(Procedures, PatchesAreNamedAndOfTheItemsStructure) {
  const auto patch = [](const std::string& points, const std::string& structure = "nerve", double within = 3) {
    return "\"patches\": [ {\"name\": \"window\", \"structure\": \"" + structure + "\", \"points_mm\": " + points +
           ", \"within_mm\": " + std::to_string(within) + "} ],\n";
  };
  const auto item = [](const std::string& kind, const std::string& named = "window") {
    return "\"items\": [ {\"name\": \"a\", \"kind\": \"" + kind + "\", \"structure\": \"nerve\", \"patch\": \"" +
           named + "\"} ]";
  };
  for (const char* const kind : {"exposed", "thinned", "no_hole"}) {
    const std::string text = with(patch("[[1, 2, 3]]") + item(kind));
    const Procedure p = parse_procedure(text, "p.json");
    EXPECT_EQ(p.items[0].patch, "window");
    EXPECT_EQ(p.patches[0].points_mm, (std::vector<Vec3>{{1, 2, 3}}));
    // Another text is another procedure, and so is its other side; twice turned it is itself.
    EXPECT_EQ(p.hash.size(), 16U);
    EXPECT_NE(p.hash, parse_procedure(text + " ", "p.json").hash);
    EXPECT_EQ(p.hash, parse_procedure(text, "q.json").hash);
    EXPECT_EQ(mirrored(p).patches[0].points_mm, (std::vector<Vec3>{{-1, 2, 3}}));
    EXPECT_EQ(mirrored(p).hash, p.hash + " mirrored");
    EXPECT_EQ(mirrored(mirrored(p)).hash, p.hash);
  }
  const auto has = [](const std::string& said, const std::string& what) {
    EXPECT_NE(said.find(what), std::string::npos) << said;
  };
  has(wrong(with(patch("[[1, 2, 3]]") + item("exposed", "windw"))), "did you mean 'window'?");
  has(wrong(with(patch("[[1, 2, 3]]") + item("followed"))), "'patch' says nothing");
  has(wrong(with(patch("[]") + item("exposed"))), "needs one point");
  has(wrong(with(patch("[[1, 2]]") + item("exposed"))), "points_mm");
  has(wrong(with(patch("[[1, 2, 3]]", "nerv") + item("exposed"))), "did you mean 'nerve'?");
  has(wrong(with(patch("[[1, 2, 3]]", "nerve", 0.1) + item("exposed"))), "within_mm");
  std::string two = patch("[[1, 2, 3]]");
  two.insert(two.find(" ],"), ", " + two.substr(two.find('{'), two.find('}') - two.find('{') + 1));
  has(wrong(with(two + item("exposed"))), "two of this name");
  has(wrong("{ \"osteotome_procedure\": 1, \"name\": \"n\",\n\"structures\": [ {\"name\": \"nerve\", \"role\": "
            "\"keep\"}, "
            "{\"name\": \"vein\", \"role\": \"keep\"} ],\n" +
            patch("[[1, 2, 3]]", "vein") + item("exposed") + "}"),
      "is of 'vein'");
}

TEST(FacePart, IsByPlaceAlongTheLineAndByWhereItLooks) {
  Procedure p;
  p.patches.push_back({"line", "s", {{0, 0, 0}, {10, 0, 0}}, 2, 0});
  ScaleItem item;
  item.patch = "line";
  const FacePart part(p, item);
  const Vec3 up{0, 0, 1};
  EXPECT_FALSE(part.whole());
  EXPECT_TRUE(part.has({5, 1.9, 0}, up));
  EXPECT_FALSE(part.has({5, 2.1, 0}, up));
  EXPECT_TRUE(part.has({-1.9, 0, 0}, up));
  EXPECT_FALSE(part.has({-1.5, 1.5, 0}, up));
  EXPECT_TRUE(part.has({11.9, 0, 0}, up));
  EXPECT_FALSE(part.has({12.1, 0, 0}, up));
  item.towards = {0, 0, 2};
  item.within_deg = 30;
  const FacePart looks(p, item);
  EXPECT_TRUE(looks.has({5, 0, 0}, {0, 0.5, 1}));
  EXPECT_FALSE(looks.has({5, 0, 0}, {0, 0.7, 1}));
  item.patch.clear();
  EXPECT_TRUE(FacePart(p, item).has({99, 0, 0}, up));
  EXPECT_FALSE(FacePart(p, item).whole());
  EXPECT_TRUE(FacePart(p, {}).whole());
  // One point alone is a ball around it.
  p.patches[0].points_mm = {{1, 0, 0}};
  item.patch = "line";
  EXPECT_TRUE(FacePart(p, item).has({1, 1.9, 0}, up));
  EXPECT_FALSE(FacePart(p, item).has({-1.1, 0, 0}, up));
}

TEST(Metrics, TheTableInTheDocsIsTheirDeclaration) {
  const std::string docs = read_text(source_folder() / "docs/validation/evidence.md");
  EXPECT_NE(docs.find(metric_table_markdown()), std::string::npos) << metric_table_markdown();
}

}  // namespace
}  // namespace osteo
