// Heat among the metrics of a score: only for who asks, since the session has to be run again for it.
#pragma once
#include <vector>

#include "osteo/assessment/evidence/metric.h"
#include "osteo/session/scene/heat_reader.h"

namespace osteo::inline assessment {

/// What a heat reader that followed the whole session knows: heat_bone_c, and for each structure heat_peak_c and
/// heat_cem43_min (the body's temperature and no dose where nothing warmed it). `structures` may be null.
[[nodiscard]] std::vector<Measured> heat_values(const HeatReader& heat, const StructureMap* structures);

}  // namespace osteo::inline assessment
