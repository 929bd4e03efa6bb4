// Fields that a god-object can follow: a grid sampled with cubics, and triangles.
#pragma once
#include <functional>
#include <span>
#include <vector>

#include "osteo/core/base/context.h"
#include "osteo/core/data/frame.h"
#include "osteo/core/data/sparse_grid.h"
#include "osteo/geometry/distance/triangle_tree.h"
#include "osteo/simulation/haptics/god_object.h"

namespace osteo::inline simulation {

/// How a CubicField joins its values. Both go through them.
enum class FieldCurve : int {
  catmull_rom,  ///< from the nearest 4^3 alone: once differentiable, slopes right to O(h^2); a kink is felt two voxels
                ///< far
  spline  ///< the cubic spline (M. Unser, IEEE Signal Process Mag 16(6), 1999): twice differentiable, slopes right to
          ///< O(h^3); a kink rings on, by 0.27 a voxel
};

/// Clearance from values at the points of a dense grid (a distance map, or any smooth function that is 0 at the surface
/// and rises outwards with a slope near 1), by tricubic interpolation. 4 bytes a voxel. About 40 ns a call. Outside the
/// grid everything is free.
class CubicField {
 public:
  /// `values` x fastest, one for each voxel of the frame; at least 4 along each axis. Voxels must be cubes.
  /// Error(usage) otherwise.
  CubicField(const Frame& frame, std::vector<float> values, FieldCurve curve = FieldCurve::catmull_rom);
  /// A stored distance map; what the grid does not store reads as its background.
  explicit CubicField(const SparseGrid& distance_mm);
  /// The proxy as a ball: what is nearer than its radius is inside.
  void set_radius_mm(double radius) { radius_mm_ = radius; }

  [[nodiscard]] Clearance operator()(Vec3 world_mm) const;
  [[nodiscard]] const Frame& frame() const { return frame_; }
  [[nodiscard]] std::size_t memory_bytes() const { return values_.size() * sizeof(float); }

 private:
  void prepare();
  Frame frame_;
  Mat3 to_index_;
  std::vector<float> values_;  // of the spline: its coefficients
  FieldCurve curve_ = FieldCurve::catmull_rom;
  double radius_mm_ = 0;
};

/// Clearance from a closed triangle mesh, exact distances; the sign by angle-weighted normals of the nearest face, edge
/// or corner (J. Baerentzen, H. Aanaes, IEEE TVCG 11(3), 2005), which is right for closed surfaces without
/// self-intersections.
class MeshField {
 public:
  /// With `shading`, forces act along normals interpolated over each triangle (D. Ruspini et al., SIGGRAPH 1997)
  /// instead of its own. Errors as of TriangleTree.
  MeshField(const TriangleSoup& soup, bool shading, const Context& context = {});
  void set_radius_mm(double radius) { radius_mm_ = radius; }
  /// Remembers the last triangle, so that the next call is quick; one field for each thread.
  [[nodiscard]] Clearance operator()(Vec3 world_mm) const;
  /// Diagonal of the box around it: tolerances go by it, so that metres and micrometres work alike.
  [[nodiscard]] double size_mm() const { return size_mm_; }

 private:
  TriangleSoup soup_;
  TriangleTree tree_;
  std::vector<Vec3> face_normal_, corner_normal_;  // unit
  std::vector<std::array<Vec3, 3>> edge_normal_;   // ab, bc, ca of each triangle
  bool shading_ = false;
  double radius_mm_ = 0, size_mm_ = 0;
  mutable std::uint32_t hint_ = ClosestPoint::kNone;
};

}  // namespace osteo::inline simulation
