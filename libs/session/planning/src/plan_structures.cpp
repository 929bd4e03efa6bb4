// Nerves and teeth that a plan meets.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "osteo/core/base/error.h"
#include "osteo/geometry/distance/distance_map.h"
#include "osteo/session/planning/detail/plan.h"
#include "section.h"

namespace osteo::inline session {
namespace {

constexpr double kSectionNearMm = 40, kBesideRemoved = 1.5;
constexpr double kOnBoneMm = 3;  // a crown of a tooth that the surface leaves out goes with it

// Where the saw goes: the kerf, as far as a circle about the section.
struct Cut {
  const CutPlane* plane = nullptr;
  Vec3 towards_waste, middle_mm;
  double radius_mm = 0;
};

Cut cut_at(const CutPlane& p, const TriangleSoup& surface) {
  const planning::Sheet sheet(p.at_mm, p.normal);
  const auto outline = planning::outline_near(surface, sheet, p.at_mm, kSectionNearMm);
  if (!outline)
    throw Error(ExitCode::failed, "plane '" + p.name + "' does not cut the bone near its place",
                "the surface must be the plan's " + p.bone + ", closed, in the same CT");
  Cut c{&p, p.waste_ahead ? p.normal : -p.normal, sheet.world(planning::moments(*outline).centroid), 0};
  for (const auto& q : *outline) c.radius_mm = std::max(c.radius_mm, length(sheet.world(q) - c.middle_mm));
  return c;
}

struct Met {
  double nearest_mm = std::numeric_limits<double>::infinity(), cut_mm3 = 0;
};

}  // namespace

PlannedHarm harm_of(const SurgicalPlan& plan, std::string_view bone, const TriangleSoup& surface,
                    const Labels& structures, double within_mm) {
  if (structures.structures.empty())
    throw Error(ExitCode::usage, "the structures have no names",
                "'osteo structures' names the values of a label map, as in a case's structures.seg.nrrd");
  std::vector<Cut> cuts;
  for (const CutPlane& p : plan.planes)
    if (p.bone == bone) cuts.push_back(cut_at(p, surface));
  if (cuts.empty())
    throw Error(ExitCode::usage, "the plan has no plane that cuts '" + std::string(bone) + "'", "name a bone of it");
  Vec3 middle;
  double farthest = 0;
  for (const Cut& c : cuts) middle += c.middle_mm / static_cast<double>(cuts.size());
  for (const Cut& c : cuts) farthest = std::max(farthest, length(c.middle_mm - middle) + c.radius_mm);
  farthest *= kBesideRemoved;

  const SignedDistance tree(surface);
  const Frame& frame = structures.frame;
  const double voxel = frame.voxel_volume_mm3();
  std::array<double, 256> all{}, removed{};
  std::vector<std::array<Met, 256>> met(cuts.size());
  std::vector<double> half(cuts.size());  // of a voxel, along the normal
  for (std::size_t n = 0; n < cuts.size(); ++n)
    for (std::size_t a = 0; a < 3; ++a)
      half[n] += 0.5 * frame.spacing_mm[a] * std::abs(dot(frame.direction.column[a], cuts[n].towards_waste));
  std::size_t at = 0;
  const auto voxels = structures.span();
  for (int k = 0; k < frame.dims[2]; ++k) {
    for (int j = 0; j < frame.dims[1]; ++j) {
      for (int i = 0; i < frame.dims[0]; ++i, ++at) {
        const std::uint8_t value = voxels[at];
        if (value == 0) continue;
        const Vec3 p = frame.world_from_index({static_cast<double>(i), static_cast<double>(j), static_cast<double>(k)});
        all[value] += voxel;
        bool ahead = cuts.size() > 1 && length(p - middle) <= farthest;
        for (std::size_t n = 0; n < cuts.size(); ++n) {
          const Cut& c = cuts[n];
          const double offset = dot(p - c.plane->at_mm, c.towards_waste), kerf = c.plane->kerf_mm;
          ahead = ahead && offset > 0;
          const Vec3 beside = p - c.middle_mm - c.towards_waste * dot(p - c.middle_mm, c.towards_waste);
          if (length(beside) > c.radius_mm) continue;
          Met& m = met[n][value];
          m.nearest_mm = std::min(m.nearest_mm, std::max({0.0, -offset - half[n], offset - half[n] - kerf}));
          const double within = std::min(offset + half[n], kerf) - std::max(offset - half[n], 0.0);
          m.cut_mm3 += voxel * std::clamp(within / (2 * half[n]), 0.0, 1.0);
        }
        if (ahead && tree.at(p).signed_mm <= kOnBoneMm) removed[value] += voxel;
      }
    }
  }
  PlannedHarm out;
  for (std::size_t n = 0; n < cuts.size(); ++n) {
    const auto first = static_cast<std::ptrdiff_t>(out.at_cuts.size());
    for (const Structure& s : structures.structures)
      if (const Met& m = met[n][s.value]; m.nearest_mm <= within_mm)
        out.at_cuts.push_back({cuts[n].plane->name, s.name, m.nearest_mm, m.cut_mm3});
    std::stable_sort(out.at_cuts.begin() + first, out.at_cuts.end(), [](const auto& a, const auto& b) {
      return std::pair{a.nearest_mm, -a.cut_mm3} < std::pair{b.nearest_mm, -b.cut_mm3};
    });
  }
  for (const Structure& s : structures.structures)
    if (removed[s.value] > 0) out.removed.push_back({s.name, removed[s.value], removed[s.value] / all[s.value]});
  std::stable_sort(out.removed.begin(), out.removed.end(),
                   [](const auto& a, const auto& b) { return a.share > b.share; });
  return out;
}

}  // namespace osteo::inline session
