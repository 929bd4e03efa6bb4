#include "osteo/display/view/instrument_view.h"

#include <vtkActor.h>
#include <vtkCellArray.h>
#include <vtkMatrix4x4.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkPolyDataMapper.h>
#include <vtkPolyDataNormals.h>
#include <vtkProperty.h>
#include <vtkRenderer.h>
#include <vtkUnsignedCharArray.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <numbers>
#include <optional>

#include "osteo/display/view/actors.h"
#include "osteo/imaging/io/vtk_data.h"
#include "osteo/simulation/bone/plates.h"
#include "osteo/simulation/bone/world_mesh.h"

namespace osteo::inline display {
namespace {

using Clock = std::chrono::steady_clock;

vtkSmartPointer<vtkPolyData> shaded(vtkPolyData* data) {
  vtkNew<vtkPolyDataNormals> normals;
  normals->SetInputData(data);
  normals->SetFeatureAngle(38);
  normals->SplittingOn();
  normals->Update();
  auto out = vtkSmartPointer<vtkPolyData>::New();
  out->ShallowCopy(normals->GetOutput());
  return out;
}

// A screw along -z, its head's underside at z = 0: a dome with a cross in it would be too small to see, so a dome;
// threads as rings that climb by their pitch in a turn.
vtkSmartPointer<vtkPolyData> screw_surface(double diameter_mm, double length_mm) {
  constexpr int kAround = 24;
  const double r = diameter_mm / 2, pitch = 0.4 * diameter_mm, core = 0.72 * r;
  vtkNew<vtkPoints> points;
  vtkNew<vtkCellArray> cells;
  int rings = 0;
  const auto ring = [&](auto radius_of, auto height_of) {
    for (int a = 0; a < kAround; ++a) {
      const double angle = 2 * std::numbers::pi * a / kAround, radius = radius_of(angle);
      points->InsertNextPoint(radius * std::cos(angle), radius * std::sin(angle), height_of(angle));
    }
    for (int a = 0; rings > 0 && a < kAround; ++a) {
      const vtkIdType next = (a + 1) % kAround, below = static_cast<vtkIdType>(rings - 1) * kAround,
                      above = below + kAround;
      const vtkIdType quad[4] = {below + a, below + next, above + next, above + a};
      cells->InsertNextCell(4, quad);
    }
    ++rings;
  };
  const auto circle = [&](double radius, double z) { ring([=](double) { return radius; }, [=](double) { return z; }); };
  const double tip = 0.8 * diameter_mm;
  circle(0.01, -length_mm);
  const int steps = static_cast<int>(std::ceil(length_mm / (pitch / 6)));
  for (int n = 1; n <= steps; ++n) {
    const double z = -length_mm + length_mm * n / steps;
    const double whole = std::min(1.0, (z + length_mm) / tip);
    ring(
        [&](double angle) {
          const double turn = z / pitch - angle / (2 * std::numbers::pi), t = turn - std::floor(turn);
          return whole * (core + (r - core) * std::max(0.0, 1 - std::abs(2 * t - 1) * 1.8));
        },
        [&](double) { return z; });
  }
  for (const auto& [radius, z] :
       {std::pair{0.9, 0.0}, {0.9, 0.12}, {0.8, 0.28}, {0.55, 0.42}, {0.28, 0.46}, {0.26, 0.22}, {0.005, 0.20}})
    circle(radius * diameter_mm, z * diameter_mm);
  vtkNew<vtkPolyData> data;
  data->SetPoints(points);
  data->SetPolys(cells);
  return shaded(data);
}

bool same(const RigidTransform& a, const RigidTransform& b) {
  return a.rotation == b.rotation && a.shift_mm == b.shift_mm;
}

struct Part {
  vtkSmartPointer<vtkPolyData> data;
  vtkNew<vtkUnsignedCharArray> colours;
  vtkNew<vtkActor> actor;
  vtkNew<vtkMatrix4x4> matrix;
  std::size_t tinted = 0;

  Part(vtkRenderer* renderer, vtkPolyData* surface) : data(shaded(surface)) {
    colours->SetNumberOfComponents(3);
    colours->SetNumberOfTuples(data->GetNumberOfPoints());
    data->GetPointData()->SetScalars(colours);
    vtkNew<vtkPolyDataMapper> mapper;
    mapper->SetInputData(data);
    actor->SetMapper(mapper);
    actor->SetUserMatrix(matrix);
    vtkProperty* const p = actor->GetProperty();
    p->SetAmbient(0.1);
    p->SetDiffuse(0.75);
    p->SetSpecular(0.5);
    p->SetSpecularPower(35);
    renderer->AddActor(actor);
    plain();
  }
  void plain() {
    tinted = 0;
    for (vtkIdType n = 0; n < data->GetNumberOfPoints(); ++n) colours->SetTuple3(n, 164, 172, 190);
    colours->Modified();
  }
  // Along the screws out of the bone again; what is seen from above by the underside below it.
  void tint(const World& world, const RigidTransform& pose, double thickness_mm) {
    constexpr double kStepMm = 0.1, kMaxMm = 1;
    tinted = 0;
    for (vtkIdType n = 0; n < data->GetNumberOfPoints(); ++n) {
      double at[3];
      data->GetPoint(n, at);
      const Vec3 p = pose({at[0], at[1], at[2] < thickness_mm + 0.2 ? 0.02 : at[2]}), up = pose.rotation.column[2];
      double deep = 0;
      while (deep < kMaxMm && is_bone(world, p + up * deep)) deep += kStepMm;
      const double red = deep > kPlateCollisionMm
                             ? 0.35 + 0.65 * std::min(1.0, (deep - kPlateCollisionMm) / (kMaxMm - kPlateCollisionMm))
                             : 0;
      tinted += red > 0 ? 1 : 0;
      colours->SetTuple3(n, 164 + (230 - 164) * red, 172 + (50 - 172) * red, 190 + (40 - 190) * red);
    }
    colours->Modified();
    data->Modified();
  }
};

}  // namespace

double plate_in_bone_mm(const World& world, const PlateModel& plate, const RigidTransform& world_from_plate,
                        double opening_mm) {
  double deepest = 0;
  for (const PlateGap& g : plate_gaps(world, plate, world_from_plate, opening_mm, 150, 1)) {
    if (g.body != SceneAction::kNobody) deepest = std::max(deepest, -g.gap_mm);
  }
  return deepest;
}

struct PlateView::Impl {
  struct Drawn {
    std::uint32_t plate = 0;
    std::vector<std::unique_ptr<Part>> parts;  // what stays, what moves, then the screws
    std::vector<RigidTransform> at;
    Clock::time_point look_again{};
  };
  vtkRenderer* renderer;
  std::map<std::uint32_t, Drawn> fixed;
  std::optional<Drawn> in_hand;

  Drawn make(std::uint32_t plate, bool screws) const {
    const PlateModel& model = plate_library()[plate];
    Drawn d;
    d.plate = plate;
    d.parts.push_back(std::make_unique<Part>(renderer, to_vtk(model.mesh)));
    if (!model.moving.triangles.empty()) d.parts.push_back(std::make_unique<Part>(renderer, to_vtk(model.moving)));
    const auto screw = screws ? screw_surface(model.screw_mm, 3 * model.screw_mm) : nullptr;
    for (std::size_t n = 0; screws && n < model.holes_mm.size(); ++n)
      d.parts.push_back(std::make_unique<Part>(renderer, screw));
    return d;
  }
  void remove(const Drawn& d) const {
    for (const auto& p : d.parts) renderer->RemoveActor(p->actor);
  }
  void place(Drawn& d, const World& world, const RigidTransform& pose, double opening_mm, bool always) const {
    const PlateModel& model = plate_library()[d.plate];
    const RigidTransform opened = pose * RigidTransform{{}, {opening_mm, 0, 0}};
    const bool opens = !model.moving.triangles.empty();
    std::vector<RigidTransform> at{pose};
    if (opens) at.push_back(opened);
    for (const Vec3& hole : model.holes_mm) {
      // Its head lies in the countersink, half of it above the plate.
      const RigidTransform in_plate{{}, hole + Vec3{0, 0, 0.7 * model.thickness_mm}};
      if (at.size() < d.parts.size()) at.push_back((opens && hole.x > 0 ? opened : pose) * in_plate);
    }
    const bool moved = d.at.size() != at.size() || !std::equal(at.begin(), at.end(), d.at.begin(), same);
    const auto now = Clock::now();
    if (!moved && !always && now < d.look_again) return;
    d.look_again = now + std::chrono::seconds(1);
    for (std::size_t n = 0; n < at.size(); ++n) {
      set_matrix(d.parts[n]->matrix, at[n]);
      if (n < (opens ? 2U : 1U)) d.parts[n]->tint(world, at[n], model.thickness_mm);  // screws are meant to be in bone
    }
    d.at = std::move(at);
  }
};

PlateView::PlateView(vtkRenderer* renderer) : impl_(std::make_unique<Impl>()) {
  impl_->renderer = renderer;
}

PlateView::~PlateView() {
  for (auto& [id, d] : impl_->fixed) impl_->remove(d);
  hide_in_hand();
}

void PlateView::update(const World& world) {
  Impl& m = *impl_;
  std::erase_if(m.fixed, [&](auto& f) {
    const bool there = std::any_of(world.fixtures().begin(), world.fixtures().end(),
                                   [&](const Fixture& x) { return x.id == f.first; });
    if (!there) m.remove(f.second);
    return !there;
  });
  for (const Fixture& f : world.fixtures()) {
    auto it = m.fixed.find(f.id);
    if (it == m.fixed.end()) it = m.fixed.emplace(f.id, m.make(f.plate, true)).first;
    m.place(it->second, world, pose_of(world, f), f.opening_mm, false);
  }
}

void PlateView::show_in_hand(const World& world, std::uint32_t plate, const RigidTransform& world_from_plate) {
  Impl& m = *impl_;
  if (m.in_hand && m.in_hand->plate != plate) hide_in_hand();
  if (!m.in_hand) m.in_hand = m.make(plate, false);
  m.place(*m.in_hand, world, world_from_plate, 0, true);
}

void PlateView::hide_in_hand() {
  if (impl_->in_hand) impl_->remove(*impl_->in_hand);
  impl_->in_hand.reset();
}

std::size_t PlateView::tinted() const {
  std::size_t all = 0;
  const auto add = [&](const Impl::Drawn& d) {
    for (const auto& p : d.parts) all += p->tinted;
  };
  for (const auto& [id, d] : impl_->fixed) add(d);
  if (impl_->in_hand) add(*impl_->in_hand);
  return all;
}

}  // namespace osteo::inline display
