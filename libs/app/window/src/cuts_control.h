// The three cuts beside the bone without their screen: which planes, where, how bright, what the mouse does. Private to
// libs/app/window; no GLFW, no ImGui, no VTK.
#pragma once
#include <array>
#include <optional>

#include "osteo/display/view/slices.h"
#include "slice_pointer.h"

namespace osteo::inline app {

class CutsControl {
 public:
  static constexpr int kCuts = 3;
  /// Along the body: axial, coronal, sagittal. Along the tool in the hand: across it, and two planes through its axis.
  enum class Planes { body, tool };

  CutsControl();

  // --- each frame
  /// Pixels of a cut on the screen.
  void resize(int cut, int width, int height);
  /// A box around the bone: the crosshair stays in it, and its middle is in the middle of the pictures at first.
  /// `step_mm`: how far a notch of the wheel scrolls.
  void set_bounds(Vec3 lo_mm, Vec3 hi_mm, double step_mm);
  /// The tool in the hand: its tip and its axis (unit, along the handle). While the cuts follow it, they go through its
  /// tip (or the place of the bone's box nearest to it), and the picture stands still until that comes near its edge.
  void tool_is(Vec3 tip_mm, Vec3 axis, bool touches = true);
  /// Where the cuts begin: on bone, so that none is black. They follow the tool from its first contact on.
  void begin_at(Vec3 world_mm);
  [[nodiscard]] bool waits() const { return waits_; }

  [[nodiscard]] const SliceView& view(int cut) const { return views_[static_cast<std::size_t>(cut)]; }
  [[nodiscard]] const char* name(int cut) const;
  [[nodiscard]] Vec3 cross_mm() const { return cross_mm_; }
  void go_to(Vec3 world_mm);  ///< and follows the tool no longer
  [[nodiscard]] bool follows() const { return follows_; }
  void follow(bool on);
  [[nodiscard]] Planes planes() const { return planes_; }
  void take_planes(Planes planes);

  /// The cut that takes the middle; -1: none.
  [[nodiscard]] int enlarged() const { return enlarged_; }
  /// Back where one is enlarged; else the one under the mouse, else the one that was last.
  void enlarge_or_back();

  HuWindow hu;
  [[nodiscard]] int preset() const { return preset_; }
  void take_preset(int number);  ///< index in grey_presets()

  // --- mouse: left click: crosshair; left drag: ruler; right drag: window and level, right click: as the preset has
  // them; middle drag: moves; wheel: scrolls, with Ctrl: nearer and farther; moved with Shift: crosshair; double click:
  // enlarge_or_back()
  void press(SlicePointer at, SliceButton button);
  void move(SlicePointer at);
  void release(SlicePointer at, SliceButton button);
  void wheel(SlicePointer at, double notches);
  void double_click(SlicePointer at);
  /// The place under the mouse; none beside the cuts.
  [[nodiscard]] std::optional<Vec3> under_mouse() const { return under_mouse_; }

  struct Ruler {
    Vec3 from_mm, to_mm;
    [[nodiscard]] double length_mm() const { return length(to_mm - from_mm); }
  };
  /// Measured last; until the next click.
  [[nodiscard]] const std::optional<Ruler>& ruler() const { return ruler_; }

 private:
  [[nodiscard]] SliceView& at(int cut) { return views_[static_cast<std::size_t>(cut)]; }
  void set_cross(Vec3 world_mm);
  void turn_to_tool();
  void keep_cross_in_view();

  std::array<SliceView, kCuts> views_;
  Vec3 cross_mm_, tip_mm_, axis_{0, 0, 1};
  SliceAxes beside_{{1, 0, 0}, {0, 1, 0}};  // across the tool, carried along as it turns
  std::optional<std::array<Vec3, 2>> bounds_mm_;
  double step_mm_ = 0.5;
  bool follows_ = true, centred_ = false, waits_ = false;
  Planes planes_ = Planes::body;
  int enlarged_ = -1, last_ = 0, preset_ = 0;
  std::optional<Vec3> under_mouse_;
  SlicePointer pointer_, pressed_;
  std::optional<SliceButton> held_;
  bool dragged_ = false;
  std::optional<Ruler> ruler_;
};

}  // namespace osteo::inline app
