#include "osteo/assessment/evidence/detail/product.h"

#include <algorithm>
#include <cmath>

#include "cavity.h"
#include "osteo/core/base/parallel.h"
#include "product_lattice.h"

namespace osteo::inline assessment {

namespace {

// Cells of structures that a cavity does not go through, and of those that it does, by their labels.
struct Walls {
  BitMask blocked, closed;
};
Walls walls_of(const Frame& lattice, const std::vector<std::uint8_t>& label, const std::array<bool, 256>& blocks,
               const Context& context) {
  Walls w{BitMask(lattice.dims), BitMask(lattice.dims)};
  const auto nx = static_cast<std::size_t>(lattice.dims[0]);
  parallel_for(w.blocked.rows(), 256, context.threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t r = begin; r < end; ++r) {
      const std::uint8_t* const row = label.data() + r * nx;
      const std::span<std::uint64_t> blocked = w.blocked.row(r), closed = w.closed.row(r);
      for (std::size_t i = 0; i < nx; ++i) {
        if (row[i] == 0) continue;
        (blocks[row[i]] ? blocked : closed)[i / 64] |= std::uint64_t{1} << (i % 64);
      }
    }
  });
  return w;
}

}  // namespace

Product::~Product() = default;

Product::Product(const World& before, const World& after, const StructureMap& structures, const Procedure& procedure,
                 std::vector<RemovedVoxel> removed, const Context& context)
    : after_world_(after),
      structures_(structures),
      procedure_(procedure),
      removed_(std::move(removed)),
      cells_(std::make_unique<Lattice>()) {
  for (std::size_t n = 0; n < structures_.values().size(); ++n) number_[structures_.values()[n]] = n;
  lay_lattice(before);
  cells_->before = solid_cells(before, frame_, context);
  cells_->after = solid_cells(after, frame_, before, cells_->before, context);
  cells_->bone = block_of(cells_->after);
  std::array<bool, 256> blocks{};
  std::vector<CellBlock> boxes;
  for (const std::uint8_t v : structures_.values()) {
    // What the procedure does not name, and is a space, is not known to be one: it ends a cavity.
    blocks[v] = !procedure.enters(structures_.name_of(v));
    boxes.push_back(cells_->near(v, 0));
  }
  cells_->label = label_cells(frame_, structures_, boxes, context);
  Walls walls = walls_of(frame_, cells_->label, blocks, context);
  BitMask gone = cells_->before;
  for (std::size_t w = 0; w < gone.words().size(); ++w) {
    gone.words()[w] &= ~cells_->after.words()[w];
    walls.blocked.words()[w] |= cells_->after.words()[w];
  }
  cells_->cavity = cavity_of(walls.blocked, gone, walls.closed, frame_.spacing_mm.x, kBallMm, kOpenedMm, context);
  measure_cavity_distances(context);
}

// Around the cavity as far as an item's verdict goes by a distance; to faces and curves whose distance itself is told,
// all the way.
void Product::measure_cavity_distances(const Context& context) {
  const double h = frame_.spacing_mm.x;
  cells_->opened = block_of(cells_->cavity);
  if (cells_->opened.empty()) return;
  double reach_mm = 2 * h;
  CellBlock part;
  for (const ScaleItem& item : procedure_.items) {
    std::uint8_t s = 0;
    if (item.kind == ItemKind::exposed || item.kind == ItemKind::followed)
      reach_mm = std::max(reach_mm, item.cover_mm + off_mm() + h / 2);
    if (item.kind == ItemKind::thinned && value_of(item.structure, s)) part = block_around(part, cells_->near(s, h));
    for (const Vec3 p : item.curve_mm) {
      const Vec3 x = index_of(p);
      CellBlock at;
      for (std::size_t a = 0; a < 3; ++a) {
        at.lo[a] = static_cast<int>(std::clamp(std::floor(x[a]) - 1, 0.0, frame_.dims[a] - 1.0));
        at.hi[a] = static_cast<int>(std::clamp(std::floor(x[a]) + 3, 1.0, double(frame_.dims[a])));
      }
      part = block_around(part, at);
    }
  }
  // A value between cells may be less than the distance by as much as a cube's diagonal, and its corners lie a cell
  // away.
  const int more = static_cast<int>(std::ceil(std::min(reach_mm / h, 1e6) + std::sqrt(3.0))) + 2;
  CellBlock around = cells_->opened;
  for (std::size_t a = 0; a < 3; ++a) {
    around.lo[a] = std::max(0, around.lo[a] - more);
    around.hi[a] = std::min(frame_.dims[a], around.hi[a] + more);
  }
  cells_->to_cavity = CavityDistance(cells_->cavity, frame_, block_around(part, around), context);
}

void Product::lay_lattice(const World& before) {
  const Frame& bone = before.bodies().front().body->bone.frame();
  const double finest = before.finest_voxel_mm();
  double h = std::min(finest, kCoarsestMm);
  // The box, in the bone's own directions.
  const Mat3 back = transposed(bone.direction);
  Vec3 lo{1e9, 1e9, 1e9}, hi = lo * -1;
  const auto take = [&](Vec3 p_mm) {
    const Vec3 q = back * (p_mm - bone.origin_mm);
    for (std::size_t a = 0; a < 3; ++a) {
      lo[a] = std::min(lo[a], q[a]);
      hi[a] = std::max(hi[a], q[a]);
    }
  };
  for (const RemovedVoxel& v : removed_) take(v.own_mm);
  for (std::size_t n = 0; n < structures_.values().size(); ++n) {
    if (procedure_.find(structures_.name_of(structures_.values()[n])) == nullptr) continue;
    for (const auto& p : structures_.face(n).points_mm) take(from_floats(p));
  }
  if (lo.x > hi.x) take(bone.centre_mm());
  // No farther than the bone: beyond it there is nothing.
  const Vec3 far{(bone.dims[0] - 1) * bone.spacing_mm.x, (bone.dims[1] - 1) * bone.spacing_mm.y,
                 (bone.dims[2] - 1) * bone.spacing_mm.z};
  for (std::size_t a = 0; a < 3; ++a) {
    lo[a] = std::max(lo[a] - kAroundMm, -kAroundMm);
    hi[a] = std::max(std::min(hi[a] + kAroundMm, far[a] + kAroundMm), lo[a] + 2 * kAroundMm);
  }
  const auto count = [&](double edge) {
    double n = 1;
    for (std::size_t a = 0; a < 3; ++a) n *= std::floor((hi[a] - lo[a]) / edge) + 2;
    return n;
  };
  if (count(h) > static_cast<double>(kMaxCells)) {
    while (count(h) > static_cast<double>(kMaxCells)) h *= 1.05;
    word_ = "the final product was measured on cubes of " + format_number(std::round(h * 1000) / 1000) +
            " mm, to keep memory in bounds";
  }
  frame_ = bone;
  frame_.spacing_mm = {h, h, h};
  Vec3 first;
  for (std::size_t a = 0; a < 3; ++a) {
    first[a] = std::floor(lo[a] / h) * h;
    frame_.dims[a] = static_cast<int>(std::ceil((hi[a] - first[a]) / h)) + 1;
  }
  frame_.origin_mm = bone.origin_mm + bone.direction * first;
  turn_ = inverse(frame_.direction);
  for (std::size_t n = 0; n < structures_.values().size(); ++n) {
    Lattice::Box& box = cells_->faces[structures_.values()[n]];
    for (const auto& p : structures_.face(n).points_mm) {
      const Vec3 x = index_of(from_floats(p));
      for (std::size_t a = 0; a < 3; ++a) {
        box.lo[a] = std::min(box.lo[a], x[a]);
        box.hi[a] = std::max(box.hi[a], x[a]);
      }
    }
  }
  cells_->dims = frame_.dims;
  cells_->cell_mm = h;
}

Vec3 Product::place(int i, int j, int k) const {
  return frame_.world_from_index({double(i), double(j), double(k)});
}

std::size_t Product::offset(int i, int j, int k) const {
  return (static_cast<std::size_t>(k) * static_cast<std::size_t>(frame_.dims[1]) + static_cast<std::size_t>(j)) *
             static_cast<std::size_t>(frame_.dims[0]) +
         static_cast<std::size_t>(i);
}

Vec3 Product::index_of(Vec3 own_mm) const {
  const Vec3 v = turn_ * (own_mm - frame_.origin_mm);
  return {v.x / frame_.spacing_mm.x, v.y / frame_.spacing_mm.y, v.z / frame_.spacing_mm.z};
}

bool Product::cell(Vec3 own_mm, std::array<int, 3>& at) const {
  const Vec3 x = index_of(own_mm);
  for (std::size_t a = 0; a < 3; ++a) {
    const double r = std::floor(x[a] + 0.5);
    if (r < 0 || r >= frame_.dims[a]) return false;
    at[a] = static_cast<int>(r);
  }
  return true;
}

std::size_t Product::cell(Vec3 own_mm) const {
  std::array<int, 3> at{};
  return cell(own_mm, at) ? offset(at[0], at[1], at[2]) : frame_.voxel_count();
}

double Product::cavity_distance_mm(Vec3 own_mm) const {
  if (cells_->to_cavity.empty()) return 1e9;
  return std::max(0.0, cells_->to_cavity.linear(index_of(own_mm)) - frame_.spacing_mm.x / 2);
}

bool Product::value_of(const std::string& name, std::uint8_t& value) const {
  for (const std::uint8_t v : structures_.values()) {
    if (structures_.name_of(v) == name) {
      value = v;
      return true;
    }
  }
  return false;
}

double Product::distance_to(std::uint8_t value, Vec3 own_mm) const {
  const double d = structures_.distance_mm(number_[value], own_mm);
  return d >= structures_.reach_mm() ? 1e9 : d;
}

void Product::keep(Result& r, Vec3 at) const {
  constexpr std::size_t kMax = 20000;
  ++r.evidence_count;
  if (r.evidence_mm.size() < kMax) r.evidence_mm.push_back(at);
}

double Product::off_mm() const {
  return 0.7 * frame_.spacing_mm.x;
}

void Product::settle(Result& r, bool passes_at_worst, bool passes_at_best) const {
  if (passes_at_worst == passes_at_best) return;
  r.margin = r.pass ? std::clamp(r.margin, 0.0, kDraw / 2) : std::clamp(r.margin, -kDraw / 2, 0.0);
  r.word = joined(r.word, "a draw: within what cubes of " +
                              format_number(std::round(frame_.spacing_mm.x * 1000) / 1000) + " mm can tell");
}

std::string Product::no_cavity() const {
  return removed_.empty() ? "no voxel lost half of its bone: there is no cavity"
                          : "nothing was opened: no ball of " + format_number(kBallMm) +
                                " mm comes in where bone was removed, so there is no cavity to measure from";
}

std::string Product::joined(const std::string& a, const std::string& b) {
  return a.empty() ? b : a + "; " + b;
}

Product::Result Product::evaluate(const ScaleItem& item, Vec3 approach, const std::vector<std::string>& injured) const {
  Result r;
  r.item = &item;
  r.threshold = item.threshold;
  const double h = frame_.spacing_mm.x;
  if (item.kind == ItemKind::not_violated || item.kind == ItemKind::no_cells_left) r.evidence_each = h * h * h;
  if (item.kind == ItemKind::no_overhang) r.evidence_each = h * h;
  switch (item.kind) {
    case ItemKind::not_violated:
      r.unit = "mm3";
      break;
    case ItemKind::no_hole:
      r.unit = "mm2";
      break;
    case ItemKind::thinned:
    case ItemKind::sharp_angle:
    case ItemKind::margin:
      r.unit = "mm";
      break;
    default:
      r.unit = "1";
  }
  std::uint8_t s = 0;
  if (!item.structure.empty() && !value_of(item.structure, s)) {
    r.word = "the case has no '" + item.structure + "'";
    return r;
  }
  switch (item.kind) {
    case ItemKind::exposed:
      exposed(item, s, r);
      break;
    case ItemKind::not_violated:
      violated(item, s, injured, r);
      break;
    case ItemKind::no_hole:
      hole(item, s, r);
      break;
    case ItemKind::no_cells_left:
      cells_left(item, s, r);
      break;
    case ItemKind::no_overhang:
      overhang(item, s, approach, r);
      break;
    case ItemKind::thinned:
      thinned(item, s, r);
      break;
    case ItemKind::sharp_angle:
      sharp(item, s, r);
      break;
    case ItemKind::followed:
      followed(item, s, r);
      break;
    case ItemKind::margin:
      margin(item, approach, r);
      break;
    case ItemKind::pieces:
    case ItemKind::fixed:
      return count(item, after_world_);
  }
  return r;
}

double Product::cavity_mm3() const {
  return static_cast<double>(cells_->cavity.count()) * frame_.voxel_volume_mm3();
}

}  // namespace osteo::inline assessment
