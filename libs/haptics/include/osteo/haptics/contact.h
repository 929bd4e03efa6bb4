// Contact of a burr with bone, and removal: the kernel of a tick.
#pragma once
#include <span>
#include <vector>

#include "osteo/bone/burr.h"
#include "osteo/grid/brick_grid.h"
#include "osteo/haptics/stream.h"

namespace osteo {

struct ContactParams {
  double stiffness_n_per_mm = 4.0;       ///< beyond the soft start; the virtual device bears it, hand-held devices about 0.5
  double soft_stiffness_n_per_mm = 1.5;  ///< in the first soft_depth_mm of penetration
  double soft_depth_mm = 0.1;
  double max_force_n = 8;
};

struct ContactResult {
  Vec3 force_n;                ///< on the tool
  double depth_mm = 0;         ///< depth of a flat cut of the burr that holds as much bone
  double bone_mm3 = 0;         ///< bone inside the burr
  std::uint32_t immersed = 0;  ///< samples in bone
};

/// A contact model is one way from pose to force and removal; scenes choose one.
class ContactModel {
 public:
  virtual ~ContactModel() = default;
  /// Force for this pose. No allocation, no exception.
  virtual ContactResult contact(const BrickGrid& bone, const DeviceSample& pose) noexcept = 0;
  /// Removes bone for the last contact(): force * time * rate. Returns the changed voxels (valid until the next call) and
  /// adds to `removed_mm3`.
  virtual std::span<const VoxelChange> remove(BrickGrid& bone, double dt_s, double& removed_mm3) noexcept = 0;
};

/// The thesis' volume sampling (section 3.2.3.4 to 3.2.3.6): each sample of the burr's volume that lies in bone pushes it
/// towards the burr's centre with unit strength, here times the bone's density there. The sum gives the direction. The
/// magnitude is a two-gain function of the immersed volume, taken through the depth of the spherical cap of that volume, so
/// that stiffness is in N/mm whatever the burr; unlike the thesis' it is continuous.
/// Removal: rate * force * time, spread over the immersed samples by their latitude; what a voxel cannot give any more is
/// carried to the next tick. About 12 ns a sample.
class VolumeSampling final : public ContactModel {
 public:
  explicit VolumeSampling(const ContactParams& params);
  ContactResult contact(const BrickGrid& bone, const DeviceSample& pose) noexcept override;
  std::span<const VoxelChange> remove(BrickGrid& bone, double dt_s, double& removed_mm3) noexcept override;

 private:
  struct Tool {
    Burr burr;
    BurrSamples samples;
    std::vector<std::array<float, 3>> offset_index;  // rotated to the axis, in voxels of the bone
    std::array<float, 3> axis{};                     // for which offset_index holds
    bool oriented = false;
  };
  struct Hit {
    VoxelKey voxel;
    float weight;  // efficiency times density
  };
  void orient(Tool& tool, const BrickGrid& bone, const std::array<float, 3>& axis) noexcept;

  ContactParams params_;
  std::vector<Tool> tools_;
  Tool* tool_ = nullptr;  // of the last contact
  std::vector<Hit> hits_;
  std::size_t hit_count_ = 0;
  double force_magnitude_n_ = 0, weight_sum_ = 0, density_sum_ = 0;
  double carry_mm3_ = 0;
  // Voxel -> share, cleared after each tick: an open hash table of fixed size.
  std::vector<VoxelKey> table_key_;
  std::vector<float> table_share_;
  std::vector<std::uint32_t> used_slots_;
  std::size_t used_count_ = 0;
  std::vector<VoxelChange> changes_;
};

/// d in [0, 2r] such that a plane at depth d cuts the volume from a ball of radius r.
[[nodiscard]] double cap_depth_mm(double volume_mm3, double radius_mm) noexcept;

}  // namespace osteo
