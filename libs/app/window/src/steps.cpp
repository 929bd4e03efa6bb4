#include "steps.h"

#include <cmath>

#include "keys.h"

namespace osteo::inline app {
namespace {

enum : std::size_t { kDrill, kUndo, kRetract, kTilt, kSuck, kZoom, kCut, kPlate, kRuler, kPicture, kEnd };
constexpr double kDrilledMm3 = 0.5, kSuckedMm3 = 0.05, kZoomed = 0.1, kTiltedRad = 0.1;

}  // namespace

FirstSteps::FirstSteps() {
  const auto key = [](Command c) { return key_name(c); };
  steps_ = {{"Drill: point at the bone, " + key(Command::bring) +
             " brings the drill; hold the left button; Shift-wheel away from you: deeper"},
            {"Undo: " + key(Command::undo) + " takes the last stroke back"},
            {"Retract: " + key(Command::lift) + " lifts the drill out of the bone"},
            {"Tilt: drag with Alt and the right button"},
            {"Suction: keep drilling, and hold " + key(Command::suck) +
             ": the suction tube beside the burr removes the dust"},
            {"Zoom: wheel; right drag turns the view"},
            {"Cut: " + key(Command::saw) + " sets the saw where you point, drag moves it, " + key(Command::perform) +
             " cuts"},
            {"Plate: " + key(Command::plates) + " takes one, a click on bone brings it there, " +
             key(Command::perform) + " fixes it"},
            {"Ruler: " + key(Command::ruler) + ", then click two points on the bone"},
            {"Picture: " + key(Command::screenshot) + " keeps one in the session's folder"},
            {"End: " + key(Command::quit) + " saves the session and shows what was done"}};
}

void FirstSteps::see(const StepFacts& now) {
  steps_[kSuck].possible = now.dust;
  if (!first_) first_ = now;
  const auto tick = [&](std::size_t step, bool so) { steps_[step].done = steps_[step].done || so; };
  tick(kDrill, now.removed_mm3 - first_->removed_mm3 > kDrilledMm3);
  tick(kUndo, now.undone);
  tick(kRetract, now.retracted);
  tick(kTilt, std::abs(now.tilted_rad - first_->tilted_rad) > kTiltedRad);
  tick(kSuck, now.sucked_mm3 - first_->sucked_mm3 > kSuckedMm3);
  tick(kZoom, std::abs(now.magnification / first_->magnification - 1) > kZoomed);
  tick(kCut, now.sawn_mm3 > first_->sawn_mm3);
  tick(kPlate, now.fixtures > first_->fixtures);
  tick(kRuler, now.measured_mm > 0);
  tick(kPicture, now.pictured);
  tick(kEnd, now.ended);
}

int FirstSteps::next() const {
  for (std::size_t n = 0; n < steps_.size(); ++n) {
    if (steps_[n].possible && !steps_[n].done) return static_cast<int>(n);
  }
  return -1;
}

}  // namespace osteo::inline app
