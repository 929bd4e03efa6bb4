#include <algorithm>
#include <bit>
#include <cmath>

#include "osteo/network/tutor/live.h"

namespace osteo::inline network {

void ClockSync::heard(const WireTimes& t, std::int64_t now_us) {
  last_sent_us_ = t.sent_us;
  last_heard_us_ = now_us;
  if (t.echo_us == 0) return;
  // Differences of what the other side says may be anything.
  const double held = static_cast<double>(t.held_us),
               rtt = static_cast<double>(now_us) - static_cast<double>(t.echo_us) - held;
  if (!(rtt >= 0 && rtt < 1e7 && held >= 0)) return;
  const double offset = static_cast<double>(t.sent_us) + rtt / 2 - static_cast<double>(now_us);
  last_[count_++ % last_.size()] = {rtt, offset};
  const auto* const best =
      std::min_element(last_.begin(), last_.begin() + static_cast<std::ptrdiff_t>(std::min(count_, last_.size())),
                       [](const Exchange& a, const Exchange& b) { return a.rtt_us < b.rtt_us; });
  rtt_us_ = best->rtt_us;
  offset_us_ = best->offset_us;
  if (count_ == last_.size()) {
    first_us_ = now_us;
    first_offset_us_ = offset_us_;
  } else if (count_ > last_.size() && now_us - first_us_ > 10'000'000) {
    drift_ppm_ = (offset_us_ - first_offset_us_) / static_cast<double>(now_us - first_us_) * 1e6;
  }
}

WireTimes ClockSync::stamp(std::int64_t now_us) const {
  return {now_us, last_sent_us_, last_sent_us_ == 0 ? 0 : now_us - last_heard_us_};
}

void JitterBuffer::put(const FarSample& s, std::uint64_t now, bool newest) noexcept {
  const std::uint64_t back = any_ && s.tick < newest_ ? newest_ - s.tick : 0;
  // What is far ahead of all before it begins again; what is older than the buffer is of no use.
  if (back >= kSlots / 2) return;
  slots_[s.tick % kSlots] = s;
  newest_ = std::max(newest_, s.tick);
  last_heard_ = now;
  if (newest) {
    delays_[delays_known_++ % kDelays] = static_cast<std::int64_t>(now) - static_cast<std::int64_t>(s.tick);
    const std::size_t n = std::min(delays_known_, kDelays);
    // All but a hundredth: the third of 256.
    std::array<std::int64_t, 3> top;
    top.fill(delays_[0]);
    least_ = delays_[0];
    std::size_t filled = 0;
    for (std::size_t i = 0; i < n; ++i) {
      const std::int64_t d = delays_[i];
      least_ = std::min(least_, d);
      std::size_t at = filled;
      while (at > 0 && d > top[at - 1]) --at;
      if (at >= top.size()) continue;
      for (std::size_t k = std::min(filled, top.size() - 1); k > at; --k) top[k] = top[k - 1];
      top[at] = d;
      filled = std::min(filled + 1, top.size());
    }
    const std::int64_t wanted = n >= 128 ? top[2] : top[0];
    target_ = std::min(wanted, least_ + 150);
    if (!any_) delay_ = target_;
  }
  any_ = true;
}

DeviceSample JitterBuffer::read(std::uint64_t now, bool pulls) noexcept {
  if (!any_) {
    DeviceSample nobody;
    nobody.position_mm = {0, 0, 5000};
    nobody.age_ms = 255;
    return nobody;
  }
  if (++slew_ >= 20) {
    slew_ = 0;
    delay_ += (target_ > delay_) - (target_ < delay_);
  }
  if (std::abs(target_ - delay_) > 200) delay_ = target_;  // another sender, or its clock was set
  const std::int64_t want = static_cast<std::int64_t>(now) - delay_;
  for (std::int64_t t = want; t >= 0 && t > want - 256; --t) {
    const FarSample& s = slots_[static_cast<std::uint64_t>(t) % kSlots];
    if (s.tick != static_cast<std::uint64_t>(t) || (t == 0 && newest_ >= kSlots)) continue;
    held_ = s.sample;
    played_ = s.tick;
    break;
  }
  const std::uint64_t silent = now > last_heard_ ? now - last_heard_ : 0;
  strength_ = pulls ? std::min(1.0, strength_ + 1.0 / kRampTicks) : std::max(0.0, strength_ - 1.0 / kFadeTicks);
  // What a moment of silence takes comes back as it went; a hand that is led by half for as long as a ramp is far off.
  heard_ = silent > kSilenceTicks
               ? std::min(heard_, std::max(0.0, 1 - static_cast<double>(silent - kSilenceTicks) / kFadeTicks))
               : std::min(1.0, heard_ + 1.0 / kFadeTicks);
  if (silent > kMomentTicks) strength_ = 0;
  const double strength = strength_ * heard_;
  DeviceSample s = held_;
  s.age_ms = static_cast<std::uint8_t>(std::min<std::uint64_t>(silent > kSilenceTicks ? silent : 0, 255));
  s.buttons = static_cast<std::uint8_t>(std::lround(strength * double{kLeadStrength}));
  return s;
}

DeviceSample FarDevice::read(std::uint64_t tick, double, Vec3) noexcept {
  std::array<Item, 64> items;
  const std::size_t n = inbox_.pop(items);
  for (std::size_t i = 0; i < n; ++i) jitter_buffer_.put(items[i].sample, tick, items[i].newest);
  const DeviceSample s = jitter_buffer_.read(tick, pulls());
  shown_.store(s);
  strength_.store(static_cast<double>(s.buttons & kLeadStrength) / double{kLeadStrength}, std::memory_order_relaxed);
  buffer_.store(jitter_buffer_.buffer_ticks(), std::memory_order_relaxed);
  return s;
}

double delayed_stiffness_n_per_mm(double damping, double mass_kg, double delay_s) {
  const double always = damping * damping / (2 * mass_kg);
  const double short_delay = delay_s > 0 ? 0.5 * damping / delay_s : 1e9;
  return std::max(always, short_delay) / 1000;
}

HandGuide far_guide(std::uint32_t hand, std::uint32_t leader, const DeviceTraits& device, double wanted_n_per_mm,
                    double most_n) {
  HandGuide g;
  g.hand = hand;
  g.leader = leader;
  g.brake_n_s_per_m = kFarBrake;
  g.stiffness_n_per_mm =
      std::min(wanted_n_per_mm,
               delayed_stiffness_n_per_mm(kFarBrake + std::min(device.damping_n_s_per_m, 5.0), kFarMassKg, 1e9));
  g.most_n = most_n;
  return g;
}

std::uint64_t mixed(std::uint64_t hash, std::uint64_t tick, std::span<const VoxelChange> changes) noexcept {
  const auto add = [&](std::uint64_t v) {
    hash = (hash ^ v) * 0x9e3779b97f4a7c15ULL;
    hash ^= hash >> 29;
  };
  for (const VoxelChange& c : changes) {
    add(tick);
    add(std::uint64_t{c.voxel} << 32 | std::bit_cast<std::uint32_t>(c.density));
  }
  return hash;
}

void LiveCopy::Hash::tick(const TickRecord& record, std::span<const VoxelChange> changes) {
  hash = mixed(hash, record.tick, changes);
}

LiveCopy::LiveCopy(World begin, const RehearsalOptions& options, const Context& context) {
  std::vector<std::unique_ptr<Device>> devices;
  for (std::size_t h = 0; h < options.haptics.hands(); ++h) {
    auto hand = std::make_unique<Hand>();
    hands_.push_back(hand.get());
    devices.push_back(std::move(hand));
  }
  // Its reader goes after it.
  auto made = std::make_unique<Rehearsal>(std::move(begin), std::move(devices), options, context);
  rehearsal_ = {made.release(), [keep = hash_](Rehearsal* r) { delete r; }};
  rehearsal_->add_reader(*hash_);
}

std::optional<BoneMark> LiveCopy::step(const LiveTick& tick) {
  for (std::size_t h = 0; h < hands_.size(); ++h) hands_[h]->sample = tick.hands[h];
  rehearsal_->step_elsewhere(tick.actions);
  if (++ticks_ % kMarkTicks != 0) return std::nullopt;
  return mark();
}

BoneMark LiveCopy::mark() {
  rehearsal_->catch_up();
  return {ticks_, hash_->hash};
}

std::string LiveCopy::bone_hash() {
  std::string hash;
  rehearsal_->look([&](const World& world, SceneReaders&) { hash = world.hash(); });
  return hash;
}

HapticSetup LiveFeel::setup_of(const HapticSetup& session, const DeviceTraits& own) {
  HapticSetup setup = session;
  setup.device = own;
  setup.more_devices = {session.device};
  // Its map is kept true by who takes the bone away.
  setup.params.effects.fail_safe = false;
  return setup;
}

LiveFeel::LiveFeel(const World& copy, const HapticSetup& session, const Anatomy& anatomy, const DeviceTraits& own,
                   const HandGuide& guide, double rate_hz)
    : renderer_(setup_of(session, own), anatomy, 1 / rate_hz), scene_(HapticScene::of(copy, renderer_.setup())) {
  renderer_.show(&scene_);
  renderer_.hold(true);
  renderer_.guide(action_of(guide));
}

TickRecord LiveFeel::step(const DeviceSample& own, const DeviceSample& host) noexcept {
  DeviceSample shown = host;
  shown.buttons |= kLeadStill;
  const DeviceSample both[] = {own, shown};
  return renderer_.step(both).hands.front();
}

}  // namespace osteo::inline network
