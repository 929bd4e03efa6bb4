// What the scene is made of while it is operated on: bone in pieces, plates on it, and what has been done to them.
#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include "osteo/simulation/bone/action.h"
#include "osteo/simulation/bone/hardness.h"
#include "osteo/simulation/bone/live_components.h"
#include "osteo/simulation/bone/pieces.h"
#include "osteo/simulation/bone/saw.h"

namespace osteo::inline simulation {

/// A voxel's new density; the name is that of the stream (Body::name_of). Session files keep the two, not what it was
/// before.
struct VoxelChange {
  VoxelKey voxel = 0;
  float density = 0;
  float before = 0;  ///< its density before this change
};
static_assert(sizeof(VoxelChange) == 12);

/// A piece of bone and where it is. The grid never moves: a pose carries it into the world.
struct Body {
  std::uint32_t id = 0;
  std::uint32_t first_brick =
      0;  ///< its bricks are numbered from here in the stream, so that a voxel has one name in all pieces
  BrickGrid bone;
  std::shared_ptr<const Hardness> hardness;  ///< null where the scene does not go by it
  [[nodiscard]] VoxelKey name_of(VoxelKey own) const { return own + first_brick * BrickGrid::kVoxels; }
};

struct PlacedBody {
  std::shared_ptr<Body> body;
  RigidTransform world_from_body;
  bool of_region = false;  ///< a finer part of the first body, which it always moves with and is never split from
};

/// A plate on bone. It holds two pieces together, or with `other` none, sits on one.
struct Fixture {
  std::uint32_t id = 0;
  std::uint32_t plate = 0;  ///< index in plate_library()
  std::uint32_t body = 0, other = SceneAction::kNobody;
  RigidTransform body_from_plate;
  double opening_mm = 0;
};

/// Bodies and fixtures change by act() alone; densities of bodies also by the servo. act() never writes into a body
/// that is there: where density changes it puts a new one in its place, so that whoever still reads the old is not
/// disturbed. The two have the bricks that did not change in common: what is removed from the new afterwards is seen in
/// the old there.
class World {
 public:
  /// Names are 32 bits wide: room for BrickGrid::kMaxBricks over all that the scene ever held; names are not given
  /// twice.
  explicit World(BrickGrid bone, std::shared_ptr<const Hardness> hardness = nullptr);
  /// A part of the first body in finer voxels: in its box the coarse bone is taken out, so that each place belongs to
  /// one of them. A world with a region is sawn and moved, but not taken apart. Error(usage) unless its box lies along
  /// faces of the first body's voxels (to a hundredth); Error(resources) where names run out.
  void add_region(BrickGrid fine, std::shared_ptr<const Hardness> hardness = nullptr);

  /// With bodies of its own (a copy by value would share them).
  [[nodiscard]] World copy() const;
  World(World&&) = default;
  World& operator=(World&&) = default;

  [[nodiscard]] const std::vector<PlacedBody>& bodies() const { return bodies_; }
  [[nodiscard]] const std::vector<Fixture>& fixtures() const { return fixtures_; }
  [[nodiscard]] const PlacedBody* find(std::uint32_t body) const;
  /// The body that a voxel of the stream belongs to; null when there is none.
  [[nodiscard]] const PlacedBody* owner(VoxelKey name) const;
  /// A plate that a hand holds instead of its instrument.
  struct Grip {
    std::uint32_t plate = SceneAction::kNobody;  ///< index in plate_library(); kNobody: the instrument
    /// The hand's frame has its origin at the device's position and z along its axis (frame_of_axis).
    RigidTransform hand_from_plate;
  };
  /// `hand` below kMaxHands. attach() leaves its hand without a plate.
  [[nodiscard]] const Grip& grip(std::uint32_t hand = 0) const { return grips_[hand]; }
  /// That holds a hand's saw. `hand` below kMaxHands.
  [[nodiscard]] const CuttingGuide& cutting_guide(std::uint32_t hand = 0) const { return guides_[hand]; }
  [[nodiscard]] bool held() const { return held_; }
  /// Whether it is computed beside the bone, as the last action has left it; at the beginning as `simulate` says, else
  /// not. No state of it is here.
  [[nodiscard]] bool simulates(Simulated what) const { return simulated_[static_cast<std::size_t>(what)]; }
  void simulate(Simulated what, bool on) { simulated_[static_cast<std::size_t>(what)] = on; }
  /// How many steps undo can take back.
  [[nodiscard]] std::size_t undo_steps() const;

  struct Effect {
    bool done = true;
    std::string message;  ///< why nothing was done, or not what was asked for
    /// Bodies with the same id, of which these bricks differ (a new grid took the old one's place).
    struct Changed {
      std::uint32_t body;
      std::vector<std::uint32_t> bricks;
    };
    std::vector<Changed> changed;
    /// Bodies that were not there before, each with how it came out of `from`.
    struct Made {
      std::uint32_t body, from;
      PieceOrigin origin;
    };
    std::vector<Made> made;
    std::vector<std::uint32_t> gone;
    std::vector<std::pair<VoxelKey, float>> dust;  ///< names of voxels and the density that became dust there
  };
  /// Cost: moves nothing; plates under a millisecond; saw, split and undo O(bricks): they copy only those that
  /// change otherwise than by going from one body to another. `components` of a body (by id), up to date; where it is
  /// empty or gives null, split finds them itself. Never throws for what cannot be done: done is false, and nothing
  /// changed.
  using ComponentsOf = std::function<const LiveComponents*(std::uint32_t body)>;
  Effect act(const SceneAction& action, const ComponentsOf& components = {});

  /// What the servo's stream tells, in its order, so that undo knows the strokes of the burr and which of them came
  /// before an action. Who changes densities without a servo (from a session file) tells the same. A stroke goes from
  /// the first voxel changed to ActionKind::stroke or to the next action that undo can take back, whichever comes
  /// first. Memory: 12 bytes for each voxel of a stroke, and about 50 while it goes on; when strokes together need more
  /// than kMaxStrokeBytes, the oldest is forgotten, with all that came before it: undo goes back to there and no
  /// farther, and says so.
  void notify(std::span<const VoxelChange> changes);
  void notify(const SceneAction& action);
  /// Changes or actions of the stream were missed: nothing that came before can be taken back any more, nor the stroke
  /// that goes on.
  void forget();
  static constexpr std::size_t kMaxStrokeBytes = std::size_t{64} << 20;

  /// Of bodies, poses and fixtures; the bone's own hash where there is one body, unmoved, and nothing on it.
  [[nodiscard]] std::string hash() const;
  /// Density at a point of the world, of whichever body has the most there.
  [[nodiscard]] float nearest(Vec3 world_mm) const;
  /// Edge of the smallest voxels: those of the region where there is one.
  [[nodiscard]] double finest_voxel_mm() const;
  /// Density over all bodies, mm3.
  [[nodiscard]] double volume_mm3() const;

 private:
  struct Change {
    VoxelKey voxel;
    float before, after;
  };
  // What it takes to go back: places and plates as they were; densities as differences, so that what was drilled since
  // stays drilled.
  struct Done {
    ActionKind kind;
    std::uint32_t of = 0;         // move: the piece; open: the fixture
    std::vector<Change> drilled;  // stroke: names; of the rest only this
    std::vector<std::pair<std::uint32_t, RigidTransform>> poses;
    std::vector<Fixture> fixtures;
    std::vector<std::pair<std::uint32_t, std::vector<Change>>> sawn;
    std::vector<std::pair<std::uint32_t, std::uint32_t>> children;  // body, the one it came from
    std::vector<std::pair<VoxelKey, float>> loose;                  // names
  };
  World(const World&) = default;  // shares bodies
  PlacedBody* placed(std::uint32_t body);
  [[nodiscard]] std::vector<std::uint32_t> joined_to(std::uint32_t body, std::uint32_t except_fixture) const;
  [[nodiscard]] std::uint32_t not_under_plate(const SceneAction& attach) const;
  void move_group(const std::vector<std::uint32_t>& group, const RigidTransform& by);
  [[nodiscard]] Done snapshot(ActionKind kind, std::uint32_t of = 0) const;
  [[nodiscard]] static bool goes_on(const Done& before, const Done& after);
  void end_stroke();
  Effect saw(const SceneAction& a);
  Effect split(const SceneAction& a, const ComponentsOf& components);
  Effect undo();

  friend struct WorldProbe;  // tests of a scene whose names run out

  std::vector<PlacedBody> bodies_;
  std::vector<Fixture> fixtures_;
  // Actions are done before the stream tells of them: the first reported_ of these it has told of, and strokes come in
  // behind those.
  std::vector<Done> done_;
  std::size_t reported_ = 0;
  std::vector<Change> stroke_;  // that goes on, by names
  std::unordered_map<VoxelKey, std::uint32_t> in_stroke_;
  bool missed_ = false;  // since something was missed, nothing has come that surely begins a new step
  std::size_t stroke_bytes_ = 0;
  std::uint64_t steps_forgotten_ = 0;
  std::array<Grip, kMaxHands> grips_;
  std::array<CuttingGuide, kMaxHands> guides_;
  std::uint32_t next_body_ = 1, next_fixture_ = 1, next_brick_ = 0;
  std::array<bool, static_cast<std::size_t>(Simulated::behind_last)> simulated_{};
  bool held_ = false;
};

}  // namespace osteo::inline simulation
