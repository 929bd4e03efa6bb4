// osteo prepare
#pragma once
#include <string>

#include "osteo/app/cli/command.h"
#include "osteo/imaging/image/crop.h"
#include "osteo/imaging/image/threshold.h"

namespace osteo {

struct PrepareCommand {
  struct Params {
    std::string out;
    BonePreset preset = BonePreset::fixed;
    double lower = 300;
    double spacing_mm = 0.5;
    Region region = Region::whole;
    bool remove_table = false;
    bool keep_table = false;
    std::string structures;
    std::string names;
    std::string series;
    std::string axes;
    double hu_offset = 0;
    std::string pipeline;
    std::string edits;
    bool fresh = false;
    bool no_report = false;
  };
  static void describe(Params& p, auto& visit) {
    visit({"out", "folder of the case, made when it is not there (also -o)"}, p.out);
    visit(
        {"preset",
         "how the bone threshold is found: fixed takes --lower, the others go by the scan ('osteo suggest-threshold')"},
        p.preset);
    visit({"lower", "bone threshold", "HU", -1024, 30000}, p.lower);
    visit({"spacing_mm", "edge of the voxels", "mm", 0.05, 10}, p.spacing_mm);
    visit({"region", "part of the head to keep; see 'osteo help crop'"}, p.region);
    visit({"remove_table",
           "clear table and head holder also where it is not certain that they are; what is certain goes without it"},
          p.remove_table);
    visit({"keep_table", "leave table and head holder on, however certain"}, p.keep_table);
    visit({"structures",
           "label map of nerves, vessels, ... (.seg.nrrd, .nii.gz, .dcm) that belongs to the CT, or the folder of a "
           "trained network that finds them in it ('osteo help segment-network')"},
          p.structures);
    visit({"names",
           "what its values stand for, like '1=facial nerve, 2=sigmoid sinus'; values without a name are left out"},
          p.names);
    visit({"series",
           "DICOM series to take, by number, UID, or scan as 'osteo import --list' shows it, like A1a or A1a:203 "
           "(empty: the recommended "
           "one)"},
          p.series);
    visit({"axes", "where the index axes point, for files that do not know: three letters like LPI"}, p.axes);
    visit({"hu_offset", "added to all values, for a scan that leaves out its offset", "HU", -5000, 5000}, p.hu_offset);
    visit({"pipeline", "another pipeline file than the built-in temporal-bone.json"}, p.pipeline);
    visit({"edits",
           "corrections by 'osteo edit' (edits.json), made again on the mask; the case keeps them until --no-edits"},
          p.edits);
    visit({"fresh", "forget the flags that the case remembers: only those given now count"}, p.fresh);
    visit({"no_report", "write no report beside the case: its cuts are pictures of the patient"}, p.no_report);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

}  // namespace osteo
