#include "osteo/display/view/structures_view.h"

#include <vtkActor.h>
#include <vtkDataObject.h>
#include <vtkFloatArray.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkPolyDataMapper.h>
#include <vtkProperty.h>
#include <vtkRenderer.h>
#include <vtkShaderProperty.h>
#include <vtkUnsignedCharArray.h>
#include <vtkWindowedSincPolyDataFilter.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "osteo/core/base/parallel.h"
#include "osteo/display/view/actors.h"
#include "osteo/imaging/io/vtk_data.h"

namespace osteo::inline display {

namespace {

void set_normals(TriMesh& mesh) {
  std::vector<Vec3> normals(mesh.points_mm.size());
  for (const auto& t : mesh.triangles) {
    const Vec3 a = from_floats(mesh.points_mm[t[0]]), b = from_floats(mesh.points_mm[t[1]]),
               c = from_floats(mesh.points_mm[t[2]]);
    const Vec3 twice_area = cross(b - a, c - a);
    for (const std::uint32_t p : t) normals[p] += twice_area;
  }
  mesh.normals.resize(normals.size());
  for (std::size_t p = 0; p < normals.size(); ++p) mesh.normals[p] = to_floats(normalized(normals[p]));
}

// Means over a point and those it shares triangles with, so often.
template <class T>
void spread(const TriMesh& mesh, std::vector<T>& values, int times) {
  std::vector<T> sum(values.size());
  std::vector<double> count(values.size());
  for (int n = 0; n < times; ++n) {
    std::fill(sum.begin(), sum.end(), T{});
    std::fill(count.begin(), count.end(), 0);
    for (const auto& t : mesh.triangles) {
      const T all = values[t[0]] + values[t[1]] + values[t[2]];
      for (const std::uint32_t p : t) {
        sum[p] = sum[p] + all;
        count[p] += 3;
      }
    }
    for (std::size_t p = 0; p < values.size(); ++p) {
      if (count[p] > 0) values[p] = sum[p] * (1 / count[p]);
    }
  }
}

// For each point how many are connected with it.
std::vector<std::uint32_t> sizes_of_parts(const TriMesh& mesh) {
  std::vector<std::uint32_t> root(mesh.points_mm.size()), size(root.size(), 0);
  std::iota(root.begin(), root.end(), 0U);
  const auto find = [&](std::uint32_t p) {
    while (root[p] != p) p = root[p] = root[root[p]];
    return p;
  };
  for (const auto& t : mesh.triangles) {
    for (const std::uint32_t p : t) root[find(p)] = find(t[0]);
  }
  for (std::uint32_t p = 0; p < root.size(); ++p) ++size[find(p)];
  std::vector<std::uint32_t> together(root.size());
  for (std::uint32_t p = 0; p < root.size(); ++p) together[p] = size[find(p)];
  return together;
}

// For each point how much of it is drawn, 0 to 1; empty: the structure ends nowhere at the border of the data.
std::vector<float> faded_at(const TriMesh& mesh, const Frame& data) {
  constexpr double kAtBorder = 1.5, kGone = 0.125;  // voxels: half of one, and what smoothing rounds off; of the fade
  std::array<std::vector<double>, 6> to_side;       // 0 at the border, 1 where the fade begins
  for (std::size_t side = 0; side < 6; ++side) {
    const std::size_t a = side / 2;
    const double spacing = data.spacing_mm[a], fade_mm = std::min(StructuresView::kFadeMm, data.dims[a] * spacing / 6);
    bool ends = false, goes_on = false;
    for (const auto& p : mesh.points_mm) {
      const double at = data.index_from_world(from_floats(p))[a];
      const double voxels = side % 2 == 0 ? at + 0.5 : data.dims[a] - 0.5 - at;
      ends = ends || voxels < kAtBorder;
      goes_on = goes_on || voxels < -kAtBorder;
      to_side[side].push_back(voxels * spacing / fade_mm);
    }
    if (!ends || goes_on) to_side[side].clear();
  }
  std::vector<float> drawn;
  for (const auto& share : to_side) {
    if (share.empty()) continue;
    if (drawn.empty()) drawn.assign(share.size(), 1.0F);
    for (std::size_t p = 0; p < share.size(); ++p)
      drawn[p] = std::min(drawn[p], static_cast<float>(std::clamp((share[p] - kGone) / (1 - kGone), 0.0, 1.0)));
  }
  return drawn;
}

void draw_share_of_points(vtkActor* actor, const std::vector<float>& share) {
  auto* const mapper = vtkPolyDataMapper::SafeDownCast(actor->GetMapper());
  vtkNew<vtkFloatArray> values;
  values->SetName("drawnShare");
  for (const float v : share) values->InsertNextValue(v);
  mapper->GetInput()->GetPointData()->AddArray(values);
  mapper->MapDataArrayToVertexAttribute("drawnShare", "drawnShare", vtkDataObject::FIELD_ASSOCIATION_POINTS, -1);
  vtkShaderProperty* const shader = actor->GetShaderProperty();
  shader->AddVertexShaderReplacement(
      "//VTK::Normal::Dec", true, "//VTK::Normal::Dec\nin float drawnShare;\nout float drawnShareVSOutput;\n", false);
  shader->AddVertexShaderReplacement("//VTK::Normal::Impl", true,
                                     "//VTK::Normal::Impl\n  drawnShareVSOutput = drawnShare;\n", false);
}

// Dots by a number of each pixel that has nothing to do with the patterns of clear structures: interleaved gradient
// noise (J. Jimenez, Next Generation Post Processing in Call of Duty, SIGGRAPH 2014).
void leave_out_dots(vtkShaderProperty* shader) {
  shader->AddFragmentShaderReplacement("//VTK::Normal::Dec", true, "//VTK::Normal::Dec\nin float drawnShareVSOutput;\n",
                                       false);
  shader->AddFragmentShaderReplacement(
      "//VTK::Color::Impl", true,
      "//VTK::Color::Impl\n"
      "  if (drawnShareVSOutput <= fract(52.9829189 * fract(dot(floor(gl_FragCoord.xy), vec2(0.06711056, "
      "0.00583715))))) discard;\n",
      false);
}

}  // namespace

TriMesh smooth_surface(const TriMesh& face, double most_mm) {
  TriMesh smooth;
  smooth.points_mm = face.points_mm;
  smooth.triangles = face.triangles;
  if (face.triangles.empty()) return smooth;
  // A tube of few voxels is drawn in by the filter. What it lost is much the same all around, unlike the steps that
  // were smoothed away: spread over the surface, that is given back. In rounds, each so weak that a tube two voxels
  // thick is still a tube before it gets it back.
  constexpr int kRounds = 3, kPasses = 30, kTimes = 2, kSpread = 20;
  constexpr double kPassBand = 0.06;
  std::vector<double> lost(smooth.points_mm.size());
  for (int round = 0; round < kRounds; ++round) {
    vtkNew<vtkWindowedSincPolyDataFilter> filter;
    smooth.normals.clear();
    filter->SetInputData(to_vtk(smooth));
    filter->SetNumberOfIterations(kPasses);
    filter->SetPassBand(kPassBand);
    filter->BoundarySmoothingOff();
    filter->FeatureEdgeSmoothingOff();
    filter->NonManifoldSmoothingOn();
    filter->NormalizeCoordinatesOn();
    filter->Update();
    for (std::size_t p = 0; p < smooth.points_mm.size(); ++p) {
      double to[3];
      filter->GetOutput()->GetPoints()->GetPoint(static_cast<vtkIdType>(p), to);
      if (std::isfinite(to[0] + to[1] + to[2])) smooth.points_mm[p] = to_floats({to[0], to[1], to[2]});
    }
    for (int n = 0; n < kTimes; ++n) {
      set_normals(smooth);
      for (std::size_t p = 0; p < lost.size(); ++p)
        lost[p] =
            dot(from_floats(face.points_mm[p]) - from_floats(smooth.points_mm[p]), from_floats(smooth.normals[p]));
      spread(smooth, lost, kSpread);
      for (std::size_t p = 0; p < lost.size(); ++p)
        smooth.points_mm[p] = to_floats(from_floats(smooth.points_mm[p]) + from_floats(smooth.normals[p]) * lost[p]);
    }
  }
  // A few voxels by themselves would be a point before it is given back what they lost: they stay as they are.
  constexpr std::uint32_t kFewPoints = 60;
  const std::vector<std::uint32_t> together = sizes_of_parts(face);
  for (std::size_t p = 0; p < smooth.points_mm.size(); ++p) {
    if (together[p] < kFewPoints) smooth.points_mm[p] = face.points_mm[p];
    const Vec3 from = from_floats(face.points_mm[p]), by = from_floats(smooth.points_mm[p]) - from;
    if (length(by) > most_mm) smooth.points_mm[p] = to_floats(from + by * (most_mm / length(by)));
  }
  set_normals(smooth);
  return smooth;
}

StructuresView::StructuresView(vtkRenderer* renderer, const StructureMap& map)
    : renderer_(renderer), all_(map.values().size()) {
  const double most_mm = map.label_spacing_mm()[1] / 2;
  parallel_for(all_.size(), 1, 0, [&](std::size_t begin, std::size_t end) {
    for (std::size_t s = begin; s < end; ++s)
      all_[s].surface = std::make_shared<const TriMesh>(smooth_surface(map.face(s), most_mm));
  });
  for (std::size_t s = 0; s < all_.size(); ++s) {
    One& one = all_[s];
    one.value = map.values()[s];
    one.actor = make_bone_actor(to_vtk(*one.surface));
    const auto c = map.colour_of(one.value);
    one.actor->GetProperty()->SetColor(c[0], c[1], c[2]);
    renderer_->AddActor(one.actor);
    for (const Structure& structure : map.structures())
      if (structure.value == one.value) one.proposed = structure.within_mm > 0;
  }
}

StructuresView::~StructuresView() {
  for (const One& one : all_) renderer_->RemoveActor(one.actor);
}

void StructuresView::fade_at_border(const Frame& bone) {
  for (One& one : all_) {
    if (one.fades) continue;
    const std::vector<float> share = faded_at(*one.surface, bone);
    if (share.empty()) continue;
    one.fades = true;
    draw_share_of_points(one.actor, share);
    leave_out_dots(one.actor->GetShaderProperty());
  }
}

void StructuresView::show(std::size_t number, StructureLook look) {
  One& one = all_[number];
  if (one.look == look) return;
  one.look = look;
  one.actor->SetVisibility(look != StructureLook::hidden ? 1 : 0);
  one.actor->GetShaderProperty()->ClearAllFragmentShaderReplacements();
  if (one.fades) leave_out_dots(one.actor->GetShaderProperty());
  if (look != StructureLook::clear) return;
  // Any two of them leave a quarter of the pixels to what lies behind both.
  static constexpr const char* kPatterns[] = {"x + y", "x / 2 + y", "x + y / 2", "x / 2 + y / 2"};
  const std::string discard = "//VTK::Light::Impl\n  { int x = int(gl_FragCoord.x), y = int(gl_FragCoord.y); if (((" +
                              std::string(kPatterns[number % 4]) + ") & 1) != 0) discard; }\n";
  one.actor->GetShaderProperty()->AddFragmentShaderReplacement("//VTK::Light::Impl", true, discard, false);
}

void StructuresView::hatch(const Labels& values, std::uint8_t from) {
  constexpr double kPeriodMm = 1.6, kPale = 0.65;
  const Frame& f = values.frame;
  // A face lies between voxels, and the drawn one a little beside it: any of those around counts.
  const auto marked = [&](Vec3 world_mm) {
    const Vec3 x = f.index_from_world(world_mm);
    for (int way = 0; way < 27; ++way) {
      std::array<int, 3> at{};
      bool inside = true;
      for (std::size_t a = 0; a < 3; ++a) {
        at[a] = static_cast<int>(std::lround(x[a])) + (a == 0 ? way % 3 : a == 1 ? way / 3 % 3 : way / 9) - 1;
        inside = inside && at[a] >= 0 && at[a] < f.dims[a];
      }
      if (inside && values.at(at[0], at[1], at[2]) >= from) return true;
    }
    return false;
  };
  parallel_for(all_.size(), 1, 0, [&](std::size_t begin, std::size_t end) {
    for (std::size_t s = begin; s < end; ++s) {
      const One& one = all_[s];
      if (!one.proposed) continue;
      double rgb[3];
      one.actor->GetProperty()->GetColor(rgb);
      vtkNew<vtkUnsignedCharArray> colours;
      colours->SetNumberOfComponents(3);
      colours->SetName("hatched");
      bool any = false;
      for (const auto& p : one.surface->points_mm) {
        const Vec3 at = from_floats(p);
        const double bars =
            std::fmod(std::fmod((at.x + at.y + at.z) / std::sqrt(3.0), kPeriodMm) + kPeriodMm, kPeriodMm);
        const bool pale = bars < kPeriodMm / 2 && marked(at);
        any = any || pale;
        for (const double c : rgb)
          colours->InsertNextValue(static_cast<unsigned char>(std::lround(255 * (pale ? c + (1 - c) * kPale : c))));
      }
      if (!any) continue;
      auto* const mapper = vtkPolyDataMapper::SafeDownCast(one.actor->GetMapper());
      mapper->GetInput()->GetPointData()->SetScalars(colours);
      mapper->SetScalarModeToUsePointData();
      mapper->SetColorModeToDirectScalars();
      mapper->ScalarVisibilityOn();
    }
  });
}

}  // namespace osteo::inline display
