// What the final product asks of its lattice, made no farther than it is asked for.
#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "osteo/assessment/evidence/detail/product.h"
#include "osteo/core/base/context.h"
#include "osteo/imaging/edit/bit_mask.h"
#include "osteo/simulation/bone/structure_map.h"

namespace osteo::inline assessment {

/// Cells [lo, hi) of a lattice.
struct CellBlock {
  std::array<int, 3> lo{}, hi{};
  [[nodiscard]] bool empty() const { return lo[0] >= hi[0] || lo[1] >= hi[1] || lo[2] >= hi[2]; }
};
/// The least block that holds both; an empty one holds nothing.
[[nodiscard]] CellBlock block_around(const CellBlock& a, const CellBlock& b);
[[nodiscard]] CellBlock common_block(const CellBlock& a, const CellBlock& b);
/// The least block that holds all cells that are set.
[[nodiscard]] CellBlock block_of(const BitMask& mask);
/// f(i, j, k) in ascending order.
template <class F>
void each_cell(const CellBlock& b, F&& f) {
  for (int k = b.lo[2]; k < b.hi[2]; ++k)
    for (int j = b.lo[1]; j < b.hi[1]; ++j)
      for (int i = b.lo[0]; i < b.hi[0]; ++i) f(i, j, k);
}

/// How far a distance may be from that at the middle of a block of `edge` cubes, which is asked for in its stead:
/// distances rise no faster than one goes, and between the points of their lattice they are off by half its diagonal at
/// most, at either end of the way. mm.
[[nodiscard]] double block_slack_mm(const StructureMap& structures, double cell_mm, int edge);

/// Inside which structure a cell of cubes lies, by the structure's value: the one it is deepest in, 0 for none.
/// `within`: of each structure in the order of values(), a block around its face. Cells are asked one by one only in
/// blocks that a face goes through: O(cells of the faces' neighbourhood), and a byte for each cell.
[[nodiscard]] std::vector<std::uint8_t> label_cells(const Frame& lattice, const StructureMap& structures,
                                                    const std::vector<CellBlock>& within, const Context& context);

/// Distances to a cavity, from centre to centre, in a part of its lattice. In it they are those that a transform of all
/// of the lattice gives; the part holds all of the cavity.
class CavityDistance {
 public:
  static constexpr double kFarMm = 1e8;  ///< outside the part

  CavityDistance() = default;
  /// `part` is made so wide that it holds the cavity. O(cells of the part).
  CavityDistance(const BitMask& cavity, const Frame& lattice, CellBlock part, const Context& context);

  [[nodiscard]] bool empty() const { return mm_.empty(); }  ///< there is no cavity
  /// At a cell of the lattice.
  [[nodiscard]] double at(int i, int j, int k) const;
  /// Linear between cells; `index`, in cells, is drawn to the lattice.
  [[nodiscard]] double linear(Vec3 index) const;

 private:
  std::array<int, 3> dims_{};  // of the lattice
  CellBlock part_;
  std::vector<float> mm_;
};

struct Product::Lattice {
  BitMask before, after, cavity;
  std::vector<std::uint8_t> label;  // structure inside which a cell lies
  CellBlock bone, opened;           // around what is left, and around the cavity
  CavityDistance to_cavity;
  struct Box {
    Vec3 lo{1e9, 1e9, 1e9}, hi{-1e9, -1e9, -1e9};
  };
  std::array<Box, 256> faces;  // around each structure's face, by value, in cells
  std::array<int, 3> dims{};
  double cell_mm = 1;

  /// All cells at most so far from a structure, and some more.
  [[nodiscard]] CellBlock near(std::uint8_t value, double mm) const;
};

}  // namespace osteo::inline assessment
