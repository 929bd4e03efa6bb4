// One picture of what a person wants to see of a result: three cuts and a lit view in 3D.
#pragma once
#include "osteo/core/base/context.h"
#include "osteo/core/base/param.h"
#include "osteo/core/data/data.h"

namespace osteo::inline display {

enum class ViewFrom : int { left_front, left, right, front, back, above, below };
[[nodiscard]] constexpr std::array<std::string_view, 7> enum_names(ViewFrom) {
  return {"left_front", "left", "right", "front", "back", "above", "below"};
}
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
  Data mask;     ///< labels or grid, tinted over the cuts; optional. Labels with structures: in their colours, in 3D
                 ///< inside clear bone
  Data surface;  ///< shown in 3D instead of one made here; optional
};

/// Works without a display. Error(failed) when there is no OpenGL.
[[nodiscard]] Picture snapshot(const SnapshotSubjects& subjects, const SnapshotParams& params,
                               const Context& context = {});

}  // namespace osteo::inline display
