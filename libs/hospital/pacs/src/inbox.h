// The folder of a receiving node, as it is now: how much is in it, and which series are still coming. People and
// programs move and delete in it at any time, so what is not there any more is never an error. Time is reported by
// whoever has a clock. Private to libs/hospital/pacs.
#pragma once
#include <chrono>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "osteo/core/base/files.h"
#include "osteo/hospital/pacs/receive.h"

namespace osteo::inline hospital::pacs {

class Inbox {
 public:
  using Time = std::chrono::steady_clock::time_point;
  using Warn = std::function<void(const std::string&)>;
  Inbox(fs::path folder, double quiet_s, Warn warn)
      : folder_(std::move(folder)), quiet_s_(quiet_s), warn_(std::move(warn)) {}

  /// Bytes of all files in study-*/series-*. Cost: looks at each folder, and at the files of those that have changed
  /// within the last seconds of these calls; nothing is read. What cannot be looked at is warned of, once, and does not
  /// count.
  [[nodiscard]] std::uint64_t measure(Time now);
  /// Series that hold objects and no CLOSED file, as after a start: as if something of them had just come.
  void open_unclosed(Time now);
  /// Something of a series (its folder below the inbox) has come: it is open, closed or not.
  void came(const fs::path& series, Time now);
  /// Closes each open series of which nothing came for quiet_s. One that was moved, deleted or emptied meanwhile is
  /// warned of, once, and forgotten; one whose CLOSED file cannot be written is warned of, once, and tried again after
  /// another quiet_s.
  [[nodiscard]] std::vector<ClosedSeries> close_quiet(Time now);
  [[nodiscard]] std::size_t open() const { return open_.size(); }
  /// Series that went before they were closed.
  [[nodiscard]] std::uint64_t gone() const { return gone_; }

 private:
  struct Open {
    Time came;
    bool warned = false;
  };
  struct Measured {
    std::int64_t changed_ns = 0;  // of the folder, by the disk's clock: only whether it is another than before
    Time first_seen;
    bool settled = false;  // measured well after the folder's last change
    std::uint64_t bytes = 0, round = 0;
  };
  void each_series(const std::function<void(const fs::path&)>& use);
  void complain(const fs::path& path, const std::error_code& why);

  const fs::path folder_;
  const double quiet_s_;
  const Warn warn_;
  std::map<fs::path, Open> open_;
  std::map<fs::path, Measured> measured_;
  std::uint64_t round_ = 0, gone_ = 0;
  bool complained_ = false;
};

}  // namespace osteo::inline hospital::pacs
