#include "seg_layers.h"

#include <algorithm>
#include <cmath>

#include "osteo/imaging/dicom/detail/place.h"
#include "place_parts.h"

namespace osteo::inline imaging::dicom {
namespace {

constexpr double kOffMm = 0.05;       // a frame may lie this far off its layer: positions are rounded
constexpr double kMinPitchMm = 0.02;  // two slices are never nearer
constexpr int kMaxLayers = 65535;

// Whether places lie on whole multiples of the pitch; the pitch is then fitted to the first and last, for it may be
// rounded.
bool fits(const std::vector<double>& places, double& pitch) {
  if (!(pitch >= kMinPitchMm)) return false;
  std::vector<double> at{0};
  for (std::size_t i = 1; i < places.size(); ++i) {
    const double steps = std::round((places[i] - places[i - 1]) / pitch);
    if (steps < 1) return false;
    at.push_back(at.back() + steps);
  }
  if (at.back() >= kMaxLayers) return false;
  const double extent = places.back() - places.front(), fitted = extent / at.back();
  if (std::abs(fitted - pitch) > 0.01 * pitch) return false;
  const double used = std::abs(extent - pitch * at.back()) <= kSamePlaceMm ? pitch : fitted;
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (std::abs(places[i] - places.front() - used * at[i]) > std::min(kOffMm, 0.1 * used)) return false;
  }
  pitch = used;
  return true;
}

// The largest length that all distances are multiples of, by Euclid's algorithm; `slack` is what positions are rounded
// to.
double common_distance(const std::vector<double>& places, double slack) {
  double common = 0;
  for (std::size_t i = 1; i < places.size(); ++i) {
    double a = std::max(common, places[i] - places[i - 1]), b = std::min(common, places[i] - places[i - 1]);
    while (b > slack) {
      const double rest = std::abs(std::remainder(a, b));
      a = b;
      b = rest;
    }
    common = a;
  }
  return common;
}

}  // namespace

SegLayers place_seg_frames(const std::vector<double>& along_mm, double spacing_mm, double thickness_mm) {
  SegLayers s;
  std::vector<double> places = along_mm;
  std::sort(places.begin(), places.end());
  places.erase(std::unique(places.begin(), places.end(), [](double a, double b) { return b - a <= kSamePlaceMm; }),
               places.end());
  const double stated = std::abs(spacing_mm);
  if (places.size() == 1) {
    s.pitch_mm = stated > 0 ? stated : thickness_mm;
    if (!(s.pitch_mm > 0))
      s.problem = "all frames lie in one slice, and it states neither distance nor thickness of slices";
  } else if (double pitch = stated; fits(places, pitch)) {
    s.pitch_mm = pitch;
    double nearest = places.back() - places.front();
    for (std::size_t i = 1; i < places.size(); ++i) nearest = std::min(nearest, places[i] - places[i - 1]);
    if (nearest > 1.5 * pitch)
      s.warning = "no two neighbouring slices hold anything: the frames lie at least " + mm(nearest) +
                  " apart, the slices " + mm(pitch) +
                  " as the file states (SpacingBetweenSlices); those between are taken as empty";
  } else {
    pitch = common_distance(places, 0.02);
    if (!fits(places, pitch)) {
      s.problem = "its frames do not lie evenly above each other";
      return s;
    }
    s.pitch_mm = pitch;
    const double parts = thickness_mm > 0 ? pitch / thickness_mm : 1;
    if (stated > 0) {
      s.warning = "the file states slices " + mm(stated) +
                  " apart (SpacingBetweenSlices), but its frames lie at multiples of " + mm(pitch) +
                  "; the positions count";
    } else if (parts > 1.5 && std::abs(parts - std::round(parts)) < 0.02 * parts) {
      s.problem = "its frames lie " + mm(pitch) + " apart and its slices are " + mm(thickness_mm) +
                  " thick, but it does not state how far apart slices are (SpacingBetweenSlices): whether empty frames "
                  "were left out cannot "
                  "be known";
      return s;
    }
  }
  if (!s.problem.empty()) return s;
  for (const double a : along_mm) s.layer.push_back(static_cast<int>(std::lround((a - places.front()) / s.pitch_mm)));
  s.count = *std::max_element(s.layer.begin(), s.layer.end()) + 1;
  return s;
}

SegStack stack_seg_frames(Frame f, const std::vector<Vec3>& at_mm, double spacing_mm, double thickness_mm) {
  Vec3 &u = f.direction.column[0], &v = f.direction.column[1];
  u = normalized(u);
  v = normalized(v - u * dot(u, v));
  f.direction.column[2] = cross(u, v);
  std::vector<double> along;
  for (const Vec3& at : at_mm) along.push_back(dot(at, f.direction.column[2]));
  SegLayers layers = place_seg_frames(along, spacing_mm, thickness_mm);
  if (!layers.problem.empty()) return {f, std::move(layers)};
  f.origin_mm = at_mm[static_cast<std::size_t>(std::min_element(along.begin(), along.end()) - along.begin())];
  f.spacing_mm.z = layers.pitch_mm;
  f.dims[2] = layers.count;
  for (std::size_t i = 0; i < at_mm.size(); ++i) {
    const Vec3 off = at_mm[i] - f.world_from_index({0, 0, static_cast<double>(layers.layer[i])});
    if (length(off) > kOffMm) layers.problem = "its frames do not lie straight above each other";
  }
  return {f, std::move(layers)};
}

}  // namespace osteo::inline imaging::dicom
