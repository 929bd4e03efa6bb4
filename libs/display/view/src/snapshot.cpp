#include "osteo/display/view/pictures.h"

#include <vtkActor.h>
#include <vtkCellArray.h>
#include <vtkFlyingEdges3D.h>
#include <vtkGenericOpenGLRenderWindow.h>
#include <vtkImageConstantPad.h>
#include <vtkImageData.h>
#include <vtkMapper.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkProperty.h>
#include <vtkRenderer.h>
#include <vtkUnsignedCharArray.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "osteo/core/base/error.h"
#include "osteo/display/view/actors.h"
#include "osteo/display/view/offscreen.h"
#include "osteo/display/view/slices.h"
#include "osteo/geometry/grid/sampler.h"
#include "osteo/geometry/mesh/bone_surface.h"
#include "osteo/imaging/io/vtk_data.h"
#include "osteo/simulation/bone/live_surface.h"

namespace osteo::inline display {
namespace {

double hu_at(const Image& image, Vec3 world) {
  const Vec3 x = image.frame.index_from_world(world);
  for (std::size_t a = 0; a < 3; ++a) {
    if (x[a] < -0.5 || x[a] > image.frame.dims[a] - 0.5) return -1024;
  }
  return sample_linear(image, x);
}

int sample_label(const Labels& labels, Vec3 world) {
  const Vec3 x = labels.frame.index_from_world(world);
  int v[3];
  for (std::size_t a = 0; a < 3; ++a) {
    v[a] = static_cast<int>(std::floor(x[a] + 0.5));
    if (v[a] < 0 || v[a] >= labels.frame.dims[a]) return 0;
  }
  return labels.at(v[0], v[1], v[2]);
}

// 1, 2 or 5 times a power of ten, near x.
double step_of(double x) {
  const double power = std::pow(10.0, std::floor(std::log10(x)));
  return power * (x / power < 1.5 ? 1 : x / power < 3.5 ? 2 : x / power < 7.5 ? 5 : 10);
}

GreyAt grey_of(const Data& data) {
  if (const auto* image = std::get_if<Image>(&data)) return [image](Vec3 p) { return grey_of_hu(hu_at(*image, p)); };
  if (const auto* grid = std::get_if<SparseGrid>(&data)) {
    auto sampler = std::make_shared<GridSampler>(*grid);
    if (grid->name == "hu") return [sampler](Vec3 p) { return grey_of_hu(static_cast<double>(sampler->nearest(p))); };
    if (grid->name == "distance_mm") {
      // Lighter with distance, a dark line at each of about ten steps; black where nothing is stored.
      const double background = grid->background, step = step_of(std::max(background, 1e-9) / 5);
      return [sampler, background, step](Vec3 p) {
        const auto d = static_cast<double>(sampler->nearest(p));
        if (d == static_cast<float>(background)) return 12.0;
        const double phase = std::abs(d) / step - std::floor(std::abs(d) / step);
        return (phase < 0.12 ? 60.0 : 120.0) + 110.0 * std::min(1.0, std::abs(d) / std::max(background, 1e-9));
      };
    }
    return [sampler](Vec3 p) { return 255.0 * static_cast<double>(std::clamp(sampler->nearest(p), 0.0F, 1.0F)); };
  }
  return nullptr;
}

LabelAt label_of(const Data& data) {
  if (const auto* labels = std::get_if<Labels>(&data)) return [labels](Vec3 p) { return sample_label(*labels, p); };
  if (const auto* grid = std::get_if<SparseGrid>(&data)) {
    auto sampler = std::make_shared<GridSampler>(*grid);
    if (grid->name == "distance_mm") return [sampler](Vec3 p) { return sampler->nearest(p) < 0 ? 1 : 0; };
    return [sampler](Vec3 p) { return sampler->nearest(p) >= 0.5F ? 1 : 0; };
  }
  return nullptr;
}

std::pair<Vec3, Vec3> bounds_of(const Data& data) {
  Vec3 lo{1e30, 1e30, 1e30}, hi{-1e30, -1e30, -1e30};
  const auto add = [&](Vec3 p) {
    for (std::size_t a = 0; a < 3; ++a) {
      lo[a] = std::min(lo[a], p[a]);
      hi[a] = std::max(hi[a], p[a]);
    }
  };
  const auto add_frame = [&](const Frame& f) {
    for (int c = 0; c < 8; ++c)
      add(f.world_from_index({(c & 1) != 0 ? f.dims[0] - 1.0 : 0.0, (c & 2) != 0 ? f.dims[1] - 1.0 : 0.0,
                              (c & 4) != 0 ? f.dims[2] - 1.0 : 0.0}));
  };
  if (const auto* image = std::get_if<Image>(&data)) add_frame(image->frame);
  if (const auto* labels = std::get_if<Labels>(&data)) add_frame(labels->frame);
  if (const auto* grid = std::get_if<SparseGrid>(&data)) return GridSampler::bounds_mm(*grid);
  if (const auto* tets = std::get_if<Tets>(&data)) {
    for (const auto& p : (*tets)->points_mm) add({p[0], p[1], p[2]});
  }
  if (const auto* surface = std::get_if<Surface>(&data)) {
    for (const auto& p : (*surface)->points_mm) add({p[0], p[1], p[2]});
  }
  return {lo, hi};
}

// Isosurface of a dense volume, closed at its border. Made in voxel indices and placed here: VTK 9.1's filters drop the
// direction.
template <class T>
vtkSmartPointer<vtkPolyData> isosurface(const Volume<T>& volume, double value, double outside) {
  Volume<T> upright = volume;
  upright.frame.origin_mm = {};
  upright.frame.spacing_mm = {1, 1, 1};
  upright.frame.direction = {};
  vtkSmartPointer<vtkImageData> image;
  if constexpr (std::is_same_v<T, std::uint8_t>) {
    image = to_vtk(Labels{{upright.frame, upright.voxels}, {}});
  } else {
    image = to_vtk(upright);
  }
  vtkNew<vtkImageConstantPad> pad;
  int e[6];
  image->GetExtent(e);
  pad->SetInputData(image);
  pad->SetOutputWholeExtent(e[0] - 1, e[1] + 1, e[2] - 1, e[3] + 1, e[4] - 1, e[5] + 1);
  pad->SetConstant(outside);
  vtkNew<vtkFlyingEdges3D> edges;
  edges->SetInputConnection(pad->GetOutputPort());
  edges->SetValue(0, value);
  edges->ComputeScalarsOff();
  edges->ComputeGradientsOff();
  edges->ComputeNormalsOn();
  edges->Update();
  vtkPolyData* const surface = edges->GetOutput();
  const Frame& f = volume.frame;
  vtkDataArray* const normals = surface->GetPointData()->GetNormals();
  for (vtkIdType p = 0; p < surface->GetNumberOfPoints(); ++p) {
    double x[3];
    surface->GetPoint(p, x);
    const Vec3 world = f.world_from_index({x[0], x[1], x[2]});
    surface->GetPoints()->SetPoint(p, world.x, world.y, world.z);
    if (normals == nullptr) continue;
    normals->GetTuple(p, x);
    const Vec3 n = normalized(f.direction * Vec3{x[0] / f.spacing_mm.x, x[1] / f.spacing_mm.y, x[2] / f.spacing_mm.z});
    normals->SetTuple3(p, n.x, n.y, n.z);
  }
  if (determinant(f.direction) < 0) {
    for (vtkIdType c = 0; c < surface->GetNumberOfPolys(); ++c) surface->GetPolys()->ReverseCellAtId(c);
  }
  return surface;
}

const std::vector<Structure>& structures_of(const SnapshotSubjects& s) {
  static const std::vector<Structure> none;
  for (const Data* data : {&s.mask, &s.subject}) {
    if (const auto* labels = std::get_if<Labels>(data); labels != nullptr && !labels->structures.empty())
      return labels->structures;
  }
  return none;
}

vtkSmartPointer<vtkActor> structure_actor(const Labels& labels, const Structure& structure) {
  const auto only = make_voxels<std::uint8_t>(labels.frame.voxel_count());
  for (std::size_t i = 0; i < labels.frame.voxel_count(); ++i) only[i] = labels.voxels[i] == structure.value ? 1 : 0;
  const auto actor = make_bone_actor(isosurface<std::uint8_t>({labels.frame, only}, 0.5, 0));
  actor->GetProperty()->SetColor(structure.rgb[0] / 255.0, structure.rgb[1] / 255.0, structure.rgb[2] / 255.0);
  return actor;
}

// Values as colours, dark to light (after viridis); on a logarithmic scale where they are all above 0 and span more
// than a factor of five.
class Colours {
 public:
  explicit Colours(std::span<const float> values) {
    const auto [lo, hi] = std::minmax_element(values.begin(), values.end());
    low_ = static_cast<double>(*lo);
    high_ = static_cast<double>(*hi);
    logarithmic_ = low_ > 0 && high_ > 5 * low_;
  }
  // Of a share of the range.
  static std::array<unsigned char, 3> at(double share) {
    constexpr double kStops[5][3] = {{68, 1, 84}, {59, 82, 139}, {33, 145, 140}, {94, 201, 98}, {253, 231, 37}};
    const double t = 4 * std::clamp(share, 0.0, 1.0);
    const auto i = static_cast<std::size_t>(std::min(3.0, std::floor(t)));
    std::array<unsigned char, 3> rgb{};
    for (std::size_t c = 0; c < 3; ++c)
      rgb[c] = static_cast<unsigned char>(
          std::lround(kStops[i][c] + (t - static_cast<double>(i)) * (kStops[i + 1][c] - kStops[i][c])));
    return rgb;
  }
  [[nodiscard]] std::array<unsigned char, 3> of(double value) const {
    if (!(high_ > low_)) return at(0.5);
    return at(logarithmic_ ? std::log(value / low_) / std::log(high_ / low_) : (value - low_) / (high_ - low_));
  }
  [[nodiscard]] double value(double share) const {
    return logarithmic_ ? low_ * std::pow(high_ / low_, share) : low_ + share * (high_ - low_);
  }

 private:
  double low_ = 0, high_ = 0;
  bool logarithmic_ = false;
};

void write_legend(Picture& picture, const TetMesh& mesh) {
  const Colours colours(mesh.values);
  constexpr int kWidth = 16, kHeight = 180, kMargin = 24;
  const int x = picture.width - 110, y = kMargin + 16;
  for (int row = 0; row < kHeight; ++row) {
    const auto rgb = Colours::at(1 - static_cast<double>(row) / (kHeight - 1));
    for (int column = 0; column < kWidth; ++column) {
      const auto i = 3 * (static_cast<std::size_t>(y + row) * static_cast<std::size_t>(picture.width) +
                          static_cast<std::size_t>(x + column));
      if (x < 0 || i + 2 >= picture.rgb.size()) return;
      std::copy(rgb.begin(), rgb.end(), picture.rgb.begin() + static_cast<std::ptrdiff_t>(i));
    }
  }
  for (const double share : {0.0, 0.5, 1.0}) {
    char text[32];
    std::snprintf(text, sizeof text, "%.3g", colours.value(share));
    write_text(picture, text, x + kWidth + 8, y + static_cast<int>((1 - share) * (kHeight - 1)) + 6, 15);
  }
  write_text(picture, mesh.values_name, x - 20, y - 14, 15);
}

// The half of a mesh that is farther from the eye, so that its inside shows; coloured where the mesh has values.
vtkSmartPointer<vtkPolyData> half_of(const TetMesh& mesh, Vec3 eye) {
  const auto at = [&](std::uint32_t v) {
    return Vec3{mesh.points_mm[v][0], mesh.points_mm[v][1], mesh.points_mm[v][2]};
  };
  Vec3 lo{1e30, 1e30, 1e30}, hi{-1e30, -1e30, -1e30};
  for (std::uint32_t v = 0; v < mesh.points_mm.size(); ++v) {
    for (std::size_t a = 0; a < 3; ++a) {
      lo[a] = std::min(lo[a], at(v)[a]);
      hi[a] = std::max(hi[a], at(v)[a]);
    }
  }
  // The cut is along the body axis nearest to the direction of the eye.
  std::size_t axis = 0;
  for (std::size_t a = 1; a < 3; ++a) {
    if (std::abs(eye[a]) > std::abs(eye[axis])) axis = a;
  }
  const double middle = (lo[axis] + hi[axis]) / 2;
  TetMesh half;
  half.points_mm = mesh.points_mm;
  for (const auto& t : mesh.tets) {
    const double c = (at(t[0])[axis] + at(t[1])[axis] + at(t[2])[axis] + at(t[3])[axis]) / 4;
    if ((c - middle) * eye[axis] <= 0) half.tets.push_back(t);
  }
  std::vector<std::uint32_t> point_of;
  const auto surface = to_vtk(boundary_of(half, &point_of));
  if (!mesh.values.empty()) {
    const Colours colours(mesh.values);
    vtkNew<vtkUnsignedCharArray> rgb;
    rgb->SetName("colour");
    rgb->SetNumberOfComponents(3);
    for (const std::uint32_t p : point_of)
      rgb->InsertNextTypedTuple(colours.of(static_cast<double>(mesh.values[p])).data());
    surface->GetPointData()->SetScalars(rgb);
  }
  return surface;
}

// The zero level of a map of distances, as bone of density 1/2 at the surface.
TriMesh zero_of(const SparseGrid& grid, const Context& context) {
  BrickGrid bricks = to_bricks(grid, true);
  const double voxel = std::cbrt(grid.frame.voxel_volume_mm3());
  for (VoxelKey key = 0; key < bricks.brick_count() * BrickGrid::kVoxels; ++key) {
    const float d = bricks.value(key);
    bricks.set(key, d == 0 ? 0.0F : static_cast<float>(std::clamp(0.5 - static_cast<double>(d) / voxel / 2, 0.0, 1.0)));
  }
  return surface_nets(bricks, 0.5F, context).mesh;
}

// As the window shows bone: without the terraces that the triangles' own normals have.
TriMesh shaded_surface(const BrickGrid& bone, const Context& context) {
  LiveSurface surface(bone, context);
  surface.shade(context);
  return surface.joined().mesh;
}

vtkSmartPointer<vtkPolyData> as_drawn(const TriMesh& mesh, const SnapshotParams& p) {
  // So many pixels show single triangles of a mesh_for_pictures().
  constexpr int kManyPixels = 2'000'000;
  return p.width * p.height > kManyPixels ? to_vtk(mesh) : to_vtk(mesh_for_pictures(mesh).mesh);
}

vtkSmartPointer<vtkPolyData> surface_of(const SnapshotSubjects& s, const SnapshotParams& p, const Context& context) {
  if (const auto* surface = std::get_if<Surface>(&s.surface)) return as_drawn(**surface, p);
  // Structures are drawn inside the bone, not instead of it.
  const bool mask_is_bone = structures_of(s).empty();
  for (const Data* data : {&s.mask, &s.subject}) {
    if (data == &s.mask && !mask_is_bone) continue;
    if (const auto* surface = std::get_if<Surface>(data)) return as_drawn(**surface, p);
    if (const auto* tets = std::get_if<Tets>(data)) return half_of(**tets, eye_direction(p.view));
    if (const auto* grid = std::get_if<SparseGrid>(data); grid != nullptr && grid->name == "distance_mm")
      return to_vtk(zero_of(*grid, context));
    if (const auto* grid = std::get_if<SparseGrid>(data); grid != nullptr && grid->name != "hu") {
      return to_vtk(shaded_surface(to_bricks(*grid), context));
    }
    if (const auto* labels = std::get_if<Labels>(data)) return isosurface<std::uint8_t>(*labels, 0.5, 0);
    if (const auto* image = std::get_if<Image>(data)) return isosurface<std::int16_t>(*image, p.bone_hu, -1024);
    if (const auto* grid = std::get_if<SparseGrid>(data)) {
      return to_vtk(surface_nets(to_bricks(*grid), static_cast<float>(p.bone_hu), context).mesh);
    }
  }
  return nullptr;
}

}  // namespace

Vec3 eye_direction(ViewFrom from) {
  switch (from) {
    case ViewFrom::left_front:
      return normalized({0.75, -0.62, 0.22});
    case ViewFrom::left:
      return {1, 0, 0};
    case ViewFrom::right:
      return {-1, 0, 0};
    case ViewFrom::front:
      return {0, -1, 0};
    case ViewFrom::back:
      return {0, 1, 0};
    case ViewFrom::above:
      return {0, 0, 1};
    case ViewFrom::below:
      return {0, 0, -1};
  }
  return {1, 0, 0};
}

Picture snapshot(const SnapshotSubjects& s, const SnapshotParams& p, const Context& context) {
  Picture picture{p.width, p.height, {}};
  picture.rgb.assign(static_cast<std::size_t>(p.width) * static_cast<std::size_t>(p.height) * 3, 12);
  const int pw = p.width / 2 - 2, ph = p.height / 2 - 2;
  const bool flat = !std::holds_alternative<Surface>(s.subject) && !std::holds_alternative<Tets>(s.subject);
  const auto [lo, hi] = bounds_of(s.subject);
  const Vec3 centre = (lo + hi) * 0.5, size = hi - lo;
  const bool through_given = p.centre_mm != std::array<double, 3>{};
  const Vec3 through = through_given ? Vec3{p.centre_mm[0], p.centre_mm[1], p.centre_mm[2]} : centre;
  const std::vector<Structure> structures = structures_of(s);

  if (flat) {
    const bool labels_only = std::holds_alternative<Labels>(s.subject);
    const GreyAt grey = labels_only ? nullptr : grey_of(s.subject);
    const auto* const grid = std::get_if<SparseGrid>(&s.subject);
    const bool shows_inside = labels_only || (grid != nullptr && grid->name == "distance_mm");
    const LabelAt label = label_of(shows_inside ? s.subject : s.mask);
    for (int n = 0; n < 3; ++n) {
      context.progress(0.1 * n, "slices");
      SliceView view;
      view.plane = static_cast<Plane>(n);
      view.centre_mm = centre;
      view.through_mm = through;
      view.width = pw;
      view.height = ph;
      const double w = n == 2 ? size.y : size.x, h = n == 0 ? size.y : size.z;
      view.mm_per_pixel = std::max({w / (pw - 8), h / (ph - 8), 1e-3});
      const int x = n == 1 ? p.width - pw : 0, y = n == 2 ? p.height - ph : 0;
      paste(picture, draw_slice(view, grey, label, structures), x, y);
      write_directions(picture, view, x, y);
    }
  }

  context.progress(0.3, "surface");
  const auto surface = surface_of(s, p, context.sub(0.3, 0.6));
  const int sw = flat ? pw : p.width, sh = flat ? ph : p.height;
  if (surface != nullptr && surface->GetNumberOfCells() > 0) {
    context.progress(0.6, "drawing");
    OffscreenWindow window(sw, sh);
    vtkNew<vtkRenderer> renderer;
    window.window()->AddRenderer(renderer);
    set_up_scene(renderer);
    const auto bone = make_bone_actor(surface);
    renderer->AddActor(bone);
    if (std::holds_alternative<Tets>(s.subject)) {
      bone->GetProperty()->SetEdgeVisibility(1);
      bone->GetProperty()->SetEdgeColor(0.25, 0.22, 0.18);
      bone->GetProperty()->SetInterpolationToFlat();
      if (surface->GetPointData()->GetScalars() != nullptr) bone->GetMapper()->ScalarVisibilityOn();
    }
    if (!structures.empty() && std::holds_alternative<Labels>(s.mask)) {
      bone->GetProperty()->SetOpacity(0.3);
      for (const Structure& each : structures) renderer->AddActor(structure_actor(std::get<Labels>(s.mask), each));
    }
    double b[6];
    surface->GetBounds(b);
    const Vec3 middle{(b[0] + b[1]) / 2, (b[2] + b[3]) / 2, (b[4] + b[5]) / 2};
    const double radius = 0.5 * length({b[1] - b[0], b[3] - b[2], b[5] - b[4]});
    look_at(renderer, middle, 0.82 * radius, eye_direction(p.view));
    set_depth(renderer, {true, 1});
    paste(picture, window.render(), p.width - sw, p.height - sh);
    context.report("triangles_drawn", static_cast<std::int64_t>(surface->GetNumberOfCells()));
  } else {
    write_text(picture, "no bone at this threshold", p.width - sw + 20, p.height - sh / 2, 18);
  }
  write_text(picture, "seen from " + std::string(EnumNames<ViewFrom>::values[static_cast<std::size_t>(p.view)]),
             p.width - sw + 10, p.height - sh + 24, 15, {150, 165, 180});
  if (const auto* tets = std::get_if<Tets>(&s.subject); tets != nullptr && !(*tets)->values.empty())
    write_legend(picture, **tets);
  if (!p.title.empty()) write_text(picture, p.title, p.width - sw + 10, p.height - 12, 16);
  context.progress(1.0);
  return picture;
}

}  // namespace osteo::inline display
