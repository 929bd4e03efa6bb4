// Which parts of the bone are connected, body by body, while it is drilled.
#pragma once
#include <map>
#include <memory>
#include <vector>

#include "osteo/session/scene/reader.h"
#include "osteo/simulation/bone/live_components.h"

namespace osteo::inline session {

/// 10 us for each changed brick and 1 ms for the joining in a whole head, in update(). Memory: that of LiveComponents
/// for each body.
class PiecesReader final : public Reader {
 public:
  /// Labels all bodies.
  explicit PiecesReader(const World& world);

  void resync(const World& world) override;
  void scene_changed(const World& world, const World::Effect& effect) override;
  void tick(const TickRecord& record, std::span<const VoxelChange> changes) override;
  void update() override;

  /// Null where there is no such body.
  [[nodiscard]] const LiveComponents* components(std::uint32_t body) const;
  /// Parts that are connected, of at least kMinPieceMm3, largest first, over all bodies; centres in the world.
  [[nodiscard]] std::vector<LiveComponents::Component> large_pieces() const;
  static constexpr double kMinPieceMm3 = 50;

 private:
  struct Followed {
    std::shared_ptr<const Body> body;
    RigidTransform world_from_body;
    bool of_region = false;
    std::unique_ptr<LiveComponents> components;
    std::uint32_t from = SceneAction::kNobody;  // a piece of that body, and how
    PieceOrigin origin;
  };
  std::map<std::uint32_t, Followed> bodies_;  // by id
};

}  // namespace osteo::inline session
