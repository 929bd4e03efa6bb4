// Surfaces that follow the drill, body by body.
#pragma once
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "osteo/session/scene/reader.h"
#include "osteo/simulation/bone/live_surface.h"

namespace osteo::inline session {

/// 30 us for each brick around changed voxels, in update(). Memory: that of a LiveSurface for each body.
class SurfaceReader final : public Reader {
 public:
  /// Makes the surfaces of all bodies.
  SurfaceReader(const World& world, const Context& context);

  void resync(const World& world) override;
  void scene_changed(const World& world, const World::Effect& effect) override;
  void tick(const TickRecord& record, std::span<const VoxelChange> changes) override;
  void update() override;

  /// From now on with normals to light by (LiveSurface::shade): whoever draws them asks for it. update() then takes
  /// half as long again.
  void shade();
  /// What update() left of those normals (LiveSurface::settle): now and then.
  void settle();

  /// Null where there is no such body.
  [[nodiscard]] const LiveSurface* surface(std::uint32_t body) const;
  /// Bricks of a body whose surface is another since they were last asked for, ascending; bodies that were not there
  /// before, all.
  std::vector<std::uint32_t> take_changed_bricks(std::uint32_t body);
  /// Over all bodies in their order; of a single body its surface's.
  [[nodiscard]] std::string hash() const;

 private:
  struct Followed {
    std::shared_ptr<const Body> body;
    std::unique_ptr<LiveSurface> surface;
    std::set<std::uint32_t> changed_bricks;
    std::uint32_t from = SceneAction::kNobody;  // a piece of that body, and how
    PieceOrigin origin;
  };
  static void update(Followed& f);

  int threads_;
  bool shaded_ = false;
  std::map<std::uint32_t, Followed> bodies_;  // by id: also their order in the world, but for regions
};

}  // namespace osteo::inline session
