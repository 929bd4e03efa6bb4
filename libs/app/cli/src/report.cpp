#include "osteo/app/cli/report.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <ostream>

#include "osteo/core/base/files.h"
#include "osteo/core/base/json_document.h"
#include "osteo/imaging/pipeline/report_json.h"

namespace osteo::inline app::cli {
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

namespace {

// At most so many decimals; what would be shown as none of it, though it is not, keeps two digits that mean something.
std::string decimals(double v, int places) {
  const double scale = std::pow(10, places), rounded = std::round(v * scale) / scale;
  if (v == 0 || std::abs(v) * scale >= 10) return format_number(rounded == 0 ? 0 : rounded);
  const double two = std::pow(10, 1 - std::floor(std::log10(std::abs(v))));
  return format_number(std::round(v * two) / two);
}
// Four digits that mean something, at most.
std::string four(double v) {
  return short_text(v);
}
std::string large(double v, const char* small_unit, const char* large_unit, double ratio) {
  return std::abs(v) < ratio ? four(v) + " " + small_unit : four(v / ratio) + " " + large_unit;
}

// A number with the digits and the unit that the ending of its name asks for; the ending goes.
bool with_unit(std::string& name, double v, std::string& text) {
  const auto ends = [&](std::string_view ending) {
    if (!name.ends_with(ending) || name.size() == ending.size()) return false;
    name.resize(name.size() - ending.size());
    return true;
  };
  if (ends("_mm3") || ends(" mm3")) {
    text = large(v, "mm3", "cm3", 1000);
  } else if (ends("_mm2")) {
    text = large(v, "mm2", "cm2", 100);
  } else if (ends("_mm")) {
    text = decimals(v, 2) + " mm";
  } else if (ends("_hu")) {
    text = std::abs(v) < 10 ? decimals(v, 1) + " HU" : format_number(std::round(v)) + " HU";
  } else if (ends("_deg")) {
    text = decimals(v, 1) + " degrees";
  } else if (ends("_percent")) {
    text = v != 0 && std::abs(v) < 0.05 ? "less than 0.1 %" : decimals(v, 1) + " %";
  } else if (ends("_mb")) {
    text = decimals(v, std::abs(v) < 10 ? 1 : 0) + " MB";
  } else if (ends("_max_voxels")) {
    text = four(v) + " voxels, the most";
  } else if (ends("_mean_voxels")) {
    text = four(v) + " voxels on average";
  } else {
    for (const auto& [ending, unit] :
         {std::pair{"_ms", "ms"}, std::pair{"_s", "s"}, std::pair{"_n", "N"}, std::pair{"_kpa", "kPa"}}) {
      if (!ends(ending)) continue;
      text = four(v) + " " + unit;
      return true;
    }
    return false;
  }
  return true;
}

// What imaging staff call it, where the name of the fact is not that.
constexpr std::array<std::array<std::string_view, 3>, 19> kWords{
    {{"source_kind", "source", ""},
     {"slice_gap_min_mm", "least distance of slices", ""},
     {"slice_gap_max_mm", "greatest distance of slices", ""},
     {"position_error_mm", "a pixel is out of place by", ""},
     {"axes", "axes of the voxels point to", ""},
     {"hu_min", "lowest value", "HU"},
     {"hu_max", "highest value", "HU"},
     {"looks_like_hu", "values look like HU", ""},
     {"lower_hu", "threshold", ""},
     {"change_percent_per_50_hu", "50 HU either way change bone by", "%"},
     {"table", "table, head holder", ""},
     {"outside_body_mm3", "taken off outside the body", ""},
     {"small_pieces_mm3", "small fragments dropped", ""},
     {"mask_volume_mm3", "bone by the mask", ""},
     {"volume_before_mm3", "bone by the mask", ""},
     {"volume_after_mm3", "bone in the case", ""},
     {"volume_change_percent", "difference", ""},
     {"volume_change_unshifted_percent", "difference without the shift", ""},
     {"boundary_offset_hu", "threshold shifted by", ""}}};

}  // namespace

std::pair<std::string, std::string> fact_text(const std::string& key, const ReportValue& value) {
  std::string name = key, text = short_text(value);
  const bool is_number = std::holds_alternative<double>(value) || std::holds_alternative<std::int64_t>(value);
  const double number = std::holds_alternative<double>(value) ? std::get<double>(value)
                        : is_number                           ? static_cast<double>(std::get<std::int64_t>(value))
                                                              : 0;
  if (is_number) static_cast<void>(with_unit(name, number, text));
  std::replace(name.begin(), name.end(), '_', ' ');
  for (const auto& [fact, words, unit] : kWords) {
    if (key != fact) continue;
    name = words;
    if (!unit.empty()) text = (unit == "%" ? decimals(number, 1) : short_text(value)) + " " + std::string(unit);
  }
  return {name, text};
}

std::string error_json(const Error& error) {
  const auto* doc = std::find_if(std::begin(exit_code_table), std::end(exit_code_table),
                                 [&](const auto& d) { return d.code == error.code(); });
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
        invocation.err << "    " << name << std::string(name.size() < kFactColumn ? kFactColumn - name.size() : 1, ' ')
                       << text << '\n';
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

}  // namespace osteo::inline app::cli
