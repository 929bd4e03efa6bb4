// The live bone in a VTK renderer: chunks of bricks, each an actor, so that an edit uploads little.
#pragma once
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include <vtkSmartPointer.h>

#include "osteo/core/data/rigid_transform.h"
#include "osteo/display/view/detail/bone_paint.h"
#include "osteo/display/view/detail/wet_film.h"
#include "osteo/simulation/bone/live_surface.h"

class vtkActor;
class vtkFloatArray;
class vtkTypeInt32Array;
class vtkMatrix4x4;
class vtkPolyData;
class vtkRenderer;

namespace osteo::inline display {

class BoneView {
 public:
  /// Coloured as BonePaint says; `structures` and `hardness` may be null.
  explicit BoneView(vtkRenderer* renderer, const StructureMap* structures = nullptr,
                    std::shared_ptr<const Hardness> hardness = nullptr)
      : renderer_(renderer), structures_(structures), hardness_(std::move(hardness)) {}
  ~BoneView();
  BoneView(const BoneView&) = delete;
  BoneView& operator=(const BoneView&) = delete;

  /// Shows all of a surface, in place of what was shown before.
  void show(const LiveSurface& surface);
  /// Renews the chunks that hold these bricks. Farther bone, which may get more light now, keeps its colours until
  /// refresh().
  void update(const LiveSurface& surface, std::span<const std::uint32_t> bricks);
  /// Colours as if shown again. 0.3 us for each vertex within Openness::kReachMm of what was updated since, here or in
  /// bone that shades it.
  void refresh(const LiveSurface& surface);
  /// Views of bone that always moves with this one and stands in its light, as this in theirs: a finer region and what
  /// is around it. They must outlive this, or another call. refresh() of each must be called, in any order, when all
  /// have their updates.
  void shade_with(const std::vector<BoneView*>& others);
  /// Where the bone is now.
  void place(const RigidTransform& world_from_body);
  void highlight(bool on);
  /// Where there is water on it, which must outlive this (null: nowhere). Bricks that change are wet at once.
  void set_film(const WetFilm* film) { film_ = film; }
  /// Wet bone is darker and mirrors the lamp: looks again at bricks near which the film's last update changed
  /// something, or at all of them where this has been moved since. Of chunks that look otherwise, the colours are made
  /// again. 0.2 us a vertex.
  void wet(const LiveSurface& surface);

  /// Bone that drilling has warmed is seen from 42 C on, amber, from 57 C on red, in steps of a kelvin. Looks at bricks
  /// that touch one of `near` (centre, radius in mm) and at those that glowed. 0.3 us a vertex of these.
  void warm(const LiveSurface& surface, std::span<const std::pair<Vec3, double>> near,
            const std::function<double(Vec3)>& celsius_at);

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
  [[nodiscard]] bool has_coarse(std::size_t chunk) const {
    return chunks_[chunk].coarse_version == chunks_[chunk].complete.version;
  }
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
    std::vector<std::uint32_t> coarse, visible;  // visible: as last drawn
    std::uint64_t coarse_version = 0;
    Drawn drawn = Drawn::complete;
    std::size_t drawn_triangles = 0;
    bool wet = false;
  };
  void rebuild(Chunk& chunk, const LiveSurface& surface);
  void recolour(Chunk& chunk);
  void set_colours(Chunk& chunk);
  bool wet_brick(const LiveSurface& surface, std::uint32_t brick);
  bool warm_brick(const LiveSurface& surface, std::uint32_t brick, const std::function<double(Vec3)>& celsius_at);
  void paint(const LiveSurface& surface, std::span<const std::uint32_t> bricks, bool by_memo);
  static void draw(Chunk& chunk, vtkTypeInt32Array* triangles, Drawn drawn);

  vtkRenderer* renderer_;
  const StructureMap* structures_;
  std::shared_ptr<const Hardness> hardness_;
  std::unique_ptr<BonePaint> paint_;
  std::vector<std::vector<Rgb>> colours_;        // of each brick's vertices
  std::vector<std::vector<std::uint8_t>> wet_;   // 255: all wet; empty: dry
  std::vector<ShineMemo> shines_;                // of bricks that were drilled, or near
  std::vector<std::vector<std::uint8_t>> warm_;  // kelvin above where it is seen; empty: nowhere
  const WetFilm* film_ = nullptr;
  RigidTransform placed_, wetted_at_;
  vtkSmartPointer<vtkMatrix4x4> matrix_;  // null: it has not moved
  std::vector<Chunk> chunks_;
  std::vector<std::uint32_t> chunk_of_brick_, updated_;  // updated since the last refresh
  std::vector<bool> is_updated_;
  std::vector<BoneView*> others_;
  std::vector<Vec3> updated_beside_mm_;  // middles of bricks of those, since the last refresh
  bool all_updated_ = false;
  std::uint64_t version_ = 0;
  double voxel_mm_ = 1;
};

/// At most a quarter of a chunk's triangles, or as few as keep its surface to `error_mm` (as meshoptimizer measures it)
/// and its border to the last point, on the same points.
[[nodiscard]] std::vector<std::uint32_t> coarse_triangles(std::span<const float> points_mm,
                                                          std::span<const int> triangles, double error_mm);

}  // namespace osteo::inline display
