// Haptic rendering: all that happens to a pose between the device and the hand, but for the device.
#pragma once
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "osteo/bone/depth_map.h"
#include "osteo/bone/structure_map.h"
#include "osteo/haptics/contact.h"
#include "osteo/haptics/curve_constraint.h"
#include "osteo/haptics/guard.h"
#include "osteo/haptics/vibration.h"

namespace osteo {

struct EffectParams {
  bool shaft = true;
  bool fail_safe = true;
  double drag = 0.15;
  bool left_handed = false;
  double speed_rpm = Burr::kNominalRpm;
  bool vibration = true;

  static void describe(EffectParams& p, auto& visit) {
    visit({"shaft", "the shaft collides too"}, p.shaft);
    visit({"fail_safe", "deep in bone, where the burr has no direction of its own, push along a distance map"}, p.fail_safe);
    visit({"drag", "pull of the teeth along the surface, for each newton pressed, at the equator (a guess)", "", 0, 2}, p.drag);
    visit({"left_handed", "the burr turns the other way"}, p.left_handed);
    visit({"speed_rpm", "of the burr; removal is in proportion", "rpm", 0, 200000}, p.speed_rpm);
    visit({"vibration", "the running drill shakes the hand"}, p.vibration);
  }
};

/// Everything that decides what a session feels like; written into its header.
struct HapticsParams {
  using Params = HapticsParams;
  ContactParams contact;
  EffectParams effects;
  GuardParams guard;

  static void describe(HapticsParams& p, auto& visit) {
    ContactParams::describe(p.contact, visit);
    EffectParams::describe(p.effects, visit);
    GuardParams::describe(p.guard, visit);
  }
};

/// Everything that decides what a rehearsal feels like; a session's header holds it. An empty part costs nothing.
struct HapticSetup {
  HapticsParams params;
  DeviceTraits device;
  std::map<int, ContactMethod> tool_methods;  ///< index in burr_library() -> another method than params.contact.method for that tool
  bool hardness = false;                      ///< removal goes by the HU of the case
  std::string structures;                     ///< hash of the structures at risk that are watched; empty: none
  std::vector<Vec3> curve;                    ///< points of a virtual fixture in mm; fewer than 2: none
  CurveConstraintParams curve_params;
  std::string vibration_json;  ///< a spectrum as parse_vibration reads it; empty: the built-in model
};

/// What is known of the patient besides bone; what is null costs nothing.
struct Anatomy {
  std::shared_ptr<const Hardness> hardness;
  std::shared_ptr<const StructureMap> structures;
};

/// Pose to force and removal. Made for one bone; owns all buffers. step() neither allocates nor locks nor throws, and the same sequence
/// of samples gives the same bits.
/// The force: contact of the head by the chosen method, contact of the shaft (exact overlap), both elastic and watched by the passivity
/// observer; drag of the teeth, along normal x axis (D. Morris 2006, section 3.2.3.7: summed over a ball it is that cross product) and
/// vibration, both motor-driven; a curve's pull. Then the limits of Guard.
class HapticRenderer {
 public:
  /// What the scene knows of the patient besides bone may be null. Errors: usage, when the vibration's text is not valid.
  HapticRenderer(const HapticSetup& setup, const BrickGrid& bone, const Anatomy& anatomy, double dt_s);
  ~HapticRenderer();

  struct Step {
    TickRecord record;                     ///< all but tick number and machine times
    std::span<const VoxelChange> changes;  ///< valid until the next step
  };
  Step step(BrickGrid& bone, const DeviceSample& sample) noexcept;

  /// Of the last step, before limits.
  [[nodiscard]] const ContactResult& contact() const { return contact_; }
  /// What is really used: the asked one, or less for the sake of stability.
  [[nodiscard]] double stiffness_n_per_mm() const { return params_.contact.stiffness_n_per_mm; }

 private:
  void escape(Vec3 at_mm, const Burr& burr) noexcept;

  HapticsParams params_;
  Anatomy anatomy_;
  double dt_s_;
  std::array<std::unique_ptr<ContactModel>, EnumNames<ContactMethod>::values.size()> models_;  // those that some tool uses
  std::vector<ContactMethod> method_of_tool_;
  ContactModel* model_ = nullptr;  // of the tool in the hand
  Removal removal_;
  std::unique_ptr<DepthMap> depth_map_;
  std::vector<VoxelKey> changed_;
  Overlap shaft_{0};
  Vibration vibration_;
  std::optional<Curve> curve_;
  std::optional<CurveConstraint> constraint_;
  Guard guard_;
  ContactResult contact_;
  DeviceSample last_good_;
  bool has_last_ = false;
  std::uint32_t flags_ = 0;
};

}  // namespace osteo
