// A surface that follows a tetrahedral mesh.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "osteo/core/base/context.h"
#include "osteo/core/base/param.h"
#include "osteo/core/data/tet_mesh.h"

namespace osteo::inline geometry {

enum class SkinMethod : int { embedded, frames };
[[nodiscard]] constexpr std::array<std::string_view, 2> enum_names(SkinMethod) {
  return {"embedded", "frames"};
}

struct SkinOptions {
  SkinMethod method = SkinMethod::embedded;
  int neighbours = 5;  ///< frames: 1 to 16 nearest points of the mesh's surface
};

/// Binds the points of a surface to a mesh at rest, then moves them with it.
/// embedded: each point keeps its barycentric coordinates in its tetrahedron (outside the mesh: in the nearest one).
/// Exact for affine motion, stretch and shear included. frames: D. Morris 2006, section 5.4.2, with its errata mended:
/// each point keeps its offsets in orthonormal frames on the n nearest points of the mesh's surface, weighted by
/// inverse squared distance so that the weights of one point sum to 1; each vote is v_s' plus the turned offset. Exact
/// at rest and for rigid motion; frames cannot carry stretch.
class Skin {
 public:
  Skin(const TriMesh& surface, const TetMesh& rest, const SkinOptions& options = {}, const Context& context = {});
  /// New positions of the surface's points. `points_mm`: the mesh's points, moved, as many as at rest. O(points of the
  /// surface).
  void apply(std::span<const std::array<float, 3>> points_mm, std::span<std::array<float, 3>> out_mm) const;
  [[nodiscard]] std::size_t point_count() const { return count_; }
  [[nodiscard]] std::size_t mesh_point_count() const { return mesh_points_; }
  /// embedded: the corners of the tetrahedron that a point follows.
  [[nodiscard]] const std::array<std::uint32_t, 4>& corners(std::size_t point) const { return embeddings_[point].v; }
  /// embedded: the share of each corner.
  [[nodiscard]] const std::array<float, 4>& weights(std::size_t point) const { return embeddings_[point].w; }
  /// Points that lie outside the mesh at rest.
  [[nodiscard]] std::size_t outside() const { return outside_; }

 private:
  struct Embedding {
    std::array<std::uint32_t, 4> v;
    std::array<float, 4> w;
  };
  struct FrameOf {
    std::uint32_t point, edge_to;  // mesh points
    std::uint32_t first, count;    // its triangles in fan_
  };
  struct Vote {
    std::uint32_t frame;
    float weight;
    std::array<float, 3> offset;
  };
  void embed(const TriMesh& surface, const TetMesh& rest, const Context& context);
  void frame(const TriMesh& surface, const TetMesh& rest, int neighbours);
  [[nodiscard]] std::array<Vec3, 3> axes(const FrameOf& f, std::span<const std::array<float, 3>> points) const;

  std::size_t count_ = 0, mesh_points_ = 0, outside_ = 0;
  std::vector<Embedding> embeddings_;
  std::vector<FrameOf> frames_;
  std::vector<std::array<std::uint32_t, 3>> fan_;
  std::vector<Vote> votes_;
  int neighbours_ = 0;
};

}  // namespace osteo::inline geometry
