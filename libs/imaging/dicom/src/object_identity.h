// Whose an object is that is written beside a scan. Private to libs/imaging/dicom; only for files that include DCMTK
// first.
#pragma once
#include <string>
#include <utility>

#include "osteo/imaging/dicom/objects.h"

namespace osteo::inline imaging::dicom {

/// Error(cannot_write) names `path`.
void put(DcmItem& d, const DcmTagKey& tag, const std::string& value, const fs::path& path);

/// Patient and study are the source's, or nobody's. A document lies in no space: it has no frame of reference.
void put_identity(DcmDataset& d, const DicomObjectOptions& o, const std::string& content, bool in_space,
                  const fs::path& path, const Context& context);

/// Date and time of this machine as DA and TM.
[[nodiscard]] std::pair<std::string, std::string> now_text();

/// At most 64 characters, as LO asks, of UTF-8; no backslash and no control characters.
[[nodiscard]] std::string lo_text(const std::string& text);

/// As lo_text; of a name that is longer its begin, its end and a hash, so that two names have two labels.
[[nodiscard]] std::string segment_label(const std::string& name);

/// Makes the texts that are there UTF-8, where one that is to be put in is not ASCII.
void speak_utf8(DcmDataset& d, const std::string& texts);

}  // namespace osteo::inline imaging::dicom
