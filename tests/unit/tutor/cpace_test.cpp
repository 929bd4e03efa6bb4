// CPace against the published vectors of draft-irtf-cfrg-cpace: ristretto255 and SHA-512, initiator and responder.
#include "osteo/network/tutor/detail/cpace.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "osteo/network/tutor/secure.h"

namespace osteo {
namespace {

template <std::size_t N>
std::array<std::uint8_t, N> hex(std::string_view text) {
  EXPECT_EQ(text.size(), 2 * N);
  std::array<std::uint8_t, N> bytes{};
  for (std::size_t i = 0; i < N && 2 * i + 1 < text.size(); ++i)
    bytes[i] = static_cast<std::uint8_t>(std::stoi(std::string(text.substr(2 * i, 2)), nullptr, 16));
  return bytes;
}

const auto kSession = hex<16>("7e4b4791d6a8ef019b936c79fb7f2c57");
const auto kSecretA = hex<32>("da3d23700a9e5699258aef94dc060dfda5ebb61f02a5ea77fad53f4ff0976d08");
const auto kSecretB = hex<32>("d2316b454718c35362d83d69df6320f38578ed5984651435e2949762d900b80d");
const auto kShareA = hex<32>("d40fb265a7abeaee7939d91a585fe59f7053f982c296ec413c624c669308f87a");
const auto kShareB = hex<32>("08bcf6e9777a9c313a3db6daa510f2d398403319c2341bd506a92e672eb7e307");
const auto kShared = hex<32>("e22b1ef7788f661478f3cddd4c600774fc0f41e6b711569190ff88fa0e607e09");
constexpr std::string_view kChannel{
    "oc\x0b"
    "B_responder\x0b"
    "A_initiator"};

TEST(Cpace, TheGeneratorIsThePublishedOne) {
  EXPECT_EQ(cpace_generator("Password", kChannel, kSession),
            hex<32>("a6fc82c3b8968fbb2e06fee81ca858586dea50d248f0c7ca6a18b0902a30b36b"));
}

TEST(Cpace, SharesAndTheSharedPointAreThePublishedOnes) {
  const CpacePoint generator = cpace_generator("Password", kChannel, kSession);
  EXPECT_EQ(cpace_multiply(kSecretA, generator), kShareA);
  EXPECT_EQ(cpace_multiply(kSecretB, generator), kShareB);
  EXPECT_EQ(cpace_multiply(kSecretA, kShareB), kShared);
  EXPECT_EQ(cpace_multiply(kSecretB, kShareA), kShared);
}

TEST(Cpace, TheKeyIsThePublishedOne) {
  EXPECT_EQ(
      cpace_key(kSession, kShared, {kShareA, "ADa"}, {kShareB, "ADb"}),
      hex<64>("4c5469a16b2364c4b944ebc1a79e51d1674ad47db26e8718154f59faebfaa52d8346f30aa58377117eb20d527f2cbc5c763"
              "81f7fd372e89df8239f87f2e02ed1"));
}

TEST(Cpace, WhatIsNoPointOrTheNeutralOneEndsIt) {
  const auto s = hex<32>("7cd0e075fa7955ba52c02759a6c90dbbfc10e6d40aea8d283e407d88cf538a05");
  EXPECT_EQ(cpace_multiply(s, hex<32>("2c3c6b8c4f3800e7aef6864025b4ed79bd599117e427c41bd47d93d654b4a51c")),
            hex<32>("7c13645fe790a468f62c39beb7388e541d8405d1ade69d1778c5fe3e7f6b600e"));
  EXPECT_EQ(cpace_multiply(s, hex<32>("2b3c6b8c4f3800e7aef6864025b4ed79bd599117e427c41bd47d93d654b4a51c")),
            std::nullopt);
  EXPECT_EQ(cpace_multiply(s, CpacePoint{}), std::nullopt);
}

// Passwords longer than the hash's block and channels of over 127 bytes, whose length takes two bytes, are others.
TEST(Cpace, EveryByteOfPasswordChannelAndSessionCounts) {
  const std::string channel(200, 'c');
  for (const std::size_t length : {8U, 108U, 109U, 110U, 300U}) {
    const std::string password(length, 'p');
    const CpacePoint generator = cpace_generator(password, channel, kSession);
    std::string other = password;
    other.back() = 'q';
    EXPECT_NE(cpace_generator(other, channel, kSession), generator);
    EXPECT_NE(cpace_generator(password + 'p', channel, kSession), generator);
    EXPECT_NE(cpace_generator(password, channel + 'c', kSession), generator);
    auto session = kSession;
    session.back() ^= 1;
    EXPECT_NE(cpace_generator(password, channel, session), generator);
  }
}

// The key depends on who sent which share, so a share that is sent back to its sender leads nowhere.
TEST(Cpace, AShareSentBackGivesNoCommonKey) {
  const Pairing::Nonce guest = Pairing::make_nonce(), host = Pairing::make_nonce();
  const Pairing a("K7MX2QPA", guest, host), b("K7MX2QPA", guest, host);
  const auto as_host = a.keys(b.share(), true), as_guest = b.keys(a.share(), false), back = a.keys(a.share(), true),
             also_host = b.keys(a.share(), true);
  ASSERT_TRUE(as_host && as_guest && back && also_host);
  EXPECT_EQ(as_host->confirm, as_guest->confirm);
  EXPECT_EQ(as_host->to_host, as_guest->to_host);
  EXPECT_NE(as_host->to_host, as_host->to_guest);
  EXPECT_NE(back->confirm, as_guest->confirm);
  EXPECT_NE(also_host->confirm, as_host->confirm);
  const Pairing wrong("K7MX2QPB", guest, host);
  const auto other = wrong.keys(a.share(), false);
  ASSERT_TRUE(other);
  EXPECT_NE(other->confirm, a.keys(wrong.share(), true)->confirm);
}

}  // namespace
}  // namespace osteo
