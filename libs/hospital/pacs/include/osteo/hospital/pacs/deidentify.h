// Objects without what identifies a person: the Basic Application Level Confidentiality Profile of PS3.15 Annex E,
// edition 2026c.
#pragma once
#include <cstddef>
#include <string>
#include <vector>

#include "osteo/core/base/context.h"
#include "osteo/core/base/files.h"
#include "osteo/hospital/pacs/send.h"

namespace osteo::inline hospital {

struct DeidentifyOptions {
  /// File of 32 to 4,096 bytes that nobody else may read. The same key gives the same codes and UIDs, today and next
  /// year; who has it can test a guess. Empty: a key of this run, which is forgotten.
  fs::path key;
};

struct DeidentifiedStudy {
  std::string code;        ///< of the patient: PatientID and PatientName of the result
  std::string study;       ///< new UID
  std::string patient_id;  ///< as it was; bytes beyond ASCII as '?'. These two lead back to the person
  std::string original;    ///< UID as it was
};

struct NotDeidentified {
  fs::path file;
  std::string why;  ///< without values
};

struct DeidentifyReport {
  std::size_t written = 0;
  std::vector<NotDeidentified> refused;
  std::vector<DeidentifiedStudy> studies;  ///< by code and UID
};

/// Writes what may leave of each object into `out` (a folder that is there), as study-x/series-x/x.dcm by hashes of the
/// new UIDs. Where the table leaves a choice the value that keeps an object valid is taken: X/Z empties, X/D, Z/D and
/// X/Z/D put a dummy. Besides the table: private attributes, attributes of no known kind, overlays and curves are
/// removed, names of persons anywhere are emptied, and UIDs that are not the standard's own are replaced, all of it
/// within sequences too. Pixels stay: a head's scan shows a face. Rejected, not written: what is no image of CT, MR,
/// PET or 3D X-ray nor a segmentation (reports, documents, photographs of screens hold words that no table knows);
/// where words are said or likely to be burned in; where a kept text has the patient's name or a number of theirs;
/// damaged files. Holds one object in memory at a time. Errors: usage (key), no_input, cannot_read, cannot_write,
/// cancelled.
[[nodiscard]] DeidentifyReport deidentify_objects(const std::vector<DicomObject>& objects, const fs::path& out,
                                                  const DeidentifyOptions& options, const Context& context = {});

/// From codes and new UIDs back to the originals, as JSON, in a file that is for this user only. Error(cannot_write)
/// where there is one.
void write_deidentify_map(const fs::path& file, const DeidentifyReport& report);

}  // namespace osteo::inline hospital
