// Soft tissue in a rehearsal: deforms under the tool beside the servo, and tells it what it pushes with.
#pragma once
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "osteo/bone/world.h"
#include "osteo/data/tet_mesh.h"

namespace osteo {

/// A body of voxels by the fast model (libs/tissue). Its steps in time run a hundred times a second beside the servo; what the hand feels
/// between them is a plane: the force now, along its own direction, rising with depth. Each such plane is an action of the stream, so a
/// replay needs no tissue. It does not know bone: what holds it is what its problem says is fixed.
class SoftBody {
 public:
  /// From mesh, problem and perhaps constants, as the stages of tissue take them. Errors: as of those.
  SoftBody(const TetMesh& mesh, std::string_view problem_json, const std::optional<std::string>& constants_json = std::nullopt);
  ~SoftBody();

  static constexpr double kUpdatesPerS = 100;
  /// Goes on by one update with the tool (a ball) there; the plane that it pushes with now, or nothing when it pushed neither before nor
  /// now. Simulated time goes slower than the clock's when a hundredth of a second needs more steps than it may take: see slow_motion().
  std::optional<SceneAction> update(Vec3 tool_mm, double radius_mm);

  [[nodiscard]] std::vector<Vec3> points_mm() const;
  [[nodiscard]] const TriMesh& surface() const;                            ///< at rest
  [[nodiscard]] std::span<const std::uint32_t> points_of_surface() const;  ///< point of the surface -> point of the body
  [[nodiscard]] double slow_motion() const;                                ///< simulated over real time, at most 1
  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// What a case lists: tissue.vtu and tissue.json in its folder, and tissue-constants.json where it is; null without.
[[nodiscard]] std::shared_ptr<SoftBody> soft_body_of(const std::filesystem::path& case_folder);

}  // namespace osteo
