// Plates and their screws, and where they lie in bone that they should lie on.
#pragma once
#include <cstdint>
#include <map>
#include <memory>

#include "osteo/simulation/bone/plates.h"
#include "osteo/simulation/bone/world.h"

class vtkRenderer;

namespace osteo::inline display {

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
