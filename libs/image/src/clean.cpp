#include "clean.h"

#include <algorithm>
#include <vector>

#include "osteo/image/components.h"
#include "osteo/image/distance.h"

namespace osteo::image {
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

}  // namespace

std::size_t clear_outside_body(std::uint8_t* mask, const Image& ct, const Context& context) {
  constexpr float kThin = 3, kGrow = 5;
  Coarse c = coarse_matter(ct);
  const std::size_t n = c.matter.size();
  const auto to_air = squared_distance_mm2(c.matter, c.frame, 0, context);
  std::vector<std::uint8_t> core(n);
  for (std::size_t i = 0; i < n; ++i) core[i] = to_air[i] > kThin * kThin ? 1 : 0;
  const Components parts = connected_components(core, c.frame.dims, 1, Connectivity::face);
  if (parts.voxels.empty()) return 0;
  const auto largest = static_cast<std::uint32_t>(std::max_element(parts.voxels.begin(), parts.voxels.end()) - parts.voxels.begin());
  std::fill(core.begin(), core.end(), std::uint8_t{0});
  for (std::size_t r = 0; r < parts.runs.size(); ++r) {
    if (parts.component[r] != largest) continue;
    const Run& run = parts.runs[r];
    const std::size_t row = static_cast<std::size_t>(run.row) * static_cast<std::size_t>(c.frame.dims[0]);
    std::fill(core.begin() + static_cast<std::ptrdiff_t>(row + run.begin), core.begin() + static_cast<std::ptrdiff_t>(row + run.end),
              std::uint8_t{1});
  }
  const auto to_core = squared_distance_mm2(core, c.frame, 1, context);
  const float reach = (kThin + kGrow) * (kThin + kGrow);
  std::vector<std::size_t> outside;
  std::size_t at = 0, bone = 0;
  for (int k = 0; k < ct.frame.dims[2]; ++k) {
    for (int j = 0; j < ct.frame.dims[1]; ++j) {
      const std::size_t row =
          (static_cast<std::size_t>(k / c.step[2]) * static_cast<std::size_t>(c.frame.dims[1]) + static_cast<std::size_t>(j / c.step[1])) *
          static_cast<std::size_t>(c.frame.dims[0]);
      for (int i = 0; i < ct.frame.dims[0]; ++i, ++at) {
        bone += mask[at];
        if (mask[at] != 0 && to_core[row + static_cast<std::size_t>(i / c.step[0])] > reach) outside.push_back(at);
      }
    }
  }
  if (3 * outside.size() > bone) {
    context.warn("no body was found around the bone (a dry skull?): nothing is taken for table or holder; --keep-largest 1 may do");
    return 0;
  }
  for (const std::size_t i : outside) mask[i] = 0;
  return outside.size();
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

}  // namespace osteo::image
