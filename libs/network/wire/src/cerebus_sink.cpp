// Packets as Blackrock's signal processors send them: sample groups, spikes, and enough of the configuration to be
// understood.
#include <algorithm>
#include <bit>

#include "osteo/network/tutor/udp.h"
#include "wire_sinks.h"

namespace osteo::inline network {
namespace {

constexpr std::uint16_t kConfiguration = 0x8000;
constexpr std::uint16_t kSystem = 0x10, kGroup = 0x30;  // replies
constexpr std::uint16_t kRawGroup = 6;                  // 30 kHz
constexpr std::uint32_t kRunning = 50;
constexpr std::size_t kDatagram = 1400;  // of a usual path, whole packets in it
constexpr std::uint64_t kConfigEvery = MonitorSetup::kRateHz / 4;

// Little endian.
class Packet {
 public:
  template <class T>
  void number(T x) {
    for (std::size_t i = 0; i < sizeof(T); ++i)
      bytes.push_back(static_cast<std::uint8_t>(static_cast<std::uint64_t>(x) >> 8 * i & 0xff));
  }
  void real(float x) { number(std::bit_cast<std::uint32_t>(x)); }
  void text(std::string_view t, std::size_t length) {
    for (std::size_t i = 0; i < length; ++i) bytes.push_back(i < t.size() ? static_cast<std::uint8_t>(t[i]) : 0);
  }
  WireBytes bytes;
};

// Of IPv4, as it stands in an address of IPv6 (::ffff:127.x.x.x).
bool is_loopback(const UdpPeer& p) {
  return p.address[10] == 0xff && p.address[11] == 0xff && p.address[12] == 127;
}

// Times are samples of 30 kHz from the session's beginning (the system says so: its clock is 30,000 Hz). What the
// system cannot send at once is lost, and counted; a stream of packets has no listeners to know of.
class CerebusSink final : public WireSink {
 public:
  explicit CerebusSink(const StreamTarget& target)
      : peer_(udp_peer(target.address)), socket_(is_loopback(peer_) ? "127.0.0.1" : "", 0), version_(target.version) {
    datagram_.reserve(kDatagram);
  }

  void begin(const WireMonitor& monitor) override {
    channels_ = monitor.labels.size();
    configure(0);
  }
  void block(const MonitorBlock& b) override {
    if (b.channels == 0) return;
    if (b.first_sample >= next_config_) configure(b.first_sample);
    Packet body;
    for (std::size_t i = 0; i < b.samples(); ++i) {
      body.bytes.clear();
      for (std::size_t ch = 0; ch < b.channels; ++ch)
        body.number(static_cast<std::uint16_t>(b.values[i * b.channels + ch]));
      add(b.first_sample + i, 0, kRawGroup, body.bytes);
      ++samples_;
    }
    send();
  }
  void spike(const MonitorSpike& s) override {
    Packet body;
    for (int i = 0; i < 3; ++i) body.real(0);  // no sorting
    const auto [least, most] = std::minmax_element(s.wave.begin(), s.wave.end());
    body.number(static_cast<std::uint16_t>(*most));
    body.number(static_cast<std::uint16_t>(*least));
    for (const std::int16_t v : s.wave) body.number(static_cast<std::uint16_t>(v));
    add(s.sample, static_cast<std::uint16_t>(s.channel + 1), 0, body.bytes);
    send();
    ++spikes_;
  }
  [[nodiscard]] std::string reported() const override {
    return "Cerebus " + version_ + " to " + udp_name(peer_) + ": " + std::to_string(samples_) + " samples of " +
           std::to_string(channels_) + " channels, " + std::to_string(spikes_) + " spikes; " +
           std::to_string(dropped_) + " datagrams could not be sent";
  }
  [[nodiscard]] std::uint64_t dropped() const override { return dropped_; }

 private:
  void add(std::uint64_t time, std::uint16_t channel, std::uint16_t type, std::span<const std::uint8_t> body) {
    const std::size_t words = (body.size() + 3) / 4;
    Packet head;
    if (version_ == "3.11") {
      head.number(static_cast<std::uint32_t>(time));
      head.number(channel);
      head.number(static_cast<std::uint8_t>(type));
      head.number(static_cast<std::uint8_t>(words));
    } else {
      head.number(time);
      head.number(channel);
      if (version_ == "4.0") {
        head.number(static_cast<std::uint8_t>(type));
        head.number(static_cast<std::uint16_t>(words));
        head.number(std::uint8_t{0});  // instrument
        head.number(std::uint16_t{0});
      } else {
        head.number(type);
        head.number(static_cast<std::uint16_t>(words));
        head.number(std::uint16_t{0});  // instrument, reserved
      }
    }
    if (datagram_.size() + head.bytes.size() + 4 * words > kDatagram) send();
    datagram_.insert(datagram_.end(), head.bytes.begin(), head.bytes.end());
    datagram_.insert(datagram_.end(), body.begin(), body.end());
    datagram_.resize(datagram_.size() + 4 * words - body.size());
  }
  void send() {
    if (datagram_.empty()) return;
    if (!socket_.send(peer_, datagram_)) ++dropped_;
    datagram_.clear();
  }
  // Again four times a second: whoever begins to listen understands soon what there is.
  void configure(std::uint64_t time) {
    next_config_ = time + kConfigEvery;
    Packet system;
    for (const std::uint32_t x : {std::uint32_t{MonitorSetup::kRateHz}, std::uint32_t{MonitorSpike::kLength},
                                  std::uint32_t{MonitorSpike::kBefore}, std::uint32_t{0}, kRunning, std::uint32_t{0}})
      system.number(x);
    if (version_ == "4.2") system.number(std::uint32_t{0});  // transport
    add(time, kConfiguration, kSystem, system.bytes);
    Packet group;
    group.number(std::uint32_t{1});  // processor
    group.number(std::uint32_t{kRawGroup});
    group.text("nerve monitor", 16);
    group.number(std::uint32_t{1});  // period, in samples
    group.number(static_cast<std::uint32_t>(channels_));
    for (std::size_t ch = 0; ch < channels_; ++ch) group.number(static_cast<std::uint16_t>(ch + 1));
    add(time, kConfiguration, kGroup, group.bytes);
    send();
  }

  UdpPeer peer_;
  UdpSocket socket_;
  std::string version_;
  std::size_t channels_ = 0;
  WireBytes datagram_;
  std::uint64_t next_config_ = 0, samples_ = 0, spikes_ = 0, dropped_ = 0;
};

}  // namespace

std::unique_ptr<WireSink> make_cerebus_sink(const StreamTarget& target) {
  return std::make_unique<CerebusSink>(target);
}

}  // namespace osteo::inline network
