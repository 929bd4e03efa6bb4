#include "osteo/assessment/evidence/detail/process.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "osteo/assessment/evidence/visibility.h"
#include "osteo/core/statistics/basics.h"
#include "osteo/simulation/bone/instrument.h"
#include "osteo/simulation/haptics/saw_slot.h"

namespace osteo::inline assessment {
namespace {

constexpr double kPathStepMm = 0.05;  // less is no way: as strokes go by
// A force above a limit that comes again within a second is told once.
constexpr double kSameExcessS = 1;
// Of NearMetric::kBandsMm.
constexpr MetricName kNearS[] = {"near_05_s", "near_1_s", "near_s", "near_4_s"};
constexpr MetricName kNearMm3[] = {"near_05_mm3", "near_1_mm3", "near_mm3", "near_4_mm3"};
static_assert(std::size(kNearS) == NearMetric::kBandsMm.size() && NearMetric::kBandsMm[2] == kNearMm);

bool drills(const TickRecord& t, const Instrument& tool) {
  return tool.cutter() != nullptr && static_cast<double>(t.speed_rpm) > kTurnsRpm && t.normal_force_n > 0;
}
double seconds(std::uint64_t ticks, double rate_hz) {
  return static_cast<double>(ticks) / rate_hz;
}
// Of sorted values: the smallest that at least a share q is not above.
double quantile(const std::vector<float>& sorted, double q) {
  const auto n = static_cast<double>(sorted.size());
  const auto at = static_cast<std::size_t>(std::clamp(std::ceil(q * n) - 1, 0.0, n - 1));
  return static_cast<double>(sorted[at]);
}

}  // namespace

void ProcessMetric::frame(const EvidenceFrame& f) {
  lost_ += f.lost_before;
  if (f.lost_before > 0) {
    last_ = {};
    path_.forget();
    path_at_.reset();
  }
  for (const SceneAction& a : f.actions) {
    // Rate of a sucker, share that water carries away: 0 puts it away.
    if (a.is(ActionKind::suction)) sucker_ = a.values[4] > 0;
    if (a.is(ActionKind::irrigate)) water_ = a.values[4] > 0;
  }
  for (const VoxelChange& c : f.sawn) {
    if (const PlacedBody* const b = f.world.owner(c.voxel))
      sawn_mm3_ += static_cast<double>(c.before - c.density) * b->body->bone.frame().voxel_volume_mm3();
  }
  bool sucker_in_hand = false, water_in_hand = false;
  for (const TickRecord& t : f.ticks) {
    const Instrument& tool = instrument_of(t.device.tool);
    sucker_in_hand |= tool.kind == InstrumentKind::sucker && t.device.pedal > 0;
    water_in_hand |= tool.kind == InstrumentKind::irrigator && t.device.pedal > 0;
  }
  std::uint64_t ticks = 0;
  const auto every = std::max<std::uint64_t>(1, static_cast<std::uint64_t>(std::llround(f.rate_hz / 100)));
  for (const TickRecord& t : f.ticks) {
    const Instrument& tool = instrument_of(t.device.tool);
    if (t.hand == 0) {
      ++ticks_;
      ++ticks;
      ++by_tool_[t.device.tool];
    }
    const Vec3 at = from_floats(t.device.position_mm), force = from_floats(t.force_n);
    Last& last = last_[t.hand];
    const bool good = (t.flags & (kPoseInvalid | kPoseJumped)) == 0;
    // Against the force on the hand, trapezoidal: what the hand puts in.
    if (last.known && good) work_mj_ -= dot((force + last.force_n) * 0.5, at - last.at_mm);
    last = {good, at, force};
    idle_.add(t);
    if (t.hand == 0) {
      if (good) {
        path_.add(t.tick, at);
      } else {
        path_.forget();
        path_at_.reset();
      }
      if (const auto place = path_.place_mm(); place && t.tick % every == 0) {
        const double step = path_at_ ? length(*place - *path_at_) : 0;
        if (step >= kPathStepMm) path_mm_ += step;
        if (!path_at_ || step >= kPathStepMm) path_at_ = place;
      }
    }
    removed_mm3_ += static_cast<double>(t.removed_mm3);
    if (t.removed_mm3 > 0) removed_by_tool_[t.device.tool] += static_cast<double>(t.removed_mm3);
    if (!drills(t, tool)) continue;
    const double t_s = seconds(t.tick, f.rate_hz);
    ++drilling_;
    if (sucker_ || sucker_in_hand) ++sucking_;
    if (water_ || water_in_hand) ++rinsing_;
    forces_n_.push_back(t.normal_force_n);
    if (static_cast<double>(t.normal_force_n) > peak_n_) {
      peak_n_ = static_cast<double>(t.normal_force_n);
      peak_ = {t_s, at, "hardest press", {}, peak_n_, 0};
    }
    if (const double n = length(force); n > 0) {
      const double cosine = std::abs(dot(force / n, normalized(from_floats(t.device.axis))));
      if (cosine <= std::cos(std::numbers::pi / 6)) ++upright_;
    }
    if (t.hand == 0) strokes_.add(t_s, at);
  }
  volume_at_.emplace_back(f.ticks.empty() ? (volume_at_.empty() ? 0 : volume_at_.back().first)
                                          : seconds(f.ticks.back().tick + 1, f.rate_hz),
                          removed_mm3_);
  if (f.camera != nullptr) {
    const bool moved =
        camera_ && (!(camera_->eye_mm == f.camera->eye_mm) || !(camera_->target_mm == f.camera->target_mm));
    if (moved) camera_ticks_ += ticks;
    if (moved && !camera_moving_) ++camera_moves_;
    camera_moving_ = moved;
    camera_ = *f.camera;
    any_camera_ = true;
  }
}

void ProcessMetric::finish(const World& /*world*/, std::vector<Measured>& values, std::vector<Moment>& moments) {
  const double hz = scene_.rate_hz, drilling_s = seconds(drilling_, hz);
  values.push_back(measured("duration_s", seconds(ticks_, hz)));
  if (lost_ > 0) values.push_back(measured("lost_s", seconds(lost_, hz)));
  values.push_back(measured("drilling_s", drilling_s));
  values.push_back(measured("idle_s", seconds(idle_.idle_ticks(), hz)));
  values.push_back(measured("removed_mm3", removed_mm3_));
  if (sawn_mm3_ > 0) values.push_back(measured("sawn_mm3", sawn_mm3_));
  values.push_back(measured("path_mm", path_mm_));
  values.push_back(measured("work_mj", work_mj_));
  for (const auto& [tool, ticks] : by_tool_)
    values.push_back(measured("instrument_s", seconds(ticks, hz), instrument_of(tool).name));
  for (const auto& [tool, mm3] : removed_by_tool_)
    values.push_back(measured("instrument_mm3", mm3, instrument_of(tool).name));
  if (any_camera_) {
    values.push_back(measured("camera_moves", static_cast<double>(camera_moves_)));
    values.push_back(measured("camera_s", seconds(camera_ticks_, hz)));
  } else {
    not_measured_all(values, MetricPlace::process, {MetricWhen::camera}, "the session has no camera notes");
  }
  if (drilling_ == 0) {
    not_measured_all(values, MetricPlace::process,
                     {MetricWhen::drilling, MetricWhen::stroke, MetricWhen::smooth_stroke, MetricWhen::removal},
                     "no burr drilled");
    return;
  }
  const auto share = [&](std::uint64_t n) { return static_cast<double>(n) / static_cast<double>(drilling_); };
  values.push_back(measured("rate_mm3_per_s", removed_mm3_ / drilling_s));
  std::sort(forces_n_.begin(), forces_n_.end());
  values.push_back(measured("force_median_n", quantile(forces_n_, 0.5)));
  values.push_back(measured("force_p95_n", quantile(forces_n_, 0.95)));
  values.push_back(measured("force_peak_n", peak_n_));
  moments.push_back(peak_);
  values.push_back(measured("suction_share", share(sucking_)));
  values.push_back(measured("irrigation_share", share(rinsing_)));
  values.push_back(measured("burr_side_share", share(upright_)));
  const std::vector<Stroke>& strokes = strokes_.finish();
  values.push_back(measured("strokes", static_cast<double>(strokes.size())));
  if (strokes.empty()) {
    not_measured_all(values, MetricPlace::process, {MetricWhen::stroke, MetricWhen::smooth_stroke},
                     "no stroke of 1 mm and 80 ms");
  } else {
    std::vector<double> mm, s, sparc, jerk;
    for (const Stroke& k : strokes) {
      mm.push_back(k.length_mm);
      s.push_back(k.end_s - k.begin_s);
      if (!std::isnan(k.sparc)) sparc.push_back(k.sparc);
      if (!std::isnan(k.log_dimensionless_jerk)) jerk.push_back(k.log_dimensionless_jerk);
    }
    const auto median = [](const std::vector<double>& v) { return statistics::quantile(v, 0.5); };
    values.push_back(measured("strokes_per_s", static_cast<double>(strokes.size()) / drilling_s));
    values.push_back(measured("stroke_mm", median(mm)));
    values.push_back(measured("stroke_s", median(s)));
    values.push_back(measured("stroke_variance", stroke_variance(strokes)));
    const auto smooth = [&](MetricName name, const std::vector<double>& v) {
      values.push_back(v.empty() ? not_measured(name, "no stroke of 100 ms") : measured(name, median(v)));
    };
    smooth("stroke_sparc", sparc);
    smooth("stroke_ldlj", jerk);
  }
  if (removed_mm3_ <= 0) {
    not_measured_all(values, MetricPlace::process, {MetricWhen::removal}, "nothing was removed");
    return;
  }
  // When each fifth of the volume was gone.
  double before = 0;
  std::size_t at = 0;
  for (int fifth = 1; fifth <= 5; ++fifth) {
    while (at + 1 < volume_at_.size() && volume_at_[at].second < removed_mm3_ * fifth / 5 * (1 - 1e-12)) ++at;
    values.push_back(measured("phase_s", volume_at_[at].first - before, "fifth " + std::to_string(fifth)));
    before = volume_at_[at].first;
  }
}

NearMetric::NearMetric(const EvidenceScene& scene) : scene_(scene), hands_(Hand(scene.rate_hz)) {
  if (scene_.structures == nullptr) return;
  of_.resize(scene_.structures->values().size());
  each_.resize(of_.size());
  for (Hand& hand : hands_) hand.at.resize(of_.size());
  if (scene_.procedure == nullptr) return;
  for (Hand& hand : hands_) hand.excess.resize(scene_.procedure->force_limits.size());
  steps_.emplace(*scene_.structures, *scene_.procedure, scene_.rate_hz);
}

void NearMetric::forget() {
  for (Hand& hand : hands_) {
    hand.motion.forget();
    hand.waiting.clear();
    for (Contact& c : hand.at) {
      c.touch.forget();
      c.injury.forget();
    }
  }
}

// Gives samples of a window ago their speeds.
void NearMetric::move(Hand& hand, const TickRecord& t) {
  if ((t.flags & (kPoseInvalid | kPoseJumped)) != 0) {
    hand.motion.forget();
    hand.waiting.clear();
    return;
  }
  hand.motion.add(t.tick, from_floats(t.device.position_mm));
  const auto speed = hand.motion.speed_mm_s();
  if (!speed) return;
  std::erase_if(hand.waiting, [&](const Waiting& w) {
    if (w.tick == hand.motion.speed_tick()) samples_[w.structure][w.number].speed_mm_s = static_cast<float>(*speed);
    return w.tick <= hand.motion.speed_tick();
  });
}

void NearMetric::frame(const EvidenceFrame& f) {
  if (scene_.structures == nullptr) return;
  if (f.lost_before > 0) forget();
  const auto every = std::max<std::uint64_t>(1, static_cast<std::uint64_t>(std::llround(f.rate_hz / 100)));
  const RigidTransform own = f.world.bodies().front().world_from_body.inverse();
  const std::vector<std::uint8_t>& names = scene_.structures->values();
  for (const TickRecord& t : f.ticks) {
    if (t.hand == 0) ++known_;
    Hand& hand = hands_[t.hand];
    const bool first = !std::exchange(hand.begun, true);
    move(hand, t);
    const Vec3 device_at = from_floats(t.device.position_mm);
    const Instrument& tool = instrument_of(t.device.tool);
    if ((t.flags & kPlateInHand) != 0) continue;
    const bool turns = tool.cutter() != nullptr && static_cast<double>(t.speed_rpm) > kTurnsRpm;
    if (!turns && (t.flags & kStructureTouched) == 0 && tool.cutter() == nullptr) continue;
    const Vec3 at = own(device_at + from_floats(t.shown_offset_mm));
    scene_.structures->clearance(tool.head, at, own.rotation * tool_axis(t, f.world.cutting_guide(t.hand)), each_);
    const bool works = drills(t, tool), removes = t.removed_mm3 > 0;
    const double t_s = seconds(t.tick, f.rate_hz), force = static_cast<double>(t.normal_force_n);
    if (works && t.hand == 0 && steps_) steps_->drill(known_ - 1, each_);
    for (std::size_t s = 0; s < of_.size(); ++s) {
      Of& o = of_[s];
      const double d = each_[s];
      o.least_mm = std::min(o.least_mm, d);
      const bool touches = d <= 0, injures = touches && turns;
      // Time is counted once, whichever and however many hands are there.
      const auto count = [&](std::uint64_t& ticks, std::uint64_t& until) {
        if (until <= t.tick) ++ticks;
        until = t.tick + 1;
      };
      if (touches) {
        count(o.touched, o.touched_until);
        o.touched_first = o.touched_first || first;
        if (hand.at[s].touch.begins(t.tick, f.rate_hz, kSameContactS)) ++o.touches;
      }
      if (injures) {
        count(o.injured, o.injured_until);
        if (hand.at[s].injury.begins(t.tick, f.rate_hz, kSameContactS))
          moments_.push_back(
              {t_s, at, tool.kind == InstrumentKind::saw ? "reached by the running saw" : "reached by a rotating burr",
               scene_.structures->name_of(names[s]), d, 0});
      }
      for (std::size_t b = 0; b < kBandsMm.size(); ++b) {
        if (d >= kBandsMm[b]) continue;
        if (works) ++o.near[b];
        if (removes) o.near_mm3[b] += static_cast<double>(t.removed_mm3);
      }
      if (works && d < scene_.structures->reach_mm() && t.tick % every == 0) {
        std::vector<Sample>& samples = samples_[names[s]];
        hand.waiting.push_back({t.tick, names[s], samples.size()});
        samples.push_back({t_s, at, static_cast<float>(d), t.normal_force_n, std::numeric_limits<float>::quiet_NaN()});
      }
    }
    if (!works || scene_.procedure == nullptr) continue;
    bool ruled = false, allowed = true;
    for (const InstrumentRule& r : scene_.procedure->instruments) {
      for (std::size_t s = 0; s < of_.size(); ++s) {
        if (each_[s] >= r.within_mm || scene_.structures->name_of(names[s]) != r.structure) continue;
        ruled = true;
        const Burr& burr = *tool.cutter();
        allowed = allowed && burr.diameter_mm <= r.most_diameter_mm + 1e-9 &&
                  !(r.diamond_only && !row_of(burr.kind).near_structures);
      }
    }
    if (ruled) {
      ++ruled_;
      allowed_ += allowed ? 1 : 0;
    }
    for (std::size_t l = 0; l < scene_.procedure->force_limits.size(); ++l) {
      const ForceLimit& limit = scene_.procedure->force_limits[l];
      for (std::size_t s = 0; s < of_.size(); ++s) {
        if (each_[s] >= limit.within_mm || force <= limit.most_n ||
            scene_.structures->name_of(names[s]) != limit.structure)
          continue;
        of_[s].excess_ns += (force - limit.most_n) / f.rate_hz;
        if (hand.excess[l].begins(t.tick, f.rate_hz, kSameExcessS))
          moments_.push_back({t_s, at, "pressed too hard near it", limit.structure, force, limit.most_n});
      }
    }
  }
}

void NearMetric::finish(const World& /*world*/, std::vector<Measured>& values, std::vector<Moment>& moments) {
  if (scene_.structures == nullptr) {
    not_measured_all(values, MetricPlace::near, {MetricWhen::structures}, "the case has no structures");
    return;
  }
  for (std::size_t s = 0; s < of_.size(); ++s) {
    if (scene_.opens(s)) continue;
    const Of& o = of_[s];
    const std::string name = scene_.structures->name_of(scene_.structures->values()[s]);
    if (o.least_mm < scene_.structures->reach_mm()) {
      values.push_back(measured("clearance_mm", o.least_mm, name));
    } else {
      values.push_back(not_measured(
          "clearance_mm", "no burr came within " + format_number(scene_.structures->reach_mm()) + " mm", name));
    }
    values.push_back(measured("touches", static_cast<double>(o.touches), name));
    values.push_back(measured("touched_s", seconds(o.touched, scene_.rate_hz), name));
    values.push_back(measured("injured_s", seconds(o.injured, scene_.rate_hz), name));
    for (std::size_t b = 0; b < kBandsMm.size(); ++b) {
      values.push_back(measured(kNearS[b], seconds(o.near[b], scene_.rate_hz), name));
      values.push_back(measured(kNearMm3[b], o.near_mm3[b], name));
    }
    if (o.touched_first) moments.push_back({0, {}, "touched from the first tick on", name, 0, 0});
    for (const Moment& m : moments_) {
      if (m.structure == name) moments.push_back(m);
    }
  }
  if (scene_.procedure == nullptr) return;
  steps_->finish(values);
  for (const ForceLimit& l : scene_.procedure->force_limits) {
    for (std::size_t s = 0; s < of_.size(); ++s) {
      if (scene_.structures->name_of(scene_.structures->values()[s]) == l.structure)
        values.push_back(measured("excess_force_ns", of_[s].excess_ns, l.structure));
    }
  }
  if (!scene_.procedure->instruments.empty()) {
    values.push_back(ruled_ == 0
                         ? not_measured("burr_choice_share", "no burr drilled where a rule on burrs holds")
                         : measured("burr_choice_share", static_cast<double>(allowed_) / static_cast<double>(ruled_)));
  }
}

}  // namespace osteo::inline assessment
