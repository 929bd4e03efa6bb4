#include "osteo/simulation/bone/plates.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "osteo/core/base/error.h"
#include "osteo/core/base/portable_math.h"
#include "osteo/geometry/grid/brick_places.h"
#include "osteo/geometry/mesh/bone_surface.h"

namespace osteo::inline simulation {
namespace {

// Surface of what lies within a signed distance, over a box; sampled at `h` mm.
TriMesh surface_of(const std::function<double(Vec3)>& distance, Vec3 lo, Vec3 hi, double h) {
  Frame f;
  f.spacing_mm = {h, h, h};
  for (std::size_t a = 0; a < 3; ++a) {
    f.dims[a] = 8 * (static_cast<int>(std::ceil((hi[a] - lo[a]) / h / 8 + 0.5)) + 1);
    // Symmetric about the box's middle, so that the mesh is.
    f.origin_mm[a] = 0.5 * (lo[a] + hi[a]) - 0.5 * (f.dims[a] - 1) * h;
  }
  BrickGrid g = BrickGrid::dense(f);
  for (VoxelKey v = 0; v < g.brick_count() * BrickGrid::kVoxels; ++v) {
    g.set(v, static_cast<float>(std::clamp(0.5 - distance(place_of_voxel_mm(g, v)) / h, 0.0, 1.0)));
  }
  return surface_nets(g).mesh;
}

double to_segment(double x, double y, double x0, double x1) {
  return portable::hypot(x - std::clamp(x, x0, x1), y);
}

// A row of rings joined by a bar, with screw holes; `holes` ascending along x.
double strip(Vec3 p, const std::vector<Vec3>& holes, double ring_mm, double bar_mm, double hole_mm,
             double thickness_mm) {
  double flat = to_segment(p.x, p.y, holes.front().x, holes.back().x) - bar_mm / 2;
  for (const Vec3 c : holes) flat = std::min(flat, portable::hypot(p.x - c.x, p.y - c.y) - ring_mm / 2);
  for (const Vec3 c : holes) flat = std::max(flat, hole_mm / 2 - portable::hypot(p.x - c.x, p.y - c.y));
  const double high = std::abs(p.z - thickness_mm / 2) - thickness_mm / 2;
  return flat > 0 && high > 0 ? portable::hypot(flat, high) : std::max(flat, high);
}

struct StripPlan {
  const char* name;
  const char* about;
  int holes;
  double spacing_mm, gap_mm;  // between holes; added in the middle
  double ring_mm, bar_mm, hole_mm, thickness_mm, screw_mm, voxel_mm;
};

PlateModel make_strip(const StripPlan& s) {
  PlateModel m;
  m.name = s.name;
  m.about = s.about;
  m.thickness_mm = s.thickness_mm;
  m.screw_mm = s.screw_mm;
  for (int i = 0; i < s.holes; ++i) {
    const double x = (i - 0.5 * (s.holes - 1)) * s.spacing_mm;
    m.holes_mm.push_back({x + (x > 0 ? 0.5 : x < 0 ? -0.5 : 0) * s.gap_mm, 0, 0});
  }
  const double end = m.holes_mm.back().x + s.ring_mm / 2, side = s.ring_mm / 2;
  m.mesh = surface_of([&](Vec3 p) { return strip(p, m.holes_mm, s.ring_mm, s.bar_mm, s.hole_mm, s.thickness_mm); },
                      {-end, -side, 0}, {end, side, s.thickness_mm}, s.voxel_mm);
  return m;
}

// Two feet of three holes each, a threaded rod above them; the foot at x > 0 rides on the rod.
PlateModel make_distractor() {
  PlateModel m;
  m.name = "distractor";
  m.about = "mandibular distractor: feet 1.0 mm thick for 2.0 mm screws, opens by up to 20 mm";
  m.thickness_mm = 1;
  m.screw_mm = 2;
  m.most_opening_mm = 20;
  constexpr double kRing = 5.5, kBar = 3, kHole = 2.2, kRodHeight = 3.6, kRod = 1.6, kBlock = 2.4, kVoxel = 0.2;
  std::vector<Vec3> left, right;
  for (int i = 0; i < 3; ++i) {
    left.push_back({-16.0 + 6 * i, 0, 0});
    right.push_back({4.0 + 6 * i, 0, 0});
  }
  const auto rod = [&](Vec3 p, double x0, double x1, double radius) {
    const double round = portable::hypot(p.y, p.z - kRodHeight) - radius, along = std::max(x0 - p.x, p.x - x1);
    return round > 0 && along > 0 ? portable::hypot(round, along) : std::max(round, along);
  };
  const auto block = [&](Vec3 p, double x) {
    return std::max({std::abs(p.x - x) - 1.5, std::abs(p.y) - kBlock / 2, 0.5 - p.z, p.z - kRodHeight - kBlock / 2});
  };
  m.mesh = surface_of(
      [&](Vec3 p) {
        // The rod reaches through the other foot's block, with play, to where that may go.
        return std::min({strip(p, left, kRing, kBar, kHole, 1), block(p, -5.5), rod(p, -24, 30, kRod / 2)});
      },
      {-24, -kRing / 2, 0}, {30, kRing / 2, kRodHeight + kBlock / 2}, kVoxel);
  m.moving = surface_of(
      [&](Vec3 p) {
        return std::max(std::min(strip(p, right, kRing, kBar, kHole, 1), block(p, 5.5)),
                        -rod(p, -99, 99, kRod / 2 + 0.3));
      },
      {0.5, -kRing / 2, 0}, {20, kRing / 2, kRodHeight + kBlock / 2}, kVoxel);
  m.holes_mm = left;
  m.holes_mm.insert(m.holes_mm.end(), right.begin(), right.end());
  return m;
}

}  // namespace

const std::vector<PlateModel>& plate_library() {
  static const std::vector<PlateModel> library = [] {
    // Miniplates: 0.9 to 1.0 mm thick, 2.0 mm screws (M. Champy et al., J. Maxillofac. Surg. 6, 1978, and the 2.0 mm
    // systems since); midface plates of the 1.5 mm systems; load-bearing reconstruction plates of the 2.4 mm
    // systems, 2.5 mm thick, holes 8 mm apart.
    std::vector<PlateModel> all;
    for (const StripPlan& s :
         {StripPlan{"miniplate-4", "miniplate: 1.0 mm thick, 4 holes for 2.0 mm screws, with a gap", 4, 6.5, 3, 5.5,
                    2.6, 2.2, 1.0, 2.0, 0.2},
          StripPlan{"miniplate-6", "miniplate: 1.0 mm thick, 6 holes for 2.0 mm screws", 6, 6.5, 0, 5.5, 2.6, 2.2, 1.0,
                    2.0, 0.2},
          StripPlan{"midface-4", "midface plate: 0.6 mm thick, 4 holes for 1.5 mm screws", 4, 4.5, 1.5, 3.6, 1.8, 1.7,
                    0.6, 1.5, 0.15},
          StripPlan{"reconstruction-8", "reconstruction plate: 2.5 mm thick, 8 holes for 2.4 mm screws", 8, 8, 0, 8, 5,
                    2.8, 2.5, 2.4, 0.3}}) {
      all.push_back(make_strip(s));
    }
    all.push_back(make_distractor());
    return all;
  }();
  return library;
}

int plate_index(const std::string& name) {
  std::string names;
  for (std::size_t i = 0; i < plate_library().size(); ++i) {
    if (plate_library()[i].name == name) return static_cast<int>(i);
    names += (names.empty() ? "" : ", ") + plate_library()[i].name;
  }
  throw Error(ExitCode::usage, "there is no plate '" + name + "'", "one of: " + names);
}

std::vector<PlateSample> sample_plate(const PlateModel& plate, int count, double extrude_mm, bool moving) {
  const TriMesh& mesh = moving ? plate.moving : plate.mesh;
  std::vector<PlateSample> samples;
  double total = 0;
  const auto corner = [&](std::size_t t, std::size_t c) {
    const auto& p = mesh.points_mm[mesh.triangles[t][c]];
    return Vec3{static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])};
  };
  std::vector<double> area;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    area.push_back(0.5 * length(cross(corner(t, 1) - corner(t, 0), corner(t, 2) - corner(t, 0))));
    total += area.back();
  }
  if (total <= 0 || count <= 0) return samples;
  // Equal steps through the triangles, in an order along the plate: each step's triangle gives a sample at its middle.
  std::vector<std::uint32_t> order(mesh.triangles.size());
  for (std::uint32_t t = 0; t < order.size(); ++t) order[t] = t;
  const auto cell = [&](std::uint32_t t) {
    const Vec3 m = (corner(t, 0) + corner(t, 1) + corner(t, 2)) / 3;
    const Vec3 n = cross(corner(t, 1) - corner(t, 0), corner(t, 2) - corner(t, 0));
    // Underside, top, sides apart; within them by strips across.
    const int side = std::abs(n.z) > portable::hypot(n.x, n.y) ? (n.z < 0 ? 0 : 1) : 2;
    return std::make_tuple(side, std::lround(m.x / 1.0), m.y);
  };
  std::vector<std::tuple<int, long, double>> cells;
  for (std::uint32_t t = 0; t < order.size(); ++t) cells.push_back(cell(t));
  std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) { return cells[a] < cells[b]; });
  const double step = total / count;
  double gone = -0.5 * step;
  for (const std::uint32_t t : order) {
    gone += area[t];
    if (gone < 0) continue;
    const Vec3 outwards = normalized(cross(corner(t, 1) - corner(t, 0), corner(t, 2) - corner(t, 0)));
    const Vec3 middle = (corner(t, 0) + corner(t, 1) + corner(t, 2)) / 3;
    const double steps = std::floor(gone / step) + 1;
    samples.push_back({middle + outwards * extrude_mm, outwards, steps * step});
    gone -= steps * step;
  }
  return samples;
}

}  // namespace osteo::inline simulation
