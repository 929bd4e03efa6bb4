#include "osteo/simulation/haptics/renderer.h"

#include <algorithm>
#include <cmath>

#include "hand_renderer.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/portable_math.h"

namespace osteo::inline simulation {
namespace {

constexpr int kMapBudget = 48;  // blocks of the distance map a tick, 5 us

// Of the way to where a first-order lag goes, in a tick.
double share_of(double time_constant_s, double dt_s) {
  return time_constant_s > 0 ? 1 - portable::exp(-dt_s / time_constant_s) : 1;
}

}  // namespace

HapticRenderer::HapticRenderer(const HapticSetup& setup, const Anatomy& anatomy, double dt_s)
    : setup_(setup), anatomy_(anatomy), common_(std::make_unique<Common>()) {
  if (!(dt_s > 0) || !(dt_s <= 1)) throw Error(ExitCode::usage, "the servo's rate must be a number from 1 Hz on");
  if (setup.hands() > kMaxHands)
    throw Error(ExitCode::usage, std::to_string(setup.hands()) + " hands are too many",
                "at most " + std::to_string(kMaxHands));
  if (anatomy_.structures) {
    clearances_.resize(anatomy_.structures->values().size());
    met_.resize(clearances_.size());
    events_.assign(clearances_.size(), {anatomy_.structures->reach_mm(), 0, 0});
  }
  if (setup.curve.size() >= 2) curve_.emplace(setup.curve);
  common_->dt_s = dt_s;
  common_->method_of_tool.resize(instrument_library().size());
  common_->params = setup.params;
  for (std::size_t h = 0; h < setup.hands(); ++h)
    hands_.push_back(std::make_unique<HandRenderer>(*common_, setup_, h, h == 0 && curve_ ? &*curve_ : nullptr));
  records_.resize(hands_.size());
  set(setup.params);
}

HapticRenderer::HapticRenderer(const HapticSetup& setup, BrickGrid& bone, const Anatomy& anatomy, double dt_s)
    : HapticRenderer(setup, anatomy, dt_s) {
  own_.add(std::make_shared<TouchedBone>(bone, anatomy.hardness), {}, setup_);
  show(&own_);
}

HapticRenderer::~HapticRenderer() = default;

void HapticRenderer::show(HapticScene* scene) noexcept {
  common_->scene = scene;
}

void HapticRenderer::hold(bool on) noexcept {
  common_->held = on;
}

void HapticRenderer::set(const HapticsParams& params) noexcept {
  common_->params = params;
  common_->up_share = share_of(params.effects.spin_up_s, common_->dt_s);
  common_->down_share = share_of(params.effects.spin_down_s, common_->dt_s);
  for (std::size_t tool = 0; tool < common_->method_of_tool.size(); ++tool)
    common_->method_of_tool[tool] = method_of(setup_, params.contact.method, tool);
  for (const auto& hand : hands_) hand->set();
}

void HapticRenderer::push(const SceneAction& soft_push) noexcept {
  if (soft_push.hand < hands_.size()) hands_[soft_push.hand]->push(soft_push);
}

void HapticRenderer::guide(const SceneAction& action) noexcept {
  const HandGuide guide = guide_of(action);
  if (guide.hand >= hands_.size() || guide.leader >= hands_.size()) return;
  hands_[guide.hand]->guide(guide);
  any_led_ = std::any_of(hands_.begin(), hands_.end(), [](const auto& h) { return h->guided().on(); });
}

// Who leads, and what the led are told of it: poses of this tick, the leader's force of the tick before.
void HapticRenderer::lead(std::span<const DeviceSample> samples) noexcept {
  for (const auto& hand : hands_)
    hand->leads(!hand->guided().on());  // other hands of a lesson stand still with the first
  for (const auto& hand : hands_) {
    const HandGuide& guide = hand->guided();
    if (!guide.on()) continue;
    hands_[guide.leader]->leads(true);
    hand->led(samples[guide.leader], from_floats(records_[guide.leader].force_n));
  }
}

const ContactResult& HapticRenderer::contact(std::size_t hand) const {
  return hands_[hand]->contact();
}

double HapticRenderer::stiffness_n_per_mm(std::size_t hand) const {
  return hands_[hand]->stiffness_n_per_mm();
}

// What is at risk belongs to the patient: it goes with the first body.
void HapticRenderer::watch(HandRenderer& hand) noexcept {
  const RigidTransform& own = common_->scene->items.front().body_from_world;
  const auto nearest =
      anatomy_.structures->clearance(hand.head(), own(hand.shown_mm()), own.rotation * hand.axis(), clearances_);
  hand.record().clearance_mm = static_cast<float>(nearest.distance_mm);
  hand.record().structure = nearest.structure;
  for (std::size_t s = 0; s < events_.size(); ++s) {
    if (anatomy_.structures->opened(s)) continue;
    events_[s].least_clearance_mm = std::min(events_[s].least_clearance_mm, clearances_[s]);
    if (clearances_[s] > 0) continue;
    hand.flag(kStructureTouched | (hand.cuts() ? kStructureInjured : 0U));
    met_[s] = std::max<std::uint8_t>(met_[s], hand.cuts() ? 2 : 1);
  }
}

std::map<std::uint32_t, StructureEvents> HapticRenderer::structure_events() const {
  std::map<std::uint32_t, StructureEvents> by_value;
  for (std::size_t s = 0; s < events_.size(); ++s) {
    if (events_[s].least_clearance_mm < anatomy_.structures->reach_mm())
      by_value.emplace(anatomy_.structures->values()[s], events_[s]);
  }
  return by_value;
}

HapticRenderer::Step HapticRenderer::step(std::span<const DeviceSample> samples) noexcept {
  HapticScene& scene = *common_->scene;
  if (any_led_) lead(samples);
  for (std::size_t h = 0; h < hands_.size(); ++h) hands_[h]->feel(samples[h]);
  if (anatomy_.structures && !scene.items.empty()) {
    std::fill(met_.begin(), met_.end(), std::uint8_t{0});
    for (const auto& hand : hands_) {
      if (hand->has_head()) watch(*hand);
    }
    for (std::size_t s = 0; s < events_.size(); ++s) {
      events_[s].ticks_touched += met_[s] > 0 ? 1 : 0;
      events_[s].ticks_injured += met_[s] > 1 ? 1 : 0;
    }
  }
  std::size_t changed = 0;
  for (std::size_t h = 0; h < hands_.size(); ++h) {
    hands_[h]->remove(changed);
    records_[h] = hands_[h]->finish();
  }
  for (const HapticScene::Item& item : scene.items) {
    if (item.depth_map) item.depth_map->update(item.bone->bone(), {}, kMapBudget);
  }
  return {records_, {scene.changes.data(), changed}};
}

HapticRenderer::HandStep HapticRenderer::step(const DeviceSample& sample) noexcept {
  const Step s = step({&sample, 1});
  return {s.hands.front(), s.changes};
}

}  // namespace osteo::inline simulation
