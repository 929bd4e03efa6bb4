#include "osteo/imaging/io/segments.h"

#include <algorithm>
#include <array>

#include "osteo/core/base/error.h"
#include "raw_volume.h"
#include "seg_notes.h"

namespace osteo::inline imaging::io {
namespace {

template <class T>
std::optional<Volume<std::uint8_t>> mask_of(const RawVolume& raw, const T* p, std::size_t layer, int value) {
  const auto layers = static_cast<std::size_t>(raw.layers);
  const std::array<int, 3>& d = raw.frame.dims;
  std::array<int, 3> lo = d, hi{-1, -1, -1};
  std::size_t at = layer;
  for (int k = 0; k < d[2]; ++k) {
    for (int j = 0; j < d[1]; ++j) {
      for (int i = 0; i < d[0]; ++i, at += layers) {
        if (static_cast<double>(p[at]) != value) continue;
        const std::array<int, 3> x{i, j, k};
        for (std::size_t a = 0; a < 3; ++a) {
          lo[a] = std::min(lo[a], x[a]);
          hi[a] = std::max(hi[a], x[a]);
        }
      }
    }
  }
  if (hi[0] < 0) return {};
  Volume<std::uint8_t> mask;
  mask.frame = raw.frame;
  mask.frame.origin_mm =
      raw.frame.world_from_index({static_cast<double>(lo[0]), static_cast<double>(lo[1]), static_cast<double>(lo[2])});
  for (std::size_t a = 0; a < 3; ++a) mask.frame.dims[a] = hi[a] - lo[a] + 1;
  auto voxels = make_voxels<std::uint8_t>(mask.frame.voxel_count());
  std::size_t to = 0;
  for (int k = lo[2]; k <= hi[2]; ++k) {
    for (int j = lo[1]; j <= hi[1]; ++j) {
      const auto row = static_cast<std::size_t>(k) * static_cast<std::size_t>(d[1]) + static_cast<std::size_t>(j);
      const T* from = p + (row * static_cast<std::size_t>(d[0]) + static_cast<std::size_t>(lo[0])) * layers + layer;
      for (int i = lo[0]; i <= hi[0]; ++i, from += layers) voxels[to++] = static_cast<double>(*from) == value ? 1 : 0;
    }
  }
  mask.voxels = std::move(voxels);
  return mask;
}

}  // namespace

std::vector<Segment> segments_of(const RawVolume& raw) {
  require_valid(raw.frame);
  const auto notes = segments_from(raw.notes);
  // One voxel stands for a segmentation that holds nothing.
  const bool nothing = raw.frame.voxel_count() == 1;
  if (notes.empty() && !nothing) {
    throw Error(ExitCode::corrupt, "it names no segments", "save it from 3D Slicer as a segmentation (.seg.nrrd)");
  }
  std::vector<Segment> result;
  for (const SegmentNote& n : notes) {
    Segment s{n.id, n.structure.name, n.structure.rgb, n.tags, {}};
    const int layer = raw.layers == 1 ? 0 : n.layer;
    if (layer < 0 || layer >= raw.layers)
      throw Error(ExitCode::corrupt, "segment '" + s.name + "' is in a layer that is not there");
    if (!nothing && n.value != 0)
      visit_scalars(raw, [&](const auto* p) { s.mask = mask_of(raw, p, static_cast<std::size_t>(layer), n.value); });
    result.push_back(std::move(s));
  }
  return result;
}

}  // namespace osteo::inline imaging::io
