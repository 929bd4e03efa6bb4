// The live bone in a VTK renderer: chunks of bricks, each an actor, so that an edit uploads little.
#pragma once
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include <vtkSmartPointer.h>

#include "osteo/bone/live_surface.h"
#include "osteo/bone/rigid_transform.h"
#include "osteo/view/bone_paint.h"

class vtkActor;
class vtkFloatArray;
class vtkTypeInt32Array;
class vtkMatrix4x4;
class vtkPolyData;
class vtkRenderer;

namespace osteo {

class BoneView {
 public:
  /// Coloured as BonePaint says; `structures` and `hardness` may be null.
  explicit BoneView(vtkRenderer* renderer, const StructureMap* structures = nullptr, std::shared_ptr<const Hardness> hardness = nullptr)
      : renderer_(renderer), structures_(structures), hardness_(std::move(hardness)) {}
  ~BoneView();
  BoneView(const BoneView&) = delete;
  BoneView& operator=(const BoneView&) = delete;

  /// Shows all of a surface, in place of what was shown before.
  void show(const LiveSurface& surface);
  /// Renews the chunks that hold these bricks. Farther bone, which may get more light now, keeps its colours until refresh().
  void update(const LiveSurface& surface, std::span<const std::uint32_t> bricks);
  /// Colours as if shown anew. 0.3 us for each vertex within Openness::kReachMm of what was updated since.
  void refresh(const LiveSurface& surface);
  /// Where the bone is now.
  void place(const RigidTransform& world_from_body);
  void highlight(bool on);
  /// 0: dry and dull, 1: wet, darker and with highlights. Nothing is made again.
  void set_wetness(double share);

  /// A chunk's triangles as they were at some version; they stay when the chunk is made again.
  struct Arrays {
    vtkSmartPointer<vtkFloatArray> points_mm;
    vtkSmartPointer<vtkTypeInt32Array> triangles;
    std::uint64_t version = 0;
  };
  [[nodiscard]] std::size_t chunks() const { return chunks_.size(); }
  [[nodiscard]] Arrays arrays(std::size_t chunk) const { return chunks_[chunk].complete; }
  /// Grows with every change of any chunk.
  [[nodiscard]] std::uint64_t version() const { return version_; }
  /// Draws only these triangles of a chunk (three points each), if it is still of that version.
  void draw_only(std::size_t chunk, std::uint64_t version, std::span<const std::uint32_t> triangles);
  /// Fewer triangles that stand for a chunk of that version while the camera moves.
  void keep_coarse(std::size_t chunk, std::uint64_t version, std::vector<std::uint32_t> triangles);
  [[nodiscard]] bool has_coarse(std::size_t chunk) const { return chunks_[chunk].coarse_version == chunks_[chunk].complete.version; }
  /// Whole; with `coarse` those fewer triangles where they are known.
  void draw_all(bool coarse = false);
  /// Where it was placed, as VTK has it.
  [[nodiscard]] RigidTransform placed() const { return placed_; }
  [[nodiscard]] double voxel_mm() const { return voxel_mm_; }
  [[nodiscard]] std::size_t triangles() const;
  /// That go to the graphics card now.
  [[nodiscard]] std::size_t drawn_triangles() const;

 private:
  enum class Drawn { complete, coarse, visible };
  struct Chunk {
    std::vector<std::uint32_t> bricks;
    vtkSmartPointer<vtkPolyData> data;
    vtkSmartPointer<vtkActor> actor;
    Arrays complete;
    std::vector<std::uint32_t> coarse;
    std::uint64_t coarse_version = 0;
    Drawn drawn = Drawn::complete;
    std::size_t drawn_triangles = 0;
  };
  void rebuild(Chunk& chunk, const LiveSurface& surface);
  void recolour(Chunk& chunk);
  void paint(const LiveSurface& surface, std::span<const std::uint32_t> bricks);
  static void draw(Chunk& chunk, vtkTypeInt32Array* triangles, Drawn drawn);

  vtkRenderer* renderer_;
  const StructureMap* structures_;
  std::shared_ptr<const Hardness> hardness_;
  std::unique_ptr<BonePaint> paint_;
  std::vector<std::vector<Rgb>> colours_;  // of each brick's vertices
  RigidTransform placed_;
  vtkSmartPointer<vtkMatrix4x4> matrix_;  // null: it has not moved
  std::vector<Chunk> chunks_;
  std::vector<std::uint32_t> chunk_of_brick_, updated_;  // updated since the last refresh
  std::vector<bool> is_updated_;
  std::uint64_t version_ = 0;
  double voxel_mm_ = 1;
};

/// At most a quarter of a chunk's triangles, or as few as keep its surface to `error_mm` (as meshoptimizer measures it) and its border to
/// the last point, on the same points.
[[nodiscard]] std::vector<std::uint32_t> coarse_triangles(std::span<const float> points_mm, std::span<const int> triangles,
                                                          double error_mm);

}  // namespace osteo
