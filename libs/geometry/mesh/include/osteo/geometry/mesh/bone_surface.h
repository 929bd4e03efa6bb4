// The triangle surface of a density grid, in two methods, with the maps that tie voxels to vertices to triangles.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "osteo/core/base/context.h"
#include "osteo/core/base/param.h"
#include "osteo/core/data/tri_mesh.h"
#include "osteo/geometry/grid/brick_grid.h"

namespace osteo::inline geometry {

/// Rows of indices: row r is items[first[r] .. first[r+1]).
struct IndexRows {
  std::vector<std::uint32_t> first;
  std::vector<std::uint32_t> items;
  [[nodiscard]] std::span<const std::uint32_t> row(std::size_t r) const {
    return {items.data() + first[r], first[r + 1] - first[r]};
  }
  [[nodiscard]] std::size_t rows() const { return first.empty() ? 0 : first.size() - 1; }
};

struct BoneSurface {
  TriMesh mesh;
  std::vector<VoxelKey> voxels;   ///< the voxels on the surface, ascending
  IndexRows vertices_of_voxel;    ///< one row a surface voxel
  IndexRows triangles_of_vertex;  ///< one row a mesh point
};

/// Surface nets: a closed, oriented 2-manifold whatever the voxels are (open where the bone meets nothing: the outside
/// of the grid counts as empty, so it closes there too). One vertex for each sheet of surface in a cell, at the mean of
/// the points where the sheet crosses the cell's edges. Follows S. Gibson, Constrained Elastic Surface Nets (1998),
/// with the sheets of G. Nielson, Dual Marching Cubes (2004) and the treatment of shared ambiguous faces after R.
/// Wenger, Isosurfaces (2013), section 5. Bone is value >= iso; bone voxels that meet only across an edge or corner are
/// separate. No two points are equal, nor does a triangle lose its area, in single precision: what joins equal points,
/// as readers of STL do, finds the same manifold.
[[nodiscard]] BoneSurface surface_nets(const BrickGrid& bone, float iso = 0.5F, const Context& context = {});

/// A surface that encloses as much as the grid holds. The one at half density falls short of it, by what is cut off
/// edges, is thinner than a voxel or is nowhere half full: 0.03 to 0.5 % of a large piece, most of a crumb of a few
/// voxels.
struct VolumeSurface {
  TriMesh mesh;
  double bone_mm3 = 0;     ///< the grid's: density times volume
  double surface_mm3 = 0;  ///< the mesh's
  float iso = 0.5F;        ///< the density at which it lies
  double scale = 1;        ///< its size was made this much larger, about its middle, where no density gives the volume
  double moved_mm = 0;     ///< outwards, on average, from where it would be at half density
};
/// Surface nets at the density between 0.05 and 0.95 that gives the volume to 0.1 %; where none does, scaled, unless a
/// point would move by more than half a voxel. Closed and manifold, since it is a surface of the same bone and a scaled
/// one. Cost: 1 to 15 times surface_nets, mostly 3.
[[nodiscard]] VolumeSurface surface_of_volume(const BrickGrid& bone, const Context& context = {});

/// The thesis' surface: each vertex is a voxel on the surface (bone with an empty neighbour among 26); triangles join
/// voxels that are neighbours of each other, each once, without those hidden below others. D. Morris 2006,
/// section 3.2.2. Not closed: sheets one voxel thin have their two sides on the same vertices.
[[nodiscard]] BoneSurface voxel_surface(const BrickGrid& bone, float iso = 0.5F, const Context& context = {});

// --- surface nets brick by brick, for a surface that follows edits -----------------------------------------------

/// The part of the surface that belongs to the bone voxels of one brick. A pure function of the voxels up to 2 beyond
/// the brick, so that a local update equals a rebuild.
struct SurfacePatch {
  struct Vertex {
    std::array<float, 3> index;   ///< position in index coordinates of the grid
    std::array<float, 3> normal;  ///< unit, out of the bone, index axes
    std::uint64_t key;            ///< cell and sheet: equal in every patch that has this vertex
  };
  std::vector<Vertex> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<std::uint16_t> voxel_of_triangle;  ///< place in the brick of the bone voxel that the triangle closes
  [[nodiscard]] std::size_t memory_bytes() const {
    return vertices.capacity() * sizeof(Vertex) + triangles.capacity() * sizeof(triangles[0]) +
           voxel_of_triangle.capacity() * 2;
  }
};
[[nodiscard]] SurfacePatch extract_patch(const BrickGrid& bone, std::uint32_t brick, float iso = 0.5F);
/// The same, reusing the memory of `patch`.
void extract_patch(const BrickGrid& bone, std::uint32_t brick, float iso, SurfacePatch& patch);

/// Patches in brick order, joined at equal vertices, in LPS mm.
[[nodiscard]] BoneSurface join_patches(const BrickGrid& bone, std::span<const SurfacePatch> patches);

}  // namespace osteo::inline geometry
