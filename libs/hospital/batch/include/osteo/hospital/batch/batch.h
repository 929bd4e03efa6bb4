// Many cases, each in a process of its own: one that fails, hangs or eats memory never stops the others, and what was
// done is not done again. The folder OUT holds
//   batch.json            what makes it a batch; another batch into it at once is rejected
//   cases/CODE/           the cases, as the work made them, and what it wrote beside them
//   records/CODE.json     how each went, written whole when it ended
//   report.html .json .csv
// No name of a scan, nor any value of the table but the code, is in records or reports.
#pragma once
#include <filesystem>
#include <functional>
#include <set>
#include <string>
#include <vector>

#include "osteo/core/base/context.h"
#include "osteo/core/base/json_document.h"
#include "osteo/hospital/batch/children.h"
#include "osteo/hospital/batch/table.h"

namespace osteo::inline hospital {

enum class CaseState {
  waiting,    ///< not tried yet, or interrupted
  done,       ///<
  refused,    ///< for its input (exit codes 3 to 5)
  failed,     ///< for another reason that comes again: flags, outputs in the way, the method (1, 2, 6, 7)
  resources,  ///< out of memory or time, or killed: another try may go well
};
[[nodiscard]] std::string_view state_name(CaseState state);

/// How a case went.
struct CaseRecord {
  std::string code;
  std::string key;  ///< of its row, the pipeline and what the source looked like (sizes and times of files)
  CaseState state = CaseState::waiting;
  int exit_code = 0;
  int tries = 0;
  double seconds = 0, peak_mb = 0;    ///< of the last try
  std::string verdict;                ///< on the scan: good, repaired, rejected; empty where none was given
  std::vector<std::string> findings;  ///< their codes
  double volume_mm3 = 0;              ///< of bone; 0 where not known
  std::int64_t triangles = 0;         ///< of its surface
  std::string why, advice;            ///< what went wrong, without names
  std::string program;                ///< version

  [[nodiscard]] Json to_json() const;
  /// Error(corrupt)
  [[nodiscard]] static CaseRecord from_json(std::string_view text, const std::string& name);
};

struct BatchOptions {
  std::filesystem::path out;
  std::string program;         ///< version, for the records
  std::string key;             ///< of all that the cases have in common: a change makes them all again
  int jobs = 1;                ///< cases at a time
  double memory_mb = 0;        ///< of each; 0: no bound
  double seconds = 0;          ///< of each try; 0: no bound
  int retries = 1;             ///< further tries of a case that ended for memory, time or a signal
  bool retry_failed = false;   ///< also try again, once, what an earlier run has rejected or seen fail
  double keep_free_mb = 0;     ///< on the disk of OUT; with less, no case is begun
  std::set<std::string> only;  ///< codes; empty: all
};

struct BatchResult {
  std::size_t cases = 0, done = 0, refused = 0, failed = 0, resources = 0, waiting = 0;
  std::size_t untouched = 0;  ///< of those, known from earlier runs
  std::string stopped;        ///< why not all were tried; empty when all were
};

/// Makes one case at `folder` (OUT/cases/CODE); runs in a child process, so what it leaves in memory is lost. Gives the
/// exit code, and writes to standard output what a command writes with --json: "stages" with their reports, or "error"
/// and "verdict".
using CaseWork = std::function<int(const BatchCase& row, const std::filesystem::path& folder)>;

/// Runs what is not done yet, in the order of the table, and writes the report. Cancelled through the context it asks
/// the running cases to end, writes the report and throws Error(cancelled). Memory does not grow with the number of
/// cases but for their rows. Errors: cannot_write where OUT holds something that is no batch, or another run is at work
/// in it; usage for codes in `only` that the table does not have.
BatchResult run_batch(const std::vector<BatchCase>& table, const BatchOptions& options, const CaseWork& work,
                      const Context& context);

/// OUT/report.html, .json and .csv of what the records say. A record that cannot be read counts as waiting.
BatchResult write_batch_report(const std::vector<BatchCase>& table, const std::filesystem::path& out);

/// What became of a case whose child has ended; `folder` is where the case is.
[[nodiscard]] CaseRecord record_of(const BatchCase& row, const std::string& key, const ChildEnd& end, int tries,
                                   const ChildLimits& limits, const std::filesystem::path& folder);

/// A message without names of files: of what is in quotation marks, that which looks like a path or a file's name, or
/// is one in `source`.
[[nodiscard]] std::string without_names(const std::string& text, const std::filesystem::path& source);

}  // namespace osteo::inline hospital
