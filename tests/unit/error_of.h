// What an Error says.
#pragma once
#include <string>

#include "osteo/core/base/error.h"

namespace osteo::test {

/// Empty where nothing is thrown.
template <class F>
std::string error_of(F&& f) {
  try {
    f();
  } catch (const Error& e) {
    return e.what();
  }
  return {};
}

}  // namespace osteo::test
