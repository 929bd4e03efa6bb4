#include "hand_tools.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "keys.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/translate.h"
#include "osteo/geometry/grid/brick_places.h"
#include "osteo/simulation/bone/plates.h"

namespace osteo::inline app {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kKeyTurn = 5 * kDegree;
constexpr double kTurnPerMm = 0.6 * kDegree;
constexpr double kCrumbMm3 = 30;  // what is smaller than that and is connected with nothing becomes dust

RigidTransform grip_of(float turn_deg, float tilt_deg) {
  return rotation_about({}, {1, 0, 0}, static_cast<double>(tilt_deg) * kDegree) *
         rotation_about({}, {0, 0, 1}, static_cast<double>(turn_deg) * kDegree);
}

}  // namespace

std::optional<BoneHit> bone_on_ray(const World& world, Vec3 from, Vec3 direction, double reach_mm) {
  std::optional<BoneHit> first;
  double nearest = reach_mm;
  for (const PlacedBody& placed : world.bodies()) {
    const RigidTransform own = placed.world_from_body.inverse();
    const BrickGrid& bone = placed.body->bone;
    const Vec3 start = own(from), way = own.rotation * direction;
    const double step = bone.frame().spacing_mm.x / 2;
    for (double s = 0; s < nearest; s += step) {
      if (bone.nearest(start + way * s) < 0.5F) continue;
      nearest = s;
      first = BoneHit{from + direction * s, placed.body->id};
      break;
    }
  }
  return first;
}

void HandTools::renew(Vec3 centre_mm, double size_mm) {
  tool_ = Tool::drill;
  piece_ = SceneAction::kNobody;
  size_mm_ = size_mm;
  handle_mm_ = centre_mm;
  cut_ = SawCut{};
  cut_.at_mm = centre_mm;
  within_mm_ = kGuideMm;
  saw_in_hand_ = false;
  note_ = {};
}

void HandTools::choose(Tool tool, Rehearsal& rehearsal, const ViewAxes& view) {
  if (tool == tool_ || (saw_in_hand_ && tool == Tool::saw)) tool = Tool::drill;  // the same key puts it away
  if (tool_ == Tool::plate && tool != Tool::plate) rehearsal.act(SceneAction::grip(SceneAction::kNobody));
  put_saw_away(rehearsal);
  tool_ = tool;
  note_ = {};
  if (tool == Tool::saw) aim_saw(view, false);
  if (tool == Tool::plate) grip(rehearsal);
}

void HandTools::plan(std::vector<PlannedCut> cuts, std::filesystem::path file) {
  planned_ = std::move(cuts);
  planned_file_ = std::move(file);
}

void HandTools::choose_planned(std::size_t cut) {
  cut_ = planned_[cut].cut;
  within_mm_ = planned_[cut].within_mm;
  note_ = [&] { return filled(tr("saw at the planned cut '{name}'"), {{"name", planned_[cut].name}}); };
}

CuttingGuide HandTools::guide() const {
  for (const PlannedCut& c : planned_)
    if (c.cut.at_mm == cut_.at_mm && c.cut.normal == cut_.normal && c.within_mm == within_mm_) return c.guide();
  return {cut_.at_mm, normalized(cut_.normal), within_mm_};
}

void HandTools::keep_planned(const std::string& name) {
  try {
    if (name.empty()) {
      note_ = [] { return tr("a planned cut needs a name"); };
      return;
    }
    auto cuts = std::filesystem::exists(planned_file_) ? load_planned_cuts(planned_file_) : std::vector<PlannedCut>{};
    for (const PlannedCut& c : cuts) {
      if (c.name != name) continue;
      note_ = [&] { return filled(tr("there is a planned cut '{name}' already"), {{"name", name}}); };
      return;
    }
    cuts.push_back({name, cut_, within_mm_});
    write_file(planned_file_, planned_cuts_json(cuts));
    planned_ = std::move(cuts);
    note_ = [&] {
      return filled(tr("kept as '{name}' in {file}"), {{"name", name}, {"file", planned_file_.string()}});
    };
  } catch (const Error& e) {
    note_ = LocalText::untranslated(e.what());
  }
}

void HandTools::take_saw(Rehearsal& rehearsal) {
  tool_ = Tool::drill;
  saw_in_hand_ = true;
  rehearsal.act(SceneAction::cutting_guide(guide()));
  note_ = [] {
    return filled(tr("saw in the hand, held in its plane: {bring} brings it, {saw} puts it away"),
                  {{"bring", key_name(Command::bring)}, {"saw", key_name(Command::saw)}});
  };
}

void HandTools::loosen_saw(bool loose, Rehearsal& rehearsal) {
  if (saw_in_hand_) rehearsal.act(SceneAction::cutting_guide(loose ? CuttingGuide{} : guide()));
}

void HandTools::put_saw_away(Rehearsal& rehearsal) {
  if (!saw_in_hand_) return;
  saw_in_hand_ = false;
  rehearsal.act(SceneAction::cutting_guide({}));
}

void HandTools::aim_saw(const ViewAxes& view, bool flat) {
  cut_.normal = flat ? view.up : view.right;
  cut_.along = flat ? view.right : view.up;
}

void HandTools::set_plate(std::size_t plate, float turn_deg, float tilt_deg, Rehearsal& rehearsal) {
  plate_ = plate;
  turn_deg_ = turn_deg;
  tilt_deg_ = tilt_deg;
  grip(rehearsal);
}

RigidTransform HandTools::plate_grip() const {
  return grip_of(turn_deg_, tilt_deg_);
}

void HandTools::grip(Rehearsal& rehearsal) {
  rehearsal.act(SceneAction::grip(static_cast<std::uint32_t>(plate_), grip_of(turn_deg_, tilt_deg_)));
}

void HandTools::turn_saw(Vec3 axis, double angle) {
  const Mat3 r = rotation_about({}, axis, angle).rotation;
  cut_.normal = normalized(r * cut_.normal);
  cut_.along = normalized(r * cut_.along);
}

void HandTools::move_piece(Rehearsal& rehearsal, const RigidTransform& by) {
  if (piece_ == SceneAction::kNobody) return;
  pose_ = by * pose_;
  // Rounding of many small turns must not add up.
  auto& c = pose_.rotation.column;
  c[0] = normalized(c[0]);
  c[1] = normalized(c[1] - c[0] * dot(c[0], c[1]));
  c[2] = cross(c[0], c[1]);
  handle_mm_ = by(handle_mm_);
  rehearsal.act(SceneAction::move(piece_, pose_));
}

void HandTools::pick(Rehearsal& rehearsal, Vec3 from, Vec3 direction) {
  if (tool_ != Tool::piece) return;
  rehearsal.look([&](const World& world, SceneReaders&) {
    const auto hit = bone_on_ray(world, from, direction, 10 * size_mm_ + length(from - handle_mm_));
    if (!hit) return;
    piece_ = hit->body;
    if (world.find(piece_)->of_region) piece_ = world.bodies().front().body->id;
    pose_ = world.find(piece_)->world_from_body;
    handle_mm_ = hit->at_mm;
  });
}

void HandTools::take_piece(std::uint32_t body, Rehearsal& rehearsal) {
  if (tool_ != Tool::piece) return;
  rehearsal.look([&](const World& world, SceneReaders&) {
    const PlacedBody* const placed = world.find(body);
    if (placed == nullptr) return;
    Vec3 sum{};
    const BrickGrid& bone = placed->body->bone;
    for (std::uint32_t b = 0; b < bone.brick_count(); ++b) sum += middle_of_brick_mm(bone, b);
    piece_ = body;
    pose_ = placed->world_from_body;
    handle_mm_ = pose_(sum / std::max(1.0, static_cast<double>(bone.brick_count())));
  });
}

void HandTools::attach(Rehearsal& rehearsal) {
  const TickRecord tick = rehearsal.latest();
  const RigidTransform pose = plate_pose(from_floats(tick.device.position_mm) + from_floats(tick.shown_offset_mm),
                                         normalized(from_floats(tick.device.axis)), grip_of(turn_deg_, tilt_deg_));
  std::vector<std::uint32_t> under;
  rehearsal.look(
      [&](const World& world, SceneReaders&) { under = bodies_under(world, plate_library()[plate_], pose); });
  if (under.empty()) {
    note_ = [] { return tr("no bone within 2 mm below the plate"); };
    return;
  }
  rehearsal.act(SceneAction::attach(static_cast<std::uint32_t>(plate_), pose, under[0],
                                    under.size() > 1 ? under[1] : SceneAction::kNobody));
  note_ = [&] { return under.size() > 1 ? tr("fixed to two fragments") : tr("fixed to one fragment"); };
  tool_ = Tool::drill;
}

void HandTools::drag(double right_mm, double up_mm, bool turn, Rehearsal& rehearsal, const ViewAxes& view) {
  const Vec3 by = view.right * right_mm + view.up * up_mm;
  if (tool_ == Tool::saw) {
    if (turn) {
      turn_saw(view.up, right_mm * kTurnPerMm);
      turn_saw(view.right, -up_mm * kTurnPerMm);
    } else {
      cut_.at_mm += by;
    }
  } else if (tool_ == Tool::piece) {
    move_piece(rehearsal, turn ? rotation_about(handle_mm_, view.up, right_mm * kTurnPerMm) *
                                     rotation_about(handle_mm_, view.right, -up_mm * kTurnPerMm)
                               : RigidTransform{{}, by});
  }
}

void HandTools::push(double deeper_mm, Rehearsal& rehearsal, const ViewAxes& view) {
  if (tool_ == Tool::saw) cut_.at_mm += view.forward * deeper_mm;
  if (tool_ == Tool::piece) move_piece(rehearsal, {{}, view.forward * deeper_mm});
}

void HandTools::perform(Rehearsal& rehearsal) {
  if (tool_ == Tool::saw) rehearsal.act(SceneAction::saw(cut_));
  if (tool_ == Tool::piece) rehearsal.act(SceneAction::split(kCrumbMm3));
  if (tool_ == Tool::plate) attach(rehearsal);
}

void HandTools::undo(Rehearsal& rehearsal) {
  rehearsal.act(SceneAction::plain(ActionKind::undo));
  piece_ = SceneAction::kNobody;
  note_ = {};
}

std::string HandTools::how() const {
  switch (tool_) {
    case Tool::drill:
      break;
    case Tool::saw:
      return filled(tr("saw: drag moves it, {perform} cuts, {away} puts it away"),
                    {{"perform", key_name(Command::perform)}, {"away", key_name(Command::put_away)}});
    case Tool::piece:
      return filled(tr("fragments: {perform} separates them, drag moves one"),
                    {{"perform", key_name(Command::perform)}});
    case Tool::plate:
      return filled(tr("plate: a click on bone brings it there, {perform} fixes it"),
                    {{"perform", key_name(Command::perform)}});
  }
  return {};
}

const LocalText& HandTools::note(Rehearsal& rehearsal) {
  if (std::string refused = rehearsal.take_refusal(); !refused.empty())
    note_ = LocalText::untranslated(std::move(refused));
  return note_;
}

bool HandTools::key(Command command, Rehearsal& rehearsal, const ViewAxes& view) {
  switch (command) {
    case Command::saw:
      choose(Tool::saw, rehearsal, view);
      return true;
    case Command::pieces:
      choose(Tool::piece, rehearsal, view);
      return true;
    case Command::plates:
      choose(Tool::plate, rehearsal, view);
      return true;
    case Command::undo:
      undo(rehearsal);
      return true;
    case Command::turn_left:
    case Command::turn_right: {
      const double turn = command == Command::turn_left ? kKeyTurn : -kKeyTurn;
      if (tool_ == Tool::saw) turn_saw(view.forward, turn);
      if (tool_ == Tool::piece) move_piece(rehearsal, rotation_about(handle_mm_, view.forward, turn));
      if (tool_ == Tool::plate) {
        turn_deg_ += static_cast<float>(turn / kDegree);
        turn_deg_ -= 360 * std::round(turn_deg_ / 360);
        grip(rehearsal);
      }
      return tool_ != Tool::drill;
    }
    case Command::perform:
      perform(rehearsal);
      return tool_ != Tool::drill;
    case Command::put_away:
      if (tool_ == Tool::drill && !saw_in_hand_) return false;
      choose(tool_, rehearsal, view);
      return true;
    default:
      return false;
  }
}

}  // namespace osteo::inline app
