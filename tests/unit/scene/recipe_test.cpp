// A case remembers what it was asked for, and is either the old or the new one.
#include "osteo/session/scene/recipe.h"

#include <gtest/gtest.h>
#include <stdlib.h>

#include <fstream>

#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/session/scene/case.h"

namespace osteo {
namespace {

using Given = std::map<std::string, std::optional<std::string>>;

void put(const fs::path& path, const std::string& text) {
  std::ofstream(path) << text;
}

const RecipeChange* find(const std::vector<RecipeChange>& changes, const std::string& name) {
  for (const auto& c : changes) {
    if (c.name == name) return &c;
  }
  return nullptr;
}

TEST(Recipe, OneChangeKeepsTheRest) {
  Recipe r{.settings = {{"lower", "500"}, {"region", "left_temporal"}, {"names", "6=facial nerve"}}};
  const auto changes = change_settings(r, Given{{"lower", "550"}, {"spacing_mm", "0.3"}}, false);
  EXPECT_EQ(r.settings,
            (std::map<std::string, std::string>{
                {"lower", "550"}, {"names", "6=facial nerve"}, {"region", "left_temporal"}, {"spacing_mm", "0.3"}}));
  ASSERT_EQ(changes.size(), 2U);
  EXPECT_EQ(find(changes, "lower")->from, "500");
  EXPECT_EQ(find(changes, "lower")->to, "550");
  EXPECT_FALSE(find(changes, "spacing_mm")->from);
  EXPECT_TRUE(change_settings(r, Given{{"lower", "550"}}, false).empty());
  EXPECT_EQ(change_settings(r, Given{{"region", std::nullopt}}, false).size(), 1U);
  EXPECT_FALSE(r.settings.contains("region"));
}

TEST(Recipe, WhatBelongsToAChangedThingGoesWithItAndIsTold) {
  const Recipe before{
      .settings = {
          {"region", "box"}, {"centre_mm", "1,2,3"}, {"size_mm", "9,9,9"}, {"preset", "cellular"}, {"names", "1=a"}}};
  Recipe r = before;
  auto changes = change_settings(r, Given{{"region", "jaw"}}, false);
  EXPECT_FALSE(r.settings.contains("centre_mm"));
  EXPECT_FALSE(r.settings.contains("size_mm"));
  EXPECT_FALSE(find(changes, "centre_mm")->why.empty());
  r = before;
  (void)change_settings(r, Given{{"region", "box"}}, false);  // the same again
  EXPECT_EQ(r, before);
  r = before;
  changes = change_settings(r, Given{{"region", "jaw"}, {"centre_mm", "1,2,3"}}, false);  // given again: meant
  EXPECT_TRUE(r.settings.contains("centre_mm"));
  r = before;
  changes = change_settings(r, Given{{"lower", "400"}}, false);  // the preset would ignore it
  EXPECT_FALSE(r.settings.contains("preset"));
  EXPECT_EQ(find(changes, "preset")->from, "cellular");
  changes = change_settings(r, Given{{"preset", "thin"}}, false);
  EXPECT_FALSE(r.settings.contains("lower"));
  changes = change_settings(r, Given{}, true);
  EXPECT_FALSE(r.settings.contains("names"));
  r.settings["remove_table"] = "true";
  changes = change_settings(r, Given{{"keep_table", "true"}}, false);  // both would be rejected
  EXPECT_FALSE(r.settings.contains("remove_table"));
  EXPECT_FALSE(find(changes, "remove_table")->why.empty());
  changes = change_settings(r, Given{{"remove_table", "true"}}, false);
  EXPECT_FALSE(r.settings.contains("keep_table"));
}

class WithState : public testing::Test {
 protected:
  void SetUp() override { ::setenv("XDG_STATE_HOME", state_.path().c_str(), 1); }
  void TearDown() override { ::unsetenv("XDG_STATE_HOME"); }
  TemporaryFolder state_;
};

using Memory = WithState;

TEST_F(Memory, HoldsFilesByTheirContent) {
  const TemporaryFolder at;
  const fs::path file = at.path() / "scan";
  put(file, "voxels");
  const std::string hash = hash_path(file);
  EXPECT_FALSE(recall_file(hash));
  remember(hash, file.string());
  EXPECT_EQ(recall_file(hash), file);
  EXPECT_EQ(fs::status(state_.path() / "osteotome").permissions(), fs::perms::owner_all);
  put(file, "other voxels");
  EXPECT_FALSE(recall_file(hash));
  fs::remove(file);
  EXPECT_FALSE(recall_file(hash));
  EXPECT_FALSE(recall("../x"));
}

TEST_F(Memory, WhatNamesAPatientIsNotInTheCase) {
  const TemporaryFolder at;
  Recipe r{.source_hash = "abc",
           .structures_hash = "def",
           .settings = {{"lower", "500"}, {"series", "1.2.3.4.5"}},
           .withheld = {"series"}};
  const std::string text = recipe_json(r).dump();
  EXPECT_EQ(text.find("1.2.3.4.5"), std::string::npos);
  put(at.path() / "manifest.json", R"({"osteotome_case": 1, "recipe": )" + text + "}");
  auto read = read_recipe(at.path());
  ASSERT_TRUE(read);
  EXPECT_TRUE(read->lost.contains("series"));  // on another machine
  remember(hash_text("1.2.3.4.5"), "1.2.3.4.5");
  read = read_recipe(at.path());
  EXPECT_EQ(*read, r);
  put(at.path() / "manifest.json", R"({"osteotome_case": 1})");
  EXPECT_FALSE(read_recipe(at.path()));
  put(at.path() / "manifest.json", "{");
  EXPECT_THROW((void)read_recipe(at.path()), Error);
}

std::string manifest(const std::map<std::string, fs::path>& files) {
  std::string text;
  for (const auto& [role, path] : files) {
    text += (text.empty() ? "" : ", ") +
            ("\"" + role + R"(": {"file": ")" + path.filename().string() + R"(", "hash": ")" + hash_path(path) + "\"}");
  }
  return R"({"osteotome_case": 1, "files": {)" + text + "}}";
}

struct CaseFolder : TemporaryFolder {
  fs::path folder = path() / "c";
  // bone "1" and structures "nerve", committed
  CaseFolder() {
    CaseUpdate u(folder);
    put(u.place(folder / "bone.vdb"), "1");
    put(u.place(folder / "structures.seg.nrrd"), "nerve");
    u.commit(
        manifest({{"bone", u.place(folder / "bone.vdb")}, {"structures", u.place(folder / "structures.seg.nrrd")}}));
  }
  std::size_t entries() const { return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder), {})); }
};

TEST(CaseUpdate, NothingChangesBeforeTheCommit) {
  const CaseFolder c;
  put(c.folder / "haptics.json", "mine");
  {
    CaseUpdate u(c.folder);
    put(u.place(c.folder / "bone.vdb"), "2");
    EXPECT_EQ(u.place(c.folder / "sub/x.vdb"), c.folder / "sub/x.vdb");
    EXPECT_EQ(read_text(c.folder / "bone.vdb"), "1");
  }
  EXPECT_EQ(read_text(c.folder / "bone.vdb"), "1");
  EXPECT_EQ(c.entries(), 4U);
  { CaseUpdate u(c.path() / "never"); }
  EXPECT_FALSE(fs::exists(c.path() / "never"));
}

TEST(CaseUpdate, CommitRemovesWhatIsStaleButNothingElse) {
  const CaseFolder c;
  put(c.folder / "notes.txt", "mine");
  const auto update = [&](const std::string& bone) {
    CaseUpdate u(c.folder);
    put(u.place(c.folder / "bone.vdb"), bone);
    u.commit(manifest({{"bone", u.place(c.folder / "bone.vdb")}}));
  };
  update("2");
  EXPECT_EQ(read_text(c.folder / "bone.vdb"), "2");
  EXPECT_FALSE(fs::exists(c.folder / "structures.seg.nrrd"));
  EXPECT_EQ(read_text(c.folder / "notes.txt"), "mine");
  EXPECT_EQ(c.entries(), 3U);

  const CaseFolder d;
  put(d.folder / "structures.seg.nrrd", "drawn on by hand since");
  CaseUpdate u(d.folder);
  put(u.place(d.folder / "bone.vdb"), "2");
  u.commit(manifest({{"bone", u.place(d.folder / "bone.vdb")}}));
  EXPECT_EQ(read_text(d.folder / "structures.seg.nrrd"), "drawn on by hand since");
}

// Cut at each of its renames, it is finished by who comes next.
TEST(CaseUpdate, CutCommitIsFinished) {
  for (int done = 0; done <= 2; ++done) {
    const CaseFolder c;
    const fs::path next = c.folder / ".osteo-next";
    fs::create_directory(next);
    put(next / "bone.vdb", "2");
    put(next / "surface.ply", "s");
    put(next / "manifest.json", manifest({{"bone", next / "bone.vdb"}, {"surface", next / "surface.ply"}}));
    if (done > 0) fs::rename(next / "bone.vdb", c.folder / "bone.vdb");
    if (done > 1) fs::rename(next / "surface.ply", c.folder / "surface.ply");
    { CaseUpdate u(c.folder); }
    EXPECT_EQ(read_text(c.folder / "bone.vdb"), "2") << done;
    EXPECT_EQ(parse_manifest(read_text(c.folder / "manifest.json")).at("bone").hash, hash_text("2")) << done;
    EXPECT_FALSE(fs::exists(next)) << done;
    EXPECT_FALSE(fs::exists(c.folder / "structures.seg.nrrd")) << done;
    EXPECT_EQ(c.entries(), 3U) << done;
  }
}

TEST(CaseUpdate, TwoAtOnceAreKeptApart) {
  const CaseFolder c;
  CaseUpdate first(c.folder);
  try {
    CaseUpdate second(c.folder);
    FAIL() << "both got in";
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::cannot_write);
  }
  EXPECT_TRUE(fs::exists(first.place(c.folder / "x.vdb").parent_path()));  // the first is not disturbed
}

TEST(CaseUpdate, WhatAKilledOneLeftGoes) {
  const CaseFolder c;
  fs::create_directory(c.folder / ".osteo-tmp-case-1");
  put(c.folder / ".osteo-tmp-case-1/bone.vdb", "half");
  { CaseUpdate u(c.folder); }
  EXPECT_EQ(c.entries(), 3U);
  EXPECT_TRUE(foreign_files(c.folder, {}).empty());
}

TEST(Case, ForeignFilesAreTold) {
  const TemporaryFolder at;
  const fs::path folder = at.path() / "f";
  EXPECT_TRUE(foreign_files(folder, {}).empty());
  fs::create_directory(folder);
  EXPECT_TRUE(foreign_files(folder, {}).empty());
  put(folder / "manifest.json", R"({"name": "a web page"})");
  put(folder / "preview.png", "a photograph");
  put(folder / "a.txt", "x");
  EXPECT_EQ(foreign_files(folder, {}), (std::vector<std::string>{"a.txt", "manifest.json", "preview.png"}));

  const CaseFolder c;
  put(c.folder / "haptics.json", "mine");
  put(c.folder / "preview.png", "a photograph");
  EXPECT_TRUE(foreign_files(c.folder, {c.folder / "bone.vdb"}).empty());
  EXPECT_EQ(foreign_files(c.folder, {c.folder / "bone.vdb", c.folder / "preview.png"}),
            std::vector<std::string>{"preview.png"});
}

TEST(Case, AManifestIsReadStrictly) {
  const std::string good = R"({"osteotome_case": 1,
    "files": {"bone": {"file": "bone.vdb", "hash": "x"},
              "hu": {"file": "hu.vdb", "hash": "y"}},
    "steps": []})";
  EXPECT_EQ(parse_manifest(good).at("hu").hash, "y");
  const auto says = [&](const std::string& from, const std::string& to, const std::string& what) {
    std::string changed = good;
    changed.replace(changed.find(from), from.size(), to);
    try {
      static_cast<void>(parse_manifest(changed, "c/manifest.json"));
      ADD_FAILURE() << to << " was read";
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ExitCode::corrupt);
      EXPECT_FALSE(e.advice().empty());
      EXPECT_NE(std::string(e.what()).find(what), std::string::npos) << e.what();
    }
  };
  says("\"steps\"", "\"stpes\"", "'c/manifest.json' line 4: the key \"stpes\" is not known: did you mean \"steps\"?");
  says("\"hash\": \"y\"", "\"hash\": \"y\", \"size\": 3", "line 3: hu: the key \"size\" is not known");
  says("\"hash\": \"y\"", "\"hash\": 3", "line 3: hu: \"hash\" must be a text");
  says("hu.vdb", "../hu.vdb", "line 3: hu: '../hu.vdb' is no file inside the case");
  says("\"bone\"", "\"born\"", "it names no bone");
  says("\"osteotome_case\": 1", "\"osteotome_case\": 2", "\"osteotome_case\" must be 1");
  says("\"steps\": []}", "\"steps\": []", "this is not valid JSON");
}

TEST(Case, FactsOfStepsThatWereNotDoneAgainAreKept) {
  const TemporaryFolder at;
  put(at.path() / "manifest.json",
      R"({"osteotome_case": 1, "steps": [{"id": "mask", "key": "k", "report": {"pieces": 36}}, {"id": "ct", "key": "old", "report": {"a": 1}}]})");
  std::vector<NodeResult> results(3);
  results[0] = {.id = "mask", .stage = "threshold", .key = "k", .reused = true};
  results[1] = {.id = "ct", .stage = "crop", .key = "new", .reused = true};
  results[2] = {.id = "mask", .stage = "threshold", .key = "k", .reused = false};
  recall_facts(at.path(), results);
  ASSERT_EQ(results[0].report.size(), 1U);
  EXPECT_EQ(std::get<std::int64_t>(results[0].report[0].second), 36);
  EXPECT_TRUE(results[1].report.empty());
  EXPECT_TRUE(results[2].report.empty());
}

}  // namespace
}  // namespace osteo
