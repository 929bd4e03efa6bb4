// What the burr does now: force, depth, bone under it, structures near it; and what was found in the scan.
#pragma once
#include "osteo/dicom/verdict.h"
#include "osteo/scene/rehearsal.h"

namespace osteo {

/// Into the current ImGui window.
void draw_status(const Rehearsal& rehearsal, const TickRecord& tick);

/// What the import found in the scan; nothing where that is unknown.
void draw_scan(const VerdictSummary& scan);

}  // namespace osteo
