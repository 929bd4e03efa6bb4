#include "osteo/assessment/evidence/metric.h"

#include <algorithm>

#include "osteo/core/base/error.h"

namespace osteo::inline assessment {
namespace {

constexpr Better kUp = Better::higher, kDown = Better::lower, kNone = Better::neither;
constexpr std::string_view kThesis351 = "Morris 2006, 3.5.1", kThesis352 = "Morris 2006, 3.5.2", kThesis353 = "Morris 2006, 3.5.3",
                           kProcess = "after Wan 2010, UWO thesis", kOurs = "this project", kStroke = "after FIVRS, mended",
                           kSmooth = "Balasubramanian 2015", kHeat = "docs/heat.md";

// The one declaration of each.
constexpr MetricRow kTable[] = {
    {"duration_s", "s", kDown, "", kProcess, "time that is known of the session"},
    {"lost_s", "s", kDown, "", kOurs, "time that was not recorded"},
    {"drilling_s", "s", kNone, "", kProcess, "a burr turns (over 1000 rpm) and presses on bone"},
    {"idle_s", "s", kDown, "", kOurs, "no pedal down and no hand faster than 2 mm/s, for a second or longer"},
    {"removed_mm3", "mm3", kNone, "", kProcess, "bone taken by burrs, what was taken back too"},
    {"sawn_mm3", "mm3", kNone, "", kOurs, "bone taken by saws"},
    {"rate_mm3_per_s", "mm3/s", kUp, "", kOurs, "removed for each second of drilling"},
    {"path_mm", "mm", kDown, "", kProcess, "way of the first hand's tip, from 100 places a second"},
    {"work_mj", "mJ", kNone, "", kOurs, "what the hands put in against the force"},
    {"instrument_s", "s", kNone, "", kProcess, "time an instrument is in the first hand"},
    {"instrument_mm3", "mm3", kNone, "", kProcess, "bone an instrument has taken"},
    {"camera_moves", "1", kNone, "camera", kProcess, "how often the view began to change"},
    {"camera_s", "s", kNone, "camera", kProcess, "time in which the view changed"},
    {"force_median_n", "N", kNone, "", kProcess, "burr on bone while drilling, the middle"},
    {"force_p95_n", "N", kDown, "", kProcess, "burr on bone while drilling, exceeded in 5 % of the time"},
    {"force_peak_n", "N", kDown, "", kProcess, "burr on bone while drilling, the most"},
    {"suction_share", "1", kUp, "", kProcess, "of drilling, with a sucker at work"},
    {"irrigation_share", "1", kUp, "", kProcess, "of drilling, with water"},
    {"burr_side_share", "1", kUp, "", kProcess,
     "of drilling, the shaft 30 to 90 degrees off the force: the burr's side works"},
    {"strokes", "1", kNone, "", kStroke,
     "of the first hand's burr: at least 1 mm and 80 ms between turns of 60 degrees"},
    {"strokes_per_s", "1/s", kNone, "", kStroke, "for each second of drilling"},
    {"stroke_mm", "mm", kNone, "", kStroke, "length of a stroke, the middle"},
    {"stroke_s", "s", kNone, "", kStroke, "time of a stroke, the middle"},
    {"stroke_variance", "1", kDown, "", kStroke,
     "how little five strokes in a row follow one line: 0 one line, 2/3 all directions"},
    {"stroke_sparc", "1", kUp, "", kSmooth,
     "spectral arc length of a stroke's speed, the middle of those of 100 ms; nearer to 0 is smoother"},
    {"stroke_ldlj", "1", kUp, "", kSmooth, "log dimensionless jerk of the same; nearer to 0 is smoother"},
    {"phase_s", "s", kNone, "", kStroke, "time for each fifth of the volume"},
    {"step_s", "s", kNone, "structures, procedure", kOurs,
     "time for each step of the procedure, by where the burr drills"},
    {"seen_share", "1", kUp, "camera", kThesis351, "of removed bone, by volume, seen when it went"},
    {"hidden_mm3", "mm3", kDown, "camera", kThesis351, "removed unseen"},
    {"sight_unknown_mm3", "mm3", kNone, "camera", kThesis351, "removed before the first camera note"},
    {"hidden_near_mm3", "mm3", kDown, "camera, structures", kThesis351, "removed unseen within 2 mm of a structure"},
    {"clearance_mm", "mm", kUp, "structures", kProcess, "least distance of a burr's surface; negative inside"},
    {"touches", "1", kDown, "structures", kProcess, "how often a burr reached it"},
    {"touched_s", "s", kDown, "structures", kProcess, "how long"},
    {"injured_s", "s", kDown, "structures", kProcess, "how long while it turned"},
    {"cut_mm3", "mm3", kDown, "structures", kOurs, "of it, in the path of cuts by a plane"},
    {"saw_clearance_mm", "mm", kUp, "structures", kOurs,
     "least distance of a cut by a plane, where it is below 5 mm and none went through it"},
    {"near_s", "s", kNone, "structures", kProcess, "drilling within 2 mm of it"},
    {"near_mm3", "mm3", kNone, "structures", kProcess, "bone taken with the burr within 2 mm of it"},
    {"near_05_s", "s", kNone, "structures", kProcess, "drilling within 0.5 mm of it"},
    {"near_05_mm3", "mm3", kNone, "structures", kProcess, "bone taken with the burr within 0.5 mm of it"},
    {"near_1_s", "s", kNone, "structures", kProcess, "drilling within 1 mm of it"},
    {"near_1_mm3", "mm3", kNone, "structures", kProcess, "bone taken with the burr within 1 mm of it"},
    {"near_4_s", "s", kNone, "structures", kProcess, "drilling within 4 mm of it"},
    {"near_4_mm3", "mm3", kNone, "structures", kProcess, "bone taken with the burr within 4 mm of it"},
    {"excess_force_ns", "N s", kDown, "structures, procedure", kProcess, "impulse above the procedure's limit near it"},
    {"burr_choice_share", "1", kUp, "structures, procedure", kProcess,
     "of drilling where a rule on burrs holds, with an allowed one"},
    {"target_share", "1", kUp, "structures, procedure", kOurs, "of a target region's bone, gone"},
    {"forbidden_mm3", "mm3", kDown, "structures, procedure", kOurs, "bone of a forbidden region that is gone"},
    {"outside_target_mm3", "mm3", kDown, "structures, procedure", kProcess,
     "removed bone that lies in no target region"},
    {"cavity_mm3", "mm3", kNone, "structures, procedure", kOurs,
     "that a ball of 0.5 mm reaches now and did not before"},
    {"items_passed", "1", kUp, "structures, procedure", kOurs, "of the scale"},
    {"heat_bone_c", "C", kDown, "heat", kHeat, "the warmest that bone became; known within a factor of ten at best"},
    {"heat_peak_c", "C", kDown, "heat, structures", kHeat, "the warmest that the structure's face became"},
    {"heat_cem43_min", "min", kDown, "heat, structures", kHeat, "dose at its face, in minutes at 43 C; 16 harm bone"},
    {"force_above_band_share", "1", kDown, "structures, reference", kThesis352,
     "of drilling near it, pressing harder than 90 % of experts do at that distance"},
    {"speed_above_band_share", "1", kDown, "structures, reference", kThesis352,
     "of drilling near it, faster than 90 % of experts are at that distance"},
    {"region_log_ratio", "1", kUp, "reference", kThesis353,
     "log of how much more likely experts would have left the bone so; Laplace, kept voxels too"},
    {"region_per_voxel", "1", kUp, "reference", kThesis353, "the same for each voxel that decides"},
    {"region_voxels", "1", kNone, "reference", kThesis353, "effective number of these"},
    {"region_thesis", "1", kUp, "reference", kThesis353, "as printed there: removed voxels only"},
};

}  // namespace

std::string_view name_of(Better better) {
  return better == Better::higher ? "higher" : better == Better::lower ? "lower" : "neither";
}

std::span<const MetricRow> metric_table() {
  return kTable;
}

const MetricRow& metric_row(std::string_view name) {
  const auto row = std::find_if(std::begin(kTable), std::end(kTable), [&](const MetricRow& r) { return r.name == name; });
  if (row == std::end(kTable)) throw Error(ExitCode::unspecified, "metric '" + std::string(name) + "' is not declared");
  return *row;
}

Measured measured(std::string_view name, double value, std::string of) {
  return {&metric_row(name), std::move(of), value, {}};
}

Measured not_measured(std::string_view name, std::string why, std::string of) {
  return {&metric_row(name), std::move(of), std::nullopt, std::move(why)};
}

}  // namespace osteo::assessment
