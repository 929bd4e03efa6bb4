// The WoodenHaptics and Polhem family: open-hardware arms of three motors and a gimbal.
#pragma once
#include <array>
#include <filesystem>
#include <optional>

#include "osteo/core/base/param.h"
#include "osteo/core/data/vec.h"
#include "osteo/simulation/devices/detail/reports.h"

namespace osteo::inline simulation {

/// Geometry and motors. Links, capstans, encoders, torque constants and limits of the Polhem v3 as its driver's header
/// gives them (haptikfabrikenapi.h); the diameters of the driven bodies, the workspace's origin and the gimbal's
/// directions are not there: those are guesses after the WoodenHaptics, to be replaced by what one's own device has, in
/// a file.
struct WoodenHapticsGeometry {
  using Params = WoodenHapticsGeometry;
  std::array<double, 3> capstan_diameter_mm{28.8, 13, 10};
  std::array<double, 3> body_diameter_mm{180, 120, 120};
  std::array<double, 3> link_mm{100, 165, 130.8};  ///< column, upper arm, forearm
  std::array<double, 3> origin_mm{130.8, 0, 265};  ///< of the workspace
  std::array<double, 3> zero_angle_rad{0, 0, 1.5707963267948966};
  std::array<double, 3> counts_a_turn{4096, 4096, 4096};
  std::array<double, 3> gimbal_counts_a_turn{1024, 1024, 4096};
  std::array<double, 3> torque_constant_nm_per_a{0.0603, 0.0538, 0.0538};
  double max_current_a = 3;
  double max_force_n = 5;
  double max_stiffness_n_per_mm = 2;
  double damping_n_s_per_m = 0.5;

  static void describe(WoodenHapticsGeometry& p, auto& visit) {
    visit({"capstan_diameter_mm", "capstan diameters on the motors of joints a, b, c", "mm"}, p.capstan_diameter_mm);
    visit({"body_diameter_mm", "diameters of the bodies that the capstans drive", "mm"}, p.body_diameter_mm);
    visit({"link_mm", "column, upper arm, forearm", "mm"}, p.link_mm);
    visit({"origin_mm", "origin of the workspace", "mm"}, p.origin_mm);
    visit({"zero_angle_rad", "joint angles where the encoders count 0", "rad"}, p.zero_angle_rad);
    visit({"counts_a_turn", "counts a turn of the motors' encoders"}, p.counts_a_turn);
    visit({"gimbal_counts_a_turn", "counts a turn of the gimbal's encoders"}, p.gimbal_counts_a_turn);
    visit({"torque_constant_nm_per_a", "torque constant of the motors", "N m/A"}, p.torque_constant_nm_per_a);
    visit({"max_current_a", "through a motor", "A", 0, 20}, p.max_current_a);
    visit({"max_force_n", "at the tip", "N", 0, 50}, p.max_force_n);
    visit({"max_stiffness_n_per_mm", "maximum stiffness that the arm can render", "N/mm", 0, 100},
          p.max_stiffness_n_per_mm);
    visit({"damping_n_s_per_m", "damping of the arm itself, at the tip", "N s/m", 0, 100}, p.damping_n_s_per_m);
  }
};

/// Any field of the geometry under its name; "osteotome_woodenhaptics": 1. Errors: usage, no_input.
[[nodiscard]] WoodenHapticsGeometry load_woodenhaptics(const std::filesystem::path& path);

/// x forward, y to the left, z up, from the workspace's origin:
///   x = cos A (Lb sin B + Lc sin C), y = sin A (Lb sin B + Lc sin C), z = La + Lb cos B - Lc cos C.
class WoodenHapticsKinematics {
 public:
  explicit WoodenHapticsKinematics(const WoodenHapticsGeometry& geometry) : g_(geometry) {}
  [[nodiscard]] Vec3 angles_rad(const std::array<int, 6>& encoder) const;
  [[nodiscard]] Vec3 position_mm(Vec3 angles_rad) const;
  /// Columns: the tip's move for a radian of each joint, mm.
  [[nodiscard]] Mat3 jacobian_mm(Vec3 angles_rad) const;
  /// Unit, from tip to handle: the forearm's direction turned by the gimbal.
  [[nodiscard]] Vec3 axis(Vec3 angles_rad, const std::array<int, 6>& encoder) const;
  /// For a force at the tip: torque = J^T force, over gear and torque constant, limited to the motors.
  [[nodiscard]] std::array<double, 3> currents_ma(Vec3 angles_rad, Vec3 force_n) const;
  /// The force that currents make; for simulated devices.
  [[nodiscard]] Vec3 force_n(Vec3 angles_rad, const std::array<double, 3>& current_ma) const;
  /// Encoder counts for a place, elbow up; nothing when it is out of reach. For simulated devices and calibration.
  [[nodiscard]] std::optional<std::array<int, 6>> encoders(Vec3 position_mm) const;
  /// The largest step of the tip for one count, at the workspace's origin.
  [[nodiscard]] double resolution_mm() const;

 private:
  [[nodiscard]] double gear(std::size_t joint) const {
    return g_.body_diameter_mm[joint] / g_.capstan_diameter_mm[joint];
  }
  WoodenHapticsGeometry g_;
};

}  // namespace osteo::inline simulation
