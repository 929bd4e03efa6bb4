// Host and seat in their own threads over the machine's own network: what they do, not how soon.
#include "osteo/network/tutor/live_seat.h"

#include <gtest/gtest.h>

#include <chrono>
#include <functional>

#include "bar.h"
#include "live_pair.h"
#include "osteo/core/base/error.h"

namespace osteo {
namespace {

// Waits for what has to come; how long is the machine's.
bool comes(const std::function<bool()>& what) {
  for (int i = 0; i < 12'000; ++i) {
    if (what()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return false;
}

// The same for what takes long: as long as it goes on.
bool comes(const std::function<bool()>& what, const std::function<std::uint64_t()>& so_far) {
  for (std::uint64_t last = 0;;) {
    if (comes([&] { return what() || so_far() > last; }) && what()) return true;
    const std::uint64_t now = so_far();
    if (now <= last) return what();
    last = now;
  }
}

// A session of an instructor's hand that drills, and of one who joins.
struct Hosted {
  explicit Hosted(bool heat = false) {
    options.follow.surface = false;
    options.follow.heat = header.heat = heat;
    auto own = std::make_unique<test::SimHand>(Vec3{0, 0, 6});
    own->device().set_hand({}, {0, 0, 4.6}, 0.6);
    options.haptics.device = own->traits();
    options.haptics.more_devices = {own->traits()};
    options.actions.push_back(action_of(far_guide(0, 1, own->traits(), 10, 6)));
    World world(test::bar(0.5, 0.3));
    header.bone_hash = world.hash();
    header.rate_hz = options.rate_hz;
    header.haptics = options.haptics;
    host.emplace(test::kCode, settings_bytes(header, past), 2, far);
    std::vector<std::unique_ptr<Device>> devices;
    devices.push_back(std::move(own));
    devices.push_back(std::make_unique<FarHand>(far));
    rehearsal.emplace(std::move(world), std::move(devices), options, Context{});
    net.emplace(*host, *rehearsal, "127.0.0.1", 0);
  }
  [[nodiscard]] SeatOptions seat(JoinRole role) const {
    return {udp_peer("127.0.0.1:" + std::to_string(net->port())), test::kCode, role, 1, 3};
  }
  RehearsalOptions options;
  SessionHeader header;
  Bytes past{1, 2, 3};
  std::shared_ptr<FarDevice> far = std::make_shared<FarDevice>();
  std::optional<LiveHost> host;
  std::optional<Rehearsal> rehearsal;
  std::optional<HostThread> net;
};

TEST(LiveSeat, WhoJoinsHasAllOfTheSessionWhenItIsOver) {
  for (const JoinRole role : {JoinRole::watcher, JoinRole::trainee}) {
    Hosted hosted;
    LiveSeat seat(hosted.seat(role));
    const SessionHeader theirs = seat.wait_for_session(60, {});
    EXPECT_EQ(theirs.bone_hash, hosted.header.bone_hash);
    EXPECT_EQ(theirs.rate_hz, hosted.header.rate_hz);
    EXPECT_EQ(seat.past(), hosted.past);
    RehearsalOptions copied;
    copied.follow.surface = false;
    try {
      static_cast<void>(seat.begin(theirs, World(test::bar(0.45, 0.3)), copied, nullptr, {}));
      ADD_FAILURE() << "another bone was taken";
    } catch (const Error& e) {
      EXPECT_STREQ(e.what(), "the host's bone is another");
    }
    const std::int64_t began_us = steady_us();
    std::unique_ptr<Device> own;
    if (role == JoinRole::trainee) own = std::make_unique<YieldingHand>(100, seat.leader());
    const auto copy = seat.begin(theirs, World(test::bar(0.5, 0.3)), copied, std::move(own), {});
    ASSERT_TRUE(comes([&] {
      const auto all = hosted.host->status(steady_us());
      return !all.empty() && all.front().ready;
    }));
    EXPECT_EQ(seat.status().state, JoinState::joined);
    hosted.rehearsal->start();
    ASSERT_TRUE(comes([&] { return seat.status().ticks >= 400; }));
    if (role == JoinRole::trainee) {
      ASSERT_TRUE(comes([&] { return seat.status().strength > 0 && hosted.far->shown().age_ms < 255; }));
      EXPECT_GT(seat.status().apart_mm, 0);
      ASSERT_TRUE(comes([&] { return seat.status().apart_rms_mm > 0; }));
    }
    EXPECT_FALSE(seat.status().over);
    const RehearsalSummary s = hosted.rehearsal->stop();
    hosted.net->over(s.ticks);
    wait_for_all(*hosted.host, 60);
    ASSERT_TRUE(comes([&] { return seat.status().over; }, [&] { return seat.status().ticks; }));
    EXPECT_FALSE(hosted.host->lost());
    EXPECT_FALSE(hosted.host->waited_for(steady_us()));
    const SeatStatus status = seat.status();
    EXPECT_EQ(status.ticks, s.ticks);
    EXPECT_EQ(status.behind_ticks, 0U);
    EXPECT_LE(status.apart_rms_mm, status.apart_most_mm);
    EXPECT_EQ(status.led_s > 0, role == JoinRole::trainee);
    EXPECT_LE(status.led_s, static_cast<double>(steady_us() - began_us) * 1e-6);
    EXPECT_FALSE(status.host_lost || status.another);
    EXPECT_EQ(status.bone_differs_since, 0U);
    seat.leave();
    copy->stop();
    std::string bone;
    hosted.rehearsal->look([&](const World& world, SceneReaders&) { bone = world.hash(); });
    EXPECT_NE(bone, hosted.header.bone_hash) << "nothing was drilled";
    EXPECT_EQ(seat.bone_hash(), bone);
    hosted.net.reset();
  }
}

// Whatever was asked for here: what the session begins with is the host's.
TEST(LiveSeat, ACopyHasHeatWhereItsHostHas) {
  for (const bool host_has : {true, false}) {
    Hosted hosted(host_has);
    LiveSeat seat(hosted.seat(JoinRole::watcher));
    const SessionHeader theirs = seat.wait_for_session(60, {});
    RehearsalOptions copied;
    copied.follow.surface = false;
    copied.follow.heat = copied.follow.dust = !host_has;
    const auto copy = seat.begin(theirs, World(test::bar(0.5, 0.3)), copied, nullptr, {});
    EXPECT_EQ(copy->simulates(Simulated::heat), host_has);
    EXPECT_FALSE(copy->simulates(Simulated::dust));
    ASSERT_TRUE(comes([&] {
      const auto all = hosted.host->status(steady_us());
      return !all.empty() && all.front().ready;
    }));
    hosted.rehearsal->start();
    ASSERT_TRUE(comes([&] { return seat.status().ticks >= 400; }));
    const RehearsalSummary s = hosted.rehearsal->stop();
    hosted.net->over(s.ticks);
    wait_for_all(*hosted.host, 60);
    ASSERT_TRUE(comes([&] { return seat.status().over; }, [&] { return seat.status().ticks; }));
    seat.leave();
    copy->stop();
    const auto joules = [](Rehearsal& r) {
      double j = 0;
      r.look([&](const World&, SceneReaders& readers) { j = readers.heat ? readers.heat->ledger().added_j : -1; });
      return j;
    };
    EXPECT_EQ(joules(*copy), joules(*hosted.rehearsal));
    EXPECT_EQ(joules(*copy) > 0, host_has) << "drilling warms";
    hosted.net.reset();
  }
}

TEST(LiveSeat, WhoIsNotLetInIsToldWhy) {
  Hosted hosted;
  const auto told = [&](const SeatOptions& options) -> std::string {
    LiveSeat seat(options);
    try {
      static_cast<void>(seat.wait_for_session(options.tidy_code == test::kCode ? 0.05 : 60, {}));
    } catch (const Error& e) {
      return e.what();
    }
    return "";
  };
  SeatOptions wrong = hosted.seat(JoinRole::watcher);
  wrong.tidy_code = "AAAAAAAA";
  EXPECT_EQ(told(wrong), "the host rejects: the code is another");
  // A socket at which nobody answers.
  const UdpSocket silent("127.0.0.1", 0);
  SeatOptions nobody = hosted.seat(JoinRole::watcher);
  nobody.host = udp_peer("127.0.0.1:" + std::to_string(silent.port()));
  EXPECT_EQ(told(nobody), "nobody answers at " + udp_name(nobody.host));
}

TEST(LiveSeat, AHandWithoutAWillBeginsWhereTheLeaderIs) {
  const auto leader = std::make_shared<FarDevice>();
  YieldingHand hand(100, leader);
  EXPECT_EQ(hand.read(0, 1e-3, {}).age_ms, 255);
  DeviceSample at;
  at.position_mm = {4, 5, 6};
  at.tool = 2;
  for (std::uint64_t t = 0; t < 40; ++t) {
    leader->put({t, at}, true);
    static_cast<void>(leader->read(t, 1e-3, {}));
  }
  const DeviceSample first = hand.read(1, 1e-3, {});
  EXPECT_EQ(first.age_ms, 0);
  EXPECT_EQ(first.tool, 2);
  EXPECT_EQ(first.pedal, 0);
  EXPECT_NEAR(length(from_floats(first.position_mm) - Vec3{4, 5, 9}), 0, 1e-3) << "3 mm above it";
  // It stays where nothing pulls, and gives way to what does.
  DeviceSample s;
  for (std::uint64_t t = 2; t < 500; ++t) s = hand.read(t, 1e-3, {});
  EXPECT_NEAR(length(from_floats(s.position_mm) - Vec3{4, 5, 9}), 0, 1e-3);
  for (std::uint64_t t = 500; t < 1500; ++t) s = hand.read(t, 1e-3, {0.5, 0, 0});
  EXPECT_GT(s.position_mm[0], 10);
  EXPECT_NEAR(s.position_mm[1], 5, 1e-3);
  EXPECT_NE(joined_text(JoinRole::trainee), joined_text(JoinRole::watcher));
}

}  // namespace
}  // namespace osteo
