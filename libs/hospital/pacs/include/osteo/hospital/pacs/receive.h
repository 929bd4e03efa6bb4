// A DICOM node that takes what is sent to it (C-STORE, C-ECHO) into a folder.
//
// The parent only accepts connections; each association is served by a child process of its own with limits on memory,
// file size and time, so that what a peer sends can end that child and nothing else. Nothing is decoded: an object is
// written as it came, its head is read for its UIDs, and it is renamed into place whole, or rejected with a status.
#pragma once
#include <cstdint>
#include <functional>
#include <set>
#include <string>
#include <vector>

#include "osteo/core/base/context.h"
#include "osteo/core/base/files.h"
#include "osteo/hospital/pacs/peer.h"

namespace osteo::inline hospital {

/// Slower than this an object does not come for long.
inline constexpr double kReceiveBytesPerS = 100'000;

struct ReceiveOptions {
  std::string ae = "OSTEOTOME";       ///< a peer must call us so
  std::string address = "127.0.0.1";  ///< IPv4 to listen on
  int port = 11112;                   ///< 0: any free one (told to `listening`)
  std::vector<std::string> allowed;   ///< titles that may send; empty: anybody, which must be asked for
  bool anybody = false;
  DicomTls tls;  ///< when `ca` is named, all three are needed, and who has no certificate from it is not let in
  int most_associations = 20;  ///< at once; more are rejected ("local limit exceeded")
  double object_gb = 2;        ///< a larger object is rejected
  double folder_gb = 100;      ///< all series that are there now; beyond it objects are rejected (A700)
  double keep_free_gb = 1;     ///< of the disk
  double memory_mb = 512;      ///< of an association's process
  double timeout_s = 30;  ///< for a peer to say something, and for a message to be whole: an object's may take a second
                          ///< more for each kReceiveBytesPerS of it that have come
  double association_s = 3600;  ///< longest
  double quiet_s = 30;          ///< a series is closed when nothing of it came for so long
};

struct ReceiveCounters {
  std::uint64_t associations = 0, refused_associations = 0, died = 0;  ///< died: processes ended by a limit or a fault
  std::uint64_t stored = 0, again = 0, refused = 0, bytes = 0;         ///< again: had the same object already
  std::uint64_t timed_out = 0;         ///< associations ended for timeout_s or association_s
  std::uint64_t closed = 0, gone = 0;  ///< series; those moved or deleted before they were closed
  [[nodiscard]] bool operator==(const ReceiveCounters&) const = default;
};

/// A series all of whose objects have come, as far as one can tell: more may come later, and it is then closed again.
struct ClosedSeries {
  fs::path folder;  ///< FOLDER/study-xxxxxxxxxxxx/series-xxxxxxxxxxxx: names from hashes of the UIDs
  std::uint64_t objects = 0, bytes = 0;
  std::set<std::string>
      from;  ///< titles of the nodes that have sent of it since it was open; not known after a restart
};

struct ReceiveEvents {
  std::function<void(int port)> listening;
  std::function<void(const ClosedSeries&)>
      closed;  ///< called between connections: what takes long belongs into another process
  std::function<void(const ReceiveCounters&)> counters;  ///< at most once a second, when they changed, and at the end
};

/// Serves until the context is cancelled (then series still open are left as they are, and closed at the next start:
/// what is in the folder and has no CLOSED file counts as having just come). Whatever is moved, deleted or filled in
/// the folder meanwhile is warned of once and ends nothing. Must be called while the process has one thread. Errors:
/// usage, cannot_write (also where another node receives into the folder), failed (port taken).
void receive_objects(const fs::path& folder, const ReceiveOptions& options, const ReceiveEvents& events,
                     const Context& context);

/// What a monitoring system reads (Prometheus' text form, version 0.0.4).
[[nodiscard]] std::string metrics_text(const ReceiveCounters& counters);

}  // namespace osteo::inline hospital
