#include "osteo/imaging/image/threshold.h"

#include <algorithm>
#include <cmath>

#include "clean.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/parallel.h"
#include "osteo/geometry/distance/binary_distance.h"

namespace osteo::inline imaging {
namespace {

constexpr std::size_t kGrain = 1 << 16;

void paint(std::uint8_t* mask, const Components& parts, int nx, std::uint8_t value, const std::vector<bool>& chosen) {
  for (std::size_t r = 0; r < parts.runs.size(); ++r) {
    if (!chosen[parts.component[r]]) continue;
    const Run& run = parts.runs[r];
    std::fill(mask + static_cast<std::size_t>(run.row) * static_cast<std::size_t>(nx) + run.begin,
              mask + static_cast<std::size_t>(run.row) * static_cast<std::size_t>(nx) + run.end, value);
  }
}

void keep_cored_pieces(std::uint8_t* mask, const Image& ct, double core, Connectivity connectivity) {
  const auto parts = connected_components({mask, ct.frame.voxel_count()}, ct.frame.dims, 1, connectivity);
  std::vector<bool> drop(parts.voxels.size(), true);
  for (std::size_t r = 0; r < parts.runs.size(); ++r) {
    const Run& run = parts.runs[r];
    const std::int16_t* const row =
        ct.voxels.get() + static_cast<std::size_t>(run.row) * static_cast<std::size_t>(ct.frame.dims[0]);
    if (std::any_of(row + run.begin, row + run.end, [&](std::int16_t hu) { return hu >= core; }))
      drop[parts.component[r]] = false;
  }
  paint(mask, parts, ct.frame.dims[0], 0, drop);
}

void close_gaps(std::uint8_t* mask, const Frame& frame, double radius_mm, const Context& context) {
  const std::size_t n = frame.voxel_count();
  const auto r2 = static_cast<float>(radius_mm * radius_mm);
  const auto to_mask = squared_distance_mm2({mask, n}, frame, 1, context);
  std::vector<std::uint8_t> dilated(n);
  for (std::size_t i = 0; i < n; ++i) dilated[i] = to_mask[i] <= r2 ? 1 : 0;
  const auto to_rest = squared_distance_mm2(dilated, frame, 0, context);
  for (std::size_t i = 0; i < n; ++i) mask[i] = to_rest[i] > r2 ? 1 : mask[i];
}

void fill_cavities(std::uint8_t* mask, const Frame& frame, double max_mm3) {
  const auto parts = connected_components({mask, frame.voxel_count()}, frame.dims, 0, Connectivity::face);
  const auto nx = static_cast<std::uint32_t>(frame.dims[0]), ny = static_cast<std::uint32_t>(frame.dims[1]);
  const auto nz = static_cast<std::uint32_t>(frame.dims[2]);
  std::vector<bool> enclosed(parts.voxels.size());
  for (std::size_t c = 0; c < enclosed.size(); ++c) {
    enclosed[c] = static_cast<double>(parts.voxels[c]) * frame.voxel_volume_mm3() <= max_mm3;
  }
  for (std::size_t r = 0; r < parts.runs.size(); ++r) {
    const Run& run = parts.runs[r];
    const std::uint32_t y = run.row % ny, z = run.row / ny;
    if (run.begin == 0 || run.end == nx || y == 0 || y + 1 == ny || z == 0 || z + 1 == nz)
      enclosed[parts.component[r]] = false;
  }
  paint(mask, parts, frame.dims[0], 1, enclosed);
}

void take_table_off(std::uint8_t* mask, const Image& ct, const ThresholdParams& p, const Context& context) {
  const image::Outside found = image::find_outside(mask, ct, context);
  const double voxel_mm3 = ct.frame.voxel_volume_mm3();
  const auto volume = [&](std::size_t voxels) {
    const double mm3 = static_cast<double>(voxels) * voxel_mm3;
    return mm3 < 1000 ? std::to_string(std::lround(mm3)) + " mm3" : format_number(std::round(mm3 / 100) / 10) + " cm3";
  };
  std::size_t cleared = 0;
  const auto clear = [&](const std::vector<std::size_t>& voxels) {
    for (const std::size_t i : voxels) mask[i] = 0;
    cleared += voxels.size();
  };
  const std::size_t all = found.certain.size() + found.doubtful.size();
  std::string said;
  if (all == 0) {
    said = "none found";
  } else if (p.keep_table) {
    said = "left on, as asked: " + volume(all) + " lie outside the body";
  } else if (p.remove_table) {
    clear(found.certain);
    clear(found.doubtful);
    said = "taken off, as asked: " + volume(all);
  } else {
    clear(found.certain);
    if (!found.certain.empty()) {
      said = "taken off: " + volume(found.certain.size()) + " in " + std::to_string(found.pieces) +
             (found.pieces == 1 ? " component, " : " components, ") + std::to_string(std::lround(found.nearest_mm)) +
             " mm and more from the body";
      context.info("table or head holder " + said + " (--keep-table leaves it on)");
    }
    if (!found.doubtful.empty()) {
      const std::string left =
          volume(found.doubtful.size()) + " outside the body, which may be table or holder, LEFT ON: " + found.doubt;
      said += (said.empty() ? "" : "; ") + left;
      // Less than any table has, and teeth and the tip of a nose reach so far.
      if (static_cast<double>(found.doubtful.size()) * voxel_mm3 >= 1000)
        context.warn(left + "; --remove-table takes it off");
    }
  }
  context.report("table", said);
  context.report("outside_body_mm3", static_cast<double>(cleared) * voxel_mm3);
  context.report("outside_body_left_mm3", static_cast<double>(all - cleared) * voxel_mm3);
}

void drop_small_pieces(std::uint8_t* mask, const Frame& frame, const ThresholdParams& p, const Context& context) {
  const auto parts = connected_components({mask, frame.voxel_count()}, frame.dims, 1, p.connectivity);
  const auto drop = components_to_drop(parts, p.min_volume_mm3 / frame.voxel_volume_mm3(), p.keep_largest);
  const auto kept = static_cast<std::int64_t>(std::count(drop.begin(), drop.end(), false));
  paint(mask, parts, frame.dims[0], 0, drop);
  std::uint64_t dropped = 0;
  for (std::size_t c = 0; c < drop.size(); ++c) dropped += drop[c] ? parts.voxels[c] : 0;
  context.report("small_pieces_mm3", static_cast<double>(dropped) * frame.voxel_volume_mm3());
  context.report("pieces_found", static_cast<std::int64_t>(parts.voxels.size()));
  context.report("pieces_kept", kept);
}

}  // namespace

Labels threshold(const Image& ct, const ThresholdParams& given, const Context& context) {
  ThresholdParams p = given;
  if (p.preset != BonePreset::fixed) {
    const BoneGuide guide = guide_threshold(ct, context.threads);
    const PresetGuide& chosen = guide.presets[static_cast<std::size_t>(p.preset) - 1];
    p.lower = chosen.lower_hu;
    context.report("soft_tissue_hu", guide.soft_tissue_hu);
    context.report("dense_bone_hu", guide.dense_bone_hu);
    context.report("confidence", guide.confidence);
    context.report("change_percent_per_50_hu", chosen.change_percent);
    if (!guide.doubt.empty()) {
      context.warn(guide.doubt);
    } else if (guide.confidence < 0.5) {
      context.warn("bone and tissue are hard to tell apart in this scan (confidence " +
                   format_number(std::round(guide.confidence * 100) / 100) + "): look at the mask before you rely on " +
                   format_number(p.lower) + " HU");
    }
  }
  context.report("lower_hu", p.lower);
  if (p.keep_table && p.remove_table)
    throw Error(ExitCode::usage, "--keep-table and --remove-table contradict each other", "give one of them");
  if (p.lower > p.upper) {
    throw Error(ExitCode::usage,
                "--lower " + format_number(p.lower) + " HU is above --upper " + format_number(p.upper) + " HU");
  }
  const std::size_t n = ct.frame.voxel_count();
  const auto mask = make_voxels<std::uint8_t>(n);
  parallel_for(n, kGrain, context.threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) mask[i] = ct.voxels[i] >= p.lower && ct.voxels[i] <= p.upper ? 1 : 0;
  });
  context.progress(0.1, "body");
  take_table_off(mask.get(), ct, p, context.sub(0.1, 0.15));
  if (p.metal_mm > 0) {
    std::size_t metal = 0;
    const std::size_t cleared = image::clear_streaks(mask.get(), ct, p.metal_mm, p.metal_hu,
                                                     std::max(p.metal_lower, p.lower), metal, context.sub(0.15, 0.2));
    context.report("metal_mm3", static_cast<double>(metal) * ct.frame.voxel_volume_mm3());
    context.report("streaks_mm3", static_cast<double>(cleared) * ct.frame.voxel_volume_mm3());
  }
  context.progress(0.2, "components");
  if (p.core > p.lower) keep_cored_pieces(mask.get(), ct, p.core, p.connectivity);
  if (p.close_mm > 0) close_gaps(mask.get(), ct.frame, p.close_mm, context);
  context.progress(0.5, "components");
  if (p.fill_mm3 > 0) fill_cavities(mask.get(), ct.frame, p.fill_mm3);
  drop_small_pieces(mask.get(), ct.frame, p, context);
  const auto count = static_cast<std::int64_t>(std::count(mask.get(), mask.get() + n, std::uint8_t{1}));
  if (count == 0) {
    throw Error(ExitCode::failed,
                "no voxel is left between " + format_number(p.lower) + " and " + format_number(p.upper) + " HU",
                "'osteo info FILE' shows the range of values; lower --lower or --min-volume-mm3");
  }
  context.report("mask_voxels", count);
  context.report("mask_volume_mm3", static_cast<double>(count) * ct.frame.voxel_volume_mm3());
  context.progress(1.0);
  return {ct.frame, mask};
}

}  // namespace osteo::inline imaging
