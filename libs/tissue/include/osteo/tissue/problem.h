// What is asked of a piece of tissue: materials, what holds it, loads. A JSON file.
#pragma once
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "osteo/data/tet_mesh.h"
#include "osteo/tissue/fem.h"
#include "osteo/tissue/tissue_model.h"

namespace osteo {

/// { "osteotome_tissue": 1, "material": {"young_kpa": 100, "poisson": 0.45},
///   "regions": [ {"box_mm": [[0,0,0],[10,10,5]], "young_kpa": 1000, "poisson": 0.3} ],
///   "fixed": [ {"box_mm": [[-1,-1,-1],[100,100,0.1]]} ],
///   "loads": [ {"name": "pull", "forces": [ {"at_mm": [5,5,10], "radius_mm": 3, "total_n": [0,0,1]} ]} ] }
/// Places are boxes ("box_mm") or balls ("at_mm", "radius_mm"), LPS. A force is the total over the points in its place, shared evenly.
/// Tetrahedra whose middle lies in a region have its material, the last such region's.
struct TissueProblem {
  std::vector<Material> materials;   ///< one a tetrahedron, or one for all
  std::vector<std::uint32_t> fixed;  ///< points
  std::vector<std::string> load_names;
  std::vector<TissueLoad> loads;  ///< each with `fixed`
};
/// Errors: usage with the place in the text; for places that no point lies in; for a load on fixed points alone.
/// Without `needs_loads` there may be none.
[[nodiscard]] TissueProblem parse_tissue_problem(std::string_view json, const TetMesh& mesh, bool needs_loads = true);
/// The fast model of a problem on a mesh of voxels: in closed form, or with constants as calibrate writes them. Errors: usage.
[[nodiscard]] TissueModel model_of_problem(const TetMesh& mesh, const TissueProblem& problem,
                                           const std::optional<std::string>& constants_json = std::nullopt);

}  // namespace osteo
