// Places and directions in JSON: lists of three numbers.
#pragma once
#include <cmath>
#include <optional>

#include "osteo/core/base/json_document.h"
#include "osteo/core/data/vec.h"

namespace osteo {

/// [x, y, z].
[[nodiscard]] inline Json json_of(Vec3 v) {
  return Json{v.x, v.y, v.z};
}

/// Nothing where it is null, or no list of three finite numbers.
[[nodiscard]] inline std::optional<Vec3> vec_of(const Json* j) {
  if (j == nullptr || j->items().size() != 3) return std::nullopt;
  Vec3 v;
  for (std::size_t a = 0; a < 3; ++a) {
    const auto n = j->items()[a].number();
    if (!n || !std::isfinite(*n)) return std::nullopt;
    v[a] = *n;
  }
  return v;
}

}  // namespace osteo
