#include "register.h"

#include "osteo/core/base/json_document.h"

namespace osteo::inline app {

StageInfo RegisterStage::info() {
  return {
      .name = "register",
      .version = 2,
      .synopsis = "a second scan (CT after, MR) brought onto the case's, as a rigid body",
      .description =
          "Finds the turn and shift by which a second scan of the same head lies on the first, from wherever its "
          "file puts it, turned by "
          "up "
          "to 40 degrees. It is rejected, with the reason, where edges of the two do not meet (another patient, the "
          "other side), less than "
          "a "
          "quarter of the smaller scan lies in the other, or registering back by itself leads elsewhere. The "
          "residual is the distance "
          "between like edges along their normals: blur and thresholds are in it, sliding along a smooth surface "
          "is not. Look at the "
          "checkerboard. The transform is for 3D Slicer and ITK, LPS mm, from the first scan to the second.",
      .inputs = {{"first", {DataKind::image}, "the scan that stays, the case's"},
                 {"second", {DataKind::image}, "the scan that is brought onto it"},
                 {"labels", {DataKind::labels}, "label map of the second scan, to be carried over", true}},
      .outputs = {{"transform", {DataKind::document}, "ITK transform (.tfm)"},
                  {"findings", {DataKind::document}, "transform and residual in JSON", true, ".json"},
                  {"moved",
                   {DataKind::image},
                   "the second scan on the first's voxels, trilinear; outside it its least value",
                   true},
                  {"labels", {DataKind::labels}, "the labels on the first's voxels, of the nearest voxel", true},
                  {"checkerboard", {DataKind::picture}, "three cuts in squares of the one and the other", true}},
      .references = {"C. Studholme et al., An overlap invariant entropy measure of 3D medical image alignment, "
                     "Pattern Recognition 1999",
                     "Y. Chen, G. Medioni, Object modelling by registration of multiple range images, Image and "
                     "Vision Computing 1992",
                     "D. Chetverikov et al., The trimmed iterative closest point algorithm, ICPR 2002"},
      .example =
          "osteo register before.nrrd after.nrrd after.tfm --moved-out after-on-before.nrrd --checkerboard-out "
          "check.png"};
}

std::vector<Data> RegisterStage::run(const Params& params, std::span<const Data> inputs, const Context& context) {
  const auto &first = std::get<Image>(inputs[0]), &second = std::get<Image>(inputs[1]);
  const Registration r = register_scans(first, second, params, context);
  Json j{{"osteotome_registration", 1},
         {"method", EnumNames<RegisterMethod>::values[static_cast<std::size_t>(params.method)]}};
  const auto& m = r.second_from_first;
  Json rows = Json::list();
  for (std::size_t row = 0; row < 3; ++row)
    rows.push_back(Json(
        Json::List{m.rotation.column[0][row], m.rotation.column[1][row], m.rotation.column[2][row], m.shift_mm[row]}));
  j["second_from_first_lps_mm"] = std::move(rows);
  j["rotation_deg"] = r.rotation_deg;
  j["shift_at_centre_mm"] = r.shift_mm;
  j["overlap"] = r.overlap;
  j["edges"] = {{"points", r.residual.points},
                {"found", r.residual.found},
                {"median_mm", r.residual.median_mm},
                {"p90_mm", r.residual.p90_mm},
                {"shift_mm", r.residual.shift_mm}};
  j["inverse_consistency_mm"] = r.inverse_mm;
  if (params.method == RegisterMethod::surface)
    j["surface"] = {{"mean_mm", r.surface_mean_mm},
                    {"p95_mm", r.surface_p95_mm},
                    {"shape_mean_mm", r.surface_shape_mm},
                    {"boundary_shift_mm", r.boundary_shift_mm}};
  std::vector<Data> out{Document{itk_transform_text(m)}, Document{j.dump(2) + "\n"},
                        moved_onto(first.frame, second, m, context), std::monostate{}, checkerboard(first, second, m)};
  if (const auto* labels = std::get_if<Labels>(&inputs[2])) out[3] = moved_onto(first.frame, *labels, m, context);
  return out;
}

}  // namespace osteo::inline app
