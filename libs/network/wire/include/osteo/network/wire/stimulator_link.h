// The nerve monitor's stimulator, set from a console elsewhere: who has the code that the rehearsal shows. Pairing and
// secrecy as of live tutoring (osteo/network/tutor/secure.h), in OpenIGTLink messages of a type of their own, which
// other readers pass over. No socket, no clock.
#pragma once
#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "osteo/network/tutor/secure.h"
#include "osteo/network/wire/igtl.h"
#include "osteo/simulation/nerve/stimulator.h"

namespace osteo::inline network {

inline constexpr std::string_view kStimulatorType = "OSTEO_STIM";

/// The rehearsal's side, for all who are connected. Three wrong codes close it. At most kMaxMessagesS messages of each
/// client a second are looked at, and kMaxPairingsS pairings of all. Memory: about 300 bytes a client. hear() and
/// gone() from one thread, the rest from any.
class StimulatorEndpoint {
 public:
  static constexpr int kTries = 3;
  static constexpr double kMaxMessagesS = 100, kMaxPairingsS = 20;
  using Set = std::function<void(const StimulatorSetting&)>;
  /// As it is set now, and how many hands there are.
  using Now = std::function<std::pair<StimulatorSetting, std::uint32_t>()>;
  StimulatorEndpoint(std::string_view tidy_code, Set set, Now now);

  /// What a client says, and the answers for it alone: messages of kStimulatorType; others are nothing.
  [[nodiscard]] std::vector<WireBytes> hear(std::uint64_t client, const IgtlMessage& message, double now_s);
  void gone(std::uint64_t client);
  struct Counts {
    std::uint64_t settings = 0, refused = 0;  ///< taken; not understood, forged, repeated, too many
    int tries_left = kTries;
  };
  [[nodiscard]] Counts counts() const;

 private:
  struct Client {
    Pairing::Nonce guest{}, host{};
    std::optional<Pairing> pairing;
    std::optional<SecureChannel> channel;
    double messages = kMaxMessagesS, last_s = 0;
  };
  [[nodiscard]] std::vector<WireBytes> take(Client& client, std::span<const std::uint8_t> body);
  const std::string code_;
  const Set set_;
  const Now now_;
  std::map<std::uint64_t, Client> clients_;
  double pairings_ = kMaxPairingsS, last_s_ = 0;
  mutable std::mutex mutex_;
  Counts counts_;
};

/// The console's side. One thread, but for state().
class StimulatorLink {
 public:
  explicit StimulatorLink(std::string_view tidy_code);
  /// Connected, from the beginning again: what is to be sent.
  [[nodiscard]] WireBytes begin();
  /// What the server says: answers to it.
  [[nodiscard]] std::vector<WireBytes> hear(const IgtlMessage& message);
  /// Nothing until it is paired.
  [[nodiscard]] std::optional<WireBytes> set(const StimulatorSetting& setting);
  /// The monitor has told that it is so: by a search that ended, or whoever set it.
  void reported(double current_ma, bool search);
  void lost();  ///< the connection

  struct State {
    bool paired = false;
    std::string refused;  ///< in words: why it is not, for good
    StimulatorSetting now;
    std::uint32_t hands = 1;
  };
  [[nodiscard]] State state() const;

 private:
  const std::string code_;
  Pairing::Nonce guest_{};
  std::optional<PairKeys> keys_;
  std::optional<SecureChannel> channel_;
  mutable std::mutex mutex_;  // of state_
  State state_;
};

}  // namespace osteo::inline network
