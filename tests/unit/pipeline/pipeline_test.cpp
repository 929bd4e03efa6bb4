// Pipelines of toy stages: what is run again, what is kept, what is never replaced, what the record says.
#include "osteo/imaging/pipeline/pipeline.h"

#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/imaging/pipeline/formats.h"

namespace osteo {
namespace {

int g_runs = 0;

// Makes a small image; its values come from the seed, so that a result tells which seed it had.
struct MakeStage {
  struct Params {
    int add = 0;
    bool refuse = false;
  };
  static void describe(Params& p, auto& visit) {
    visit({"add", "to every value", "", 0, 100}, p.add);
    visit({"refuse", "fails with a finding"}, p.refuse);
  }
  static StageInfo info() {
    return {
        .name = "make",
        .synopsis = "an image",
        .description = {},
        .inputs = {},
        .outputs = {{"image", {DataKind::image}, "image"}, {"finding", {DataKind::document}, "what was found", true}},
        .references = {},
        .example = {}};
  }
  static std::vector<Data> run(const Params& p, std::span<const Data>, const Context& context) {
    ++g_runs;
    if (p.refuse) throw ErrorWithDocument(Error(ExitCode::corrupt, "refused"), "finding", {R"({"status": "refused"})"});
    Frame f;
    f.dims = {4, 3, 12};
    auto v = make_voxels<std::int16_t>(f.voxel_count());
    for (std::size_t n = 0; n < f.voxel_count(); ++n)
      v[n] = static_cast<std::int16_t>(n + 1000 * context.seed + static_cast<std::size_t>(p.add));
    context.report("first", static_cast<std::int64_t>(v[0]));
    return {Image{f, v}, Document{"{}"}};
  }
};

struct MaskStage {
  struct Params {};
  static void describe(Params&, auto&) {}
  static StageInfo info() {
    return {.name = "mask",
            .synopsis = "a mask",
            .description = {},
            .inputs = {{"image", {DataKind::image}, "image"}},
            .outputs = {{"mask", {DataKind::labels}, "odd values"}},
            .references = {},
            .example = {}};
  }
  static std::vector<Data> run(const Params&, std::span<const Data> inputs, const Context&) {
    ++g_runs;
    const auto& image = std::get<Image>(inputs[0]);
    auto v = make_voxels<std::uint8_t>(image.frame.voxel_count());
    for (std::size_t n = 0; n < image.frame.voxel_count(); ++n) v[n] = image.voxels[n] & 1;
    return {Labels{{image.frame, v}, {}}};
  }
};

const Registry& registry() {
  static const Registry value = [] {
    Registry r;
    r.add<MakeStage>();
    r.add<MaskStage>();
    return r;
  }();
  return value;
}

Pipeline make_only(const fs::path& out, const std::string& add = "0") {
  return {
      "p", "", {{.id = "make", .stage = "make", .params = {{"add", add}}, .inputs = {}, .outputs = {{"image", out}}}}};
}

Pipeline chain(const fs::path& folder, const std::string& add = "0") {
  Pipeline p = make_only(folder / "image.nrrd", add);
  p.nodes.push_back({.id = "odd",
                     .stage = "mask",
                     .params = {},
                     .inputs = {{"image", {"make", "", {}}}},
                     .outputs = {{"mask", folder / "mask.nrrd"}}});
  return p;
}

std::vector<NodeResult> run(const Pipeline& p, RunOptions options = {}, std::uint64_t seed = 1) {
  Context context;
  context.seed = seed;
  return run_pipeline(p, registry(), options, context);
}

const RunOptions kForce{.overwrite = true}, kReuse{.reuse = true};

Error refusal(const std::function<void()>& f) {
  try {
    f();
  } catch (const Error& e) {
    return e;
  }
  return {ExitCode::ok, "nothing was refused"};
}

nlohmann::json record(const fs::path& output) {
  return nlohmann::json::parse(read_text(provenance_path(output)));
}

void put(const fs::path& path, const std::string& text) {
  std::ofstream(path) << text;
}

TEST(Run, KeepsWhatIsUnchangedAndMakesTheRestAgain) {
  const TemporaryFolder at;
  g_runs = 0;
  run(chain(at.path()));
  EXPECT_EQ(g_runs, 2);
  auto results = run(chain(at.path()), kReuse);
  EXPECT_EQ(g_runs, 2);
  EXPECT_TRUE(results[0].reused && results[1].reused);
  EXPECT_EQ(std::get<std::int64_t>(results[0].report.at(0).second), 1000);  // the facts are in the record
  run(chain(at.path(), "1"), kReuse);
  EXPECT_EQ(g_runs, 4);
  fs::remove(at.path() / "mask.nrrd");
  run(chain(at.path(), "1"), kReuse);
  EXPECT_EQ(g_runs, 5);  // from the image that is there
  put(at.path() / "image.nrrd", "changed by hand");
  run(chain(at.path(), "1"), kReuse);
  EXPECT_EQ(g_runs, 6);
  EXPECT_NE(read_text(at.path() / "image.nrrd"), "changed by hand");
}

TEST(Run, AnotherSeedIsAnotherResultAndTheRecordSaysWhich) {
  const TemporaryFolder at;
  const fs::path out = at.path() / "a.nrrd";
  run(make_only(out));
  const auto first = record(out);
  EXPECT_EQ(first["seed"], 1);
  EXPECT_FALSE(run(make_only(out), kReuse, 2)[0].reused);
  EXPECT_EQ(record(out)["seed"], 2);
  EXPECT_NE(record(out)["key"], first["key"]);
  EXPECT_EQ(record(out)["report"]["first"], 2000);
  EXPECT_TRUE(run(make_only(out), kReuse, 2)[0].reused);
}

TEST(Run, ExistingOutputsAreRefusedWithoutForce) {
  const TemporaryFolder at;
  const fs::path out = at.path() / "a.nrrd";
  put(out, "precious");
  EXPECT_EQ(refusal([&] { run(make_only(out)); }).code(), ExitCode::cannot_write);
  EXPECT_EQ(read_text(out), "precious");
  fs::create_symlink(at.path() / "gone", at.path() / "link.nrrd");
  EXPECT_EQ(refusal([&] { run(make_only(at.path() / "link.nrrd")); }).code(), ExitCode::cannot_write);
  run(make_only(out), kForce);
  EXPECT_NE(read_text(out), "precious");
}

TEST(Run, FolderWithForeignFilesIsNeverReplaced) {
  const TemporaryFolder at;
  const fs::path out = at.path() / "precious";
  fs::create_directory(out);
  put(out / "thesis.txt", "years of work");
  g_runs = 0;
  for (const RunOptions& options : {kForce, kReuse}) {
    const Error e = refusal([&] { run(make_only(out), options); });
    EXPECT_EQ(e.code(), ExitCode::cannot_write);
    EXPECT_NE(std::string(e.what()).find("thesis.txt"), std::string::npos) << e.what();
    EXPECT_EQ(read_text(out / "thesis.txt"), "years of work");
  }
  EXPECT_EQ(g_runs, 0);  // told before the work
}

TEST(Run, FolderThatWasMadeIsReplacedUnlessSomethingWasPutIntoItOrChanged) {
  const TemporaryFolder at;
  const fs::path out = at.path() / "series";
  run(make_only(out));
  EXPECT_EQ(record(out)["files"].size(), 12U);
  const std::string old = hash_path(out);
  run(make_only(out, "5"), kForce);
  EXPECT_NE(hash_path(out), old);
  EXPECT_TRUE(run(make_only(out, "5"), kReuse)[0].reused);
  run(make_only(out, "6"), kReuse);

  put(out / "notes.txt", "mine");
  EXPECT_NE(std::string(refusal([&] { run(make_only(out, "7"), kForce); }).what()).find("notes.txt"),
            std::string::npos);
  fs::remove(out / "notes.txt");
  fs::create_directory(out / "sub");
  EXPECT_EQ(refusal([&] { run(make_only(out, "7"), kForce); }).code(), ExitCode::cannot_write);
  fs::remove(out / "sub");
  put(out / "0003.dcm", "a file of mine under that name");
  EXPECT_NE(std::string(refusal([&] { run(make_only(out, "7"), kForce); }).what()).find("0003.dcm"), std::string::npos);
  fs::remove(out / "0003.dcm");
  run(make_only(out, "7"), kForce);  // one that is missing is nothing to lose
  fs::remove(provenance_path(out));
  EXPECT_EQ(refusal([&] { run(make_only(out, "8"), kForce); }).code(), ExitCode::cannot_write);
}

TEST(Run, FileAndFolderInEachOthersPlaceAreRefusedBeforeTheWork) {
  const TemporaryFolder at;
  put(at.path() / "folder", "a file where a folder is wanted");
  fs::create_directory(at.path() / "file.nrrd");
  g_runs = 0;
  for (const char* name : {"folder", "file.nrrd"}) {
    EXPECT_EQ(refusal([&] { run(make_only(at.path() / name), kForce); }).code(), ExitCode::cannot_write) << name;
  }
  const fs::path before = fs::current_path();
  fs::current_path(at.path());
  for (const char* name : {".", "..", "/", "./"}) {
    EXPECT_EQ(refusal([&] { run(make_only(name), kForce); }).code(), ExitCode::cannot_write) << name;
  }
  fs::current_path(before);
  EXPECT_EQ(g_runs, 0);
  EXPECT_EQ(read_text(at.path() / "folder"), "a file where a folder is wanted");
}

TEST(Run, OutputsCanBeWrittenBesideTheirPlaces) {
  const TemporaryFolder at;
  fs::create_directory(at.path() / "staged");
  const RunOptions staged{.reuse = true,
                          .place = [&](const fs::path& p) { return p.parent_path() / "staged" / p.filename(); }};
  const auto results = run(chain(at.path()), staged);
  EXPECT_FALSE(fs::exists(at.path() / "image.nrrd"));
  EXPECT_TRUE(fs::exists(at.path() / "staged/mask.nrrd.prov.json"));
  EXPECT_EQ(results[1].outputs.at("mask"), at.path() / "mask.nrrd");
}

TEST(Run, RefusalKeepsItsDocumentAndNamesTheStage) {
  const TemporaryFolder at;
  Pipeline p = chain(at.path());
  p.nodes[0].params["refuse"] = "true";
  p.nodes[0].outputs["finding"] = at.path() / "finding.json";
  try {
    run(p);
    FAIL() << "nothing was refused";
  } catch (const ErrorWithDocument& e) {
    EXPECT_STREQ(e.what(), "stage 'make': refused");
    EXPECT_EQ(e.port(), "finding");
    EXPECT_NE(e.document().json.find("refused"), std::string::npos);
  }
  EXPECT_TRUE(fs::exists(at.path() / "finding.json"));
  EXPECT_FALSE(fs::exists(at.path() / "image.nrrd"));
}

TEST(Run, TheRecordSaysWhichProgram) {
  const std::string version(program_version());
  EXPECT_TRUE(version.starts_with("0.")) << version;
  EXPECT_TRUE(version.find(" (commit ") != std::string::npos || version.find(" (unknown commit)") != std::string::npos)
      << version;
  const TemporaryFolder at;
  run(make_only(at.path() / "a.nrrd"));
  EXPECT_EQ(record(at.path() / "a.nrrd")["osteotome"], version);
}

TEST(Parse, VariablesInNamesOfFilesAreKnown) {
  const char* text = R"({"osteotome": 1, "variables": {"scan": {}, "lower": {"default": 3}},
    "stages": [{"id": "m", "stage": "mask", "in": {"image": {"file": "${scan}/x.nrrd"}}, "params": {}}]})";
  const auto v = pipeline_variables(text);
  ASSERT_EQ(v.size(), 2U);
  EXPECT_FALSE(v[0].in_file_name);  // lower
  EXPECT_TRUE(v[1].in_file_name);
}

TEST(Parse, MistakesAreNamedWithThePlace) {
  const auto what = [](const char* text) {
    return std::string(refusal([&] { (void)parse_pipeline(text, {}); }).what());
  };
  EXPECT_NE(what("{\"osteotome\": 1,\n\"stages\": [}").find("line 2"), std::string::npos);
  EXPECT_NE(what(R"({"osteotome": 1, "stages": [{"stage": "make"}, {"stage": "make"}]})").find("two stages"),
            std::string::npos);
  EXPECT_NE(what(R"({"osteotome": 1, "stages": [{"id": "a.b", "stage": "make"}]})").find("no dots"), std::string::npos);
  EXPECT_NE(what(R"({"stages": []})").find("osteotome"), std::string::npos);
  const auto says = [&](const char* text, const char* part) {
    EXPECT_NE(what(text).find(part), std::string::npos) << what(text);
  };
  says("{\"osteotome\": 1,\n\"stage\": []}",
       "'pipeline' line 2: the key \"stage\" is not known: did you mean \"stages\"?");
  says("{\"osteotome\": 1, \"stages\": [\n{\"stage\": \"make\",\n\"parms\": {}}]}",
       "line 3: stage 1: the key \"parms\" is not known");
  says("{\"osteotome\": 1, \"stages\": [\n{\"stage\": \"make\", \"params\": {\n\"value\": {}}}]}",
       "line 3: stage 'make' parameter 'value': must be");
  says("{\"osteotome\": 1,\n\"stages\": [{\"stage\": \"make\",\n \"in\": {\"image\": 7}}]}",
       "line 3: stage 'make' input 'image'");
  says("{\"osteotome\": 1,\n\"stages\": [{\"stage\": \"make\", \"out\": {\"image\":\n \"${where}/x\"}}]}",
       "line 3: stage 'make' output 'image': the variable 'where' has no value");
  says("{\"osteotome\": 1, \"stages\": [],\n\"stages\": []}", "line 2: the key \"stages\" is there twice");
  says("{\"osteotome\": 2, \"stages\": []}", "must be 1");
}

TEST(Validate, OrdersFindsCirclesAndTwoWriters) {
  Pipeline p = chain("/tmp");
  std::swap(p.nodes[0], p.nodes[1]);
  validate(p, registry());
  EXPECT_EQ(p.nodes[0].id, "make");
  p.nodes[1].outputs["mask"] = "/tmp/./image.nrrd";
  EXPECT_NE(std::string(refusal([&] { validate(p, registry()); }).what()).find("both write"), std::string::npos);
}

TEST(Names, LongListsAreCut) {
  EXPECT_EQ(list_names({"a", "b"}), "a, b");
  EXPECT_EQ(list_names({"a", "b", "c", "d", "e", "f", "g"}), "a, b, c, d, e and 2 more");
  EXPECT_EQ(without_uid("1.2.840.113619.2"), "(UID)");
  EXPECT_EQ(without_uid("1.5,2.5,3"), "1.5,2.5,3");
}

}  // namespace
}  // namespace osteo
