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

StageInfo CuttingGuideStage::info() {
  return {.name = "cutting-guide",
          .version = 1,
          .synopsis = "a cutting guide to print, from a plan and the bone",
          .description =
              "A block that fits the bone in one place, with a slot for each planned plane. Its underside is the "
              "bone's offset surface as seen from where the guide comes from, so that nothing catches; its top is "
              "flat, to be printed on. Slots that would run into each other share an opening whose two faces lead "
              "the saw. Reports the gap by exact distances, an exact sweep of putting it on, and how far its play "
              "lets each plane rock. For research and training; no medical device: a guide for a named patient is "
              "a custom-made device under its own law.",
          .inputs = {{"plan", {DataKind::document}, "plan file of 'plan-reconstruction', or written by hand"},
                     {"bone", {DataKind::surface}, "closed surface of the bone that the plan cuts, in the plan's CT"}},
          .outputs = {{"guide", {DataKind::surface}, "closed surface of the guide"},
                      {"findings", {DataKind::document}, "measures of the guide in JSON", true}},
          .references = {"G. Dantzig, Linear Programming and Extensions, Princeton 1963"},
          .example = "osteo cutting-guide plan.json fibula.stl guide.stl --bone fibula --code CASE-7"};
}

std::vector<Data> CuttingGuideStage::run(const Params& params, std::span<const Data> inputs, const Context& context) {
  const SurgicalPlan plan = plan_of(std::get<Document>(inputs[0]).json, "the plan");
  const TriangleSoup bone = compacted(welded(soup_of(*std::get<Surface>(inputs[1]))));
  const CuttingGuide g = make_cutting_guide(bone, plan, params, context);
  context.report("cuts", static_cast<std::int64_t>(g.cuts.size()));
  context.report("min_gap_mm", g.min_gap_mm);
  context.report("seat_mm2", g.seat_mm2);
  context.report("seat_off_mm", g.seat_off_mm);
  context.report("insertion_clearance_mm", g.insertion_mm);
  Json j{{"osteotome_cutting_guide", 1},
         {"intended_use", "research, teaching and rehearsal; not a medical device"},
         {"approach", json_of(g.approach)},
         {"along", json_of(g.along)},
         {"size_mm", Json{g.length_mm, g.width_mm, g.height_mm}},
         {"gap_mm", params.gap_mm},
         {"min_gap_mm", g.min_gap_mm},
         {"seat_mm2", g.seat_mm2},
         {"seat_off_mm", g.seat_off_mm},
         {"insertion_clearance_mm", g.insertion_mm},
         {"engraved", g.engraved}};
  j["cuts"] = Json::list();
  for (const GuideCut& c : g.cuts)
    j["cuts"].push_back({{"plane", c.plane},
                         {"two_sided", c.two_sided},
                         {"width_mm", c.width_mm},
                         {"rock_mm", c.rock_mm},
                         {"rock_deg", c.rock_deg}});
  return {std::make_shared<const TriMesh>(mesh_of(g.solid)), Document{j.dump(1) + "\n"}};
}

}  // namespace osteo::inline app
