#include "bone_stiffness.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>

#include "osteo/core/base/error.h"
#include "osteo/core/base/json_document.h"
#include "osteo/core/base/param.h"
#include "tissue_parts.h"

namespace osteo::inline app {

using namespace tissue;

namespace {

// Of a quantity of the tetrahedra, by volume: at shares from 0 to 1.
std::vector<double> quantiles(const std::vector<double>& values, const std::vector<double>& volume,
                              const std::vector<double>& shares) {
  std::vector<std::size_t> order(values.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return values[a] < values[b]; });
  const double all = std::accumulate(volume.begin(), volume.end(), 0.0);
  std::vector<double> found;
  double so_far = 0;
  std::size_t n = 0;
  for (const double share : shares) {
    while (n + 1 < order.size() && so_far + volume[order[n]] < share * all) so_far += volume[order[n++]];
    found.push_back(values[order[n]]);
  }
  return found;
}

// What is connected by its points, as far as the load holds it: a part that can move freely has no solution. Crumbs
// of the meshing are left out, larger ones are for a person to decide.
struct Held {
  TetMesh mesh;
  std::size_t loose_parts = 0;
  double loose_mm3 = 0;
};
constexpr double kCrumb = 0.01;  // of the body's volume

Held held_parts(const TetMesh& mesh, const std::vector<double>& volume, const TissueLoad& load) {
  std::vector<std::uint32_t> root(mesh.points_mm.size());
  std::iota(root.begin(), root.end(), 0U);
  const auto find = [&](std::uint32_t p) {
    while (root[p] != p) p = root[p] = root[root[p]];
    return p;
  };
  for (const auto& t : mesh.tets) {
    for (std::size_t c = 1; c < 4; ++c) root[find(t[c])] = find(t[0]);
  }
  std::vector<int> axes(root.size());  // held, of each part
  std::vector<double> size(root.size());
  for (const std::uint32_t p : load.fixed) axes[find(p)] += 3;
  for (const Slider& s : load.sliders) axes[find(s.point)] += std::popcount(s.held);
  for (const TissueLoad::Moved& m : load.moved) axes[find(m.point)] += std::popcount(m.held);
  double all = 0;
  for (std::size_t t = 0; t < mesh.tets.size(); ++t) {
    size[find(mesh.tets[t][0])] += volume[t];
    all += volume[t];
  }
  Held held;
  std::vector<std::uint32_t> number(root.size(), ~0U);
  for (std::uint32_t p = 0; p < root.size(); ++p) {
    if (find(p) != p || size[p] == 0 || axes[p] >= 6) continue;
    if (size[p] > kCrumb * all)
      throw Error(ExitCode::usage,
                  "nothing holds a part of the bone of " + format_number(std::round(size[p])) + " mm3 at " +
                      format_number(mesh.points_mm[p][0]) + ", " + format_number(mesh.points_mm[p][1]) + ", " +
                      format_number(mesh.points_mm[p][2]) + " mm, of " + format_number(std::round(all)) + " mm3 in all",
                  "let a place of \"fixed\" reach it, or leave it out of the mesh (threshold --keep-largest); "
                  "--keep-floating writes it as it is");
    ++held.loose_parts;
    held.loose_mm3 += size[p];
  }
  for (const auto& t : mesh.tets) {
    if (axes[find(t[0])] < 6) continue;
    std::array<std::uint32_t, 4> own;
    for (std::size_t c = 0; c < 4; ++c) {
      if (number[t[c]] == ~0U) {
        number[t[c]] = static_cast<std::uint32_t>(held.mesh.points_mm.size());
        held.mesh.points_mm.push_back(mesh.points_mm[t[c]]);
      }
      own[c] = number[t[c]];
    }
    held.mesh.tets.push_back(own);
  }
  return held;
}

std::vector<double> volumes_mm3(const TetMesh& mesh) {
  std::vector<double> volume(mesh.tets.size());
  for (std::size_t t = 0; t < volume.size(); ++t) {
    std::array<Vec3, 4> c;
    for (std::size_t k = 0; k < 4; ++k) c[k] = from_floats(mesh.points_mm[mesh.tets[t][k]]);
    volume[t] = std::abs(dot(cross(c[1] - c[0], c[2] - c[0]), c[3] - c[0])) / 6;
  }
  return volume;
}

// Of each tetrahedron: by the CT, but in the problem's regions their own.
struct Graded {
  std::vector<Material> materials;
  std::size_t of_regions = 0, weightless = 0;  // weightless: of those, without a density
};

Graded graded_materials(const TissueProblem& problem, const BoneStiffness& bone, std::size_t tets) {
  Graded g;
  g.materials.resize(tets);
  for (std::size_t t = 0; t < tets; ++t) {
    const Material& own = problem.materials[problem.materials.size() == 1 ? 0 : t];
    const bool region = !problem.in_region.empty() && problem.in_region[t] != 0;
    g.of_regions += region ? 1 : 0;
    g.materials[t] = region ? own : Material{bone.young_mpa[t], own.poisson, bone.density_kg_m3[t]};
    g.weightless += region && own.density_kg_m3 == 0 ? 1 : 0;
  }
  return g;
}

// Sums over the volume.
struct Sums {
  double young = 0, hu = 0;  // times mm3
  double kg = 0;
  Json young_by_volume;
};

Sums sums_of(const std::vector<double>& volume, const std::vector<Material>& materials, const BoneStiffness& bone) {
  Sums s;
  std::vector<double> young(volume.size());
  for (std::size_t t = 0; t < volume.size(); ++t) {
    s.young += volume[t] * materials[t].young_mpa;
    young[t] = materials[t].young_mpa;
    s.hu += volume[t] * static_cast<double>(bone.hu[t]);
    s.kg += volume[t] * materials[t].density_kg_m3 * 1e-9;
  }
  const std::vector<double> shares{0, 0.05, 0.25, 0.5, 0.75, 0.95, 1}, q = quantiles(young, volume, shares);
  for (std::size_t i = 0; i < shares.size(); ++i)
    s.young_by_volume.push_back({{"share", shares[i]}, {"young_mpa", q[i]}});
  return s;
}

// Young's modulus at each point: the mean of its tetrahedra by volume.
TetMesh map_of(const TetMesh& mesh, const std::vector<double>& volume, const std::vector<Material>& materials) {
  std::vector<double> at_point(mesh.points_mm.size()), shared(mesh.points_mm.size());
  for (std::size_t t = 0; t < volume.size(); ++t) {
    for (const std::uint32_t v : mesh.tets[t]) {
      at_point[v] += volume[t] * materials[t].young_mpa;
      shared[v] += volume[t];
    }
  }
  TetMesh map = mesh;
  map.values_name = "young_mpa";
  map.values.resize(at_point.size());
  for (std::size_t v = 0; v < at_point.size(); ++v)
    map.values[v] = shared[v] > 0 ? static_cast<float>(at_point[v] / shared[v]) : 0.0F;
  return map;
}

void warn_of_extrapolation(const BoneDensity& density, const BoneStiffness& bone, const Context& context) {
  const BoneDensity guess;
  if (density.per_1000_hu == guess.per_1000_hu && density.at_0_hu == guess.at_0_hu)
    context.warn("density by a guess of " + format_number(guess.per_1000_hu) +
                 " g/cm3 at 1000 HU, which may be 15 % off (stiffness 20 to 40 %): give --density-per-1000-hu and "
                 "--density-at-0-hu of the scanner's calibration phantom");
  const auto limited = [&](double share, const char* than, double limit) {
    if (share > 0.01)
      context.warn(format_number(std::round(1000 * share) / 10) + " % of the volume came out " + than + ' ' +
                   format_number(limit) + " MPa and was set to it");
  };
  limited(bone.share_below, "softer than", density.min_mpa);
  limited(bone.share_above, "stiffer than", density.max_mpa);
  if (bone.share_outside > 0)
    context.warn(format_number(std::round(1e5 * bone.share_outside) / 1e3) +
                 " % of the volume lies outside of the CT: the values at its border were taken there");
}

}  // namespace

StageInfo BoneStiffnessStage::info() {
  return {
      .name = "bone-stiffness",
      .version = 2,
      .synopsis = "bone as stiff as its CT says: a finite element problem with graded material",
      .description =
          "Each tetrahedron gets the mean, over its volume, of Young's modulus by the density of the CT's voxels. The "
          "problem says what "
          "is fixed and loaded, and Poisson's ratio; the young_kpa of its material is not used, while its regions (a "
          "screw, a plate) "
          "keep their own stiffness. The file can be solved by CalculiX or Abaqus, and by 'osteo fem', given as mesh "
          "and as problem. "
          "What nothing holds has no solution: crumbs of the mesh below 1 % of the volume are left out, with a "
          "warning. "
          "The laws were "
          "measured on long bones, none on a skull, and the CT's blur makes thin cortex too soft. Density is "
          "written too (--weight), so that a load's gravity weighs by the CT; regions weigh by their density_kg_m3.",
      .inputs = {{"mesh", {DataKind::tets}, "bone, as tetrahedralize makes it"},
                 {"ct", {DataKind::image}, "the CT that it was made from, in HU"},
                 {"problem", {DataKind::document}, "what is fixed, loads, Poisson's ratio, in JSON"}},
      .outputs = {{"inp", {DataKind::document}, "mesh, materials and load for CalculiX or Abaqus (.inp)"},
                  {"map", {DataKind::tets}, "the mesh with young_mpa at its points, to look at", true},
                  {"report", {DataKind::document}, "moduli, mass, what was limited, in JSON", true}},
      .references = {"E. Morgan, H. Bayraktar, T. Keaveny, Journal of Biomechanics 36, 2003",
                     "T. Keller, Journal of Biomechanics 27, 1994",
                     "D. Carter, W. Hayes, Journal of Bone and Joint Surgery 59-A, 1977",
                     "J. Keyak et al., Journal of Biomechanics 31, 1998",
                     "W. Schneider, T. Bortfeld, W. Schlegel, Physics in Medicine and Biology 45, 2000",
                     "E. Schileo et al., Journal of Biomechanics 41, 2008",
                     "F. Taddei et al., Medical Engineering and Physics 29, 2007"},
      .example =
          "osteo bone-stiffness jaw.vtu ct.nrrd problem.json jaw.inp --density-per-1000-hu 0.76 --report-out jaw.json"};
}

std::vector<Data> BoneStiffnessStage::run(const Params& p, std::span<const Data> inputs, const Context& context) {
  const Tets given = std::get<Tets>(inputs[0]);
  const std::string& text = std::get<Document>(inputs[2]).json;
  TissueProblem problem = parse_tissue_problem(text, *given, true, Weight::apart);
  const std::size_t n = load_named(problem, p.load);
  Held held;
  if (!p.keep_floating) {
    held = held_parts(*given, volumes_mm3(*given), problem.loads[n]);
    if (held.loose_parts > 0) {
      context.warn(std::to_string(held.loose_parts) + " parts of " +
                   format_number(std::round(100 * held.loose_mm3) / 100) +
                   " mm3 in all, which nothing holds, were left out; --keep-floating keeps them");
      problem = parse_tissue_problem(text, held.mesh, true, Weight::apart);
    }
  }
  const TetMesh& mesh = held.loose_parts > 0 ? held.mesh : *given;
  if (!problem.law) problem.law = ElasticLaw::linear;
  if (*problem.law != ElasticLaw::linear && *problem.law != ElasticLaw::stvk)
    throw Error(ExitCode::usage, "bone is linear or stvk; the problem's law is " + std::string(name_of(*problem.law)),
                "leave \"law\" out: linear");
  const BoneStiffness bone =
      bone_stiffness(mesh, std::get<Image>(inputs[1]), p.density, p.step_percent / 100, context.sub(0, 0.7));
  const Graded graded = graded_materials(problem, bone, mesh.tets.size());
  const double pull = length(problem.loads[n].gravity_m_s2);
  if (graded.weightless > 0 && pull > 0)
    throw Error(ExitCode::usage,
                std::to_string(graded.weightless) +
                    " tetrahedra of the problem's regions have no \"density_kg_m3\", and the load has gravity",
                "give each region one; titanium has 4430");
  problem.materials = graded.materials;
  const Elements elements = elements_for(LawChoice::automatic, p.order, problem, mesh);
  const FemBody body(points_of(mesh), tets_of(mesh), graded.materials, elements.law, elements.order);
  context.progress(0.8, "writing the problem");

  const std::vector<double> volume = volumes_mm3(mesh);
  Sums sums = sums_of(volume, graded.materials, bone);
  Json j{{"law", EnumNames<StiffnessLaw>::values[static_cast<std::size_t>(p.density.law)]},
         {"density_per_1000_hu", p.density.per_1000_hu},
         {"density_at_0_hu", p.density.at_0_hu},
         {"ash_correction", p.density.ash_correction},
         {"tetrahedra", mesh.tets.size()},
         {"tetrahedra_of_regions", graded.of_regions},
         {"loose_parts_left_out", held.loose_parts},
         {"loose_mm3_left_out", held.loose_mm3},
         {"materials", bone.materials},
         {"volume_mm3", bone.volume_mm3},
         {"mass_g", 1000 * sums.kg},
         {"weight", EnumNames<BoneWeight>::values[static_cast<std::size_t>(p.density.weight)]},
         {"gravity_n", pull * sums.kg},
         {"mean_hu", sums.hu / bone.volume_mm3},
         {"mean_young_mpa", sums.young / bone.volume_mm3},
         {"young_mpa_by_volume", std::move(sums.young_by_volume)},
         {"min_mpa", p.density.min_mpa},
         {"max_mpa", p.density.max_mpa},
         {"volume_share_below_least", bone.share_below},
         {"volume_share_above_most", bone.share_above},
         {"volume_share_outside_ct", bone.share_outside},
         {"poisson", problem.general.poisson},
         {"load", problem.load_names[n]},
         {"order", name_of(elements.order)},
         {"order_because", elements.because}};
  context.report("mean_young_mpa", sums.young / bone.volume_mm3);
  context.report("materials", static_cast<std::int64_t>(bone.materials));
  context.report("mass_g", 1000 * sums.kg);
  warn_of_extrapolation(p.density, bone, context);
  Document inp{inp_text(body, body.on_all_points(problem.loads[n]))};
  context.progress(1);
  return {std::move(inp), std::make_shared<const TetMesh>(map_of(mesh, volume, graded.materials)),
          Document{written(j)}};
}

}  // namespace osteo::inline app
