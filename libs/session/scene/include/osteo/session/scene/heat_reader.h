// How warm drilling makes bone, and what that does to critical structures.
#pragma once
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "osteo/session/scene/detail/changed_bricks.h"
#include "osteo/session/scene/reader.h"
#include "osteo/simulation/bone/structure_map.h"
#include "osteo/simulation/heat/heat_field.h"

namespace osteo::inline session {

/// How much of a burr's work becomes heat in bone, and what water does. Known within a factor of ten at best: chosen so
/// that a third of a watt for 30 s gives 13 K at 3 mm, as reported for grinding (docs/validation/heat.md); temperatures
/// follow it in proportion.
struct HeatOfCutting {
  /// Of force times speed of the burr's surface, cutting burrs: friction times the share that stays in bone.
  double cutting_share = 0.03;
  /// Diamond burrs: by force alone, as measured (heat follows pressure, not speed).
  double diamond_w_per_n = 0.5;
  double body_c = 37, water_c = 22;
  double film_w_per_m2_k = 3000;  ///< of running water
  double cell_mm = 0.5;  ///< cells are 1, 2, 4 or 8 voxels wide: the fewest that make at least three quarters of this
};

/// Heat of all burrs of all hands, at their points of contact; conduction in each body by itself (not across a saw cut,
/// nor across the border of a finer region); water from irrigators and from the action `irrigate`. What is cut off
/// begins cold, and so does everything after ticks were lost: told by restarts(). In steps of whole ticks, from the
/// stream alone: a replay gives the same to the bit. Memory: a copy of the bone as of the tick reached, and 22 KB for
/// each 8^3 cells that are warm.
class HeatReader final : public Reader {
 public:
  /// `structures` (null: none) must outlive it.
  HeatReader(const World& world, const StructureMap* structures, double rate_hz, const HeatOfCutting& params = {});
  ~HeatReader() override;

  void resync(const World& world) override;
  void scene_changed(const World& world, const World::Effect& effect) override;
  void action(const SceneAction& action) override;
  void tick(const TickRecord& record, std::span<const VoxelChange> changes) override;

  /// Celsius, at a point of the world; the body's where nothing is warm.
  [[nodiscard]] double celsius_at(Vec3 world_mm) const;
  struct OfStructure {
    ThermalDose worst;            ///< the highest of each over its face
    double now_c = 0;             ///< the warmest place
    double share_over_limit = 0;  ///< of its face, with more than kBoneLimitCem43
  };
  /// Where cells are warm, as balls of the world around their bricks; nothing else is warmer or cooler than the body.
  void for_warm_places(const std::function<void(Vec3 centre_mm, double radius_mm)>& f) const;
  /// By value in the label map, those whose face became warm at all.
  [[nodiscard]] std::map<std::uint8_t, OfStructure> structures() const;
  [[nodiscard]] double hottest_c() const { return hottest_c_; }  ///< of any bone so far
  [[nodiscard]] HeatLedger ledger() const;                       ///< over all bodies, also those that are gone
  [[nodiscard]] double stored_j() const;
  [[nodiscard]] std::size_t warm_bricks() const;

  /// From now on: the highest temperature that each cell has, and the course of each structure. Before the first tick.
  /// Nothing of it without this. Memory: 4 KB for each 8^3 cells that were ever warm, 8 bytes a step and structure.
  /// Forgotten where ticks are lost.
  void keep_history();
  /// Of the bone that is still there, linear between the centres of its cells; the body's where none was warm, or
  /// nothing is kept.
  [[nodiscard]] double peak_c_at(Vec3 world_mm) const;
  /// Share of bone of the voxel at a point of the world, as of the tick reached.
  [[nodiscard]] double bone_at(Vec3 world_mm) const;
  struct Warmest {
    Vec3 at_mm;
    double peak_c = 0;
  };
  /// Of cells that still hold at least half of their bone; none where no such cell was warm.
  [[nodiscard]] std::optional<Warmest> warmest_left() const;
  /// The warmest place of each structure after each step (step_s() apart), C, by value in the label map: of those whose
  /// face became warm.
  [[nodiscard]] const std::map<std::uint8_t, std::vector<double>>& courses() const { return courses_; }
  [[nodiscard]] std::uint64_t steps() const { return steps_; }  ///< that the history tells of

  [[nodiscard]] std::uint64_t restarts() const { return restarts_; }
  [[nodiscard]] double step_s() const { return static_cast<double>(every_) / rate_hz_; }

 private:
  struct Body;
  struct Pending {
    std::vector<std::pair<std::uint32_t, RigidTransform>> poses;
    std::vector<std::unique_ptr<Body>> made;
    std::vector<std::uint32_t> gone;
    std::vector<ChangedBricks> changed;
  };
  [[nodiscard]] std::unique_ptr<Body> body_of(const PlacedBody& placed) const;
  void begin(const World& world);
  void place_structures();
  void retire(Body& body);
  void heat(const TickRecord& record);
  void heat(Vec3 contact_mm, double radius_mm, double watt, double when);
  void cool(Vec3 at_mm, double radius_mm, double share);
  void step();
  void keep_course();

  double rate_hz_;
  HeatOfCutting params_;
  const StructureMap* structures_;
  std::vector<std::unique_ptr<Body>> bodies_;  // finer regions first
  std::deque<Pending> pending_;
  std::size_t applied_early_ = 0;  // pending when ticks were lost, whose action is still to be told
  std::uint64_t every_ = 1, restarts_ = 0;
  SceneAction water_;
  std::array<CuttingGuide, kMaxHands> guides_{};
  HeatLedger retired_;
  double hottest_c_;
  // Of each place on a face: whose, and what it has been through.
  struct Place {
    std::uint8_t structure;
    ThermalDose dose;
    double now_c;
  };
  std::vector<Place> places_;
  bool history_ = false;
  std::uint64_t steps_ = 0;
  std::map<std::uint8_t, std::vector<double>> courses_;
};

/// What it found, a line each: warmest bone and where its heat went; each structure that became warm; none at risk. For
/// people.
[[nodiscard]] std::vector<std::string> reported(const HeatReader& heat, const StructureMap* structures);

}  // namespace osteo::inline session
