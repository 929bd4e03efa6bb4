// What a procedure wants removed or left, drawn around its structures.
#pragma once
#include <vtkSmartPointer.h>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "osteo/core/base/context.h"
#include "osteo/core/data/tri_mesh.h"
#include "osteo/simulation/bone/structure_map.h"

class vtkActor;
class vtkRenderer;

namespace osteo::inline display {

/// Bone at most so far from a structure's face, or inside it.
struct PlannedRegion {
  std::string name, structure;
  bool forbidden = false;  ///< to be left; else to be removed
  double within_mm = 1;
};

/// All that is at most `within_mm` (0 to the map's reach) from a structure's face, as a closed surface with normals;
/// `number` in the map's values(). Off a ball of 3 mm in labels of 0.5 mm: 0.12 mm at most up to 2.5 mm, 0.34 at 8
/// (mean 0.15). A millisecond a cubic centimetre.
[[nodiscard]] TriMesh offset_surface(const StructureMap& map, std::size_t number, double within_mm,
                                     const Context& context = {});

/// Their rims, seen through bone: green what is to go, orange what is to stay. They touch no physics.
class RegionsView {
 public:
  /// Regions of structures that the map does not name are left out: missing(). All are shown at first. The renderer
  /// must outlive this.
  RegionsView(vtkRenderer* renderer, const StructureMap& map, const std::vector<PlannedRegion>& regions,
              const Context& context = {});
  ~RegionsView();
  RegionsView(const RegionsView&) = delete;
  RegionsView& operator=(const RegionsView&) = delete;

  struct One {
    PlannedRegion region;
    std::shared_ptr<const TriMesh> surface;
    vtkSmartPointer<vtkActor> actor;
  };
  [[nodiscard]] const std::vector<One>& all() const { return all_; }
  [[nodiscard]] const std::vector<std::string>& missing() const { return missing_; }  ///< names of regions
  void show(bool on);
  [[nodiscard]] bool shown() const { return shown_; }

 private:
  vtkRenderer* renderer_;
  std::vector<One> all_;
  std::vector<std::string> missing_;
  bool shown_ = true;
};

/// Red, green, blue, 0 to 1. Distinguished by the colour-blind too.
[[nodiscard]] std::array<double, 3> region_colour(bool forbidden);

}  // namespace osteo::inline display
