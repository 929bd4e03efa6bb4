#include "osteo/assessment/scoring/hint_reader.h"

#include <algorithm>

namespace osteo::inline assessment {

std::vector<Measured> heat_values(const HeatReader& heat, const StructureMap* structures) {
  std::vector<Measured> values{measured("heat_bone_c", heat.hottest_c())};
  if (structures == nullptr) {
    not_measured_all(values, MetricPlace::heat, {MetricWhen::structures}, "the case has no structures");
    return values;
  }
  const auto warm = heat.structures();
  for (const std::uint8_t s : structures->values()) {
    const auto found = warm.find(s);
    const ThermalDose worst = found == warm.end() ? ThermalDose{} : found->second.worst;
    const std::string name = structures->name_of(s);
    values.push_back(measured("heat_peak_c", std::max(worst.peak_c, HeatOfCutting{}.body_c), name));
    values.push_back(measured("heat_cem43_min", worst.cem43_min, name));
  }
  return values;
}

}  // namespace osteo::inline assessment
