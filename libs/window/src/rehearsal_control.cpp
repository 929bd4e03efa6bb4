#include "rehearsal_control.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <new>

#include "osteo/base/error.h"
#include "osteo/grid/brick_places.h"

namespace osteo {

// --- sessions

template <class F>
bool RehearsalControl::guarded(F&& f) {
  try {
    f();
    return true;
  } catch (const Error& e) {
    failure_ = e;
  } catch (const std::bad_alloc&) {
    failure_ = Error(ExitCode::resources, "out of memory");
  } catch (const std::exception& e) {
    failure_ = Error(ExitCode::unspecified, std::string("unexpected: ") + e.what(), "this is a defect of the program; please report it");
  }
  return false;
}

void RehearsalControl::measure(const World& world) {
  Vec3 lo{1e30, 1e30, 1e30}, hi{-1e30, -1e30, -1e30};
  const BrickGrid& bone = world.bodies().front().body->bone;
  for (std::uint32_t b = 0; b < bone.brick_count(); ++b) {
    const Vec3 p = middle_of_brick_mm(bone, b);
    for (std::size_t a = 0; a < 3; ++a) {
      lo[a] = std::min(lo[a], p[a]);
      hi[a] = std::max(hi[a], p[a]);
    }
  }
  centre_mm_ = (lo + hi) * 0.5;
  radius_mm_ = std::max(5.0, 0.5 * length(hi - lo));
}

bool RehearsalControl::begin(bool from_case, bool save_first) {
  failure_.reset();
  leading_.reset();
  ran_ = latched_ = sucking_ = washing_ = false;
  const bool saved = !save_first || guarded([&] { actions_.save(); });
  if (!saved) lost_ = failure_;
  const bool begun = saved && guarded([&] {
                       goal_ = actions_.begin(from_case, {towards_eye(), wanted_axis(), tool_});
                       axis_ = from_floats(goal_.axis);
                       rehearsal().look([&](const World& world, SceneReaders&) { measure(world); });
                       tools_.renew(centre_mm_, 2 * radius_mm_);
                       show_(rehearsal());
                     });
  // A session that nobody can see is closed, with the reason kept.
  if (saved && !begun && actions_.rehearsal() != nullptr) {
    const std::optional<Error> why = failure_;
    guarded([&] { actions_.save(); });
    failure_ = why;
  }
  return begun;
}

void RehearsalControl::save() {
  if (begin(false, true)) say("saved; a new session goes on from here");
}

void RehearsalControl::reset() {
  if (begin(true, true)) say("the bone is whole again; the session before was saved");
}

bool RehearsalControl::end() {
  leading_.reset();
  const bool saved = guarded([&] { actions_.save(); });
  if (!saved) lost_ = failure_;
  ran_ = latched_ = sucking_ = washing_ = false;
  return saved;
}

void RehearsalControl::watch() {
  const Rehearsal* const running = actions_.rehearsal();
  if (running == nullptr || failure_) return;
  if (const std::optional<Error> failed = actions_.failure()) {
    guarded([&] {
      actions_.save();
      throw Error(*failed);
    });
    lost_ = failure_;
  } else if (running->running()) {
    ran_ = true;
  } else if (ran_) {
    guarded([&] {
      actions_.save();
      throw Error(ExitCode::failed, "the session has ended by itself; it is saved", "please report this with the session");
    });
    lost_ = failure_;
  }
}

// --- the hand

// A drill is held from the right; a plate lies flat against what one looks at.
Vec3 RehearsalControl::wanted_axis() const {
  return plate_in_hand() ? view_.forward * -1 : normalized(view_.right * 0.62 + view_.up * 0.45 - view_.forward * 0.64);
}

// Where the hand is; before the first tick, where it will be.
HandPose RehearsalControl::hand_pose() const {
  const TickRecord tick = rehearsal().latest();
  if (tick.tick == 0) return {goal_.position_mm, from_floats(goal_.axis)};
  return {from_floats(tick.device.position_mm), from_floats(tick.device.axis)};
}

FreeWays RehearsalControl::free_ways(bool whole_tool) const {
  ToolSkin skin = plate_in_hand() ? skin_of_plate(tools_.plate(), tools_.plate_grip())
                                  : skin_of_instrument(static_cast<std::size_t>(tool_), whole_tool);
  std::optional<FreeWays> ways;
  rehearsal().look([&](const World& world, SceneReaders&) { ways.emplace(world, std::move(skin), rehearsal().structures()); });
  return *std::move(ways);
}

bool RehearsalControl::outside() const {
  const FreeWays ways = free_ways(true);
  return length(hand_pose().at_mm - ways.centre_mm()) > ways.radius_mm();
}

void RehearsalControl::move_hand(Vec3 to_mm) {
  if (!leading_) goal_.position_mm = to_mm;
}

void RehearsalControl::push_hand(double deeper_mm) {
  if (!leading_) goal_.position_mm += view_.forward * deeper_mm;
}

// The handle follows the view, as far as bone lets it.
void RehearsalControl::turn_handle(double seconds) {
  constexpr double kRadPerS = 4;
  const Vec3 wanted = wanted_axis();
  if (length(wanted - axis_) < 1e-3) return;
  axis_ = free_ways(false).turned({hand_pose().at_mm, axis_}, wanted, kRadPerS * std::min(seconds, 0.2));
}

void RehearsalControl::send_goal(double seconds) {
  Device& device = rehearsal().device();
  device.set_tool(static_cast<std::uint8_t>(tool_));
  if (leading_) {
    latched_ = false;
    return;
  }
  auto* const mouse = dynamic_cast<MouseDevice*>(&device);
  if (mouse == nullptr) {  // it moves by itself, and drills by a pedal of its own where it has one
    if (actions_.press) actions_.press(latched_ || held_);
    return;
  }
  turn_handle(seconds);
  goal_.axis = to_floats(axis_);
  goal_.tool = static_cast<std::uint8_t>(tool_);
  goal_.pedal = latched_ || held_ ? 255 : 0;
  mouse->set_goal(goal_);
}

void RehearsalControl::lead(std::optional<Vec3> seen_mm, Vec3 forward) {
  if (!rehearsal().device().lead({})) {
    say("the drill is in your own hand");
    return;
  }
  leading_ = Leading{Leading::Stage::letting_go, {}, seen_mm, forward, {}};
  latched_ = false;
  wait_for_release_ = true;
}

void RehearsalControl::lift() {
  lead(std::nullopt, {});
}

void RehearsalControl::bring(Vec3 direction) {
  std::optional<BoneHit> hit;
  rehearsal().look([&](const World& world, SceneReaders&) {
    hit = bone_on_ray(world, view_.eye_mm, direction, length(centre_mm_ - view_.eye_mm) + 4 * radius_mm_);
  });
  if (!hit) {
    say("no bone under the mouse");
    return;
  }
  lead(hit->at_mm, direction);
}

// No way was free of structures at risk.
static constexpr const char* kPastStructures = "; past a structure at risk, since no other way was free";

void RehearsalControl::go_on_leading() {
  if (!leading_) return;
  Device& device = rehearsal().device();
  const Led led = device.led();
  if (led == Led::on_the_way) return;
  const auto go = [&](Leading::Stage stage, const HandWay& way, const HandPose& end) {
    leading_->stage = stage;
    goal_.position_mm = end.at_mm;
    axis_ = end.axis;
    goal_.axis = to_floats(axis_);
    goal_.pedal = 0;
    device.lead(way);
  };
  const auto waiting = [&](const FreeWays& ways) { return ways.waiting(towards_eye(), wanted_axis()); };
  if (leading_->stage == Leading::Stage::letting_go) {
    const std::uint64_t tick = rehearsal().latest().tick;
    if (!leading_->quiet_tick) leading_->quiet_tick = tick;
    if (tick <= *leading_->quiet_tick) return;
    const FreeWays ways = free_ways(true);
    const HandPose from = hand_pose();
    if (leading_->seen_mm) {
      const FreeWays::Found a = ways.approach(from, *leading_->seen_mm, leading_->forward, wanted_axis());
      const double gap = length(a.end.at_mm - *leading_->seen_mm) - burr().diameter_mm / 2;
      char far[80];
      std::snprintf(far, sizeof far, "the drill gets no nearer than %.0f mm this way", gap);
      leading_->done = a.way.put ? "the drill was shut in; it was taken out and set down there"
                       : gap > 6 ? far
                                 : "drill brought to the bone";
      if (a.past_structures) leading_->done += kPastStructures;
      go(Leading::Stage::on_the_way, a.way, a.end);
    } else {
      const HandPose to = waiting(ways);
      const FreeWays::Found out = ways.way(from, to);
      leading_->done = out.way.put ? "the drill was shut in; it was taken out" : "drill lifted out";
      if (out.past_structures) leading_->done += kPastStructures;
      go(Leading::Stage::on_the_way, out.way, to);
    }
  } else if (led == Led::blocked && leading_->stage == Leading::Stage::on_the_way) {
    leading_->done = "the drill was stuck; it was taken out";
    const HandPose to = waiting(free_ways(true));
    HandWay way;
    way.put = true;
    way.points[0] = {to.at_mm, to_floats(to.axis), false};
    way.count = 1;
    go(Leading::Stage::put, way, to);
  } else {
    say(leading_->done);
    leading_.reset();
  }
}

void RehearsalControl::take_burr(int tool) {
  if (leading_) {  // on a way that was found for the burr that it has
    say("the drill is on its way: change the burr when it has arrived");
    return;
  }
  tool_ = tool;
}
void RehearsalControl::take_burr(BurrKind kind) {
  take_burr(burr_index(kind, burr().diameter_mm, burr().shape));
}
void RehearsalControl::take_burr(BurrShape shape) {
  take_burr(burr_index(burr().kind, burr().diameter_mm, shape));
}
void RehearsalControl::take_burr_of(int diameter_mm) {
  take_burr(burr_index(burr().kind, diameter_mm, burr().shape));
}

// --- a frame

bool RehearsalControl::command(const Keyboard::Press& press, const std::optional<Vec3>& direction) {
  if (tools_.key(press.command, rehearsal(), view_)) return true;
  switch (press.command) {
    case Command::deeper:
      push_hand(0.25);
      return true;
    case Command::back:
      push_hand(-0.25);
      return true;
    case Command::bring:
      if (direction) bring(*direction);
      return true;
    case Command::lift:
      lift();
      return true;
    case Command::drill:
      latch(!latched_);
      return true;
    case Command::diameter:
      take_burr_of(press.value);
      return true;
    case Command::cutting:
      take_burr(BurrKind::cutting);
      return true;
    case Command::diamond:
      take_burr(BurrKind::diamond);
      return true;
    case Command::ball:
      take_burr(BurrShape::ball);
      return true;
    case Command::cylinder:
      take_burr(BurrShape::cylinder);
      return true;
    case Command::taper:
      take_burr(BurrShape::taper);
      return true;
    case Command::save:
      save();
      return true;
    case Command::reset:
      reset();
      return true;
    case Command::second_hand:
      take_next_second();
      return true;
    default:
      return false;
  }
}

void RehearsalControl::hold(const HandInput& input) {
  // A button that was held when the hand was led away does not drill where it arrives.
  if (!input.pressed && !leading_) wait_for_release_ = false;
  held_ = input.pressed && !wait_for_release_ && input.on_bone && tools_.tool() == HandTools::Tool::drill;
  if (input.pad && !leading_) {
    const PadMotion& pad = *input.pad;
    goal_.position_mm +=
        (view_.right * pad.right_mm_s + view_.up * pad.up_mm_s + view_.forward * pad.deeper_mm_s) * std::min(input.seconds, 0.1);
    if (!pad.drill && !held_) wait_for_release_ = false;
    held_ = held_ || (pad.drill && !wait_for_release_);
  }
  // Who takes up the saw or a piece lets go of the drill: it does not stay in the bone.
  const bool in_hand = tools_.in_hand();
  if (in_hand_ && !in_hand && !leading_ && !outside()) lift();
  in_hand_ = in_hand;
  go_on_leading();
  send_goal(input.seconds);
}

// What the second hand may hold, in turn; the first: nothing.
static constexpr const char* kSecond[] = {"", "sucker 10 Fr", "irrigator 2 mm", "probe 1 mm"};

void RehearsalControl::take_next_second() {
  if (rehearsal().hands() < 2) {
    say("there is no second hand: --dust, or --second-device");
    return;
  }
  second_ = (second_ + 1) % std::size(kSecond);
  Device& device = rehearsal().device(1);
  if (dynamic_cast<MouseDevice*>(&device) == nullptr) {
    second_ = std::max<std::size_t>(second_, 1);
    device.set_tool(static_cast<std::uint8_t>(instrument_index(kSecond[second_])));
  }
  say(second_ == 0 ? "second hand: nothing" : std::string("second hand: ") + kSecond[second_]);
}

void RehearsalControl::wash(bool suck, bool wash) {
  second_empty_ = false;
  auto* const hand = rehearsal().hands() > 1 ? dynamic_cast<MouseDevice*>(&rehearsal().device(1)) : nullptr;
  if (hand == nullptr) return;
  sucking_ = suck;
  washing_ = wash;
  const bool works = suck || wash;
  second_empty_ = !works && second_ == 0;
  const TickRecord tick = rehearsal().latest();
  HandGoal goal;
  goal.tool = static_cast<std::uint8_t>(instrument_index(suck   ? kSecond[1]
                                                         : wash ? kSecond[2]
                                                                : kSecond[std::max<std::size_t>(second_, 1)]));
  goal.pedal = works ? 255 : 0;
  goal.axis = to_floats(normalized(view_.right - view_.forward));
  const double gap = instrument_of(tick.device.tool).head.largest_radius_mm() + instrument_of(goal.tool).head.largest_radius_mm();
  goal.position_mm = from_floats(tick.device.position_mm) + from_floats(tick.shown_offset_mm) + view_.right * gap;
  // Held ready beside it, or put away.
  if (!works) goal.position_mm += second_ > 0 ? view_.right * 8 - view_.forward * 6 : view_.right * 30 - view_.forward * 40;
  hand->set_goal(goal);
}

// --- what is told

void RehearsalControl::say(const std::string& text) {
  message_ = text;
  message_until_ = std::chrono::steady_clock::now() + std::chrono::seconds(4);
  if (Rehearsal* const running = actions_.rehearsal()) running->note("message", text);
}

std::string RehearsalControl::told() const {
  if (leading_) return "the drill is on its way, off";
  return std::chrono::steady_clock::now() < message_until_ ? message_ : std::string();
}

}  // namespace osteo
