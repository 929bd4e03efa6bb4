// What the finders of the ear's structures share. Private to libs/imaging/segment. The side looked for is always the
// left: a right ear comes mirrored, so +x is outward.
#pragma once
#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "field.h"
#include "osteo/imaging/segment/ear.h"

namespace osteo::inline imaging::segment {

/// Values that tell air, soft tissue and bone apart in this scan.
struct Levels {
  double soft_hu = 40, bone_hu = 1000, noise_hu = 0;
  double bone_above = 500;  ///< half way from soft tissue to bone
  double air_below = -480;  ///< half way from air to soft tissue
  double cell_below = -20;  ///< half way from air to bone
};

using Mask = std::vector<std::uint8_t>;

struct Part {
  bool found = false;
  double quality = 0;
  std::string why;
  Mask mask;
  bool by_canal = false;  ///< not looked for, since the canal was not found
};

struct Canal : Part {
  Vec3 drum_mm;   ///< its inner end
  Mask exterior;  ///< air outside of the head
  double length_mm = 0;
  double behind_mm3 = 0;  ///< air behind the drum; 0: no drum is seen
};

struct Brain {
  Mask mask;  ///< what a ball of 7 mm reaches inside the skull
  std::string why;
  bool found = false;
  double share = 1;  ///< of what it takes to be sure of the inside; less where little of it lies in the image
};

/// Distance in mm from each voxel to the nearest of the mask's.
[[nodiscard]] std::vector<float> distance_mm(const Field& f, const Mask& mask, const Context& context);

/// Of each voxel, which component (1 and up; 0: none), and their sizes in voxels.
struct Pieces {
  std::vector<std::uint32_t> of;
  std::vector<std::size_t> size;
};
[[nodiscard]] Pieces pieces_of(const Field& f, const Mask& mask, bool full_connectivity);

/// The share of 96 directions in space that meet a wall within `reach_mm`. `what`: 1 wall, 0 goes on, -1 open.
[[nodiscard]] double enclosure(const Field& f, Vec3 from_mm, double reach_mm,
                               const std::function<int(std::size_t)>& what);

/// From the seeds through what `open` lets in: the least height that must be climbed to each voxel (infinity: not
/// reached).
[[nodiscard]] std::vector<float> climbed(const Field& f, const std::vector<float>& height,
                                         const std::vector<std::size_t>& seeds,
                                         const std::function<bool(std::size_t)>& open);

/// The pass behind which the most lies: voxels lower than the pass that lead to them. Volume 0 when nothing lies behind
/// any.
struct Pass {
  double height = std::numeric_limits<double>::infinity();
  double volume_mm3 = 0;
};
[[nodiscard]] Pass greatest_pass(const Field& f, const std::vector<float>& height, const std::vector<float>& climbed,
                                 double least_drop);

/// The lowest pass behind which at least so much lies.
[[nodiscard]] Pass lowest_pass(const Field& f, const std::vector<float>& height, const std::vector<float>& climbed,
                               double least_drop, double least_mm3);

[[nodiscard]] Canal find_canal(const Field& f, const Levels& levels, const Context& context);
[[nodiscard]] Part find_air_cells(const Field& f, const Levels& levels, const Canal& canal, const Context& context);
[[nodiscard]] Brain find_brain(const Field& f, const Levels& levels, const Canal& canal, const Context& context);
[[nodiscard]] Part find_tegmen(const Field& f, const Levels& levels, const Canal& canal, const Brain& brain,
                               const Mask& air, const Context& context);
[[nodiscard]] Part find_dura(const Field& f, const Levels& levels, const Canal& canal, const Brain& brain,
                             const Mask& sinus, const Context& context);
[[nodiscard]] Part find_sinus(const Field& f, const Levels& levels, const Canal& canal, const Context& context);
[[nodiscard]] Part find_labyrinth(const Field& f, const Levels& levels, Vec3 point_mm, const Context& context);

}  // namespace osteo::inline imaging::segment
