// The editor without its screen: tools, views, what a click does. Private to libs/app/window; no GLFW, no ImGui, no
// VTK.
#pragma once
#include <array>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "edit_keys.h"
#include "edit_worker.h"
#include "osteo/display/view/slices.h"
#include "osteo/imaging/edit/document.h"
#include "slice_pointer.h"

namespace osteo::inline app {

/// Views 0 to 2 are the slices in the order of `Plane`; 3 is the picture in 3D.
inline constexpr int kView3D = 3;

class EditControl {
 public:
  /// The document must outlive it.
  explicit EditControl(EditDocument& document);

  // --- views
  // --------------------------------------------------------------------------------------------------------------------------
  void resize(int view, int width, int height);
  /// Everything of the scan.
  void fit();
  [[nodiscard]] const SliceView& view(int view) const { return views_[static_cast<std::size_t>(view)]; }
  [[nodiscard]] int enlarged() const { return enlarged_; }  ///< -1: four up
  [[nodiscard]] Vec3 cross_mm() const { return cross_mm_; }
  void go_to(Vec3 world_mm);
  /// So many slices along the plane's normal; stays within the scan.
  void scroll(int view, int slices);
  /// Number of the slice from 1 on, and how many there are.
  [[nodiscard]] std::pair<int, int> slice(int view) const;
  HuWindow hu;
  bool show_cross = true, show_outlines = true, show_help = false;

  /// Of the picture in 3D: fewer where triangles are drawn without a graphics card.
  std::size_t preview_voxels = 3'000'000;

  // --- mouse
  // --------------------------------------------------------------------------------------------------------------------------
  void press(SlicePointer at, SliceButton button);
  /// Also without a button.
  void move(SlicePointer at);
  void release(SlicePointer at, SliceButton button);
  void wheel(SlicePointer at, double notches);
  void double_click(SlicePointer at);
  /// Where the mouse is in the scan, when it is over a slice.
  [[nodiscard]] std::optional<Vec3> under_mouse() const { return under_mouse_; }
  /// "L 12.3  P 4.0  H 31.5 mm   345 HU   bone, facial nerve"; empty beside the slices.
  [[nodiscard]] std::string readout() const;

  // --- tools
  // --------------------------------------------------------------------------------------------------------------------------
  [[nodiscard]] EditTool tool() const { return tool_; }
  void take(EditTool tool);
  double brush_radius_mm = 2, fill_mm3 = 50, smooth_mm = 1, pieces_mm3 = 10;
  int pieces_largest = 0;
  double lower_hu = 300, upper_hu = 32767;
  bool later_steps_again = true;  ///< after a threshold, what was done since the last one is done again
  int structure = 0;              ///< that brush and eraser work on; 0: bone
  std::array<double, 3> box_lo_mm{}, box_hi_mm{};
  std::optional<std::array<Vec3, 2>> ruler_mm;
  /// The threshold that is being chosen and not applied yet.
  [[nodiscard]] std::optional<ThresholdEdit> live() const;
  void set_threshold(double lower, double upper);
  /// What Enter does with the tool; of a box as `choice` says.
  void apply(BoxChoice choice = BoxChoice::clear_inside);
  /// Something to be worked out beside the window.
  void start(std::vector<EditOperation> operations);
  /// What is done at once: structures. False, with a message, where it is rejected.
  bool at_once(const EditOperation& operation);
  bool add_structure(const std::string& name);
  /// Structures by something that runs beside the window; they come as one step when it has ended. `what` names it.
  void find_structures(const std::string& what, std::function<EditFound(const Context&)> work);
  /// What should be looked at first, the worst first.
  std::vector<EditPlace> places;
  void undo();
  void redo();
  void cancel();
  /// True when the key was one of the editor's own; save, close, help and 3D are the window's.
  bool key(const EditKeyRow& key);

  /// What the next click does, in a sentence.
  [[nodiscard]] std::string hint() const;
  /// What was done last, or why not.
  [[nodiscard]] const std::string& message() const { return message_; }
  void say(std::string text) { message_ = std::move(text); }
  /// What must not be changed now: something is worked out.
  [[nodiscard]] bool busy() const { return worker_.planning(); }
  [[nodiscard]] double progress() const { return worker_.progress(); }
  /// Takes what was worked out; asks for a new picture in 3D when something changed. Once a frame.
  void tick();
  [[nodiscard]] std::optional<Preview> take_preview() { return worker_.take_preview(); }
  [[nodiscard]] bool previewing() const { return worker_.previewing(); }

  [[nodiscard]] EditDocument& document() { return document_; }
  [[nodiscard]] const EditDocument& document() const { return document_; }
  [[nodiscard]] bool unsaved() const { return document_.version() != saved_version_ || hidden_changed_; }
  /// `version` as the document had it when it was written.
  void saved(std::uint64_t version) {
    saved_version_ = version;
    hidden_changed_ = false;
  }
  void show_structure(int value, bool shown);
  /// What all slices show has changed since the last call, beside where they lie and how they are looked at.
  [[nodiscard]] bool take_redraw() { return std::exchange(redraw_, false); }

 private:
  [[nodiscard]] Vec3 world(SlicePointer at) const {
    return views_[static_cast<std::size_t>(at.view)].world(at.x, at.y);
  }
  void follow_cross();
  [[nodiscard]] bool refuse_when_busy();
  void ask_preview();
  void reported(const EditOutcome& outcome);
  void take_found(EditFound found);

  EditDocument& document_;
  EditWorker worker_;
  std::array<SliceView, 3> views_;
  int enlarged_ = -1;
  Vec3 cross_mm_;
  std::optional<Vec3> under_mouse_;
  SlicePointer last_;
  std::optional<SliceButton> held_;
  int held_view_ = -1;
  Vec3 box_from_mm_;
  EditTool tool_ = EditTool::look;
  std::string message_, finding_;
  std::uint64_t saved_version_, drawn_version_, preview_version_ = ~0ULL;
  std::optional<ThresholdEdit> preview_live_;
  bool hidden_changed_ = false, redraw_ = true;
};

/// "12.3 cm3", "45 mm3".
[[nodiscard]] std::string volume_text(double mm3);

}  // namespace osteo::inline app
