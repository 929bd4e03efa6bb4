// Points in text files.
#pragma once
#include <filesystem>
#include <vector>

#include "osteo/core/data/vec.h"

namespace osteo {

/// One point a line: x, y, z in LPS mm, with commas, semicolons, blanks or tabs between; what follows is ignored, as
/// are a first line that holds no numbers, empty lines and those that begin with '#'. A .fcsv is 3D Slicer's: an
/// identifier, then x, y, z, in LPS or RAS as the file says; .json (.mrk.json) is what Slicer saves since version 5: one
/// list of points, a line or a curve, in mm. Errors: no_input, cannot_read, corrupt with file and line.
[[nodiscard]] std::vector<Vec3> load_points(const std::filesystem::path& path);

}  // namespace osteo
