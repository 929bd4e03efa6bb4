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

constexpr float kThin = 3, kGrow = 5, kReach = (kThin + kGrow) * (kThin + kGrow);
constexpr float kCover = 2;
constexpr double kSpeck_mm3 = 10;

// take(component, i, j, k, voxel) for all voxels of all components.
template <typename Take>
void each_voxel(const Components& all, const std::array<int, 3>& dims, const Take& take) {
  const auto nx = static_cast<std::size_t>(dims[0]);
  for (std::size_t r = 0; r < all.runs.size(); ++r) {
    const Run& run = all.runs[r];
    const int j = static_cast<int>(run.row) % dims[1], k = static_cast<int>(run.row) / dims[1];
    for (std::uint32_t i = run.begin; i < run.end; ++i)
      take(all.component[r], static_cast<int>(i), j, k, run.row * nx + i);
  }
}

std::uint32_t largest_of(const Components& all) {
  return static_cast<std::uint32_t>(std::max_element(all.voxels.begin(), all.voxels.end()) - all.voxels.begin());
}

// Matter by parts, without what is as thin as a table's cover: the body, and other soft ones.
class Matter {
 public:
  Matter(const Image& ct, const Context& context) : c_(coarse_matter(ct)) {
    to_air_ = squared_distance_mm2(c_.matter, c_.frame, 0, context);
    std::vector<std::uint8_t>& core = c_.matter;  // its memory is not needed any more
    for (std::size_t i = 0; i < core.size(); ++i) core[i] = to_air_[i] > kThin * kThin ? 1 : 0;
    parts_ = connected_components(core, c_.frame.dims, 1, Connectivity::face);
    soft_.resize(parts_.voxels.size());
    each_voxel(parts_, c_.frame.dims, [&](std::uint32_t part, int i, int j, int k, std::size_t) {
      const std::int16_t hu = ct.at(i * c_.step[0], j * c_.step[1], k * c_.step[2]);
      soft_[part] += hu >= -150 && hu <= 150 ? 1 : 0;
    });
  }
  [[nodiscard]] const Frame& frame() const { return c_.frame; }
  [[nodiscard]] const std::array<int, 3>& step() const { return c_.step; }
  [[nodiscard]] const Components& parts() const { return parts_; }
  [[nodiscard]] bool is_soft(std::uint32_t part, double share) const {
    return static_cast<double>(soft_[part]) >= share * static_cast<double>(parts_.voxels[part]);
  }
  // Where a voxel of the CT lies in it.
  [[nodiscard]] std::size_t at(int i, int j, int k) const {
    return (static_cast<std::size_t>(k / c_.step[2]) * static_cast<std::size_t>(c_.frame.dims[1]) +
            static_cast<std::size_t>(j / c_.step[1])) *
               static_cast<std::size_t>(c_.frame.dims[0]) +
           static_cast<std::size_t>(i / c_.step[0]);
  }
  [[nodiscard]] bool covered(int i, int j, int k) const { return to_air_[at(i, j, k)] > kCover * kCover; }
  // The chosen parts as a map.
  template <typename Chosen>
  [[nodiscard]] std::vector<std::uint8_t> of_parts(const Chosen& chosen) const {
    std::vector<std::uint8_t> map(c_.matter.size());
    for (std::size_t r = 0; r < parts_.runs.size(); ++r) {
      const Run& run = parts_.runs[r];
      const std::size_t row = static_cast<std::size_t>(run.row) * static_cast<std::size_t>(c_.frame.dims[0]);
      if (chosen(parts_.component[r]))
        std::fill(map.begin() + static_cast<std::ptrdiff_t>(row + run.begin),
                  map.begin() + static_cast<std::ptrdiff_t>(row + run.end), std::uint8_t{1});
    }
    return map;
  }

 private:
  Coarse c_;
  std::vector<float> to_air_;
  Components parts_;
  std::vector<std::size_t> soft_;  // voxels of soft tissue, of each part
};

// Pieces of the mask beside a body: what lies beyond its reach and out of its hull.
class Surroundings {
 public:
  Surroundings(const std::uint8_t* mask, const Image& ct, const Context& context)
      : ct_(ct),
        context_(context),
        matter_(ct, context),
        pieces_(connected_components({mask, ct.frame.voxel_count()}, ct.frame.dims, 1, Connectivity::full)),
        up_(up_axis(ct.frame)),
        beyond_(pieces_.voxels.size()) {}
  Outside find() {
    Outside result;
    if (pieces_.voxels.empty()) return result;
    result.body = find_body();
    if (!result.body) take_skull_for_body();
    if (outside_ == 0) return result;
    const std::vector<Near> near = what_is_near(result.body);
    const auto is_certain = [&](std::uint32_t p) { return result.body && apart(p) && !near[p].limb; };
    bool reaches = false, tissue = false;
    float least = std::numeric_limits<float>::infinity();
    for (std::uint32_t p = 0; p < pieces_.voxels.size(); ++p) {
      if (beyond_[p] == 0 || is_speck(p)) continue;
      if (is_certain(p)) {
        ++result.pieces;
        least = std::min(least, near[p].body_mm2);
      } else {
        (apart(p) ? tissue : reaches) = true;
      }
    }
    if (result.pieces > 0) result.nearest_mm = static_cast<double>(std::sqrt(least) - kThin);
    each_of_mask([&](std::uint32_t p, int i, int j, int k, std::size_t v) {
      // Of a dry skull only what stands apart as a whole.
      if (beyond_[p] == 0 || is_speck(p) || (!result.body && !apart(p)) || !is_outside(i, j, k)) return;
      (is_certain(p) ? result.certain : result.doubtful).push_back(v);
    });
    result.doubt = !result.body ? "there is no soft tissue around the bone (a dry skull?), so it may be a part of it"
                   : reaches && tissue ? "it touches bone of the body, or has tissue near it as a limb has"
                   : reaches           ? "it touches bone of the body"
                                       : "it has tissue near it, as a limb has";
    return result;
  }

 private:
  template <typename Take>
  void each_of_mask(const Take& take) const {
    each_voxel(pieces_, ct_.frame.dims, take);
  }
  [[nodiscard]] bool apart(std::uint32_t piece) const { return beyond_[piece] == pieces_.voxels[piece]; }
  [[nodiscard]] bool is_speck(std::uint32_t piece) const {
    return static_cast<double>(pieces_.voxels[piece]) * ct_.frame.voxel_volume_mm3() < kSpeck_mm3;
  }
  [[nodiscard]] bool is_outside(int i, int j, int k) const {
    if (to_body_[matter_.at(i, j, k)] <= kReach) return false;
    const auto& step = matter_.step();
    const std::array<int, 3> x{i / step[0], j / step[1], k / step[2]};
    return !hulls_[static_cast<std::size_t>(x[up_])].holds(x[(up_ + 1) % 3], x[(up_ + 2) % 3]);
  }

  // The largest part of matter, where it is soft and most of the mask lies in it.
  bool find_body() {
    const Components& parts = matter_.parts();
    if (parts.voxels.empty()) return false;
    body_part_ = largest_of(parts);
    if (!matter_.is_soft(body_part_, 0.5)) return false;
    look_around(matter_.of_parts([&](std::uint32_t part) { return part == body_part_; }));
    return 3 * outside_ <= 2 * all_ && 20 * covered_ >= 17 * (all_ - outside_);
  }
  void take_skull_for_body() {
    const std::uint32_t skull = largest_of(pieces_);
    std::vector<std::uint8_t> bone(matter_.frame().voxel_count());
    each_of_mask([&](std::uint32_t p, int i, int j, int k, std::size_t) {
      if (p == skull) bone[matter_.at(i, j, k)] = 1;
    });
    look_around(bone);
  }
  void look_around(const std::vector<std::uint8_t>& body) {
    to_body_ = squared_distance_mm2(body, matter_.frame(), 1, context_);
    hulls_ = hulls_of(body, matter_.frame());
    std::fill(beyond_.begin(), beyond_.end(), 0);
    outside_ = all_ = covered_ = 0;
    each_of_mask([&](std::uint32_t p, int i, int j, int k, std::size_t) {
      const bool is = is_outside(i, j, k);
      beyond_[p] += is ? 1 : 0;
      outside_ += is ? 1 : 0;
      covered_ += !is && matter_.covered(i, j, k) ? 1 : 0;
      ++all_;
    });
  }

  // Of each piece that stands apart as a whole.
  struct Near {
    float body_mm2 = std::numeric_limits<float>::infinity();  // squared distance
    bool limb = false;                                        // there is tissue near it that is not the body
  };
  [[nodiscard]] std::vector<Near> what_is_near(bool body) const {
    std::vector<float> to_limb;
    if (body)
      to_limb = squared_distance_mm2(matter_.of_parts([&](std::uint32_t part) {
        return part != body_part_ && matter_.is_soft(part, 0.25);  // a wrist is half bone
      }),
                                     matter_.frame(), 1, context_);
    std::vector<Near> near(pieces_.voxels.size());
    each_of_mask([&](std::uint32_t p, int i, int j, int k, std::size_t) {
      if (!apart(p)) return;
      const std::size_t at = matter_.at(i, j, k);
      near[p].body_mm2 = std::min(near[p].body_mm2, to_body_[at]);
      if (!to_limb.empty() && to_limb[at] <= kReach) near[p].limb = true;
    });
    return near;
  }

  const Image& ct_;
  const Context& context_;
  Matter matter_;
  Components pieces_;  // of the mask
  std::size_t up_;
  std::uint32_t body_part_ = 0;
  std::vector<float> to_body_;  // squared, mm2
  std::vector<Hull> hulls_;
  std::vector<std::uint64_t> beyond_;  // voxels of each piece that are outside
  // Voxels of the mask; covered: not outside, and with matter around them.
  std::uint64_t outside_ = 0, all_ = 0, covered_ = 0;
};

}  // namespace

Outside find_outside(const std::uint8_t* mask, const Image& ct, const Context& context) {
  return Surroundings(mask, ct, context).find();
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
