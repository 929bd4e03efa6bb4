#include "progress.h"
#include "osteo/core/base/json_document.h"

#include <algorithm>
#include <cmath>
#include <ostream>

namespace osteo::inline app::cli {

ProgressPrinter::ProgressPrinter(ProgressStyle style, bool quiet, std::ostream& err, bool terminal)
    : style_(style == ProgressStyle::automatic ? (terminal ? ProgressStyle::bar : ProgressStyle::none) : style),
      quiet_(quiet),
      err_(err),
      start_(std::chrono::steady_clock::now()) {
  if (quiet_) style_ = ProgressStyle::none;
}

void ProgressPrinter::update(double fraction, std::string_view activity) {
  if (style_ == ProgressStyle::none) return;
  const std::lock_guard lock(mutex_);
  if (!activity.empty()) activity_ = activity;
  fraction = std::clamp(fraction, 0.0, 1.0);
  const auto now = std::chrono::steady_clock::now();
  if (style_ == ProgressStyle::bar) {
    if (now - start_ < std::chrono::milliseconds(500) || now - last_ < std::chrono::milliseconds(100)) return;
    last_ = now;
    bar_shown_ = true;
    constexpr int kWidth = 30;
    const int filled = static_cast<int>(std::lround(fraction * kWidth));
    err_ << "\r[" << std::string(static_cast<std::size_t>(filled), '#')
         << std::string(static_cast<std::size_t>(kWidth - filled), '.') << "] " << static_cast<int>(fraction * 100)
         << " %  " << activity_ << "\x1b[K" << std::flush;
    return;
  }
  // Machines read each step once, and never backwards.
  if (fraction <= shown_ || (fraction - shown_ < 0.01 && fraction < 1)) return;
  shown_ = fraction;
  if (style_ == ProgressStyle::json) {
    Json line;
    line["progress"] = std::round(fraction * 1000) / 1000;
    line["activity"] = activity_;
    err_ << line.dump() << '\n' << std::flush;
  } else {
    err_ << "<filter-progress>" << fraction << "</filter-progress>\n<filter-comment>" << activity_
         << "</filter-comment>\n"
         << std::flush;
  }
}

void ProgressPrinter::message(std::string_view text) {
  const std::lock_guard lock(mutex_);
  clear_locked();
  if (!quiet_) err_ << text << '\n' << std::flush;
}

void ProgressPrinter::clear() {
  const std::lock_guard lock(mutex_);
  clear_locked();
}

void ProgressPrinter::clear_locked() {
  if (!bar_shown_) return;
  err_ << "\r\x1b[K" << std::flush;
  bar_shown_ = false;
}

}  // namespace osteo::inline app::cli
