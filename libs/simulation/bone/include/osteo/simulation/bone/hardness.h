// How much each voxel of bone resists the burr.
#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "osteo/core/base/param.h"
#include "osteo/core/data/sparse_grid.h"
#include "osteo/geometry/grid/brick_grid.h"

namespace osteo::inline simulation {

/// Energy to remove a volume of bone of some HU over that of dense cortical bone. Form, sources and the built-in
/// constants: libs/simulation/bone/hardness.json.
struct HardnessLaw {
  using Params = HardnessLaw;
  double cortical_hu = 1500, zero_hu = 0, exponent = 1, least = 0.125, most = 3;

  static void describe(HardnessLaw& p, auto& visit) {
    visit({"cortical_hu", "bone that counts as 1", "HU", 1, 30000}, p.cortical_hu);
    visit({"zero_hu", "what would resist not at all", "HU", -1024, 29999}, p.zero_hu);
    visit({"exponent", "exponent of the density between the two", "", 0, 4}, p.exponent);
    visit({"least", "no bone resists less", "", 0.02, 1}, p.least);
    visit({"most", "nor more", "", 1, 3.9}, p.most);
  }
  [[nodiscard]] double at(double hu) const;
};
/// { "osteotome_hardness": 1, "source": "...", and any field of HardnessLaw; what is not named is as built in }.
/// Error(usage), with line and key; `name` of the text.
[[nodiscard]] HardnessLaw parse_hardness(std::string_view json, const std::string& name);
/// libs/simulation/bone/hardness.json.
[[nodiscard]] std::string_view default_hardness_json();

/// The law of every voxel, in steps of 1/64; one byte a voxel.
class Hardness {
 public:
  /// From the HU of the case, sampled at the voxels of the bone. Voxels without HU count as cortical.
  Hardness(const BrickGrid& bone, const SparseGrid& hu, const HardnessLaw& law = {});
  /// Of a piece: its bricks are these of the whole.
  Hardness(const Hardness& whole, std::span<const std::uint32_t> bricks);
  [[nodiscard]] float at(VoxelKey voxel) const { return static_cast<float>(steps_[voxel]) / 64.0F; }
  [[nodiscard]] const HardnessLaw& law() const { return law_; }
  [[nodiscard]] std::size_t memory_bytes() const { return steps_.size(); }

 private:
  HardnessLaw law_;
  std::vector<std::uint8_t> steps_;
};

}  // namespace osteo::inline simulation
