// A host and a guest with their hands, a network between them that is simulated, a millisecond a step.
#pragma once
#include <cmath>
#include <memory>
#include <optional>

#include "bar.h"
#include "osteo/network/tutor/live.h"
#include "osteo/simulation/bone/instrument.h"
#include "osteo/simulation/haptics/simulated_device.h"
#include "sim_network.h"

namespace osteo::test {

inline constexpr const char* kCode = "K7MX2QPA";
inline constexpr UdpPeer kGuest{{}, 0, 7};

// A device of 0.1 kg and 1 N s/m in a hand that wants something, or nothing.
class SimHand final : public Device {
 public:
  explicit SimHand(Vec3 start, double own_damping = 1) : device_(params(own_damping), start) {
    device_.set_drill(true, burr_index(BurrKind::cutting, 4));
  }
  DeviceSample read(std::uint64_t tick, double dt, Vec3 force) noexcept override {
    DeviceSample s = device_.read(tick, dt, force);
    s.pedal = pedal;
    return s;
  }
  [[nodiscard]] DeviceTraits traits() const override { return device_.traits(); }
  SimulatedDevice& device() { return device_; }
  std::uint8_t pedal = 255;

 private:
  static SimulatedDeviceParams params(double damping) {
    SimulatedDeviceParams p;
    p.damping_n_s_per_m = damping;
    return p;
  }
  SimulatedDevice device_;
};

struct LiveParams {
  NetworkFaults faults;
  double seconds = 4;
  double stiffness_n_per_mm = 10, brake = -1;  // of the guides; -1: as far_guide has it
  bool two_way = true;
  bool follows = true;  // the guest has no will; else both rest after a push
  std::int64_t guest_clock_us = 123'456'789;
  double guest_drift = 0;  // of its clock
};

// Host and guest, each with a millisecond a step.
class LivePair {
 public:
  explicit LivePair(const LiveParams& p)
      : p_(p),
        to_host_(p.faults, 11),
        to_guest_(p.faults, 12),
        host_hand_(Vec3{-6, 0, 9}),
        guest_hand_(Vec3{-5, 0, 9}) {
    setup_.device = host_hand_.traits();
    setup_.more_devices = {guest_hand_.traits()};
    host_.emplace(kCode, Bytes{1, 2, 3}, 2, far_);
    guest_.emplace(kCode, JoinRole::trainee, host_shown_);
    Device* const both[] = {&host_hand_, far_.get()};
    operation_.emplace(World(bar(0.5, 0.3)), setup_, Anatomy{}, both, stream_, 1000);
    dispatcher_.emplace(stream_.add_reader(), operation_->world());
    dispatcher_->add(operation_->strokes(), false);
    dispatcher_->add(*host_);
    if (p.two_way) operation_->act(action_of(guide(0, 1)));
    copy_.emplace(World(bar(0.5, 0.3)), options(), Context{});
    make_feel();
  }

  [[nodiscard]] RehearsalOptions options() const {
    RehearsalOptions o;
    o.haptics = setup_;
    o.follow.surface = false;
    return o;
  }
  void make_feel() {
    copy_->rehearsal()->look([&](const World& world, SceneReaders&) {
      feel_.emplace(world, setup_, Anatomy{}, guest_hand_.traits(), guide(0, 1), 1000);
    });
  }

  HandGuide guide(std::uint32_t hand, std::uint32_t leader) const {
    HandGuide g = far_guide(hand, leader, {.damping_n_s_per_m = 1}, p_.stiffness_n_per_mm, 6);
    if (p_.brake >= 0) {
      g.brake_n_s_per_m = p_.brake;
      g.stiffness_n_per_mm = p_.stiffness_n_per_mm;
    }
    return g;
  }

  void step() {
    const std::int64_t now = static_cast<std::int64_t>(tick_) * 1000,
                       theirs = p_.guest_clock_us +
                                static_cast<std::int64_t>(static_cast<double>(now) * (1 + p_.guest_drift));
    for (const Bytes& b : to_host_.arrived(now)) host_->receive(kGuest, b, now);
    for (const Bytes& b : to_guest_.arrived(now)) guest_->receive(b, theirs);
    operation_->step(0);
    dispatcher_->drain();
    for (auto& o : host_->poll(now)) to_guest_.send(o.bytes, now);

    const DeviceSample shown = host_shown_->read(tick_, 1e-3, {});
    const DeviceSample own = guest_hand_.read(tick_, 1e-3, felt_);
    felt_ = from_floats(feel_->step(own, shown).force_n);
    guest_->put({tick_, own});
    for (const Bytes& b : guest_->poll(theirs)) to_host_.send(b, now);
    while (const auto t = guest_->next()) {
      if (const auto mark = copy_->step(*t)) guest_->mark(*mark);
    }
    ++tick_;
  }
  [[nodiscard]] double apart_mm() {
    return length(host_hand_.device().position_mm() - guest_hand_.device().position_mm());
  }
  [[nodiscard]] double kinetic_mj() {
    const auto of = [](SimHand& h) {
      return 0.5 * 0.1 * dot(h.device().velocity_mm_s(), h.device().velocity_mm_s()) / 1000;
    };
    return of(host_hand_) + of(guest_hand_);
  }
  // The rest of the log, without new ticks.
  void settle() {
    for (int i = 0; i < 3000 && guest_->next_tick() < operation_->ticks(); ++i, ++tick_) {
      const std::int64_t now = static_cast<std::int64_t>(tick_) * 1000;
      for (const Bytes& b : to_host_.arrived(now)) host_->receive(kGuest, b, now);
      for (const Bytes& b : to_guest_.arrived(now)) guest_->receive(b, now + p_.guest_clock_us);
      for (auto& o : host_->poll(now)) to_guest_.send(o.bytes, now);
      for (const Bytes& b : guest_->poll(now + p_.guest_clock_us)) to_host_.send(b, now);
      while (const auto t = guest_->next()) {
        if (const auto mark = copy_->step(*t)) guest_->mark(*mark);
      }
    }
  }

  LiveParams p_;
  SimNetwork to_host_, to_guest_;
  SimHand host_hand_, guest_hand_;
  std::shared_ptr<FarDevice> far_ = std::make_shared<FarDevice>(), host_shown_ = std::make_shared<FarDevice>();
  HapticSetup setup_;
  std::optional<LiveHost> host_;
  std::optional<LiveGuest> guest_;
  Stream stream_;
  std::optional<Operation> operation_;
  std::optional<ReaderDispatcher> dispatcher_;
  std::optional<LiveCopy> copy_;
  std::optional<LiveFeel> feel_;
  Vec3 felt_;
  std::uint64_t tick_ = 0;
};

}  // namespace osteo::test
