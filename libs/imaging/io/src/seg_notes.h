// The key:=value lines by which 3D Slicer names the segments of a label map (.seg.nrrd). Private to libs/imaging/io.
// Keys: slicer.readthedocs.io, developer guide, "Segmentation file format".
#pragma once
#include <map>
#include <string>
#include <vector>

#include "osteo/core/data/volume.h"

namespace osteo::inline imaging::io {

struct SegmentNote {
  int layer = 0;
  int value = 1;        ///< in its layer; above 255 it is no label of ours
  Structure structure;  ///< its value is that in its layer, where it is one from 1 to 255
  std::string id;
  std::map<std::string, std::string> tags;  ///< Slicer keeps those that it does not know
};
/// In the order of the file's numbers; empty when there are none. Files of Slicer 4.10 and before name no layers: each
/// segment has its own.
[[nodiscard]] std::vector<SegmentNote> segments_from(const std::map<std::string, std::string>& notes);

/// For a label map without names, its values become "Segment_1", ... with colours of their own. `tags` go to each
/// segment. A segment always has a tag: Slicer up to 4.11 at least waits for ever on a "|" without one.
[[nodiscard]] std::map<std::string, std::string> notes_from(const Labels& labels,
                                                            const std::map<std::string, std::string>& tags = {});

}  // namespace osteo::inline imaging::io
