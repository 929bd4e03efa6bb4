// A voxel as five tetrahedra, in the two ways that alternate. Plain numbers: also included where nothing else may be.
#pragma once

namespace osteo::inline simulation::tissue {

/// Corners by bits: 0 x, 1 y, 2 z. All of positive volume; the first is the regular one.
constexpr int kVoxelSplit[2][5][4] = {{{0, 3, 6, 5}, {1, 0, 5, 3}, {2, 3, 6, 0}, {4, 5, 0, 6}, {7, 6, 3, 5}},
                                      {{1, 2, 4, 7}, {0, 1, 2, 4}, {3, 2, 1, 7}, {5, 4, 7, 1}, {6, 7, 4, 2}}};

}  // namespace osteo::inline simulation::tissue
