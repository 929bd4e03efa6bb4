// Items and regions that go by cells: what was violated, left, hidden, and how thick bone is.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "osteo/assessment/evidence/detail/product.h"
#include "osteo/core/base/parallel.h"
#include "osteo/geometry/distance/binary_distance.h"
#include "product_lattice.h"

namespace osteo::inline assessment {

namespace {
constexpr double kFaceOff = 0.36;  // of a label voxel: by how much the face of a structure may be off, at most
}

void Product::violated(const ScaleItem& item, std::uint8_t s, const std::vector<std::string>& injured,
                       Result& r) const {
  // What lies so near the face that another lattice would have put it on the other side. Outside it the labels' own
  // error counts too: a sheet of the structure that is thinner has no voxel's middle in it, and would count as nothing.
  const double beyond = off_mm() + kFaceOff * structures_.label_spacing_mm()[1];
  double surely = 0, perhaps = 0;
  for (const RemovedVoxel& v : removed_) {
    const double d = distance_to(s, v.own_mm), mm3 = static_cast<double>(v.mm3);
    if (d < -off_mm()) surely += mm3;
    if (d < beyond) perhaps += mm3;
    if (d >= 0) continue;
    const StructureMap::Answer a = structures_.at(v.own_mm);
    if (a.structure != s || a.distance_mm >= 0) continue;
    r.value += mm3;
    keep(r, v.own_mm);
  }
  r.measured = true;
  const bool reached = std::find(injured.begin(), injured.end(), item.structure) != injured.end();
  r.pass = r.value <= item.threshold && !reached;
  r.margin = (item.threshold - r.value) / item.spread;
  // Nothing gone is as good as it gets, whatever is allowed.
  if (r.pass && r.value == 0) r.margin = std::max(1.0, r.margin);
  if (!r.pass) r.margin = std::min(-1.0, r.margin);
  if (reached) {
    r.word = "a running burr or saw reached into it";
  } else {
    settle(r, perhaps <= item.threshold, surely <= item.threshold);
  }
}

void Product::cells_left(const ScaleItem& item, std::uint8_t s, Result& r) const {
  std::uint8_t cells = 0;
  if (!value_of(item.cells, cells)) {
    r.word = "the case has no '" + item.cells + "'";
    return;
  }
  std::uint64_t all = 0, left = 0, beside = 0;  // beside: next to the cavity
  each_cell(common_block(cells_->near(s, item.within_mm), cells_->near(cells, 0)), [&](int i, int j, int k) {
    if (cells_->label[offset(i, j, k)] != cells || distance_to(s, place(i, j, k)) > item.within_mm) return;
    ++all;
    if (cells_->cavity.at(i, j, k)) return;
    ++left;
    if (!cells_->to_cavity.empty() && cells_->to_cavity.at(i, j, k) <= frame_.spacing_mm.x * 1.01) ++beside;
    keep(r, place(i, j, k));
  });
  if (all == 0) {
    r.word = "no cells lie within " + format_number(item.within_mm) + " mm of it";
    return;
  }
  r.measured = true;
  const auto share = [&](std::uint64_t n) { return static_cast<double>(n) / static_cast<double>(all); };
  r.value = share(left);
  r.pass = r.value <= item.threshold;
  r.margin = (item.threshold - r.value) / item.spread;
  settle(r, share(left + beside) <= item.threshold, share(left - beside) <= item.threshold);
}

void Product::overhang(const ScaleItem& item, std::uint8_t s, Vec3 approach, Result& r) const {
  const Vec3 given = normalized({item.towards[0], item.towards[1], item.towards[2]});
  const Vec3 axis = length(given) > 0 ? given : approach;
  if (length(axis) == 0) {
    r.word = "it is not known from where it is looked at: neither \"towards\" nor a burr that drilled";
    return;
  }
  // The axis and eight directions on the cone's mantle, 15 degrees off.
  std::vector<Vec3> views{axis};
  const Vec3 u = any_perpendicular(axis), v = cross(axis, u);
  for (int d = 0; d < 8; ++d) {
    const double a = d * std::numbers::pi / 4, off = 15 * std::numbers::pi / 180;
    views.push_back(axis * std::cos(off) + (u * std::cos(a) + v * std::sin(a)) * std::sin(off));
  }
  // At rest: seen through the lattice, half a cell a step. A cell's length of bone is in the way; less is how a
  // slanting wall is made of cells.
  const double h = frame_.spacing_mm.x;
  const BitMask &after = cells_->after, &cavity = cells_->cavity;
  const CellBlock& bone = cells_->bone;
  const auto open = [&](Vec3 from, Vec3 way) {
    const Vec3 goes = index_of(from + way) - index_of(from);
    int in_bone = 0;
    std::array<int, 3> c{};
    for (double t = h;; t += h / 2) {
      if (!cell(from + way * t, c)) return true;
      in_bone = after.at(c[0], c[1], c[2]) ? in_bone + 1 : 0;
      if (in_bone == 3) return false;
      // Beyond all bone, and on its way from it.
      for (std::size_t a = 0; a < 3; ++a) {
        if ((goes[a] >= 0 && c[a] > bone.hi[a]) || (goes[a] <= 0 && c[a] < bone.lo[a] - 1)) return true;
      }
    }
  };
  const auto is_bone = [&](int i, int j, int k) {
    return i >= 0 && j >= 0 && k >= 0 && i < frame_.dims[0] && j < frame_.dims[1] && k < frame_.dims[2] &&
           after.at(i, j, k);
  };
  std::uint64_t all = 0, seen = 0;
  each_cell(common_block(cells_->near(s, item.within_mm), cells_->opened), [&](int i, int j, int k) {
    if (!cavity.at(i, j, k) || k == 0 || k + 1 == frame_.dims[2]) return;
    // Of the cavity the cells at its wall.
    const bool wall = is_bone(i - 1, j, k) || is_bone(i + 1, j, k) || is_bone(i, j - 1, k) || is_bone(i, j + 1, k) ||
                      is_bone(i, j, k - 1) || is_bone(i, j, k + 1);
    if (!wall) return;
    const Vec3 at = place(i, j, k);
    if (distance_to(s, at) > item.within_mm) return;
    ++all;
    if (std::any_of(views.begin(), views.end(), [&](Vec3 w) { return open(at, w); })) {
      ++seen;
    } else {
      keep(r, at);
    }
  });
  if (all == 0) {
    r.word = "the cavity does not come within " + format_number(item.within_mm) + " mm of it";
    return;
  }
  r.measured = true;
  r.value = static_cast<double>(seen) / static_cast<double>(all);
  r.pass = r.value >= item.threshold;
  r.margin = (r.value - item.threshold) / item.spread;
}

void Product::sharp(const ScaleItem& item, std::uint8_t s, Result& r) const {
  std::uint8_t other = 0;
  if (!value_of(item.second, other)) {
    r.word = "the case has no '" + item.second + "'";
    return;
  }
  // The largest ball in bone that is left, near both plates: twice the half cell between centres and faces. Distances
  // are made around where both are near; a ball that is larger than what was looked at around there asks for all of the
  // lattice.
  const CellBlock both = common_block(cells_->near(s, item.within_mm), cells_->near(other, item.within_mm));
  Vec3 where;
  bool any = false;
  for (const double around_mm : {8.0, 1e6}) {
    Frame part = frame_;
    Ijk first;
    for (std::size_t a = 0; a < 3; ++a) {
      const double more = around_mm / frame_.spacing_mm.x + 1, last = frame_.dims[a];
      const int lo = static_cast<int>(std::max(0.0, both.lo[a] - more)),
                hi = static_cast<int>(std::min(last, both.hi[a] + more));
      (a == 0 ? first.i : a == 1 ? first.j : first.k) = lo;
      part.dims[a] = hi - lo;
    }
    const auto px = static_cast<std::size_t>(part.dims[0]), py = static_cast<std::size_t>(part.dims[1]);
    std::vector<std::uint8_t> bone(part.voxel_count());
    parallel_for(py * static_cast<std::size_t>(part.dims[2]), 64, 0, [&](std::size_t begin, std::size_t end) {
      for (std::size_t row = begin; row < end; ++row) {
        const int j = static_cast<int>(row % py) + first.j, k = static_cast<int>(row / py) + first.k;
        for (std::size_t i = 0; i < px; ++i)
          bone[row * px + i] = cells_->after.at(static_cast<int>(i) + first.i, j, k) ? 1 : 0;
      }
    });
    const std::vector<float> d2 = squared_distance_mm2(bone, part, 0);
    r.value = 0;
    any = false;
    each_cell(both, [&](int i, int j, int k) {
      if (!cells_->after.at(i, j, k)) return;
      const auto row = static_cast<std::size_t>(k - first.k) * py + static_cast<std::size_t>(j - first.j);
      const auto mm2 = static_cast<double>(d2[row * px + static_cast<std::size_t>(i - first.i)]);
      if (mm2 <= r.value * r.value) return;
      const Vec3 at = place(i, j, k);
      if (distance_to(s, at) > item.within_mm || distance_to(other, at) > item.within_mm) return;
      r.value = std::sqrt(mm2);
      where = at;
      any = true;
    });
    if (r.value <= around_mm) break;
  }
  r.measured = true;
  r.value = any ? std::max(0.0, r.value - frame_.spacing_mm.x / 2) : 0;
  if (any) keep(r, where);
  r.pass = r.value <= item.threshold;
  r.margin = (item.threshold - r.value) / item.spread;
  settle(r, r.value + off_mm() <= item.threshold, r.value - off_mm() <= item.threshold);
}

Product::Result Product::count(const ScaleItem& item, const World& world) {
  Result r;
  r.item = &item;
  r.threshold = item.threshold;
  r.unit = "1";
  if (item.kind == ItemKind::fixed) {
    r.value = static_cast<double>(world.fixtures().size());
  } else {
    for (const PlacedBody& b : world.bodies()) r.value += b.of_region ? 0 : 1;
  }
  r.measured = true;
  r.pass = r.value >= item.threshold && (item.kind == ItemKind::fixed || r.value <= item.most);
  r.margin = (item.kind == ItemKind::fixed ? r.value - item.threshold + 1
                                           : std::min(r.value - item.threshold + 1, item.most - r.value + 1)) /
             item.spread;
  if (!r.pass) r.margin = std::min(r.margin, 0.0) - 1;
  return r;
}

std::vector<Product::RegionResult> Product::regions() const {
  std::vector<RegionResult> all;
  const double cell_mm3 = frame_.voxel_volume_mm3();
  for (const ProcedureRegion& g : procedure_.regions) {
    RegionResult r;
    r.region = &g;
    std::uint8_t s = 0;
    if (!value_of(g.structure, s)) continue;
    // In blocks, of which those that lie beyond are not looked at.
    constexpr int kEdge = 4;
    const double slack_mm = block_slack_mm(structures_, frame_.spacing_mm.x, kEdge), middle = (kEdge - 1) / 2.0;
    const CellBlock near = cells_->near(s, g.within_mm);
    for (int k = near.lo[2]; k < near.hi[2]; k += kEdge) {
      for (int j = near.lo[1]; j < near.hi[1]; j += kEdge) {
        for (int i = near.lo[0]; i < near.hi[0]; i += kEdge) {
          const Vec3 centre = frame_.world_from_index({i + middle, j + middle, k + middle});
          if (structures_.distance_mm(number_[s], centre) > g.within_mm + slack_mm) continue;
          each_cell(common_block(near, {{i, j, k}, {i + kEdge, j + kEdge, k + kEdge}}), [&](int x, int y, int z) {
            if (!cells_->before.at(x, y, z) || distance_to(s, place(x, y, z)) > g.within_mm) return;
            r.bone_mm3 += cell_mm3;
            if (!cells_->after.at(x, y, z)) r.removed_mm3 += cell_mm3;
          });
        }
      }
    }
    all.push_back(r);
  }
  return all;
}

double Product::outside_targets_mm3() const {
  std::vector<std::pair<std::uint8_t, double>> targets;
  for (const ProcedureRegion& g : procedure_.regions) {
    std::uint8_t s = 0;
    if (g.kind == RegionKind::target && value_of(g.structure, s)) targets.emplace_back(s, g.within_mm);
  }
  double mm3 = 0;
  for (const RemovedVoxel& v : removed_) {
    if (std::none_of(targets.begin(), targets.end(),
                     [&](const auto& t) { return distance_to(t.first, v.own_mm) <= t.second; }))
      mm3 += static_cast<double>(v.mm3);
  }
  return mm3;
}

}  // namespace osteo::inline assessment
