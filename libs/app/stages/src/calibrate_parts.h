// What calibrate does with either truth: finite elements or what was measured.
#pragma once
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "osteo/core/base/json_document.h"
#include "osteo/simulation/tissue/problem.h"
#include "tissue.h"

namespace osteo::inline app::tissue {

/// What Young's modulus each constraint's stiffness would be in closed form, in kPa.
std::vector<double> stiffness_kpa(const TissueModel& model, const TissueModel& uniform, const Material& of_uniform);
/// At each point, the geometric mean over its edges.
Tets stiffness_map(const TetMesh& mesh, const TissueModel& model, std::span<const double> kpa);

/// The edges of each of the problem's materials: all of whose tetrahedra, and theirs, are of it.
struct MaterialEdges {
  std::vector<double> young_kpa;  ///< of each material, rising
  std::vector<int> of;            ///< of each constraint, its material; -1: no edge, or of several
};
MaterialEdges material_edges(const TissueProblem& problem, const TissueModel& model);
/// What was learnt of each material: the geometric mean over its edges.
Json learnt(const MaterialEdges& edges, std::span<const double> kpa);

/// 'A,B' as numbers; empty: none.
std::vector<std::size_t> loads_named(const TissueProblem& problem, const std::string& names);

/// The outputs of calibrate. `surface`: of the body at rest, or null: the mesh's own. `fitted` empty: all that was
/// measured.
std::vector<Data> calibrate_to_measured(const CalibrateParams& p, const TetMesh& mesh, const TissueProblem& problem,
                                        TissueModel model, const std::filesystem::path& measured,
                                        const TriMesh* surface, std::vector<std::size_t> fitted,
                                        const Context& context);

}  // namespace osteo::inline app::tissue
