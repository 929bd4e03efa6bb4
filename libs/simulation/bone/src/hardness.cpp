#include "osteo/simulation/bone/hardness.h"

#include <algorithm>
#include <cmath>

#include "hardness_json.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/json.h"
#include "osteo/core/base/portable_math.h"
#include "osteo/geometry/grid/brick_places.h"
#include "osteo/geometry/grid/sampler.h"

namespace osteo::inline simulation {

double HardnessLaw::at(double hu) const {
  const double density = std::max(0.0, (hu - zero_hu) / (cortical_hu - zero_hu));
  return std::clamp(exponent == 1 ? density : portable::pow(density, exponent), least, most);
}

HardnessLaw parse_hardness(std::string_view text, const std::string& name) {
  const JsonFile file(text, name);
  HardnessLaw law;
  int version = 0;
  std::string source;
  auto fields = fields_of<HardnessLaw>(law);
  detail::FieldCollector others;
  others({"osteotome_hardness", "version of the format", "", 1, 1, true}, version);
  others({"source", "where the constants are from"}, source);
  fields.insert(fields.end(), others.fields.begin(), others.fields.end());
  file.read(file.root(), "", fields);
  if (!(law.zero_hu < law.cortical_hu)) throw file.wrong(file.root(), "\"zero_hu\" must be below \"cortical_hu\"");
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
    const auto value = static_cast<double>(sampler.nearest(place_of_voxel_mm(bone, v)));
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

}  // namespace osteo::inline simulation
