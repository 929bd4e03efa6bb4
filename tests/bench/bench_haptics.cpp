// Haptic rendering: a whole tick, stability, removal, real time. Prints Markdown for docs/validation/haptics.md.
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <functional>
#include <random>
#include <thread>

#include "bench.h"
#include "folders.h"
#include "haptics_tables.h"
#include "osteo/core/base/simd.h"
#include "osteo/core/rt/loop.h"
#include "osteo/geometry/grid/resample.h"
#include "osteo/imaging/image/threshold.h"
#include "osteo/imaging/io/volume_io.h"
#include "osteo/session/recording/recorder.h"
#include "osteo/simulation/haptics/servo.h"
#include "slab.h"
#include "solid.h"
#include "stability.h"

namespace osteo {
namespace {

using haptics_tables::kMethods, haptics_tables::name_of, haptics_tables::Spread;

/// A head from ../shared/data, or the phantom.
BrickGrid head(double h, const Context& context, std::string& name) {
  const std::filesystem::path folder = shared_data() / "ct_head_unc";
  name = "phantom slab";
  if (std::filesystem::exists(folder)) {
    for (const auto& e : std::filesystem::directory_iterator(folder)) {
      if (e.path().extension() != ".nrrd" && e.path().extension() != ".mha" && e.path().extension() != ".gz") continue;
      try {
        const Image ct = load_image(e.path(), context);
        ThresholdParams t;
        t.lower = 300;
        ResampleParams r;
        r.spacing_mm = h;
        name = "real head";
        return to_bricks(resample_bone(ct, threshold(ct, t), r, context).density);
      } catch (const std::exception&) {
      }
    }
  }
  return test::slab(h);
}

void bench_kernel(const Context& context) {
  std::printf(
      "### A whole tick\n\nHead and shaft, drag, vibration, removal, guard, distance map: everything between a pose "
      "and a record. A 6 mm "
      "burr drills for 20 s of "
      "ticks.\n\n| bone | voxels mm | method | us p50 | p99 | p99.9 | voxels in the burr, mean | voxels a ms "
      "|\n|---|---|---|---|---|---|---|---|\n");
  for (const double h : {0.5, 0.2}) {
    for (const bool real : {false, true}) {
      std::string bone_name = "flat";
      BrickGrid whole = test::slab(h);
      Vec3 place{0, 0, 3};
      if (real) {
        if (h < 0.3) continue;  // the whole head at 0.2 mm is not what a scene holds
        whole = head(h, context, bone_name);
        // The first bone from the patient's left, half-way.
        const Vec3 c = whole.frame().centre_mm();
        for (double x = 120; x > 0; x -= 0.5) {
          place = c + Vec3{x, 0, 0};
          if (whole.nearest(place) > 0.5F) break;
        }
        place.x += 3;
      }
      for (const ContactMethod method : kMethods) {
        BrickGrid bone = whole;
        HapticSetup setup;
        setup.params.contact.method = method;
        setup.device = SpringHand::traits();
        HapticRenderer renderer(setup, bone, {}, 1e-3);
        SpringHand hand;
        Spread us, voxels;
        Vec3 force{};
        for (int t = 0; t < 20000; ++t) {
          const double s = t * 1e-3;
          HandGoal goal;
          const Vec3 turn{0, 4 * std::sin(5 * s), 4 * std::cos(5 * s)};
          goal.position_mm =
              real ? place + turn + Vec3{-1 - 0.3 * s, 0, 0} : place + Vec3{turn.y, turn.z, -1 - 0.3 * s};
          goal.axis = {0.6F, 0, 0.8F};
          goal.pedal = 255;
          goal.tool = 5;
          const DeviceSample sample = hand.step(goal, 1e-3, force);
          const auto begin = std::chrono::steady_clock::now();
          const auto step = renderer.step(sample);
          us.add(std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count() * 1e6);
          force = {step.record.force_n[0], step.record.force_n[1], step.record.force_n[2]};
          voxels.add(step.record.immersed);
        }
        // What exact coverage stands for: every voxel under the burr, each tick.
        const double under = burr_library()[5].head().volume_mm3() / (h * h * h);
        std::printf("| %s | %g | %s | %.1f | %.1f | %.1f | %.0f | %.0f |\n", bone_name.c_str(), h, name_of(method),
                    us.at(0.5), us.at(0.99), us.at(0.999), voxels.mean(), under / us.at(0.5) * 1000);
        std::fflush(stdout);
      }
    }
  }
  std::printf(
      "\nVectors: %s. One overlap of a 6 mm burr buried to its middle, deepest case:\n\n| voxels mm | us | voxels "
      "under it | of them a ms "
      "|\n|---|---|---|---|\n",
      simd_name(simd()).data());
  for (const double h : {1.0, 0.5, 0.25, 0.2}) {
    const auto bone = test::slab(h);
    Overlap overlap(0);
    Spread us;
    for (int n = 0; n < 2000; ++n) {
      const auto begin = std::chrono::steady_clock::now();
      static_cast<void>(overlap.measure(bone, {0, 0, 3, 3}, {0.001 * n, 0.3, 0}, {0.6, 0, 0.8}));
      us.add(std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count() * 1e6);
    }
    const double under = 4.0 / 3 * M_PI * 27 / (h * h * h);
    std::printf("| %g | %.1f | %.0f | %.0f |\n", h, us.at(0.5), under, under / us.at(0.5) * 1000);
  }
}

void bench_removal_rate() {
  std::printf(
      "\n### Removal is a property of the burr\n\nThe same hand, 2 s on flat bone: volume removed over that at 0.5 mm "
      "and 1 kHz.\n\n| "
      "method | burr | 0.25 mm | "
      "0.35 mm | 1 mm | 500 Hz | 2 kHz | 5 kHz | removed mm3 |\n|---|---|---|---|---|---|---|---|---|\n");
  for (const ContactMethod method : kMethods) {
    for (const int tool : {3, 17, 38}) {
      const auto drill = [&](double h, double hz) { return test::drilled_mm3(method, h, hz, tool); };
      const double reference = drill(0.5, 1000);
      std::printf("| %s | %s | %.3f | %.3f | %.3f | %.3f | %.3f | %.3f | %.1f |\n", name_of(method),
                  burr_library()[static_cast<std::size_t>(tool)].name().c_str(), drill(0.25, 1000) / reference,
                  drill(0.35, 1000) / reference, drill(1, 1000) / reference, drill(0.5, 500) / reference,
                  drill(0.5, 2000) / reference, drill(0.5, 5000) / reference, reference);
      std::fflush(stdout);
    }
  }
}

void bench_stability() {
  std::printf(
      "\n### Stability\n\nA device of 0.1 kg pushed against a wall of 2 N/mm (2 kN/m) by 1 N. Stable: slower than 2 "
      "mm/s after 2.5 s. "
      "Gained: the most that the wall "
      "had given beyond what it had taken.\n\n| device | bare wall | mm/s at the end | gained mJ | guarded | stiffness "
      "in use N/mm | mm/s "
      "at the end | gained mJ "
      "|\n|---|---|---|---|---|---|---|---|\n");
  for (const auto& c : test::kStabilityCases) {
    const auto bare = test::push_against_wall(c, 2, false), guarded = test::push_against_wall(c, 2, true);
    std::printf("| %s | %s | %.1f | %.3f | %s | %.2f | %.3f | %.4f |\n", c.name, bare.stable ? "stable" : "**not**",
                bare.fastest_mm_s, bare.gained_mj, guarded.stable ? "stable" : "**not**", guarded.stiffness_n_per_mm,
                guarded.fastest_mm_s, guarded.gained_mj);
  }
}

void bench_real_time() {
  std::printf(
      "\n### Ticks in real time\n\nThe servo with recorder on flat bone at 0.5 mm, a 6 mm burr by overlap, 10 s each; "
      "loaded: four threads "
      "that compute "
      "without pause.\n\n| Hz | load | work p50 us | p99.9 | max | late p50 us | p99 | p99.9 | max | missed by work | "
      "by the machine |\n"
      "|---|---|---|---|---|---|---|---|---|---|---|\n");
  bool granted = false;
  for (const double hz : {1000.0, 5000.0}) {
    for (const bool loaded : {false, true}) {
      std::atomic<bool> stop{false};
      std::vector<std::thread> hogs;
      if (loaded)
        for (int i = 0; i < 4; ++i)
          hogs.emplace_back([&] {
            volatile double x = 1;
            while (!stop) x = x * 1.0000001;
          });
      auto bone = test::slab(0.5);
      HapticSetup setup;
      setup.device = SpringHand::traits();
      HapticRenderer renderer(setup, bone, {}, 1 / hz);
      Strokes script;
      script.tool = 5;
      script.axis = {0.6, 0, 0.8};
      for (int i = 0; i <= 100; ++i)
        script.waypoints.push_back({0.1 * i, {4 * std::sin(i), 4 * std::cos(i), 3 - 0.04 * i}, true});
      ScriptedDevice device(script, hz);
      Stream stream;
      const auto path =
          std::filesystem::temp_directory_path() / ("osteo-bench-session-" + std::to_string(::getpid()) + ".oss");
      std::filesystem::remove(path);
      Recorder recorder(stream.add_reader(), path, {});
      Servo servo(renderer, device, stream, hz);
      FixedRateLoop loop(hz, [&](std::int64_t late) { return servo.step(late); });
      recorder.start();
      loop.start();
      loop.join();
      recorder.stop();
      stop = true;
      for (auto& t : hogs) t.join();
      std::filesystem::remove(path);
      const LoopStats& s = loop.stats();
      granted = s.realtime_granted;
      std::printf("| %g | %s | %.1f | %.1f | %.1f | %.1f | %.1f | %.1f | %.1f | %llu | %llu |\n", hz,
                  loaded ? "loaded" : "idle", s.work.quantile_us(0.5), s.work.quantile_us(0.999), s.work.max_us(),
                  s.lateness.quantile_us(0.5), s.lateness.quantile_us(0.99), s.lateness.quantile_us(0.999),
                  s.lateness.max_us(), static_cast<unsigned long long>(s.missed_by_work),
                  static_cast<unsigned long long>(s.missed_by_machine));
      std::fflush(stdout);
    }
  }
  std::printf(
      "\nReal-time priority was %s.\n\n### Handing a record over\n\n128 bytes and 8 changed voxels into the ring of a "
      "reader that writes "
      "and syncs them, 5 kHz for 20 s.\n\n"
      "| ns p50 | p99 | p99.9 | max | dropped |\n|---|---|---|---|---|\n",
      granted ? "granted" : "refused");
  Stream stream;
  auto& reader = stream.add_reader();
  const auto path =
      std::filesystem::temp_directory_path() / ("osteo-bench-session-" + std::to_string(::getpid()) + ".oss");
  std::filesystem::remove(path);
  Recorder recorder(reader, path, {});
  recorder.start();
  Spread ns;
  ns.values.reserve(100000);
  TickRecord record;
  std::vector<VoxelChange> changes(8);
  record.voxels_changed = 8;
  FixedRateLoop loop(5000, [&](std::int64_t) {
    record.tick = ns.values.size();
    const std::int64_t begin = monotonic_ns();
    stream.publish(record, changes);
    ns.add(static_cast<double>(monotonic_ns() - begin));
    return ns.values.size() < 100000;
  });
  loop.start();
  loop.join();
  recorder.stop();
  std::filesystem::remove(path);
  std::printf("| %.0f | %.0f | %.0f | %.0f | %llu |\n", ns.at(0.5), ns.at(0.99), ns.at(0.999), ns.at(1),
              static_cast<unsigned long long>(reader.dropped.load()));
}

// Each hand presses a 4 mm burr on its own place and moves it in circles; or all but the first hold a sucker. All
// columns in turn, so that a busy machine slows them alike.
void bench_hands() {
  std::printf(
      "### Hands\n\nA tick of the servo's renderer with 1, 2 and 4 hands, each at its own place on a slab; 4,000 ticks "
      "each, in turns.\n\n"
      "| voxels mm | hands | us p50 | us p99 | times one hand |\n|---|---|---|---|---|\n");
  struct Run {
    std::size_t hands;
    bool suckers;
    std::unique_ptr<BrickGrid> bone;
    std::unique_ptr<HapticRenderer> renderer;
    Spread us;
  };
  const auto sucker = static_cast<std::uint8_t>(instrument_index("sucker 8 Fr"));
  for (const double h : {0.5, 0.25}) {
    std::vector<Run> runs;
    for (const auto& [hands, suckers] : {std::pair{1, false}, {2, true}, {2, false}, {4, false}}) {
      Run r{static_cast<std::size_t>(hands), suckers, std::make_unique<BrickGrid>(test::slab(h)), nullptr, {}};
      HapticSetup setup;
      setup.device = SpringHand::traits();
      setup.more_devices.assign(r.hands - 1, SpringHand::traits());
      r.renderer = std::make_unique<HapticRenderer>(setup, *r.bone, Anatomy{}, 1e-3);
      runs.push_back(std::move(r));
    }
    for (int t = 0; t < 4000; ++t) {
      for (Run& r : runs) {
        std::array<DeviceSample, kMaxHands> samples;
        for (std::size_t n = 0; n < r.hands; ++n) {
          const double a = t / 150.0;
          samples[n].position_mm = to_floats(
              Vec3{(n % 2 == 0 ? -8 : 8) + 3 * std::cos(a), (n < 2 ? -8 : 8) + 3 * std::sin(a), 1.5 - 1e-4 * t});
          samples[n].axis = to_floats(normalized(Vec3{0.3, 0, 1}));
          samples[n].pedal = 255;
          samples[n].tool = r.suckers && n > 0 ? sucker : 3;
        }
        const std::int64_t begin = monotonic_ns();
        static_cast<void>(r.renderer->step({samples.data(), r.hands}));
        r.us.add(static_cast<double>(monotonic_ns() - begin) / 1000);
      }
    }
    const double one = runs[0].us.at(0.5);
    for (Run& r : runs)
      std::printf("| %g | %zu%s | %.1f | %.1f | %.2f |\n", h, r.hands, r.suckers ? ", one with a sucker" : "",
                  r.us.at(0.5), r.us.at(0.99), r.us.at(0.5) / one);
  }
}

}  // namespace

void bench_haptics(const Context& context) {
  std::printf("## Haptics\n\n");
  haptics_tables::bench_contact();
  std::printf("\n");
  bench_kernel(context);
  bench_removal_rate();
  haptics_tables::bench_god_object();
  bench_stability();
  std::printf("\n");
  bench_hands();
  std::printf("\n");
  bench_real_time();
}

void bench_haptics_hands(const Context&) {
  bench_hands();
}

// Anything a device may say, `OSTEO_FUZZ_TICKS` times (10^6): finite, within limits, always.
void bench_haptics_fuzz(const Context&) {
  const char* const wish = std::getenv("OSTEO_FUZZ_TICKS");
  const auto ticks = static_cast<std::uint64_t>(wish != nullptr ? std::atof(wish) : 1e6);
  std::printf(
      "### Fuzz\n\n| method | ticks | not finite | over the limit | over the rate | removed mm3 "
      "|\n|---|---|---|---|---|---|\n");
  for (const ContactMethod method :
       {ContactMethod::overlap, ContactMethod::proxy, ContactMethod::volume, ContactMethod::rays}) {
    // Most for the default method; the others share the rest.
    const std::uint64_t n = method == ContactMethod::overlap ? ticks * 7 / 10 : ticks / 10;
    std::mt19937_64 random(42);
    std::uniform_real_distribution<double> u(-1, 1);
    std::uint64_t bad = 0, over = 0, steep = 0;
    double removed = 0;
    HapticSetup setup;
    setup.params.contact.method = method;
    setup.device.max_force_n = 3.3;
    std::unique_ptr<HapticRenderer> renderer;
    BrickGrid bone;
    Vec3 x{0, 0, 5}, last{};
    for (std::uint64_t t = 0; t < n; ++t) {
      if (t % 2'000'000 == 0) {
        const double a = 0.7 + 0.1 * static_cast<double>(t / 2'000'000 % 5);
        bone = test::solid(
            0.5, 9, [a](Vec3 p) { return std::sin(a * p.x) + std::sin(1.3 * a * p.y) + std::sin(0.9 * p.z) - 0.2 < 0; },
            {}, 8);
        renderer = std::make_unique<HapticRenderer>(setup, bone, Anatomy{}, 1e-3);
        last = {};
      }
      const auto dice = random() % 1000;
      if (dice < 5) x = Vec3{u(random), u(random), u(random)} * 12;
      x += Vec3{u(random), u(random), u(random)} * (dice < 50 ? 3 : 0.3);
      if (length(x) > 14) x = x * 0.5;
      DeviceSample s;
      s.position_mm = {static_cast<float>(x.x), static_cast<float>(x.y), static_cast<float>(x.z)};
      s.axis = {static_cast<float>(u(random)), static_cast<float>(u(random)), static_cast<float>(u(random))};
      s.pedal = random() % 50 == 0 ? 255 : 0;
      s.tool = static_cast<std::uint8_t>(random() % 50);
      s.age_ms = dice > 990 ? static_cast<std::uint8_t>(random()) : 0;
      if (dice == 500) s.position_mm[random() % 3] = NAN;
      if (dice == 501) s.axis[random() % 3] = INFINITY;
      if (dice == 502) s.position_mm[random() % 3] = 1e30F;
      const auto step = renderer->step(s);
      const Vec3 f{step.record.force_n[0], step.record.force_n[1], step.record.force_n[2]};
      bad += std::isfinite(length(f)) ? 0 : 1;
      over += length(f) > 3.3 * (1 + 1e-6) ? 1 : 0;
      steep += length(f - last) > setup.params.guard.max_rate_n_per_s * 1e-3 * (1 + 1e-5) + 1e-6 ? 1 : 0;
      last = f;
      removed += static_cast<double>(step.record.removed_mm3);
    }
    std::printf("| %s | %llu | %llu | %llu | %llu | %.0f |\n", name_of(method), static_cast<unsigned long long>(n),
                static_cast<unsigned long long>(bad), static_cast<unsigned long long>(over),
                static_cast<unsigned long long>(steep), removed);
    std::fflush(stdout);
  }
}

}  // namespace osteo
