// The key:=value lines by which 3D Slicer names the segments of a label map (.seg.nrrd). Private to libs/io.
// Keys: slicer.readthedocs.io, developer guide, "Segmentation file format".
#pragma once
#include <map>
#include <string>

#include "osteo/data/volume.h"

namespace osteo::io {

struct SegmentNote {
  int layer = 0;
  Structure structure;  ///< value: as in its layer
};
/// In the order of the file's numbers; empty when there are none. Values that are no labels are left out.
[[nodiscard]] std::vector<SegmentNote> segments_from(const std::map<std::string, std::string>& notes);

/// For a label map without names, its values become "Segment_1", ... with colours of their own.
[[nodiscard]] std::map<std::string, std::string> notes_from(const Labels& labels);

}  // namespace osteo::io
