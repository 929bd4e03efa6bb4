#include "osteo/imaging/dicom/verdict.h"

#include <algorithm>
#include <cmath>

#include "osteo/core/base/error.h"
#include "osteo/core/base/json.h"
#include "osteo/core/base/json_document.h"

namespace osteo::inline imaging {
namespace {

// Ten micrometres are the promise; a hundredth of that is enough to print.
double tidy(double v) {
  const double r = std::round(v * 1e4) / 1e4;
  return r == 0 ? 0.0 : r;
}
Json triple(Vec3 v) {
  return {tidy(v.x), tidy(v.y), tidy(v.z)};
}
Json direction(Vec3 v) {
  return {v.x, v.y, v.z};
}

}  // namespace

void Verdict::add(std::string_view code, Severity severity, std::string message, std::string advice,
                  std::vector<std::string> files) {
  findings.push_back({std::string(code), severity, std::move(message), std::move(advice), std::move(files)});
}

bool Verdict::has(std::string_view wanted) const {
  return std::any_of(findings.begin(), findings.end(), [&](const Finding& f) { return f.code == wanted; });
}

bool Verdict::refused() const {
  return std::any_of(findings.begin(), findings.end(), [](const Finding& f) { return f.severity == Severity::error; });
}

std::string Verdict::status() const {
  if (refused()) return "refused";
  const bool warned =
      std::any_of(findings.begin(), findings.end(), [](const Finding& f) { return f.severity == Severity::warning; });
  return resampled || warned ? "repaired" : "good";
}

std::string to_json(const Verdict& v) {
  static constexpr const char* kSeverity[] = {"info", "warning", "error"};
  Json j;
  j["osteotome_verdict"] = 1;
  j["status"] = v.status();
  j["findings"] = Json::list();
  for (const Finding& f : v.findings) {
    Json e{{"code", f.code}, {"severity", kSeverity[static_cast<int>(f.severity)]}, {"message", f.message}};
    if (!f.advice.empty()) e["advice"] = f.advice;
    if (!f.files.empty()) e["files"] = f.files;
    j["findings"].push_back(std::move(e));
  }
  j["source"] = v.source;
  if (v.source == "DICOM") {
    j["series"] = {{"number", v.series},     {"stack", v.stack},   {"stacks", v.stacks},
                   {"modality", v.modality}, {"kernel", v.kernel}, {"thickness_mm", tidy(v.thickness_mm)},
                   {"why", v.why_chosen}};
    if (!v.scanner.empty()) j["series"]["scanner"] = v.scanner;
    if (!v.scan_hash.empty()) j["series"]["scan_hash"] = v.scan_hash;
    j["geometry"] = {{"slices", v.slices.size()},
                     {"columns", v.columns},
                     {"rows", v.rows},
                     {"pixel_mm", {v.pixel_mm[0], v.pixel_mm[1]}},
                     {"gap_min_mm", tidy(v.gap_min_mm)},
                     {"gap_max_mm", tidy(v.gap_max_mm)},
                     {"gap_usual_mm", tidy(v.gap_usual_mm)},
                     {"tilt_deg", tidy(v.tilt_deg)},
                     {"shear_mm_per_mm", {tidy(v.shear_mm_per_mm[0]), tidy(v.shear_mm_per_mm[1])}},
                     {"resampled", v.resampled},
                     {"position_error_mm", tidy(v.position_error_mm)}};
  }
  if (v.output.voxel_count() > 0) {
    j["output"] = {{"dims", v.output.dims},
                   {"spacing_mm", {v.output.spacing_mm.x, v.output.spacing_mm.y, v.output.spacing_mm.z}},
                   {"origin_lps_mm", triple(v.output.origin_mm)},
                   {"direction",
                    {direction(v.output.direction.column[0]), direction(v.output.direction.column[1]),
                     direction(v.output.direction.column[2])}},
                   {"axes", orientation_code(v.output)}};
  }
  if (v.values.checked) {
    Json values{{"hu_min", v.values.hu_min}, {"hu_max", v.values.hu_max}, {"plausible_hu", v.values.plausible}};
    values["air_hu"] = v.values.has_air ? Json(tidy(v.values.air_hu)) : Json();
    values["soft_tissue_hu"] = v.values.has_soft_tissue ? Json(tidy(v.values.soft_tissue_hu)) : Json();
    values["padding"] = {{"source", v.values.padding_source}, {"share", tidy(v.values.padding_share)}};
    if (v.values.padding_source != "none") values["padding"]["hu"] = tidy(v.values.padding_hu);
    values["saturated_mm3"] = tidy(v.values.saturated_mm3);
    values["metal_mm3"] = tidy(v.values.metal_mm3);
    values["rounding_error_hu"] = v.values.rounding_error_hu;
    j["values"] = std::move(values);
  }
  if (v.source == "DICOM") {
    j["gaps"] = Json::list();
    for (const SliceGap& g : v.gaps) {
      j["gaps"].push_back({{"after", g.after},
                           {"before", g.before},
                           {"gap_mm", tidy(g.gap_mm)},
                           {"usual_mm", tidy(g.usual_mm)},
                           {"missing", g.missing},
                           {"filled", g.filled}});
    }
    j["slices"] = Json::list();
    for (const SliceRecord& s : v.slices) {
      Json e{{"file", s.file},
             {"position_lps_mm", triple(s.position_mm)},
             {"along_mm", tidy(s.along_mm)},
             {"output_slice", tidy(s.output_index)}};
      if (s.frame > 0) e["frame"] = s.frame;
      j["slices"].push_back(std::move(e));
    }
    j["set_aside"] = Json::list();
    for (const FileSetAside& f : v.set_aside)
      j["set_aside"].push_back({{"file", f.file}, {"code", f.code}, {"why", f.why}});
  }
  return j.dump(2) + "\n";
}

VerdictSummary read_verdict(std::string_view text) {
  try {
    const JsonFile file(text, "verdict", ExitCode::corrupt);
    file.require_format("osteotome_verdict");
    const auto text_of = [&](const JsonValue& object, const char* key) {
      return file.text(file.need(object, "", key), std::string("\"") + key + "\"");
    };
    VerdictSummary summary;
    summary.status = text_of(file.root(), "status");
    if (const JsonValue* const series = file.root().find("series");
        series != nullptr && series->find("scan_hash") != nullptr)
      summary.scan_hash = text_of(*series, "scan_hash");
    for (const JsonValue& f : file.list(file.need(file.root(), "", "findings"), "\"findings\"")) {
      Finding finding;
      finding.code = text_of(f, "code");
      const std::string severity = text_of(f, "severity");
      finding.severity = severity == "error"     ? Severity::error
                         : severity == "warning" ? Severity::warning
                                                 : Severity::info;
      finding.message = text_of(f, "message");
      if (f.find("advice") != nullptr) finding.advice = text_of(f, "advice");
      if (const JsonValue* const files = f.find("files"); files != nullptr) {
        for (const JsonValue& name : file.list(*files, "\"files\""))
          finding.files.push_back(file.text(name, "\"files\""));
      }
      summary.findings.push_back(std::move(finding));
    }
    return summary;
  } catch (const Error& e) {
    throw e.in("this is no verdict of an import");
  }
}

}  // namespace osteo::inline imaging
