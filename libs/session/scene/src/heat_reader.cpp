#include "osteo/session/scene/heat_reader.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "osteo/core/base/param.h"
#include "osteo/simulation/bone/instrument.h"
#include "osteo/simulation/haptics/saw_slot.h"

namespace osteo::inline session {
namespace {

constexpr double kMsPerMinuteAndMm = 1.0 / 60 / 1000;  // rpm times mm to m/s
constexpr double kStrokeMm = 3;                        // of a reciprocating saw, to and fro; makers give 2.5 to 3.2

Vec3 vec(Ijk c) {
  return {static_cast<double>(c.i), static_cast<double>(c.j), static_cast<double>(c.k)};
}

}  // namespace

// A body as of the tick that heat has reached: servo and scene may be farther.
struct HeatReader::Body {
  std::uint32_t id = 0, first_brick = 0;
  BrickGrid bone;
  RigidTransform world_from_body;
  bool of_region = false;
  int edge = 1;  // voxels along a cell
  std::unique_ptr<HeatField> field;
  std::map<std::array<int, 3>, std::vector<std::pair<int, std::size_t>>>
      places;  // by brick of cells: cell, number in places_
  std::map<std::array<int, 3>, std::array<double, BrickGrid::kVoxels>>
      peaks;  // by brick of cells: K, where history is kept

  [[nodiscard]] Ijk cell_of(Ijk voxel) const {
    const auto down = [&](int v) { return v >= 0 ? v / edge : -((edge - 1 - v) / edge); };
    return {down(voxel.i), down(voxel.j), down(voxel.k)};
  }
  [[nodiscard]] Vec3 cells_from_world(Vec3 world_mm) const {
    const Vec3 v = bone.frame().index_from_world(world_from_body.inverse()(world_mm));
    const double off = 0.5 * (edge - 1);
    return (v - Vec3{off, off, off}) / edge;
  }
  [[nodiscard]] Vec3 body_from_cells(Vec3 cell) const {
    const double off = 0.5 * (edge - 1);
    return bone.frame().world_from_index(cell * static_cast<double>(edge) + Vec3{off, off, off});
  }
  [[nodiscard]] HeatMatter matter(Ijk cell, const StructureMap* structures) const {
    float sum = 0;
    for (int k = 0; k < edge; ++k) {
      for (int j = 0; j < edge; ++j) {
        for (int i = 0; i < edge; ++i) sum += bone.at(cell.i * edge + i, cell.j * edge + j, cell.k * edge + k);
      }
    }
    HeatMatter m{sum / static_cast<float>(edge * edge * edge), 0};
    // Soft tissue is where the structures of the patient are: known before anything is moved.
    if (structures != nullptr && structures->at_risk(body_from_cells(vec(cell))).distance_mm < 0) m.tissue = 1 - m.bone;
    return m;
  }
};

HeatReader::HeatReader(const World& world, const StructureMap* structures, double rate_hz, const HeatOfCutting& params)
    : rate_hz_(rate_hz), params_(params), structures_(structures), hottest_c_(params.body_c) {
  begin(world);
}
HeatReader::~HeatReader() = default;

std::unique_ptr<HeatReader::Body> HeatReader::body_of(const PlacedBody& placed) const {
  auto made = std::make_unique<Body>();
  Body* const b = made.get();
  b->id = placed.body->id;
  b->first_brick = placed.body->first_brick;
  b->bone = BrickGrid(placed.body->bone);
  b->world_from_body = placed.world_from_body;
  b->of_region = placed.of_region;
  const double voxel_mm = b->bone.frame().spacing_mm.x;
  while (b->edge < 8 && b->edge * voxel_mm < 0.75 * params_.cell_mm) b->edge *= 2;
  b->field = std::make_unique<HeatField>(b->edge * voxel_mm, HeatMaterials{},
                                         [b, this](Ijk cell) { return b->matter(cell, structures_); });
  return made;
}

void HeatReader::begin(const World& world) {
  for (const auto& b : bodies_) retire(*b);
  bodies_.clear();
  for (const PlacedBody& placed : world.bodies()) bodies_.push_back(body_of(placed));
  for (std::uint32_t hand = 0; hand < guides_.size(); ++hand) guides_[hand] = world.cutting_guide(hand);
  std::stable_sort(bodies_.begin(), bodies_.end(),
                   [](const auto& a, const auto& b) { return a->of_region && !b->of_region; });
  double longest_s = 0.2;
  for (const auto& b : bodies_) longest_s = std::min(longest_s, b->field->longest_step_s());
  every_ = static_cast<std::uint64_t>(std::max(1.0, std::floor(longest_s * rate_hz_)));
  place_structures();
}

// Of each face one place in a cell, in the finest body that has bone about there.
void HeatReader::place_structures() {
  if (structures_ == nullptr) return;
  const bool first_time = places_.empty();
  std::size_t next = 0;
  std::set<std::array<int, 5>> known;
  for (std::size_t n = 0; n < structures_->values().size(); ++n) {
    if (structures_->opened(n)) continue;
    const std::uint8_t structure = structures_->values()[n];
    for (const auto& q : structures_->face(n).points_mm) {
      const Vec3 at{static_cast<double>(q[0]), static_cast<double>(q[1]), static_cast<double>(q[2])};
      for (const auto& b : bodies_) {
        const Vec3 v = b->bone.frame().index_from_world(at);
        const auto whole = [](double x) { return static_cast<int>(std::floor(x + 0.5)); };
        const Ijk voxel{whole(v.x), whole(v.y), whole(v.z)};
        if (b->of_region && b->bone.find(voxel.i, voxel.j, voxel.k) == BrickGrid::kNone) continue;
        const Ijk c = b->cell_of(voxel);
        if (!known.insert({static_cast<int>(b->id), c.i, c.j, c.k, structure}).second) break;
        if (first_time) places_.push_back({structure, {params_.body_c, 0, false}, params_.body_c});
        if (next < places_.size())
          b->places[{c.i >> 3, c.j >> 3, c.k >> 3}].emplace_back((c.i & 7) | (c.j & 7) << 3 | (c.k & 7) << 6, next++);
        break;
      }
    }
  }
}

void HeatReader::retire(Body& body) {
  const HeatLedger l = body.field->ledger();
  retired_.added_j += l.added_j;
  retired_.chips_j += l.chips_j;
  retired_.cooled_j += l.cooled_j;
  retired_.forgotten_j += l.forgotten_j + body.field->stored_j();
}

void HeatReader::resync(const World& world) {
  applied_early_ += pending_.size();
  pending_.clear();
  begin(world);
  ++restarts_;
  courses_.clear();
  steps_ = 0;
}

void HeatReader::scene_changed(const World& world, const World::Effect& effect) {
  Pending a;
  for (const PlacedBody& placed : world.bodies()) a.poses.emplace_back(placed.body->id, placed.world_from_body);
  for (const auto& made : effect.made) a.made.push_back(body_of(*world.find(made.body)));
  a.gone = effect.gone;
  a.changed = changed_bricks(world, effect);
  pending_.push_back(std::move(a));
}

void HeatReader::action(const SceneAction& action) {
  if (action.is(ActionKind::irrigate)) water_ = action;
  if (action.is(ActionKind::cutting_guide) && action.hand < guides_.size()) guides_[action.hand] = action.guide();
  if (!row_of(action).changes_world) return;
  if (applied_early_ > 0) {
    --applied_early_;
    return;
  }
  if (pending_.empty()) return;
  Pending a = std::move(pending_.front());
  pending_.pop_front();
  for (auto& made : a.made) bodies_.push_back(std::move(made));
  for (const auto& c : a.changed) {
    const auto it = std::find_if(bodies_.begin(), bodies_.end(), [&](const auto& b) { return b->id == c.body; });
    if (it == bodies_.end()) continue;
    Body& b = **it;
    std::size_t n = 0;
    for (const std::uint32_t brick : c.bricks) {
      for (VoxelKey v = brick * BrickGrid::kVoxels; v < (brick + 1) * BrickGrid::kVoxels; ++v, ++n)
        b.bone.set(v, c.values[n]);
    }
    for (const std::uint32_t brick : c.bricks) {
      const Ijk first = b.cell_of(b.bone.coordinate(brick * BrickGrid::kVoxels));
      const int wide = std::max(1, BrickGrid::kEdge / b.edge);
      for (int k = 0; k < wide; ++k) {
        for (int j = 0; j < wide; ++j) {
          for (int i = 0; i < wide; ++i) {
            const Ijk cell{first.i + i, first.j + j, first.k + k};
            b.field->set_matter(cell, b.matter(cell, structures_));
          }
        }
      }
    }
  }
  std::erase_if(bodies_, [&](const auto& b) {
    if (std::find(a.gone.begin(), a.gone.end(), b->id) == a.gone.end()) return false;
    retire(*b);
    return true;
  });
  for (const auto& [id, pose] : a.poses) {
    for (const auto& b : bodies_) {
      if (b->id == id) b->world_from_body = pose;
    }
  }
}

void HeatReader::tick(const TickRecord& record, std::span<const VoxelChange> changes) {
  for (const VoxelChange& c : changes) {
    const std::uint32_t brick = c.voxel / BrickGrid::kVoxels;
    for (const auto& b : bodies_) {
      if (brick < b->first_brick || brick - b->first_brick >= b->bone.brick_count()) continue;
      const VoxelKey own = c.voxel - b->first_brick * BrickGrid::kVoxels;
      b->bone.set(own, c.density);
      const Ijk cell = b->cell_of(b->bone.coordinate(own));
      b->field->set_matter(cell, b->matter(cell, structures_));
      break;
    }
  }
  heat(record);
  if (record.hand > 0 || record.tick % every_ != 0) return;  // once for all hands
  if (water_.values[4] > 0)
    cool({water_.values[0], water_.values[1], water_.values[2]}, water_.values[3], std::min(1.0, water_.values[4]));
  step();
}

void HeatReader::heat(const TickRecord& record) {
  if ((record.flags & (kPlateInHand | kPoseInvalid)) != 0) return;
  const Instrument& held = instrument_of(record.device.tool);
  const Vec3 tip = from_floats(record.device.position_mm) + from_floats(record.shown_offset_mm);
  if (held.kind == InstrumentKind::irrigator && record.device.pedal > 0 && record.tick % every_ == 0)
    cool(tip, held.reach_mm, record.device.pedal / 255.0);
  const Burr* const edge = held.cutter();
  const double press_n = static_cast<double>(record.normal_force_n);
  if (edge == nullptr || press_n <= 0 || record.speed_rpm <= 0) return;
  // A burr's rim goes once around in a turn, a saw's teeth twice their stroke.
  const bool saw = held.kind == InstrumentKind::saw;
  const double way_mm = saw ? 2 * kStrokeMm * held.speed_share : std::numbers::pi * edge->diameter_mm;
  const double speed_ms = way_mm * static_cast<double>(record.speed_rpm) * kMsPerMinuteAndMm;
  const BurrKindRow& kind = row_of(edge->kind);
  const double watt = kind.heat_by_work * params_.cutting_share * press_n * speed_ms +
                      kind.heat_by_force * params_.diamond_w_per_n * press_n;
  // Of the step that comes next: it ends with the first hand's tick, so those of others there begin another.
  const std::uint64_t into = record.tick % every_;
  const double when = into == 0 ? (record.hand == 0 ? 1 - 0.5 / static_cast<double>(every_) : 0)
                                : (static_cast<double>(into) - 0.5) / static_cast<double>(every_);
  // Bone pushes the hand away from where it is pressed.
  const Vec3 force = from_floats(record.force_n);
  const double radius = held.head.start_radius_mm;
  const Vec3 contact = length(force) > 0 ? tip - normalized(force) * radius : tip;
  if (!saw) {
    heat(contact, radius, watt, when);
    return;
  }
  // Along the blade, wherever there is bone at it.
  constexpr int kPlaces = 6;
  const CuttingGuide none;
  const CuttingGuide& guide = record.hand < guides_.size() ? guides_[record.hand] : none;
  const Vec3 along = tool_axis(record, guide) * (held.head.length_mm / (kPlaces - 1));
  std::array<bool, kPlaces> in{};
  for (int n = 0; n < kPlaces; ++n)
    in[static_cast<std::size_t>(n)] = std::any_of(bodies_.begin(), bodies_.end(), [&](const auto& b) {
      return b->field->holds(
                 {b->cells_from_world(contact + along * n), std::max(0.9, 0.5 * radius / b->field->cell_mm())}) > 0;
    });
  const auto met = std::count(in.begin(), in.end(), true);
  for (int n = 0; n < kPlaces; ++n) {
    if (in[static_cast<std::size_t>(n)]) heat(contact + along * n, radius, watt / static_cast<double>(met), when);
  }
}

// Where the edge has left but crumbs they cannot take it all: the bone around them does.
void HeatReader::heat(Vec3 contact_mm, double radius_mm, double watt, double when) {
  for (const double wider : {1.0, 1.5, 2.2}) {
    for (const auto& b : bodies_) {
      const HeatField::Ball ball{b->cells_from_world(contact_mm),
                                 wider * std::max(0.9, 0.5 * radius_mm / b->field->cell_mm())};
      if (b->field->holds(ball) < (wider < 2 ? 3 * b->field->full_cell_j_per_k() : 0)) continue;
      if (b->field->add(ball, watt / rate_hz_, when) > 0) return;
    }
  }
}

void HeatReader::cool(Vec3 at_mm, double radius_mm, double share) {
  for (const auto& b : bodies_)
    b->field->cool({b->cells_from_world(at_mm), radius_mm / b->field->cell_mm()}, share * params_.film_w_per_m2_k,
                   params_.water_c - params_.body_c);
}

void HeatReader::step() {
  const double seconds = step_s();
  for (const auto& b : bodies_) {
    b->field->step(seconds);
    hottest_c_ = std::max(hottest_c_, params_.body_c + b->field->hottest());
    for (const Ijk brick : b->field->warm_bricks()) {
      const std::span<const double> kelvin = b->field->brick(brick);
      if (history_) {
        auto& peaks = b->peaks[{brick.i, brick.j, brick.k}];
        for (std::size_t c = 0; c < kelvin.size(); ++c) peaks[c] = std::max(peaks[c], kelvin[c]);
      }
      const auto places = b->places.find({brick.i, brick.j, brick.k});
      if (places == b->places.end()) continue;
      for (const auto& [cell, number] : places->second) {
        Place& p = places_[number];
        p.now_c = params_.body_c + kelvin[static_cast<std::size_t>(cell)];
        p.dose.stay(p.now_c, seconds);
      }
    }
  }
  if (history_) keep_course();
}

void HeatReader::keep_history() {
  history_ = true;
}

void HeatReader::keep_course() {
  std::map<std::uint8_t, double> now;
  for (const Place& p : places_) {
    if (p.dose.peak_c <= params_.body_c) continue;
    double& c = now.try_emplace(p.structure, p.now_c).first->second;
    c = std::max(c, p.now_c);
  }
  for (const auto& [value, c] : now) {
    std::vector<double>& course = courses_[value];
    course.resize(steps_, params_.body_c);  // until now it was as warm as the body
    course.push_back(c);
  }
  ++steps_;
}

double HeatReader::peak_c_at(Vec3 world_mm) const {
  double peak_k = 0;
  for (const auto& b : bodies_) {
    if (b->peaks.empty()) continue;
    const Vec3 x = b->cells_from_world(world_mm);
    const Ijk lo{static_cast<int>(std::floor(x.x)), static_cast<int>(std::floor(x.y)),
                 static_cast<int>(std::floor(x.z))};
    double sum = 0, weights = 0;
    for (int n = 0; n < 8; ++n) {
      const Ijk c{lo.i + (n & 1), lo.j + (n >> 1 & 1), lo.k + (n >> 2)};
      if (b->bone.nearest(b->body_from_cells(vec(c))) <= 0) continue;
      const double w = (1 - std::abs(x.x - c.i)) * (1 - std::abs(x.y - c.j)) * (1 - std::abs(x.z - c.k));
      const auto brick = b->peaks.find({c.i >> 3, c.j >> 3, c.k >> 3});
      if (brick != b->peaks.end())
        sum += w * brick->second[static_cast<std::size_t>((c.i & 7) | (c.j & 7) << 3 | (c.k & 7) << 6)];
      weights += w;
    }
    if (weights > 0) peak_k = std::max(peak_k, sum / weights);
  }
  return params_.body_c + peak_k;
}

double HeatReader::bone_at(Vec3 world_mm) const {
  float most = 0;
  for (const auto& b : bodies_) most = std::max(most, b->bone.nearest(b->world_from_body.inverse()(world_mm)));
  return static_cast<double>(most);
}

std::optional<HeatReader::Warmest> HeatReader::warmest_left() const {
  std::optional<Warmest> warmest;
  for (const auto& b : bodies_) {
    for (const auto& [brick, peaks] : b->peaks) {
      for (int c = 0; c < BrickGrid::kVoxels; ++c) {
        const double peak_c = params_.body_c + peaks[static_cast<std::size_t>(c)];
        if (peak_c <= (warmest ? warmest->peak_c : params_.body_c)) continue;
        const Ijk cell{brick[0] * 8 + (c & 7), brick[1] * 8 + (c >> 3 & 7), brick[2] * 8 + (c >> 6)};
        if (b->matter(cell, nullptr).bone >= 0.5F)
          warmest = Warmest{b->world_from_body(b->body_from_cells(vec(cell))), peak_c};
      }
    }
  }
  return warmest;
}

double HeatReader::celsius_at(Vec3 world_mm) const {
  double kelvin = 0;
  for (const auto& b : bodies_) {
    const double k = b->field->at(b->cells_from_world(world_mm));
    if (std::abs(k) > std::abs(kelvin)) kelvin = k;
  }
  return params_.body_c + kelvin;
}

void HeatReader::for_warm_places(const std::function<void(Vec3 centre_mm, double radius_mm)>& f) const {
  for (const auto& b : bodies_) {
    const double radius_mm = 4 * std::numbers::sqrt3 * b->field->cell_mm();
    for (const Ijk at : b->field->warm_bricks())
      f(b->world_from_body(b->body_from_cells({at.i * 8 + 3.5, at.j * 8 + 3.5, at.k * 8 + 3.5})), radius_mm);
  }
}

std::map<std::uint8_t, HeatReader::OfStructure> HeatReader::structures() const {
  std::map<std::uint8_t, OfStructure> all;
  std::map<std::uint8_t, std::array<std::size_t, 2>> counts;
  for (const Place& p : places_) {
    auto& [over, of] = counts[p.structure];
    ++of;
    over += p.dose.cem43_min > kBoneLimitCem43 ? 1 : 0;
    if (p.dose.peak_c <= params_.body_c) continue;
    OfStructure& s = all[p.structure];
    s.worst.peak_c = std::max(s.worst.peak_c, p.dose.peak_c);
    s.worst.cem43_min = std::max(s.worst.cem43_min, p.dose.cem43_min);
    s.worst.coagulated = s.worst.coagulated || p.dose.coagulated;
    s.now_c = std::max(s.now_c, p.now_c);
  }
  for (auto& [value, s] : all)
    s.share_over_limit = static_cast<double>(counts[value][0]) / static_cast<double>(counts[value][1]);
  return all;
}

HeatLedger HeatReader::ledger() const {
  HeatLedger sum = retired_;
  for (const auto& b : bodies_) {
    const HeatLedger& l = b->field->ledger();
    sum.added_j += l.added_j;
    sum.chips_j += l.chips_j;
    sum.cooled_j += l.cooled_j;
    sum.forgotten_j += l.forgotten_j;
  }
  return sum;
}

double HeatReader::stored_j() const {
  double sum = 0;
  for (const auto& b : bodies_) sum += b->field->stored_j();
  return sum;
}

std::size_t HeatReader::warm_bricks() const {
  std::size_t sum = 0;
  for (const auto& b : bodies_) sum += b->field->bricks();
  return sum;
}

std::vector<std::string> reported(const HeatReader& heat, const StructureMap* structures) {
  const auto tenths = [](double x) { return format_number(std::round(x * 10) / 10); };
  const HeatLedger l = heat.ledger();
  std::vector<std::string> lines{"warmest bone " + tenths(heat.hottest_c()) + " C; " + tenths(l.added_j) +
                                 " J into bone, of which " + tenths(l.chips_j) + " left with chips, " +
                                 tenths(l.cooled_j) + " into water"};
  if (structures == nullptr) {
    lines.emplace_back("the case lists no critical structures");
    return lines;
  }
  for (const auto& [value, s] : heat.structures()) {
    const double minutes = s.worst.cem43_min;
    lines.push_back(structures->name_of(value) + ": " + tenths(s.worst.peak_c) + " C at most, " +
                    format_number(minutes < 1000 ? std::round(minutes * 100) / 100 : std::round(minutes)) +
                    " min at 43 C" + (s.worst.coagulated ? ", COAGULATED" : ""));
  }
  return lines;
}

}  // namespace osteo::inline session
