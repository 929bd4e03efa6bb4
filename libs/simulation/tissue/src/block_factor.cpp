#include "block_factor.h"

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCholesky>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "osteo/core/base/error.h"

namespace osteo::inline simulation::tissue {
namespace {

using Matrix = Eigen::SparseMatrix<double>;
// Four numbers side by side: a point's three and whatever stands behind them, which is never looked at.
using Four = float __attribute__((vector_size(16)));

Four load(const float* from) {
  Four v;
  std::memcpy(&v, from, sizeof v);
  return v;
}
void store(float* to, Four v) {
  std::memcpy(to, &v, sizeof v);
}

}  // namespace

BlockFactor::BlockFactor(std::size_t points, std::vector<Block> blocks)
    : order_(points), first_(points + 1), room_(4 * points) {
  // Ordered by points, so that the three columns of each have the same rows.
  std::vector<Eigen::Triplet<double>> pattern;
  for (const Block& b : blocks) pattern.emplace_back(static_cast<int>(b.row), static_cast<int>(b.column), 1.0);
  const auto n = static_cast<Eigen::Index>(points);
  Matrix graph(n, n);
  graph.setFromTriplets(pattern.begin(), pattern.end());
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> from_place;
  Eigen::AMDOrdering<int>()(graph.selfadjointView<Eigen::Lower>(), from_place);
  std::vector<std::uint32_t> place(points);
  for (std::size_t i = 0; i < points; ++i) {
    order_[i] = static_cast<std::uint32_t>(from_place.indices()[static_cast<Eigen::Index>(i)]);
    place[order_[i]] = static_cast<std::uint32_t>(i);
  }
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(blocks.size() * 9);
  for (const Block& b : blocks) {
    const std::uint32_t r = place[b.row], c = place[b.column];
    for (std::uint32_t i = 0; i < 3; ++i) {
      for (std::uint32_t j = 0; j < 3; ++j) {
        const std::uint32_t row = 3 * r + i, column = 3 * c + j;
        if (r == c && row < column) continue;
        // Above the diagonal of the order: its mirror image.
        entries.emplace_back(static_cast<int>(std::max(row, column)), static_cast<int>(std::min(row, column)),
                             b.value[3 * i + j]);
      }
    }
  }
  Matrix lower(3 * n, 3 * n);
  lower.setFromTriplets(entries.begin(), entries.end());
  Eigen::SimplicialLLT<Matrix, Eigen::Lower, Eigen::NaturalOrdering<int>> cholesky;
  cholesky.compute(lower);
  if (cholesky.info() != Eigen::Success)
    throw Error(ExitCode::failed, "the stiffness of the tissue at rest is not positive definite",
                "its tetrahedra may be flat, or so thin that rounding makes them so");
  const Matrix l = cholesky.matrixL();
  const int* const start = l.outerIndexPtr();
  const int* const row = l.innerIndexPtr();
  const double* const value = l.valuePtr();
  for (std::size_t c = 0; c < points; ++c) {
    const std::size_t begin = static_cast<std::size_t>(start[3 * c]), end = static_cast<std::size_t>(start[3 * c + 1]);
    const std::size_t middle = static_cast<std::size_t>(start[3 * c + 1]),
                      last = static_cast<std::size_t>(start[3 * c + 2]);
    diagonal_.insert(diagonal_.end(), {static_cast<float>(1 / value[begin]), static_cast<float>(value[begin + 1]),
                                       static_cast<float>(1 / value[middle]), static_cast<float>(value[begin + 2]),
                                       static_cast<float>(value[middle + 1]), static_cast<float>(1 / value[last])});
    first_[c] = rows_.size();
    for (std::size_t i = begin + 3, k = 0; i < end; i += 3, k += 3) {
      rows_.push_back(static_cast<std::uint32_t>(row[i]) / 3);
      for (const double* column : {value + i, value + middle + 2 + k, value + last + 1 + k}) {
        for (std::size_t a = 0; a < 3; ++a) columns_.push_back(static_cast<float>(column[a]));
      }
    }
  }
  first_[points] = rows_.size();
  columns_.push_back(0);
}

void BlockFactor::solve(std::span<float> x) {
  const std::size_t n = order_.size();
  for (std::size_t i = 0; i < n; ++i)
    std::copy_n(x.data() + 4 * static_cast<std::size_t>(order_[i]), 4, room_.data() + 4 * i);
  for (std::size_t c = 0; c < n; ++c) {
    float* const y = room_.data() + 4 * c;
    const float* const d = diagonal_.data() + 6 * c;
    y[0] *= d[0];
    y[1] = (y[1] - d[1] * y[0]) * d[2];
    y[2] = (y[2] - d[3] * y[0] - d[4] * y[1]) * d[5];
    const Four y0{y[0], y[0], y[0], y[0]}, y1{y[1], y[1], y[1], y[1]}, y2{y[2], y[2], y[2], y[2]};
    const float* l = columns_.data() + 9 * first_[c];
    for (std::size_t b = first_[c]; b < first_[c + 1]; ++b, l += 9) {
      float* const to = room_.data() + 4 * static_cast<std::size_t>(rows_[b]);
      store(to, load(to) - (load(l) * y0 + load(l + 3) * y1 + load(l + 6) * y2));
    }
  }
  for (std::size_t c = n; c-- > 0;) {
    Four s0{}, s1{}, s2{};
    const float* l = columns_.data() + 9 * first_[c];
    for (std::size_t b = first_[c]; b < first_[c + 1]; ++b, l += 9) {
      const Four from = load(room_.data() + 4 * static_cast<std::size_t>(rows_[b]));
      s0 += load(l) * from;
      s1 += load(l + 3) * from;
      s2 += load(l + 6) * from;
    }
    float* const y = room_.data() + 4 * c;
    const float* const d = diagonal_.data() + 6 * c;
    y[2] = (y[2] - (s2[0] + s2[1] + s2[2])) * d[5];
    y[1] = (y[1] - (s1[0] + s1[1] + s1[2]) - d[4] * y[2]) * d[2];
    y[0] = (y[0] - (s0[0] + s0[1] + s0[2]) - d[1] * y[1] - d[3] * y[2]) * d[0];
  }
  for (std::size_t i = 0; i < n; ++i) {
    float* const to = x.data() + 4 * static_cast<std::size_t>(order_[i]);
    std::copy_n(room_.data() + 4 * i, 3, to);
    to[3] = 0;
  }
}

}  // namespace osteo::inline simulation::tissue
