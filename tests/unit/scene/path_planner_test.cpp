// The hand's ways through free air, walked by a hand in front of the servo's renderer.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <filesystem>
#include <functional>

#include "folders.h"
#include "osteo/geometry/grid/resample.h"
#include "osteo/imaging/dicom/import.h"
#include "osteo/imaging/image/phantom.h"
#include "osteo/imaging/image/structures.h"
#include "osteo/imaging/image/threshold.h"
#include "osteo/session/scene/path_planner.h"
#include "osteo/simulation/bone/burr.h"
#include "osteo/simulation/bone/structure_map.h"
#include "osteo/simulation/haptics/renderer.h"

namespace osteo {
namespace {

constexpr int kTool = 3;  // cutting ball, 4 mm

World world_of(const Image& ct, double lower, double spacing_mm) {
  ThresholdParams t;
  t.lower = lower;
  ResampleParams r;
  r.lower = lower;
  r.spacing_mm = spacing_mm;
  return World(to_bricks(resample_bone(ct, threshold(ct, t), r).density));
}

// A box of voxels of half a millimetre around the origin, filled where `bone` says so.
World carved(Vec3 half_mm, const std::function<bool(Vec3)>& bone) {
  const double h = 0.5;
  Frame f;
  f.spacing_mm = {h, h, h};
  for (std::size_t a = 0; a < 3; ++a) f.dims[a] = 2 * static_cast<int>(half_mm[a] / h);
  f.origin_mm = half_mm * -1 + Vec3{h / 2, h / 2, h / 2};
  BrickGrid g = BrickGrid::dense(f);
  for (int k = 0; k < f.dims[2]; ++k)
    for (int j = 0; j < f.dims[1]; ++j)
      for (int i = 0; i < f.dims[0]; ++i)
        if (bone(f.world_from_index({double(i), double(j), double(k)}))) g.set(g.find(i, j, k), 1);
  return World(std::move(g));
}

struct View {
  const char* name;
  Vec3 eye;
  [[nodiscard]] Vec3 forward() const { return normalized(eye) * -1; }
  [[nodiscard]] Vec3 up() const {
    const Vec3 v = std::abs(eye.z) > 0.95 ? Vec3{0, -1, 0} : Vec3{0, 0, 1};
    return normalized(v - forward() * dot(v, forward()));
  }
  [[nodiscard]] Vec3 right() const { return cross(forward(), up()); }
  [[nodiscard]] Vec3 axis() const {
    return normalized(right() * 0.62 + up() * 0.45 - forward() * 0.64);
  }  // as the window holds a drill
};
const View kViews[] = {{"left", {0.94, -0.25, 0.22}}, {"right", {-0.94, -0.25, 0.22}}, {"front", {0, -1, 0.1}},
                       {"behind", {0, 1, 0.1}},       {"above", {0, -0.05, 1}},        {"below", {0, -0.05, -1}}};

std::optional<Vec3> seen(const World& world, Vec3 from, Vec3 direction, double reach) {
  for (double s = 0; s < reach; s += 0.25)
    if (world.nearest(from + direction * s) >= 0.5F) return from + direction * s;
  return std::nullopt;
}

// A mouse's hand and what it feels, a tick a millisecond.
class Hand {
 public:
  Hand(const World& world, const HandPose& start)
      : device_({start.at_mm, to_floats(start.axis), 0, kTool}),
        renderer_(setup(), {}, 1e-3),
        scene_(HapticScene::of(world, renderer_.setup())) {
    renderer_.show(&scene_);
  }
  static HapticSetup setup() {
    HapticSetup s;
    s.device = SpringHand::traits();
    s.params.effects.held_shaft = true;  // as in a window, where tools are led
    return s;
  }
  void tick() {
    last_ = renderer_.step(device_.read(tick_++, 1e-3, force_n_)).record;
    force_n_ = from_floats(last_.force_n);
    // What it was pressed with before it was led takes a moment to go.
    if (length(force_n_) < 0.5 || ++pressed_ > 100) pressed_ = 1000;
    if (pressed_ >= 1000) most_n_ = std::max(most_n_, length(force_n_));
    removed_mm3_ += static_cast<double>(last_.removed_mm3);
    drilled_ = drilled_ || last_.device.pedal != 0;
  }
  Led walk(const HandWay& way) {
    device_.lead(way);
    most_n_ = 0;
    pressed_ = 0;
    drilled_ = false;
    for (int t = 0; t < 60000 && device_.led() == Led::on_the_way; ++t) tick();
    return device_.led();
  }
  void push(Vec3 to_mm, bool drill, int ticks) {
    static_cast<void>(device_.led());
    device_.set_goal({to_mm, last_.device.axis, static_cast<std::uint8_t>(drill ? 255 : 0), kTool});
    for (int t = 0; t < ticks; ++t) tick();
  }
  [[nodiscard]] HandPose pose() const {
    return {from_floats(last_.device.position_mm), from_floats(last_.device.axis)};
  }
  // Where the tool is shown: at the bone's surface.
  [[nodiscard]] HandPose shown() const { return {pose().at_mm + from_floats(last_.shown_offset_mm), pose().axis}; }
  [[nodiscard]] double force_n() const { return length(force_n_); }
  [[nodiscard]] double most_n() const { return most_n_; }
  [[nodiscard]] double removed_mm3() const { return removed_mm3_; }
  [[nodiscard]] bool drilled() const { return drilled_; }
  [[nodiscard]] double seconds() const { return static_cast<double>(tick_) / 1000; }
  [[nodiscard]] const TickRecord& last() const { return last_; }
  [[nodiscard]] MouseDevice& device() { return device_; }

 private:
  MouseDevice device_;
  HapticRenderer renderer_;
  HapticScene scene_;
  Vec3 force_n_;
  TickRecord last_;
  std::uint64_t tick_ = 0;
  int pressed_ = 0;
  double most_n_ = 0, removed_mm3_ = 0;
  bool drilled_ = false;
};

// From each view to what one sees there, beginning where the view before ended.
void from_six_views(const char* name, const World& world, const StructureMap* structures = nullptr) {
  const PathPlanner ways(world, skin_of_instrument(kTool), structures);
  const HandPose start = ways.waiting(normalized(kViews[0].eye), kViews[0].axis());
  Hand hand(world, start);
  hand.tick();
  EXPECT_EQ(hand.force_n(), 0) << name << ", first tick";
  EXPECT_TRUE(ways.free(hand.pose(), 1)) << name;
  int walked = 0, put = 0;
  double most_n = 0, farthest = 0, longest_s = 0, plan_s = 0;
  for (const View& view : kViews) {
    for (const auto& [across, up] : {std::pair{0.0, 0.0}, {0.35, 0.2}, {-0.3, -0.3}}) {
      const Vec3 eye = ways.centre_mm() - view.forward() * (4 * ways.radius_mm());
      const Vec3 aim =
          ways.centre_mm() + view.right() * (across * ways.radius_mm()) + view.up() * (up * ways.radius_mm());
      const auto at = seen(world, eye, normalized(aim - eye), 8 * ways.radius_mm());
      if (!at) continue;
      EXPECT_EQ(hand.walk({}), Led::arrived);
      const auto began = std::chrono::steady_clock::now();
      const PathPlanner::Found a = ways.approach(hand.shown(), *at, normalized(aim - eye), view.axis());
      plan_s = std::max(plan_s, std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count());
      const double from_s = hand.seconds();
      EXPECT_EQ(hand.walk(a.way), Led::arrived) << name << ", " << view.name << " " << across;
      longest_s = std::max(longest_s, hand.seconds() - from_s);
      EXPECT_LT(hand.most_n(), 1.0) << name << ", " << view.name << " " << across;
      EXPECT_FALSE(hand.drilled());
      EXPECT_LT(length(hand.pose().at_mm - a.end.at_mm), 0.4);
      most_n = std::max(most_n, hand.most_n());
      farthest = std::max(farthest, length(a.end.at_mm - *at) - 2);
      put += a.way.put ? 1 : 0;
      ++walked;
      // Down on the bone, pressed and drilled a little; from there the next one starts.
      hand.push(*at - view.forward() * -1.0, walked % 2 == 0, 300);
      hand.push(*at, false, 100);
    }
  }
  EXPECT_GE(walked, 12) << name;
  // Whatever the hand is in, it gets out.
  const View& last = kViews[5];
  hand.walk({});
  const HandWay out = ways.way(hand.shown(), ways.waiting(normalized(last.eye), last.axis())).way;
  EXPECT_EQ(hand.walk(out), Led::arrived) << name;
  EXPECT_EQ(hand.force_n(), 0);
  std::printf(
      "%s: %d ways from six views, %d put; most force %.3f N, least gap within %.1f mm of the bone seen, longest %.1f "
      "s, found in at most "
      "%.2f s\n",
      name, walked, put, most_n, farthest, longest_s, plan_s);
}

TEST(PathPlanner, FromSixViewsOnThePhantomsHead) {
  PhantomParams p;
  p.spacing_mm = 1.5;
  from_six_views("phantom head", world_of(make_phantom(p).ct, 500, 1));
}

TEST(PathPlanner, FromSixViewsOnThePhantomsTemporalBone) {
  PhantomParams p;
  p.region = PhantomRegion::temporal;
  p.spacing_mm = 0.8;
  from_six_views("phantom temporal bone", world_of(make_phantom(p).ct, 500, 0.8));
}

// Structures cost little where they are, and change nothing where they are covered by bone.
TEST(PathPlanner, FromSixViewsWithStructuresAtRisk) {
  PhantomParams p;
  p.region = PhantomRegion::temporal;
  p.spacing_mm = 0.8;
  const Phantom phantom = make_phantom(p);
  StructuresParams named;
  named.names = "6=facial nerve, 7=sigmoid sinus";
  named.only_named = true;
  const StructureMap structures(name_structures(phantom.labels, named));
  from_six_views("phantom temporal bone with structures", world_of(phantom.ct, 500, 0.8), &structures);
}

TEST(PathPlanner, FromSixViewsOnAHead) {
  const std::filesystem::path file = shared_data() / "ct_head_unc/CThead_HU_256x256x113_derived.nrrd";
  if (!std::filesystem::exists(file)) GTEST_SKIP() << "no " << file;
  ImportParams p;
  p.axes = "LPI";
  from_six_views("CT of a head", world_of(import_ct(file, p).image, 300, 1));
}

TEST(PathPlanner, FromSixViewsOnASkull) {
  const std::filesystem::path folder = shared_data() / "dicom_ct_skull_phantom/S21570/S2030";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "no " << folder;
  from_six_views("CT of a skull", world_of(import_ct(folder, {}).image, 300, 1));
}

// A slot too narrow for the head, a tunnel below it, and at one end a hole that lets it out: back along the tunnel,
// then up.
TEST(PathPlanner, BackThroughATunnel) {
  const auto bone = [](Vec3 p) {
    const bool slot = std::abs(p.y) < 1.8 && p.x > -20 && p.x < 12 && p.z > -4;
    const bool tunnel = std::hypot(p.y, p.z + 4) < 3.2 && p.x > -20 && p.x < 12;
    const bool hole = std::hypot(p.x + 17, p.y) < 3.6 && p.z > -5;
    return !(slot || tunnel || hole);
  };
  const World world = carved({24, 12, 12}, bone);
  const PathPlanner ways(world, skin_of_instrument(kTool));
  const HandPose inside{{8, 0, -4}, {0, 0, 1}};
  ASSERT_TRUE(ways.free(inside, 0.4));
  Hand hand(world, inside);
  hand.tick();
  const HandPose outside = ways.waiting({0, 0, 1}, {0, 0, 1});
  const HandWay way = ways.way(inside, outside).way;
  EXPECT_FALSE(way.put);
  EXPECT_EQ(hand.walk(way), Led::arrived);
  EXPECT_LT(hand.most_n(), 1.0);
  // And in again, to the floor of the tunnel's far end, which only a slanting look can see: as near as it gets, never
  // harder.
  const PathPlanner::Found a = ways.approach(hand.pose(), {8, 0, -7}, {0, 0, -1}, {0, 0, 1});
  EXPECT_EQ(hand.walk(a.way), Led::arrived);
  EXPECT_LT(hand.most_n(), 1.0);
}

// No way leads out of a closed shell: the tool is taken away and put where it was wanted.
TEST(PathPlanner, OutOfAClosedShellItIsPut) {
  const World world = carved({24, 24, 24}, [](Vec3 p) { return length(p) > 12 && length(p) < 20; });
  const PathPlanner ways(world, skin_of_instrument(kTool));
  // The shaft sticks in the shell: jammed, as the drill was that began at the origin.
  Hand hand(world, {{0, 0, 0}, normalized({0.6, 0.4, 0.6})});
  for (int t = 0; t < 1000; ++t) hand.tick();
  const PathPlanner::Found a = ways.approach(hand.pose(), {20, 0, 0}, {-1, 0, 0}, normalized({0.64, 0.62, 0.45}));
  EXPECT_TRUE(a.way.put);
  const double jammed_n = hand.force_n();
  EXPECT_EQ(hand.walk(a.way), Led::arrived);
  EXPECT_LT(hand.force_n(), 0.01) << "was " << jammed_n;
  EXPECT_LT(length(hand.pose().at_mm - Vec3{20, 0, 0}), 4);
}

// Pressed hard, drill on: the way begins by letting go.
TEST(PathPlanner, LiftsOutOfACavityWhileItDrills) {
  const World world = carved({20, 20, 12}, [](Vec3 p) { return p.z < 4; });
  const PathPlanner ways(world, skin_of_instrument(kTool));
  const Vec3 axis = normalized({0.3, 0.2, 0.9});
  Hand hand(world, {{0, 0, 8}, axis});
  hand.push({0, 0, -1}, true, 6000);
  EXPECT_GT(hand.force_n(), 1.0);
  EXPECT_GT(hand.removed_mm3(), 5);
  const double before = hand.force_n();
  hand.walk({});
  const PathPlanner::Found out = ways.way(hand.shown(), ways.waiting({0, 0, 1}, axis));
  EXPECT_FALSE(out.way.put) << "nothing is put aside";
  hand.device().lead(out.way);
  double last = before, removed = hand.removed_mm3();
  hand.tick();
  for (int t = 0; hand.device().led() == Led::on_the_way && t < 20000; ++t) {
    hand.tick();
    EXPECT_LT(hand.force_n(), std::max(last, 0.7) + 0.3) << "tick " << t;
    last = hand.force_n();
    EXPECT_EQ(hand.last().device.pedal, 0);
  }
  // The burr runs down while it is let go.
  EXPECT_LT(hand.removed_mm3(), removed + 0.5);
  EXPECT_EQ(hand.device().led(), Led::arrived);
  EXPECT_EQ(hand.force_n(), 0);
}

// What came into the way after it was found: the hand gives up where it is, and does not press.
TEST(PathPlanner, GivesUpWhereSomethingIsInTheWay) {
  const World empty = carved({20, 20, 20}, [](Vec3 p) { return length(p - Vec3{-15, 0, 0}) < 3; });
  const PathPlanner ways(empty, skin_of_instrument(kTool));
  const HandPose a = ways.waiting({1, 0, 0}, {1, 0, 0});
  const World wall = carved({20, 20, 20}, [](Vec3 p) { return std::abs(p.x) < 4; });
  Hand hand(wall, a);
  hand.tick();
  HandWay way;
  way.points[0] = {{-12, 0, 0}, to_floats(a.axis), true};
  way.count = 1;
  EXPECT_EQ(hand.walk(way), Led::blocked);
  EXPECT_LT(hand.most_n(), 1.0);
  EXPECT_LT(hand.force_n(), 0.7);
  const Vec3 stopped = hand.pose().at_mm;
  // Not heard until the window knows: an old goal does not pull it on.
  for (int t = 0; t < 200; ++t) hand.tick();
  EXPECT_LT(length(hand.pose().at_mm - stopped), 0.5);
}

// The goal that was sent before a way, or while it went on, does not count after it.
TEST(PathPlanner, AfterAWayOnlyANewGoalCounts) {
  const World world = carved({8, 8, 8}, [](Vec3 p) { return length(p) < 3; });
  Hand hand(world, {{30, 0, 0}, {1, 0, 0}});
  hand.tick();
  HandWay way;
  way.points[0] = {{40, 0, 0}, {1, 0, 0}, false};
  way.count = 1;
  hand.device().lead(way);
  hand.device().set_goal({{99, 0, 0}, {1, 0, 0}, 1, kTool});
  for (int t = 0; t < 3000; ++t) hand.tick();
  EXPECT_NEAR(hand.pose().at_mm.x, 40, 0.2);
  EXPECT_FALSE(hand.drilled());
  EXPECT_EQ(hand.device().led(), Led::arrived);
  hand.push({50, 0, 0}, false, 1000);
  EXPECT_NEAR(hand.pose().at_mm.x, 50, 0.2);
}

// The handle follows the view as far as bone lets its shaft.
TEST(PathPlanner, TurnsOnlyAsFarAsTheShaftIsFree) {
  const World world = carved({20, 20, 20}, [](Vec3 p) { return p.z < 0 && std::hypot(p.x, p.y) > 4; });
  const PathPlanner shaft(world, skin_of_instrument(kTool, false));
  HandPose pose{{0, 0, -10}, {0, 0, 1}};
  for (int frame = 0; frame < 200; ++frame) pose.axis = shaft.turned(pose, {1, 0, 0}, 0.1);
  const double tilt = std::atan2(pose.axis.x, pose.axis.z);
  EXPECT_GT(tilt, 0.1);
  EXPECT_LT(tilt, std::atan(4.5 / 10));
  EXPECT_TRUE(shaft.free(pose, 0));
  pose.at_mm = {0, 0, 10};
  for (int frame = 0; frame < 200; ++frame) pose.axis = shaft.turned(pose, {1, 0, 0}, 0.1);
  EXPECT_NEAR(pose.axis.x, 1, 1e-6);
}

// A burr that rests on the floor of a hole touches bone already: the shaft may not touch more.
TEST(PathPlanner, ATouchingToolTurnsOnlyAsFarAsItTouchesNoMore) {
  const World world = carved({20, 20, 20}, [](Vec3 p) { return p.z < 0 && (std::hypot(p.x, p.y) > 4 || p.z < -12); });
  const PathPlanner whole(world, skin_of_instrument(kTool));
  const HandPose pose{{0, 0, -10.6}, {0, 0, 1}};
  ASSERT_FALSE(whole.free(pose, 0));
  const Vec3 axis = whole.turned(pose, {1, 0, 0}, 1);
  EXPECT_LT(std::acos(axis.z), 0.5);
}

TEST(PathPlanner, WaitsInFreeAirWhereverOneLooksFrom) {
  const World world = carved({30, 10, 20}, [](Vec3) { return true; });
  const PathPlanner ways(world, skin_of_instrument(kTool));
  for (const View& view : kViews) {
    const HandPose pose = ways.waiting(normalized(view.eye), view.axis());
    EXPECT_TRUE(ways.free(pose, 2));
    EXPECT_GT(dot(pose.at_mm - ways.centre_mm(), normalized(view.eye)), ways.radius_mm());
  }
}

// Structures where `inside` says so, on labels of half a millimetre around the origin.
StructureMap structures_of(Vec3 half_mm, const std::function<bool(Vec3)>& inside) {
  const double h = 0.5;
  Labels labels;
  Frame& f = labels.frame;
  f.spacing_mm = {h, h, h};
  for (std::size_t a = 0; a < 3; ++a) f.dims[a] = 2 * static_cast<int>(half_mm[a] / h);
  f.origin_mm = half_mm * -1 + Vec3{h / 2, h / 2, h / 2};
  const auto voxels = make_voxels<std::uint8_t>(f.voxel_count());
  std::size_t v = 0;
  for (int k = 0; k < f.dims[2]; ++k)
    for (int j = 0; j < f.dims[1]; ++j)
      for (int i = 0; i < f.dims[0]; ++i)
        voxels[v++] = inside(f.world_from_index({double(i), double(j), double(k)})) ? 1 : 0;
  labels.voxels = voxels;
  labels.structures = {{1, "nerve", {240, 220, 60}}};
  return StructureMap(labels);
}

// The nearest that the whole tool came to a structure on a way.
double least_clearance(const StructureMap& structures, Hand& hand, const HandWay& way) {
  const Burr& burr = burr_library()[kTool];
  double least = structures.reach_mm();
  hand.device().lead(way);
  hand.tick();
  for (int t = 0; t < 60000 && hand.device().led() == Led::on_the_way; ++t) {
    if (t % 20 == 0) {
      const HandPose p = hand.pose();
      for (const RoundCone& part : {burr.head(), burr.shaft()})
        least = std::min(least, structures.clearance(part, p.at_mm, p.axis).distance_mm);
    }
    hand.tick();
  }
  EXPECT_EQ(hand.device().led(), Led::arrived);
  return least;
}

// A pit with a nerve laid bare across it, above the burr: past the nerve, not through it.
TEST(PathPlanner, KeepClearOfANerveThatHasBeenLaidBare) {
  const World world =
      carved({24, 24, 12}, [](Vec3 p) { return p.z < 4 && (std::abs(p.x) > 14 || std::abs(p.y) > 9 || p.z < -8); });
  const StructureMap nerve = structures_of({24, 24, 14}, [](Vec3 p) { return std::hypot(p.x, p.z) < 1.2; });
  const HandPose inside{{0, 0, -5}, normalized({0.7, 0, 0.7})};
  const ToolSkin skin = skin_of_instrument(kTool);
  const PathPlanner of_bone(world, skin), ways(world, skin, &nerve);
  ASSERT_TRUE(of_bone.free(inside, 0.4));
  ASSERT_TRUE(ways.free(inside, 0.4));
  EXPECT_FALSE(ways.free({{0, 0, 0}, {0, 1, 0}}, -0.3));  // on the nerve, in free air
  const HandPose outside = of_bone.waiting({0, 0, 1}, normalized({0.7, 0, 0.7}));
  const auto clearance = [&](const PathPlanner& w) {
    Hand hand(world, inside);
    hand.tick();
    const PathPlanner::Found out = w.way(inside, outside);
    EXPECT_FALSE(out.way.put);
    EXPECT_FALSE(out.past_structures);
    return least_clearance(nerve, hand, out.way);
  };
  EXPECT_LT(clearance(of_bone), 0.2);  // as it was: the nerve is brushed
  EXPECT_GT(clearance(ways), PathPlanner::kClearOfStructuresMm - 0.2);

  // And down to bone behind the nerve: to a place beside the line of sight's end that is clear of it.
  Hand hand(world, outside);
  hand.tick();
  const PathPlanner::Found down = ways.approach(hand.pose(), {5, 0, -8}, {0, 0, -1}, {0, 0, 1});
  EXPECT_FALSE(down.way.put);
  EXPECT_FALSE(down.past_structures);
  EXPECT_LT(length(down.end.at_mm - Vec3{5, 0, -8}), 3.5);
  EXPECT_GT(least_clearance(nerve, hand, down.way), PathPlanner::kClearOfStructuresMm - 0.2);
}

// A membrane over the whole mouth of a pit: the way leads through it, and that is told.
TEST(PathPlanner, PastAStructureOnlyWhereNothingElseIsFree) {
  const World world = carved({16, 16, 12}, [](Vec3 p) { return std::abs(p.x) > 7 || std::abs(p.y) > 7 || p.z < -8; });
  const StructureMap membrane = structures_of({20, 20, 14}, [](Vec3 p) { return std::abs(p.z - 4) < 0.6; });
  // Held upright, so that the shaft alone goes through.
  const HandPose inside{{0, 0, -4}, {0, 0, 1}};
  const PathPlanner ways(world, skin_of_instrument(kTool), &membrane);
  const HandPose outside = ways.waiting({0, 0, 1}, {0, 0, 1});
  EXPECT_TRUE(ways.free(outside, 2));
  const PathPlanner::Found out = ways.way(inside, outside);
  EXPECT_TRUE(out.past_structures);
  EXPECT_FALSE(out.way.put);
  Hand hand(world, inside);
  hand.tick();
  EXPECT_EQ(hand.walk(out.way), Led::arrived);
  EXPECT_LT(hand.most_n(), 1.0);
  // Without the membrane in the way nothing is told of it.
  EXPECT_FALSE(ways.way(outside, ways.waiting({1, 0, 0}, {0, 0, 1})).past_structures);
}

}  // namespace
}  // namespace osteo
