// The live bone in a VTK renderer: chunks of bricks, each an actor, so that an edit uploads little.
#pragma once
#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include <vtkSmartPointer.h>

#include "osteo/bone/live_surface.h"

class vtkActor;
class vtkPolyData;
class vtkRenderer;

namespace osteo {

class BoneView {
 public:
  explicit BoneView(vtkRenderer* renderer) : renderer_(renderer) {}
  ~BoneView();
  BoneView(const BoneView&) = delete;
  BoneView& operator=(const BoneView&) = delete;

  /// Shows all of a surface, in place of what was shown before.
  void show(const LiveSurface& surface);
  /// Renews the chunks that hold these bricks.
  void update(const LiveSurface& surface, std::span<const std::uint32_t> bricks);
  [[nodiscard]] std::size_t triangles() const;

 private:
  struct Chunk {
    std::vector<std::uint32_t> bricks;
    vtkSmartPointer<vtkPolyData> data;
    vtkSmartPointer<vtkActor> actor;
  };
  void rebuild(Chunk& chunk, const LiveSurface& surface);

  vtkRenderer* renderer_;
  std::vector<Chunk> chunks_;
  std::vector<std::uint32_t> chunk_of_brick_;
};

}  // namespace osteo
