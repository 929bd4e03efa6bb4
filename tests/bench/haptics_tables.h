// What the tables of haptic rendering share.
#pragma once
#include <algorithm>
#include <cstddef>
#include <vector>

#include "osteo/core/base/param.h"
#include "osteo/simulation/haptics/servo.h"

namespace osteo::haptics_tables {

inline constexpr ContactMethod kMethods[] = {ContactMethod::rays, ContactMethod::volume, ContactMethod::overlap,
                                             ContactMethod::proxy};
inline const char* name_of(ContactMethod m) {
  return EnumNames<ContactMethod>::values[static_cast<std::size_t>(m)].data();
}

struct Spread {
  std::vector<double> values;
  void add(double v) { values.push_back(v); }
  double mean() const {
    double s = 0;
    for (const double v : values) s += v / static_cast<double>(values.size());
    return s;
  }
  double at(double q) {
    if (values.empty()) return 0;
    std::sort(values.begin(), values.end());
    return values[std::min(values.size() - 1, static_cast<std::size_t>(q * static_cast<double>(values.size())))];
  }
};

/// Contact models against the truth.
void bench_contact();
void bench_god_object();

}  // namespace osteo::haptics_tables
