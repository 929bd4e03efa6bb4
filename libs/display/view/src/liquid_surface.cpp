#include "liquid_surface.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "chance.h"
#include "osteo/geometry/mesh/bone_surface.h"

namespace osteo::inline display {
namespace {

constexpr float kMinDrop = 0.004F;  // of a cell: a mist nobody would see

struct Cell {
  float full = 0, solid = 0;
};

// Cells of the bricks that hold water and of those around them, moved so that no coordinate is negative.
struct Field {
  BrickGrid grid;                  // bone and water: 1 where either is
  std::vector<Cell> cells;         // of each voxel of the grid
  std::vector<std::uint32_t> wet;  // bricks that hold water
  std::vector<VoxelKey> falling;   // voxels whose water is in the air; not in `grid`
  Ijk shift;                       // from the grid's coordinates to the bone's
};

std::array<std::uint8_t, 4> colour_of(const Cell& c) {
  const float film = std::min(1.0F, c.full / static_cast<float>(Dust::kFilm));
  const float deep = std::clamp((c.full - 0.12F) / 0.4F, 0.0F, 1.0F), thick = std::min(1.0F, c.solid / 0.12F);
  const auto mix = [](float a, float b, float t) { return a + (b - a) * t; };
  const float alpha = mix(0.20F * film + 0.25F * thick * film, mix(0.40F, 0.92F, thick), deep);
  const auto byte = [](float v) { return static_cast<std::uint8_t>(std::lround(255 * std::clamp(v, 0.0F, 1.0F))); };
  return {byte(mix(0.36F, 0.84F, thick)), byte(mix(0.34F, 0.74F, thick)), byte(mix(0.34F, 0.62F, thick)), byte(alpha)};
}

// Whether the water of a cell rests on something: bone beside it, or water below it down to bone.
bool stands(const Field& f, const BrickGrid& bone, Ijk at, Vec3 step) {
  const auto is_bone = [&](Ijk c) { return bone.at(c.i + f.shift.i, c.j + f.shift.j, c.k + f.shift.k) >= 0.5F; };
  for (int dk = -1; dk <= 1; ++dk)
    for (int dj = -1; dj <= 1; ++dj)
      for (int di = -1; di <= 1; ++di)
        if (is_bone({at.i + di, at.j + dj, at.k + dk})) return true;
  const Vec3 from{double(at.i), double(at.j), double(at.k)};
  for (int n = 1;; ++n) {
    const Vec3 p = from + step * n;
    const Ijk c{static_cast<int>(std::lround(p.x)), static_cast<int>(std::lround(p.y)),
                static_cast<int>(std::lround(p.z))};
    if (is_bone(c)) return true;
    if (!(f.grid.at(c.i, c.j, c.k) >= 0.5F)) return false;  // air, or beyond what is stored
  }
}

Field field_of(const Dust& dust) {
  const BrickGrid& bone = dust.bone();
  struct Wet {
    Ijk at;
    Cell cell;
  };
  std::vector<Wet> wet;
  dust.visit_liquid([&](Ijk at, double full, double solid) {
    wet.push_back({at, {static_cast<float>(full), static_cast<float>(solid)}});
  });
  Field f;
  if (wet.empty()) return f;
  Ijk lo = wet.front().at, hi = lo;
  for (const Wet& w : wet) {
    lo = {std::min(lo.i, w.at.i), std::min(lo.j, w.at.j), std::min(lo.k, w.at.k)};
    hi = {std::max(hi.i, w.at.i), std::max(hi.j, w.at.j), std::max(hi.k, w.at.k)};
  }
  lo = {(lo.i >> 3) - 1, (lo.j >> 3) - 1, (lo.k >> 3) - 1};
  hi = {(hi.i >> 3) + 1, (hi.j >> 3) + 1, (hi.k >> 3) + 1};
  f.shift = {lo.i * 8, lo.j * 8, lo.k * 8};
  const std::array<int, 3> n{hi.i - lo.i + 1, hi.j - lo.j + 1, hi.k - lo.k + 1};
  std::vector<std::uint8_t> stored(static_cast<std::size_t>(n[0]) * static_cast<std::size_t>(n[1]) *
                                   static_cast<std::size_t>(n[2]));
  const auto place = [&](int i, int j, int k) {
    return (static_cast<std::size_t>(k) * static_cast<std::size_t>(n[1]) + static_cast<std::size_t>(j)) *
               static_cast<std::size_t>(n[0]) +
           static_cast<std::size_t>(i);
  };
  for (const Wet& w : wet) stored[place((w.at.i >> 3) - lo.i, (w.at.j >> 3) - lo.j, (w.at.k >> 3) - lo.k)] = 2;
  std::vector<Ijk> bricks;
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i) {
        bool near = false;
        for (int z = std::max(0, k - 1); z <= std::min(n[2] - 1, k + 1) && !near; ++z)
          for (int y = std::max(0, j - 1); y <= std::min(n[1] - 1, j + 1) && !near; ++y)
            for (int x = std::max(0, i - 1); x <= std::min(n[0] - 1, i + 1) && !near; ++x)
              near = stored[place(x, y, z)] == 2;
        if (near) bricks.push_back({i, j, k});
      }
  Frame frame = bone.frame();
  frame.dims = {8 * n[0], 8 * n[1], 8 * n[2]};
  frame.origin_mm = bone.frame().world_from_index({double(f.shift.i), double(f.shift.j), double(f.shift.k)});
  f.grid = BrickGrid(frame, std::move(bricks));
  f.cells.resize(f.grid.brick_count() * BrickGrid::kVoxels);
  for (std::uint32_t b = 0; b < f.grid.brick_count(); ++b) {
    const Ijk at = f.grid.brick_coordinate(b);
    if (stored[place(at.i, at.j, at.k)] == 2) f.wet.push_back(b);
    const std::uint32_t of_bone = bone.find_brick(at.i + lo.i, at.j + lo.j, at.k + lo.k);
    if (of_bone == BrickGrid::kNone) continue;
    for (VoxelKey v = 0; v < BrickGrid::kVoxels; ++v)
      f.grid.set(b * BrickGrid::kVoxels + v, bone.value(of_bone * BrickGrid::kVoxels + v));
  }
  for (const Wet& w : wet) {
    const VoxelKey v = f.grid.find(w.at.i - f.shift.i, w.at.j - f.shift.j, w.at.k - f.shift.k);
    f.cells[v] = w.cell;
    f.grid.set(v, std::min(1.0F, f.grid.value(v) + w.cell.full));
  }
  const Vec3 down = frame.index_from_world(frame.origin_mm + dust.gravity());
  const double most = std::max({std::abs(down.x), std::abs(down.y), std::abs(down.z)});
  for (const Wet& w : wet) {
    const Ijk at{w.at.i - f.shift.i, w.at.j - f.shift.j, w.at.k - f.shift.k};
    if (w.cell.full >= kMinDrop && !(most > 0 && stands(f, bone, at, down / most)))
      f.falling.push_back(f.grid.find(at.i, at.j, at.k));
  }
  for (const VoxelKey v : f.falling) f.grid.set(v, std::max(0.0F, f.grid.value(v) - f.cells[v].full));
  return f;
}

}  // namespace

LiquidSurface liquid_surface(const Dust& dust) {
  LiquidSurface out;
  const Field f = field_of(dust);
  if (f.wet.empty()) return out;
  const Frame& frame = f.grid.frame();
  std::unordered_map<std::uint64_t, std::uint32_t> known;  // vertices of patches, by what is equal in all of them
  SurfacePatch patch;
  std::vector<std::uint32_t> name;
  std::vector<Vec3> normals;
  constexpr std::uint32_t kDry = 0xffffffffU;
  for (const std::uint32_t b : f.wet) {
    extract_patch(f.grid, b, 0.5F, patch);
    name.assign(patch.vertices.size(), kDry);
    for (std::size_t n = 0; n < patch.vertices.size(); ++n) {
      const auto& v = patch.vertices[n];
      // The wettest of the cells around it.
      Cell wettest;
      for (int c = 0; c < 8; ++c) {
        const auto at = [&](std::size_t a, int high) { return static_cast<int>(std::floor(v.index[a])) + high; };
        const VoxelKey cell = f.grid.find(at(0, c & 1), at(1, c >> 1 & 1), at(2, c >> 2));
        if (cell != BrickGrid::kNone && f.cells[cell].full > wettest.full) wettest = f.cells[cell];
      }
      const auto [it, is_new] = known.try_emplace(v.key, static_cast<std::uint32_t>(out.points_mm.size()));
      name[n] = it->second;
      if (!is_new) continue;
      const Vec3 p = frame.world_from_index(from_floats(v.index));
      out.points_mm.push_back(to_floats(p));
      normals.push_back(normalized(frame.direction * from_floats(v.normal)));
      out.rgba.push_back(colour_of(wettest));
    }
    for (const auto& t : patch.triangles) {
      const std::array<std::uint32_t, 3> of{name[t[0]], name[t[1]], name[t[2]]};
      if (std::any_of(of.begin(), of.end(), [&](std::uint32_t p) { return out.rgba[p][3] > 2; }))
        out.triangles.push_back(of);
    }
  }
  for (int ring = 0; ring < 3; ++ring) {
    std::vector<Vec3> sum = normals;
    for (const auto& t : out.triangles) {
      const Vec3 all = normals[t[0]] + normals[t[1]] + normals[t[2]];
      for (const std::uint32_t p : t) sum[p] += all;
    }
    for (std::size_t p = 0; p < sum.size(); ++p) normals[p] = normalized(sum[p]);
  }
  constexpr double kOutMm = 0.04;  // in front of the bone that it lies on, by less than anybody sees
  for (std::size_t p = 0; p < normals.size(); ++p) {
    out.normals.push_back(to_floats(normals[p]));
    out.points_mm[p] = to_floats(from_floats(out.points_mm[p]) + normals[p] * kOutMm);
  }
  for (const VoxelKey v : f.falling) {
    const Cell& c = f.cells[v];
    const Ijk at = f.grid.coordinate(v);
    if (!is_drawn(dust, {at.i + f.shift.i, at.j + f.shift.j, at.k + f.shift.k}, frame.spacing_mm.x)) continue;
    Chance chance(at.i + f.shift.i, at.j + f.shift.j, at.k + f.shift.k);
    const int count = std::max(1, static_cast<int>(std::lround(4 * std::min(1.0F, c.full))));
    // Balls of the cell's volume together.
    const double radius = frame.spacing_mm.x * 0.62 * std::cbrt(static_cast<double>(c.full) / count);
    for (int n = 0; n < count; ++n) {
      const auto aside = [&] { return LiquidSurface::kSpread * (static_cast<double>(chance.next()) - 0.5); };
      const Vec3 p =
          frame.world_from_index(Vec3{double(at.i), double(at.j), double(at.k)} + Vec3{aside(), aside(), aside()});
      out.drops.push_back(
          {to_floats(p), static_cast<float>(radius) * (0.8F + 0.4F * chance.next()), std::min(1.0F, c.solid / 0.12F)});
    }
  }
  return out;
}

}  // namespace osteo::inline display
