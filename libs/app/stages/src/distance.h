// The stages distance, distance-at, voxelize and compare.
#pragma once
#include <string>

#include "osteo/core/stage/stage.h"
#include "osteo/geometry/distance/distance_map.h"

namespace osteo::inline app {

enum class DistanceMethod : int { exact, swept, thesis };
[[nodiscard]] constexpr std::array<std::string_view, 3> enum_names(DistanceMethod) {
  return {"exact", "swept", "thesis"};
}

/// Where the voxels of a map lie, when no other volume says so.
struct GridParams {
  double spacing_mm = 0;
  int resolution = 100;
  int margin_voxels = 3;
  static void describe(GridParams& p, auto& visit) {
    visit({"spacing_mm", "edge of the voxels (0: from --resolution)", "mm", 0, 1000}, p.spacing_mm);
    visit({"resolution", "voxels along the longest extent of the surface", "", 1, 4000}, p.resolution);
    visit({"margin_voxels", "voxels around the surface's box", "", 0, 1000}, p.margin_voxels);
  }
  [[nodiscard]] Frame frame(const TriangleSoup& surface) const;
};

struct DistanceParams {
  GridParams grid;
  DistanceRegion region = DistanceRegion::band;
  double band_inside_mm = 3, band_outside_mm = 3;
  DistanceMethod method = DistanceMethod::exact;
  int tree_ascend_n = 0;
  bool breadth_first = false;
  bool bound_as_printed = false;
  std::string structure;
  bool name_nearest = false;
};

struct DistanceStage {
  using Params = DistanceParams;
  static void describe(Params& p, auto& visit) {
    visit({"region", "which voxels get a distance: near the surface (band), inside (interior), all (box)"}, p.region);
    visit({"band_inside_mm", "how deep the band reaches inside", "mm", 0, 1e6}, p.band_inside_mm);
    visit({"band_outside_mm", "how far the band reaches outside", "mm", 0, 1e6}, p.band_outside_mm);
    GridParams::describe(p.grid, visit);
    visit({"method",
           "exact; swept: exact beside the surface, approximate beyond; thesis: its tree search, for comparison"},
          p.method);
    visit({"tree_ascend_n",
           "thesis: levels up from the last voxel's triangle where the search starts (-1: no such hint)", "", -1, 1000},
          p.tree_ascend_n);
    visit({"breadth_first", "thesis: search breadth first"}, p.breadth_first);
    visit({"bound_as_printed", "thesis: the lower bound as printed, which loses nearer triangles"}, p.bound_as_printed);
    visit({"structure", "structure of a label map by name or value (empty: all together)"}, p.structure);
    visit({"name_nearest", "write into the second grid which structure of a label map is nearest"}, p.name_nearest);
  }
  static StageInfo info();
  static std::vector<Data> run(const Params& params, std::span<const Data> inputs, const Context& context);
};

struct DistanceAtStage {
  struct Params {};
  static void describe(Params&, auto&) {}
  static StageInfo info();
  static std::vector<Data> run(const Params& params, std::span<const Data> inputs, const Context& context);
};

enum class VoxelMargin : int { exact, thesis };
[[nodiscard]] constexpr std::array<std::string_view, 2> enum_names(VoxelMargin) {
  return {"exact", "thesis"};
}
struct VoxelizeParams {
  GridParams grid;
  VoxelMargin margin = VoxelMargin::exact;
};
struct VoxelizeStage {
  using Params = VoxelizeParams;
  static void describe(Params& p, auto& visit) {
    GridParams::describe(p.grid, visit);
    visit({"margin", "exact: border voxels lie inside and touch the outside; thesis: one voxel more, outside"},
          p.margin);
  }
  static StageInfo info();
  static std::vector<Data> run(const Params& params, std::span<const Data> inputs, const Context& context);
};

struct CompareParams {
  double iso = 0.5;
};
struct CompareStage {
  using Params = CompareParams;
  static void describe(Params& p, auto& visit) {
    visit({"iso", "value at the surface of a grid", "", -1e9, 1e9}, p.iso);
  }
  static StageInfo info();
  static std::vector<Data> run(const Params& params, std::span<const Data> inputs, const Context& context);
};

}  // namespace osteo::inline app
