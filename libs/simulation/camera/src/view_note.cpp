#include "osteo/simulation/camera/microscope.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "osteo/core/base/json_document.h"
#include "osteo/core/data/json_vec.h"

namespace osteo::inline simulation {
namespace {

double number_of(const Json* j, double otherwise) {
  const auto n = j == nullptr ? std::nullopt : j->number();
  return n && std::isfinite(*n) && *n > 0 ? *n : otherwise;
}

}  // namespace

std::optional<ScopeView> view_of_note(std::string_view json) {
  const auto j = Json::parse(json);
  if (!j) return std::nullopt;
  const auto eye = vec_of(j->find("eye_mm")), target = vec_of(j->find("target_mm")), up = vec_of(j->find("up"));
  if (!eye || !target) return std::nullopt;
  const double distance_mm = length(*eye - *target);
  if (!(distance_mm > 1e-6)) return std::nullopt;
  ScopeView view;
  view.focus_mm = *target;
  view.working_distance_mm = distance_mm;
  const Vec3 back = (*eye - *target) * (1 / distance_mm);
  const bool upward = up && length(cross(normalized(*up), back)) > 1e-3;
  view.upright = !upward;
  look_from(view, back, upward ? up : std::nullopt);
  const double angle_rad = std::min(number_of(j->find("view_angle_deg"), 30), 170.0) * std::numbers::pi / 180;
  const double field_mm = 2 * distance_mm * std::tan(angle_rad / 2);
  view.magnification = number_of(j->find("magnification"), kFieldNumberMm / field_mm);
  return view;
}

}  // namespace osteo::inline simulation
