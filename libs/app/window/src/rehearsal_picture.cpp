#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>
#include <vector>

#include "gamepad.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/translate.h"
#include "osteo/display/view/actors.h"
#include "osteo/display/view/offscreen.h"
#include "osteo/imaging/io/surface_io.h"
#include "osteo/simulation/bone/world_mesh.h"
#include "rehearsal_parts.h"
#include "scope_panel.h"

namespace osteo::inline app {

// What the camera may be asked to look at.
ScopeScene RehearsalWindow::scope_scene() {
  ScopeScene scene{control_.centre_mm(), control_.radius_mm(), control_.goal_mm(), {0, 0, 1}, {}};
  Rehearsal* const rehearsal = actions_.rehearsal();
  if (rehearsal == nullptr || control_.failure()) return scene;
  if (const TickRecord tick = rehearsal->latest(); tick.tick != 0) {
    scene.drill_mm = from_floats(tick.device.position_mm) + from_floats(tick.shown_offset_mm);
    scene.handle = normalized(from_floats(tick.device.axis));
  }
  scene.bone = [rehearsal, reach = length(scene.centre_mm - scope_.view().eye_mm()) + 4 * scene.radius_mm](
                   Vec3 from, Vec3 direction) {
    std::optional<BoneHit> hit;
    rehearsal->look([&](const World& world, SceneReaders&) { hit = bone_on_ray(world, from, direction, reach); });
    return hit ? std::optional(hit->at_mm) : std::nullopt;
  };
  return scene;
}

// The bone in the middle of the picture; or the middle of all of it.
Vec3 RehearsalWindow::middle_of_bone() {
  const ScopeScene scene = scope_scene();
  return (scene.bone ? scene.bone(scope_.view().eye_mm(), scope_.view().back * -1) : std::nullopt)
      .value_or(scene.centre_mm);
}

void RehearsalWindow::show() {
  Rehearsal& now = control_.rehearsal();
  const ViewScene scene = view_scene(now);
  main_view_.draw(scene);
  look_at_settings();
  if (screenshot_wanted_) main_view_.draw_caption(scene);
  if (MonitorController* const controller = monitor_controller()) monitor_.draw(*controller);
  cuts_.draw(now, control_.tools().tool() == HandTools::Tool::saw ? &control_.tools().cut() : nullptr);
  now.look([&](const World& world, SceneReaders& readers) {
    world_view_->update(world, readers);
    if (now.soft() != nullptr) world_view_->update_soft(*now.soft());
    look_at_warmth(readers);
  });
  world_view_->highlight(control_.tools().piece());
  const TickRecord tick = now.latest();
  show_tutor(now);
  show_instruments(now);
  report_touch(now);
  now.look([&](const World& world, SceneReaders&) {
    tools_->show(control_.tools(), tick, world, now.structures(), ImGui::GetTime());
  });
  draw_saw_line(control_.tools(), tools_->preview(), scene.project, cuts_.scene(), ImGui::GetBackgroundDrawList());
  use_water();
  note_camera(now);
  hints_.frame(scope_.view().eye_mm(), ImGui::GetTime());
  hints_.draw(main_view_.free_room());
}

// For the panel, five times a second as the bone's colours.
void RehearsalWindow::look_at_warmth(const SceneReaders& readers) {
  if (!readers.heat) {
    warmth_.reset();
    return;
  }
  const auto now = std::chrono::steady_clock::now();
  if (warmth_ && now < warmth_at_) return;
  warmth_at_ = now + std::chrono::milliseconds(200);
  warmth_.emplace();
  warmth_->bone_c = readers.heat->hottest_c();
  for (const auto& [value, s] : readers.heat->structures()) warmth_->structures_c[value] = s.now_c;
}

void RehearsalWindow::show_instruments(Rehearsal& now) {
  now.look([&](const World& world, SceneReaders&) {
    const auto solid = [&](Vec3 p) { return is_bone(world, p); };
    for (std::size_t hand = 0; hand < now.hands(); ++hand) {
      TickRecord tick = now.latest(hand);
      last_seen_[hand] = tick;
      if (tick.tick == 0 && hand == 0) tick.device.tool = static_cast<std::uint8_t>(control_.instrument());
      if (hand > 0 && (tick.tick == 0 || control_.second_hand_empty())) {
        hands_[hand]->hide();
      } else {
        hands_[hand]->show(tick, now.rate_hz(), solid, world.cutting_guide(static_cast<std::uint32_t>(hand)));
      }
    }
  });
}

void RehearsalWindow::look_at_tutor() {
  if (!actions_.tutor) return;
  Rehearsal* const rehearsal = actions_.rehearsal();
  std::vector<std::string> injured;
  harm_.clear();
  if (rehearsal != nullptr && work_ && rehearsal->structures() != nullptr) {
    const auto harm = work_->harm();
    harm_ = harm_lines(harm, rehearsal->structures());
    for (const auto& [value, h] : harm) {
      if (h.violations > 0) injured.push_back(rehearsal->structures()->name_of(value));
    }
  }
  tutor_ = actions_.tutor();
  if (actions_.steps) tutor_.steps = actions_.steps(injured);
}

void RehearsalWindow::show_tutor(Rehearsal& now) {
  if (tutor_.title.empty()) return;
  if (const auto said = links_.look(tutor_)) control_.say(*said);
  std::vector<TickRecord> hands;
  for (std::size_t hand = 0; hand < now.hands(); ++hand) {
    hands.push_back(now.latest(hand));
    if (hand > 0)
      hands_[hand]->report_apart({kPartnerColour.red, kPartnerColour.green, kPartnerColour.blue},
                                 tutor_.ghosts ? 0.5 : 1);
  }
  tutor_panel_.draw(
      tutor_, hands, harm_, cuts_.scene(), [this](Vec3 at) { return project(at); }, main_view_.pressed());
}

void RehearsalWindow::report_touch(Rehearsal& now) {
  if (!tutor_.title.empty()) return;  // hands that lead each other are where the other is
  std::vector<TickRecord> hands;
  for (std::size_t hand = 0; hand < now.hands(); ++hand) {
    const TickRecord tick = now.latest(hand);
    if (tick.tick != 0 && (hand == 0 || !control_.second_hand_empty())) hands.push_back(tick);
  }
  if (const auto reported = touch_.look(hands)) {
    control_.say(reported->text);
    now.note("touch", reported->note);
  }
  const auto at = touch_.at_mm() ? project(*touch_.at_mm()) : std::nullopt;
  if (!at) return;
  ImDrawList* const list = ImGui::GetBackgroundDrawList();
  const float r = 0.7F * ImGui::GetFontSize();
  list->AddCircle({(*at)[0], (*at)[1]}, r, IM_COL32(0, 0, 0, 200), 0, 5);
  list->AddCircle({(*at)[0], (*at)[1]}, r, IM_COL32(255, 190, 60, 255), 0, 2.5F);
}

void RehearsalWindow::note_camera(Rehearsal& rehearsal) {
  const ScopeView& view = scope_.view();
  const CameraView noted{
      view.eye_mm(),     view.focus_mm, view.up, view.view_angle_deg(scope_.area), view.pixels_per_mm(scope_.area),
      view.magnification};
  const double now_s = std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
  if (const auto note = camera_notes_.next(noted, now_s, &rehearsal)) rehearsal.note("camera", *note);
}

ViewScene RehearsalWindow::view_scene(Rehearsal& now) {
  MachineFacts machine;
  machine.device = device_name_;
  machine.drawn_millions = static_cast<double>(world_view_->drawn_triangles()) / 1e6;
  machine.triangles_millions = static_cast<double>(world_view_->triangles()) / 1e6;
  machine.scan = &scan_;
  machine.approval = approval_;
  machine.approval_ended = approval_ended_;
  machine.case_hash = case_hash_;
  machine.pictures = painter_->words();
  return {control_,
          sound_,
          now.latest(),
          machine,
          scope_.view().pixels_per_mm(scope_.area),
          scope_.view().magnification,
          [this](Vec3 at) { return project(at); },
          [this] {
            draw_scope_panel(scope_, stereo_, scope_scene());
            draw_quality(painter_->quality());
          },
          [this, &now] { tools_->panel(control_.tools(), now, view_axes()); },
          cuts_.room(),
          [this] { controller_.draw(control_); },
          procedures_,
          tutor_.title.empty(),
          warmth_,
          cuts_.control().enlarged() >= 0};
}

// A point of the world in pixels of the window, from its upper left corner.
std::optional<std::array<float, 2>> RehearsalWindow::project(Vec3 at) const {
  const auto p = scope_.view().pixel(at, scope_.area);
  return p ? std::optional(std::array<float, 2>{static_cast<float>((*p)[0]), static_cast<float>((*p)[1])})
           : std::nullopt;
}

bool RehearsalWindow::input() {
  const ImGuiIO& io = ImGui::GetIO();
  return io.MouseDelta.x != 0 || io.MouseDelta.y != 0 || io.MouseWheel != 0 || ImGui::IsAnyMouseDown() ||
         !io.InputQueueCharacters.empty();
}

void RehearsalWindow::end_picture() {
  render_window_->SetSize(width_, height_);
  const PictureArea& area = scope_.area;
  renderer_->SetViewport(area.x / width_, 1 - (area.y + area.height) / height_, (area.x + area.width) / width_,
                         1 - area.y / height_);
  aim(renderer_, scope_.view(), area);
  if (before_view_) before_view_->place(renderer_, main_view_.before());
  renderer_->ResetCameraClippingRange();
  const bool scene = world_view_ && !control_.failure(), two_eyes = scene && stereo_.on();
  if (scene && !screenshot_wanted_)
    draw_scope(scope_.view(), area, stereo_.params.mode);  // the caption has a bar of its own
  if (scene) trial_.draw(scope_.view(), area);
  if (two_eyes) {
    world_view_->wake();  // what the middle of them cannot see, one of the eyes may
    stereo_.draw(renderer_, render_window_, scope_.view(), area, height_);
  }
  ImGui::Render();
  if (!two_eyes) {
    const auto whole = [](double x) { return static_cast<int>(std::lround(x)); };
    const SceneBox box{whole(area.x), height_ - whole(area.y + area.height), std::max(1, whole(area.width)),
                       std::max(1, whole(area.height))};
    const bool settled = !scene || world_view_->rest(box.width, box.height, painter_->coarse());
    const bool still = screenshot_wanted_ || review_.wants_picture();
    // Curves that run, partners, what is played or flies, a cursor in a text, and a key that is held in the panel move
    // without an event.
    const bool calm = !ended_ && !control_.leading() && !scope_.control.flies() && tutor_.title.empty() &&
                      monitor_controller() == nullptr && !main_view_.in_front() &&
                      main_view_.focus() == MainView::Focus::bone && !controller_.assign().listens();
    const ScenePainter::Turn turn{box,  width_,         height_, settled, input(), still, shell_.take_uncovered(),
                                  calm, cuts_.uploads()};
    if (!painter_->begin(turn, ImGui::GetDrawData())) return painter_->wait([this] { return stirs(); });
  }
  glBindFramebuffer(GL_FRAMEBUFFER, 0);
  stereo_.show([&] {
    glClearColor(0.05F, 0.06F, 0.08F, 1);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    if (!two_eyes) painter_->show();
  });
  if (!two_eyes && review_.wants_picture()) {  // of a finding: nobody sees this one
    review_.take_picture(scope_.area, height_);
    return painter_->done();
  }
  if (screenshot_wanted_) save_screenshot();
  shell_.count_gl_errors();
  glfwSwapBuffers(window_);
  if (!two_eyes) painter_->done();
}

bool RehearsalWindow::stirs() {
  Rehearsal* const rehearsal = actions_.rehearsal();
  if (rehearsal == nullptr || control_.failure() || ended_) return actions_.stop();
  constexpr double kUnseenMm = 0.005;
  for (std::size_t hand = 0; hand < std::min(rehearsal->hands(), last_seen_.size()); ++hand) {
    const DeviceSample now = rehearsal->latest(hand).device, &was = last_seen_[hand].device;
    if (length(from_floats(now.position_mm) - from_floats(was.position_mm)) > kUnseenMm ||
        length(from_floats(now.axis) - from_floats(was.axis)) > kUnseenMm || now.pedal != was.pedal ||
        now.tool != was.tool || now.buttons != was.buttons)
      return true;
  }
  std::vector<ButtonLevel> levels;
  read_stick_buttons(levels);
  return actions_.stop() ||
         std::any_of(levels.begin(), levels.end(), [](const ButtonLevel& l) { return l.level > 0.5; }) ||
         (actions_.switches && actions_.switches(shell_.attended()).value_or(0) != 0);
}

void RehearsalWindow::save_screenshot() {
  screenshot_wanted_ = false;
  Picture picture{width_, height_, {}};
  std::vector<std::uint8_t> pixels(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_) * 3);
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadBuffer(GL_BACK);
  glReadPixels(0, 0, width_, height_, GL_RGB, GL_UNSIGNED_BYTE, pixels.data());
  const std::size_t row = static_cast<std::size_t>(width_) * 3;
  for (int y = height_ - 1; y >= 0; --y) {
    const auto* const begin = pixels.data() + static_cast<std::size_t>(y) * row;
    picture.rgb.insert(picture.rgb.end(), begin, begin + row);
  }
  int n = 1;
  std::filesystem::path path;
  do {
    path = actions_.folder() / ("screenshot-" + std::to_string(n++) + ".png");
  } while (std::filesystem::exists(path));
  try {
    save_picture(picture, path);
    control_.say([&] { return filled(tr("saved {file}"), {{"file", path.filename().string()}}); });
    main_view_.picture_kept();
  } catch (const Error& e) {
    control_.say(LocalText::untranslated(e.what()));
  }
}

}  // namespace osteo::inline app
