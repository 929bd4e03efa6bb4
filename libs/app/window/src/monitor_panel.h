// The nerve monitor's window in the window. Private to libs/app/window; ImGui.
#pragma once
#include "osteo/app/window/monitor_controller.h"
#include "view_layout.h"

namespace osteo::inline app {

class MonitorPanel {
 public:
  [[nodiscard]] bool shown() const { return shown_; }
  void show(bool on) { shown_ = on; }
  /// Its strip, taken from the pictures; none where there is no monitor, or while it is not shown.
  void lay_out(ViewLayout& layout, float em_pixels, bool there);
  /// In place of a strip: all of a window of its own.
  void fill(const ScreenBox& area) {
    box_ = area;
    own_window_ = true;
  }
  [[nodiscard]] const ScreenBox& box() const { return box_; }
  /// The answers to pulses, or the free run.
  [[nodiscard]] bool answers() const { return answers_; }
  void show_answers(bool on) { answers_ = on; }
  /// Between ImGui::NewFrame and Render.
  void draw(MonitorController& controller);
  /// As its buttons do, where there is a stimulator.
  void switch_stimulator(MonitorController& controller) const;
  void find_threshold(MonitorController& controller) const;

 private:
  void draw_sweep(MonitorController& controller, float height);
  void draw_answers(MonitorController& controller, float height);
  void draw_switches(MonitorController& controller);
  void draw_stimulator(MonitorController& controller);
  ScreenBox box_;
  bool shown_ = true, answers_ = false, own_window_ = false;
  StimulatorSetting wanted_{0, 0.5, 4, 0.1, false};
};

}  // namespace osteo::inline app
