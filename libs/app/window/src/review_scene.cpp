#include "review_scene.h"

// GLEW, through VTK, must come before anything that includes GL.
#include <vtk_glew.h>

#include <vtkActor.h>
#include <vtkCellArray.h>
#include <vtkNew.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkPolyDataMapper.h>
#include <vtkProperty.h>
#include <vtkRenderer.h>

#include <algorithm>

#include "gl_texture.h"
#include "osteo/core/base/translate.h"
#include "osteo/simulation/camera/microscope.h"
#include "palette.h"
#include "ui_kit.h"

namespace osteo::inline app {

ReviewScene::ReviewScene() = default;
ReviewScene::~ReviewScene() {
  end();
}

void ReviewScene::end() {
  control_.end();
  for (unsigned& picture : pictures_) {
    if (picture != 0) glDeleteTextures(1, &picture);
    picture = 0;
  }
  due_.reset();
  view_before_.reset();
  taken_ = 0;
  drawn_ = false;
  course_ = {};
  if (places_ && renderer_ != nullptr) renderer_->RemoveActor(places_);
  places_ = nullptr;
}

void ReviewScene::lay_out(ViewLayout& layout, float em_pixels) {
  course_ = {};
  if (layout.shown != Layout::review || !control_.shown()) return;
  const float high = std::min(kCourseEm * em_pixels, 0.4F * layout.view.height);
  // Below the picture, or where that is too narrow for the player's buttons below the page as well.
  constexpr float kPlayer = 400;
  const bool whole = layout.view.width < kPlayer * layout.unit;
  const float from = whole ? layout.page.x : layout.view.x;
  course_ = {from, layout.view.bottom() - high, layout.view.right() - from, high};
  layout.view.height -= high;
  if (whole) layout.page.height -= high;
}

void ReviewScene::draw_findings() {
  osteo::draw_findings(control_, pictures_);
}

void ReviewScene::draw_switch() {
  bool shown = control_.shown();
  if (control_.state() == ReviewControl::State::ready && kit_switch(tr("Course of the session (Ctrl-T)"), shown))
    control_.show(shown);
}

bool ReviewScene::found_serious() const {
  return control_.state() == ReviewControl::State::ready && serious(control_.review().findings);
}

// Each finding once, from where the surgeon looked last; then the camera is where it was, and the worst is looked at.
void ReviewScene::aim_at_next(ScopeInput& scope) {
  constexpr double kFieldMm = 30;
  if (due_) return;
  const auto shown = shown_findings(control_.review().findings);
  for (; taken_ < shown.size(); ++taken_) {
    const std::optional<Vec3> at = control_.review().findings[shown[taken_]].at_mm;
    if (!at) continue;
    if (!view_before_) view_before_ = scope.control.target();
    ScopeView view = *view_before_;
    view.focus_mm = *at;
    magnify(view, kFieldNumberMm / kFieldMm);
    scope.control.jump(view);
    due_ = taken_;
    return;
  }
  if (view_before_) scope.control.jump(*view_before_);
  view_before_.reset();
  if (taken_ == shown.size()) control_.present();
  ++taken_;  // once
}

void ReviewScene::take_picture(const PictureArea& area, int window_height) {
  if (!due_) return;
  // As wide as the card's: 7 to 5.
  const double wide = std::min(area.width, 1.4 * area.height), high = wide / 1.4;
  const int width = std::max(1, static_cast<int>(wide)), height = std::max(1, static_cast<int>(high));
  std::vector<unsigned char> pixels(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 3);
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadBuffer(GL_BACK);
  glReadPixels(static_cast<int>(area.x + (area.width - wide) / 2),
               window_height - static_cast<int>(area.y + (area.height + high) / 2), width, height, GL_RGB,
               GL_UNSIGNED_BYTE, pixels.data());
  unsigned& picture = pictures_[*due_];
  if (picture == 0) picture = make_texture();
  put_pixels(picture, width, height, 3, pixels.data());
  glBindTexture(GL_TEXTURE_2D, picture);
  glGenerateMipmap(GL_TEXTURE_2D);  // it is shown far smaller
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
  glBindTexture(GL_TEXTURE_2D, 0);
  due_.reset();
  ++taken_;
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
  if (taken_ <= shown_findings(control_.review().findings).size()) aim_at_next(scope);
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

void ReviewScene::state(ViewState& state) const {
  if (control_.state() != ReviewControl::State::ready) return;
  state.findings = static_cast<int>(control_.review().findings.size());
  state.timeline = control_.shown();
  state.playing = control_.playing();
  state.review_s = control_.now_s();
  state.speed = control_.speed();
  state.review_mm3 = volume_mm3_;
}

}  // namespace osteo::inline app
