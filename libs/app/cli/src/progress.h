// Shows progress in the style asked for: on standard error, for Slicer on standard output. Private to libs/app/cli.
#pragma once
#include <chrono>
#include <iosfwd>
#include <mutex>
#include <string>

#include "osteo/app/cli/command.h"

namespace osteo::inline app::cli {

/// A bar appears only after 0.5 s and is redrawn at most ten times a second. Thread-safe.
class ProgressPrinter {
 public:
  ProgressPrinter(ProgressStyle style, bool quiet, std::ostream& err, bool terminal);
  void update(double fraction, std::string_view activity);
  void message(std::string_view text);
  /// Removes the bar, if one is shown.
  void clear();

 private:
  void clear_locked();
  ProgressStyle style_;
  bool quiet_;
  std::ostream& err_;
  std::mutex mutex_;
  std::chrono::steady_clock::time_point start_, last_{};
  double shown_ = -1;
  std::string activity_;
  bool bar_shown_ = false;
};

}  // namespace osteo::inline app::cli
