// Solids of which everything is known: where their surface is, which way it faces, and a way over it.
#pragma once
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "osteo/core/base/context.h"
#include "osteo/core/data/vec.h"
#include "osteo/geometry/grid/brick_grid.h"
#include "osteo/geometry/mesh/soup.h"
#include "osteo/simulation/haptics/fields.h"

namespace osteo::inline assessment::truth {

/// A way over a surface as a function of time, the same for the same seed.
struct PathParams {
  std::uint64_t seed = 1;
  bool closed = false;  ///< comes back to its beginning every kCycleS, to measure what a cycle costs
};
inline constexpr double kCycleS = 8;

/// Sizes are some centimetres: an object that fits in a cube of 2 half_mm. Immutable: any number of threads may ask.
class Solid {
 public:
  Solid(std::string name, double half_mm, double stiffness)
      : name_(std::move(name)), half_mm_(half_mm), stiffness_(stiffness) {}
  virtual ~Solid() = default;
  Solid(const Solid&) = delete;
  Solid& operator=(const Solid&) = delete;

  [[nodiscard]] const std::string& name() const { return name_; }
  /// Half the edge of the cube around the origin in which it is felt; a sampled field covers that.
  [[nodiscard]] double half_mm() const { return half_mm_; }
  /// N/mm at which the spring of a trajectory stays shorter than the sharpest curve of the surface, so that the contact
  /// is the only one.
  [[nodiscard]] double stiffness_n_per_mm() const { return stiffness_; }

  /// 0 at the surface, positive outside, with a slope near 1. Closed form, or of the bone its own definition.
  [[nodiscard]] virtual double clearance_mm(Vec3 at) const = 0;
  /// Of the clearance; by central differences where a solid has no other, right to 1e-8.
  [[nodiscard]] virtual Vec3 gradient(Vec3 at) const;
  /// Unit, outwards, of a point on the surface.
  [[nodiscard]] Vec3 normal(Vec3 at) const { return normalized(gradient(at)); }
  /// Where a path is, on the surface to 1e-9 mm, always moving. Smooth: its speed may be taken by differences.
  [[nodiscard]] virtual Vec3 place(double time_s, const PathParams& path) const = 0;
  /// A closed surface of about so many triangles, its corners on the solid's.
  [[nodiscard]] virtual TriangleSoup mesh(int triangles) const = 0;
  /// The nearest point of the surface, for points near it: Newton's method along the gradient.
  [[nodiscard]] Vec3 foot(Vec3 at) const;

 private:
  std::string name_;
  double half_mm_, stiffness_;
};

/// plane, sphere, cylinder (round ends), torus, duck (D. Morris 2006's by reference: r = 30 (1 + .12 sin^3 t sin 3p +
/// .06 sin^2 t cos 2t)), wedge (two slopes of 30 degrees, rounded to 3 mm), saddle, bump (a ridge of 2 mm, sides of 45
/// degrees), wall (2 mm thin). Error(usage) when there is none of that name.
[[nodiscard]] std::shared_ptr<const Solid> make_solid(std::string_view name);
/// All names that make_solid takes.
[[nodiscard]] const std::vector<std::string>& solid_names();

/// A ridge across a plane as in figure 65: `height_mm` high, its sides at `degrees` (5 to 85) to the plane, edges and
/// feet rounded to `radius_mm`, the top `top_mm` wide. Its profile, z over x, is a chain of lines and arcs.
struct RidgeProfile {
  double height_mm = 2, degrees = 45, radius_mm = 0.5, top_mm = 6;
  /// Height and slope at x.
  [[nodiscard]] double height(double x) const;
  [[nodiscard]] double slope(double x) const;
  /// From (x, z) to the nearest point of the profile, negative below it. Exact.
  [[nodiscard]] double distance(double x, double z) const;
};
[[nodiscard]] std::shared_ptr<const Solid> make_ridge(const RidgeProfile& profile);

/// Bone: the surface where the exact distance to `mesh`, sampled every `spacing_mm` and joined by the cubic spline, is
/// 0. That is the truth by definition, smooth, and within a tenth of the spacing of the mesh where that is not sharper.
/// Moved to the origin and brought to 70 mm. Error(usage) where the mesh is not closed.
[[nodiscard]] std::shared_ptr<const Solid> make_bone(const TriangleSoup& mesh, double spacing_mm,
                                                     const Context& context = {});

/// What someone scanned: its triangles are the truth, by exact distance, in their own coordinates; it has no way over
/// it. Error(usage) where they are not closed or farther than a metre from the origin.
[[nodiscard]] std::shared_ptr<const Solid> make_mesh_solid(const TriangleSoup& mesh, const Context& context = {});

/// The solid's clearance at the points of a grid of n^3 over its cube, lengths times `scale`.
[[nodiscard]] CubicField sampled_field(const Solid& solid, int n, double scale,
                                       FieldCurve curve = FieldCurve::catmull_rom, const Context& context = {});
/// Its bone in voxels, the share of each that it fills, by 4^3 points at the surface.
[[nodiscard]] BrickGrid sampled_bone(const Solid& solid, double spacing_mm, const Context& context = {});

}  // namespace osteo::inline assessment::truth
