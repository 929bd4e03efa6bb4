#include "osteo/network/tutor/pairing.h"

#include <sodium.h>

#include <algorithm>

#include "handshake.h"

namespace osteo::inline network {
namespace {

Bytes refusal(const Pairing::Nonce& nonce, PairingRefusal why) {
  return PairingPacket(PairingStep::refused).add(nonce).add(why).sealed();
}

std::string words_of(PairingRefusal why) {
  switch (why) {
    case PairingRefusal::wrong_code:
      return "the code is another";
    case PairingRefusal::locked:
      return "there were too many wrong codes: the host has to show a new one";
    case PairingRefusal::full:
      return "someone else is the trainee, or nobody else can join";
    case PairingRefusal::protocol:
      break;
  }
  return "the host speaks another version of this protocol";
}

}  // namespace

std::array<std::uint8_t, kChecksumBytes> packet_checksum(std::span<const std::uint8_t> bytes) {
  // No shorter hash than 16 bytes is offered.
  std::array<std::uint8_t, crypto_generichash_BYTES_MIN> hash;
  ::crypto_generichash(hash.data(), hash.size(), bytes.data(), bytes.size(), nullptr, 0);
  std::array<std::uint8_t, kChecksumBytes> sum;
  std::copy_n(hash.begin(), sum.size(), sum.begin());
  return sum;
}

// --- the host

PairingHost::~PairingHost() {
  wipe(code_);
}

bool PairingHost::Budget::take(int per_s, std::int64_t now_us) {
  left = std::min<double>(per_s, left + static_cast<double>(std::max<std::int64_t>(0, now_us - at_us)) * 1e-6 * per_s);
  at_us = now_us;
  if (left < 1) return false;
  left -= 1;
  return true;
}

Bytes PairingHost::challenge(const Attempt& a) {
  return PairingPacket(PairingStep::challenge).add(a.guest).add(a.host).add(a.pairing->share()).sealed();
}

void PairingHost::judge(Attempt& a, const Pairing::Share& share, std::span<const std::uint8_t> tag,
                        std::int64_t now_us) {
  a.keys = a.pairing->keys(share, true);
  a.pairing.reset();
  if (a.keys && same_proof(proof(*a.keys, "guest"), tag)) {
    tries_ = kTries;
    a.state = State::proved;
    a.proved_us = now_us;
    return;
  }
  a.keys.reset();
  --tries_;
  ++refused_;
  a.state = State::refused;
  a.outcome = refusal(a.guest, PairingRefusal::wrong_code);
}

std::optional<Bytes> PairingHost::receive(const UdpPeer& from, std::span<const std::uint8_t> packet,
                                          std::int64_t now_us, PairingSeats& seats) {
  const auto of_no_use = [&]() -> std::optional<Bytes> {
    ++refused_;
    return std::nullopt;
  };
  const auto answer = [&](Bytes bytes) -> std::optional<Bytes> {
    if (bytes.size() > packet.size() || !answers_.take(kAnswersPerS, now_us)) return of_no_use();
    return bytes;
  };
  PairingFields f(packet);
  const auto nonce = f.take<Pairing::Nonce>();
  if (!f.good || (f.step != PairingStep::ask && f.step != PairingStep::prove)) return of_no_use();
  if (f.protocol != kTutorProtocol) return answer(refusal(nonce, PairingRefusal::protocol));
  if (!f.whole()) return of_no_use();
  std::erase_if(attempts_, [&](const Attempt& a) { return now_us - a.last_us > kForgetUs; });
  const auto known = std::find_if(attempts_.begin(), attempts_.end(),
                                  [&](const Attempt& a) { return a.guest == nonce && a.from == from; });

  if (f.step == PairingStep::ask) {
    const auto role = f.take<JoinRole>();
    if (!f.good || packet.size() < kAskBytes || (role != JoinRole::trainee && role != JoinRole::watcher))
      return of_no_use();
    if (known != attempts_.end()) {
      // One that was overtaken by its own proof needs no answer.
      if (known->state != State::challenged) return std::nullopt;
      known->last_us = now_us;
      return answer(challenge(*known));
    }
    if (tries_ <= 0) return answer(refusal(nonce, PairingRefusal::locked));
    if (!asks_.take(kPairingsPerS, now_us)) return of_no_use();
    if (attempts_.size() >= kMaxAttempts) attempts_.pop_front();
    Attempt& a = attempts_.emplace_back();
    a.from = from;
    a.role = role;
    a.guest = nonce;
    a.host = Pairing::make_nonce();
    a.pairing.emplace(code_, a.guest, a.host);
    a.last_us = now_us;
    return answer(challenge(a));
  }

  const auto host = f.take<Pairing::Nonce>();
  const auto share = f.take<Pairing::Share>();
  const auto tag = f.take<std::array<std::uint8_t, 16>>();
  if (!f.good) return of_no_use();
  if (known == attempts_.end() || known->host != host)
    return answer(PairingPacket(PairingStep::again).add(nonce).sealed());
  Attempt& a = *known;
  a.last_us = now_us;
  if (a.state == State::challenged) {
    if (tries_ <= 0) {
      a.pairing.reset();
      a.state = State::refused;
      a.outcome = refusal(nonce, PairingRefusal::locked);
    } else {
      if (!proofs_.take(kPairingsPerS, now_us)) return of_no_use();
      judge(a, share, tag, now_us);
    }
  }
  if (a.state == State::proved) {
    switch (seats.seat(from, a.role, a.proved_us, now_us)) {
      case PairingSeats::Answer::wait:
        return answer(PairingPacket(PairingStep::wait).add(nonce).sealed());
      case PairingSeats::Answer::taken:
        a.state = State::refused;
        a.outcome = refusal(nonce, PairingRefusal::full);
        break;
      case PairingSeats::Answer::free:
        a.state = State::welcomed;
        a.outcome = PairingPacket(PairingStep::welcome)
                        .add(nonce)
                        .add(seats.take(from, a.role, *a.keys, now_us))
                        .add(proof(*a.keys, "host"))
                        .sealed();
        break;
    }
    a.keys.reset();
  }
  return answer(a.outcome);
}

// --- the guest

PairingGuest::PairingGuest(std::string_view tidy_code, JoinRole role) : code_(tidy_code), role_(role) {
  begin();
}

PairingGuest::~PairingGuest() {
  wipe(code_);
}

void PairingGuest::begin() {
  state_ = State::asking;
  nonce_ = Pairing::make_nonce();
  keys_.reset();
  why_.clear();
  other_protocol_ = 0;
  sent_us_.reset();
}

PairKeys PairingGuest::take_keys() {
  PairKeys keys = keys_.value_or(PairKeys{});
  keys_.reset();
  return keys;
}

void PairingGuest::receive(std::span<const std::uint8_t> packet, std::int64_t now_us) {
  PairingFields f(packet);
  const auto nonce = f.take<Pairing::Nonce>();
  if (!f.good || nonce != nonce_ || (state_ != State::asking && state_ != State::proving)) return;
  if (f.step == PairingStep::refused && f.protocol != kTutorProtocol) {
    // Its checksum, if it has one, is not known here: it is believed when it has said so three times.
    answered_ = true;
    if (++other_protocol_ >= 3) state_ = State::refused, why_ = words_of(PairingRefusal::protocol);
    return;
  }
  if (!f.whole()) return;
  answered_ = true;
  switch (f.step) {
    case PairingStep::challenge: {
      if (state_ != State::asking) return;
      host_nonce_ = f.take<Pairing::Nonce>();
      const auto share = f.take<Pairing::Share>();
      if (!f.good) return;
      const Pairing pairing(code_, nonce_, host_nonce_);
      keys_ = pairing.keys(share, false);
      if (!keys_) return;
      share_ = pairing.share();
      state_ = State::proving;
      heard_us_ = now_us;
      sent_us_.reset();
      return;
    }
    case PairingStep::wait:
      if (state_ == State::proving) heard_us_ = now_us;
      return;
    case PairingStep::again:
      if (state_ != State::proving) return;
      begin();
      sent_us_ = now_us;  // a host that forgets at once is not asked at once
      return;
    case PairingStep::welcome: {
      if (state_ != State::proving) return;
      const auto connection = f.take<std::uint32_t>();
      const auto tag = f.take<std::array<std::uint8_t, 16>>();
      if (!f.good || connection == 0 || !same_proof(proof(*keys_, "host"), tag)) return;
      connection_ = connection;
      state_ = State::joined;
      return;
    }
    case PairingStep::refused: {
      const auto why = f.take<PairingRefusal>();
      if (!f.good) return;
      // That the host's protocol is another may come from a byte that was damaged on its way there.
      if (why == PairingRefusal::protocol && ++other_protocol_ < 3) return;
      keys_.reset();
      state_ = State::refused;
      why_ = words_of(why);
      return;
    }
    default:
      return;
  }
}

std::optional<Bytes> PairingGuest::poll(std::int64_t now_us) {
  if (state_ == State::proving && now_us - heard_us_ > kUnansweredUs) begin();
  if (state_ != State::asking && state_ != State::proving) return std::nullopt;
  if (sent_us_ && now_us - *sent_us_ < kRepeatUs) return std::nullopt;
  sent_us_ = now_us;
  if (state_ == State::proving) {
    const auto tag = proof(*keys_, "guest");
    return PairingPacket(PairingStep::prove).add(nonce_).add(host_nonce_).add(share_).add(tag).sealed();
  }
  return PairingPacket(PairingStep::ask).add(nonce_).add(role_).sealed(kAskBytes);
}

}  // namespace osteo::inline network
