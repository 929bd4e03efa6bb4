// Soft tissue in a rehearsal: deforms under the tool beside the servo, and tells it what it pushes with.
#pragma once
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "osteo/bone/world.h"
#include "osteo/data/tet_mesh.h"

namespace osteo {

/// The tool as soft tissue meets it.
struct SoftTool {
  Vec3 at_mm;             ///< centre of the tip
  Vec3 axis{0, 0, 1};     ///< unit, from tip to handle
  std::uint8_t tool = 0;  ///< index in instrument_library()
  bool turns = false;     ///< a burr that turns
};

/// A body of voxels by the fast model (libs/tissue). Its steps in time run a hundred times a second beside the servo; what the hand feels
/// between them is a plane: the force now, along its own direction, rising with depth. Each such plane is an action of the stream, so a
/// replay needs no tissue. It meets the head of the instrument in its own shape, and the bone as it is now: where it lies in bone at rest
/// it has grown on it, until the bone there is drilled away.
/// A burr that turns cuts voxels off (VoxelCutting); what comes loose is gone with them.
class SoftBody {
 public:
  /// From mesh, problem and perhaps constants, as the stages of tissue take them; `skin`: a finer surface that is drawn instead of the
  /// voxels' own. Errors: as of those.
  SoftBody(const TetMesh& mesh, std::string_view problem_json, const std::optional<std::string>& constants_json = std::nullopt,
           const TriMesh* skin = nullptr);
  ~SoftBody();

  static constexpr double kUpdatesPerS = 100;
  /// The bone that it meets from now on, as it lies at rest; null: none. The world must stay until another is set.
  void meet(const World* world);
  /// Goes on by one update with the tool there; the plane that it pushes with now, or nothing when it pushed neither before nor
  /// now. Simulated time goes slower than the clock's when a hundredth of a second needs more steps than it may take: see slow_motion(); at
  /// a quarter of real time it is as if it were sixteen times as heavy.
  std::optional<SceneAction> update(const SoftTool& tool);

  [[nodiscard]] std::vector<Vec3> points_mm() const;
  /// The surface as it is now. Its triangles change only with version(), when something was cut off.
  [[nodiscard]] const TriMesh& drawn();
  [[nodiscard]] std::uint64_t version() const;
  [[nodiscard]] double cut_off_mm3() const;
  [[nodiscard]] double slow_motion() const;  ///< simulated over real time, at most 1
  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// What a case lists: tissue.vtu and tissue.json in its folder, and where they are tissue-constants.json and tissue.ply, the surface that
/// is drawn; null without.
[[nodiscard]] std::shared_ptr<SoftBody> soft_body_of(const std::filesystem::path& case_folder);

}  // namespace osteo
