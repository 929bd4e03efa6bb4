// Scenes that are operated on: how soon the picture follows the drill, pieces live, plates, regions of interest.
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <thread>

#include "bench.h"
#include "osteo/core/rt/loop.h"
#include "osteo/geometry/grid/resample.h"
#include "osteo/imaging/image/phantom.h"
#include "osteo/imaging/image/threshold.h"
#include "osteo/session/scene/rehearsal.h"
#include "osteo/simulation/bone/plates.h"

namespace osteo {
namespace {

double ms_since(std::int64_t begin_ns) {
  return static_cast<double>(monotonic_ns() - begin_ns) / 1e6;
}
// Of all threads of this program: on a busy machine it says more than the clock.
double processor_ms() {
  return 1e3 * static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}
double quantile(std::vector<double> v, double q) {
  std::sort(v.begin(), v.end());
  return v.empty() ? 0 : v[std::min(v.size() - 1, static_cast<std::size_t>(q * static_cast<double>(v.size())))];
}

BrickGrid head(double spacing_mm, const Context& context) {
  const Phantom phantom = make_phantom(PhantomParams{}, context);
  ThresholdParams t;
  t.lower = 500;
  ResampleParams r;
  r.spacing_mm = spacing_mm;
  return to_bricks(resample_bone(phantom.ct, threshold(phantom.ct, t), r, context).density);
}

// In real time: from the moment a tick's removal is in the stream to the moment its triangles are made.
void latency(const BrickGrid& bone, const Context& context) {
  std::printf(
      "## From bone removed to triangles ready: in real time, 1 kHz, head at 0.5 mm, the follower's thread beside the "
      "servo's\n\n"
      "| burr | followed | p50 ms | p99 ms | p99.9 ms | worst ms | ticks that removed bone "
      "|\n|---|---|---|---|---|---|---|\n");
  for (const int diameter : {4, 6}) {
    for (const ReaderList parts :
         {ReaderList{true, false, false}, ReaderList{true, true, false}, ReaderList{true, true, true}}) {
      const int tool = burr_index(BurrKind::cutting, diameter);
      ScriptedDevice device(make_default_script(World(BrickGrid(bone)), true, tool, 12), 1000);
      HapticSetup setup;
      setup.device = device.traits();
      Stream stream;
      StreamReader& reader = stream.add_reader();
      Operation operation(World(BrickGrid(bone)), setup, {}, device, stream, 1000);
      ReaderDispatcher dispatcher(reader, operation.world());
      SceneReaders readers(operation.world(), parts, 1000, context);
      readers.add_to(dispatcher);
      dispatcher.add(operation.strokes(), false);
      std::vector<std::atomic<std::int64_t>> published(20000);
      FixedRateLoop loop(1000, [&](std::int64_t late) {
        const std::uint64_t t = operation.ticks();
        const bool more = operation.step(late);
        published[t] = monotonic_ns();
        return more;
      });
      std::vector<double> waits;
      std::uint64_t seen = 0;
      std::vector<bool> removed(20000);
      StreamReader& watch = stream.add_reader(1 << 15, 1 << 22);
      loop.start();
      while (loop.running() || seen < operation.ticks()) {
        const std::size_t n = dispatcher.drain();
        const std::int64_t now = monotonic_ns();
        for (std::uint64_t t = seen; t < seen + n; ++t) {
          TickRecord r;
          if (watch.ticks.pop({&r, 1}) == 1 && r.voxels_changed > 0)
            waits.push_back(static_cast<double>(now - published[t].load()) / 1e6);
        }
        seen += n;
        if (n == 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
      }
      loop.join();
      std::printf("| %d mm | surface%s%s | %.2f | %.2f | %.2f | %.2f | %zu |\n", diameter,
                  parts.pieces ? ", pieces" : "", parts.dust ? ", dust" : "", quantile(waits, 0.5),
                  quantile(waits, 0.99), quantile(waits, 0.999), quantile(waits, 1), waits.size());
    }
  }
  std::printf("\n");
}

// What it takes from "take it apart" to bodies that are drilled on their own.
void pieces(const BrickGrid& bone, const Context& context) {
  std::printf(
      "## A head sawn and taken apart: stages of the live split\n\n| step | ms in real time | ms of processors "
      "|\n|---|---|---|\n");
  World world{BrickGrid(bone)};
  SceneReaders readers(world, {true, true, false}, 1000, context);
  HapticSetup setup;
  setup.device = SpringHand::traits();
  const HapticRenderer renderer(setup, {}, 1e-3);
  HapticScene scene = HapticScene::of(world, renderer.setup());
  const SawCut cut{bone.frame().centre_mm(), {0, 0.3, 1}, {1, 0, 0}, 1};
  for (const SceneAction& a : {SceneAction::saw(cut), SceneAction::split(50), SceneAction::plain(ActionKind::undo)}) {
    std::int64_t t = monotonic_ns();
    double cpu = processor_ms();
    const World::Effect e = world.act(a, [&](std::uint32_t id) { return readers.pieces->components(id); });
    const std::string name(name_of(static_cast<ActionKind>(a.kind)));
    const double acted = processor_ms() - cpu;
    std::printf("| %s: bone%s | %.1f | %.1f |\n", name.c_str(),
                a.is(ActionKind::split) ? (" of " + std::to_string(world.bodies().size()) + " bodies").c_str() : "",
                ms_since(t), acted);
    t = monotonic_ns();
    cpu = processor_ms();
    readers.surface->scene_changed(world, e);
    readers.pieces->scene_changed(world, e);
    std::printf("| %s: surfaces and labels | %.1f | %.1f |\n", name.c_str(), ms_since(t), processor_ms() - cpu);
    t = monotonic_ns();
    cpu = processor_ms();
    HapticScene next = HapticScene::of(world, renderer.setup(), &scene);
    std::printf("| %s: what the servo keeps (side by side with the surfaces) | %.1f | %.1f |\n", name.c_str(),
                ms_since(t), processor_ms() - cpu);
    scene = std::move(next);
  }
  std::printf(
      "\nThe same in real time, from the hold (nothing is removed) to the tick where the new bodies are touched:\n\n| "
      "action | ms, five "
      "runs |\n|---|---|\n");
  std::map<std::string, std::vector<std::uint64_t>> held;
  for (int run = 0; run < 5; ++run) {
    Script script = make_default_script(World(BrickGrid(bone)), true, burr_index(BurrKind::cutting, 4), 3);
    for (auto& w : script.waypoints) w.drill_on = false;  // else undo would take back a stroke, and not the split
    RehearsalOptions o;
    o.follow = {true, true, false};
    o.haptics.device = SpringHand::traits();
    o.actions = {SceneAction::saw(cut), SceneAction::split(50), SceneAction::plain(ActionKind::undo)};
    for (std::size_t i = 0; i < o.actions.size(); ++i) o.actions[i].tick = 500 + 700 * i;
    o.session_file =
        std::filesystem::temp_directory_path() / ("osteo-bench-split-" + std::to_string(::getpid()) + ".oss");
    std::filesystem::remove(o.session_file);
    Rehearsal r(World(BrickGrid(bone)), std::make_unique<ScriptedDevice>(script, 1000), o, context);
    r.start();
    while (r.running()) std::this_thread::sleep_for(std::chrono::milliseconds(20));
    r.stop();
    std::uint64_t begin = 0;
    for (const RecordedAction& a : read_session(o.session_file).actions) {
      if (a.action.is(ActionKind::hold))
        begin = a.action.tick;
      else
        held[std::string(name_of(static_cast<ActionKind>(a.action.kind)))].push_back(a.action.tick - begin);
    }
    std::filesystem::remove(o.session_file);
  }
  for (const auto& [name, ticks] : held) {
    std::printf("| %s |", name.c_str());
    for (const std::uint64_t t : ticks) std::printf(" %llu", static_cast<unsigned long long>(t));
    std::printf(" |\n");
  }
  std::printf("\n");
}

void plates(const BrickGrid& bone) {
  std::printf(
      "## Plates: contact by samples traced through live bone, on the head\n\n| plate | samples | us 0.1 mm into bone, "
      "samples in it | us "
      "0.5 mm "
      "into bone, samples in it |\n|---|---|---|---|\n");
  World world{BrickGrid(bone)};
  HapticSetup setup;
  setup.device = SpringHand::traits();
  const HapticScene scene = HapticScene::of(world, setup);
  // On the side of the head: the second point of the strokes lies a burr's radius and a millimetre before it.
  const int tool = 3;
  const Vec3 at = make_default_script(World(BrickGrid(bone)), true, tool, 5).waypoints[1].at_mm;
  const double before = burr_library()[tool].diameter_mm / 2 + 1;
  for (const PlateModel& plate : plate_library()) {
    for (const int count : {100, 600, 2000}) {
      const PlateInHand hand(plate, count);
      std::printf("| %s | %zu |", plate.name.c_str(), hand.samples.size());
      for (const double depth : {0.1, 0.5}) {
        const RigidTransform pose{frame_of_axis({1, 0, 0}), at - Vec3{before + depth, 0, 0}};
        std::vector<double> times;
        std::uint32_t in_bone = 0;
        for (int n = 0; n < 300; ++n) {
          const std::int64_t t = monotonic_ns();
          const ContactResult r = plate_contact(hand, pose, scene.items, setup.params.contact);
          times.push_back(static_cast<double>(monotonic_ns() - t) / 1e3);
          in_bone = r.immersed;
        }
        std::printf(" %.0f, %u |", quantile(times, 0.5), in_bone);
      }
      std::printf("\n");
    }
  }
  std::printf("\n");
}

}  // namespace

void bench_operation(const Context& context) {
  const BrickGrid bone = head(0.5, context);
  plates(bone);
  latency(bone, context);
  pieces(bone, context);
}

}  // namespace osteo
