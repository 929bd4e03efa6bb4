// A folder into which scans come: each series that a rule matches goes through its pipeline once, and again when slices
// come late.
//   OUT/watch.json          what makes it one; a second watcher into it is rejected
//   OUT/records/CODE.json   the journal: what was done with a series, and of which objects; CODE is a hash of the
//   series' UID OUT/cases/CODE, CODE-2  the cases; a case is never made again in place of one that is there
//   OUT/sources/CODE        links to (or copies of) a series' files, where they lie among those of others
// Records and events hold no identity.
#pragma once
#include <functional>
#include <string>
#include <vector>

#include "osteo/core/base/context.h"
#include "osteo/core/base/files.h"
#include "osteo/hospital/batch/batch.h"
#include "osteo/hospital/pacs/rules.h"

namespace osteo::inline hospital {

struct WatchOptions {
  fs::path folder, out;
  double quiet_s = 30;  ///< a series is taken when none of its files has come or changed for so long
  double poll_s = 2;    ///< between looks
  int jobs = 1;
  double memory_mb = 4000, seconds = 3600;  ///< of a case; 0: no bound
  int retries = 1;                          ///< of a case that ended for memory, time or a signal
  double keep_free_mb = 500;                ///< on the disk of OUT; with less, no case is begun
  bool once = false;                        ///< ends when nothing is left to do, instead of waiting for more
  std::string program;                      ///< version, for the records
  /// When given: brings files into the folder. Called in a process of its own (1 GB, an hour), again poll_s after it
  /// has ended; its standard error is told. After an exit code other than 0 it waits twice as long each time, up to 5
  /// minutes.
  std::function<int()> feed;
};

struct WatchEvent {
  std::string series;  ///< its code
  std::string what;    ///< begun, done, rejected, failed, resources, again; ignored, unmatched; unreadable (a file)
  std::string rule;    ///< its name, where one matched
  std::string why;
  fs::path folder;  ///< of the case; empty where there is none
  std::size_t objects = 0;
};

struct WatchCounters {
  std::size_t series = 0, done = 0, bad = 0, unmatched = 0,
              unreadable = 0;  ///< bad: rejected, failed, out of resources
};

/// Makes the case at `folder` of the scan in `source`; as CaseWork.
using WatchWork = std::function<int(const SeriesRule& rule, const fs::path& source, const fs::path& folder)>;

/// Error(usage) where one would lie in the other. Neither needs to be there.
void check_watch_folders(const fs::path& folder, const fs::path& out);

/// Until the context is cancelled (what runs is asked to end, and begun again at the next start), or with `once` until
/// all is done. Heads of files are read in a process of their own: one that brings it down is set aside and told. Must
/// be called while the process has one thread. Polls, so that it works on any file system; a look costs a stat() of
/// each file. Errors: no_input; failed where `feed` failed and `once` is set; cannot_write where OUT holds something
/// else or another watcher is at work.
WatchCounters watch_folder(const std::vector<SeriesRule>& rules, const WatchOptions& options, const WatchWork& work,
                           const std::function<void(const WatchEvent&, const WatchCounters&)>& notify,
                           const Context& context);

/// As metrics_text() of receive.h.
[[nodiscard]] std::string metrics_text(const WatchCounters& counters);

}  // namespace osteo::inline hospital
