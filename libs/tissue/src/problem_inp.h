// A tissue problem from an Abaqus or CalculiX input file.
#pragma once
#include <string_view>

#include "osteo/tissue/problem.h"

namespace osteo::tissue {

TissueProblem problem_of_inp(std::string_view text, const TetMesh& mesh, bool needs_loads, Weight weight);

}  // namespace osteo::tissue
