// Which step of a procedure is being worked on, told from where the burr drills.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "osteo/assessment/evidence/metric.h"
#include "osteo/assessment/evidence/procedure.h"
#include "osteo/simulation/bone/structure_map.h"

namespace osteo::inline assessment {

/// A step's structures are those that its items are about (`structure` and `second`; not `cells`, which lie
/// everywhere). The first step with structures begins with the first drilling. Another begins where the burr begins to
/// be nearest to structures of its own, and not of the step before, for kSettledS of drilling; drilling out of reach of
/// all of them says nothing. Where several steps have that structure it is the next of them in the procedure's order,
/// else the last before. A step lasts until another begins, the last one until the last drilling: all times together
/// are those from the first drilling to the last. One may begin again. Not known this way: whether a step was done
/// well, or at all; that, `Score::steps` says.
class StepClock {
 public:
  static constexpr double kSettledS = 2;

  /// Both outlive this.
  StepClock(const StructureMap& structures, const Procedure& procedure, double rate_hz);
  /// The first hand drills. `now`: ticks known before this one, not falling. `each_mm`: burr's surface to each of
  /// structures.values(). O(structures of the case).
  void drill(std::uint64_t now, std::span<const double> each_mm);
  /// step_s of each step, in their order.
  void finish(std::vector<Measured>& values) const;

 private:
  [[nodiscard]] bool has(std::size_t step, std::size_t structure) const { return has_[step][structure] != 0; }
  const StructureMap& structures_;
  const Procedure& procedure_;
  double rate_hz_;
  std::vector<std::vector<std::uint8_t>> has_;  // by step, by number of the structure
  std::vector<std::uint8_t> any_;               // by number of the structure: of some step
  std::vector<std::uint64_t> ticks_;            // by step: of those that ended
  std::size_t now_ = 0, next_ = 0;              // step worked on; step that may begin
  std::uint64_t begun_ = 0, last_ = 0;          // when the step began; end of the last drilling
  std::uint64_t next_begun_ = 0, next_ticks_ = 0;
  bool drilled_ = false;
};

}  // namespace osteo::inline assessment
