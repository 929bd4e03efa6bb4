#include "osteo/imaging/bone_import/import_bone.h"

#include <algorithm>
#include <cmath>

#include "osteo/core/base/error.h"
#include "osteo/core/base/parallel.h"
#include "osteo/geometry/grid/brick_grid.h"
#include "osteo/geometry/grid/vdb.h"
#include "osteo/imaging/dicom/volume.h"

namespace osteo::inline imaging {
namespace {

constexpr int kLayers = 8;  // a leaf of OpenVDB

// Layers arrive in order; a layer's bone is known when the next has come.
class BoneBuilder {
 public:
  BoneBuilder(const ImportBoneParams& p, const Context& context) : p_(p), context_(context) {}

  void begin(const Frame& frame) {
    frame_ = frame;
    nx_ = static_cast<std::size_t>(frame.dims[0]);
    ny_ = static_cast<std::size_t>(frame.dims[1]);
    hu_.assign(nx_ * ny_ * (kLayers + 2), DicomSlabs::kNoValue);
    density_.assign(nx_ * ny_ * (kLayers + 1), 0);
    held_ = 0;
    runs_.clear();
    density_grid = openvdb::FloatGrid::create(0.0F);
    hu_grid = openvdb::FloatGrid::create(-1024.0F);
    valid_grid = openvdb::FloatGrid::create(0.0F);
  }

  void take(int first, int layers, const std::int16_t* slab) {
    mark_valid(first, layers, slab);
    const std::size_t area = nx_ * ny_;
    std::copy_n(slab, area * static_cast<std::size_t>(layers), hu_.data() + area * static_cast<std::size_t>(held_));
    const int have = held_ + layers, base = first - held_;  // hu_ holds layers [base, base + have)
    const bool last = first + layers == frame_.dims[2];
    // The lowest held layer is there for its neighbour only, unless it is the bottom of all.
    const int from = base == 0 ? 0 : 1, to = last ? have : have - 1;
    fill(from, to, have);
    for (int l = from; l < to; ++l) insert(base + l, l);
    held_ = std::min(2, have);
    std::copy_n(hu_.data() + area * static_cast<std::size_t>(have - held_), area * static_cast<std::size_t>(held_),
                hu_.data());
  }

  // Small pieces go; returns the number of pieces found and kept.
  std::pair<std::int64_t, std::int64_t> drop_small_pieces() {
    const Components parts = connected_components(std::move(runs_), frame_.dims, Connectivity::full);
    const auto drop = components_to_drop(parts, p_.min_volume_mm3 / frame_.voxel_volume_mm3(), p_.keep_largest);
    auto density = density_grid->getAccessor();
    auto hu = hu_grid->getAccessor();
    for (std::size_t r = 0; r < parts.runs.size(); ++r) {
      if (!drop[parts.component[r]]) continue;
      const Run& run = parts.runs[r];
      const int y = static_cast<int>(run.row % ny_), z = static_cast<int>(run.row / ny_);
      for (auto x = static_cast<int>(run.begin); x < static_cast<int>(run.end); ++x) {
        density.setValueOff({x, y, z}, 0.0F);
        hu.setValueOff({x, y, z}, -1024.0F);
      }
    }
    density_grid->tree().prune();
    return {static_cast<std::int64_t>(drop.size()),
            static_cast<std::int64_t>(std::count(drop.begin(), drop.end(), false))};
  }

  openvdb::FloatGrid::Ptr density_grid, hu_grid, valid_grid;

 private:
  void mark_valid(int first, int layers, const std::int16_t* slab) {
    for (std::size_t by = 0; by < ny_; by += 8) {
      for (std::size_t bx = 0; bx < nx_; bx += 8) {
        const std::size_t ex = std::min(bx + 8, nx_), ey = std::min(by + 8, ny_);
        std::size_t n = 0;
        for (std::size_t z = 0; z < static_cast<std::size_t>(layers); ++z) {
          for (std::size_t y = by; y < ey; ++y) {
            const std::int16_t* const row = slab + (z * ny_ + y) * nx_;
            for (std::size_t x = bx; x < ex; ++x) n += row[x] != DicomSlabs::kNoValue ? 1 : 0;
          }
        }
        if (n == 0) continue;
        const openvdb::Coord origin(static_cast<int>(bx), static_cast<int>(by), first);
        if (n == 512) {
          valid_grid->tree().addTile(1, origin, 1.0F, true);
          continue;
        }
        auto* const leaf = valid_grid->tree().touchLeaf(origin);
        for (std::size_t z = 0; z < static_cast<std::size_t>(layers); ++z) {
          for (std::size_t y = by; y < ey; ++y) {
            for (std::size_t x = bx; x < ex; ++x) {
              if (slab[(z * ny_ + y) * nx_ + x] == DicomSlabs::kNoValue) continue;
              leaf->setValueOn(openvdb::Coord(static_cast<int>(x), static_cast<int>(y), first + static_cast<int>(z)),
                               1.0F);
            }
          }
        }
      }
    }
  }

  // Densities of held layers [from, to), of which there are `have`.
  void fill(int from, int to, int have) {
    const auto lower = static_cast<float>(p_.lower);
    const auto limit = static_cast<std::int16_t>(std::clamp(std::ceil(p_.lower), -32767.0, 32767.0));
    const std::size_t count = static_cast<std::size_t>(std::max(0, to - from)) * ny_;
    parallel_for(count, ny_, context_.threads, [&](std::size_t begin, std::size_t end) {
      for (std::size_t r = begin; r < end; ++r) {
        const std::size_t l = static_cast<std::size_t>(from) + r / ny_, y = r % ny_;
        const auto row = [&](std::size_t layer, std::size_t line) { return hu_.data() + (layer * ny_ + line) * nx_; };
        const std::int16_t* const p = row(l, y);
        const std::int16_t* const near[4] = {row(l, y > 0 ? y - 1 : y), row(l, y + 1 < ny_ ? y + 1 : y),
                                             row(l > 0 ? l - 1 : l, y),
                                             row(l + 1 < static_cast<std::size_t>(have) ? l + 1 : l, y)};
        float* const out = density_.data() + r * nx_;
        for (std::size_t x = 0; x < nx_; ++x) {
          const std::int16_t left = p[x > 0 ? x - 1 : x], right = p[x + 1 < nx_ ? x + 1 : x];
          const std::int16_t top = std::max({p[x], left, right, near[0][x], near[1][x], near[2][x], near[3][x]});
          out[x] = 0;
          if (top < limit || p[x] == DicomSlabs::kNoValue) continue;
          const auto slope = [](std::int16_t a, std::int16_t b) {
            return 0.5F * (std::max(-1024.0F, static_cast<float>(b)) - std::max(-1024.0F, static_cast<float>(a)));
          };
          const float gx = slope(left, right), gy = slope(near[0][x], near[1][x]), gz = slope(near[2][x], near[3][x]);
          const float ramp =
              0.5F * (std::sqrt(gx * gx + gy * gy + gz * gz) + std::abs(gx) + std::abs(gy) + std::abs(gz));
          out[x] = std::clamp(0.5F + (static_cast<float>(p[x]) - lower) / std::max(ramp, 1.0F), 0.0F, 1.0F);
        }
      }
    });
    first_filled_ = from;
  }

  void insert(int z, int held) {
    auto density = density_grid->getAccessor();
    auto hu = hu_grid->getAccessor();
    constexpr float kTrace = 1.0F / 256;
    for (std::size_t y = 0; y < ny_; ++y) {
      const float* const d = density_.data() + (static_cast<std::size_t>(held - first_filled_) * ny_ + y) * nx_;
      const std::int16_t* const v = hu_.data() + (static_cast<std::size_t>(held) * ny_ + y) * nx_;
      for (std::size_t x = 0; x < nx_;) {
        while (x < nx_ && d[x] < kTrace) ++x;
        if (x == nx_) break;
        const std::size_t begin = x;
        for (; x < nx_ && d[x] >= kTrace; ++x) {
          const openvdb::Coord c(static_cast<int>(x), static_cast<int>(y), z);
          density.setValueOn(c, d[x]);
          hu.setValueOn(c, v[x]);
        }
        runs_.push_back({static_cast<std::uint32_t>(begin), static_cast<std::uint32_t>(x),
                         static_cast<std::uint32_t>(y + static_cast<std::size_t>(z) * ny_)});
      }
    }
  }

  const ImportBoneParams& p_;
  const Context& context_;
  Frame frame_;
  std::size_t nx_ = 0, ny_ = 0;
  std::vector<std::int16_t> hu_;  // two held layers, then the slab
  std::vector<float> density_;
  int held_ = 0, first_filled_ = 0;
  std::vector<Run> runs_;
};

}  // namespace

ImportedBone import_bone(const fs::path& source, const ImportBoneParams& p, const Context& context) {
  grid::initialize_vdb();
  require_readable(source);
  const PlaceOptions options = place_options(p.source);
  const DicomScan scan = scan_dicom(source, options, context.sub(0, 0.1));
  const DicomSeries& series = choose_series(scan, p.source.series, source.string());
  BoneBuilder builder(p, context);
  ImportedBone result;
  DicomSlabs slabs(series, options, p.spacing_mm);
  const auto refuse = [&](const std::string& what) {
    return Error(ExitCode::resources, "voxels of " + format_number(p.spacing_mm) + " mm make " + what,
                 "choose a larger --spacing-mm");
  };
  std::array<std::uint64_t, 3> cells{};
  for (std::size_t a = 0; a < 3; ++a)
    cells[a] = static_cast<std::uint64_t>(slabs.frame().dims[a]) / BrickGrid::kEdge + 1;
  if (too_wide_for_bricks(cells))
    throw refuse("a grid of more than " + std::to_string(BrickGrid::kMaxCells) + " bricks of 8^3");
  slabs.run(kLayers, context.sub(0.1, 0.95), [&](int first, int layers, const std::int16_t* slab) {
    if (first == 0) builder.begin(slabs.frame());
    builder.take(first, layers, slab);
    if (too_many_bricks(builder.density_grid->tree().leafCount()))
      throw refuse("more than " + std::to_string(BrickGrid::kMaxBricks) +
                   " bricks of 8^3 that hold bone, which is all that can be numbered");
  });
  const Frame& frame = slabs.frame();
  result.verdict = slabs.verdict();
  report_verdict(result.verdict, context);
  const auto [found, kept] = builder.drop_small_pieces();
  if (kept == 0) {
    throw Error(ExitCode::failed, "no bone is left at or above " + format_number(p.lower) + " HU",
                "'osteo import' and 'osteo info' show the range of values; lower --lower or --min-volume-mm3");
  }
  builder.hu_grid->setSaveFloatAsHalf(true);
  builder.valid_grid->setSaveFloatAsHalf(true);
  result.density = grid::wrap(builder.density_grid, frame, "density");
  result.hu = grid::wrap(builder.hu_grid, frame, "hu");
  result.valid = grid::wrap(builder.valid_grid, frame, "valid");
  context.report("pieces_found", found);
  context.report("pieces_kept", kept);
  context.report("bone_voxels", static_cast<std::int64_t>(result.density.active_voxels));
  context.report("grid_memory_mb", static_cast<double>(result.density.memory_bytes) / 1e6);
  context.progress(1.0);
  return result;
}

}  // namespace osteo::inline imaging
