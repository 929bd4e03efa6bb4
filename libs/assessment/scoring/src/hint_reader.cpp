#include "osteo/assessment/scoring/hint_reader.h"

#include <cmath>
#include <utility>

#include "osteo/assessment/evidence/visibility.h"
#include "osteo/geometry/grid/brick_places.h"
#include "osteo/simulation/bone/instrument.h"

namespace osteo::inline assessment {

void HintReader::tick(const TickRecord& record, std::span<const VoxelChange> /*changes*/) {
  watch_.tick(record);
  if (record.hand == 0) last_ = record;
}

void HintReader::update() {
  if (watch_.drilling() && world_ != nullptr && last_.tick >= look_at_tick_) {
    look_at_tick_ = last_.tick + static_cast<std::uint64_t>(rate_hz_ / kLookHz);
    std::optional<Vec3> eye;
    {
      const std::lock_guard lock(mutex_);
      eye = eye_mm_;
    }
    if (eye) {
      const Vec3 tip = from_floats(last_.device.position_mm) + from_floats(last_.shown_offset_mm),
                 axis = from_floats(last_.device.axis);
      const RoundCone& head = instrument_of(last_.device.tool).head;
      watch_.seen(!BoneSight(*world_).blocked(*eye, tip, [&](const PlacedBody& body, VoxelKey own) {
        const BrickGrid& bone = body.body->bone;
        const Vec3 at = body.world_from_body(place_of_voxel_mm(bone, own));
        const double axial = dot(at - tip, axis);
        return head.distance_mm({length(at - tip - axis * axial), 0, axial}) < length(bone.frame().spacing_mm);
      }));
    } else {
      watch_.seen(std::nullopt);
    }
  }
  if (auto hint = watch_.take()) {
    const std::lock_guard lock(mutex_);
    hint_ = std::move(hint);
  }
}

void HintReader::look_from(Vec3 eye_mm) {
  const std::lock_guard lock(mutex_);
  eye_mm_ = eye_mm;
}

std::optional<Hint> HintReader::take() {
  const std::lock_guard lock(mutex_);
  return std::exchange(hint_, std::nullopt);
}

}  // namespace osteo::inline assessment
