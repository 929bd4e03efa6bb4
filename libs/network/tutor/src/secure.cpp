#include "osteo/network/tutor/secure.h"

#include <sodium.h>

#include <algorithm>
#include <cstring>

#include "osteo/core/base/error.h"
#include "osteo/network/tutor/detail/cpace.h"

namespace osteo::inline network {
namespace {

constexpr std::string_view kLetters = "23456789ABCDEFGHJKLMNPQRSTUVWXYZ";  // 32 of them: no 0, 1, I, O
static_assert(kLetters.size() == 32);

void need_sodium() {
  static const bool ready = ::sodium_init() >= 0;
  if (!ready)
    throw Error(ExitCode::failed, "there is no randomness for a key", "libsodium cannot be used on this machine");
}

constexpr std::string_view kChannel = "osteotome 5";  // both sides speak this, and nothing else of this kind
constexpr std::string_view kHost = "host", kGuest = "guest";

}  // namespace

PairKeys::~PairKeys() {
  ::sodium_memzero(to_host.data(), to_host.size());
  ::sodium_memzero(to_guest.data(), to_guest.size());
  ::sodium_memzero(confirm.data(), confirm.size());
}

void wipe(std::string& secret) noexcept {
  ::sodium_memzero(secret.data(), secret.size());
  secret.clear();
}

Pairing::~Pairing() {
  ::sodium_memzero(secret_.data(), secret_.size());
}

SecureChannel::~SecureChannel() {
  ::sodium_memzero(send_.data(), send_.size());
  ::sodium_memzero(receive_.data(), receive_.size());
}

std::string make_pairing_code() {
  need_sodium();
  std::string code;
  for (int i = 0; i < 8; ++i) {
    if (i == 4) code += '-';
    code += kLetters[::randombytes_uniform(32)];
  }
  return code;
}

std::string tidy_code(std::string_view typed) {
  std::string code;
  for (char c : typed) {
    if (c == '-' || c == ' ') continue;
    if (c >= 'a' && c <= 'z') c = static_cast<char>(c - 'a' + 'A');
    if (kLetters.find(c) == std::string_view::npos) return {};
    code += c;
  }
  return code.size() == 8 ? code : std::string();
}

Pairing::Nonce Pairing::make_nonce() {
  need_sodium();
  Nonce nonce;
  ::randombytes_buf(nonce.data(), nonce.size());
  return nonce;
}

Pairing::Pairing(std::string_view tidy_code, const Nonce& guest, const Nonce& host) {
  need_sodium();
  std::copy(guest.begin(), guest.end(), session_.begin());
  std::copy(host.begin(), host.end(), session_.begin() + kNonce);
  // From it the code could be tried out without talking to anybody.
  CpacePoint generator = cpace_generator(tidy_code, kChannel, session_);
  std::optional<CpacePoint> share;
  do {
    ::crypto_core_ristretto255_scalar_random(secret_.data());
    share = cpace_multiply(secret_, generator);
  } while (!share);
  mine_ = *share;
  ::sodium_memzero(generator.data(), generator.size());
}

std::optional<PairKeys> Pairing::keys(const Share& theirs, bool i_am_host) const {
  std::optional<CpacePoint> shared = cpace_multiply(secret_, theirs);
  if (!shared) return std::nullopt;
  // The host's share is the first to be sent. What each is goes with its share, so that none can be sent back.
  CpaceKey key =
      cpace_key(session_, *shared, {i_am_host ? mine_ : theirs, kHost}, {i_am_host ? theirs : mine_, kGuest});
  ::sodium_memzero(shared->data(), shared->size());
  PairKeys keys;
  const auto derive = [&](std::string_view label, std::array<std::uint8_t, 32>& out) {
    static_assert(std::tuple_size_v<CpaceKey> <= crypto_generichash_KEYBYTES_MAX);
    ::crypto_generichash(out.data(), out.size(), reinterpret_cast<const unsigned char*>(label.data()), label.size(),
                         key.data(), key.size());
  };
  derive("to host", keys.to_host);
  derive("to guest", keys.to_guest);
  derive("confirm", keys.confirm);
  ::sodium_memzero(key.data(), key.size());
  return keys;
}

std::array<std::uint8_t, 16> proof(const PairKeys& keys, std::string_view label) {
  std::array<std::uint8_t, 16> tag;
  ::crypto_generichash(tag.data(), tag.size(), reinterpret_cast<const unsigned char*>(label.data()), label.size(),
                       keys.confirm.data(), keys.confirm.size());
  return tag;
}

bool same_proof(const std::array<std::uint8_t, 16>& a, std::span<const std::uint8_t> b) {
  return b.size() == a.size() && ::sodium_memcmp(a.data(), b.data(), a.size()) == 0;
}

Bytes SecureChannel::seal(std::span<const std::uint8_t> plain) {
  Bytes packet(plain.size() + kOverhead);
  const std::uint64_t counter = ++sent_;
  std::memcpy(packet.data(), &connection_, 4);
  std::memcpy(packet.data() + 4, &counter, 8);
  std::array<std::uint8_t, crypto_aead_chacha20poly1305_ietf_NPUBBYTES> nonce{};
  std::memcpy(nonce.data(), &counter, 8);
  unsigned long long written = 0;
  ::crypto_aead_chacha20poly1305_ietf_encrypt(packet.data() + 12, &written, plain.data(), plain.size(), packet.data(),
                                              12, nullptr, nonce.data(), send_.data());
  return packet;
}

std::optional<Bytes> SecureChannel::open(std::span<const std::uint8_t> packet) {
  if (packet.size() < kOverhead || packet.size() > kMaxPacketBytes + kOverhead) return std::nullopt;
  std::uint32_t connection = 0;
  std::uint64_t counter = 0;
  std::memcpy(&connection, packet.data(), 4);
  std::memcpy(&counter, packet.data() + 4, 8);
  if (connection != connection_ || counter == 0) return std::nullopt;
  // What is old costs no decryption.
  const bool newer = counter > newest_;
  if (!newer && (newest_ - counter >= kWindow || heard_[counter % kWindow])) return std::nullopt;
  std::array<std::uint8_t, crypto_aead_chacha20poly1305_ietf_NPUBBYTES> nonce{};
  std::memcpy(nonce.data(), &counter, 8);
  Bytes plain(packet.size() - kOverhead);
  unsigned long long written = 0;
  if (::crypto_aead_chacha20poly1305_ietf_decrypt(plain.data(), &written, nullptr, packet.data() + 12,
                                                  packet.size() - 12, packet.data(), 12, nonce.data(),
                                                  receive_.data()) != 0)
    return std::nullopt;
  if (newer) {
    if (counter - newest_ >= kWindow) {
      heard_.reset();
    } else {
      for (std::uint64_t c = newest_ + 1; c < counter; ++c) heard_.reset(c % kWindow);
    }
    newest_ = counter;
  }
  heard_.set(counter % kWindow);
  return plain;
}

}  // namespace osteo::inline network
