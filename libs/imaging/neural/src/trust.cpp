#include "osteo/imaging/neural/detail/trust.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "osteo/core/base/error.h"
#include "osteo/core/base/json_document.h"
#include "osteo/core/base/parallel.h"
#include "osteo/core/base/param.h"
#include "osteo/imaging/neural/detail/half.h"

namespace osteo::inline imaging {
namespace {

[[noreturn]] void reject_calibration(const std::string& why) {
  throw Error(ExitCode::corrupt, "calibration.json: " + why, "make it again, or take it out of the folder");
}

double number_of(const Json* value, const std::string& what, double low, double high) {
  const auto n = value != nullptr ? value->number() : std::nullopt;
  if (!n || !(*n >= low && *n <= high))
    reject_calibration("'" + what + "' is not a number from " + format_number(low) + " to " + format_number(high));
  return *n;
}

// Of one class: its voxels, its probability over them and over all.
struct Sums {
  double found = 0, of_found = 0, of_all = 0;
};

std::string doubt_of(const StructureTrust& t, const StructureCalibration& c) {
  if (t.volume_mm3 == 0) return "not found";
  std::string why;
  const auto add = [&](const std::string& text) { why += (why.empty() ? "" : "; ") + text; };
  const auto volume = format_number(std::round(t.volume_mm3)) + " mm3";
  if (t.volume_mm3 < c.least_mm3) add(volume + ", less than " + format_number(std::round(c.least_mm3)));
  if (t.volume_mm3 > c.most_mm3) add(volume + ", more than " + format_number(std::round(c.most_mm3)));
  if (t.expected_dice < c.least_dice)
    add("expected Dice " + format_number(std::round(100 * t.expected_dice) / 100) + ", below " +
        format_number(std::round(100 * c.least_dice) / 100));
  return why;
}

}  // namespace

NetworkCalibration read_network_calibration(std::string_view text, const NetworkModel& model) {
  const auto json = Json::parse(text);
  if (!json) reject_calibration("it is not JSON");
  number_of(json->find("osteotome_calibration"), "osteotome_calibration", 1, 1);
  NetworkCalibration c;
  c.temperature = number_of(json->find("temperature"), "temperature", 0.05, 20);
  const Json* const rows = json->find("structures");
  if (rows == nullptr || rows->items().empty()) reject_calibration("'structures' is missing");
  for (const Json& row : rows->items()) {
    StructureCalibration s;
    s.value = static_cast<int>(number_of(row.find("value"), "value", 1, 255));
    const auto named =
        std::find_if(model.names.begin(), model.names.end(), [&](const auto& n) { return n.first == s.value; });
    if (named == model.names.end()) reject_calibration("the network has no label " + std::to_string(s.value));
    s.name = named->second;
    s.least_mm3 = number_of(row.find("least_mm3"), "least_mm3", 0, 1e9);
    s.most_mm3 = number_of(row.find("most_mm3"), "most_mm3", s.least_mm3, 1e9);
    s.least_dice = number_of(row.find("least_dice"), "least_dice", 0, 1);
    if (const Json* const table = row.find("boundary_mm")) {
      for (const Json& pair : table->items()) {
        if (pair.items().size() != 2) reject_calibration("'boundary_mm' is not a list of pairs");
        const auto low = s.boundary_mm.empty() ? std::array{0.0, 0.0} : s.boundary_mm.back();
        s.boundary_mm.push_back({number_of(&pair.items()[0], "boundary_mm", low[0], 100),
                                 number_of(&pair.items()[1], "boundary_mm", low[1], 100)});
        if (s.boundary_mm.size() > 1 && s.boundary_mm.back()[0] == low[0])
          reject_calibration("'boundary_mm' has a width twice");
      }
      if (s.boundary_mm.empty()) reject_calibration("'boundary_mm' is empty");
    }
    c.structures.push_back(s);
  }
  return c;
}

std::vector<StructureTrust> trust_in(const NetworkLogits& logits, const NetworkModel& model,
                                     const NetworkCalibration& calibration, const Context& context) {
  if (model.regions) throw Error(ExitCode::usage, "a network of regions has no calibration");
  const std::size_t classes = model.values.size(), voxels = voxels_of(logits.size);
  const auto planes = static_cast<std::size_t>(logits.size[0]);
  const std::size_t plane = voxels / std::max<std::size_t>(planes, 1);
  // Plane by plane, and then the planes in order: the same sums for any number of threads.
  std::vector<Sums> parts(planes * classes);
  parallel_for(planes, 1, context.threads, [&](std::size_t begin, std::size_t end) {
    context.check_cancelled();
    std::vector<double> p(classes);
    for (std::size_t v = begin * plane; v < end * plane; ++v) {
      std::size_t best = 0;
      for (std::size_t c = 0; c < classes; ++c) {
        p[c] = static_cast<double>(float_from_half(logits.values[c * voxels + v]));
        if (p[c] > p[best]) best = c;
      }
      const double top = p[best];
      double sum = 0;
      for (double& x : p) sum += x = std::exp((x - top) / calibration.temperature);
      Sums* const part = parts.data() + v / plane * classes;
      for (std::size_t c = 0; c < classes; ++c) part[c].of_all += p[c] / sum;
      part[best].found += 1;
      part[best].of_found += p[best] / sum;
    }
  });
  const double voxel_mm3 = logits.grid_mm[0] * logits.grid_mm[1] * logits.grid_mm[2];
  std::vector<StructureTrust> rows;
  for (const StructureCalibration& s : calibration.structures) {
    const auto at = std::find(model.values.begin(), model.values.end(), s.value);
    if (at == model.values.end()) reject_calibration("the network has no label " + std::to_string(s.value));
    const auto c = static_cast<std::size_t>(at - model.values.begin());
    Sums all;
    for (std::size_t z = 0; z < planes; ++z) {
      all.found += parts[z * classes + c].found;
      all.of_found += parts[z * classes + c].of_found;
      all.of_all += parts[z * classes + c].of_all;
    }
    StructureTrust t;
    t.name = s.name;
    t.volume_mm3 = all.found * voxel_mm3;
    t.expected_dice = all.found > 0 ? 2 * all.of_found / (all.found + all.of_all) : 0;
    t.doubt = doubt_of(t, s);
    rows.push_back(t);
  }
  return rows;
}

}  // namespace osteo::inline imaging
