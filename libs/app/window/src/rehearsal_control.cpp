#include "rehearsal_control.h"

#include <algorithm>
#include <cmath>
#include <new>
#include <numbers>

#include "osteo/core/base/error.h"
#include "osteo/core/base/translate.h"
#include "osteo/geometry/grid/brick_places.h"
#include "osteo/simulation/haptics/device.h"

namespace osteo::inline app {

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
    failure_ = Error(ExitCode::unspecified, std::string("unexpected: ") + e.what(),
                     "this is a defect of the program; please report it");
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
  lead_pause_.end();
  ran_ = latched_ = false;
  second_.rest();
  second_.follow();
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
  if (begin(false, true)) say([&] { return tr("saved; a new session goes on from here"); });
}

void RehearsalControl::reset() {
  if (begin(true, true)) say([&] { return tr("bone reset; the session before was saved"); });
}

bool RehearsalControl::end() {
  leading_.reset();
  lead_pause_.end();
  const bool saved = guarded([&] { actions_.save(); });
  if (!saved) lost_ = failure_;
  ran_ = latched_ = false;
  second_.rest();
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
      throw Error(ExitCode::failed, "the session has ended by itself; it is saved",
                  "please report this with the session");
    });
    lost_ = failure_;
  }
}

// --- the hand

Vec3 RehearsalControl::wanted_axis() const {
  const Vec3 axis = handle_.axis(view_);
  // The blade along its plane: a mouse cannot feel which way that is.
  return tools_.saw_in_hand() && std::abs(dot(axis, tools_.guide().normal)) < 0.98 ? tools_.guide().along(axis) : axis;
}

int RehearsalControl::instrument() const {
  static const int saw = instrument_index("saw 25 mm");
  return tools_.saw_in_hand() ? saw : tool_;
}

// Where the tool is: bone may hold it back from the hand. Before the first tick, where it will be.
HandPose RehearsalControl::hand_pose() const {
  const TickRecord tick = rehearsal().latest();
  if (tick.tick == 0) return {goal_.position_mm, from_floats(goal_.axis)};
  return {from_floats(tick.device.position_mm) + from_floats(tick.shown_offset_mm), from_floats(tick.device.axis)};
}

PathPlanner RehearsalControl::path_planner(bool whole_tool) const {
  ToolSkin skin = plate_in_hand() ? skin_of_plate(tools_.plate(), tools_.plate_grip())
                                  : skin_of_instrument(static_cast<std::size_t>(instrument()), whole_tool);
  std::optional<PathPlanner> ways;
  rehearsal().look(
      [&](const World& world, SceneReaders&) { ways.emplace(world, std::move(skin), rehearsal().structures()); });
  return *std::move(ways);
}

bool RehearsalControl::outside() const {
  const PathPlanner ways = path_planner(true);
  return length(hand_pose().at_mm - ways.centre_mm()) > ways.radius_mm();
}

void RehearsalControl::move_hand(Vec3 to_mm) {
  if (!leading_) goal_.position_mm = to_mm;
}

bool RehearsalControl::moves_by_itself() const {
  return dynamic_cast<const MouseDevice*>(&rehearsal().device()) == nullptr;
}

void RehearsalControl::drag_hand(const MouseStep& step) {
  if (!leading_) goal_.position_mm = motion_.moved(goal_.position_mm, step);
}

void RehearsalControl::push_hand(double deeper_mm) {
  if (!leading_) goal_.position_mm += view_.forward * (deeper_mm * motion_.factor());
}

void RehearsalControl::tilt_hand(double right_rad, double up_rad) {
  if (!leading_ && !motion_.clutch) handle_.tilt(right_rad, up_rad);
}

void RehearsalControl::roll_hand(double rad) {
  if (!leading_ && !motion_.clutch) handle_.roll(rad);
}

// The handle follows the view and the hand, as far as bone lets it.
void RehearsalControl::turn_handle(double seconds) {
  constexpr double kRadPerS = 4;
  const Vec3 wanted = wanted_axis();
  if (length(wanted - axis_) < 1e-3) return;
  axis_ = path_planner(false).turned({hand_pose().at_mm, axis_}, wanted, kRadPerS * std::min(seconds, 0.2));
}

void RehearsalControl::send_goal(double seconds) {
  Device& device = rehearsal().device();
  device.set_tool(static_cast<std::uint8_t>(instrument()));
  if (leading_) {
    latched_ = false;
    return;
  }
  auto* const mouse = dynamic_cast<MouseDevice*>(&device);
  const auto pedal_of = [&](double down) { return static_cast<std::uint8_t>(std::lround(255 * burr_share * down)); };
  const std::uint8_t pedal = pedal_of(latched_ ? 1 : held_);
  if (mouse == nullptr) {  // it moves by itself, and drills by a pedal of its own where it has one
    const double scale = (motion_.rest ? motion_.rest_share : 1) / motion_.one_to;
    if (actions_.tune) actions_.tune({scale, motion_.clutch, pedal, pedal_of(1)});
    return;
  }
  turn_handle(seconds);
  goal_.axis = to_floats(axis_);
  goal_.tool = static_cast<std::uint8_t>(instrument());
  goal_.pedal = pedal;
  mouse->set_goal(goal_);
}

void RehearsalControl::lead(std::optional<Vec3> seen_mm, Vec3 forward) {
  if (!rehearsal().device().lead({})) {
    say([&] { return tr("the drill is in your own hand"); }, Message::Rank::hindrance);
    return;
  }
  leading_ = Leading{Leading::Stage::letting_go, 0, {}, seen_mm, forward, {}};
  tools_.loosen_saw(true, rehearsal());
  // Pulled aside it would not get there.
  if (lead_pause_.begin()) say([&] { return tr("the drill finds its way: your hand is let go until it is there"); });
  latched_ = false;
  wait_for_release_ = true;
}

void RehearsalControl::lift() {
  lead(std::nullopt, {});
}

void RehearsalControl::bring(Vec3 direction) {
  const std::optional<BoneHit> hit = bone_seen(direction);
  if (!hit) {
    say([&] { return tr("no bone under the mouse"); }, Message::Rank::hindrance);
    return;
  }
  lead(hit->at_mm, direction);
}

std::optional<BoneHit> RehearsalControl::bone_seen(Vec3 direction) const {
  std::optional<BoneHit> hit;
  rehearsal().look([&](const World& world, SceneReaders&) {
    hit = bone_on_ray(world, view_.eye_mm, direction, length(centre_mm_ - view_.eye_mm) + 4 * radius_mm_);
  });
  return hit;
}

enum class Brought { drill, saw, plate };
// How what is in the hand has come to the bone: through free space or `put` there, so far off it.
static std::string brought_text(Brought what, bool put, double gap_mm) {
  const auto of = [&](const char* drill, const char* saw, const char* plate) {
    return what == Brought::drill ? drill : what == Brought::saw ? saw : plate;
  };
  if (put)
    return of(tr("the drill was shut in; it was taken out and set down there"),
              tr("the saw was shut in; it was taken out and set down there"),
              tr("the plate was shut in; it was taken out and set down there"));
  if (gap_mm > 6)
    return filled(
        of(tr("the drill gets no nearer than {mm} mm this way"), tr("the saw gets no nearer than {mm} mm this way"),
           tr("the plate gets no nearer than {mm} mm this way")),
        {{"mm", shown_number(gap_mm, 0)}});
  return of(tr("drill brought to the bone"), tr("saw brought to the bone"), tr("plate brought to the bone"));
}

// No way was free of critical structures.
static constexpr const char* kPastStructures = tr_later("; past a critical structure, since no other path was free");

void RehearsalControl::go_on_leading() {
  constexpr double kBackMm = 0.3;
  constexpr int kLetGo = 3;
  if (!leading_) return;
  Device& device = rehearsal().device();
  const Led led = device.led();
  if (led == Led::on_the_way) return;
  const bool saw = tools_.saw_in_hand();
  const auto go = [&](Leading::Stage stage, const HandWay& way, const HandPose& end) {
    leading_->stage = stage;
    goal_.position_mm = end.at_mm;
    axis_ = end.axis;
    goal_.axis = to_floats(axis_);
    goal_.pedal = 0;
    device.lead(way);
  };
  const auto waiting = [&](const PathPlanner& ways) { return ways.waiting(towards_eye(), wanted_axis()); };
  if (leading_->stage == Leading::Stage::letting_go) {
    if (lead_pause_.pulled()) return;
    const TickRecord now = rehearsal().latest();
    if (!leading_->quiet_tick) leading_->quiet_tick = now.tick;
    if (now.tick <= *leading_->quiet_tick) return;
    // The way is the tool's: it has to be back at the hand, which is pulled to it while it is let go.
    if (length(from_floats(now.shown_offset_mm)) > kBackMm && leading_->let_go < kLetGo) {
      ++leading_->let_go;
      leading_->quiet_tick.reset();
      device.lead({});
      return;
    }
    const PathPlanner ways = path_planner(true);
    const HandPose from = hand_pose();
    if (leading_->seen_mm) {
      const PathPlanner::Found a = ways.approach(from, *leading_->seen_mm, leading_->forward, wanted_axis());
      const double gap = length(a.end.at_mm - *leading_->seen_mm) - burr().diameter_mm / 2;
      const Brought what = plate_in_hand() ? Brought::plate : saw ? Brought::saw : Brought::drill;
      leading_->done = [&] { return brought_text(what, a.way.put, gap); };
      if (a.past_structures) leading_->done += [] { return tr(kPastStructures); };
      go(Leading::Stage::on_the_way, a.way, a.end);
    } else {
      const HandPose to = waiting(ways);
      const PathPlanner::Found out = ways.way(from, to);
      leading_->done = [&] {
        return out.way.put
                   ? (saw ? tr("the saw was shut in; it was taken out") : tr("the drill was shut in; it was taken out"))
                   : (saw ? tr("saw lifted out") : tr("drill lifted out"));
      };
      if (out.past_structures) leading_->done += [] { return tr(kPastStructures); };
      go(Leading::Stage::on_the_way, out.way, to);
    }
  } else if (led == Led::blocked && leading_->stage == Leading::Stage::on_the_way) {
    leading_->done = [&] {
      return saw ? tr("the saw was stuck; it was taken out") : tr("the drill was stuck; it was taken out");
    };
    const HandPose to = waiting(path_planner(true));
    HandWay way;
    way.put = true;
    way.points[0] = {to.at_mm, to_floats(to.axis), false};
    way.count = 1;
    go(Leading::Stage::put, way, to);
  } else {
    if (leading_->seen_mm) motion_.meet();
    // Who took up the saw meanwhile has to know how it is used.
    const LocalText how = leading_->seen_mm ? LocalText() : LocalText([&] { return tools_.how(); });
    LocalText done = how.empty() ? leading_->done : how;
    if (lead_pause_.end()) done += [] { return tr("; your hand is led again"); };
    say(done);
    leading_.reset();
    tools_.loosen_saw(false, rehearsal());
  }
}

void RehearsalControl::take_burr(int tool) {
  if (leading_) {  // on a way that was found for the burr that it has
    say([&] { return tr("the drill is on its way: change the burr when it has arrived"); }, Message::Rank::hindrance);
    return;
  }
  tool_ = tool;
  tools_.put_saw_away(rehearsal());
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

// One size up or down; behind the last of them the other end.
void RehearsalControl::next_burr(int by) {
  constexpr int kSizes = 7;
  const int now = static_cast<int>(std::lround(burr().diameter_mm));
  take_burr_of((now - 1 + by + kSizes) % kSizes + 1);
}

void RehearsalControl::set_burr_share(int by) {
  burr_share = std::clamp(burr_share + 0.25 * by, 0.25, 1.0);
  say([&] {
    return filled(tr("burr at most at {share} % of its speed"), {{"share", shown_number(100 * burr_share, 0)}});
  });
}

// --- a frame

bool RehearsalControl::command(const Keyboard::Press& press, const std::optional<Vec3>& direction) {
  const HandTools::Tool before = tools_.tool();
  // Where the mouse points, or the middle of the picture: there it is seen.
  if (press.command == Command::saw && before != HandTools::Tool::saw && !tools_.saw_in_hand()) {
    if (const auto hit = bone_seen(direction.value_or(view_.forward))) {
      SawCut cut = tools_.cut();
      cut.at_mm = hit->at_mm;
      tools_.set_cut(cut);
    }
  }
  if (tools_.key(press.command, rehearsal(), view_)) {
    if (tools_.tool() != before && !tools_.how().empty()) say([&] { return tools_.how(); });
    return true;
  }
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
    case Command::burr_kind:
      take_burr(static_cast<BurrKind>(press.value));
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
      say(second_.take_next(rehearsal()));
      return true;
    case Command::tilt: {
      constexpr double kStep = 3 * std::numbers::pi / 180;
      const double across[] = {-kStep, kStep, 0, 0}, up[] = {0, 0, kStep, -kStep};
      tilt_hand(across[press.value], up[press.value]);
      return true;
    }
    case Command::roll:
      roll_hand(press.value * 3 * std::numbers::pi / 180);
      return true;
    case Command::straight:
      if (!leading_) handle_.straight();
      return true;
    case Command::motion: {
      motion_.step(press.value);
      say([&] {
        return filled(motion_.one_to == 1 && motion_.parted()
                          ? tr("motion of the hand 1:{n}; {bring} brings the drill under the mouse again")
                          : tr("motion of the hand 1:{n}"),
                      {{"n", std::to_string(motion_.one_to)}, {"bring", key_name(Command::bring)}});
      });
      return true;
    }
    case Command::burr_speed:
      set_burr_share(press.value);
      return true;
    case Command::other_burr:
      take_burr(static_cast<BurrKind>((static_cast<std::size_t>(burr().kind) + 1) % kBurrKinds.size()));
      return true;
    case Command::next_burr:
      next_burr(press.value);
      return true;
    default:
      return false;
  }
}

void RehearsalControl::hold(const HandInput& input) {
  motion_.clutch = input.clutch;
  motion_.rest = input.wrist_rest;
  handle_.take(plate_in_hand());
  second_works_ = input.second_hand && input.pressed && input.on_bone;
  const bool pressed = input.pressed && !input.second_hand;
  // What was held when the hand was led away does not drill where it arrives.
  if (!pressed && !(input.drill > 0) && !leading_) wait_for_release_ = false;
  const double down = std::max(pressed && input.on_bone ? 1.0 : 0.0, std::clamp(input.drill, 0.0, 1.0));
  held_ = wait_for_release_ || tools_.tool() != HandTools::Tool::drill ? 0 : down;
  if (input.pad && !leading_) {
    const PadMotion& pad = *input.pad;
    goal_.position_mm += (view_.right * pad.right_mm_s + view_.up * pad.up_mm_s + view_.forward * pad.deeper_mm_s) *
                         (std::min(input.seconds, 0.1) * motion_.factor());
  }
  // Who takes up the saw or a piece lets go of the drill: it does not stay in the bone.
  const bool in_hand = tools_.in_hand();
  if (in_hand_ && !in_hand && !leading_ && !outside()) lift();
  in_hand_ = in_hand;
  go_on_leading();
  send_goal(input.seconds);
  report_of_tools();
}

// What came of saw, pieces and plates, or why nothing did: once, wherever the panel is.
void RehearsalControl::report_of_tools() {
  const LocalText& note = tools_.note(rehearsal());
  if (note == reported_of_tools_) return;
  reported_of_tools_ = note;
  if (!note.empty()) say(note);
}

void RehearsalControl::drag_second(Vec3 by_mm) {
  LocalText said;
  static_cast<void>(second_.move(rehearsal(), by_mm * motion_.factor(), said));
  if (!said.empty() && said.shown != message()) say(said);
}

Vec3 RehearsalControl::second_mm() const {
  if (second_.placed_mm()) return *second_.placed_mm();
  return rehearsal().hands() > 1 ? from_floats(rehearsal().latest(1).device.position_mm) : goal_.position_mm;
}

void RehearsalControl::wash(bool suck, bool wash) {
  second_.hold(rehearsal(), view_, suck, wash, second_works_, handle_.left());
}

// --- what is told

void RehearsalControl::say(const LocalText& text, Message::Rank rank) {
  notify(text.shown, rank);
  if (Rehearsal* const running = actions_.rehearsal()) running->note("message", text.english);
}

std::optional<Message> RehearsalControl::reported(std::vector<Message> causes) {
  if (leading_) causes.push_back({Message::Rank::hindrance, tr("the drill is on its way, off")});
  messages_.causes(std::move(causes));
  return messages_.shown();
}

}  // namespace osteo::inline app
