// What cuts by a plane took of structures: no burr is near one when a saw goes through it.
#pragma once
#include <map>
#include <vector>

#include "osteo/assessment/evidence/metric.h"
#include "osteo/simulation/bone/structure_map.h"

namespace osteo::inline assessment {

/// Of each cut by a plane that was done, what of the structures lay in the blade's path (structure_cut.h). A cut that
/// was taken back has been made all the same, as a burr's touch has. Sessions without such a cut have no values of it.
class SawCutMetric final : public Metric {
 public:
  /// The moment of a cut; its value is in mm3.
  static constexpr std::string_view kMoment = "cut through by the saw";

  explicit SawCutMetric(const EvidenceScene& scene) : scene_(scene) {}
  void frame(const EvidenceFrame& frame) override;
  void finish(const World& world, std::vector<Measured>& values, std::vector<Moment>& moments) override;

 private:
  EvidenceScene scene_;
  bool any_ = false;
  std::map<std::uint8_t, double> mm3_;       // by the structure's value
  std::map<std::uint8_t, double> least_mm_;  // of those that were not cut, where a blade came near
  std::vector<Moment> moments_;
};

}  // namespace osteo::inline assessment
