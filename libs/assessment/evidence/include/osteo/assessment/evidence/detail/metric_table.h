// The one table of metrics: name, unit, direction, what it needs, who computes it, where it is from, what it is.
#pragma once
#include <span>
#include <string_view>

namespace osteo::inline assessment {

enum class Better { higher, lower, neither };

/// The class or function that computes a metric: the only one that names it.
enum class MetricPlace {
  process,    ///< ProcessMetric
  steps,      ///< StepClock
  sight,      ///< VisibilityMetric
  near,       ///< NearMetric
  saw,        ///< CutMetric
  product,    ///< score_session, from Product
  reference,  ///< score_session, from Reference
  heat,       ///< heat_values (library scene)
  plan,       ///< planned_cut_values
};
/// What has to be there for a value. What is missing is missing for all metrics of a place that need it:
/// not_measured_all().
enum class MetricWhen {
  always,
  some,           ///< told only where there is some: never "not measured"
  camera,         ///< camera notes
  structures,     ///< structures of the case
  procedure,      ///< a procedure that asks for it
  drilling,       ///< a burr that drilled
  stroke,         ///< a stroke
  smooth_stroke,  ///< a stroke long enough for its smoothness
  removal,        ///< bone that was removed
  bands,          ///< a reference with samples near structures
  regions,        ///< a reference with experts and novices
  planned,        ///< a planned cut that was made
};

/// The declaration of a metric: all that lines, columns, JSON and the table in docs/validation/evidence.md need to know
/// of it.
struct MetricRow {
  std::string_view name;  ///< lower case; unit at its end where it has one
  std::string_view unit;  ///< "1": a share or a count
  Better better;
  std::string_view needs;  ///< "": nothing but the ticks; else "camera", "structures", "procedure",
                           ///< "planned cuts", "reference"
  MetricPlace place;
  MetricWhen when;
  std::string_view source;  ///< where it is from
  std::string_view help;    ///< one phrase
};

namespace metric_table_detail {
inline constexpr Better kUp = Better::higher, kDown = Better::lower, kNone = Better::neither;
inline constexpr std::string_view kThesis351 = "Morris 2006, 3.5.1", kThesis352 = "Morris 2006, 3.5.2",
                                  kThesis353 = "Morris 2006, 3.5.3", kProcess = "after Wan 2010, UWO thesis",
                                  kOurs = "this project", kStroke = "after FIVRS, mended",
                                  kSmooth = "Balasubramanian 2015", kHeat = "docs/validation/heat.md";

// A new metric: a row here, its value where its place computes it, a row in tests/unit/evidence/metric_table_test.cpp,
// and the table in docs/validation/evidence.md as metric_table_markdown() has it. All but the first fail to compile or
// fail a test where they are forgotten.
inline constexpr MetricRow kRows[] = {
    {"duration_s", "s", kDown, "", MetricPlace::process, MetricWhen::always, kProcess,
     "time that is known of the session"},
    {"lost_s", "s", kDown, "", MetricPlace::process, MetricWhen::some, kOurs, "time that was not recorded"},
    {"drilling_s", "s", kNone, "", MetricPlace::process, MetricWhen::always, kProcess,
     "a burr rotates (over 1000 rpm) and presses on bone; each hand's counts"},
    {"idle_s", "s", kDown, "", MetricPlace::process, MetricWhen::always, kOurs,
     "no pedal down and no hand faster than 2 mm/s (means of a tenth of a second), for a second or longer"},
    {"removed_mm3", "mm3", kNone, "", MetricPlace::process, MetricWhen::always, kProcess,
     "bone taken by burrs, what was taken back too"},
    {"sawn_mm3", "mm3", kNone, "", MetricPlace::process, MetricWhen::some, kOurs, "bone taken by saws"},
    {"rate_mm3_per_s", "mm3/s", kUp, "", MetricPlace::process, MetricWhen::drilling, kOurs,
     "removed for each second of drilling"},
    {"path_mm", "mm", kDown, "", MetricPlace::process, MetricWhen::always, kProcess,
     "way of the first hand's tip: means of 25 ms, in steps of 0.05 mm or more"},
    {"work_mj", "mJ", kNone, "", MetricPlace::process, MetricWhen::always, kOurs,
     "what the hands put in against the force"},
    {"instrument_s", "s", kNone, "", MetricPlace::process, MetricWhen::always, kProcess,
     "time an instrument is in the first hand"},
    {"instrument_mm3", "mm3", kNone, "", MetricPlace::process, MetricWhen::always, kProcess,
     "bone an instrument has taken"},
    {"camera_moves", "1", kNone, "camera", MetricPlace::process, MetricWhen::camera, kProcess,
     "how often the view began to change"},
    {"camera_s", "s", kNone, "camera", MetricPlace::process, MetricWhen::camera, kProcess,
     "time in which the view changed"},
    {"force_median_n", "N", kNone, "", MetricPlace::process, MetricWhen::drilling, kProcess,
     "burr on bone while drilling, the middle"},
    {"force_p95_n", "N", kDown, "", MetricPlace::process, MetricWhen::drilling, kProcess,
     "burr on bone while drilling, exceeded in 5 % of the time"},
    {"force_peak_n", "N", kDown, "", MetricPlace::process, MetricWhen::drilling, kProcess,
     "burr on bone while drilling, the most"},
    {"suction_share", "1", kUp, "", MetricPlace::process, MetricWhen::drilling, kProcess,
     "of drilling, with a suction tube at work"},
    {"irrigation_share", "1", kUp, "", MetricPlace::process, MetricWhen::drilling, kProcess, "of drilling, with water"},
    {"burr_side_share", "1", kUp, "", MetricPlace::process, MetricWhen::drilling, kProcess,
     "of drilling, the shaft 30 to 90 degrees off the force: the burr's side works"},
    {"strokes", "1", kNone, "", MetricPlace::process, MetricWhen::drilling, kStroke,
     "of the first hand's burr: at least 1 mm and 80 ms between turns of 60 degrees"},
    {"strokes_per_s", "1/s", kNone, "", MetricPlace::process, MetricWhen::stroke, kStroke,
     "for each second of drilling"},
    {"stroke_mm", "mm", kNone, "", MetricPlace::process, MetricWhen::stroke, kStroke, "length of a stroke, the middle"},
    {"stroke_s", "s", kNone, "", MetricPlace::process, MetricWhen::stroke, kStroke, "time of a stroke, the middle"},
    {"stroke_variance", "1", kDown, "", MetricPlace::process, MetricWhen::stroke, kStroke,
     "how little five strokes in a row follow one line: 0 one line, 2/3 all directions"},
    {"stroke_sparc", "1", kUp, "", MetricPlace::process, MetricWhen::smooth_stroke, kSmooth,
     "spectral arc length of a stroke's speed, the middle of those of 100 ms; nearer to 0 is smoother"},
    {"stroke_ldlj", "1", kUp, "", MetricPlace::process, MetricWhen::smooth_stroke, kSmooth,
     "log dimensionless jerk of the same; nearer to 0 is smoother"},
    {"phase_s", "s", kNone, "", MetricPlace::process, MetricWhen::removal, kStroke,
     "time for each fifth of the volume"},
    {"step_s", "s", kNone, "structures, procedure", MetricPlace::steps, MetricWhen::drilling, kOurs,
     "time for each step of the procedure, by where the burr drills"},
    {"seen_share", "1", kUp, "camera", MetricPlace::sight, MetricWhen::camera, kThesis351,
     "of removed bone, by volume, seen when it went"},
    {"hidden_mm3", "mm3", kDown, "camera", MetricPlace::sight, MetricWhen::camera, kThesis351, "removed unseen"},
    {"sight_unknown_mm3", "mm3", kNone, "camera", MetricPlace::sight, MetricWhen::some, kThesis351,
     "removed before the first camera note"},
    {"hidden_near_mm3", "mm3", kDown, "camera, structures", MetricPlace::sight, MetricWhen::structures, kThesis351,
     "removed unseen within 2 mm of a structure"},
    {"clearance_mm", "mm", kUp, "structures", MetricPlace::near, MetricWhen::structures, kProcess,
     "least distance of a burr's surface; negative inside"},
    {"touches", "1", kDown, "structures", MetricPlace::near, MetricWhen::structures, kProcess,
     "how often a burr reached it, each hand by itself"},
    {"touched_s", "s", kDown, "structures", MetricPlace::near, MetricWhen::structures, kProcess,
     "how long, by whichever hand"},
    {"injured_s", "s", kDown, "structures", MetricPlace::near, MetricWhen::structures, kProcess,
     "how long while it turned"},
    {"cut_mm3", "mm3", kDown, "structures", MetricPlace::saw, MetricWhen::structures, kOurs,
     "of it, taken by burrs and saws or gone through by shafts and screws"},
    {"saw_clearance_mm", "mm", kUp, "structures", MetricPlace::saw, MetricWhen::some, kOurs,
     "least distance of a cut by a plane, where it is below 5 mm and none went through it"},
    {"near_s", "s", kNone, "structures", MetricPlace::near, MetricWhen::structures, kProcess,
     "drilling within 2 mm of it"},
    {"near_mm3", "mm3", kNone, "structures", MetricPlace::near, MetricWhen::structures, kProcess,
     "bone taken with the burr within 2 mm of it"},
    {"near_05_s", "s", kNone, "structures", MetricPlace::near, MetricWhen::structures, kProcess,
     "drilling within 0.5 mm of it"},
    {"near_05_mm3", "mm3", kNone, "structures", MetricPlace::near, MetricWhen::structures, kProcess,
     "bone taken with the burr within 0.5 mm of it"},
    {"near_1_s", "s", kNone, "structures", MetricPlace::near, MetricWhen::structures, kProcess,
     "drilling within 1 mm of it"},
    {"near_1_mm3", "mm3", kNone, "structures", MetricPlace::near, MetricWhen::structures, kProcess,
     "bone taken with the burr within 1 mm of it"},
    {"near_4_s", "s", kNone, "structures", MetricPlace::near, MetricWhen::structures, kProcess,
     "drilling within 4 mm of it"},
    {"near_4_mm3", "mm3", kNone, "structures", MetricPlace::near, MetricWhen::structures, kProcess,
     "bone taken with the burr within 4 mm of it"},
    {"excess_force_ns", "N s", kDown, "structures, procedure", MetricPlace::near, MetricWhen::procedure, kProcess,
     "impulse above the procedure's limit near it"},
    {"burr_choice_share", "1", kUp, "structures, procedure", MetricPlace::near, MetricWhen::procedure, kProcess,
     "of drilling where a rule on burrs holds, with an allowed one"},
    {"target_share", "1", kUp, "structures, procedure", MetricPlace::product, MetricWhen::procedure, kOurs,
     "of a target region's bone, gone"},
    {"forbidden_mm3", "mm3", kDown, "structures, procedure", MetricPlace::product, MetricWhen::procedure, kOurs,
     "bone of a forbidden region that is gone"},
    {"outside_target_mm3", "mm3", kDown, "structures, procedure", MetricPlace::product, MetricWhen::procedure, kProcess,
     "removed bone that lies in no target region"},
    {"cavity_mm3", "mm3", kNone, "structures, procedure", MetricPlace::product, MetricWhen::procedure, kOurs,
     "that a ball of 0.5 mm reaches now and did not before"},
    {"items_passed", "1", kUp, "structures, procedure", MetricPlace::product, MetricWhen::procedure, kOurs,
     "of the scale"},
    {"heat_bone_c", "C", kDown, "heat", MetricPlace::heat, MetricWhen::always, kHeat,
     "the warmest that bone became; known within a factor of ten at best"},
    {"heat_peak_c", "C", kDown, "heat, structures", MetricPlace::heat, MetricWhen::structures, kHeat,
     "the warmest that the structure's face became"},
    {"heat_cem43_min", "min", kDown, "heat, structures", MetricPlace::heat, MetricWhen::structures, kHeat,
     "dose at its face, in minutes at 43 C; 16 harm bone"},
    {"plan_off_mm", "mm", kDown, "planned cuts", MetricPlace::plan, MetricWhen::planned, kOurs,
     "from the planned plane to the sawn one, in the middle of what was sawn"},
    {"plan_angle_deg", "deg", kDown, "planned cuts", MetricPlace::plan, MetricWhen::planned, kOurs,
     "between the planned plane and the sawn one"},
    {"plan_voxels", "1", kNone, "planned cuts", MetricPlace::plan, MetricWhen::planned, kOurs,
     "voxels of the sawn slot that the two are from"},
    {"force_above_band_share", "1", kDown, "structures, reference", MetricPlace::reference, MetricWhen::bands,
     kThesis352, "of drilling near it, pressing harder than 90 % of experts do at that distance"},
    {"speed_above_band_share", "1", kDown, "structures, reference", MetricPlace::reference, MetricWhen::bands,
     kThesis352, "of drilling near it, faster than 90 % of experts are at that distance"},
    {"region_log_ratio", "1", kUp, "reference", MetricPlace::reference, MetricWhen::regions, kThesis353,
     "log of how much more likely experts would have left the bone so; Laplace, kept voxels too"},
    {"region_per_voxel", "1", kUp, "reference", MetricPlace::reference, MetricWhen::regions, kThesis353,
     "the same for each voxel that decides"},
    {"region_voxels", "1", kNone, "reference", MetricPlace::reference, MetricWhen::regions, kThesis353,
     "effective number of these"},
    {"region_thesis", "1", kUp, "reference", MetricPlace::reference, MetricWhen::regions, kThesis353,
     "as printed there: removed voxels only"},
};

// Not constexpr: a name that is not in the table does not compile.
void a_metric_that_is_not_in_the_table();
consteval const MetricRow* declared(std::string_view name) {
  for (const MetricRow& row : kRows) {
    if (row.name == name) return &row;
  }
  a_metric_that_is_not_in_the_table();
  return nullptr;
}
}  // namespace metric_table_detail

/// The name of a metric, checked against the table when it is compiled.
class MetricName {
 public:
  consteval MetricName(const char* name) : row_(metric_table_detail::declared(name)) {}
  [[nodiscard]] constexpr const MetricRow& row() const { return *row_; }

 private:
  const MetricRow* row_;
};

[[nodiscard]] constexpr std::span<const MetricRow> metric_table() {
  return metric_table_detail::kRows;
}

}  // namespace osteo::inline assessment
