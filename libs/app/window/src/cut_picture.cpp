#include "cut_picture.h"

#include <algorithm>
#include <cmath>

#include "osteo/core/base/parallel.h"

namespace osteo::inline app {
namespace {

constexpr std::uint32_t colour(std::uint32_t r, std::uint32_t g, std::uint32_t b) {
  return r | g << 8 | b << 16 | 0xff000000U;
}
constexpr std::uint32_t colour(const std::array<std::uint8_t, 3>& c) {
  return colour(c[0], c[1], c[2]);
}
std::uint32_t mix(std::uint32_t a, const std::array<std::uint8_t, 3>& b, std::uint32_t share) {  // share of b, of 256
  const auto part = [&](int shift, std::uint8_t v) {
    return (((a >> shift & 255) * (256 - share) + v * share) >> 8) << shift;
  };
  return part(0, b[0]) | part(8, b[1]) | part(16, b[2]) | 0xff000000U;
}

// What a pixel shows: bit 0 bone, bit 1 the live threshold, from bit 8 on the structure.
using What = std::uint16_t;

}  // namespace

std::optional<double> hu_at(const Image& ct, Vec3 world_mm) {
  const Vec3 x = ct.frame.index_from_world(world_mm);
  for (std::size_t a = 0; a < 3; ++a) {
    if (!(x[a] >= -0.5 && x[a] <= ct.frame.dims[a] - 0.5)) return std::nullopt;
  }
  return sample_linear(ct, x);
}

void draw_cut(const SliceView& view, const EditDocument& document, const CutLook& look,
              std::vector<std::uint32_t>& rgba) {
  const Image& ct = document.ct();
  const auto width = static_cast<std::size_t>(view.width), height = static_cast<std::size_t>(view.height);
  rgba.resize(width * height);
  std::vector<What> what(width * height);
  std::array<const EditStructure*, 256> shown{};
  for (const EditStructure& s : document.structures()) shown[s.is.value] = s.shown ? &s : nullptr;

  // Index coordinates change evenly from pixel to pixel.
  const Frame& f = ct.frame;
  const Vec3 first = f.index_from_world(view.world(0, 0));
  const Vec3 across = f.index_from_world(view.world(1, 0)) - first, down = f.index_from_world(view.world(0, 1)) - first;
  const std::array<double, 3> edge{f.dims[0] - 0.5, f.dims[1] - 0.5, f.dims[2] - 0.5};
  const auto nx = static_cast<std::ptrdiff_t>(f.dims[0]), nxy = nx * f.dims[1];
  const double black = look.hu.level - look.hu.width / 2, scale = 255 / std::max(1.0, look.hu.width);
  const std::span<const std::uint8_t> labels = document.labels();

  parallel_for(height, 16, 0, [&](std::size_t begin, std::size_t end) {
    for (std::size_t y = begin; y < end; ++y) {
      for (std::size_t x = 0; x < width; ++x) {
        const std::size_t p = y * width + x;
        const Vec3 at = first + across * static_cast<double>(x) + down * static_cast<double>(y);
        if (!(at.x >= -0.5 && at.y >= -0.5 && at.z >= -0.5 && at.x < edge[0] && at.y < edge[1] && at.z < edge[2])) {
          rgba[p] = 0xff000000U;
          continue;
        }
        const auto split = [](double v, int n, std::ptrdiff_t& low, std::ptrdiff_t& step) {
          const double c = std::clamp(v, 0.0, n - 1.0);
          low = std::min(static_cast<std::ptrdiff_t>(c), static_cast<std::ptrdiff_t>(std::max(0, n - 2)));
          step = n > 1 ? 1 : 0;
          return static_cast<float>(c - static_cast<double>(low));
        };
        std::ptrdiff_t i = 0, j = 0, k = 0, si = 0, sj = 0, sk = 0;
        const float u = split(at.x, f.dims[0], i, si), v = split(at.y, f.dims[1], j, sj),
                    w = split(at.z, f.dims[2], k, sk);
        const std::int16_t* const c = ct.voxels.get() + k * nxy + j * nx + i;
        const auto lerp = [](float a, float b, float t) { return a + (b - a) * t; };
        const auto square = [&](const std::int16_t* q) {
          return lerp(lerp(static_cast<float>(q[0]), static_cast<float>(q[si]), u),
                      lerp(static_cast<float>(q[sj * nx]), static_cast<float>(q[sj * nx + si]), u), v);
        };
        const float hu = w == 0 ? square(c) : lerp(square(c), square(c + sk * nxy), w);
        const auto g = static_cast<std::uint32_t>(std::clamp((static_cast<double>(hu) - black) * scale, 0.0, 255.0));
        rgba[p] = colour(g, g, g);
        const int ni = static_cast<int>(at.x + 0.5), nj = static_cast<int>(at.y + 0.5),
                  nk = static_cast<int>(at.z + 0.5);
        unsigned is = document.bone().at(ni, nj, nk) ? 1U : 0U;
        if (look.live && static_cast<double>(hu) >= look.live->lower_hu &&
            static_cast<double>(hu) <= look.live->upper_hu)
          is |= 2U;
        if (const std::uint8_t label = labels[static_cast<std::size_t>(nk * nxy + nj * nx + ni)];
            label != 0 && shown[label] != nullptr)
          is |= static_cast<unsigned>(label) << 8;
        what[p] = static_cast<What>(is);
      }
    }
  });
  if (!look.outlines && document.structures().empty()) return;

  const auto reach = static_cast<std::size_t>(std::max(1, look.line_pixels));
  parallel_for(height, 16, 0, [&](std::size_t begin, std::size_t end) {
    for (std::size_t y = begin; y < end; ++y) {
      for (std::size_t x = 0; x < width; ++x) {
        const std::size_t p = y * width + x;
        const What is = what[p];
        if (is == 0) continue;
        // What all around is too; at the edge of the picture nothing ends.
        What common = 0xffff;
        bool same_label = true;
        const auto beside = [&](std::size_t q) {
          common = static_cast<What>(common & what[q]);
          same_label = same_label && what[q] >> 8 == is >> 8;
        };
        if (x >= reach) beside(p - reach);
        if (x + reach < width) beside(p + reach);
        if (y >= reach) beside(p - reach * width);
        if (y + reach < height) beside(p + reach * width);
        if (is >> 8 != 0) {
          const auto& rgb = shown[is >> 8]->is.rgb;
          rgba[p] = same_label ? mix(rgba[p], rgb, 90) : colour(rgb);
        }
        if (!look.outlines) continue;
        const What wanted = look.live ? 2 : 1;
        if ((is & wanted) == 0) continue;
        if ((common & wanted) == 0) {
          rgba[p] = colour(look.live ? kLiveColour : kBoneColour);
        } else if (look.live) {
          rgba[p] = mix(rgba[p], kLiveColour, 40);
        }
      }
    }
  });
}

}  // namespace osteo::inline app
