// Errors carry a stable exit code, a chain of context, and advice for the person who reads them.
#pragma once
#include <stdexcept>
#include <string>
#include <string_view>

namespace osteo {

/// Process exit codes. Documented in docs/reference/exit-codes.md, which is generated from `exit_code_table`.
enum class ExitCode : int {
  ok = 0,
  unspecified = 1,
  usage = 2,
  no_input = 3,
  corrupt = 4,
  cannot_read = 5,
  cannot_write = 6,
  failed = 7,
  partial = 8,
  resources = 9,
  cancelled = 130,
};

struct ExitCodeDoc {
  ExitCode code;
  std::string_view name;
  std::string_view meaning;
};

inline constexpr ExitCodeDoc exit_code_table[] = {
    {ExitCode::ok, "ok", "the work is done"},
    {ExitCode::unspecified, "unspecified", "a defect in the program itself; please report it"},
    {ExitCode::usage, "usage", "the command line or a pipeline file asks for something that does not exist"},
    {ExitCode::no_input, "no_input", "the input does not exist or holds nothing that can be used"},
    {ExitCode::corrupt, "corrupt",
     "the input is damaged, of a kind that is not supported, or a scan that is rejected (its verdict says why)"},
    {ExitCode::cannot_read, "cannot_read", "the input exists but may not be read"},
    {ExitCode::cannot_write, "cannot_write", "the output cannot be written, or exists already"},
    {ExitCode::failed, "failed", "the method failed or its result is not valid; the input could be read"},
    {ExitCode::partial, "partial",
     "part of it could not be done: some cases of a batch failed, actions of a script were rejected, or ticks of a "
     "session were not "
     "recorded"},
    {ExitCode::resources, "resources", "out of memory or time"},
    {ExitCode::cancelled, "cancelled", "interrupted by the user; nothing half-written was left behind"},
};

/// What went wrong (`what()`), where (`in(...)` prefixes, outermost first), and what to do about it (`advice()`).
class Error : public std::runtime_error {
 public:
  Error(ExitCode code, const std::string& what, std::string advice = {})
      : std::runtime_error(what), code_(code), advice_(std::move(advice)) {}

  [[nodiscard]] ExitCode code() const noexcept { return code_; }
  [[nodiscard]] const std::string& advice() const noexcept { return advice_; }

  /// The same error seen from one level further out, e.g. `e.in("stage 'threshold'")`.
  [[nodiscard]] Error in(std::string_view outer) const { return {code_, std::string(outer) + ": " + what(), advice_}; }

 private:
  ExitCode code_;
  std::string advice_;
};

}  // namespace osteo
