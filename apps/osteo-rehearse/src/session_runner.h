// Sessions in the window, one after another.
#pragma once
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "hands.h"
#include "live_session_runner.h"
#include "osteo/app/cli/command.h"
#include "osteo/app/window/monitor_controller.h"
#include "osteo/assessment/evidence/procedure.h"
#include "osteo/network/tutor/playback.h"
#include "osteo/network/wire/rehearsal_stream.h"
#include "osteo/session/scene/rehearsal.h"
#include "osteo/session/scene/session_folder.h"
#include "past_session.h"
#include "procedure_progress.h"
#include "session_review.h"

namespace osteo {

// One session after another on a case. Between them, and after whatever throws, none runs.
class SessionRunner {
 public:
  /// `procedure`: what the session is scored by; null: no items are judged. It, the case and `io` must outlive the
  /// sitting.
  SessionRunner(const WindowFlags& flags, const Case& the_case, const Procedure* procedure, const PersonValues& person,
                cli::Invocation& io);
  ~SessionRunner();
  SessionRunner(const SessionRunner&) = delete;
  SessionRunner& operator=(const SessionRunner&) = delete;

  /// While this lives and `on`, it is saved when the program is ended by exit(), as Xlib does when the display goes
  /// away.
  void save_at_exit(bool on);

  // Begun and saved in threads of their own; whoever ends the program meanwhile waits.
  HandGoal begin(bool from_case, const HandView& view);

  void save();

  /// Who leads, and who takes part.
  [[nodiscard]] TutorNow tutor() const;
  /// How far a teacher's procedure is, as ProcedureProgress::look().
  [[nodiscard]] std::vector<TutorNow::Step> steps(const std::vector<std::string>& injured);
  void lead(bool on);

  /// Of the recorded hand that leads; empty where none does.
  [[nodiscard]] std::vector<Vec3> way() const;

  [[nodiscard]] Rehearsal* rehearsal() const { return rehearsal_.get(); }
  /// Of the session that was saved last.
  [[nodiscard]] const SessionFacts& facts() const { return facts_; }
  /// As the session that runs, or ran last, began with it.
  [[nodiscard]] World at_begin(const Context& context) const {
    return world_at_begin(session_, case_, options_.anatomy, context);
  }
  /// Of the session that was saved last.
  [[nodiscard]] SessionReview review(const Context& context) const {
    return review_of(session_, case_, options_.anatomy, procedure_, context);
  }
  /// For pictures. What is looked at again stays as it is.
  [[nodiscard]] std::filesystem::path folder() const {
    return past_ ? std::filesystem::current_path() : session_.folder;
  }
  [[nodiscard]] SoundOut& sound() { return sound_; }
  [[nodiscard]] MonitorController* monitor() const { return monitor_.get(); }
  /// While a rehearsal runs, or for the next. False: a stream has the one there is, or the host's is the only one.
  bool turn_monitor(bool on);
  // Dust or heat of the session that runs begins or ends, a few ticks later.
  void simulate(Simulated what, bool on);
  [[nodiscard]] std::string device() const { return hands_.name(); }
  [[nodiscard]] CameraDevices camera(bool lend) const {
    return hands_.camera(rehearsal_ ? &rehearsal_->device() : nullptr, lend);
  }
  void tune(const HandTuning& tuning) const { Hands::tune(rehearsal_ ? &rehearsal_->device() : nullptr, tuning); }
  [[nodiscard]] std::optional<std::uint32_t> switches(bool attended) const { return hands_.switches(attended); }
  /// Of any session so far, ticks were not recorded.
  [[nodiscard]] bool lost_ticks() const { return lost_ticks_; }

 private:
  // What a recorded session teaches; its settings are this one's.
  void learn(const WindowFlags& flags);

  // The lesson from its beginning, with its own bone. A mouse cannot be led: where nothing but the way is to be felt
  // the tool follows by itself.
  HandGoal begin_led();

  // A session that runs elsewhere, on a copy of its bone.
  HandGoal begin_joined(const HandView& view);

  void run(World world, std::vector<std::unique_ptr<Device>> devices, const std::filesystem::path& resumed_from,
           const std::string& guided = {}, double resumed_at_s = 0);

  void save_now();
  void leave_sound();
  void want_monitor();
  void begin_monitor();
  void begin_stream();
  // Taken from under those who leave notes; what it waits for when it goes may be theirs.
  [[nodiscard]] std::unique_ptr<RehearsalStream> take_stream();
  [[nodiscard]] SessionFacts facts_of(const RehearsalSummary& s) const;

  const Case& case_;
  const Procedure* procedure_;
  cli::Invocation& io_;
  const Hands hands_;
  PlaybackParams playback_params_;
  double lesson_from_s_ = 0;
  SessionFolder lesson_folder_;
  std::shared_ptr<const Lesson> lesson_;
  std::filesystem::path next_folder_, last_;
  RehearsalOptions options_;
  SessionFolder session_;
  SessionFacts facts_;
  std::optional<PastSession> past_;  // that is looked at, instead of one that runs
  std::mutex mutex_;
  std::optional<MonitorOptions> monitor_options_;  // where one is listed
  std::string monitor_json_;                       // of the person's own file
  const std::filesystem::path monitor_setup_;
  std::vector<StreamTarget> targets_;
  std::mutex stream_mutex_;
  LiveSessionRunner live_;
  std::shared_ptr<Playback> playback_;  // of a lesson that is shown
  std::shared_ptr<Rehearsal> rehearsal_;
  std::unique_ptr<ProcedureProgress> progress_;  // of a teacher's session
  std::unique_ptr<MonitorController> monitor_;
  std::unique_ptr<RehearsalStream> stream_;  // of the monitor: before it, it goes
  SoundOut sound_;                           // before the rehearsal it follows, it goes
  bool has_anatomy_ = false, lost_ticks_ = false, reported_silence_ = false;
};

}  // namespace osteo
