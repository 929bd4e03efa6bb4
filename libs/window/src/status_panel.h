// What the burr does now: force, depth, bone under it, structures near it; and what was found in the scan.
#pragma once
#include <string>

#include "osteo/dicom/verdict.h"
#include "osteo/scene/rehearsal.h"

namespace osteo {

/// Into the current ImGui window.
void draw_status(const Rehearsal& rehearsal, const TickRecord& tick);

/// What the import found in the scan; nothing where that is unknown.
void draw_scan(const VerdictSummary& scan);
/// Who stands for the case: a calm line, in another colour where a later change has ended it.
void draw_approval(const std::string& words, bool ended);

}  // namespace osteo
