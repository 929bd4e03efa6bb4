// Label maps of other programs as the structures of a case: nerves, vessels, ossicles.
#pragma once
#include <optional>
#include <string>
#include <string_view>

#include "osteo/core/base/context.h"
#include "osteo/core/base/param.h"
#include "osteo/core/data/volume.h"

namespace osteo::inline imaging {

struct StructuresParams {
  std::string names;
  bool only_named = false;
};

/// What no healthy structure of that name exceeds.
struct StructureLimits {
  std::string_view name;
  double radius_mm = 0;   ///< of the tube it is; 0: it is no tube
  double volume_mm3 = 0;  ///< of one side's
};

/// By words in the name, in any case ("Left Facial_Nerve"). Nothing for names that are not known.
[[nodiscard]] std::optional<StructureLimits> structure_limits(std::string_view name);

/// Why a structure of this name and volume cannot be what it is called; empty when it can, or nothing is known of it.
[[nodiscard]] std::string implausible_volume(std::string_view name, double volume_mm3);

/// Every value gets a name and a colour. `params.names`: "1=facial nerve, 2=sigmoid sinus" goes before what the file
/// says; what neither names is "structure 3", or with `only_named` background. Values that no voxel has are left out.
/// Reports the volume of each, and warns of one too large for its name. With a CT: Error(failed) when no labelled voxel
/// lies inside it, a warning when less than half do, and one of each structure that is not to be trusted (Structure::
/// doubt). Error(usage) for names that cannot be read.
[[nodiscard]] Labels name_structures(const Labels& labels, const StructuresParams& params, const Image* ct = nullptr,
                                     const Context& context = {});

}  // namespace osteo::inline imaging
