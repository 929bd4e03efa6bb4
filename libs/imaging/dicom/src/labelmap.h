// Label map segmentations (PS3.3 A.51, SOP class of 2024): a pixel is the number of its segment. Private to
// libs/imaging/dicom.
#pragma once
#include <filesystem>
#include <string_view>

#include "osteo/core/base/context.h"
#include "osteo/core/data/volume.h"

namespace osteo::inline imaging::dicom {

inline constexpr std::string_view kLabelMapStorage = "1.2.840.10008.5.1.4.1.1.66.7";

/// 8 or 16 bits a pixel, in any encoding that is read; layers as of load_segmentation(). Numbers of segments stay where
/// all are at most 255, else segments are numbered from 1 in the order of theirs (a warning says so). Pixels of numbers
/// that no segment has are rejected. Errors: corrupt.
[[nodiscard]] Labels load_labelmap(const std::filesystem::path& path, const Context& context);

/// Structure::origin of a segment that is read: its algorithm's name and version, or "by hand"; empty where it says
/// none.
[[nodiscard]] std::string origin_from(const std::string& type, const std::string& name, const std::string& version);

/// Structure::within_mm and doubt from its SegmentDescription; as they are where it says nothing of them.
void read_certainty(const std::string& description, Structure& structure);

}  // namespace osteo::inline imaging::dicom
