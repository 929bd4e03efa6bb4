#include "osteo/simulation/tissue/bone_stiffness.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "osteo/core/base/error.h"
#include "osteo/core/base/parallel.h"

namespace osteo::inline simulation {
namespace {

constexpr double kAshOfApparent = 0.598;
constexpr double kMaxOutside = 0.05;  // of the volume: more is another CT
constexpr double kMinDensity = 1;     // kg/m3, of air: all that has a volume has a weight
constexpr int kMaxAlongEdge = 64;     // samples: a tetrahedron of 32 voxels is no longer resolved finer

void require_usable(const BoneDensity& d, double step) {
  if (!(d.per_1000_hu > 0) || !std::isfinite(d.per_1000_hu) || !std::isfinite(d.at_0_hu))
    throw Error(ExitCode::usage, "density rises with HU: its slope is above 0, and both are finite");
  if (!(d.min_mpa > 0 && d.max_mpa > d.min_mpa && std::isfinite(d.max_mpa)))
    throw Error(ExitCode::usage, "the least modulus is above 0 and below the most");
  if (!(step >= 0 && step <= 1)) throw Error(ExitCode::usage, "materials are 0 to 1 (100 %) apart");
}

}  // namespace

double ash_density(double hu, const BoneDensity& density) {
  const double mineral = density.at_0_hu + density.per_1000_hu * hu / 1000;
  return std::max(0.0, density.ash_correction ? (mineral + 0.09) / 1.14 : mineral);
}

double apparent_density(double hu, const BoneDensity& density) {
  return ash_density(hu, density) / kAshOfApparent;
}

double weighed_density(double hu, const BoneDensity& density) {
  if (density.weight == BoneWeight::apparent) return apparent_density(hu, density);
  constexpr double kFrom = 100, kAtFrom = 1.017 + 0.000592 * kFrom;
  if (hu >= kFrom) return 1.017 + 0.000592 * hu;
  return hu >= 0 ? 1 + hu / kFrom * (kAtFrom - 1) : std::max(0.0, 1 + hu / 1000);
}

double young_mpa(double hu, const BoneDensity& density) {
  const double ash = ash_density(hu, density), apparent = ash / kAshOfApparent;
  switch (density.law) {
    case StiffnessLaw::morgan_2003:
      return 6850 * std::pow(apparent, 1.49);
    case StiffnessLaw::keller_1994:
      return 10500 * std::pow(ash, 2.29);
    case StiffnessLaw::carter_hayes_1977:
      return 3790 * std::pow(0.01, 0.06) * apparent * apparent * apparent;
    case StiffnessLaw::keyak_1998:
      break;
  }
  return ash <= 0.27 ? 33900 * std::pow(ash, 2.20) : ash < 0.6 ? 5307 * ash + 469 : 10200 * std::pow(ash, 2.01);
}

BoneStiffness bone_stiffness(const TetMesh& mesh, const Image& ct, const BoneDensity& density, double step,
                             const Context& context) {
  require_usable(density, step);
  const Vec3 h = ct.frame.spacing_mm;
  const double apart_mm = 0.5 * std::min({h.x, h.y, h.z});
  // HU are whole: the law is looked up, linear between them.
  std::vector<double> law(65536 + 1);
  for (std::size_t v = 0; v < law.size(); ++v) law[v] = young_mpa(static_cast<double>(v) - 32768, density);
  const std::size_t count = mesh.tets.size();
  BoneStiffness s;
  s.young_mpa.resize(count);
  s.hu.resize(count);
  std::vector<double> volume(count);
  std::vector<double> grams(count), outside(count);
  for (const auto& p : mesh.points_mm) {
    if (!std::isfinite(p[0]) || !std::isfinite(p[1]) || !std::isfinite(p[2]))
      throw Error(ExitCode::usage, "a point of the mesh is nowhere: its coordinates are not finite");
  }
  parallel_for(count, 4096, context.threads, [&](std::size_t begin, std::size_t end) {
    context.check_cancelled();
    for (std::size_t t = begin; t < end; ++t) {
      std::array<Vec3, 4> at;  // in voxels
      std::array<Vec3, 4> mm;
      for (std::size_t c = 0; c < 4; ++c) {
        mm[c] = from_floats(mesh.points_mm[mesh.tets[t][c]]);
        at[c] = ct.frame.index_from_world(mm[c]);
      }
      volume[t] = std::abs(dot(cross(mm[1] - mm[0], mm[2] - mm[0]), mm[3] - mm[0])) / 6;
      double longest = 0;
      for (std::size_t c = 0; c < 4; ++c) {
        for (std::size_t b = 0; b < c; ++b) longest = std::max(longest, length(mm[c] - mm[b]));
      }
      // Middles of the n^3 small tetrahedra that stand like the whole: their mean is that of the whole for anything
      // linear.
      const int n = std::clamp(static_cast<int>(std::ceil(longest / apart_mm)), 2, kMaxAlongEdge);
      double sum = 0, sum_hu = 0, sum_density = 0;
      int samples = 0, beyond = 0;
      for (int i = 0; i < n; ++i) {
        for (int j = 0; j < n - i; ++j) {
          for (int k = 0; k < n - i - j; ++k, ++samples) {
            const double a = (i + 0.25) / n, b = (j + 0.25) / n, c = (k + 0.25) / n;
            const Vec3 place = at[0] * a + at[1] * b + at[2] * c + at[3] * (1 - a - b - c);
            bool in = true;
            for (std::size_t x = 0; x < 3; ++x) in = in && place[x] >= -1 && place[x] <= ct.frame.dims[x];
            beyond += in ? 0 : 1;
            const double hu = sample_linear(ct, place);
            const double where = hu + 32768, low = std::floor(where);
            const auto v = static_cast<std::size_t>(low);
            sum += law[v] + (where - low) * (law[std::min(v + 1, law.size() - 1)] - law[v]);
            sum_hu += hu;
            sum_density += weighed_density(hu, density);
          }
        }
      }
      s.young_mpa[t] = sum / samples;
      s.hu[t] = static_cast<float>(sum_hu / samples);
      grams[t] = sum_density / samples * volume[t] / 1000;
      outside[t] = volume[t] * beyond / samples;
    }
  });
  double below = 0, above = 0;
  for (std::size_t t = 0; t < count; ++t) {
    s.volume_mm3 += volume[t];
    s.mass_g += grams[t];
    s.share_outside += outside[t];
    below += s.young_mpa[t] < density.min_mpa ? volume[t] : 0;
    above += s.young_mpa[t] > density.max_mpa ? volume[t] : 0;
    s.young_mpa[t] = std::clamp(s.young_mpa[t], density.min_mpa, density.max_mpa);
  }
  if (s.volume_mm3 > 0) {
    s.share_outside /= s.volume_mm3;
    s.share_below = below / s.volume_mm3;
    s.share_above = above / s.volume_mm3;
  }
  if (s.share_outside > kMaxOutside)
    throw Error(
        ExitCode::usage,
        format_number(std::round(1000 * s.share_outside) / 10) + " % of the mesh lies outside of the CT",
        "the CT is the one that the mesh was made from, before it was cropped; 'osteo info' prints where each is");
  struct Group {
    double volume = 0, sum = 0, grams = 0;
  };
  const auto group_of = [&](double e) {
    return step > 0 ? std::round(std::log(e / density.min_mpa) / std::log1p(step)) : e;
  };
  std::map<double, Group> groups;
  for (std::size_t t = 0; t < count; ++t) {
    Group& g = groups[group_of(s.young_mpa[t])];
    g.volume += volume[t];
    g.sum += volume[t] * s.young_mpa[t];
    g.grams += grams[t];
  }
  s.materials = groups.size();
  s.density_kg_m3.resize(count);
  for (std::size_t t = 0; t < count; ++t) {
    const Group& g = groups[group_of(s.young_mpa[t])];
    if (!(g.volume > 0)) continue;
    s.density_kg_m3[t] = std::max(kMinDensity, 1e6 * g.grams / g.volume);
    if (step > 0) s.young_mpa[t] = g.sum / g.volume;
  }
  return s;
}

}  // namespace osteo::inline simulation
