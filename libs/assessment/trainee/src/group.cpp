#include "osteo/assessment/trainee/group.h"

#include <algorithm>

#include "osteo/core/statistics/basics.h"

namespace osteo::inline assessment {
namespace {

// The worst and the best of a skill, as a group has it.
struct Span {
  double TraineeSkill::*member;
  double worst, best;                    // of all
  std::array<double, 2> novice, expert;  // shares of the way from worst to best
};
const std::vector<Span>& spans() {
  static const std::vector<Span> all{{&TraineeSkill::region, 0, 1, {0, 0.7}, {0.6, 1}},
                                     {&TraineeSkill::undercut, 1, 0, {0.1, 0.7}, {0.6, 1}},
                                     {&TraineeSkill::force_control, 0, 1, {0, 0.7}, {0.6, 1}},
                                     {&TraineeSkill::tremor_mm, 0.5, 0.02, {0.1, 0.7}, {0.6, 1}},
                                     {&TraineeSkill::speed_mm_s, 12, 40, {0, 0.7}, {0.5, 1}},
                                     {&TraineeSkill::knowledge, 0, 1, {0, 0.8}, {0.7, 1}},
                                     {&TraineeSkill::instruments, 0, 1, {0, 0.7}, {0.7, 1}},
                                     {&TraineeSkill::camera, 0, 1, {0, 0.7}, {0.5, 1}}};
  return all;
}

}  // namespace

TraineeSkill person_skill(TraineeGroup group, std::uint64_t seed) {
  statistics::Random random(seed ^ 0x706572736f6eULL);
  TraineeSkill skill;
  for (const Span& s : spans()) {
    const auto [lo, hi] = group == TraineeGroup::expert ? s.expert : s.novice;
    skill.*s.member = s.worst + (s.best - s.worst) * (lo + (hi - lo) * random.uniform());
  }
  return skill;
}

std::vector<TraineeSkill> latin_hypercube(std::size_t n, std::uint64_t seed) {
  std::vector<TraineeSkill> all(n);
  statistics::Random random(seed);
  for (const Span& s : spans()) {
    std::vector<std::size_t> order(n);
    for (std::size_t i = 0; i < n; ++i) order[i] = i;
    random.shuffle(order);
    for (std::size_t i = 0; i < n; ++i)
      all[i].*s.member =
          s.worst + (s.best - s.worst) * (static_cast<double>(order[i]) + random.uniform()) / static_cast<double>(n);
  }
  return all;
}

double overall(const TraineeSkill& skill) {
  double sum = 0;
  for (const Span& s : spans()) sum += std::clamp((skill.*s.member - s.worst) / (s.best - s.worst), 0.0, 1.0);
  return sum / static_cast<double>(spans().size());
}

}  // namespace osteo::inline assessment
