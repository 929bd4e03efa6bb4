// Every file in pipelines/, run by both engines on made data: the same files, byte for byte, the same records and the
// same report. A new file is found by itself and needs a line in the table.
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <regex>

#include "folders.h"
#include "osteo/app/stages/registry.h"
#include "osteo/app/vtk/pipeline.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/json_document.h"
#include "osteo/imaging/pipeline/engine.h"
#include "osteo/imaging/pipeline/report_json.h"
#include "scratch.h"

namespace osteo {
namespace {

using Settings = std::map<std::string, std::string>;

const Registry& registry() {
  static const Registry value = osteo_stages();
  return value;
}

// What the pipelines read, made once: a scan as volume and as DICOM, bone of it.
struct Inputs {
  test::ScratchFolder folder;
  Inputs() {
    const std::string f = folder.path().string();
    run(R"({ "osteotome": 1, "stages": [
      { "id": "p", "stage": "phantom", "params": { "region": "temporal", "spacing_mm": 1, "individual": 1 }, "out": { "image": ")" +
        f + R"(/ct.nrrd" } },
      { "id": "coarse", "stage": "phantom", "params": { "region": "temporal", "spacing_mm": 2 }, "out": { "image": ")" +
        f + R"(/dicom" } },
      { "id": "mask", "stage": "threshold", "in": { "image": "coarse" }, "params": { "lower": 500 } },
      { "id": "bone", "stage": "resample", "in": { "image": "coarse", "mask": "mask" }, "params": { "lower": 500, "spacing_mm": 2 },
        "out": { "bone": ")" +
        f + R"(/bone.vdb" } },
      { "id": "surface", "stage": "surface", "in": { "bone": "bone" }, "out": { "surface": ")" +
        f + R"(/bone.ply" } } ] })");
  }
  static void run(const std::string& text) { run_pipeline(parse_pipeline(text, {}), registry(), {}, {}); }
};

const Inputs& inputs() {
  static const Inputs value;
  return value;
}

std::map<std::string, Settings> table() {
  const std::string f = inputs().folder.path().string(), source = source_folder().string();
  const std::string ct = f + "/ct.nrrd", gear = source + "/testdata/gear.stl";
  return {
      {"temporal-bone", {{"source", ct}, {"lower", "500"}, {"spacing_mm", "1.5"}}},
      {"ear-structures", {{"source", ct}, {"lower", "500"}, {"spacing_mm", "1.5"}, {"what", "ear_canal,air_cells"}}},
      {"region-of-interest",
       {{"source", ct},
        {"lower", "500"},
        {"spacing_mm", "1.5"},
        {"fine_mm", "0.5"},
        {"fine_centre_mm", "62,16,-27"},
        {"fine_box_mm", "12,12,12"}}},
      {"large-scan", {{"source", f + "/dicom"}, {"lower", "500"}, {"spacing_mm", "2"}}},
      {"split-head", {{"bone", f + "/bone.vdb"}}},
      {"bone-stiffness",
       {{"ct", ct},
        {"problem", source + "/pipelines/tissue/pressed-bone.json"},
        {"lower", "500"},
        {"spacing_mm", "1.5"},
        {"edge_mm", "8"}}},
      {"tissue-mesh", {{"surface", f + "/bone.ply"}, {"spacing_mm", "6"}}},
      {"calibrate-tissue",
       {{"surface", gear}, {"problem", source + "/pipelines/tissue/gear.json"}, {"spacing_mm", "9"}}},
      {"thesis-gear",
       {{"surface", source + "/testdata/gear-2m.stl"},
        {"problem", source + "/pipelines/tissue/thesis-gear.json"},
        {"spacing_mm", "200"}}},
      {"thesis-cube",
       {{"surface", source + "/testdata/cube.stl"},
        {"problem", source + "/pipelines/tissue/two-materials.json"},
        {"spacing_mm", "50"},
        {"grid", "2"},
        {"grid_z", "2"}}},
  };
}

std::string text_of(const fs::path& file) {
  return read_text(file);
}

// Of pipelines/ and what is below, all that 'osteo run' takes.
std::vector<fs::path> pipeline_files() {
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(source_folder() / "pipelines")) {
    if (entry.path().extension() == ".json" && text_of(entry.path()).find("\"osteotome\": 1") != std::string::npos)
      files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

std::string name_of(const testing::TestParamInfo<fs::path>& info) {
  std::string name = info.param.stem().string();
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
}

// A file's content, without how long it took: durations of records and of documents that tell them.
std::string content(const fs::path& file, const std::string& folder = {}) {
  std::string text = text_of(file);
  if (file.extension() == ".svg")
    return std::regex_replace(text, std::regex(R"re(solves, [0-9.e+-]+ s: )re"), "solves: ");
  if (file.extension() != ".json") return text;
  for (std::size_t at = folder.empty() ? std::string::npos : text.find(folder); at != std::string::npos;
       at = text.find(folder))
    text.erase(at, folder.size());
  return std::regex_replace(text, std::regex(R"re("(seconds|peak_memory_mb)": [-+.0-9e]+)re"), "\"$1\": 0");
}

bool is_timed(const fs::path& record) {
  fs::path file = record;
  file.replace_extension().replace_extension();  // x.json.prov.json
  return text_of(file) != content(file);
}

class EveryPipeline : public testing::TestWithParam<fs::path> {};

TEST_P(EveryPipeline, GivesTheSameBytesByBothEngines) {
  const std::string text = text_of(GetParam());
  const auto known = table();
  const auto line = known.find(GetParam().stem().string());
  ASSERT_NE(line, known.end()) << GetParam()
                               << " has no line in the table of this test: with which made data can it run?";
  const test::ScratchFolder by_stages, by_vtk;
  int asked = 0;
  const auto counted = [&](const Pipeline& to_run) {
    ++asked;
    return vtk_engine(registry())(to_run);
  };
  const auto run = [&](const test::ScratchFolder& out, const MakeEngine& engine) {
    Settings settings = line->second;
    for (const PipelineVariable& v : pipeline_variables(text)) {
      if (v.name == "out" || v.name == "case") settings[v.name] = out.path().string();
    }
    return run_pipeline(parse_pipeline(text, settings), registry(), {}, {}, engine);
  };
  const auto first = run(by_stages, {}), second = run(by_vtk, counted);
  EXPECT_EQ(asked, 1);
  ASSERT_EQ(first.size(), second.size());
  for (std::size_t n = 0; n < first.size(); ++n) {
    EXPECT_EQ(first[n].id, second[n].id);
    EXPECT_EQ(first[n].key, second[n].key);
    EXPECT_EQ(first[n].params, second[n].params);
    Report a = first[n].report, b = second[n].report;
    const auto timed = [](const auto& fact) {
      return fact.first == "finer_truth_estimate_s" || fact.first == "seconds";
    };
    std::erase_if(a, timed);
    std::erase_if(b, timed);
    EXPECT_EQ(a, b) << first[n].id;
  }
  const auto files = hash_files(by_stages.path()), others = hash_files(by_vtk.path());
  ASSERT_EQ(files.size(), others.size());
  std::size_t outputs = 0;
  for (const auto& [name, hash] : files) {
    ASSERT_TRUE(others.contains(name)) << name;
    const bool record = name.ends_with(".prov.json");
    outputs += record ? 0 : 1;
    if (hash == others.at(name)) continue;
    std::string a = content(by_stages / name, by_stages.path().string()),
                b = content(by_vtk / name, by_vtk.path().string());
    if (record && is_timed(by_stages / name)) {
      const std::regex hash_of(R"re("output_hash": "[0-9a-f]+")re");
      a = std::regex_replace(a, hash_of, "");
      b = std::regex_replace(b, hash_of, "");
    }
    EXPECT_TRUE(a == b) << name << (record ? ":\n" + a + "\n" + b : "");
  }
  EXPECT_GE(outputs, 3U);
}

INSTANTIATE_TEST_SUITE_P(File, EveryPipeline, testing::ValuesIn(pipeline_files()), name_of);

}  // namespace
}  // namespace osteo
