#include "osteo/cli/report.h"

#include <cmath>
#include <nlohmann/json.hpp>
#include <ostream>

#include "osteo/base/files.h"
#include "osteo/pipeline/report_json.h"

namespace osteo::cli {

std::string short_text(const ReportValue& value) {
  if (const auto* b = std::get_if<bool>(&value)) return *b ? "yes" : "no";
  if (const auto* i = std::get_if<std::int64_t>(&value)) return std::to_string(*i);
  if (const auto* d = std::get_if<double>(&value)) {
    if (*d == 0) return "0";
    const double scale = std::pow(10, 4 - std::floor(std::log10(std::abs(*d))) - 1);
    return format_number(std::abs(*d) >= 10000 ? std::round(*d) : std::round(*d * scale) / scale);
  }
  return std::get<std::string>(value);
}

void print_results(const std::vector<NodeResult>& results, Invocation& invocation) {
  if (!invocation.common.quiet) {
    for (const NodeResult& r : results) {
      invocation.err << r.id << ": ";
      if (r.reused && r.outputs.empty()) {
        invocation.err << "not needed\n";
        continue;
      }
      if (r.reused) {
        invocation.err << "unchanged";
      } else {
        invocation.err << format_number(std::round(r.seconds * 100) / 100) << " s";
      }
      for (const auto& [key, value] : r.report) invocation.err << "; " << key << ' ' << short_text(value);
      invocation.err << '\n';
      for (const auto& [port, path] : r.outputs) invocation.err << "  " << port << " -> " << path.string() << '\n';
    }
  }
  if (!invocation.common.json) return;
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const NodeResult& r : results) {
    nlohmann::ordered_json o{{"id", r.id},           {"stage", r.stage},   {"reused", r.reused},
                             {"seconds", r.seconds}, {"params", r.params}, {"report", report_to_json(r.report)}};
    for (const auto& [port, path] : r.outputs) o["outputs"][port] = path.string();
    list.push_back(o);
  }
  invocation.out << nlohmann::ordered_json{{"stages", list}, {"peak_memory_mb", peak_memory_mb()}}.dump(2) << '\n';
}

}  // namespace osteo::cli
