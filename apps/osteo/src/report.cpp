// report, approve: a case that a person can look at and stand for.
#include <ostream>

#include "audit_case.h"
#include "case_pipeline.h"
#include "case_series.h"
#include "commands/approve.h"
#include "commands/report.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/json_document.h"
#include "osteo/core/base/shell.h"
#include "osteo/hospital/pacs/roles.h"
#include "osteo/imaging/dicom/objects.h"
#include "osteo/imaging/io/volume_io.h"
#include "osteo/imaging/pipeline/pipeline.h"
#include "osteo/session/scene/approval.h"
#include "osteo/session/scene/case.h"
#include "osteo/session/scene/slicer_exchange.h"

namespace osteo {
namespace {

CaseReport make_report(const fs::path& folder, const std::optional<Recipe>& recipe,
                       const std::optional<Pipeline>& pipeline, cli::Invocation& io) {
  return report_on(folder, recipe ? flags_of(*recipe) : " (made by an earlier version, which did not keep its flags)",
                   pipeline, std::nullopt, io);
}

CaseReport make_report(const fs::path& folder, cli::Invocation& io) {
  const auto recipe = read_recipe(folder);
  return make_report(folder, recipe, pipeline_at_hand(folder, recipe, {}), io);
}

}  // namespace

cli::CommandInfo ReportCommand::info() {
  return {"report",
          "the report of a case, to look at, print and sign",
          "Writes CASE.report.html and CASE.report.pdf beside the case, as prepare does: two pages with the scan's "
          "facts, cuts with the bone's "
          "outline, the bone from six sides, what was taken off, what the scan can resolve, structures and a line to "
          "sign. Its cuts are "
          "pictures of the "
          "patient, so it is not in the case. Without the scan the pictures of an earlier report of the same state are "
          "kept, or left out, and "
          "it says so. --dicom writes the PDF as a DICOM object too, of the patient and study of the scan, which is "
          "looked at for it: "
          "'osteo send' brings it to a PACS. --measures writes what it says in numbers as a DICOM structured report.",
          {{"case", "a folder made by prepare"}},
          "osteo report CASE",
          false,
          {},
          {"dicom", "measures"},
          {"segmentation", "scan"}};
}

int ReportCommand::run(const Params& p, cli::Invocation& io) {
  const fs::path folder = io.arguments[0], object = p.dicom;
  const AuditTrail trail;
  check_object(p.dicom, report_file(folder, ".dcm"), "--dicom", io);
  check_object(p.measures, report_file(folder, ".measures.dcm"), "--measures", io);
  if (!p.segmentation.empty() && p.measures.empty())
    throw Error(ExitCode::usage, "--segmentation is what --measures refers to", "--measures FILE.dcm");
  const auto recipe = read_recipe(folder);
  const auto pipeline = pipeline_at_hand(folder, recipe, p.scan);
  std::optional<CaseSeries> of;
  if (!object.empty() || !p.measures.empty()) of = series_of(folder, pipeline, io);
  const CaseReport report = make_report(folder, recipe, pipeline, io);
  // Of each at once: where the second fails, the first is there, and names the patient.
  if (!object.empty()) {
    save_encapsulated_pdf(read_text(report.pdf), "Bone for rehearsal: " + case_code(folder), object,
                          {of->series, "Bone for rehearsal, not for diagnosis"}, io.context);
    handed_over(trail, folder, p.dicom, io);
  }
  if (!p.measures.empty()) {
    save_measures_report(measures_of_case(folder, p.segmentation, io.context), p.measures,
                         {of->series, "Measures of bone for rehearsal, not for diagnosis"}, io.context);
    handed_over(trail, folder, p.measures, io);
  }
  if (io.common.json) {
    Json said{{"html", report.html.string()},  {"pdf", report.pdf.string()},
              {"unchanged", report.unchanged}, {"left_out", report.left_out},
              {"code", case_code(folder)},     {"approval", approval_json(approval_of(folder))}};
    if (!object.empty()) said["dicom"] = p.dicom;
    if (!p.measures.empty()) said["measures"] = p.measures;
    io.out << said.dump(2) << '\n';
  }
  return 0;
}

cli::CommandInfo ApproveCommand::info() {
  return {"approve",
          "say that a person has looked at a case and stands for it",
          "Writes the name, today's date and the note into the case, bound to the content of its files and to the "
          "report: any later change "
          "ends it. Shown by "
          "'osteo info CASE', in the report, in the rehearsal's window and in each session. The name is kept as it is "
          "given: it is the "
          "only one in a "
          "case. 'osteo rehearse --require-approved' rejects a case without.",
          {{"case", "a folder made by prepare"}},
          "osteo approve CASE --by 'A. Miller' --note 'mastoid only'"};
}

namespace {

// Who approves a case takes the word of what drew its structures, unless a hand has changed them since.
void warn_of_doubts(const fs::path& folder, const Context& context) {
  const fs::path file = folder / "structures.seg.nrrd";
  if (!output_exists(file)) return;
  for (const Structure& s : load_labels(file).structures)
    if (!s.doubt.empty())
      context.warn(s.name + " is approved as found, though it is not to be trusted here: " + s.doubt);
}

}  // namespace

int ApproveCommand::run(const Params& p, cli::Invocation& io) {
  const fs::path folder = io.arguments[0];
  if (p.withdraw && (!p.by.empty() || !p.note.empty()))
    throw Error(ExitCode::usage, "--withdraw takes the approval back: --by and --note do nothing beside it",
                "leave them out");
  if (!p.withdraw && p.by.empty()) throw Error(ExitCode::usage, "who approves it? --by NAME");
  const AuditTrail trail;
  require_role("approve", trail, io.context);
  // A case whose files are not what its manifest says is not to be approved.
  static_cast<void>(load_case(folder));
  if (p.withdraw) {
    if (!withdraw_approval(folder))
      throw Error(ExitCode::failed, "'" + folder.string() + "' is not approved: there is nothing to take back");
  } else {
    // Looked at must have been the case as it is.
    if (output_exists(report_file(folder, ".html")) && !report_shows(folder)) {
      throw Error(ExitCode::failed, "the report of '" + folder.string() + "' shows the case before its last change",
                  "make it again with 'osteo report " + shell_path(folder) + "', look at it, then approve");
    }
    if (output_exists(report_file(folder, ".html")) && make_report(folder, io).says_other) {
      throw Error(ExitCode::failed,
                  "the report of '" + folder.string() + "' was of another version of the program, and is made again",
                  "look at it, then approve");
    }
    warn_of_doubts(folder, io.context);
    approve(folder, p.by, p.note);
  }
  audit_case(trail, p.withdraw ? AuditEvent::Kind::withdraw : AuditEvent::Kind::approve, folder, io.context);
  const CaseReport report = make_report(folder, io);
  const ApprovalNow now = approval_of(folder);
  if (io.common.json) {
    io.out << Json{{"approval", approval_json(now)}, {"report", report.html.string()}}.dump(2) << '\n';
  } else if (!io.common.quiet) {
    io.err << case_code(folder) << ": " << now.words() << '\n';
  }
  return 0;
}

}  // namespace osteo
