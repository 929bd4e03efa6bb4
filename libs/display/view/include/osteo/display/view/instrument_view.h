// What a hand holds, as it looks.
#pragma once
#include <functional>
#include <memory>

#include "osteo/simulation/bone/instrument.h"
#include "osteo/simulation/bone/world.h"
#include "osteo/simulation/haptics/saw_slot.h"

class vtkRenderer;

namespace osteo::inline display {

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
  void tell_apart(Vec3 colour, double opacity);
  /// How much of the shaft is within bone: 0 to 1, of its rings; as of the last picture.
  [[nodiscard]] double shaft_in_bone() const;
  [[nodiscard]] bool ghost_shown() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace osteo::inline display
