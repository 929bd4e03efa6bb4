// The live bone in a VTK renderer: chunks of bricks, each an actor, so that an edit uploads little.
#pragma once
#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include <vtkSmartPointer.h>

#include "osteo/bone/live_surface.h"
#include "osteo/bone/rigid_transform.h"
#include "osteo/bone/structure_map.h"

class vtkActor;
class vtkMatrix4x4;
class vtkPolyData;
class vtkRenderer;

namespace osteo {

class BoneView {
 public:
  /// With `structures`: where bone over them is thinner than kShownThroughMm, their colour shines through.
  explicit BoneView(vtkRenderer* renderer, const StructureMap* structures = nullptr) : renderer_(renderer), structures_(structures) {}
  static constexpr double kShownThroughMm = 2.5;
  ~BoneView();
  BoneView(const BoneView&) = delete;
  BoneView& operator=(const BoneView&) = delete;

  /// Shows all of a surface, in place of what was shown before.
  void show(const LiveSurface& surface);
  /// Renews the chunks that hold these bricks.
  void update(const LiveSurface& surface, std::span<const std::uint32_t> bricks);
  /// Where the bone is now.
  void place(const RigidTransform& world_from_body);
  void highlight(bool on);
  [[nodiscard]] std::size_t triangles() const;

 private:
  struct Chunk {
    std::vector<std::uint32_t> bricks;
    vtkSmartPointer<vtkPolyData> data;
    vtkSmartPointer<vtkActor> actor;
  };
  void rebuild(Chunk& chunk, const LiveSurface& surface);

  vtkRenderer* renderer_;
  const StructureMap* structures_;
  vtkSmartPointer<vtkMatrix4x4> matrix_;  // null: it has not moved
  std::vector<Chunk> chunks_;
  std::vector<std::uint32_t> chunk_of_brick_;
};

}  // namespace osteo
