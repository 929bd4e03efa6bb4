#include "osteo/simulation/bone/world.h"

#include <algorithm>
#include <cmath>
#include <deque>

#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/param.h"
#include "osteo/simulation/bone/plates.h"

namespace osteo::inline simulation {
namespace {

World::Effect nothing(std::string why) {
  World::Effect e;
  e.done = false;
  e.message = std::move(why);
  return e;
}

// Columns at right angles, of length one, right-handed, to what a pose built in doubles has.
bool is_rigid(const RigidTransform& t) {
  const auto& c = t.rotation.column;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = i; j < 3; ++j) {
      if (!(std::abs(dot(c[i], c[j]) - (i == j ? 1 : 0)) < 1e-6)) return false;
    }
  }
  return determinant(t.rotation) > 0 && std::isfinite(dot(t.shift_mm, t.shift_mm)) && length(t.shift_mm) < 1e6;
}

// Why the numbers of an action make no sense, whatever the scene; empty: they do.
std::string senseless(const SceneAction& a) {
  const auto& v = a.values;
  for (const double x : v) {
    if (!std::isfinite(x)) return "a number of the action is not finite";
  }
  if (a.hand >= kMaxHands) return "there is no hand " + std::to_string(a.hand);
  switch (static_cast<ActionKind>(a.kind)) {
    case ActionKind::guide:
      if (!(v[0] >= 0 && v[0] < kMaxHands && v[0] == std::floor(v[0])) || a.item >= kMaxHands ||
          static_cast<double>(a.item) == v[0])
        return "one hand is led by another, both below " + std::to_string(kMaxHands);
      if (!(v[1] >= -10 && v[1] <= 10 && v[2] >= 0 && v[2] <= 100 && std::abs(v[3]) <= 2 && v[4] >= 0 && v[4] <= 20 &&
            v[5] >= 0 && (v[6] == 0 || v[6] == 1) && v[7] >= 0 && v[7] <= 100))
        return "a guide pulls with -10 to 10 N/mm, 0 to 100 N s/m, up to 20 N and twice the leader's force";
      break;
    case ActionKind::cutting_guide:
      if (!(v[6] >= 0 && v[6] <= SceneAction::kMaxSlotMm))
        return "a saw slips into a cutting guide from 0 to " + format_number(SceneAction::kMaxSlotMm) + " mm away";
      if (v[6] > 0 && !(length(Vec3{v[3], v[4], v[5]}) > 1e-9))
        return "the plane of a cutting guide has no direction across it";
      if (v[6] > 0 && v[7] != 0) {
        const CuttingGuide g = a.guide();
        const auto fits = [](double mm) { return mm >= SceneAction::kLeastFaceMm && mm <= SceneAction::kMaxFaceMm; };
        if (!(v[7] > 0 && v[7] <= SceneAction::kMaxPlayMm))
          return "a blade has 0 to " + format_number(SceneAction::kMaxPlayMm) + " mm of play in its slot";
        if (!fits(length(g.up_mm)) || !fits(g.length_mm))
          return "the faces of a slot with play are " + format_number(SceneAction::kLeastFaceMm) + " to " +
                 format_number(SceneAction::kMaxFaceMm) + " mm high, in its plane, and long";
      }
      break;
    case ActionKind::suction:
    case ActionKind::irrigate:
      if (v[4] > 0 && !(v[3] > 0 && v[3] <= SceneAction::kMaxReachMm))
        return "it reaches " + format_number(v[3]) + " mm, but at most " + format_number(SceneAction::kMaxReachMm) +
               " mm make sense";
      break;
    case ActionKind::simulate:
      if (a.item >= static_cast<std::uint32_t>(Simulated::behind_last) || (v[0] != 0 && v[0] != 1))
        return "dust (0) or heat (1) begins (1) or ends (0)";
      break;
    case ActionKind::posture:
      if (const double n = length(Vec3{v[0], v[1], v[2]}); !(n > 0.99 && n < 1.01))
        return "what is down must be a unit direction";
      break;
    default:
      break;
  }
  return {};
}

}  // namespace

World::World(BrickGrid bone, std::shared_ptr<const Hardness> hardness) {
  auto body = std::make_shared<Body>();
  body->bone = std::move(bone);
  body->hardness = std::move(hardness);
  next_brick_ = static_cast<std::uint32_t>(body->bone.brick_count());
  bodies_.push_back({std::move(body), {}, false});
}

World World::copy() const {
  World w(*this);
  for (PlacedBody& b : w.bodies_)
    b.body = std::make_shared<Body>(Body{b.body->id, b.body->first_brick, BrickGrid(b.body->bone), b.body->hardness});
  return w;
}

void World::add_region(BrickGrid fine, std::shared_ptr<const Hardness> hardness) {
  Body& coarse = *bodies_.front().body;
  const Frame& c = coarse.bone.frame();
  const Frame& f = fine.frame();
  const auto refuse = [](const std::string& what) {
    return Error(ExitCode::usage, "the region of interest does not fit the bone: " + what,
                 "make it with resample: the same axes, and a box of whole voxels of the coarser bone");
  };
  if (bodies_.size() != 1) throw refuse("there is one already");
  for (std::size_t a = 0; a < 3; ++a) {
    if (length(c.direction.column[a] - f.direction.column[a]) > 1e-6) throw refuse("its axes point elsewhere");
  }
  const Vec3 lo = c.index_from_world(f.world_from_index({-0.5, -0.5, -0.5}));
  const Vec3 hi = c.index_from_world(f.world_from_index({f.dims[0] - 0.5, f.dims[1] - 0.5, f.dims[2] - 0.5}));
  int first[3], last[3];
  for (std::size_t a = 0; a < 3; ++a) {
    first[a] = static_cast<int>(std::lround(lo[a] + 0.5));
    last[a] = static_cast<int>(std::lround(hi[a] - 0.5));
    if (!(std::abs(first[a] - 0.5 - lo[a]) <= 0.01) || !(std::abs(last[a] + 0.5 - hi[a]) <= 0.01))
      throw refuse("its box cuts through voxels of the bone");
    first[a] = std::max(first[a], 0);
    last[a] = std::min(last[a], c.dims[a] - 1);
  }
  if (too_many_bricks(next_brick_ + fine.brick_count()))
    throw Error(ExitCode::resources, "bone and region of interest together have more bricks than can be numbered",
                "make the region smaller, or its voxels larger");
  for (int k = first[2]; k <= last[2]; ++k) {
    for (int j = first[1]; j <= last[1]; ++j) {
      for (int i = first[0]; i <= last[0]; ++i) {
        if (const VoxelKey v = coarse.bone.find(i, j, k); v != BrickGrid::kNone) coarse.bone.set(v, 0);
      }
    }
  }
  auto body = std::make_shared<Body>();
  body->id = next_body_++;
  body->first_brick = next_brick_;
  next_brick_ += static_cast<std::uint32_t>(fine.brick_count());
  body->bone = std::move(fine);
  body->hardness = std::move(hardness);
  bodies_.push_back({std::move(body), {}, true});
}

const PlacedBody* World::find(std::uint32_t id) const {
  const auto it = std::find_if(bodies_.begin(), bodies_.end(), [&](const PlacedBody& b) { return b.body->id == id; });
  return it == bodies_.end() ? nullptr : &*it;
}
PlacedBody* World::placed(std::uint32_t id) {
  return const_cast<PlacedBody*>(find(id));
}

const PlacedBody* World::owner(VoxelKey name) const {
  const std::uint32_t brick = name / BrickGrid::kVoxels;
  for (const PlacedBody& b : bodies_) {
    if (brick >= b.body->first_brick && brick < b.body->first_brick + b.body->bone.brick_count()) return &b;
  }
  return nullptr;
}

World::Done World::snapshot(ActionKind kind, std::uint32_t of) const {
  Done d;
  d.kind = kind;
  d.of = of;
  for (const PlacedBody& b : bodies_) d.poses.emplace_back(b.body->id, b.world_from_body);
  d.fixtures = fixtures_;
  return d;
}

// Dragging a piece is one step, not one for each picture. So is turning a distractor's screw.
bool World::goes_on(const Done& before, const Done& after) {
  return (after.kind == ActionKind::move || after.kind == ActionKind::open) && before.kind == after.kind &&
         before.of == after.of;
}

std::size_t World::undo_steps() const {
  std::size_t steps = 0;
  // The stroke that goes on stands between those that were told and the others.
  for (std::size_t d = 0; d < done_.size(); ++d)
    steps += d > 0 && (d != reported_ || stroke_.empty()) && goes_on(done_[d - 1], done_[d]) ? 0 : 1;
  return steps + (stroke_.empty() || missed_ ? 0 : 1);
}

void World::notify(std::span<const VoxelChange> changes) {
  for (const VoxelChange& c : changes) {
    const auto [known, is_new] = in_stroke_.try_emplace(c.voxel, static_cast<std::uint32_t>(stroke_.size()));
    if (is_new) {
      stroke_.push_back({c.voxel, c.before, c.density});
    } else {
      stroke_[known->second].after = c.density;
    }
  }
}

void World::end_stroke() {
  if (stroke_.empty()) return;
  in_stroke_.clear();
  std::vector<Change> drilled(stroke_.begin(), stroke_.end());  // no larger than it must be
  stroke_.clear();
  if (std::exchange(missed_, false)) return;  // only its end is known
  stroke_bytes_ += drilled.size() * sizeof(Change);
  Done stroke;
  stroke.kind = ActionKind::stroke;
  stroke.drilled = std::move(drilled);
  done_.insert(done_.begin() + static_cast<std::ptrdiff_t>(reported_), std::move(stroke));
  ++reported_;
  // With what came before it: undo leaves nothing out on its way back.
  while (stroke_bytes_ > kMaxStrokeBytes) {
    const auto oldest =
        std::find_if(done_.begin(), done_.end(), [](const Done& d) { return d.kind == ActionKind::stroke; });
    const auto steps = oldest + 1 - done_.begin();
    stroke_bytes_ -= oldest->drilled.size() * sizeof(Change);
    done_.erase(done_.begin(), oldest + 1);
    reported_ -= static_cast<std::size_t>(steps);
    steps_forgotten_ += static_cast<std::uint64_t>(steps);
  }
}

void World::notify(const SceneAction& action) {
  if (action.is(ActionKind::stroke)) return end_stroke();
  const bool is_step = row_of(action).changes_world && !action.is(ActionKind::undo);
  if (!is_step || reported_ == done_.size()) return;
  if (missed_) {
    // Whatever was missed may belong to the same drag: then only its end is known.
    const bool may_go_on = action.is(ActionKind::move) || action.is(ActionKind::open);
    in_stroke_.clear();
    stroke_.clear();
    if (may_go_on) {
      done_.erase(done_.begin() + static_cast<std::ptrdiff_t>(reported_));
      return;
    }
    missed_ = false;
  }
  end_stroke();
  if (reported_ > 0 && goes_on(done_[reported_ - 1], done_[reported_])) {
    done_.erase(done_.begin() + static_cast<std::ptrdiff_t>(reported_));  // where it began is known
  } else {
    ++reported_;
  }
}

void World::forget() {
  steps_forgotten_ += reported_ + (stroke_.empty() ? 0 : 1);
  done_.erase(done_.begin(), done_.begin() + static_cast<std::ptrdiff_t>(reported_));
  reported_ = 0;
  stroke_bytes_ = 0;
  in_stroke_.clear();
  stroke_.clear();
  missed_ = true;
}

std::vector<std::uint32_t> World::joined_to(std::uint32_t body, std::uint32_t except) const {
  std::vector<std::uint32_t> group{body};
  const auto add = [&](std::uint32_t id) {
    if (std::find(group.begin(), group.end(), id) == group.end()) group.push_back(id);
  };
  for (std::size_t i = 0; i < group.size(); ++i) {
    for (const Fixture& f : fixtures_) {
      if (f.id == except || f.other == SceneAction::kNobody) continue;
      if (f.body == group[i]) add(f.other);
      if (f.other == group[i]) add(f.body);
    }
    const bool whole = group[i] == bodies_.front().body->id || find(group[i])->of_region;
    for (std::size_t b = 0; b < bodies_.size() && whole; ++b) {
      if (b == 0 || bodies_[b].of_region) add(bodies_[b].body->id);
    }
  }
  return group;
}

void World::move_group(const std::vector<std::uint32_t>& group, const RigidTransform& by) {
  for (const std::uint32_t id : group) {
    PlacedBody* const b = placed(id);
    b->world_from_body = by * b->world_from_body;
  }
}

// Which of the pieces that a plate is to be fixed to is not there; kNobody: none.
std::uint32_t World::not_under_plate(const SceneAction& attach) const {
  const auto gaps =
      plate_gaps(*this, plate_library()[attach.item], attach.transform(), 0, 400, SceneAction::kPlateReachMm);
  for (const std::uint32_t id : {attach.body, attach.other}) {
    if (id == SceneAction::kNobody) continue;
    const auto on = [&](const PlateGap& g) {
      return g.body == id ||
             (g.body != SceneAction::kNobody && id == bodies_.front().body->id && find(g.body)->of_region);
    };
    if (std::none_of(gaps.begin(), gaps.end(), on)) return id;
  }
  return SceneAction::kNobody;
}

World::Effect World::act(const SceneAction& a, const ComponentsOf& components) {
  Effect effect;
  const ActionRow& row = row_of(a);
  if (a.is(ActionKind::hold) || row.ends_hold) held_ = a.is(ActionKind::hold);
  if (std::string why = senseless(a); !why.empty()) return nothing(std::move(why));
  const auto known = [&](std::uint32_t id) { return find(id) != nullptr; };
  const auto fixture =
      std::find_if(fixtures_.begin(), fixtures_.end(), [&](const Fixture& f) { return f.id == a.item; });
  switch (static_cast<ActionKind>(a.kind)) {
    case ActionKind::hold:
    case ActionKind::resume:
    case ActionKind::soft_push:
    case ActionKind::setting:
    case ActionKind::guide:
    case ActionKind::suction:
    case ActionKind::irrigate:
    case ActionKind::posture:
      break;
    case ActionKind::cutting_guide:
      guides_[a.hand] = a.guide();
      break;
    case ActionKind::simulate:
      simulate(static_cast<Simulated>(a.item), a.values[0] > 0);
      break;
    case ActionKind::saw:
      return saw(a);
    case ActionKind::split:
      return split(a, components);
    case ActionKind::undo:
      return undo();
    case ActionKind::stroke:
      return nothing("a stroke ends by itself, when the burr takes no more bone");
    case ActionKind::grip:
      if (!is_rigid(a.transform())) return nothing("this is no rigid motion");
      if (a.item != SceneAction::kNobody && a.item >= plate_library().size())
        return nothing("there is no plate " + std::to_string(a.item));
      grips_[a.hand] = {a.item, a.transform()};
      break;
    case ActionKind::move: {
      if (!known(a.body)) return nothing("there is no piece " + std::to_string(a.body));
      if (!is_rigid(a.transform())) return nothing("this is no rigid motion");
      Done before = snapshot(ActionKind::move, a.body);
      const RigidTransform by = a.transform() * find(a.body)->world_from_body.inverse();
      move_group(joined_to(a.body, SceneAction::kNobody), by);
      placed(a.body)->world_from_body = a.transform();  // to the bit
      done_.push_back(std::move(before));
      break;
    }
    case ActionKind::attach: {
      if (a.item >= plate_library().size()) return nothing("there is no plate " + std::to_string(a.item));
      if (!known(a.body) || (a.other != SceneAction::kNobody && !known(a.other)) || a.body == a.other)
        return nothing("a plate is attached to one piece, or to two that are not the same");
      if (!is_rigid(a.transform())) return nothing("this is no rigid motion");
      if (const std::uint32_t off = not_under_plate(a); off != SceneAction::kNobody)
        return nothing("the plate is not on piece " + std::to_string(off) + ": no bone of it begins within " +
                       format_number(SceneAction::kPlateReachMm) + " mm below its underside");
      done_.push_back(snapshot(ActionKind::attach));
      Fixture f;
      f.id = next_fixture_++;
      f.plate = a.item;
      f.body = a.body;
      f.other = a.other;
      f.body_from_plate = find(a.body)->world_from_body.inverse() * a.transform();
      fixtures_.push_back(f);
      grips_[a.hand].plate = SceneAction::kNobody;
      break;
    }
    case ActionKind::detach:
      if (fixture == fixtures_.end()) return nothing("there is no plate fixed as number " + std::to_string(a.item));
      done_.push_back(snapshot(ActionKind::detach));
      fixtures_.erase(fixture);
      break;
    case ActionKind::open: {
      if (fixture == fixtures_.end()) return nothing("there is no plate fixed as number " + std::to_string(a.item));
      const double most = plate_library()[fixture->plate].most_opening_mm;
      if (most <= 0) return nothing("'" + plate_library()[fixture->plate].name + "' is no distractor");
      if (fixture->other == SceneAction::kNobody) return nothing("the distractor is fixed to one piece only");
      Done before = snapshot(ActionKind::open, a.item);
      const double opening = std::clamp(a.values[0], 0.0, most);
      if (opening != a.values[0]) effect.message = "opened to " + format_number(opening) + " mm: it goes no further";
      const std::vector<std::uint32_t> group = joined_to(fixture->other, fixture->id);
      if (std::find(group.begin(), group.end(), fixture->body) != group.end())
        return nothing("another plate holds the two fragments together");
      const Vec3 along = (find(fixture->body)->world_from_body * fixture->body_from_plate).rotation.column[0];
      move_group(group, {Mat3{}, along * (opening - fixture->opening_mm)});
      fixture->opening_mm = opening;
      done_.push_back(std::move(before));
      break;
    }
    default:
      return nothing("unknown action " + std::to_string(a.kind) + ": a kind that this version does not have");
  }
  return effect;
}

World::Effect World::saw(const SceneAction& a) {
  const SawCut cut = a.saw_cut();
  if (!(length(cut.normal) > 1e-9) || !(cut.kerf_mm > 0)) return nothing("a saw cut needs a direction and a width");
  if (a.body != SceneAction::kNobody && find(a.body) == nullptr)
    return nothing("there is no piece " + std::to_string(a.body));
  Effect effect;
  Done before = snapshot(ActionKind::saw);
  for (PlacedBody& placed : bodies_) {
    if (a.body != SceneAction::kNobody && a.body != placed.body->id) continue;
    SawCut own = cut;
    const RigidTransform back = placed.world_from_body.inverse();
    own.at_mm = back(cut.at_mm);
    own.normal = back.rotation * cut.normal;
    own.along = back.rotation * cut.along;
    auto sawn = std::make_shared<Body>(
        Body{placed.body->id, placed.body->first_brick, placed.body->bone.sharing(), placed.body->hardness});
    std::vector<VoxelKey> changed;
    apply_saw(sawn->bone, own, changed);
    if (changed.empty()) continue;
    Effect::Changed bricks{sawn->id, {}};
    std::vector<Change> changes;
    for (const VoxelKey v : changed) {
      const float was = placed.body->bone.value(v), is = sawn->bone.value(v);
      changes.push_back({v, was, is});
      effect.dust.emplace_back(sawn->name_of(v), was - is);
      if (bricks.bricks.empty() || bricks.bricks.back() != v / BrickGrid::kVoxels)
        bricks.bricks.push_back(v / BrickGrid::kVoxels);
    }
    before.sawn.emplace_back(sawn->id, std::move(changes));
    effect.changed.push_back(std::move(bricks));
    placed.body = std::move(sawn);
  }
  if (effect.changed.empty()) return nothing("the saw meets no bone");
  done_.push_back(std::move(before));
  return effect;
}

World::Effect World::split(const SceneAction& a, const ComponentsOf& components) {
  if (std::any_of(bodies_.begin(), bodies_.end(), [](const PlacedBody& b) { return b.of_region; }))
    return nothing("bone with a region of interest is not separated");
  Effect effect;
  Done before = snapshot(ActionKind::split);
  // What is given out stays given only when all goes well.
  std::uint32_t next_body = next_body_, next_brick = next_brick_;
  std::vector<PlacedBody> bodies;
  std::vector<PlacedBody> made;
  for (const PlacedBody& placed : bodies_) {
    bodies.push_back(placed);
    const BrickGrid& bone = placed.body->bone;
    const LiveComponents* labels = components ? components(placed.body->id) : nullptr;
    std::unique_ptr<LiveComponents> own;
    if (labels == nullptr) {
      own = std::make_unique<LiveComponents>(bone);
      labels = own.get();
    }
    if (labels->components().size() < 2) continue;
    Split split = split_bone(bone, *labels, a.values[0]);
    // What is all crumbs stays as it is: a scene has at least the body it began with.
    if (split.pieces.empty() || split.changed_bricks.empty()) continue;
    for (const auto& [voxel, density] : split.loose) {
      before.loose.emplace_back(placed.body->name_of(voxel), density);
      effect.dust.emplace_back(placed.body->name_of(voxel), density);
    }
    effect.changed.push_back({placed.body->id, std::move(split.changed_bricks)});
    bodies.back().body = std::make_shared<Body>(
        Body{placed.body->id, placed.body->first_brick, std::move(split.pieces[0].bone), placed.body->hardness});
    for (std::size_t p = 1; p < split.pieces.size(); ++p) {
      Piece& piece = split.pieces[p];
      if (too_many_bricks(next_brick + piece.bone.brick_count()))
        return nothing("too many fragments: no names are left for their voxels");
      auto body = std::make_shared<Body>(Body{next_body++, next_brick, std::move(piece.bone), nullptr});
      next_brick += static_cast<std::uint32_t>(body->bone.brick_count());
      if (placed.body->hardness)
        body->hardness = std::make_shared<const Hardness>(*placed.body->hardness, piece.origin.brick);
      before.children.emplace_back(body->id, placed.body->id);
      effect.made.push_back({body->id, placed.body->id, std::move(piece.origin)});
      made.push_back({std::move(body), placed.world_from_body, false});
    }
  }
  if (effect.changed.empty()) return nothing("the bone is connected");
  bodies_ = std::move(bodies);
  bodies_.insert(bodies_.end(), made.begin(), made.end());
  next_body_ = next_body;
  next_brick_ = next_brick;
  done_.push_back(std::move(before));
  return effect;
}

World::Effect World::undo() {
  if (!missed_) end_stroke();  // whoever undoes is up to date, or has no strokes
  if (missed_ || done_.empty())
    return nothing(steps_forgotten_ == 0 && !missed_ ? "there is nothing to take back"
                                                     : "what was done before is no longer known, and stays");
  Effect effect;
  while (done_.size() > 1 && goes_on(done_[done_.size() - 2], done_.back())) done_.pop_back();  // where it began
  const Done last = std::move(done_.back());
  done_.pop_back();
  reported_ = std::min(reported_, done_.size());
  stroke_bytes_ -= last.drilled.size() * sizeof(Change);
  // New grids in place of those that get density back; what does not change they share with the old.
  struct Renewed {
    std::uint32_t id;
    Body* body;
    std::vector<std::uint32_t> bricks;  // that changed
    std::vector<std::uint8_t> own;      // one a brick: it may be written
    void note(std::uint32_t brick) {
      if (bricks.empty() || bricks.back() != brick) bricks.push_back(brick);
    }
    void write(VoxelKey v, float density) {
      const std::uint32_t brick = v / BrickGrid::kVoxels;
      note(brick);
      if (std::exchange(own[brick], 1) == 0) body->bone.own_brick(brick);
      body->bone.set(v, density);
    }
  };
  std::deque<Renewed> touched;
  const auto renewed = [&](std::uint32_t id) -> Renewed& {
    if (!touched.empty() && touched.back().id == id) return touched.back();
    for (Renewed& r : touched) {
      if (r.id == id) return r;
    }
    PlacedBody* const old = placed(id);
    old->body =
        std::make_shared<Body>(Body{id, old->body->first_brick, old->body->bone.sharing(), old->body->hardness});
    touched.push_back({id, old->body.get(), {}, std::vector<std::uint8_t>(old->body->bone.brick_count())});
    return touched.back();
  };
  const auto holds_bone = [](const BrickGrid& bone, std::uint32_t brick) {
    const float* const v = bone.values_of_brick(brick);
    return std::any_of(v, v + BrickGrid::kVoxels, [](float density) { return density > 0; });
  };
  for (const auto& [child, parent] : last.children) {
    const PlacedBody piece = *find(child);
    const BrickGrid& from = piece.body->bone;
    for (std::uint32_t b = 0; b < from.brick_count(); ++b) {
      if (!holds_bone(from, b)) continue;
      Renewed& whole = renewed(parent);
      BrickGrid& to = whole.body->bone;
      const Ijk o = from.brick_coordinate(b);
      const std::uint32_t there = to.find_brick(o.i, o.j, o.k);
      if (!holds_bone(to, there)) {
        to.share_brick(there, from, b);
        whole.own[there] = 0;
        whole.note(there);
        continue;
      }
      for (std::uint32_t v = 0; v < BrickGrid::kVoxels; ++v) {
        const VoxelKey at = there * BrickGrid::kVoxels + v;
        if (const float density = from.value(b * BrickGrid::kVoxels + v); density > 0)
          whole.write(at, std::min(to.value(at) + density, 1.0F));
      }
    }
    bodies_.erase(bodies_.begin() + (find(child) - bodies_.data()));
    effect.gone.push_back(child);
  }
  for (const auto& [name, density] : last.loose) {
    const PlacedBody* const b = owner(name);
    const VoxelKey own = name - b->body->name_of(0);
    Renewed& to = renewed(b->body->id);
    to.write(own, std::min(to.body->bone.value(own) + density, 1.0F));
  }
  const auto take_back = [&](std::uint32_t id, VoxelKey own, const Change& c) {
    Renewed& to = renewed(id);
    const float now = to.body->bone.value(own);
    // To the bit where nothing was drilled since.
    to.write(own, now == c.after ? c.before : std::clamp(now + c.before - c.after, 0.0F, 1.0F));
  };
  for (const auto& [id, changes] : last.sawn) {
    for (const Change& c : changes) take_back(id, c.voxel, c);
  }
  for (const Change& c : last.drilled) {
    const PlacedBody* const b = owner(c.voxel);
    take_back(b->body->id, c.voxel - b->body->name_of(0), c);
  }
  for (const auto& [id, pose] : last.poses) {
    if (PlacedBody* const b = placed(id); b != nullptr) b->world_from_body = pose;
  }
  if (last.kind != ActionKind::stroke) fixtures_ = last.fixtures;
  for (Renewed& r : touched) {
    std::sort(r.bricks.begin(), r.bricks.end());
    r.bricks.erase(std::unique(r.bricks.begin(), r.bricks.end()), r.bricks.end());
    effect.changed.push_back({r.id, std::move(r.bricks)});
  }
  return effect;
}

std::string World::hash() const {
  const auto& first = bodies_.front();
  if (bodies_.size() == 1 && fixtures_.empty() && first.world_from_body.rotation == Mat3{} &&
      first.world_from_body.shift_mm == Vec3{})
    return first.body->bone.hash();
  Hasher h;
  const auto add = [&](const auto& v) { h.add(&v, sizeof v); };
  for (const PlacedBody& b : bodies_) {
    const std::string bone = b.body->bone.hash();
    h.add(bone.data(), bone.size());
    add(b.body->id);
    add(b.world_from_body);
  }
  for (const Fixture& f : fixtures_) {
    add(f.id);
    add(f.plate);
    add(f.body);
    add(f.other);
    add(f.body_from_plate);
    add(f.opening_mm);
  }
  return h.hex();
}

float World::nearest(Vec3 world_mm) const {
  float most = 0;
  for (const PlacedBody& b : bodies_)
    most = std::max(most, b.body->bone.nearest(b.world_from_body.inverse()(world_mm)));
  return most;
}

double World::finest_voxel_mm() const {
  double least = bodies_.front().body->bone.frame().spacing_mm.x;
  for (const PlacedBody& b : bodies_) least = std::min(least, b.body->bone.frame().spacing_mm.x);
  return least;
}

double World::volume_mm3() const {
  double sum = 0;
  for (const PlacedBody& b : bodies_) sum += b.body->bone.sum() * b.body->bone.frame().voxel_volume_mm3();
  return sum;
}

}  // namespace osteo::inline simulation
