// Dust and heat of the session that runs: what its switches show, and what the person has chosen for later ones.
// Private to libs/app/window.
#pragma once
#include <array>
#include <utility>
#include <vector>

#include "osteo/app/window/person_settings.h"
#include "osteo/simulation/bone/action.h"

namespace osteo::inline app {

/// The person's values are the switches while a window is open; behind it they are that person's choice again.
class SimulationSwitches {
 public:
  using Both = std::array<bool, 2>;  ///< by Simulated
  explicit SimulationSwitches(PersonValues& values) : values_(values), chosen_{values.dust, values.heat} {
    shown_ = asked_ = chosen_;
  }
  SimulationSwitches(const SimulationSwitches&) = delete;
  SimulationSwitches& operator=(const SimulationSwitches&) = delete;
  ~SimulationSwitches() { show(chosen_); }

  /// A session has begun, with these.
  void begin(const Both& simulated) {
    show(simulated);
    asked_ = simulated;
  }
  /// Dust begins in this session, for who uses water; nobody has chosen it for others.
  void use_water() {
    if (values_.dust) return;
    values_.dust = shown_[index(Simulated::dust)] = true;
  }
  /// Of a session that is another's, and as that person has it. True when somebody has pressed a switch here, in vain.
  [[nodiscard]] bool follow(const Both& simulated) {
    const bool pressed = shown_ != now();
    begin(simulated);
    return pressed;
  }
  /// What the session is to be asked for. What was pressed since is the person's choice.
  [[nodiscard]] std::vector<std::pair<Simulated, bool>> take_changes() {
    std::vector<std::pair<Simulated, bool>> changes;
    const Both pressed = now();
    for (const Simulated what : {Simulated::dust, Simulated::heat}) {
      const std::size_t n = index(what);
      if (pressed[n] != shown_[n]) chosen_[n] = pressed[n];
      if (pressed[n] != asked_[n]) changes.emplace_back(what, pressed[n]);
    }
    shown_ = asked_ = pressed;
    return changes;
  }

 private:
  static constexpr std::size_t index(Simulated what) { return static_cast<std::size_t>(what); }
  [[nodiscard]] Both now() const { return {values_.dust, values_.heat}; }
  void show(const Both& both) {
    shown_ = both;
    values_.dust = both[index(Simulated::dust)];
    values_.heat = both[index(Simulated::heat)];
  }

  PersonValues& values_;
  Both chosen_, shown_, asked_;
};

}  // namespace osteo::inline app
