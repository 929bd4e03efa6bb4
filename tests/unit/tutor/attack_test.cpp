// A peer that lies, repeats, floods or guesses.
#include <gtest/gtest.h>

#include <cstring>

#include "osteo/network/tutor/live.h"
#include "sim_network.h"

namespace osteo {
namespace {

constexpr const char* kCode = "K7MX2QPA";

UdpPeer peer(std::uint64_t number) {
  return {{}, static_cast<std::uint32_t>(number >> 16), static_cast<std::uint16_t>(number)};
}

struct Meeting {
  std::shared_ptr<FarDevice> far = std::make_shared<FarDevice>(), shown = std::make_shared<FarDevice>();
  LiveHost host{kCode, Bytes(2500, 7), 2, far};
  std::int64_t now = 0;
  // Lets both talk; what went over the wire is kept.
  std::vector<Bytes> heard_by_host;
  void talk(LiveGuest& guest, int ms, std::uint64_t from = 5) {
    for (int i = 0; i < ms; ++i, now += 1000) {
      for (const Bytes& b : guest.poll(now)) {
        heard_by_host.push_back(b);
        host.receive(peer(from), b, now);
      }
      for (const auto& o : host.poll(now)) {
        if (o.to == peer(from)) guest.receive(o.bytes, now);
      }
    }
  }
};

TEST(PairingCode, IsReadAsPeopleTypeIt) {
  const std::string code = make_pairing_code();
  EXPECT_EQ(code.size(), 9U);
  EXPECT_NE(make_pairing_code(), code);
  EXPECT_EQ(tidy_code("k7mx 2qpa"), kCode);
  EXPECT_EQ(tidy_code("K7MX-2QPA"), kCode);
  EXPECT_EQ(tidy_code("K7MX-2QP"), "");
  EXPECT_EQ(tidy_code("K7MX-2QPO"), "");
}

TEST(Attack, TheRightCodeJoinsAndSettingsArrive) {
  Meeting m;
  LiveGuest guest(kCode, JoinRole::trainee, m.shown);
  m.talk(guest, 300);
  EXPECT_EQ(guest.state(), JoinState::joined);
  EXPECT_EQ(guest.settings(), Bytes(2500, 7));
  ASSERT_EQ(m.host.status(m.now).size(), 1U);
  // Nobody's place twice; watchers have theirs.
  LiveGuest second(kCode, JoinRole::trainee, m.shown), watcher(kCode, JoinRole::watcher, m.shown);
  for (int i = 0; i < 500; ++i) m.talk(guest, 1), m.talk(second, 1, 6), m.talk(watcher, 1, 7);
  EXPECT_EQ(guest.state(), JoinState::joined);
  EXPECT_EQ(watcher.state(), JoinState::joined);
  EXPECT_EQ(second.state(), JoinState::refused);
  EXPECT_NE(second.why().find("trainee"), std::string::npos);
}

TEST(Attack, AWrongCodeIsRefusedAndThreeCloseTheDoor) {
  Meeting m;
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(m.host.tries_left(), 3 - i);
    LiveGuest guest("AAAAAAAA", JoinRole::trainee, m.shown);
    m.talk(guest, 300);
    EXPECT_EQ(guest.state(), JoinState::refused);
  }
  LiveGuest right(kCode, JoinRole::trainee, m.shown);
  m.talk(right, 300);
  EXPECT_EQ(right.state(), JoinState::refused);
  EXPECT_NE(right.why().find("new one"), std::string::npos);
}

TEST(Attack, PacketsAreTakenOnceAndUnchanged) {
  const std::array<std::uint8_t, 32> a{1}, b{2};
  SecureChannel here(9, a, b), there(9, b, a), other(9, b, b);
  const Bytes plain{1, 2, 3, 4};
  const Bytes sealed = here.seal(plain);
  EXPECT_FALSE(other.open(sealed));  // another key
  for (std::size_t i = 0; i < sealed.size(); ++i) {
    Bytes bent = sealed;
    bent[i] ^= 1;
    EXPECT_FALSE(there.open(bent)) << i;
    EXPECT_FALSE(there.open({sealed.data(), i})) << i;
  }
  EXPECT_EQ(there.open(sealed), plain);
  EXPECT_FALSE(there.open(sealed));  // again
  EXPECT_FALSE(here.open(sealed));   // thrown back
  // Out of order within the window, each once; older ones not.
  std::vector<Bytes> many;
  for (int i = 0; i < 3000; ++i) many.push_back(here.seal(plain));
  EXPECT_TRUE(there.open(many[2999]));
  for (int i = 2000; i < 2999; ++i) EXPECT_TRUE(there.open(many[static_cast<std::size_t>(i)])) << i;
  for (int i = 2000; i < 3000; ++i) EXPECT_FALSE(there.open(many[static_cast<std::size_t>(i)])) << i;
  EXPECT_FALSE(there.open(many[1900]));
}

TEST(Attack, AStoredConversationOpensNothing) {
  Meeting m;
  LiveGuest guest(kCode, JoinRole::trainee, m.shown);
  for (std::uint64_t t = 0; t < 300; ++t) {
    DeviceSample s;
    s.position_mm[0] = static_cast<float>(t);
    guest.put({t, s});
    m.talk(guest, 1);
  }
  ASSERT_EQ(guest.state(), JoinState::joined);
  DeviceSample seen;
  for (int t = 0; t < 100; ++t) seen = m.far->read(static_cast<std::uint64_t>(t), 1e-3, {});
  const std::uint64_t before = m.host.refused();
  // All of it again, to the same host and to another one with the same code.
  Meeting again;
  for (const Bytes& b : m.heard_by_host) {
    m.host.receive(peer(5), b, m.now);
    again.host.receive(peer(5), b, again.now);
  }
  EXPECT_GE(m.host.refused(), before + 100);
  EXPECT_EQ(again.host.status(0).size(), 0U);
}

// Bytes of all kinds, at both sides and at each decoder.
TEST(Attack, WhateverComesNothingBreaks) {
  Meeting m;
  LiveGuest guest(kCode, JoinRole::trainee, m.shown);
  m.talk(guest, 200);
  test::SimNetwork dice({}, 99);
  const auto below = [&](std::size_t n) { return static_cast<std::size_t>(dice.chance() * static_cast<double>(n)); };
  HandPacket hand;
  hand.newest = 500;
  hand.samples.resize(16);
  LogPacket log;
  log.samples.resize(24);
  log.actions.resize(2, SceneAction::plain(ActionKind::undo));
  BlobPacket blob;
  blob.total = 1000;
  blob.bytes.resize(1000);
  const Bytes good[] = {encode(hand), encode(log), encode(blob)};
  ASSERT_TRUE(decode_hand(good[0]));
  ASSERT_TRUE(decode_log(good[1]));
  ASSERT_TRUE(decode_blob(good[2]));
  std::size_t understood = 0;
  const char* const asked = std::getenv("OSTEO_TUTOR_PACKETS");  // 1000000 for docs/guides/tutoring.md
  const int packets = asked != nullptr ? std::atoi(asked) : 30000;
  for (int i = 0; i < packets; ++i) {
    Bytes b;
    if (i % 3 == 0) {
      b.resize(below(1400));
      for (auto& x : b) x = static_cast<std::uint8_t>(below(256));
      if (i % 6 == 0 && b.size() > 6)
        std::memset(b.data(), 0, 4), b[4] = static_cast<std::uint8_t>(1 + below(5)), b[5] = kTutorProtocol;
    } else {
      b = i % 3 == 1 && !m.heard_by_host.empty() ? m.heard_by_host[below(m.heard_by_host.size())] : good[below(3)];
      for (std::size_t k = below(4) + 1; k > 0 && !b.empty(); --k)
        b[below(b.size())] = static_cast<std::uint8_t>(below(256));
      if (below(3) == 0) b.resize(below(b.size() + 1));
      if (below(5) == 0) b.resize(b.size() + below(300));
    }
    understood += decode_hand(b) || decode_log(b) || decode_blob(b) ? 1 : 0;
    m.host.receive(peer(below(3) + 4), b, m.now);
    guest.receive(b, m.now);
    if (i % 10 == 0) {
      for (const auto& o : m.host.poll(m.now)) guest.receive(o.bytes, m.now);
      m.now += 50;
    }
  }
  EXPECT_GT(understood, 100U);  // changed poses are packets all the same
  EXPECT_LE(m.host.status(m.now).size(), LiveHost::kMaxPeers);
  // And the two still hear each other.
  m.talk(guest, 50);
  EXPECT_EQ(guest.state(), JoinState::joined);
  EXPECT_TRUE(m.host.status(m.now).front().heard);
}

// Answers are no longer than what asks: nobody can have another flooded by way of the host.
TEST(Attack, AnAnswerIsNoLongerThanItsQuestion) {
  Meeting m;
  LiveGuest guest(kCode, JoinRole::trainee, m.shown);
  for (const Bytes& ask : guest.poll(200'000)) {
    m.host.receive(peer(1), ask, 200'000);
    std::size_t answered = 0;
    for (const auto& o : m.host.poll(200'000)) answered += o.bytes.size();
    EXPECT_GT(answered, 0U);
    EXPECT_LE(answered, ask.size());
  }
  // Ten thousand of them in a tenth of a second: twenty are answered.
  std::size_t answers = 0;
  for (int i = 0; i < 10000; ++i) {
    LiveGuest one(kCode, JoinRole::watcher, m.shown);
    if (i > 30) {
      m.host.receive(peer(static_cast<std::uint64_t>(i)), Bytes(128, 0), 200'000 + i * 10);
      continue;
    }
    for (const Bytes& ask : one.poll(200'000))
      m.host.receive(peer(static_cast<std::uint64_t>(i)), ask, 200'000 + i * 10);
    answers += m.host.poll(200'000 + i * 10).size();
  }
  EXPECT_LE(answers, 22U);
}

// The servo takes at most 64 samples a tick, whatever is in its inbox.
TEST(Attack, AFloodOfPosesCostsTheServoNoMoreThanItsShare) {
  FarDevice far;
  for (std::uint64_t i = 0; i < 100'000; ++i) far.put({i, {}}, true);
  static_cast<void>(far.read(0, 1e-3, {}));
  EXPECT_GE(far.strength(), 0);
  DeviceSample wild;
  wild.position_mm = {NAN, INFINITY, 1e30F};
  far.put({~std::uint64_t{0}, wild}, true);
  far.put({0, wild}, true);
  for (std::uint64_t t = 1; t < 100; ++t) static_cast<void>(far.read(t, 1e-3, {}));
}

}  // namespace
}  // namespace osteo
