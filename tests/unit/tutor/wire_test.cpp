// Packets as bytes: what is written is read back, and what says of itself what is not so is no packet.
#include "osteo/network/tutor/wire.h"

#include <gtest/gtest.h>

namespace osteo {
namespace {

constexpr std::uint64_t kLast = ~std::uint64_t{0};

DeviceSample sample(float x) {
  DeviceSample s;
  s.position_mm = {x, x + 1, x + 2};
  s.pedal = 9;
  return s;
}
HandPacket hand(std::size_t samples) {
  HandPacket p;
  p.times = {11, 12, 13};
  p.next_tick = 14;
  p.blob_bytes = 15;
  p.mark = {16, 17};
  p.newest = 18;
  for (std::size_t i = 0; i < samples; ++i) p.samples.push_back(sample(static_cast<float>(i)));
  return p;
}
LogPacket log(std::size_t ticks, std::uint8_t hands = 1) {
  LogPacket p;
  p.times = {11, 12, 13};
  p.session = 14;
  p.first_tick = 100;
  p.now_tick = 15;
  p.mark = {16, 17};
  p.hands = hands;
  for (std::size_t i = 0; i < ticks * hands; ++i) p.samples.push_back(sample(static_cast<float>(i)));
  return p;
}
BlobPacket blob(std::uint32_t total, std::uint32_t offset, std::size_t bytes) {
  BlobPacket p;
  p.times = {11, 12, 13};
  p.session = 14;
  p.total = total;
  p.offset = offset;
  p.bytes.assign(bytes, 7);
  return p;
}
SceneAction action(std::uint64_t tick) {
  SceneAction a = SceneAction::suction({1, 2, 3}, 4, 5);
  a.tick = tick;
  return a;
}
void expect_same(const WireTimes& t) {
  EXPECT_EQ(t.sent_us, 11);
  EXPECT_EQ(t.echo_us, 12);
  EXPECT_EQ(t.held_us, 13);
}

TEST(Wire, WhatIsWrittenIsReadBack) {
  for (const bool ready : {false, true}) {
    HandPacket p = hand(3);
    p.ready = ready;
    const auto h = decode_hand(encode(p));
    ASSERT_TRUE(h);
    expect_same(h->times);
    EXPECT_EQ(h->next_tick, 14U);
    EXPECT_EQ(h->blob_bytes, 15U);
    EXPECT_EQ(h->ready, ready);
    EXPECT_EQ(h->mark, (BoneMark{16, 17}));
    EXPECT_EQ(h->newest, 18U);
    ASSERT_EQ(h->samples.size(), 3U);
    for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(h->samples[i].position_mm, p.samples[i].position_mm);
    EXPECT_EQ(h->samples[2].pedal, 9);
  }
  for (const LogState state : {LogState::runs, LogState::over, LogState::lost}) {
    LogPacket p = log(4, 2);
    p.state = state;
    p.actions = {action(100), action(103)};
    const auto l = decode_log(encode(p));
    ASSERT_TRUE(l);
    expect_same(l->times);
    EXPECT_EQ(l->session, 14U);
    EXPECT_EQ(l->first_tick, 100U);
    EXPECT_EQ(l->now_tick, 15U);
    EXPECT_EQ(l->state, state);
    EXPECT_EQ(l->mark, (BoneMark{16, 17}));
    EXPECT_EQ(l->hands, 2);
    ASSERT_EQ(l->samples.size(), 8U);
    for (std::size_t i = 0; i < 8; ++i) EXPECT_EQ(l->samples[i].position_mm, p.samples[i].position_mm);
    ASSERT_EQ(l->actions.size(), 2U);
    EXPECT_EQ(l->actions[1].tick, 103U);
    EXPECT_EQ(l->actions[1].values, p.actions[1].values);
  }
  const auto b = decode_blob(encode(blob(1000, 300, 20)));
  ASSERT_TRUE(b);
  expect_same(b->times);
  EXPECT_EQ(b->session, 14U);
  EXPECT_EQ(b->total, 1000U);
  EXPECT_EQ(b->offset, 300U);
  EXPECT_EQ(b->bytes, Bytes(20, 7));
}

TEST(Wire, EachKindAndProtocolIsItsOwnAndNoByteMayLack) {
  LogPacket with_actions = log(2, 2);
  with_actions.actions = {action(101)};
  const Bytes all[] = {encode(hand(2)), encode(with_actions), encode(blob(50, 0, 50))};
  for (std::size_t kind = 0; kind < 3; ++kind) {
    const Bytes& whole = all[kind];
    EXPECT_EQ(decode_hand(whole).has_value(), kind == 0);
    EXPECT_EQ(decode_log(whole).has_value(), kind == 1);
    EXPECT_EQ(decode_blob(whole).has_value(), kind == 2);
    Bytes other = whole;
    other[1] = kTutorProtocol + 1;
    EXPECT_FALSE(decode_hand(other) || decode_log(other) || decode_blob(other)) << kind;
    if (kind == 2) continue;  // of the settings as much is taken as there is
    for (std::size_t n = 0; n < whole.size(); ++n) {
      const std::span<const std::uint8_t> less(whole.data(), n);
      EXPECT_FALSE(decode_hand(less) || decode_log(less)) << kind << ' ' << n;
    }
    Bytes more = whole;
    more.push_back(0);
    EXPECT_FALSE(decode_hand(more) || decode_log(more)) << kind;
  }
  // What comes before the settings is 42 bytes; without them it says nothing, but is a packet.
  for (std::size_t n = 0; n <= 42; ++n) EXPECT_EQ(decode_blob({all[2].data(), n}).has_value(), n == 42) << n;
}

TEST(Wire, AHandSendsAsManySamplesAsItHasNumbersFor) {
  HandPacket p = hand(HandPacket::kMax);
  p.newest = HandPacket::kMax - 1;  // from number 0 on
  EXPECT_TRUE(decode_hand(encode(p)));
  p.newest = HandPacket::kMax - 2;
  EXPECT_FALSE(decode_hand(encode(p)));
  EXPECT_FALSE(decode_hand(encode(hand(HandPacket::kMax + 1))));
  p = hand(0);  // of a watcher
  p.newest = 0;
  ASSERT_TRUE(decode_hand(encode(p)));
  EXPECT_TRUE(decode_hand(encode(p))->samples.empty());
}

TEST(Wire, ALogIsOfTicksAndHandsThatThereMayBe) {
  for (const auto& [ticks, hands, good] : {std::tuple<std::size_t, std::size_t, bool>{LogPacket::kMaxTicks, 1, true},
                                           {LogPacket::kMaxTicks + 1, 1, false},
                                           {LogPacket::kMaxTicks, 2, true},
                                           {LogPacket::kMaxTicks / 2, kMaxHands, true},
                                           {0, kMaxHands, true},
                                           {0, kMaxHands + 1, false},
                                           {1, kMaxHands + 1, false},
                                           {0, 0, false}}) {
    const auto l = decode_log(encode(log(ticks, static_cast<std::uint8_t>(hands))));
    EXPECT_EQ(l.has_value(), good) << ticks << " of " << hands;
    if (l) {
      EXPECT_EQ(l->samples.size(), ticks * hands);
    }
  }
  LogPacket state = log(1);
  state.state = static_cast<LogState>(static_cast<int>(LogState::lost) + 1);
  EXPECT_FALSE(decode_log(encode(state)));
  // Numbers of ticks have an end.
  LogPacket last = log(0);
  last.first_tick = kLast;
  EXPECT_TRUE(decode_log(encode(last)));
  last = log(1);
  last.first_tick = kLast - 1;
  EXPECT_TRUE(decode_log(encode(last)));
  last.first_tick = kLast;
  EXPECT_FALSE(decode_log(encode(last)));
  // The most that a host says at once stays under what a path carries.
  LogPacket full = log(LogPacket::kMaxTicks, 2);
  full.actions.assign(LogPacket::kMaxActions, action(100));
  EXPECT_LE(encode(full).size(), kMaxPacketBytes);
  EXPECT_TRUE(decode_log(encode(full)));
  full.samples.resize(24, sample(0));
  full.actions.push_back(action(100));
  EXPECT_FALSE(decode_log(encode(full)));
}

// Ticks 100 to 103. What was done behind the last one belongs to a session that is over, and to no other.
TEST(Wire, ActionsAreOfThePacketsTicks) {
  for (const LogState state : {LogState::runs, LogState::over, LogState::lost}) {
    for (const auto& [tick, good] : {std::pair<std::uint64_t, bool>{99, false},
                                     {100, true},
                                     {103, true},
                                     {104, state == LogState::over},
                                     {105, false}}) {
      LogPacket p = log(4);
      p.state = state;
      p.actions = {action(101), action(tick)};
      EXPECT_EQ(decode_log(encode(p)).has_value(), good) << static_cast<int>(state) << ' ' << tick;
    }
  }
  LogPacket p = log(4);
  p.actions = {action(100)};
  p.actions[0].kind = 250;  // no such action
  EXPECT_FALSE(decode_log(encode(p)));
  p = log(1);
  p.actions.assign(LogPacket::kMaxActions, action(100));
  EXPECT_TRUE(decode_log(encode(p)));
  p.actions.push_back(action(100));
  EXPECT_FALSE(decode_log(encode(p)));
}

TEST(Wire, SettingsLieWithinTheirLength) {
  constexpr std::uint32_t kTotal = BlobPacket::kMaxTotal;
  for (const auto& [total, offset, bytes, good] :
       {std::tuple<std::uint32_t, std::uint32_t, std::size_t, bool>{kTotal, 0, BlobPacket::kMax, true},
        {kTotal + 1, 0, 10, false},
        {kTotal, 0, BlobPacket::kMax + 1, false},
        {500, 500, 0, true},
        {500, 501, 0, false},
        {500, 490, 10, true},
        {500, 490, 11, false},
        {0, 0, 0, true}}) {
    EXPECT_EQ(decode_blob(encode(blob(total, offset, bytes))).has_value(), good)
        << total << ' ' << offset << ' ' << bytes;
  }
}

}  // namespace
}  // namespace osteo
