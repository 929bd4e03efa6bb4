#include "osteo/simulation/camera/camera_trial.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <numbers>
#include <random>

namespace osteo::inline simulation {
namespace {

// The standard's distributions differ between libraries; its engine does not.
class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}
  double uniform(double lo, double hi) { return lo + (hi - lo) * (static_cast<double>(engine_() >> 11) * 0x1p-53); }
  double normal() { return std::sqrt(-2 * std::log(1 - uniform(0, 1))) * std::cos(uniform(0, 2 * std::numbers::pi)); }

 private:
  std::mt19937_64 engine_;
};

}  // namespace

bool close_to(const ScopeView& view, const ScopeView& target, const TrialTolerance& tolerance) {
  const ViewError e = view_error(view, target);
  return e.place_mm <= tolerance.place * target.field_mm() && e.angle_rad <= tolerance.angle_rad &&
         e.zoom <= tolerance.zoom;
}

std::vector<ScopeView> camera_targets(const ScopeView& start, std::size_t count, std::uint64_t seed) {
  Random random(seed);
  std::vector<ScopeView> targets;
  for (std::size_t n = 0; n < count; ++n) {
    ScopeView t = start;
    level(t);
    Vec3 off;
    do {
      off = {random.uniform(-25, 25), random.uniform(-25, 25), random.uniform(-25, 25)};
    } while (length(off) > 25);
    t.focus_mm += off;
    const double around = random.uniform(0, 2 * std::numbers::pi), by = random.uniform(0, std::numbers::pi / 4);
    orbit(t, by * std::cos(around), by * std::sin(around));
    magnify(t, kMagnifications[std::min<std::size_t>(2, static_cast<std::size_t>(random.uniform(0, 3)))]);
    targets.push_back(t);
  }
  return targets;
}

void CameraTrial::note(const ScopeControl& control, bool reached) {
  TrialResult r;
  r.seconds = seconds_ - (reached ? held_s_ : 0);
  r.reached = reached;
  for (std::size_t k = 0; k < r.by_kind.size(); ++k) {
    r.by_kind[k] = control.moves()[k] - before_[k];
    r.moves += r.by_kind[k];
  }
  before_ = control.moves();
  results_.push_back(r);
  seconds_ = held_s_ = 0;
}

bool CameraTrial::advance(const ScopeControl& control, double seconds) {
  const ScopeView* const t = target();
  if (t == nullptr) return false;
  if (results_.empty() && seconds_ == 0) before_ = control.moves();
  seconds_ += seconds;
  held_s_ = close_to(control.view(), *t, tolerance_) ? held_s_ + seconds : 0;
  if (held_s_ < tolerance_.hold_s) return false;
  note(control, true);
  return true;
}

void CameraTrial::give_up(const ScopeControl& control) {
  if (target() != nullptr) note(control, false);
}

namespace {

// What the hand has hold of.
enum class Grip { none, orbit, pan, depth, zoom, shift, turn, all };

class Simulation {
 public:
  Simulation(CameraMode mode, const ScopeView& start, const std::vector<ScopeView>& targets,
             const SimulatedPerson& person, std::uint64_t seed, const TrialTolerance& tolerance)
      : mode_(mode), p_(person), tolerance_(tolerance), random_(seed), trial_(targets, tolerance) {
    ScopeView begin = start;
    begin.upright = mode != CameraMode::six;
    control_.jump(begin);
  }

  std::vector<TrialResult> run() {
    while (trial_.target() != nullptr) {
      done_ = false;
      const std::size_t before = trial_.results().size();
      if (mode_ == CameraMode::bookmarks) recall();
      if (mode_ == CameraMode::point) point();
      while (!done_ && trial_.results().size() == before) {
        if (trial_.seconds() > p_.most_s) {
          trial_.give_up(control_);
        } else {
          correct();
        }
      }
    }
    return trial_.results();
  }

 private:
  static constexpr double kFrameS = 1.0 / 60, kMmPerPx = 0.25;
  static constexpr double kPixels = 860;  // of the picture's shorter side

  void frame() {
    control_.advance(kFrameS);
    done_ = trial_.advance(control_, kFrameS) || done_;
  }
  void wait(double seconds) {
    for (double t = 0; t < seconds - 1e-9 && !done_; t += kFrameS) frame();
  }
  void take(Grip grip) {
    wait(p_.reaction_s + (grip != grip_ ? p_.grip_s : 0));
    grip_ = grip;
  }
  double off(double amount) { return amount * (1 + p_.noise * random_.normal()); }

  // A move of minimum jerk: `step` gets its share of each frame.
  void submove(double seconds, const std::function<void(double share)>& step) {
    const int frames = std::max(1, static_cast<int>(std::lround(std::max(seconds, p_.least_move_s) / kFrameS)));
    const auto gone = [&](int n) {
      const double t = static_cast<double>(n) / frames;
      return t * t * t * (10 - 15 * t + 6 * t * t);
    };
    for (int n = 0; n < frames && !done_; ++n) {
      step(gone(n + 1) - gone(n));
      frame();
    }
  }
  // Peak velocity of minimum jerk is 15 / 8 of the mean.
  [[nodiscard]] double time_for(double length, double peak) const { return 15.0 / 8 * length / peak; }

  void recall() {
    // The view was kept before: it is known which key brings it.
    wait(p_.decide_s + p_.key_s);
    if (!done_) control_.go(*trial_.target());
    wait(ScopeControl::kFlightS + tolerance_.hold_s + 0.1);
  }
  void point() {
    wait(p_.reaction_s + p_.point_s + p_.key_s);
    ScopeView to = control_.view();
    // What is under the mouse is bone near where the person wants it.
    const double sd = 0.02 * to.field_mm();
    to.focus_mm = trial_.target()->focus_mm + Vec3{sd * random_.normal(), sd * random_.normal(), sd * random_.normal()};
    if (!done_) control_.go(to);
    wait(ScopeControl::kFlightS);
  }

  void correct() {
    const ScopeView& now = control_.view();
    const ScopeView& to = *trial_.target();
    const Vec3 d = to.focus_mm - now.focus_mm, turn = turn_between(now, to);
    const Vec3 shift{dot(d, now.right()), dot(d, now.up), dot(d, now.back)};
    const double place = tolerance_.place * to.field_mm(), zoom = std::log(to.magnification / now.magnification);
    const double across = std::hypot(shift.x, shift.y) / place, deep = std::abs(shift.z) / place,
                 turned = length(turn) / tolerance_.angle_rad, zoomed = std::abs(zoom) / std::log(tolerance_.zoom);
    constexpr double kGood = 0.8;
    if (std::max({std::hypot(across, deep), turned, zoomed}) < kGood) {
      wait(p_.reaction_s);
      return;
    }
    if (zoomed >= kGood && zoomed >= std::max({across, deep, turned}) * 0.5) {
      wheel(Grip::zoom, zoom / std::log(1.1), [&](double steps) { control_.zoom(std::pow(1.1, steps)); });
      return;
    }
    switch (mode_) {
      case CameraMode::mouse:
      case CameraMode::point:
      case CameraMode::bookmarks:
        if (turned >= std::max(across, deep)) {
          mouse_orbit(to);
        } else if (across >= deep) {
          mouse_pan(shift);
        } else {
          const double step = 0.02 * control_.view().field_mm();
          wheel(Grip::depth, -shift.z / step,
                [&](double steps) { control_.focus(steps * 0.02 * control_.view().field_mm()); });
        }
        break;
      case CameraMode::device:
        device(turned >= std::max(across, deep), shift, turn);
        break;
      case CameraMode::six:
        six(shift, turn);
        break;
      case CameraMode::rate:
        rate(shift, turn);
        break;
    }
  }

  void wheel(Grip grip, double steps, const std::function<void(double)>& turn) {
    take(grip);
    const int count = std::max(1, static_cast<int>(std::lround(std::abs(off(steps)))));
    for (int n = 0; n < count && !done_; ++n) {
      turn(std::copysign(1.0, steps));
      wait(p_.wheel_step_s);
    }
  }

  void mouse_orbit(const ScopeView& to) {
    take(Grip::orbit);
    const ScopeView& now = control_.view();
    const double around =
        std::remainder(std::atan2(to.back.y, to.back.x) - std::atan2(now.back.y, now.back.x), 2 * std::numbers::pi);
    const double right = off(around), up = off(std::asin(to.back.z) - std::asin(now.back.z));
    constexpr double kRadPerPx = 0.35 * std::numbers::pi / 180;  // as the window has it
    const double hand_mm = std::hypot(right, up) / kRadPerPx * kMmPerPx;
    submove(time_for(hand_mm, p_.hand_mm_s), [&](double share) { control_.orbit(right * share, up * share); });
  }

  void mouse_pan(Vec3 shift) {
    take(Grip::pan);
    const double px_per_mm = kPixels / control_.view().field_mm();
    // No further than across the picture in one drag.
    const double part = std::min(1.0, kPixels / (std::hypot(shift.x, shift.y) * px_per_mm));
    const double right = off(shift.x * part), up = off(shift.y * part);
    submove(time_for(std::hypot(right, up) * px_per_mm * kMmPerPx, p_.hand_mm_s),
            [&](double share) { control_.pan(right * share, up * share); });
  }

  // The device's way, at most its reach; more needs the clutch.
  void guided(CameraGuide guide, ScopeMotion way) {
    const double part = std::min(
        {1.0, p_.reach_mm / std::max(1e-9, length(way.shift_mm)), p_.wrist_rad / std::max(1e-9, length(way.turn_rad))});
    way = {way.shift_mm * part, way.turn_rad * part};
    submove(std::max(time_for(length(way.shift_mm), p_.hand_mm_s), time_for(length(way.turn_rad), p_.wrist_rad_s)),
            [&](double share) {
              control_.guide(guide, {way.shift_mm * share, way.turn_rad * share}, kFrameS);
            });
    // Inertia runs out before the brake is set.
    for (double t = 0; t < 0.25 && !done_; t += kFrameS) {
      control_.guide(guide, {}, kFrameS);
      frame();
    }
    control_.brake();
    if (part < 1) wait(p_.clutch_s);
  }

  void device(bool turns, Vec3 shift, Vec3 turn) {
    take(turns ? Grip::turn : Grip::shift);
    if (turns) {
      const Vec3 hand = Vec3{turn.y, -turn.x, 0} / ScopeControl::kRadPerMm;
      guided(CameraGuide::turn, {{off(hand.x), off(hand.y), 0}, {}});
    } else {
      const Vec3 hand = shift / (ScopeControl::kFieldsPerMm * control_.view().field_mm());
      guided(CameraGuide::shift, {{off(hand.x), off(hand.y), off(hand.z)}, {}});
    }
  }

  void six(Vec3 shift, Vec3 turn) {
    take(Grip::all);
    const Vec3 hand = shift / (ScopeControl::kFieldsPerMm * control_.view().field_mm());
    // 100 mm of the hand for a quarter of a turn of the wrist, as far as crosstalk goes.
    const double to_rad = p_.crosstalk * ScopeControl::kRadPerMm * length(hand) / std::numbers::sqrt3,
                 to_mm = p_.crosstalk / ScopeControl::kRadPerMm * length(turn) / std::numbers::sqrt3;
    ScopeMotion way;
    for (std::size_t a = 0; a < 3; ++a) {
      way.shift_mm[a] = off(hand[a]) + to_mm * random_.normal();
      way.turn_rad[a] = off(turn[a]) + to_rad * random_.normal();
    }
    guided(CameraGuide::six, way);
  }

  // Deflection 1: a field, or half a radian, a second. All axes are held for the same time, each as far as it needs.
  void rate(Vec3 shift, Vec3 turn) {
    take(Grip::all);
    const Vec3 fields = shift / control_.view().field_mm(), halves = turn / 0.5;
    const double seconds = std::max({p_.least_move_s, length(fields) * 15 / 8, length(halves) * 15 / 8});
    const double all = std::hypot(length(fields), length(halves));
    Vec3 push, twist;
    for (std::size_t a = 0; a < 3; ++a) {
      push[a] = off(fields[a]) + p_.crosstalk * all / std::sqrt(6.0) * random_.normal();
      twist[a] = off(halves[a]) + p_.crosstalk * all / std::sqrt(6.0) * random_.normal();
    }
    submove(seconds,
            [&](double share) { control_.drive(push * (share / kFrameS), twist * (share / kFrameS), kFrameS); });
    for (double t = 0; t < 0.25 && !done_; t += kFrameS) {
      control_.drive({}, {}, kFrameS);
      frame();
    }
  }

  CameraMode mode_;
  SimulatedPerson p_;
  TrialTolerance tolerance_;
  Random random_;
  CameraTrial trial_;
  ScopeControl control_;
  Grip grip_ = Grip::none;
  bool done_ = false;
};

}  // namespace

std::vector<TrialResult> simulate_trial(CameraMode mode, const ScopeView& start, const std::vector<ScopeView>& targets,
                                        const SimulatedPerson& person, std::uint64_t seed,
                                        const TrialTolerance& tolerance) {
  return Simulation(mode, start, targets, person, seed, tolerance).run();
}

TrialSummary summary_of(const std::vector<TrialResult>& results) {
  TrialSummary s;
  s.targets = results.size();
  std::vector<double> seconds;
  for (const TrialResult& r : results) {
    if (!r.reached) {
      ++s.missed;
      continue;
    }
    seconds.push_back(r.seconds);
    s.mean_moves += r.moves;
  }
  if (seconds.empty()) return s;
  s.mean_moves /= static_cast<double>(seconds.size());
  std::sort(seconds.begin(), seconds.end());
  const auto quantile = [&](double q) {
    return seconds[static_cast<std::size_t>(std::lround(q * static_cast<double>(seconds.size() - 1)))];
  };
  s.median_s = quantile(0.5);
  s.p90_s = quantile(0.9);
  return s;
}

std::string trial_csv(const std::vector<TrialResult>& results) {
  std::string csv = "target,reached,seconds,moves";
  for (const std::string_view kind : EnumNames<ScopeControl::Kind>::values) csv += "," + std::string(kind);
  csv += "\n";
  for (std::size_t n = 0; n < results.size(); ++n) {
    const TrialResult& r = results[n];
    char line[96];
    std::snprintf(line, sizeof line, "%zu,%d,%.2f,%u", n + 1, r.reached ? 1 : 0, r.seconds, r.moves);
    csv += line;
    for (const unsigned k : r.by_kind) csv += "," + std::to_string(k);
    csv += "\n";
  }
  return csv;
}

}  // namespace osteo::inline simulation
