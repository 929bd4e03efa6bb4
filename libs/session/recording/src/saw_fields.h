// A saw cut as files have it. Private to libs/session/recording.
#pragma once
#include <array>
#include <string>
#include <vector>

#include "osteo/core/base/json.h"
#include "osteo/core/base/param.h"
#include "osteo/simulation/bone/action.h"
#include "osteo/simulation/bone/saw.h"

namespace osteo::inline session {

using Triple = std::array<double, 3>;
inline constexpr double kFarMm = 10000;

inline Vec3 vec(const Triple& t) {
  return {t[0], t[1], t[2]};
}

template <class T>
std::vector<FieldRef> fields_in(T& part) {
  detail::FieldCollector collect;
  T::describe(part, collect);
  return std::move(collect.fields);
}

/// Unit. Error(usage) with its line when it has no length.
inline Vec3 direction_of(const JsonFile& file, const JsonValue& object, const std::string& where, const char* key,
                         const Triple& t) {
  const Vec3 v = vec(t);
  const JsonValue* const at = object.find(key);
  if (!(length(v) > 1e-9))
    throw file.wrong(at != nullptr ? *at : object,
                     (where.empty() ? "" : where + ": ") + "\"" + key + "\" is a direction and has no length");
  return normalized(v);
}

struct SawFields {
  Triple at_mm{}, normal{}, along{0, 0, 1};
  double kerf_mm = SawCut{}.kerf_mm, length_mm = 0, depth_mm = 0;
  static void describe(SawFields& p, auto& visit, bool needed) {
    visit({"at_mm", "middle of the blade, LPS", "mm", -kFarMm, kFarMm, needed}, p.at_mm);
    visit({"normal", "across the blade", "", -kFarMm, kFarMm, needed}, p.normal);
    visit({"along", "where its length lies", "", -kFarMm, kFarMm}, p.along);
    visit({"kerf_mm", "thickness of what it takes", "mm", 0.05, 10}, p.kerf_mm);
    visit({"length_mm", "length of the cut (0: through)", "mm", 0, 2000}, p.length_mm);
    visit({"depth_mm", "across normal and length; 0: through", "mm", 0, 2000}, p.depth_mm);
  }
  /// The cut, its directions as they are written (a cut takes any length). Error(usage) with its line: what is no
  /// direction.
  [[nodiscard]] SawCut checked(const JsonFile& file, const JsonValue& object, const std::string& where) const {
    const Vec3 across = direction_of(file, object, where, "normal", normal),
               length_of = direction_of(file, object, where, "along", along);
    if (object.find("along") != nullptr && length(cross(across, length_of)) < 1e-6)
      throw file.wrong(object, where + ": \"along\" lies along \"normal\"",
                       "the length of the blade lies across its normal");
    return {vec(at_mm), vec(normal), vec(along), kerf_mm, length_mm, depth_mm};
  }
};

}  // namespace osteo::inline session
