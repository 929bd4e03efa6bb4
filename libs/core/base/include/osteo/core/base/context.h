// What the surroundings give to an algorithm: progress, cancellation, threads, seed, log and report.
#pragma once
#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

namespace osteo {

enum class LogLevel { debug, info, warning };

/// A measured fact about a result ("bone_volume_mm3" -> 412345.0). Ends up in the provenance beside the output.
using ReportValue = std::variant<bool, std::int64_t, double, std::string>;
using Report = std::vector<std::pair<std::string, ReportValue>>;

/// Copyable handle; copies share the same sinks. All members may be called from any thread.
class Context {
 public:
  using ProgressSink = std::function<void(double fraction, std::string_view activity)>;
  using LogSink = std::function<void(LogLevel, std::string_view)>;

  Context();

  int threads = 0;         ///< 0 = all cores. Results never depend on it.
  std::uint64_t seed = 1;  ///< for every random choice; recorded in the output

  void on_progress(ProgressSink sink);
  void on_log(LogSink sink);
  /// The flag is polled, never written, by algorithms. It must outlive the context.
  void set_cancel_flag(const std::atomic<bool>* flag);

  /// fraction in [0, 1] of this context's own range; throws Error(cancelled) when the user asked to stop.
  void progress(double fraction, std::string_view activity = {}) const;
  /// Throws Error(cancelled) when the user asked to stop.
  void check_cancelled() const;
  [[nodiscard]] bool cancelled() const noexcept;

  void info(std::string_view message) const;
  void warn(std::string_view message) const;
  void report(std::string_view key, ReportValue value) const;
  /// Takes what has been reported so far and empties the report.
  [[nodiscard]] Report take_report() const;

  /// A context whose progress 0..1 maps to begin..end of this one.
  [[nodiscard]] Context sub(double begin, double end) const;

 private:
  struct Shared;
  std::shared_ptr<Shared> shared_;
  double begin_ = 0.0, end_ = 1.0;
};

}  // namespace osteo
