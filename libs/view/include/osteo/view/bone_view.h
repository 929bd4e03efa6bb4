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
class vtkFloatArray;
class vtkTypeInt32Array;
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
  /// A chunk's triangles as they were at some version; they stay when the chunk is made again.
  struct Arrays {
    vtkSmartPointer<vtkFloatArray> points_mm;
    vtkSmartPointer<vtkTypeInt32Array> triangles;
    std::uint64_t version = 0;
  };
  [[nodiscard]] std::size_t chunks() const { return chunks_.size(); }
  [[nodiscard]] Arrays arrays(std::size_t chunk) const { return chunks_[chunk].complete; }
  /// Draws only these triangles of a chunk (three points each), if it is still of that version.
  void draw_only(std::size_t chunk, std::uint64_t version, std::span<const std::uint32_t> triangles);
  void draw_all();
  /// Where it was placed, as VTK has it.
  [[nodiscard]] RigidTransform placed() const { return placed_; }
  [[nodiscard]] std::size_t triangles() const;

 private:
  struct Chunk {
    std::vector<std::uint32_t> bricks;
    vtkSmartPointer<vtkPolyData> data;
    vtkSmartPointer<vtkActor> actor;
    Arrays complete;
    bool partly = false;  // only what is visible is drawn
  };
  void rebuild(Chunk& chunk, const LiveSurface& surface);

  vtkRenderer* renderer_;
  const StructureMap* structures_;
  RigidTransform placed_;
  vtkSmartPointer<vtkMatrix4x4> matrix_;  // null: it has not moved
  std::vector<Chunk> chunks_;
  std::vector<std::uint32_t> chunk_of_brick_;
};

}  // namespace osteo
