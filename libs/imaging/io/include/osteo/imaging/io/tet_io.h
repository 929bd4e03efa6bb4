// Tetrahedral meshes in files.
#pragma once
#include <filesystem>

#include "osteo/core/data/tet_mesh.h"
#include "osteo/core/data/volume.h"

namespace osteo::inline imaging {

/// True for .vtu .node .ele .inp (any case).
[[nodiscard]] bool is_tet_file(const std::filesystem::path& path);

/// .vtu: cells of other kinds are an error; the active scalars of its points become `values`. TetGen's .node or .ele:
/// the other is looked for beside it; numbered from 0 or 1; attributes and markers are ignored. .inp: C3D4 and C3D10
/// (their corners), see inp_io.h. Tetrahedra with negative volume are turned round. Errors: no_input, cannot_read,
/// corrupt with file and line.
[[nodiscard]] Tets load_tets(const std::filesystem::path& path);
/// .vtu, binary and compressed, with values. .node or .ele: both are written, numbered from 0, coordinates so that they
/// read back equal.
void save_tets(const TetMesh& mesh, const std::filesystem::path& path);

// -- Volumes of real numbers, such as distance maps, for other programs.

/// In single precision, as .nrrd or .vti, written atomically. Errors: usage for another suffix, cannot_write.
void save_values(const Volume<float>& values, const std::filesystem::path& path);

}  // namespace osteo::inline imaging
