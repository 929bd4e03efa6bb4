// Small helpers around DCMTK. Private to libs/imaging/dicom; only for files that include DCMTK first.
#pragma once
#include <string>

#include "osteo/core/base/context.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/imaging/dicom/scan.h"

namespace osteo::inline imaging::dicom {

inline constexpr const char* kAnonymousName = "OSTEOTOME^ANONYMOUS";
inline constexpr const char* kAnonymousId = "OSTEOTOME";

/// DCMTK's warnings go nowhere: what matters comes back as a condition.
void quiet_dcmtk();

/// "2.25." and the number that 32 hex digits stand for (PS3.5 B.2): the same content, the same UID.
[[nodiscard]] std::string uid_of(const std::string& hex);

void require(const OFCondition& condition, const fs::path& path);

/// The UID, or where it is none, a valid one made from it.
[[nodiscard]] std::string valid_uid(const std::string& uid);

/// What an object takes over from its source: the first usable slice without its pixels, and without values that DICOM
/// does not allow (an invalid UID is replaced by valid_uid, any other such value is emptied). Their names are told as a
/// warning. Error(corrupt) when there is no slice that can be read.
void load_identity(const DicomSeries& source, DcmFileFormat& file, const Context& context);

/// At most 16 characters, as DS asks.
[[nodiscard]] std::string decimal(double value);

}  // namespace osteo::inline imaging::dicom
