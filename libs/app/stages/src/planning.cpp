#include "planning.h"

#include <algorithm>

#include "osteo/core/base/json_document.h"
#include "osteo/core/data/json_vec.h"

namespace osteo::inline app {

StageInfo PlanReconstructionStage::info() {
  return {
      .name = "plan-reconstruction",
      .version = 1,
      .synopsis = "a resected mandible rebuilt from segments of a fibula",
      .description =
          "From two resection planes: how many straight segments, how long, where the fibula is sawn and where each "
          "segment goes. The target is the healthy side mirrored; the plane of symmetry is found without "
          "landmarks. Reports contour error and contact of each joint. For research and training; no medical "
          "device: vessels, skin, teeth and occlusion are not considered.",
      .inputs = {{"mandible", {DataKind::surface}, "closed surface, before resection"},
                 {"fibula", {DataKind::surface}, "closed surface of the donor bone"}},
      .outputs = {{"plan", {DataKind::document}, "cut planes, fragments and their movements in JSON"},
                  {"findings", {DataKind::document}, "figures of the plan, contour and axes in JSON", true}},
      .references = {"Y. Chen, G. Medioni, Object modelling by registration of multiple range images, Image and "
                     "Vision Computing 1992",
                     "D. Chetverikov et al., The trimmed iterative closest point algorithm, ICPR 2002"},
      .example =
          "osteo plan-reconstruction mandible.stl fibula.stl plan.json --a-mm 12,-60,4 --a-normal 1,0.3,0 "
          "--b-mm 40,-20,8 --b-normal -0.4,-0.9,0"};
}

std::vector<Data> PlanReconstructionStage::run(const Params& params, std::span<const Data> inputs,
                                               const Context& context) {
  const auto bone = [&](std::size_t n) { return compacted(welded(soup_of(*std::get<Surface>(inputs[n])))); };
  const Reconstruction r = reconstruct(bone(0), bone(1), params, context);
  const double contact = *std::min_element(r.contact.begin(), r.contact.end());
  context.report("segments", static_cast<std::int64_t>(r.segments.size()));
  context.report("contour_mean_mm", r.contour_mean_mm);
  context.report("contour_max_mm", r.contour_max_mm);
  context.report("least_contact", contact);
  context.report("donor_used_mm", r.donor_used_mm);
  Json j{{"osteotome_reconstruction", 1},
         {"contour_mean_mm", r.contour_mean_mm},
         {"contour_max_mm", r.contour_max_mm},
         {"contact", r.contact},
         {"wedge_deg", r.wedge_deg},
         {"donor_used_mm", r.donor_used_mm},
         {"donor_thickness_mm", r.donor_thickness_mm}};
  if (r.symmetry)
    j["symmetry"] = {{"at_mm", json_of(r.symmetry->at_mm)},
                     {"normal", json_of(r.symmetry->normal)},
                     {"residual_mm", r.symmetry->residual_mm},
                     {"within_1_mm", r.symmetry->within_1_mm}};
  j["segments"] = Json::list();
  for (const DonorSegment& s : r.segments)
    j["segments"].push_back({{"length_mm", s.length_mm}, {"shortest_mm", s.shortest_mm}, {"from_mm", s.from_mm}});
  j["contour_points_mm"] = Json::list();
  for (const Vec3& p : r.contour_mm) j["contour_points_mm"].push_back(json_of(p));
  j["axis_points_mm"] = Json::list();
  for (const Vec3& p : r.axis_mm) j["axis_points_mm"].push_back(json_of(p));
  return {Document{plan_json(r.plan)}, Document{j.dump(1) + "\n"}};
}

}  // namespace osteo::inline app
