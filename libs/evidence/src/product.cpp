#include "osteo/evidence/product.h"

#include <algorithm>
#include <cmath>
#include <queue>

#include "osteo/base/parallel.h"
#include "osteo/bone/world_mesh.h"
#include "osteo/evidence/visibility.h"
#include "osteo/grid/brick_linear.h"
#include "osteo/grid/brick_places.h"
#include "osteo/image/distance.h"

namespace osteo {
namespace {

std::size_t cells_of(const Frame& f) {
  return f.voxel_count();
}

// Bone of all bodies at rest, where each was at the beginning.
void fill_solid(const World& world, const Frame& frame, std::vector<std::uint8_t>& out, const Context& context) {
  const auto nx = static_cast<std::size_t>(frame.dims[0]), ny = static_cast<std::size_t>(frame.dims[1]);
  for (const PlacedBody& b : world.bodies()) {
    const BrickGrid& bone = b.body->bone;
    if (bone.brick_count() == 0) continue;
    parallel_for(ny * static_cast<std::size_t>(frame.dims[2]), 64, context.threads, [&](std::size_t begin, std::size_t end) {
      for (std::size_t row = begin; row < end; ++row) {
        const double j = static_cast<double>(row % ny), k = static_cast<double>(row / ny);
        const Vec3 first = bone.frame().index_from_world(frame.world_from_index({0, j, k}));
        const Vec3 step = bone.frame().index_from_world(frame.world_from_index({1, j, k})) - first;
        for (std::size_t i = 0; i < nx; ++i) {
          Vec3 at = first + step * static_cast<double>(i);
          // A lattice that is the bone's own reads its voxels, whatever rounding has done.
          for (std::size_t a = 0; a < 3; ++a) {
            const double near = std::round(at[a]);
            if (std::abs(at[a] - near) < 1e-6) at[a] = near;
          }
          if (out[row * nx + i] == 0 && linear_at(bone, at) >= kSolid) out[row * nx + i] = 1;
        }
      }
    });
  }
}

// From cell to cell by faces, as far as `enter` lets.
void walk(const std::array<int, 3>& dims, std::vector<std::uint32_t>& queue, const auto& enter) {
  const auto nx = static_cast<std::size_t>(dims[0]), ny = static_cast<std::size_t>(dims[1]), nz = static_cast<std::size_t>(dims[2]);
  const auto visit = [&](std::size_t c) {
    if (enter(c)) queue.push_back(static_cast<std::uint32_t>(c));
  };
  for (std::size_t q = 0; q < queue.size(); ++q) {
    const std::size_t c = queue[q], i = c % nx, j = c / nx % ny, k = c / (nx * ny);
    if (i > 0) visit(c - 1);
    if (i + 1 < nx) visit(c + 1);
    if (j > 0) visit(c - nx);
    if (j + 1 < ny) visit(c + nx);
    if (k > 0) visit(c - nx * ny);
    if (k + 1 < nz) visit(c + nx * ny);
  }
}

// What a ball of kBallMm reaches from the lattice's faces by way of bone that is gone. `solid`: as it is left; `gone`: bone that was;
// `closed`: spaces that were closed, into which no way leads but through bone that is gone.
std::vector<std::uint8_t> cavity_of(const std::vector<std::uint8_t>& solid, const std::vector<std::uint8_t>& gone,
                                    const std::vector<std::uint8_t>& closed, const Frame& frame, const Context& context) {
  const std::size_t n = frame.voxel_count();
  const double h = frame.spacing_mm.x;
  const std::array<int, 3> dims = frame.dims;
  const std::vector<float> d2 = squared_distance_mm2(solid, frame, 1, context);
  // Distances are between centres: the solid begins half a cell nearer.
  const auto least = static_cast<float>(std::pow(Product::kBallMm + h / 2, 2) * (1 - 1e-6));
  // Outside first: all that is reached without what is gone or was closed.
  std::vector<std::uint8_t> outside(n, 0), inside(n, 0);
  std::vector<std::uint32_t> queue;
  const auto enter_outside = [&](std::size_t c) {
    if (outside[c] != 0 || d2[c] < least || gone[c] != 0 || closed[c] != 0) return false;
    outside[c] = 1;
    return true;
  };
  const std::vector<float> to_gone = squared_distance_mm2(gone, frame, 1, context);
  const auto opened = static_cast<float>(Product::kOpenedMm * Product::kOpenedMm);
  const auto enter_inside = [&](std::size_t c) {
    if (inside[c] != 0 || outside[c] != 0 || d2[c] < least || to_gone[c] > opened) return false;
    inside[c] = 1;
    return true;
  };
  const auto nx = static_cast<std::size_t>(dims[0]), ny = static_cast<std::size_t>(dims[1]), nz = static_cast<std::size_t>(dims[2]);
  std::vector<std::uint32_t> at_face;  // bone that is gone, at the lattice's own face
  for (std::size_t c = 0; c < n; ++c) {
    const std::size_t i = c % nx, j = c / nx % ny, k = c / (nx * ny);
    if (i != 0 && j != 0 && k != 0 && i != nx - 1 && j != ny - 1 && k != nz - 1) continue;
    if (enter_outside(c)) queue.push_back(static_cast<std::uint32_t>(c));
    if (gone[c] != 0) at_face.push_back(static_cast<std::uint32_t>(c));
  }
  walk(dims, queue, enter_outside);
  // From there into what is gone, and on wherever the ball fits.
  std::vector<std::uint32_t> inner;
  for (const std::uint32_t c : at_face) {
    if (enter_inside(c)) inner.push_back(c);
  }
  const auto step_in = [&](std::size_t c) { return gone[c] != 0 && enter_inside(c); };
  for (const std::uint32_t c : queue) {
    const std::size_t i = c % nx, j = c / nx % ny, k = c / (nx * ny);
    const auto look = [&](std::size_t to) {
      if (step_in(to)) inner.push_back(static_cast<std::uint32_t>(to));
    };
    if (i > 0) look(c - 1);
    if (i + 1 < nx) look(c + 1);
    if (j > 0) look(c - nx);
    if (j + 1 < ny) look(c + nx);
    if (k > 0) look(c - nx * ny);
    if (k + 1 < nz) look(c + nx * ny);
  }
  walk(dims, inner, enter_inside);
  if (inner.empty()) return inside;
  // The ball sweeps what lies within its radius (and half a cell: faces, not centres) of its centre's ways.
  const std::vector<float> swept = squared_distance_mm2(inside, frame, 1, context),
                           beside = squared_distance_mm2(outside, frame, 1, context);
  const auto most = static_cast<float>(std::pow(Product::kBallMm + h / 2, 2) * (1 + 1e-6));
  for (std::size_t c = 0; c < n; ++c) {
    const bool was_outside = gone[c] == 0 && closed[c] == 0 && beside[c] < most;
    inside[c] = swept[c] < most && solid[c] == 0 && !was_outside ? 1 : 0;
  }
  return inside;
}

}  // namespace

Product::Product(const World& before, const World& after, const StructureMap& structures, const Procedure& procedure,
                 std::vector<RemovedVoxel> removed, const Context& context)
    : after_world_(after), structures_(structures), procedure_(procedure), removed_(std::move(removed)) {
  for (std::size_t n = 0; n < structures_.values().size(); ++n) {
    append(face_, structures_.face(n));
    face_of_.resize(face_.points_mm.size(), structures_.values()[n]);
  }
  for (std::size_t p = 0; p < face_.points_mm.size(); ++p) {
    Box& box = boxes_[face_of_[p]];
    for (std::size_t a = 0; a < 3; ++a) {
      box.lo[a] = std::min(box.lo[a], static_cast<double>(face_.points_mm[p][a]));
      box.hi[a] = std::max(box.hi[a], static_cast<double>(face_.points_mm[p][a]));
    }
  }
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
  for (std::size_t p = 0; p < face_.points_mm.size(); ++p) {
    if (const ProcedureStructure* const s = procedure_.find(structures_.name_of(face_of_[p])); s != nullptr)
      take(from_floats(face_.points_mm[p]));
  }
  if (lo.x > hi.x) take(bone.centre_mm());
  // No farther than the bone: beyond it there is nothing.
  const Vec3 far{(bone.dims[0] - 1) * bone.spacing_mm.x, (bone.dims[1] - 1) * bone.spacing_mm.y, (bone.dims[2] - 1) * bone.spacing_mm.z};
  for (std::size_t a = 0; a < 3; ++a) {
    lo[a] = std::max(lo[a] - kAroundMm, -kAroundMm);
    hi[a] = std::max(std::min(hi[a] + kAroundMm, far[a] + kAroundMm), lo[a] + 2 * kAroundMm);
  }
  const auto count = [&](double edge) {
    double n = 1;
    for (std::size_t a = 0; a < 3; ++a) n *= std::floor((hi[a] - lo[a]) / edge) + 2;
    return n;
  };
  if (count(h) > static_cast<double>(kMostCells)) {
    while (count(h) > static_cast<double>(kMostCells)) h *= 1.05;
    word_ = "the end product was measured on cubes of " + format_number(std::round(h * 1000) / 1000) + " mm, to keep memory in bounds";
  }
  frame_ = bone;
  frame_.spacing_mm = {h, h, h};
  Vec3 first;
  for (std::size_t a = 0; a < 3; ++a) {
    first[a] = std::floor(lo[a] / h) * h;
    frame_.dims[a] = static_cast<int>(std::ceil((hi[a] - first[a]) / h)) + 1;
  }
  frame_.origin_mm = bone.origin_mm + bone.direction * first;
  const std::size_t n = cells_of(frame_);
  before_.assign(n, 0);
  after_.assign(n, 0);
  label_.assign(n, 0);
  nearest_mm_.assign(n, 0);
  fill_solid(before, frame_, before_, context);
  fill_solid(after, frame_, after_, context);
  std::array<bool, 256> blocks{};
  for (const std::uint8_t v : structures_.values()) {
    const ProcedureStructure* const s = procedure_.find(structures_.name_of(v));
    // What the procedure does not name, and is a space, is not known to be one: it ends a cavity.
    blocks[v] = s == nullptr || s->role != ProcedureRole::enter;
  }
  const auto nx = static_cast<std::size_t>(frame_.dims[0]);
  parallel_for(n / nx, 64, context.threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t c = begin * nx; c < end * nx; ++c) {
      const StructureMap::Answer a = structures_.at(place(c));
      if (a.structure != 0 && a.distance_mm < 0) label_[c] = a.structure;
      nearest_mm_[c] = static_cast<float>(a.distance_mm);
    }
  });
  std::vector<std::uint8_t> solid(n), gone(n), closed(n);
  for (std::size_t c = 0; c < n; ++c) {
    solid[c] = after_[c] != 0 || blocks[label_[c]] ? 1 : 0;
    gone[c] = before_[c] != 0 && after_[c] == 0 ? 1 : 0;
    closed[c] = label_[c] != 0 && !blocks[label_[c]] ? 1 : 0;
  }
  cavity_ = cavity_of(solid, gone, closed, frame_, context);
  const bool any = std::find(cavity_.begin(), cavity_.end(), 1) != cavity_.end();
  if (any) {
    to_cavity_mm_ = squared_distance_mm2(cavity_, frame_, 1, context);
    for (float& d : to_cavity_mm_) d = std::sqrt(d);
  }
}

Vec3 Product::place(std::size_t c) const {
  const auto nx = static_cast<std::size_t>(frame_.dims[0]), ny = static_cast<std::size_t>(frame_.dims[1]);
  return frame_.world_from_index({static_cast<double>(c % nx), static_cast<double>(c / nx % ny), static_cast<double>(c / (nx * ny))});
}

std::size_t Product::cell(Vec3 own_mm) const {
  const Vec3 x = frame_.index_from_world(own_mm);
  std::array<std::size_t, 3> at{};
  for (std::size_t a = 0; a < 3; ++a) {
    const double r = std::floor(x[a] + 0.5);
    if (r < 0 || r >= frame_.dims[a]) return cells_of(frame_);
    at[a] = static_cast<std::size_t>(r);
  }
  return (at[2] * static_cast<std::size_t>(frame_.dims[1]) + at[1]) * static_cast<std::size_t>(frame_.dims[0]) + at[0];
}

double Product::sample(const std::vector<float>& field, Vec3 own_mm) const {
  const Vec3 x = frame_.index_from_world(own_mm);
  std::array<int, 3> lo{};
  std::array<float, 3> u{};
  for (std::size_t a = 0; a < 3; ++a) {
    const double c = std::clamp(x[a], 0.0, static_cast<double>(frame_.dims[a] - 1) - 1e-9);
    lo[a] = std::min(static_cast<int>(c), std::max(0, frame_.dims[a] - 2));
    u[a] = static_cast<float>(c - lo[a]);
  }
  float d[8];
  for (int c = 0; c < 8; ++c) {
    const int i = std::min(lo[0] + (c & 1), frame_.dims[0] - 1), j = std::min(lo[1] + (c >> 1 & 1), frame_.dims[1] - 1),
              k = std::min(lo[2] + (c >> 2), frame_.dims[2] - 1);
    d[c] = field[(static_cast<std::size_t>(k) * static_cast<std::size_t>(frame_.dims[1]) + static_cast<std::size_t>(j)) *
                     static_cast<std::size_t>(frame_.dims[0]) +
                 static_cast<std::size_t>(i)];
  }
  return static_cast<double>(mix_linear(d, u[0], u[1], u[2]));
}

double Product::cavity_distance_mm(Vec3 own_mm) const {
  if (to_cavity_mm_.empty()) return 1e9;
  return std::max(0.0, sample(to_cavity_mm_, own_mm) - frame_.spacing_mm.x / 2);
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
  const Box& box = boxes_[value];
  for (std::size_t a = 0; a < 3; ++a) {
    if (own_mm[a] < box.lo[a] - structures_.reach_mm() || own_mm[a] > box.hi[a] + structures_.reach_mm()) return 1e9;
  }
  // A point is a tool of no size.
  std::array<double, 256> each;
  static_cast<void>(structures_.clearance({0, 0, 1e-9, 1e-9}, own_mm, {0, 0, 1}, {each.data(), structures_.values().size()}));
  const auto at = std::find(structures_.values().begin(), structures_.values().end(), value);
  const double d = each[static_cast<std::size_t>(at - structures_.values().begin())];
  return d >= structures_.reach_mm() ? 1e9 : d;
}

std::vector<Product::Patch> Product::patch_of(std::uint8_t value, const ScaleItem& item) const {
  const Vec3 towards = normalized({item.towards[0], item.towards[1], item.towards[2]});
  const bool all = length(towards) == 0;
  const double least = std::cos(item.within_deg * 3.14159265358979323846 / 180);
  std::vector<Patch> patch;
  for (const auto& t : face_.triangles) {
    if (face_of_[t[0]] != value) continue;
    const Vec3 a = from_floats(face_.points_mm[t[0]]), b = from_floats(face_.points_mm[t[1]]), c = from_floats(face_.points_mm[t[2]]);
    const Vec3 n = cross(b - a, c - a);
    const double area = length(n) / 2;
    if (area <= 0 || (!all && dot(normalized(n), towards) < least)) continue;
    const Vec3 at = (a + b + c) / 3;
    // What lies outside the lattice is far from all that was done.
    patch.push_back({at, normalized(n), area, cell(at) == cells_of(frame_) ? 1e9 : cavity_distance_mm(at)});
  }
  return patch;
}

void Product::keep(Result& r, Vec3 at) const {
  constexpr std::size_t kMost = 20000;
  ++r.evidence_count;
  if (r.evidence_mm.size() < kMost) r.evidence_mm.push_back(at);
}

void Product::exposed(const ScaleItem& item, std::uint8_t s, Result& r) const {
  double shown = 0, all = 0;
  for (const Patch& p : patch_of(s, item)) {
    all += p.area_mm2;
    if (p.cover_mm > item.cover_mm) continue;
    shown += p.area_mm2;
    keep(r, p.at_mm);
  }
  if (all <= 0) {
    r.word = "no part of the structure's face looks that way";
    return;
  }
  r.measured = true;
  r.value = shown / all;
  r.pass = r.value >= item.threshold;
  r.margin = (r.value - item.threshold) / item.spread;
}

void Product::violated(const ScaleItem& item, std::uint8_t s, const std::vector<std::string>& injured, Result& r) const {
  for (const RemovedVoxel& v : removed_) {
    const StructureMap::Answer a = structures_.at(v.own_mm);
    if (a.structure != s || a.distance_mm >= 0) continue;
    r.value += static_cast<double>(v.mm3);
    keep(r, v.own_mm);
  }
  r.measured = true;
  const bool reached = std::find(injured.begin(), injured.end(), item.structure) != injured.end();
  if (reached) r.word = "a turning burr reached into it";
  r.pass = r.value <= item.threshold && !reached;
  r.margin = r.pass ? (item.threshold - r.value) / item.spread : std::min(-1.0, (item.threshold - r.value) / item.spread);
}

// Triangles that share a point hang together.
void Product::hole(const ScaleItem& item, std::uint8_t s, Result& r) const {
  const Vec3 towards = normalized({item.towards[0], item.towards[1], item.towards[2]});
  const bool all = length(towards) == 0;
  const double least = std::cos(item.within_deg * 3.14159265358979323846 / 180), bare_mm = frame_.spacing_mm.x / 2;
  std::vector<std::uint32_t> part(face_.points_mm.size());
  for (std::uint32_t p = 0; p < part.size(); ++p) part[p] = p;
  const auto root = [&](std::uint32_t p) {
    while (part[p] != p) p = part[p] = part[part[p]];
    return p;
  };
  std::vector<std::pair<std::uint32_t, std::pair<double, Vec3>>> bare;
  for (const auto& t : face_.triangles) {
    if (face_of_[t[0]] != s) continue;
    const Vec3 a = from_floats(face_.points_mm[t[0]]), b = from_floats(face_.points_mm[t[1]]), c = from_floats(face_.points_mm[t[2]]);
    const Vec3 n = cross(b - a, c - a), at = (a + b + c) / 3;
    if (!all && dot(normalized(n), towards) < least) continue;
    if (cell(at) == cells_of(frame_) || cavity_distance_mm(at) > bare_mm) continue;
    part[root(t[1])] = root(t[0]);
    part[root(t[2])] = root(t[0]);
    bare.push_back({t[0], {length(n) / 2, at}});
  }
  std::map<std::uint32_t, double> area;
  for (const auto& b : bare) area[root(b.first)] += b.second.first;
  for (const auto& [p, mm2] : area) r.value = std::max(r.value, mm2);
  for (const auto& b : bare) {
    if (area[root(b.first)] == r.value) keep(r, b.second.second);
  }
  r.measured = true;
  r.pass = r.value < item.threshold;
  r.margin = (item.threshold - r.value) / item.spread;
}

void Product::cells_left(const ScaleItem& item, std::uint8_t s, Result& r) const {
  std::uint8_t cells = 0;
  if (!value_of(item.cells, cells)) {
    r.word = "the case has no '" + item.cells + "'";
    return;
  }
  std::uint64_t all = 0, left = 0;
  for (std::size_t c = 0; c < label_.size(); ++c) {
    if (label_[c] != cells || distance_to(s, place(c)) > item.within_mm) continue;
    ++all;
    if (cavity_[c] != 0) continue;
    ++left;
    keep(r, place(c));
  }
  if (all == 0) {
    r.word = "no cells lie within " + format_number(item.within_mm) + " mm of it";
    return;
  }
  r.measured = true;
  r.value = static_cast<double>(left) / static_cast<double>(all);
  r.pass = r.value <= item.threshold;
  r.margin = (item.threshold - r.value) / item.spread;
}

void Product::overhang(const ScaleItem& item, std::uint8_t s, Vec3 approach, Result& r) const {
  const Vec3 given = normalized({item.towards[0], item.towards[1], item.towards[2]});
  const Vec3 axis = length(given) > 0 ? given : approach;
  if (length(axis) == 0) {
    r.word = "nothing tells from where it is looked at: neither \"towards\" nor a burr that drilled";
    return;
  }
  // The axis and eight directions on the cone's mantle, 15 degrees off.
  std::vector<Vec3> views{axis};
  const Vec3 u = any_perpendicular(axis), v = cross(axis, u);
  for (int d = 0; d < 8; ++d) {
    const double a = d * 3.14159265358979323846 / 4, off = 15 * 3.14159265358979323846 / 180;
    views.push_back(axis * std::cos(off) + (u * std::cos(a) + v * std::sin(a)) * std::sin(off));
  }
  // At rest: seen through the lattice, half a cell a step.
  const double h = frame_.spacing_mm.x;
  const auto open = [&](Vec3 from, Vec3 way) {
    for (double t = h;; t += h / 2) {
      const std::size_t c = cell(from + way * t);
      if (c == cells_of(frame_)) return true;
      if (after_[c] != 0) return false;
    }
  };
  const auto nx = static_cast<std::size_t>(frame_.dims[0]), nxy = nx * static_cast<std::size_t>(frame_.dims[1]);
  std::uint64_t all = 0, seen = 0;
  for (std::size_t c = nxy; c + nxy < cavity_.size(); ++c) {
    if (cavity_[c] == 0) continue;
    // Of the cavity the cells at its wall.
    const bool wall = after_[c - 1] != 0 || after_[c + 1] != 0 || after_[c - nx] != 0 || after_[c + nx] != 0 || after_[c - nxy] != 0 ||
                      after_[c + nxy] != 0;
    if (!wall) continue;
    const Vec3 at = place(c);
    if (static_cast<double>(nearest_mm_[c]) > item.within_mm || distance_to(s, at) > item.within_mm) continue;
    ++all;
    if (std::any_of(views.begin(), views.end(), [&](Vec3 w) { return open(at, w); })) {
      ++seen;
    } else {
      keep(r, at);
    }
  }
  if (all == 0) {
    r.word = "the cavity does not come within " + format_number(item.within_mm) + " mm of it";
    return;
  }
  r.measured = true;
  r.value = static_cast<double>(seen) / static_cast<double>(all);
  r.pass = r.value >= item.threshold;
  r.margin = (r.value - item.threshold) / item.spread;
}

void Product::thinned(const ScaleItem& item, std::uint8_t s, Result& r) const {
  std::vector<std::pair<double, double>> wall;
  double all = 0;
  for (const Patch& p : patch_of(s, item)) {
    wall.emplace_back(p.cover_mm, p.area_mm2);
    all += p.area_mm2;
    if (p.cover_mm > item.threshold) keep(r, p.at_mm);
  }
  if (all <= 0 || to_cavity_mm_.empty()) {
    r.word = all <= 0 ? "no part of the structure's face looks that way" : "nothing was opened";
    return;
  }
  std::sort(wall.begin(), wall.end());
  const auto quantile = [&](double q) {
    double sum = 0;
    for (const auto& [mm, mm2] : wall) {
      sum += mm2;
      if (sum >= q * all) return mm;
    }
    return wall.back().first;
  };
  const double p90 = quantile(0.9);
  r.measured = true;
  r.value = quantile(0.5);
  r.pass = r.value <= item.threshold && p90 <= item.most;
  r.margin = std::min(item.threshold - r.value, item.most - p90) / item.spread;
  r.word = "90 % of the wall is at most " + format_number(std::round(p90 * 100) / 100) + " mm";
}

void Product::sharp(const ScaleItem& item, std::uint8_t s, Result& r) const {
  std::uint8_t other = 0;
  if (!value_of(item.second, other)) {
    r.word = "the case has no '" + item.second + "'";
    return;
  }
  // The largest ball in bone that is left, near both plates: twice the half cell between centres and faces.
  const std::vector<float> d2 = squared_distance_mm2(after_, frame_, 0);
  Vec3 where;
  bool any = false;
  for (std::size_t c = 0; c < after_.size(); ++c) {
    if (after_[c] == 0 || static_cast<double>(d2[c]) <= r.value * r.value || static_cast<double>(nearest_mm_[c]) > item.within_mm) continue;
    const Vec3 at = place(c);
    if (distance_to(s, at) > item.within_mm || distance_to(other, at) > item.within_mm) continue;
    r.value = std::sqrt(static_cast<double>(d2[c]));
    where = at;
    any = true;
  }
  r.measured = true;
  r.value = any ? std::max(0.0, r.value - frame_.spacing_mm.x / 2) : 0;
  if (any) keep(r, where);
  r.pass = r.value <= item.threshold;
  r.margin = (item.threshold - r.value) / item.spread;
}

// Along a tube: cells by their way from one of its ends, in steps of a millimetre.
void Product::followed(const ScaleItem& item, std::uint8_t s, Result& r) const {
  std::vector<std::size_t> inside;
  std::map<std::size_t, std::uint32_t> number;
  for (std::size_t c = 0; c < label_.size(); ++c) {
    if (label_[c] != s) continue;
    number.emplace(c, static_cast<std::uint32_t>(inside.size()));
    inside.push_back(c);
  }
  if (inside.empty()) {
    r.word = "it is thinner than the lattice of " + format_number(frame_.spacing_mm.x) + " mm";
    return;
  }
  const auto nx = static_cast<std::ptrdiff_t>(frame_.dims[0]), nxy = nx * frame_.dims[1];
  const double h = frame_.spacing_mm.x;
  const auto ways_from = [&](std::uint32_t start) {
    std::vector<double> way(inside.size(), 1e9);
    using Entry = std::pair<double, std::uint32_t>;
    std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
    queue.emplace(way[start] = 0, start);
    while (!queue.empty()) {
      const auto [d, at] = queue.top();
      queue.pop();
      if (d > way[at]) continue;
      for (int k = -1; k <= 1; ++k)
        for (int j = -1; j <= 1; ++j)
          for (int i = -1; i <= 1; ++i) {
            const auto to = number.find(static_cast<std::size_t>(static_cast<std::ptrdiff_t>(inside[at]) + i + j * nx + k * nxy));
            if (to == number.end()) continue;
            const double next = d + h * std::sqrt(double(i * i + j * j + k * k));
            if (next < way[to->second] - 1e-9) queue.emplace(way[to->second] = next, to->second);
          }
    }
    return way;
  };
  const auto farthest = [](const std::vector<double>& way) {
    std::uint32_t best = 0;
    for (std::uint32_t n = 0; n < way.size(); ++n) {
      if (way[n] < 1e9 && (way[best] >= 1e9 || way[n] > way[best])) best = n;
    }
    return best;
  };
  const std::vector<double> way = ways_from(farthest(ways_from(0)));
  const auto bins = static_cast<std::size_t>(way[farthest(way)]) + 1;
  std::vector<double> cover(bins, 1e9);
  // Its face, not its middle, is what the cavity comes near to: faces by the nearest cell inside.
  for (std::size_t n = 0; n < inside.size(); ++n) {
    if (way[n] >= 1e9) continue;
    const Vec3 at = place(inside[n]);
    const double depth = -structures_.at(at).distance_mm;
    double& c = cover[std::min(bins - 1, static_cast<std::size_t>(way[n]))];
    c = std::min(c, std::max(0.0, cavity_distance_mm(at) - std::max(0.0, depth)));
  }
  std::size_t shown = 0, all = 0;
  for (std::size_t n = 0; n < bins; ++n) {
    if (cover[n] >= 1e9 && !to_cavity_mm_.empty()) continue;
    ++all;
    if (cover[n] <= item.cover_mm) ++shown;
  }
  for (std::size_t n = 0; n < inside.size(); ++n) {
    if (way[n] < 1e9 && cover[std::min(bins - 1, static_cast<std::size_t>(way[n]))] <= item.cover_mm) keep(r, place(inside[n]));
  }
  r.measured = all > 0;
  r.value = all > 0 ? static_cast<double>(shown) / static_cast<double>(all) : 0;
  r.pass = r.measured && r.value >= item.threshold;
  r.margin = (r.value - item.threshold) / item.spread;
}

// The cavity reaches a landmark curve: everywhere near it, nowhere far beyond. Value: the farthest that the curve is from it.
void Product::margin(const ScaleItem& item, Vec3 approach, Result& r) const {
  if (to_cavity_mm_.empty()) {
    r.word = "nothing was opened";
    return;
  }
  Vec3 middle;
  for (const RemovedVoxel& v : removed_) middle += v.own_mm / static_cast<double>(std::max<std::size_t>(1, removed_.size()));
  double beyond = 0;
  std::vector<Vec3> samples;
  for (std::size_t n = 0; n + 1 < item.curve_mm.size(); ++n) {
    const Vec3 a = item.curve_mm[n], by = item.curve_mm[n + 1] - a;
    const int steps = std::max(1, static_cast<int>(std::ceil(length(by) / 0.25)));
    for (int t = 0; t < steps + (n + 2 == item.curve_mm.size() ? 1 : 0); ++t) samples.push_back(a + by * (double(t) / steps));
  }
  for (const Vec3 p : samples) {
    const double d = cell(p) == cells_of(frame_) ? 1e9 : cavity_distance_mm(p);
    r.value = std::max(r.value, d);
    if (d > item.threshold) keep(r, p);
    // Beyond: on the way on from the cavity's middle across the curve, at right angles to the approach.
    const Vec3 out = normalized(p - middle - approach * dot(p - middle, approach));
    for (double t = 0; t <= 20; t += frame_.spacing_mm.x / 2) {
      const std::size_t c = cell(p + out * t);
      if (c == cells_of(frame_)) break;
      if (cavity_[c] != 0) beyond = std::max(beyond, t);
    }
  }
  r.measured = true;
  r.pass = r.value <= item.threshold && beyond <= item.most;
  r.margin = std::min(item.threshold - r.value, item.most - beyond) / item.spread;
  r.word = "beyond it by " + format_number(std::round(beyond * 10) / 10) + " mm";
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
  r.margin =
      (item.kind == ItemKind::fixed ? r.value - item.threshold + 1 : std::min(r.value - item.threshold + 1, item.most - r.value + 1)) /
      item.spread;
  if (!r.pass) r.margin = std::min(r.margin, 0.0) - 1;
  return r;
}

Product::Result Product::evaluate(const ScaleItem& item, Vec3 approach, const std::vector<std::string>& injured) const {
  Result r;
  r.item = &item;
  r.threshold = item.threshold;
  const double h = frame_.spacing_mm.x;
  switch (item.kind) {
    case ItemKind::not_violated:
    case ItemKind::no_cells_left:
      r.evidence_each = h * h * h;
      break;
    case ItemKind::no_overhang:
      r.evidence_each = h * h;
      break;
    default:
      break;
  }
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

std::vector<Product::RegionResult> Product::regions() const {
  std::vector<RegionResult> all;
  const double cell_mm3 = frame_.voxel_volume_mm3();
  for (const ProcedureRegion& g : procedure_.regions) {
    RegionResult r;
    r.region = &g;
    std::uint8_t s = 0;
    if (!value_of(g.structure, s)) continue;
    for (std::size_t c = 0; c < before_.size(); ++c) {
      if (before_[c] == 0 || static_cast<double>(nearest_mm_[c]) > g.within_mm || distance_to(s, place(c)) > g.within_mm) continue;
      r.bone_mm3 += cell_mm3;
      if (after_[c] == 0) r.removed_mm3 += cell_mm3;
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
    if (std::none_of(targets.begin(), targets.end(), [&](const auto& t) { return distance_to(t.first, v.own_mm) <= t.second; }))
      mm3 += static_cast<double>(v.mm3);
  }
  return mm3;
}

double Product::cavity_mm3() const {
  std::size_t n = 0;
  for (const std::uint8_t c : cavity_) n += c;
  return static_cast<double>(n) * frame_.voxel_volume_mm3();
}

}  // namespace osteo
