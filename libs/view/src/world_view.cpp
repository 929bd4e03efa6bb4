#include "osteo/view/world_view.h"

#include <vtkActor.h>
#include <vtkGenericOpenGLRenderWindow.h>
#include <vtkMapper.h>
#include <vtkMatrix4x4.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkRenderer.h>
#include <vtkUnsignedCharArray.h>

#include <cmath>

#include "osteo/bone/plates.h"
#include "osteo/bone/world_mesh.h"
#include "osteo/io/vtk_data.h"
#include "osteo/view/actors.h"
#include "osteo/view/offscreen.h"

namespace osteo {

WorldView::WorldView(vtkRenderer* renderer, const StructureMap* structures) : renderer_(renderer), structures_(structures) {
  if (structures == nullptr) return;
  const auto [mesh, whose] = structures->surface();
  auto data = to_vtk(mesh);
  vtkNew<vtkUnsignedCharArray> colours;
  colours->SetNumberOfComponents(3);
  for (const std::uint8_t s : whose) {
    const auto c = structures->colour_of(s);
    colours->InsertNextTuple3(std::round(255 * c[0]), std::round(255 * c[1]), std::round(255 * c[2]));
  }
  data->GetPointData()->SetScalars(colours);
  structures_actor_ = make_bone_actor(data);
  structures_actor_->GetMapper()->ScalarVisibilityOn();
  renderer_->AddActor(structures_actor_);
}

WorldView::~WorldView() {
  if (structures_actor_) renderer_->RemoveActor(structures_actor_);
  for (auto& [id, p] : plates_) {
    renderer_->RemoveActor(p.actor);
    if (p.moving) renderer_->RemoveActor(p.moving);
  }
}

void WorldView::update(const World& world, Follower& follower) {
  std::erase_if(bodies_, [&](const auto& b) { return world.find(b.first) == nullptr; });
  for (const PlacedBody& placed : world.bodies()) {
    const std::uint32_t id = placed.body->id;
    const LiveSurface* const surface = follower.surface(id);
    if (surface == nullptr) continue;
    auto& view = bodies_[id];
    const auto changed = follower.take_changed_bricks(id);
    if (!view) {
      // What is at risk goes with the first body, and the finer part of it.
      const bool patient = id == world.bodies().front().body->id || placed.of_region;
      view = std::make_unique<BoneView>(renderer_, patient ? structures_ : nullptr);
      view->show(*surface);
    } else {
      view->update(*surface, changed);
    }
    view->place(placed.world_from_body);
  }
  std::erase_if(plates_, [&](auto& p) {
    for (const Fixture& f : world.fixtures()) {
      if (f.id == p.first) return false;
    }
    renderer_->RemoveActor(p.second.actor);
    if (p.second.moving) renderer_->RemoveActor(p.second.moving);
    return true;
  });
  for (const Fixture& f : world.fixtures()) {
    const PlateModel& model = plate_library()[f.plate];
    Plate& p = plates_[f.id];
    const auto shown = [&](vtkSmartPointer<vtkActor>& actor, const TriMesh& mesh, const RigidTransform& pose) {
      if (!actor) {
        actor = make_plate_actor(mesh);
        actor->SetUserMatrix(vtkNew<vtkMatrix4x4>());
        renderer_->AddActor(actor);
      }
      set_matrix(actor->GetUserMatrix(), pose);
    };
    const RigidTransform pose = pose_of(world, f);
    shown(p.actor, model.mesh, pose);
    if (!model.moving.triangles.empty()) shown(p.moving, model.moving, pose * RigidTransform{{}, {f.opening_mm, 0, 0}});
  }
  if (follower.dust() != nullptr) {
    if (!dust_) dust_ = std::make_unique<DustView>(renderer_, world.bodies().front().body->bone.frame().spacing_mm.x);
    dust_->update(*follower.dust());
  }
}

void WorldView::highlight(std::uint32_t body) {
  for (auto& [id, view] : bodies_) view->highlight(id == body);
}

std::size_t WorldView::triangles() const {
  std::size_t total = 0;
  for (const auto& [id, view] : bodies_) total += view->triangles();
  return total;
}

Picture draw_world(const World& world, Follower& follower, const StructureMap* structures, const WorldPicture& p) {
  OffscreenWindow window(p.width, p.height);
  vtkNew<vtkRenderer> renderer;
  window.window()->AddRenderer(renderer);
  set_up_scene(renderer);
  WorldView view(renderer, structures);
  view.update(world, follower);
  look_at(renderer, p.centre_mm, p.radius_mm, p.eye);
  return window.render();
}

}  // namespace osteo
