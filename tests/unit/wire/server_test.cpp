// Server, client, tracked hand and remote monitor, over the loopback.
#include "osteo/network/wire/server.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <thread>

#include "osteo/core/base/error.h"
#include "osteo/core/rt/loop.h"
#include "osteo/network/wire/client.h"
#include "osteo/network/wire/remote_monitor.h"
#include "osteo/network/wire/stream_feed.h"
#include "osteo/network/wire/tracked_hand.h"

namespace osteo {
namespace {

using namespace std::chrono_literals;

// Until it holds; a loaded machine may take its time.
bool soon(const std::function<bool()>& holds) {
  for (int i = 0; i < 3000; ++i) {
    if (holds()) return true;
    std::this_thread::sleep_for(10ms);
  }
  return false;
}

int connected_to(int port, int receive_bytes = 0) {
  const int fd = ::socket(AF_INET, SOCK_STREAM, 0);
  if (receive_bytes > 0) ::setsockopt(fd, SOL_SOCKET, SO_RCVBUF, &receive_bytes, sizeof receive_bytes);
  sockaddr_in a{};
  a.sin_family = AF_INET;
  a.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  a.sin_port = htons(static_cast<std::uint16_t>(port));
  EXPECT_EQ(::connect(fd, reinterpret_cast<sockaddr*>(&a), sizeof a), 0);
  return fd;
}

WireBytes notice(std::uint64_t dropped) {
  return igtl_status("x", 0, IgtlStatus::overflow, static_cast<std::int64_t>(dropped), "dropped", "");
}

TEST(WireAddress, PortAloneIsThisMachine) {
  EXPECT_EQ(wire_address("18944").host, "127.0.0.1");
  EXPECT_EQ(wire_address("18944").port, 18944);
  EXPECT_EQ(wire_address("[::1]:7").host, "::1");
  EXPECT_EQ(wire_address("a.example:7").host, "a.example");
  for (const char* const wrong : {"", "x", ":1", "1:", "1:99999", "1:-2", "1:2x"})
    EXPECT_THROW((void)wire_address(wrong), Error) << wrong;
  for (const char* const wrong : {"igtl", "igtl:", "lsl:1", "cerebus:1.2.3.4:5/9", "ftp:1", "igtl:x"})
    EXPECT_THROW((void)stream_targets(wrong), Error) << wrong;
  EXPECT_EQ(stream_targets("igtl:1, cerebus:127.0.0.1:51002/3.11,lsl").size(), 3u);
  EXPECT_TRUE(stream_targets("").empty());
}

TEST(WireServer, EveryClientGetsEverythingInOrder) {
  WireServer server({"127.0.0.1", 0}, notice);
  server.greet({igtl_string("hello", 0, "0")});
  constexpr int kMessages = 2000;
  std::array<std::vector<int>, 3> heard;
  {
    std::vector<std::unique_ptr<WireClient>> clients;
    std::array<std::atomic<int>, 3> counts{};
    for (std::size_t c = 0; c < 3; ++c)
      clients.push_back(
          std::make_unique<WireClient>(WireAddress{"127.0.0.1", server.port()}, 1 << 16, [&, c](const IgtlMessage& m) {
            heard[c].push_back(std::stoi(*igtl_string_in(m)));
            ++counts[c];
          }));
    ASSERT_TRUE(server.wait_for_clients(3, 30));
    for (int i = 1; i <= kMessages; ++i) server.send(igtl_string("n", 0, std::to_string(i)));
    EXPECT_TRUE(soon([&] { return counts[0] + counts[1] + counts[2] == 3 * (kMessages + 1); }));
  }
  for (const auto& h : heard) {
    ASSERT_EQ(h.size(), kMessages + 1u);
    for (int i = 0; i <= kMessages; ++i) EXPECT_EQ(h[static_cast<std::size_t>(i)], i);
  }
  EXPECT_EQ(server.counts().dropped, 0u);
  EXPECT_TRUE(soon([&] { return server.counts().clients == 0; }));
}

// One that takes nothing: its own messages are dropped and counted, it is told when it takes again; memory is bounded,
// others get all.
TEST(WireServer, WhoStallsLosesAloneAndIsTold) {
  WireServer server({"127.0.0.1", 0}, notice, 600);
  const int stalled = connected_to(server.port(), 4096);
  std::atomic<int> good{0};
  WireClient client({"127.0.0.1", server.port()}, 1 << 17, [&](const IgtlMessage&) { ++good; });
  ASSERT_TRUE(server.wait_for_clients(2, 30));
  const std::string big(60000, 'x');
  constexpr int kMessages = 300;  // 18 MB
  double longest_ms = 0;
  for (int i = 0; i < kMessages; ++i) {
    const std::int64_t before = monotonic_ns();
    server.send(igtl_string("n", 0, big));
    longest_ms = std::max(longest_ms, static_cast<double>(monotonic_ns() - before) / 1e6);
    ASSERT_TRUE(soon([&] { return good == i + 1; }));
  }
  RecordProperty("longest_send_ms", std::to_string(longest_ms));
  const std::uint64_t dropped = server.counts().dropped;
  EXPECT_GT(dropped, 100u);
  IgtlParser parser(1 << 17);
  std::uint64_t whole = 0;
  std::int64_t reported = 0;
  std::array<std::uint8_t, 65536> bytes;
  timeval patience{20, 0};
  ::setsockopt(stalled, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  while (reported == 0) {
    if (whole > 20) server.send(igtl_string("n", 0, "small"));
    const ssize_t n = ::recv(stalled, bytes.data(), bytes.size(), 0);
    ASSERT_GT(n, 0);
    ASSERT_TRUE(parser.feed({bytes.data(), static_cast<std::size_t>(n)}, [&](const IgtlMessage& m) {
      ++whole;
      if (m.type == "STATUS")
        for (std::size_t i = 0; i < 8; ++i) reported = reported << 8 | m.content[2 + i];
    }));
  }
  EXPECT_GE(static_cast<std::uint64_t>(reported), dropped);
  EXPECT_EQ(parser.damaged(), 0u);
  ::close(stalled);
}

TEST(WireServer, FloodsVanishingClientsAndTooManyOfThem) {
  WireServer server({"127.0.0.1", 0}, notice);
  std::atomic<bool> stop{false};
  const std::int64_t begin = monotonic_ns();
  std::thread flood([&] {
    const int fd = connected_to(server.port());
    const WireBytes noise(65536, 0xAB);
    while (!stop) {
      if (::send(fd, noise.data(), noise.size(), MSG_NOSIGNAL | MSG_DONTWAIT) < 0) std::this_thread::sleep_for(1ms);
    }
    ::close(fd);
  });
  std::atomic<int> good{0};
  WireClient client({"127.0.0.1", server.port()}, 1 << 16, [&](const IgtlMessage&) { ++good; });
  EXPECT_TRUE(server.wait_for_clients(2, 30));
  for (int i = 0; i < 50; ++i) {
    const int fd = connected_to(server.port());
    const linger at_once{1, 0};  // a reset
    ::setsockopt(fd, SOL_SOCKET, SO_LINGER, &at_once, sizeof at_once);
    server.send(igtl_string("n", 0, "x"));
    ::close(fd);
  }
  EXPECT_TRUE(soon([&] { return good == 50; }));
  std::this_thread::sleep_for(1500ms);
  const std::uint64_t heard = server.counts().heard;
  const double took_s = static_cast<double>(monotonic_ns() - begin) / 1e9;
  // A second's worth, and what one read takes beyond it, in each second that has begun.
  EXPECT_LE(static_cast<double>(heard), (took_s + 1) * (WireServer::kMaxHeard + 16384))
      << "it is read no faster than that";
  stop = true;
  flood.join();
  EXPECT_TRUE(soon([&] { return server.counts().clients == 1; }));
  std::vector<int> many;
  for (std::size_t i = 0; i < WireServer::kMaxClients + 2; ++i) many.push_back(connected_to(server.port()));
  EXPECT_TRUE(soon([&] { return server.counts().turned_away == 3; }));
  for (const int fd : many) ::close(fd);
}

TEST(WireServer, PortThatIsTaken) {
  WireServer first({"127.0.0.1", 0}, notice);
  EXPECT_THROW(WireServer({"127.0.0.1", first.port()}, notice), Error);
  EXPECT_THROW(WireServer({"192.0.2.7", 0}, notice), Error);  // no address of this machine
}

struct Tracker {
  WireServer server{{"127.0.0.1", 0}, notice};
  void says(const char* name, Vec3 ras_mm, double stretch = 1) {
    IgtlPose p{{}, ras_mm};
    p.axes.column[0] = p.axes.column[0] * stretch;
    server.send(igtl_transform(name, 0, p));
  }
};

TEST(TrackedHand, GoesWhereTheTrackerSaysAndRestsWhenItIsSilent) {
  Tracker tracker;
  const std::string at = "127.0.0.1:" + std::to_string(tracker.server.port());
  auto link = std::make_shared<TrackedLink>(tracker_address(at + "/Drill"));
  HandGoal start;
  start.tool = 3;
  TrackedHand hand(link, start, nullptr);
  ASSERT_TRUE(tracker.server.wait_for_clients(1, 30));
  EXPECT_TRUE(soon([&] { return !hand.trouble().empty(); }));
  DeviceSample s = hand.read(0, 0.001, {});
  EXPECT_GT(s.age_ms, 0);
  // Others' tools, and matrices that are none, move nothing.
  tracker.says("Probe", {50, 50, 50});
  tracker.says("Drill", {50, 50, 50}, 1.5);
  ASSERT_TRUE(soon([&] { return link->refused() == 1; }));
  EXPECT_EQ(link->poses(), 0u);
  // RAS to LPS; at once where it first is.
  tracker.says("Drill", {-10, -20, 30});
  tracker.server.send(igtl_sensor("DrillPedal", 0, 0, std::array{0.5}));
  ASSERT_TRUE(soon([&] {
    TrackedLink::State state;
    return link->latest(state) && state.pedal_ns != 0;
  }));
  // Sent again and again, as trackers do, until it is heard in time on a loaded machine.
  ASSERT_TRUE(soon([&] {
    tracker.says("Drill", {-10, -20, 30});
    tracker.server.send(igtl_sensor("DrillPedal", 0, 0, std::array{0.5}));
    s = hand.read(1, 0.001, {});
    return s.age_ms == 0 && s.pedal == 128;
  }));
  EXPECT_NEAR(static_cast<double>(s.position_mm[0]), 10, 1e-3);
  EXPECT_NEAR(static_cast<double>(s.position_mm[1]), 20, 1e-3);
  EXPECT_NEAR(static_cast<double>(s.position_mm[2]), 30, 1e-3);
  EXPECT_EQ(s.tool, 3);
  // Silence: it rests, the pedal is up, the age rises, and it is told.
  ASSERT_TRUE(soon([&] {
    s = hand.read(2, 0.001, {});
    return s.age_ms > 100;
  }));
  EXPECT_EQ(s.pedal, 0);
  EXPECT_NEAR(static_cast<double>(s.position_mm[0]), 10, 0.01);
  ASSERT_TRUE(soon([&] { return hand.trouble().find("out of sight") != std::string::npos; }));
  // In sight again somewhere else: it goes there by its spring, and the pedal counts only there.
  bool early = false;
  ASSERT_TRUE(soon([&] {
    tracker.says("Drill", {-60, -20, 30});
    tracker.server.send(igtl_sensor("DrillPedal", 0, 0, std::array{1.0}));
    for (int i = 0; i < 10; ++i) s = hand.read(3, 0.001, {});
    const double away = std::abs(static_cast<double>(s.position_mm[0]) - 60);
    early = early || (s.pedal > 0 && away > 2 * TrackedHand::kTakesHoldMm && s.age_ms == 0);
    return away < 0.1 && s.pedal == 255;
  }));
  EXPECT_FALSE(early);
}

TEST(TrackedHand, AddressesOfTrackers) {
  EXPECT_EQ(tracker_address("localhost:18944/Drill").tool, "Drill");
  EXPECT_EQ(tracker_address("localhost:18944").tool, "");
  for (const char* const wrong : {"", "x", "h:0", "h:1/abcdefghijklmnopqrstuvw"})
    EXPECT_THROW((void)tracker_address(wrong), Error) << wrong;
}

// A tracker that says something else than OpenIGTLink, and one that floods: told, and the hand is as without one.
TEST(TrackedHand, LiarsAndFloods) {
  Tracker tracker;
  auto link = std::make_shared<TrackedLink>(tracker_address("127.0.0.1:" + std::to_string(tracker.server.port())));
  ASSERT_TRUE(tracker.server.wait_for_clients(1, 30));
  tracker.server.send(WireBytes(1000, 'G'));
  ASSERT_TRUE(soon([&] { return tracker.server.counts().accepted >= 2; })) << "it connects again";
  for (int i = 0; i < 20000; ++i) tracker.says("T", {1, 2, static_cast<double>(i % 50)});
  ASSERT_TRUE(soon([&] { return link->poses() > 1000; }));
}

class Kept final : public MonitorSink {
 public:
  void block(const MonitorBlock& b) override { values.insert(values.end(), b.values.begin(), b.values.end()); }
  void event(const MonitorEvent& e) override { events.push_back(e); }
  std::vector<std::int16_t> values;
  std::vector<MonitorEvent> events;
};

// What a feed tells is what a console far away shows: every sample, every event but those that nobody can know.
TEST(RemoteMonitor, HasEverySampleAndEvent) {
  auto sink = make_sink({StreamTarget::Kind::igtl, "127.0.0.1:0", ""});
  sink->begin({{"oculi", "oris"}, 100});
  const std::string reported = sink->reported();
  const int port = std::stoi(reported.substr(reported.find("port ") + 5));
  Kept kept;
  std::atomic<int> begun{0};
  RemoteMonitor remote({"127.0.0.1", port}, [&](const WireMonitor& m) {
    EXPECT_EQ(m.labels, (std::vector<std::string>{"oculi", "oris"}));
    ++begun;
    return std::vector<MonitorSink*>{&kept};
  });
  ASSERT_TRUE(sink->wait(1, 30, {}));
  std::vector<std::int16_t> sent;
  for (int block = 0; block < 200; ++block) {
    std::vector<std::int16_t> values(300);
    for (std::size_t i = 0; i < values.size(); ++i)
      values[i] = static_cast<std::int16_t>(block * 300 + static_cast<int>(i));
    const std::uint64_t first =
        static_cast<std::uint64_t>(block) * 150 + (block >= 100 ? 600 : 0);  // 20 ms are missing
    sink->block({first, 2, values});
    sent.insert(sent.end(), values.begin(), values.end());
  }
  MonitorEvent e;
  e.kind = MonitorEventKind::response;
  e.sample = 12345;
  e.channel = 1;
  e.uv = 250.5;
  e.ms = 5.25;
  e.ma = 0.5;
  sink->event(e, "response, oris");
  e.kind = MonitorEventKind::cause;
  EXPECT_EQ(event_json(e, ""), "");
  sink->end(1, "{}");
  ASSERT_TRUE(soon([&] { return remote.ended(); }));
  EXPECT_EQ(kept.values, sent);
  EXPECT_EQ(remote.samples(), 30000u);
  EXPECT_EQ(remote.lost(), 600u);
  ASSERT_EQ(kept.events.size(), 2u);
  EXPECT_EQ(kept.events[0].kind, MonitorEventKind::lost);
  EXPECT_NEAR(kept.events[0].seconds, 0.02, 1e-9);
  EXPECT_EQ(kept.events[1].kind, MonitorEventKind::response);
  EXPECT_EQ(kept.events[1].sample, 12345u);
  EXPECT_EQ(kept.events[1].channel, 1);
  EXPECT_EQ(kept.events[1].uv, 250.5);
  EXPECT_EQ(begun, 1);
  // Another session of the same server begins before what was heard: nothing is lost, and it is shown again.
  const std::vector<std::int16_t> two{1, 2};
  sink->block({0, 2, two});
  ASSERT_TRUE(soon([&] { return begun == 2; }));
  ASSERT_TRUE(soon([&] { return remote.samples() == 30001; }));
  EXPECT_EQ(remote.lost(), 600u);
}

TEST(RemoteMonitor, LiesInTextsAreNothing) {
  for (const char* const wrong :
       {"", "[]", "{}", "{\"event\":\"cause\",\"sample\":1}", "{\"event\":\"burst\"}",
        "{\"event\":\"burst\",\"sample\":-1}", "{\"event\":7,\"sample\":1}", "{\"event\":\"burst\",\"sample\":\"x\"}"})
    EXPECT_FALSE(event_in(wrong)) << wrong;
  for (const char* const wrong :
       {"", "{}", "{\"osteotome_wire\":2,\"rate_hz\":30000,\"uv_per_bit\":0.25,\"event_uv\":100,\"channels\":[]}",
        "{\"osteotome_wire\":1,\"rate_hz\":30000,\"uv_per_bit\":0.25,\"event_uv\":-1,\"channels\":[]}",
        "{\"osteotome_wire\":1,\"rate_hz\":30000,\"uv_per_bit\":0.25,\"event_uv\":100,\"channels\":[1]}"})
    EXPECT_FALSE(monitor_in(wrong)) << wrong;
  EXPECT_TRUE(monitor_in(monitor_json({{"a"}, 100})));
  EXPECT_FALSE(monitor_in(monitor_json({std::vector<std::string>(17, "a"), 100})));
  for (const char* const wrong :
       {"", "{}", "{\"eye_mm\":[1,2],\"target_mm\":[0,0,0]}", "{\"eye_mm\":[0,0,0],\"target_mm\":[0,0,0]}"})
    EXPECT_FALSE(camera_in_note(wrong)) << wrong;
}

}  // namespace
}  // namespace osteo
