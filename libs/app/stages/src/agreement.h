// What a network's labels and our own methods say of each other, put into the labels, their uncertainty and the report.
// Private to libs/app/stages.
#pragma once
#include "osteo/core/base/context.h"
#include "osteo/imaging/neural/segment_network.h"

namespace osteo::inline app {

/// Joins `found` with compare_with_ear(): a boundary that both draw apart is in the last class of uncertainty, and the
/// structure says so (Structure::doubt); what the network has none of is drawn as it was found, and doubted. Reports
/// `agreement`, `disagreement` and `found_by_one`, and warns of disagreement. Nothing is done where no structure has a
/// name that is known.
void join_with_exact(const Image& ct, NetworkLabels& found, const Context& context);

}  // namespace osteo::inline app
