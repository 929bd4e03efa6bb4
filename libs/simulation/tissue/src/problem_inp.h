// A tissue problem from an Abaqus or CalculiX input file.
#pragma once
#include <string_view>

#include "osteo/simulation/tissue/problem.h"

namespace osteo::inline simulation::tissue {

TissueProblem problem_of_inp(std::string_view text, const TetMesh& mesh, bool needs_loads, Weight weight);

}  // namespace osteo::inline simulation::tissue
