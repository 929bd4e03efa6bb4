// osteo convert
#pragma once
#include <string>

#include "osteo/app/cli/command.h"
#include "osteo/imaging/dicom/objects.h"

namespace osteo {

struct ConvertCommand {
  struct Params {
    std::string source;
    std::string series;
    bool onto_source = false;
    std::string description = "Bone";
    SegmentationForm segmentation = SegmentationForm::binary;
  };
  static void describe(Params& p, auto& visit) {
    visit({"source", "DICOM it was made from: a .dcm output takes over its patient, study and frame of reference"},
          p.source);
    visit({"series",
           "which series of the source, by number, UID, or scan like A1a or A1a:203 (empty: the recommended one)"},
          p.series);
    visit({"onto_source", "a label map as .dcm: on the source's own slices, tilted and uneven as they are"},
          p.onto_source);
    visit({"description", "series description of a .dcm output, as a PACS lists it"}, p.description);
    visit(
        {"segmentation",
         "how a label map is stored as .dcm: binary has a frame for each structure, which every viewer reads; labelmap "
         "has one frame a slice with the structures' numbers, which older viewers do not know"},
        p.segmentation);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

}  // namespace osteo
