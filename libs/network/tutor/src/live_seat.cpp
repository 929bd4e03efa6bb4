#include "osteo/network/tutor/live_seat.h"

#include <chrono>
#include <cmath>
#include <utility>

#include "osteo/core/base/error.h"
#include "osteo/network/tutor/live_past.h"

namespace osteo::inline network {

// --- a hand without a will

YieldingHand::YieldingHand(double stiffness_n_per_m, std::shared_ptr<const FarDevice> leader)
    : device_(SimulatedDeviceParams{}, {}), stiffness_n_per_mm_(stiffness_n_per_m / 1000), leader_(std::move(leader)) {}

DeviceSample YieldingHand::read(std::uint64_t tick, double dt_s, Vec3 force_n) noexcept {
  constexpr double kYieldS = 0.1;
  if (!begun_) {
    const DeviceSample leader = leader_->shown();
    DeviceSample none;
    none.age_ms = 255;
    if ((leader.buttons & kLeadStrength) == 0) return none;
    begun_ = true;
    place_ = from_floats(leader.position_mm) + Vec3{0, 0, 3};
    device_ = SimulatedDevice(SimulatedDeviceParams{}, place_);
    device_.set_drill(false, leader.tool);
  }
  place_ += (device_.position_mm() - place_) * (dt_s / kYieldS);
  device_.set_hand({}, place_, stiffness_n_per_mm_);
  return device_.read(tick, dt_s, force_n);
}

// --- what the own hand feels: made again where the scene changes, while it is felt

class LiveSeat::Feeling final : public Reader {
 public:
  using Make = std::function<std::unique_ptr<LiveFeel>(const World&)>;
  Feeling(Make make, const World& world) : make_(std::move(make)), held_(make_(world)), given_(held_.get()) {}

  LiveFeel& take() noexcept { return *given_.load(std::memory_order_acquire); }
  void took() noexcept { steps_.fetch_add(1, std::memory_order_release); }
  void run(bool on) noexcept { runs_ = on; }

  void scene_changed(const World& world, const World::Effect&) override {
    std::unique_ptr<LiveFeel> next = make_(world);
    given_.store(next.get(), std::memory_order_release);
    // Until the hand is done with the one before: a tick or two.
    const std::uint64_t now = steps_;
    while (runs_ && steps_ < now + 2) std::this_thread::sleep_for(std::chrono::microseconds(200));
    held_ = std::move(next);
  }

 private:
  const Make make_;
  std::unique_ptr<LiveFeel> held_;
  std::atomic<LiveFeel*> given_;
  std::atomic<std::uint64_t> steps_{0};
  std::atomic<bool> runs_{false};
};

std::string joined_text(JoinRole role) {
  return role == JoinRole::trainee
             ? "live tutoring: the second hand is this trainee's, led by the instructor's, far away"
             : "live tutoring: watched from far away";
}

// --- the link

LiveSeat::LiveSeat(const SeatOptions& options)
    : options_(options), guest_(options.tidy_code, options.role, leader_), socket_("", 0) {
  packets_ = std::thread([this] {
    while (!stop_packets_) {
      socket_.wait_ms(1);
      exchange();
    }
  });
}

LiveSeat::~LiveSeat() {
  try {
    leave();
  } catch (...) {  // told by an earlier leave(), or by nobody's fault any more
  }
  stop_packets_ = true;
  packets_.join();
}

void LiveSeat::exchange() {
  UdpPeer from;
  for (int n = 0; n < HostThread::kMaxPackets; ++n) {
    const auto packet = socket_.receive(from);
    if (!packet) break;
    if (from != options_.host) continue;
    const std::lock_guard lock(mutex_);
    guest_.receive(*packet, steady_us());
  }
  std::vector<Bytes> out;
  {
    const std::lock_guard lock(mutex_);
    out = guest_.poll(steady_us());
  }
  for (const Bytes& b : out) socket_.send(options_.host, b);
}

SessionHeader LiveSeat::wait_for_session(double most_s, const Context& context) {
  std::int64_t begin = steady_us();
  std::size_t here = 0;
  for (;;) {
    {
      const std::lock_guard lock(mutex_);
      if (const std::size_t now = guest_.settings_here(); std::exchange(here, now) != now) begin = steady_us();
      if (guest_.state() == JoinState::refused)
        throw Error(ExitCode::failed, "the host rejects: " + guest_.why(), "ask for the code it shows now");
      if (!guest_.settings().empty()) return settings_of(guest_.settings());
    }
    context.check_cancelled();
    if (steady_us() - begin > static_cast<std::int64_t>(most_s * 1e6)) {
      const std::lock_guard lock(mutex_);
      if (guest_.answered())
        throw Error(ExitCode::failed,
                    "the host at " + udp_name(options_.host) + " answers, but too little of it comes through",
                    "a bad line, or somebody floods the host: try again");
      throw Error(ExitCode::failed, "nobody answers at " + udp_name(options_.host),
                  "look at address, port and firewall");
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
}

Bytes LiveSeat::past() const {
  const std::lock_guard lock(mutex_);
  return past_of(guest_.settings());
}

// --- the session

std::shared_ptr<Rehearsal> LiveSeat::begin(const SessionHeader& header, World begin, RehearsalOptions options,
                                           std::unique_ptr<Device> own, const Context& context) {
  leave();
  if (begin.hash() != header.bone_hash)
    throw Error(ExitCode::usage, "the host's bone is another", "both need the same case, unchanged");
  header_ = header;
  own_ = std::move(own);
  options.haptics = header.haptics;
  options.rate_hz = header.rate_hz;
  options.follow.dust = header.dust;
  options.follow.heat = header.heat;
  options.actions.clear();
  options.soft = nullptr;
  copy_ = std::make_unique<LiveCopy>(std::move(begin), options, context);
  const std::shared_ptr<Rehearsal> rehearsal = copy_->rehearsal();
  if (own_) {
    const DeviceTraits traits = own_->traits();
    const HandGuide guide = far_guide(0, 1, traits, options_.stiffness_n_per_mm, options_.most_n);
    rehearsal->look([&](const World& world, SceneReaders&) {
      feeling_ = std::make_unique<Feeling>(
          [traits, guide, header, anatomy = options.anatomy](const World& w) {
            return std::make_unique<LiveFeel>(w, header.haptics, anatomy, traits, guide, header.rate_hz);
          },
          world);
    });
    rehearsal->add_reader(*feeling_);
    own_now_.store({});
    rehearsal->seat(own_.get(), &own_now_, 1);
  }
  {
    const std::lock_guard lock(mutex_);
    session_ = guest_.session();
    guest_.begin_again();
    guest_.be_ready();
  }
  ticks_ = counted_ = 0;
  squares_ = most_mm_ = apart_mm_ = 0;
  stop_ticks_ = failed_ = false;
  failure_ = nullptr;
  copying_ = std::thread([this] { do_ticks(); });
  if (own_) {
    loop_ = std::make_unique<FixedRateLoop>(header.rate_hz, [this](std::int64_t) { return own_tick(); });
    feeling_->run(true);
    loop_->start();
  }
  return rehearsal;
}

void LiveSeat::leave() {
  stop_ticks_ = true;
  if (loop_) {
    loop_->request_stop();
    loop_->join();
  }
  if (feeling_) feeling_->run(false);
  if (copying_.joinable()) copying_.join();
  loop_.reset();
  if (copy_ && feeling_) copy_->rehearsal()->remove_reader(*feeling_);
  feeling_.reset();
  if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
}

void LiveSeat::do_ticks() {
  try {
    bool ended = false;
    while (!stop_ticks_) {
      std::optional<LiveTick> tick;
      std::vector<SceneAction> behind;
      bool over = false;
      {
        const std::lock_guard lock(mutex_);
        if (guest_.session() == session_) {
          tick = guest_.next();
          over = !tick && guest_.over();
          if (over) behind = guest_.behind();
        }
      }
      if (!tick) {
        copy_->rehearsal()->catch_up();
        if (over && !std::exchange(ended, true)) copy_->end(behind);
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
        continue;
      }
      if (const auto mark = copy_->step(*tick)) {
        const std::lock_guard lock(mutex_);
        guest_.mark(*mark);
      }
      ticks_ = tick->tick + 1;
    }
  } catch (...) {
    failure_ = std::current_exception();
    failed_ = true;
  }
}

bool LiveSeat::own_tick() {
  const double dt = 1 / header_.rate_hz;
  const std::uint64_t tick = own_ticks_++;
  const DeviceSample leader = leader_->read(tick, dt, {}), own = own_->read(tick, dt, felt_);
  if (own.age_ms == 255) return !stop_ticks_;
  LiveFeel& feel = feeling_->take();
  TickRecord now = feel.step(own, leader);
  felt_ = from_floats(now.force_n);
  own_->feel(felt_, feel.normal(), feel.stiffness_n_per_mm());
  feeling_->took();
  now.tick = tick + 1;  // 0: none yet
  now.hand = 0;
  own_now_.store(now);
  guest_.put({tick, own});
  if ((leader.buttons & kLeadStrength) != 0) {
    const double apart = length(from_floats(own.position_mm) - from_floats(leader.position_mm));
    apart_mm_ = apart;
    if ((leader.buttons & kLeadStrength) == kLeadStrength) {
      squares_ = squares_ + apart * apart;
      most_mm_ = std::max(most_mm_.load(), apart);
      counted_ = counted_ + 1;
    }
  }
  return !stop_ticks_;
}

double LiveSeat::silent_s() const {
  const std::lock_guard lock(mutex_);
  return static_cast<double>(steady_us() - guest_.heard_us()) * 1e-6;
}

SeatStatus LiveSeat::status() const {
  SeatStatus s;
  const auto counted = static_cast<double>(counted_.load());
  s.apart_mm = apart_mm_;
  s.strength = leader_->strength();
  s.apart_rms_mm = counted > 0 ? std::sqrt(squares_ / counted) : 0;
  s.apart_most_mm = most_mm_;
  s.led_s = header_.rate_hz > 0 ? counted / header_.rate_hz : 0;
  s.ticks = ticks_;
  const std::lock_guard lock(mutex_);
  s.state = guest_.state();
  s.why = guest_.why();
  s.rtt_ms = guest_.clock().rtt_ms();
  s.offset_ms = guest_.clock().offset_ms();
  s.drift_ppm = guest_.clock().drift_ppm();
  s.lost = guest_.lost();
  s.behind_ticks = guest_.host_tick() - std::min(guest_.host_tick(), s.ticks);
  s.another = session_ != 0 && guest_.session() != session_;
  s.over = !s.another && guest_.over() && s.ticks == guest_.host_tick();
  s.host_lost = guest_.host_lost() || failed_;
  s.marks_same = guest_.marks_same();
  s.bone_differs_since = guest_.differs();
  s.packets_refused = guest_.refused();
  return s;
}

}  // namespace osteo::inline network
