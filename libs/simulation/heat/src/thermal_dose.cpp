#include "osteo/simulation/heat/heat_field.h"

#include <algorithm>

#include "osteo/core/base/portable_math.h"

namespace osteo::inline simulation {

double cem43_per_s(double celsius) noexcept {
  if (!(celsius >= 39)) return 0;
  return portable::pow(celsius >= 43 ? 0.5 : 0.25, 43 - std::min(celsius, 100.0)) / 60;
}

void ThermalDose::stay(double celsius, double seconds) noexcept {
  peak_c = std::max(peak_c, celsius);
  cem43_min += cem43_per_s(celsius) * seconds;
  coagulated = coagulated || celsius >= kCoagulatedC;
}

}  // namespace osteo::inline simulation
