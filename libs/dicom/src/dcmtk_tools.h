// Small helpers around DCMTK. Private to libs/dicom; only for files that include DCMTK first.
#pragma once
#include <string>

#include "osteo/base/error.h"
#include "osteo/base/files.h"

namespace osteo::dicom {

inline constexpr const char* kAnonymousName = "OSTEOTOME^ANONYMOUS";
inline constexpr const char* kAnonymousId = "OSTEOTOME";

/// DCMTK's warnings go nowhere: what matters comes back as a condition.
void quiet_dcmtk();

/// "2.25." and the number that 32 hex digits stand for (PS3.5 B.2): the same content, the same UID.
[[nodiscard]] std::string uid_of(const std::string& hex);

void require(const OFCondition& condition, const fs::path& path);

/// At most 16 characters, as DS asks.
[[nodiscard]] std::string decimal(double value);

}  // namespace osteo::dicom
