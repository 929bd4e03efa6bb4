// Which layer of an even stack each frame of a segmentation lies in. Private to libs/imaging/dicom.
#pragma once
#include <string>
#include <vector>

#include "osteo/core/data/frame.h"

namespace osteo::inline imaging::dicom {

struct SegLayers {
  double pitch_mm = 0;     ///< between layers
  int count = 0;           ///< layers from the first that holds a frame to the last
  std::vector<int> layer;  ///< of each frame, from 0
  std::string problem;     ///< why the frames cannot be placed; empty when they can
  std::string warning;     ///< what the volume depends on besides positions; empty when nothing
};

/// A segmentation leaves out frames that hold nothing (PS3.3 A.51), so the distances between its frames are multiples
/// of the distance between slices, and positions alone do not tell which. `spacing_mm` (SpacingBetweenSlices) is taken
/// where all distances are multiples of it; else the slices' thickness decides whether the largest distance that all
/// are multiples of is that of the slices. `along_mm`: of each frame along the normal, any order, several at one place
/// (segments). 0: the file states none. O(n log n).
[[nodiscard]] SegLayers place_seg_frames(const std::vector<double>& along_mm, double spacing_mm, double thickness_mm);

/// The frame of the volume in which frames at these positions lie, all with the axes and pixels of `plane` (its first
/// two axes and spacings, columns and rows; the rest is made here), and the layer of each. `layers.problem` tells why
/// not.
struct SegStack {
  Frame frame;
  SegLayers layers;
};
[[nodiscard]] SegStack stack_seg_frames(Frame plane, const std::vector<Vec3>& at_mm, double spacing_mm,
                                        double thickness_mm);

}  // namespace osteo::inline imaging::dicom
