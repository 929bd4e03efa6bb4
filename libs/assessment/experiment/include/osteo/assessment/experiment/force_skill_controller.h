// A participant at the device: which page is shown, runs in the servo's thread, trials saved as they end. What the
// window shows and does, without the window.
#pragma once
#include <atomic>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "osteo/assessment/experiment/analysis.h"
#include "osteo/core/rt/seqlock.h"

namespace osteo::inline assessment::experiment {

enum class RunPage : int { before_training, training, feedback, before_test, test, pause, done };

/// Two threads: step() is the servo's, all else the window's.
class ForceSkillController {
 public:
  /// Goes on at the first trial that is not finished. Error as read_trials.
  ForceSkillController(std::filesystem::path experiment, Protocol protocol, std::size_t participant, bool retention,
                       Mover mover, std::string device, const DeviceTraits& traits);

  /// The force for the hand. No allocation, no wait; nothing where no run is under way.
  Vec3 step(const DeviceSample& sample) noexcept;
  [[nodiscard]] bool running() const noexcept { return running_.load(std::memory_order_acquire); }

  /// The person wants to go on: a run begins, or the next page comes. Nothing while a run is under way.
  void go_on();
  /// Notices runs that have ended; saves the trial behind its test. Error(cannot_write). Call it once a picture.
  void update();

  [[nodiscard]] RunPage page() const { return page_; }
  /// Trials done, and of how many.
  [[nodiscard]] std::size_t done() const { return next_; }
  [[nodiscard]] std::size_t trials() const { return trials_.size(); }
  /// What is under way or comes next; not on the page `done`.
  [[nodiscard]] const Trial& trial() const { return trials_[next_]; }
  [[nodiscard]] const Protocol& protocol() const { return protocol_; }
  /// What is to be seen now: the run's drawing, of nothing on other pages.
  [[nodiscard]] sheet::Drawing drawing(double width, double height) const;
  [[nodiscard]] TaskView view() const;
  /// For the page: a title and a sentence of what to do.
  [[nodiscard]] std::pair<std::string, std::string> words() const;
  /// Of the last training, for the page `feedback`: target and applied force over time, at the servo's rate.
  [[nodiscard]] std::pair<std::vector<double>, std::vector<double>> last_training() const;

 private:
  void load();
  void begin(RunKind kind);

  std::filesystem::path folder_;
  Protocol protocol_;
  std::string participant_;
  bool retention_;
  std::vector<Trial> trials_;
  std::size_t next_ = 0;
  RunPage page_ = RunPage::done;
  std::unique_ptr<Stimulus> stimulus_;
  TrialRecord record_;
  // The servo's while running_.
  std::unique_ptr<ForceTask> task_;
  std::vector<TickRecord>* ticks_ = nullptr;
  std::uint64_t tick_ = 0;
  std::atomic<bool> running_{false};
  Seqlock<TaskView> view_;
};

}  // namespace osteo::inline assessment::experiment
