// What was found in the scan, and who stands for the case.
#pragma once
#include <string>

#include "osteo/imaging/dicom/verdict.h"

namespace osteo::inline app {

/// Into the current ImGui window. What the import found in the scan; nothing where that is unknown.
void draw_scan(const VerdictSummary& scan);
/// Who stands for the case: a calm line, in another colour where a later change has ended it.
void draw_approval(const std::string& words, bool ended);

}  // namespace osteo::inline app
