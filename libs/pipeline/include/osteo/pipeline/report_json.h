// Reports as JSON. Include only in source files: the JSON header is heavy.
#pragma once
#include <nlohmann/json.hpp>

#include "osteo/base/context.h"

namespace osteo {

[[nodiscard]] inline nlohmann::ordered_json report_to_json(const Report& report) {
  auto object = nlohmann::ordered_json::object();
  for (const auto& [key, value] : report) {
    std::visit([&, &name = key](const auto& v) { object[name] = v; }, value);
  }
  return object;
}

[[nodiscard]] inline Report report_from_json(const nlohmann::ordered_json& object) {
  Report report;
  for (const auto& [key, value] : object.items()) {
    if (value.is_boolean()) {
      report.emplace_back(key, value.get<bool>());
    } else if (value.is_number_integer()) {
      report.emplace_back(key, value.get<std::int64_t>());
    } else if (value.is_number()) {
      report.emplace_back(key, value.get<double>());
    } else {
      report.emplace_back(key, value.get<std::string>());
    }
  }
  return report;
}

}  // namespace osteo
