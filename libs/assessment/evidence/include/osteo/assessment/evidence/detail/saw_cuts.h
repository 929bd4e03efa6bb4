// What burrs, saws, shafts and screws took of structures.
#pragma once
#include <map>
#include <vector>

#include "osteo/assessment/evidence/metric.h"
#include "osteo/simulation/haptics/structure_judge.h"

namespace osteo::inline assessment {

/// The events of the one judge (structure_judge.h), and how near cuts by a plane came. What was taken back has been
/// done all the same, as a burr's touch has.
class CutMetric final : public Metric {
 public:
  /// The moment of an event; its value is in mm3.
  [[nodiscard]] static std::string_view moment_of(CutBy by, bool contact);

  explicit CutMetric(const EvidenceScene& scene);
  void frame(const EvidenceFrame& frame) override;
  void finish(const World& world, std::vector<Measured>& values, std::vector<Moment>& moments) override;

 private:
  EvidenceScene scene_;
  std::optional<StructureJudge> judge_;  // where the scene has structures
  std::map<std::uint8_t, double>
      least_mm_;  // by the structure's value, of those that no plane cut, where one came near
};

}  // namespace osteo::inline assessment
