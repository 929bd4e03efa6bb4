// Every stage of osteo as a VTK filter: fed through VTK's own data sets it must give what the stage gives by itself,
// bit for bit, and its images must be what their information announces. A new stage is tried by itself, with inputs of
// the first kind that its ports take; one that needs parameters, a document or a file has a line in the table.
#include <gtest/gtest.h>
#include <unistd.h>
#include <vtkExecutive.h>
#include <vtkImageData.h>
#include <vtkImageThreshold.h>
#include <vtkInformation.h>
#include <vtkNew.h>
#include <vtkPolyData.h>
#include <vtkSphereSource.h>
#include <vtkStreamingDemandDrivenPipeline.h>
#include <vtkTrivialProducer.h>
#include <vtkUnstructuredGrid.h>

#include <fstream>

#include "edit.h"
#include "folders.h"
#include "osteo/app/stages/mesh.h"
#include "osteo/app/stages/registry.h"
#include "osteo/app/vtk/vtkOsteoDataObject.h"
#include "osteo/app/vtk/vtkOsteoStage.h"
#include "osteo/core/base/files.h"
#include "osteo/geometry/grid/resample.h"
#include "osteo/imaging/dicom/save_series.h"
#include "osteo/imaging/image/phantom.h"
#include "osteo/imaging/image/threshold.h"
#include "osteo/imaging/io/vtk_data.h"
#include "osteo/simulation/tissue/calibrate.h"

namespace osteo {
namespace {

struct Recipe {
  std::map<std::string, std::string> params;
  std::map<std::string, std::string> texts;  // port -> a document, or the content of a file that it reads
  std::vector<std::string> also;             // optional inputs that are connected too
  std::vector<std::string> timed = {};       // outputs that hold durations: only that they are there
};

constexpr const char* kProblem = R"({"osteotome_tissue": 1, "material": {"young_kpa": 10, "poisson": 0.4},
  "fixed": [{"box_mm": [[-20, -20, -20], [20, 20, -4]]}], "loads": [{"name": "pull", "forces": [{"at_mm": [0, 0, 8], "radius_mm": 8, "total_n": [0, 0, 0.1]}]}]})";

// The ball, sawn beside its middle.
constexpr const char* kPlan = R"({"osteotome_surgical_plan": 1, "unit": "mm",
  "planes": [{"name": "a", "bone": "ball", "at_mm": [0, 0, 1], "normal": [0, 0, 1], "kerf_mm": 1, "waste_ahead": true}],
  "fragments": [{"name": "rest", "bone": "ball", "planes": ["a"], "rotation_rows": [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
                 "shift_mm": [0, 0, 0]}]})";

// The ball of the table's problem, let go: about its own frequency.
std::string plucked() {
  std::string csv = "time_s,u_mm\n";
  for (int n = 0; n < 60; ++n) {
    const double t = 0.0025 * n;
    csv += std::to_string(t) + "," + std::to_string(std::exp(-10 * t) * std::cos(2 * 3.14159265 * 40 * t)) + "\n";
  }
  return csv;
}

const std::map<std::string, Recipe>& table() {
  static const std::map<std::string, Recipe> value{
      {"import-bone", {{{"lower", "500"}, {"spacing_mm", "2"}}, {}, {}}},
      {"crop", {{{"region", "box"}, {"centre_mm", "60,20,-20"}, {"size_mm", "30,24,20"}}, {}, {"labels"}}},
      {"threshold", {{{"lower", "500"}}, {}, {}}},
      {"resample", {{{"lower", "500"}, {"spacing_mm", "2"}}, {}, {"mask"}}},
      {"distance", {{{"resolution", "16"}}, {}, {}}},
      {"distance-at", {{}, {{"points", "0 0 0\n12 0 0\n"}}, {}}},
      {"voxelize", {{{"resolution", "20"}}, {}, {}}},
      {"tetrahedralize", {{{"method", "grid"}, {"spacing_mm", "4"}}, {}, {}}},
      {"bone-stiffness", {{}, {{"problem", kProblem}}, {}}},
      {"fem", {{}, {{"problem", kProblem}}, {}, {"report"}}},
      {"calibrate", {{}, {{"problem", kProblem}}, {}, {"constants", "course"}}},
      {"simulate", {{{"seconds", "0.02"}}, {{"problem", kProblem}}, {}, {"report"}}},
      {"fit-damping", {{{"at_mm", "0,0,10"}}, {{"problem", kProblem}, {"motion", plucked()}}, {}}},
      {"register", {{{"finest_mm", "4"}}, {}, {"labels"}}},
      {"saw", {{{"normal", "0,0,1"}}, {}, {}}},
      {"virtual-fixture", {{}, {{"curve", "0 0 0\n10 0 0\n10 10 0\n"}, {"path", "1 1 0\n9 1 0\n9 8 0\n"}}, {}}},
      {"tube",
       {{{"points_mm", "53.4,25.9,-15.6; 48,24,-28"}, {"max_radius_mm", "5"}, {"name", "sigmoid sinus"}},
        {},
        {"line"}}},
      {"find-structures", {{{"what", "ear_canal,air_cells"}}, {}, {"findings"}}},
      {"plan-reconstruction",
       {{{"target", "own"},
         {"a_mm", "-4,0,0"},
         {"a_normal", "1,0,0"},
         {"b_mm", "4,0,0"},
         {"b_normal", "-1,0,0"},
         {"min_length_mm", "5"},
         {"reserve_mm", "5"}},
        {},
        {}}},
      {"cutting-guide", {{{"approach", "1,0,0"}, {"margin_mm", "3"}}, {{"plan", kPlan}}, {}}},
      {"outcome", {{}, {{"plan", kPlan}}, {}}},
      {"segment-network", {{{"folds", "0"}, {"mirror", "no"}, {"step", "1"}}, {}, {}}},
      {"phantom", {{{"region", "temporal"}, {"spacing_mm", "4"}}, {}, {}}},
  };
  return value;
}

// One value of each kind, as it comes out of VTK.
struct Values {
  TemporaryFolder files;
  Image image;
  Labels labels;
  SparseGrid grid;
  Surface surface;
  Tets tets;
  fs::path dicom = files.path() / "dicom";

  Values() {
    PhantomParams p;
    p.region = PhantomRegion::temporal;
    p.spacing_mm = 2;
    const Phantom phantom = make_phantom(p);
    image = image_from_vtk(to_vtk(phantom.ct));
    labels = labels_from_vtk(to_vtk(phantom.labels));
    ThresholdParams t;
    t.lower = 500;
    ResampleParams r;
    r.lower = 500;
    r.spacing_mm = 2;
    grid = resample_bone(image, threshold(image, t), r).density;
    save_dicom_series(image, dicom);
    vtkNew<vtkSphereSource> sphere;
    sphere->SetRadius(10);
    sphere->SetThetaResolution(24);
    sphere->SetPhiResolution(16);
    sphere->Update();
    surface = std::make_shared<const TriMesh>(mesh_from_vtk(sphere->GetOutput()));
    const auto stage = osteo_stages().make("tetrahedralize");
    for (const auto& f : stage->fields()) {
      if (const auto it = table().at("tetrahedralize").params.find(std::string(f.doc.name));
          it != table().at("tetrahedralize").params.end())
        f.from_text(it->second);
    }
    tets = std::get<Tets>(stage->run(std::vector<Data>{surface}, {})[0]);
  }
  [[nodiscard]] Data of(DataKind kind, const std::string& text) const {
    switch (kind) {
      case DataKind::image:
        return image;
      case DataKind::labels:
        return labels;
      case DataKind::grid:
        return grid;
      case DataKind::surface:
        return surface;
      case DataKind::tets:
        return tets;
      case DataKind::document:
        return Document{text};
      case DataKind::picture:
        return Picture{1, 1, {0, 0, 0}};
      case DataKind::source:
      case DataKind::none:
        break;
    }
    return std::monostate{};
  }
  [[nodiscard]] fs::path file(const std::string& stage, const std::string& port, const std::string& text) const {
    if (text.empty()) return dicom;
    const fs::path path = files.path() / (stage + "-" + port + ".txt");
    std::ofstream(path) << text;
    return path;
  }
};

const Values& values() {
  static const Values v;
  return v;
}

vtkSmartPointer<vtkDataObject> as_vtk(const Data& data) {
  if (const auto* i = std::get_if<Image>(&data)) return to_vtk(*i);
  if (const auto* l = std::get_if<Labels>(&data)) return to_vtk(*l);
  if (const auto* s = std::get_if<Surface>(&data)) return to_vtk(**s);
  if (const auto* t = std::get_if<Tets>(&data)) return to_vtk(**t);
  auto own = vtkSmartPointer<vtkOsteoDataObject>::New();
  own->SetValue(data);
  return own;
}

void expect_equal(const Data& wanted, vtkDataObject* object) {
  ASSERT_NE(object, nullptr);
  if (const auto* image = std::get_if<Image>(&wanted)) {
    const Image got = image_from_vtk(vtkImageData::SafeDownCast(object));
    EXPECT_TRUE(same_place(got.frame, image->frame, 1e-9));
    EXPECT_TRUE(std::ranges::equal(got.span(), image->span()));
  } else if (const auto* labels = std::get_if<Labels>(&wanted)) {
    const Labels got = labels_from_vtk(vtkImageData::SafeDownCast(object));
    EXPECT_TRUE(same_place(got.frame, labels->frame, 1e-9));
    EXPECT_TRUE(std::ranges::equal(got.span(), labels->span()));
  } else if (const auto* surface = std::get_if<Surface>(&wanted)) {
    const TriMesh got = mesh_from_vtk(vtkPolyData::SafeDownCast(object));
    EXPECT_EQ(got.points_mm, (*surface)->points_mm);
    EXPECT_EQ(got.triangles, (*surface)->triangles);
  } else if (const auto* tets = std::get_if<Tets>(&wanted)) {
    const TetMesh got = tets_from_vtk(vtkUnstructuredGrid::SafeDownCast(object));
    EXPECT_TRUE(std::ranges::equal(got.points_mm, (*tets)->points_mm));
    EXPECT_TRUE(std::ranges::equal(got.tets, (*tets)->tets));
  } else if (std::holds_alternative<std::monostate>(wanted)) {
    if (auto* const empty = vtkImageData::SafeDownCast(object)) {
      EXPECT_EQ(empty->GetNumberOfPoints(), 0);
    }
  } else {
    auto* const own = vtkOsteoDataObject::SafeDownCast(object);
    ASSERT_NE(own, nullptr);
    ASSERT_EQ(kind_of(own->GetValue()), kind_of(wanted));
    if (const auto* grid = std::get_if<SparseGrid>(&wanted)) {
      const auto& got = std::get<SparseGrid>(own->GetValue());
      EXPECT_EQ(got.frame, grid->frame);
      EXPECT_EQ(got.active_voxels, grid->active_voxels);
    }
    if (const auto* d = std::get_if<Document>(&wanted)) {
      EXPECT_EQ(std::get<Document>(own->GetValue()).json, d->json);
    }
    if (const auto* p = std::get_if<Picture>(&wanted)) {
      EXPECT_EQ(std::get<Picture>(own->GetValue()).rgb, p->rgb);
    }
  }
}

void expect_announced(vtkOsteoStage* stage, int port) {
  auto* const image = vtkImageData::SafeDownCast(stage->GetOutputDataObject(port));
  if (image == nullptr || image->GetNumberOfPoints() == 0) return;
  int announced[6], extent[6];
  double spacing[3], origin[3];
  vtkInformation* const info = stage->GetOutputInformation(port);
  info->Get(vtkStreamingDemandDrivenPipeline::WHOLE_EXTENT(), announced);
  info->Get(vtkDataObject::SPACING(), spacing);
  info->Get(vtkDataObject::ORIGIN(), origin);
  image->GetExtent(extent);
  for (int i = 0; i < 6; ++i) EXPECT_EQ(announced[i], extent[i]);
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(spacing[i], image->GetSpacing()[i]);
    EXPECT_EQ(origin[i], image->GetOrigin()[i]);
  }
  // What VTK's own filter makes of it covers all of it.
  vtkNew<vtkImageThreshold> next;
  next->SetInputConnection(stage->GetOutputPort(port));
  next->ThresholdByUpper(1);
  next->Update();
  EXPECT_EQ(next->GetOutput()->GetNumberOfPoints(), image->GetNumberOfPoints());
}

Image finer_ct() {
  PhantomParams p;
  p.region = PhantomRegion::temporal;
  p.spacing_mm = 1;
  p.individual = 1;
  return image_from_vtk(to_vtk(make_phantom(p).ct));
}

Image ct_around_the_ball() {
  Image ct = values().image;
  ct.frame.origin_mm = ct.frame.origin_mm - ct.frame.centre_mm();
  return ct;
}

Image ct_of_the_ball() {
  Image ct;
  ct.frame.dims = {50, 50, 50};
  ct.frame.spacing_mm = {0.8, 0.8, 0.8};
  ct.frame.origin_mm = {-19.6, -19.6, -19.6};
  const auto voxels = make_voxels<std::int16_t>(ct.frame.voxel_count());
  std::size_t n = 0;
  for (int k = 0; k < 50; ++k)
    for (int j = 0; j < 50; ++j)
      for (int i = 0; i < 50; ++i)
        voxels[n++] = static_cast<std::int16_t>(
            40 + 1000 / (1 + std::exp(3 * (length(ct.frame.world_from_index(Vec3(i, j, k))) - 9.9))));
  ct.voxels = voxels;
  return ct;
}

class EveryStage : public testing::TestWithParam<std::string> {};

// The ball drawn out: a donor bone of 20 mm would be taken for one in centimetres.
Surface long_donor() {
  auto mesh = std::make_shared<TriMesh>(*values().surface);
  for (auto& p : mesh->points_mm) p = to_floats(Vec3{from_floats(p).x, from_floats(p).y, 5 * from_floats(p).z});
  mesh->normals.clear();
  return mesh;
}

TEST_P(EveryStage, IsAVtkFilterThatGivesWhatTheStageGives) {
  if ((GetParam() == "calibrate" || GetParam() == "fit-damping") && !has_ceres()) GTEST_SKIP() << "built without Ceres";
  const Registry registry = osteo_stages();
  const auto line = table().find(GetParam());
  const Recipe recipe = line == table().end() ? Recipe{} : line->second;
  const auto plain = registry.make(GetParam());
  vtkNew<vtkOsteoStage> filter;
  ASSERT_TRUE(filter->SetStage(registry, GetParam()));
  for (const auto& [name, text] : recipe.params) {
    ASSERT_TRUE(filter->SetParameter(name, text)) << filter->GetLastError();
    for (const auto& f : plain->fields()) {
      if (f.doc.name == name) f.from_text(text);
    }
  }
  std::vector<Data> inputs;
  for (const Port& port : plain->info().inputs) {
    inputs.emplace_back();
    if (port.optional && std::find(recipe.also.begin(), recipe.also.end(), port.name) == recipe.also.end()) continue;
    const auto text = recipe.texts.find(port.name);
    if (port.kinds.front() == DataKind::source) {
      const fs::path path = GetParam() == "segment-network"
                                ? source_folder() / "testdata/neural/plain"
                                : values().file(GetParam(), port.name, text == recipe.texts.end() ? "" : text->second);
      inputs.back() = Source{path};
      filter->SetSourcePath(port.name, path.string());
      continue;
    }
    inputs.back() = values().of(port.kinds.front(), text == recipe.texts.end() ? "" : text->second);
    if (GetParam() == "apply-edits" && port.name == "edits") {  // bound to the CT that it is given
      const Image& ct = values().image;
      EditDocument document(ct, values().labels);
      document.apply(ThresholdEdit{400, 3000});
      document.apply(AddStructureEdit{1, "nerve", {250, 220, 40}, StructureRole::at_risk});
      document.apply(BrushEdit{1, false, 5, {ct.frame.centre_mm()}});
      inputs.back() = Document{edits_text(recipe_of(document))};
    }
    if (GetParam() == "find-structures") inputs.back() = finer_ct();  // an ear cannot be made out in 2 mm voxels
    if (GetParam() == "outcome" && port.name == "postop") inputs.back() = ct_of_the_ball();
    if (GetParam() == "plan-reconstruction" && port.name == "fibula") inputs.back() = long_donor();
    if (GetParam() == "bone-stiffness" && port.name == "ct") inputs.back() = ct_around_the_ball();
    vtkNew<vtkTrivialProducer> producer;
    producer->SetOutput(as_vtk(inputs.back()));
    filter->SetInputConnection(filter->GetInputPortIndex(port.name), producer->GetOutputPort());
  }
  const std::vector<Data> wanted = plain->run(inputs, {});
  for (int again = 0; again < 2; ++again) {
    ASSERT_EQ(filter->GetExecutive()->Update(0), 1) << filter->GetLastError();
    ASSERT_EQ(filter->GetErrorCode(), 0UL) << filter->GetLastError();
    for (std::size_t p = 0; p < wanted.size(); ++p) {
      SCOPED_TRACE(plain->info().outputs[p].name);
      const auto& timed = recipe.timed;
      if (std::find(timed.begin(), timed.end(), plain->info().outputs[p].name) == timed.end())
        expect_equal(wanted[p], filter->GetOutputDataObject(static_cast<int>(p)));
      expect_announced(filter, static_cast<int>(p));
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Registry, EveryStage, testing::ValuesIn(osteo_stages().names()), [](const auto& of) {
  std::string name = of.param;
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
});

TEST(EveryStage, TableNamesNoStageThatIsGone) {
  for (const auto& [name, recipe] : table()) EXPECT_TRUE(osteo_stages().has(name)) << name;
}

// Crop announces another lattice each time its box changes, and without labels its second output stays empty.
TEST(CropFilter, FollowsItsParametersAndItsInputs) {
  const Registry registry = osteo_stages();
  vtkNew<vtkOsteoStage> phantom, crop, mask;
  ASSERT_TRUE(phantom->SetStage(registry, "phantom"));
  ASSERT_TRUE(phantom->SetParameter("region", "temporal") && phantom->SetParameter("spacing_mm", "4"));
  ASSERT_TRUE(crop->SetStage(registry, "crop"));
  ASSERT_TRUE(crop->SetParameter("region", "box") && crop->SetParameter("centre_mm", "60,20,-20") &&
              crop->SetParameter("size_mm", "30,30,30"));
  crop->SetInputConnection(crop->GetInputPortIndex("image"), phantom->GetOutputPort(0));
  ASSERT_TRUE(mask->SetStage(registry, "threshold"));
  ASSERT_TRUE(mask->SetParameter("lower", "300"));
  mask->SetInputConnection(crop->GetOutputPort(0));
  const auto points = [&] {
    EXPECT_EQ(mask->GetExecutive()->Update(0), 1) << crop->GetLastError() << mask->GetLastError();
    return vtkImageData::SafeDownCast(mask->GetOutputDataObject(0))->GetNumberOfPoints();
  };
  const auto small = points();
  EXPECT_LT(small, 1000);
  ASSERT_TRUE(crop->SetParameter("size_mm", "44,44,44"));
  const auto large = points();
  EXPECT_GT(large, 2 * small);
  ASSERT_TRUE(phantom->SetParameter("spacing_mm", "3"));
  EXPECT_GT(points(), 2 * large);
  EXPECT_EQ(vtkImageData::SafeDownCast(crop->GetOutputDataObject(1))->GetNumberOfPoints(), 0);
}

}  // namespace
}  // namespace osteo
