// What the sources of outcomes share: places on a surface, a pose that was found, and its deviation from the plan.
#pragma once
#include <array>
#include <cstdint>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "edge_fit.h"
#include "osteo/core/base/context.h"
#include "osteo/core/data/rigid_transform.h"
#include "osteo/core/data/volume.h"
#include "osteo/geometry/mesh/soup.h"
#include "osteo/session/planning/detail/outcome.h"
#include "osteo/session/planning/detail/plan.h"

namespace osteo::inline session::outcome {

constexpr double kDeg = std::numbers::pi / 180;
constexpr double kMinFound = 0.35;  ///< of a fragment's places, without which it is not found

struct SurfacePlace {
  Vec3 at, normal;
  double mm2 = 0;  ///< of the surface that it stands for
};

struct Fit {
  RigidTransform pose;  ///< the CT after surgery from the bone's
  double offset = 0;    ///< what all edges lie further out
  Vec3 middle;          ///< about which the pose's error turns, in the CT after surgery
  planning::Square<7> covariance{};
  double quantile = 0, rms = 0, found = 0, drop = 0, blur = 0, beyond = 0;
};

[[nodiscard]] RigidTransform small_motion(Vec3 about, Vec3 shift, Vec3 turn);
[[nodiscard]] Vec3 rotation_vector(const Mat3& m);
/// `share` below 1; 0 of nothing.
[[nodiscard]] double quantile_of(std::vector<double> v, double share);
[[nodiscard]] double median_of(std::vector<double> v);
[[nodiscard]] std::array<int, 3> patch_of(Vec3 p, double size);
/// Error(usage): its surface is not given.
[[nodiscard]] const TriangleSoup& bone_called(const std::vector<std::pair<std::string, TriangleSoup>>& bones,
                                              const std::string& name);
/// The plan leaves it where it is.
[[nodiscard]] bool stays(const PlannedFragment& f);
/// Of each triangle that is `in` the number of its piece, by shared points, in order of their first triangles; of
/// others 0.
[[nodiscard]] std::vector<std::uint32_t> pieces_of(const TriangleSoup& s, const std::vector<bool>& in);
/// 2000 places over what lies behind the planes, in one piece with what is nearest to the first one's place; without
/// planes over the largest piece.
[[nodiscard]] std::vector<SurfacePlace> spread(const TriangleSoup& bone, const std::vector<const CutPlane*>& planes);
/// The shift and turn of a place under a pose's error, from its unknowns, in other axes.
[[nodiscard]] std::array<planning::Row<7>, 6> at_place(const Fit& fit, Vec3 place, const Mat3& axes);
/// The direction along which alone a place is not known to `limit`, at `quantile` standard deviations; else zero.
[[nodiscard]] Vec3 slide_of(const std::array<std::array<double, 3>, 3>& covariance, double quantile, double limit);
/// Half-width along a direction.
[[nodiscard]] double half_along(const std::array<std::array<double, 3>, 3>& covariance, double quantile, Vec3 a);
/// Shift and turn, at out.middle_mm, of what was found against where the plan has it in the reference's axes.
void deviation(FragmentOutcome& out, const PlannedFragment& planned, const Fit& fit, const Fit& reference,
               const OutcomeParams& params);
/// Known where its intervals are as narrow as is asked for; else why not.
void judge(FragmentOutcome& out, const OutcomeParams& params);

/// Outlines and condyles; the bone of the plan's first plane is the jaw.
void find_contours(Outcome& out, const SurgicalPlan& plan,
                   const std::vector<std::pair<std::string, TriangleSoup>>& bones,
                   const std::vector<std::optional<Fit>>& fits, const std::vector<std::vector<SurfacePlace>>& places,
                   std::size_t reference, const OutcomeParams& params, const Context& context);

// -- Metal and holes; `fits` as the plan's fragments.

/// Share of a normal variable of variance 1 that lies below x.
[[nodiscard]] double share_below(double x);
/// The CT's blur, one sigma, as the bone's edges have it.
[[nodiscard]] double blur_of(const Fit& fit);
/// CTs end at a HU that much metal has: that HU; infinity where none does.
[[nodiscard]] double clip_of(const Image& ct);

void find_screws(Outcome& out, const SurgicalPlan& plan, const std::vector<std::optional<Fit>>& fits,
                 const planning::EdgeReader& ct, const Image& postop, const OutcomeParams& params,
                 const Context& context);
/// Error(usage): a plate's surface is empty, open or of another unit than mm.
void require_plates(const SurgicalPlan& plan);
void find_plates(Outcome& out, const SurgicalPlan& plan, const std::vector<std::optional<Fit>>& fits,
                 const std::vector<std::vector<SurfacePlace>>& places, const planning::EdgeReader& ct,
                 const Image& postop, const OutcomeParams& params, const Context& context);

}  // namespace osteo::inline session::outcome
