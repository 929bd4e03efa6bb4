// Label maps of other programs as the structures of a case: nerves, vessels, ossicles.
#pragma once
#include <string>

#include "osteo/core/base/context.h"
#include "osteo/core/base/param.h"
#include "osteo/core/data/volume.h"

namespace osteo::inline imaging {

struct StructuresParams {
  std::string names;
  bool only_named = false;
};

/// Every value gets a name and a colour. `params.names`: "1=facial nerve, 2=sigmoid sinus" goes before what the file
/// says; what neither names is "structure 3", or with `only_named` background. Values that no voxel has are left out.
/// Reports the volume of each. With a CT: Error(failed) when no labelled voxel lies inside it, a warning when less than
/// half do. Error(usage) for names that cannot be read.
[[nodiscard]] Labels name_structures(const Labels& labels, const StructuresParams& params, const Image* ct = nullptr,
                                     const Context& context = {});

}  // namespace osteo::inline imaging
