// The thesis' fast model of tissue: lengths, areas and volumes that want to stay what they are.
#pragma once
#include <array>
#include <vector>

#include "osteo/core/data/tet_mesh.h"
#include "osteo/simulation/tissue/detail/energy.h"
#include "osteo/simulation/tissue/fem.h"

namespace osteo::inline simulation {

/// What kind of constraint: the classes that calibration scales apart.
enum class TissueClass : std::uint8_t { axis_edge, diagonal_edge, face, volume };
inline constexpr std::size_t kTissueClasses = 4;

/// E = sum of k/2 C^2 with C = q / q0 - 1, q the length of an edge, the area of a face, the volume of a tetrahedron or
/// of the five of a voxel; k in N mm. M. Teschner et al. 2004; D. Morris 2006, section 5.4.1, whose printed forces are
/// not the gradients of these energies: here they are, to rounding, so that forces and torques sum to zero. Where a
/// direction is undefined (an edge of no length) its force is zero. Inverted tetrahedra are pushed back by the signed
/// volume.
class TissueModel final : public Energy {
 public:
  struct Constraint {
    std::array<std::uint32_t, 8> node{};  ///< 2, 3, 4 or 8 (the corners of a voxel) of them
    std::uint8_t nodes = 2;
    TissueClass kind = TissueClass::axis_edge;
    double rest = 0;          ///< q0: mm, mm2, mm3
    double stiffness = 0;     ///< k in N mm
    std::uint32_t voxel = 0;  ///< of volumes of 8 nodes: which of the splits (0 or 1); else unused
  };

  /// Of a mesh of grid_tets(): five tetrahedra a voxel in alternating ways. In closed form, without any simulation,
  /// from a material for each voxel (or one for all): with edge h, each voxel gives mu h^3 / 4 to each of its 12 edges,
  /// 2 mu h^3 to each of its 6 diagonals and (lambda - mu) h^3 to its volume. The sum is exactly isotropic linear
  /// elasticity for small strains; Poisson's ratio at least 1/4 (below, the volume's share would be negative). One
  /// volume constraint a voxel, not one a tetrahedron, so nothing locks near a half. With `faces` area constraints are
  /// there too, of stiffness 0 until calibration gives them some. Errors: usage when the mesh is not of that kind, or
  /// for materials out of range.
  static TissueModel of_voxels(std::span<const Vec3> points_mm, std::span<const std::array<std::uint32_t, 4>> tets,
                               std::span<const Material> materials, bool faces = true);
  /// Of any mesh, with the thesis' three constants for all constraints (per unit of rest volume share where
  /// `by_volume`).
  static TissueModel uniform(std::span<const Vec3> points_mm, std::span<const std::array<std::uint32_t, 4>> tets,
                             double distance_n_mm, double area_n_mm, double volume_n_mm);

  [[nodiscard]] std::size_t point_count() const override { return rest_.size(); }
  [[nodiscard]] std::size_t element_count() const override { return constraints_.size(); }
  [[nodiscard]] std::span<const std::uint32_t> nodes(std::size_t e) const override {
    return {constraints_[e].node.data(), constraints_[e].nodes};
  }
  double element(std::size_t e, const Vec3* x, double* gradient, double* hessian) const override;
  /// A constraint's q at the places `x` of its nodes, and its gradient by each of them.
  double measure(std::size_t e, const Vec3* x, Vec3* gradient) const;

  [[nodiscard]] const std::vector<Vec3>& rest() const { return rest_; }
  [[nodiscard]] const std::vector<Constraint>& constraints() const { return constraints_; }
  void set_stiffness(std::size_t constraint, double n_mm) { constraints_[constraint].stiffness = n_mm; }
  /// What a constraint's stiffness would be with multiplier 1 for its class.
  [[nodiscard]] double base_stiffness(std::size_t constraint) const { return base_[constraint]; }
  /// All constraints of a class times a factor of the base. Faces: their base is a hundredth of what a diagonal has.
  void scale(const std::array<double, kTissueClasses>& factors);
  /// Multiplies constraint by constraint; as many factors as constraints.
  void scale_each(std::span<const double> factors);
  /// Tetrahedra turned inside out.
  [[nodiscard]] std::size_t inverted(std::span<const Vec3> x) const;
  [[nodiscard]] const std::vector<std::array<std::uint32_t, 4>>& tets() const { return tets_; }

 private:
  std::vector<Vec3> rest_;
  std::vector<std::array<std::uint32_t, 4>> tets_;
  std::vector<Constraint> constraints_;
  std::vector<double> base_;
};

}  // namespace osteo::inline simulation
