#include "osteo/display/view/world_view.h"

#include <meshoptimizer.h>
#include <vtkActor.h>
#include <vtkCamera.h>
#include <vtkFloatArray.h>
#include <vtkGenericOpenGLRenderWindow.h>
#include <vtkMapper.h>
#include <vtkMatrix4x4.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkProperty.h>
#include <vtkRenderer.h>
#include <vtkTypeInt32Array.h>

#include <cmath>
#include <optional>

#include "osteo/display/view/actors.h"
#include "osteo/display/view/detail/visible.h"
#include "osteo/display/view/offscreen.h"
#include "osteo/display/view/structures_view.h"
#include "osteo/imaging/io/vtk_data.h"

namespace osteo::inline display {
namespace {

// So long nothing has happened when what can wait is done.
constexpr std::chrono::milliseconds kStill{300};

}  // namespace

WorldView::WorldView(vtkRenderer* renderer, const StructureMap* structures)
    : renderer_(renderer), structures_(structures), plates_(renderer) {}

WorldView::~WorldView() {
  stop_ = true;
  if (coarsening_.valid()) coarsening_.wait();
  if (looking_.valid()) looking_.wait();
  for (const SoftView& s : soft_) renderer_->RemoveActor(s.actor);
}

void WorldView::update(const World& world, SceneReaders& readers, Work work) {
  const auto now = std::chrono::steady_clock::now();
  const bool gone = std::erase_if(bodies_, [&](const auto& b) { return world.find(b.first) == nullptr; }) > 0;
  if (readers.surface) {
    // Normals a little way off a cut may follow a quarter of a second later.
    constexpr std::chrono::milliseconds kSettle{250};
    readers.surface->shade();
    if (work == Work::all || now >= settle_at_) {
      readers.surface->settle();
      settle_at_ = now + kSettle;
    }
  }
  const bool film_changed = look_at_film(readers, now);
  const bool heat_changed = look_at_heat(readers, now);
  bool regions = false, others = gone;
  for (const PlacedBody& placed : world.bodies()) {
    const std::uint32_t id = placed.body->id;
    const LiveSurface* const surface = readers.surface ? readers.surface->surface(id) : nullptr;
    if (surface == nullptr) continue;
    auto& view = bodies_[id];
    const auto changed = readers.surface->take_changed_bricks(id);
    regions |= placed.of_region;
    others |= !view;
    if (!view) {
      // What is at risk goes with the first body, and the finer part of it.
      const bool patient = id == world.bodies().front().body->id || placed.of_region;
      view = std::make_unique<BoneView>(renderer_, patient ? structures_ : nullptr, placed.body->hardness);
      view->set_film(&film_);
      view->place(placed.world_from_body);
      view->show(*surface);
      changed_at_ = now;
    } else if (!changed.empty()) {
      view->update(*surface, changed);
      changed_at_ = now;
    }
    if (work == Work::all || now - changed_at_ > kStill) view->refresh(*surface);
    view->place(placed.world_from_body);
    if (film_changed) view->wet(*surface);
    if (heat_changed)
      view->warm(*surface, warm_places_, [&](Vec3 at) { return readers.heat ? readers.heat->celsius_at(at) : 0; });
  }
  if (regions && others) shade_regions(world, readers);
  plates_.update(world);
  if (readers.dust) {
    if (!dust_) dust_ = std::make_unique<DustView>(renderer_, world.bodies().front().body->bone.frame().spacing_mm.x);
    dust_->update(readers.dust->dust());
  } else {
    dust_.reset();
  }
}

// Finer regions and the bone around them are bodies of their own, but one bone: they shade each other.
void WorldView::shade_regions(const World& world, const SceneReaders& readers) {
  std::vector<BoneView*> patient;
  std::vector<const LiveSurface*> surfaces;
  for (const PlacedBody& placed : world.bodies()) {
    const auto view = bodies_.find(placed.body->id);
    if (view == bodies_.end() || (placed.body->id != world.bodies().front().body->id && !placed.of_region)) continue;
    patient.push_back(view->second.get());
    surfaces.push_back(readers.surface->surface(placed.body->id));
  }
  for (BoneView* const view : patient) {
    std::vector<BoneView*> others = patient;
    std::erase(others, view);
    view->shade_with(others);
  }
  for (std::size_t n = 0; n < patient.size(); ++n) patient[n]->refresh(*surfaces[n]);
}

// Ten times a second at most: water runs, and its looks change slowly.
bool WorldView::look_at_film(const SceneReaders& readers, std::chrono::steady_clock::time_point now) {
  constexpr std::chrono::milliseconds kEvery{100};
  if (!readers.dust) {
    film_of_.reset();
    return film_.clear();
  }
  // What was switched off and on is another, and the film looks into the bone that it lies on.
  const Dust& dust = readers.dust->dust();
  const bool other = film_dust_ != &dust || !film_of_ || dust.version() < *film_of_;
  if (!other && (now < film_at_ || dust.version() == *film_of_)) return false;
  film_at_ = now + kEvery;
  film_dust_ = &dust;
  film_of_ = dust.version();
  return film_.update(dust);
}

// Five times a second: heat spreads slowly.
bool WorldView::look_at_heat(const SceneReaders& readers, std::chrono::steady_clock::time_point now) {
  constexpr std::chrono::milliseconds kEvery{200};
  const bool was_warm = !warm_places_.empty();
  if (!readers.heat) warm_places_.clear();
  if (!readers.heat) return was_warm;
  if (now < heat_at_) return false;
  heat_at_ = now + kEvery;
  warm_places_.clear();
  readers.heat->for_warm_places(
      [&](Vec3 centre_mm, double radius_mm) { warm_places_.emplace_back(centre_mm, radius_mm); });
  return was_warm || !warm_places_.empty();
}

void WorldView::update_soft(SoftTissue& soft) {
  // Muscle, fat, dura, gland: bodies side by side are distinguished.
  constexpr double kColours[][3] = {{0.80, 0.42, 0.40}, {0.84, 0.68, 0.42}, {0.72, 0.52, 0.62}, {0.62, 0.32, 0.28}};
  soft_.resize(soft.size());
  for (std::size_t n = 0; n < soft.size(); ++n) {
    SoftView& view = soft_[n];
    SoftBody& body = soft.body(n);
    if (view.actor && view.version == body.version() && view.updates == body.updates()) continue;
    const TriMesh& mesh = body.drawn();
    view.updates = body.updates();
    if (!view.actor || view.version != body.version()) {
      if (view.actor) renderer_->RemoveActor(view.actor);
      view.version = body.version();
      view.data = to_vtk(mesh);
      view.actor = make_bone_actor(view.data);
      const auto& colour = kColours[n % std::size(kColours)];
      view.actor->GetProperty()->SetColor(colour[0], colour[1], colour[2]);
      view.actor->GetProperty()->SetSpecular(0.3);
      view.actor->GetMapper()->StaticOff();
      renderer_->AddActor(view.actor);
      continue;
    }
    vtkPoints* const at = view.data->GetPoints();
    for (std::size_t p = 0; p < mesh.points_mm.size(); ++p)
      at->SetPoint(static_cast<vtkIdType>(p), mesh.points_mm[p].data());
    at->Modified();
    view.data->Modified();
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

std::size_t WorldView::drawn_triangles() const {
  std::size_t total = 0;
  for (const auto& [id, view] : bodies_) total += view->drawn_triangles();
  return total;
}

void WorldView::wake(bool coarse) {
  looked_ = false;
  for (auto& [id, view] : bodies_) view->draw_all(coarse);
}

// A thread makes the coarse triangles of all chunks that have none, or old ones.
void WorldView::make_coarse() {
  std::vector<Seen> jobs;
  for (const auto& [id, view] : bodies_) {
    for (std::size_t n = 0; n < view->chunks(); ++n) {
      if (!view->has_coarse(n)) jobs.push_back({id, n, view->arrays(n), {}, kCoarse * view->voxel_mm()});
    }
  }
  if (jobs.empty()) return;
  coarsening_ = std::async(std::launch::async, [this, jobs = std::move(jobs)]() mutable {
    for (Seen& job : jobs) {
      if (stop_) break;
      auto& a = job.arrays;
      job.triangles = coarse_triangles(
          {a.points_mm->GetPointer(0), static_cast<std::size_t>(a.points_mm->GetNumberOfValues())},
          {a.triangles->GetPointer(0), static_cast<std::size_t>(a.triangles->GetNumberOfValues())}, job.error_mm);
    }
    return jobs;
  });
}

void WorldView::take_coarse() {
  if (!coarsening_.valid() || coarsening_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return;
  for (Seen& s : coarsening_.get()) {
    if (const auto body = bodies_.find(s.body); body != bodies_.end() && s.chunk < body->second->chunks())
      body->second->keep_coarse(s.chunk, s.arrays.version, std::move(s.triangles));
  }
}

bool WorldView::rest(int width, int height, bool coarse) {
  // All that decides what is seen; not the clipping planes, which follow the drill.
  vtkCamera* const camera = renderer_->GetActiveCamera();
  std::vector<double> now{static_cast<double>(width), static_cast<double>(height), camera->GetViewAngle()};
  for (const double* const v : {camera->GetPosition(), camera->GetFocalPoint(), camera->GetViewUp()})
    now.insert(now.end(), v, v + 3);
  for (const auto& [id, view] : bodies_) {
    const RigidTransform t = view->placed();
    for (const Vec3 v : {t.rotation.column[0], t.rotation.column[1], t.shift_mm})
      now.insert(now.end(), {v.x, v.y, v.z});
  }
  std::uint64_t version = 0;
  for (const auto& [id, view] : bodies_) version += view->version();
  take_coarse();
  const auto time = std::chrono::steady_clock::now();
  if (now != camera_) {
    wake(coarse);
    camera_ = std::move(now);
    since_ = time;
    return false;
  }
  if (looking_.valid() && looking_.wait_for(std::chrono::seconds(0)) == std::future_status::ready) {
    const std::vector<Seen> seen = looking_.get();
    // For a camera that has moved since it tells nothing.
    if (looked_) {
      for (const Seen& s : seen) {
        if (const auto body = bodies_.find(s.body); body != bodies_.end() && s.chunk < body->second->chunks())
          body->second->draw_only(s.chunk, s.arrays.version, s.triangles);
      }
    }
  }
  if (looking_.valid() || time - since_ < kStill) return false;
  const bool still = time - changed_at_ > kStill;
  // Of what the camera saw before the bone changed, and lay whole since, only what is seen, once the bone rests.
  if (looked_ && (looked_version_ == version || !still)) {
    if (still && coarse && coarse_version_ != version && !coarsening_.valid()) {
      coarse_version_ = version;
      make_coarse();
    }
    return still;
  }
  looked_version_ = version;
  looked_ = true;
  const double* const m =
      camera->GetCompositeProjectionTransformMatrix(renderer_->GetTiledAspectRatio(), -1, 1)->GetData();
  std::vector<Seen> jobs;
  std::vector<std::array<double, 16>> matrices;
  for (const auto& [id, view] : bodies_) {
    const RigidTransform t = view->placed();
    std::array<double, 16> clip{};
    for (std::size_t r = 0; r < 4; ++r) {
      for (std::size_t c = 0; c < 4; ++c) {
        for (std::size_t k = 0; k < 3; ++k)
          clip[4 * r + c] += m[4 * r + k] * (c < 3 ? t.rotation.column[c][k] : t.shift_mm[k]);
        if (c == 3) clip[4 * r + c] += m[4 * r + 3];
      }
    }
    for (std::size_t n = 0; n < view->chunks(); ++n) {
      jobs.push_back({id, n, view->arrays(n), {}, 0});
      matrices.push_back(clip);
    }
  }
  looking_ = std::async(std::launch::async, [jobs = std::move(jobs), matrices = std::move(matrices), width,
                                             height]() mutable {
    std::vector<VisibleMesh> meshes;
    for (std::size_t n = 0; n < jobs.size(); ++n) {
      auto& a = jobs[n].arrays;
      meshes.push_back({{a.points_mm->GetPointer(0), static_cast<std::size_t>(a.points_mm->GetNumberOfValues())},
                        {a.triangles->GetPointer(0), static_cast<std::size_t>(a.triangles->GetNumberOfValues())},
                        matrices[n]});
    }
    const auto seen = visible_triangles(meshes, width, height);
    std::vector<std::uint32_t> order;
    for (std::size_t n = 0; n < jobs.size(); ++n) {
      for (const std::uint32_t t : seen[n]) {
        for (std::size_t c = 0; c < 3; ++c)
          jobs[n].triangles.push_back(static_cast<std::uint32_t>(meshes[n].triangles[3 * t + c]));
      }
      if (jobs[n].triangles.empty()) continue;
      // So that a corner is worked on once for the triangles that share it.
      order.resize(jobs[n].triangles.size());
      meshopt_optimizeVertexCache(order.data(), jobs[n].triangles.data(), order.size(), meshes[n].points_mm.size() / 3);
      jobs[n].triangles = order;
    }
    return jobs;
  });
  return false;
}

Picture draw_world(const World& world, SceneReaders& readers, const StructureMap* structures, const WorldPicture& p,
                   SoftTissue* soft) {
  OffscreenWindow window(p.width, p.height);
  vtkNew<vtkRenderer> renderer;
  window.window()->AddRenderer(renderer);
  set_up_scene(renderer);
  WorldView view(renderer, structures);
  std::optional<StructuresView> at_risk;
  if (structures != nullptr) at_risk.emplace(renderer, *structures);
  view.update(world, readers);
  if (at_risk) at_risk->fade_at_border(world.bodies().front().body->bone.frame());
  if (soft != nullptr) view.update_soft(*soft);
  look_at(renderer, p.centre_mm, p.radius_mm, p.eye);
  set_depth(renderer, {true, 1});
  return window.render();
}

}  // namespace osteo::inline display
