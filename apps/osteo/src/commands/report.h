// osteo report
#pragma once
#include <string>

#include "osteo/app/cli/command.h"

namespace osteo {

struct ReportCommand {
  struct Params {
    std::string scan, dicom, measures, segmentation;
  };
  static void describe(Params& p, auto& visit) {
    visit({"scan",
           "the scan that the case was made from, when it is not where it was (empty: as this machine remembers)"},
          p.scan);
    visit({"dicom", "file for the PDF as a DICOM object too, like CASE.report.dcm: it names the patient (empty: none)"},
          p.dicom);
    visit({"measures",
           "file for the case's measures as a DICOM structured report (TID 1500), like CASE.measures.dcm: volumes, "
           "distances and lengths of structures, the bone's threshold; it names the patient (empty: none)"},
          p.measures);
    visit({"segmentation",
           "DICOM SEG of the case's structures, as convert writes it, that --measures refers to (empty: none)"},
          p.segmentation);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

}  // namespace osteo
