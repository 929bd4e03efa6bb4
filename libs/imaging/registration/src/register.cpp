#include "osteo/imaging/registration/register.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include "edges.h"
#include "mirror.h"
#include "mutual.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/portable_math.h"
#include "surface.h"

namespace osteo::inline imaging {
namespace {

namespace reg = registration;

constexpr double kMinOverlap = 0.25, kMaxInverseMm = 1, kManyOff = 1.3, kLike = 0.8;
constexpr int kMinEdges = 300;
// Thin slices of one head meet to 0.03 to 0.05 mm at half of all edges; from here on a mirror is tried.
constexpr double kDoubtMm = 0.06;
// What is better goes by the pair's own residual: thick slices leave 0.2 mm to a right pair and 0.25 to its mirror
// image. Of right pairs none fitted better in a mirror by both (docs/validation/registration.md).
constexpr double kMirrorBetter = 0.87, kMirrorBetterP90 = 0.96, kMirrorAlike = 1.15;
// Where the two medians are alike, the field of what lies off decides: from 1.4 times the other on (both with what
// noise leaves) it counts; what lies between is warned of.
constexpr double kJudgedMm = 1;  // voxels, never finer than either scan
constexpr double kSidesNoiseMm = 0.02, kSidesClear = 1.4, kMedianAgainst = 1.05;
// Of one head a tenth of all edges lies more than 0.07 (1 mm voxels) to 0.34 (5 mm slices) of the coarser scan's
// spacing off; another head's do from here on.
constexpr double kManyOffOfSpacing = 0.45, kManyOffLeastMm = 0.4;
// Of one head half of all edges lie up to 0.15 of the coarser scan's spacing off.
constexpr double kPoorOfSpacing = 0.16;
// Another place counts when half of all edges meet clearly better there.
constexpr double kBetter = 0.97;
constexpr reg::SearchWidth kFromMirror{.most = 6}, kWide{.times = 2};

double extent_mm3(const Frame& f) {
  return f.voxel_volume_mm3() * static_cast<double>(f.voxel_count());
}

// Where the same place of the body comes out after there and back, at the corners of what both scans show.
double there_and_back(const RigidTransform& there, const RigidTransform& back, const Frame& first,
                      const Frame& second) {
  Vec3 lo{1e30, 1e30, 1e30}, hi{-1e30, -1e30, -1e30};
  for (int c = 0; c < 11 * 11 * 11; ++c) {
    const Vec3 x{(c % 11) / 10.0 * (first.dims[0] - 1), (c / 11 % 11) / 10.0 * (first.dims[1] - 1),
                 (c / 121) / 10.0 * (first.dims[2] - 1)};
    const Vec3 p = first.world_from_index(x), y = second.index_from_world(there(p));
    bool in = true;
    for (std::size_t a = 0; a < 3; ++a) in = in && y[a] >= -0.5 && y[a] <= second.dims[a] - 0.5;
    if (!in) continue;
    for (std::size_t a = 0; a < 3; ++a) {
      lo[a] = std::min(lo[a], p[a]);
      hi[a] = std::max(hi[a], p[a]);
    }
  }
  double most = 0;
  for (int c = 0; c < 8; ++c) {
    const Vec3 p{(c & 1) != 0 ? hi.x : lo.x, (c & 2) != 0 ? hi.y : lo.y, (c & 4) != 0 ? hi.z : lo.z};
    most = std::max(most, length(back(there(p)) - p));
  }
  return most;
}

std::string mm(double v) {
  return format_number(std::round(v * 100) / 100) + " mm";
}

double coarsest_mm(const Frame& f) {
  return std::max({f.spacing_mm.x, f.spacing_mm.y, f.spacing_mm.z});
}

// What a tenth of all edges may be off without a word.
double many_off_mm(const RegisterParams& p, const Frame& first, const Frame& second) {
  const double own = kManyOffOfSpacing * std::max({coarsest_mm(first), coarsest_mm(second), p.finest_mm});
  return std::min(kManyOff * p.max_residual_mm, std::max(kManyOffLeastMm, own));
}

enum class Mirror { worse, unknown, better };

// Whether the second scan fits better in a mirror: by half of all edges, or by the field of where they lie off.
Mirror verdict_of(const Registration& r) {
  if (!r.mirror_tried || r.mirror.points < kMinEdges) return Mirror::worse;
  const double median = r.mirror.median_mm / std::max(r.residual.median_mm, 1e-9);
  const auto with_noise = [](double mm) { return portable::hypot(mm, kSidesNoiseMm); };
  const double sides = r.sides_known ? with_noise(r.mirror_sides_mm) / with_noise(r.sides_mm) : 1;
  if (median < kMirrorBetter && r.mirror.p90_mm < kMirrorBetterP90 * r.residual.p90_mm && sides < kSidesClear)
    return Mirror::better;
  if (sides < 1 / kSidesClear && median < kMedianAgainst) return Mirror::better;
  if (sides > kSidesClear && median > 1 / kMedianAgainst) return Mirror::worse;
  return median >= kMirrorAlike && sides > 1 / kSidesClear ? Mirror::worse : Mirror::unknown;
}

// Empty when the two belong together.
std::string doubt(const Registration& r, const RegisterParams& p) {
  if (r.overlap < kMinOverlap)
    return "only " + std::to_string(static_cast<int>(std::lround(100 * r.overlap))) +
           " % of the smaller scan lies inside the other";
  if (r.residual.points < kMinEdges)
    return "both scans show only " + std::to_string(r.residual.points) +
           " points of an edge in the same place: too little to go by";
  if (verdict_of(r) == Mirror::better)
    return "the second scan fits better in a mirror, with left and right exchanged: half of all edges then meet to " +
           mm(r.mirror.median_mm) + " instead of " + mm(r.residual.median_mm) +
           "; one of the two files is mirrored, or shows the other side";
  if (r.residual.median_mm > p.max_residual_mm)
    return "at half of all edges the other scan's edge is " + mm(r.residual.median_mm) +
           " off or missing, allowed are " + mm(p.max_residual_mm) +
           ": another patient, the other side, or a body that has changed its shape";
  if (r.inverse_mm > kMaxInverseMm)
    return "registered back by itself, a corner of the region ends up " + mm(r.inverse_mm) +
           " from where it began: there is no one best place";
  return {};
}

// Two scans, and which of them gives the points: those of the smaller find all their partners in the larger.
struct Scans {
  const reg::Levels &first, &second;
  bool swapped = false;

  [[nodiscard]] const reg::Levels& from() const { return swapped ? second : first; }
  [[nodiscard]] const reg::Levels& to() const { return swapped ? first : second; }
  /// Between a match's transform and that from the first to the second.
  [[nodiscard]] RigidTransform turned(const RigidTransform& t) const { return swapped ? t.inverse() : t; }
  [[nodiscard]] std::vector<RigidTransform> anywhere(const Context& context) const {
    return reg::anywhere(from(), to(), context);
  }
  [[nodiscard]] reg::Match search(std::size_t stop, const Context& context) const {
    return reg::search(from(), to(), anywhere(context), {}, stop, context);
  }
  /// The best of the starts. Nothing where they lead to the place that is known, of the second from the first.
  [[nodiscard]] std::optional<reg::Match> search_elsewhere(const std::vector<RigidTransform>& starts,
                                                           const reg::SearchWidth& width, const RigidTransform& known,
                                                           std::size_t stop, const Context& context) const {
    const std::size_t near = std::min({stop + 1, first.levels.size() - 1, second.levels.size() - 1});
    const reg::Match m = reg::search(from(), to(), starts, width, near, context);
    const Frame& f = from().levels.front().frame;
    double apart = 0;
    for (int c = 0; c < 8; ++c) {
      const Vec3 q = f.world_from_index(
          {(c & 1) * (f.dims[0] - 1.0), (c >> 1 & 1) * (f.dims[1] - 1.0), (c >> 2) * (f.dims[2] - 1.0)});
      apart = std::max(apart, length(m.to_from(q) - turned(known)(q)));
    }
    if (apart < 0.5 * to().levels[near].frame.spacing_mm.x) return std::nullopt;
    reg::Match finer = near > stop ? reg::refine(from(), to(), m.to_from, stop, context) : m;
    finer.overlap = m.overlap;  // of points anywhere
    return finer;
  }
};

// Where the second scan lies on the first, and where it lies with left and right exchanged.
class Placing {
 public:
  Placing(const Image& first, const Image& second, const RegisterParams& p, const Context& context)
      : first_(first),
        second_(second),
        p_(p),
        context_(context),
        finest_mm_(reg::finest_of(first.frame, second.frame, p.finest_mm)),
        a_(reg::make_levels(first, finest_mm_, context)),
        b_(reg::make_levels(second, finest_mm_, context)),
        scans_{a_, b_, extent_mm3(second.frame) < extent_mm3(first.frame)},
        // Surfaces need a guess to a few mm.
        stop_(p.method == RegisterMethod::surface ? std::min<std::size_t>(1, a_.levels.size() - 1) : 0) {
    context.progress(0.1, "search");
    best_ = placed(scans_.search(stop_, context.sub(0.1, 0.6)), context.sub(0.6, 0.92));
    if (best_.overlap >= kMinOverlap &&
        (best_.residual.median_mm > kDoubtMm || best_.residual.p90_mm > many_off_mm(p, first.frame, second.frame)))
      look_in_mirror();
  }

  [[nodiscard]] const Registration& best() const { return best_; }
  [[nodiscard]] double finest_mm() const { return finest_mm_; }

 private:
  using Starts = std::vector<RigidTransform>;

  [[nodiscard]] Registration placed(const reg::Match& match, const Context& within) {
    Registration r;
    r.overlap = match.overlap;
    r.second_from_first = scans_.turned(match.to_from);
    if (r.overlap >= kMinOverlap) {
      const RigidTransform back =
          p_.method == RegisterMethod::surface ? onto_surfaces(r, within) : by_values(r, match, within);
      r.inverse_mm = there_and_back(r.second_from_first, back, first_.frame, second_.frame);
    }
    r.residual = residual_of(b_, r.second_from_first, fine_ ? &fine_->second : nullptr);
    return r;
  }

  // These change the transform and return the one back, from the second to the first, that is found by itself.
  [[nodiscard]] RigidTransform onto_surfaces(Registration& r, const Context& within) {
    if (!bone_) {
      bone_ = reg::bone_surface_of(first_, p_.bone_hu, "first", context_);
      other_bone_ = reg::bone_surface_of(second_, p_.bone_hu, "second", context_);
    }
    const reg::SurfaceFit there = reg::fit_surfaces(*bone_, *other_bone_, r.second_from_first, context_);
    r.second_from_first = there.second_from_first;
    r.surface_mean_mm = there.mean_mm;
    r.surface_p95_mm = there.p95_mm;
    r.surface_shape_mm = there.shape_mean_mm;
    r.boundary_shift_mm = there.boundary_shift_mm;
    within.progress(0.5, "and back");
    return reg::fit_surfaces(*other_bone_, *bone_, r.second_from_first.inverse(), context_).second_from_first;
  }
  [[nodiscard]] RigidTransform by_values(Registration& r, const reg::Match& match, const Context& within) const {
    // Between scans of one kind mutual information is the more exact; a coil's shading pulls it.
    const bool unlike = reg::likeness(scans_.from(), scans_.to(), match.to_from, context_) < kLike;
    if (unlike) r.second_from_first = reg::fit_edges(a_, b_, r.second_from_first, context_);
    within.progress(0.5, "and back");
    // Two levels up, where there is more than one place to fall into.
    RigidTransform back = reg::refine(scans_.to(), scans_.from(), match.to_from.inverse(), 2, context_).to_from;
    back = scans_.turned(back);
    return unlike ? reg::fit_edges(b_, a_, back, context_) : back;
  }

  [[nodiscard]] EdgeResidual residual_of(const reg::Levels& second, const RigidTransform& second_from_first,
                                         const reg::Levels* fine) const {
    return reg::edge_residual(fine != nullptr ? fine_->first : a_, fine != nullptr ? *fine : second, second_from_first,
                              context_);
  }

  void look_in_mirror() {
    context_.progress(0.92, "in a mirror");
    const Context within = context_.sub(0.92, 0.99);
    const reg::Mirrored mirrored = reg::in_a_mirror(second_);
    reflection_ = mirrored.reflection;
    c_ = reg::make_levels(mirrored.image, finest_mm_, context_);
    // Where edges lie between coarse voxels depends on how the voxels lie, and those of a mirror image lie otherwise.
    const double fine_mm = reg::finest_of(first_.frame, second_.frame, std::min(finest_mm_, kJudgedMm));
    if (fine_mm < finest_mm_) {
      fine_ = Fine{reg::make_levels(first_, fine_mm, context_), reg::make_levels(second_, fine_mm, context_),
                   reg::make_levels(mirrored.image, fine_mm, context_)};
      best_.residual = residual_of(b_, best_.second_from_first, &fine_->second);
    }
    const Scans in_mirror{a_, *c_, scans_.swapped};
    mirror_ = in_mirror.turned(in_mirror.search(0, within).to_from);
    mirror_residual_ = residual_of(*c_, mirror_, fine_ ? &fine_->mirrored : nullptr);
    each_from_the_other(within);
    if (poor()) {
      // Other points, and more of the best of each level.
      Context others = within;
      ++others.seed;
      const bool one = better_placed(scans_.anywhere(others), kWide, others),
                 other = better_mirror(in_mirror.anywhere(others), kWide, others);
      if (one || other) each_from_the_other(within);
    }
    best_.mirror_tried = true;
    best_.mirror = mirror_residual_;
    const reg::Unevenness sides =
        reg::unevenness(fine_ ? fine_->first : a_, fine_ ? fine_->second : b_, best_.second_from_first,
                        fine_ ? fine_->mirrored : *c_, mirror_, reflection_, context_);
    best_.sides_known = sides.known;
    best_.sides_mm = sides.straight_mm;
    best_.mirror_sides_mm = sides.mirrored_mm;
  }

  // Farther off than scans of one head are at such voxels.
  [[nodiscard]] bool poor() const {
    const double own = kPoorOfSpacing * std::max({coarsest_mm(first_.frame), coarsest_mm(second_.frame), finest_mm_});
    return best_.residual.median_mm > std::min(p_.max_residual_mm, own);
  }

  // A search can end in a poor minimum. Whichever fits worse starts again from where the other lies, until that changes
  // nothing.
  void each_from_the_other(const Context& within) {
    for (int round = 0; round < 4; ++round) {
      const bool mirror_worse = mirror_residual_.median_mm > best_.residual.median_mm;
      Starts starts = reg::starts_from_mirror(mirror_worse ? best_.second_from_first : mirror_, reflection_,
                                              first_.frame.centre_mm());
      for (RigidTransform& t : starts) t = scans_.turned(t);
      if (!(mirror_worse ? better_mirror(starts, kFromMirror, within) : better_placed(starts, kFromMirror, within)))
        return;
    }
  }

  // Whether it lies elsewhere and is better there.
  [[nodiscard]] bool better_placed(const Starts& starts, const reg::SearchWidth& width, const Context& within) {
    const auto found = scans_.search_elsewhere(starts, width, best_.second_from_first, stop_, within);
    if (!found || found->overlap < kMinOverlap) return false;
    const Registration again = placed(*found, within);
    if (!better(again.residual, best_.residual)) return false;
    best_ = again;
    return true;
  }
  [[nodiscard]] bool better_mirror(const Starts& starts, const reg::SearchWidth& width, const Context& within) {
    const Scans in_mirror{a_, *c_, scans_.swapped};
    const auto found = in_mirror.search_elsewhere(starts, width, mirror_, 0, within);
    if (!found || found->overlap < kMinOverlap) return false;
    const RigidTransform again = in_mirror.turned(found->to_from);
    const EdgeResidual residual = residual_of(*c_, again, fine_ ? &fine_->mirrored : nullptr);
    if (!better(residual, mirror_residual_)) return false;
    mirror_ = again;
    mirror_residual_ = residual;
    return true;
  }
  static bool better(const EdgeResidual& now, const EdgeResidual& before) {
    return now.points >= kMinEdges && now.median_mm < kBetter * before.median_mm;
  }

  const Image &first_, &second_;
  const RegisterParams& p_;
  const Context& context_;
  double finest_mm_;
  reg::Levels a_, b_;
  std::optional<reg::Levels> c_;  // the second in a mirror
  struct Fine {
    reg::Levels first, second, mirrored;
  };
  std::optional<Fine> fine_;  // where the search was on coarser voxels than the scans have
  Scans scans_;
  std::size_t stop_;
  std::optional<reg::BoneOf> bone_, other_bone_;
  Registration best_;
  RigidTransform reflection_, mirror_;
  EdgeResidual mirror_residual_;
};

}  // namespace

EdgeResidual edge_residual(const Image& first, const Image& second, const RigidTransform& second_from_first,
                           const Context& context) {
  const double h = reg::finest_of(first.frame, second.frame, 1);
  return reg::edge_residual(reg::make_levels(first, h, context), reg::make_levels(second, h, context),
                            second_from_first, context);
}

Registration register_scans(const Image& first, const Image& second, const RegisterParams& p, const Context& context) {
  const Placing placing(first, second, p, context);
  Registration r = placing.best();
  const bool by_surface = p.method == RegisterMethod::surface;
  const Mat3& m = r.second_from_first.rotation;
  const double trace = m.column[0].x + m.column[1].y + m.column[2].z;
  r.rotation_deg = portable::acos(std::clamp((trace - 1) / 2, -1.0, 1.0)) * 180 / std::numbers::pi;
  r.shift_mm = length(r.second_from_first(first.frame.centre_mm()) - first.frame.centre_mm());

  context.report("finest_mm", placing.finest_mm());
  context.report("overlap_percent", 100 * r.overlap);
  context.report("edge_points", static_cast<std::int64_t>(r.residual.points));
  context.report("edges_found_percent", 100 * r.residual.found);
  context.report("edge_residual_median_mm", r.residual.median_mm);
  context.report("edge_residual_p90_mm", r.residual.p90_mm);
  context.report("edge_shift_mm", r.residual.shift_mm);
  if (r.mirror_tried) context.report("mirror_residual_median_mm", r.mirror.median_mm);
  if (r.sides_known) {
    context.report("sides_mm", r.sides_mm);
    context.report("mirror_sides_mm", r.mirror_sides_mm);
  }
  context.report("inverse_consistency_mm", r.inverse_mm);
  if (by_surface) {
    context.report("surface_mean_mm", r.surface_mean_mm);
    context.report("surface_p95_mm", r.surface_p95_mm);
    context.report("surface_shape_mean_mm", r.surface_shape_mm);
    context.report("boundary_shift_mm", r.boundary_shift_mm);
  }
  context.report("rotation_deg", r.rotation_deg);
  context.report("shift_at_centre_mm", r.shift_mm);
  if (r.residual.p90_mm > many_off_mm(p, first.frame, second.frame)) {
    context.warn("at a tenth of all edges the other scan's edge is " + mm(r.residual.p90_mm) +
                 " off or missing: drilled, swollen, a jaw or neck that moved, thick slices, or another patient; look "
                 "at --checkerboard-out");
  }
  const std::string why = doubt(r, p);
  if (why.empty() && verdict_of(r) == Mirror::unknown)
    context.warn("in a mirror, with left and right exchanged, the second scan fits as well (" + mm(r.mirror.median_mm) +
                 "): these scans do not show whether one of the files is mirrored");
  if (!why.empty()) {
    if (!p.accept_poor)
      throw Error(
          ExitCode::failed, "the scans cannot be registered: " + why,
          "look whether both are of the same patient and region; --accept-poor writes the transform all the same");
    context.warn("accepted as asked: " + why);
  }
  context.progress(1.0);
  return r;
}

}  // namespace osteo::inline imaging
