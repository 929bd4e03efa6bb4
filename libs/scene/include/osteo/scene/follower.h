// What reads the stream while bone is drilled: surface, pieces, dust.
#pragma once
#include <array>
#include <deque>
#include <map>
#include <memory>
#include <set>
#include <vector>

#include "osteo/bone/dust.h"
#include "osteo/bone/live_components.h"
#include "osteo/bone/live_surface.h"
#include "osteo/haptics/stream.h"

namespace osteo {

struct FollowerParts {
  bool surface = true;
  bool pieces = false;
  bool dust = false;
};

/// Keeps up what a scene lists, body by body; the rest is not built. One thread at a time. Everything follows from the stream alone, so a
/// replay's follower ends with the same dust.
class Follower {
 public:
  Follower(const World& world, const FollowerParts& parts, double rate_hz, const Context& context);
  ~Follower();

  /// Takes what the stream holds, and brings everything up to date. Returns the ticks taken. Where the stream had to leave ticks out,
  /// everything is made again from the bone as it is: right again, but that dust then appeared later than it was made, and structures were
  /// not watched meanwhile.
  std::size_t drain(StreamReader& reader);
  /// The servo has ended after so many ticks, and drain() took what there was: what was done behind the last happens to the dust, and
  /// if the last ticks are missing it catches up.
  void end(StreamReader& reader, std::uint64_t ticks);
  [[nodiscard]] std::uint64_t ticks_lost() const { return ticks_lost_; }
  /// The world was changed by an action, which the stream will tell of; it was drained as far as it went before.
  void follow(const World& world, const World::Effect& effect);

  /// Null where pieces are not followed, or there is no such body.
  [[nodiscard]] const LiveComponents* components(std::uint32_t body) const;
  /// Null where the surface is not followed, or there is no such body.
  [[nodiscard]] const LiveSurface* surface(std::uint32_t body) const;
  /// Bricks of a body whose surface is another since they were last asked for, ascending; bodies that were not there before, all.
  std::vector<std::uint32_t> take_changed_bricks(std::uint32_t body);
  /// Over all bodies in their order; of a single body its surface's.
  [[nodiscard]] std::string surface_hash() const;
  /// Parts that hang together, of at least kLeastPieceMm3, largest first, over all bodies.
  [[nodiscard]] std::vector<LiveComponents::Component> large_pieces() const;
  static constexpr double kLeastPieceMm3 = 50;
  /// Null where the scene has none.
  [[nodiscard]] Dust* dust() const { return dust_.get(); }

  /// `hand` below kMostHands; of one that is not there: as it was made.
  [[nodiscard]] const TickRecord& latest(std::size_t hand = 0) const { return latest_[hand]; }
  [[nodiscard]] double sawn_mm3() const { return sawn_mm3_; }
  /// Instruments that have removed bone.
  [[nodiscard]] const std::set<std::uint8_t>& burrs_used() const { return burrs_used_; }
  /// Ticks in which bone was left that might have gone (kNoRoom).
  [[nodiscard]] std::uint64_t ticks_without_room() const { return ticks_without_room_; }
  /// Ticks in which the device gave no pose that could be used.
  [[nodiscard]] std::uint64_t unusable_poses() const { return unusable_poses_; }

 private:
  struct Followed {
    std::shared_ptr<const Body> body;
    RigidTransform world_from_body;
    bool of_region = false;
    std::unique_ptr<LiveSurface> surface;
    std::unique_ptr<LiveComponents> components;
    std::set<std::uint32_t> changed_bricks;
    std::uint32_t from = SceneAction::kNobody;  // a piece of that body, and how
    PieceOrigin origin;
  };
  // A body as of the tick that the dust has reached: servo and scene may be farther.
  struct Dusty {
    BrickGrid bone;
    std::uint32_t first_brick = 0;
    RigidTransform world_from_body;
    bool of_region = false;
  };
  // What an action does to dust and to the bone it lies on, until its tick has come.
  struct Awaited {
    std::vector<std::pair<std::uint32_t, RigidTransform>> poses;
    std::vector<std::pair<std::uint32_t, Dusty>> made;
    std::vector<std::uint32_t> gone;
    struct Bricks {
      std::uint32_t body;
      std::vector<std::uint32_t> bricks;
      std::vector<float> values;
    };
    std::vector<Bricks> changed;
    std::vector<std::pair<VoxelKey, float>> dust;
  };
  Followed* owner(VoxelKey name);
  void dust_tick(const TickRecord& tick, std::span<const VoxelChange> changes);
  void await(const World& world, const World::Effect& effect);
  void happen(const SceneAction& action);
  void happen_next();
  void update();
  Dusty* dusty_owner(VoxelKey name);
  void lose(const Dusty& from, VoxelKey own, float density);
  void make_dust(std::span<const VoxelChange> changes);
  void catch_up();
  [[nodiscard]] static Vec3 place_of(const Dusty& body, VoxelKey own);

  FollowerParts parts_;
  double rate_hz_;
  std::map<std::uint32_t, std::unique_ptr<Followed>> bodies_;  // by id: also their order in the world, but for regions
  std::map<std::uint32_t, Dusty> dusty_;
  std::deque<Awaited> awaited_;
  std::unique_ptr<Dust> dust_;
  SceneAction sucker_, water_;
  std::deque<SceneAction> actions_;
  std::vector<TickRecord> ticks_;
  std::vector<VoxelChange> changes_;
  std::array<TickRecord, kMostHands> latest_;
  double sawn_mm3_ = 0;
  std::uint64_t next_tick_ = 0, ticks_lost_ = 0;
  std::size_t happened_before_ = 0;  // actions whose turn comes still, and that have happened to the dust while catching up
  std::set<std::uint8_t> burrs_used_;
  std::uint64_t ticks_without_room_ = 0;
  std::uint64_t unusable_poses_ = 0;
};

}  // namespace osteo
