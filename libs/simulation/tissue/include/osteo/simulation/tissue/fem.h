// Finite elements: what a deformable body really does, as far as its mesh allows.
#pragma once
#include <array>
#include <span>
#include <string>
#include <vector>

#include "osteo/core/data/tet_mesh.h"
#include "osteo/simulation/tissue/detail/energy.h"
#include "osteo/simulation/tissue/detail/equilibrium.h"

namespace osteo::inline simulation {

inline constexpr double kTonnesPerMm3 = 1e-12;  ///< of 1 kg/m3: the density that goes with mm, N and MPa

struct Material {
  double young_mpa = 0.1;
  double poisson = 0.45;
  double density_kg_m3 = 0;  ///< 0: not known
  [[nodiscard]] double shear_mpa() const { return young_mpa / (2 * (1 + poisson)); }
  [[nodiscard]] double bulk_mpa() const { return young_mpa / (3 * (1 - 2 * poisson)); }
  [[nodiscard]] double lambda_mpa() const { return young_mpa * poisson / ((1 + poisson) * (1 - 2 * poisson)); }
};

/// linear: small strain. stvk: Saint Venant-Kirchhoff, Green's strain in Hooke's law (what programs mean by large
/// displacement with elastic constants). neo_hooke: W = mu/2 (tr C - 3) - mu ln J + lambda/2 (ln J)^2. neo_hooke_split:
/// W = mu/2 (J^(-2/3) tr C - 3) + K/2 (J - 1)^2, shape apart from volume, as *HYPERELASTIC, NEO HOOKE has it. Both
/// infinite where J <= 0. corotated: W = mu |F - R|^2 + lambda/2 (tr(R^T F) - 3)^2, R the rotation (never a mirroring)
/// nearest to F: Hooke's law seen from where the element has turned to, finite for any F, so that what is inside out is
/// pushed back. Its Hessian is exact but where the two smaller singular values, signed, add up to less than 1e-3: there
/// R jumps, and the Hessian is that of 1e-3.
enum class ElasticLaw : int { linear, stvk, neo_hooke, neo_hooke_split, corotated };
/// t4: linear tetrahedra; too stiff in bending, and lock as Poisson's ratio nears a half. t10: quadratic, straight
/// edges at rest, 4 Gauss points. t4_mean: linear ones in patches of about eight; the part of the law that Poisson's
/// ratio makes stiff (the term of lambda; of neo_hooke_split that of K) acts on the change of volume averaged over a
/// patch, the rest on each tetrahedron. Bends like t4, does not lock. An energy like the others, so forces balance and
/// the Hessian is symmetric (T. Hughes 1980 for the mean; patches of simplices: E. de Souza Neto et al., Int. J. Numer.
/// Meth. Eng. 62, 2005, there without an energy).
enum class TetOrder : int { t4, t10, t4_mean };

/// A body of tetrahedra with one material a tetrahedron. Points are mm at rest; of t10 the corners come first, as in
/// the mesh.
class FemBody final : public Energy {
 public:
  /// Errors: usage for a Poisson's ratio outside (-1, 0.5), a modulus not above 0, an index out of range; corrupt for a
  /// tetrahedron of volume
  /// <= 0. `materials`: one for all, or one a tetrahedron.
  FemBody(std::span<const Vec3> points_mm, std::span<const std::array<std::uint32_t, 4>> tets,
          std::vector<Material> materials, ElasticLaw law, TetOrder order);

  [[nodiscard]] std::size_t point_count() const override { return rest_.size(); }
  /// The tetrahedra, then of t4_mean the patches.
  [[nodiscard]] std::size_t element_count() const override { return count_ + patches_.size(); }
  [[nodiscard]] std::size_t tet_count() const { return count_; }
  [[nodiscard]] std::span<const std::uint32_t> nodes(std::size_t e) const override {
    return e < count_ ? std::span(nodes_.data() + e * per_, per_)
                      : std::span<const std::uint32_t>(patches_[e - count_].nodes);
  }
  double element(std::size_t e, const Vec3* x, double* gradient, double* hessian) const override;

  [[nodiscard]] const std::vector<Vec3>& rest() const { return rest_; }
  [[nodiscard]] std::size_t corner_count() const { return corners_; }
  /// Fixed corners, and of t10 also the points in the middle of edges between two of them.
  [[nodiscard]] std::vector<std::uint32_t> with_middles(std::span<const std::uint32_t> corners) const;
  /// A load on the mesh's points as one on all of the body's: also held are, of t10, the middles between two corners
  /// that are (along the axes that both are and `edges_held` leaves, moved by the mean of their movements), and forces
  /// that act on edges go there. Of t4 nothing changes.
  [[nodiscard]] TissueLoad on_all_points(const TissueLoad& load) const;
  /// Tetrahedra that are turned inside out (of t10: at a Gauss point).
  [[nodiscard]] std::size_t inverted(std::span<const Vec3> x) const;
  [[nodiscard]] const std::vector<Material>& materials() const { return materials_; }
  [[nodiscard]] ElasticLaw law() const { return law_; }
  [[nodiscard]] TetOrder order() const { return order_; }
  /// Of t4_mean: the tetrahedra of each patch, all of one material, joined by faces. Each tetrahedron is in one; those
  /// that no neighbour of their material could take are patches of fewer than four, and as stiff as t4.
  [[nodiscard]] std::size_t patch_count() const { return patches_.size(); }
  [[nodiscard]] const std::vector<std::uint32_t>& patch(std::size_t p) const { return patches_[p].tets; }

 private:
  struct Gauss {
    std::array<Vec3, 10> gradient;  // of the shape functions, 1/mm
    double weight_mm3;
  };
  struct Patch {
    std::vector<std::uint32_t> tets, nodes;
    std::vector<std::array<std::uint8_t, 4>> local;  // of each tetrahedron: its corners among `nodes`
    double mm3 = 0;
  };
  void make_patches();
  double patch_element(const Patch& patch, const Vec3* x, double* gradient, double* hessian) const;
  [[nodiscard]] const Material& material(std::size_t e) const { return materials_[materials_.size() == 1 ? 0 : e]; }

  std::vector<Vec3> rest_;
  std::vector<std::uint32_t> nodes_;
  std::vector<std::array<std::uint32_t, 2>> middle_of_;  // of t10: the corners that a later point lies between
  std::size_t count_, per_, corners_;
  std::vector<Gauss> gauss_;
  std::size_t gauss_per_;
  std::vector<Material> materials_;
  ElasticLaw law_;
  TetOrder order_;
  std::vector<Patch> patches_;
};

/// Points in mm and tetrahedra of a mesh, for both models.
[[nodiscard]] std::vector<Vec3> points_of(const TetMesh& mesh);
[[nodiscard]] std::vector<std::array<std::uint32_t, 4>> tets_of(const TetMesh& mesh);

// -- All that finite elements found, for programs that draw it.

/// A .vtu file in text (VTK's XML, read by ParaView and 3D Slicer): every node of the body where it is under the load,
/// in double precision, of t10 the middles of edges too, as cells of VTK_TETRA or VTK_QUADRATIC_TETRA;
/// "displacement_mm" at the nodes, "young_mpa" and "poisson" in the cells. `x`: places of all nodes, finite.
[[nodiscard]] std::string nodes_vtu(const FemBody& body, std::span<const Vec3> x);

struct Statics : Equilibrium {
  Vec3 reaction_n;             ///< on what is held or moved: what holds it exerts
  Vec3 contact_n;              ///< of rigid things on the body
  std::uint64_t touching = 0;  ///< points in contact; of quadratic elements the seven places of each face
};

/// Where `body` comes to rest under `load`, as FemBody::on_all_points() makes it. Movements are prescribed to the full;
/// where the law has no finite energy there, they and the forces grow in 4, 16 and 64 steps. A rigid thing pushes each
/// point of the body's surface out along its shortest way by its stiffness times the depth, of quadratic elements the
/// faces, by as much for each area as points that look at it have: the depth that is left is the force over it. A body
/// that contact alone holds can still move freely. Errors: as of EquilibriumSolver.
[[nodiscard]] Statics statics(const FemBody& body, const TissueLoad& load, const EquilibriumOptions& options = {},
                              const Context& context = {});

}  // namespace osteo::inline simulation
