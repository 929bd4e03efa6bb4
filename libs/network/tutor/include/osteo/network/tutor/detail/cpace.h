// CPace on ristretto255 with SHA-512, as draft-irtf-cfrg-cpace says (suite CPACE-RISTR255-SHA512, initiator and
// responder). The group and the hash are libsodium's.
#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

namespace osteo::inline network {

using CpacePoint = std::array<std::uint8_t, 32>;
using CpaceScalar = std::array<std::uint8_t, 32>;
using CpaceKey = std::array<std::uint8_t, 64>;  ///< the draft's intermediate session key, ISK

/// The generator of a password, a channel and a session. Secret: passwords can be tried on it. What it is made of is
/// wiped.
[[nodiscard]] CpacePoint cpace_generator(std::string_view password, std::string_view channel,
                                         std::span<const std::uint8_t> session);
/// `secret` times `point`. Nothing where that is no point, or the neutral one: then the protocol ends.
[[nodiscard]] std::optional<CpacePoint> cpace_multiply(const CpaceScalar& secret, const CpacePoint& point);

/// What one side sent: its share, and the data that go with it and are agreed on by it.
struct CpaceMessage {
  CpacePoint share;
  std::string_view data;
};
/// The key of both, from the point that both have. Nobody else may see `shared`, and it is no key itself.
[[nodiscard]] CpaceKey cpace_key(std::span<const std::uint8_t> session, const CpacePoint& shared,
                                 const CpaceMessage& initiator, const CpaceMessage& responder);

}  // namespace osteo::inline network
