// Surfaces as the bytes of a file: formats simple enough to write here, where every byte is seen to reach the disk.
// Private to libs/imaging/io.
#pragma once
#include <vtkPolyData.h>
#include <vtkSmartPointer.h>

#include <filesystem>
#include <string>

#include "osteo/core/data/tri_mesh.h"

namespace osteo::inline imaging::io {

inline constexpr const char* kSurfaceNote = "Osteotome; LPS; mm";

[[nodiscard]] std::string ply_text(const TriMesh& mesh);
/// Points and faces, as the file numbers them.
[[nodiscard]] vtkSmartPointer<vtkPolyData> read_obj(const std::filesystem::path& path);
[[nodiscard]] std::string obj_text(const TriMesh& mesh);
/// glTF 2.0 binary. Points stay LPS mm; the node turns and scales them to metres with Y up (x left, y head, z front).
[[nodiscard]] std::string glb_text(const TriMesh& mesh);
/// 3MF core 1.2, unit millimetre. `shown` is the name for errors.
void write_3mf(const TriMesh& mesh, const std::filesystem::path& to, const std::filesystem::path& shown);

}  // namespace osteo::inline imaging::io
