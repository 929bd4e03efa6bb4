// Pairing by a short code, and packets that nobody else can read, change, repeat or make up. libsodium inside.
#pragma once
#include <array>
#include <bitset>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "osteo/network/tutor/wire.h"

namespace osteo::inline network {

/// Eight letters and digits that are not mistaken for each other, 40 bits: "K7MX-2QPA". Error(failed) where there is no
/// randomness.
[[nodiscard]] std::string make_pairing_code();
/// Small letters, blanks and dashes are as good; empty: it is none.
[[nodiscard]] std::string tidy_code(std::string_view typed);

/// What both have after pairing. Each copy is wiped as it goes.
struct PairKeys {
  std::array<std::uint8_t, 32> to_host{}, to_guest{}, confirm{};
  ~PairKeys();
};
/// Overwrites a secret text, and empties it.
void wipe(std::string& secret) noexcept;

/// One side of CPace (a balanced PAKE: draft-irtf-cfrg-cpace, suite CPACE-RISTR255-SHA512; the draft's published
/// vectors are tested): the code maps to a generator, each side sends a random multiple of it. Who listens learns
/// nothing to try codes on; who takes part can try one code a run, and the host counts runs (three). Not withstood:
/// someone who reads the code. The session is both nonces, the host is the initiator, and each share goes with the role
/// of who sent it. The three keys are BLAKE2b under the draft's ISK. The secret is wiped at the end.
class Pairing {
 public:
  static constexpr std::size_t kNonce = 16, kShare = 32;
  using Nonce = std::array<std::uint8_t, kNonce>;
  using Share = std::array<std::uint8_t, kShare>;
  [[nodiscard]] static Nonce make_nonce();
  Pairing(std::string_view tidy_code, const Nonce& guest, const Nonce& host);
  ~Pairing();
  [[nodiscard]] const Share& share() const { return mine_; }
  /// Nothing where the other's share is no point, or the neutral one.
  [[nodiscard]] std::optional<PairKeys> keys(const Share& theirs, bool i_am_host) const;

 private:
  std::array<std::uint8_t, 2 * kNonce> session_{};  // the guest's nonce, then the host's
  std::array<std::uint8_t, 32> secret_{};
  Share mine_{};
};

/// Authenticated encryption of packets in one direction each (ChaCha20-Poly1305, the counter is the nonce). A packet:
/// connection (4 bytes), counter (8), ciphertext, tag (16). Both keys are wiped at the end.
class SecureChannel {
 public:
  static constexpr std::size_t kOverhead = 28;
  SecureChannel(std::uint32_t connection, const std::array<std::uint8_t, 32>& send,
                const std::array<std::uint8_t, 32>& receive)
      : connection_(connection), send_(send), receive_(receive) {}
  ~SecureChannel();
  [[nodiscard]] Bytes seal(std::span<const std::uint8_t> plain);
  /// Nothing for what was not sealed by the other side, was heard before, or is older than kWindow packets.
  [[nodiscard]] std::optional<Bytes> open(std::span<const std::uint8_t> packet);
  [[nodiscard]] std::uint32_t connection() const { return connection_; }
  /// Of the last kWindow packets that the other side has sent, the share that did not come.
  [[nodiscard]] double lost() const {
    const std::uint64_t sent = newest_ < kWindow ? newest_ : kWindow;
    return sent == 0 ? 0 : 1 - static_cast<double>(heard_.count()) / static_cast<double>(sent);
  }

  static constexpr std::size_t kWindow = 1024;

 private:
  std::uint32_t connection_;
  std::array<std::uint8_t, 32> send_, receive_;
  std::uint64_t sent_ = 0, newest_ = 0;
  std::bitset<kWindow> heard_;  // by counter, modulo
};

/// Short proof of having the key, under a label.
[[nodiscard]] std::array<std::uint8_t, 16> proof(const PairKeys& keys, std::string_view label);
/// In a time that does not depend on where they differ.
[[nodiscard]] bool same_proof(const std::array<std::uint8_t, 16>& a, std::span<const std::uint8_t> b);

}  // namespace osteo::inline network
