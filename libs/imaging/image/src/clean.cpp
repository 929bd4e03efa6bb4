#include "clean.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "osteo/geometry/distance/binary_distance.h"
#include "osteo/imaging/image/components.h"

namespace osteo::inline imaging::image {
namespace {

// A frame and a body on every n-th voxel: the body needs no finer look, and a fraction of the memory.
struct Coarse {
  Frame frame;
  std::vector<std::uint8_t> matter;
  std::array<int, 3> step{1, 1, 1};
};

Coarse coarse_matter(const Image& ct) {
  Coarse c;
  c.frame = ct.frame;
  for (std::size_t a = 0; a < 3; ++a) {
    c.step[a] = std::max(1, static_cast<int>(1.5 / ct.frame.spacing_mm[a]));
    c.frame.dims[a] = (ct.frame.dims[a] + c.step[a] - 1) / c.step[a];
    c.frame.spacing_mm[a] *= c.step[a];
  }
  c.matter.resize(c.frame.voxel_count());
  std::size_t at = 0;
  for (int k = 0; k < c.frame.dims[2]; ++k) {
    for (int j = 0; j < c.frame.dims[1]; ++j) {
      for (int i = 0; i < c.frame.dims[0]; ++i, ++at) {
        c.matter[at] = ct.at(i * c.step[0], j * c.step[1], k * c.step[2]) > -300 ? 1 : 0;
      }
    }
  }
  return c;
}

// The index axis that runs most along the body.
std::size_t up_axis(const Frame& f) {
  std::size_t up = 0;
  for (std::size_t a = 1; a < 3; ++a) {
    if (std::abs(f.direction.column[a].z) > std::abs(f.direction.column[up].z)) up = a;
  }
  return up;
}

// Convex hull of the body in a slice: counter-clockwise corners in voxels.
struct Hull {
  std::vector<std::array<int, 2>> corners;

  static std::int64_t turn(const std::array<int, 2>& a, const std::array<int, 2>& b, const std::array<int, 2>& c) {
    return std::int64_t{b[0] - a[0]} * (c[1] - a[1]) - std::int64_t{b[1] - a[1]} * (c[0] - a[0]);
  }
  [[nodiscard]] bool holds(int x, int y) const {
    if (corners.size() < 3) return false;
    for (std::size_t n = 0; n < corners.size(); ++n) {
      if (turn(corners[n], corners[(n + 1) % corners.size()], {x, y}) < 0) return false;
    }
    return true;
  }
};

// Of points in order of x, then y. A. M. Andrew, Another efficient algorithm for convex hulls in two dimensions, 1979.
Hull hull_of(const std::vector<std::array<int, 2>>& points) {
  Hull h;
  auto& c = h.corners;
  const auto chain = [&](auto begin, auto end) {
    const std::size_t first = c.size();
    for (auto p = begin; p != end; ++p) {
      while (c.size() >= first + 2 && Hull::turn(c[c.size() - 2], c.back(), *p) <= 0) c.pop_back();
      c.push_back(*p);
    }
    if (!c.empty()) c.pop_back();
  };
  chain(points.begin(), points.end());
  chain(points.rbegin(), points.rend());
  return h;
}

std::vector<Hull> hulls_of(const std::vector<std::uint8_t>& core, const Frame& f) {
  const std::size_t up = up_axis(f), a = (up + 1) % 3, b = (up + 2) % 3;
  std::vector<Hull> hulls;
  const std::array<std::size_t, 3> stride{1, static_cast<std::size_t>(f.dims[0]),
                                          static_cast<std::size_t>(f.dims[0]) * static_cast<std::size_t>(f.dims[1])};
  for (int s = 0; s < f.dims[up]; ++s) {
    std::vector<std::array<int, 2>> points;
    for (int x = 0; x < f.dims[a]; ++x) {
      for (int y = 0; y < f.dims[b]; ++y) {
        if (core[static_cast<std::size_t>(s) * stride[up] + static_cast<std::size_t>(x) * stride[a] +
                 static_cast<std::size_t>(y) * stride[b]] != 0)
          points.push_back({x, y});
      }
    }
    hulls.push_back(hull_of(points));
  }
  return hulls;
}

}  // namespace

Outside find_outside(const std::uint8_t* mask, const Image& ct, const Context& context) {
  constexpr float kThin = 3, kGrow = 5, kReach = (kThin + kGrow) * (kThin + kGrow);
  constexpr float kCover = 2;
  constexpr double kSpeck_mm3 = 10;
  Outside result;
  Coarse c = coarse_matter(ct);
  const std::size_t n = c.matter.size();
  const auto to_air = squared_distance_mm2(c.matter, c.frame, 0, context);
  std::vector<std::uint8_t>& core = c.matter;  // its memory is not needed any more
  for (std::size_t i = 0; i < n; ++i) core[i] = to_air[i] > kThin * kThin ? 1 : 0;
  const Components parts = connected_components(core, c.frame.dims, 1, Connectivity::face);
  const Components pieces = connected_components({mask, ct.frame.voxel_count()}, ct.frame.dims, 1, Connectivity::full);
  if (pieces.voxels.empty()) return result;
  const auto nx = static_cast<std::size_t>(ct.frame.dims[0]);
  const std::size_t up = up_axis(ct.frame);
  const auto largest_of = [](const Components& all) {
    return static_cast<std::uint32_t>(std::max_element(all.voxels.begin(), all.voxels.end()) - all.voxels.begin());
  };
  const auto each_voxel = [&](const auto& take) {
    for (std::size_t r = 0; r < pieces.runs.size(); ++r) {
      const Run& run = pieces.runs[r];
      const int j = static_cast<int>(run.row) % ct.frame.dims[1], k = static_cast<int>(run.row) / ct.frame.dims[1];
      for (std::uint32_t i = run.begin; i < run.end; ++i)
        take(pieces.component[r], static_cast<int>(i), j, k, run.row * nx + i);
    }
  };
  const auto coarse_at = [&](int i, int j, int k) {
    return (static_cast<std::size_t>(k / c.step[2]) * static_cast<std::size_t>(c.frame.dims[1]) +
            static_cast<std::size_t>(j / c.step[1])) *
               static_cast<std::size_t>(c.frame.dims[0]) +
           static_cast<std::size_t>(i / c.step[0]);
  };

  // Matter by parts: the body, and other soft ones.
  std::vector<std::size_t> soft(parts.voxels.size());
  for (std::size_t r = 0; r < parts.runs.size(); ++r) {
    const Run& run = parts.runs[r];
    const int j = static_cast<int>(run.row) % c.frame.dims[1], k = static_cast<int>(run.row) / c.frame.dims[1];
    for (std::uint32_t i = run.begin; i < run.end; ++i) {
      const std::int16_t hu = ct.at(static_cast<int>(i) * c.step[0], j * c.step[1], k * c.step[2]);
      soft[parts.component[r]] += hu >= -150 && hu <= 150 ? 1 : 0;
    }
  }
  const auto is_soft = [&](std::uint32_t part, double share) {
    return static_cast<double>(soft[part]) >= share * static_cast<double>(parts.voxels[part]);
  };
  const auto of_parts = [&](const auto& chosen) {
    std::vector<std::uint8_t> map(n);
    for (std::size_t r = 0; r < parts.runs.size(); ++r) {
      const Run& run = parts.runs[r];
      const std::size_t row = static_cast<std::size_t>(run.row) * static_cast<std::size_t>(c.frame.dims[0]);
      if (chosen(parts.component[r]))
        std::fill(map.begin() + static_cast<std::ptrdiff_t>(row + run.begin),
                  map.begin() + static_cast<std::ptrdiff_t>(row + run.end), std::uint8_t{1});
    }
    return map;
  };
  std::vector<float> to_body;
  std::vector<Hull> hulls;
  const auto is_outside = [&](int i, int j, int k) {
    if (to_body[coarse_at(i, j, k)] <= kReach) return false;
    const std::array<int, 3> x{i / c.step[0], j / c.step[1], k / c.step[2]};
    return !hulls[static_cast<std::size_t>(x[up])].holds(x[(up + 1) % 3], x[(up + 2) % 3]);
  };
  std::vector<std::uint64_t> beyond(pieces.voxels.size());
  std::uint64_t outside = 0, all = 0,
                covered = 0;  // voxels of the mask; covered: not outside, and with matter around them
  const auto look_around = [&](const std::vector<std::uint8_t>& body) {
    to_body = squared_distance_mm2(body, c.frame, 1, context);
    hulls = hulls_of(body, c.frame);
    std::fill(beyond.begin(), beyond.end(), 0);
    outside = all = covered = 0;
    each_voxel([&](std::uint32_t p, int i, int j, int k, std::size_t) {
      const bool is = is_outside(i, j, k);
      beyond[p] += is ? 1 : 0;
      outside += is ? 1 : 0;
      covered += !is && to_air[coarse_at(i, j, k)] > kCover * kCover ? 1 : 0;
      ++all;
    });
  };
  std::uint32_t body_part = 0;
  if (!parts.voxels.empty() && is_soft(body_part = largest_of(parts), 0.5)) {
    look_around(of_parts([&](std::uint32_t part) { return part == body_part; }));
    result.body = 3 * outside <= 2 * all && 20 * covered >= 17 * (all - outside);
  }
  if (!result.body) {
    const std::uint32_t skull = largest_of(pieces);
    std::vector<std::uint8_t> bone(n);
    each_voxel([&](std::uint32_t p, int i, int j, int k, std::size_t) {
      if (p == skull) bone[coarse_at(i, j, k)] = 1;
    });
    look_around(bone);
  }
  if (outside == 0) return result;

  std::vector<float> to_limb;
  if (result.body)
    to_limb = squared_distance_mm2(of_parts([&](std::uint32_t part) {
                                     return part != body_part && is_soft(part, 0.25);  // a wrist is half bone
                                   }),
                                   c.frame, 1, context);
  std::vector<std::uint8_t> limb(pieces.voxels.size());
  std::vector<float> nearest(pieces.voxels.size(), std::numeric_limits<float>::infinity());
  each_voxel([&](std::uint32_t p, int i, int j, int k, std::size_t) {
    if (beyond[p] != pieces.voxels[p]) return;
    const std::size_t at = coarse_at(i, j, k);
    nearest[p] = std::min(nearest[p], to_body[at]);
    if (!to_limb.empty() && to_limb[at] <= kReach) limb[p] = 1;
  });
  const auto is_speck = [&](std::uint32_t p) {
    return static_cast<double>(pieces.voxels[p]) * ct.frame.voxel_volume_mm3() < kSpeck_mm3;
  };
  const auto is_certain = [&](std::uint32_t p) { return result.body && beyond[p] == pieces.voxels[p] && limb[p] == 0; };
  bool reaches = false, tissue = false;
  float least = std::numeric_limits<float>::infinity();
  for (std::uint32_t p = 0; p < pieces.voxels.size(); ++p) {
    if (beyond[p] == 0 || is_speck(p)) continue;
    if (is_certain(p)) {
      ++result.pieces;
      least = std::min(least, nearest[p]);
    } else {
      (beyond[p] == pieces.voxels[p] ? tissue : reaches) = true;
    }
  }
  if (result.pieces > 0) result.nearest_mm = static_cast<double>(std::sqrt(least) - kThin);
  each_voxel([&](std::uint32_t p, int i, int j, int k, std::size_t v) {
    // Of a dry skull only what stands apart as a whole.
    if (beyond[p] == 0 || is_speck(p) || (!result.body && beyond[p] != pieces.voxels[p]) || !is_outside(i, j, k))
      return;
    (is_certain(p) ? result.certain : result.doubtful).push_back(v);
  });
  result.doubt = !result.body ? "there is no soft tissue around the bone (a dry skull?), so it may be a part of it"
                 : reaches && tissue ? "it touches bone of the body, or has tissue near it as a limb has"
                 : reaches           ? "it touches bone of the body"
                                     : "it has tissue near it, as a limb has";
  return result;
}

std::size_t clear_streaks(std::uint8_t* mask, const Image& ct, double radius_mm, double metal_hu, double lower_hu,
                          std::size_t& metal_voxels, const Context& context) {
  const std::size_t n = ct.frame.voxel_count();
  std::vector<std::uint8_t> metal(n);
  metal_voxels = 0;
  for (std::size_t i = 0; i < n; ++i) {
    metal[i] = ct.voxels[i] >= metal_hu ? 1 : 0;
    metal_voxels += metal[i];
  }
  if (metal_voxels == 0) return 0;
  const auto to_metal = squared_distance_mm2(metal, ct.frame, 1, context);
  const auto reach = static_cast<float>(radius_mm * radius_mm);
  std::size_t cleared = 0;
  for (std::size_t i = 0; i < n; ++i) {
    if (mask[i] == 0 || to_metal[i] > reach || ct.voxels[i] >= lower_hu) continue;
    mask[i] = 0;
    ++cleared;
  }
  return cleared;
}

}  // namespace osteo::inline imaging::image
