#include "agreement_surface.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "osteo/geometry/distance/binary_distance.h"

namespace osteo::inline imaging::segment {
namespace {

constexpr int kTogether = 2;  // voxels between those of one group
constexpr double kOverMm = 1;
constexpr float kPastEnd = 2;  // times the limit, from an end to what goes on

std::vector<std::uint8_t> boundary_of(const MaskBox& box) {
  std::vector<std::uint8_t> b(box.in.size());
  for (std::size_t v = 0; v < b.size(); ++v) b[v] = box.in[v] != 0 && at_boundary(box, box.in, v) ? 1 : 0;
  return b;
}

/// Groups of marked voxels.
std::vector<std::vector<std::size_t>> groups(const MaskBox& box, const std::vector<std::uint8_t>& in) {
  std::vector<std::vector<std::size_t>> all;
  std::vector<bool> met(in.size());
  for (std::size_t v = 0; v < in.size(); ++v) {
    if (in[v] == 0 || met[v]) continue;
    std::vector<std::size_t> group{v};
    met[v] = true;
    for (std::size_t n = 0; n < group.size(); ++n) {
      box.around(group[n], kTogether, [&](std::size_t w) {
        if (in[w] == 0 || met[w]) return;
        met[w] = true;
        group.push_back(w);
      });
    }
    all.push_back(std::move(group));
  }
  return all;
}

DifferingPlace place_of(const MaskBox& box, const std::vector<std::size_t>& group, const std::vector<float>& apart) {
  DifferingPlace place;
  Vec3 lo = box.world(group.front()), hi = lo;
  for (const std::size_t v : group) {
    const Vec3 p = box.world(v);
    for (std::size_t a = 0; a < 3; ++a) {
      lo[a] = std::min(lo[a], p[a]);
      hi[a] = std::max(hi[a], p[a]);
    }
    if (static_cast<double>(apart[v]) <= place.apart_mm) continue;
    place.apart_mm = static_cast<double>(apart[v]);
    place.at_mm = p;
  }
  place.along_mm = length(hi - lo);
  return place;
}

/// Of a tube: groups of voxels of ours, farther from theirs than the limit, that begin at one of its ends. What begins
/// at its side is a difference.
std::vector<std::uint8_t> beyond_end(const MaskBox& ours, const MaskBox& theirs, const std::vector<float>& to_theirs,
                                     const Tolerance& tolerance, const Context& context) {
  const std::size_t n = ours.in.size();
  std::vector<std::uint8_t> outside(n), beyond(n);
  const std::vector<Vec3> line = middle_line(theirs, context);
  if (line.empty()) return beyond;
  for (std::size_t v = 0; v < n; ++v)
    outside[v] = ours.in[v] != 0 && theirs.in[v] == 0 && static_cast<double>(to_theirs[v]) > tolerance.apart_mm ? 1 : 0;
  for (const std::vector<std::size_t>& group : groups(ours, outside)) {
    Vec3 middle;
    double count = 0;
    for (const std::size_t v : group) {
      if (static_cast<double>(to_theirs[v]) > tolerance.apart_mm + kOverMm) continue;
      middle += ours.world(v);
      count += 1;
    }
    if (count == 0) continue;
    middle = middle / count;
    if (std::min(length(middle - line.front()), length(middle - line.back())) > tolerance.end_mm) continue;
    for (const std::size_t v : group) beyond[v] = 1;
  }
  return beyond;
}

/// Out of the box that theirs fills, or at its faces.
std::vector<std::uint8_t> beyond_box(const MaskBox& ours, const MaskBox& theirs, double limit_mm) {
  std::array<int, 3> lo{theirs.frame.dims}, hi{-1, -1, -1};
  for (std::size_t v = 0; v < theirs.in.size(); ++v) {
    if (theirs.in[v] == 0) continue;
    const auto p = theirs.place(v);
    for (std::size_t a = 0; a < 3; ++a) {
      lo[a] = std::min(lo[a], p[a]);
      hi[a] = std::max(hi[a], p[a]);
    }
  }
  std::vector<std::uint8_t> beyond(ours.in.size());
  for (std::size_t v = 0; v < beyond.size(); ++v) {
    const auto p = ours.place(v);
    for (std::size_t a = 0; a < 3; ++a) {
      const int rim = static_cast<int>(std::ceil(limit_mm / ours.frame.spacing_mm[a]));
      if (p[a] < lo[a] + rim || p[a] > hi[a] - rim) beyond[v] = 1;
    }
  }
  return beyond;
}

std::vector<std::uint8_t> beyond_of(const MaskBox& ours, const MaskBox& theirs, const std::vector<float>& to_theirs,
                                    const Tolerance& tolerance, const Context& context) {
  switch (tolerance.open) {
    case Tolerance::Open::ends:
      return beyond_end(ours, theirs, to_theirs, tolerance, context);
    case Tolerance::Open::box:
      return beyond_box(ours, theirs, tolerance.apart_mm);
    case Tolerance::Open::nowhere:
      break;
  }
  return std::vector<std::uint8_t>(ours.in.size());
}

}  // namespace

std::uint8_t apart_of(double mm) {
  return static_cast<std::uint8_t>(std::clamp(1 + std::floor(10 * mm + 0.5), 1.0, 254.0));
}

bool at_boundary(const MaskBox& box, const std::vector<std::uint8_t>& in, std::size_t v) {
  const auto p = box.place(v);
  for (std::size_t a = 0; a < 3; ++a) {
    for (const int way : {-1, 1}) {
      auto n = p;
      n[a] += way;
      if (n[a] >= 0 && n[a] < box.frame.dims[a] && in[box.at(n[0], n[1], n[2])] == 0) return true;
    }
  }
  return false;
}

SurfaceDifference difference(const MaskBox& ours, const MaskBox& theirs, const Tolerance& tolerance,
                             const Context& context) {
  const std::size_t n = ours.in.size();
  const std::vector<std::uint8_t> our_wall = boundary_of(ours), their_wall = boundary_of(theirs);
  std::vector<float> to_theirs = squared_distance_mm2(their_wall, ours.frame, 1, context),
                     to_ours = squared_distance_mm2(our_wall, ours.frame, 1, context);
  for (float& d : to_theirs) d = std::sqrt(d);
  for (float& d : to_ours) d = std::sqrt(d);
  const auto limit = static_cast<float>(tolerance.apart_mm);
  const std::vector<std::uint8_t> beyond = beyond_of(ours, theirs, to_theirs, tolerance, context);
  std::vector<float> to_beyond = squared_distance_mm2(beyond, ours.frame, 1, context);
  for (float& d : to_beyond) d = std::sqrt(d);
  SurfaceDifference result;
  result.apart.assign(n, 0);
  std::vector<std::uint8_t> differs(n);
  std::vector<float> apart(n), compared;
  double in_ours = 0, in_theirs = 0, in_both = 0;
  for (std::size_t v = 0; v < n; ++v) {
    if (beyond[v] != 0) continue;
    in_ours += ours.in[v], in_theirs += theirs.in[v], in_both += ours.in[v] & theirs.in[v];
    if (our_wall[v] != 0) {
      apart[v] = to_theirs[v];
      differs[v] = to_theirs[v] > limit ? 1 : 0;
      compared.push_back(to_theirs[v]);
      result.apart[v] = apart_of(static_cast<double>(to_theirs[v]));
    }
    if (their_wall[v] == 0 || to_ours[v] <= limit) continue;
    // The end of theirs, within what goes on beyond it.
    if (ours.in[v] != 0 && to_beyond[v] <= kPastEnd * limit) continue;
    differs[v] = 1;
    apart[v] = std::max(apart[v], to_ours[v]);
  }
  result.dice = 2 * in_both / std::max(1.0, in_ours + in_theirs);
  if (!compared.empty()) {
    const auto at = compared.begin() + static_cast<std::ptrdiff_t>((compared.size() - 1) * 95 / 100);
    std::nth_element(compared.begin(), at, compared.end());
    result.within_mm = static_cast<double>(*at);
  }
  const double voxel_mm2 = std::pow(ours.frame.voxel_volume_mm3(), 2.0 / 3);
  for (const auto& group : groups(ours, differs)) {
    if (static_cast<double>(group.size()) * voxel_mm2 < tolerance.least_mm2) continue;
    result.places.push_back(place_of(ours, group, apart));
    for (const std::size_t v : group) {
      if (our_wall[v] != 0) {
        result.apart[v] = kDiffers;
        continue;
      }
      // Theirs alone: what of ours is nearest to it is in doubt.
      const int reach = static_cast<int>(
          std::ceil((static_cast<double>(apart[v]) + kOverMm) /
                    std::min({ours.frame.spacing_mm.x, ours.frame.spacing_mm.y, ours.frame.spacing_mm.z})));
      if (reach > 20) continue;
      const Vec3 p = ours.world(v);
      ours.around(v, reach, [&](std::size_t w) {
        if (our_wall[w] != 0 && length(ours.world(w) - p) <= static_cast<double>(apart[v]) + 0.01)
          result.apart[w] = kDiffers;
      });
    }
  }
  std::stable_sort(result.places.begin(), result.places.end(),
                   [](const auto& a, const auto& b) { return a.along_mm > b.along_mm; });
  return result;
}

}  // namespace osteo::inline imaging::segment
