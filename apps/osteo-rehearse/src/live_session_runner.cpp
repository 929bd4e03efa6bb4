#include "live_session_runner.h"

#include <utility>

#include "osteo/core/base/error.h"
#include "osteo/core/base/translate.h"

namespace osteo {
namespace {

constexpr double kPullNPerMm = 1, kMaxPullN = 3;
constexpr int kMaxAgain = 3;

}  // namespace

LiveSessionRunner::LiveSessionRunner(const WindowFlags& flags)
    : hosts_(flags.tutor),
      two_way_(flags.two_way),
      listen_(flags.listen),
      join_(flags.join),
      role_(flags.role == Attend::trainee ? JoinRole::trainee : JoinRole::watcher),
      port_(flags.port) {
  if (hosts_ && joins())
    throw Error(ExitCode::usage, "--tutor and --join exclude each other", "one runs the session, the others join it");
  if (two_way_ && !hosts_) throw Error(ExitCode::usage, "--two-way has no effect without --tutor", "leave it out");
  if (!flags.code.empty() && !joins())
    throw Error(ExitCode::usage, "--code has no effect without --join", "leave it out");
  const auto refuse = [&](bool given, const char* flag) {
    if (given && (hosts_ || joins()))
      throw Error(ExitCode::usage, std::string(flag) + " does not go with --tutor and --join", "leave one of them out");
  };
  refuse(!flags.playback.empty(), "--playback");
  refuse(flags.second_device != SecondDevice::keys, "--second-device");
  if (!flags.resume.empty() && joins())
    throw Error(ExitCode::usage, "--resume does not go with --join",
                "the session is the host's; leave one of them out");
  for (const auto& [given, flag] : {std::pair(flags.dust, "--dust"), std::pair(flags.heat, "--heat")}) {
    if (given && joins())
      throw Error(ExitCode::usage, std::string(flag) + " does not go with --join",
                  "the host switches it for all; leave it out");
  }
  if (flags.monitor && joins()) throw Error(ExitCode::usage, "--monitor does not go with --join", "the host has it");
  if (hosts_) code_ = make_pairing_code();
  if (!joins()) return;
  code_ = tidy_code(flags.code);
  if (code_.empty())
    throw Error(ExitCode::usage, "this is no code", "eight letters and digits, as the host shows them: K7MX-2QPA");
  static_cast<void>(udp_peer(join_));
}

void LiveSessionRunner::add_hand(std::vector<std::unique_ptr<Device>>& devices, RehearsalOptions& options) {
  devices.resize(1);
  far_ = std::make_shared<FarDevice>();
  far_->pull(pulls_);
  devices.push_back(std::make_unique<FarHand>(far_));
  std::erase_if(options.actions, [](const SceneAction& a) { return a.is(ActionKind::guide); });
  if (two_way_)
    options.actions.push_back(action_of(far_guide(0, 1, devices.front()->traits(), kPullNPerMm, kMaxPullN)));
}

void LiveSessionRunner::open(Rehearsal& rehearsal, const SessionHeader& header, const SessionFolder& session) {
  closed_.clear();
  Bytes past;
  try {
    past = past_bytes(session);
  } catch (const Error& e) {
    closed_ = e.what() + (e.advice().empty() ? std::string() : "; " + e.advice());
    return;
  }
  host_ = std::make_unique<LiveHost>(tidy_code(code_), settings_bytes(header, past), header.haptics.hands(), far_);
  net_ = std::make_unique<HostThread>(*host_, rehearsal, listen_, port_);
  port_ = net_->port();  // those who have joined find the next session there
}

void LiveSessionRunner::close(std::uint64_t ticks) {
  if (!net_) return;
  if (ticks > 0) {
    net_->over(ticks);
    wait_for_all(*host_, 2);
  }
  net_.reset();
  host_.reset();
}

std::pair<SessionHeader, Bytes> LiveSessionRunner::wait(const Context& context) {
  if (!seat_) {
    const UdpPeer host = udp_peer(join_);
    host_name_ = udp_name(host);
    seat_ = std::make_unique<LiveSeat>(SeatOptions{host, code_, role_, kPullNPerMm, kMaxPullN});
  }
  SessionHeader header = seat_->wait_for_session(60, context);
  return {std::move(header), seat_->past()};
}

std::shared_ptr<Rehearsal> LiveSessionRunner::begin(const SessionHeader& header, World world,
                                                    const RehearsalOptions& options, std::unique_ptr<Device> own,
                                                    const Context& context) {
  if (seat_->status().bone_differs_since > 0) ++again_;
  return seat_->begin(header, std::move(world), options, std::move(own), context);
}

void LiveSessionRunner::leave() {
  if (seat_) seat_->leave();
}

void LiveSessionRunner::guide(bool on) {
  pulls_ = on;
  if (far_) far_->pull(on);
  if (seat_) seat_->leader()->pull(on);
}

TutorNow LiveSessionRunner::now(const Rehearsal* rehearsal) const {
  TutorNow n;
  if (hosts_ && host_ && net_) {
    n.teaches = true;
    n.title = two_way_ ? tr("You teach; hands pull each other") : tr("You teach; the trainee's hand is led by yours");
    const bool bracket = listen_.find(':') != std::string::npos;
    n.invitation = "osteo rehearse CASE --join " + (bracket ? "[" + listen_ + "]" : listen_) + ":" +
                   std::to_string(net_->port()) + "\ncode " + code_;
    n.hands = {"you", "trainee"};
    n.leads = two_way_;
    n.guiding = pulls_;
    n.pull = two_way_ ? far_->strength() : 0;
    int watchers = 0;
    for (const PeerStatus& s : host_->status(steady_us())) {
      const std::string who = s.role == JoinRole::trainee ? "trainee" : "watcher " + std::to_string(++watchers);
      n.links.push_back({who, s.heard, s.rtt_ms, s.offset_ms, s.drift_ppm, s.lost,
                         static_cast<double>(s.behind_ticks) / 1000, s.bone_differs_since > 0});
    }
    if (host_->tries_left() == 0) n.trouble = tr("three wrong codes: nobody else can join this session");
    if (host_->lost())
      n.trouble =
          tr("this machine does not keep up, or half an hour has passed: the others get no more of this session");
    const TickRecord far = rehearsal != nullptr ? rehearsal->latest(1) : TickRecord{};
    if (far.tick != 0 && far.device.age_ms < 255)
      n.apart_mm = length(from_floats(far.device.position_mm) - from_floats(rehearsal->latest(0).device.position_mm));
  } else if (hosts_ && !closed_.empty()) {
    n.title = tr("You teach");
    n.teaches = true;
    n.hands = {"you", "trainee"};
    n.trouble = filled(tr("nobody can join this session: {why}"), {{"why", closed_}});
  } else if (seat_) {
    const SeatStatus s = seat_->status();
    const bool trainee = role_ == JoinRole::trainee;
    n.title = trainee ? tr("You learn; the instructor's hand leads yours") : tr("You watch");
    n.teaches = !trainee;
    n.hands =
        trainee ? std::vector<std::string>{"you", "instructor"} : std::vector<std::string>{"instructor", "trainee"};
    n.links.push_back({"instructor", s.state == JoinState::joined && seat_->silent_s() < 0.5, s.rtt_ms, s.offset_ms,
                       s.drift_ppm, s.lost, static_cast<double>(s.behind_ticks) / 1000, s.bone_differs_since > 0});
    n.leads = trainee;
    n.guiding = pulls_;
    n.pull = trainee ? s.strength : 0;
    if (trainee && s.strength > 0) n.apart_mm = s.apart_mm;
    if (s.over) n.trouble = tr("the instructor's session is over");
    if (s.host_lost) n.trouble = tr("the instructor's machine gives no more of this session");
    if (s.state == JoinState::refused) n.trouble = filled(tr("the host rejects: {why}"), {{"why", s.why}});
    n.begin_again = s.another || (s.bone_differs_since > 0 && again_ < kMaxAgain);
    if (s.bone_differs_since > 0 && !n.begin_again) n.trouble = tr("this copy's bone is another than the instructor's");
  }
  return n;
}

}  // namespace osteo
