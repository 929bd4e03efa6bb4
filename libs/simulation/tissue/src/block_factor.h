// A sparse symmetric matrix of 3 x 3 blocks, factorised once and solved with often.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

namespace osteo::inline simulation::tissue {

/// L of the Cholesky factorisation in floats: a back-solve reads it twice and does little else, so its bytes are what
/// it costs. Same calls, same bits on one machine. Not thread-safe: solve() has room of its own.
class BlockFactor {
 public:
  struct Block {
    std::uint32_t row, column;  ///< of points, row >= column
    double value[9];            ///< rows of the block
  };
  /// Blocks of the same place are added up; every point needs one on the diagonal. Error(failed) where the matrix is
  /// not positive definite.
  BlockFactor(std::size_t points, std::vector<Block> blocks);

  /// Solves in place: 4 floats a point, of which the last is 0 afterwards. 2 multiplications for each of values()
  /// numbers.
  void solve(std::span<float> x);
  [[nodiscard]] std::size_t values() const { return rows_.size() * 9 + diagonal_.size(); }
  [[nodiscard]] std::size_t memory_bytes() const { return rows_.size() * 40 + order_.size() * 44; }

 private:
  std::vector<std::uint32_t> order_;  // of each place in the factor: the point
  std::vector<std::size_t> first_;    // of each column, in rows_
  std::vector<std::uint32_t> rows_;
  std::vector<float> columns_;  // below the diagonal: 3 columns of 3 numbers a block; one number more at the end, to be
                                // read and passed over
  std::vector<float> diagonal_;  // 6 a point: 1 / l00, l10, 1 / l11, l20, l21, 1 / l22
  std::vector<float> room_;
};

}  // namespace osteo::inline simulation::tissue
