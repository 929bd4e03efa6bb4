// What is asked of a piece of tissue: materials, what holds it, loads. A JSON file.
#pragma once
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "osteo/core/data/tet_mesh.h"
#include "osteo/simulation/tissue/detail/tissue_model.h"
#include "osteo/simulation/tissue/fem.h"

namespace osteo::inline simulation {

/// { "osteotome_tissue": 1, "material": {"young_kpa": 100, "poisson": 0.45},
///   "regions": [ {"box_mm": [[0,0,0],[10,10,5]], "young_kpa": 1000, "poisson": 0.3} ],
///   "fixed": [ {"box_mm": [[-1,-1,-1],[100,100,0.1]]}, {"box_mm": [[-1,-1,-1],[0.1,100,100]], "axes": "x"} ],
///   "loads": [ {"name": "pull", "forces": [ {"at_mm": [5,5,10], "radius_mm": 3, "total_n": [0,0,1]} ],
///                               "surfaces": [ {"box_mm": [[0,0,9.9],[10,10,10.1]], "kpa": 2} ]} ] }
/// docs/formats/tissue-problem.md has every key with its unit; beside these "law" and "order" may choose the elements by their
/// names, and a load may also have
///   "volumes": [{place, "total_n": [0,0,1]}], "gravity_m_s2": [0,0,-9.81] (with "density_kg_m3" in the material),
///   "moved": [{place, "by_mm": [0,0,-1], "axes": "z"}],
///   "contacts": [{"at_mm": [0,0,0], "normal": [0,0,1] (or "radius_mm"), "stiffness_n_per_mm": 10}].
/// Places are boxes ("box_mm") or balls ("at_mm", "radius_mm"), LPS. A force is the total over the points in its place,
/// shared evenly. A surface is loaded where the middle of a triangle of the body's boundary lies in its place: "kpa",
/// one number: a pressure inwards; three: force over area. Both are of the shape at rest. With "axes" points are held
/// along those only, and slide along the others. Tetrahedra whose middle lies in a region have its material, the last
/// such region's. Ranges: young_kpa 1e-6 to 1e9, poisson -0.999 to 0.49999, places within 1e6 mm, radii above 0, forces
/// within 1e6 N, pressures within 1e6 kPa. A key that is not known is an error.
///
/// Or an input file of Abaqus or CalculiX, with mm, N and MPa, whose mesh `mesh` is (load_tets): *ELASTIC or
/// *HYPERELASTIC, NEO HOOKE by *SOLID SECTION; *BOUNDARY, within a *STEP with movements too; each *STEP a load of
/// *CLOAD and *DLOAD (P1 to P4; GRAV, with *DENSITY), NLGEOM says which law. A step goes on from the one before: what it
/// names replaces what acted there, the rest stays, unless OP=NEW. Pressures that would follow large displacements are
/// an error.
struct TissueProblem {
  Material general;                     ///< of what no region has
  std::vector<Material> materials;      ///< one a tetrahedron, or one for all
  std::vector<std::uint8_t> in_region;  ///< one a tetrahedron: whether a region of JSON has it; or empty: there is none
  std::vector<std::uint32_t> fixed;     ///< points
  std::vector<Slider> sliders;
  std::vector<std::string> load_names;
  std::vector<TissueLoad> loads;  ///< each with `fixed` and `sliders`, and what it holds or moves besides
  std::optional<ElasticLaw> law;  ///< what an .inp says, and JSON may
  std::optional<TetOrder> order;  ///< so too
};
/// Where a load's weight under gravity is: among its forces, by the problem's densities; or apart, as
/// TissueLoad::gravity_m_s2, for whoever knows the densities better.
enum class Weight { among_forces, apart };
/// Errors: usage with the line and the place in the text; for places that no point lies in; for a load on fixed points
/// alone; for gravity where there is no density (not if it is kept apart), or gravity of an .inp that is to be kept
/// apart. Without `needs_loads` there may be none.
[[nodiscard]] TissueProblem parse_tissue_problem(std::string_view text, const TetMesh& mesh, bool needs_loads = true,
                                                 Weight weight = Weight::among_forces);
/// A problem as an input file of CalculiX or Abaqus; `load` as FemBody::on_all_points() makes it. linear and stvk:
/// *ELASTIC, without and with NLGEOM; neo_hooke_split: *HYPERELASTIC. Densities that are known are written (*DENSITY),
/// gravity that is apart as GRAV; else weight is among the forces (*CLOAD). Displacements are printed to the .dat file.
/// Contact with planes (one triangle) and balls (5120, off by 0.1 % of the radius) is a *CONTACT PAIR, surface to
/// surface, against tetrahedra that are held; its pressure grows with depth by stiffness_n_per_mm times points over
/// area of what looks at it. There faces are pushed, here points of t4: the same for a plane but for the depth left,
/// and for a ball as far as the mesh resolves what it touches. Not read back. Error(usage) for neo_hooke, corotated and
/// t4_mean, which are not known there, for rigid things of another shape, and for gravity on what has no density.
[[nodiscard]] std::string inp_text(const FemBody& body, const TissueLoad& load);
/// The fast model of a problem on a mesh of voxels: in closed form, or with constants as calibrate writes them. Errors:
/// usage. Constants that were learnt without the regions ("base") stand on one material.
[[nodiscard]] TissueModel model_of_problem(const TetMesh& mesh, const TissueProblem& problem,
                                           const std::optional<std::string>& constants_json = std::nullopt);

}  // namespace osteo::inline simulation
