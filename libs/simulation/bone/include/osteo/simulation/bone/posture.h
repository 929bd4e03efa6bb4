// How the patient lies: which way is down in the case.
#pragma once
#include <array>
#include <string_view>

#include "osteo/core/base/param.h"
#include "osteo/core/data/vec.h"

namespace osteo::inline simulation {

enum class Posture : int { supine, prone, sitting, left_side, right_side };
[[nodiscard]] constexpr std::array<std::string_view, 5> enum_names(Posture) {
  return {"supine", "prone", "sitting", "left_side", "right_side"};
}

/// The direction of gravity in LPS of the case, whose axes go with the head: unit. `head_turned_deg`: about the body's
/// long axis, positive where the face turns towards the patient's left (for the right ear), negative towards the right
/// (for the left ear).
[[nodiscard]] Vec3 down_of(Posture posture, double head_turned_deg);

struct PostureNow {
  Posture posture = Posture::supine;
  double head_turned_deg = 0;
};
/// One of those that give this direction (unit): supine, prone or sitting, turned by at most 90 degrees. Sitting
/// where it lies along the body's axis more than across it.
[[nodiscard]] PostureNow posture_of(Vec3 down);

}  // namespace osteo::inline simulation
