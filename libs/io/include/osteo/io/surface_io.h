// Surfaces and pictures in files.
#pragma once
#include <filesystem>

#include "osteo/data/data.h"

namespace osteo {

/// .ply .stl .obj .vtp; points in LPS mm. Errors: no_input, cannot_read, corrupt.
[[nodiscard]] Surface load_surface(const std::filesystem::path& path);
/// .ply and .stl binary, .vtp compressed, .obj text; LPS mm is written into the header where the format has room.
void save_surface(const TriMesh& mesh, const std::filesystem::path& path);
[[nodiscard]] bool is_surface_file(const std::filesystem::path& path);

/// .png
void save_picture(const Picture& picture, const std::filesystem::path& path);
[[nodiscard]] Picture load_picture(const std::filesystem::path& path);

}  // namespace osteo
