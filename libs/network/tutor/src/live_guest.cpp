#include <algorithm>

#include "handshake.h"
#include "osteo/network/tutor/live.h"

namespace osteo::inline network {
namespace {

constexpr std::int64_t kGuestSendEveryUs = 2000, kLostUs = 2'000'000;
constexpr std::size_t kMaxPieces = 512;  // of a kilobyte each

}  // namespace

LiveGuest::LiveGuest(std::string_view tidy_code, JoinRole role, std::shared_ptr<FarDevice> host_hand)
    : role_(role), host_hand_(std::move(host_hand)), pairing_(tidy_code, role) {}

void LiveGuest::receive(std::span<const std::uint8_t> packet, std::int64_t now_us) {
  if (!PairingFields(packet).good) {
    if (!channel_) return;
    const auto plain = channel_->open(packet);
    if (!plain) {
      ++refused_;
      return;
    }
    if (const auto log = decode_log(*plain)) {
      clock_.heard(log->times, now_us);
      last_heard_us_ = now_us;
      hear(*log, now_us);
    } else if (const auto blob = decode_blob(*plain)) {
      clock_.heard(blob->times, now_us);
      last_heard_us_ = now_us;
      hear(*blob);
    } else {
      ++refused_;
    }
    return;
  }
  if (state_ != JoinState::asking) return;
  pairing_.receive(packet, now_us);
  if (pairing_.state() == PairingGuest::State::refused) state_ = JoinState::refused;
  if (pairing_.state() != PairingGuest::State::joined) return;
  const PairKeys keys = pairing_.take_keys();
  channel_ = std::make_unique<SecureChannel>(pairing_.connection(), keys.to_host, keys.to_guest);
  state_ = JoinState::joined;
  last_heard_us_ = now_us;
  clock_ = {};
}

// A host that has begun again: nothing of before counts.
void LiveGuest::take_session(std::uint64_t session) {
  if (session == session_) return;
  session_ = session;
  settings_.clear();
  pieces_.clear();
  settings_whole_ = ready_ = false;
  host_state_ = LogState::runs;
  host_tick_ = newest_shown_ = 0;
  behind_.clear();
  begin_again();
}

void LiveGuest::hear(const BlobPacket& p) {
  take_session(p.session);
  if (settings_whole_ || p.offset < settings_.size()) return;
  // What comes before its turn waits, so that what was lost alone has to come again.
  if (pieces_.size() < kMaxPieces || p.offset == settings_.size()) pieces_.try_emplace(p.offset, p.bytes);
  for (auto next = pieces_.begin(); next != pieces_.end() && next->first <= settings_.size(); next = pieces_.begin()) {
    if (next->first == settings_.size()) settings_.insert(settings_.end(), next->second.begin(), next->second.end());
    pieces_.erase(next);
  }
  settings_whole_ = settings_.size() == p.total;
}

void LiveGuest::hear(const LogPacket& p, std::int64_t) {
  take_session(p.session);
  if (!settings_whole_) return;
  host_tick_ = std::max(host_tick_, p.now_tick);
  if (p.state != LogState::runs) host_state_ = p.state;
  const std::size_t ticks = p.samples.size() / p.hands;
  auto action = p.actions.begin();
  for (std::size_t i = 0; i < ticks; ++i) {
    const std::uint64_t tick = p.first_tick + i;
    // The host's hand as soon as it is heard of, for the spring; what is old serves the copy alone.
    if (tick + 256 > newest_shown_)
      host_hand_->put({tick, p.samples[i * p.hands]}, tick > newest_shown_ && i + 1 == ticks);
    LiveTick t;
    t.tick = tick;
    for (std::size_t h = 0; h < p.hands; ++h) t.hands[h] = p.samples[i * p.hands + h];
    for (; action != p.actions.end() && action->tick == tick; ++action) t.actions.push_back(*action);
    if (tick >= taken_ && tick < taken_ + kMaxWaiting) waiting_.try_emplace(tick, std::move(t));
  }
  if (action != p.actions.end()) behind_.assign(action, p.actions.end());
  if (ticks > 0) newest_shown_ = std::max(newest_shown_, p.first_tick + ticks - 1);
  while (waiting_.contains(next_tick_)) ++next_tick_;
  if (const auto mine = my_marks_.find(p.mark.tick); mine != my_marks_.end() && p.mark.tick > compared_) {
    compared_ = p.mark.tick;
    if (mine->second == p.mark.hash) {
      ++same_;
    } else if (differs_ == 0) {
      differs_ = p.mark.tick;
    }
  }
}

std::optional<LiveTick> LiveGuest::next() {
  const auto at = waiting_.find(taken_);
  if (at == waiting_.end()) return std::nullopt;
  LiveTick t = std::move(at->second);
  waiting_.erase(at);
  ++taken_;
  next_tick_ = std::max(next_tick_, taken_);
  return t;
}

void LiveGuest::mark(const BoneMark& mine) {
  if (mine.tick % kMarkTicks != 0) return;
  my_mark_ = mine;
  my_marks_[mine.tick] = mine.hash;
  if (my_marks_.size() > 64) my_marks_.erase(my_marks_.begin());
}

void LiveGuest::begin_again() {
  waiting_.clear();
  next_tick_ = taken_ = differs_ = compared_ = same_ = 0;
  my_mark_ = {};
  my_marks_.clear();
}

std::vector<Bytes> LiveGuest::poll(std::int64_t now_us) {
  std::vector<Bytes> out;
  std::array<FarSample, 256> items;
  const std::size_t n = own_.pop(items);
  recent_.insert(recent_.end(), items.begin(), items.begin() + static_cast<std::ptrdiff_t>(n));
  while (recent_.size() > HandPacket::kMax) recent_.pop_front();
  if (state_ == JoinState::joined && now_us - last_heard_us_ > kLostUs) {
    // Dropped: the session goes on here alone, and it is asked for again.
    state_ = JoinState::asking;
    channel_.reset();
    pairing_.begin();
  }
  if (state_ == JoinState::asking) {
    if (auto packet = pairing_.poll(now_us)) out.push_back(std::move(*packet));
  }
  if (state_ == JoinState::joined && now_us - last_sent_us_ >= kGuestSendEveryUs) {
    last_sent_us_ = now_us;
    HandPacket p;
    p.times = clock_.stamp(now_us);
    p.next_tick = next_tick_;
    p.blob_bytes = static_cast<std::uint32_t>(settings_.size());
    p.ready = ready_;
    p.mark = my_mark_;
    if (role_ == JoinRole::trainee && !recent_.empty()) {
      p.newest = recent_.back().tick;
      for (const FarSample& s : recent_) p.samples.push_back(s.sample);
    }
    out.push_back(channel_->seal(encode(p)));
  }
  return out;
}

}  // namespace osteo::inline network
