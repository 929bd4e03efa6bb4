// Contact of a burr with bone: from a pose to a force and to what is removed. Four methods, one interface.
#pragma once
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "osteo/core/base/param.h"
#include "osteo/geometry/grid/brick_grid.h"
#include "osteo/simulation/bone/hardness.h"
#include "osteo/simulation/bone/instrument.h"
#include "osteo/simulation/haptics/detail/grains.h"
#include "osteo/simulation/haptics/detail/overlap.h"
#include "osteo/simulation/haptics/stream.h"

namespace osteo::inline simulation {

enum class ContactMethod : int { rays, volume, overlap, proxy };
[[nodiscard]] constexpr std::array<std::string_view, 4> enum_names(ContactMethod) {
  return {"rays", "volume", "overlap", "proxy"};
}

struct ContactParams {
  ContactMethod method = ContactMethod::overlap;
  double stiffness_n_per_mm = 4.0;  ///< beyond the soft start; the virtual device bears it, hand-held devices about 0.5
  double soft_stiffness_n_per_mm = 1.5;  ///< in the first soft_depth_mm of penetration
  double soft_depth_mm = 0.1;
  double max_force_n = 8;
  double friction = 0.2;         ///< proxy: dynamic; the drill at rest on bone
  double static_friction = 0.3;  ///< proxy: until it slips; >= friction

  static void describe(ContactParams& p, auto& visit) {
    visit({"method",
           "rays: surface samples traced inwards; volume: samples of the volume (thesis); overlap: exact; proxy: "
           "rigid, with friction"},
          p.method);
    visit({"stiffness_n_per_mm", "stiffness of bone, beyond the soft start", "N/mm", 0, 100}, p.stiffness_n_per_mm);
    visit({"soft_stiffness_n_per_mm", "stiffness of bone at first contact", "N/mm", 0, 100}, p.soft_stiffness_n_per_mm);
    visit({"soft_depth_mm", "how deep the soft start reaches", "mm", 0, 5}, p.soft_depth_mm);
    visit({"max_force_n", "the contact pushes no harder", "N", 0, 100}, p.max_force_n);
    visit({"friction", "friction of the resting drill on bone, while it slides (proxy)", "", 0, 3}, p.friction);
    visit({"static_friction", "until it slides (proxy)", "", 0, 3}, p.static_friction);
  }
  /// Force at a depth: two slopes, continuous, capped.
  [[nodiscard]] double force_n(double depth_mm) const noexcept {
    const double soft = depth_mm < soft_depth_mm ? depth_mm : soft_depth_mm;
    const double f = soft_stiffness_n_per_mm * soft + stiffness_n_per_mm * (depth_mm - soft);
    return f < max_force_n ? f : max_force_n;
  }
  /// What a wall of this law gives back from a depth, mJ.
  [[nodiscard]] double energy_mj(double depth_mm) const noexcept {
    const auto under = [most = max_force_n](double from, double slope, double to_go) {
      const double rising = from + slope * to_go <= most ? to_go : (most - from) / slope;
      return (from + 0.5 * slope * rising) * rising + most * (to_go - rising);
    };
    const double soft = depth_mm < soft_depth_mm ? depth_mm : soft_depth_mm;
    return under(0, soft_stiffness_n_per_mm, soft) + under(force_n(soft), stiffness_n_per_mm, depth_mm - soft);
  }
};

struct ContactResult {
  Vec3 force_n;               ///< on the tool
  Vec3 torque_n_mm;           ///< on the tool, about its position
  Vec3 normal;                ///< unit, out of the bone; zero without contact or where there is no direction
  double normal_force_n = 0;  ///< along the normal: what presses the burr into bone
  double depth_mm =
      0;  ///< depth of a flat cut of the burr that holds as much bone; proxy: how far the hand is behind the surface
  double bone_mm3 = 0;         ///< bone inside the burr
  std::uint32_t immersed = 0;  ///< samples, or voxels that will be cut
  Vec3 shown_offset_mm;        ///< from the pose to where the tool is shown: at the surface
  double stored_mj = 0;        ///< about what it would give back on the way out, by its law; 0: the method cannot tell
};

/// What a model hands over for removal: every voxel once.
struct Cut {
  std::span<const Hit> hits;
  Vec3 at_mm, axis;       ///< where the burr cuts: its tip's centre, in the bone's frame
  bool in_turns = false;  ///< only some of the voxels under the burr are listed, others the next time
};

/// A contact model is one way from pose to force; scenes choose one. It remembers one hand's contact with one bone.
/// Everything is allocated when it is made.
class ContactModel {
 public:
  explicit ContactModel(const ContactParams& params) : params_(params) {}
  virtual ~ContactModel() = default;
  /// The law of force from the next contact() on; `method` is that of the model, whatever it says here.
  void set(const ContactParams& params) noexcept { params_ = params; }
  /// Where burrs have been in the bone of the contact()s to come; null: nowhere. Must outlive them. With it a burr is
  /// pressed by what it may still take, and by no bone that it can never reach.
  void know(const Grains* known) noexcept { known_ = known; }
  /// A slot holds the tool across this direction (unit, in the bone's frame) from the next contact() on; zero: nothing
  /// does. Of the proxy alone, the method of saws: it does not slide there, and bone beside it does not stop it.
  void hold(Vec3 across) noexcept { held_ = across; }
  /// Force for this pose. A pose that is not finite gives none. No allocation, no exception.
  virtual ContactResult contact(const BrickGrid& bone, const DeviceSample& pose) noexcept = 0;
  /// What the last contact() would cut; empty when the pedal was up. Valid until the next contact().
  [[nodiscard]] virtual Cut cut(const BrickGrid& bone) noexcept = 0;
  /// Another model is in use now: what this one remembers of the hand is out of date.
  virtual void rest() noexcept {}
  /// What the last contact() overlapped, where that is all that matters: of several bones it may be added up. Null: it
  /// may not.
  [[nodiscard]] virtual const OverlapResult* overlapped() const noexcept { return nullptr; }

 protected:
  ContactParams params_;
  const Grains* known_ = nullptr;
  Vec3 held_;
};

/// `spacing_mm` of the bone it will meet: sizes its buffers. `tools`: of instrument_library(), that it is for; none:
/// all. (A proxy makes a table for each, 2 ms.)
[[nodiscard]] std::unique_ptr<ContactModel> make_contact_model(const ContactParams& params, double spacing_mm,
                                                               std::span<const std::size_t> tools = {});

/// Below this many voxels of radius a burr is too small for them: flat bone is felt with errors of 10 % of the force
/// and more.
inline constexpr double kMinRadiusVoxels = 2;
/// What to say of such a burr, and what to do about it; empty for the others.
[[nodiscard]] std::string too_small_for_voxels(const Burr& burr, double spacing_mm);

/// Takes bone away: rate * force * time * speed / hardness, spread over the voxels of a cut by the bone that may go
/// there and by efficiency, but nowhere more than what the burr has ever covered (Grains). What voxels cannot give is
/// carried to the next call, so that the rate depends on neither voxels nor ticks. Remembers where burrs have been: one
/// for each bone, whichever hand holds them.
class Removal {
 public:
  explicit Removal(const BrickGrid& bone);
  /// `hardness` may be null; `hand` below kMaxHands. Without force nothing goes, but what the burr covers is known
  /// from then on. Returns the changed voxels (valid until the next call) and sets what was removed.
  std::span<const VoxelChange> remove(BrickGrid& bone, const Cut& cut, const Burr& burr, double force_n,
                                      double speed_rpm, double dt_s, const Hardness* hardness, double& removed_mm3,
                                      std::size_t hand = 0) noexcept;
  [[nodiscard]] Grains& grains() { return grains_; }
  [[nodiscard]] const Grains& grains() const { return grains_; }

 private:
  std::array<double, kMaxHands> carry_mm3_{};
  Grains grains_;
  std::vector<float> reached_;   // of each hit, how much density the burr may still take
  std::vector<double> weights_;  // and its part in what goes
  std::vector<VoxelChange> changes_;
};

/// At most about this many voxels change in a tick: with more under the burr, their rows take turns.
inline constexpr std::size_t kMaxCutPerTick = 1024;
/// Room for the hits of any instrument of the library at this spacing.
[[nodiscard]] std::size_t most_hits(double spacing_mm);

}  // namespace osteo::inline simulation
