// Overlap of a round cone with one brick of bone: what each instruction set compiles, and who calls which.
#pragma once
#include <cstddef>
#include <cstdint>

#include "osteo/simulation/haptics/detail/overlap.h"

namespace osteo::inline simulation::overlap {

/// A round cone in voxels: lengths over the voxel's edge, directions along the grid's axes.
struct Shape {
  float axis[3];
  float length, start_radius;
  float slope;      // shrinking of the radius along the axis
  float slope_run;  // slope / sqrt(1 - slope^2): how far back along the axis the foot lies, for a unit off the axis
  float falloff;    // efficiency lost for a radian of latitude
  bool ball;        // length 0
};

/// Sums over voxels, in voxels; n is the outward normal of the shape, A the area of its surface inside a voxel, t the
/// foot.
struct Sums {
  double volume = 0;         // density * share covered
  double surface = 0;        // density * A
  double area[3] = {};       // density * A * n
  double area_foot[3] = {};  // density * A * t * n
};

/// Where hits go: rows whose number plus `phase` is a multiple of `stride`. `hits` has room for 512 more than
/// `capacity`; when that is reached the rest is not listed.
struct HitList {
  Hit* hits = nullptr;  // null: none wanted
  std::size_t count = 0, capacity = 0;
  std::uint32_t stride = 1, phase = 0;
};

/// A voxel that is bone only in part and covered only in part, or that a burr has covered in part.
struct Partial {
  VoxelKey voxel;
  float density, share;
  float normal[3];
  float area, foot;  // of the shape's surface inside it; where on the axis that stands
};
struct PartialList {
  Partial* items = nullptr;
  std::size_t count = 0, capacity = 0;  // beyond it the rest is not listed
  const std::uint8_t* begun = nullptr;  // a bit for each voxel: a burr has covered it in part; null: none
};

/// Adds the part of the shape in one brick. `first`: the brick's first voxel minus the start of the axis, in voxels.
using BrickFunction = void (*)(const Shape& shape, const float* values, const float* first, VoxelKey key, Sums& sums,
                               HitList& list, PartialList& partial);
void brick_base(const Shape&, const float*, const float*, VoxelKey, Sums&, HitList&, PartialList&);
void brick_avx2(const Shape&, const float*, const float*, VoxelKey, Sums&, HitList&, PartialList&);
void brick_avx512(const Shape&, const float*, const float*, VoxelKey, Sums&, HitList&, PartialList&);
/// The one for simd(); all give the same bits.
BrickFunction brick_function();

/// A voxel's grains: parts^3 cubes, x fastest, of 64 points each, one word of bits a cube.
/// Both functions leave of a set those points that ..., and tell how many those are.
struct GrainFunctions {
  /// ... the shape does not cover. `at`: the voxel's middle minus the start of the axis.
  std::uint32_t (*take)(const Shape& shape, const float* at, std::uint32_t parts, std::uint64_t* left);
  /// ... lie beyond a plane: dot(inwards, x) >= least, x from the voxel's middle.
  std::uint32_t (*plane)(const float* inwards, float least, std::uint32_t parts, std::uint64_t* left);
};
extern const GrainFunctions kGrainsBase, kGrainsAvx2, kGrainsAvx512;
/// As brick_function() chooses.
const GrainFunctions& grain_functions();

}  // namespace osteo::inline simulation::overlap
