// Instruments, plates and their screws in the scene.
#pragma once
#include <cstdint>
#include <functional>
#include <map>
#include <memory>

#include "osteo/simulation/bone/instrument.h"
#include "osteo/simulation/bone/plates.h"
#include "osteo/simulation/bone/world.h"
#include "osteo/simulation/haptics/saw_slot.h"

class vtkRenderer;

namespace osteo::inline display {

// -- What a hand holds, as it looks.

/// How far a burr turns in a time, and how much of its flutes a picture shows: 1 while they turn by less than a quarter
/// of their distance between two pictures, 0 from half of it on, where they would seem to stand or to turn backwards.
struct BurrSpin {
  double angle_rad = 0;
  double sharp = 1;
  /// `seconds` between two pictures. O(1).
  void turn(double speed_rpm, double seconds, int flutes);
};
/// Flutes around a cutting burr, by its diameter; a guess between the 6 and 12 that are usual. 0: a diamond.
[[nodiscard]] int flutes_of(const Burr& burr);

/// Whether a place in the world lies in bone of any piece. O(pieces).
[[nodiscard]] bool is_bone(const World& world, Vec3 at_mm);

/// A burr with flutes or grain that turns with the recorded speed and is a smooth blur when that is faster than
/// pictures show, its shaft and handpiece; a sucker's open tube with its finger plate, an irrigator, a probe, a hook.
/// The head keeps its true outline, which is what is felt; flutes are cut into it. The tool is drawn where the bone
/// stops it; where the true hand is farther than kGhostMm from that, its outline is drawn there too. Of the shaft, what
/// lies within bone is left out, and a band at the place says that it touches.
class InstrumentView {
 public:
  static constexpr double kGhostMm = 1.5;
  explicit InstrumentView(vtkRenderer* renderer);
  ~InstrumentView();
  InstrumentView(const InstrumentView&) = delete;
  InstrumentView& operator=(const InstrumentView&) = delete;

  /// `solid`: whether a place in the world lies in bone, asked some thousand times where the shaft touches
  /// (kShaftContact); none: no bone. `rate_hz`: ticks a second. Cost: 5 us; where the shaft touches or a burr comes up
  /// to speed some 0.2 ms. `guide`: of this hand (World::cutting_guide).
  void show(const TickRecord& tick, double rate_hz, const std::function<bool(Vec3)>& solid = {},
            const CuttingGuide& guide = {});
  void hide();
  /// The handle in a colour of its own (red, green, blue, 0 to 1), which tells whose it is; `opacity` below 1: of one
  /// that is not there.
  void report_apart(Vec3 colour, double opacity);
  /// How much of the shaft is within bone: 0 to 1, of its rings; as of the last picture.
  [[nodiscard]] double shaft_in_bone() const;
  [[nodiscard]] bool ghost_shown() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// -- Plates and their screws, and where they lie in bone that they should lie on.

/// What is deeper than this in bone is tinted and told.
inline constexpr double kPlateCollisionMm = 0.2;

/// How deep a plate's underside lies in bone at most, along its screws, by plate_gaps() at 150 points; 0 where it lies
/// on it. 0.2 ms.
[[nodiscard]] double plate_in_bone_mm(const World& world, const PlateModel& plate,
                                      const RigidTransform& world_from_plate, double opening_mm = 0);

/// Metal, shaded, edges crisp; both feet of a distractor. Fixed plates have a screw in each hole: its head on the
/// plate, threads below. Red from kPlateCollisionMm on, full at a millimetre.
class PlateView {
 public:
  explicit PlateView(vtkRenderer* renderer);
  ~PlateView();
  PlateView(const PlateView&) = delete;
  PlateView& operator=(const PlateView&) = delete;

  /// The plates that are fixed. What lies in bone is looked for when one has come or moved, and each second: 1 us a
  /// point of it.
  void update(const World& world);
  /// One in a hand, without screws; looked at each time.
  void show_in_hand(const World& world, std::uint32_t plate, const RigidTransform& world_from_plate);
  void hide_in_hand();
  /// Points of all that is drawn now and is tinted.
  [[nodiscard]] std::size_t tinted() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace osteo::inline display
