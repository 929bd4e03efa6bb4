// What calls have in common that cannot mean anything.
#pragma once
#include <cmath>
#include <span>
#include <string>

#include "osteo/core/base/error.h"

namespace osteo::statistics {

[[noreturn]] inline void refuse(const std::string& what) {
  throw Error(ExitCode::usage, "statistics: " + what);
}
inline void need_finite(std::span<const double> values, const char* called) {
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!std::isfinite(values[i]))
      refuse(std::string(called) + ", value " + std::to_string(i + 1) + ", is not a number");
  }
}
inline void need_same_size(std::size_t a, std::size_t b) {
  if (a != b) refuse("lists of " + std::to_string(a) + " and " + std::to_string(b) + " values do not fit together");
}
inline void need_level(double level) {
  if (!(level > 0 && level < 1)) refuse("the level of an interval lies between 0 and 1");
}

}  // namespace osteo::statistics
