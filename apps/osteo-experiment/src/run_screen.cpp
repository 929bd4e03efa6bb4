#include "run_screen.h"

#include <imgui.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <fstream>

#include "osteo/app/window/window_shell.h"
#include "osteo/core/base/json_document.h"

namespace osteo {
namespace {

using experiment::RunPage;

// GLFW's numbers.
enum : int { kSpaceKey = 32, kEscapeKey = 256, kDownKey = 264, kUpKey = 265 };
constexpr float kKeyStepN = 0.4F;

ImU32 colour(const sheet::Drawing::Colour& c, double opacity = 1) {
  return IM_COL32(c[0], c[1], c[2], static_cast<int>(255 * std::clamp(opacity, 0.0, 1.0)));
}

void draw(const sheet::Drawing& d) {
  ImDrawList* const list = ImGui::GetBackgroundDrawList();
  for (const auto& mark : d.marks) {
    if (const auto* const path = std::get_if<sheet::Drawing::Path>(&mark)) {
      std::vector<ImVec2> points;
      for (const auto& p : path->points) points.emplace_back(static_cast<float>(p[0]), static_cast<float>(p[1]));
      if (path->fill)
        list->AddConvexPolyFilled(points.data(), static_cast<int>(points.size()), colour(*path->fill, path->opacity));
      if (path->stroke)
        list->AddPolyline(points.data(), static_cast<int>(points.size()), colour(*path->stroke, path->opacity), 0,
                          static_cast<float>(path->width));
    } else if (const auto* const text = std::get_if<sheet::Drawing::Text>(&mark)) {
      const auto size = static_cast<float>(text->size);
      const float wide = ImGui::GetFont()->CalcTextSizeA(size, 1e9F, 0, text->text.c_str()).x;
      const float x = static_cast<float>(text->x) - (text->align < 0 ? 0 : text->align == 0 ? wide / 2 : wide);
      list->AddText(ImGui::GetFont(), size, {x, static_cast<float>(text->y) - size}, colour(text->colour),
                    text->text.c_str());
    }
  }
}

// In the middle, across the whole window.
void draw_page(const std::string& title, const std::string& words, float width, float height, float em) {
  ImDrawList* const list = ImGui::GetBackgroundDrawList();
  list->AddRectFilled({0, 0}, {width, height}, IM_COL32(250, 250, 252, 255));
  const float big = 1.6F * em, wrap = std::min(0.8F * width, 42 * em), x = (width - wrap) / 2;
  list->AddText(ImGui::GetFont(), big, {x, 0.34F * height}, IM_COL32(28, 33, 41, 255), title.c_str(), nullptr, wrap);
  list->AddText(ImGui::GetFont(), em, {x, 0.34F * height + 2 * big}, IM_COL32(28, 33, 41, 255), words.c_str(), nullptr,
                wrap);
}

// By mouse and keys the force is a place on this axis. Down is harder, as one presses down.
void draw_force_axis(double pressed_n, double most_n, bool keys, float width, float height, float em) {
  ImDrawList* const list = ImGui::GetBackgroundDrawList();
  const float x = width - 4 * em, top = 0.2F * height, bottom = 0.85F * height;
  const ImU32 ink = IM_COL32(28, 33, 41, 255);
  list->AddLine({x, top}, {x, bottom}, ink, 2);
  for (int n = 0; n <= static_cast<int>(most_n); n += 4) {
    const float y = top + (bottom - top) * static_cast<float>(n / most_n);
    list->AddLine({x, y}, {x + 0.5F * em, y}, ink, 2);
    list->AddText({x + 0.8F * em, y - 0.5F * em}, ink, (std::to_string(n) + " N").c_str());
  }
  const float y = top + (bottom - top) * static_cast<float>(std::clamp(pressed_n / most_n, 0.0, 1.0));
  list->AddTriangleFilled({x - em, y - 0.5F * em}, {x - em, y + 0.5F * em}, {x - 0.1F * em, y}, ink);
  const char* const words = keys ? "force axis: keys Up, Down" : "force axis: the mouse";
  const char* const more = "set, not felt";
  list->AddText({width - ImGui::CalcTextSize(words).x - em, bottom + em}, ink, words);
  list->AddText({width - ImGui::CalcTextSize(more).x - em, bottom + 2.2F * em}, ink, more);
}

// What was to be pressed and what was, over time, with axes in newtons and seconds.
void draw_feedback(const experiment::ForceSkillController& controller, float width, float height) {
  const auto [target, applied] = controller.last_training();
  if (target.size() < 2 || applied.size() != target.size()) return;
  ImDrawList* const list = ImGui::GetBackgroundDrawList();
  const double most = controller.protocol().peak_n,
               seconds = static_cast<double>(target.size()) / controller.protocol().rate_hz;
  const auto at = [&](double share, double newtons) {
    return ImVec2(static_cast<float>((0.1 + 0.8 * share) * width),
                  static_cast<float>((0.92 - 0.4 * std::clamp(newtons / most, 0.0, 1.0)) * height));
  };
  const ImU32 ink = IM_COL32(28, 33, 41, 255), faint = IM_COL32(28, 33, 41, 40);
  const float letter = ImGui::GetFontSize();
  for (double n = 0; n <= most; n += 4) {
    list->AddLine(at(0, n), at(1, n), n > 0 ? faint : ink);
    const std::string text = std::to_string(static_cast<int>(n)) + " N";
    const ImVec2 size = ImGui::CalcTextSize(text.c_str()), from = at(0, n);
    list->AddText(ImVec2(from.x - size.x - 0.5F * letter, from.y - 0.5F * size.y), ink, text.c_str());
  }
  for (double s = 0; s <= seconds; s += 5) {
    const std::string text = std::to_string(static_cast<int>(s)) + " s";
    const ImVec2 size = ImGui::CalcTextSize(text.c_str()), from = at(s / seconds, 0);
    list->AddText(ImVec2(from.x - 0.5F * size.x, from.y + 0.3F * letter), ink, text.c_str());
  }
  const float line = std::max(2.0F, height / 400);
  for (const auto& [values, colour] :
       {std::pair{&target, IM_COL32(38, 99, 200, 255)}, std::pair{&applied, IM_COL32(40, 150, 70, 255)}}) {
    std::vector<ImVec2> points;
    for (std::size_t i = 0; i < values->size(); i += std::max<std::size_t>(1, values->size() / 600))
      points.push_back(at(static_cast<double>(i) / static_cast<double>(values->size() - 1), (*values)[i]));
    list->AddPolyline(points.data(), static_cast<int>(points.size()), colour, 0, line);
  }
}

}  // namespace

int run_experiment_window(experiment::ForceSkillController& controller, PressedForce& pressed,
                          const RunScreenOptions& options, const Context& context) {
  ShellOptions shell_options;
  shell_options.width = options.width;
  shell_options.height = options.height;
  shell_options.title = "Osteotome experiment";
  WindowShell shell(shell_options);
  const double most_n = controller.protocol().peak_n;
  bool leave = false, go_on = false;
  float by_keys = 0;
  shell.on_key = [&](int key, int action, int) {
    if (action == 0) return;
    if (key == kEscapeKey) leave = true;
    if (key == kSpaceKey && action == 1) go_on = true;
    if (key == kDownKey) by_keys = std::min(by_keys + kKeyStepN, static_cast<float>(most_n));
    if (key == kUpKey) by_keys = std::max(by_keys - kKeyStepN, 0.0F);
  };
  std::uint64_t pictures = 0;
  std::chrono::steady_clock::time_point paused = std::chrono::steady_clock::now();
  RunPage last = controller.page();
  while (!leave && !shell.closing() && !context.cancelled()) {
    if (!shell.poll()) continue;
    if (std::exchange(go_on, false)) controller.go_on();
    controller.update();
    if (controller.page() != last) {
      last = controller.page();
      paused = std::chrono::steady_clock::now();
      by_keys = 0;
    }
    shell.new_frame();
    const auto width = static_cast<float>(shell.width()), height = static_cast<float>(shell.height()),
               em = static_cast<float>(shell.em_pixels());
    const bool running = controller.page() == RunPage::training || controller.page() == RunPage::test;
    if (options.by_hand) {
      const float top = 0.2F * height, bottom = 0.85F * height, y = ImGui::GetIO().MousePos.y;
      const float mouse =
          std::isfinite(y) ? std::clamp((y - top) / (bottom - top), 0.0F, 1.0F) * static_cast<float>(most_n) : 0;
      pressed.n.store(!running ? 0 : options.keys ? by_keys : mouse, std::memory_order_relaxed);
    }
    if (running) {
      draw(controller.drawing(width, height));
      if (options.by_hand) draw_force_axis(pressed.n.load(), most_n, options.keys, width, height, em);
    } else {
      auto [title, words] = controller.words();
      if (controller.page() == RunPage::pause) {
        const double left = 60 * controller.protocol().break_min -
                            std::chrono::duration<double>(std::chrono::steady_clock::now() - paused).count();
        char line[64];
        const int s = static_cast<int>(std::max(0.0, std::ceil(left)));
        std::snprintf(line, sizeof line, " %d:%02d are left.", s / 60, s % 60);
        words += line;
      }
      draw_page(title, words, width, height, em);
      if (controller.page() == RunPage::feedback) draw_feedback(controller, width, height);
    }
    shell.show_page();
    ++pictures;
    if (!options.state_file.empty()) {
      static constexpr const char* kPages[] = {"before_training", "training", "feedback", "before_test", "test",
                                               "pause",           "done"};
      const experiment::TaskView v = controller.view();
      Json j{{"page", kPages[static_cast<std::size_t>(controller.page())]},
             {"done", controller.done()},
             {"trials", controller.trials()},
             {"pictures", pictures},
             {"t_s", v.t_s},
             {"target_n", v.target_n},
             {"applied_n", v.applied_n},
             {"saturated", v.saturated},
             {"pressed_n", static_cast<double>(pressed.n.load())},
             {"hand_mm", Json{v.hand_mm.x, v.hand_mm.y, v.hand_mm.z}},
             {"path_mm", Json{v.path_x_mm, v.path_z_mm}}};
      if (controller.page() != RunPage::done) j["training"] = experiment::short_name(controller.trial().training);
      const std::filesystem::path beside = options.state_file.string() + ".new";
      std::ofstream(beside) << j.dump() << '\n';
      std::error_code ignored;
      std::filesystem::rename(beside, options.state_file, ignored);
    }
  }
  return shell.gl_errors();
}

}  // namespace osteo
