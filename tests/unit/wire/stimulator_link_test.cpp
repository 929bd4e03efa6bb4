// The stimulator over the network: who has the code sets it, and nobody else does.
#include "osteo/network/wire/stimulator_link.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <cstring>
#include <random>
#include <thread>

#include "osteo/network/wire/remote_monitor.h"

namespace osteo {
namespace {

constexpr const char* kCode = "K7MX2QPA";

// A message as it was made, read once more.
void with(const WireBytes& bytes, const std::function<void(const IgtlMessage&)>& take) {
  IgtlParser parser(WireServer::kMaxAsked);
  EXPECT_TRUE(parser.feed(bytes, take));
}

int connected_to(int port) {
  const int fd = ::socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in a{};
  a.sin_family = AF_INET;
  a.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  a.sin_port = htons(static_cast<std::uint16_t>(port));
  EXPECT_EQ(::connect(fd, reinterpret_cast<const sockaddr*>(&a), sizeof a), 0);
  return fd;
}

struct Theatre {
  std::vector<StimulatorSetting> set;
  StimulatorSetting now;
  StimulatorEndpoint endpoint{kCode,
                              [this](const StimulatorSetting& s) {
                                set.push_back(s);
                                now = s;
                              },
                              [this] { return std::pair(now, std::uint32_t{2}); }};
  double at_s = 0;
  std::vector<WireBytes> said_to_door;

  // Until neither has anything to say.
  void talk(StimulatorLink& link, std::uint64_t client, WireBytes first) {
    std::vector<WireBytes> to_door{std::move(first)};
    while (!to_door.empty()) {
      std::vector<WireBytes> to_link;
      for (const WireBytes& b : to_door) {
        said_to_door.push_back(b);
        with(b, [&](const IgtlMessage& m) {
          for (WireBytes& a : endpoint.hear(client, m, at_s)) to_link.push_back(std::move(a));
        });
      }
      to_door.clear();
      for (const WireBytes& b : to_link) {
        with(b, [&](const IgtlMessage& m) {
          for (WireBytes& a : link.hear(m)) to_door.push_back(std::move(a));
        });
      }
    }
  }
};

TEST(StimulatorLink, WhoHasTheCodeSetsCurrentPulsesAndSearch) {
  Theatre theatre;
  theatre.now.current_ma = 0.7;
  StimulatorLink link("K7MX2QPA");
  EXPECT_FALSE(link.set({}));
  theatre.talk(link, 1, link.begin());
  ASSERT_TRUE(link.state().paired);
  EXPECT_EQ(link.state().now.current_ma, 0.7) << "as it is when one comes";
  EXPECT_EQ(link.state().hands, 2U);
  const StimulatorSetting wanted{1, 1.25, 10, 0.2, true};
  theatre.talk(link, 1, *link.set(wanted));
  ASSERT_EQ(theatre.set.size(), 1U);
  EXPECT_EQ(theatre.set[0], wanted);
  EXPECT_EQ(link.state().now, wanted);
  // Out of range is the nearest; a hand that is not there is nothing.
  theatre.talk(link, 1, *link.set({0, 500, 1000, 9, false}));
  ASSERT_EQ(theatre.set.size(), 2U);
  EXPECT_EQ(theatre.set[1], (StimulatorSetting{0, StimulatorSetting::kMaxMa, 30, 1, false}));
  theatre.talk(link, 1, *link.set({2, 1, 4, 0.1, false}));
  EXPECT_EQ(theatre.set.size(), 2U);
  EXPECT_EQ(theatre.endpoint.counts().settings, 2U);
  link.reported(0, false);
  EXPECT_EQ(link.state().now.current_ma, 0);
}

TEST(StimulatorLink, AWrongCodeSetsNothingAndThreeCloseTheDoor) {
  Theatre theatre;
  for (int i = 0; i < 3; ++i) {
    StimulatorLink wrong("AAAAAAAA");
    theatre.talk(wrong, 10 + static_cast<std::uint64_t>(i), wrong.begin());
    EXPECT_FALSE(wrong.state().paired);
    EXPECT_NE(wrong.state().refused.find("another"), std::string::npos);
    EXPECT_FALSE(wrong.set({0, 1, 4, 0.1, false}));
  }
  EXPECT_EQ(theatre.endpoint.counts().tries_left, 0);
  StimulatorLink right(kCode);
  theatre.talk(right, 20, right.begin());
  EXPECT_FALSE(right.state().paired);
  EXPECT_NE(right.state().refused.find("three"), std::string::npos);
  EXPECT_TRUE(theatre.set.empty());
}

TEST(StimulatorLink, NothingIsTakenTwiceChangedOrFromSomebodyElse) {
  Theatre theatre;
  StimulatorLink link(kCode);
  theatre.talk(link, 1, link.begin());
  const WireBytes good = *link.set({0, 1, 4, 0.1, false});
  theatre.talk(link, 1, good);
  ASSERT_EQ(theatre.set.size(), 1U);
  const std::vector<WireBytes> all = theatre.said_to_door;
  const auto hear = [&](std::uint64_t client, const WireBytes& b) {
    with(b, [&](const IgtlMessage& m) { static_cast<void>(theatre.endpoint.hear(client, m, theatre.at_s += 1)); });
  };
  hear(1, good);                              // once more
  for (const WireBytes& b : all) hear(2, b);  // all that was said, from another connection
  for (std::size_t at = IgtlParser::kHeader; at < good.size(); ++at) {
    // With a checksum that fits: the seal has to see it.
    WireBytes body(good.begin() + IgtlParser::kHeader, good.end());
    body[at - IgtlParser::kHeader] ^= 1;
    hear(1, igtl_message(kStimulatorType, "Stimulator", 0, body));
  }
  EXPECT_EQ(theatre.set.size(), 1U);
  theatre.endpoint.gone(1);
  hear(1, *link.set({0, 2, 4, 0.1, false}));
  EXPECT_EQ(theatre.set.size(), 1U);
}

TEST(StimulatorLink, WhateverComesNothingBreaksAndNothingIsSet) {
  Theatre theatre;
  StimulatorLink link(kCode);
  theatre.talk(link, 1, link.begin());
  theatre.talk(link, 1, *link.set({0, 1, 4, 0.1, false}));
  std::mt19937 dice(5);
  const auto below = [&](std::size_t n) { return static_cast<std::size_t>(dice()) % n; };
  const std::vector<WireBytes> heard = theatre.said_to_door;
  for (int i = 0; i < 20000; ++i) {
    Bytes body;
    if (i % 2 == 0) {
      body.resize(below(200));
      for (auto& x : body) x = static_cast<std::uint8_t>(dice());
      if (body.size() > 1 && i % 4 == 0) body[0] = 1, body[1] = static_cast<std::uint8_t>(below(9));
    } else {
      const WireBytes& b = heard[below(heard.size())];
      body.assign(b.begin() + IgtlParser::kHeader, b.end());
      body[below(body.size())] ^= static_cast<std::uint8_t>(1 + below(255));
      if (below(3) == 0) body.resize(below(body.size() + 1));
    }
    with(igtl_message(kStimulatorType, "x", 0, body), [&](const IgtlMessage& m) {
      static_cast<void>(theatre.endpoint.hear(1 + below(8), m, theatre.at_s += 0.01));
      static_cast<void>(link.hear(m));
    });
  }
  EXPECT_EQ(theatre.set.size(), 1U);
  // A flood in one moment: no more is looked at than in a second.
  const auto before = theatre.endpoint.counts().refused;
  for (int i = 0; i < 1000; ++i)
    with(link.begin(), [&](const IgtlMessage& m) { static_cast<void>(theatre.endpoint.hear(3, m, theatre.at_s)); });
  EXPECT_GE(theatre.endpoint.counts().refused - before, 1000U - 101U);
}

// Over the loopback, from a console to the endpoint behind an OpenIGTLink server; and one who does not have the code
// hears as before.
TEST(StimulatorLink, OverTheNetwork) {
  auto sink = make_sink({StreamTarget::Kind::igtl, "127.0.0.1:0", "", true});
  std::mutex mutex;
  std::vector<StimulatorSetting> set;
  const auto endpoint = std::make_shared<StimulatorEndpoint>(
      kCode,
      [&](const StimulatorSetting& s) {
        const std::lock_guard lock(mutex);
        set.push_back(s);
      },
      [] { return std::pair(StimulatorSetting{}, std::uint32_t{1}); });
  sink->let_stimulate(endpoint);
  sink->begin({{"oculi"}, 100});
  const std::string reported = sink->reported();
  const int port = std::stoi(reported.substr(reported.find("port ") + 5));
  const auto none = [](const WireMonitor&) { return std::vector<MonitorSink*>{}; };
  RemoteMonitor with_code({"127.0.0.1", port}, none, kCode), without({"127.0.0.1", port}, none),
      guesses({"127.0.0.1", port}, none, "AAAAAAAA");
  const auto soon = [](const std::function<bool()>& holds) {
    for (int i = 0; i < 3000 && !holds(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(10));
    return holds();
  };
  ASSERT_TRUE(soon([&] { return with_code.stimulator().paired; })) << with_code.trouble();
  ASSERT_TRUE(soon([&] { return !guesses.stimulator().refused.empty(); }));
  ASSERT_TRUE(soon([&] { return without.trouble().empty(); })) << without.trouble();
  EXPECT_NE(guesses.trouble().find("another"), std::string::npos);
  without.stimulate({0, 3, 4, 0.1, false});
  guesses.stimulate({0, 3, 4, 0.1, false});
  with_code.stimulate({0, 1.5, 4, 0.1, false});
  ASSERT_TRUE(soon([&] { return with_code.stimulator().now.current_ma == 1.5; }));
  // A search that has ended is heard of as an event.
  MonitorEvent e;
  e.kind = MonitorEventKind::threshold;
  e.ma = 0.4;
  sink->event(e, "threshold");
  ASSERT_TRUE(soon([&] { return with_code.stimulator().now.current_ma == 0; }));
  // One who floods its connection with what looks right, and one with what is no message at all: neither is in
  // anybody's way.
  const int flooder = connected_to(port), babbler = connected_to(port);
  WireBytes much;
  for (int i = 0; i < 2000; ++i) {
    const WireBytes m = igtl_message(kStimulatorType, "x", 0, WireBytes(100, static_cast<std::uint8_t>(i)));
    much.insert(much.end(), m.begin(), m.end());
  }
  EXPECT_EQ(::send(flooder, much.data(), much.size(), MSG_NOSIGNAL), static_cast<ssize_t>(much.size()));
  const WireBytes noise(100000, 0xa5);
  EXPECT_EQ(::send(babbler, noise.data(), noise.size(), MSG_NOSIGNAL), static_cast<ssize_t>(noise.size()));
  ASSERT_TRUE(soon([&] { return endpoint->counts().refused > 1000; }));
  with_code.stimulate({0, 2.5, 4, 0.1, false});
  ASSERT_TRUE(soon([&] { return with_code.stimulator().now.current_ma == 2.5; }));
  ::close(flooder);
  ::close(babbler);
  const std::lock_guard lock(mutex);
  ASSERT_GE(set.size(), 2U);
  EXPECT_EQ(set.front().current_ma, 1.5);
  EXPECT_EQ(set.back().current_ma, 2.5);
}

}  // namespace
}  // namespace osteo
