#include "osteo/assessment/trainee/trainee_hand.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "osteo/core/base/portable_math.h"
#include "osteo/core/statistics/basics.h"
#include "osteo/simulation/bone/instrument.h"

namespace osteo::inline assessment {
namespace {

constexpr double kFirstTouchN = 0.8;  // until it feels bone it presses no harder, so that it does not fall onto it
constexpr double kContactN = 0.05;
constexpr double kRampNPerS = 60, kFeltS = 0.02, kCorrectPerS = 5, kAxisS = 0.15;
constexpr std::size_t kLagPoints = 5;  // of its stroke, by which the hand may be behind the place it pulls towards
constexpr double kTravelSidewaysMm = 2.5;
constexpr double kSidewaysShare = 0.8,
                 kMinSidewaysMm = 0.5;  // it pulls sideways by no more than this share of what it presses
constexpr double kComeDownS = 1.5;
constexpr double kStallS = 0.4;  // then it goes on to the next place
constexpr double kTooHard = 1, kWavering = 0.9, kEasedShare = 0.75;

}  // namespace

Wavering::Wavering(std::uint64_t seed, double least_hz, double most_hz) {
  statistics::Random random(seed);
  for (std::size_t i = 0; i < hz_.size(); ++i) {
    hz_[i] = least_hz + (most_hz - least_hz) * random.uniform();
    turns_[i] = random.uniform();
  }
}

double Wavering::at(double t_s) const noexcept {
  double sum = 0;
  for (std::size_t i = 0; i < hz_.size(); ++i) sum += portable::sin_cos_turns(hz_[i] * t_s + turns_[i]).sin;
  return sum * std::sqrt(2.0 / 3.0);
}

TraineeHand::TraineeHand(const TraineeSkill& skill, std::uint64_t seed, const StructureMap* structures,
                         std::vector<bool> guarded, Vec3 start_mm, Vec3 toward, Vec3 axis)
    : skill_(skill),
      structures_(structures),
      guarded_(std::move(guarded)),
      near_mm_(guarded_.size()),
      toward_(toward),
      force_wave_(seed ^ 0x666f726365ULL, 0.3, 1.5),
      tremor_{Wavering(seed ^ 0x7472656d31ULL, 8, 12), Wavering(seed ^ 0x7472656d32ULL, 8, 12),
              Wavering(seed ^ 0x7472656d33ULL, 8, 12)},
      at_mm_(start_mm),
      carrot_mm_(start_mm),
      axis_(axis) {
  hand_.put(start_mm);
}

void TraineeHand::begin(TraineeStroke stroke) {
  stroke_ = std::move(stroke);
  next_ = 0;
  stalled_s_ = coming_s_ = 0;
  carrot_mm_ = at_mm_;
}

// How deep it wants to come where the hand is, as planned along the part of the stroke that it is on, however high it
// is.
double TraineeHand::wanted_height_mm() const noexcept {
  const auto sideways = [&](Vec3 v) { return v - toward_ * dot(v, toward_); };
  const auto floor_mm = [&](std::size_t p) {
    return dot(stroke_.points[p].at_mm, toward_) - stroke_.points[p].press_mm;
  };
  double nearest = 1e300, height = floor_mm(next_);
  for (std::size_t p = next_ > kLagPoints ? next_ - kLagPoints : 0; p < next_; ++p) {
    const Vec3 from = stroke_.points[p].at_mm, way = sideways(stroke_.points[p + 1].at_mm - from),
               to_hand = sideways(at_mm_ - from);
    const double square = dot(way, way), share = square > 1e-12 ? std::clamp(dot(to_hand, way) / square, 0.0, 1.0) : 1;
    const double off = length(to_hand - way * share);
    if (off > nearest) continue;  // of two as near, the one that comes later
    nearest = off;
    height = floor_mm(p) + (floor_mm(p + 1) - floor_mm(p)) * share;
  }
  return height;
}

// The place it pulls towards goes on along the stroke, and waits where the hand cannot follow.
void TraineeHand::go_on(double dt_s, double most_sideways_mm) noexcept {
  carrot_speed_mm_s_ = {};
  if (done()) return;
  const auto sideways = [&](Vec3 v) { return v - toward_ * dot(v, toward_); };
  const Vec3 behind = carrot_mm_ - at_mm_;
  if (length(stroke_.drilling ? sideways(behind) : behind) > most_sideways_mm) {
    stalled_s_ += dt_s;
    if (stalled_s_ < kStallS) return;
    stalled_s_ = 0;
    ++next_;
    carrot_mm_ = at_mm_;
    return;
  }
  stalled_s_ = std::max(0.0, stalled_s_ - dt_s);
  // First it comes down.
  if (stroke_.drilling && next_ == 0) {
    const double above = dot(at_mm_ - stroke_.points[0].at_mm, toward_);
    coming_s_ += dt_s;
    if (felt_n_ < kContactN && above > 0.4 && coming_s_ < kComeDownS &&
        length(sideways(stroke_.points[0].at_mm - at_mm_)) < 1) {
      carrot_mm_ = stroke_.points[0].at_mm;
      return;
    }
  }
  const Vec3 left = stroke_.points[next_].at_mm - carrot_mm_;
  const double speed = stroke_.drilling ? skill_.speed_mm_s : kTravelMmS, way = length(left), step = speed * dt_s;
  // On a drilling stroke depth is a matter of force, and costs no way.
  const double counts = stroke_.drilling ? length(sideways(left)) : way;
  if (counts <= step) {
    carrot_mm_ = stroke_.points[next_].at_mm;
    ++next_;
    return;
  }
  const Vec3 goes = stroke_.drilling ? sideways(left) : left;
  carrot_mm_ += goes * (step / counts);
  carrot_speed_mm_s_ = goes * (speed / counts);
}

double TraineeHand::wanted_n(double t_s, double dt_s) noexcept {
  double n =
      skill_.force_n * std::max(0.05, 1 + (1 - skill_.force_control) * (kTooHard + kWavering * force_wave_.at(t_s)));
  if (structures_ != nullptr) {
    const double radius = instrument_of(stroke_.tool).head.largest_radius_mm();
    structures_->clearance(RoundCone{0, 0, radius, radius}, at_mm_, toward_, near_mm_);
    double clearance = structures_->reach_mm();
    for (std::size_t s = 0; s < guarded_.size(); ++s)
      if (guarded_[s]) clearance = std::min(clearance, near_mm_[s]);
    if (clearance < kNearMm) n *= 1 - skill_.force_control * kEasedShare;
  }
  if (felt_n_ < kContactN) {
    ramp_n_ = kFirstTouchN;
    bias_n_ = 0;
  } else {
    ramp_n_ += kRampNPerS * dt_s;
    // It takes back what is too much, and does not press after bone that gives way.
    bias_n_ = std::clamp(bias_n_ + skill_.force_control * kCorrectPerS * (std::min(n, ramp_n_) - felt_n_) * dt_s,
                         -0.5 * n, 0.0);
  }
  ramp_n_ = std::min(ramp_n_, n);
  return ramp_n_ + bias_n_;
}

DeviceSample TraineeHand::read(std::uint64_t tick, double dt_s, Vec3 force_n) noexcept {
  const double t_s = static_cast<double>(tick) * dt_s, push = dot(force_n, toward_);
  if (std::isfinite(push)) felt_n_ += (std::max(0.0, push) - felt_n_) * std::min(1.0, dt_s / kFeltS);
  const bool drilling = stroke_.drilling && !done();
  const double press_n = drilling ? wanted_n(t_s, dt_s) : 0;
  const double most_sideways_mm =
      drilling ? std::max(kMinSidewaysMm, kSidewaysShare * press_n / kSpringNPerMm) : kTravelSidewaysMm;
  go_on(dt_s, most_sideways_mm);
  if (stroke_.drilling && !done()) carrot_mm_ += toward_ * (wanted_height_mm() - dot(carrot_mm_, toward_));
  const Vec3 ahead = carrot_mm_ - at_mm_;
  const double up = dot(ahead, toward_);
  Vec3 sideways = ahead - toward_ * up;
  if (const double n = length(sideways); n > most_sideways_mm) sideways = sideways * (most_sideways_mm / n);
  double depth = up;
  if (drilling) {
    // How far the burr that it sees, which stays at the bone's surface, still is from where it wants to come to.
    const double above = felt_n_ * yields_mm_per_n_ - up;
    if (above > 0) depth = -press_n * std::min(1.0, above / kEaseMm) / kSpringNPerMm;
  }
  HandGoal goal;
  // What its own damping holds back is added, so that it keeps up with its speed.
  goal.position_mm = at_mm_ + sideways + toward_ * depth + carrot_speed_mm_s_ * (kDampingNsPerMm / kSpringNPerMm);
  if (skill_.tremor_mm > 0) {
    // The spring takes half of it at these frequencies: 1 + (10 Hz / 11.6 Hz)^2.
    constexpr double kThroughSpring = 1.74;
    for (std::size_t a = 0; a < 3; ++a) goal.position_mm[a] += skill_.tremor_mm * kThroughSpring * tremor_[a].at(t_s);
  }
  if (!done()) axis_ = normalized(axis_ + (stroke_.points[next_].axis - axis_) * std::min(1.0, dt_s / kAxisS));
  goal.axis = to_floats(axis_);
  goal.pedal = drilling ? 255 : 0;
  goal.tool = stroke_.tool;
  const DeviceSample sample = hand_.step(goal, dt_s, force_n);
  at_mm_ = hand_.position_mm();
  return sample;
}

}  // namespace osteo::inline assessment
