// What a cutting guide is made of, in its own axes: x along the bone, y across, z towards where it comes from.
#pragma once
#include <array>
#include <memory>
#include <string>
#include <vector>

#include "osteo/core/base/context.h"
#include "osteo/geometry/distance/distance_map.h"
#include "osteo/session/planning/detail/cutting_guide.h"

namespace osteo::inline session::guide {

/// n . p = c.
struct GuideFace {
  Vec3 n;
  double c = 0;
  [[nodiscard]] double x(double y, double z) const { return (c - n.y * y - n.z * z) / n.x; }
};

/// A hole right through the block, between two faces; cuts: the planes (one or two) that it serves.
struct GuideOpening {
  GuideFace lower, upper;
  std::vector<std::size_t> cuts;
};

/// Where a guide that comes down from +z stops: at this height the place is `gap` from the bone. Heights below a floor
/// are not looked for.
class Underside {
 public:
  Underside(const TriangleSoup& local_bone, double gap, const Context& context);
  [[nodiscard]] double traced(double x, double y, double floor) const;
  /// No lower than `depth` under the highest place across the bone there.
  [[nodiscard]] double height(double x, double y) const { return traced(x, y, crest(x) - depth_); }
  [[nodiscard]] double crest(double x) const;
  [[nodiscard]] double depth() const { return depth_; }
  void measure_crest(double x0, double x1, double y0, double y1, double depth, const Context& context);
  [[nodiscard]] const SignedDistance& bone() const { return bone_; }

 private:
  SignedDistance bone_;
  BoxMm box_;
  double gap_, depth_ = 0, x0_ = 0;
  std::vector<double> crest_;  // 1 mm apart
};

struct GuideLayout {
  double x0 = 0, x1 = 0;  ///< ends of the block
  double y0 = 0, y1 = 0, cut0 = 0,
         cut1 = 0;  ///< sides of the block; ends of the slots, also the side where they are open
  double top = 0;
  std::vector<GuideOpening> openings;  ///< by x
  double gap = 0.1;
  std::string code;  ///< to engrave
  Vec3 head;         ///< towards the patient's
};

struct GuideBlock {
  TriangleSoup solid;
  double min_gap = 0, seat_mm2 = 0, seat_off = 0;
  bool engraved = false;
  struct Contact {
    Vec3 at, normal;  ///< towards the guide, at the underside
    double gap = 0;
  };
  std::vector<Contact> contacts;  ///< a few all over it
  std::vector<Contact> others;    ///< its nodes, and the middles of the other cells
};
[[nodiscard]] GuideBlock build_block(const GuideLayout& layout, const Underside& under, const Context& context);

/// The most that c . x reaches where a x <= b for all rows; b >= 0, so that 0 is allowed. Simplex method with Bland's
/// rule. Infinity where nothing limits it, where it is not found in 2000 steps, and where
/// what is found does not keep to the rows within 1e-6. `x`: where it is reached, if it is.
[[nodiscard]] double largest(const std::array<double, 6>& c, const std::vector<std::array<double, 6>>& a,
                             const std::vector<double>& b, std::array<double, 6>* x = nullptr);

}  // namespace osteo::inline session::guide
