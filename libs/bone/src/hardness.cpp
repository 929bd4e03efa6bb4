#include "osteo/bone/hardness.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "hardness_json.h"
#include "osteo/base/error.h"
#include "osteo/grid/sampler.h"

namespace osteo {

double HardnessLaw::at(double hu) const {
  const double density = std::max(0.0, (hu - zero_hu) / (cortical_hu - zero_hu));
  return std::clamp(exponent == 1 ? density : std::pow(density, exponent), least, most);
}

HardnessLaw parse_hardness(std::string_view text, const std::string& name) {
  HardnessLaw law;
  std::string where = name;
  try {
    const auto j = nlohmann::ordered_json::parse(text, nullptr, true, true);
    if (!j.is_object() || j.value("osteotome_hardness", 0) != 1) throw Error(ExitCode::usage, "\"osteotome_hardness\" must be 1");
    const auto fields = fields_of<HardnessLaw>(law);
    for (const auto& [key, value] : j.items()) {
      const std::string_view before = text.substr(0, text.find('"' + key + '"'));
      where = name + ", line " + std::to_string(std::count(before.begin(), before.end(), '\n') + 1);
      if (key == "osteotome_hardness" || (key == "source" && value.is_string())) continue;
      const auto f = std::find_if(fields.begin(), fields.end(), [&](const FieldRef& r) { return r.doc.name == key; });
      if (f == fields.end()) {
        std::vector<std::string> known{"source"};
        for (const FieldRef& r : fields) known.emplace_back(r.doc.name);
        const std::string near = nearest_name(key, known);
        throw Error(ExitCode::usage, "there is no \"" + key + "\"" + (near.empty() ? "" : ": did you mean \"" + near + "\"?"));
      }
      if (!value.is_number()) throw Error(ExitCode::usage, "\"" + key + "\" must be a number");
      f->from_text(value.dump());
    }
    where = name;
    if (!(law.zero_hu < law.cortical_hu)) throw Error(ExitCode::usage, "\"zero_hu\" must be below \"cortical_hu\"");
  } catch (const nlohmann::json::exception& e) {
    throw Error(ExitCode::usage, where + ": " + e.what());
  } catch (const Error& e) {
    throw e.in(where);
  }
  return law;
}

std::string_view default_hardness_json() {
  return kHardnessJson;
}

Hardness::Hardness(const BrickGrid& bone, const SparseGrid& hu, const HardnessLaw& law)
    : law_(law), steps_(bone.brick_count() * BrickGrid::kVoxels, 64) {
  const GridSampler sampler(hu);
  for (VoxelKey v = 0; v < steps_.size(); ++v) {
    if (bone.value(v) <= 0) continue;
    const Ijk c = bone.coordinate(v);
    const auto value = static_cast<double>(sampler.nearest(bone.frame().world_from_index({double(c.i), double(c.j), double(c.k)})));
    if (value == hu.background) continue;
    steps_[v] = static_cast<std::uint8_t>(std::lround(64 * law_.at(value)));
  }
}

Hardness::Hardness(const Hardness& whole, std::span<const std::uint32_t> bricks) : law_(whole.law_) {
  steps_.reserve(bricks.size() * BrickGrid::kVoxels);
  for (const std::uint32_t b : bricks) {
    const auto first = whole.steps_.begin() + static_cast<std::ptrdiff_t>(b) * BrickGrid::kVoxels;
    steps_.insert(steps_.end(), first, first + BrickGrid::kVoxels);
  }
}

}  // namespace osteo
