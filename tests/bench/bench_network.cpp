// What a session costs that is told to the network, and what the servo feels of who floods its listeners. Tables of
// docs/how-to/network.md.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <optional>
#include <thread>

#include "bench.h"
#include "ear.h"
#include "flood.h"
#include "osteo/core/base/error.h"
#include "osteo/network/wire/rehearsal_stream.h"
#include "osteo/session/recording/script.h"

namespace osteo {
namespace {

// Listed: nothing; heat, a nerve monitor and the network, which nobody disturbs; one of its listeners flooded.
enum class Listed { nothing, all, igtl, cerebus, lsl };

struct Socket {
  int fd = ::socket(AF_INET, SOCK_DGRAM, 0), port = 0;
  Socket() {
    sockaddr_in a{};
    a.sin_family = AF_INET;
    a.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    static_cast<void>(::bind(fd, reinterpret_cast<const sockaddr*>(&a), sizeof a));
    socklen_t size = sizeof a;
    ::getsockname(fd, reinterpret_cast<sockaddr*>(&a), &size);
    port = ntohs(a.sin_port);
  }
  ~Socket() { ::close(fd); }
  // Of the first packet that comes: where it is from.
  [[nodiscard]] int sender() const {
    sockaddr_in from{};
    socklen_t size = sizeof from;
    char byte = 0;
    ::recvfrom(fd, &byte, 1, 0, reinterpret_cast<sockaddr*>(&from), &size);
    return ntohs(from.sin_port);
  }
};

int port_in(const std::string& reported) {
  return std::stoi(reported.substr(reported.find("port ") + 5));
}

// False: there is no liblsl.
bool row(Listed listed, double seconds) {
  const HeadAnatomy head;
  test::Ear ear = test::ear(head, 0.5);
  RehearsalOptions o;
  o.follow.surface = false;
  o.follow.heat = listed != Listed::nothing;
  o.haptics.device = SpringHand::traits();
  o.anatomy.structures = std::make_shared<const StructureMap>(ear.labels);
  Script s;
  s.tool = burr_index(BurrKind::cutting, 3);
  s.waypoints = {{0, {62, 9.5, -33.5}, true}, {seconds / 2, {50, 9.5, -33.5}, true}, {seconds, {48, 12, -33.5}, true}};
  const double before = bench::resident_mb();
  Rehearsal r(World(std::move(ear.bone)), devices_of(s, 1000), o, {});
  std::optional<RehearsalStream> stream;
  const Socket listener;
  if (listed != Listed::nothing) {
    std::string to = "igtl:127.0.0.1:0/stimulator,cerebus:127.0.0.1:" + std::to_string(listener.port) + "/4.1";
    if (listed == Listed::lsl) to += ",lsl";
    try {
      stream.emplace(r, stream_targets(to), nullptr, monitor_options_of(""));
    } catch (const Error& e) {
      std::printf("(%s)\n", e.what());
      return false;
    }
  }
  std::vector<bench::Bytes> kinds;
  for (int i = 0; i < 64; ++i) {
    bench::Bytes b(i % 4 == 3 ? 1200 : 200);
    for (std::size_t k = 0; k < b.size(); ++k)
      b[k] = static_cast<std::uint8_t>(k * 31 + static_cast<std::size_t>(i) * 7);
    b[0] = 1;
    b[1] = static_cast<std::uint8_t>(1 + i % 6);  // bodies of forged pairings and settings, and none
    kinds.push_back(
        listed == Listed::igtl && i % 4 != 2 ? igtl_message(i % 4 == 1 ? "TRANSFORM" : kStimulatorType, "x", 0, b) : b);
  }
  std::optional<bench::Crowd> crowd;
  std::optional<bench::Flood> flood;
  r.start();
  constexpr double kRate = 100'000;
  if (listed == Listed::igtl) crowd.emplace(port_in(stream->feed().reported().front()), 8, kRate, kinds);
  if (listed == Listed::cerebus) flood.emplace(listener.sender(), kRate, kinds);
  if (listed == Listed::lsl) flood.emplace(16572, kRate, kinds);
  while (r.running()) std::this_thread::sleep_for(std::chrono::milliseconds(20));
  const std::uint64_t sent = crowd ? crowd->sent() : flood ? flood->sent() : 0, taken = crowd ? crowd->taken() : 0;
  const double grown = bench::resident_mb() - before;
  crowd.reset();
  flood.reset();
  const RehearsalSummary sum = r.stop();
  const std::uint64_t refused = stream ? stream->endpoint()->counts().refused : 0,
                      set = stream ? stream->endpoint()->counts().settings : 0;
  const char* const names[] = {"nothing listed", "heat, monitor, network", "OpenIGTLink flooded",
                               "Cerebus' sender flooded", "LSL flooded"};
  std::printf("| %s | %.0f | %.0f, %.0f, %.0f | %.2f, %.1f | %.1f MB | %.1f MB | %llu | %llu |\n",
              names[static_cast<int>(listed)], static_cast<double>(sent) / seconds, sum.loop->lateness.quantile_us(0.5),
              sum.loop->lateness.quantile_us(0.99), sum.loop->lateness.quantile_us(0.999),
              sum.loop->work.quantile_us(0.5), sum.loop->work.quantile_us(0.999), grown,
              static_cast<double>(taken) / 1e6, static_cast<unsigned long long>(refused),
              static_cast<unsigned long long>(set));
  std::fflush(stdout);
  return true;
}

}  // namespace

void bench_network(const Context&) {
  std::printf(
      "\n## Who listens to the network, flooded\n\nDrilling towards the facial nerve, ten seconds in real time each, "
      "in turns.\n\n"
      "| listed | packets/s | servo late p50, p99, p99.9 us | work p50, p99.9 us | memory | taken in | refused | "
      "settings |\n"
      "|---|---|---|---|---|---|---|---|\n");
  bool lsl = true;
  for (int round = 0; round < 3; ++round) {
    for (const Listed l : {Listed::nothing, Listed::all, Listed::igtl, Listed::cerebus}) static_cast<void>(row(l, 10));
    lsl = lsl && row(Listed::lsl, 10);
  }
}

}  // namespace osteo
