// The hand without the drill, where no device moves it: beside the burr, or where the mouse has put it. Private to
// libs/app/window; no screen.
#pragma once
#include <optional>
#include <string>

#include "hand_tools.h"

namespace osteo::inline app {

class SecondHand {
 public:
  /// The next of sucker, irrigator, probe and nothing; a device's hand always holds one of the three. What there is to
  /// say.
  LocalText take_next(Rehearsal& rehearsal);
  /// One of them; 0: nothing. What there is to say.
  LocalText take(Rehearsal& rehearsal, std::size_t what);
  [[nodiscard]] std::size_t holds() const { return holds_; }
  static constexpr std::size_t kSucker = 1, kIrrigator = 2, kProbe = 3;
  /// Its sucker, in French: 5, 7, 8, 10 or 12.
  void take_sucker(int french) { french_ = french; }
  [[nodiscard]] int sucker_french() const { return french_; }
  /// The mouse moves it: from where it is, and it stays where it is put. With nothing in it, it takes a sucker. False:
  /// there is none that a mouse could move, and `said` is why.
  bool move(Rehearsal& rehearsal, Vec3 by_mm, LocalText& said);
  /// Beside the burr again.
  void follow() { placed_mm_.reset(); }
  /// Each frame: `suck`, `wash`: what is asked for by key; `works`: what it holds is to work.
  void hold(Rehearsal& rehearsal, const ViewAxes& view, bool suck, bool wash, bool works, bool left_handed);
  void rest() { sucking_ = washing_ = false; }

  [[nodiscard]] bool sucking() const { return sucking_; }
  [[nodiscard]] bool washing() const { return washing_; }
  /// Nothing is in it, and nothing of it is to be drawn.
  [[nodiscard]] bool empty() const { return empty_; }
  [[nodiscard]] const std::optional<Vec3>& placed_mm() const { return placed_mm_; }

 private:
  [[nodiscard]] std::string name_of(std::size_t what) const;
  std::size_t holds_ = 0;
  int french_ = 10;
  bool sucking_ = false, washing_ = false, empty_ = false;
  std::optional<Vec3> placed_mm_;
};

}  // namespace osteo::inline app
