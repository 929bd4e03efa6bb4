// What elastic models have in common: a sum of energies of small groups of points.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>

#include "osteo/core/data/vec.h"

namespace osteo::inline simulation {

/// Units throughout: mm, N, MPa (N/mm2), so energies are N mm = mJ. Elements of at most kMaxNodes points each.
/// Implementations are immutable as far as threads see them.
class Energy {
 public:
  static constexpr std::size_t kMaxNodes = 16;

  virtual ~Energy() = default;
  [[nodiscard]] virtual std::size_t point_count() const = 0;
  [[nodiscard]] virtual std::size_t element_count() const = 0;
  [[nodiscard]] virtual std::span<const std::uint32_t> nodes(std::size_t element) const = 0;

  /// Energy of one element at the places `x` of its nodes; infinite where it is not defined (a material turned inside
  /// out). `gradient`: 3 numbers a node, `hessian`: rows of 3 n numbers; either may be null. Gradient and Hessian are
  /// the exact derivatives of the energy.
  virtual double element(std::size_t element, const Vec3* x, double* gradient, double* hessian) const = 0;
};

/// Sum over all elements, in their order.
[[nodiscard]] double total_energy(const Energy& energy, std::span<const Vec3> x);
/// Its gradient: minus the internal forces.
void total_gradient(const Energy& energy, std::span<const Vec3> x, std::span<Vec3> gradient);

}  // namespace osteo::inline simulation
