// Trajectories with their forces: generated so that everything is true, or measured and read from files.
#pragma once
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "osteo/assessment/ground_truth/solid.h"

namespace osteo::inline assessment::truth {

/// One moment of a stiff probe on a rigid body.
struct Moment {
  double time_s = 0;
  Vec3 surface_mm;  ///< the out-trajectory: where the contact is, or would be
  Vec3 normal;      ///< unit, outwards
  Vec3 force_n;     ///< on the probe; zero in the air
  Vec3 device_mm;   ///< the in-trajectory: where a spring to the surface makes that force
  bool contact = false;
};
struct Trajectory {
  std::vector<Moment> moments;
  double stiffness_n_per_mm = 0.5, friction = 0, rate_hz = 1000, probe_radius_mm = 0;
};

struct TruthParams {
  PathParams path;
  double seconds = 20, rate_hz = 1000;
  double stiffness_n_per_mm = 0;        ///< 0: the solid's own
  double friction = 0;                  ///< Coulomb's, against the motion
  double push_n = 1.2, swing_n = 0.8;   ///< normal force: push + swing sin(2.3 rad/s t)
  double probe_radius_mm = 0;           ///< the device is the centre of a ball
  bool lifts = false;                   ///< every 5 s half a second through the air
  bool device_by_normal_force = false;  ///< D. Morris 2006, equation 2: p_in = p_out - F_n / k, whatever friction adds
};
/// Out-trajectory, force and in-trajectory (p_in = p_out - F / k), all in closed form but the direction of motion,
/// which is the path's difference over 0.2 ms. Error(usage) for values that make no sense. O(seconds x rate).
[[nodiscard]] Trajectory true_trajectory(const Solid& solid, const TruthParams& params);

/// What the instruments of D. Morris 2006, section 7.2 would have made of it.
struct Instruments {
  double tracker_hz = 60, tracker_sd_mm = 0.17;  ///< "less than 0.5 mm" taken as three standard deviations
  double force_sd_n = 0.005;  ///< a guess; the sensor's steps are printed: 1/320 N across, 1/640 N along
  std::uint64_t seed = 1;
};
/// The truth as measured: positions at the tracker's rate with its noise, joined by lines and put back on the surface;
/// forces in the sensor's steps. The in-trajectory follows from those by equation 2. The truth in `truth` stays what it
/// is: compare to either.
[[nodiscard]] Trajectory measured_trajectory(const Solid& solid, const Trajectory& truth,
                                             const Instruments& instruments);

// --- files
// ---------------------------------------------------------------------------------------------------------------------------

/// Which trajectory of the four that the thesis kept in files of their own.
enum class TrajectoryRole : int { probe, out, in };

/// Lines of "time x y z fx fy fz" in s, mm and N, with blanks between. As in the published set, an in-trajectory's
/// forces are 0 and an out-trajectory's force is (0, 0, 1) in contact, 0 in the air.
[[nodiscard]] std::string traj_text(const Trajectory& trajectory, TrajectoryRole role);
/// All of it with a header: time_s, surface_*, normal_*, force_*, device_*, contact.
[[nodiscard]] std::string trajectory_csv(const Trajectory& trajectory);

/// A sample of a file: positions and forces, whatever they are of.
struct TrajSample {
  double time_s = 0;
  Vec3 position_mm, force_n;
};
/// Numbers with blanks, commas or tabs between; lines that begin with '#' or '%' are skipped, and a first line of
/// words. `columns` names them in their order: t, x, y, z, fx, fy, fz, and '-' for what is not wanted; x, y and z are
/// needed, without t `rate_hz` says the time. The columns of the files of 2006 are not printed anywhere we could read;
/// "t x y z fx fy fz" is a guess to be changed by who has them. Error(corrupt) with the line, Error(usage) for columns
/// that are none, Error(no_input) for a file without samples.
[[nodiscard]] std::vector<TrajSample> parse_traj(std::string_view text, const std::string& name,
                                                 std::string_view columns, double rate_hz);
[[nodiscard]] std::vector<TrajSample> load_traj(const std::filesystem::path& path,
                                                std::string_view columns = "t x y z fx fy fz", double rate_hz = 1000);

/// Of a recorded out-trajectory with its forces on a solid: the surface's nearest point, and the in-trajectory by
/// equation 2.
[[nodiscard]] Trajectory trajectory_of(const Solid& solid, const std::vector<TrajSample>& samples,
                                       double stiffness_n_per_mm);

}  // namespace osteo::inline assessment::truth
