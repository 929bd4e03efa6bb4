#include "osteo/assessment/experiment/participant.h"

#include <algorithm>
#include <cmath>

#include "osteo/core/base/portable_math.h"
#include "osteo/core/statistics/basics.h"

namespace osteo::inline assessment::experiment {
namespace {

SimulatedDeviceParams arm_of(std::uint64_t seed) {
  SimulatedDeviceParams p;
  p.mass_kg = TaskGains{}.moving_mass_kg;
  p.damping_n_s_per_m = 2;
  p.hand_damping_n_s_per_m = 10;
  p.encoder_mm = 0.01;
  p.seed = seed;
  return p;
}
std::uint64_t mixed(std::uint64_t seed, std::uint64_t with) {
  return statistics::Random(seed * 0x100000001b3ULL + with).bits();
}

}  // namespace

ParticipantModel null_model() {
  ParticipantModel m;
  m.memory = {0.38, 0.38, 0.38};
  return m;
}

SimulatedParticipant::Wander SimulatedParticipant::Wander::made(std::uint64_t seed, int count, double highest_hz) {
  statistics::Random random(seed);
  Wander w;
  for (int i = 0; i < count; ++i) {
    const double hz = highest_hz * (static_cast<double>(i) + random.uniform()) / count, phase = random.uniform();
    w.waves.push_back({hz, phase});
  }
  return w;
}

double SimulatedParticipant::Wander::at(double t_s) const {
  double sum = 0;
  for (const auto& [hz, phase] : waves) sum += portable::sin_cos_turns(hz * t_s + phase).sin;
  return sum * std::sqrt(2 / static_cast<double>(waves.size()));
}

SimulatedParticipant::SimulatedParticipant(const ParticipantModel& model, std::uint64_t seed)
    : model_(model), seed_(seed), device_(arm_of(seed), Vec3{}) {
  statistics::Random random(mixed(seed, 1));
  skill_ = portable::exp(model.person * random.normal());
  for (double& s : suits_) s = portable::exp(model.person_by_training * random.normal());
}

DeviceTraits SimulatedParticipant::traits() const {
  DeviceTraits t = device_.traits();
  t.damping_n_s_per_m += arm_of(seed_).hand_damping_n_s_per_m;
  return t;
}

double SimulatedParticipant::memory_of(const Trial& t) const {
  const auto training = static_cast<std::size_t>(t.training);
  double m = model_.memory[training] * suits_[training] * skill_;
  for (int r = 1; r < t.repetition; ++r) m *= model_.learning;
  return m;
}

void SimulatedParticipant::begin(const Stimulus& stimulus, const Trial& trial, RunKind kind, double lead_s) {
  stimulus_ = &stimulus;
  trial_ = trial;
  kind_ = kind;
  lead_s_ = lead_s;
  mean_n_ = statistics::mean(stimulus.force_n);
  sigma_ = memory_of(trial) * mean_n_;
  const std::uint64_t own =
      mixed(seed_, static_cast<std::uint64_t>(trial.number) * 4 + static_cast<std::uint64_t>(kind) + 100);
  memory_ = Wander::made(mixed(own, 1), 8, 0.4);
  timing_ = Wander::made(mixed(own, 2), 4, 0.1);
  tremor_ = Wander::made(mixed(own, 3), 12, 4);
  const double relative = model_.memory[1] > 0 ? memory_of(trial) / model_.memory[1] : 0;
  shift_s_ = model_.timing_s * relative;
  // What it will press: in a test what it recalls, where it has learned at all; in a training what it is told, after
  // its reaction.
  plan_n_.clear();
  constexpr std::size_t kEvery = 10;
  for (std::size_t i = 0; i < stimulus.force_n.size(); i += kEvery) {
    const double t = static_cast<double>(i) / stimulus.rate_hz;
    double n = 0;
    if (kind == RunKind::test) {
      n = stimulus.force_at(t - model_.reaction_s / 2 + shift_s_ * timing_.at(t)) + sigma_ * memory_.at(t);
      // Everybody knows that a run begins and ends without force.
      const double edge = std::min({1.0, t, stimulus.seconds() - t});
      n *= std::clamp(edge, 0.0, 1.0);
    } else {
      n = trial.aid * stimulus.force_at(t - model_.reaction_s);
    }
    const bool seen = kind == RunKind::training && trial.training == Training::visuohaptic;
    n *= 1 + (seen ? model_.force_seen : model_.force_blind) * tremor_.at(t);
    plan_n_.push_back(std::clamp(n, 0.0, model_.most_n));
  }
}

DeviceSample SimulatedParticipant::read(std::uint64_t tick, double dt_s, Vec3 force_n) {
  const double t = static_cast<double>(tick) * dt_s - lead_s_;
  double down = 0;
  if (t >= 0 && !plan_n_.empty()) {
    const double at = std::min(t * stimulus_->rate_hz / 10, static_cast<double>(plan_n_.size() - 1));
    const auto i = std::min(static_cast<std::size_t>(at), plan_n_.size() - 1),
               next = std::min(i + 1, plan_n_.size() - 1);
    down = plan_n_[i] + (at - static_cast<double>(i)) * (plan_n_[next] - plan_n_[i]);
  }
  // Pushed by the device, it stays in the plane by the arm's own stiffness; else it only presses.
  const bool pushed = kind_ == RunKind::training && trial_.training == Training::haptic;
  const Vec3 at = device_.position_mm();
  device_.set_hand({0, -down, 0}, {at.x, 0, at.z}, pushed ? 0.5 : 0);
  return device_.read(tick, dt_s, force_n);
}

}  // namespace osteo::inline assessment::experiment
