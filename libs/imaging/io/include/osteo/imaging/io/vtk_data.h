// Our values as VTK data sets and back. Voxels are shared, not copied; whoever lives longer keeps them alive.
#pragma once
#include <vtkSmartPointer.h>

#include <filesystem>

#include "osteo/core/base/error.h"
#include "osteo/core/data/tet_mesh.h"
#include "osteo/core/data/tri_mesh.h"
#include "osteo/core/data/volume.h"

class vtkImageData;
class vtkPolyData;
class vtkUnstructuredGrid;

namespace osteo::inline imaging {

/// Zero-copy. Origin, spacing and direction carry the frame (LPS mm).
[[nodiscard]] vtkSmartPointer<vtkImageData> to_vtk(const Image& image);
[[nodiscard]] vtkSmartPointer<vtkImageData> to_vtk(const Labels& labels);
/// Copies points and triangles.
[[nodiscard]] vtkSmartPointer<vtkPolyData> to_vtk(const TriMesh& mesh);

[[nodiscard]] vtkSmartPointer<vtkUnstructuredGrid> to_vtk(const TetMesh& mesh);

/// Zero-copy where the scalars are already of the right type, else converted as load_image / load_labels do.
/// Errors: corrupt when there are no scalars, several components, or values that do not fit.
[[nodiscard]] Image image_from_vtk(vtkImageData* data);
[[nodiscard]] Labels labels_from_vtk(vtkImageData* data);
/// Polygons of more than three points are cut into triangles; strips and lines are ignored. Error corrupt for indices
/// without a point.
[[nodiscard]] TriMesh mesh_from_vtk(vtkPolyData* data);
/// Cells must be tetrahedra (Error corrupt); those of negative volume are turned round.
[[nodiscard]] TetMesh tets_from_vtk(vtkUnstructuredGrid* data);

/// What to throw when a VTK writer failed: says "no space left" when that was it.
[[nodiscard]] Error vtk_write_error(const std::filesystem::path& path, unsigned long vtk_error_code);

/// While it lives, VTK's warnings and errors are collected instead of printed.
class QuietVtk {
 public:
  QuietVtk();
  ~QuietVtk();
  QuietVtk(const QuietVtk&) = delete;
  QuietVtk& operator=(const QuietVtk&) = delete;
  /// The first line of the first message since construction, without VTK's file and line; empty when there was none.
  [[nodiscard]] std::string first_message() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace osteo::inline imaging
