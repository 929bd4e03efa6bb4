#include "osteo/imaging/pipeline/report_json.h"

namespace osteo::inline imaging {

Json report_to_json(const Report& report) {
  Json object = Json::object();
  for (const auto& [key, value] : report) {
    std::visit([&, &name = key](const auto& v) { object[name] = v; }, value);
  }
  return object;
}

Report report_from_json(const JsonValue& object) {
  Report report;
  for (const auto& [key, value] : object.members) {
    if (value.kind == JsonValue::Kind::flag) report.emplace_back(key, value.flag);
    if (value.kind == JsonValue::Kind::number && value.whole)
      report.emplace_back(key, static_cast<std::int64_t>(value.number));
    if (value.kind == JsonValue::Kind::number && !value.whole) report.emplace_back(key, value.number);
    if (value.kind == JsonValue::Kind::text) report.emplace_back(key, value.text);
  }
  return report;
}

}  // namespace osteo::inline imaging
