// A session made by hand, of which every metric is known: 20 s of one hand, or of two.
#pragma once
#include <cmath>
#include <filesystem>
#include <memory>
#include <numbers>
#include <vector>

#include "osteo/session/recording/session_file.h"
#include "osteo/simulation/bone/instrument.h"
#include "scene.h"

namespace osteo::test {

/// What the second hand does, 60 mm from everything the first one does.
enum class Second {
  none,
  resting,  ///< holds a burr that turns in the air
  cutting   ///< from 16 to 18 s its burr presses on bone with 0.5 N and takes 5 mm3
};

/// A cube of bone of 16 mm around the origin, in voxels of 0.5 mm.
inline World metric_bone() {
  return solid_world([](Vec3 p) { return 8 - std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}); }, 0.5, 24);
}
/// In its middle a ball of 2 mm: the nerve (1).
inline const std::shared_ptr<const StructureMap>& metric_nerve() {
  static const auto map = std::make_shared<const StructureMap>(
      structure_map([](Vec3 p) -> std::uint8_t { return length(p) < 2 ? 1 : 0; }, {{1, "nerve", {}}}, 0.25, 24));
  return map;
}
inline VoxelKey metric_voxel(const World& bone, Vec3 at_mm) {
  const BrickGrid& grid = bone.bodies().front().body->bone;
  const Vec3 x = grid.frame().index_from_world(at_mm);
  const auto whole = [](double v) { return static_cast<int>(std::lround(v)); };
  return bone.bodies().front().body->name_of(grid.find(whole(x.x), whole(x.y), whole(x.z)));
}

/// What the first hand does, each drilling on an arc of 6 mm around the nerve, there in a second and back in another,
/// as minimum jerk has it, pressing with 0.5 N and taking 5 mm3:
///  0 to 2 s at rest; 2 to 2.4 s it goes 2 mm against 1.5 N;
///  3 to 5 s it drills 0.25 mm from the nerve's face, in the xy plane, with a diamond, the shaft 45 degrees off the
///  force, sucker and water; 6 to 8 s 0.7 mm from it, all else with a cutting burr, with the sucker alone; 9 to 11
///  s 1.5 mm from it, in the xz plane, the shaft along the force; for 80 ms with 3 N; 12 to 14 s 3 mm from it, with 1
///  N. It goes into the nerve and out, for 0.28 s at rest at 14.66 and again at 15.66 s, for 0.18 s turning at 16.66 s.
///  From 18 s on it holds a probe; 18.5 to 18.8 s are not recorded; then it rests to 20 s.
/// Bone: 0.25 mm3 goes before the first camera note (0.5 s, from above); a millimetre is sawn off at 2.6 s: 256 mm3;
/// at 2.7 s a pit of 3 by 3 by 2 mm opens on top, in sight; at 2.9 s 4 voxels go on a side and 2 next to the nerve,
/// unseen. From 3 s on the camera looks from that side.
class MetricSession {
 public:
  static constexpr double kHz = 1000;
  static constexpr std::uint64_t kEnd = 20'000, kLostFrom = 18'500, kLostTo = 18'800;

  static void write(const std::filesystem::path& file, Second second, std::uint64_t lost_from = kLostFrom,
                    std::uint64_t lost_to = kLostTo) {
    const World bone = metric_bone();
    SessionHeader header;
    header.bone_hash = bone.hash();
    header.rate_hz = kHz;
    if (second != Second::none) header.haptics.more_devices.resize(1);
    SessionWriter writer(file, header);
    SessionBatch batch;
    for (std::uint64_t n = 0; n < kEnd; ++n) {
      if (n == lost_from) {
        if (!batch.ticks.empty()) writer.append(batch);
        batch = {};
        writer.append(RecordingGap{lost_from, lost_to - lost_from, false});
        n = lost_to;
      }
      act(n, bone, batch);
      batch.ticks.push_back(first_hand(n));
      if (second != Second::none) batch.ticks.push_back(second_hand(n, second));
      if ((n + 1) % 100 != 0) continue;
      writer.append(batch);
      batch = {};
    }
    SessionEnd end;
    end.ticks = kEnd;
    end.ticks_lost = lost_to - lost_from;
    writer.finish(end);
  }

 private:
  struct Arc {
    double from_s, radius_mm;
    bool in_xy;
  };
  static constexpr Arc kArcs[] = {{3, 3.25, true}, {6, 3.7, true}, {9, 4.5, false}, {12, 6, false}};
  static constexpr double kLengthMm = 6;

  static double reach(double x) { return x * x * x * (10 - 15 * x + 6 * x * x); }
  static Vec3 on_arc(const Arc& a, double s) {
    const double way = s < 1 ? reach(s) : 1 - reach(s - 1), angle = kLengthMm / a.radius_mm * (way - 0.5);
    const double c = a.radius_mm * std::cos(angle), d = a.radius_mm * std::sin(angle);
    return a.in_xy ? Vec3{c, d, 0} : Vec3{c, 0, d};
  }
  static const Arc* arc_at(double s) {
    for (const Arc& a : kArcs) {
      if (s >= a.from_s && s < a.from_s + 2) return &a;
    }
    return nullptr;
  }
  static Vec3 place(double s) {
    if (const Arc* const a = arc_at(s)) return on_arc(*a, s - a->from_s);
    struct Way {
      double s;
      Vec3 at;
    };
    static const std::vector<Way> ways{
        {0, {12, 0, 0}},           {2, {12, 0, 0}},           {2.4, {10, 0, 0}},         {3, on_arc(kArcs[0], 0)},
        {5, on_arc(kArcs[0], 2)},  {6, on_arc(kArcs[1], 0)},  {8, on_arc(kArcs[1], 2)},  {9, on_arc(kArcs[2], 0)},
        {11, on_arc(kArcs[2], 2)}, {12, on_arc(kArcs[3], 0)}, {14, on_arc(kArcs[3], 2)}, {14.5, {5, 0, 0}},
        {14.7, {2.5, 0, 0}},       {14.9, {2.5, 0, 0}},       {15.1, {5, 0, 0}},         {15.5, {5, 0, 0}},
        {15.7, {2.5, 0, 0}},       {15.9, {2.5, 0, 0}},       {16.1, {5, 0, 0}},         {16.5, {5, 0, 0}},
        {16.7, {2.5, 0, 0}},       {16.8, {2.5, 0, 0}},       {17, {5, 0, 0}},           {17.5, {5, 0, 0}},
        {18, {12, 0, 0}},          {21, {12, 0, 0}}};
    std::size_t n = 1;
    while (ways[n].s <= s) ++n;
    const double share = (s - ways[n - 1].s) / (ways[n].s - ways[n - 1].s);
    return ways[n - 1].at + (ways[n].at - ways[n - 1].at) * share;
  }
  static std::array<float, 3> floats(Vec3 v) {
    return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
  }
  static std::uint8_t tool(const char* name) { return static_cast<std::uint8_t>(instrument_index(name)); }

  static TickRecord first_hand(std::uint64_t n) {
    const double s = static_cast<double>(n) / kHz;
    TickRecord t;
    t.tick = n;
    const Vec3 at = place(s);
    t.device.position_mm = floats(at);
    t.device.tool = tool(s >= 18 ? "probe 1 mm" : s >= 3 && s < 5 ? "diamond 2 mm" : "cutting 2 mm");
    const bool turns = (s >= 2 && s < 14) || (s >= 16.5 && s < 17.5);
    t.device.pedal = turns ? 255 : 0;
    t.speed_rpm = turns ? 20'000.0F : 0;
    if (s >= 2 && s < 2.4) t.force_n = {1.5F, 0, 0};
    const Arc* const arc = arc_at(s);
    if (arc == nullptr) return t;
    const double press = arc == &kArcs[3] ? 1 : n >= 10'000 && n < 10'080 ? 3 : 0.5;
    const Vec3 out = normalized(at);
    t.normal_force_n = static_cast<float>(press);
    t.force_n = floats(out * press);
    t.removed_mm3 = 0.0025F;
    const Vec3 aside = arc->in_xy ? Vec3{0, 0, 1} : Vec3{0, 1, 0};
    t.device.axis = floats(s < 9 ? normalized(out + aside) : out);
    return t;
  }
  static TickRecord second_hand(std::uint64_t n, Second what) {
    TickRecord t;
    t.tick = n;
    t.hand = 1;
    t.device.position_mm = {60, 0, 0};
    t.device.tool = tool("cutting 4 mm");
    t.speed_rpm = 20'000;
    if (what != Second::cutting || n < 16'000 || n >= 18'000) return t;
    t.device.pedal = 255;
    t.normal_force_n = 0.5F;
    t.force_n = {0, 0, 0.5F};
    t.removed_mm3 = 0.0025F;
    return t;
  }
  static void act(std::uint64_t n, const World& bone, SessionBatch& batch) {
    const auto note = [&](const char* json) { batch.notes.push_back({n, "camera", json}); };
    const auto action = [&](SceneAction a) {
      a.tick = n;
      batch.actions.push_back(a);
    };
    const auto gone = [&](Vec3 at) { batch.changes.push_back({metric_voxel(bone, at), 0, 1}); };
    if (n == 300) {
      for (const double x : {0.25, 2.25}) gone({x, -5.25, 7.75});
    }
    if (n == 500) note(R"({"eye_mm":[0,0,200],"target_mm":[0,0,0]})");
    if (n == 2600) action(SceneAction::saw({{-7.5, 0, 0}, {1, 0, 0}, {0, 0, 1}, 1}));
    if (n == 2700) {
      for (int k = 0; k < 4; ++k)
        for (int j = 0; j < 6; ++j)
          for (int i = 0; i < 6; ++i) gone({-1.25 + 0.5 * i, 3.75 + 0.5 * j, 6.25 + 0.5 * k});
    }
    if (n == 2900) {
      for (int i = 0; i < 4; ++i) gone({7.75, -3.75 + 2 * i, 0.25});
      for (const double y : {-0.25, 0.25}) gone({3.25, y, 0.25});
    }
    if (n == 3000) action(SceneAction::suction({}, 1, 10));
    if (n == 3000) action(SceneAction::irrigate({}, 1, 10));
    if (n == 3010) note(R"({"eye_mm":[200,0,0],"target_mm":[0,0,0]})");
    if (n == 3110) note(R"({"eye_mm":[200,0,1],"target_mm":[0,0,0]})");
    if (n == 4050) note(R"({"eye_mm":[200,0,1],"target_mm":[0,0,1]})");
    if (n == 5500) action(SceneAction::irrigate({}, 1, 0));
    if (n == 8500) action(SceneAction::suction({}, 1, 0));
  }
};

}  // namespace osteo::test
