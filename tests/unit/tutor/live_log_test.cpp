// What a host keeps of its session and tells those who have joined, tick by tick, without a session around it.
#include <gtest/gtest.h>

#include <cstdio>

#include "osteo/network/tutor/live.h"
#include "sim_network.h"

namespace osteo {
namespace {

using test::NetworkFaults;
using test::SimNetwork;

constexpr const char* kCode = "K7MX2QPA";
constexpr UdpPeer kFrom{{}, 0, 5};

Bytes settings(std::size_t size) {
  Bytes b(size);
  for (std::size_t i = 0; i < size; ++i) b[i] = static_cast<std::uint8_t>(i * 7 + i / 251);
  return b;
}

// A host and one who joins, a millisecond a step.
struct Link {
  explicit Link(std::size_t hands, Bytes of_session = settings(40), JoinRole role = JoinRole::trainee,
                const NetworkFaults& faults = {})
      : hands_(hands),
        host(std::in_place, kCode, std::move(of_session), hands, far),
        guest(kCode, role, shown),
        up(faults, 31),
        down(faults, 32) {}
  // The session's next tick: each hand where its number says.
  void tick() {
    for (std::size_t h = 0; h < hands_; ++h) {
      TickRecord t;
      t.tick = ticks;
      t.hand = static_cast<std::uint8_t>(h);
      t.device.position_mm = {static_cast<float>(ticks), static_cast<float>(h), 0};
      host->tick(t, {});
    }
    ++ticks;
  }
  void act(std::uint64_t at, double number) {
    SceneAction a = SceneAction::suction({}, 1, number);
    a.tick = at;
    host->action(a);
  }
  // All that goes to and fro in so many milliseconds.
  void run(int ms) {
    for (int i = 0; i < ms; ++i) {
      now += 1000;
      for (const Bytes& b : up.arrived(now)) {
        host->receive(kFrom, b, now);
        heard_us = now;
      }
      for (const Bytes& b : down.arrived(now)) guest.receive(b, now);
      for (const auto& o : host->poll(now)) {
        large += o.bytes.size() > BlobPacket::kMax ? 1 : 0;
        down.send(o.bytes, now);
      }
      for (const Bytes& b : guest.poll(now)) up.send(b, now);
    }
  }
  // Ticks that have come, as they should be.
  std::vector<LiveTick> taken() {
    std::vector<LiveTick> all;
    while (auto t = guest.next()) {
      EXPECT_EQ(t->tick, next_);
      for (std::size_t h = 0; h < hands_; ++h)
        EXPECT_EQ(t->hands[h].position_mm, (std::array<float, 3>{static_cast<float>(next_), static_cast<float>(h), 0}));
      ++next_;
      all.push_back(std::move(*t));
    }
    return all;
  }
  std::shared_ptr<FarDevice> far = std::make_shared<FarDevice>(), shown = std::make_shared<FarDevice>();
  std::size_t hands_;
  std::optional<LiveHost> host;
  LiveGuest guest;
  SimNetwork up, down;
  std::int64_t now = 1'000'000, heard_us = 0;
  std::uint64_t ticks = 0, next_ = 0;
  int large = 0;  // packets that are full of settings
};

TEST(LiveLog, TicksComeWithTheirActionsAndAtTheEndWhatIsBehindTheLast) {
  for (const std::size_t hands : {1U, 2U, 3U, 4U}) {
    Link link(hands);
    const std::vector<std::uint64_t> at{0, 0, 57, 57, 57, 58, 59, 60, 99, 100, 100};
    for (std::size_t n = 0; n < at.size(); ++n) link.act(at[n], static_cast<double>(n));
    for (int t = 0; t < 100; ++t) link.tick();
    link.run(200);
    std::vector<std::pair<std::uint64_t, double>> came, wanted;
    const std::vector<LiveTick> all = link.taken();
    ASSERT_EQ(all.size(), 100U) << hands;
    for (const LiveTick& t : all) {
      for (const SceneAction& a : t.actions) {
        EXPECT_EQ(a.tick, t.tick);
        came.emplace_back(a.tick, a.values[4]);
      }
    }
    // While it runs there is no last tick, and nothing behind it.
    EXPECT_FALSE(link.guest.over());
    EXPECT_TRUE(link.guest.behind().empty());
    EXPECT_EQ(link.guest.host_tick(), 100U);
    for (std::size_t n = 0; n < at.size(); ++n)
      if (at[n] < 100) wanted.emplace_back(at[n], static_cast<double>(n));
    EXPECT_EQ(came, wanted) << hands;
    link.host->over(100);
    link.run(50);
    EXPECT_TRUE(link.guest.over());
    EXPECT_FALSE(link.guest.host_lost());
    EXPECT_FALSE(link.host->lost());
    ASSERT_EQ(link.guest.behind().size(), 2U);
    for (const SceneAction& a : link.guest.behind()) EXPECT_EQ(a.tick, 100U);
    EXPECT_FALSE(link.guest.next());
  }
}

// It is over for who has all of it.
TEST(LiveLog, OverIsWhenAllWasTaken) {
  Link link(1);
  for (int t = 0; t < 30; ++t) link.tick();
  link.host->over(30);
  link.run(100);
  EXPECT_EQ(link.guest.next_tick(), 30U);
  for (int t = 0; t < 30; ++t) {
    EXPECT_FALSE(link.guest.over()) << t;
    ASSERT_TRUE(link.guest.next());
  }
  EXPECT_TRUE(link.guest.over());
}

// A network that reorders: what was sent earlier and comes later says nothing of how far the copy is now.
TEST(LiveLog, AnOvertakenPacketTakesNothingBack) {
  Link link(1);
  for (int t = 0; t < 50; ++t) link.tick();
  link.run(200);
  ASSERT_EQ(link.guest.next_tick(), 50U);
  link.now += 5000;
  const std::vector<Bytes> held = link.guest.poll(link.now);
  ASSERT_EQ(held.size(), 1U);
  link.guest.be_ready();
  for (int t = 0; t < 100; ++t) link.tick();
  link.run(200);
  ASSERT_EQ(link.guest.next_tick(), 150U);
  const auto status = [&] { return link.host->status(link.now).front(); };
  ASSERT_EQ(status().behind_ticks, 0U);
  ASSERT_TRUE(status().ready);
  const std::uint64_t refused = link.host->refused();
  link.host->receive(kFrom, held.front(), link.now);
  EXPECT_EQ(link.host->refused(), refused) << "late, but good";
  EXPECT_EQ(status().behind_ticks, 0U);
  EXPECT_TRUE(status().ready);
  // Who does begin again is given all of it once more.
  link.guest.begin_again();
  link.next_ = 0;
  link.run(300);
  EXPECT_EQ(link.taken().size(), 150U);
}

// A copy that is slower than the session for longer than the host remembers what it sent: once it is faster it has all.
TEST(LiveLog, WhoWasFarBehindCatchesUp) {
  Link link(1, settings(40), JoinRole::watcher, {10, 0, 0, 0});
  link.run(100);
  std::uint64_t taken = 0;
  const auto step = [&](int most) {
    link.tick();
    link.run(1);
    for (int n = 0; n < most && link.guest.next(); ++n) ++taken;
  };
  for (int t = 0; t < 40'000; ++t) step(t % 3 == 0 ? 1 : 0);
  ASSERT_LT(taken + 20'000, link.ticks) << "it is not far behind";
  for (int t = 0; t < 20'000 && taken + 50 < link.ticks; ++t) step(5);
  std::printf("26,000 ticks behind, it had all after %d ms\n", static_cast<int>(link.ticks) - 40'000);
  EXPECT_GT(link.guest.next_tick() + 50, link.ticks);
  EXPECT_LT(link.ticks, 55'000U) << "faster than time goes";
}

// More at once than a packet holds: ticks go on, with the first of it.
TEST(LiveLog, MoreActionsInATickThanFitHoldNothingUp) {
  Link link(2);
  for (int n = 0; n < 6; ++n) link.act(10, n);
  link.act(11, 6);
  for (int t = 0; t < 40; ++t) link.tick();
  link.run(300);
  const std::vector<LiveTick> all = link.taken();
  ASSERT_EQ(all.size(), 40U);
  EXPECT_EQ(all[10].actions.size(), LogPacket::kMaxActions);
  EXPECT_EQ(all[11].actions.size(), 1U);
  // Nor at the end of a session, where no tick follows.
  for (std::uint64_t t = 43; t < 49; ++t) link.act(t, 0);
  for (int t = 0; t < 10; ++t) link.tick();
  link.host->over(50);
  link.run(100);
  const std::vector<LiveTick> last = link.taken();
  ASSERT_EQ(last.size(), 10U);
  for (std::size_t t = 3; t < 9; ++t) EXPECT_EQ(last[t].actions.size(), 1U) << t;
  EXPECT_TRUE(link.guest.over());
}

TEST(LiveLog, WhereTicksAreMissingThereIsNoMoreOfIt) {
  const auto record = [](std::uint64_t tick, std::uint8_t hand) {
    TickRecord t;
    t.tick = tick;
    t.hand = hand;
    return t;
  };
  Link skipped(2);
  skipped.tick();
  EXPECT_FALSE(skipped.host->lost());
  skipped.run(100);
  EXPECT_FALSE(skipped.guest.host_lost());
  skipped.host->tick(record(2, 0), {});
  EXPECT_TRUE(skipped.host->lost());
  skipped.host->tick(record(1, 0), {});  // too late
  skipped.host->over(1);
  skipped.run(100);
  EXPECT_TRUE(skipped.host->lost());
  EXPECT_TRUE(skipped.guest.host_lost());
  EXPECT_FALSE(skipped.guest.over());
  EXPECT_EQ(skipped.taken().size(), 1U);
  EXPECT_EQ(skipped.host->mark().tick, 1U);

  Link other_hand(2);  // of a tick one hand alone
  other_hand.host->tick(record(0, 0), {});
  EXPECT_FALSE(other_hand.host->lost());
  other_hand.host->tick(record(1, 0), {});
  EXPECT_TRUE(other_hand.host->lost());

  for (const auto& [told, lost] : {std::pair<std::uint64_t, bool>{9, true}, {10, false}, {11, true}}) {
    Link link(1);
    for (int t = 0; t < 10; ++t) link.tick();
    link.host->over(told);
    EXPECT_EQ(link.host->lost(), lost) << told;
    link.host->over(10);  // what was said first counts
    EXPECT_EQ(link.host->lost(), lost) << told;
  }
}

TEST(LiveLog, ThereIsRoomForHalfAnHour) {
  LiveHost host(kCode, {}, 1, std::make_shared<FarDevice>());
  TickRecord t;
  for (; t.tick < LiveHost::kMaxTicks; ++t.tick) host.tick(t, {});
  EXPECT_FALSE(host.lost());
  EXPECT_EQ(host.mark().tick, 1'800'000U);
  host.tick(t, {});
  EXPECT_TRUE(host.lost());
  EXPECT_EQ(host.mark().tick, LiveHost::kMaxTicks);
}

// One who lacks ticks is waited for as long as it may still be there: ten seconds.
TEST(LiveLog, WhoLacksAPartIsWaitedForWhileItMayBeThere) {
  Link link(2);
  link.tick();
  EXPECT_FALSE(link.host->waited_for(link.now)) << "nobody is there";
  link.run(100);
  ASSERT_EQ(link.guest.state(), JoinState::joined);
  EXPECT_FALSE(link.host->waited_for(link.now));
  link.up.cut = true;
  link.run(5);
  link.tick();
  EXPECT_TRUE(link.host->waited_for(link.now));
  EXPECT_TRUE(link.host->waited_for(link.heard_us + 10'000'000));
  EXPECT_FALSE(link.host->waited_for(link.heard_us + 10'000'001));
  // Heard of within a second; forgotten after ten.
  ASSERT_EQ(link.host->status(link.now).size(), 1U);
  EXPECT_EQ(link.host->status(link.now).front().behind_ticks, 1U);
  EXPECT_TRUE(link.host->status(link.heard_us + 999'999).front().heard);
  EXPECT_FALSE(link.host->status(link.heard_us + 1'000'000).front().heard);
  static_cast<void>(link.host->poll(link.heard_us + 10'000'000));
  EXPECT_EQ(link.host->status(link.now).size(), 1U);
  static_cast<void>(link.host->poll(link.heard_us + 10'000'001));
  EXPECT_TRUE(link.host->status(link.now).empty());
}

// A guest whose host is silent for more than two seconds asks again, and what it hears then may be another session.
TEST(LiveLog, AHostThatBeginsAgainIsFollowedFromTheBeginning) {
  Link link(1, settings(3000));
  for (int t = 0; t < 50; ++t) link.tick();
  link.act(50, 1);
  link.host->over(50);
  link.run(200);
  ASSERT_EQ(link.taken().size(), 50U);
  ASSERT_TRUE(link.guest.over());
  ASSERT_EQ(link.guest.behind().size(), 1U);
  link.guest.be_ready();
  link.run(10);
  EXPECT_TRUE(link.host->status(link.now).front().ready);
  const std::uint64_t before = link.guest.session();
  EXPECT_NE(before, 0U);

  const std::int64_t heard = link.guest.heard_us();
  static_cast<void>(link.guest.poll(heard + 2'000'000));
  EXPECT_EQ(link.guest.state(), JoinState::joined);
  static_cast<void>(link.guest.poll(heard + 2'000'001));
  EXPECT_EQ(link.guest.state(), JoinState::asking);
  link.now = heard + 2'000'001;
  link.host.emplace(kCode, settings(1500), 1, link.far);
  link.ticks = link.next_ = 0;
  for (int t = 0; t < 20; ++t) link.tick();
  link.run(300);
  EXPECT_EQ(link.guest.state(), JoinState::joined);
  EXPECT_NE(link.guest.session(), before);
  EXPECT_EQ(link.guest.settings(), settings(1500));
  EXPECT_EQ(link.guest.settings_here(), 1500U);
  EXPECT_EQ(link.guest.host_tick(), 20U);
  EXPECT_TRUE(link.guest.behind().empty());
  EXPECT_FALSE(link.host->status(link.now).front().ready);
  EXPECT_EQ(link.taken().size(), 20U);
  EXPECT_FALSE(link.guest.over());
}

TEST(LiveLog, LargeSettingsArriveOnceAndWhole) {
  Link clean(1, settings(600'000));
  clean.run(1500);
  EXPECT_EQ(clean.guest.settings(), settings(600'000));
  EXPECT_EQ(clean.large, 600) << "nothing was lost, so nothing is said twice";
  // Who says nothing is told again, but no sooner than after 20 ms.
  Link silent(1, settings(16'000));
  for (int i = 0; i < 100 && silent.host->status(silent.now).empty(); ++i) silent.run(1);
  ASSERT_EQ(silent.host->status(silent.now).size(), 1U);
  silent.up.cut = true;
  silent.run(1000);
  EXPECT_GT(silent.large, 16 * 1000 / 30);
  EXPECT_LE(silent.large, 16 * (1000 / 20 + 1));
  // Half of what is on its way may be lost; a tick waits for them.
  Link bad(1, settings(100'000), JoinRole::watcher, {20, 5, 0.5, 0.1});
  bad.tick();
  bad.run(500);
  const std::size_t some = bad.guest.settings_here();
  EXPECT_TRUE(bad.guest.settings().empty());
  EXPECT_FALSE(bad.guest.next());
  bad.up.faults.loss = bad.down.faults.loss = 0.1;
  bad.run(6000);
  EXPECT_GT(bad.guest.settings_here(), some);
  EXPECT_EQ(bad.guest.settings(), settings(100'000));
  EXPECT_EQ(bad.taken().size(), 1U);
}

// Whoever comes late catches up faster than time goes, however much is lost.
TEST(LiveLog, WhoComesLateCatchesUp) {
  for (const double loss : {0.0, 0.1}) {
    Link link(2, settings(40), JoinRole::watcher, {10, loss > 0 ? 5.0 : 0.0, loss, loss / 2});
    for (int t = 0; t < 20'000; ++t) link.tick();
    std::size_t came = 0;
    int ms = 0;
    for (; came < 20'000 && ms < 20'000; ms += 10) {
      link.run(10);
      came += link.taken().size();
    }
    EXPECT_EQ(came, 20'000U);
    std::printf("20 s of a session came in %d ms, %.0f %% lost\n", ms, 100 * loss);
    EXPECT_LT(ms, loss > 0 ? 7000 : 1000);
    // Where nothing is lost nor overtaken nothing is said twice: 12 ticks in each packet.
    if (loss == 0) {
      EXPECT_LE(link.down.sent, 20'000U / 12 + static_cast<unsigned>(ms) / 4 + 20);
    }
    EXPECT_EQ(link.host->status(link.now).front().role, JoinRole::watcher);
  }
}

// Whoever was away for a while goes on where it was: what it has is not sent again.
TEST(LiveLog, WhoComesBackGoesOnWhereItWas) {
  Link link(2);
  for (int t = 0; t < 5000; ++t) link.tick();
  link.run(1000);
  ASSERT_EQ(link.taken().size(), 5000U);
  link.up.cut = link.down.cut = true;
  link.run(3000);
  ASSERT_EQ(link.guest.state(), JoinState::asking);
  for (int t = 0; t < 50; ++t) link.tick();
  link.run(1000);
  link.up.cut = link.down.cut = false;
  const std::uint64_t before = link.down.sent;
  link.run(400);
  EXPECT_EQ(link.guest.state(), JoinState::joined);
  EXPECT_EQ(link.taken().size(), 50U);
  EXPECT_LE(link.down.sent - before, 400U / 4 + 12) << "of 5000 ticks are 417 packets";
}

// Marks of the bone are compared once each; one that differs is told to both sides.
TEST(LiveLog, MarksThatDifferAreToldToBoth) {
  for (const bool same : {true, false}) {
    Link link(1);
    link.run(60);
    const VoxelChange change{5, 0, 1};
    for (int second = 1; second <= 3; ++second) {
      for (int t = 0; t < 1000; ++t) {
        TickRecord r;
        r.tick = link.ticks++;
        link.host->tick(r, {&change, r.tick == 1500 ? 1U : 0U});
        if (t % 10 == 9) link.run(10);
      }
      link.run(30);
      std::uint64_t hash = second > 1 ? mixed(0, 1500, {&change, 1}) : 0;
      EXPECT_EQ(link.host->mark(), (BoneMark{static_cast<std::uint64_t>(second) * 1000, hash}));
      link.guest.mark({static_cast<std::uint64_t>(second) * 1000, same ? hash : 0});
      link.guest.mark({static_cast<std::uint64_t>(second) * 1000 - 1, 77});  // between marks: not compared
      link.run(30);
    }
    const PeerStatus status = link.host->status(link.now).front();
    EXPECT_EQ(status.bone_differs_since, same ? 0U : 2000U);
    EXPECT_EQ(status.marks_same, same ? 3U : 1U);
    EXPECT_EQ(link.guest.differs(), same ? 0U : 2000U);
    EXPECT_EQ(link.guest.marks_same(), same ? 3U : 1U);
    EXPECT_FALSE(same && link.guest.differs() != 0);
  }
}

// Each hand is heard of by the ticks of its own machine, however far those are from the other's, and without a buffer
// where nothing is late.
TEST(LiveLog, HandsAreFollowedByTheirOwnTicks) {
  for (const std::uint64_t begin : {std::uint64_t{0}, std::uint64_t{700'000}}) {
    for (const JoinRole role : {JoinRole::trainee, JoinRole::watcher}) {
      Link link(1, settings(40), role);
      link.run(100);
      DeviceSample at_host, at_guest;
      for (std::uint64_t t = 0; t < 1500; ++t) {
        link.tick();
        DeviceSample s;
        s.position_mm[1] = static_cast<float>(t);
        link.guest.put({begin + t, s});
        link.run(1);
        at_host = link.far->read(t, 1e-3, {});
        at_guest = link.shown->read(begin + t, 1e-3, {});
        static_cast<void>(link.taken());
      }
      EXPECT_NEAR(at_guest.position_mm[0], 1499, 8) << begin;
      EXPECT_EQ(at_guest.age_ms, 0);
      EXPECT_LE(link.shown->buffer_ms(), 4);
      // Where nothing is lost nothing is said again: a packet every 4 ms, and every 2 ms of a hand.
      EXPECT_NEAR(static_cast<double>(link.down.sent), 1600 / 4, 15);
      EXPECT_NEAR(static_cast<double>(link.up.sent), 1600 / 2, 15);
      if (role == JoinRole::watcher) {
        EXPECT_EQ(at_host.age_ms, 255) << "a watcher has no hand";
        continue;
      }
      EXPECT_NEAR(at_host.position_mm[1], 1499, 5) << begin;
      EXPECT_EQ(at_host.age_ms, 0);
      EXPECT_LE(link.far->buffer_ms(), 2);
      EXPECT_EQ(link.far->strength(), 1);
    }
  }
}

TEST(ClockSync, IsThatOfTheShortestWay) {
  ClockSync clock;
  EXPECT_FALSE(clock.known());
  EXPECT_EQ(clock.stamp(500).sent_us, 500);
  EXPECT_EQ(clock.stamp(500).echo_us, 0);
  EXPECT_EQ(clock.stamp(500).held_us, 0);
  clock.heard({7000, 0, 0}, 1000);  // they have not heard of us
  EXPECT_FALSE(clock.known());
  EXPECT_EQ(clock.stamp(1600).echo_us, 7000);
  EXPECT_EQ(clock.stamp(1600).held_us, 600);
  // Sent at 1600, held for 2000 there, back at 5600: 2000 on the way. Their 9000 is our 4600.
  clock.heard({9000, 1600, 2000}, 5600);
  EXPECT_TRUE(clock.known());
  EXPECT_DOUBLE_EQ(clock.rtt_ms(), 2);
  EXPECT_DOUBLE_EQ(clock.offset_ms(), 4.4);
  // A longer way says less; a shorter one more.
  clock.heard({20'000, 6000, 0}, 10'000);
  EXPECT_DOUBLE_EQ(clock.rtt_ms(), 2);
  EXPECT_DOUBLE_EQ(clock.offset_ms(), 4.4);
  clock.heard({20'000, 15'000, 0}, 15'500);
  EXPECT_DOUBLE_EQ(clock.rtt_ms(), 0.5);
  EXPECT_DOUBLE_EQ(clock.offset_ms(), 4.75);
  // What cannot be is not believed: an answer before its question, ten seconds on the way, held for less than nothing.
  clock.heard({30'000, 20'001, 0}, 20'000);
  clock.heard({20'000'000, 100, 0}, 10'000'100);
  clock.heard({30'000, 20'000, -1}, 20'100);
  EXPECT_DOUBLE_EQ(clock.rtt_ms(), 0.5);
  EXPECT_DOUBLE_EQ(clock.offset_ms(), 4.75);
  // Of the last 64: then the short way is forgotten.
  for (int i = 1; i <= 64; ++i) {
    EXPECT_DOUBLE_EQ(clock.rtt_ms(), 0.5) << i;
    clock.heard({40'000 + i, 30'000 + i, 0}, 31'000 + i);
  }
  EXPECT_DOUBLE_EQ(clock.rtt_ms(), 1);
  // Their clock was ahead by 9.5 ms when 64 were known, and is by 10.7 ms ten seconds later: 120 millionths.
  clock = {};
  for (int i = 1; i <= 64; ++i) clock.heard({40'000, 30'000, 0}, 31'000);
  EXPECT_DOUBLE_EQ(clock.offset_ms(), 9.5);
  clock.heard({10'041'600, 10'030'500, 0}, 10'031'000);  // half as long: it counts
  EXPECT_DOUBLE_EQ(clock.offset_ms(), 10.85);
  EXPECT_EQ(clock.drift_ppm(), 0) << "ten seconds are too short";
  clock.heard({10'041'501, 10'030'601, 0}, 10'031'001);
  EXPECT_DOUBLE_EQ(clock.offset_ms(), 10.7);
  EXPECT_NEAR(clock.drift_ppm(), 1200 / 10.000001, 1e-6);
}

TEST(JitterBuffer, SilenceIsToldFromTheTwentyFirstTickOn) {
  JitterBuffer buffer;
  EXPECT_EQ(buffer.read(0).age_ms, 255);
  EXPECT_EQ(buffer.read(0).position_mm[2], 5000);
  for (std::uint64_t t = 0; t <= 1000; ++t) {
    buffer.put({t, {}}, t, true);
    const DeviceSample s = buffer.read(t);
    EXPECT_EQ(s.age_ms, 0);
    // Of whoever begins to pull, softly: all of it in half a second.
    if (t < 499) {
      EXPECT_NEAR(s.buttons, double{kLeadStrength} * static_cast<double>(t + 1) / 500, 4) << t;
    }
  }
  EXPECT_EQ(buffer.read(1000).buttons, kLeadStrength);
  for (std::uint64_t silent = 1; silent <= 300; ++silent) {
    const DeviceSample s = buffer.read(1000 + silent);
    EXPECT_EQ(s.age_ms, silent <= 20 ? 0 : std::min<std::uint64_t>(silent, 255)) << silent;
    const double pull = silent <= 20 ? 1 : std::max(0.0, 1 - (static_cast<double>(silent) - 20) / 30);
    EXPECT_NEAR(s.buttons, double{kLeadStrength} * pull, 0.51) << silent;
  }
  // Who may not pull: gone within 30 ticks.
  JitterBuffer held;
  for (std::uint64_t t = 0; t < 600; ++t) {
    held.put({t, {}}, t, true);
    static_cast<void>(held.read(t));
  }
  for (std::uint64_t t = 600; t < 630; ++t) {
    held.put({t, {}}, t, true);
    EXPECT_NEAR(held.read(t, false).buttons, double{kLeadStrength} * (1 - static_cast<double>(t - 599) / 30), 0.51);
  }
}

// What all but a hundredth of the samples need, and of the first hundred what each needs; the quickest way is no part
// of it.
TEST(JitterBuffer, AllButAHundredthSetHowMuchIsHeld) {
  JitterBuffer buffer;
  for (std::uint64_t t = 100; t < 3000; ++t) {
    const std::uint64_t late = t == 150 || (t > 1000 && t % 150 == 0) ? 60 : t % 2 * 8;
    buffer.put({t - 30 - late, {}}, t, true);
    static_cast<void>(buffer.read(t));
    if (t == 100) {
      EXPECT_EQ(buffer.buffer_ticks(), 0) << "it begins with what came";
      EXPECT_EQ(buffer.played_tick(), 70U);
    }
    if (t == 220) {
      EXPECT_NEAR(buffer.buffer_ticks(), 6, 1) << "by a tick in twenty towards 60";
    }
  }
  EXPECT_EQ(buffer.buffer_ticks(), 8);
  EXPECT_EQ(buffer.played_tick(), 2999U - 38);
  // Another sender, whose ticks are other numbers: at once, but for what is held at most.
  for (std::uint64_t t = 3000; t < 3300; ++t) {
    buffer.put({t + 5000, {}}, t, true);
    static_cast<void>(buffer.read(t));
  }
  EXPECT_NEAR(static_cast<double>(buffer.played_tick()), 3299 + 5000 - 150, 5);
}

TEST(Live, AChangeOfBoneIsMixedInWithItsTickPlaceAndDensity) {
  const VoxelChange change{5, 0.25F, 1};
  EXPECT_EQ(mixed(9, 3, {}), 9U);
  const std::uint64_t one = mixed(9, 3, {&change, 1});
  EXPECT_NE(one, 9U);
  EXPECT_EQ(one, mixed(9, 3, {&change, 1}));
  EXPECT_NE(one, mixed(9, 4, {&change, 1}));
  EXPECT_NE(one, mixed(8, 3, {&change, 1}));
  for (const VoxelChange& other : {VoxelChange{6, 0.25F, 1}, VoxelChange{5, 0.5F, 1}})
    EXPECT_NE(one, mixed(9, 3, {&other, 1}));
}

}  // namespace
}  // namespace osteo
