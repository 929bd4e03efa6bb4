#include <algorithm>
#include <cstring>
#include <iterator>

#include "handshake.h"
#include "osteo/network/tutor/live.h"

namespace osteo::inline network {
namespace {

constexpr std::int64_t kSendEveryUs = 4000, kGoneUs = 10'000'000;
// Of seats: who is silent for so long may lose his; who is heard so long after another has asked is there, and no
// packet of before is late; and how long watchers wait for a trainee that was there within the last minute.
constexpr std::int64_t kSilentUs = 1'000'000, kSurelyUs = 200'000, kTraineeFirstUs = 2'000'000,
                       kTraineeAwaitedUs = 60'000'000;
constexpr std::uint64_t kWindowTicks = 4096;  // on their way to one who catches up
constexpr std::size_t kMaxOnWay = 4096;       // packets, of one who says that it gets none
constexpr std::uint64_t kOverlap = 8;         // of the newest ticks, sent again with each packet
constexpr int kPacketsAPoll = 16;
constexpr std::size_t kWindowBytes = 256 << 10;  // of settings, on their way

std::uint64_t random_number() {
  const Pairing::Nonce nonce = Pairing::make_nonce();
  std::uint64_t n = 0;
  std::memcpy(&n, nonce.data(), sizeof n);
  return n | 1;  // 0: none
}

}  // namespace

LiveHost::LiveHost(std::string_view tidy_code, Bytes settings, std::size_t hands, std::shared_ptr<FarDevice> far)
    : pairing_(tidy_code),
      settings_(std::move(settings)),
      hands_(hands),
      far_(std::move(far)),
      session_(random_number()) {}

void LiveHost::action(const SceneAction& action) {
  const std::lock_guard lock(mutex_);
  actions_.push_back(action);
}

void LiveHost::tick(const TickRecord& record, std::span<const VoxelChange> changes) {
  const std::lock_guard lock(mutex_);
  if (state_ == LogState::lost) return;
  if (record.tick * hands_ + record.hand != log_.size() || record.tick >= kMaxTicks) {
    // Ticks were dropped before they came here; or there is no more room for a lesson of half an hour.
    state_ = LogState::lost;
    return;
  }
  log_.push_back(record.device);
  hash_ = mixed(hash_, record.tick, changes);
  if (record.hand + 1 == hands_ && (record.tick + 1) % kMarkTicks == 0) {
    marks_[record.tick + 1] = hash_;
    if (marks_.size() > 64) marks_.erase(marks_.begin());
  }
}

BoneMark LiveHost::mark() const {
  const std::lock_guard lock(mutex_);
  return {log_.size() / hands_, hash_};
}

void LiveHost::over(std::uint64_t ticks) {
  const std::lock_guard lock(mutex_);
  if (state_ == LogState::runs) state_ = log_.size() == ticks * hands_ ? LogState::over : LogState::lost;
}

bool LiveHost::lost() const {
  const std::lock_guard lock(mutex_);
  return state_ == LogState::lost;
}

bool LiveHost::waited_for(std::int64_t now_us) const {
  const std::lock_guard lock(mutex_);
  return std::any_of(peers_.begin(), peers_.end(), [&](const auto& p) {
    return p->next_tick < log_.size() / hands_ && now_us - p->last_heard_us <= kGoneUs;
  });
}

int LiveHost::tries_left() const {
  const std::lock_guard lock(mutex_);
  return pairing_.tries_left();
}

std::uint64_t LiveHost::refused() const {
  const std::lock_guard lock(mutex_);
  return refused_ + pairing_.refused();
}

std::vector<PeerStatus> LiveHost::status(std::int64_t now_us) const {
  const std::lock_guard lock(mutex_);
  std::vector<PeerStatus> all;
  for (const auto& p : peers_) {
    const std::uint64_t ticks = log_.size() / hands_;
    all.push_back({p->role, p->clock.rtt_ms(), p->clock.offset_ms(), p->clock.drift_ppm(), p->channel->lost(),
                   now_us - p->last_heard_us < 1'000'000, p->ready, ticks - std::min(ticks, p->next_tick), p->differs,
                   p->same});
  }
  return all;
}

PairingSeats::Answer LiveHost::seat(const UdpPeer& from, JoinRole role, std::int64_t proved_us, std::int64_t now_us) {
  const auto silent = [&](const Peer& p) { return now_us - p.last_heard_us > kSilentUs; };
  const auto surely_there = [&](const Peer& p) { return p.last_heard_us > proved_us + kSurelyUs; };
  if (role == JoinRole::watcher && trainee_heard_us_) {
    const std::int64_t gone_for = now_us - *trainee_heard_us_;
    if (gone_for > kSilentUs && gone_for < kTraineeAwaitedUs && now_us - proved_us < kTraineeFirstUs)
      return Answer::wait;
  }
  std::size_t others = 0, sure = 0;
  for (const auto& p : peers_) {
    if (p->from == from || silent(*p)) continue;
    if (role == JoinRole::trainee && p->role == JoinRole::trainee)
      return surely_there(*p) ? Answer::taken : Answer::wait;
    ++others;
    sure += surely_there(*p) ? 1 : 0;
  }
  if (others < kMaxPeers) return Answer::free;
  return sure < kMaxPeers ? Answer::wait : Answer::taken;
}

std::uint32_t LiveHost::take(const UdpPeer& from, JoinRole role, const PairKeys& keys, std::int64_t now_us) {
  std::erase_if(peers_, [&](const auto& p) {
    return p->from == from || (role == JoinRole::trainee && p->role == JoinRole::trainee);
  });
  if (peers_.size() >= kMaxPeers) {
    peers_.erase(std::min_element(peers_.begin(), peers_.end(),
                                  [](const auto& a, const auto& b) { return a->last_heard_us < b->last_heard_us; }));
  }
  auto peer = std::make_unique<Peer>();
  peer->from = from;
  peer->role = role;
  const std::uint32_t connection = next_connection_++;
  peer->channel = std::make_unique<SecureChannel>(connection, keys.to_guest, keys.to_host);
  peer->last_heard_us = now_us;
  if (role == JoinRole::trainee) trainee_heard_us_ = now_us;
  peers_.push_back(std::move(peer));
  return connection;
}

void LiveHost::receive(const UdpPeer& from, std::span<const std::uint8_t> packet, std::int64_t now_us) {
  const std::lock_guard lock(mutex_);
  if (packet.size() >= 4 && std::all_of(packet.begin(), packet.begin() + 4, [](std::uint8_t b) { return b == 0; })) {
    if (auto answer = pairing_.receive(from, packet, now_us, *this)) out_.push_back({from, std::move(*answer)});
    return;
  }
  for (const auto& p : peers_) {
    if (p->from != from) continue;
    const auto plain = p->channel->open(packet);
    if (!plain) break;
    const auto said = decode_hand(*plain);
    if (!said) break;
    return hear(*p, *said, now_us);
  }
  ++refused_;
}

void LiveHost::hear(Peer& peer, const HandPacket& p, std::int64_t now_us) {
  peer.last_heard_us = now_us;
  if (peer.role == JoinRole::trainee) trainee_heard_us_ = now_us;
  peer.clock.heard(p.times, now_us);
  // A packet that a later one has overtaken says how far the copy was, not how far it is: its samples alone count.
  if (p.times.sent_us >= peer.told_us) {
    peer.told_us = p.times.sent_us;
    hear_progress(peer, p, now_us);
  }
  if (peer.role != JoinRole::trainee || p.samples.empty()) return;
  const std::uint64_t first = p.newest + 1 - p.samples.size();
  const bool newest = p.newest > peer.newest_hand;
  for (std::size_t i = 0; i < p.samples.size(); ++i)
    far_->put({first + i, p.samples[i]}, newest && i + 1 == p.samples.size());
  peer.newest_hand = std::max(peer.newest_hand, p.newest);
}

void LiveHost::hear_progress(Peer& peer, const HandPacket& p, std::int64_t now_us) {
  const std::uint64_t ticks = log_.size() / hands_;
  if (p.next_tick <= ticks) {
    if (p.next_tick < peer.next_tick) {  // it begins again
      peer.sent_to = p.next_tick;
      peer.on_way.clear();
    }
    peer.next_tick = p.next_tick;
    std::erase_if(peer.on_way, [&](const auto& sent) { return sent.second.end <= p.next_tick; });
  }
  peer.ready = p.ready;
  const auto has = std::min<std::uint32_t>(p.blob_bytes, static_cast<std::uint32_t>(settings_.size()));
  if (has != peer.blob_bytes) peer.blob_moved_us = now_us;
  if (has < peer.blob_bytes) peer.blob_sent = has;  // it begins again
  peer.blob_bytes = has;
  if (const auto mine = marks_.find(p.mark.tick); mine != marks_.end()) {
    if (mine->second != p.mark.hash) {
      if (peer.differs == 0) peer.differs = p.mark.tick;
    } else {
      peer.differs = 0;
      if (p.mark.tick > peer.compared) ++peer.same;
    }
    peer.compared = std::max(peer.compared, p.mark.tick);
  }
}

LogPacket LiveHost::log_from(std::uint64_t tick) const {
  LogPacket p;
  p.session = session_;
  p.state = state_;
  p.first_tick = tick;
  p.now_tick = log_.size() / hands_;
  p.hands = static_cast<std::uint8_t>(hands_);
  std::uint64_t end =
      std::min<std::uint64_t>(p.now_tick, tick + (hands_ <= 2 ? LogPacket::kMaxTicks : LogPacket::kMaxTicks / 2));
  const auto from = std::lower_bound(actions_.begin(), actions_.end(), tick,
                                     [](const SceneAction& a, std::uint64_t t) { return a.tick < t; });
  for (auto a = from; a != actions_.end() && a->tick < end; ++a) {
    if (p.actions.size() == LogPacket::kMaxActions) {
      end = std::max(a->tick, tick + 1);  // more in one tick than fit are none that people do
      break;
    }
    p.actions.push_back(*a);
  }
  std::erase_if(p.actions, [&](const SceneAction& a) { return a.tick >= end; });
  if (state_ == LogState::over && end == p.now_tick) {  // and those behind the last tick
    const auto behind = std::lower_bound(actions_.begin(), actions_.end(), end,
                                         [](const SceneAction& a, std::uint64_t t) { return a.tick < t; });
    for (auto a = behind; a != actions_.end() && a->tick == end && p.actions.size() < LogPacket::kMaxActions; ++a)
      p.actions.push_back(*a);
  }
  p.samples.assign(log_.begin() + static_cast<std::ptrdiff_t>(tick * hands_),
                   log_.begin() + static_cast<std::ptrdiff_t>(end * hands_));
  if (!marks_.empty()) p.mark = {marks_.rbegin()->first, marks_.rbegin()->second};
  return p;
}

// Whether the first tick that is missing there was sent, and each time longer ago than the way takes: it was lost. Of
// what was sent and is not known any more nothing comes either.
bool LiveHost::overdue(const Peer& peer, std::int64_t patience_us, std::int64_t now_us) {
  if (peer.next_tick >= peer.sent_to) return false;
  for (auto at = peer.on_way.begin(); at != peer.on_way.end() && at->first <= peer.next_tick; ++at) {
    if (at->second.end > peer.next_tick && now_us - at->second.at_us <= patience_us) return false;
  }
  return true;
}

std::vector<OutgoingPacket> LiveHost::poll(std::int64_t now_us) {
  const std::lock_guard lock(mutex_);
  std::erase_if(peers_, [&](const auto& p) { return now_us - p->last_heard_us > kGoneUs; });
  const std::uint64_t ticks = log_.size() / hands_;
  for (const auto& peer : peers_) {
    Peer& p = *peer;
    if (now_us - p.last_sent_us < kSendEveryUs) continue;
    p.last_sent_us = now_us;
    const auto send = [&](auto packet) {
      packet.times = p.clock.stamp(now_us);
      out_.push_back({p.from, p.channel->seal(encode(packet))});
    };
    const auto send_log = [&](const LogPacket& log) {
      const std::uint64_t end = log.first_tick + log.samples.size() / hands_;
      p.on_way[log.first_tick] = {end, now_us};
      // Of one that takes nothing, those that it needs first are known; the rest is overdue when it comes to them.
      if (p.on_way.size() > kMaxOnWay) p.on_way.erase(std::prev(p.on_way.end()));
      send(log);
      return end;
    };
    const auto patience_us = static_cast<std::int64_t>(p.clock.rtt_ms() * 1000) + 20'000;
    if (p.blob_bytes < settings_.size()) {
      // From what it has on, where no more has come for longer than the way takes.
      if (now_us - p.blob_moved_us > patience_us) {
        p.blob_sent = p.blob_bytes;
        p.blob_moved_us = now_us;
      }
      std::size_t at = std::max(p.blob_sent, p.blob_bytes);
      for (int n = 0; at < settings_.size() && at < p.blob_bytes + kWindowBytes && n < kPacketsAPoll; ++n) {
        BlobPacket b;
        b.session = session_;
        b.total = static_cast<std::uint32_t>(settings_.size());
        b.offset = static_cast<std::uint32_t>(at);
        const std::size_t end = std::min(settings_.size(), at + BlobPacket::kMax);
        b.bytes.assign(settings_.begin() + static_cast<std::ptrdiff_t>(at),
                       settings_.begin() + static_cast<std::ptrdiff_t>(end));
        send(b);
        at = end;
      }
      p.blob_sent = static_cast<std::uint32_t>(at);
      continue;
    }
    if (overdue(p, patience_us, now_us)) {
      // One that was far behind has let go of all that came meanwhile.
      p.burst = p.next_tick == p.resent_to ? std::min(2 * p.burst, kPacketsAPoll) : 1;
      p.resent_to = p.next_tick;
      for (int n = 0; n < p.burst && p.resent_to < p.sent_to; ++n) p.resent_to = send_log(log_from(p.resent_to));
    }
    p.sent_to = std::max(p.sent_to, p.next_tick);
    int sent = 0;
    while (p.sent_to + LogPacket::kMaxTicks < ticks && p.sent_to < p.next_tick + kWindowTicks && sent < kPacketsAPoll) {
      p.sent_to = send_log(log_from(p.sent_to));
      ++sent;
    }
    if (p.sent_to + LogPacket::kMaxTicks >= ticks) {
      // The newest, with those before them once more: in one packet, but of many hands or actions.
      std::uint64_t from = std::min(p.sent_to, ticks > kOverlap ? ticks - kOverlap : 0);
      do {
        from = send_log(log_from(from));
      } while (from < ticks);
      p.sent_to = from;
    }
  }
  return std::exchange(out_, {});
}

}  // namespace osteo::inline network
