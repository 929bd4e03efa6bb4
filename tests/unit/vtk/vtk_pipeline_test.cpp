// A pipeline file as a pipeline of VTK: what runs and what does not, what is written, how it ends early; of toy stages
// that count.
#include "osteo/app/vtk/pipeline.h"

#include <gtest/gtest.h>
#include <vtkAlgorithmOutput.h>
#include <vtkCallbackCommand.h>
#include <vtkImageData.h>
#include <vtkImageShiftScale.h>
#include <vtkNew.h>

#include <fstream>

#include "osteo/app/vtk/vtkOsteoDataObject.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/imaging/io/volume_io.h"
#include "osteo/imaging/io/vtk_data.h"
#include "scratch.h"

namespace osteo {
namespace {

std::map<std::string, int> g_runs;  // by the parameter "called"

Image image_of(int value) {
  Frame f;
  f.dims = {3, 2, 2};
  const auto voxels = make_voxels<std::int16_t>(f.voxel_count());
  std::fill_n(voxels.get(), f.voxel_count(), static_cast<std::int16_t>(value));
  return {f, voxels};
}

struct MakeStage {
  struct Params {
    std::string called = "make";
    int value = 1;
  };
  static void describe(Params& p, auto& visit) {
    visit({"called", "for the count"}, p.called);
    visit({"value", "of all voxels", "", 0, 100}, p.value);
  }
  static StageInfo info() {
    return {
        .name = "make",
        .synopsis = "an image",
        .description = {},
        .inputs = {},
        .outputs = {{"image", {DataKind::image}, "image"}, {"seen", {DataKind::document}, "its surroundings", true}},
        .references = {},
        .example = {}};
  }
  static std::vector<Data> run(const Params& p, std::span<const Data>, const Context& context) {
    ++g_runs[p.called];
    context.report("value", std::int64_t{p.value});
    return {image_of(p.value), Document{"{\"seed\": " + std::to_string(context.seed) + "}"}};
  }
};

struct AddStage {
  struct Params {
    std::string called = "add";
    int add = 0;
    bool refuse = false;
  };
  static void describe(Params& p, auto& visit) {
    visit({"called", "for the count"}, p.called);
    visit({"add", "to all voxels", "", 0, 100}, p.add);
    visit({"refuse", "fails with a finding"}, p.refuse);
  }
  static StageInfo info() {
    return {
        .name = "add",
        .synopsis = "adds",
        .description = {},
        .inputs = {{"image", {DataKind::image}, "image"}, {"other", {DataKind::image}, "added too", true}},
        .outputs = {{"image", {DataKind::image}, "image"}, {"finding", {DataKind::document}, "what was found", true}},
        .references = {},
        .example = {}};
  }
  static std::vector<Data> run(const Params& p, std::span<const Data> in, const Context& context) {
    ++g_runs[p.called];
    if (p.refuse)
      throw ErrorWithDocument(Error(ExitCode::failed, "refused", "do not"), "finding", {R"({"status": "refused"})"});
    for (int n = 0; n <= 4; ++n) context.progress(n / 4.0, "adding");
    int sum = std::get<Image>(in[0]).span()[0] + p.add;
    if (const auto* other = std::get_if<Image>(&in[1])) sum += other->span()[0];
    return {image_of(sum), Data()};
  }
};

struct NameStage {
  struct Params {};
  static void describe(Params&, auto&) {}
  static StageInfo info() {
    return {.name = "name",
            .synopsis = "labels with a name",
            .description = {},
            .inputs = {},
            .outputs = {{"labels", {DataKind::labels}, "labels"}},
            .references = {},
            .example = {}};
  }
  static std::vector<Data> run(const Params&, std::span<const Data>, const Context&) {
    Labels labels;
    labels.frame.dims = {2, 2, 2};
    const auto voxels = make_voxels<std::uint8_t>(8);
    std::fill_n(voxels.get(), 8, std::uint8_t{1});
    labels.voxels = voxels;
    labels.structures = {{1, "facial nerve", {255, 255, 0}}};
    return {labels};
  }
};

struct SayStage {
  struct Params {};
  static void describe(Params&, auto&) {}
  static StageInfo info() {
    return {.name = "say",
            .synopsis = "names of labels",
            .description = {},
            .inputs = {{"labels", {DataKind::labels}, "labels"}},
            .outputs = {{"names", {DataKind::document}, "names"}},
            .references = {},
            .example = {}};
  }
  static std::vector<Data> run(const Params&, std::span<const Data> in, const Context&) {
    const auto& labels = std::get<Labels>(in[0]);
    return {Document{labels.structures.empty() ? "none" : labels.structures[0].name}};
  }
};

const Registry& registry() {
  static const Registry value = [] {
    Registry r;
    r.add<MakeStage>();
    r.add<AddStage>();
    r.add<NameStage>();
    r.add<SayStage>();
    return r;
  }();
  return value;
}

// make -> a -> b and make -> c, both into sum; b and sum are written.
constexpr const char* kGraph = R"({
  "osteotome": 1,
  "variables": { "out": {} },
  "stages": [
    { "id": "make", "stage": "make" },
    { "id": "a", "stage": "add", "in": { "image": "make" }, "params": { "called": "a", "add": 10 } },
    { "id": "b", "stage": "add", "in": { "image": "a" }, "params": { "called": "b", "add": 20 },
      "out": { "image": "${out}/b.nrrd", "finding": "${out}/b.json" } },
    { "id": "c", "stage": "add", "in": { "image": "make" }, "params": { "called": "c", "add": 3 } },
    { "id": "sum", "stage": "add", "in": { "image": "b", "other": "c" }, "params": { "called": "sum" }, "out": { "image": "${out}/sum.nrrd" } }
  ]
})";

class VtkPipelineTest : public testing::Test {
 protected:
  VtkPipelineTest() {
    g_runs.clear();
    std::ofstream(file()) << kGraph;
  }
  [[nodiscard]] fs::path file() const { return folder / "graph.json"; }
  [[nodiscard]] std::map<std::string, std::string> settings(std::map<std::string, std::string> more = {}) const {
    more["out"] = folder.path().string();
    return more;
  }
  [[nodiscard]] VtkPipeline load(bool overwrite = false,
                                 const std::map<std::string, std::string>& more = {{"b.add", "20"}}) const {
    Pipeline p = parse_pipeline(kGraph, settings(more));
    for (PipelineNode& n : p.nodes) n.outputs.erase("finding");  // made only on failure
    return {p, registry(), {.overwrite = overwrite}};
  }
  [[nodiscard]] static int value(const VtkPipeline& p, const std::string& id) {
    return image_from_vtk(vtkImageData::SafeDownCast(p.step(id)->GetOutputDataObject(0))).span()[0];
  }
  [[nodiscard]] int written(const std::string& name) const { return load_image(folder / name).span()[0]; }
  static void expect_runs(const std::map<std::string, int>& wanted) { EXPECT_EQ(g_runs, wanted); }

  test::ScratchFolder folder;
};

TEST_F(VtkPipelineTest, OneOutputRunsWhatItNeedsAndNothingElse) {
  VtkPipeline p = load();
  EXPECT_TRUE(g_runs.empty());
  p.update("b");
  EXPECT_EQ(value(p, "b"), 31);
  expect_runs({{"make", 1}, {"a", 1}, {"b", 1}});
  p.update("b");
  expect_runs({{"make", 1}, {"a", 1}, {"b", 1}});
  p.update("sum");
  EXPECT_EQ(value(p, "sum"), 35);
  expect_runs({{"make", 1}, {"a", 1}, {"b", 1}, {"c", 1}, {"sum", 1}});
  EXPECT_FALSE(fs::exists(folder / "b.nrrd"));  // nobody asked a writer
}

TEST_F(VtkPipelineTest, AChangedParameterRunsWhatComesAfterItAndNothingElse) {
  VtkPipeline p = load();
  p.update("sum");
  ASSERT_TRUE(p.step("c")->SetParameter("add", "5"));
  p.update("sum");
  EXPECT_EQ(value(p, "sum"), 37);
  expect_runs({{"make", 1}, {"a", 1}, {"b", 1}, {"c", 2}, {"sum", 2}});
  ASSERT_TRUE(p.step("b")->SetParameter("add", "20"));  // as it was
  p.update("sum");
  expect_runs({{"make", 1}, {"a", 1}, {"b", 1}, {"c", 2}, {"sum", 2}});
  ASSERT_TRUE(p.step("make")->SetParameter("value", "2"));
  p.update("a");
  expect_runs({{"make", 2}, {"a", 2}, {"b", 1}, {"c", 2}, {"sum", 2}});
  p.update("sum");
  EXPECT_EQ(value(p, "sum"), 2 + 10 + 20 + 2 + 5);
  expect_runs({{"make", 2}, {"a", 2}, {"b", 2}, {"c", 3}, {"sum", 3}});
}

TEST_F(VtkPipelineTest, FiltersOfVtkPullAndStandBetween) {
  VtkPipeline p = load();
  vtkNew<vtkImageShiftScale> shift;  // c + 100, in place of c
  shift->SetInputConnection(p.output("c"));
  shift->SetShift(100);
  p.step("sum")->SetInputConnection(p.step("sum")->GetInputPortIndex("other"), shift->GetOutputPort());
  vtkNew<vtkImageShiftScale> last;
  last->SetInputConnection(p.output("sum", "image"));
  last->SetShift(1000);
  last->Update();
  EXPECT_EQ(image_from_vtk(last->GetOutput()).span()[0], 1135);
  EXPECT_THROW(static_cast<void>(p.output("sum", "imag")), Error);
  try {
    static_cast<void>(p.step("sun"));
    FAIL();
  } catch (const Error& e) {
    EXPECT_NE(e.advice().find("'sum'"), std::string::npos);
  }
}

TEST_F(VtkPipelineTest, WritersWriteOnceAndAgainWhatChanged) {
  VtkPipeline p = load();
  p.write();
  EXPECT_EQ(written("b.nrrd"), 31);
  EXPECT_EQ(written("sum.nrrd"), 35);
  const auto runs = g_runs;
  const auto b = fs::last_write_time(folder / "b.nrrd"), sum = fs::last_write_time(folder / "sum.nrrd");
  p.write();
  EXPECT_EQ(g_runs, runs);
  EXPECT_EQ(fs::last_write_time(folder / "sum.nrrd"), sum);
  ASSERT_TRUE(p.step("c")->SetParameter("add", "4"));
  p.write();
  EXPECT_EQ(written("sum.nrrd"), 36);
  EXPECT_EQ(fs::last_write_time(folder / "b.nrrd"), b);
}

TEST_F(VtkPipelineTest, WhatAPersonHasThereIsNotReplacedUnasked) {
  std::ofstream(folder / "sum.nrrd") << "mine";
  VtkPipeline p = load();
  try {
    p.write();
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::cannot_write);
    EXPECT_NE(std::string(e.what()).find("stage 'sum'"), std::string::npos) << e.what();
  }
  EXPECT_EQ(read_text(folder / "sum.nrrd"), "mine");
  EXPECT_EQ(written("b.nrrd"), 31);
  fs::remove(folder / "sum.nrrd");
  p.write();  // tried again
  EXPECT_EQ(written("sum.nrrd"), 35);
  std::ofstream(folder / "sum.nrrd") << "changed since";
  ASSERT_TRUE(p.step("c")->SetParameter("add", "4"));
  EXPECT_THROW(p.write(), Error);
  EXPECT_EQ(read_text(folder / "sum.nrrd"), "changed since");
  VtkPipeline q = load(true);
  q.write();
  EXPECT_EQ(written("sum.nrrd"), 35);
}

TEST_F(VtkPipelineTest, ErrorsNameFileLineAndTheStepThatFailed) {
  const auto said = [&](const std::map<std::string, std::string>& more, const char* id) {
    try {
      load_vtk_pipeline(file(), settings(more), registry()).update(id);
    } catch (const Error& e) {
      return std::string(e.what()) + " | " + e.advice();
    }
    return std::string();
  };
  const std::string name = "'" + file().string() + "' line ";
  EXPECT_EQ(said({{"a.refuse", "true"}}, "sum"), name + "6: stage 'a': refused | do not");
  EXPECT_EQ(said({{"b.refuse", "true"}}, "b"), name + "7: stage 'b': refused | do not");
  EXPECT_EQ(said({{"b.refuse", "true"}}, "c"), "");
  EXPECT_EQ(said({{"c.ad", "1"}}, "c").find(name.substr(0, name.size() - 6)), 0U);
  EXPECT_NE(said({{"c.ad", "1"}}, "c").find("line 9: stage 'c'"), std::string::npos) << said({{"c.ad", "1"}}, "c");
  EXPECT_NE(said({{"sum.add", "1000"}}, "b").find("line 10: stage 'sum'"), std::string::npos)
      << said({{"sum.add", "1000"}}, "b");
  std::ofstream(file()) << R"({ "osteotome": 1, "stages": [
    { "id": "here", "stage": "add", "in": { "image": { "file": "/nowhere/x.nrrd" } } } ] })";
  try {
    load_vtk_pipeline(file(), {}, registry()).update("here");
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::no_input);
    EXPECT_NE(std::string(e.what()).find("line 2: stage 'here'"), std::string::npos) << e.what();
  }
}

TEST_F(VtkPipelineTest, AFailureIsOverOnceItsCauseIs) {
  VtkPipeline p = load(false, {{"a.refuse", "true"}});
  for (int n = 0; n < 2; ++n) EXPECT_THROW(p.update("sum"), ErrorWithDocument) << n;
  EXPECT_EQ(g_runs["b"], 0);
  EXPECT_EQ(g_runs["sum"], 0);
  ASSERT_TRUE(p.step("a")->SetParameter("refuse", "false"));
  p.update("sum");
  EXPECT_EQ(value(p, "sum"), 35);
}

TEST_F(VtkPipelineTest, ProgressIsToldAndAbortLeavesNoFile) {
  VtkPipeline p = load();
  std::vector<double> reported;
  vtkNew<vtkCallbackCommand> observer;
  observer->SetClientData(&reported);
  observer->SetCallback([](vtkObject* caller, unsigned long, void* data, void*) {
    auto& list = *static_cast<std::vector<double>*>(data);
    list.push_back(static_cast<vtkAlgorithm*>(caller)->GetProgress());
    if (list.size() == 2) static_cast<vtkAlgorithm*>(caller)->AbortExecuteOn();
  });
  p.step("sum")->AddObserver(vtkCommand::ProgressEvent, observer);
  try {
    p.write();
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::cancelled);
  }
  EXPECT_EQ(reported, (std::vector<double>{0, 0.25}));
  EXPECT_TRUE(fs::exists(folder / "b.nrrd"));
  std::vector<std::string> left;
  for (const auto& entry : fs::directory_iterator(folder.path())) left.push_back(entry.path().filename().string());
  std::sort(left.begin(), left.end());
  EXPECT_EQ(left, (std::vector<std::string>{"b.nrrd", "graph.json"}));
  p.write();  // an abort is over when one asks again
  EXPECT_EQ(written("sum.nrrd"), 35);
}

TEST_F(VtkPipelineTest, WhatVtkHasNoPlaceForGoesAlong) {
  const Pipeline two = parse_pipeline(
      R"({ "osteotome": 1, "stages": [ { "stage": "name" }, { "stage": "say", "in": { "labels": "name" } } ] })", {});
  VtkPipeline p(two, registry());
  const auto said = [&] {
    p.update("say");
    return std::get<Document>(vtkOsteoDataObject::SafeDownCast(p.step("say")->GetOutputDataObject(0))->GetValue()).json;
  };
  EXPECT_EQ(said(), "facial nerve");
  // Of this object as it is: a copy and a changed one are only what VTK shows.
  auto* const shown = vtkImageData::SafeDownCast(p.step("name")->GetOutputDataObject(0));
  EXPECT_NE(vtkOsteoDataObject::GetAttached(shown), nullptr);
  vtkNew<vtkImageData> copy;
  copy->ShallowCopy(shown);
  EXPECT_EQ(vtkOsteoDataObject::GetAttached(copy), nullptr);
  p.step("say")->SetInputDataObject(0, copy);
  EXPECT_EQ(said(), "none");
  shown->Modified();
  EXPECT_EQ(vtkOsteoDataObject::GetAttached(shown), nullptr);
}

TEST_F(VtkPipelineTest, TheSeedArrives) {
  const Pipeline one = parse_pipeline(R"({ "osteotome": 1, "stages": [ { "stage": "make" } ] })", {});
  VtkPipeline p(one, registry(), {.seed = 7});
  const auto seed = [&] {
    p.update("make");
    return std::get<Document>(vtkOsteoDataObject::SafeDownCast(p.step("make")->GetOutputDataObject(1))->GetValue())
        .json;
  };
  EXPECT_EQ(seed(), "{\"seed\": 7}");
  p.step("make")->SetSeed(8);
  EXPECT_EQ(seed(), "{\"seed\": 8}");
}

TEST_F(VtkPipelineTest, TheEngineKeepsWhatIsFreshAndReadsIt) {
  const auto run = [&](const std::map<std::string, std::string>& more, bool reuse) {
    Pipeline p = parse_pipeline(kGraph, settings(more));
    for (PipelineNode& n : p.nodes) n.outputs.erase("finding");
    return run_pipeline(p, registry(), {.reuse = reuse}, {}, vtk_engine(registry()));
  };
  const auto first = run({}, false);
  EXPECT_EQ(std::get<std::int64_t>(first[0].report.at(0).second), 1);
  expect_runs({{"make", 1}, {"a", 1}, {"b", 1}, {"c", 1}, {"sum", 1}});
  const auto again = run({{"c.add", "4"}}, true);
  EXPECT_EQ(written("sum.nrrd"), 36);
  expect_runs({{"make", 2}, {"a", 1}, {"b", 1}, {"c", 2}, {"sum", 2}});  // b comes from its file
  EXPECT_TRUE(again[1].reused);
  EXPECT_THROW(run({}, false), Error);  // they exist
}

TEST_F(VtkPipelineTest, TheEngineFailsAndStopsAsTheOther) {
  const auto engines = {MakeEngine(), vtk_engine(registry())};
  for (const MakeEngine& engine : engines) {
    for (const char* const name : {"b.nrrd", "b.json", "sum.nrrd"}) fs::remove(folder / name);
    try {
      run_pipeline(parse_pipeline(kGraph, settings({{"b.refuse", "true"}})), registry(), {}, {}, engine);
      FAIL();
    } catch (const ErrorWithDocument& e) {
      EXPECT_STREQ(e.what(), "stage 'b': refused");
    }
    EXPECT_EQ(read_text(folder / "b.json"), R"({"status": "refused"})");
    EXPECT_FALSE(fs::exists(folder / "b.nrrd"));
    fs::remove(folder / "b.json");
    Pipeline p = parse_pipeline(kGraph, settings());
    for (PipelineNode& n : p.nodes) n.outputs.erase("finding");
    std::atomic<bool> stop{false};
    Context context;
    context.set_cancel_flag(&stop);
    std::vector<double> reported;
    context.on_progress([&](double fraction, std::string_view) {
      reported.push_back(fraction);
      stop = fraction > 0.9;
    });
    try {
      run_pipeline(p, registry(), {}, context, engine);
      FAIL();
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ExitCode::cancelled);
    }
    EXPECT_TRUE(std::is_sorted(reported.begin(), reported.end()));
    EXPECT_TRUE(fs::exists(folder / "b.nrrd"));
    EXPECT_FALSE(fs::exists(folder / "sum.nrrd"));
  }
}

}  // namespace
}  // namespace osteo
