// Critical structures as one sees them: smooth, each in its colour, shown, clear or hidden.
#pragma once
#include <vtkSmartPointer.h>

#include <array>
#include <cstdint>
#include <memory>
#include <string_view>
#include <vector>

#include "osteo/core/base/param.h"
#include "osteo/core/data/tri_mesh.h"
#include "osteo/simulation/bone/structure_map.h"

class vtkActor;
class vtkRenderer;

namespace osteo::inline display {

enum class StructureLook : int { solid, clear, hidden };
[[nodiscard]] constexpr std::array<std::string_view, 3> enum_names(StructureLook) {
  return {"solid", "clear", "hidden"};
}

/// The face of a structure without the steps of its voxels, with normals: a windowed sinc (G. Taubin, T. Zhang, G.
/// Golub, Optimal surface smoothing as filter design, 1996; VTK's filter) in rounds, after each of which what the
/// surface lost is given back evenly, so that tubes two voxels thick stay as thick as they were. No point moves farther
/// than `most_mm`; parts of fewer than 60 points, two voxels or so, stay as they are. Distances are measured from the
/// face itself. Errors: docs/validation/accuracy.md.
[[nodiscard]] TriMesh smooth_surface(const TriMesh& face, double most_mm);

class StructuresView {
 public:
  /// Smooths every structure of the map, half a label voxel at most, in parallel. All are solid at first. The renderer
  /// must outlive this.
  StructuresView(vtkRenderer* renderer, const StructureMap& map);
  ~StructuresView();
  StructuresView(const StructuresView&) = delete;
  StructuresView& operator=(const StructuresView&) = delete;

  struct One {
    std::uint8_t value = 0;
    std::shared_ptr<const TriMesh> surface;
    StructureLook look = StructureLook::solid;
    vtkSmartPointer<vtkActor> actor;
    bool fades = false;     ///< it reaches the border of the bone's grid
    bool proposed = false;  ///< a network drew it that knows how far off it may be, and no hand has changed it
  };
  /// In the order of the map's values().
  [[nodiscard]] const std::vector<One>& all() const { return all_; }
  /// A clear one is screen-door: every other pixel of it is left out, in one of four patterns by its number, so nothing
  /// has to be sorted, peeled or drawn twice. `number` in all().
  void show(std::size_t number, StructureLook look);
  /// A structure that reaches the border of `bone` goes on beyond it in the patient: its last kFadeMm, but no more than
  /// a sixth of the bone's width, are left out dot by dot up to its end. What ends elsewhere, as at the border of
  /// labels that were cropped, stays whole, and so does what is labelled beyond the bone.
  static constexpr double kFadeMm = 4;
  void fade_at_border(const Frame& bone);
  /// Of structures that are still as proposed, hatches what lies at voxels of that value or a larger one, as where a
  /// network is not sure of a boundary: bars of 0.8 mm in a paler colour, which are of the surface and turn with it.
  /// Values may lie in another grid than the map's.
  void hatch(const Labels& values, std::uint8_t from);

 private:
  vtkRenderer* renderer_;
  std::vector<One> all_;
};

}  // namespace osteo::inline display
