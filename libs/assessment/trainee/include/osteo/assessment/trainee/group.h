// Groups of simulated trainees: skills drawn, so that a study of them has something to find.
#pragma once
#include <cstdint>
#include <vector>

#include "osteo/assessment/trainee/skill.h"
#include "osteo/core/base/param.h"

namespace osteo::inline assessment {

enum class TraineeGroup : int { novice, expert };
[[nodiscard]] constexpr std::array<std::string_view, 2> enum_names(TraineeGroup) {
  return {"novice", "expert"};
}

/// Each skill uniform in its group's range; both ranges overlap. The ranges are ours, not measured on people. Same
/// seed, same skill.
[[nodiscard]] TraineeSkill person_skill(TraineeGroup group, std::uint64_t seed);

/// `n` trainees in which every skill but force_n (the same for all) goes through its whole range in n equal steps, each
/// skill in an order of its own: McKay, Beckman, Conover 1979.
[[nodiscard]] std::vector<TraineeSkill> latin_hypercube(std::size_t n, std::uint64_t seed);

/// 0 to 1, the mean of how good each skill is: what a simulated rater goes by.
[[nodiscard]] double overall(const TraineeSkill& skill);

}  // namespace osteo::inline assessment
