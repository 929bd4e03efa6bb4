#include "osteo/assessment/experiment/force_skill_controller.h"

#include <utility>

#include "osteo/core/base/error.h"

namespace osteo::inline assessment::experiment {

ForceSkillController::ForceSkillController(std::filesystem::path experiment, Protocol protocol, std::size_t participant,
                                           bool retention, Mover mover, std::string device, const DeviceTraits& traits)
    : protocol_(std::move(protocol)), participant_(protocol_.participants.at(participant)), retention_(retention) {
  folder_ = trials_folder(experiment, participant_, retention);
  trials_ = retention ? retention_of(protocol_, participant) : trials_of(protocol_, participant);
  next_ = first_unfinished(folder_, trials_);
  record_.mover = mover;
  record_.device = std::move(device);
  record_.traits = traits;
  record_.gains = safe_gains({}, traits, protocol_.rate_hz);
  view_.store({});
  load();
}

// The page before the next trial.
void ForceSkillController::load() {
  if (next_ >= trials_.size()) {
    page_ = RunPage::done;
    return;
  }
  stimulus_ = std::make_unique<Stimulus>(stimulus_of(protocol_, trials_[next_]));
  record_.trial = trials_[next_];
  record_.training.clear();
  record_.test.clear();
  page_ = trials_[next_].pause ? RunPage::pause : retention_ ? RunPage::before_test : RunPage::before_training;
}

void ForceSkillController::begin(RunKind kind) {
  task_ = std::make_unique<ForceTask>(*stimulus_, trials_[next_], kind, TaskGains{}, record_.traits, protocol_.peak_n,
                                      kLeadS);
  record_.lead_ticks = task_->lead_ticks();
  ticks_ = kind == RunKind::training ? &record_.training : &record_.test;
  ticks_->clear();
  ticks_->reserve(task_->ticks());
  tick_ = 0;
  page_ = kind == RunKind::training ? RunPage::training : RunPage::test;
  running_.store(true, std::memory_order_release);
}

Vec3 ForceSkillController::step(const DeviceSample& sample) noexcept {
  if (!running_.load(std::memory_order_acquire)) return {};
  const TickRecord r = task_->step(tick_++, sample);
  ticks_->push_back(r);  // room was made for all of them
  view_.store(task_->view());
  if (task_->done()) running_.store(false, std::memory_order_release);
  return {r.force_n[0], r.force_n[1], r.force_n[2]};
}

void ForceSkillController::go_on() {
  switch (page_) {
    case RunPage::pause:
      page_ = retention_ ? RunPage::before_test : RunPage::before_training;
      break;
    case RunPage::before_training:
      begin(RunKind::training);
      break;
    case RunPage::feedback:
      page_ = RunPage::before_test;
      break;
    case RunPage::before_test:
      begin(RunKind::test);
      break;
    case RunPage::training:
    case RunPage::test:
    case RunPage::done:
      break;
  }
}

void ForceSkillController::update() {
  if (running()) return;
  if (page_ == RunPage::training) {
    // Sight of the own force behind the run, where it was not there in it.
    page_ = protocol_.feedback == Feedback::delayed && trials_[next_].training != Training::haptic
                ? RunPage::feedback
                : RunPage::before_test;
  } else if (page_ == RunPage::test) {
    (void)save_trial(folder_, participant_, *stimulus_, record_);
    ++next_;
    load();
  }
}

TaskView ForceSkillController::view() const {
  return view_.load();
}

sheet::Drawing ForceSkillController::drawing(double width, double height) const {
  if (page_ != RunPage::training && page_ != RunPage::test) {
    sheet::Drawing nothing;
    nothing.width = width;
    nothing.height = height;
    return nothing;
  }
  DisplayState s;
  s.training = trial().training;
  s.kind = page_ == RunPage::training ? RunKind::training : RunKind::test;
  s.view = view();
  s.view.done = false;
  s.most_n = protocol_.scale ? protocol_.device_n : protocol_.peak_n;
  s.aid = trial().aid;
  s.amplification = protocol_.amplification;
  s.feedback = protocol_.feedback;
  return run_drawing(*stimulus_, s, width, height);
}

std::pair<std::string, std::string> ForceSkillController::words() const {
  if (page_ == RunPage::done) return {"All trials are done.", "Thank you. Escape closes the window."};
  const Trial& t = trial();
  const std::string number = "Trial " + std::to_string(next_ + 1) + " of " + std::to_string(trials_.size());
  static constexpr std::array<const char*, kTrainings> kToDo{
      "The device will push upwards. Oppose it so that it stays in its plane, and learn the force.",
      "The blue bar will show a force. Learn it, and press down as it says.",
      "The blue bar will show a force, the green one what you press. Keep both equally high, and learn the force."};
  switch (page_) {
    case RunPage::pause:
      return {"A break of " + std::to_string(static_cast<int>(protocol_.break_min)) + " minutes",
              "The space bar goes on."};
    case RunPage::before_training:
      return {number + ": training " + short_name(t.training),
              std::string(kToDo[static_cast<std::size_t>(t.training)]) + " The space bar begins."};
    case RunPage::feedback:
      return {number + ": what you pressed", "Blue: the force to learn. Green: yours. The space bar goes on."};
    case RunPage::before_test:
      return {number + ": test",
              "Press the force that you have learned, while you are led along the path. The space bar begins."};
    default:
      return {number, ""};
  }
}

std::pair<std::vector<double>, std::vector<double>> ForceSkillController::last_training() const {
  std::vector<double> applied;
  for (std::size_t i = record_.lead_ticks; i < record_.training.size(); ++i)
    applied.push_back(record_.training[i].normal_force_n);
  return {stimulus_ ? stimulus_->force_n : std::vector<double>{}, applied};
}

}  // namespace osteo::inline assessment::experiment
