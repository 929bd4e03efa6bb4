// Bone dust as it lies.
#pragma once
#include <memory>

#include "osteo/bone/dust.h"

class vtkRenderer;

namespace osteo {

/// A soft disc for each cell that holds dust, its area in proportion to how full the cell is.
class DustView {
 public:
  DustView(vtkRenderer* renderer, double cell_mm);
  ~DustView();
  void update(const Dust& dust);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace osteo
