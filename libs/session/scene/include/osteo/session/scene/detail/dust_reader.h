// Bone dust that the burr, the saw and splits leave.
#pragma once
#include <deque>
#include <map>
#include <memory>
#include <vector>

#include "osteo/session/scene/detail/changed_bricks.h"
#include "osteo/session/scene/reader.h"
#include "osteo/simulation/bone/dust.h"

namespace osteo::inline session {

/// Moves in tick(), a hundred steps a second, so that a replay ends with the same dust to the bit. What a stroke or a
/// saw left stays dust when it is taken back. After ticks were lost: what is gone since has become dust, later than it
/// was made. One that joins a scene whose pieces it does not know begins without dust. Memory: a copy of the bone as of
/// the tick reached, and 2 to 6 KB for each brick that holds dust or water.
class DustReader final : public Reader {
 public:
  DustReader(const World& world, double rate_hz);

  void resync(const World& world) override;
  void scene_changed(const World& world, const World::Effect& effect) override;
  void action(const SceneAction& action) override;
  void tick(const TickRecord& record, std::span<const VoxelChange> changes) override;

  [[nodiscard]] Dust& dust() { return *dust_; }
  [[nodiscard]] const Dust& dust() const { return *dust_; }

 private:
  // A body as of the tick that the dust has reached: servo and scene may be farther.
  struct Bone {
    BrickGrid bone;
    std::uint32_t first_brick = 0;
    RigidTransform world_from_body;
    bool of_region = false;
  };
  // What an action does to dust and to the bone it lies on, until its tick has come.
  struct Pending {
    std::vector<std::pair<std::uint32_t, RigidTransform>> poses;
    std::vector<std::pair<std::uint32_t, Bone>> made;
    std::vector<std::uint32_t> gone;
    std::vector<ChangedBricks> changed;
    std::vector<std::pair<VoxelKey, float>> dust;
  };
  void begin(const World& world);
  void apply_next();
  Bone* owner(VoxelKey name);
  void remove_from_coarse(const Bone& from, VoxelKey own, float density);
  void make_dust(std::span<const VoxelChange> changes);
  [[nodiscard]] static Vec3 place_of(const Bone& body, VoxelKey own);

  double rate_hz_;
  std::map<std::uint32_t, Bone> bones_;  // by id
  std::deque<Pending> pending_;
  std::unique_ptr<Dust> dust_;
  SceneAction sucker_, water_, posture_;
  std::size_t applied_early_ = 0;  // pending when ticks were lost, whose action is still to be told
};

}  // namespace osteo::inline session
