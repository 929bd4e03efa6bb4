#include "review_scene.h"

#include <vtkActor.h>
#include <vtkCellArray.h>
#include <vtkNew.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkPolyDataMapper.h>
#include <vtkProperty.h>
#include <vtkRenderer.h>

#include <algorithm>

#include "osteo/simulation/camera/microscope.h"
#include "palette.h"
#include "review_panel.h"

namespace osteo::inline app {

ReviewScene::ReviewScene() = default;
ReviewScene::~ReviewScene() {
  end();
}

void ReviewScene::end() {
  control_.end();
  drawn_ = false;
  course_ = {};
  if (places_ && renderer_ != nullptr) renderer_->RemoveActor(places_);
  places_ = nullptr;
}

void ReviewScene::lay_out(RoomLayout& room, float em_pixels) {
  course_ = {};
  if (room.shown != Layout::review || !control_.shown()) return;
  const float high = std::min(kCourseEm * em_pixels, 0.4F * room.view.height);
  course_ = {room.view.x, room.view.bottom() - high, room.view.width, high};
  room.view.height -= high;
}

void ReviewScene::draw_findings() {
  osteo::draw_findings(control_);
}

void ReviewScene::show(vtkRenderer* renderer, std::unique_ptr<WorldView>& world,
                       std::array<std::unique_ptr<InstrumentView>, kMaxHands>& hands, ScopeInput& scope,
                       double seconds) {
  renderer_ = renderer;
  if (control_.poll() != ReviewControl::State::ready) return;
  control_.advance(seconds);
  SessionScene& scene = control_.review().player->scene();
  const bool first = !std::exchange(drawn_, true);
  if (first) world = std::make_unique<WorldView>(renderer, control_.review().structures.get());
  if (control_.take_moved() || first) {
    volume_mm3_ = scene.world()->volume_mm3();
    show_hands(hands);
  }
  world->update(*scene.world(), scene.readers());  // colours may follow later
  if (const auto places = control_.take_places()) show_places(renderer, *places);
  if (const auto at = control_.take_look()) scope.control.look_at(*at);
  if (control_.playing() && control_.surgeons_view) {
    const std::string* const note = control_.review().player->camera();
    if (const auto view = note == nullptr ? std::nullopt : view_of_note(*note)) scope.control.jump(*view);
  }
  if (control_.shown() && !course_.empty()) draw_course(course_, control_);
}

void ReviewScene::show_hands(std::array<std::unique_ptr<InstrumentView>, kMaxHands>& hands) {
  SessionPlayer& player = *control_.review().player;
  const World& world = *player.scene().world();
  for (std::size_t h = 0; h < hands.size(); ++h) {
    const TickRecord* const tick = h < player.hands() ? player.hand(h) : nullptr;
    if (tick == nullptr) {
      hands[h]->hide();
    } else {
      hands[h]->show(
          *tick, player.rate_hz(), [&](Vec3 p) { return is_bone(world, p); },
          world.cutting_guide(static_cast<std::uint32_t>(h)));
    }
  }
}

void ReviewScene::show_places(vtkRenderer* renderer, const std::vector<Vec3>& places_mm) {
  if (places_) renderer->RemoveActor(places_);
  places_ = nullptr;
  if (places_mm.empty()) return;
  vtkNew<vtkPoints> points;
  vtkNew<vtkCellArray> dots;
  for (const Vec3 p : places_mm) {
    const vtkIdType id = points->InsertNextPoint(p.x, p.y, p.z);
    dots->InsertNextCell(1, &id);
  }
  vtkNew<vtkPolyData> data;
  data->SetPoints(points);
  data->SetVerts(dots);
  vtkNew<vtkPolyDataMapper> mapper;
  mapper->SetInputData(data);
  // In front of the face of bone that they lie on.
  mapper->SetRelativeCoincidentTopologyPointOffsetParameter(-8);
  places_ = vtkSmartPointer<vtkActor>::New();
  places_->SetMapper(mapper);
  places_->GetProperty()->SetColor(palette::kVermillion.red, palette::kVermillion.green, palette::kVermillion.blue);
  places_->GetProperty()->SetPointSize(4);
  places_->GetProperty()->LightingOff();
  renderer->AddActor(places_);
}

void ReviewScene::state(RoomState& state) const {
  if (control_.state() != ReviewControl::State::ready) return;
  state.findings = static_cast<int>(control_.review().findings.size());
  state.timeline = control_.shown();
  state.playing = control_.playing();
  state.review_s = control_.now_s();
  state.review_mm3 = volume_mm3_;
}

}  // namespace osteo::inline app
