// What the stages of tissue have in common.
#pragma once
#include <span>
#include <string>

#include "osteo/core/base/json_document.h"
#include "osteo/simulation/tissue/problem.h"
#include "tissue.h"

namespace osteo::inline app::tissue {

/// Finite elements for a problem: as asked, as its own file says, or by Poisson's ratio and size.
struct Elements {
  ElasticLaw law;
  TetOrder order;
  std::string because;  ///< why this order
};
Elements elements_for(LawChoice law, OrderChoice order, const TissueProblem& problem, const TetMesh& mesh);
std::string_view name_of(ElasticLaw law);
std::string_view name_of(TetOrder order);

/// Error(usage) with the names there are; empty: the first.
std::size_t load_named(const TissueProblem& problem, const std::string& name);
Tets moved_mesh(const TetMesh& mesh, std::span<const Vec3> x);
/// {"rms_mm", "largest_mm"}
Json displacement(std::span<const Vec3> rest, std::span<const Vec3> x);
Error not_at_rest(const Equilibrium& r, const std::string& advice);
std::string written(const Json& j);

}  // namespace osteo::inline app::tissue
