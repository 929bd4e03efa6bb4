#include "osteo/simulation/bone/structure_map.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/parallel.h"
#include "osteo/geometry/distance/binary_distance.h"
#include "osteo/geometry/distance/distance_map.h"
#include "osteo/geometry/grid/sampler.h"
#include "osteo/geometry/mesh/bone_surface.h"
#include "osteo/simulation/bone/burr.h"

namespace osteo::inline simulation {

namespace {

constexpr int kPad = 3;  // voxels beside a structure that its face depends on

// Beside a structure's voxels: smoothed distance to its steps, in the label's smallest spacing, positive inside. Only
// voxels with a neighbour on the other side of the face matter: the rest tell the side. What smooths is 2 S - S^2, S
// being 1 2 1 along each axis: flat faces stay where they are as under S, while curved ones are not drawn inwards (by
// 0.1 voxel at radii of 2 to 5 under S alone).
BrickGrid face_field(const Labels& crop, const Context& context) {
  const Frame& f = crop.frame;
  const Vec3 h = f.spacing_mm;
  const auto [nx, ny, nz] = f.dims;
  const float unit = static_cast<float>(std::min({h.x, h.y, h.z}));
  constexpr float kMin = 0.2F, kDeep = 4;  // so near a voxel's centre may the face come
  constexpr int kSmooth = 2;               // voxels to each side that the smoothing looks at
  constexpr std::array<float, 5> kOnce{0, 0.25F, 0.5F, 0.25F, 0}, kTwice{1 / 16.0F, 0.25F, 0.375F, 0.25F, 1 / 16.0F};
  // From a voxel of the smoothing to the one beside the face, and a step on across it.
  const double within_mm = 1.001 * std::max({length({3 * h.x, 2 * h.y, 2 * h.z}), length({2 * h.x, 3 * h.y, 2 * h.z}),
                                             length({2 * h.x, 2 * h.y, 3 * h.z})});
  // Slab by slab: the distances of a whole head are never in memory together.
  constexpr int kSlab = 48;
  struct Slab {
    std::vector<Ijk> bricks;
    std::vector<std::pair<std::size_t, float>> beside;
  };
  std::vector<Slab> slabs(static_cast<std::size_t>((nz + kSlab - 1) / kSlab));
  const auto bx = static_cast<std::size_t>((nx + 7) / 8), by = static_cast<std::size_t>((ny + 7) / 8);
  const auto slab_of = [&](std::size_t s) {
    Slab& out = slabs[s];
    const int begin = std::max(1, static_cast<int>(s) * kSlab),
              end = std::min(nz - 1, (static_cast<int>(s) + 1) * kSlab);
    const int more = kSmooth + static_cast<int>(std::ceil(within_mm / h.z));
    const int lo = std::max(0, begin - more), hi = std::min(nz, end + more);
    Frame part = f;
    part.dims[2] = hi - lo;
    const std::span<const std::uint8_t> mask = crop.span().subspan(crop.offset(0, 0, lo), part.voxel_count());
    Context alone;
    alone.threads = 1;
    std::vector<float> phi = squared_distance_within_mm2(mask, part, 0, within_mm, alone);
    {
      const std::vector<float> outside = squared_distance_within_mm2(mask, part, 1, within_mm, alone);
      for (std::size_t v = 0; v < phi.size(); ++v) {
        const float inwards = mask[v] != 0 ? std::sqrt(phi[v]) : -std::sqrt(outside[v]);
        phi[v] = inwards / unit - std::copysign(0.5F, inwards);
      }
    }
    const std::size_t below = crop.offset(0, 0, lo);
    std::vector<std::uint8_t> wanted(bx * by * static_cast<std::size_t>(kSlab / 8));
    for (int k = begin; k < end; ++k) {
      context.check_cancelled();
      for (int j = 1; j + 1 < ny; ++j) {
        for (int i = 1; i + 1 < nx; ++i) {
          const std::size_t v = crop.offset(i, j, k);
          const bool inside = crop.voxels[v] != 0;
          const auto side = [&](int a, int b, int c) {
            return (crop.voxels[crop.offset(i + a, j + b, k + c)] != 0) == inside;
          };
          const bool deep =
              side(-1, 0, 0) && side(1, 0, 0) && side(0, -1, 0) && side(0, 1, 0) && side(0, 0, -1) && side(0, 0, 1);
          if (deep && !inside) continue;
          std::uint8_t& brick =
              wanted[(static_cast<std::size_t>(k % kSlab / 8) * by + static_cast<std::size_t>(j / 8)) * bx +
                     static_cast<std::size_t>(i / 8)];
          if (brick == 0) out.bricks.push_back({i / 8, j / 8, k / 8});
          brick = 1;
          if (deep) continue;
          float s1 = 0, s2 = 0;
          for (int c = -kSmooth; c <= kSmooth; ++c) {
            for (int b = -kSmooth; b <= kSmooth; ++b) {
              float row1 = 0, row2 = 0;
              for (int a = -kSmooth; a <= kSmooth; ++a) {
                const float p = phi[crop.offset(std::clamp(i + a, 0, nx - 1), std::clamp(j + b, 0, ny - 1),
                                                std::clamp(k + c, 0, nz - 1)) -
                                    below];
                row1 += kOnce[static_cast<std::size_t>(a + 2)] * p;
                row2 += kTwice[static_cast<std::size_t>(a + 2)] * p;
              }
              s1 += kOnce[static_cast<std::size_t>(b + 2)] * kOnce[static_cast<std::size_t>(c + 2)] * row1;
              s2 += kTwice[static_cast<std::size_t>(b + 2)] * kTwice[static_cast<std::size_t>(c + 2)] * row2;
            }
          }
          const float smooth = 2 * s1 - s2;
          out.beside.emplace_back(v, inside ? std::max(smooth, kMin) : std::min(smooth, -kMin));
        }
      }
    }
  };
  parallel_for(slabs.size(), 1, context.threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t s = begin; s < end; ++s) slab_of(s);
  });
  std::vector<Ijk> bricks;
  for (const Slab& s : slabs) bricks.insert(bricks.end(), s.bricks.begin(), s.bricks.end());
  BrickGrid grid(f, bricks);
  // Zero is far outside, also where no brick is.
  for (std::uint32_t b = 0; b < grid.brick_count(); ++b) {
    for (VoxelKey v = b * BrickGrid::kVoxels; v < (b + 1) * BrickGrid::kVoxels; ++v) {
      const Ijk c = grid.coordinate(v);
      if (c.i < nx && c.j < ny && c.k < nz && crop.at(c.i, c.j, c.k) != 0) grid.set(v, 2 * kDeep);
    }
  }
  for (const Slab& s : slabs) {
    for (const auto& [at, value] : s.beside) {
      const auto row = static_cast<std::size_t>(nx), slice = row * static_cast<std::size_t>(ny);
      grid.set(grid.find(static_cast<int>(at % row), static_cast<int>(at % slice / row), static_cast<int>(at / slice)),
               kDeep + std::clamp(value, -kDeep, kDeep));
    }
  }
  return grid;
}

}  // namespace

StructureMap::Field StructureMap::field_of(const TriangleSoup& face, const TriangleTree& tree, const Frame& frame,
                                           double inside_mm, double outside_mm, const Context& context) {
  const DistanceMap map = DistanceMapper(face, tree, frame, context.sub(0, 0.2))
                              .map({DistanceRegion::band, inside_mm, outside_mm}, context.sub(0.2, 1));
  Field field{BrickGrid(frame, map.bricks), {}};
  for (std::size_t b = 0; b < map.bricks.size(); ++b) {
    const Ijk o = map.bricks[b];
    const VoxelKey first = field.values.find_brick(o.i, o.j, o.k) * BrickGrid::kVoxels;
    for (VoxelKey v = 0; v < BrickGrid::kVoxels; ++v)
      field.values.set(first + v, static_cast<float>(map.distance_mm[b * BrickGrid::kVoxels + v]));
  }
  const Mat3 turn = inverse(frame.direction);
  for (std::size_t c = 0; c < 3; ++c) {
    for (std::size_t r = 0; r < 3; ++r) field.index_from_mm.column[c][r] = turn.column[c][r] / frame.spacing_mm[r];
  }
  return field;
}

StructureMap::Part StructureMap::part_of(const Labels& labels, std::uint8_t value,
                                         std::array<std::array<int, 2>, 3> box, double far_mm, const Context& context) {
  const Vec3 h = labels.frame.spacing_mm;
  const double coarsest = std::max({h.x, h.y, h.z});
  Labels crop;
  crop.frame = labels.frame;
  for (std::size_t a = 0; a < 3; ++a) crop.frame.dims[a] = box[a][1] - box[a][0] + 1 + 2 * kPad;
  crop.frame.origin_mm =
      labels.frame.world_from_index({double(box[0][0] - kPad), double(box[1][0] - kPad), double(box[2][0] - kPad)});
  const auto voxels = make_voxels<std::uint8_t>(crop.frame.voxel_count());
  std::fill_n(voxels.get(), crop.frame.voxel_count(), std::uint8_t{0});
  for (int k = box[2][0]; k <= box[2][1]; ++k) {
    for (int j = box[1][0]; j <= box[1][1]; ++j) {
      for (int i = box[0][0]; i <= box[0][1]; ++i) {
        if (labels.at(i, j, k) == value)
          voxels[crop.offset(i - box[0][0] + kPad, j - box[1][0] + kPad, k - box[2][0] + kPad)] = 1;
      }
    }
  }
  crop.voxels = voxels;
  Part part;
  part.face = surface_nets(face_field(crop, context), 4, context.sub(0, 0.1)).mesh;
  const TriangleSoup face = soup_of(part.face);
  part.box = bounds_of(face);
  // A lattice in the labels' directions around the structure and `beyond_mm` of what is beside it.
  const auto around = [&](Vec3 spacing, double beyond_mm) {
    Frame f = crop.frame;
    f.spacing_mm = spacing;
    Vec3 shift;
    for (std::size_t a = 0; a < 3; ++a) {
      const int more = static_cast<int>(std::ceil(beyond_mm / spacing[a])) + 1;
      f.dims[a] =
          static_cast<int>(std::ceil((crop.frame.dims[a] - 1) * crop.frame.spacing_mm[a] / spacing[a])) + 1 + 2 * more;
      shift[a] = -more * spacing[a];
    }
    f.origin_mm = f.origin_mm + f.direction * shift;
    return f;
  };
  const double near_mm = 2 * coarsest, wide = std::max(2 * coarsest, 0.3);
  const TriangleTree tree(face, crop.frame.direction, context.sub(0.1, 0.2));
  part.near = field_of(face, tree, around(h, near_mm), near_mm, near_mm, context.sub(0.2, 0.5));
  // A point is between lattice points up to a diagonal away.
  const double kept_mm = far_mm + std::sqrt(3.0) * wide;
  part.whole = field_of(face, tree, around({wide, wide, wide}, kept_mm), std::numeric_limits<double>::infinity(),
                        kept_mm, context.sub(0.5, 1));
  return part;
}

StructureMap::StructureMap(const Labels& labels, double reach_mm, const Context& context,
                           std::span<const std::string> opened)
    : reach_mm_(reach_mm), structures_(labels.structures) {
  const Vec3 h = labels.frame.spacing_mm;
  spacing_mm_ = {std::min({h.x, h.y, h.z}), std::max({h.x, h.y, h.z})};
  using Box = std::array<std::array<int, 2>, 3>;
  constexpr int kMany = std::numeric_limits<int>::max();
  std::array<Box, 256> boxes;
  boxes.fill({{{kMany, -1}, {kMany, -1}, {kMany, -1}}});
  std::size_t v = 0;
  for (int k = 0; k < labels.frame.dims[2]; ++k) {
    for (int j = 0; j < labels.frame.dims[1]; ++j) {
      for (int i = 0; i < labels.frame.dims[0]; ++i, ++v) {
        if (labels.voxels[v] == 0) continue;
        Box& box = boxes[labels.voxels[v]];
        const std::array<int, 3> at{i, j, k};
        for (std::size_t a = 0; a < 3; ++a) box[a] = {std::min(box[a][0], at[a]), std::max(box[a][1], at[a])};
      }
    }
  }
  for (int value = 1; value < 256; ++value) {
    if (boxes[static_cast<std::size_t>(value)][0][1] >= 0) values_.push_back(static_cast<std::uint8_t>(value));
  }
  if (values_.empty()) throw Error(ExitCode::failed, "no voxel of the labels belongs to a structure");
  double thickest = 0;
  for (const Burr& burr : burr_library()) thickest = std::max(thickest, burr.head().largest_radius_mm());
  for (const std::uint8_t value : values_) {
    const double done = static_cast<double>(parts_.size()), all = static_cast<double>(values_.size());
    parts_.push_back(
        part_of(labels, value, boxes[value], reach_mm + thickest, context.sub(done / all, (done + 1) / all)));
    parts_.back().opened = std::find(opened.begin(), opened.end(), name_of(value)) != opened.end();
  }
}

double StructureMap::Field::at(Vec3 world_mm) const noexcept {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  const Vec3 x = index_from_mm * (world_mm - values.frame().origin_mm);
  if (!(std::abs(x.x) < 1e6 && std::abs(x.y) < 1e6 && std::abs(x.z) < 1e6)) return kNone;
  const double fi = std::floor(x.x), fj = std::floor(x.y), fk = std::floor(x.z);
  const int i = static_cast<int>(fi), j = static_cast<int>(fj), k = static_cast<int>(fk);
  float d[8];
  if ((i & 7) != 7 && (j & 7) != 7 && (k & 7) != 7) {
    const VoxelKey first = values.find(i, j, k);
    if (first == BrickGrid::kNone) return kNone;
    const float* const p = values.values_of_brick(first / BrickGrid::kVoxels) + first % BrickGrid::kVoxels;
    for (int c = 0; c < 8; ++c) d[c] = p[(c & 1) + (c >> 1 & 1) * 8 + (c >> 2) * 64];
  } else {
    for (int c = 0; c < 8; ++c) {
      const VoxelKey v = values.find(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2));
      if (v == BrickGrid::kNone) return kNone;
      d[c] = values.value(v);
    }
  }
  return static_cast<double>(
      mix_linear(d, static_cast<float>(x.x - fi), static_cast<float>(x.y - fj), static_cast<float>(x.z - fk)));
}

double StructureMap::Part::at(Vec3 world_mm) const noexcept {
  const double d = near.at(world_mm);
  return std::isnan(d) ? whole.at(world_mm) : d;
}

// Not a number where none of it is kept so far away.
double StructureMap::Part::clearance(const RoundCone& tool, Vec3 start_mm, Vec3 axis) const noexcept {
  const auto gap = [&](double t) { return at(start_mm + axis * (tool.start_mm + t)) - tool.radius_at_mm(t); };
  if (!(tool.length_mm > 0)) return gap(0);
  const double step = tool.length_mm / std::ceil(tool.length_mm / (0.5 * tool.largest_radius_mm()));
  double least = std::numeric_limits<double>::quiet_NaN(), where = 0;
  const auto look = [&](double t) {
    if (t < 0 || t > tool.length_mm) return;
    if (const double g = gap(t); g < least || (std::isnan(least) && !std::isnan(g))) {
      least = g;
      where = t;
    }
  };
  for (double t = 0; t < tool.length_mm + 0.5 * step; t += step) look(std::min(t, tool.length_mm));
  // Between those: the gap rises no faster than along the axis, so a sixteenth of a step leaves a few micrometres.
  if (!std::isnan(least)) {
    for (double w = step / 2; w > step / 20; w /= 2) {
      const double middle = where;
      look(middle - w);
      look(middle + w);
    }
  }
  return least;
}

StructureMap::Answer StructureMap::at(Vec3 world_mm) const noexcept {
  return nearest({0, 0, 0, 0}, world_mm, {0, 0, 1}, {}, true);
}

StructureMap::Answer StructureMap::at_risk(Vec3 world_mm) const noexcept {
  return nearest({0, 0, 0, 0}, world_mm, {0, 0, 1}, {}, false);
}

double StructureMap::distance_mm(std::size_t number, Vec3 world_mm) const noexcept {
  const double d = parts_[number].at(world_mm);
  return d < reach_mm_ ? d : reach_mm_;
}

StructureMap::Answer StructureMap::clearance(const RoundCone& tool, Vec3 start_mm, Vec3 axis,
                                             std::span<double> each) const noexcept {
  return nearest(tool, start_mm, axis, each, false);
}

StructureMap::Answer StructureMap::nearest(const RoundCone& tool, Vec3 start_mm, Vec3 axis, std::span<double> each,
                                           bool with_opened) const noexcept {
  const Vec3 middle = start_mm + axis * (tool.start_mm + tool.length_mm / 2);
  const double reach = reach_mm_ + tool.length_mm / 2 + tool.largest_radius_mm();
  Answer nearest{reach_mm_, 0};
  for (std::size_t s = 0; s < parts_.size(); ++s) {
    const BoxMm& box = parts_[s].box;
    bool beyond = false;
    for (std::size_t a = 0; a < 3; ++a)
      beyond = beyond || box.lo[a] - middle[a] > reach || middle[a] - box.hi[a] > reach;
    const double gap = beyond ? reach_mm_ : parts_[s].clearance(tool, start_mm, axis);
    if (s < each.size()) each[s] = gap < reach_mm_ ? gap : reach_mm_;
    if (gap < nearest.distance_mm && (with_opened || !parts_[s].opened)) nearest = {gap, values_[s]};
  }
  return nearest;
}

std::array<double, 3> StructureMap::colour_of(std::uint8_t structure) const {
  for (const Structure& s : structures_) {
    if (s.value == structure && s.rgb != std::array<std::uint8_t, 3>{})
      return {s.rgb[0] / 255.0, s.rgb[1] / 255.0, s.rgb[2] / 255.0};
  }
  static constexpr std::array<std::array<double, 3>, 6> kRow{{{0.95, 0.85, 0.25},
                                                              {0.30, 0.45, 0.90},
                                                              {0.85, 0.25, 0.25},
                                                              {0.35, 0.75, 0.45},
                                                              {0.80, 0.45, 0.80},
                                                              {0.30, 0.75, 0.80}}};
  return kRow[(structure + 5U) % kRow.size()];
}

std::string StructureMap::name_of(std::uint8_t structure) const {
  const auto s =
      std::find_if(structures_.begin(), structures_.end(), [&](const Structure& c) { return c.value == structure; });
  return s != structures_.end() ? s->name : "structure " + std::to_string(structure);
}

std::size_t StructureMap::memory_bytes() const {
  std::size_t sum = 0;
  for (const Part& p : parts_) {
    sum += p.near.values.memory_bytes() + p.whole.values.memory_bytes() +
           p.face.triangles.size() * sizeof(p.face.triangles[0]) +
           p.face.points_mm.size() * (sizeof(p.face.points_mm[0]) + sizeof(p.face.normals[0]));
  }
  return sum;
}

std::string StructureMap::hash() const {
  Hasher h;
  h.add(values_.data(), values_.size());
  for (const Part& p : parts_) {
    for (const Field* const f : {&p.near, &p.whole}) {
      const std::string hex = f->values.hash();
      h.add(hex.data(), hex.size());
    }
  }
  return h.hex();
}

}  // namespace osteo::inline simulation
