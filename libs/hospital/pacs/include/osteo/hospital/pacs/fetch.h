// What a DICOM node has, and getting it: C-FIND and C-GET of the study root.
#pragma once
#include <cstdint>
#include <vector>

#include "osteo/core/base/context.h"
#include "osteo/core/base/files.h"
#include "osteo/hospital/pacs/peer.h"

namespace osteo::inline hospital {

/// What is asked for; empty: any. At least one must be given.
struct SeriesKeys {
  std::string study, series;  ///< UIDs
  std::string accession, patient_id;
  std::string study_date;  ///< "20240131" or a range "20240101-20240131"
  std::string modality;
};

struct RemoteSeries {
  std::string study, series;  ///< UIDs
  std::string modality, description, study_date;
  int number = 0;
  int images = -1;  ///< -1: the node does not say
};

/// Series that match, by study and number; at most 10,000 (Error usage: ask for less). Errors: usage when nothing is
/// asked for or a UID is none; failed.
[[nodiscard]] std::vector<RemoteSeries> find_series(const DicomPeer& peer, const SeriesKeys& keys,
                                                    const Context& context = {});

struct FetchLimits {
  double object_gb = 4;   ///< no object may be larger
  double series_gb = 16;  ///< nor all of a series
  double keep_free_gb = 1;
};

struct FetchReport {
  int images = 0;
  std::uint64_t bytes = 0;
};

/// The objects of a series into `folder` (which must exist and be empty), as they come, bit for bit, named by their
/// order. Errors: failed when the node says that some could not be sent, or sends another number than it said;
/// resources past a limit; cannot_write.
[[nodiscard]] FetchReport fetch_series(const DicomPeer& peer, const RemoteSeries& series, const fs::path& folder,
                                       const FetchLimits& limits = {}, const Context& context = {});

}  // namespace osteo::inline hospital
