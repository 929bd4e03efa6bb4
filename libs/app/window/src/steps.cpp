#include "steps.h"

#include <cmath>

#include "keys.h"
#include "osteo/core/base/translate.h"

namespace osteo::inline app {
namespace {

enum : std::size_t { kDrill, kUndo, kRetract, kTilt, kSuck, kZoom, kCut, kPlate, kRuler, kPicture, kEnd };
constexpr double kDrilledMm3 = 0.5, kSuckedMm3 = 0.05, kZoomed = 0.1, kTiltedRad = 0.1;

}  // namespace

FirstSteps::FirstSteps() {
  steps_ = {{tr_later("Drill: point at the bone, {bring} brings the drill; hold the left button; Shift-wheel away from "
                      "you: deeper")},
            {tr_later("Undo: {undo} takes the last stroke back")},
            {tr_later("Retract: {lift} lifts the drill out of the bone")},
            {tr_later("Tilt: drag with Alt and the right button")},
            {tr_later("Suction: keep drilling, and hold {suction}: the suction tube beside the burr removes the dust")},
            {tr_later("Zoom: wheel; right drag turns the view")},
            {tr_later("Cut: {saw} sets the saw where you point, drag moves it, {perform} cuts")},
            {tr_later("Plate: {plate} takes one, a click on bone brings it there, {perform} fixes it")},
            {tr_later("Ruler: {ruler}, then click two points on the bone")},
            {tr_later("Picture: {picture} keeps one in the session's folder")},
            {tr_later("End: {end} saves the session and shows what was done")}};
}

std::string Step::words() const {
  return filled(tr(text), {{"bring", key_name(Command::bring)},
                           {"undo", key_name(Command::undo)},
                           {"lift", key_name(Command::lift)},
                           {"suction", key_name(Command::suck)},
                           {"saw", key_name(Command::saw)},
                           {"plate", key_name(Command::plates)},
                           {"perform", key_name(Command::perform)},
                           {"ruler", key_name(Command::ruler)},
                           {"picture", key_name(Command::screenshot)},
                           {"end", key_name(Command::quit)}});
}

std::string Step::name() const {
  const std::string all = words();
  const auto end = all.find_last_not_of(' ', all.find(':') - 1);  // French has a blank before it
  return all.substr(0, end + 1);
}

std::string Step::how() const {
  const std::string all = words();
  const auto from = all.find_first_not_of(": ", all.find(':'));
  return from == std::string::npos ? std::string() : all.substr(from);
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
