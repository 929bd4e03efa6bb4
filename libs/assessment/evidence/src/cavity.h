// Bone on a lattice, and the cavity in it.
#pragma once
#include <cstdint>
#include <vector>

#include "osteo/core/base/context.h"
#include "osteo/imaging/edit/bit_mask.h"
#include "osteo/simulation/bone/world.h"

namespace osteo::inline assessment {

/// Which cells of a lattice (cubes) are bone, with each body where it lay at the beginning: density of at least a half,
/// linear between voxels and of all bodies together, since each place belongs to one of them: no seam where a finer
/// region or a piece meets the rest. A lattice whose points are a bone's voxels reads them. O(cells).
[[nodiscard]] BitMask solid_cells(const World& world, const Frame& lattice, const Context& context);
/// The same of a world that came of another, `before`, whose cells are known: only rows are made again in which a
/// density changed; all of them where bodies were cut. O(bricks + cells of those rows).
[[nodiscard]] BitMask solid_cells(const World& world, const Frame& lattice, const World& before, BitMask cells,
                                  const Context& context);

/// All cells at most sqrt(most2) cells from one that is set, centre to centre; `most2` in squares of a cell. Exact: the
/// same cells as a distance transform against that threshold gives, at a few words a row for each pair of directions
/// instead of a number a cell.
[[nodiscard]] BitMask grown(const BitMask& mask, int most2, const Context& context);

/// What a ball of `ball_mm` reaches from the lattice's faces by way of bone that is gone. `solid`: what it cannot pass,
/// as it is left; `gone`: bone that was; `closed`: spaces that were closed, into which no way leads but through bone
/// that is gone, and on in them no farther than `opened_mm` from it. `cell_mm`: of the cubes.
[[nodiscard]] BitMask cavity_of(const BitMask& solid, const BitMask& gone, const BitMask& closed, double cell_mm,
                                double ball_mm, double opened_mm, const Context& context);

}  // namespace osteo::inline assessment
