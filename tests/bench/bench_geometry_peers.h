// Peers of the distance map that have a C++ interface. Each gets the surface and the points; times include building its
// tree.
#pragma once
#include <span>
#include <vector>

#include "osteo/core/data/frame.h"
#include "osteo/geometry/mesh/curve.h"
#include "osteo/geometry/mesh/soup.h"

namespace osteo::bench {

std::vector<double> by_embree(const TriangleSoup& soup,
                              std::span<const Vec3> points);  ///< with the last triangle as a bound
std::vector<double> by_cgal(const TriangleSoup& soup,
                            std::span<const Vec3> points);  ///< AABB_tree, hint of the last point
std::vector<double> by_vtk_locator(const TriangleSoup& soup, std::span<const Vec3> points);
std::vector<double> by_vtk_implicit(const TriangleSoup& soup, std::span<const Vec3> points);  ///< signed
/// meshToVolume; the signed distance in voxels of each voxel of the frame, NaN where it has none. band < 0: the whole
/// inside.
std::vector<float> by_openvdb(const TriangleSoup& soup, const Frame& frame, double inside_voxels,
                              double outside_voxels);

/// The thesis' curve search on nanoflann: the n nearest sample points, the segments at them (both, as its text says),
/// the arc penalty added afterwards.
class NearestNeighbours {
 public:
  explicit NearestNeighbours(std::span<const Vec3> points);
  ~NearestNeighbours();
  CurvePoint find(Vec3 p, double arc, double penalty, int n) const;

 private:
  struct Impl;
  Impl* impl_;
};

}  // namespace osteo::bench
