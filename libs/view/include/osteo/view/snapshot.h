// One picture of what a person wants to see of a result: three cuts and a lit view in 3D.
#pragma once
#include "osteo/data/data.h"
#include "osteo/stage/stage.h"

namespace osteo {

enum class ViewFrom : int { left_front, left, right, front, back, above, below };
template <>
struct EnumNames<ViewFrom> {
  static constexpr std::array<std::string_view, 7> values{"left_front", "left", "right", "front", "back", "above", "below"};
};
/// Unit vector from the middle of the patient to the eye, LPS.
[[nodiscard]] Vec3 eye_direction(ViewFrom from);

struct SnapshotParams {
  int width = 1400;
  int height = 1000;
  ViewFrom view = ViewFrom::left_front;
  double bone_hu = 300;
  std::array<double, 3> centre_mm{0, 0, 0};
  std::string title;
};

struct SnapshotSubjects {
  Data subject;  ///< image, labels, grid, surface or tets
  Data mask;     ///< labels or grid, tinted over the cuts; optional. Labels with structures: in their colours, in 3D inside clear bone
  Data surface;  ///< shown in 3D instead of one made here; optional
};

/// Works without a display. Error(failed) when there is no OpenGL.
[[nodiscard]] Picture snapshot(const SnapshotSubjects& subjects, const SnapshotParams& params, const Context& context = {});

struct SnapshotStage {
  using Params = SnapshotParams;
  static void describe(Params& p, auto& visit) {
    visit({"width", "of the picture", "pixels", 200, 8192}, p.width);
    visit({"height", "of the picture", "pixels", 200, 8192}, p.height);
    visit({"view", "from where the 3D view looks at the patient"}, p.view);
    visit({"bone_hu", "surface shown in 3D of a CT without mask", "HU", -1000, 30000}, p.bone_hu);
    visit({"centre_mm", "point that the cuts go through, LPS (0,0,0: the middle)", "mm"}, p.centre_mm);
    visit({"title", "written in the lower right corner"}, p.title);
  }
  static StageInfo info();
  static std::vector<Data> run(const Params& params, std::span<const Data> inputs, const Context& context);
};

}  // namespace osteo
