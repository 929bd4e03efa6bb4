#include "osteo/network/wire/stimulator_link.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <utility>

namespace osteo::inline network {
namespace {

static_assert(std::endian::native == std::endian::little, "messages are little endian");
constexpr std::uint8_t kVersion = 2;
constexpr std::uint32_t kConnection = 1;
enum class Step : std::uint8_t { ask = 1, challenge, prove, welcome, refused, setting, state };
enum class Refusal : std::uint8_t { wrong_code = 1, closed, version };

template <class T>
void put(Bytes& to, const T& value) {
  static_assert(std::is_trivially_copyable_v<T>);
  const auto* const from = reinterpret_cast<const std::uint8_t*>(&value);
  to.insert(to.end(), from, from + sizeof value);
}
template <class T>
bool take(std::span<const std::uint8_t>& from, T& value) {
  if (from.size() < sizeof value) return false;
  std::memcpy(&value, from.data(), sizeof value);
  from = from.subspan(sizeof value);
  return true;
}

WireBytes message(Step step, const Bytes& rest) {
  Bytes body{kVersion, static_cast<std::uint8_t>(step)};
  body.insert(body.end(), rest.begin(), rest.end());
  return igtl_message(kStimulatorType, "Stimulator", 0, body);
}
template <class... T>
WireBytes message_of(Step step, const T&... fields) {
  Bytes rest;
  (put(rest, fields), ...);
  return message(step, rest);
}

Bytes plain_of(const StimulatorSetting& s, std::uint32_t hands) {
  Bytes b;
  put(b, hands);
  put(b, s.hand);
  put(b, s.current_ma);
  put(b, s.pulses_per_s);
  put(b, s.width_ms);
  put(b, static_cast<std::uint8_t>(s.search ? 1 : 0));
  return b;
}
std::optional<std::pair<StimulatorSetting, std::uint32_t>> setting_in(std::span<const std::uint8_t> plain) {
  StimulatorSetting s;
  std::uint32_t hands = 0;
  std::uint8_t search = 0;
  if (!take(plain, hands) || !take(plain, s.hand) || !take(plain, s.current_ma) || !take(plain, s.pulses_per_s) ||
      !take(plain, s.width_ms) || !take(plain, search) || !plain.empty() || search > 1)
    return std::nullopt;
  s.search = search == 1;
  return std::pair(within_range(s), hands);
}

}  // namespace

StimulatorEndpoint::StimulatorEndpoint(std::string_view tidy_code, Set set, Now now)
    : code_(tidy_code), set_(std::move(set)), now_(std::move(now)) {}

StimulatorEndpoint::Counts StimulatorEndpoint::counts() const {
  const std::lock_guard lock(mutex_);
  return counts_;
}

void StimulatorEndpoint::gone(std::uint64_t client) {
  clients_.erase(client);
}

std::vector<WireBytes> StimulatorEndpoint::hear(std::uint64_t client, const IgtlMessage& m, double now_s) {
  if (m.type != kStimulatorType) return {};
  Client& c = clients_[client];
  c.messages = std::min(kMaxMessagesS, c.messages + std::max(0.0, now_s - c.last_s) * kMaxMessagesS);
  pairings_ = std::min(kMaxPairingsS, pairings_ + std::max(0.0, now_s - last_s_) * kMaxPairingsS);
  c.last_s = last_s_ = now_s;
  std::vector<WireBytes> answers;
  if (c.messages >= 1) {
    c.messages -= 1;
    answers = take(c, m.content);
  }
  if (answers.empty()) {
    const std::lock_guard lock(mutex_);
    ++counts_.refused;
  }
  return answers;
}

std::vector<WireBytes> StimulatorEndpoint::take(Client& c, std::span<const std::uint8_t> body) {
  std::uint8_t version = 0, step = 0;
  if (!osteo::take(body, version) || !osteo::take(body, step)) return {};
  if (version != kVersion) return {message_of(Step::refused, Refusal::version)};
  const auto tries = [&] {
    const std::lock_guard lock(mutex_);
    return counts_.tries_left;
  };
  if (step == static_cast<std::uint8_t>(Step::ask) || step == static_cast<std::uint8_t>(Step::prove)) {
    if (pairings_ < 1) return {};
    pairings_ -= 1;
    if (tries() <= 0) return {message_of(Step::refused, Refusal::closed)};
  }
  switch (static_cast<Step>(step)) {
    case Step::ask: {
      if (!osteo::take(body, c.guest) || !body.empty()) return {};
      c.channel.reset();
      c.host = Pairing::make_nonce();
      c.pairing.emplace(code_, c.guest, c.host);
      return {message_of(Step::challenge, c.host, c.pairing->share())};
    }
    case Step::prove: {
      Pairing::Share share;
      std::array<std::uint8_t, 16> tag;
      if (!c.pairing || !osteo::take(body, share) || !osteo::take(body, tag) || !body.empty()) return {};
      const auto keys = std::exchange(c.pairing, std::nullopt)->keys(share, true);
      if (!keys || !same_proof(proof(*keys, "stimulator guest"), tag)) {
        const std::lock_guard lock(mutex_);
        --counts_.tries_left;
        return {message_of(Step::refused, Refusal::wrong_code)};
      }
      {
        const std::lock_guard lock(mutex_);
        counts_.tries_left = kTries;
      }
      c.channel.emplace(kConnection, keys->to_guest, keys->to_host);
      const auto [setting, hands] = now_();
      return {message_of(Step::welcome, proof(*keys, "stimulator host")),
              message(Step::state, c.channel->seal(plain_of(setting, hands)))};
    }
    case Step::setting: {
      const auto plain = c.channel ? c.channel->open(body) : std::nullopt;
      const auto wanted = plain ? setting_in(*plain) : std::nullopt;
      const std::uint32_t hands = wanted ? now_().second : 0;
      if (!wanted || wanted->first.hand >= hands) return {};
      set_(wanted->first);
      {
        const std::lock_guard lock(mutex_);
        ++counts_.settings;
      }
      return {message(Step::state, c.channel->seal(plain_of(wanted->first, hands)))};
    }
    default:
      return {};
  }
}

// --- the console's side

StimulatorLink::StimulatorLink(std::string_view tidy_code) : code_(tidy_code) {}

StimulatorLink::State StimulatorLink::state() const {
  const std::lock_guard lock(mutex_);
  return state_;
}

void StimulatorLink::lost() {
  channel_.reset();
  keys_.reset();
  const std::lock_guard lock(mutex_);
  state_.paired = false;
}

WireBytes StimulatorLink::begin() {
  lost();
  guest_ = Pairing::make_nonce();
  return message_of(Step::ask, guest_);
}

std::vector<WireBytes> StimulatorLink::hear(const IgtlMessage& m) {
  std::span<const std::uint8_t> body = m.content;
  std::uint8_t version = 0, step = 0;
  if (m.type != kStimulatorType || !take(body, version) || !take(body, step) || version != kVersion) return {};
  switch (static_cast<Step>(step)) {
    case Step::challenge: {
      Pairing::Nonce host;
      Pairing::Share share;
      if (keys_ || channel_ || !take(body, host) || !take(body, share) || !body.empty()) return {};
      const Pairing pairing(code_, guest_, host);
      keys_ = pairing.keys(share, false);
      if (!keys_) return {};
      return {message_of(Step::prove, pairing.share(), proof(*keys_, "stimulator guest"))};
    }
    case Step::welcome: {
      std::array<std::uint8_t, 16> tag;
      if (!keys_ || channel_ || !take(body, tag) || !same_proof(proof(*keys_, "stimulator host"), tag)) return {};
      channel_.emplace(kConnection, keys_->to_host, keys_->to_guest);
      return {};
    }
    case Step::refused: {
      Refusal why{};
      if (channel_ || !take(body, why)) return {};
      const std::lock_guard lock(mutex_);
      state_.refused = why == Refusal::wrong_code ? "the stimulator's code is another"
                       : why == Refusal::closed   ? "the stimulator: three wrong codes, nobody else can set it"
                                                  : "the stimulator: the rehearsal is of another version";
      return {};
    }
    case Step::state: {
      const auto plain = channel_ ? channel_->open(body) : std::nullopt;
      const auto reported = plain ? setting_in(*plain) : std::nullopt;
      if (!reported) return {};
      const std::lock_guard lock(mutex_);
      state_.paired = true;
      state_.refused.clear();
      state_.now = reported->first;
      state_.hands = std::clamp<std::uint32_t>(reported->second, 1, 64);
      return {};
    }
    default:
      return {};
  }
}

std::optional<WireBytes> StimulatorLink::set(const StimulatorSetting& setting) {
  if (!channel_) return std::nullopt;
  return message(Step::setting, channel_->seal(plain_of(within_range(setting), 0)));
}

void StimulatorLink::reported(double current_ma, bool search) {
  const std::lock_guard lock(mutex_);
  state_.now.current_ma = current_ma;
  state_.now.search = search;
}

}  // namespace osteo::inline network
