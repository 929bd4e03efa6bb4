// What the hand can do besides drilling: saw, move pieces, fix plates. Private to libs/app/window; no ImGui, no VTK.
#pragma once
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "keys.h"
#include "local_text.h"
#include "osteo/session/recording/planned_cuts.h"
#include "osteo/session/scene/rehearsal.h"

namespace osteo::inline app {

/// The view, as far as a tool needs it. Unit vectors.
struct ViewAxes {
  Vec3 eye_mm, forward{0, 1, 0}, right{1, 0, 0}, up{0, 0, 1};
};

class HandTools {
 public:
  enum class Tool { drill, saw, piece, plate };

  [[nodiscard]] Tool tool() const { return tool_; }
  /// The drill, or a plate: the hand moves it.
  [[nodiscard]] bool in_hand() const { return tool_ == Tool::drill || tool_ == Tool::plate; }
  /// The bone is another one, `size_mm` across.
  void renew(Vec3 centre_mm, double size_mm);

  /// Takes it up; the one in hand: puts it away.
  void choose(Tool tool, Rehearsal& rehearsal, const ViewAxes& view);
  /// True when the key was meant for a tool.
  bool key(Command command, Rehearsal& rehearsal, const ViewAxes& view);
  /// A motion of the mouse over the view by so many mm at the tool's depth, or a wheel step; only where in_hand() is
  /// false.
  void drag(double right_mm, double up_mm, bool turn, Rehearsal& rehearsal, const ViewAxes& view);
  void push(double deeper_mm, Rehearsal& rehearsal, const ViewAxes& view);
  /// Takes up that piece.
  void take_piece(std::uint32_t body, Rehearsal& rehearsal);
  /// Takes up the piece that a ray hits.
  void pick(Rehearsal& rehearsal, Vec3 from_mm, Vec3 direction);
  /// Cuts, takes apart, fixes the plate: what the tool is for.
  void perform(Rehearsal& rehearsal);
  void undo(Rehearsal& rehearsal);
  /// The saw into the hand, where the blade's plane becomes a cutting guide; what it cuts then is by force and time, as
  /// with a burr.
  void take_saw(Rehearsal& rehearsal);
  void put_saw_away(Rehearsal& rehearsal);
  /// While the hand is led somewhere the guide does not hold its saw.
  void loosen_saw(bool loose, Rehearsal& rehearsal);
  [[nodiscard]] bool saw_in_hand() const { return saw_in_hand_; }
  /// Of a planned cut that was not moved its own, with the slot's play.
  [[nodiscard]] CuttingGuide guide() const;

  /// Cuts that were planned before, to choose from, and the file that one kept here is added to.
  void plan(std::vector<PlannedCut> cuts, std::filesystem::path file);
  [[nodiscard]] std::span<const PlannedCut> planned() const { return planned_; }
  /// The saw there, and its guide as that says.
  void choose_planned(std::size_t cut);
  /// The saw's plane as it is now, as a planned cut of that name: into the file, beside what it holds by now. note()
  /// says what came of it.
  void keep_planned(const std::string& name);

  /// Of the saw. Another one: as set in a panel.
  [[nodiscard]] const SawCut& cut() const { return cut_; }
  void set_cut(const SawCut& cut) { cut_ = cut; }
  /// Across the view, from above to below; or flat in it.
  void aim_saw(const ViewAxes& view, bool flat);
  /// Across the bone.
  [[nodiscard]] double size_mm() const { return size_mm_; }

  /// The piece that is moved; kNobody: none. Where it is, as last asked for.
  [[nodiscard]] std::uint32_t piece() const { return tool_ == Tool::piece ? piece_ : SceneAction::kNobody; }
  [[nodiscard]] const RigidTransform& piece_pose() const { return pose_; }
  void put_piece_back(Rehearsal& rehearsal) { move_piece(rehearsal, pose_.inverse()); }

  /// What the hand holds, when it is a plate: which, and how.
  [[nodiscard]] std::size_t plate() const { return plate_; }
  [[nodiscard]] float plate_turn_deg() const { return turn_deg_; }
  [[nodiscard]] float plate_tilt_deg() const { return tilt_deg_; }
  void set_plate(std::size_t plate, float turn_deg, float tilt_deg, Rehearsal& rehearsal);
  [[nodiscard]] RigidTransform plate_grip() const;

  /// Where the tool is: mouse motions are measured at this depth.
  [[nodiscard]] Vec3 position_mm() const { return tool_ == Tool::saw ? cut_.at_mm : handle_mm_; }
  /// What there is to say about the last thing done; also why it was rejected, which is asked for here.
  const LocalText& note(Rehearsal& rehearsal);
  /// How the tool in the hand is used, in a few words; empty for the drill.
  [[nodiscard]] std::string how() const;

 private:
  static constexpr double kGuideMm = 3;  // how far from its plane the hand may be for the saw to slip in
  void turn_saw(Vec3 axis, double angle_rad);
  void move_piece(Rehearsal& rehearsal, const RigidTransform& by);
  void attach(Rehearsal& rehearsal);
  void grip(Rehearsal& rehearsal);

  Tool tool_ = Tool::drill;
  double size_mm_ = 100;
  SawCut cut_;
  std::uint32_t piece_ = SceneAction::kNobody;
  RigidTransform pose_;  // of the piece, as last asked for
  Vec3 handle_mm_;       // its middle
  std::size_t plate_ = 0;
  float turn_deg_ = 0, tilt_deg_ = 0;
  bool saw_in_hand_ = false;
  std::vector<PlannedCut> planned_;
  std::filesystem::path planned_file_;
  double within_mm_ = kGuideMm;
  LocalText note_;
};

/// The first bone on a ray, and the body it belongs to.
struct BoneHit {
  Vec3 at_mm;
  std::uint32_t body;
};
[[nodiscard]] std::optional<BoneHit> bone_on_ray(const World& world, Vec3 from_mm, Vec3 direction, double reach_mm);

}  // namespace osteo::inline app
