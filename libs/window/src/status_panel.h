// What the burr does now: force, depth, bone under it, structures near it.
#pragma once
#include "osteo/scene/rehearsal.h"

namespace osteo {

/// Into the current ImGui window.
void draw_status(const Rehearsal& rehearsal, const TickRecord& tick);

}  // namespace osteo
