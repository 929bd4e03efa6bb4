#include "distance.h"

#include "osteo/core/base/json_document.h"
#include "osteo/geometry/distance/compare.h"
#include "osteo/geometry/distance/solid.h"
#include "osteo/geometry/grid/brick_grid.h"
#include "osteo/geometry/mesh/bone_surface.h"

namespace osteo::inline app {
namespace {

TriangleSoup soup_from(const Data& data, double iso, const Context& context) {
  if (const auto* surface = std::get_if<Surface>(&data)) return soup_of(**surface);
  if (const auto* tets = std::get_if<Tets>(&data)) return soup_of(boundary_of(**tets));
  return soup_of(surface_nets(to_bricks(std::get<SparseGrid>(data)), static_cast<float>(iso), context).mesh);
}

}  // namespace

StageInfo CompareStage::info() {
  return {
      .name = "compare",
      .version = 2,
      .synopsis = "how far apart two surfaces, grids or tetrahedral meshes are",
      .description =
          "Distances from each surface to the other: mean, RMS and 95th percentile over area, and the maximum "
          "(Hausdorff) "
          "with a bound that it cannot exceed. Enclosed volumes. A grid stands for its isosurface, tetrahedra for "
          "their boundary.",
      .inputs = {{"a", {DataKind::surface, DataKind::tets, DataKind::grid}, "one surface"},
                 {"b", {DataKind::surface, DataKind::tets, DataKind::grid}, "the other"}},
      .outputs = {{"findings", {DataKind::document}, "the figures in JSON"}},
      .references = {"P. Cignoni et al., Metro: measuring error on simplified surfaces, Computer Graphics Forum 1998"},
      .example = "osteo compare bone.ply repaired.ply difference.json"};
}

std::vector<Data> CompareStage::run(const Params& params, std::span<const Data> inputs, const Context& context) {
  const TriangleSoup a = soup_from(inputs[0], params.iso, context), b = soup_from(inputs[1], params.iso, context);
  const SurfaceComparison c = compare_surfaces(a, b, context);
  Json j;
  const auto put = [&](const std::string& key, double value) {
    j[key] = value;
    context.report(key, value);
  };
  put("hausdorff_mm", c.hausdorff_mm());
  put("hausdorff_bound_mm", c.hausdorff_bound_mm());
  for (const auto& [name, d] : {std::pair{"a_to_b", &c.a_to_b}, std::pair{"b_to_a", &c.b_to_a}}) {
    const std::string p = std::string(name) + "_";
    put(p + "mean_mm", d->mean_mm);
    put(p + "rms_mm", d->rms_mm);
    put(p + "p95_mm", d->p95_mm);
    put(p + "max_mm", d->max_mm);
    j[p + "worst_point_mm"] = {d->worst_mm.x, d->worst_mm.y, d->worst_mm.z};
    j[p + "samples"] = d->samples;
  }
  for (const auto& [name, s] : {std::pair{"a", &a}, std::pair{"b", &b}}) {
    // By the rule of all stages: as it is where it closes, else with neighbours made to agree.
    TriangleSoup closed = welded(*s);
    if (!is_closed(closed)) closed = ordered(*s, context).soup;
    if (is_closed(closed)) put(std::string(name) + "_volume_mm3", inside_volume_mm3(closed, context));
  }
  return {Document{j.dump(2) + "\n"}};
}

}  // namespace osteo::inline app
