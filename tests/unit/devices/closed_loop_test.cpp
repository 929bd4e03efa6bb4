// Hands in the loop: device, link, servo and bone.
#include <gtest/gtest.h>

#include <atomic>
#include <cstddef>
#include <cstring>
#include <stdexcept>
#include <thread>

#include "osteo/core/rt/loop.h"
#include "osteo/simulation/devices/devices.h"
#include "osteo/simulation/haptics/servo.h"
#include "slab.h"
#include "virtual_arm.h"

namespace osteo {
namespace {

// The closed loop: arm, link, servo and bone, each in its own thread as with a real arm.
struct Loop {
  WoodenHapticsGeometry geometry;
  test::VirtualArm arm{geometry, {0, 0, 8}};
  BrickGrid bone = test::slab(0.5);
  WoodenHapticsDevice device;
  HapticSetup setup;
  Stream stream;
  std::unique_ptr<HapticRenderer> renderer;
  std::unique_ptr<Servo> servo;
  std::atomic<int> ticks{0};
  FixedRateLoop loop;

  static WorkspaceMap map() { return {{0, 0, 8}, Mat3{}, 1}; }
  Loop()
      : device(arm.opener(), geometry, map(), 3, nullptr), loop(1000, [this](std::int64_t late) {
          ++ticks;
          return servo->step(late);
        }) {
    setup.device = device.traits();
    setup.params.contact.stiffness_n_per_mm = 2;
    renderer = std::make_unique<HapticRenderer>(setup, bone, Anatomy{}, 1e-3);
    servo = std::make_unique<Servo>(*renderer, device, stream, 1000);
  }
  ~Loop() {
    loop.request_stop();
    loop.join();
  }
  void run_for(int ms) { std::this_thread::sleep_for(std::chrono::milliseconds(ms)); }
  bool wait_for(const std::function<bool()>& done, int ms = 5000) {
    for (int i = 0; i < ms / 5 && !done(); ++i) run_for(5);
    return done();
  }
};

TEST(ClosedLoop, AVirtualArmRestsOnBone) {
  Loop l;
  l.arm.set_hand({0, 0, 8}, 0.5);
  l.loop.start();
  ASSERT_TRUE(l.wait_for([&] { return l.arm.commands > 50 && l.ticks > 50; }));
  l.arm.set_hand({0, 0, -2}, 0.3);  // presses: 10 mm below where it began
  ASSERT_TRUE(l.wait_for([&] { return l.arm.force_n().z > 0.3; }));
  l.run_for(800);
  const Vec3 rest = l.arm.position_mm();
  // In balance: what the motors push is what the hand's spring pushes, and the burr stands on the bone.
  EXPECT_NEAR(l.arm.force_n().z, 0.3 * (rest.z + 2), 0.25);
  EXPECT_GT(rest.z, -0.5);  // the stiffness that delay and encoder allow is soft
  EXPECT_LT(rest.z, 2.1);
  double fastest = 0;
  Vec3 before = rest;
  for (int i = 0; i < 50; ++i) {
    l.run_for(4);
    fastest = std::max(fastest, length(l.arm.position_mm() - before));
    before = l.arm.position_mm();
  }
  EXPECT_LT(fastest, 0.3) << "mm in 4 ms: it shakes";
}

// The camera has the hand: the drill rests where it is, the motors too, and the arm's own motion is told. Then it is
// the drill's again, without a jump.
TEST(Lending, AnArmRestsAndTellsOfItsHand) {
  const WoodenHapticsGeometry geometry;
  test::VirtualArm arm(geometry, {0, 0, 8});
  WoodenHapticsDevice device(arm.opener(), geometry, Loop::map(), 3, nullptr);
  DeviceSample sample;
  const auto until = [&](const std::function<bool()>& done) {
    for (int i = 0; i < 5000 && !done(); ++i) {
      sample = device.read(0, 1e-3, {});
      device.feel({0, 0, 1}, {}, 0);
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return done();
  };
  const auto place = [&] { return from_floats(sample.position_mm); };
  arm.set_hand({0, 0, 8}, 0.5);
  ASSERT_TRUE(until([&] { return device.motion().hand_mm && length(arm.force_n()) > 0.5; }));
  device.lend(true);
  const DeviceMotion before = device.motion();
  const Vec3 rests = place();
  arm.set_hand({0, 20, 30}, 0.5);
  ASSERT_TRUE(until([&] { return length(arm.force_n()) < 1e-9; })) << "motors rest";
  ASSERT_TRUE(until([&] { return length(*device.motion().hand_mm - *before.hand_mm) > 20; }));
  EXPECT_LT(length(place() - rests), 0.5);
  EXPECT_LT((*device.motion().hand_mm - *before.hand_mm).x, -5) << "its left is the user's left";
  EXPECT_GT((*device.motion().hand_mm - *before.hand_mm).y, 5) << "up is up";
  int more = 0;
  ASSERT_TRUE(until([&] { return ++more > 500; }));  // the arm has come to rest
  const Vec3 lent = place();
  device.lend(false);
  sample = device.read(0, 1e-3, {});
  EXPECT_LT(length(place() - lent), 2) << "it goes on from where it was";
}

// A cap's deflection reaches the camera in the user's own right, up and towards; lent, it moves no drill.
TEST(Lending, ACapDrivesTheCamera) {
  const auto plugged = [](std::atomic<int>& far) {
    return [&far](std::string&) -> std::unique_ptr<HidPort> {
      int ends[2];
      if (far >= 0 || ::socketpair(AF_UNIX, SOCK_SEQPACKET, 0, ends) != 0) return nullptr;
      far = ends[1];
      return open_socket(ends[0]);
    };
  };
  std::atomic<int> puck_end{-1}, hand_end{-1};
  CameraPuck puck(plugged(puck_end));
  SpaceMouseDevice hand(plugged(hand_end), HandGoal{}, Mat3{}, nullptr);
  hand.lend(true);
  // Full deflection, 350 counts, along each of its axes as it reports them.
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::array<std::byte, 7> report{std::byte{1}};
    report[1 + 2 * axis] = std::byte{350 & 255};
    report[2 + 2 * axis] = std::byte{350 >> 8};
    SpaceMouseState state;
    ASSERT_TRUE(decode_space_mouse(report, state));
    const Vec3 wanted{state.move[0], state.move[2], -state.move[1]};
    const auto reported = [&](const auto& device) {
      const DeviceMotion m = device.motion();
      return m.push && length(*m.push - wanted) < 1e-9;
    };
    bool both = false;
    for (int i = 0; i < 5000 && !both; ++i) {
      for (const int end : {puck_end.load(), hand_end.load()}) {
        if (end >= 0) static_cast<void>(::send(end, report.data(), report.size(), MSG_NOSIGNAL));
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
      both = reported(puck) && reported(hand);
    }
    EXPECT_TRUE(both) << axis;
  }
  Vec3 before = from_floats(hand.read(0, 1e-3, {}).position_mm), now;
  for (int i = 0; i < 100; ++i) now = from_floats(hand.read(0, 1e-3, {}).position_mm);
  EXPECT_LT(length(now - before), 1e-9) << "lent";
  hand.lend(false);
  for (int i = 0; i < 100; ++i) now = from_floats(hand.read(0, 1e-3, {}).position_mm);
  EXPECT_GT(length(now - before), 1) << "and its own again";
  for (const int end : {puck_end.load(), hand_end.load()}) ::close(end);
}

// --- as the person wants it

TEST(Tuning, AnotherScaleBeginsWhereTheToolIs) {
  WorkspaceMap map({100, 0, 0}, Mat3{}, 2);
  const Vec3 start = map.update({0, 0, 0}, false);
  EXPECT_EQ(start, (Vec3{100, 0, 0}));
  const Vec3 before = map.update({3, 0, 0}, false);
  EXPECT_EQ(before, (Vec3{106, 0, 0}));
  map.rescale(0.25);
  EXPECT_EQ(map.update({3, 0, 0}, false), before) << "nothing jumps";
  EXPECT_EQ(map.update({3, 4, 0}, false), before + Vec3(0, 4 * 2 * 0.25, 0));
  EXPECT_EQ(map.scale(), 0.5);
  map.rescale(0.25);  // the same is no new beginning
  EXPECT_EQ(map.update({3, 8, 0}, false), before + Vec3(0, 8 * 2 * 0.25, 0));
  map.rescale(1);
  const Vec3 back = map.update({3, 8, 0}, false);
  EXPECT_EQ(map.update({4, 8, 0}, false), back + Vec3(2, 0, 0));
}

// One end of a device that says what the test wants.
struct PluggedEnd {
  std::atomic<int> far{-1};
  HidLink::Open opener() {
    return [this](std::string&) -> std::unique_ptr<HidPort> {
      int ends[2];
      if (far >= 0 || ::socketpair(AF_UNIX, SOCK_SEQPACKET, 0, ends) != 0) return nullptr;
      far = ends[1];
      return open_socket(ends[0]);
    };
  }
  ~PluggedEnd() {
    if (far >= 0) ::close(far);
  }
  // Says it again and again until it has come to something.
  bool says(std::initializer_list<int> report, const std::function<bool()>& so) {
    std::vector<std::byte> raw;
    for (const int b : report) raw.push_back(static_cast<std::byte>(b));
    for (int i = 0; i < 5000; ++i) {
      if (far >= 0) static_cast<void>(::send(far, raw.data(), raw.size(), MSG_NOSIGNAL));
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
      if (so()) return true;
    }
    return false;
  }
};

TEST(Tuning, ACapMovesByTheScaleAndNotAtAllWithTheClutch) {
  PluggedEnd end;
  SpaceMouseDevice hand(end.opener(), HandGoal{}, Mat3{}, nullptr);
  // Full deflection to the right, and button 2.
  ASSERT_TRUE(end.says({1, 350 & 255, 350 >> 8, 0, 0, 0, 0},
                       [&] { return hand.motion().push && hand.motion().push->x > 0.99; }));
  ASSERT_TRUE(end.says({3, 2}, [&] { return hand.read(0, 1e-3, {}).buttons == 2; }));
  // The spring hand behind it has caught up after a second.
  const auto mm_per_s = [&](const HandTuning& t) {
    hand.tune(t);
    for (int i = 0; i < 1000; ++i) static_cast<void>(hand.read(0, 1e-3, {}));
    const float at = hand.read(0, 1e-3, {}).position_mm[0];
    DeviceSample s;
    for (int i = 0; i < 500; ++i) s = hand.read(0, 1e-3, {});
    return static_cast<double>(s.position_mm[0] - at) / 0.5;
  };
  HandTuning t;
  EXPECT_NEAR(mm_per_s(t), 60, 0.2);
  t.scale = 0.25;
  EXPECT_NEAR(mm_per_s(t), 15, 0.2);
  t.clutch = true;
  EXPECT_NEAR(mm_per_s(t), 0, 0.01);
  // Button 2 drills only when it is told to, as hard as it is told to.
  EXPECT_EQ(hand.read(0, 1e-3, {}).pedal, 0);
  t.drill_buttons = 2;
  t.full = 128;
  hand.tune(t);
  EXPECT_EQ(hand.read(0, 1e-3, {}).pedal, 128);
  t.pedal = 200;  // the window's keys press harder
  hand.tune(t);
  EXPECT_EQ(hand.read(0, 1e-3, {}).pedal, 200);
  hand.lend(true);
  EXPECT_EQ(hand.read(0, 1e-3, {}).pedal, 0);
}

TEST(Tuning, SwitchesDoWhatTheyWereGivenToDo) {
  PluggedEnd cap, foot;
  FootPedal pedal(DeviceModel::pedal_infinity, foot.opener());
  SpaceMouseDevice hand(cap.opener(), HandGoal{}, Mat3{}, &pedal);
  ASSERT_TRUE(foot.says({4, 0}, [&] { return pedal.pressed() == 4; }));
  EXPECT_EQ(hand.read(0, 1e-3, {}).pedal, 0) << "the right switch is not this hand's";
  HandTuning t;
  t.drill_switches = 4;
  hand.tune(t);
  EXPECT_EQ(hand.read(0, 1e-3, {}).pedal, 255);
  ASSERT_TRUE(foot.says({1, 0}, [&] { return pedal.pressed() == 1; }));
  EXPECT_EQ(hand.read(0, 1e-3, {}).pedal, 0);
}

TEST(FootPedal, WhatIsDownWhenTheWindowIsLeftCountsOnceItHasComeUp) {
  PluggedEnd foot;
  FootPedal pedal(DeviceModel::pedal_infinity, foot.opener());
  ASSERT_TRUE(foot.says({1, 0}, [&] { return pedal.pressed() == 1; }));
  pedal.hold_back(true);
  EXPECT_EQ(pedal.pressed(), 0U);
  pedal.hold_back(false);
  EXPECT_EQ(pedal.pressed(), 0U) << "it is still down";
  // Another switch counts at once, and the first again from its next press on.
  ASSERT_TRUE(foot.says({3, 0}, [&] { return pedal.pressed() == 2; }));
  ASSERT_TRUE(foot.says({2, 0}, [&] { return pedal.pressed() == 2; }));
  ASSERT_TRUE(foot.says({3, 0}, [&] { return pedal.pressed() == 3; }));
  // A press between two looks is not missed; what is unplugged is not pressed.
  ASSERT_TRUE(foot.says({0, 0}, [&] { return pedal.pressed() == 0; }));
  EXPECT_EQ(pedal.pressed_since(), 3U);
  EXPECT_EQ(pedal.pressed_since(), 0U);
  ASSERT_TRUE(foot.says({1, 0}, [&] { return pedal.pressed() == 1; }));
  ::close(foot.far);
  for (int i = 0; i < 5000 && pedal.pressed() != 0; ++i) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  EXPECT_EQ(pedal.pressed(), 0U);
}

TEST(ClosedLoop, UnpluggedAndPluggedInAgain) {
  Loop l;
  l.loop.start();
  l.arm.set_hand({0, 0, 0}, 0.3);
  ASSERT_TRUE(l.wait_for([&] { return l.arm.commands > 50 && l.ticks > 50; }));
  l.arm.unplug();
  ASSERT_TRUE(l.wait_for([&] { return !l.device.connected(); }));
  l.loop.request_stop();
  l.loop.join();  // from here on this thread reads the device
  const auto gone = l.device.read(0, 1e-3, {});
  EXPECT_EQ(gone.age_ms, 255);
  EXPECT_EQ(gone.pedal, 0);
  l.arm.plug();
  const auto begin = std::chrono::steady_clock::now();
  ASSERT_TRUE(l.wait_for([&] { return l.device.connected(); }));
  EXPECT_LT(std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count(), 2.0);
  ASSERT_TRUE(l.wait_for([&] { return l.device.connected() && l.arm.commands > 0; }));
}

TEST(ClosedLoop, ShortGarbledAndDoubledReportsAreSafe) {
  Loop l;
  l.loop.start();
  l.arm.set_hand({0, 0, 4}, 0.3);
  ASSERT_TRUE(l.wait_for([&] { return l.arm.commands > 50 && l.ticks > 50; }));
  for (const int kind : {1, 2}) {
    l.arm.mischief = kind;
    ASSERT_TRUE(l.wait_for([&] { return l.device.garbled() > 20U * static_cast<unsigned>(kind); }));
    // Nobody knows where the hand is: the motors rest.
    ASSERT_TRUE(l.wait_for([&] { return length(l.arm.force_n()) < 1e-6; }));
  }
  l.arm.mischief = 3;
  ASSERT_TRUE(l.wait_for([&] { return l.device.connected() && l.arm.commands > 0; }));
}

TEST(ClosedLoop, MotorsRestWhenTheServoFallsSilent) {
  Loop l;
  l.loop.start();
  l.arm.set_hand({0, 0, 8}, 0.5);
  ASSERT_TRUE(l.wait_for([&] { return l.ticks > 50; }));
  l.arm.set_hand({0, 0, -2}, 0.3);
  ASSERT_TRUE(l.wait_for([&] { return l.arm.force_n().z > 0.3; }));
  l.loop.request_stop();
  l.loop.join();
  EXPECT_TRUE(l.wait_for([&] { return length(l.arm.force_n()) < 1e-6; }, 2000));
}

// Two arms, each with a link and a thread of its own, in one servo; what their hands did, run again, gives the same
// bits. One is pulled out on the way.
TEST(ClosedLoop, TwoArmsAreTwoHands) {
  const WoodenHapticsGeometry geometry;
  test::VirtualArm left(geometry, {-6, 0, 8}), right(geometry, {6, 0, 8});
  test::VirtualArm* const arms[2]{&left, &right};
  const int tools[2] = {3, instrument_index("sucker 8 Fr")};
  std::vector<std::unique_ptr<WoodenHapticsDevice>> devices;
  std::vector<Device*> hands;
  for (int h = 0; h < 2; ++h) {
    const WorkspaceMap map({h == 0 ? -6.0 : 6.0, 0, 8}, Mat3{}, 1);
    hands.push_back(
        devices.emplace_back(std::make_unique<WoodenHapticsDevice>(arms[h]->opener(), geometry, map, tools[h], nullptr))
            .get());
  }
  HapticSetup setup;
  setup.device = hands[0]->traits();
  setup.more_devices = {hands[1]->traits()};
  setup.params.contact.stiffness_n_per_mm = 2;
  std::vector<TickRecord> records;
  std::vector<VoxelChange> changes(1 << 16);
  const auto take = [&](StreamReader& reader) {
    std::array<TickRecord, 64> some;
    while (const std::size_t n = reader.ticks.pop(some))
      records.insert(records.end(), some.begin(), some.begin() + static_cast<std::ptrdiff_t>(n));
    while (reader.changes.pop(changes) > 0) {
    }
  };
  BrickGrid bone = test::slab(0.5);
  {
    Stream stream;
    StreamReader& reader = stream.add_reader();
    HapticRenderer renderer(setup, bone, Anatomy{}, 1e-3);
    Servo servo(renderer, hands, stream, 1000);
    std::atomic<int> ticks{0};
    FixedRateLoop loop(1000, [&](std::int64_t late) {
      ++ticks;
      return servo.step(late);
    });
    const auto wait_for = [&](const std::function<bool()>& done) {
      for (int i = 0; i < 1000 && !done(); ++i) {
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
        take(reader);
      }
      return done();
    };
    loop.start();
    ASSERT_TRUE(wait_for([&] { return left.commands > 50 && right.commands > 50 && ticks > 50; }));
    left.set_hand({-6, 0, -2}, 0.3);
    right.set_hand({6, 0, -6}, 0.3);
    EXPECT_TRUE(wait_for([&] { return left.force_n().z > 0.3 && right.force_n().z > 0.3; }));
    right.unplug();
    // The link knows before the servo's next tick does; what is waited for is a record that says so.
    EXPECT_TRUE(wait_for([&] {
      return !devices[1]->connected() && devices[0]->connected() && !records.empty() && records.back().hand == 1 &&
             records.back().device.age_ms == 255;
    }));
    loop.request_stop();
    loop.join();
    take(reader);
    EXPECT_EQ(reader.dropped, 0u);
  }
  ASSERT_GT(records.size(), 100u);
  std::vector<DeviceSample> samples[2];
  for (const TickRecord& r : records) samples[r.hand].push_back(r.device);
  ASSERT_EQ(samples[0].size(), samples[1].size());
  EXPECT_EQ(records.back().device.tool, tools[1]);
  EXPECT_EQ(records.back().device.age_ms, 255);
  ReplayDevice again[2]{ReplayDevice(samples[0]), ReplayDevice(samples[1])};
  BrickGrid other = test::slab(0.5);
  Stream stream;
  StreamReader& reader = stream.add_reader(2 * records.size());
  HapticRenderer renderer(setup, other, Anatomy{}, 1e-3);
  Servo servo(renderer, std::array<Device*, 2>{&again[0], &again[1]}, stream, 1000);
  const std::vector<TickRecord> recorded = std::exchange(records, {});
  while (servo.step(0)) {
    if (servo.ticks() % 1000 == 0) take(reader);
  }
  take(reader);
  ASSERT_EQ(records.size(), recorded.size());
  for (std::size_t i = 0; i < records.size(); ++i)
    ASSERT_EQ(std::memcmp(&records[i], &recorded[i], offsetof(TickRecord, work_us)), 0) << "record " << i;
  EXPECT_EQ(other.hash(), bone.hash());
}

TEST(HidLink, WhatItsThreadThrowsIsToldAndItTriesAgain) {
  struct Nobody final : HidHandler {
    void report(HidPort&, std::span<const std::byte>) override {}
  } nobody;
  std::atomic<int> tries{0};
  const HidLink link(
      [&](std::string&) -> std::unique_ptr<HidPort> {
        if (++tries == 1) throw std::runtime_error("the bus has gone");
        return nullptr;
      },
      nobody, 10);
  while (tries < 3) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  EXPECT_EQ(link.trouble(), "the bus has gone");
  EXPECT_FALSE(link.connected());
}

}  // namespace
}  // namespace osteo
