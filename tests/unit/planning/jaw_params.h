// The two resection planes of a phantom's jaw, as who plans gives them.
#pragma once
#include "osteo/session/planning/detail/jaw_phantom.h"
#include "osteo/session/planning/detail/reconstruct.h"

namespace osteo::test {

inline ReconstructionParams params_for(const JawPhantom& p) {
  ReconstructionParams params;
  const auto set = [](std::array<double, 3>& to, Vec3 v) { to = {v.x, v.y, v.z}; };
  set(params.a_mm, p.a_mm);
  set(params.b_mm, p.b_mm);
  set(params.a_normal, p.a_normal);
  set(params.b_normal, p.b_normal);
  return params;
}

}  // namespace osteo::test
