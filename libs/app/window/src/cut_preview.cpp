#include "cut_preview.h"

#include <algorithm>
#include <cmath>

#include "osteo/core/base/param.h"
#include "osteo/core/base/translate.h"

namespace osteo::inline app {
namespace {

bool same(const SawCut& a, const SawCut& b) {
  return a.at_mm == b.at_mm && a.normal == b.normal && a.along == b.along && a.kerf_mm == b.kerf_mm &&
         a.length_mm == b.length_mm && a.depth_mm == b.depth_mm;
}

}  // namespace

void CutPreview::look(const World& world, const StructureMap* structures, const SawCut& cut, double now_s) {
  if (structures == nullptr) return clear();
  const bool other = !last_ || !same(*last_, cut);
  if (now_s - looked_s_ < (other ? kEveryS : kAgainS)) return;
  last_ = cut;
  looked_s_ = now_s;
  cuts_ = false;
  text_.clear();
  const std::optional<SawCut> blade = blade_at_work(world, cut, voxels_sawn(world, cut));
  if (!blade) return;
  const std::vector<StructureCut> near = structures_cut(*structures, *blade);
  if (const std::string reported = reported_structures_cut(*structures, near); !reported.empty()) {
    cuts_ = true;
    text_ = filled(tr("would cut {what}"), {{"what", reported}});
    return;
  }
  const auto nearest = std::min_element(near.begin(), near.end(), [](const StructureCut& a, const StructureCut& b) {
    return a.distance_mm < b.distance_mm;
  });
  text_ = nearest == near.end()
              ? tr("no structure within 5 mm")
              : filled(tr("nearest: the {structure}, {mm} mm"),
                       {{"structure", tr(structures->name_of(nearest->structure))},
                        {"mm", shown_figures(format_number(std::round(nearest->distance_mm * 10) / 10))}});
}

void CutPreview::clear() {
  *this = {};
}

}  // namespace osteo::inline app
