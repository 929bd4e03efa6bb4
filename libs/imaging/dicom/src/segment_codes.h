// What a structure is and what drew it, in the codes of DICOM. Private to libs/imaging/dicom; only for files that
// include DCMTK first.
#pragma once
#include <filesystem>
#include <string>
#include <string_view>

#include "osteo/core/data/volume.h"

namespace osteo::inline imaging::dicom {

struct SegmentCode {
  std::string_view code, meaning;
};

/// SNOMED CT by the words of the name: what is not known by them is a tissue, or bone where it is the only one.
[[nodiscard]] SegmentCode code_of(const std::string& name, bool alone);

/// One item of a code sequence, in place of what was there. Error(cannot_write) names `path`.
void put_code(DcmItem& in, const DcmTagKey& sequence, SegmentCode code, const char* scheme,
              const std::filesystem::path& path);

/// SegmentAlgorithmType, its name, and SegmentationAlgorithmIdentificationSequence where the origin tells what and
/// which version (Structure::origin).
void put_algorithm(DcmItem& segment, const std::string& origin, const std::filesystem::path& path);

/// What is known of its boundary (Structure::within_mm, doubt) as SegmentDescription, in English; nothing where nothing
/// is known. labelmap.h reads it back.
void put_certainty(DcmItem& segment, const Structure& structure, const std::filesystem::path& path);

/// Structure::origin read.
struct DrawnBy {
  std::string name, version;  ///< of what drew it; empty: not known
  bool corrected = false;     ///< by hand, afterwards
  bool own = false;           ///< one of our stages; else somebody else's program, or a hand
};
[[nodiscard]] DrawnBy drawn_by(const std::string& origin);

/// What stands for the name of an algorithm that is not known.
inline constexpr std::string_view kNotRecorded = "not recorded";

}  // namespace osteo::inline imaging::dicom
