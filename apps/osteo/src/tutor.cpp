// tutor and join: one session, two machines.
#include <cmath>
#include <iostream>
#include <ostream>
#include <thread>
#include <tuple>

#include "commands/join.h"
#include "commands/playback.h"
#include "commands/tutor.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/json_document.h"
#include "osteo/core/rt/loop.h"
#include "osteo/imaging/pipeline/pipeline.h"
#include "osteo/network/tutor/live_past.h"
#include "osteo/network/tutor/live_seat.h"
#include "osteo/session/recording/script.h"
#include "osteo/session/scene/case.h"
#include "osteo/session/scene/rehearsal.h"
#include "osteo/session/scene/session_folder.h"
#include "osteo/simulation/bone/instrument.h"
#include "playback_text.h"

namespace osteo {
namespace {

std::string hundredths(double x) {
  return format_number(std::round(x * 100) / 100);
}

Json status_json(const PeerStatus& p) {
  return {{"role", p.role == JoinRole::trainee ? "trainee" : "watcher"},
          {"rtt_ms", p.rtt_ms},
          {"offset_ms", p.offset_ms},
          {"drift_ppm", p.drift_ppm},
          {"lost", p.lost},
          {"heard", p.heard},
          {"behind_ticks", p.behind_ticks},
          {"bone_differs_since_tick", p.bone_differs_since},
          {"marks_same", p.marks_same}};
}

}  // namespace

cli::CommandInfo TutorCommand::info() {
  return {"tutor",
          "a session that others join from their machines: the instructor's side",
          "Runs a session in real time, its first hand by a script, its second by who joins as the trainee, and shows "
          "the code to join with. "
          "Listens on this machine alone unless --listen names another address. What travels is poses, encrypted; each "
          "side feels its own copy "
          "of the same bone (docs/guides/tutoring.md says what it withstands). Without --two-way the instructor's hand "
          "is not "
          "pulled.",
          {{"case", "a folder made by prepare"}},
          "osteo tutor CASE --script lesson.json --listen 0.0.0.0"};
}

int TutorCommand::run(const Params& p, cli::Invocation& io) {
  const Case the_case = load_case(io.arguments[0]);
  const Script script = load_script(p.script, planned_cuts_of(the_case.folder));
  if (!script.more_hands.empty())
    throw Error(ExitCode::usage, "'" + p.script + "' has more hands than one", "the second is the trainee's");
  RehearsalOptions options;
  options.haptics.device = SpringHand::traits();
  options.haptics.more_devices = {SpringHand::traits()};
  apply_haptic_settings(the_case.folder, p.settings, options.haptics);
  options.anatomy = anatomy_of(the_case, options.haptics, io.context);
  const SessionFolder goes_on{{}, the_case.folder, p.resume};
  const Bytes past = past_bytes(goes_on);
  World world = world_at_begin(goes_on, the_case, options.anatomy, io.context);
  SessionHeader header;
  header.program_version = program_version();
  header.bone_hash = world.hash();
  header.rate_hz = options.rate_hz;
  header.haptics = options.haptics;
  const std::string code = make_pairing_code();
  auto far = std::make_shared<FarDevice>();
  LiveHost host(tidy_code(code), settings_bytes(header, past), 2, far);
  const SessionFolder session = create_session_folder(p.out, the_case.folder, p.resume,
                                                      "live tutoring: the second hand is a trainee's, far away");
  options.session_file = session.stream();
  if (p.two_way)
    options.actions.push_back(action_of(far_guide(0, 1, options.haptics.device, p.stiffness_n_per_mm, p.most_n)));
  for (const SceneAction& a : actions_of(script, options.rate_hz)) options.actions.push_back(a);
  std::vector<std::unique_ptr<Device>> devices = devices_of(script, options.rate_hz);
  devices.push_back(std::make_unique<FarHand>(far));
  Rehearsal rehearsal(std::move(world), std::move(devices), options, io.context);
  std::optional<HostThread> net(std::in_place, host, rehearsal, p.listen, p.port);
  io.end_progress();
  const bool bracket = p.listen.find(':') != std::string::npos;
  io.err << "join with: osteo join " << (bracket ? "[" + p.listen + "]" : p.listen) << ':' << net->port()
         << " --case-folder CASE --code " << code << std::endl;
  // The session begins when they are there, each with its copy: nothing is missed.
  const auto ready = [&] {
    int n = 0;
    for (const PeerStatus& s : host.status(steady_us())) n += s.ready ? 1 : 0;
    return n;
  };
  const std::int64_t asked = steady_us();
  while (ready() < p.attend && steady_us() - asked < static_cast<std::int64_t>(p.wait_s * 1e6)) {
    io.context.check_cancelled();
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  if (const int n = ready(); n < p.attend)
    io.context.warn(std::to_string(n) + " of " + std::to_string(p.attend) + " have joined within " +
                    format_number(p.wait_s) + " s; the session begins all the same");
  rehearsal.start();
  std::size_t seen = 0;
  bool reported_door = false, reported_lost = false;
  while (rehearsal.running() && !io.context.cancelled()) {
    const auto all = host.status(steady_us());
    if (all.size() != seen && !io.common.quiet)
      io.err << all.size() << (all.size() == 1 ? " has" : " have") << " joined" << std::endl;
    seen = all.size();
    for (const PeerStatus& s : all) {
      if (s.bone_differs_since > 0)
        io.context.warn("a copy's bone differs since tick " + std::to_string(s.bone_differs_since) +
                        "; it is made again");
    }
    if (host.tries_left() == 0 && !std::exchange(reported_door, true))
      io.context.warn("three wrong codes: nobody else can join this session");
    if (host.lost() && !std::exchange(reported_lost, true))
      io.context.warn(
          "the machine does not keep up, or half an hour has passed: those who have joined get no more of it");
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  const RehearsalSummary s = rehearsal.stop();
  // Those who are behind get the rest.
  net->over(s.ticks);
  wait_for_all(host, 30);
  Json j{
      {"osteotome_tutoring", 1}, {"bone_hash", s.bone_hash}, {"ticks", s.ticks}, {"packets_refused", host.refused()}};
  j["peers"] = Json::list();
  for (const PeerStatus& x : host.status(steady_us())) j["peers"].push_back(status_json(x));
  if (s.loop) j["lateness_p99_9_us"] = s.loop->lateness.quantile_us(0.999);
  net.reset();
  write_summary(session, s, options.rate_hz, instrument_library()[static_cast<std::size_t>(script.tool)].name,
                options.anatomy);
  write_file(session.folder / "tutoring.json", j.dump(2) + "\n");
  if (io.common.json) io.out << j.dump(2) << '\n';
  if (!io.common.quiet) io.err << "session: " << session.folder.string() << ", bone " << s.bone_hash << '\n';
  return static_cast<int>(host.lost() || !s.gaps.empty() ? ExitCode::partial : ExitCode::ok);
}

cli::CommandInfo JoinCommand::info() {
  return {"join",
          "take part in, or watch, a session that 'osteo tutor' runs on another machine",
          "Needs the same case; the host's bone is checked against it. A simulated hand is led by the instructor's "
          "(--hand), or with --role "
          "watcher none. Bone is compared each second; where it differs the copy is made again from the beginning, and "
          "that is said. Without a "
          "code it is asked for on standard input.",
          {{"host", "HOST:PORT as the host shows it"}},
          "osteo join 192.0.2.7:18950 --case-folder CASE"};
}

int JoinCommand::run(const Params& p, cli::Invocation& io) {
  const UdpPeer host = udp_peer(io.arguments[0]);
  std::string typed = p.code;
  if (typed.empty()) {
    io.err << "code: " << std::flush;
    std::getline(std::cin, typed);
  }
  const std::string code = tidy_code(typed);
  if (code.empty())
    throw Error(ExitCode::usage, "this is no code", "eight letters and digits, as the host shows them: K7MX-2QPA");
  const bool trainee = p.role == Attend::trainee;
  const double hand_n_per_m = trainee ? simulated_stiffness(p.hand) : 0;
  const Case the_case = load_case(p.case_folder);
  LiveSeat seat({host, code, trainee ? JoinRole::trainee : JoinRole::watcher, p.stiffness_n_per_mm, p.most_n});
  const SessionHeader header = seat.wait_for_session(p.wait_s, io.context);
  const Bytes past = seat.past();
  HapticSetup setup = header.haptics;
  RehearsalOptions options;
  options.follow.surface = !p.out.empty();
  options.anatomy = anatomy_of(the_case, setup, io.context);
  if (setup.structures != header.haptics.structures)
    throw Error(ExitCode::usage, "the host's case has other critical structures", "both need the same case, unchanged");
  const auto begin = [&](const fs::path& out) {
    std::optional<SessionFolder> session;
    if (!out.empty()) {
      session = create_joined_folder(out, the_case.folder, past,
                                     joined_text(trainee ? JoinRole::trainee : JoinRole::watcher));
      options.session_file = session->stream();
    } else {
      options.session_file.clear();
    }
    return std::pair(
        seat.begin(header, world_of_past(past, the_case, options.anatomy), options,
                   trainee ? std::make_unique<YieldingHand>(hand_n_per_m, seat.leader()) : nullptr, io.context),
        session);
  };
  auto [rehearsal, session] = begin(p.out);
  io.end_progress();
  if (!io.common.quiet)
    io.err << "joined; clock of the host: " << hundredths(seat.status().offset_ms) << " ms, there and back "
           << hundredths(seat.status().rtt_ms) << " ms" << std::endl;
  std::uint64_t again = 0;
  SeatStatus now = seat.status();
  bool reported_link = false;
  while (!io.context.cancelled() && !now.over && !now.another && now.state != JoinState::refused &&
         seat.silent_s() < p.patience_s) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    now = seat.status();
    if ((now.state != JoinState::joined) != std::exchange(reported_link, now.state != JoinState::joined))
      io.context.warn(reported_link ? "the link has dropped; the host is asked again" : "the link is back");
    if (now.host_lost && now.behind_ticks == 0) break;
    if (now.bone_differs_since > 0 && again < 3) {
      ++again;
      io.context.warn("the copy's bone differs since tick " + std::to_string(now.bone_differs_since) +
                      ": it is made again from the beginning");
      seat.leave();
      rehearsal->stop();
      std::tie(rehearsal, session) = begin(p.out.empty() ? p.out : p.out + "-again-" + std::to_string(again));
    }
  }
  const bool whole = now.over;
  // The host hears that all of it is here.
  std::this_thread::sleep_for(std::chrono::milliseconds(whole ? 30 : 0));
  now = seat.status();
  seat.leave();
  const RehearsalSummary s = rehearsal->stop();
  if (session) write_summary(*session, s, header.rate_hz, "far away", options.anatomy);
  Json j{{"ticks", s.ticks},
         {"bone_hash", s.bone_hash},
         {"whole", whole},
         {"marks_same", now.marks_same},
         {"made_again", again},
         {"packets_refused", now.packets_refused},
         {"rtt_ms", now.rtt_ms},
         {"offset_ms", now.offset_ms},
         {"drift_ppm", now.drift_ppm},
         {"lost", now.lost},
         {"apart_rms_mm", now.apart_rms_mm},
         {"apart_most_mm", now.apart_most_mm},
         {"led_s", now.led_s}};
  if (io.common.json) io.out << j.dump(2) << '\n';
  if (!io.common.quiet)
    io.err << s.ticks << " ticks, bone " << s.bone_hash << ", the same as the host's in " << now.marks_same
           << " comparisons, one a second; clock of the host " << hundredths(now.offset_ms) << " ms, drift "
           << hundredths(now.drift_ppm) << " ppm, there and back " << hundredths(now.rtt_ms) << " ms\n";
  io.context.check_cancelled();
  if (!whole) io.err << "NOT WHOLE: the host did not say that the session is over\n";
  return static_cast<int>(whole && now.bone_differs_since == 0 ? ExitCode::ok : ExitCode::partial);
}

}  // namespace osteo
