#include "osteo/display/view/live_cut.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "osteo/core/base/order.h"
#include "osteo/geometry/grid/sampler.h"

namespace osteo::inline display {
namespace {

// Coordinates that change evenly from pixel to pixel.
struct Even {
  Vec3 first, across, down;
  template <class F>
  Even(const SliceView& view, F&& coordinates)
      : first(coordinates(view.world(0, 0))),
        across(coordinates(view.world(1, 0)) - first),
        down(coordinates(view.world(0, 1)) - first) {}
  [[nodiscard]] Vec3 at(int x, int y) const { return first + across * x + down * y; }
};

}  // namespace

float CtValues::at(Vec3 x) const {
  if (stored_) return stored_->linear_stored_at(x);
  for (std::size_t a = 0; a < 3; ++a) {
    if (!(x[a] >= -0.5 && x[a] <= scan_->frame.dims[a] - 0.5)) return std::numeric_limits<float>::quiet_NaN();
  }
  return static_cast<float>(sample_linear(*scan_, x));
}

std::optional<double> CtValues::at_world(Vec3 world_mm) const {
  const float hu = at(frame().index_from_world(world_mm));
  return std::isnan(hu) ? std::nullopt : std::optional(static_cast<double>(hu));
}

double difference_hu(const SparseGrid& kept, const Image& scan) {
  const BrickGrid values = to_bricks(kept, true);
  const GridSampler stored(kept);
  const CtValues ct(scan);
  const std::size_t all = values.brick_count() * BrickGrid::kVoxels, step = std::max<std::size_t>(1, all / 40'000);
  std::vector<float> off;
  std::size_t outside = 0;
  for (std::size_t v = 0; v < all; v += step) {
    const Ijk c = values.coordinate(static_cast<VoxelKey>(v));
    const Vec3 at{double(c.i), double(c.j), double(c.k)};
    const float hu = stored.linear_stored_at(at);
    if (std::isnan(hu)) continue;
    const auto there = ct.at_world(kept.frame.world_from_index(at));
    if (there) {
      off.push_back(std::abs(hu - static_cast<float>(*there)));
    } else {
      ++outside;
    }
  }
  if (off.empty() || 20 * outside > off.size()) return std::numeric_limits<double>::infinity();
  return static_cast<double>(upper_median(std::move(off)));
}

void draw_live_cut(const SliceView& view, const LiveCut& cut, std::vector<std::uint32_t>& rgba) {
  struct Laid {
    const BrickGrid* bone;
    Even index, ct;
  };
  const auto ct_index = [&](Vec3 own) { return cut.ct != nullptr ? cut.ct->frame().index_from_world(own) : Vec3{}; };
  std::vector<Laid> laid;
  for (const LiveCut::Part& p : cut.parts) {
    const BrickGrid& bone = p.body->bone;
    laid.push_back({&bone, Even(view, [&](Vec3 w) { return bone.frame().index_from_world(p.body_from_world(w)); }),
                    Even(view, [&](Vec3 w) { return ct_index(p.body_from_world(w)); })});
  }
  const Even ct_here(view, ct_index);
  std::vector<Even> before;
  for (const GridSampler* const b : cut.before)
    before.emplace_back(view, [&](Vec3 w) { return b->frame().index_from_world(w); });
  const auto density_before = [&](int x, int y) {
    for (std::size_t b = 0; b < before.size(); ++b) {
      const Vec3 at = before[b].at(x, y);
      const auto& dims = cut.before[b]->frame().dims;
      if (at.x >= -0.5 && at.y >= -0.5 && at.z >= -0.5 && at.x < dims[0] - 0.5 && at.y < dims[1] - 0.5 &&
          at.z < dims[2] - 0.5)
        return cut.before[b]->linear_at(at);
    }
    return 0.0F;
  };
  rgba.resize(static_cast<std::size_t>(view.width) * static_cast<std::size_t>(view.height));
  std::size_t pixel = 0;
  for (int y = 0; y < view.height; ++y) {
    for (int x = 0; x < view.width; ++x, ++pixel) {
      float now = 0;
      const Even* from = &ct_here;
      for (const Laid& l : laid) {
        const float d = linear_at(*l.bone, l.index.at(x, y));
        if (d <= now) continue;
        now = d;
        from = &l.ct;
      }
      double grey = 220.0 * static_cast<double>(now);
      if (cut.ct != nullptr) {
        // At the rim of a piece that was moved its own place has no value: what lies here does.
        float hu = cut.ct->at(from->at(x, y));
        if (std::isnan(hu)) hu = cut.ct->at(ct_here.at(x, y));
        if (!std::isnan(hu)) grey = cut.hu.grey(static_cast<double>(hu));
      }
      std::array<double, 3> rgb{grey, grey, grey};
      if (cut.tint_removed) {
        const double missing = std::clamp(static_cast<double>(density_before(x, y) - now), 0.0, 1.0);
        for (std::size_t c = 0; c < 3; ++c) rgb[c] += 0.55 * missing * (kRemovedColour[c] - rgb[c]);
      }
      std::uint32_t packed = 0xff000000U;
      for (std::size_t c = 0; c < 3; ++c) packed |= static_cast<std::uint32_t>(std::lround(rgb[c])) << (8 * c);
      rgba[pixel] = packed;
    }
  }
}

}  // namespace osteo::inline display
