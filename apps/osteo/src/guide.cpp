// guide: which threshold suits the bone of a scan.
#include <cmath>
#include <ostream>

#include "commands.h"
#include "osteo/base/error.h"
#include "osteo/base/json_document.h"
#include "osteo/dicom/import.h"
#include "osteo/image/bone_threshold.h"

namespace osteo {

cli::CommandInfo GuideCommand::info() {
  return {"guide",
          "which bone threshold suits a scan",
          "Finds soft tissue and dense bone in the values and proposes a threshold for thick bone (cortical), for the walls of air cells "
          "(cellular) and for thin plates (thin), with the volume of bone each gives and how much that depends on the exact number.",
          {{"source", "DICOM folder or zip, or a volume file"}},
          "osteo guide DICOM_FOLDER"};
}

int GuideCommand::run(const Params&, cli::Invocation& io) {
  const Image ct = import_ct(io.arguments[0], {}, io.context).image;
  const BoneGuide g = guide_threshold(ct, io.context.threads);
  io.end_progress();
  if (io.common.json) {
    Json j{{"soft_tissue_hu", g.soft_tissue_hu},
           {"noise_hu", g.noise_hu},
           {"dense_bone_hu", g.dense_bone_hu},
           {"confidence", g.confidence},
           {"presets", Json::object()}};
    for (const PresetGuide& p : g.presets) {
      j["presets"][std::string(EnumNames<BonePreset>::values[static_cast<std::size_t>(p.preset)])] = {
          {"lower_hu", p.lower_hu}, {"volume_mm3", p.volume_mm3}, {"change_percent_per_50_hu", p.change_percent}};
    }
    io.out << j.dump(2) << '\n';
    return 0;
  }
  const auto r = [](double v) { return std::lround(v); };
  io.out << "soft tissue " << r(g.soft_tissue_hu) << " HU (noise " << r(g.noise_hu) << "), dense bone " << r(g.dense_bone_hu)
         << " HU; confidence " << std::round(g.confidence * 100) / 100
         << (g.confidence > 0.7   ? " (good)"
             : g.confidence > 0.4 ? " (look at the mask)"
                                  : " (poor: decide by eye)")
         << "\n\npreset     lower HU  volume cm3  changes per 50 HU  for\n";
  static constexpr const char* kFor[] = {"skull vault, jaw, long bones", "mastoid air cells, cancellous bone",
                                         "orbit, sinus walls, tegmen"};
  for (std::size_t n = 0; n < g.presets.size(); ++n) {
    const PresetGuide& p = g.presets[n];
    char line[160];
    std::snprintf(line, sizeof line, "%-10s %-9.0f %-11.1f %-18s %s\n",
                  std::string(EnumNames<BonePreset>::values[static_cast<std::size_t>(p.preset)]).c_str(), p.lower_hu, p.volume_mm3 / 1000,
                  (std::to_string(r(p.change_percent)) + " %").c_str(), kFor[n]);
    io.out << line;
  }
  io.out << "\nosteo prepare " << io.arguments[0] << " -o CASE --preset cellular\n";
  return 0;
}

}  // namespace osteo
