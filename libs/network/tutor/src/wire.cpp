#include "osteo/network/tutor/wire.h"

#include <bit>
#include <cstring>
#include <type_traits>

namespace osteo::inline network {
namespace {

static_assert(std::endian::native == std::endian::little, "packets are little endian");
constexpr std::uint8_t kHand = 1, kLog = 2, kBlob = 3;

class PacketWriter {
 public:
  explicit PacketWriter(std::uint8_t kind) {
    put(kind);
    put(kTutorProtocol);
  }
  template <class T>
  void put(const T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    const auto* const from = reinterpret_cast<const std::uint8_t*>(&value);
    bytes.insert(bytes.end(), from, from + sizeof value);
  }
  void put(const WireTimes& t) {
    put(t.sent_us);
    put(t.echo_us);
    put(t.held_us);
  }
  void put(const BoneMark& m) {
    put(m.tick);
    put(m.hash);
  }
  Bytes bytes;
};

class PacketReader {
 public:
  PacketReader(std::span<const std::uint8_t> bytes, std::uint8_t kind) : left_(bytes) {
    good_ = bytes.size() <= kMaxPacketBytes && take<std::uint8_t>() == kind && take<std::uint8_t>() == kTutorProtocol;
  }
  template <class T>
  T take() {
    T value{};
    if (left_.size() < sizeof value) {
      good_ = false;
      left_ = {};
      return value;
    }
    std::memcpy(&value, left_.data(), sizeof value);
    left_ = left_.subspan(sizeof value);
    return value;
  }
  WireTimes times() {
    WireTimes t;
    t.sent_us = take<std::int64_t>();
    t.echo_us = take<std::int64_t>();
    t.held_us = take<std::int64_t>();
    return t;
  }
  BoneMark mark() {
    BoneMark m;
    m.tick = take<std::uint64_t>();
    m.hash = take<std::uint64_t>();
    return m;
  }
  template <class T>
  std::vector<T> list(std::size_t n, std::size_t most) {
    std::vector<T> all;
    if (n > most || left_.size() < n * sizeof(T)) {
      good_ = false;
      return all;
    }
    for (std::size_t i = 0; i < n; ++i) all.push_back(take<T>());
    return all;
  }
  [[nodiscard]] std::span<const std::uint8_t> rest() const { return left_; }
  void need(bool condition) { good_ = good_ && condition; }
  [[nodiscard]] bool good() const { return good_; }
  [[nodiscard]] bool whole() const { return good_ && left_.empty(); }

 private:
  std::span<const std::uint8_t> left_;
  bool good_ = false;
};

}  // namespace

Bytes encode(const HandPacket& p) {
  PacketWriter w(kHand);
  w.put(p.times);
  w.put(p.next_tick);
  w.put(p.blob_bytes);
  w.put(static_cast<std::uint8_t>(p.ready ? 1 : 0));
  w.put(p.mark);
  w.put(p.newest);
  w.put(static_cast<std::uint8_t>(p.samples.size()));
  for (const DeviceSample& s : p.samples) w.put(s);
  return std::move(w.bytes);
}

Bytes encode(const LogPacket& p) {
  PacketWriter w(kLog);
  w.put(p.times);
  w.put(p.session);
  w.put(p.first_tick);
  w.put(p.now_tick);
  w.put(static_cast<std::uint8_t>(p.state));
  w.put(p.mark);
  w.put(p.hands);
  w.put(static_cast<std::uint8_t>(p.hands > 0 ? p.samples.size() / p.hands : 0));
  w.put(static_cast<std::uint8_t>(p.actions.size()));
  for (const DeviceSample& s : p.samples) w.put(s);
  for (const SceneAction& a : p.actions) w.put(a);
  return std::move(w.bytes);
}

Bytes encode(const BlobPacket& p) {
  PacketWriter w(kBlob);
  w.put(p.times);
  w.put(p.session);
  w.put(p.total);
  w.put(p.offset);
  w.bytes.insert(w.bytes.end(), p.bytes.begin(), p.bytes.end());
  return std::move(w.bytes);
}

std::optional<HandPacket> decode_hand(std::span<const std::uint8_t> bytes) {
  PacketReader r(bytes, kHand);
  if (!r.good()) return std::nullopt;
  HandPacket p;
  p.times = r.times();
  p.next_tick = r.take<std::uint64_t>();
  p.blob_bytes = r.take<std::uint32_t>();
  p.ready = r.take<std::uint8_t>() != 0;
  p.mark = r.mark();
  p.newest = r.take<std::uint64_t>();
  const auto count = r.take<std::uint8_t>();
  p.samples = r.list<DeviceSample>(count, HandPacket::kMax);
  if (count > 0) r.need(p.newest + 1 >= count);
  if (!r.whole()) return std::nullopt;
  return p;
}

std::optional<LogPacket> decode_log(std::span<const std::uint8_t> bytes) {
  PacketReader r(bytes, kLog);
  if (!r.good()) return std::nullopt;
  LogPacket p;
  p.times = r.times();
  p.session = r.take<std::uint64_t>();
  p.first_tick = r.take<std::uint64_t>();
  p.now_tick = r.take<std::uint64_t>();
  p.state = static_cast<LogState>(r.take<std::uint8_t>());
  p.mark = r.mark();
  p.hands = r.take<std::uint8_t>();
  const auto ticks = r.take<std::uint8_t>(), actions = r.take<std::uint8_t>();
  r.need(p.hands >= 1 && p.hands <= kMaxHands && ticks <= LogPacket::kMaxTicks && p.state <= LogState::lost);
  if (!r.good()) return std::nullopt;
  p.samples = r.list<DeviceSample>(std::size_t{ticks} * p.hands, LogPacket::kMaxTicks * kMaxHands);
  p.actions = r.list<SceneAction>(actions, LogPacket::kMaxActions);
  const std::uint64_t behind = p.first_tick + ticks + (p.state == LogState::over ? 1 : 0);
  for (const SceneAction& a : p.actions)
    r.need(a.tick >= p.first_tick && a.tick < behind && find_row(a.kind) != nullptr);
  if (!r.whole() || p.first_tick + ticks < p.first_tick) return std::nullopt;
  return p;
}

std::optional<BlobPacket> decode_blob(std::span<const std::uint8_t> bytes) {
  PacketReader r(bytes, kBlob);
  if (!r.good()) return std::nullopt;
  BlobPacket p;
  p.times = r.times();
  p.session = r.take<std::uint64_t>();
  p.total = r.take<std::uint32_t>();
  p.offset = r.take<std::uint32_t>();
  r.need(p.total <= BlobPacket::kMaxTotal && p.offset <= p.total && r.rest().size() <= BlobPacket::kMax &&
         r.rest().size() <= p.total - p.offset);
  if (!r.good()) return std::nullopt;
  p.bytes.assign(r.rest().begin(), r.rest().end());
  return p;
}

}  // namespace osteo::inline network
