// Surfaces and pictures in files.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "osteo/core/data/data.h"

namespace osteo::inline imaging {

/// .ply .stl .obj .vtp; points in LPS mm. Errors: no_input, cannot_read, corrupt.
[[nodiscard]] Surface load_surface(const std::filesystem::path& path);
/// The points alone, of files without a triangle too, as scanners write them: each place once. Errors as of
/// load_surface().
[[nodiscard]] std::vector<Vec3> load_surface_points(const std::filesystem::path& path);
/// .ply and .stl binary, .vtp compressed, .obj text, .glb (glTF 2.0, turned to metres and Y up by its node), .3mf (for
/// printing). LPS mm is written into the header where the format has room. .glb and .3mf are written only.
void save_surface(const TriMesh& mesh, const std::filesystem::path& path);
/// The bytes of a binary STL.
[[nodiscard]] std::string stl_text(const TriMesh& mesh);
[[nodiscard]] bool is_surface_file(const std::filesystem::path& path);

/// .png
void save_picture(const Picture& picture, const std::filesystem::path& path);
[[nodiscard]] Picture load_picture(const std::filesystem::path& path);

}  // namespace osteo::inline imaging
