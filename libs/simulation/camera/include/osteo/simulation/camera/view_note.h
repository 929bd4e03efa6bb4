// Where one looked from, as sessions keep it: the value of a "camera" note.
#pragma once
#include <optional>
#include <string_view>

#include "osteo/simulation/camera/microscope.h"

namespace osteo::inline simulation {

/// The view of a "camera" note. Where it names no magnification, from its angle of view (30 degrees where that is
/// missing too); where it names no upward direction, head up. Nothing for what is no such note: no JSON, no eye or
/// target, both in one place.
[[nodiscard]] std::optional<ScopeView> view_of_note(std::string_view json);

}  // namespace osteo::inline simulation
