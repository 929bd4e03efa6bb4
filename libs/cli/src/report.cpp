#include "osteo/cli/report.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <ostream>

#include "osteo/base/files.h"
#include "osteo/base/json_document.h"
#include "osteo/pipeline/report_json.h"

namespace osteo::cli {
namespace {
constexpr std::size_t kFactColumn = 34;
}

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

std::pair<std::string, std::string> fact_text(const std::string& key, const ReportValue& value) {
  static constexpr std::array<std::pair<std::string_view, std::string_view>, 14> kUnits{{{"_mm3", "mm3"},
                                                                                         {"_mm2", "mm2"},
                                                                                         {"_mm", "mm"},
                                                                                         {"_hu", "HU"},
                                                                                         {"_deg", "degrees"},
                                                                                         {"_percent", "%"},
                                                                                         {"_mb", "MB"},
                                                                                         {"_ms", "ms"},
                                                                                         {"_s", "s"},
                                                                                         {"_n", "N"},
                                                                                         {"_kpa", "kPa"},
                                                                                         {" mm3", "mm3"},
                                                                                         {"_max_voxels", "voxels, the most"},
                                                                                         {"_mean_voxels", "voxels on average"}}};
  std::string name = key, text = short_text(value);
  if (!std::holds_alternative<bool>(value) && !std::holds_alternative<std::string>(value)) {
    for (const auto& [ending, unit] : kUnits) {
      if (!name.ends_with(ending) || name.size() == ending.size()) continue;
      name.resize(name.size() - ending.size());
      text.append(" ").append(unit);
      break;
    }
  }
  std::replace(name.begin(), name.end(), '_', ' ');
  return {name, text};
}

std::string error_json(const Error& error) {
  const auto* doc =
      std::find_if(std::begin(exit_code_table), std::end(exit_code_table), [&](const auto& d) { return d.code == error.code(); });
  Json j;
  j["error"] = {{"exit_code", static_cast<int>(error.code())},
                {"name", doc == std::end(exit_code_table) ? "" : std::string(doc->name)},
                {"message", error.what()},
                {"advice", error.advice()}};
  if (const auto* e = dynamic_cast<const ErrorWithDocument*>(&error)) {
    j[e->port()] = Json::parse(e->document().json).value_or(e->document().json);
  }
  return j.dump(2) + "\n";
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
      invocation.err << '\n';
      for (const auto& [key, value] : r.report) {
        const auto [name, text] = fact_text(key, value);
        invocation.err << "    " << name << std::string(name.size() < kFactColumn ? kFactColumn - name.size() : 1, ' ') << text << '\n';
      }
      for (const auto& [port, path] : r.outputs) invocation.err << "  " << port << " -> " << path.string() << '\n';
    }
  }
  if (!invocation.common.json) return;
  Json list = Json::list();
  for (const NodeResult& r : results) {
    Json o{{"id", r.id},           {"stage", r.stage},   {"reused", r.reused},
           {"seconds", r.seconds}, {"params", r.params}, {"report", report_to_json(r.report)}};
    for (const auto& [port, path] : r.outputs) o["outputs"][port] = path.string();
    list.push_back(o);
  }
  invocation.out << Json{{"stages", list}, {"peak_memory_mb", peak_memory_mb()}}.dump(2) << '\n';
}

}  // namespace osteo::cli
