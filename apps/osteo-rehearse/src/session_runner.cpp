#include "session_runner.h"

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <iostream>
#include <thread>
#include <utility>

#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/translate.h"
#include "osteo/imaging/pipeline/pipeline.h"
#include "osteo/session/recording/session_reader.h"
#include "osteo/session/scene/path_planner.h"
#include "osteo/simulation/bone/plates.h"
#include "osteo/simulation/haptics/device_measure.h"
#include "playback_text.h"

namespace osteo {
namespace {

// In front of the bone on the patient's left, or where there is none, where a hand waits.
Vec3 near_the_bone(const World& world, const HandGoal& start) {
  try {
    return make_default_script(world, true, start.tool, 10).waypoints.front().at_mm;
  } catch (const Error&) {
    return start.position_mm;
  }
}

// What the guard goes by; of an arm with motors, as its loop really is. The session's header keeps it.
DeviceTraits measured(Device& device, double rate_hz, cli::Invocation& io) {
  if (!device.held().has_motors()) return device.traits();
  auto next = std::chrono::steady_clock::now();
  const auto tick = std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::duration<double>(1 / rate_hz));
  const MeasuredDevice m =
      measure_device(device.held(), 1 / rate_hz, [&] { std::this_thread::sleep_until(next += tick); });
  if (!m.delay_measured || !io.common.quiet) io.err << m.reported << std::endl;
  return m.traits;
}

// When the display goes away Xlib ends the program, by exit(): the session is closed first.
SessionRunner* g_session_runner = nullptr;

void close_at_exit() {
  if (g_session_runner == nullptr) return;
  int code = static_cast<int>(ExitCode::cancelled);
  try {
    std::exchange(g_session_runner, nullptr)->save();
    std::cerr << "osteo: the display is gone; the session is saved" << std::endl;
  } catch (const Error& e) {
    std::cerr << "osteo: the display is gone, and " << e.what() << std::endl;
    code = static_cast<int>(e.code());
  } catch (...) {
    code = static_cast<int>(ExitCode::unspecified);
  }
  ::_exit(code);
}

}  // namespace

SessionRunner::SessionRunner(const WindowFlags& flags, const Case& the_case, const Procedure* procedure,
                             const PersonValues& person, cli::Invocation& io)
    : case_(the_case),
      procedure_(procedure),
      io_(io),
      hands_(flags),
      next_folder_(flags.out),
      last_(flags.resume),
      monitor_setup_(flags.monitor_setup),
      live_(flags),
      sound_(person.sound, person.volume, person.alarms) {
  options_.rate_hz = flags.rate_hz;
  options_.follow = {true, true, flags.dust, flags.heat};
  options_.actions = first_actions(flags);
  options_.haptics.params.contact.method = flags.contact;
  if (flags.monitor) want_monitor();
  targets_ = stream_targets(flags.stream);
  options_.heard = [this](const std::string& kind, const std::string& json) {
    const std::lock_guard lock(stream_mutex_);
    if (stream_) stream_->feed().note(kind, json);
  };
  options_.haptics.params.effects.held_shaft = true;  // a hand meets it; settings may say otherwise
  apply_haptic_settings(case_.folder, flags.settings, options_.haptics);
  if (!flags.playback.empty()) learn(flags);
  if (procedure_ != nullptr) options_.haptics.opened = procedure_->opened();
  if (!flags.review.empty()) past_.emplace(flags.review, case_.folder);
  if (flags.playback.empty() && !flags.playback_as.empty())
    throw Error(ExitCode::usage, "--playback-as has no effect without --playback", "leave it out");
}

SessionRunner::~SessionRunner() {
  save_at_exit(false);
}

void SessionRunner::save_at_exit(bool on) {
  if (on) {
    g_session_runner = this;
  } else if (g_session_runner == this) {
    g_session_runner = nullptr;
  }
}

HandGoal SessionRunner::begin(bool from_case, const HandView& view) {
  const std::lock_guard lock(mutex_);
  leave_sound();
  live_.leave();
  live_.close(0);
  rehearsal_.reset();
  if (!has_anatomy_) {  // the same for all sessions
    options_.anatomy = anatomy_of(case_, options_.haptics, io_.context);
    has_anatomy_ = true;
    if (!io_.common.quiet) io_.err << reported_hardness(options_.anatomy) << std::endl;
  }
  if (past_) {
    rehearsal_ = past_->stage(case_, options_, view, io_.context);
    session_ = past_->folder();
    rehearsal_->start();
    return HandGoal{view.eye * 300, to_floats(view.axis), 0, static_cast<std::uint8_t>(view.tool)};
  }
  SessionFolder session{next_folder_, case_.folder, from_case ? std::filesystem::path() : last_};
  if (lesson_) return begin_led();
  if (live_.joins()) return begin_joined(view);
  World world = world_at_begin(session, case_, options_.anatomy, io_.context);
  const HandPose pose =
      PathPlanner(world, skin_of_instrument(static_cast<std::size_t>(view.tool))).waiting(view.eye, view.axis);
  const HandGoal start{pose.at_mm, to_floats(pose.axis), 0, static_cast<std::uint8_t>(view.tool)};
  auto devices = hands_.make(start, near_the_bone(world, start));
  if (live_.hosts()) live_.add_hand(devices, options_);
  options_.haptics.device = measured(*devices.front(), options_.rate_hz, io_);
  options_.haptics.more_devices.clear();
  for (std::size_t h = 1; h < devices.size(); ++h)
    options_.haptics.more_devices.push_back(measured(*devices[h], options_.rate_hz, io_));
  options_.soft = soft_tissue_of(case_.folder);
  run(std::move(world), std::move(devices), session.resumed_from,
      live_.hosts() ? "live tutoring: the second hand is a trainee's, far away" : "");
  return start;
}

void SessionRunner::save() {
  const std::lock_guard lock(mutex_);
  save_now();
}

std::vector<TutorNow::Step> SessionRunner::steps(const std::vector<std::string>& injured) {
  return progress_ && rehearsal_ ? progress_->look(*rehearsal_, injured) : std::vector<TutorNow::Step>{};
}

TutorNow SessionRunner::tutor() const {
  TutorNow n;
  if (!playback_) {
    n = live_.now(rehearsal_.get());
    if (procedure_ != nullptr) n.procedure = procedure_->name;
    return n;
  }
  const std::string mode(EnumNames<PlaybackMode>::values[static_cast<std::size_t>(playback_params_.mode)]);
  n.title = filled(tr("Lesson: {mode}, {now} of {all} s"), {{"mode", tr(mode)},
                                                            {"now", shown_number(playback_->seconds.load(), 1)},
                                                            {"all", shown_number(lesson_->seconds(), 1)}});
  n.hands = {"you"};
  for (std::size_t h = 0; h < lesson_->hands.size(); ++h)
    n.hands.push_back(h == 0 ? "recorded" : "recorded " + std::to_string(h + 1));
  n.ghosts = true;
  n.leads = leads(playback_params_);
  n.guiding = playback_->on;
  n.pull = playback_->pulled;
  if (rehearsal_)
    n.apart_mm = length(from_floats(rehearsal_->latest(0).device.position_mm) -
                        from_floats(rehearsal_->latest(1).device.position_mm));
  return n;
}

void SessionRunner::lead(bool on) {
  if (playback_) playback_->on = on;
  live_.guide(on);
}

std::vector<Vec3> SessionRunner::way() const {
  std::vector<Vec3> all;
  if (lesson_) {
    for (const Lesson::Point& p : lesson_->way) all.push_back(from_floats(p.at_mm));
  }
  return all;
}

void SessionRunner::learn(const WindowFlags& flags) {
  if (!flags.resume.empty())
    throw Error(ExitCode::usage, "--resume has no effect with --playback", "a lesson begins with its own bone");
  std::vector<FieldRef> fields = fields_of<PlaybackParams>(playback_params_);
  double to_s = 0;
  fields.push_back({{"from_s", "", "s", 0, 1e6}, &lesson_from_s_});
  fields.push_back({{"to_s", "", "s", 0, 1e6}, &to_s});
  for (std::size_t at = 0; at < flags.playback_as.size();) {
    const std::size_t comma = std::min(flags.playback_as.find(',', at), flags.playback_as.size());
    const std::string one = flags.playback_as.substr(at, comma - at);
    const std::size_t equals = one.find('=');
    const FieldRef* const field = find_field(fields, std::string_view(one).substr(0, equals));
    if (equals == std::string::npos || field == nullptr)
      throw Error(ExitCode::usage, "--playback-as: '" + one + "' is no flag of 'osteo playback'",
                  "mode=guide,pace=way");
    field->from_text(one.substr(equals + 1), "--playback-as");
    at = comma + 1;
  }
  lesson_folder_ = open_session_folder(flags.playback, case_.folder);
  lesson_ = std::make_shared<Lesson>(read_lesson(SessionReader(lesson_folder_.stream()), lesson_from_s_, to_s));
  options_.rate_hz = lesson_->rate_hz;
  options_.haptics = lesson_->setup;
}

HandGoal SessionRunner::begin_led() {
  const DeviceSample& first = lesson_->hands.front().front();
  const HandGoal start{from_floats(first.position_mm), first.axis, 0, first.tool};
  playback_ = std::make_shared<Playback>(lesson_, playback_params_);
  const std::shared_ptr<Playback>& playback = playback_;
  auto devices = hands_.make(start, start.position_mm);
  std::unique_ptr<Device> learner = std::move(devices.front());
  const bool mouse = dynamic_cast<MouseDevice*>(learner.get()) != nullptr;
  if (mouse && playback_params_.mode == PlaybackMode::show) {
    auto follower = std::make_unique<FollowingHand>(250, start.position_mm, playback);
    follower->stays = true;
    learner = std::move(follower);
  }
  auto led = playback_devices(std::move(learner), playback, options_.haptics);
  options_.actions = playback_actions(*playback);
  options_.soft = nullptr;
  const bool within = lesson_from_s_ > 0;
  run(world_of_lesson(lesson_folder_, lesson_from_s_, case_, options_.anatomy, io_.context), std::move(led),
      within ? lesson_folder_.folder : lesson_folder_.resumed_from, guided_text(playback_params_),
      within ? lesson_from_s_ : lesson_folder_.resumed_at_s);
  return start;
}

HandGoal SessionRunner::begin_joined(const HandView& view) {
  const auto [header, past] = live_.wait(io_.context);
  if (options_.haptics.structures != header.haptics.structures)
    throw Error(ExitCode::usage, "the host's case has other critical structures", "both need the same case, unchanged");
  if (options_.haptics.opened != header.haptics.opened) {  // whom nobody warns of is the host's to say
    options_.haptics.opened = header.haptics.opened;
    options_.anatomy = anatomy_of(case_, options_.haptics, io_.context);
  }
  World world = world_of_past(past, case_, options_.anatomy);
  const HandPose pose =
      PathPlanner(world, skin_of_instrument(static_cast<std::size_t>(view.tool))).waiting(view.eye, view.axis);
  const HandGoal start{pose.at_mm, to_floats(pose.axis), 0, static_cast<std::uint8_t>(view.tool)};
  std::unique_ptr<Device> own;
  if (live_.has_hand()) own = std::move(hands_.make(start, near_the_bone(world, start)).front());
  RehearsalOptions options = options_;
  options.haptics = header.haptics;
  const SessionFolder before = session_;
  session_ = create_joined_folder(next_folder_, case_.folder, past, live_.words());
  next_folder_.clear();
  options.session_file = session_.stream();
  try {
    rehearsal_ = live_.begin(header, std::move(world), options, std::move(own), io_.context);
    sound_.follow(rehearsal_.get());
    static_cast<void>(plate_library());
    std::atexit(close_at_exit);
  } catch (...) {
    std::error_code ignored;  // nothing was recorded in it
    std::filesystem::remove_all(session_.folder, ignored);
    session_ = before;
    throw;
  }
  return start;
}

void SessionRunner::run(World world, std::vector<std::unique_ptr<Device>> devices,
                        const std::filesystem::path& resumed_from, const std::string& guided, double resumed_at_s) {
  // Last, so that what fails before leaves no folder.
  const SessionFolder before = session_;
  session_ = create_session_folder(next_folder_, case_.folder, resumed_from, guided, resumed_at_s);
  next_folder_.clear();
  options_.session_file = session_.stream();
  try {
    SessionHeader header;
    if (live_.hosts()) {
      header.program_version = program_version();
      header.bone_hash = world.hash();
      header.rate_hz = options_.rate_hz;
      header.haptics = options_.haptics;
      header.dust = options_.follow.dust;
      header.heat = options_.follow.heat;
    }
    if (live_.hosts() && procedure_ != nullptr && options_.anatomy.structures)
      progress_ = std::make_unique<ProcedureProgress>(*procedure_, *options_.anatomy.structures, world.copy());
    rehearsal_ = std::make_shared<Rehearsal>(std::move(world), std::move(devices), options_, io_.context);
    if (live_.hosts()) live_.open(*rehearsal_, header, session_);
    if (monitor_options_) begin_monitor();
    if (!targets_.empty()) begin_stream();
    rehearsal_->start();
    sound_.follow(rehearsal_.get());
    if (sound_.on() && !sound_.failure().empty() && !io_.common.quiet && !reported_silence_) {
      io_.err << sound_.failure() << "; --no-sound does not look for one" << std::endl;
      reported_silence_ = true;
    }
    // Registered again: what the servo has made for itself by now must outlive it.
    static_cast<void>(plate_library());
    std::atexit(close_at_exit);
  } catch (...) {
    leave_sound();
    live_.close(0);
    rehearsal_.reset();
    std::error_code ignored;  // nothing was recorded in it
    std::filesystem::remove_all(session_.folder, ignored);
    session_ = before;  // what is kept
    throw;
  }
}

void SessionRunner::save_now() {
  if (!rehearsal_) return;
  sound_.follow(nullptr);
  sound_.mix_in(nullptr);
  progress_.reset();
  // Whatever comes of it, it is over; and what was recorded can be gone on from.
  const std::shared_ptr<Rehearsal> over = std::move(rehearsal_);
  const std::unique_ptr<MonitorController> monitor = std::move(monitor_);  // hears it to its end, and goes before it
  last_ = session_.folder;
  // The next one goes on as this one was.
  options_.follow.dust = over->simulates(Simulated::dust);
  options_.follow.heat = over->simulates(Simulated::heat);
  RehearsalSummary s;
  try {
    live_.leave();
    s = over->stop();
  } catch (...) {
    take_stream().reset();
    live_.close(0);
    throw;
  }
  live_.close(s.ticks);
  if (const std::unique_ptr<RehearsalStream> stream = take_stream()) {
    stream->feed().end();
    if (!io_.common.quiet) {
      for (const std::string& line : stream->feed().reported()) io_.err << line << std::endl;
    }
  }
  if (past_) {  // nothing was done, and nothing is written
    facts_ = past_->facts(options_.anatomy);
    return;
  }
  write_summary(session_, s, options_.rate_hz, "window", options_.anatomy);
  facts_ = facts_of(s);
  for (const std::string& w : s.warnings) io_.context.warn(w);
  // Reported even when quiet: the exit code is about it.
  if (!s.gaps.empty()) {
    lost_ticks_ = true;
    io_.err << "NOT RECORDED: " << s.ticks_not_recorded << " ticks in " << s.gaps.size()
            << " gaps, since the disk did not keep up; session: " << session_.folder.string() << std::endl;
  }
  if (!io_.common.quiet)
    io_.err << "session: " << session_.folder.string() << "  (" << s.ticks << " ticks, " << s.removed_mm3 << " mm3)"
            << std::endl;
}

void SessionRunner::leave_sound() {
  sound_.follow(nullptr);
  sound_.mix_in(nullptr);
  take_stream().reset();
  monitor_.reset();
}

std::unique_ptr<RehearsalStream> SessionRunner::take_stream() {
  const std::lock_guard lock(stream_mutex_);
  return std::move(stream_);
}

void SessionRunner::begin_stream() {
  stream_ = std::make_unique<RehearsalStream>(*rehearsal_, targets_, monitor_ ? &monitor_->reader() : nullptr,
                                              monitor_options_ ? *monitor_options_ : monitor_options_of({}));
  if (!io_.common.quiet) {
    for (const std::string& line : stream_->feed().reported()) io_.err << line << std::endl;
  }
  if (monitor_) monitor_->invite(stream_->invitation());
  if (!stream_->invitation().empty()) io_.err << stream_->invitation() << std::endl;
}

void SessionRunner::want_monitor() {
  monitor_json_ = monitor_setup_.empty() ? std::string() : read_text(monitor_setup_);
  monitor_options_.emplace();
  monitor_options_->setup = parse_monitor(monitor_json_.empty() ? default_monitor_json() : monitor_json_,
                                          monitor_setup_.empty() ? "the built-in monitor" : monitor_setup_.string());
}

void SessionRunner::simulate(Simulated what, bool on) {
  if (rehearsal_) rehearsal_->act(SceneAction::simulate(what, on));
}

bool SessionRunner::turn_monitor(bool on) {
  if (past_ || live_.joins() || (stream_ && monitor_)) return false;
  if (on) {
    want_monitor();
    if (rehearsal_) begin_monitor();
  } else {
    monitor_options_.reset();
    sound_.mix_in(nullptr);
    monitor_.reset();
  }
  return true;
}

void SessionRunner::begin_monitor() {
  if (!monitor_json_.empty()) write_file(session_.folder / kMonitorFile, monitor_json_);
  monitor_ = std::make_unique<MonitorController>(*rehearsal_, *monitor_options_);
  sound_.mix_in(&monitor_->sound());
  if (monitor_->wiring().channels.empty())
    io_.context.warn(
        "the case lists none of the nerves that the monitor knows: it hears nothing (--structures and --names of "
        "'osteo prepare')");
}

SessionFacts SessionRunner::facts_of(const RehearsalSummary& s) const {
  SessionFacts f;
  f.folder = session_.folder;
  f.rate_hz = options_.rate_hz;
  f.seconds = static_cast<double>(s.ticks) / options_.rate_hz;
  f.removed_mm3 = s.removed_mm3;
  f.sawn_mm3 = s.sawn_mm3;
  f.tissue_mm3 = s.tissue_mm3;
  f.bodies = s.bodies;
  for (const Fixture& p : s.fixtures) f.plates.push_back(std::to_string(p.id) + ": " + plate_library()[p.plate].name);
  const StructureMap* const map = options_.anatomy.structures.get();
  f.has_structures = map != nullptr;
  for (const auto& [value, e] : s.structures) {
    if (map == nullptr) break;
    f.structures.push_back({map->name_of(static_cast<std::uint8_t>(value)), e.least_clearance_mm,
                            static_cast<double>(e.ticks_touched) / options_.rate_hz,
                            static_cast<double>(e.ticks_injured) / options_.rate_hz});
  }
  for (const StructureCutEvent& e : s.structure_cuts) {
    if (map != nullptr) f.add_cut(map->name_of(e.cut.structure), std::string(name_of(e.by)), e.cut.mm3);
  }
  f.warnings = s.warnings;
  if (!s.gaps.empty())
    f.warnings.push_back(
        filled(tr("NOT RECORDED: {n} ticks: the disk did not keep up"), {{"n", std::to_string(s.ticks_not_recorded)}}));
  return f;
}

}  // namespace osteo
