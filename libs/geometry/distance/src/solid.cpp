#include "osteo/geometry/distance/solid.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <optional>
#include <tuple>

#include "osteo/core/base/error.h"
#include "osteo/core/base/portable_math.h"
#include "osteo/core/base/union_find.h"
#include "osteo/geometry/distance/voxelize.h"
#include "turns_tree.h"
#include "winding.h"
#include "winding_at.h"

namespace osteo::inline geometry {
namespace {

using Triangle = std::array<std::uint32_t, 3>;

// Triangles with the same corners, as one: as many as face one way more than the other.
std::vector<Layer> layers_of(const TriangleSoup& soup) {
  std::vector<std::pair<Triangle, std::uint32_t>> by_corners;
  for (std::uint32_t i = 0; i < soup.triangles.size(); ++i) {
    Triangle key = soup.triangles[i];
    if (key[0] == key[1] || key[1] == key[2] || key[2] == key[0]) continue;
    std::sort(key.begin(), key.end());
    by_corners.emplace_back(key, i);
  }
  std::sort(by_corners.begin(), by_corners.end());
  std::vector<std::pair<std::uint32_t, int>> firsts;
  for (std::size_t i = 0, j = 0; i < by_corners.size(); i = j) {
    const Triangle& own = soup.triangles[by_corners[i].second];
    int net = 0;
    for (j = i; j < by_corners.size() && by_corners[j].first == by_corners[i].first; ++j) {
      const Triangle& t = soup.triangles[by_corners[j].second];
      const auto first = static_cast<std::size_t>(std::find(t.begin(), t.end(), own[0]) - t.begin());
      net += t[(first + 1) % 3] == own[1] ? 1 : -1;
    }
    firsts.emplace_back(by_corners[i].second, net);
  }
  std::sort(firsts.begin(), firsts.end());
  std::vector<Layer> layers;
  for (const auto& [i, net] : firsts) layers.push_back({soup.triangles[i], net});
  return layers;
}

// Of a triangle seen from p, over 4 pi; positive from behind. A. van Oosterom, J. Strackee 1983.
double corner_solid_angle(Vec3 a, Vec3 b, Vec3 c, Vec3 p) {
  a = a - p;
  b = b - p;
  c = c - p;
  const double la = length(a), lb = length(b), lc = length(c);
  const double up = dot(a, cross(b, c)), down = la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb;
  return up == 0 ? 0 : portable::atan2(up, down) / (2 * std::numbers::pi);
}

double divergence(const TriangleSoup& soup) {
  if (soup.triangles.empty()) return 0;
  const Vec3 about = soup.points_mm[soup.triangles[0][0]];
  double sum = 0;
  for (const auto& t : soup.triangles)
    sum += dot(soup.points_mm[t[0]] - about, cross(soup.points_mm[t[1]] - about, soup.points_mm[t[2]] - about)) / 6;
  return sum;
}

std::optional<SolidSurface> solid_of(const TriangleSoup& input, const Context& context) {
  SolidSurface result;
  result.soup = welded(input);
  // What no order closes is put in order first, or it would be as many patches as triangles.
  Ordered mended;
  if (!is_closed(result.soup)) {
    mended = ordered(input, context);
    result.soup = mended.soup;
  }
  const auto& points = result.soup.points_mm;
  const std::vector<Layer> layers = layers_of(result.soup);
  const auto corner = [&](const Layer& s, std::size_t i) { return points[s.corners[i]]; };
  // Patches: neighbours over edges of two that face the same way and lie on each other as often.
  std::vector<std::uint32_t> parent(layers.size());
  std::iota(parent.begin(), parent.end(), 0U);
  struct Edge {
    std::uint32_t a, b, layer;
    bool forward;
  };
  std::vector<Edge> edges;
  for (std::uint32_t s = 0; s < layers.size(); ++s) {
    for (std::size_t e = 0; e < 3; ++e) {
      const std::uint32_t u = layers[s].corners[e], v = layers[s].corners[(e + 1) % 3];
      edges.push_back({std::min(u, v), std::max(u, v), s, u < v});
    }
  }
  std::sort(edges.begin(), edges.end(),
            [](const Edge& x, const Edge& y) { return std::tie(x.a, x.b, x.layer) < std::tie(y.a, y.b, y.layer); });
  std::vector<bool> at_border(layers.size());  // of their patch
  for (std::size_t i = 0, j = 0; i < edges.size(); i = j) {
    for (j = i + 1; j < edges.size() && edges[j].a == edges[i].a && edges[j].b == edges[i].b;) ++j;
    if (j - i == 2 && edges[i].forward != edges[i + 1].forward &&
        layers[edges[i].layer].net == layers[edges[i + 1].layer].net) {
      join_sets(parent, edges[i].layer, edges[i + 1].layer);
    } else {
      for (std::size_t e = i; e < j; ++e) at_border[edges[e].layer] = true;
    }
  }
  struct Patch {
    std::vector<std::uint32_t> layers;
    std::uint32_t largest = 0;
    double most = -1;
    BoxMm box;
    bool closed = true;  // by itself: nothing outside of its box is within it
  };
  std::vector<Patch> patches;
  std::vector<std::uint32_t> patch_of(layers.size());
  {
    constexpr std::uint32_t kUnnumbered = 0xffffffffU;
    std::vector<std::uint32_t> number(layers.size(), kUnnumbered);  // by root
    for (std::uint32_t s = 0; s < layers.size(); ++s) {
      std::uint32_t& n = number[root_of(parent, s)];
      if (n == kUnnumbered) {
        n = static_cast<std::uint32_t>(patches.size());
        patches.emplace_back();
      }
      patch_of[s] = n;
      Patch& patch = patches[n];
      const double area =
          length(cross(corner(layers[s], 1) - corner(layers[s], 0), corner(layers[s], 2) - corner(layers[s], 0)));
      patch.layers.push_back(s);
      patch.closed = patch.closed && !at_border[s];
      if (area > patch.most) patch.largest = s, patch.most = area;
      for (std::size_t i = 0; i < 3; ++i) patch.box.include(corner(layers[s], i));
    }
  }
  std::vector<PlaceOn> places;
  for (const Patch& patch : patches) {
    const Layer& own = layers[patch.largest];
    places.push_back({patch.largest, corner(own, 0) * 0.37 + corner(own, 1) * 0.33 + corner(own, 2) * 0.30});
  }
  // How often the surface winds around what lies right behind each place: whole numbers by rays, for a surface that
  // fans close, less the turns of these.
  const std::vector<Fan> fans = closing_fans(mended, points);
  const TurnsTree fan_tree(fans);
  const auto windings = [&] {
    if (fans.empty()) return windings_behind(points, layers, places, context);
    std::vector<Vec3> all_points = points;
    std::vector<Layer> all_layers = layers;
    for (const Fan& fan : fans) {
      const auto at = static_cast<std::uint32_t>(all_points.size());
      all_points.insert(all_points.end(), {fan.a, fan.b, fan.c});
      all_layers.push_back({{at, at + 1, at + 2}, fan.weight});
    }
    return windings_behind(all_points, all_layers, places, context);
  }();
  // Where rays give no answer: the sum of all solid angles, in which a triangle that holds the place makes no turn.
  const auto sum_at = [&](std::size_t number) {
    const Patch& patch = patches[number];
    const Vec3 p = places[number].at;
    // By more than rounding: faces that lie on each other are looked at.
    const auto apart_from = [&](const Patch& other) {
      bool outside = false;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const double slack = 1e-9 * (std::abs(other.box.lo[axis]) + std::abs(other.box.hi[axis]) + std::abs(p[axis]));
        outside = outside || p[axis] < other.box.lo[axis] - slack || p[axis] > other.box.hi[axis] + slack;
      }
      return outside;
    };
    double others = 0;
    for (const Patch& other : patches) {
      if (&other != &patch && other.closed && apart_from(other)) continue;
      for (const std::uint32_t s : other.layers) {
        if (s != patch.largest && layers[s].net != 0)
          others +=
              layers[s].net * corner_solid_angle(corner(layers[s], 0), corner(layers[s], 1), corner(layers[s], 2), p);
      }
    }
    return others + layers[patch.largest].net / 2.0;
  };
  enum class Verdict : std::uint8_t { drop, keep, turn };
  std::vector<Verdict> verdict_of;
  const auto inside = [](double w) { return std::abs(w) > 0.5; };
  for (std::size_t number = 0; number < patches.size(); ++number) {
    context.check_cancelled();
    const int net = layers[patches[number].largest].net;
    double behind = 0;
    bool decided = windings[number].has_value();
    if (decided) {
      const TurnsTree::Turns turns = fan_tree.turns(places[number].at, 1e-6);
      behind = *windings[number] - turns.value;
      for (const double w : {behind, behind - net})
        decided = decided && std::abs(std::abs(w) - 0.5) > turns.error + 1e-9;
    }
    if (!decided) behind = sum_at(number);
    verdict_of.push_back(inside(behind) == inside(behind - net) ? Verdict::drop
                         : inside(behind)                       ? Verdict::keep
                                                                : Verdict::turn);
  }
  result.soup.triangles.clear();
  for (std::uint32_t s = 0; s < layers.size(); ++s) {
    Triangle t = layers[s].corners;
    const Verdict v = verdict_of[patch_of[s]];
    if (v == Verdict::drop) {
      ++result.buried;
      continue;
    }
    if (v == Verdict::turn) {
      std::swap(t[1], t[2]);
      ++result.turned;
    }
    result.soup.triangles.push_back(t);
  }
  if (result.soup.triangles.empty()) return std::nullopt;
  return result;
}

}  // namespace

SolidSurface solid_surface(const TriangleSoup& soup, const Context& context) {
  require_sound(soup);
  if (auto found = solid_of(soup, context)) return *std::move(found);
  throw Error(ExitCode::failed, "the surface encloses nothing: everywhere its winding number is the same on both sides",
              "a sheet has no inside; 'osteo mesh-info' shows what the surface is");
}

double inside_volume_mm3(const TriangleSoup& soup, const Context& context) {
  require_sound(soup);
  const auto [lo, hi] = bounds_of(soup);
  const Vec3 size = hi - lo;
  const double extent = std::max({size.x, size.y, size.z});
  if (!(extent > 0)) return 0;
  const TriangleSoup whole = welded(soup);
  constexpr int kVoxels = 200;
  if (!is_closed(whole)) {
    // In a soup of triangles every voxel may need every opening's solid angle, for minutes: voxels are halved only
    // while that is expected to stay below a bound, by how many it took before.
    constexpr double kMaxAngles = 3e7;
    int voxels = kVoxels / 8;
    std::uint64_t angles = 0;
    Frame frame = frame_around(soup, voxels, 1);
    VoxelBits bits = voxels_inside_counted(soup, frame, context, nullptr, angles);
    while (voxels < kVoxels && 8.0 * static_cast<double>(angles) <= kMaxAngles) {
      frame = frame_around(soup, voxels *= 2, 1);
      bits = voxels_inside_counted(soup, frame, context, nullptr, angles);
    }
    return static_cast<double>(bits.count()) * frame.voxel_volume_mm3();
  }
  const Frame frame = frame_around(soup, kVoxels, 1);
  InsideReport report;
  const VoxelBits bits = voxels_inside(soup, frame, context, &report);
  // Of bodies that cross nothing may be left, as a patch is judged by one place of it: then the surface is taken whole.
  const auto solid = solid_of(soup, context);
  if (!solid && std::all_of(bits.words.begin(), bits.words.end(), [](auto word) { return word == 0; })) return 0;
  // The divergence theorem counts a place as often as the surface winds about it. What that is too much is counted in
  // voxels, so that only it is as coarse as these, and nothing where nothing overlaps. A surface that was sound is not
  // counted again.
  InsideReport of_solid = report;
  const bool untouched =
      solid && solid->buried == 0 && solid->turned == 0 && solid->soup.triangles.size() == whole.triangles.size();
  const bool same = solid && (untouched || voxels_inside(solid->soup, frame, context, &of_solid).words == bits.words);
  const TriangleSoup& used = same ? solid->soup : whole;
  return divergence(used) - static_cast<double>(same ? of_solid.surplus : report.surplus) * frame.voxel_volume_mm3();
}

}  // namespace osteo::inline geometry
