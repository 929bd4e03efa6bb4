// Who may join a live session: two state machines, the host's and the guest's, that exchange the packets of a pairing
// over a network that loses, repeats, delays and reorders them. No socket, no clock, no session: whoever has them gives
// packets and time.
//
//   guest                                   host, an entry for each attempt (address, nonce)
//   asking   -- ask(nonce, role) ------->   none -> challenged
//            <- challenge(host nonce, share)
//   proving  -- prove(host nonce, share, tag) -> challenged -> proved, or rejected (wrong code)
//            <- wait                        proved: a seat is not decided yet
//            <- welcome(connection, tag)    proved -> welcomed
//            <- refused(why)                proved -> rejected (full)
//            <- again                       no such entry: it was forgotten
//
// The guest repeats its packet every 100 ms until it is answered; each attempt has a nonce of its own. `again`, or 2 s
// without any answer to its proof, leads back to asking with a new nonce. The host keeps the outcome of an attempt, so
// that a repeated proof has the same answer and is judged once. Each packet ends with a checksum: one that was damaged
// on the way is no packet, and never a wrong code.
#pragma once
#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "osteo/network/tutor/secure.h"
#include "osteo/network/tutor/wire.h"

namespace osteo::inline network {

enum class JoinRole : std::uint8_t { trainee = 1, watcher = 2 };

/// Who sits where, decided by the session.
class PairingSeats {
 public:
  enum class Answer : std::uint8_t { free, wait, taken };
  virtual ~PairingSeats() = default;
  /// For somebody who has proved at `proved_us` to know the code. Asked with each packet that repeats the proof, until
  /// it is not `wait`.
  [[nodiscard]] virtual Answer seat(const UdpPeer& from, JoinRole role, std::int64_t proved_us,
                                    std::int64_t now_us) = 0;
  /// The seat is taken; gives the number of the connection, not 0.
  [[nodiscard]] virtual std::uint32_t take(const UdpPeer& from, JoinRole role, const PairKeys& keys,
                                           std::int64_t now_us) = 0;
};

/// The host's side, for all who ask. Memory: at most kMaxAttempts entries of about 300 bytes. Cost: a packet about 1
/// us; the group's operations (0.2 ms) at most kPairingsPerS times a second for those who ask and as often for those
/// who prove, so that strangers who ask keep nobody from proving; other answers at most kAnswersPerS times. Not
/// thread-safe.
class PairingHost {
 public:
  static constexpr int kTries = 3, kPairingsPerS = 20, kAnswersPerS = 400;
  /// An attempt is not pushed out by others before kMaxAttempts / kPairingsPerS = 3.2 s, longer than a proof takes.
  static constexpr std::size_t kMaxAttempts = 64;
  static constexpr std::int64_t kForgetUs = 10'000'000;  ///< after the last packet of an attempt

  explicit PairingHost(std::string_view tidy_code) : code_(tidy_code) {}
  ~PairingHost();
  PairingHost(const PairingHost&) = delete;
  PairingHost& operator=(const PairingHost&) = delete;

  /// A packet whose first four bytes are 0, and the answer for its sender, where there is one: never longer than the
  /// packet.
  [[nodiscard]] std::optional<Bytes> receive(const UdpPeer& from, std::span<const std::uint8_t> packet,
                                             std::int64_t now_us, PairingSeats& seats);
  /// Wrong codes until nobody can join any more; a right one brings them back to kTries.
  [[nodiscard]] int tries_left() const { return tries_; }
  /// Packets that were damaged, of no use, or too many.
  [[nodiscard]] std::uint64_t refused() const { return refused_; }

 private:
  enum class State : std::uint8_t { challenged, proved, welcomed, refused };
  struct Attempt {
    UdpPeer from;
    JoinRole role{};
    Pairing::Nonce guest{}, host{};
    State state = State::challenged;
    std::optional<Pairing> pairing;  // challenged
    std::optional<PairKeys> keys;    // proved
    std::int64_t proved_us = 0, last_us = 0;
    Bytes outcome;  // welcomed, rejected: the answer
  };
  struct Budget {
    double left = 0;
    std::int64_t at_us = 0;
    [[nodiscard]] bool take(int per_s, std::int64_t now_us);
  };
  [[nodiscard]] static Bytes challenge(const Attempt& a);
  void judge(Attempt& a, const Pairing::Share& share, std::span<const std::uint8_t> tag, std::int64_t now_us);
  std::string code_;
  std::deque<Attempt> attempts_;  // oldest first
  int tries_ = kTries;
  Budget asks_{kPairingsPerS, 0}, proofs_{kPairingsPerS, 0}, answers_{kAnswersPerS, 0};
  std::uint64_t refused_ = 0;
};

/// The guest's side. Not thread-safe.
class PairingGuest {
 public:
  enum class State : std::uint8_t { asking, proving, joined, refused };
  static constexpr std::int64_t kRepeatUs = 100'000, kUnansweredUs = 2'000'000;

  PairingGuest(std::string_view tidy_code, JoinRole role);
  ~PairingGuest();
  PairingGuest(const PairingGuest&) = delete;
  PairingGuest& operator=(const PairingGuest&) = delete;

  /// From asking on, whatever was before.
  void begin();
  void receive(std::span<const std::uint8_t> packet, std::int64_t now_us);
  /// What is to be sent now, if anything.
  [[nodiscard]] std::optional<Bytes> poll(std::int64_t now_us);

  [[nodiscard]] State state() const { return state_; }
  [[nodiscard]] const std::string& why() const { return why_; }  ///< rejected: in words
  [[nodiscard]] bool answered() const { return answered_; }      ///< a host has been heard of
  [[nodiscard]] std::uint32_t connection() const { return connection_; }
  /// Joined: the keys, once; they are wiped here.
  [[nodiscard]] PairKeys take_keys();

 private:
  std::string code_;
  const JoinRole role_;
  State state_ = State::asking;
  Pairing::Nonce nonce_{}, host_nonce_{};
  Pairing::Share share_{};
  std::optional<PairKeys> keys_;
  std::uint32_t connection_ = 0;
  std::string why_;
  bool answered_ = false;
  int other_protocol_ = 0;  // answers that said so
  std::optional<std::int64_t> sent_us_;
  std::int64_t heard_us_ = 0;  // proving: since then nothing
};

}  // namespace osteo::inline network
