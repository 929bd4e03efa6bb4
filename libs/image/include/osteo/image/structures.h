// Label maps of other programs as the structures of a case: nerves, vessels, ossicles.
#pragma once
#include <string>

#include "osteo/data/volume.h"
#include "osteo/stage/stage.h"

namespace osteo {

struct StructuresParams {
  std::string names;
  bool only_named = false;
};

/// Every value gets a name and a colour. `params.names`: "1=facial nerve, 2=sigmoid sinus" goes before what the file says; what neither
/// names is "structure 3", or with `only_named` background. Values that no voxel has are left out. Reports the volume of each. With a CT:
/// Error(failed) when no labelled voxel lies inside it, a warning when less than half do. Error(usage) for names that cannot be read.
[[nodiscard]] Labels name_structures(const Labels& labels, const StructuresParams& params, const Image* ct = nullptr,
                                     const Context& context = {});

struct StructuresStage {
  using Params = StructuresParams;
  static void describe(Params& p, auto& visit) {
    visit({"names", "what the values stand for, like '1=facial nerve, 2=sigmoid sinus' (empty: as the file says)"}, p.names);
    visit({"only_named", "values that neither names nor the file name are background: tissue that is not at risk"}, p.only_named);
  }
  static StageInfo info();
  static std::vector<Data> run(const Params& params, std::span<const Data> inputs, const Context& context);
};

}  // namespace osteo
