// A network between two programs that is none: delay, jitter (which reorders), loss, duplicates. The same seed, the
// same network.
#pragma once
#include <cstdint>
#include <map>
#include <vector>

#include "osteo/network/tutor/wire.h"

namespace osteo::test {

struct NetworkFaults {
  double delay_ms = 0;   ///< one way
  double jitter_ms = 0;  ///< uniform, on top
  double loss = 0, duplicates = 0;
};

class SimNetwork {
 public:
  explicit SimNetwork(const NetworkFaults& wanted, std::uint64_t seed = 1) : faults(wanted), state_(seed) {}
  void send(const Bytes& packet, std::int64_t now_us) {
    ++sent;
    bytes += packet.size();
    if (cut || chance() < faults.loss) return;
    const auto arrive = [&] {
      return now_us + static_cast<std::int64_t>(1000 * (faults.delay_ms + faults.jitter_ms * chance()));
    };
    on_its_way_.emplace(arrive(), packet);
    if (chance() < faults.duplicates) on_its_way_.emplace(arrive(), packet);
  }
  std::vector<Bytes> arrived(std::int64_t now_us) {
    std::vector<Bytes> all;
    while (!on_its_way_.empty() && on_its_way_.begin()->first <= now_us) {
      all.push_back(std::move(on_its_way_.begin()->second));
      on_its_way_.erase(on_its_way_.begin());
    }
    return all;
  }
  double chance() {
    std::uint64_t z = (state_ += 0x9e3779b97f4a7c15ULL);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
    return static_cast<double>((z ^ (z >> 31)) >> 11) * 0x1p-53;
  }
  NetworkFaults faults;
  bool cut = false;
  std::uint64_t sent = 0, bytes = 0;

 private:
  std::uint64_t state_;
  std::multimap<std::int64_t, Bytes> on_its_way_;
};

}  // namespace osteo::test
