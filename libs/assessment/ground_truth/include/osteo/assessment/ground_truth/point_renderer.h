// Haptic renderers behind one interface, so that the same trajectory goes through each: ours, the thesis', and other
// programs.
#pragma once
#include <memory>
#include <string>
#include <string_view>

#include "osteo/assessment/ground_truth/solid.h"

namespace osteo::inline assessment::truth {

struct RenderSettings {
  double stiffness_n_per_mm = 0.5;
  double friction = 0;    ///< dynamic and static alike
  double unit = 1;        ///< all lengths times this, stiffness over this: 0.001 renders in metres, 1000 in micrometres
  double rate_hz = 1000;  ///< of the ticks, for who wants to know
  double probe_radius_mm = 0;  ///< of a burr, which is a ball
};

/// What a renderer makes of one position.
struct Rendered {
  Vec3 force_n;     ///< on the device
  Vec3 contact_mm;  ///< where it thinks the surface is touched; the device where it is not
  bool contact = false;
  int operations = 0;  ///< evaluations of a field, tests of a triangle, voxels looked up: what its cost grows with
};

/// One renderer with one solid in it. Not for two threads at once.
class PointRenderer {
 public:
  virtual ~PointRenderer() = default;
  /// The device was put somewhere: what came before does not count.
  virtual void place(Vec3 device_mm) = 0;
  virtual Rendered render(Vec3 device_mm) = 0;
  /// Nanoseconds that the last render() took by its own clock; -1: it has none, and who calls measures.
  [[nodiscard]] virtual double own_ns() const { return -1; }
  [[nodiscard]] double setup_s() const { return setup_s_; }
  [[nodiscard]] std::size_t memory_bytes() const { return memory_bytes_; }
  /// Of the object's representation, in the solid's mm: voxel, or edge of a triangle.
  [[nodiscard]] double grain_mm() const { return grain_mm_; }

 protected:
  double setup_s_ = 0, grain_mm_ = 1;
  std::size_t memory_bytes_ = 0;
};

/// What can be asked for, with its settings after a colon:
///   exact               our god-object on the solid's closed form, which must outlive the renderer
///   field:N             our god-object on the clearance at N^3 points, joined by Catmull-Rom's cubics;  spline:N  by
///   the cubic spline triangles:N         our god-object on about N triangles, by exact distance;  shaded:N  with
///   interpolated normals voxel:N/M           D. Morris 2006, 7.4.1: the nearest of M triangles for each of N^3 voxels,
///   its plane the surface cone:M              a proxy held by up to three of M triangles, with a friction cone, as of
///   those days;  cone-shaded:M overlap:H, proxy:H, volume:H, rays:H   our contact models of a 4 mm burr on bone in
///   voxels of H mm; settings.probe_radius_mm must be 2 process:COMMAND     another program: see docs/validation/ground-truth.md;
///   gets the solid as process-mesh of 20,000 triangles
/// Error(usage) with what is wrong.
[[nodiscard]] std::unique_ptr<PointRenderer> make_point_renderer(const std::string& what, const Solid& solid,
                                                                 const RenderSettings& settings,
                                                                 const Context& context = {});

// The kinds that have files of their own.
[[nodiscard]] std::unique_ptr<PointRenderer> make_voxel_renderer(const TriangleSoup& mesh, int voxels, double half,
                                                                 const RenderSettings& settings,
                                                                 const Context& context);
[[nodiscard]] std::unique_ptr<PointRenderer> make_cone_renderer(const TriangleSoup& mesh, bool shaded,
                                                                const RenderSettings& settings);
/// Starts `command` by the shell and speaks the protocol of docs/validation/ground-truth.md with it. Error(failed) where it ends,
/// says something else or nothing for `patience_s`.
[[nodiscard]] std::unique_ptr<PointRenderer> make_process_renderer(const std::string& command, const TriangleSoup& mesh,
                                                                   const RenderSettings& settings,
                                                                   double patience_s = 20);

}  // namespace osteo::inline assessment::truth
