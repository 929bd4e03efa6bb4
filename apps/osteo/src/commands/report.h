// osteo report
#pragma once
#include <string>

#include "osteo/app/cli/command.h"

namespace osteo {

struct ReportCommand {
  struct Params {
    std::string scan, dicom;
  };
  static void describe(Params& p, auto& visit) {
    visit({"scan",
           "the scan that the case was made from, when it is not where it was (empty: as this machine remembers)"},
          p.scan);
    visit({"dicom", "file for the PDF as a DICOM object too, like CASE.report.dcm: it names the patient (empty: none)"},
          p.dicom);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

}  // namespace osteo
