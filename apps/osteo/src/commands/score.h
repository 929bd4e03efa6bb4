// osteo score
#pragma once
#include <string>

#include "osteo/app/cli/command.h"

namespace osteo {

struct ScoreCommand {
  struct Params {
    std::string procedure;
    bool mirror = false;
    std::string reference;
    std::string subject;
    std::string csv;
    std::string measures, segmentation, scan;
    bool evidence = false;
    bool heat = false;
    std::string case_folder;
  };
  static void describe(Params& p, auto& visit) {
    visit({"procedure",
           "what was to be done, by name (mastoidectomy, mastoid-window, mandible-split) or as JSON; empty: no items, "
           "regions or rules"},
          p.procedure);
    visit({"mirror",
           "the procedure is written for the other side of the body: its directions and curves turn about x = 0"},
          p.mirror);
    visit({"reference", "folder with reference.json and sessions of others on the same case; empty: no comparison"},
          p.reference);
    visit(
        {"subject", "who this is, by the reference's code: sessions of the same person are left out of the comparison"},
        p.subject);
    visit({"csv", "also write a header and a row of all values (.csv)"}, p.csv);
    visit({"measures",
           "file for the score and the case's measures as a DICOM structured report (TID 1500), like "
           "SESSION.score.dcm: it names the patient (empty: none)"},
          p.measures);
    visit({"segmentation",
           "DICOM SEG of the case's structures, as convert writes it, that --measures refers to (empty: none)"},
          p.segmentation);
    visit({"scan",
           "the scan that the case was made from, for --measures, when it is not where it was (empty: as this machine "
           "remembers)"},
          p.scan);
    visit({"evidence", "add to --json the places that prove each item, and all bone removed unseen"}, p.evidence);
    visit(
        {"heat", "also how warm bone and structures became: runs the session again, which takes several times as long"},
        p.heat);
    visit({"case_folder", "the case, when it was moved since (empty: where the session says)"}, p.case_folder);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

}  // namespace osteo
