// Label maps of other programs as the structures of a case: nerves, vessels, ossicles.
#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "osteo/core/base/context.h"
#include "osteo/core/base/param.h"
#include "osteo/core/data/volume.h"

namespace osteo::inline imaging {

struct StructuresParams {
  std::string names;
  bool only_named = false;
};

/// Between what every healthy structure of that name lies: of one side's. {0, 0}: nothing is known.
struct StructureLimits {
  std::string_view name;
  double radius_mm = 0;               ///< of the tube it is, at most; 0: it is no tube
  double volume_mm3 = 0;              ///< at most
  double least_mm3 = 0;               ///< at least
  std::array<double, 2> length_mm{};  ///< of the longest way within it
  std::array<double, 2> width_mm{};   ///< of a round tube of that volume and length
  bool one_piece = false;
};

/// What a structure's voxels are like.
struct StructureShape {
  double volume_mm3 = 0;
  double length_mm = 0;      ///< of the longest way from voxel to voxel within its largest piece
  double width_mm = 0;       ///< of a round tube of the largest piece's volume and length
  double largest_share = 0;  ///< of its voxels that are in the largest piece (26 neighbours)
  bool cut_off = false;      ///< it reaches the image's edge, and so may go on
};

/// The words of a structure's name in small letters, with one space between: "Left Facial_Nerve" is "left facial
/// nerve".
[[nodiscard]] std::string plain_name(std::string_view name);

/// Whether a name calls a structure as a whole: `term` stands in it word by word, also in the plural, and no other word
/// makes it something else ("facial nerve, labyrinthine segment", "internal ear canal", "artery of the labyrinth").
[[nodiscard]] bool is_called(std::string_view name, std::string_view term);

/// By whole words in the name, as is_called() has it. Nothing for names that are not known.
[[nodiscard]] std::optional<StructureLimits> structure_limits(std::string_view name);

/// Why a structure of this name and volume cannot be what it is called; empty when it can, or nothing is known of it.
[[nodiscard]] std::string implausible_volume(std::string_view name, double volume_mm3);

/// Of the voxels of a value whose place along the world's x lies in [from_x, to_x). O(n log n) in their number.
[[nodiscard]] StructureShape shape_of(const Labels& labels, std::uint8_t value, double from_x = -1e9,
                                      double to_x = 1e9);

/// Why a structure of this name cannot be what it is called, as `implausible_volume`: also too small, too short or
/// long, too thin or wide, or in pieces. Of a structure that the image cuts off only what is too much. One with pieces
/// whose middles lie more than 40 mm apart across, or that reaches across more than 90 mm, is taken for that of both
/// sides, and each is looked at. No voxels: empty.
[[nodiscard]] std::string implausible_shape(const Labels& labels, const Structure& structure);

/// Every value gets a name and a colour. `params.names`: "1=facial nerve, 2=sigmoid sinus" goes before what the file
/// says; what neither names is "structure 3", or with `only_named` background. Values that no voxel has are left out.
/// Reports the volume of each, and warns of one whose shape its name cannot have. With a CT: Error(failed) when no
/// labelled voxel lies inside it, a warning when less than half do, and one of each structure that is not to be trusted
/// (Structure:: doubt). Error(usage) for names that cannot be read.
[[nodiscard]] Labels name_structures(const Labels& labels, const StructuresParams& params, const Image* ct = nullptr,
                                     const Context& context = {});

}  // namespace osteo::inline imaging
