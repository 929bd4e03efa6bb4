// The four contact models; made by make_contact_model.
#pragma once
#include "osteo/simulation/bone/round_cone.h"
#include "osteo/simulation/haptics/contact.h"
#include "osteo/simulation/haptics/god_object.h"

namespace osteo::inline simulation {

[[nodiscard]] inline Vec3 position_of(const DeviceSample& s) {
  return from_floats(s.position_mm);
}
/// Unit; along z when the sample's is not usable.
[[nodiscard]] inline Vec3 axis_of(const DeviceSample& s) {
  const Vec3 a = from_floats(s.axis);
  const double n = length(a);
  return std::isfinite(n) && n > 1e-6 ? a / n : Vec3{0, 0, 1};
}
[[nodiscard]] inline bool finite(Vec3 v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}
[[nodiscard]] inline std::size_t tool_of(const DeviceSample& s) {
  return std::min<std::size_t>(s.tool, instrument_library().size() - 1);
}

/// The overlap of the library's heads, and what they cut by it: the same voxels whatever method the force comes from.
class HeadOverlap {
 public:
  explicit HeadOverlap(double spacing_mm);
  /// With `cutting`, cut() is what it would take there.
  const OverlapResult& measure(const BrickGrid& bone, const Grains* known, std::size_t tool, Vec3 at_mm, Vec3 axis,
                               bool cutting) noexcept;
  [[nodiscard]] const OverlapResult& last() const { return last_; }
  [[nodiscard]] Cut cut() const noexcept;

 private:
  std::vector<RoundCone> heads_;
  std::vector<std::uint32_t> strides_;
  Overlap overlap_;
  OverlapResult last_;
  bool cutting_ = false;
  Vec3 at_mm_, axis_;
  std::uint32_t stride_ = 1, phase_ = 0;
};

/// Beside samples, which know of densities alone: the exact overlap of the head, for what it cuts and for where burrs
/// have been.
class SampledHead {
 public:
  explicit SampledHead(double spacing_mm) : overlap_(spacing_mm) {}
  void begin(const DeviceSample& pose) noexcept;
  /// The share of the bone under the head that is really there; 1 where no burr has been.
  [[nodiscard]] double share(const BrickGrid& bone, const Grains* known) noexcept;
  [[nodiscard]] Cut cut(const BrickGrid& bone, const Grains* known) noexcept;

 private:
  HeadOverlap overlap_;
  DeviceSample pose_;
  bool measured_ = false;
};

/// Exact overlap: the stiffness law of the depth of a flat cut of the same volume, against the gradient of the overlap.
/// Where pushes from opposite sides cancel, as between two walls, so does the force.
class ExactOverlap final : public ContactModel {
 public:
  ExactOverlap(const ContactParams& params, double spacing_mm);
  ContactResult contact(const BrickGrid& bone, const DeviceSample& pose) noexcept override;
  [[nodiscard]] Cut cut(const BrickGrid& bone) noexcept override;
  [[nodiscard]] const OverlapResult* overlapped() const noexcept override { return &head_.last(); }

 private:
  HeadOverlap head_;
};

/// The law of ExactOverlap; all but what was immersed.
[[nodiscard]] ContactResult contact_of_overlap(const ContactParams& params, std::size_t tool,
                                               const OverlapResult& overlap, Vec3 axis) noexcept;

/// The share of a flat cut's push that is left when parts of the surface push against each other: 1 on flat bone, 0
/// between two walls.
[[nodiscard]] inline double push_left(const OverlapResult& o, double depth_mm, const RoundCone& shape) {
  // Of a flat cut: 1 - d / 2r for a ball, more for sides; down to 0.4 where the slenderest end is in.
  const double flat = std::max(0.4, 1 - depth_mm / (2 * std::min(shape.start_radius_mm, shape.end_radius_mm)));
  return o.surface_mm2 > 0 ? std::min(1.0, length(o.area_mm2) / (o.surface_mm2 * flat)) : 0;
}

/// God-object of the whole burr: it stays where its overlap with bone is that of a light touch, whatever the hand does.
class BurrProxy final : public ContactModel {
 public:
  /// For these instruments; none: all. Others feel nothing.
  BurrProxy(const ContactParams& params, double spacing_mm, std::span<const std::size_t> tools);
  ContactResult contact(const BrickGrid& bone, const DeviceSample& pose) noexcept override;
  [[nodiscard]] Cut cut(const BrickGrid& bone) noexcept override;

  void rest() noexcept override { proxy_.forget(); }

 private:
  [[nodiscard]] double teeth(const BrickGrid& bone, Vec3 proxy_mm, Vec3 to_hand_mm, Vec3 normal) noexcept;

  double spacing_mm_;
  std::vector<RoundCone> shells_;
  std::vector<const CutDepth*> shell_depths_;
  Overlap overlap_;
  HeadOverlap head_;
  GodObject proxy_;
  std::size_t tool_ = 0;
  bool cutting_ = false;
  double teeth_mm_ = 0;  // how far they reach beyond the proxy
  Vec3 axis_;
};

/// The thesis' volume sampling (section 3.2.3.4 to 3.2.3.6): each sample of the burr's volume that lies in bone pushes
/// it towards the burr's axis with unit strength, here times the bone's density there. The sum gives the direction; the
/// magnitude is a two-gain function of the immersed volume, taken through the depth of a flat cut of that volume, so
/// that stiffness is in N/mm whatever the burr; unlike the thesis' it is continuous. About 12 ns a sample.
class VolumeSampling final : public ContactModel {
 public:
  VolumeSampling(const ContactParams& params, double spacing_mm);
  ContactResult contact(const BrickGrid& bone, const DeviceSample& pose) noexcept override;
  [[nodiscard]] Cut cut(const BrickGrid& bone) noexcept override;

 private:
  struct Tool {
    BurrSamples samples;
    std::vector<std::array<float, 3>> offset_index, inward_index;  // rotated to the axis; offsets in voxels of the bone
    std::array<float, 3> axis{};                                   // for which they hold
    bool oriented = false;
  };
  void orient(Tool& tool, const BrickGrid& bone, const std::array<float, 3>& axis) noexcept;

  std::vector<Tool> tools_;
  SampledHead head_;
};

/// The thesis' first method (section 3.2.3.4, after Petersik 2002): samples of the burr's surface, each traced towards
/// the axis until it leaves the bone. The sum of the penetrations, each along its ray, is the immersed volume and the
/// direction of its push.
class RaySampling final : public ContactModel {
 public:
  RaySampling(const ContactParams& params, double spacing_mm);
  ContactResult contact(const BrickGrid& bone, const DeviceSample& pose) noexcept override;
  [[nodiscard]] Cut cut(const BrickGrid& bone) noexcept override;

 private:
  static constexpr int kSamples = 400;
  std::vector<BurrSurface> tools_;
  SampledHead head_;
};

}  // namespace osteo::inline simulation
