// Live tutoring and playback: how near hands stay, energy, what a bad network and a flood cost. Tables of
// docs/guides/tutoring.md.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <thread>

#include "bench.h"
#include "flood.h"
#include "osteo/core/base/files.h"
#include "osteo/network/tutor/live_run.h"
#include "osteo/network/tutor/playback.h"
#include "osteo/session/recording/script.h"
#include "tutor/firm_hand.h"
#include "tutor/live_pair.h"

namespace osteo {
namespace {

// What the pull does on a hand, tick by tick: its work, and what its brake alone takes away.
class Energy {
 public:
  Energy(const HandGuide& guide, const DeviceTraits& device) {
    HandGuide brake = guide;
    brake.stiffness_n_per_mm = 0;
    all_.set(guide, device, 0, 1e-3);
    brake_.set(brake, device, 0, 1e-3);
  }
  void step(Vec3 at_mm, const DeviceSample& leader) {
    const Vec3 pull = all_.step(at_mm, {}, leader, {}, 1e-3), drag = brake_.step(at_mm, {}, leader, {}, 1e-3);
    if (began_) {
      work_mj += dot(pull, at_mm - last_);
      braked_mj -= dot(drag, at_mm - last_);
    }
    most_mj = std::max(most_mj, work_mj);
    last_ = at_mm;
    began_ = true;
  }
  double work_mj = 0, most_mj = 0, braked_mj = 0;

 private:
  GuideLaw all_, brake_;
  Vec3 last_;
  bool began_ = false;
};

double quantile(std::vector<double>& all, double share) {
  const auto at = all.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(all.size() - 1));
  std::nth_element(all.begin(), at, all.end());
  return *at;
}

// The instructor strokes along the bar at up to 16 mm/s; the guest has no will but a grip of 100 N/m that gives way.
void live_row(double rtt_ms, double loss, bool two_way) {
  test::LiveParams p;
  const double jitter = rtt_ms / 5;
  p.faults = {rtt_ms / 2 - jitter / 2, jitter, loss, 0.01};
  p.two_way = two_way;
  test::LivePair pair(p);
  const DeviceTraits traits = pair.guest_hand_.traits();
  Energy host(pair.guide(0, 1), traits), guest(pair.guide(0, 1), traits);
  std::vector<double> apart;
  Vec3 place{-5, 0, 9};
  const int ticks = 8000;
  for (int t = 0; t < ticks; ++t) {
    const double at = t * 1e-3;
    pair.host_hand_.device().set_hand(
        {}, {-6 * std::cos(2 * M_PI * at / 2.4), 2 * std::sin(2 * M_PI * at / 3.1), at < 0.3 ? 9.0 - 15 * at : 4.6},
        0.6);
    place += (pair.guest_hand_.device().position_mm() - place) * 0.01;
    pair.guest_hand_.device().set_hand({}, place, 0.1);
    pair.step();
    if (t <= 1500) continue;
    apart.push_back(pair.apart_mm());
    if (two_way) host.step(pair.host_hand_.device().position_mm(), pair.far_->shown());
    guest.step(pair.guest_hand_.device().position_mm(), pair.host_shown_->shown());
  }
  const double seconds = ticks * 1e-3;
  const auto bytes_out = static_cast<double>(pair.to_guest_.bytes) / seconds,
             bytes_in = static_cast<double>(pair.to_host_.bytes) / seconds;
  pair.settle();
  const bool same = pair.operation_->world().hash() == pair.copy_->bone_hash();
  // A push of 2 N for 0.1 s in free air: what is left of the motion after five seconds.
  test::LivePair pushed(p);
  pushed.host_hand_.pedal = pushed.guest_hand_.pedal = 0;
  double early = 0, late = 0;
  for (int t = 0; t < 8000; ++t) {
    pushed.host_hand_.device().set_hand(t > 2000 && t < 2100 ? Vec3{0, 0, 2} : Vec3{}, {}, 0);
    pushed.step();
    if (t > 2100 && t < 4000) early = std::max(early, pushed.kinetic_mj());
    if (t > 7000) late = std::max(late, pushed.kinetic_mj());
  }
  std::printf("| %.0f | %.0f %% | %s | %.2f | %.2f | %.2f | %.1f, %.1f | %.1f | %.0f %% | %.0f, %.0f | %s |\n", rtt_ms,
              100 * loss, two_way ? "both" : "one", quantile(apart, 0.5), quantile(apart, 0.95), quantile(apart, 1),
              host.work_mj + guest.work_mj, host.most_mj + guest.most_mj, host.braked_mj + guest.braked_mj,
              early > 0 ? 100 * late / early : 0.0, bytes_out / 1000, bytes_in / 1000, same ? "same" : "DIFFERS");
  std::fflush(stdout);
}

// Grips of who is led, at 12 mm/s, 25 +- 5 ms each way, one in twenty lost, by the brake of both hands.
void grip_row(double grip_n_per_m, double brake_n_s_per_m) {
  test::LiveParams p;
  p.faults = {20, 10, 0.05, 0.01};
  p.brake = brake_n_s_per_m;
  p.stiffness_n_per_mm = delayed_stiffness_n_per_mm(brake_n_s_per_m + 1, kFarMassKg, 1e9);
  test::LivePair pair(p);
  std::vector<double> apart;
  Vec3 place{-5, 0, 9};
  for (int t = 0; t < 12000; ++t) {
    const double at = t * 1e-3;
    pair.host_hand_.device().set_hand(
        {}, {-6 * std::cos(2 * M_PI * at / 3.3), 2 * std::sin(2 * M_PI * at / 3.1), at < 0.3 ? 9.0 - 15 * at : 4.6},
        0.6);
    place += (pair.guest_hand_.device().position_mm() - place) * 0.01;
    pair.guest_hand_.device().set_hand({}, place, grip_n_per_m / 1000);
    pair.step();
    if (t > 1500) apart.push_back(pair.apart_mm());
  }
  std::printf("| %.0f N/m | %.0f N s/m, %.2f N/mm | %.2f, %.2f, %.2f |\n", grip_n_per_m, brake_n_s_per_m,
              p.stiffness_n_per_mm, quantile(apart, 0.5), quantile(apart, 0.95), quantile(apart, 1));
  std::fflush(stdout);
}

// The groove of the unit test in `seconds`, played back.
void playback_row(const std::filesystem::path& folder, double seconds, double stiffness, PlaybackMode mode, Pace pace,
                  double tolerance_radius_mm) {
  Script s;
  s.tool = burr_index(BurrKind::cutting, 4);
  for (const auto& [t, at, on] : std::initializer_list<std::tuple<double, Vec3, bool>>{{0, {-6, 0, 8}, true},
                                                                                       {0.12, {-6, 0, 5}, true},
                                                                                       {0.5, {0, 1, 4}, true},
                                                                                       {0.6, {0, 1, 4}, true},
                                                                                       {0.92, {6, 0, 4.5}, true},
                                                                                       {1, {6, 0, 9}, false}})
    s.waypoints.push_back({t * seconds, at, on});
  const auto expert = folder / "expert.oss", led = folder / "led.oss";
  std::filesystem::remove(expert);
  std::filesystem::remove(led);
  RehearsalOptions o;
  o.follow.surface = false;
  o.session_file = expert;
  o.haptics.device = SpringHand::traits();
  static_cast<void>(Rehearsal(World(test::bar(0.5, 0.3)), devices_of(s, 1000), o, {}).run_to_end({}));
  PlaybackParams params;
  params.mode = mode;
  params.pace = pace;
  params.tolerance_radius_mm = tolerance_radius_mm;
  auto playback =
      std::make_shared<Playback>(std::make_shared<Lesson>(read_lesson(SessionReader(expert), 0, 0)), params);
  RehearsalOptions l;
  l.follow.surface = false;
  l.session_file = led;
  playback->patience_s = 20;
  auto devices =
      playback_devices(std::make_unique<FollowingHand>(
                           stiffness, from_floats(playback->lesson->hands.front().front().position_mm), playback),
                       playback, l.haptics);
  l.actions = playback_actions(*playback);
  const RehearsalSummary sum = Rehearsal(World(test::bar(0.5, 0.3)), std::move(devices), l, {}).run_to_end({});
  const GuidedFacts f = measure_guided(SessionReader(led), playback->begun);
  double way = 0;
  for (std::size_t i = 1; i < s.waypoints.size(); ++i) way += length(s.waypoints[i].at_mm - s.waypoints[i - 1].at_mm);
  std::printf(
      "| %.1f s (%.0f mm/s) | %.0f N/m | %s, %s %.1f mm | %.2f | %.2f | %.2f | %.1f s | %.2f N | %.1f mJ |\n", seconds,
      way / seconds, stiffness, std::string(EnumNames<PlaybackMode>::values[static_cast<std::size_t>(mode)]).c_str(),
      pace == Pace::clock ? "clock" : "way, leash", pace == Pace::clock ? 0 : tolerance_radius_mm, f.rms_mm, f.p95_mm,
      f.most_mm, static_cast<double>(sum.ticks - playback->begun) / 1000, f.most_pull_n, f.most_work_mj);
  std::fflush(stdout);
}

// A lesson that presses, on arms that are not alike.
void arm_rows(const std::filesystem::path& folder, double press_n) {
  const auto expert = folder / "firm.oss", led = folder / "firm_led.oss";
  std::filesystem::remove(expert);
  RehearsalOptions o;
  o.follow.surface = false;
  o.session_file = expert;
  auto firm = std::make_unique<test::FirmHand>(press_n, 3.6);
  o.haptics.device = firm->traits();
  static_cast<void>(Rehearsal(World(test::bar(0.5, 0.3)), std::move(firm), o, {}).run_to_end({}));
  const auto lesson = std::make_shared<Lesson>(read_lesson(SessionReader(expert), 0, 0));
  double most_n = 0;
  const Session recorded = read_session(expert);
  for (const TickRecord& t : recorded.ticks) most_n = std::max(most_n, length(from_floats(t.force_n)));
  for (const test::Arm& arm : test::kArms) {
    for (const PlaybackMode mode : {PlaybackMode::show, PlaybackMode::guide}) {
      double rms = 0, p95 = 0, most = 0, pull = 0, work = 0;
      for (const double grip : {100.0, 250.0, 500.0}) {
        std::filesystem::remove(led);
        PlaybackParams params;
        params.mode = mode;
        auto playback = std::make_shared<Playback>(lesson, params);
        playback->patience_s = 20;
        RehearsalOptions l;
        l.follow.surface = false;
        l.session_file = led;
        auto devices =
            playback_devices(std::make_unique<FollowingHand>(
                                 grip, from_floats(lesson->hands.front().front().position_mm), playback, arm.params),
                             playback, l.haptics);
        l.actions = playback_actions(*playback);
        static_cast<void>(Rehearsal(World(test::bar(0.5, 0.3)), std::move(devices), l, {}).run_to_end({}));
        const GuidedFacts f = measure_guided(SessionReader(led), playback->begun);
        rms = std::max(rms, f.rms_mm);
        p95 = std::max(p95, f.p95_mm);
        most = std::max(most, f.most_mm);
        pull = std::max(pull, f.most_pull_n);
        work = std::max(work, f.most_work_mj);
      }
      std::printf("| %.1f N | %s | %s | %.2f, %.2f, %.2f mm | %.2f N | %.1f mJ |\n", most_n, arm.name,
                  mode == PlaybackMode::show ? "show" : "guide", rms, p95, most, pull, work);
      std::fflush(stdout);
    }
  }
}

void flood_row(double packets_a_s, double seconds) {
  RehearsalOptions o;
  o.follow.surface = false;
  o.haptics.device = SpringHand::traits();
  o.haptics.more_devices = {SpringHand::traits()};
  auto far = std::make_shared<FarDevice>();
  Script s;
  s.waypoints = {{0, {-6, 0, 8}, true}, {seconds, {6, 0, 4.5}, true}};
  auto devices = devices_of(s, 1000);
  devices.push_back(std::make_unique<FarHand>(far));
  LiveHost host(test::kCode, Bytes(2500, 7), 2, far);
  Rehearsal r(World(test::bar(0.5, 0.3)), std::move(devices), o, {});
  HostThread net(host, r, "127.0.0.1", 0);
  std::vector<Bytes> kinds;
  for (int i = 0; i < 64; ++i) {
    const Pairing::Nonce a = Pairing::make_nonce();
    Bytes b(600);
    for (std::size_t k = 0; k < b.size(); ++k) b[k] = static_cast<std::uint8_t>(a[k % a.size()] + k * 31);
    if (i % 4 == 1) b = *PairingGuest("AAAAAAAA", JoinRole::watcher).poll(0);  // asks to join
    if (i % 4 == 2) b[0] = 1, b[1] = b[2] = b[3] = 0;                          // of a connection that may be there
    kinds.push_back(b);
  }
  const double before = bench::resident_mb();
  std::optional<bench::Flood> flood;
  if (packets_a_s > 0) flood.emplace(net.port(), packets_a_s, kinds);
  r.start();
  while (r.running()) std::this_thread::sleep_for(std::chrono::milliseconds(20));
  const std::uint64_t sent = flood ? flood->sent() : 0;
  flood.reset();
  const RehearsalSummary sum = r.stop();
  std::printf("| %.0f | %.0f | %.0f, %.0f, %.0f | %.0f, %.0f | %+.1f MB | %llu |\n", packets_a_s,
              static_cast<double>(sent) / seconds, sum.loop->lateness.quantile_us(0.5),
              sum.loop->lateness.quantile_us(0.99), sum.loop->lateness.quantile_us(0.999),
              sum.loop->work.quantile_us(0.5), sum.loop->work.quantile_us(0.999), bench::resident_mb() - before,
              static_cast<unsigned long long>(host.refused()));
  std::fflush(stdout);
}

// A tick of two hands that nobody leads, and of the same where one leads the other. In turns, the best of each.
void off_is_free() {
  double best[2] = {1e9, 1e9};
  for (int round = 0; round < 10; ++round) {
    for (const bool led : {false, true}) {
      test::SimHand a{{-6, 0, 4.6}}, b{{6, 0, 4.6}};
      Device* const both[] = {&a, &b};
      HapticSetup setup;
      setup.device = a.traits();
      setup.more_devices = {b.traits()};
      Stream stream;
      Operation op(World(test::bar(0.5, 0.3)), setup, Anatomy{}, both, stream, 1000);
      if (led) op.act(action_of(far_guide(0, 1, a.traits(), 1, 3)));
      const auto begin = std::chrono::steady_clock::now();
      for (int t = 0; t < 2000; ++t) op.step(0);
      best[led] =
          std::min(best[led],
                   std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - begin).count() / 2000);
    }
  }
  std::printf(
      "\nA tick of two hands: %.2f us with nobody led, %.2f us where one leads the other (%.3f of it); GuideLaw is %zu "
      "bytes a hand.\n",
      best[0], best[1], best[1] / best[0], sizeof(GuideLaw));
}

}  // namespace

void bench_tutoring(const Context&) {
  std::printf(
      "\n## Live tutoring\n\nJitter each way a fifth of the RTT, 1 %% duplicates. Work of the pulls on both hands (at "
      "the end, most), what "
      "their "
      "brakes took; left: kinetic energy 5 s after a push.\n\n"
      "| RTT ms | lost | led | apart p50 mm | p95 | most | work mJ | braked mJ | left | kB/s out, in | bone |\n"
      "|---|---|---|---|---|---|---|---|---|---|---|\n");
  for (const double rtt : {0.0, 20.0, 50.0, 100.0, 200.0}) {
    for (const double loss : {0.0, 0.05, 0.2}) {
      for (const bool two_way : {false, true}) live_row(rtt, loss, two_way);
    }
  }
  std::printf("\n## Grips at an RTT of 50 ms\n\n| grip | brake, spring | apart p50, p95, most mm |\n|---|---|---|\n");
  for (const double grip : {100.0, 250.0, 500.0}) {
    for (const double brake : {12.0, kFarBrake}) grip_row(grip, brake);
  }
  std::printf(
      "\n## Playback\n\n| groove | grip | mode, time | RMS mm | 95 %% | most | took | most pull | most work "
      "|\n|---|---|---|---|---|---|---|---|---|\n");
  const TemporaryFolder folder;
  for (const double seconds : {9.0, 2.6, 1.0, 0.5}) {
    for (const double stiffness : {100.0, 250.0, 500.0}) {
      for (const PlaybackMode mode : {PlaybackMode::show, PlaybackMode::guide}) {
        playback_row(folder.path(), seconds, stiffness, mode, Pace::clock, 2);
        if (seconds < 2) playback_row(folder.path(), seconds, stiffness, mode, Pace::way, 1);
      }
    }
  }
  std::printf(
      "\n## Playback of a lesson that presses, worst of three grips\n\n| most of the lesson | arm | mode | RMS, 95 %%, "
      "most "
      "| most pull | most work |\n|---|---|---|---|---|---|\n");
  for (const double press_n : {2.0, 5.0, 9.6}) arm_rows(folder.path(), press_n);
  std::printf(
      "\n## A flood\n\n| packets/s asked | sent | servo late p50, p99, p99.9 us | work p50, p99.9 us | memory | "
      "refused "
      "|\n|---|---|---|---|---|---|\n");
  for (int round = 0; round < 2; ++round) {
    for (const double rate : {0.0, 100'000.0}) flood_row(rate, 10);
  }
  off_is_free();
}

}  // namespace osteo
