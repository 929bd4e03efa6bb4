// What the hand can do besides drilling: saw, move pieces, fix plates. Private to libs/window.
#pragma once
#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <vtkSmartPointer.h>

#include "keys.h"
#include "osteo/scene/rehearsal.h"

class vtkActor;
class vtkPolyData;
class vtkRenderer;

namespace osteo {

/// The view, as far as a tool needs it. Unit vectors.
struct ViewAxes {
  Vec3 eye_mm, forward, right, up;
};

class SceneTools {
 public:
  enum class Tool { drill, saw, piece, plate };

  explicit SceneTools(vtkRenderer* renderer);
  ~SceneTools();
  SceneTools(const SceneTools&) = delete;
  SceneTools& operator=(const SceneTools&) = delete;

  [[nodiscard]] Tool tool() const { return tool_; }
  /// The drill, or a plate: the hand moves it.
  [[nodiscard]] bool in_hand() const { return tool_ == Tool::drill || tool_ == Tool::plate; }
  /// The bone is another one, `size_mm` across.
  void renew(Vec3 centre_mm, double size_mm);

  /// A section of the panel. `say` shows a line to the user.
  void panel(Rehearsal& rehearsal, const ViewAxes& view);
  /// True when the key was meant for a tool.
  bool key(Command command, Rehearsal& rehearsal, const ViewAxes& view);
  /// A motion of the mouse over the view by so many mm at the tool's depth, or a wheel step; only where in_hand() is false.
  void drag(double right_mm, double up_mm, bool turn, Rehearsal& rehearsal, const ViewAxes& view);
  void push(double deeper_mm, Rehearsal& rehearsal, const ViewAxes& view);
  /// Takes up the piece that a ray hits.
  void pick(Rehearsal& rehearsal, Vec3 from_mm, Vec3 direction);
  /// What the hand holds, when it is a plate: which, and how.
  [[nodiscard]] std::size_t plate() const { return static_cast<std::size_t>(plate_); }
  [[nodiscard]] RigidTransform plate_grip() const;
  [[nodiscard]] const SawCut& cut() const { return cut_; }
  /// Where the tool is: mouse motions are measured at this depth.
  [[nodiscard]] Vec3 position_mm() const { return tool_ == Tool::saw ? cut_.at_mm : handle_mm_; }
  /// The piece that is moved; kNobody: none.
  [[nodiscard]] std::uint32_t piece() const { return tool_ == Tool::piece ? piece_ : SceneAction::kNobody; }

  /// Cursors of the tools, before each frame.
  void show(const TickRecord& tick);

 private:
  void choose(Tool tool, Rehearsal& rehearsal, const ViewAxes& view);
  void turn_saw(Vec3 axis, double angle_rad);
  void move_piece(Rehearsal& rehearsal, const RigidTransform& by);
  void attach(Rehearsal& rehearsal);
  void grip(Rehearsal& rehearsal);
  void saw_panel(Rehearsal& rehearsal, const ViewAxes& view);
  void piece_panel(Rehearsal& rehearsal);
  void plate_panel(Rehearsal& rehearsal);

  vtkRenderer* renderer_;
  Tool tool_ = Tool::drill;
  double size_mm_ = 100;
  SawCut cut_;
  std::uint32_t piece_ = SceneAction::kNobody;
  RigidTransform pose_;  // of the piece, as last asked for
  Vec3 handle_mm_;       // its middle
  int plate_ = 0;
  float turn_deg_ = 0, tilt_deg_ = 0;
  std::string note_;
  vtkSmartPointer<vtkActor> plane_, plate_actor_;
  vtkSmartPointer<vtkPolyData> plane_data_;
  int plate_shown_ = -1;
};

/// The first bone on a ray, and the body it belongs to.
struct BoneHit {
  Vec3 at_mm;
  std::uint32_t body;
};
[[nodiscard]] std::optional<BoneHit> bone_on_ray(const World& world, Vec3 from_mm, Vec3 direction, double reach_mm);

}  // namespace osteo
