#include "case_series.h"

#include <ostream>

#include "audit_case.h"
#include "built_in_pipelines.h"
#include "case_edits.h"
#include "case_pipeline.h"
#include "osteo/assessment/case_report/case_report.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/session/scene/slicer_exchange.h"

namespace osteo {

std::optional<Pipeline> pipeline_at_hand(const fs::path& folder, const std::optional<Recipe>& recipe,
                                         const std::string& given) {
  if (!recipe) {
    if (!given.empty())
      throw Error(ExitCode::usage,
                  "'" + folder.string() + "' was made by an earlier version and does not know its scan",
                  "make it again, with prepare");
    return std::nullopt;
  }
  fs::path scan;
  if (!given.empty()) {
    require_readable(given);
    if (hash_path(given) != recipe->source_hash)
      throw Error(ExitCode::corrupt,
                  "'" + given + "' is not the scan that '" + folder.string() + "' was made from, or was changed since");
    scan = given;
  } else if (const auto known = recall_file(recipe->source_hash)) {
    scan = *known;
  }
  std::string text(kTemporalBonePipeline);
  if (!recipe->pipeline_hash.empty()) {
    const auto known = pipeline_file(folder, recipe->pipeline_hash);
    if (!known) return std::nullopt;
    text = read_text(*known);
  }
  if (scan.empty() || !recipe->lost.empty()) return std::nullopt;
  Recipe same = *recipe;
  std::vector<std::string> notes;
  return case_pipeline(text, *recipe, scan, {}, false, folder, edits_of_case(folder, std::nullopt, same, notes), false);
}

CaseSeries series_of(const fs::path& folder, const std::optional<Pipeline>& pipeline, cli::Invocation& io) {
  if (!pipeline)
    throw Error(ExitCode::no_input,
                "the scan of '" + folder.string() + "' is not at hand, whose patient and study the object belongs to",
                "--scan DICOM_FOLDER");
  for (const PipelineNode& n : pipeline->nodes) {
    const auto source = n.inputs.find("source");
    if ((n.stage != "import" && n.stage != "import-bone") || source == n.inputs.end() || source->second.file.empty())
      continue;
    const auto wanted = n.params.find("series");
    CaseSeries s;
    s.scan = scan_dicom(source->second.file, {}, io.context.sub(0, 0.1));
    s.series = &choose_series(s.scan, wanted == n.params.end() ? "" : wanted->second, source->second.file.string());
    return s;
  }
  throw Error(ExitCode::usage, "'" + folder.string() +
                                   "' was not made from a DICOM series: there is no study that its report belongs to");
}

void check_object(const std::string& object, const fs::path& example, const char* flag, const cli::Invocation& io) {
  if (object.empty()) return;
  if (fs::path(object).extension() != ".dcm")
    throw Error(ExitCode::usage, "'" + object + "' does not end in .dcm", std::string(flag) + " " + example.string());
  if (output_exists(object) && !io.common.force)
    throw Error(ExitCode::cannot_write, "'" + object + "' exists already",
                "give another name, or --force to replace it");
}

void handed_over(const AuditTrail& trail, const fs::path& case_folder, const std::string& written,
                 cli::Invocation& io) {
  io.end_progress();
  audit_case(trail, AuditEvent::Kind::hand_over, case_folder, io.context);
  if (!io.common.quiet) io.err << "  " << written << " (names the patient)\n";
}

MeasuresReport measures_of_case(const fs::path& folder, const fs::path& segmentation, const Context& context) {
  const CaseMeasures measured = case_measures(folder, context);
  MeasuresReport report;
  report.program = program_version();
  report.code = case_code(folder);
  report.bone_mm3 = measured.bone_mm3.value_or(-1);
  report.bone_lower_hu = measured.lower_hu;
  for (const auto& s : measured.structures)
    report.structures.push_back({s.is.name, s.is.origin, s.volume_mm3, s.length_mm});
  for (const auto& g : measured.gaps) report.gaps.push_back({g.a, g.b, g.mm});
  report.segmentation = segmentation;
  return report;
}

}  // namespace osteo
