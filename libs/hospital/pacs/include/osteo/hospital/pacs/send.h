// Objects to a DICOM node by C-STORE: every status judged, then asked whether they are there.
#pragma once
#include <cstdint>
#include <optional>
#include <vector>

#include "osteo/core/base/context.h"
#include "osteo/core/base/files.h"
#include "osteo/hospital/pacs/peer.h"

namespace osteo::inline hospital {

struct DicomObject {
  fs::path file;
  std::uint64_t bytes = 0;
  std::string kind;  ///< "CT Image Storage", or the UID of a class without a name here
  std::string sop_class, sop_instance, study, series,
      syntax;  ///< UIDs: they can identify a person, so nothing prints them
};

struct DicomObjects {
  std::vector<DicomObject> objects;  ///< by path
  std::vector<fs::path> set_aside;   ///< files that are no DICOM object
};

/// Heads of files, and of all files below folders; no pixels are read. Errors: no_input, cannot_read.
[[nodiscard]] DicomObjects list_objects(const std::vector<fs::path>& sources, const Context& context = {});

struct SentObject {
  DicomObject object;
  bool accepted = false;
  std::string problem;        ///< why not; or what the node changed, where it warns
  std::optional<bool> found;  ///< whether a query finds it afterwards; empty where that was not asked or could not be
};

struct SendReport {
  std::vector<SentObject> objects;
  std::string not_checked;  ///< why nothing was asked afterwards; empty where it was
  [[nodiscard]] std::size_t accepted() const;
  /// Accepted, and found where that was asked.
  [[nodiscard]] std::size_t safe() const;
};

/// Sends each object as it is, in its own transfer syntax, under a presentation context of its class: what the node
/// does not take is told, and the rest is sent. With `check`, the node is asked by C-FIND (study root, image level)
/// which of them it has. Errors: failed when there is no connection or the node rejects us (which side, which title,
/// why); cancelled.
[[nodiscard]] SendReport send_objects(const DicomPeer& peer, const std::vector<DicomObject>& objects, bool check = true,
                                      const Context& context = {});

}  // namespace osteo::inline hospital
