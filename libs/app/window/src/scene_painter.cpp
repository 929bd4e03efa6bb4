#include "scene_painter.h"

// GLEW, through VTK, must come before anything that includes GL.
#include <vtk_glew.h>

#include <GLFW/glfw3.h>
#include <imgui.h>

#include <vtkGenericOpenGLRenderWindow.h>
#include <vtkOpenGLState.h>
#include <vtkRenderer.h>

#include <algorithm>
#include <cmath>

#include "osteo/core/base/translate.h"
#include "osteo/display/view/actors.h"
#include "osteo/display/view/world_view.h"

namespace osteo::inline app {
namespace {

// How long nothing has changed when the picture rests, and the camera not when it does; how often panels alone are
// shown again; how long nobody did anything when the window sleeps, and how long it does at most: a clock's seconds,
// and messages that go.
constexpr std::chrono::milliseconds kRest{300}, kTurned{100}, kPanels{100}, kAwake{1500}, kSleep{250};
constexpr double kMuch = 0.5;  // of the triangles: where more changes, all is as good as drawn again
constexpr double kLookAgainS = 0.008, kIdleS = 0.05, kStirS = 0.02;

void add(std::uint64_t& h, const void* data, std::size_t bytes) {
  const auto* const p = static_cast<const unsigned char*>(data);
  std::size_t i = 0;
  for (; i + 8 <= bytes; i += 8) {
    std::uint64_t v = 0;
    std::copy_n(p + i, 8, reinterpret_cast<unsigned char*>(&v));
    h = (h ^ v) * 0x9e3779b97f4a7c15ULL;
    h ^= h >> 29;
  }
  for (; i < bytes; ++i) h = (h ^ p[i]) * 0x100000001b3ULL;
}

}  // namespace

std::uint64_t panels_stamp(const ImDrawData* panels) {
  std::uint64_t h = 1;
  for (int n = 0; n < panels->CmdListsCount; ++n) {
    const ImDrawList& list = *panels->CmdLists[n];
    add(h, list.VtxBuffer.Data, static_cast<std::size_t>(list.VtxBuffer.size_in_bytes()));
    add(h, list.IdxBuffer.Data, static_cast<std::size_t>(list.IdxBuffer.size_in_bytes()));
    for (const ImDrawCmd& c : list.CmdBuffer) {
      add(h, &c.ClipRect, sizeof c.ClipRect);
      add(h, &c.TextureId, sizeof c.TextureId);
    }
  }
  return h;
}

ScenePainter::ScenePainter(vtkGenericOpenGLRenderWindow* window, vtkRenderer* renderer)
    : window_(window), renderer_(renderer), layer_(window, renderer) {
  window->SetFrameBlitModeToNoBlit();
}

bool ScenePainter::begin(const Turn& turn, const ImDrawData* panels) {
  began_ = Clock::now();
  const bool resized = turn.width != turn_.width || turn.height != turn_.height || turn.box.left != turn_.box.left ||
                       turn.box.bottom != turn_.box.bottom || turn.box.width != turn_.box.width ||
                       turn.box.height != turn_.box.height;
  turn_ = turn;
  const std::uint64_t scene = scene_stamp(renderer_), view = view_stamp(renderer_),
                      flat = panels_stamp(panels) + turn.images * 0x9e3779b97f4a7c15ULL;
  if (scene != seen_ || resized) {
    seen_ = scene;
    changed_at_ = began_;
  }
  if (view != view_ || resized) {
    view_ = view;
    turned_at_ = began_;
  }
  const bool moves = !turn.still && (began_ - changed_at_ < kRest || !turn.settled);
  motion_ = !moves                                                         ? Motion::none
            : began_ - turned_at_ < kTurned || layer_.live_share() > kMuch ? Motion::all
                                                                           : Motion::little;
  const PictureStyle style = quality_.style(motion_);
  // A picture that was drawn at rest stays until something changes; one of a moving camera until that rests.
  draws_ = scene != stamp_ || resized || drawn_ == 0 || (motion_ == Motion::none && style != style_) ||
           (motion_ == Motion::little && style.scale > style_.scale);
  if (draws_) {
    stamp_ = scene;
    style_ = style;
  }
  if (turn.input || changed_at_ == began_) stirred_at_ = began_;
  const auto since = began_ - shown_at_;
  const bool shows = draws_ || turn.still || turn.uncovered || (flat != panels_ && (turn.input || since > kPanels));
  if (shows) panels_ = flat;
  return shows;
}

void ScenePainter::show() {
  const int width = std::max(1, static_cast<int>(std::lround(turn_.box.width * style_.scale))),
            height = std::max(1, static_cast<int>(std::lround(turn_.box.height * style_.scale)));
  if (draws_) {
    double before[4];
    renderer_->GetViewport(before);
    // VTK clears and copies its window whole: no larger than what is drawn. Others see the window as it is.
    window_->SetSize(width, height);
    renderer_->SetViewport(0, 0, 1, 1);
    set_depth(renderer_, style_);
    window_->GetState()->Reset();
    layer_.render();
    renderer_->SetViewport(before);
    window_->SetSize(turn_.width, turn_.height);
    stamp_ = seen_ = scene_stamp(renderer_);  // occlusion touches what it draws for the first time
    ++drawn_;
  }
  glBindFramebuffer(GL_FRAMEBUFFER, 0);
  window_->BlitDisplayFramebuffer(0, 0, 0, width, height, turn_.box.left, turn_.box.bottom, turn_.box.width,
                                  turn_.box.height, GL_COLOR_BUFFER_BIT, style_.scale < 1 ? GL_LINEAR : GL_NEAREST);
  // VTK leaves its state for itself; ImGui saves and restores what it touches.
  glBindFramebuffer(GL_FRAMEBUFFER, 0);
  glDisable(GL_SCISSOR_TEST);
  glViewport(0, 0, turn_.width, turn_.height);
}

void ScenePainter::done() {
  shown_at_ = Clock::now();
  if (draws_)
    quality_.took(style_, motion_, std::chrono::duration<double, std::milli>(shown_at_ - began_).count(),
                  static_cast<double>(turn_.box.width) * turn_.box.height);
}

void ScenePainter::wait(const std::function<bool()>& stirs) {
  const auto begin = Clock::now();
  if (begin - changed_at_ < std::chrono::seconds(1)) return glfwWaitEventsTimeout(kLookAgainS);
  if (!turn_.calm || begin - stirred_at_ < kAwake) return glfwWaitEventsTimeout(kIdleS);
  for (auto now = begin; now - begin < kSleep && !stirs();) {
    glfwWaitEventsTimeout(kStirS);
    const auto then = std::exchange(now, Clock::now());
    if (std::chrono::duration<double>(now - then).count() < 0.9 * kStirS) {  // an event
      stirred_at_ = now;
      break;
    }
  }
  slept_s_ += std::chrono::duration<double>(Clock::now() - begin).count();
}

std::string ScenePainter::words() const {
  const QualityChoice& q = quality_;
  const auto name = [](Quality level) {
    return tr(std::string(EnumNames<Quality>::values[static_cast<std::size_t>(level)]));
  };
  const std::string times =
      filled(tr("picture {moving} ms, at rest {resting} ms"),
             {{"moving", shown_number(q.moving_ms(), 0)}, {"resting", shown_number(q.resting_ms(), 0)}});
  return times + "\n" +
         filled(q.wish() == Quality::automatic ? tr("quality (J): {wish}, now {level}") : tr("quality (J): {wish}"),
                {{"wish", name(q.wish())}, {"level", name(q.level())}});
}

}  // namespace osteo::inline app
