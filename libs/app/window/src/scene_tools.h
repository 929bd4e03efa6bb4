// The hand's tools as one sees them: cursors in the scene, a section of the panel. Private to libs/app/window.
#pragma once
#include <vtkSmartPointer.h>

#include <array>
#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "cut_preview.h"
#include "hand_tools.h"
#include "osteo/display/view/instrument_view.h"
#include "view_layout.h"

struct ImDrawList;
class vtkActor;
class vtkPolyData;
class vtkRenderer;

namespace osteo::inline app {

/// A point of the world in pixels of the window; nothing behind the eye.
using Project = std::function<std::optional<std::array<float, 2>>(Vec3)>;
/// The saw's line over the picture, within `area`: seen edge on its plane is as thin as the blade, and bone hides it;
/// red, with words, where it would cut a structure. No-op without a saw.
void draw_saw_line(const HandTools& tools, const CutPreview& preview, const Project& project, const ScreenBox& area,
                   ImDrawList* draw);

class SceneTools {
 public:
  /// After what else is drawn: what one sees through is drawn in the order in which it is added.
  explicit SceneTools(vtkRenderer* renderer);
  ~SceneTools();
  SceneTools(const SceneTools&) = delete;
  SceneTools& operator=(const SceneTools&) = delete;

  /// Into the current window: what belongs to the tool in hand, and nothing else.
  void panel(HandTools& tools, Rehearsal& rehearsal, const ViewAxes& view);
  /// Plates that are on the bone, to be taken off or opened. No-op without any.
  static void fixed_plates(Rehearsal& rehearsal);
  /// Cursors of the tools, before each frame.
  void show(const HandTools& tools, const TickRecord& tick, const World& world, const StructureMap* structures,
            double now_s);
  /// What the saw would cut where it is now.
  [[nodiscard]] const CutPreview& preview() const { return preview_; }

 private:
  vtkRenderer* renderer_;
  vtkSmartPointer<vtkActor> plane_;
  vtkSmartPointer<vtkPolyData> plane_data_;
  PlateView hand_plate_;
  double hand_in_bone_mm_ = 0;
  // What is shown now: a picture at rest is drawn again only when something moves.
  std::vector<Vec3> blade_mm_;
  struct HeldPlate {
    std::size_t plate, undo_steps;
    RigidTransform pose;
  };
  std::optional<HeldPlate> held_;
  CutPreview preview_;
  std::string plan_name_;
};

}  // namespace osteo::inline app
