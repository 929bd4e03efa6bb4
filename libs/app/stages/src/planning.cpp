#include "planning.h"

#include <algorithm>
#include <cmath>

#include "osteo/core/base/error.h"
#include "osteo/core/base/json_document.h"
#include "osteo/core/data/json_vec.h"
#include "osteo/core/report/sheet.h"
#include "osteo/session/recording/planned_cuts.h"

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
                 {"fibula", {DataKind::surface}, "closed surface of the donor bone"},
                 {"structures",
                  {DataKind::labels},
                  "named structures of the mandible's CT (nerve, teeth): which of them the resection meets",
                  true}},
      .outputs = {{"plan", {DataKind::document}, "cut planes, fragments and their movements in JSON"},
                  {"findings", {DataKind::document}, "figures of the plan, contour and axes in JSON", true}},
      .references = {"Y. Chen, G. Medioni, Object modelling by registration of multiple range images, Image and "
                     "Vision Computing 1992",
                     "D. Chetverikov et al., The trimmed iterative closest point algorithm, ICPR 2002"},
      .example =
          "osteo plan-reconstruction mandible.stl fibula.stl plan.json --a-mm 12,-60,4 --a-normal 1,0.3,0 "
          "--b-mm 40,-20,8 --b-normal -0.4,-0.9,0"};
}

namespace {

// Before it is done, where the planner looks: what is cut through, and what is nearer to a saw than a hand is steady.
void tell(const PlannedHarm& harm, const Context& context) {
  constexpr double kNearMm = 2;
  for (const StructureAtCut& s : harm.at_cuts) {
    if (s.cut_mm3 > 0)
      context.warn(s.plane + " cuts " + s.structure + " (" + planning::rounded(s.cut_mm3, 1) +
                   " mm\u00b3 in the kerf)");
    else if (s.nearest_mm < kNearMm)
      context.warn(s.plane + " passes " + s.structure + " at " + planning::rounded(s.nearest_mm, 1) + " mm");
  }
  for (const StructureRemoved& s : harm.removed)
    context.info(planning::rounded(100 * s.share, 1) + " % of " + s.structure + " is in what is removed");
}

}  // namespace

std::vector<Data> PlanReconstructionStage::run(const Params& params, std::span<const Data> inputs,
                                               const Context& context) {
  const auto bone = [&](std::size_t n) { return compacted(welded(soup_of(*std::get<Surface>(inputs[n])))); };
  const TriangleSoup jaw = bone(0);
  const Reconstruction r = reconstruct(jaw, bone(1), params, context);
  const double contact = *std::min_element(r.contact.begin(), r.contact.end());
  context.report("segments", static_cast<std::int64_t>(r.segments.size()));
  context.report("contour_mean_mm", r.contour_mean_mm);
  context.report("contour_max_mm", r.contour_max_mm);
  context.report("least_contact", contact);
  context.report("donor_used_mm", r.donor_used_mm);
  PlannedHarm harm;
  if (const auto* const structures = std::get_if<Labels>(&inputs[2])) {
    harm = harm_of(r.plan, "mandible", jaw, *structures);
    tell(harm, context);
  }
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
  j["structures_at_cuts"] = Json::list();
  for (const StructureAtCut& s : harm.at_cuts)
    j["structures_at_cuts"].push_back(
        {{"plane", s.plane}, {"structure", s.structure}, {"nearest_mm", s.nearest_mm}, {"cut_mm3", s.cut_mm3}});
  j["structures_removed"] = Json::list();
  for (const StructureRemoved& s : harm.removed)
    j["structures_removed"].push_back({{"structure", s.structure}, {"mm3", s.mm3}, {"share", s.share}});
  j["contour_points_mm"] = Json::list();
  for (const Vec3& p : r.contour_mm) j["contour_points_mm"].push_back(json_of(p));
  j["axis_points_mm"] = Json::list();
  for (const Vec3& p : r.axis_mm) j["axis_points_mm"].push_back(json_of(p));
  return {Document{plan_json(r.plan)}, Document{j.dump(1) + "\n"}};
}

StageInfo CuttingGuideStage::info() {
  return {
      .name = "cutting-guide",
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
                 {"surface", {DataKind::surface}, "closed surface of the bone that the plan cuts, in the plan's CT"}},
      .outputs = {{"guide", {DataKind::surface}, "closed surface of the guide"},
                  {"findings", {DataKind::document}, "measures of the guide in JSON", true},
                  {"cuts",
                   {DataKind::document},
                   "the same planes for a rehearsal: CASE/planned-cuts.json of a case of this CT, whose saw slips into "
                   "them",
                   true}},
      .references = {"G. Dantzig, Linear Programming and Extensions, Princeton 1963"},
      .example = "osteo cutting-guide plan.json fibula.stl guide.stl --bone fibula --code CASE-7"};
}

namespace {

// The blade's middle is half a kerf from the face that stays; its length lies across the guide's approach. A plan may
// have a kerf of 0, a saw of a rehearsal not: the file would not be read. In an opening that two planes share the blade
// is held against its face, so it has no play.
PlannedCut planned_cut_of(const CutPlane& plane, Vec3 approach, const GuideCut& guide,
                          const CuttingGuideParams& params) {
  constexpr double kThinnestMm = 0.05;
  const double kerf = std::max(plane.kerf_mm, kThinnestMm);
  PlannedCut c;
  c.name = plane.name;
  c.cut.at_mm = plane.at_mm + plane.normal * ((plane.waste_ahead ? 0.5 : -0.5) * kerf);
  c.cut.normal = plane.normal;
  c.cut.along = cross(plane.normal, approach);
  c.cut.kerf_mm = kerf;
  const RigidTransform moved = params.seat == GuideSeat::rocked ? guide.rocked : RigidTransform{};
  c.slot = {moved(guide.slot_at_mm),
            moved.rotation * plane.normal,
            c.within_mm,
            guide.two_sided ? params.play_mm : 0,
            moved.rotation * guide.slot_up_mm,
            guide.slot_length_mm};
  return c;
}

}  // namespace

std::vector<Data> CuttingGuideStage::run(const Params& params, std::span<const Data> inputs, const Context& context) {
  const SurgicalPlan plan = plan_of(std::get<Document>(inputs[0]).json, "the plan");
  const TriangleSoup bone = compacted(welded(soup_of(*std::get<Surface>(inputs[1]))));
  const PrintedGuide g = make_cutting_guide(bone, plan, params, context);
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
                         {"slot_high_mm", length(c.slot_up_mm)},
                         {"slot_long_mm", c.slot_length_mm},
                         {"play_deg", c.play_deg},
                         {"rock_mm", c.rock_mm},
                         {"rock_deg", c.rock_deg}});
  std::vector<PlannedCut> cuts;
  for (const GuideCut& c : g.cuts) cuts.push_back(planned_cut_of(plan.plane(c.plane), g.approach, c, params));
  return {std::make_shared<const TriMesh>(mesh_of(g.solid)), Document{j.dump(1) + "\n"},
          Document{planned_cuts_json(cuts)}};
}

StageInfo OutcomeStage::info() {
  return {
      .name = "outcome",
      .version = 1,
      .synopsis =
          "what came of a plan: fragments, cuts, contour, condyles, screws and plates in a CT after surgery, "
          "with intervals",
      .description =
          "Finds each fragment of a plan in a CT after surgery by the edges of its surface, and each cut face where "
          "the CT shows it. The contour is compared with the plan and with the mirrored side, each condyle with where "
          "the "
          "plan has it. Screws and empty holes of the plan are compared within their fragment, a plate with each "
          "fragment that it lies on. Deviations are from the plan, with the largest fragment that stays as the "
          "reference, each "
          "with a 95 % interval. What the CT does not show is not known, with the reason: a face that lies upon "
          "other bone, a fragment under metal, screws that merge. The CT must lie within about 20 mm and 12 degrees of "
          "the plan's; "
          "'register' brings it there. For research and training; no medical device.",
      .inputs =
          {{"plan", {DataKind::document}, "plan file"},
           {"postop", {DataKind::image}, "CT after surgery"},
           {"bone", {DataKind::surface}, "closed surface of the bone that the plan names first, in the plan's CT"},
           {"donor",
            {DataKind::surface},
            "closed surface of the plan's other bone, of which it takes segments or against which all is measured",
            true},
           {"plate",
            {DataKind::surface},
            "closed surface of a metal plate where the plan has it: in the plan's CT, on the fragments as wanted",
            true}},
      .outputs = {{"outcome", {DataKind::document}, "deviations and intervals in JSON"},
                  {"page", {DataKind::document}, "one page to print, in HTML", true}},
      .references =
          {"J. MacKinnon, H. White, Some heteroskedasticity-consistent covariance matrix estimators with improved "
           "finite sample properties, Journal of Econometrics 1985",
           "D. Chetverikov et al., The trimmed iterative closest point algorithm, ICPR 2002"},
      .example =
          "osteo outcome plan.json after.nrrd mandible.stl outcome.json --donor fibula.stl --page-out outcome.html"};
}

namespace {

Json json_of(const Interval95& m) {
  return {{"value", m.value}, {"half_width_95", m.half}};
}

template <std::size_t N>
Json json_of(const std::array<Interval95, N>& all) {
  Json j = Json::list();
  for (const Interval95& m : all) j.push_back(json_of(m));
  return j;
}

Json json_of(const ScrewOutcome& s) {
  Json one{{"name", s.name},           {"fragment", s.fragment}, {"empty", s.empty},
           {"found", s.found},         {"known", s.known},       {"direction_known", s.direction_known},
           {"tip_known", s.tip_known}, {"seen", s.seen}};
  if (!s.why.empty()) one["why"] = s.why;
  if (!s.finding.empty()) one["finding"] = s.finding;
  if (!(s.slides_along == Vec3{})) one["slides_along"] = osteo::json_of(s.slides_along);
  if (s.known) one["entry_mm"] = json_of(s.entry_mm);
  if (s.tip_known) one["tip_mm"] = json_of(s.tip_mm);
  if (s.direction_known) {
    one["tilt_deg"] = json_of(s.tilt_deg);
    one["tilt_towards"] = Json::list();
    for (const Vec3& a : s.axes) one["tilt_towards"].push_back(osteo::json_of(a));
    one["angle_deg"] = s.angle_deg;
  }
  return one;
}

// Of a fragment, a plate or a condyle.
void add_pose(Json& to, const FragmentOutcome& f) {
  if (!(f.slides_along == Vec3{})) to["slides_along"] = osteo::json_of(f.slides_along);
  to["shift_mm"] = json_of(f.shift_mm);
  to["turn_deg"] = json_of(f.turn_deg);
}

Json json_of(const ContourOutcome& c) {
  Json one{{"against", c.against}, {"known", c.known}};
  if (!c.known) {
    one["why"] = c.why;
    return one;
  }
  one["mean_mm"] = json_of(c.mean_mm);
  one["p95_mm"] = json_of(c.p95_mm);
  one["planned_mean_mm"] = c.planned_mean_mm;
  one["planned_p95_mm"] = c.planned_p95_mm;
  return one;
}

Json json_of(const CondyleOutcome& c) {
  Json one{{"side", c.side}, {"fragment", c.pose.name}, {"known", c.pose.known}};
  if (!c.pose.known) {
    one["why"] = c.pose.why;
    return one;
  }
  one["middle_mm"] = osteo::json_of(c.pose.middle_mm);
  add_pose(one, c.pose);
  return one;
}

Json outcome_json(const Outcome& o) {
  Json j{{"osteotome_outcome", 1}, {"intended_use", "research, teaching and rehearsal; not a medical device"}};
  j["fragments"] = Json::list();
  for (const FragmentOutcome& f : o.fragments) {
    Json one{{"name", f.name}, {"known", f.known}, {"reference", f.reference}, {"found", f.found}};
    if (!f.known) one["why"] = f.why;
    if (f.known) {
      one["middle_mm"] = osteo::json_of(f.middle_mm);
      one["edge_rms_mm"] = f.edge_mm;
      if (!f.reference) add_pose(one, f);
    }
    j["fragments"].push_back(std::move(one));
  }
  j["cuts"] = Json::list();
  for (const CutOutcome& c : o.cuts) {
    Json one{{"plane", c.plane}, {"fragment", c.fragment}, {"known", c.known}, {"seen", c.seen}};
    if (!c.known) one["why"] = c.why;
    if (c.known) {
      one["off_mm"] = json_of(c.off_mm);
      one["tilt_deg"] = json_of(c.tilt_deg);
      one["tilt_along"] = Json::list();
      for (const Vec3& a : c.axes) one["tilt_along"].push_back(osteo::json_of(a));
      one["angle_deg"] = c.angle_deg;
    }
    j["cuts"].push_back(std::move(one));
  }
  j["contours"] = Json::list();
  for (const ContourOutcome& c : o.contours) j["contours"].push_back(json_of(c));
  j["condyles"] = Json::list();
  for (const CondyleOutcome& c : o.condyles) j["condyles"].push_back(json_of(c));
  if (!o.screws.empty()) j["screws"] = Json::list();
  for (const ScrewOutcome& s : o.screws) j["screws"].push_back(json_of(s));
  if (!o.plates.empty()) j["plates"] = Json::list();
  for (const PlateOutcome& p : o.plates) {
    Json one{{"name", p.pose.name}, {"against", p.against}, {"known", p.pose.known}, {"found", p.pose.found}};
    if (!p.pose.known) one["why"] = p.pose.why;
    if (p.pose.known) {
      one["middle_mm"] = osteo::json_of(p.pose.middle_mm);
      add_pose(one, p.pose);
    }
    j["plates"].push_back(std::move(one));
  }
  return j;
}

std::string text_of(const Interval95& m) {
  return planning::rounded(m.value, 2) + " \u00b1 " + planning::rounded(m.half, 2);
}

std::string text_of(const std::array<Interval95, 3>& all) {
  return text_of(all[0]) + "; " + text_of(all[1]) + "; " + text_of(all[2]);
}

sheet::Cell plain(std::string text) {
  return {std::move(text), Tone::plain};
}
sheet::Cell not_known(const std::string& why) {
  return {"not known: " + why, Tone::caution};
}

sheet::Table contours_table(const std::vector<ContourOutcome>& contours) {
  sheet::Table t{
      {"Contour against", "mean (mm)", "95 % within (mm)", "as planned: mean, 95 % (mm)"}, {}, {0.22, 0.24, 0.24, 0.3}};
  for (const ContourOutcome& c : contours) {
    if (c.known)
      t.rows.push_back(
          {plain("the " + c.against), plain(text_of(c.mean_mm)), plain(text_of(c.p95_mm)),
           plain(planning::rounded(c.planned_mean_mm, 2) + "; " + planning::rounded(c.planned_p95_mm, 2))});
    else
      t.rows.push_back({plain("the " + c.against), not_known(c.why), plain(""), plain("")});
  }
  return t;
}

sheet::Table condyles_table(const std::vector<CondyleOutcome>& condyles) {
  sheet::Table t{{"Condyle", "shift x, y, z (mm)", "turn x, y, z (degrees)"}, {}, {0.3, 0.35, 0.35}};
  for (const CondyleOutcome& c : condyles) {
    std::string name = c.side + (c.pose.name.empty() ? "" : " (" + c.pose.name + ")");
    if (!(c.pose.slides_along == Vec3{})) name += " (not known along its fragment)";
    if (c.pose.known)
      t.rows.push_back({plain(name), plain(text_of(c.pose.shift_mm)), plain(text_of(c.pose.turn_deg))});
    else
      t.rows.push_back({plain(name), not_known(c.pose.why), plain("")});
  }
  return t;
}

sheet::Table screws_table(const std::vector<ScrewOutcome>& screws) {
  sheet::Table t{{"Screw", "entry x, y, z (mm)", "tip x, y, z (mm)", "tilt (degrees)"}, {}, {0.16, 0.32, 0.32, 0.2}};
  for (const ScrewOutcome& s : screws) {
    std::string name = s.name + (s.empty ? " (empty hole)" : "");
    if (!(s.slides_along == Vec3{})) name += " (not known along its fragment)";
    if (!s.finding.empty()) name += " (" + s.finding + ")";
    if (!s.found || !(s.known || s.tip_known || s.direction_known)) {
      t.rows.push_back({plain(name), s.found ? not_known(s.why) : sheet::Cell{"not found: " + s.why, Tone::caution},
                        plain(""), plain("")});
      continue;
    }
    t.rows.push_back(
        {plain(name), s.known ? plain(text_of(s.entry_mm)) : not_known(s.why),
         s.tip_known ? plain(text_of(s.tip_mm)) : not_known(s.why),
         s.direction_known ? plain(text_of(s.tilt_deg[0]) + "; " + text_of(s.tilt_deg[1])) : not_known(s.why)});
  }
  return t;
}

sheet::Table plates_table(const std::vector<PlateOutcome>& plates) {
  sheet::Table t{{"Plate", "shift x, y, z (mm)", "turn x, y, z (degrees)"}, {}, {0.3, 0.35, 0.35}};
  for (const PlateOutcome& p : plates) {
    const bool slides = !(p.pose.slides_along == Vec3{});
    const std::string name = p.pose.name + " against " + p.against + (slides ? " (not known along it)" : "");
    if (p.pose.known)
      t.rows.push_back({plain(name), plain(text_of(p.pose.shift_mm)), plain(text_of(p.pose.turn_deg))});
    else
      t.rows.push_back({plain(name), not_known(p.pose.why), plain("")});
  }
  return t;
}

std::string outcome_page(const Outcome& o) {
  Sheet s;
  s.title = "Outcome against the plan";
  s.footer = "Osteotome. Research, teaching and rehearsal; not a medical device.";
  s.pages = 1;
  const auto cell = [](std::string text, Tone tone = Tone::plain) { return sheet::Cell{std::move(text), tone}; };
  sheet::Table fragments{{"Fragment", "shift x, y, z (mm)", "turn x, y, z (degrees)"}, {}, {0.3, 0.35, 0.35}};
  for (const FragmentOutcome& f : o.fragments) {
    std::vector<sheet::Cell> row{cell(f.name)};
    if (!f.known) {
      row.push_back(cell("not known: " + f.why, Tone::caution));
      row.push_back(cell(""));
    } else if (f.reference) {
      row.push_back(cell("reference"));
      row.push_back(cell("reference"));
    } else {
      for (const auto& all : {f.shift_mm, f.turn_deg})
        row.push_back(cell(text_of(all[0]) + "; " + text_of(all[1]) + "; " + text_of(all[2])));
      if (!(f.slides_along == Vec3{})) row[0].text += " (not known along itself)";
    }
    fragments.rows.push_back(std::move(row));
  }
  sheet::Table cuts{{"Cut", "off the plan (mm)", "tilt (degrees)"}, {}, {0.3, 0.35, 0.35}};
  for (const CutOutcome& c : o.cuts) {
    if (c.known)
      cuts.rows.push_back(
          {cell(c.plane), cell(text_of(c.off_mm)), cell(text_of(c.tilt_deg[0]) + "; " + text_of(c.tilt_deg[1]))});
    else
      cuts.rows.push_back({cell(c.plane), cell("not known: " + c.why, Tone::caution), cell("")});
  }
  s.blocks.push_back({sheet::Paragraph{
      "Value and half-width of the 95 % interval. x: to the patient's left, y: to the back, z: to the head. A cut is "
      "off by more than 0 where the face lies further towards what was removed. Not known along itself: the surface of "
      "a "
      "shaft does not show how far it is shifted along its axis; the shift is what lies across."}});
  s.blocks.push_back({sheet::Heading{"Fragments"}});
  s.blocks.push_back({std::move(fragments)});
  s.blocks.push_back({sheet::Heading{"Cuts"}});
  s.blocks.push_back({std::move(cuts)});
  s.blocks.push_back({sheet::Heading{"Contour"}});
  s.blocks.push_back({contours_table(o.contours)});
  s.blocks.push_back({sheet::Paragraph{
      "How far the surface of what the plan moves is from where the plan has it; how far the lower border of the "
      "mirrored side is from the axes of the segments that rebuild it. A mirrored side is no truth of how the bone "
      "was."}});
  s.blocks.push_back({sheet::Heading{"Condyles"}});
  s.blocks.push_back({condyles_table(o.condyles)});
  if (!o.screws.empty()) {
    s.blocks.push_back({sheet::Heading{"Screws"}});
    s.blocks.push_back({screws_table(o.screws)});
    s.blocks.push_back({sheet::Paragraph{
        "Relative to the fragment that a screw is in. Entry: where its axis passes the planned place of entry, across "
        "the planned axis."}});
  }
  if (!o.plates.empty()) {
    s.blocks.push_back({sheet::Heading{"Plate"}});
    s.blocks.push_back({plates_table(o.plates)});
  }
  return sheet_html(s);
}

}  // namespace

std::vector<Data> OutcomeStage::run(const Params& params, std::span<const Data> inputs, const Context& context) {
  SurgicalPlan plan = plan_of(std::get<Document>(inputs[0]).json, "the plan");
  if (plan.planes.empty()) throw Error(ExitCode::usage, "the plan has no plane", "give a plan with cuts");
  std::vector<std::pair<std::string, TriangleSoup>> bones;
  const auto add = [&](const std::string& name, const Data& data) {
    if (const auto* s = std::get_if<Surface>(&data)) bones.emplace_back(name, compacted(welded(soup_of(**s))));
  };
  const std::string& first = plan.planes.front().bone;
  add(first, inputs[2]);
  const auto add_other = [&](const std::string& bone) {
    if (bone != first && bones.size() == 1) add(bone, inputs[3]);
  };
  for (const CutPlane& p : plan.planes) add_other(p.bone);
  for (const PlannedFragment& f : plan.fragments) add_other(f.bone);
  if (const auto* plate = std::get_if<Surface>(&inputs[4]))
    plan.plates.push_back({"plate", compacted(welded(soup_of(**plate)))});
  const Outcome o = measure_outcome(plan, bones, std::get<Image>(inputs[1]), params, context);
  std::int64_t fragments = 0, cuts = 0;
  for (const FragmentOutcome& f : o.fragments) fragments += f.known ? 1 : 0;
  for (const CutOutcome& c : o.cuts) cuts += c.known ? 1 : 0;
  context.report("fragments_known", fragments);
  context.report("fragments", static_cast<std::int64_t>(o.fragments.size()));
  context.report("cuts_known", cuts);
  context.report("cuts", static_cast<std::int64_t>(o.cuts.size()));
  const auto known = [](const auto& all, auto&& is) { return std::count_if(all.begin(), all.end(), is); };
  if (!o.screws.empty()) {
    context.report("screws_known", static_cast<std::int64_t>(known(o.screws, [](const auto& s) { return s.known; })));
    context.report("screws", static_cast<std::int64_t>(o.screws.size()));
  }
  if (!o.plates.empty())
    context.report("plate_known",
                   static_cast<std::int64_t>(known(o.plates, [](const auto& p) { return p.pose.known; })));
  return {Document{outcome_json(o).dump(1) + "\n"}, Document{outcome_page(o)}};
}

}  // namespace osteo::inline app
