// Soft tissue in a rehearsal: deforms under the tools beside the servo, and tells it what it pushes with.
#pragma once
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "osteo/core/data/tet_mesh.h"
#include "osteo/simulation/bone/world.h"

namespace osteo::inline session {

/// A tool as soft tissue meets it.
struct SoftTool {
  Vec3 at_mm;             ///< centre of the tip
  Vec3 axis{0, 0, 1};     ///< unit, from tip to handle
  std::uint8_t tool = 0;  ///< index in instrument_library()
  bool turns = false;     ///< what cuts, at work
};

/// What a body pushes a tool with.
struct SoftPush {
  Vec3 force_n;
  double stiffness_n_per_mm = 0;  ///< by so much more for each mm deeper
};

/// A body of voxels by the fast model (libs/simulation/tissue). Its steps in time run a hundred times a second beside
/// the servo. It meets the heads of instruments in their own shape, and the bone as it is now: where it lies in bone at
/// rest it has grown on it, until the bone there is drilled away. A tool at work that cuts takes voxels off
/// (VoxelCutting); what comes loose is gone with them. What has been still for half a second with no tool near goes to
/// sleep, and costs nothing until a tool comes near or it is woken.
class SoftBody {
 public:
  /// From mesh, problem and perhaps constants, as the stages of tissue take them; `skin`: a finer surface that is drawn
  /// instead of the voxels' own. Errors: as of those.
  SoftBody(const TetMesh& mesh, std::string_view problem_json,
           const std::optional<std::string>& constants_json = std::nullopt, const TriMesh* skin = nullptr);
  ~SoftBody();

  static constexpr double kUpdatesPerS = 100;
  /// What an update may take, in steps times tetrahedra: 4 to 10 ms of a core. Not measured by wall clock, or two runs
  /// of one script would differ.
  static constexpr double kMaxWork = 250'000;
  static constexpr double kNearMm = 10;  ///< a tool is near whose head comes within this of the body's box

  /// The bone that it meets from now on, as it lies at rest; null: none. The world must stay until another is set.
  void meet(const World* world);
  /// Goes on by one update with the tools there, by number the same ones as before. What it pushes each with; all
  /// nothing while it sleeps. Simulated time goes slower than the clock's when a hundredth of a second needs more than
  /// `most_work`: see slow_motion(). Its own swinging is then slower, as if it were heavier. A pad that a hand presses
  /// gives way almost alike, a thin flap lags (docs/validation/tissue.md, Fewer steps than real time).
  std::vector<SoftPush> update(std::span<const SoftTool> tools, double most_work = kMaxWork);
  /// Whether the next update with these tools costs nothing.
  [[nodiscard]] bool sleeps_with(std::span<const SoftTool> tools) const;
  /// For whoever changed the bone that it lies on.
  void wake();
  /// The same, where the head of an instrument (at its tip's centre) is near.
  void wake_near(Vec3 at_mm, std::uint8_t tool);
  [[nodiscard]] bool asleep() const;

  [[nodiscard]] double work() const;  ///< what an update in real time would take, as kMaxWork
  [[nodiscard]] std::vector<Vec3> points_mm() const;
  /// The surface as it is now. Its triangles change only with version(), when something was cut off.
  [[nodiscard]] const TriMesh& drawn();
  [[nodiscard]] std::uint64_t version() const;
  [[nodiscard]] std::uint64_t updates()
      const;  ///< that it was not asleep in: as long as this stays, all of it is where it was
  [[nodiscard]] double cut_off_mm3() const;
  /// Simulated over real time in the last update that it was not asleep in, at most 1.
  [[nodiscard]] double slow_motion() const;
  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace osteo::inline session
