// The command line around toy commands: flags, exit codes, what goes to standard output; and the rules that all of
// osteo's own keep.
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "osteo/app/cli/command.h"
#include "osteo/app/cli/report.h"
#include "osteo/app/stages/registry.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/imaging/pipeline/pipeline.h"

namespace osteo {
namespace {

struct FailStage {
  struct Params {
    std::string how = "verdict";
    int times = 1;
  };
  static void describe(Params& p, auto& visit) {
    visit({"how", "it fails"}, p.how);
    visit({"times", "so often", "", 0, 9}, p.times);
  }
  static StageInfo info() {
    return {.name = "fail",
            .synopsis = "fails",
            .description = "Fails.",
            .inputs = {},
            .outputs = {{"document", {DataKind::document}, "nothing"},
                        {"verdict", {DataKind::document}, "why", true, ".verdict.json"}},
            .references = {},
            .example = "osteo fail x.json"};
  }
  static std::vector<Data> run(const Params& p, std::span<const Data>, const Context&) {
    if (p.how == "verdict")
      throw ErrorWithDocument(Error(ExitCode::corrupt, "not taken", "look"), "verdict", {R"({"status": "refused"})"});
    if (p.how == "permission")
      throw fs::filesystem_error("status", "/nowhere/x", std::make_error_code(std::errc::permission_denied));
    if (p.how == "memory") throw std::bad_alloc();
    if (p.how == "defect") throw std::logic_error("odd");
    return {Document{"{}"}, Document{"{}"}};
  }
};

struct EchoCommand {
  struct Params {
    std::string text = "abc";
    bool on = true;
    double size = 2;
  };
  static void describe(Params& p, auto& visit) {
    visit({"text", "a text"}, p.text);
    visit({"on", "a flag"}, p.on);
    visit({"size", "a number", "mm", 0, 5}, p.size);
  }
  static cli::CommandInfo info() { return {"echo", "says", "Says.", {{"what", "to say", true}}, "osteo echo", true}; }
  static int run(const Params& p, cli::Invocation& io) {
    nlohmann::json j{
        {"text", p.text},         {"on", p.on}, {"size", p.size}, {"given", io.given}, {"arguments", io.arguments},
        {"seed", io.context.seed}};
    for (const auto& [k, v] : io.settings) j["settings"][k] = v;
    io.out << j.dump();
    return 0;
  }
};

struct PairCommand {
  struct Params {
    std::string one, two, from;
  };
  static void describe(Params& p, auto& visit) {
    visit({"one", "a file"}, p.one);
    visit({"two", "another file"}, p.two);
    visit({"from", "what is read"}, p.from);
  }
  static cli::CommandInfo info() {
    return {"pair", "writes two",   "Writes two.",   {{"what", "to read", true}}, "osteo pair", false,
            {},     {"one", "two"}, {"from", "what"}};
  }
  static int run(const Params& p, cli::Invocation& io) {
    io.out << p.one + "|" + p.two;
    return 0;
  }
};

// Not a TemporaryFolder: a program that fails removes those of its process.
class Folder {
 public:
  Folder() { path_ = ::mkdtemp(name_); }
  ~Folder() { fs::remove_all(path_); }
  [[nodiscard]] const fs::path& path() const { return path_; }

 private:
  char name_[32] = "/tmp/osteo-cli-XXXXXX";
  fs::path path_;
};

struct Said {
  int code = 0;
  std::string out, err;
  [[nodiscard]] nlohmann::json json() const { return nlohmann::json::parse(out); }
};

Said run(std::vector<std::string> args) {
  cli::Program program;
  program.registry.add<FailStage>();
  program.add<EchoCommand>();
  program.add<PairCommand>();
  args.insert(args.begin(), "osteo");
  std::vector<char*> argv;
  for (auto& a : args) argv.push_back(a.data());
  std::ostringstream out, err;
  Said said;
  said.code = cli::run_program(program, static_cast<int>(argv.size()), argv.data(), out, err);
  said.out = out.str();
  said.err = err.str();
  return said;
}

TEST(Cli, NoFileIsWrittenTwiceOrReadAndWritten) {
  const Folder folder;
  const auto pair = [&](std::vector<std::string> args) {
    args.insert(args.begin(), "pair");
    return run(args);
  };
  const std::string a = (folder.path() / "a").string(), b = (folder.path() / "b").string();
  EXPECT_EQ(pair({"--one", a, "--two", b, "--from", "c", "d"}).out, a + "|" + b);
  EXPECT_EQ(pair({}).out, "|") << "two that are not given are not one file";
  EXPECT_EQ(pair({"--from", a, a}).code, 0) << "what is only read may be read twice";
  fs::create_symlink(a, folder.path() / "link");
  fs::create_directory(folder.path() / "sub");
  std::ofstream(a) << "there";
  for (const std::string& again : {a, (folder.path() / "sub/../a").string(), (folder.path() / "link").string()}) {
    for (const std::vector<std::string>& args :
         {std::vector<std::string>{"--two", again}, {"--from", again}, {again}}) {
      std::vector<std::string> all{"--one", a, "--force"};
      all.insert(all.end(), args.begin(), args.end());
      const Said said = pair(all);
      EXPECT_EQ(said.code, static_cast<int>(ExitCode::usage)) << again << ' ' << args.front();
      EXPECT_EQ(said.out, "");
      EXPECT_NE(said.err.find("are one file"), std::string::npos) << said.err;
    }
  }
}

TEST(Cli, FlagsReachTheCommandAndItKnowsWhichWereGiven) {
  const auto j = run({"echo", "hello", "--size=3", "--no-on", "--set", "a=b=c", "--seed", "7"}).json();
  EXPECT_EQ(j["size"], 3);
  EXPECT_EQ(j["on"], false);
  EXPECT_EQ(j["text"], "abc");
  EXPECT_EQ(j["settings"]["a"], "b=c");
  EXPECT_EQ(j["seed"], 7);
  EXPECT_EQ(j["given"], (nlohmann::json{"on", "seed", "size"}));
  EXPECT_EQ(run({"echo", "--size", "2"}).json()["given"], nlohmann::json{"size"});  // also when it is the default
  EXPECT_EQ(run({"echo", "--no-text"}).json()["text"], "");
  EXPECT_EQ(run({"echo", "--", "--size"}).json()["arguments"], nlohmann::json{"--size"});
}

TEST(Cli, NamesStandInTheirGroupsAndTheRestLast) {
  cli::Program program;
  program.registry.add<FailStage>();
  program.add<EchoCommand>();
  const auto titles = [&] {
    std::vector<std::string> all;
    for (const cli::Group& g : program.grouped()) {
      for (const std::string& name : g.members) all.push_back(g.title + ": " + name);
    }
    return all;
  };
  const std::string stage = program.registry.names().front();
  EXPECT_EQ(titles(), (std::vector<std::string>{"Commands: " + stage, "Commands: echo"}));
  program.groups = {{"Sounds", {"not-in-this-build", "echo"}}, {"Empty", {"gone"}}};
  EXPECT_EQ(titles(), (std::vector<std::string>{"Sounds: echo", "Others: " + stage}));
  program.groups.push_back({"Again", {"echo"}});
  EXPECT_THROW(static_cast<void>(program.grouped()), Error);
}

TEST(Cli, MistakesAreUsageAndNameTheRightWord) {
  for (const auto& [args, text] : std::vector<std::pair<std::vector<std::string>, std::string>>{
           {{"echo", "--sise", "1"}, "did you mean --size?"},
           {{"echo", "--size", "9"}, "between 0 mm and 5 mm"},
           {{"echo", "--size"}, "needs a value"},
           {{"echo", "--no-size"}, "no flag --no-size"},
           {{"echo", "a", "b"}, "takes [what]"},
           {{"ecko"}, "did you mean 'echo'?"},
           {{"fail"}, "takes <document.out> (1 name), but none was given"},
           {{"fail", "a", "b"}, "(1 name), but 2 were given"}}) {
    const Said said = run(args);
    EXPECT_EQ(said.code, 2) << text;
    EXPECT_NE(said.err.find(text), std::string::npos) << said.err;
    EXPECT_TRUE(said.out.empty());
  }
}

TEST(Cli, FailureIsJsonOnStandardOutputWithWhatWasFound) {
  const Folder at;
  const std::string out = (at.path() / "x.json").string();
  const Said said = run({"fail", out, "--json"});
  EXPECT_EQ(said.code, 4);
  EXPECT_EQ(said.json()["error"]["exit_code"], 4);
  EXPECT_EQ(said.json()["error"]["name"], "corrupt");
  EXPECT_EQ(said.json()["error"]["message"], "not taken");
  EXPECT_EQ(said.json()["error"]["advice"], "look");
  EXPECT_EQ(said.json()["verdict"]["status"], "refused");
  EXPECT_TRUE(fs::exists(at.path() / "x.json.verdict.json"));
  EXPECT_TRUE(run({"fail", out}).out.empty());
  EXPECT_EQ(run({"echo", "--json", "--size", "9"}).json()["error"]["exit_code"], 2);
}

TEST(Cli, WhatTheLibraryThrowsHasACodeToo) {
  const Folder at;
  const std::string out = (at.path() / "x.json").string();
  EXPECT_EQ(run({"fail", out, "--how", "permission"}).code, 6);
  EXPECT_EQ(run({"fail", out, "--how", "memory"}).code, 9);
  const Said defect = run({"fail", out, "--how", "defect"});
  EXPECT_EQ(defect.code, 1);
  EXPECT_NE(defect.err.find("please report it"), std::string::npos);
}

TEST(Cli, VersionNamesTheCommit) {
  const Said said = run({"--version"});
  EXPECT_EQ(said.code, 0);
  EXPECT_TRUE(said.out.starts_with("osteo " + std::string(program_version()) + "\n")) << said.out;
}

TEST(Cli, FactsAreForPeople) {
  using P = std::pair<std::string, std::string>;
  EXPECT_EQ(cli::fact_text("mask_volume_mm3", 511409.3), (P{"bone by the mask", "511.4 cm3"}));
  EXPECT_EQ(cli::fact_text("air_mm3", 411.04), (P{"air", "411 mm3"}));
  EXPECT_EQ(cli::fact_text("volume_change_percent", -0.00038076), (P{"difference", "less than 0.1 %"}));
  EXPECT_EQ(cli::fact_text("spacing_mm", 0.48828119999999997), (P{"spacing", "0.49 mm"}));
  EXPECT_EQ(cli::fact_text("distance_mm", 0.0031416), (P{"distance", "0.0031 mm"}));
  EXPECT_EQ(cli::fact_text("distance_mm", 0.0), (P{"distance", "0 mm"}));
  EXPECT_EQ(cli::fact_text("change_percent_per_50_hu", 4.26637), (P{"50 HU either way change bone by", "4.3 %"}));
  EXPECT_EQ(cli::fact_text("hu_min", std::int64_t{-1024}), (P{"lowest value", "-1024 HU"}));
  EXPECT_EQ(cli::fact_text("marching_cubes_distance_max_voxels", 0.17),
            (P{"marching cubes distance", "0.17 voxels, the most"}));
  EXPECT_EQ(cli::fact_text("facial nerve mm3", 12.5), (P{"facial nerve", "12.5 mm3"}));
  EXPECT_EQ(cli::fact_text("pieces", std::int64_t{36}), (P{"pieces", "36"}));
  EXPECT_EQ(cli::fact_text("watertight", true), (P{"watertight", "yes"}));
  EXPECT_EQ(cli::fact_text("hu", std::int64_t{3}), (P{"hu", "3"}));
}

// A stage's own --seed once hid the common one.
TEST(AllStages, NoFlagHidesACommonOne) {
  cli::Common::Params common;
  std::set<std::string> taken{"xml", "describe", "help", "set"};
  for (const auto& f : fields_of<cli::Common>(common)) taken.emplace(f.doc.name);
  const Registry registry = osteo_stages();
  for (const auto& name : registry.names()) {
    const auto stage = registry.make(name);
    std::set<std::string> own;
    for (const auto& f : stage->fields()) {
      EXPECT_FALSE(taken.contains(std::string(f.doc.name))) << name << " --" << f.doc.name;
      EXPECT_TRUE(own.emplace(f.doc.name).second) << name << " has --" << f.doc.name << " twice";
    }
    for (const Port& p : stage->info().inputs) EXPECT_FALSE(own.contains(p.name)) << name << " " << p.name;
  }
}

TEST(Cli, ADocumentGoesToAPipeAndAMeshSaysWhyNot) {
  const auto said = [](std::vector<std::string> args) {
    cli::Program program;
    program.registry = osteo_stages();
    args.insert(args.begin(), "osteo");
    std::vector<char*> argv;
    for (auto& a : args) argv.push_back(a.data());
    std::ostringstream out, err;
    Said s;
    s.code = cli::run_program(program, static_cast<int>(argv.size()), argv.data(), out, err);
    s.out = out.str();
    s.err = err.str();
    return s;
  };
  const Folder at;
  const std::string curve = (at.path() / "c.csv").string(), path = (at.path() / "p.csv").string();
  std::ofstream(curve) << "0 0 0\n10 0 0\n";
  std::ofstream(path) << "1 1 0\n9 1 0\n";
  const Said file = said({"virtual-fixture", curve, path, (at.path() / "a.json").string()});
  ASSERT_EQ(file.code, 0) << file.err;
  const Said pipe = said({"virtual-fixture", curve, path, "-"});
  ASSERT_EQ(pipe.code, 0) << pipe.err;
  EXPECT_EQ(pipe.out, read_text(at.path() / "a.json"));

  std::istringstream from("1 1 0\n9 1 0\n");
  std::streambuf* const own = std::cin.rdbuf(from.rdbuf());
  const Said through = said({"virtual-fixture", curve, "-", "-"});
  std::istringstream two("0 0 0\n10 0 0\n");
  std::cin.rdbuf(two.rdbuf());
  const Said twice = said({"virtual-fixture", "-", "-", "-"});
  std::cin.rdbuf(own);
  EXPECT_EQ(through.out, pipe.out) << through.err;
  EXPECT_NE(twice.err.find("one standard input"), std::string::npos) << twice.err;
  EXPECT_NE(said({"virtual-fixture", curve, path, "-", "--json"}).err.find("both want standard output"),
            std::string::npos);
  const Said mesh = said({"mesh-repair", "in.ply", "-"});
  EXPECT_EQ(mesh.code, 2);
  EXPECT_NE(mesh.err.find("cannot go through a pipe"), std::string::npos) << mesh.err;
  const Said volume = said({"threshold", "-", "m.nrrd"});
  EXPECT_EQ(volume.code, 2);
  EXPECT_NE(volume.err.find("cannot come through a pipe"), std::string::npos) << volume.err;
}

// Of version 0.1: still accepted, said, and never a name that is in use.
TEST(AllStages, OldNamesAreAcceptedAndSaid) {
  const auto said = [](std::vector<std::string> args) {
    cli::Program program;
    program.registry = osteo_stages();
    args.insert(args.begin(), "osteo");
    std::vector<char*> argv;
    for (auto& a : args) argv.push_back(a.data());
    std::ostringstream out, err;
    Said s;
    s.code = cli::run_program(program, static_cast<int>(argv.size()), argv.data(), out, err);
    s.out = out.str();
    s.err = err.str();
    return s;
  };
  const Folder at;
  const std::string curve = (at.path() / "c.csv").string(), path = (at.path() / "p.csv").string();
  std::ofstream(curve) << "0 0 0\n10 0 0\n";
  std::ofstream(path) << "1 1 0\n9 1 0\n";
  const Said old = said({"curve", curve, path, (at.path() / "a.json").string()});
  EXPECT_EQ(old.code, 0) << old.err;
  EXPECT_NE(old.err.find("'curve' is now called 'virtual-fixture'"), std::string::npos) << old.err;
  const Said now = said({"virtual-fixture", curve, path, (at.path() / "b.json").string()});
  EXPECT_EQ(now.code, 0) << now.err;
  EXPECT_EQ(now.err.find("now called"), std::string::npos);
  EXPECT_EQ(read_text(at.path() / "a.json"), read_text(at.path() / "b.json"));
  EXPECT_EQ(said({"help", "skin"}).out, said({"help", "embed-surface"}).out);

  const Said flag = said({"pieces", "none.vdb", "p.json", "--least-mm3", "-1"});
  EXPECT_EQ(flag.code, 2);
  EXPECT_NE(flag.err.find("--min-volume-mm3 is -1"), std::string::npos) << flag.err;
  EXPECT_NE(said({"pieces", "none.vdb", "p.json", "--least-mm3", "5"}).err.find("'--least-mm3' is now called"),
            std::string::npos);
  EXPECT_NE(said({"mesh-info", "--least-mm3", "5"}).err.find("there is no flag --least-mm3"), std::string::npos);

  const Registry registry = osteo_stages();
  const auto names = registry.names();
  for (const OldName& n : old_command_names()) {
    EXPECT_EQ(std::count(names.begin(), names.end(), n.old), 0) << n.old;
    EXPECT_EQ(current_command(n.current), n.current) << "renamed twice";
  }
}

TEST(AllStages, SeedOfTheCommandLineIsTheSeedOfTheResult) {
  cli::Program program;
  program.registry = osteo_stages();
  const Folder at;
  std::vector<std::string> hashes;
  for (const char* seed : {"1", "2"}) {
    const fs::path out = at.path() / (std::string(seed) + ".nrrd");
    std::vector<std::string> args{"osteo",        "phantom", out.string(), "--region", "temporal",
                                  "--spacing-mm", "4",       "--seed",     seed,       "--quiet"};
    std::vector<char*> argv;
    for (auto& a : args) argv.push_back(a.data());
    std::ostringstream said, err;
    ASSERT_EQ(cli::run_program(program, static_cast<int>(argv.size()), argv.data(), said, err), 0) << err.str();
    const auto p = nlohmann::json::parse(read_text(provenance_path(out)));
    EXPECT_EQ(p["seed"], std::stoi(seed));
    hashes.push_back(p["output_hash"]);
  }
  EXPECT_NE(hashes[0], hashes[1]);
}

}  // namespace
}  // namespace osteo
