// The stages resample, surface, saw and pieces.
#pragma once
#include "osteo/core/stage/stage.h"
#include "osteo/geometry/grid/resample.h"
#include "osteo/imaging/image/components.h"

namespace osteo::inline app {

struct ResampleStage {
  using Params = ResampleParams;
  static void describe(Params& p, auto& visit) {
    visit({"spacing_mm", "edge of the output voxels", "mm", 0.05, 10}, p.spacing_mm);
    visit({"lower", "HU at the boundary of bone (0: the value that fits the mask best, the --lower of threshold)", "HU",
           -32768, 32767},
          p.lower);
    visit({"between",
           "how the boundary runs from slice to slice: values takes interpolated HU, which makes a step where slices "
           "lie far apart; "
           "outlines moves "
           "the slices' outlines into each other; automatic: outlines where slices lie 1.5 mm or more and over 1.3 "
           "times as far apart as "
           "pixels"},
          p.between);
    visit({"box_mm", "only a box of this size: a region of interest in a coarser bone (0,0,0: all)", "mm", 0, 1000},
          p.box_mm);
    visit({"centre_mm", "middle of the box, LPS", "mm"}, p.centre_mm);
    visit({"align_mm", "edge of the voxels of that coarser bone; the box grows to their faces", "mm", 0.05, 10},
          p.align_mm);
  }
  static StageInfo info();
  static std::vector<Data> run(const Params& params, std::span<const Data> inputs, const Context& context);
};

enum class SurfaceMethod : int { nets, voxel };
[[nodiscard]] constexpr std::array<std::string_view, 2> enum_names(SurfaceMethod) {
  return {"nets", "voxel"};
}

struct SurfaceParams {
  SurfaceMethod method = SurfaceMethod::nets;
  double iso = 0.5;
};

struct SurfaceStage {
  using Params = SurfaceParams;
  static void describe(Params& p, auto& visit) {
    visit({"method", "nets: smooth, closed and manifold; voxel: each vertex is a voxel, as in the thesis"}, p.method);
    visit({"iso", "density at the surface", "", 0.01, 0.99}, p.iso);
  }
  static StageInfo info();
  static std::vector<Data> run(const Params& params, std::span<const Data> inputs, const Context& context);
};

struct SawParams {
  std::array<double, 3> at_mm{0, 0, 0};
  bool from_centre = true;
  std::array<double, 3> normal{1, 0, 0};
  std::array<double, 3> along{0, 0, 1};
  double kerf_mm = 0.6;
  double length_mm = 0;
  double depth_mm = 0;
};
struct SawStage {
  using Params = SawParams;
  static void describe(Params& p, auto& visit) {
    visit({"at_mm", "middle of the blade, LPS", "mm"}, p.at_mm);
    visit({"from_centre", "--at-mm counts from the middle of the bone instead of from the scan's origin"},
          p.from_centre);
    visit({"normal", "across the blade, LPS"}, p.normal);
    visit({"along", "where the blade's length lies, LPS"}, p.along);
    visit({"kerf_mm", "thickness of what is removed", "mm", 0.01, 100}, p.kerf_mm);
    visit({"length_mm", "length of the blade (0: endless)", "mm", 0, 10000}, p.length_mm);
    visit({"depth_mm", "depth of the blade, at right angles to its length (0: endless)", "mm", 0, 10000}, p.depth_mm);
  }
  static StageInfo info();
  static std::vector<Data> run(const Params& params, std::span<const Data> inputs, const Context& context);
};

struct PiecesParams {
  double least_mm3 = 50;
  Connectivity connectivity = Connectivity::face;
  double apart_mm = 0;
  int keep = 0;
};
struct SeparateFragmentsStage {
  using Params = PiecesParams;
  static void describe(Params& p, auto& visit) {
    visit({"min_volume_mm3", "smaller parts are crumbs", "mm3", 0, 1e9}, p.least_mm3);
    visit({"connectivity", "face: voxels that share a face are connected; full: an edge or a corner is enough"},
          p.connectivity);
    visit({"apart_mm", "move the fragments away from their common middle, to look at them", "mm", 0, 1000}, p.apart_mm);
    visit({"keep", "which piece the output bone holds, largest first (0: all but the crumbs)", "", 0, 1000000}, p.keep);
  }
  static StageInfo info();
  static std::vector<Data> run(const Params& params, std::span<const Data> inputs, const Context& context);
};

}  // namespace osteo::inline app
