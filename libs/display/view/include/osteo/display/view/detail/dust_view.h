// Bone dust and water as they lie.
#pragma once
#include <cstddef>
#include <memory>

#include "osteo/simulation/bone/dust.h"

class vtkRenderer;

namespace osteo::inline display {

/// Dry dust as grains of their own sizes and shades at places of their own in each cell (by the cell's coordinates, so
/// that what lies still looks still), spread so that nothing of the lattice of cells shows; water as a surface, drops
/// where it falls. Nothing is seen through dust; water is drawn over what is below it in one layer, without sorting. At
/// most kMaxGrains grains: of more, fewer larger.
class DustView {
 public:
  static constexpr std::size_t kMaxGrains = 60000;
  DustView(vtkRenderer* renderer, double cell_mm);
  ~DustView();
  DustView(const DustView&) = delete;
  DustView& operator=(const DustView&) = delete;
  /// Costs nothing where nothing has moved since the last call; else 0.1 us a grain and 0.1 ms a brick with water.
  void update(const Dust& dust);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace osteo::inline display
