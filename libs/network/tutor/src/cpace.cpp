#include "osteo/network/tutor/detail/cpace.h"

#include <sodium.h>

#include <algorithm>
#include <string>
#include <vector>

namespace osteo::inline network {
namespace {

constexpr std::string_view kName = "CPaceRistretto255", kKeyName = "CPaceRistretto255_ISK";
constexpr std::size_t kHashBlock = 128;  // bytes that SHA-512 takes at once

static_assert(crypto_core_ristretto255_BYTES == std::tuple_size_v<CpacePoint> &&
              crypto_core_ristretto255_SCALARBYTES == std::tuple_size_v<CpaceScalar> &&
              crypto_core_ristretto255_HASHBYTES == crypto_hash_sha512_BYTES &&
              crypto_hash_sha512_BYTES == std::tuple_size_v<CpaceKey>);

std::span<const std::uint8_t> bytes_of(std::string_view text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

/// Texts one behind the other, each with its length in LEB128 before it, so that no two lists of texts are the same.
/// Wiped at the end: passwords are among them. Never grows beyond what it has reserved, which would leave a copy.
class Fields {
 public:
  explicit Fields(std::size_t most) { bytes_.reserve(most); }
  ~Fields() { ::sodium_memzero(bytes_.data(), bytes_.size()); }
  Fields(const Fields&) = delete;
  Fields& operator=(const Fields&) = delete;

  Fields& add(std::span<const std::uint8_t> field) {
    std::size_t n = field.size();
    for (; n >= 128; n >>= 7) bytes_.push_back(static_cast<std::uint8_t>(n | 0x80));
    bytes_.push_back(static_cast<std::uint8_t>(n));
    bytes_.insert(bytes_.end(), field.begin(), field.end());
    return *this;
  }
  Fields& add(std::string_view field) { return add(bytes_of(field)); }
  [[nodiscard]] std::size_t size() const { return bytes_.size(); }
  [[nodiscard]] CpaceKey hash() const {
    CpaceKey out;
    ::crypto_hash_sha512(out.data(), bytes_.data(), bytes_.size());
    return out;
  }

 private:
  std::vector<std::uint8_t> bytes_;
};
constexpr std::size_t kLengths = 10 * 8;  // of eight fields, in LEB128 at most

}  // namespace

CpacePoint cpace_generator(std::string_view password, std::string_view channel, std::span<const std::uint8_t> session) {
  Fields fields(kName.size() + password.size() + kHashBlock + channel.size() + session.size() + kLengths);
  fields.add(kName).add(password);
  // Zeros fill the hash's first block, so that what follows is hashed apart from the password.
  const std::array<std::uint8_t, kHashBlock> zeros{};
  const std::size_t begun = fields.size() + 1;
  fields.add(std::span(zeros).first(begun < kHashBlock ? kHashBlock - begun : 0)).add(channel).add(session);
  CpaceKey hash = fields.hash();
  CpacePoint generator;
  ::crypto_core_ristretto255_from_hash(generator.data(), hash.data());
  ::sodium_memzero(hash.data(), hash.size());
  return generator;
}

std::optional<CpacePoint> cpace_multiply(const CpaceScalar& secret, const CpacePoint& point) {
  CpacePoint product;
  if (::crypto_scalarmult_ristretto255(product.data(), secret.data(), point.data()) != 0) return std::nullopt;
  return product;
}

CpaceKey cpace_key(std::span<const std::uint8_t> session, const CpacePoint& shared, const CpaceMessage& initiator,
                   const CpaceMessage& responder) {
  Fields fields(kKeyName.size() + session.size() + 3 * shared.size() + initiator.data.size() + responder.data.size() +
                kLengths);
  fields.add(kKeyName).add(session).add(shared);
  fields.add(initiator.share).add(initiator.data).add(responder.share).add(responder.data);
  return fields.hash();
}

}  // namespace osteo::inline network
